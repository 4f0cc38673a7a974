#!/usr/bin/env python3
"""A robot walks on grains, and on the ground models that are fitted to them (lab/grains/README.md, "The robot walks on grains").

    lab/grains/walk.py fit                      the models' numbers from lab/grains/records.tar.xz, into lab/grains/walk/grounds.json
    lab/grains/walk.py grains --out out/walk    the walks on grains, by build/grains/grains; wants a GPU
    lab/grains/walk.py models --out out/walk    the same walks on the models, some seconds each
    lab/grains/walk.py mpm --out out/walk       the same walks on Newton's implicit MPM, by walk_mpm.py; wants a GPU
    lab/grains/walk.py lead --out out/walk      leads the feet of the walks on grains through mild_merged: forces after touchdown, side by side
    lab/grains/walk.py tilt --out out/walk      how the horizontal force of feet on grains grows with their tilt
    lab/grains/walk.py figure --out out/walk    OUT/walk.csv with a row for each stance, OUT/walks.json for each walk, and the figure
    lab/grains/walk.py video --out out/walk     a video of each walk on grains

Every walk is `mild eval` with the same policy, sensors, delays, seed and physics step; only the ground differs. What is there
already is not run again."""
import argparse
import configparser
import json
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import time

import walk_manifest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import pack  # noqa: E402

RECORDS = ROOT / "lab/grains" / "records.tar.xz"
GROUNDS = ROOT / "lab/grains" / "walk" / "grounds.json"
# Beds under the robot, and the families of presses that the models are fitted to, on beds about as deep and so as dense.
BEDS = {"sand": {"friction": 0.5, "rolling": 0}, "rolling": {"friction": 0.5, "rolling": 0.1}}
PRESSES = {"sand": "walk", "rolling": "walk_rolling"}
MODELS = ("mild", "mild_merged", "bekker", "ecc_quasi_3d")


def fail(text):
    print(f"walk.py: {text}", file=sys.stderr)
    sys.exit(2)


def feet_of(robot):
    """The sections of robot.ini that are feet."""
    ini, file = configparser.ConfigParser(inline_comment_prefixes=(";",)), ROOT / "robots" / robot / "robot.ini"
    if not ini.read(file):
        fail(f"--robot {robot}: no {file}")
    return [ini[section] for section in ini.sections() if section.startswith("foot.")]


# ---- the models' numbers ----

def fit(args):
    """As lab/grains/judge.py fits them, two level plates and a drag, but with elements of the robot's soles, as k_pen is that of one element,
    and with the plates as they are: a robot's soles on a model are not half a grain wider (judge_cases.Sole) either."""
    import judge
    import walk_lead
    from judge_entries import GroundEntry
    pitch = walk_lead.pitch_of(feet_of(args.robot)[0])
    records, grounds = judge.Records(pack.opened(RECORDS), 0), {}
    for family in BEDS:
        keys = [f"{PRESSES[family]}/{name}" for name in judge.FITS[family][0]]
        given = {key: (records.cases[key][0], judge.mean_rows(records.cases[key][1])) for key in keys}
        for model in MODELS:
            entry = GroundEntry(model, pitch=pitch)
            entry.fit(given, records.ground(PRESSES[family]))
            grounds.setdefault(family, {})[model] = {name: text for name, text in entry.material.as_dict().items() if name != "model"}
    GROUNDS.parent.mkdir(exist_ok=True)
    GROUNDS.write_text(json.dumps(grounds, indent=1) + "\n")


def ground_of(family, model):
    """Options of `mild eval`. All start from one preset, and every number of it is replaced."""
    numbers = json.loads(GROUNDS.read_text())[family][model]
    return ["--ground", "sand_loose", "--model", model, *(f"--ground.{name}={value}" for name, value in numbers.items())]


# ---- walks ----

def outline(robot):
    """Sole of the first foot, in the foot's frame, and its height there."""
    feet = feet_of(robot)
    points = [[float(word) for word in foot["outline"].split()] for foot in feet]
    if len(feet) != 2 or any(abs(a - b) > 1e-6 for a, b in zip(points[0][::2], points[1][::2])) or \
            any(abs(a + b) > 1e-6 for a, b in zip(points[0][1::2], points[1][1::2])):
        fail(f"robot {robot}: two soles that mirror each other are expected")
    return "polygon:" + ",".join(f"{value:g}" for value in points[0]), feet[0]["z"]


def fitted(out, robot):
    """The folder of the robot with as many elements as fit its soles: the 77 of the SA01's cover 24 % more than the sole that grains feel."""
    feet_of(robot)  # it is there
    folder = out / "robot" / robot
    shutil.copytree(ROOT / "robots" / robot, folder, dirs_exist_ok=True)
    file = folder / "robot.ini"
    file.write_text(re.sub(r"(?m)^elements *=.*", "elements = 0", file.read_text()))
    return folder


def walk(args, folder, speed, ground, trials, robot, program=None):
    """One `mild eval` into a folder, unless it is there."""
    if (folder / "eval.json").exists():
        return
    folder.mkdir(parents=True, exist_ok=True)
    words = [args.mild, "eval", "--robot", robot, "--policy", args.policy, "--speed", speed, "--trials", trials, "--seconds",
             args.seconds, "--seed", args.seed, "--jump", args.jump, *ground, "--task.physics_dt", args.dt, "--terrain.memory=true", "--threads", args.threads]
    for name in ("stances", "feet", "actions", "track"):
        words += [f"--{name}", folder / f"{name}.csv"]
    if program:
        words += ["--program", shlex.join(str(word) for word in program)]
    words += ["--json", folder / "eval.json"]
    walk_manifest.write(folder, words, args, on_grains=program is not None)
    begin = time.time()
    done = subprocess.run([str(word) for word in words])
    if done.returncode:
        fail(f"{folder}: mild eval ended with {done.returncode}")
    row = json.loads((folder / "eval.json").read_text())["rows"][0]
    ends = {end: count for end, count in row["ends"].items() if count and end != "time"}
    said = ", ".join(f"{name} {row[name]:.3f}" for name in ("velocity", "cot", "flight", "load_peak", "penetration", "rise", "stride")
                     if row.get(name) is not None)
    print(f"{folder}: {row['success']}/{row['trials']} upright {ends or ''}, {said}, {time.time() - begin:.0f} s", flush=True)


def folder_of(args, family, speed, ground):
    return args.out / family / speed / ground


def on_grains(args):
    sole, height = outline(args.robot)
    for family in args.families:
        for speed in args.speeds:
            folder = folder_of(args, family, speed, "grains")
            bed = {"grain": args.grain, "box": args.box, **BEDS[family], "settle": args.settle, "seeds": args.bed_seed,
                   "sole-height": args.sole_height, "stiffness": args.stiffness,
                   "reach": args.reach, "frames": args.frames, "track": abs(float(speed)) * args.seconds + 1.5}
            options = [word for name, value in bed.items() for word in (f"--{name}", value)]
            walk(args, folder, speed, ground_of(family, "mild"), 1, args.robot,
                 [args.program, "--sole", sole, "--sole-z", height, "--out", folder, *options])


def on_models(args):
    robot = fitted(args.out, args.robot)
    for family in args.families:
        for speed in args.speeds:
            for model in MODELS:
                walk(args, folder_of(args, family, speed, model), speed, ground_of(family, model), args.trials, robot)


def mpm_friction(args):
    """That which fits the level press of the same grains, with the same numbers of the solver (lab/grains/newton.tar.xz)."""
    if args.friction:
        return args.friction
    rows = json.loads(pack.opened(ROOT / "lab/grains" / "newton.tar.xz" / "manifest.json").read_text())
    had, wanted = rows["newton"]["parameters"], {"voxel": args.voxel, "iterations": args.iterations, "basis": "S2", "particles": 2}
    other = [name for name, value in wanted.items() if had[name] != value]
    if other:
        fail(f"lab/grains/newton.tar.xz was fitted with --{other[0]} {had[other[0]]}: give --friction")
    fit = rows["fits"]["sand/disc120"]
    return min(fit["tried"], key=lambda pair: abs(pair[1] - fit["grains"]))[0]


def on_mpm(args):
    """Only sand: its press has a friction."""
    (sole, height), friction = outline(args.robot), mpm_friction(args)
    solid = json.loads(pack.opened(RECORDS / "manifest.json").read_text())["sand"]["solid"]
    for speed in args.speeds:
        folder = folder_of(args, "sand", speed, "newton_mpm")
        ground = {"friction": friction, "plate-friction": BEDS["sand"]["friction"], "solid": sum(solid) / len(solid), "window": args.window,
                  "voxel": args.voxel, "iterations": args.iterations, "seed": args.bed_seed, "sole-height": args.sole_height}
        options = [word for name, value in ground.items() for word in (f"--{name}", value)]
        walk(args, folder, speed, ground_of("sand", "mild"), 1, args.robot,
             [args.python, ROOT / "lab/grains" / "walk_mpm.py", "--sole", sole, "--sole-z", height, "--out", folder, *options])


def draw_figure(args):
    import walk_pictures
    walk_pictures.write_stances(args.out, args.families, args.speeds, args.out / "walk.csv")
    walk_pictures.write_walks(args.out, args.families, args.speeds, args.out / "walks.json")
    for family in args.families:
        image = args.image if family == args.families[0] else args.image.with_stem(f"{args.image.stem}-{family}")
        walk_pictures.figure(args.out, family, args.speeds, image)
        print(image)


def lead(args):
    import walk_lead
    for family in args.families:
        for speed in args.speeds:
            folder = args.out / family / speed
            if not (folder / "grains" / "feet.csv").exists():
                fail(f"{folder}/grains/feet.csv is not there: lab/grains/walk.py grains")
            walk_lead.compare(folder, feet_of(args.robot), json.loads(GROUNDS.read_text())[family]["mild_merged"], "mild_merged")


def tilt(args):
    import walk_lead
    for family in args.families:
        for speed in args.speeds:
            if (args.out / family / speed / "grains" / "feet.csv").exists():
                walk_lead.tilt_slopes(args.out / family / speed, float(feet_of(args.robot)[0]["z"]))


def film(args):
    import walk_pictures
    for family in args.families:
        for speed in args.speeds:
            folder = folder_of(args, family, speed, "grains")
            file = args.out / f"{family}-{speed}.mp4"
            if not (folder / "frames-0.bin").exists():
                fail(f"{folder}/frames-0.bin is not there: lab/grains/walk.py grains")
            still = (args.still, file.with_suffix(".png")) if args.still >= 0 else None
            pictures, failed = walk_pictures.video(ROOT, args.robot, folder, args.draw, file, still)
            if failed:
                fail(f"{file}: ffmpeg or {args.draw} failed")
            print(f"{file}: {pictures} pictures")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("fit", "grains", "models", "mpm", "lead", "tilt", "figure", "video"))
    parser.add_argument("--out", default=ROOT / "out" / "walk", type=pathlib.Path)
    parser.add_argument("--mild", default=ROOT / "build" / "mild", type=pathlib.Path)
    parser.add_argument("--program", default=ROOT / "build" / "grains" / "grains", type=pathlib.Path)
    parser.add_argument("--draw", default=ROOT / "build" / "grains" / "grains_draw", type=pathlib.Path, help="of the video")
    parser.add_argument("--still", default=-1, type=int, help="picture of each video that is kept as PNG too")
    parser.add_argument("--robot", default="sa01")
    parser.add_argument("--policy", default=ROOT / "policies" / "mild.safetensors", type=pathlib.Path)
    parser.add_argument("--families", default="sand", type=lambda text: text.split(","), help="of " + ", ".join(BEDS))
    parser.add_argument("--speeds", default="0.3,0.6", type=lambda text: text.split(","))
    parser.add_argument("--seconds", default=10, type=float)
    parser.add_argument("--jump", default=0, type=float, help="[m] rise of jumps; --speeds are then their mean speeds")
    parser.add_argument("--seed", default=1, type=int, help="of the trials")
    parser.add_argument("--trials", default=10, type=int, help="on models; the first is that on grains")
    parser.add_argument("--dt", type=float, help="[s] physics step of the robot; default: 0.0005, on MPM 0.0025")
    parser.add_argument("--threads", default=0, type=int)
    parser.add_argument("--grain", default=0.005, type=float, help="[m]")
    parser.add_argument("--box", default="0.72,0.44,0.2", help="[m] of a settled bed, many of which make the way")
    parser.add_argument("--settle", default=0.7, type=float, help="[s]")
    parser.add_argument("--bed-seed", default=1, type=int)
    parser.add_argument("--stiffness", default=1e6, type=float, help="[Pa] of grains: normal stiffness over diameter; sound goes as its root, and so does the cost")
    parser.add_argument("--reach", default=0.3, type=float, help="[m] grains nearer to the middle of a sole move")
    parser.add_argument("--sole-height", default=0.06, type=float, help="[m] of the block that a foot is")
    parser.add_argument("--frames", default=25, type=float, help="[1/s] pictures of the grains")
    parser.add_argument("--python", default=sys.executable, help="of MPM: an interpreter that has newton")
    parser.add_argument("--voxel", default=0.01, type=float, help="[m] of MPM")
    parser.add_argument("--iterations", default=250, type=int, help="of MPM, in a step at most")
    parser.add_argument("--window", default="0.88,0.56,0.2", help="[m] of MPM: length, width and depth of the ground under the robot")
    parser.add_argument("--friction", type=float, help="of MPM; default: that of lab/grains/newton.tar.xz")
    parser.add_argument("--image", default=ROOT / "lab/grains/walk-on-grains.png", type=pathlib.Path)
    args = parser.parse_args()
    args.out = args.out.resolve()
    args.dt = args.dt or (0.0025 if args.what == "mpm" else 0.0005)
    try:
        {"fit": fit, "grains": on_grains, "models": on_models, "mpm": on_mpm, "lead": lead, "tilt": tilt, "figure": draw_figure, "video": film}[args.what](args)
    except ModuleNotFoundError as error:
        fail(f"{args.what} needs the Python package {error.name}: .venv/bin/python lab/grains/walk.py, after make setup")


if __name__ == "__main__":
    main()
