#!/usr/bin/env python3
"""The drawings of docs/ as SVG, on a light ground of their own, so that they can be read on light and dark pages.

    drawings.py [NAME...]    draws house, architecture, element, step, frames, badges, or all (needs graphviz and matplotlib)
    drawings.py --check      exit 1 when docs/house.svg is not the house (folders of src, includes, sentences) or a name in step.svg is not in src
    drawings.py --arrows [TREE ...]     folders of src and arrows between them, here or in other trees"""
import html
import math
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
INCLUDE = re.compile(r'^\s*#\s*include "([a-z_]+)/', re.M)
PAPER, INK, FILL, LINE, WARM, COOL = "#fcfcfa", "#222222", "#eef2f6", "#8795a3", "#c0562b", "#1f6fb2"


# ---- the house

def rooms(tree=ROOT):
    """{folder of src: the folders whose headers it includes}."""
    source = tree / "src"
    names = {path.name for path in source.iterdir() if path.is_dir()}
    found = {name: set() for name in names}
    for name in names:
        for path in (source / name).rglob("*"):
            if path.suffix in (".c", ".h", ".inc", ".cu", ".cpp"):
                found[name] |= set(INCLUDE.findall(path.read_text(encoding="utf-8"))) & names - {name}
    return found


def sentences():
    """{folder: what src/README.md says of it}."""
    text = (ROOT / "src/README.md").read_text(encoding="utf-8")
    return dict(re.findall(r"^\| `(\w+)` \| (.*?) \|$", text, re.M))


def reach(graph, start):
    """Every folder that can be reached from one, itself left out."""
    seen, open_ = set(), list(graph[start])
    while open_:
        name = open_.pop()
        if name not in seen:
            seen.add(name)
            open_ += graph[name]
    return seen


def direct(graph):
    """The arrows that no other way stands for."""
    return {(a, b) for a in graph for b in graph[a] if not any(b in reach(graph, c) for c in graph[a] - {b})}


def stamp(graph):
    """The whole graph and its sentences as text, which the drawing keeps and --check compares."""
    said = sentences()
    return "\n".join(f"{name} ({said.get(name, 'NO SENTENCE IN src/README.md')}): {' '.join(sorted(graph[name]))}" for name in sorted(graph))


def dot(text):
    """The SVG of a graph in graphviz's language."""
    if not shutil.which("dot"):
        sys.exit("drawings: there is no graphviz here, which lays them out: apt-get install graphviz")
    done = subprocess.run(["dot", "-Tsvg"], input=text, check=True, capture_output=True, text=True).stdout
    return done[done.index("<svg"):]


HEAD = f"""digraph {{ bgcolor="{PAPER}"; pad=0.2; nodesep=0.25; ranksep=0.45; splines=true;
node [shape=box style="filled,rounded" fillcolor="{FILL}" color="{LINE}" fontname="Helvetica" fontsize=12 fontcolor="{INK}" margin="0.12,0.07"];
edge [color="{LINE}" arrowsize=0.6 fontname="Helvetica" fontsize=11 fontcolor="{INK}"];
"""


def wrap(text, width):
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + len(word) >= width:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return "<br/>".join(html.escape(line) for line in lines)


def house():
    graph, said = rooms(), sentences()
    nodes = "".join(f'{name} [label=<<b>{name}</b><br/><font point-size="10">{wrap(said.get(name, ""), 30)}</font>>];\n' for name in sorted(graph))
    arrows = "".join(f"{a} -> {b};\n" for a, b in sorted(direct(graph)))
    return dot(HEAD + nodes + arrows + "}") + f"<!--\n{stamp(graph)}\n-->\n"


def check():
    drawn = (ROOT / "docs/house.svg").read_text(encoding="utf-8")
    wanted = stamp(rooms())
    if "NO SENTENCE" in wanted:
        return f"drawings: {wanted.split(' (NO SENTENCE')[0].split()[-1]}: a folder of src without a row in src/README.md"
    if f"<!--\n{wanted}\n-->" not in drawn:
        return "drawings: docs/house.svg is not what src is; run scripts/drawings.py house"
    code = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "src").rglob("*.[chi]*"))
    code += "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "src").rglob("*.cu"))
    for _, _, cpu, gpu in LOOP + AFTER:
        for name in [cpu, *gpu.split(", ")]:
            if not re.search(rf"\b{name}\b", code):
                return f"drawings: docs/step.svg names {name}, which src has not; change LOOP or AFTER in scripts/drawings.py and run it"
    return None


# ---- the others

def architecture():
    boxes = {
        "ground": ("libmild", "the ground: C17, libc and libm"),
        "robot": ("robots", "a folder each; MuJoCo or our batch engine"),
        "task": ("task", "observe, reward, randomise, end"),
        "learn": ("learner", "PPO, networks; CPU, GPU, several GPUs"),
        "app": ("build/mild", "train, eval, play, press, fit, export, drive"),
        "yours": ("your engine", "C"),
        "plugin": ("MuJoCo plugin", "any MJCF; C, simulate, Python"),
        "python": ("Python mild", "NumPy, CUDA tensors, fits"),
        "envs": ("environments", "Gymnasium, rsl_rl, Stable-Baselines3"),
        "policy": ("policy.safetensors", "ONNX, C, UDP, browser"),
    }
    nodes = "".join(f'{name} [label=<<b>{title}</b><br/><font point-size="10">{wrap(text, 26)}</font>>'
                    f'{f" fillcolor={chr(34)}#fbeadf{chr(34)}" if name == "ground" else ""}];\n' for name, (title, text) in boxes.items())
    arrows = "".join(f"{a} -> {b};\n" for a, b in [
        ("ground", "yours"), ("ground", "plugin"), ("ground", "python"), ("ground", "robot"), ("robot", "task"), ("task", "envs"),
        ("task", "learn"), ("learn", "app"), ("learn", "policy")])
    return dot(HEAD + 'rankdir=LR; {rank=same; yours; plugin; python; robot;}\n' + nodes + arrows + "}")


LOOP = [("dynamics", "mass matrix, bias, motors", "robot_sim_step", "part"),
        ("joint limits that push", "taken into the mass matrix", "limits_hold", "part"),
        ("feet", "A = J M⁻¹ Jᵀ, velocity without ground", "project_feet", "part"),
        ("ground: solve", "wrench of every foot, by Newton's method", "mild_ground_solve", "ground"),
        ("ground: advance", "yield depths, drift, imprints", "mild_ground_advance", "ground"),
        ("accelerate", "and the joint limits once more", "constrain", "part"),
        ("integrate", "semi-implicit Euler, new pose", "integrate", "part")]
AFTER = [("reward and end", "of the last physics step", "task_reward", "end"), ("new episodes", "draw ground, robot, command", "task_env_reset", "end, pose"),
         ("observe", "noise, latency, history", "task_observe", "observe"), ("policy", "actions of all robots", "act", "learner")]


def step():
    loop, after = LOOP, AFTER

    def node(index, row):
        title, text, cpu, gpu = row
        left, right = '<td align="left" width="225" height="18" fixedsize="true">', '<td align="right" width="125" height="18" fixedsize="true">'
        return (f'n{index} [label=<<table border="0" cellspacing="0" cellpadding="0"><tr>{left}<b>{title}</b></td>'
                f'{right}<font point-size="10" color="{COOL}">{cpu}</font></td></tr><tr>{left}<font point-size="10">{html.escape(text)}</font></td>'
                f'{right}<font point-size="10" color="{WARM}">{gpu}</font></td></tr></table>>];\n')
    text = HEAD + "ranksep=0.15;\n" + 'start [label=<<b>action</b>: a target for every joint, after its latency>];\n'
    text += f'subgraph cluster_loop {{ label="every physics step, 2 to 20 in a policy step of 10 ms"; labeljust=l; fontname="Helvetica"; fontsize=11; color="{LINE}"; style="rounded,dashed";\n'
    text += "".join(node(i, row) for i, row in enumerate(loop)) + "}\n"
    text += "".join(node(i + len(loop), row) for i, row in enumerate(after))
    text += f'key [shape=plain style="" label=<<font color="{COOL}">blue: function on the CPU</font>   <font color="{WARM}">orange: kernel on a GPU</font>>];\n'
    last = len(loop) + len(after) - 1
    text += "start -> n0;\n" + "".join(f"n{i} -> n{i + 1};\n" for i in range(last)) + f"n{last} -> key [style=invis];\n"
    return dot(text + f"n{len(loop) - 1}:e -> n0:e [constraint=false];\n}}")


def axes_of(size):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    plt.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "mild", "font.family": "sans-serif", "font.sans-serif": ["Helvetica", "Arial", "DejaVu Sans"],
                         "font.size": 11, "text.color": INK, "axes.edgecolor": INK, "figure.facecolor": PAPER, "axes.facecolor": PAPER})
    return plt, plt.subplots(1, 2, figsize=size) if size[0] > size[1] * 2 else plt.subplots(figsize=size)


def saved(plt, figure):
    import io
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", facecolor=PAPER, metadata={"Date": None})
    plt.close(figure)
    text = buffer.getvalue()
    return text[text.index("<svg"):]


def element():
    """The law of docs/model.md, sections 3 and 5, with numbers of a sand; the cone beside it to scale of its angle."""
    plt, (figure, (left, right)) = axes_of((10, 4))
    k_pen, kappa, complete, recovery = 900.0, 120.0, 0.03, 0.35  # [N/m], [N/m], [m], [-]

    def recruited(u):
        t = min(u / complete, 1)
        return complete * (t - t * t + t ** 3 / 3)

    def force(u):
        return (k_pen - kappa) * recruited(u) + kappa * u
    grid = [i * 0.04 / 200 for i in range(201)]
    deep = 0.026
    zero = deep * (1 - recovery)
    right.plot([1e3 * u for u in grid], [force(u) for u in grid], color=WARM, lw=2)
    right.plot([1e3 * zero, 1e3 * deep], [0, force(deep)], color=COOL, lw=2)
    right.plot([1e3 * deep] * 2, [0, force(deep)], color=LINE, lw=1, ls=":")
    right.annotate("virgin ground $F_g(u)$", (11, force(0.011)), (1.0, 11.8), color=WARM, arrowprops={"arrowstyle": "-", "color": WARM})
    right.annotate("unloading line:\ndown and up to $a$", (22.5, 0.63 * force(deep)), (27.5, 4.6), color=COOL, arrowprops={"arrowstyle": "-", "color": COOL})
    right.text(1e3 * deep, -1.15, "$a$ yield depth", ha="left")
    right.text(1e3 * zero, -1.15, "zero-force depth $u_z$", ha="right")
    right.set(xlim=(0, 40), ylim=(0, 14), xlabel="", ylabel="force on the element", xticks=[], yticks=[])
    right.text(40, -2.1, "depth u of the element below the undisturbed surface", ha="right")
    for side in ("top", "right"):
        right.spines[side].set_visible(False)
    left.set(xlim=(-2.3, 2.3), ylim=(-2.0, 1.25), aspect="equal")
    left.axis("off")
    left.plot([-2.3, -0.5, -0.5], [0, 0, -0.55], color=INK, lw=1.5)
    left.plot([0.5, 0.5, 2.3], [-0.55, 0, 0], color=INK, lw=1.5)
    left.fill([-2.3, -0.5, -0.5, 0.5, 0.5, 2.3, 2.3, -2.3], [0, 0, -0.55, -0.55, 0, 0, -2, -2], color="#efe3c8", lw=0)
    left.fill([-0.5, 0.5, 0.5, -0.5], [-0.55, -0.55, 0.75, 0.75], color="#c9d2db", lw=0)
    left.fill([-0.5, 0.5, 0.18, -0.18], [-0.55, -0.55, -1.25, -1.25], color="#d49a6a", lw=0)
    left.plot([-0.5, -0.18, 0.18, 0.5], [-0.55, -1.25, -1.25, -0.55], color=WARM, lw=1.5)
    left.text(0, 0.1, "element\nof a sole", ha="center", va="center")
    left.text(0, -0.9, "cone", ha="center", va="center")
    left.annotate("compacted material that\nmoves with the element:\nits mass is the added mass", (0.3, -0.8), (0.75, -1.35), fontsize=9, va="center",
                  arrowprops={"arrowstyle": "-", "color": INK})
    left.annotate("flat area $S$, shrinks\nas the cone grows", (-0.1, -1.25), (-2.1, -1.6), fontsize=9, arrowprops={"arrowstyle": "-", "color": INK})
    left.annotate("", (-0.75, 0), (-0.75, -0.55), arrowprops={"arrowstyle": "<->", "color": COOL})
    left.text(-0.8, -0.28, "$u$", color=COOL, ha="right", va="center")
    left.annotate("", (0, 0.8), (0, 1.25), arrowprops={"arrowstyle": "->", "color": COOL, "lw": 2})
    left.text(0.1, 1.05, "$w$", color=COOL)
    left.text(2.28, 0.06, "undisturbed surface $h_0$", ha="right", fontsize=9)
    figure.tight_layout()
    return saved(plt, figure)


def frames():
    plt, (figure, place) = axes_of((8, 4.6))
    place.set(xlim=(-0.55, 2.75), ylim=(-0.28, 1.5), aspect="equal")
    place.axis("off")

    def triad(x, y, tilt, name, where, color, text):
        for angle, label in ((tilt, "x"), (tilt + 90, "z")):
            dx, dy = 0.3 * math.cos(math.radians(angle)), 0.3 * math.sin(math.radians(angle))
            place.annotate("", (x + dx, y + dy), (x, y), arrowprops={"arrowstyle": "-|>", "color": color, "lw": 2, "shrinkA": 0, "shrinkB": 0})
            place.text(x + 1.2 * dx, y + 1.2 * dy, label, color=color, ha="center", va="center", fontsize=10)
        place.text(*where, name, color=color, fontweight="bold", fontsize=11)
        place.text(where[0], where[1] - 0.03, text, fontsize=9, va="top", linespacing=1.4)
    place.fill([-0.55, 2.75, 2.75, -0.55], [0, 0, -0.28, -0.28], color="#efe3c8", lw=0)
    place.plot([-0.55, 2.75], [0, 0], color=INK, lw=1.5)
    place.text(2.74, 0.03, "undisturbed surface $h_0(x, y)$", fontsize=9, ha="right")

    def box(x, y, tilt, w, h):
        c, s = math.cos(math.radians(tilt)), math.sin(math.radians(tilt))
        corners = [(x + c * a - s * b, y + s * a + c * b) for a, b in ((-w, -h), (w, -h), (w, h), (-w, h))]
        place.fill(*zip(*corners), color="#dbe2e9", lw=0)
    box(1.0, 1.05, -12, 0.16, 0.24)
    place.plot([0.95, 1.12, 0.92], [0.83, 0.5, 0.1], color="#b8c3ce", lw=9, solid_capstyle="round")
    box(0.98, 0.0, 8, 0.22, 0.035)
    for i in range(9):
        u = -0.2 + 0.4 * i / 8
        place.plot([0.98 + u], [-0.035 + 0.14 * u], marker="s", ms=3, color=WARM)
    triad(-0.35, 0.0, 0, "world", (-0.5, 0.62), INK, "z up; maps, positions,\nwrenches of the feet")
    triad(1.0, 1.05, -12, "base", (1.5, 0.93), COOL, "turns with the trunk; angular\nvelocity and gravity of the sensors")
    triad(1.0, 1.05, 0, "heading", (1.5, 1.32), "#3c8f4e", "base without roll and pitch;\ncommands and measured speed")
    triad(0.9, 0.08, 8, "foot", (1.5, 0.5), WARM, "turns with the foot's body; outline and\nelements of the sole (squares), z of its plane")
    figure.tight_layout(pad=0.3)
    return saved(plt, figure)


def badges():
    x, parts = 0, []
    for left, right in (("licence", "Apache-2.0"), ("C", "17"), ("MuJoCo", "4"), ("CUDA", "13, optional"), ("Python", "3.11+")):
        a, b = 12 + 6.6 * len(left), 12 + 6.6 * len(right)
        parts.append(f'<rect x="{x:.0f}" width="{a:.0f}" height="20" fill="#555"/><rect x="{x + a:.0f}" width="{b:.0f}" height="20" fill="#1f6fb2"/>'
                     f'<text x="{x + a / 2:.0f}" y="14">{left}</text><text x="{x + a + b / 2:.0f}" y="14">{html.escape(right)}</text>')
        x += a + b + 8
    return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{x - 8:.0f}" height="20" role="img">'
            f'<g fill="#fff" font-family="Verdana,DejaVu Sans,sans-serif" font-size="11" text-anchor="middle">{"".join(parts)}</g></svg>\n')


DRAWINGS = {"house": house, "architecture": architecture, "element": element, "step": step, "frames": frames, "badges": badges}


def main(names):
    if names == ["--check"]:
        return check()
    if names[:1] == ["--arrows"]:
        for tree in names[1:] or [ROOT]:
            graph = rooms(pathlib.Path(tree))
            upward = sum(a in reach(graph, b) for a in graph for b in graph[a])
            print(f"{tree}: {len(graph)} folders, {sum(map(len, graph.values()))} arrows, {len(direct(graph))} drawn, {upward} in a circle")
        return None
    for name in names or DRAWINGS:
        if name not in DRAWINGS:
            return f"drawings: unknown drawing '{name}'; choose from {' '.join(DRAWINGS)}"
        (ROOT / f"docs/{name}.svg").write_text(DRAWINGS[name](), encoding="utf-8")
    return None


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
