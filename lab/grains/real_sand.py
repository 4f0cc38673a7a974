#!/usr/bin/env python3
"""Ground models and a real sand (lab/grains/real-sand.md): discs and a wheel that were pressed into it, and the wheel rolling, skidding and
spinning there, measured by Pavlov and Johnson. Nothing here was measured by us.

    PYTHONPATH=build/python .venv/bin/python lab/grains/real_sand.py                       # discs and the pressed wheel, 90 s
    PYTHONPATH=build/python .venv/bin/python lab/grains/real_sand.py --roll                # and the driven wheel, in MuJoCo; minutes
    PYTHONPATH=build/python .venv/bin/python lab/grains/real_sand.py --figure lab/grains/real-sand.png
    .venv/bin/python lab/grains/real_sand.py --extract CLONE                               # the records again, from a clone of theirs

Records: lab/grains/real/press.csv and wheel.csv. --extract needs rosbags, scipy and git; CLONE is github.com/robomechanics/3d-terramechanics."""
import argparse
import csv
import io
import math
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
REAL = ROOT / "lab/grains/real"
RADIUS, WIDTH = 0.058, 0.050  # [m] of the smooth wheel (their set_rover_params.m)
DENSITY, ANGLE = 1330.0, 29.0  # [kg/m^3] of the bed, [degrees] of repose (their set_soil_params.m)
SPEED = 0.010  # [m/s] of the hub, whatever the wheel does
DISCS = {"disc60": 0.060, "disc80": 0.080, "disc100": 0.100}
BIN = 5e-4  # [m] of depth

# Their force_displacement_curve_processing.m, large sandbox, 2022-01-14: what was pressed, the files, the seconds from .. to, the height at
# which it touched [mm], what is to be added to the force sensor's zero [N]; there also for the wheels.
PRESSES = {
    "disc60": [("1", 11.03, 22, -9.62, 0.75), ("2", 13.73, 23.7, -8.55, 0), ("3", 10.97, 22.13, -9.58, 0.63)],
    "disc80": [("7", 12.65, 28, -8.72, 0), ("8", 9.9, 19.6, -9.33, 0.68), ("9", 12.08, 23.6, -9.45, 0.45)],
    "disc100": [("4", 11.67, 21.54, -9.0, 0.4), ("5", 9.39, 24.58, -9.68, 0), ("6", 9.6, 20, -9.42, 0)],
    "wheel": [("smooth_1", 10.2, 19.8, 9.98, -0.71), ("smooth_2", 9.89, 17.7, 2.15, -1), ("smooth_3", 9.49, 17.18, 3.67, -0.66)],
}
HOURS = 5  # by which the clock of the sensor was ahead of the axes'


def fail(text):
    print(f"real_sand.py: {text}", file=sys.stderr)
    sys.exit(2)


# ---- the records, from their repository ----

def blob(clone, path):
    return subprocess.run(["git", "-C", clone, "show", f"HEAD:{path}"], capture_output=True, check=True).stdout


def wrenches(clone, path):
    """Times [s] from the file's begin, forces [N] (n, 3), and the begin."""
    from rosbags.rosbag1 import Reader
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store, times, forces = get_typestore(Stores.ROS1_NOETIC), [], []
    with tempfile.NamedTemporaryFile(suffix=".bag") as file:
        file.write(blob(clone, path))
        file.flush()
        with Reader(file.name) as reader:
            types = {}
            for connection in reader.connections:
                text = getattr(connection.msgdef, "data", connection.msgdef)
                types.update(get_types_from_msg(text, connection.msgtype) if connection.msgtype not in store.fielddefs else {})
            store.register(types)
            for connection, _, raw in reader.messages():
                if connection.topic.endswith("forcetorque_readings"):
                    wrench = store.deserialize_ros1(raw, connection.msgtype).wrench
                    times.append(wrench.header.stamp.sec + 1e-9 * wrench.header.stamp.nanosec)
                    forces.append([getattr(wrench.wrench.force, axis) for axis in "xyz"])
            begin = 1e-9 * reader.start_time
    return np.array(times) - begin, np.array(forces), begin


def press_of(clone, name, first, last, touched, zero):
    """Depth [m] in bins and the mean force up [N] in each."""
    path = f"raw-data-processing/f-d-large-box/force-displacement_{name}"
    times, forces, begin = wrenches(clone, path + ".bag")
    _, still, _ = wrenches(clone, path + "_zero.bag")
    axes = np.genfromtxt(io.BytesIO(blob(clone, path + ".txt")), delimiter=",")
    up = -(forces[:, 2] - still[:, 2].mean() + zero)
    depth = -1e-3 * (np.interp(times, axes[:, 6] + 3600 * HOURS - begin, axes[:, 4]) - touched)
    keep = (times > first) & (times < last)
    place = np.floor(depth[keep] / BIN).astype(int)
    for k in range(1, place.max() + 1):
        if (place == k).any():
            yield (k + 0.5) * BIN, up[keep][place == k].mean()


def extract(clone):
    """Writes press.csv and wheel.csv, when all of both has been read."""
    import rosbags.rosbag1  # noqa: F401
    import scipy.io

    pressed = [[shape, trial, f"{depth:.5f}", f"{force:.2f}"] for shape, trials in PRESSES.items() for trial, args in enumerate(trials, 1)
               for depth, force in press_of(clone, *args)]
    table = scipy.io.loadmat(io.BytesIO(blob(clone, "raw-data-processing/all_smooth_data.mat")), squeeze_me=True, struct_as_record=False)
    driven = [[t.Vry, t.beta, f"{t.avg_Fy:.2f}", f"{t.avg_Fx:.2f}", f"{-t.avg_Fz:.2f}", f"{-t.avg_Z:.2f}"]
              for t in sorted(table["all_results"], key=lambda t: (t.beta, t.Vry))]
    write("press.csv", "shape,trial,depth_m,force_n", pressed)
    write("wheel.csv", "rim_mm_s,angle_deg,drag_n,side_n,load_n,sinkage_mm", driven)


def write(name, head, rows):
    with open(REAL / name, "w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([head.split(","), *rows])


def presses():
    """{shape: [(depth, force), ...]}, a pair of arrays for each trial."""
    found = {}
    with open(REAL / "press.csv", newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            found.setdefault(row["shape"], {}).setdefault(row["trial"], []).append((float(row["depth_m"]), float(row["force_n"])))
    return {shape: [np.array(trial).T for trial in trials.values()] for shape, trials in found.items()}


def wheels(angle=0):
    """{speed of the rim [mm/s]: mean and spread over the trials of (drag [N], load [N], sinkage [mm])}."""
    found = {}
    with open(REAL / "wheel.csv", newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if float(row["angle_deg"]) == angle:
                found.setdefault(float(row["rim_mm_s"]), []).append([float(row[name]) for name in ("drag_n", "load_n", "sinkage_mm")])
    return {rim: (np.mean(rows, 0), np.std(rows, 0, ddof=1) if len(rows) > 1 else np.full(3, math.nan)) for rim, rows in found.items()}


# ---- the models ----

def rim(sides=60):
    """Vertices and triangles of the wheel, its lowest point at the origin, its axis along y."""
    angle = 2 * math.pi * np.arange(sides) / sides
    ring = np.stack([RADIUS * np.sin(angle), np.zeros(sides), RADIUS * (1 - np.cos(angle))], axis=1)
    points = np.concatenate([ring + (0, y, 0) for y in (-WIDTH / 2, WIDTH / 2)] + [[(0, y, RADIUS)] for y in (-WIDTH / 2, WIDTH / 2)])
    left, right, faces = 2 * sides, 2 * sides + 1, []
    for a in range(sides):
        b = (a + 1) % sides
        faces += [(a, sides + b, b), (a, sides + a, sides + b), (left, a, b), (right, sides + b, sides + a)]
    return points, np.array(faces)


def make_wheel(judge_cases):
    """The wheel as the judge's functions take a sole: squares of its lower half."""
    wheel = judge_cases.Sole(f"rect:{2 * RADIUS},{WIDTH}", 0.002)
    wheel.z = RADIUS - np.sqrt(np.maximum(RADIUS**2 - wheel.x**2, 0))
    return wheel


def loose_heaps(fitted, data):
    """Laws of loose sand, fitted to the discs `fitted`: both numbers, one with u^1, and both with the mean e of a wheel."""
    import judge_cases
    import judge_loose

    soles = [judge_cases.Sole(f"disc:{DISCS[name]}", 0.001) for name in fitted]
    depths, forces = zip(*(np.hstack(data[name]) for name in fitted))
    made = {"loose_heap": judge_loose.LooseHeap(), "loose_linear": judge_loose.LooseHeap(1.0), "loose_mean": judge_loose.LooseHeap(mean=True)}
    return {name: heap.fit_presses(soles, depths, forces) for name, heap in made.items()}


def entries(fitted, data):
    """(name, force(shape, depths)) of each model, fitted to the discs `fitted`."""
    import judge_cases
    import judge_entries as judge
    import mild

    soles = {name: judge_cases.Sole(f"disc:{size}", 0.001) for name, size in DISCS.items()} | {"wheel": make_wheel(judge_cases)}
    points, faces = rim()
    # a bin as a row: those of the trials one after the other, each of its own disc
    depth = [np.concatenate([d for d, _ in data[name]]) for name in fitted]
    force = [np.concatenate([f for _, f in data[name]]) for name in fitted]

    def ground(model, material, pitch=0.005):
        def push(shape, depths):
            if shape == "wheel":
                if model.startswith("con_"):
                    return None
                sole = mild.Sole.surface([{"type": "mesh", "vertices": points, "triangles": faces}], pitch, pitch)
            else:
                sole = mild.Sole(soles[shape].outline, pitch)
                sole = sole.concentric() if model.startswith("con_") else sole
            made, found, z, speed, dt = mild.Ground([sole], material, dt=1e-3), [], 5e-4, 2.5e-3, 1e-3
            while -z < depths[-1]:
                judge.ground_step(made, (np.array([0.0, 0.0, z, 0.0, 0.0]), np.array([0.0, 0.0, -speed, 0.0, 0.0])), 0.0, dt)
                z -= dt * speed
                found.append((-z, made.force[0, 2]))
            return np.interp(depths, *np.array(found).T)
        return push

    for model in (name for name in mild.models() if name != "rigid"):
        plates = [mild.Sole(soles[name].outline, 0.005) for name in fitted]
        plates = [plate.concentric() for plate in plates] if model.startswith("con_") else plates
        hold = {"alpha": 0.3} if model in ("mild", "mild_merged", "con_cone") else None
        material = mild.GroundFit(plates, model, hold=hold).fit([d[:, None] for d in depth], force).material_
        loose = {"mu": 0, "k_drift": 0, "b_drift": 0} if model.startswith("ecc_quasi") else {"mu": math.tan(math.radians(ANGLE))}
        yield model, ground(model, mild.Material(material, phi=0.5, rho=2 * DENSITY, **loose)), mild.Material(material, **loose)
    stress = judge.rft_stress({"density": DENSITY, "solid": [1.0]}, math.tan(math.radians(ANGLE)))
    rft = mild.Material("sand_loose", model="ecc_quasi_3d", zeta=stress / 1e6, mu=0, k_drift=0, b_drift=0)
    yield "3d_rft", ground("ecc_quasi_3d", rft), None
    volume = np.concatenate([d * soles[name].area.sum() for d, name in zip(depth, fitted)])
    law = judge.Archimedes()
    law.stress = float(volume @ np.concatenate(force) / (volume @ volume))
    functions = {"chrono_scm": judge.chrono_scm, "wong_sand": judge.wong_sand, "archimedes": law, **loose_heaps(fitted, data)}
    for name, function in functions.items():
        yield name, lambda shape, depths, f=function: np.array([f(d, 0.0, 0.0, soles[shape])[2] for d in depths]), None


def deepest(trials):
    """Where all trials are and the depths are the deepest 40 %; the mean force of each trial there."""
    end = min(depth[-1] for depth, _ in trials)
    keep = [(depth > 0.6 * end) & (depth <= end) for depth, _ in trials]
    return np.arange(0.6 * end, end, BIN), np.array([force[k].mean() for (_, force), k in zip(trials, keep)])


def judge_presses(data, fitted, models=()):
    """Prints errors of the mean force at the deepest 40 % of the way. models: of all, or those."""
    print(f"\nfitted to {' and '.join(fitted)}: error of the mean force over the deepest 40 % of the way [%]\n"
          f"{'':14s}" + "".join(f"{shape + ' fit' * (shape in fitted):>14s}" for shape in data))
    places = {shape: deepest(trials) for shape, trials in data.items()}
    print(f"{'measured [N]':14s}" + "".join(f"{forces.mean():14.1f}" for _, forces in places.values()))
    print(f"{'spread [%]':14s}" + "".join(f"{100 * forces.std(ddof=1) / forces.mean():14.1f}" for _, forces in places.values()))
    for name, push, _ in entries(fitted, data):
        if models and name not in models:
            continue
        cells = []
        for shape, (depths, forces) in places.items():
            got = push(shape, depths)
            cells.append(f"{'-':>14s}" if got is None else f"{100 * (got.mean() / forces.mean() - 1):+14.0f}")
        print(f"{name:14s}" + "".join(cells), flush=True)
    for name, heap in loose_heaps(fitted, data).items():
        if not models or name in models:
            print(f"{name}: p = {heap.bears:.4g} u^{heap.power:.3f} e [Pa]")


# ---- the driven wheel ----

SLIPS = {"slip_length": 0.0024, "regain_length": 0.00067, "slip_growth": 0.07, "grip": 0.12}  # of grains of 5 mm (lab/grains/README.md)


def roll(ground, speed, load, seconds):
    """Drag [N] and sinkage [mm], means over the last fifteenth of the time, as measured (70 to 75 s)."""
    import mujoco
    sys.path.insert(0, str(ROOT / "scripts"))
    import rover_wheel

    text = rover_wheel.rig(ground, 0.006, rover_wheel.rim(60, RADIUS, WIDTH), RADIUS, load, timestep=0.002)
    model = mujoco.MjModel.from_xml_string(text)
    data, rows = mujoco.MjData(model), []
    data.qvel[:] = SPEED, 0, speed / RADIUS
    while data.time < seconds:
        mujoco.mj_step(model, data)
        if data.time > 14 / 15 * seconds:
            rows.append((-data.sensor("feel").data[0], -1e3 * (data.qpos[1] + 1e-4)))
    return np.mean(rows, axis=0)


def judge_roll(data, fitted, seconds, models):
    """Prints drag and sinkage of the wheel beside those of the models, fitted to discs, with the friction of the angle of repose."""
    import mild
    import mujoco

    mujoco.mj_loadPluginLibrary(os.environ.get("MILD_PLUGIN") or str(ROOT / "build/mujoco_plugin/libmild_plugin.so"))
    found = {name: material for name, _, material in entries(fitted, data) if material is not None}
    found |= {"mild_slips": mild.Material(found["mild"], **SLIPS), "mild_merged": mild.Material(found["mild_merged"], phi=0.5, rho=2 * DENSITY, **SLIPS)}
    measured = wheels()
    print(f"\nfitted to {' and '.join(fitted)}: drag [N] and sinkage [mm] of the wheel after {seconds:g} s at 10 mm/s\n"
          f"{'rim [mm/s]':14s}" + "".join(f"{speed:14g}" for speed in measured))
    print(f"{'load [N]':14s}" + "".join(f"{mean[1]:14.1f}" for mean, _ in measured.values()))
    print(f"{'measured':14s}" + "".join(f"{mean[0]:8.1f}{mean[2]:6.1f}" for mean, _ in measured.values()))
    print(f"{'spread':14s}" + "".join(f"{spread[0]:8.1f}{spread[2]:6.1f}" for _, spread in measured.values()))
    rolled = []
    with tempfile.TemporaryDirectory() as folder:
        for name in models:
            file = pathlib.Path(folder) / f"{name}.ini"
            found[name].save(file)
            cells = [roll(file, 1e-3 * speed, mean[1], seconds) for speed, (mean, _) in measured.items()]
            print(f"{name:14s}" + "".join(f"{drag:8.1f}{sunk:6.1f}" for drag, sunk in cells), flush=True)
            rolled += [[name, speed, f"{drag:.1f}", f"{sunk:.1f}"] for speed, (drag, sunk) in zip(measured, cells)]
    if seconds == 75 and list(models) == list(ROLLED):
        write("rolled.csv", "model,rim_mm_s,drag_n,sinkage_mm", rolled)


# ---- the picture ----

COLOURS = {"mild": "tab:blue", "mild_slips": "tab:green", "mild_merged": "tab:red", "bekker": "tab:purple", "ecc_quasi": "tab:orange"}


def draw(data, path):
    """Pressure under the discs, sinkage and drag of the wheel: measured, and models fitted to the middle disc."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(13, 4.2))
    pushes = {name: push for name, push, _ in entries(["disc80"], data) if name in COLOURS}
    two = next(push for name, push, _ in entries(["disc60", "disc100"], data) if name == "bekker")
    for shade, (shape, size) in zip(("0.65", "0.35", "0.0"), DISCS.items()):
        area, depths = math.pi * size**2 / 4, np.arange(5e-4, max(d[-1] for d, _ in data[shape]), 5e-4)
        for trial, (depth, force) in enumerate(data[shape]):
            left.plot(1e3 * depth, 1e-3 * force / area, color=shade, lw=1, label=None if trial else f"measured, {1e3 * size:.0f} mm")
        for name, push in pushes.items():
            left.plot(1e3 * depths, 1e-3 * push(shape, depths) / area, "--", color=COLOURS[name], lw=1, label=name if shape == "disc80" else None)
        left.plot(1e3 * depths, 1e-3 * two(shape, depths) / area, ":", color=COLOURS["bekker"], lw=1.5,
                  label="bekker, fitted to 60 and 100" if shape == "disc80" else None)
    left.set(xlabel="depth [mm]", ylabel="mean pressure [kPa]", xlim=(0, 32), ylim=(0, 60), title="three discs, models fitted to 80 mm")
    measured, rolled = wheels(), {}
    with open(REAL / "rolled.csv", newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            rolled.setdefault(row["model"], []).append([float(row[name]) for name in ("rim_mm_s", "drag_n", "sinkage_mm")])
    place = {speed: k for k, speed in enumerate(measured)}
    for axes, column, name in ((middle, 2, "sinkage [mm]"), (right, 0, "drag [N]")):
        axes.errorbar(range(len(place)), [mean[column] for mean, _ in measured.values()], [spread[column] for _, spread in measured.values()], fmt="ks",
                      ms=4, label="measured")
        for model, rows in rolled.items():
            if model in COLOURS:
                axes.plot([place[row[0]] for row in rows], [row[2 if column == 2 else 1] for row in rows], ".-", lw=1, color=COLOURS[model], label=model)
        axes.set(xlabel="speed of the rim [mm/s], hub at 10", ylabel=name)
        axes.set_xticks(range(len(place)), [f"{speed:g}" for speed in place])
    middle.set_title("a wheel under 20 to 26 N: sinkage")
    right.set_title("its drag")
    for axes in (left, middle):
        axes.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


ROLLED = ("mild", "mild_slips", "mild_merged", "bekker", "ecc_quasi", "ecc_quasi_3d", "ecc_spring")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--extract", metavar="CLONE", help="writes the records")
    parser.add_argument("--roll", action="store_true", help="the driven wheel, too")
    parser.add_argument("--seconds", type=float, default=75, help="of its way (default 75, as measured)")
    parser.add_argument("--models", default=",".join(ROLLED), help="on whose ground it is driven")
    parser.add_argument("--figure", metavar="FILE", help="draws it and judges nothing; needs matplotlib")
    given = parser.parse_args()
    for name in given.models.split(","):
        if name not in ROLLED:
            fail(f"--models {name}: choose from {' '.join(ROLLED)}")
    try:
        if given.extract:
            extract(given.extract)
            return
        data = presses()
    except ImportError as error:
        fail(f"--extract needs {error.name}: pip install rosbags scipy")
    except subprocess.CalledProcessError as error:
        fail(f"--extract {given.extract}: {error.stderr.decode().strip() or 'no such repository'}")
    except OSError as error:
        fail(f"{error.filename}: {error.strerror}; --extract makes the records")
    if given.figure:
        draw(data, given.figure)
        return
    for fitted in (["disc80"], ["disc60", "disc100"]):
        judge_presses(data, fitted)
    if given.roll:
        judge_roll(data, ["disc80"], given.seconds, given.models.split(","))


if __name__ == "__main__":
    main()
