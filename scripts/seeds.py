#!/usr/bin/env python3
"""Draws learning curves of several seeds: the mean of each group and the range of its runs.

  scripts/seeds.py PICTURE.png NAME=LOG.csv[,LOG.csv] [NAME=...] [--columns episode/reward,episode/length_s]

LOG.csv is the log of a training run. Prints the mean over the last tenth of each run."""
import argparse
import csv
import sys

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


def read(path, names):
    """Steps and columns of a log."""
    try:
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        return [float(row["rate/steps"]) for row in rows], [[float(row[name]) for row in rows] for name in names]
    except (OSError, KeyError, ValueError) as problem:
        sys.exit(f"{path}: not the log of a training run with {', '.join(names)}: {problem}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("picture")
    parser.add_argument("groups", nargs="+", metavar="NAME=LOG.csv[,LOG.csv]")
    parser.add_argument("--columns", default="episode/reward,episode/length_s,episode/speed_error")
    given = parser.parse_args()
    names = given.columns.split(",")
    figure, axes = plt.subplots(1, len(names), figsize=(4.5 * len(names), 3.6), layout="constrained", squeeze=False)
    for group in given.groups:
        label, _, paths = group.partition("=")
        runs = [read(path, names) for path in paths.split(",")]
        length = min(len(steps) for steps, _ in runs)
        millions = [x / 1e6 for x in runs[0][0][:length]]
        for i, (name, each) in enumerate(zip(names, axes[0])):
            curves = [columns[i][:length] for _, columns in runs]
            low, high, middle = (f(curves, axis=0) for f in (np.nanmin, np.nanmax, np.nanmean))
            line = each.plot(millions, middle, label=f"{label}, {len(runs)} seeds")
            each.fill_between(millions, low, high, alpha=0.25, color=line[0].get_color())
            each.set(xlabel="policy steps [million]", title=name)
            each.spines[["top", "right"]].set_visible(False)
            tail = max(1, length // 10)
            print(f"{name:24} {label:12}", " ".join(f"{np.nanmean(curve[-tail:]):.4g}" for curve in curves))
    axes[0][-1].legend(frameon=False)
    figure.savefig(given.picture, dpi=120)


if __name__ == "__main__":
    main()
