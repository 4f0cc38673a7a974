"""lab/grains/walk.py lead: the feet of a walk on mild_merged, led through mild_merged, find about the forces of that walk, up and
forward; through ground of twice its strength they find more. The fit finds the numbers of grounds.json again, and the sole of
the G1, led deeper than its presses, bears about what it bears in grains. test_walk_lead.py SOURCE MILD"""
import argparse
import contextlib
import io
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

sys.dont_write_bytecode = True
SOURCE, MILD = pathlib.Path(sys.argv[1]), sys.argv[2]
sys.path.insert(0, str(SOURCE / "lab/grains"))
import walk  # noqa: E402
import walk_lead  # noqa: E402

NUMBERS = json.loads(walk.GROUNDS.read_text())["sand"]["mild_merged"]


def forces(folder, numbers):
    """Force up of the walk and of the model, and forward of both, in each window."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        walk_lead.compare(folder, walk.feet_of("sa01"), numbers, "mild_merged")
    rows = [line.split("ms", 1)[1].split() for line in printed.getvalue().splitlines() if " ms " in line]
    return [[float(word) for word in row[:4]] for row in rows]


def pressed(numbers, model, depths, speed=0.1):
    """Force up under the level sole of the G1, led down, at depths."""
    import mild
    ground = mild.Ground([walk_lead.sole_of(walk.feet_of("g1")[0])], walk_lead.material(numbers, model), dt=walk_lead.STEP)
    ground.inverse_inertia[:], ground.rotation[0] = 0, np.eye(3)
    table = []
    for step in range(round(depths[-1] / speed / ground.dt) + 1):
        ground.position[0] = 0, 0, -speed * ground.dt * step
        ground.velocity[0] = ground.free_velocity[0] = 0, 0, -speed, 0, 0, 0
        ground.solve()
        ground.advance()
        table.append((speed * ground.dt * step, ground.force[0, 2]))
    return np.interp(depths, *np.array(table).T)


def in_grains(family, depths):
    record = walk.pack.opened(walk.RECORDS / family / "g1-deep-11.csv").read_text().splitlines()
    table = np.genfromtxt(record, delimiter=",", names=True)
    return np.array([table["force_z_n"][np.abs(table["depth_m"] - depth) < 0.008].mean() for depth in depths])


def tilts(folder, slope):
    """What `lab/grains/walk.py tilt` says of feet that slide back and sink, each stance with a tilt of its own and a share of `slope` times the tangent of half of it."""
    rows, start, time, names = [], 0.0, 5e-3 * np.arange(80), "foot,time_s,ankle_x_m,ankle_z_m,roll_rad,pitch_rad,yaw_rad,force_x_n,force_z_n,depth_m"
    for tilt in np.linspace(-0.3, 0.1, 9):
        up = np.where(time > 0.05, 300.0, 0.0)
        rows += [(0, start + t, -0.2 * t, -0.15 * t, 0, tilt, 0, force * (0.02 + slope * np.tan(tilt / 2)), force, 0.05) for t, force in zip(time, up)]
        start += 1.0
    np.savetxt(folder / "grains" / "feet.csv", rows, delimiter=",", header=names, comments="", fmt="%.9g")
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        walk_lead.tilt_slopes(folder, -0.05)
    return printed.getvalue()


with tempfile.TemporaryDirectory() as name:
    (pathlib.Path(name) / "grains").mkdir()
    for slope in (1.0, -0.5):
        said = tilts(pathlib.Path(name), slope)
        print(said)
        assert "slides back and sinks, 9 stances" in said and f"slope {slope:+.2f} +- 0.0" in said and "rests" not in said
with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    (folder / "grains").mkdir()
    robot = walk.fitted(folder, "sa01")
    subprocess.run([MILD, "eval", "--robot", robot, "--policy", SOURCE / "lab/grains" / "walk" / "sand.safetensors", "--speed", "0.6", "--trials", "1", "--seconds", "3", "--task.physics_dt",
                    "0.0005", "--feet", folder / "grains" / "feet.csv", *walk.ground_of("sand", "mild_merged")], check=True, stdout=subprocess.DEVNULL)
    same, stiff = forces(folder, NUMBERS), forces(folder, {**NUMBERS, **{key: str(2 * float(NUMBERS[key])) for key in ("k_pen", "sigma_cone")}})
    print("force up of the walk, led, forward of the walk, led; up, led through twice the strength:", [(*a, b[1]) for a, b in zip(same, stiff)])
    assert len(same) == len(walk_lead.WINDOWS)
    assert all(abs(led / walked - 1) < 0.06 for walked, led, _, _ in same)  # 0.84 with the 77 elements of the SA01
    assert same[0][2] < -50 and all(abs(led - walked) < 0.05 * abs(walked) + 3 for _, _, walked, led in same)
    assert all(b[1] > 1.3 * a[1] for a, b in zip(same[1:], stiff[1:]))
with tempfile.TemporaryDirectory() as name:
    kept, walk.GROUNDS = walk.GROUNDS, pathlib.Path(name) / "grounds.json"
    walk.fit(argparse.Namespace(robot="sa01"))
    again, walk.GROUNDS = json.loads(walk.GROUNDS.read_text()), kept
for family, models in json.loads(walk.GROUNDS.read_text()).items():
    for model, numbers in models.items():
        for key, text in numbers.items():
            assert text == again[family][model][key] or abs(float(again[family][model][key]) / float(text) - 1) < 1e-3, (family, model, key)
DEPTHS = np.array([0.03, 0.05, 0.07, 0.09, 0.11])  # deeper than the presses of the fit
for family, model, within in (("sand", "mild_merged", 0.05), ("sand", "mild", 0.05), ("rolling", "mild_merged", 0.2)):
    law = pressed(json.loads(walk.GROUNDS.read_text())[family][model], model, DEPTHS)
    share = law / in_grains("sole" if family == "sand" else "sole_rolling", DEPTHS)
    print(f"{family}, {model}: force up under the G1's sole, of that in grains: {np.round(share, 2)}")
    assert (np.abs(share - 1) < within).all()
