"""judge_mpm.py without newton: geometry of the cases, the way of a plate, records, the fit of the friction, mistakes.
test_mpm.py SOURCE"""
import collections
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import types

import numpy as np

SOURCE = pathlib.Path(sys.argv[1])
sys.path.insert(0, str(SOURCE / "lab/grains"))
import judge_mpm as mpm  # noqa: E402
from judge_cases import Case  # noqa: E402

RUN = mpm.grains_run()
STIFFNESS = 4000.0  # [N/m] of the ground in these tests


class Spring:
    """A bed that is a spring under a level plate and slows it along x by a third of the load."""

    mass, steps = 0.0, 0

    def collide(self, mass):
        self.mass = mass

    def step(self, pose, speed, dt):
        load = max(0.0, -STIFFNESS * pose[1])
        self.steps += 1
        return np.array([-load / 3 * (speed[0] > 0), 0, load, 0, -0.01 * load, 0])


def options(**others):
    return types.SimpleNamespace(**{"dt": 0.005, "travel": 0.001, "rows": 130, "ends": 0, **others})


def plates_are_closed_and_have_their_volume():
    texts = {text.split()[1] for text in mpm.cases(RUN).values()}
    worst = 0.0
    for text in sorted(texts):
        if text.startswith("sphere"):
            continue
        points, faces = mpm.plate_mesh(Case(f"x {text} 0 press:0.01@0.05").sole.outline)
        edges = collections.Counter((a, b) for face in faces.tolist() for a, b in zip(face, face[1:] + face[:1]))
        assert all(edges[b, a] == number == 1 for (a, b), number in edges.items()), text
        a, b, c = points[faces[:, 0]], points[faces[:, 1]], points[faces[:, 2]]
        volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
        worst = max(worst, abs(volume / (RUN.area_of(text)[0] * mpm.HEIGHT) - 1))
    print(f"{len(texts)} plates: volume beside area times height {worst:.1e} (of a disc 0.3 %: it has 48 corners)")
    assert worst < 0.004


def boxes_are_those_of_grains():
    case = Case("x disc:0.12 0 press:0.015@0.05 drag:0.03@0.05")
    for family in mpm.FITS:
        voxels = mpm.box_of(RUN, family, case, 0.01, 0)
        size = np.array(RUN.size_of(family))
        assert (voxels[:2] % 2 == 0).all() and (np.abs(0.01 * voxels - size) <= 0.0101).all(), (family, voxels)
    small = mpm.box_of(RUN, "sand", case, 0.01, 0.05)
    print(f"0.05 m around a disc of 0.12 m that is dragged 0.03 m: {0.01 * small} m, by hand 0.28 x 0.22 x 0.12")
    assert small.tolist() == [28, 22, 12]
    points = mpm.particles_of(small, 0.01, 2, 1)
    assert len(points) == 8 * small.prod() and (np.abs(points[:, :2]) <= 0.005 * small[:2]).all()
    assert points[:, 2].max() <= 0 and points[:, 2].min() >= -0.12
    cells = np.unique(np.floor(points / 0.005 + 1e-9).astype(int), axis=0)
    assert len(cells) == len(points), "one particle in each cell"
    assert (points == mpm.particles_of(small, 0.01, 2, 1)).all() and (points != mpm.particles_of(small, 0.01, 2, 2)).any()


def a_plate_goes_its_way():
    case = Case("x rect:0.1,0.1 0 press:0.02@0.05 press:-0.002@0.05 press:0.025@0.05")
    rows, costs = mpm.play(case, Spring(), options())
    for stage, depth in enumerate((0.02, -0.002, 0.025)):
        last = [row for row in rows if row["stage"] == stage][-1]
        assert abs(last["depth"] - depth) < 1e-9
    total = sum(way[1] for way in case.ways)
    forces = [(row["wrench"][2], STIFFNESS * max(row["depth"], 0)) for row in rows]
    print(f"{len(rows)} rows of {len(costs)} steps, {rows[-1]['time']:.4f} s of {total:.4f}; "
          f"force at 25 mm {forces[-1][0]:.1f} N, by hand {forces[-1][1]:.1f} at the end of the step")
    assert abs(rows[-1]["time"] - total) < 1e-9 and 100 < len(rows) < 150
    assert max(abs(force - hand) for force, hand in forces) < 0.001 * STIFFNESS  # a step goes at most 1 mm
    slow, _ = mpm.play(case, Spring(), options(travel=1e-4, rows=10**6))
    assert abs(slow[-1]["wrench"][2] - forces[-1][1]) < 1.001e-4 * STIFFNESS


def a_free_plate_falls_and_rests():
    fall = Case("x rect:0.1,0.1 0 drop:5@0.2,0.1")
    rows, _ = mpm.play(fall, types.SimpleNamespace(collide=lambda mass: None, step=lambda *pose: np.zeros(6)), options())
    hand = -mpm.Case("x rect:0.1,0.1 0 drop:5@0.2,0.1").start
    depth, exact = rows[-1]["depth"] + hand, 0.2 * 0.1 + 9.81 * 0.1**2 / 2
    print(f"falls {1e3 * depth:.2f} mm, by hand {1e3 * exact:.2f} and half a step's 9.81 dt t more")
    assert abs(depth - exact - 9.81 * 0.1 * 0.005 / 2) < 1e-9
    bed = Spring()
    rows, _ = mpm.play(Case("x rect:0.1,0.1 0 press:0.01@0.05 load:0.02@0.05"), bed, options())
    sunk = [row["sinkage"] for row in rows if row["stage"] == 1]
    load = [row["wrench"][2] for row in rows if row["stage"] == 1]
    print(f"load {bed.mass:.3f} kg, carried {min(load):.2f} to {max(load):.2f} N, sinks {1e3 * max(map(abs, sunk)):.3f} mm")
    assert abs(bed.mass * 9.81 - STIFFNESS * 0.00975) < 0.01 * STIFFNESS * 0.01 + 0.5
    assert max(map(abs, sunk)) < 1e-3 and abs(rows[-1]["path"] - 0.02) < 1e-9


def records_are_those_of_grains(folder):
    text = (SOURCE / "lab/grains" / "record.h").read_text()
    header = "".join(re.findall(r'"([^"]*)"', text[text.index('"time_s,stage'):text.index(";", text.index('"time_s,stage'))])).replace("\\n", "")
    assert header == mpm.COLUMNS, header
    rows, _ = mpm.play(Case("x rect:0.1,0.1 15 press:0.015@0.05"), Spring(), options())
    file = folder / "sand" / "x-1.csv"
    mpm.write_rows(file, rows)
    table = np.genfromtxt(file, delimiter=",", names=True)
    assert not list(folder.glob("*/*.part")) and len(table) == len(rows)
    last = table[-1]
    normal = last["force_x_n"] * math.sin(last["pitch_rad"]) + last["force_z_n"] * math.cos(last["pitch_rad"])
    print(f"centre of pressure {last['cop_x_m']:.5f} m, by hand {-last['moment_y_nm'] / normal:.5f}")
    assert abs(last["cop_x_m"] + last["moment_y_nm"] / normal) < 1e-4
    assert abs(last["depth_m"] - 0.015) < 1e-6 and abs(last["pitch_rad"] - math.radians(15)) < 1e-4


def the_force_of_grains_is_that_of_the_press(folder):
    """Mean over beds, and not over the drags of the same plate."""
    for name, force in (("disc120-1", 10), ("disc120-2", 14), ("disc120-load15-1", 99), ("disc120-swipe15-1", 99)):
        rows, _ = mpm.play(Case("x disc:0.12 0 press:0.025@0.05"), Spring(), options())
        mpm.write_rows(folder / "grains" / f"{name}.csv", [{**row, "wrench": np.array([0, 0, force, 0, 0, 0])} for row in rows])
    got = mpm.grains_force(types.SimpleNamespace(records=folder), "grains/disc120", Case("x disc:0.12 0 press:0.025@0.05"))
    print(f"force of two beds {got} N, by hand 12")
    assert abs(got - 12) < 1e-9


def friction_is_found():
    """The force of a press grows as measured: 0.86 at 0.40, 1.15 at 0.45."""
    tried = [[0.3, math.exp(5.8 * (0.3 - 0.426))]]
    while abs(math.log(tried[-1][1])) > 0.01 and len(tried) < 9:
        friction = mpm.next_friction(tried, 1.0)
        tried.append([friction, math.exp(5.8 * (friction - 0.426))])
    print("friction", ", ".join(f"{pair[0]:.4f}" for pair in tried))
    assert len(tried) <= 3 and abs(tried[-1][0] - 0.426) < 0.002


def mistakes_are_one_line(folder):
    (folder / "newton.py").write_text("raise ImportError(\"No module named 'newton'\")\n")
    old = folder / "old"
    old.mkdir()
    (old / "manifest.json").write_text(json.dumps({"newton": {"parameters": {"voxel": 0.02}}}))
    for args, text in ((("--out", folder / "new", "--friction", "0.4"), "pip install newton"), (("--seeds", "x"), "A or A-B"),
                       (("--only", "none"), "no case"), (("--voxel", "0"), "--voxel"), (("--out", old), "another --out")):
        run = subprocess.run([sys.executable, SOURCE / "lab/grains" / "judge_mpm.py", *map(str, args)], capture_output=True, text=True,
                             env={"PYTHONPATH": str(folder), "PATH": "/usr/bin:/bin"})
        print(*args, "->", run.stderr.strip())
        assert run.returncode == 2 and run.stderr.startswith("judge_mpm.py: ") and run.stderr.count("\n") == 1 and text in run.stderr
    assert not (folder / "new").exists()


def plates_are_half_a_grain_wider():
    args = types.SimpleNamespace(edge=0.5, run=RUN)
    every = mpm.cases(RUN)
    for key, grain in (("sand/square100", 0.005), ("fine/strip-tilt15", 0.0025)):
        without, wide = Case(every[key]).sole.outline, mpm.case_of(args, key, every[key]).sole.outline
        assert np.allclose(np.ptp(wide, 0) - np.ptp(without, 0), grain, atol=1e-9), key


if __name__ == "__main__":
    plates_are_half_a_grain_wider()
    plates_are_closed_and_have_their_volume()
    boxes_are_those_of_grains()
    a_plate_goes_its_way()
    a_free_plate_falls_and_rests()
    friction_is_found()
    with tempfile.TemporaryDirectory() as name:
        records_are_those_of_grains(pathlib.Path(name))
        the_force_of_grains_is_that_of_the_press(pathlib.Path(name))
        mistakes_are_one_line(pathlib.Path(name))
