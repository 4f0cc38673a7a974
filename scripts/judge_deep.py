#!/usr/bin/env python3
"""What is short where a square slides under load 20 to 120 mm deep on merged cones (docs/grains.md): depth gained [mm] in grains,
by the law, and with one thing changed at a time. Nothing is fitted.

    PYTHONPATH=build/python .venv/bin/python scripts/judge_deep.py

    over it        ground over the block, which is 60 mm high, as it sinks under it: full height above the top, less that at first
    falls in       the same, from nothing to the full height in 15 mm of slip: the most that can come"""
import argparse
import pathlib

import numpy as np

import mild
from judge import FITS, Records, mean_rows
from judge_cases import measures
from judge_entries import REGAIN, STEP, GroundEntry, ground_step

ROOT = pathlib.Path(__file__).resolve().parent.parent
CASES = ("load20", "load40", "load80", "load80-tall", "load120")
BLOCK, FALLS = 0.06, 0.015  # [m] height; slip in which ground falls in


def sunk(entry, material, case, cover=None):
    """[mm] gained under load; cover(depth at first, depth, slip): [N] ground over the sole."""
    ground = mild.Ground([entry.sole(case)], material, dt=STEP, tiles=0)
    pose, force, first = np.array([0, -case.start, case.tilt]), 0.0, 0.0
    for kind, seconds, vx, vz, rate, _ in case.ways:
        mass, first = force / 9.81 if kind == "load" else 0.0, -pose[1]
        steps, speed = max(1, round(seconds / STEP)), np.array([vx, vz, rate])
        ground_step(ground, None, mass, seconds / steps)
        for _ in range(steps):
            over = cover(first, -pose[1], pose[0]) / mass if cover and mass else 0.0
            moved = pose + seconds / steps * ground_step(ground, (pose, speed - [0, over * seconds / steps, 0]), mass, seconds / steps)
            speed, pose = (moved - pose) / (seconds / steps), moved
            force = ground.force[0, 2]
    return 1e3 * (-pose[1] - first)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--records", default=ROOT / "grains" / "records", type=pathlib.Path)
    records, entry = Records(parser.parse_args().records), GroundEntry("mild_merged")
    entry.fit({f"sand/{name}": (records.cases[f"sand/{name}"][0], mean_rows(records.cases[f"sand/{name}"][1])) for name in FITS["sand"][0]},
              records.ground("sand"))
    cases = [records.cases[f"deep/square100-{name}"] for name in CASES]
    weight, m = 0.1 * 0.1 * 9.81 * 2500 * float(np.mean(records.ground("deep")["solid"])), entry.material
    print(f"{'sunk [mm]':18}" + "".join(f"{name:>13}" for name in CASES))
    print(f"{'grains':18}" + "".join(f"{np.mean(x):7.1f} +-{np.std(x, ddof=1):4.1f}" for x in (
        [measures(case, rows)["sinkage"] for rows in beds] for case, beds in cases)))
    rows = {"law": (m, None), "forces by 1.11": (mild.Material(m, k_pen=1.11 * m.k_pen, sigma_cone=1.11 * m.sigma_cone), None),
            "over it": (m, lambda first, depth, slip: weight * max(max(depth - BLOCK, 0) - max(first - BLOCK, 0), 0)),
            "falls in": (m, lambda first, depth, slip: weight * max(depth - BLOCK, 0) * min(slip / FALLS, 1))}
    rows |= {f"slip_growth {g}": (mild.Material(m, slip_growth=g), None) for g in (0, 0.04, 0.1)}
    rows |= {f"regain/slip {r}": (mild.Material(m, regain_length=r * m.slip_length), None) for r in (0.2, 0.24, REGAIN, 0.32, 0.44, 0.48, 0.5)}
    for name, (material, cover) in rows.items():
        print(f"{name:18}" + "".join(f"{sunk(entry, material, case, cover):13.1f}" for case, _ in cases))


if __name__ == "__main__":
    main()
