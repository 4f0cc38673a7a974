#!/usr/bin/env python3
"""Loose sand that others measured beside loose grains (docs/real-sand.md, "Loose grains"): how the pressure under a disc grows with its
size and its depth.

    PYTHONPATH=build/python .venv/bin/python scripts/loose_grains.py        # 3 s
    ... scripts/loose_grains.py --figure loose-grains.png
    grains/run.py --only '^(loose|medium)' --gpus 0                         # makes the records that are not there

p ~ D^a u^n near a depth; a from all discs at that depth, n from each disc between half of it and twice of it. Where nothing but the
weight of the grains bears, p = gamma D f(u/D) and a + n = 1."""
import argparse
import math
import pathlib
import sys

import mild
import numpy as np

import judge_cases
import judge_loose
import real_sand
from judge import ROOT, Records

DEPTH = 0.010  # [m]
WAY = 0.020    # [m] over which models are fitted
MODELS = ("mild", "bekker", "mild_merged")
FITTED = "disc80"


def pressures(trials, size, depths):
    """[Pa] (trials, depths); nan where a trial did not go so deep."""
    return np.array([np.interp(depths, *trial, right=math.nan) for trial in trials]) / (math.pi * size**2 / 4)


def exponents(discs):
    """Rows (a, n), each of one trial of every disc."""
    found, sizes = [], np.log([real_sand.DISCS[name] for name in discs])
    for trials in zip(*discs.values()):
        at = np.array([pressures([trial], real_sand.DISCS[name], [DEPTH / 2, DEPTH, 2 * DEPTH])[0] for name, trial in zip(discs, trials)])
        growth = np.log(at[:, 2] / at[:, 0]) / math.log(4)  # nan of a disc that did not go so deep
        found.append([np.polyfit(sizes, np.log(at[:, 1]), 1)[0], np.nanmean(growth)])
    return np.array(found)


def print_growth(name, discs, note):
    both = exponents(discs)
    (a, n), (a_noise, n_noise) = both.mean(0), both.std(0, ddof=1)
    cells = "".join(f"{1e-3 * pressures(trials, real_sand.DISCS[disc], [z]).mean():8.2f}" for z in (DEPTH / 2, DEPTH, 2 * DEPTH)
                    for disc, trials in discs.items())
    print(f"{name:14}{note:22}{cells}{a:9.2f} +-{a_noise:5.2f}{n:9.2f} +-{n_noise:5.2f}{a + n:8.2f}")


def print_models(name, discs, edge):
    """Errors of the force over the deepest 40 % of WAY, fitted to one disc. edge: [m] by which discs count as wider."""
    soles = {disc: judge_cases.Sole(f"disc:{real_sand.DISCS[disc]}", 0.001, edge) for disc in discs}
    depths = np.arange(0.0005, WAY, 0.0005)
    forces = {disc: np.nanmean([np.interp(depths, *trial, right=math.nan) for trial in trials], 0) for disc, trials in discs.items()}
    deep = depths > 0.6 * WAY

    def error(got, disc):
        there = deep & np.isfinite(forces[disc])
        return 100 * (got[there].mean() / forces[disc][there].mean() - 1)

    for model in MODELS:
        plates = {disc: mild.Sole(sole.outline, 0.005) for disc, sole in soles.items()}
        fit = mild.GroundFit([plates[FITTED]], model, hold={"alpha": 0.3} if model != "bekker" else None)
        fit.fit([depths[:, None]], [forces[FITTED]])
        cells = []
        for disc, plate in plates.items():
            got = fit.set_params(plate=[plate]).predict([depths[:, None]])[0]
            cells.append(f"{error(got, disc):+9.0f}")
        print(f"{name:14}{model:14}" + "".join(cells))
    heap = judge_loose.LooseHeap().fit_presses([soles[FITTED]], [depths], [forces[FITTED]])
    cells = [heap.bears * (sole.area * judge_loose.free_edge(sole, 1.0, 0)).sum() * depths**heap.power for sole in soles.values()]
    print(f"{name:14}{'loose_heap':14}" + "".join(f"{error(got, disc):+9.0f}"
                                                 for disc, got in zip(soles, cells)) + f"    n {heap.power:.2f}")


def draw(real, beds, records, path):
    """Pressure over depth under the three discs: in the sand, and above floors."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    shown = {"the real sand": real} | {f"grains, floor at {1e3 * np.mean(records.manifest[family]['surface_m']):.0f} mm": beds[family]
                                       for family in ("loose_thinner", "loose_thin", "loose", "loose_thick") if family in beds}
    figure, panels = plt.subplots(1, len(shown), figsize=(13, 3.6), sharey=True)
    for axes, (title, discs) in zip(panels, shown.items()):
        for colour, (disc, trials) in zip(("tab:orange", "tab:green", "tab:blue"), discs.items()):
            area = math.pi * real_sand.DISCS[disc]**2 / 4
            for k, (depth, force) in enumerate(trials):
                axes.plot(1e3 * depth, 1e-3 * force / area, color=colour, lw=1, label=None if k else f"{disc[4:]} mm")
        axes.set(title=title, xlabel="depth [mm]", xlim=(0, 22), ylim=(0, 50))
        axes.grid(alpha=0.3)
    panels[0].set_ylabel("mean pressure [kPa]")
    panels[0].legend(title="disc")
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--records", default=ROOT / "grains" / "records", type=pathlib.Path)
    parser.add_argument("--figure", type=pathlib.Path, help="draw the curves into this file")
    args = parser.parse_args()
    records = Records(args.records)
    real = {name: trials for name, trials in real_sand.presses().items() if name in real_sand.DISCS}
    beds = {}
    for family in ("medium", "loose_thick", "loose", "loose_thin", "loose_thinner"):
        cases = {name: records.cases[f"{family}/{name}"][1] for name in real_sand.DISCS if f"{family}/{name}" in records.cases}
        if len(cases) < len(real_sand.DISCS):
            print(f"loose_grains.py: {family}: no records; make them with grains/run.py", file=sys.stderr)
            continue
        beds[family] = {name: [np.array([rows["depth"], rows["fz"]]) for rows in trials] for name, trials in cases.items()}
    deeps = "".join(f"{f'{1e3 * z:.0f} mm deep':>24}" for z in (DEPTH / 2, DEPTH, 2 * DEPTH))
    if args.figure:
        draw(real, beds, records, args.figure)
        return
    head = 3 * "".join(f"{disc[4:]:>8}" for disc in real_sand.DISCS)
    print(f"pressure [kPa] under discs of 60 to 100 mm\n{'':36}{deeps}\n{'':36}{head}{'a':>9}{'n':>17}{'a + n':>16}")
    print_growth("real sand", real, "0.50 solid")
    for family, discs in beds.items():
        bed = records.manifest[family]
        print_growth(family, discs, f"{np.mean(bed['solid']):.3f} solid, {1e3 * np.mean(bed['surface_m']):.0f} mm")
    print(f"\nfitted to {FITTED}: error of the force over the deepest 40 % of {1e3 * WAY:.0f} mm [%]\n{'':28}" + "".join(f"{disc:>9}" for disc in real_sand.DISCS))
    print_models("real sand", real, 0.0)
    for family, discs in beds.items():
        print_models(family, discs, records.edge(family))


if __name__ == "__main__":
    main()
