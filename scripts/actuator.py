#!/usr/bin/env python3
"""Draws the result of `mild actuator fit --figure`: actuator.py DATA_held.csv PICTURE.png

For each kind of motor a held-out second: the measured torque, the network's, that of the best PD."""
import csv
import sys
from collections import OrderedDict

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


def read(path):
    """{joint: [row, ...]} in the file's order; numbers in SI units."""
    joints = OrderedDict()
    with open(path, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            joint = row.pop("joint")
            joints.setdefault(joint, []).append({key: float(value) for key, value in row.items()})
    return joints


def second(rows):
    """The first held-out second in which the robot moves as usual: with at least the mean range of torque."""
    blocks = [[rows[0]]]
    for before, row in zip(rows, rows[1:]):
        if not 0 < row["time_s"] - before["time_s"] < 0.2:
            blocks.append([])
        blocks[-1].append(row)

    def spread(block):
        torques = [row["measured_nm"] for row in block]
        return max(torques) - min(torques)

    usual = sum(map(spread, blocks)) / len(blocks)
    return next(block for block in blocks if spread(block) >= usual)


def draw(joints, path):
    figure, panels = plt.subplots(
        len(joints), 1, figsize=(8, 2.4 * len(joints)), squeeze=False, layout="constrained"
    )
    for axes, (joint, rows) in zip(panels[:, 0], joints.items()):
        block = second(rows)
        time = [row["time_s"] for row in block]
        axes.plot(time, [row["measured_nm"] for row in block], color="0.2", linewidth=2.5, label="measured")
        axes.plot(time, [row["pd_fit_nm"] for row in block], color="C0", linewidth=1, label="best PD")
        axes.plot(time, [row["network_nm"] for row in block], "--", color="C3", linewidth=1.5, label="network")
        axes.set(ylabel=f"{joint}\ntorque [N m]")
        axes.spines[["top", "right"]].set_visible(False)
    panels[0, 0].legend(frameon=False, ncols=3, loc="lower left", bbox_to_anchor=(0, 1))
    panels[-1, 0].set(xlabel="time [s]")
    figure.savefig(path, dpi=130)


def main(arguments):
    if len(arguments) != 2:
        sys.exit(__doc__)
    draw(read(arguments[0]), arguments[1])


if __name__ == "__main__":
    main(sys.argv[1:])
