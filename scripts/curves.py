#!/usr/bin/env python3
"""Draws the curves of docs/ from what scripts/figures.sh recorded: curves.py NAME FOLDER PICTURE.png"""
import csv
import math
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

GROUNDS = ("rubber", "foam60", "foam45", "foam28", "foam25", "grass", "sand_loose", "sand_dense")
COLORS = dict(zip(GROUNDS, ("#3b3b3b", "#0b4f8a", "#2a86c8", "#59b3d9", "#8fd0e0", "#3d8c40", "#d9972e", "#a8551c")))
WEIGHT, AREA, WIDTH = 40 * 9.81, 77 * 0.0195**2, 0.1  # [N], [m^2] of one sole, [m]
# Bekker's n [-], k_c [kN/m^(n+1)], k_phi [kN/m^(n+2)]: Wong 2008, table 2.3; simulant: DLR
SOILS = {
    "dry sand": (1.1, 0.99, 1528.43),
    "Mars simulant": (0.8, 5.79, 180.0),
}
# What figure sinkage compares, and the pressure [kPa] at which it names the other grounds
PAIRS = {"sand_dense": "dry sand", "sand_loose": "Mars simulant"}
LABELS = {"rubber": 26, "foam60": 17, "foam45": 2.5, "foam28": 8.5, "foam25": 5.2, "grass": 3.4}


def read(folder, name):
    """{column: [numbers]}, SI units."""
    with open(f"{folder}/{name}.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {key: [float(row[key]) for row in rows] for key in rows[0]}


def down(data):
    """Depth and force of the first way down."""
    turn = max(range(len(data["depth_m"])), key=lambda i: data["depth_m"][i])
    return data["depth_m"][1:turn + 1], data["force_n"][1:turn + 1]


def parameters(folder):
    """{parameter: {ground: text}} from `mild info grounds`."""
    with open(f"{folder}/grounds.txt", encoding="utf-8") as file:
        lines = [line.split() for line in file]
    names = next(line for line in lines if line[:2] == list(GROUNDS[:2]))
    return {line[0]: dict(zip(names, line[1:])) for line in lines if len(line) == len(names) + 1}


def finish(figure, panels, path):
    for axes in panels:
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=150)


def at_force(depth, force, wanted):
    for i in range(1, len(force)):
        if force[i] >= wanted:
            share = (wanted - force[i - 1]) / (force[i] - force[i - 1])
            return depth[i - 1] + share * (depth[i] - depth[i - 1])
    return math.nan


def presets(folder, path):
    figure, axes = plt.subplots(figsize=(9, 5), layout="constrained")
    numbers = parameters(folder)
    soft, hard = down(read(folder, "softest")), down(read(folder, "hardest"))
    axes.fill_between([1e3 * d for d in soft[0]], soft[1], [min(f, 900) for f in hard[1]], color="0.93", linewidth=0,
                      label="the paper's random draws")
    for ground in GROUNDS:
        depth, force = down(read(folder, ground))
        values = [float(numbers[key][ground]) for key in ("k_pen", "sigma_cone", "alpha", "nu")]
        label = f"{ground}: {values[0]:.0f} N/m, {values[1] / 1e6:.2f}e6 N/m³, {values[2]:.3f}, {values[3]:.1f}"
        axes.plot([1e3 * d for d in depth], force, color=COLORS[ground], linewidth=2, label=label)
        for load in (0.5 * WEIGHT, WEIGHT):
            axes.plot(1e3 * at_force(depth, force, load), load, "o", color=COLORS[ground], markeredgecolor="white", zorder=3)
    for load, text in ((0.5 * WEIGHT, "40 kg on two feet"), (WEIGHT, "40 kg on one foot")):
        axes.axhline(load, color="0.6", linewidth=0.8, linestyle=":")
        axes.text(60.5, load, text.replace(" on ", "\non "), va="center", fontsize=8, color="0.35")
    axes.set(xlabel="depth [mm]", ylabel="force on one level sole of 77 elements [N]", xlim=(0, 60), ylim=(0, 900))
    figure.legend(*axes.get_legend_handles_labels(), loc="outside right upper", frameon=False, fontsize=8,
                  title="ground: k_pen, σ_cone, α, ν", title_fontsize=8)
    finish(figure, [axes], path)


def recovery(folder, path):
    figure, panels = plt.subplots(1, 3, sharey=True, figsize=(10, 3.6), layout="constrained")
    for axes, (share, text) in zip(panels, (("1", "elastic"), ("0.5", "between"), ("0", "plastic"))):
        data = read(folder, f"recovery_{share}")
        depth, force = [1e3 * d for d in data["depth_m"]], data["force_n"]
        turns = [i for i in range(1, len(depth) - 1) if (depth[i] - depth[i - 1]) * (depth[i + 1] - depth[i]) < 0]
        ends = [0] + turns + [len(depth) - 1]
        styles = (("#1f5fa8", "-", "loading"), ("#d1702e", "-", "unloading"), ("#3d8c40", "--", "loading again"),
                  ("#8a4a9e", ":", "unloading again"))
        for k, (color, style, name) in enumerate(styles):
            axes.plot(depth[ends[k]:ends[k + 1] + 1], force[ends[k]:ends[k + 1] + 1], style, color=color, linewidth=2,
                      label=name)
        axes.set(title=f"recovery {share} ({text})", xlabel="depth [mm]")
    panels[0].set_ylabel("force [N]")
    panels[0].legend(frameon=False)
    finish(figure, panels, path)


def energy(data):
    """Depth and kinetic energy per kilogram from the touch to the first stop, from the rows' depths and times."""
    time, depth = data["time_s"], data["depth_m"]
    found = []
    for i in range(1, len(depth)):
        if depth[i] <= depth[i - 1]:
            break
        speed = (depth[i] - depth[i - 1]) / (time[i] - time[i - 1])
        found.append((0.5 * (depth[i] + depth[i - 1]), 0.5 * speed * speed))
    return [z for z, _ in found], [e for _, e in found]


def durian(z, start, d1, k, mass):
    bend, slope = 0.5 * 9.81 * d1 + 0.25 * k * d1 * d1 / mass, -0.5 * k * d1 / mass
    return (start - bend) * math.exp(-2 * z / d1) + bend + slope * z


def durian_fit(z, e, mass):
    """Least squares d1, k of the form tied to the force law; linear in k for each d1."""
    best = (math.inf, 0, 0)
    d1 = 1e-3
    while d1 < 1:
        a, y = [], []
        for depth, value in zip(z, e):
            fade = math.exp(-2 * depth / d1)
            a.append(0.25 * d1 * d1 / mass * (1 - fade) - 0.5 * d1 / mass * depth)
            y.append(value - e[0] * fade - 0.5 * 9.81 * d1 * (1 - fade))
        k = sum(p * q for p, q in zip(a, y)) / sum(p * p for p in a)
        best = min(best, (sum((q - k * p) ** 2 for p, q in zip(a, y)), d1, k))
        d1 *= 1.02
    return best


def impact(folder, path):
    figure, (flat, sand) = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
    shades = {"0.5": "#8fc1e3", "1": "#3a86c0", "2": "#0b4f8a"}
    for speed, color in shades.items():
        z, e = energy(read(folder, f"flat_{speed}"))
        start = 0.5 * float(speed) ** 2
        flat.plot([1e3 * d for d in z], [v / start for v in e], color=color, linewidth=3, label=f"{speed} m/s")
        form = [durian(d, start, 0.5 / (25 * 100 * 0.5 * 1000 * 0.1 * 0.0195**2), 2000, 0.5) for d in z]
        flat.plot([1e3 * d for d in z], [max(v, 0) / start for v in form], "--", color="black", linewidth=1)
        z, e = energy(read(folder, f"sand_{speed}"))
        sand.plot([1e3 * d for d in z], [v / start for v in e], color=color, linewidth=3, label=f"{speed} m/s")
        miss, d1, k = durian_fit(z, e, 5)
        print(f"sand_loose, 5 kg at {speed} m/s: d1 {1e3 * d1:.1f} mm, k {k:.0f} N/m, "
              f"rms {100 * math.sqrt(miss / len(z)) / e[0]:.1f} % of K0")
        sand.plot([1e3 * d for d in z], [max(durian(d, e[0], d1, k, 5), 0) / start for d in z], "--", color="black",
                  linewidth=1)
    flat.set_title("straight force, constant drag: the published form", fontsize=10)
    sand.set_title("sand_loose: drag ends with the cone at 9.5 mm", fontsize=10)
    for axes in (flat, sand):
        axes.plot([], [], "--", color="black", linewidth=1, label="Katsuragi-Durian")
        axes.set(xlabel="depth [mm]", ylabel="kinetic energy / that at touch", ylim=(0, None), xlim=(0, None))
        axes.legend(frameon=False)
    finish(figure, [flat, sand], path)


def sinkage(folder, path):
    """One message: under a robot the two sands sink as deep as Bekker's soils of their kind. All else is pale."""
    figure, axes = plt.subplots(figsize=(8.5, 5.2), layout="constrained")
    two, one = 0.5e-3 * WEIGHT / AREA, 1e-3 * WEIGHT / AREA
    axes.axhspan(two, one, color="0.94", linewidth=0)
    axes.text(0.62, math.sqrt(two * one), "40 kg on two feet\n(lower edge)\nto one foot (upper)", fontsize=9, color="0.35",
              va="center")
    for ground in GROUNDS:
        depth, force = down(read(folder, ground))
        sand = ground in PAIRS
        x, y = [1e3 * d for d in depth], [1e-3 * f / AREA for f in force]
        axes.plot(x, y, color=COLORS[ground] if sand else "0.75", linewidth=3 if sand else 1.2, zorder=3 if sand else 1)
        if not sand:
            label = next(i for i, p in enumerate(y) if p > LABELS[ground])
            axes.text(x[label], y[label], ground, color="0.45", fontsize=8, ha="center", va="center",
                      bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8})
    for ground, soil in PAIRS.items():
        n, k_c, k_phi = SOILS[soil]
        z = [10 ** (-0.3 + 0.02 * i) for i in range(140)]
        axes.plot(z, [(k_c / WIDTH + k_phi) * (1e-3 * d) ** n for d in z], color=COLORS[ground], linestyle="--",
                  linewidth=1.8, zorder=2, label=f"{soil}, Bekker, measured")
        axes.plot([], [], color=COLORS[ground], linewidth=3, label=f"{ground}, ours")
    axes.set(xscale="log", yscale="log", xlim=(0.5, 80), ylim=(2, 40), xlabel="sinkage [mm]",
             ylabel="mean pressure under the sole [kPa]")
    ticks = (2, 5, 10, 20, 40), (0.5, 1, 2, 5, 10, 20, 50)
    axes.set_yticks(ticks[0], [f"{t:g}" for t in ticks[0]])
    axes.set_xticks(ticks[1], [f"{t:g}" for t in ticks[1]])
    axes.minorticks_off()
    axes.set_title("Under a robot's weight our sands sink as deep as the soils of their kind, within a factor of 1.5", fontsize=11)
    axes.legend(frameon=False, fontsize=9, loc="lower right")
    finish(figure, [axes], path)


MODELS = {  # colour, line, name in the legend
    "mild": ("#0b4f8a", "-", "mild"),
    "ecc_spring": ("#3d8c40", "-", "ecc_spring"),
    "ecc_quasi": ("#d9972e", "-", "ecc_quasi"),
    "ecc_quasi_3d": ("#a8551c", (0, (4, 2)), "ecc_quasi_3d"),
    "con_cone": ("#7a4fa3", "-", "con_cone"),
    "con_spring": ("#c23b3b", (0, (4, 2)), "con_spring"),
}
TILTS = (0, 1, 2, 3, 4, 6, 8, 10, 12, 14, 17, 20)


def at_depth(data, wanted, column):
    """On the way down."""
    depth, values = data["depth_m"], data[column]
    for i in range(1, len(depth)):
        if depth[i] >= wanted:
            share = (wanted - depth[i - 1]) / (depth[i] - depth[i - 1])
            return values[i - 1] + share * (values[i] - values[i - 1])
    return math.nan


def eccentric(folder, path):
    figure, (force, moment, tilt) = plt.subplots(1, 3, figsize=(12, 4), layout="constrained")
    for model, (color, line, name) in MODELS.items():
        style = {"color": color, "linestyle": line, "linewidth": 1.8, "label": name}
        data = read(folder, f"{model}_10")
        depth, push = down(data)
        turn = data["moment_y_nm"][1:len(depth) + 1]
        force.plot([1e3 * d for d in depth], push, **style)
        moment.plot([1e3 * d for d in depth], [-m for m in turn], **style)
        righting = [-at_depth(read(folder, f"{model}_{t}"), 0.015, "moment_y_nm") for t in TILTS]
        tilt.plot(TILTS, righting, **style)
    force.set(xlabel="depth of the plate's middle [mm]", ylabel="force [N]", title="tilted by 10°")
    moment.set(xlabel="depth of the plate's middle [mm]", ylabel="righting moment [N m]", title="tilted by 10°")
    tilt.set(xlabel="tilt [deg]", ylabel="righting moment [N m]", title="middle 15 mm deep")
    tilt.text(20, 0.2, "con_cone, con_spring", ha="right", va="bottom", fontsize=9, color=MODELS["con_cone"][0])
    force.legend(frameon=False, fontsize=9)
    finish(figure, [force, moment, tilt], path)


def main(arguments):
    figures = {"presets": presets, "recovery": recovery, "impact": impact, "sinkage": sinkage, "eccentric": eccentric}
    if len(arguments) != 3 or arguments[0] not in figures:
        sys.exit(__doc__)
    figures[arguments[0]](arguments[1], arguments[2])


if __name__ == "__main__":
    main(sys.argv[1:])
