#!/usr/bin/env python3
"""The same walks with and without what a robot does by its belief (docs/identify.md, "Effect on walking"): falls that one of the two
alone has, and of walks that stood in both the difference of the speed's error and of the cost of transport, with 95 % intervals.

    mild know --changes 1 --speed 0.7,1.2 --slick 0.2,0.25 --seed 41 --json without.json
    mild know --changes 1 --speed 0.7,1.2 --slick 0.2,0.25 --seed 41 --care 0.3,0.4 --json with.json
    scripts/know_pair.py without.json with.json          # several of each: first all without, then all with, as many"""
import json
import math
import sys

import numpy as np


def rows_of(file):
    try:
        with open(file, encoding="utf-8") as text:
            return json.load(text)["walks"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        return sys.exit(f"know_pair.py: {file} is no file of mild know --json: {error!r}")


def walks(files):
    rows = [row for file in files for row in rows_of(file)]
    number = {name: np.array([np.nan if row[name] is None else row[name] for row in rows], float) for name in ("fell", "asked", "speed", "cost")}
    return {**number, "error": np.abs(number["speed"] - number["asked"])}


def chance(one, other):
    """How often a fair coin parts so many walks at least so unevenly."""
    n, k = one + other, min(one, other)
    return min(1.0, 2 * sum(math.comb(n, i) for i in range(k + 1)) / 2**n)


def main(files):
    if len(files) < 2 or len(files) % 2:
        sys.exit("know_pair.py: as many files without as with, each of mild know --json")
    without, given = walks(files[:len(files) // 2]), walks(files[len(files) // 2:])
    if len(without["fell"]) != len(given["fell"]) or np.any(without["asked"] != given["asked"]):
        sys.exit("know_pair.py: the files are not of the same walks")
    fell, falls = without["fell"] > 0, given["fell"] > 0
    saved, lost, n = int((fell & ~falls).sum()), int((~fell & falls).sum()), len(fell)
    part, spread = (saved - lost) / n, math.sqrt(saved + lost - (saved - lost)**2 / n) / n
    print(f"{n} walks, fell {fell.sum()} without, {falls.sum()} with: {saved} saved, {lost} lost; {100 * part:.1f} +- {196 * spread:.1f} % of all walks saved; "
          f"by chance in {chance(saved, lost):.2g} of such comparisons")
    both = ~fell & ~falls & np.isfinite(without["cost"]) & np.isfinite(given["cost"])
    for name, a, b in (("error of the speed [m/s]", without["error"], given["error"]), ("log of the cost of transport", np.log(without["cost"]), np.log(given["cost"]))):
        change = (b - a)[both]
        print(f"{both.sum()} stood in both, {name}: {change.mean():+.4f} +- {1.96 * change.std(ddof=1) / math.sqrt(len(change)):.4f}")


if __name__ == "__main__":
    main(sys.argv[1:])
