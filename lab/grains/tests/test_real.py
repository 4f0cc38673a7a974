"""lab/grains/real_sand.py: the records are whole, the wheel is a wheel, and lab/grains/real-sand.md says what the models say. Usage: test_real.py
SOURCE_FOLDER, with the mild package in PYTHONPATH."""
import contextlib
import csv
import io
import math
import pathlib
import re
import sys

import numpy as np

root = pathlib.Path(sys.argv[1]).resolve()
sys.path.insert(0, str(root / "lab/grains"))
import judge_cases  # noqa: E402
import judge_loose  # noqa: E402
import mild  # noqa: E402
import real_sand  # noqa: E402


LOOSE = ("loose_heap", "loose_linear", "loose_mean")


def records():
    data = real_sand.presses()
    assert list(data) == ["disc60", "disc80", "disc100", "wheel"] and all(len(trials) == 3 for trials in data.values())
    for name, trials in data.items():
        depths, forces = real_sand.deepest(trials)
        assert forces.std(ddof=1) < 0.05 * forces.mean() and 0.01 < depths[0] < depths[-1] < 0.045, name
    at = {name: np.mean([np.interp(0.01, depth, force) for depth, force in trials]) for name, trials in data.items()}
    pressure = {name: at[name] / (math.pi * size**2 / 4) for name, size in real_sand.DISCS.items()}
    assert [round(value / 1e3, 1) for value in pressure.values()] == [7.7, 10.4, 13.7], pressure  # lab/grains/real-sand.md
    assert math.log(pressure["disc100"] / pressure["disc60"]) / math.log(100 / 60) > 1.0
    assert len((root / "lab/grains/real/wheel.csv").read_text().splitlines()) == 190
    measured = real_sand.wheels()
    assert list(measured) == [0, 3, 5, 8, 10, 12, 20, 40, 100] and all(19 < mean[1] < 26 for mean, _ in measured.values())
    assert measured[0][0][0] > 38 and measured[100][0][0] < 0  # locked it is dragged, spinning it pulls
    assert not real_sand.wheels(7)


def wheel():
    """On springs a pressed wheel is carried by its volume under the surface."""
    points, faces = real_sand.rim()
    edges = np.sort(np.concatenate([faces[:, pair] for pair in ([0, 1], [1, 2], [2, 0])]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()  # closed
    a, b, c = (points[faces[:, k]] for k in range(3))
    volume = (a * np.cross(b, c)).sum() / 6
    assert abs(volume / (math.pi * real_sand.RADIUS**2 * real_sand.WIDTH) - 1) < 0.003, volume  # counterclockwise from outside
    sole = mild.Sole.surface([{"type": "mesh", "vertices": points, "triangles": faces}], 0.005, 0.005)
    soft = mild.Material("sand_loose", model="ecc_spring", k_pen=100.0, mu=0, k_drift=0, b_drift=0)
    ground, depth = mild.Ground([sole], soft, dt=1e-3), 0.02
    for z in np.arange(0, depth + 1e-9, 2e-5):
        real_sand_step(ground, -z)
    angle = math.acos(1 - depth / real_sand.RADIUS)
    under = real_sand.RADIUS**2 * (angle - math.sin(angle) * math.cos(angle)) * real_sand.WIDTH
    square = 0.05 * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    flat = mild.Ground([mild.Sole(square, 0.005)], soft, dt=1e-3)
    for z in np.arange(0, depth + 1e-9, 2e-5):
        real_sand_step(flat, -z)
    assert abs(ground.force[0, 2] / under / (flat.force[0, 2] / (0.01 * depth)) - 1) < 0.02, (ground.force[0, 2], under, flat.force[0, 2])


def real_sand_step(ground, z):
    import judge_entries

    judge_entries.ground_step(ground, (np.array([0.0, 0.0, z, 0.0, 0.0]), np.array([0.0, 0.0, -0.02, 0.0, 0.0])), 0.0, 1e-3)


def loose():
    """p = b u^n e: distances to the free edge of plates, a ball, a wheel and a tilted plate; what made a force is found again."""
    disc, plate, ball = (judge_cases.Sole(text, 0.001) for text in ("disc:0.06", "rect:0.12,0.06", "sphere:0.05"))
    edge = judge_loose.free_edge
    assert abs(edge(disc, 0.01, 0).mean() / 0.01 - 1) < 0.01  # D/6; the disc has 48 sides
    assert abs(edge(plate, 0.01, 0).mean() / (0.06 * (3 * 0.12 - 0.06) / (12 * 0.12)) - 1) < 0.001  # a roof by its area
    half = math.sqrt(0.05**2 - 0.03**2)  # of the ball 20 mm deep
    assert abs((edge(ball, 0.02, 0) * ball.area).sum() / (math.pi * half**3 / 3) - 1) < 0.005
    rim = real_sand.make_wheel(judge_cases)
    half, wide = math.sqrt(real_sand.RADIUS**2 - (real_sand.RADIUS - 0.02) ** 2), real_sand.WIDTH
    assert abs((edge(rim, 0.02, 0) * rim.area).sum() / (wide**2 * (3 * 2 * half - wide) / 12) - 1) < 0.01
    tilted = edge(plate, 0.0, math.radians(30))  # its front half is under water, and the line is its middle
    assert (tilted[plate.x < 0] == 0).all() and abs(tilted.max() - 0.03) < 0.002 and abs(tilted[plate.x > 0.03].max() - 0.03) < 0.001
    near = (plate.x > 0) & (plate.x < 0.01) & (abs(plate.y) < 0.01)
    assert np.allclose(tilted[near], plate.x[near])

    law = judge_loose.LooseHeap(1.3)
    law.bears = 3e8
    depths = np.linspace(0, 0.03, 31)
    forces = [np.array([law(u, 0, 0, sole)[2] for u in depths]) for sole in (disc, plate)]
    assert abs(forces[0][-1] / (3e8 * 0.03**1.3 * math.pi * 0.03**3 / 3) - 1) < 0.02
    found = judge_loose.LooseHeap().fit_presses((disc, plate), (depths, depths), forces)
    assert abs(found.power - 1.3) < 1e-9 and abs(found.bears / 3e8 - 1) < 1e-9
    straight = judge_loose.LooseHeap(1.0).fit_presses((disc, plate), (depths, depths), forces)
    assert straight.power == 1 and straight.bears < 0.5 * 3e8
    assert law(0.02, 0, 0, plate)[2] > 0 == law(0.02, 0, 0, plate)[0] and law(-0.01, 0, 0, plate)[2] == 0
    mean = judge_loose.LooseHeap(1.0, mean=True)
    mean.bears = straight.bears
    assert abs(mean(0.02, 0, 0, plate)[2] / straight(0.02, 0, 0, plate)[2] - 1) < 1e-9  # a level plate has one depth
    assert mean(0.02, 0, 0, ball)[2] < 0.9 * straight(0.02, 0, 0, ball)[2]  # depth and distance are greatest together


def page():
    """Of lab/grains/real-sand.md: the rows of mild, mild_merged and 3D-RFT fitted to one disc, of bekker to two."""
    with contextlib.redirect_stdout(io.StringIO()) as said:
        real_sand.judge_presses(real_sand.presses(), ["disc80"], ("mild", "mild_merged", "3d_rft", *LOOSE))
    rows = [line.split() for line in said.getvalue().splitlines() if line.startswith(("mild", "3d_rft", "loose")) and ":" not in line]
    found = {name: [int(cell) for cell in cells] for name, *cells in rows}
    alone = {name: found[name] for name in LOOSE}
    text = (root / "lab/grains/real-sand.md").read_text(encoding="utf-8")
    for name, row in (("mild", r"\| `mild`, `hunt_crossley` \|"), ("mild_merged", r"\| `mild_merged` \|"), ("3d_rft", r"\| 3D-RFT[^|]*\|")):
        cells = re.search(row + r"([^|]*)\|([^|]*)\|([^|]*)\|", text).groups()
        says = [int(re.search(r"[-+]?\d+", cell).group()) for cell in cells]
        assert says == [found[name][0], found[name][2], found[name][3]], (name, says, found[name])
    with contextlib.redirect_stdout(io.StringIO()) as said:
        real_sand.judge_presses(real_sand.presses(), ["disc60", "disc100"], ("bekker", *LOOSE))
    found = [int(x) for line in said.getvalue().splitlines() if line.startswith("bekker") for x in line.split()[1:]]
    says = [int(x) for x in re.findall(r"[-+]\d+", re.search(r"\n\| `bekker` \|(.*)", text).group(1))[3:]]
    assert says == found and max(map(abs, found[:3])) < 10, (says, found)  # k_c below 0: pressure that grows with the disc
    rows = [line.split() for line in said.getvalue().splitlines() if line.startswith("loose") and ":" not in line]
    two = {name: [int(cell) for cell in cells] for name, *cells in rows}
    for name, row in two.items():
        says = [int(x) for x in re.findall(r"[-+]\d+", re.search(rf"\n\| `{name}`[^|]*\|(.*)", text).group(1))]
        assert says == [alone[name][0], *alone[name][2:], *row], (name, says, alone[name], row)
    assert list(two) == list(LOOSE) and max(map(abs, two["loose_heap"])) < 8 and abs(alone["loose_heap"][3]) < 4
    powers = re.findall(r"^loose_heap: p = \S+ u\^(\S+) e", said.getvalue(), re.M)
    assert powers == ["1.375"], powers


def page_of_wheel():
    """Its rows of the driven wheel are those of the records, and the mean errors are of these rows."""
    text = (root / "lab/grains/real-sand.md").read_text(encoding="utf-8")
    rolled, measured = {}, real_sand.wheels()
    with open(root / "lab/grains/real/rolled.csv", newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            rolled.setdefault(row["model"], []).append((float(row["drag_n"]), float(row["sinkage_mm"])))
    sunk, drag = ([mean[k] for mean, _ in measured.values()] for k in (2, 0))
    rows = {r"\*\*measured\*\*": (drag, sunk), "`mild`, slips": tuple(zip(*rolled["mild_slips"])),
            "`mild_merged` with the same": tuple(zip(*rolled["mild_merged"]))}
    for name, numbers in rows.items():
        found = re.findall(rf"^\| {name} \|(.*)\|$", text, re.M)
        says = [[float(x) for x in re.findall(r"-?\d+\.\d+", line)] for line in found]
        assert len(says) == 2, name
        for cells, wanted in zip(says, (numbers[1], numbers[0])):
            assert all(abs(a - b) <= 0.051 for a, b in zip(cells, wanted, strict=False)) and len(cells) >= 9, (name, cells, wanted)
        if "measured" not in name:
            assert abs(says[0][9] - np.mean(np.abs(np.subtract(numbers[1], sunk))[5:])) < 0.06, name


records()
wheel()
loose()
page()
page_of_wheel()
print("real sand: records, wheel and page")
