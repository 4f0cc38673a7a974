#!/usr/bin/env python3
"""Where under a plate and a ball grains press (docs/grains.md, "Pressure"), beside mild_merged, which is fitted to forces alone.

    PYTHONPATH=build/python .venv/bin/python scripts/judge_pressure.py out/pressure --commands | bash       # 140 s of an H200
    PYTHONPATH=build/python .venv/bin/python scripts/judge_pressure.py out/pressure                         # 10 s

Reads FOLDER/FAMILY/NAME-SEED-bands.csv (grains --bands): the force up on grains by their distance from the edge of what their centres
meet, of a ball from its middle. Pressure is that force over the level area of the band, mean over the deepest 40 % of the way. The
`reach` of a ball's load is where a cone of pressure with the same mean distance ends, by the radius b in which the ball meets level
ground."""
import argparse
import math
import pathlib
import sys

import numpy as np

from judge import Records
from judge_ball import rim
from judge_cases import Case, Sole, measures
from judge_entries import GroundEntry
from judge_tilt import ELEMENT, MODEL, ROOT, deep, fitted_law, outline_distance

# family: (options of its beds, width of a band [m], cases)
CASES = {
    "sand": ("--seeds 1-8 --box 0.45,0.35,0.12 --grain 0.005 --friction 0.5", 0.0025,
             ("disc120 disc:0.12 0 press:0.025@0.05", "square100 rect:0.1,0.1 0 press:0.025@0.05", "ball200-12 sphere:0.1 0 press:0.012@0.05",
              "ball200-24 sphere:0.1 0 press:0.024@0.05", "ball240 sphere:0.12 0 press:0.018@0.05")),
    "fine": ("--seeds 1-4 --box 0.33,0.28,0.08 --grain 0.0025 --friction 0.5 --settle 0.4", 0.00125,
             ("disc60 disc:0.06 0 press:0.02@0.05", "ball120-10 sphere:0.06 0 press:0.01@0.05", "ball120-20 sphere:0.06 0 press:0.02@0.05")),
}
WIDE = 4  # bands of a row
SQUARE = 0.001  # [m]


def fail(text):
    print(f"judge_pressure.py: {text}", file=sys.stderr)
    sys.exit(2)


def commands(folder):
    for family, (options, width, cases) in CASES.items():
        print(f"mkdir -p {folder}/{family} && build/grains/grains {options} --bands {width:g} --out {folder}/{family} "
              + " ".join(f"--case '{case}'" for case in cases))


def bands(folder, family, case):
    """[beds][bands] Force up [N], and the mean depth [m]."""
    found, depths = [], []
    for path in sorted((folder / family).glob(f"{case.name}-*-bands.csv")):
        rows = np.array([[float(word) for word in line.split(",")] for line in path.read_text(encoding="utf-8").split("\n")[1:] if line])
        part = deep(case, rows[:, 1])
        found.append(rows[part, 3:].mean(0))
        depths.append(rows[part, 1].mean())
    if not found:
        fail(f"{folder / family}: no {case.name}-*-bands.csv; --commands says how they are made")
    return np.array(found), np.mean(depths)


def law_at(material, sole, depth):
    """Distance [m] as in the bands, area [m^2] and pressure [Pa] of mild_merged in squares of a level sole."""
    k0, kappa, slope = material.k_pen / ELEMENT**2, material.sigma_cone / math.cos(material.alpha), math.tan(material.alpha) / material.nu
    if sole.radius:
        _, d, e, inside, _ = rim(sole, depth, True)
        return np.hypot(sole.x, sole.y), sole.area, np.where(inside, kappa * np.maximum(d, slope * e) + (k0 - kappa) * slope * e, 0)
    free = outline_distance(sole)
    return free, sole.area, kappa * depth + (k0 - kappa) * np.minimum(depth, free * slope)


def print_case(records, folder, family, line, width):
    case = Case(line, records.edge(family))
    up, depth = bands(folder, family, case)
    material = fitted_law(records, family)
    sole = Sole(line.split()[1], SQUARE, records.edge(family))
    far, area, pressure = law_at(material, sole, depth)
    entry = GroundEntry(MODEL, material, pitch=records.ground(family)["grain"])
    force = measures(case, entry.play(case))["force"]
    middle = (np.arange(up.shape[1]) + 0.5) * width
    head = f"{family}/{case.name}: {up.sum(1).mean():.2f} +- {up.sum(1).std(ddof=1):.2f} N at {1e3 * depth:.1f} mm, {MODEL} {100 * (force / up.sum(1).mean() - 1):+.0f} %"
    if sole.radius:
        b = math.sqrt(2 * sole.radius * depth - depth**2)
        reach = 2 * (up * middle).sum(1) / up.sum(1)
        head += f"; b {1e3 * b:.1f} mm, reach {reach.mean() / b:.2f} +- {reach.std(ddof=1) / b:.2f}"
    print(head + f"\n{'distance [mm]':>16}{'grains [kPa]':>16}{MODEL:>14}")
    for k in range(0, up.shape[1] - 1 - WIDE, WIDE):
        ring = np.floor(far / (WIDE * width)) == k / WIDE
        if sole.radius:
            size = math.pi * width**2 * ((k + WIDE)**2 - k**2)
        else:
            size = area[ring].sum()
        found = up[:, k:k + WIDE].sum(1) / max(size, 1e-9) / 1e3
        if found.mean() < 0.01 or size < 9 * width**2:
            break
        print(f"{1e3 * k * width:8.1f} to {1e3 * (k + WIDE) * width:4.1f}{found.mean():8.2f} +- {found.std(ddof=1):.2f}"
              f"{(area * pressure)[ring].sum() / size / 1e3:14.2f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--records", default=ROOT / "grains" / "records", type=pathlib.Path)
    parser.add_argument("--commands", action="store_true", help="print what makes the folder, and end")
    args = parser.parse_args()
    if args.commands:
        commands(args.folder)
        return
    records = Records(args.records)
    for family, (_, width, cases) in CASES.items():
        for line in cases:
            print_case(records, args.folder, family, line, width)


if __name__ == "__main__":
    main()
