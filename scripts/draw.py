#!/usr/bin/env python3
"""Draws what the program measured: draw.py KIND DATA.csv PICTURE.png [TITLE]

KIND: press (`mild press --figure`), fit (`mild fit --figure`), pressure (`mild play --pressure`), actuator (`mild actuator fit --figure`)."""
import csv
import sys

try:
    import matplotlib
except ImportError:
    sys.exit(1)  # the program says what is missing

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.collections import PatchCollection  # noqa: E402
from matplotlib.colors import Normalize  # noqa: E402
from matplotlib.lines import Line2D  # noqa: E402
from matplotlib.patches import Patch, Rectangle  # noqa: E402


def grouped(rows, key):
    """{value of `key`: [row, ...]} in the file's order; numbers in SI units."""
    groups = {}
    for row in rows:
        groups.setdefault(row[key], []).append({name: float(value) for name, value in row.items() if name != key})
    return groups


# ---- press ----

COLORS = {"down": "#1f5fa8", "up": "#d1702e", "dragged": "#3d8c40"}


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


def beside_force(data):
    """The panel beside the force, or None."""
    if "x_m" in data:
        return drag_over_way if is_dragged(data) else over_time
    tilted = max(abs(m) for m in data["moment_y_nm"]) > 1e-3 * max(data["force_n"])
    return zmp_over_depth if tilted else None


def draw_press(rows, path, title=None):
    """Force over depth; beside it whatever else moved: the resistance over the way (dragged), depth and force over time
    (dropped), or the zero moment point over depth (tilted)."""
    data = {key: [float(row[key]) for row in rows] for key in rows[0]}
    beside = beside_force(data)
    figure, panels = plt.subplots(1, 2 if beside else 1, squeeze=False, figsize=(10 if beside else 6, 4.2),
                                  layout="constrained")
    force_over_depth(panels[0][0], data)
    if beside:
        beside(panels[0][1], data)
    for axes in panels[0]:
        axes.spines[["top", "right"]].set_visible(False)
    figure.suptitle(title, fontsize="medium")
    figure.savefig(path, dpi=150)


# ---- fit ----


def draw_fit(rows, path):
    """Top: measured forces and the fitted law over depth. Bottom: the residuals."""
    records = grouped(rows, "record")
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


# ---- pressure ----

PRESSURES = (("mean_kpa", "mean over stance"), ("peak_kpa", "peak"))
GAP = 0.03  # [m] between the drawn soles
PATH = "#0aa3c2"


def values(rows, key):
    return [float(row[key]) for row in rows]


def pitch(rows):
    xs = sorted(set(values(rows, "x_m")))
    return min(b - a for a, b in zip(xs, xs[1:]) if b - a > 1e-4)


def draw_foot(axes, foot, key, norm, shift, path):
    """Toes up, the foot's left (+y) to the left."""
    edge = pitch(foot["element"])
    x, y, p = (values(foot["element"], k) for k in ("x_m", "y_m", key))
    squares = [Rectangle((shift - b - edge / 2, a - edge / 2), edge, edge) for a, b in zip(x, y)]
    cells = PatchCollection(squares, cmap="magma_r", norm=norm, edgecolor="white", linewidth=0.6)
    cells.set_array(p)
    axes.add_collection(cells)
    if path and foot["path"]:
        px, py = values(foot["path"], "x_m"), values(foot["path"], "y_m")
        axes.plot([shift - b for b in py], px, color=PATH, linewidth=2, solid_capstyle="round", zorder=3)
        axes.plot(shift - py[0], px[0], "o", color=PATH, markeredgecolor="white", markersize=7, zorder=4)
        axes.plot(shift - py[-1], px[-1], "X", color=PATH, markeredgecolor="white", markersize=8, zorder=4)
    return cells


def legend(figure, element):
    """What every mark means, below the soles."""
    spot = {"color": "none", "markerfacecolor": PATH, "markeredgecolor": "white"}
    edge = 1e3 * pitch(element)
    marks = (
        (Line2D([], [], color=PATH, linewidth=2), "path of the centre of pressure,\nmean over the stances"),
        (Line2D([], [], marker="o", markersize=9, **spot), "touchdown"),
        (Line2D([], [], marker="X", markersize=10, **spot), "lift-off"),
        (Patch(facecolor="#f1605d", edgecolor="white"), f"element of the sole,\n{edge:.1f} x {edge:.1f} mm, toes up"),
    )
    handles, labels = zip(*marks)
    figure.legend(handles, labels, loc="outside lower center", ncols=len(marks), frameon=False, fontsize=9)


def draw_pressure(rows, path):
    """For each ground the left and right sole seen from above: mean pressure per element over the stances, peak pressure, and
    the path of the centre of pressure from touchdown to lift-off, mean over the stances. A legend names every mark."""
    grounds = {}
    for row in rows:
        foot = grounds.setdefault(row["ground"], {}).setdefault(row["foot"], {"element": [], "path": []})
        foot[row["what"]].append(row)
    width = 2.3 * max(len(grounds), 2) + 1.6
    figure, panels = plt.subplots(len(PRESSURES), len(grounds), figsize=(width, 6.9), squeeze=False, layout="constrained")
    for index, ((key, title), row) in enumerate(zip(PRESSURES, panels)):
        top = max(max(values(foot["element"], key)) for feet in grounds.values() for foot in feet.values())
        norm = Normalize(0, top)
        for axes, (ground, feet) in zip(row, grounds.items()):
            ys = [v for foot in feet.values() for v in values(foot["element"], "y_m")]
            xs = [v for foot in feet.values() for v in values(foot["element"], "x_m")]
            half = max(map(abs, ys)) + GAP / 2 + 0.01
            for name, side in (("left", -1), ("right", 1)):
                if name in feet:
                    cells = draw_foot(axes, feet[name], key, norm, side * half, key == "mean_kpa")
                axes.text(side * half, min(xs) - 0.025, name, ha="center", va="top", fontsize=8, color="0.35")
            axes.set(xlim=(-2 * half, 2 * half), ylim=(min(xs) - 0.05, max(xs) + 0.02), aspect="equal")
            axes.axis("off")
            if index == 0:
                axes.set_title(ground, fontsize=11)
        bar = figure.colorbar(cells, ax=row.tolist(), shrink=0.85, pad=0.02)
        bar.set_label(f"{title} [kPa]")
    legend(figure, next(iter(next(iter(grounds.values())).values()))["element"])
    figure.suptitle("Sole pressure while walking", fontsize=13)
    figure.savefig(path, dpi=150)


# ---- actuator ----


def usual_second(rows):
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


def draw_actuator(rows, path):
    """For each kind of motor a held-out second: the measured torque, the network's, that of the best PD."""
    joints = grouped(rows, "joint")
    figure, panels = plt.subplots(
        len(joints), 1, figsize=(8, 2.4 * len(joints)), squeeze=False, layout="constrained"
    )
    for axes, (joint, rows) in zip(panels[:, 0], joints.items()):
        block = usual_second(rows)
        time = [row["time_s"] for row in block]
        axes.plot(time, [row["measured_nm"] for row in block], color="0.2", linewidth=2.5, label="measured")
        axes.plot(time, [row["pd_fit_nm"] for row in block], color="C0", linewidth=1, label="best PD")
        axes.plot(time, [row["network_nm"] for row in block], "--", color="C3", linewidth=1.5, label="network")
        axes.set(ylabel=f"{joint}\ntorque [N m]")
        axes.spines[["top", "right"]].set_visible(False)
    panels[0, 0].legend(frameon=False, ncols=3, loc="lower left", bbox_to_anchor=(0, 1))
    panels[-1, 0].set(xlabel="time [s]")
    figure.savefig(path, dpi=130)


DRAW = {"press": draw_press, "fit": draw_fit, "pressure": draw_pressure, "actuator": draw_actuator}


def main(kind=None, data=None, picture=None, *title):
    if kind not in DRAW or picture is None or len(title) > (kind == "press"):
        sys.exit(__doc__)
    with open(data, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    if not rows:
        sys.exit(f"{data}: nothing was recorded, nothing to draw")
    DRAW[kind](rows, picture, *title)


if __name__ == "__main__":
    main(*sys.argv[1:])
