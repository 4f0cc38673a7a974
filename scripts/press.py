#!/usr/bin/env python3
"""Draws what `mild press --figure` recorded: press.py DATA.csv PICTURE.png [TITLE]

Force over depth; beside it whatever else moved: the resistance over the way (dragged), depth and force over time
(dropped), or the zero moment point over depth (tilted)."""
import csv
import sys

try:
    import matplotlib
except ImportError:
    sys.exit(1)  # the program says what is missing

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

COLORS = {"down": "#1f5fa8", "up": "#d1702e", "dragged": "#3d8c40"}


def read(path):
    """{column: [numbers]}, SI units."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {key: [float(row[key]) for row in rows] for key in rows[0]}


def is_dragged(data):
    """Whether it moved forward without turning, as a dragged plate does and a dropped one does not."""
    return "x_m" in data and max(data["x_m"]) - data["x_m"][0] > 0.5e-4 and max(data["tilt_rad"]) == min(data["tilt_rad"])


def ways(data):
    """Runs of one direction: (first, end, name); a run begins with the last row of the one before."""
    depth, x = data["depth_m"], data["x_m"] if is_dragged(data) else [0] * len(data["depth_m"])
    names = []
    for i in range(1, len(depth)):
        down, side = depth[i] - depth[i - 1], abs(x[i] - x[i - 1])
        rest = abs(down) < 1e-8 and side < 1e-7
        names.append(names[-1] if rest and names else "dragged" if side > abs(down) else "down" if down > 0 else "up")
    runs, first = [], 0
    for i in range(1, len(depth)):
        if i == len(names) or names[i] != names[i - 1]:
            runs.append((first, i + 1, names[i - 1]))
            first = i
    return runs


def force_over_depth(axes, data):
    depth, force = [1e3 * d for d in data["depth_m"]], data["force_n"]
    named = {"dragged"}  # at one depth: there is nothing to see
    for first, end, name in ways(data):
        label = None if name in named else "on the way " + name
        axes.plot(depth[first:end], force[first:end], color=COLORS[name], linewidth=1.8, label=label)
        named.add(name)
    axes.set(xlabel="depth [mm]", ylabel="force up [N]")
    axes.legend(frameon=False)


def over_time(axes, data):
    time = [1e3 * t for t in data["time_s"]]
    stop = next((i for i in range(1, len(time)) if data["force_n"][i] > 0 and data["depth_m"][i] < data["depth_m"][i - 1]), 0)
    last = min(len(time), 3 * stop) if stop else len(time)
    axes.plot(time[:last], [1e3 * d for d in data["depth_m"][:last]], color=COLORS["down"], linewidth=1.8)
    axes.set(xlabel="time [ms]", ylabel="depth [mm]")
    axes.invert_yaxis()
    axes.axhline(0, color="0.5", linewidth=0.8)


def drag_over_way(axes, data):
    rows = [i for first, end, name in ways(data) if name == "dragged" for i in range(first + 1, end)]
    axes.plot([1e3 * data["x_m"][i] for i in rows], [-data["force_x_n"][i] for i in rows], color=COLORS["dragged"], linewidth=1.8)
    axes.set(xlabel="dragged forward by [mm]", ylabel="horizontal resistance [N]")
    axes.set_ylim(bottom=0)


def zmp_over_depth(axes, data):
    depth = [1e3 * d for d in data["depth_m"]]
    for first, end, name in ways(data):
        axes.plot(depth[first:end], [1e3 * x for x in data["zmp_x_m"][first:end]], linewidth=1.8, color=COLORS[name])
    axes.axhline(0, color="0.5", linewidth=0.8)
    axes.set(xlabel="depth [mm]", ylabel="zero moment point, forward [mm]")


def second(data):
    """The panel beside the force, or None."""
    if "x_m" in data:
        return drag_over_way if is_dragged(data) else over_time
    tilted = max(abs(m) for m in data["moment_y_nm"]) > 1e-3 * max(data["force_n"])
    return zmp_over_depth if tilted else None


def draw(data, path, title=None):
    beside = second(data)
    figure, panels = plt.subplots(1, 2 if beside else 1, squeeze=False, figsize=(10 if beside else 6, 4.2),
                                  layout="constrained")
    force_over_depth(panels[0][0], data)
    if beside:
        beside(panels[0][1], data)
    for axes in panels[0]:
        axes.spines[["top", "right"]].set_visible(False)
    figure.suptitle(title, fontsize="medium")
    figure.savefig(path, dpi=150)


def main(arguments):
    if len(arguments) not in (2, 3):
        sys.exit(__doc__)
    draw(read(arguments[0]), *arguments[1:])


if __name__ == "__main__":
    main(sys.argv[1:])
