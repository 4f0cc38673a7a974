"""scripts/judge_pressure.py and loose_grains.py find what they are given: bands filled by the law have the law's pressure, a cone its reach,
and discs that grow by powers their exponents. Usage: test_pressure.py SOURCE_FOLDER, with the mild package in PYTHONPATH."""
import contextlib
import io
import math
import pathlib
import re
import sys
import tempfile

import numpy as np

root = pathlib.Path(sys.argv[1]).resolve()
sys.path.insert(0, str(root / "scripts"))
import judge_pressure  # noqa: E402
import loose_grains  # noqa: E402
import real_sand  # noqa: E402
from judge import Records  # noqa: E402
from judge_cases import Sole  # noqa: E402

BANDS, WIDTH = 64, 0.0025
records = Records(root / "grains" / "records")


def write(folder, name, way, pressure):
    """Two beds; pressure: depth -> far [m], area [m^2], [Pa] of squares."""
    (folder / "sand").mkdir(exist_ok=True)
    for seed in (1, 2):
        lines = ["time_s,depth_m,band_m,force_z_n..."]
        for depth in np.linspace(0.0005, way, 40):
            far, area, p = pressure(depth)
            up = np.bincount(np.minimum(far / WIDTH, BANDS - 1).astype(int), area * p * (0.99 if seed == 1 else 1.01), BANDS)
            lines.append(",".join(f"{x:.6g}" for x in (0, depth, WIDTH, *up)))
        (folder / "sand" / f"{name}-{seed}-bands.csv").write_text("\n".join(lines) + "\n")


def printed(folder, line):
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        judge_pressure.print_case(records, folder, "sand", line, WIDTH)
    head, _, *rows = text.getvalue().splitlines()
    return head, np.array([[float(x) for x in re.findall(r"\d+\.\d+", row)] for row in rows])


def the_law_is_found(folder):
    material = judge_pressure.fitted_law(records, "sand")
    sole = Sole("disc:0.12", 0.001, records.edge("sand"))
    write(folder, "disc120", 0.025, lambda depth: judge_pressure.law_at(material, sole, depth))
    head, rows = printed(folder, judge_pressure.CASES["sand"][2][0])
    assert abs(float(re.search(r"mild_merged ([+-]\d+)", head)[1])) <= 1, head
    assert len(rows) >= 5 and np.abs(rows[:, 2] / rows[:, 4] - 1).max() < 0.01, rows
    assert rows[-1, 4] > 1.5 * rows[0, 4] and np.all(rows[:, 3] < 0.03 * rows[:, 2])


def a_cone_has_its_reach(folder):
    radius = 0.1 + records.edge("sand")
    x, y = np.meshgrid(np.arange(-0.1, 0.1, 0.0005), np.arange(-0.1, 0.1, 0.0005))
    far, area = np.hypot(x, y).ravel(), np.full(x.size, 0.0005**2)

    def pressure(depth):
        reach = 1.1 * math.sqrt(2 * radius * depth - depth**2)
        return far, area, 1e5 * np.maximum(reach - far, 0)
    write(folder, "ball200-24", 0.024, pressure)
    head, rows = printed(folder, judge_pressure.CASES["sand"][2][3])
    assert abs(float(re.search(r"reach (\d\.\d+)", head)[1]) - 1.1) <= 0.011, head
    assert np.all(np.diff(rows[:, 2]) < 0)


def powers_have_their_exponents():
    depths = np.linspace(0.0005, 0.025, 200)
    discs = {name: [(depths, math.pi * size**2 / 4 * 3e5 * size**0.4 * depths**0.6)] * 2 for name, size in real_sand.DISCS.items()}
    assert np.abs(loose_grains.exponents(discs) - (0.4, 0.6)).max() < 0.01


with tempfile.TemporaryDirectory() as name:
    the_law_is_found(pathlib.Path(name))
    a_cone_has_its_reach(pathlib.Path(name))
powers_have_their_exponents()
print("pressure: the law, a cone, powers")
