#!/usr/bin/env python3
"""Draws what `mild play --pressure` measured: pressure.py DATA.csv PICTURE.png

For each ground the left and right sole seen from above: mean pressure per element over the stances, peak pressure, and
the path of the centre of pressure from touchdown to lift-off, mean over the stances. A legend names every mark."""
import csv
import sys
from collections import OrderedDict

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

ROWS = (("mean_kpa", "mean over stance"), ("peak_kpa", "peak"))
GAP = 0.03  # [m] between the drawn soles
PATH = "#0aa3c2"


def read(path):
    """{ground: {foot: {"element": [...], "path": [...]}}} in the file's order."""
    grounds = OrderedDict()
    with open(path, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            foot = grounds.setdefault(row["ground"], {}).setdefault(row["foot"], {"element": [], "path": []})
            foot[row["what"]].append(row)
    return grounds


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


def draw(grounds, path):
    width = 2.3 * max(len(grounds), 2) + 1.6
    figure, panels = plt.subplots(len(ROWS), len(grounds), figsize=(width, 6.9), squeeze=False, layout="constrained")
    for index, ((key, title), row) in enumerate(zip(ROWS, panels)):
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


def main(arguments):
    if len(arguments) != 2:
        sys.exit(__doc__)
    grounds = read(arguments[0])
    if not grounds:
        sys.exit(f"{arguments[0]}: no stance was recorded, nothing to draw")
    draw(grounds, arguments[1])


if __name__ == "__main__":
    main(sys.argv[1:])
