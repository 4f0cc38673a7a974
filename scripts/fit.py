#!/usr/bin/env python3
"""Draws the result of `mild fit --figure`: fit.py DATA_fit.csv PICTURE.png

Top: measured forces and the fitted law over depth. Bottom: the residuals."""
import csv
import sys
from collections import OrderedDict

try:
    import matplotlib
except ImportError:
    sys.exit(1)  # the program says what is missing

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


def read(path):
    """{record: [row, ...]} in the file's order; numbers in SI units."""
    records = OrderedDict()
    with open(path, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            records.setdefault(row["record"], []).append({key: float(value) for key, value in row.items()})
    return records


def draw(records, path):
    figure, (above, below) = plt.subplots(
        2, 1, sharex=True, figsize=(7, 6), height_ratios=(3, 1), layout="constrained"
    )
    for index, (record, rows) in enumerate(records.items()):
        depth = [1e3 * row["depth_m"] for row in rows]
        speed = sorted(row["speed_m_s"] for row in rows)
        label = f"record {record}"
        if speed[-1] > 0:
            constant = speed[-1] < 1.3 * speed[0]
            label += f", {speed[len(speed) // 2]:.3g} m/s" if constant else f", {speed[0]:.2g} to {speed[-1]:.2g} m/s"
        color = f"C{index}"
        above.plot(depth, [row["force_n"] for row in rows], ".", color=color, markersize=6, alpha=0.3, label=label)
        above.plot(depth, [row["fit_n"] for row in rows], color="black", linewidth=0.8, label=None if index else "fit")
        below.plot(depth, [row["force_n"] - row["fit_n"] for row in rows], ".", color=color, markersize=2)
    above.set(ylabel="force [N]")
    above.legend(frameon=False)
    below.axhline(0, color="0.4", linewidth=0.8)
    below.set(xlabel="depth [mm]", ylabel="difference [N]")
    for axes in (above, below):
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=150)


def main(arguments):
    if len(arguments) != 2:
        sys.exit(__doc__)
    draw(read(arguments[0]), arguments[1])


if __name__ == "__main__":
    main(sys.argv[1:])
