#!/usr/bin/env python3
"""Runs the list of grain simulations (lab/grains/README.md) and keeps their records.

    lab/grains/run.py --list                                what there is, and what it is expected to cost
    lab/grains/run.py --program build/grains/grains --gpus 0,1     what lab/grains/records.tar.xz lacks, into out/records
    lab/grains/run.py --only 'sand/disc120' --out out/again        one case again, to compare
    lab/grains/run.py --have out/again --out new --seconds 500         what out/again lacks, as far as the time goes

A block is one start of the program: beds of one family, which settle once, and some cases on all of them. Blocks are in the
order in which they are worth having; an interrupted run goes on where it stopped, case by case. Records are
OUT/FAMILY/CASE-SEED.csv, and manifest.json beside them has the command, seeds, numbers and time of each case;
`scripts/pack.py lab/grains/records.tar.xz out/records` puts them into the archive, which every reader opens by itself."""
import argparse
import configparser
import datetime
import json
import math
import os
import pathlib
import queue
import re
import subprocess
import sys
import threading

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import pack  # noqa: E402

RECORDS = ROOT / "lab/grains" / "records.tar.xz"
V = 0.05  # [m/s] of plates that are led: inertial number under 0.005

# Options of the beds. sand: the ground that laws are fitted to; slick: less friction; fine: half the grain; wide: room for
# soles and large plates; deep: as far as a robot's foot goes down; hertz, rolling: other contacts; medium, loose: grains that
# roll with resistance, which lie as loose as natural sand; loose_thin, loose_thinner, loose_thick: as loose, with a
# nearer and a further floor. led, landing: beds of their own for direction.py; landing_stiff: sound at 40 to 70 m/s in place of 10 to 18.
# walk, walk_rolling: about as deep as under a robot, and so as dense: walk.py fits the models to them. sole, sole_rolling: a robot's sole,
# led as deep as it goes.
BOX, WIDE, FINE, DEEP = "0.45,0.35,0.12", "0.72,0.44,0.12", "0.33,0.28,0.08", "0.5,0.4,0.25"
LOOSE = {"seeds": "1-3", "box": "0.35,0.29,0.12", "grain": 0.004, "friction": 0.8, "rolling": 1}
FAMILIES = {
    "sand": {"seeds": "1-8", "box": BOX, "grain": 0.005, "friction": 0.5},
    "slick": {"seeds": "1-8", "box": BOX, "grain": 0.005, "friction": 0.3},
    "wide": {"seeds": "1-8", "box": WIDE, "grain": 0.005, "friction": 0.5},
    "fine": {"seeds": "1-4", "box": FINE, "grain": 0.0025, "friction": 0.5, "settle": 0.4},
    "deep": {"seeds": "1-4", "box": DEEP, "grain": 0.005, "friction": 0.5, "settle": 0.8},
    "hertz": {"seeds": "1-4", "box": BOX, "grain": 0.005, "friction": 0.5, "contact": "hertz", "stiffness": 1e7},
    "rolling": {"seeds": "1-4", "box": BOX, "grain": 0.005, "friction": 0.5, "rolling": 0.1},
    "medium": {**LOOSE, "friction": 0.5, "rolling": 0.3},
    "loose": LOOSE,
    "loose_thin": {**LOOSE, "box": "0.35,0.29,0.06"},
    "loose_thinner": {**LOOSE, "box": "0.35,0.29,0.045"},
    "loose_thick": {**LOOSE, "box": "0.35,0.29,0.2", "settle": 0.7},
    "led": {"seeds": "11-13", "box": BOX, "grain": 0.005, "friction": 0.5},
    "led_wide": {"seeds": "11-13", "box": WIDE, "grain": 0.005, "friction": 0.5},
    "led_deep": {"seeds": "11-13", "box": DEEP, "grain": 0.005, "friction": 0.5, "settle": 0.8},
    "led_fine": {"seeds": "11-13", "box": FINE, "grain": 0.0025, "friction": 0.5, "settle": 0.4},
    "landing": {"seeds": "11-13", "box": "0.72,0.44,0.3", "grain": 0.005, "friction": 0.5, "settle": 1, "steps": 50},
    "walk": {"seeds": "1-3", "box": DEEP, "grain": 0.005, "friction": 0.5, "settle": 0.8},
    "walk_rolling": {"seeds": "1-3", "box": DEEP, "grain": 0.005, "friction": 0.5, "settle": 0.8, "rolling": 0.1},
    "sole": {"seeds": "11-11", "box": "0.72,0.44,0.3", "grain": 0.005, "friction": 0.5, "settle": 1},
    "sole_rolling": {"seeds": "11-11", "box": "0.72,0.44,0.3", "grain": 0.005, "friction": 0.5, "settle": 1, "rolling": 0.1},
    "landing_stiff": {"seeds": "11-12", "box": "0.72,0.44,0.3", "grain": 0.005, "friction": 0.5, "settle": 1, "stiffness": 1.6e7},
}


def fail(text):
    print(f"run.py: {text}", file=sys.stderr)
    sys.exit(2)


def outline(robot, section):
    """A robot's sole about the middle of its area."""
    ini = configparser.ConfigParser(inline_comment_prefixes=(";",))
    ini.read(ROOT / "robots" / robot / "robot.ini")
    numbers = [float(word) for word in ini[section]["outline"].split()]
    points = list(zip(numbers[::2], numbers[1::2]))
    area = x = y = 0.0
    for (x0, y0), (x1, y1) in zip(points, points[1:] + points[:1]):
        part = x0 * y1 - x1 * y0
        area, x, y = area + part / 2, x + (x0 + x1) * part / 6, y + (y0 + y1) * part / 6
    return "polygon:" + ",".join(f"{px - x / area:.4f},{py - y / area:.4f}" for px, py in points)


PLATE = "rect:0.12,0.1"
DISC, SQUARE, STRIP = "disc:0.12", "rect:0.1,0.1", "rect:0.12,0.06"
BALL60, BALL80, BALL100, BALL120, BALL160, BALL170 = (f"sphere:{r}" for r in (0.03, 0.04, 0.05, 0.06, 0.08, 0.085))
SA01, G1, GO1 = outline("sa01", "foot.left"), outline("g1", "foot.left"), "sphere:0.023"


def press(depth):
    return f"press:{depth}@{V}"


def deep(name, shape, depth, stage="load:0.03@0.05"):
    return f"{name} {shape} 0 press:{depth}@0.1 {stage}"


def drag(path=0.03, kind="drag"):
    return f"{kind}:{path}@{V}"


def toward(shape, half, tilt, angle, speed=0.1, depth=0.01):
    """A plate of `half` its length [m], tilted [deg], moves at an angle below the horizontal [deg] until its middle is `depth` deep."""
    way = depth + 0.0005 + half * math.sin(math.radians(abs(tilt)))
    down = speed * math.sin(math.radians(angle))
    return f"way{tilt:+d}-{angle} {shape} {tilt} move:{speed * math.cos(math.radians(angle)):.5g},0,{-down:.5g},0,0,{way / down:.5g}"


def along(shape, tilt, depth, *ways, speed=0.1):
    """A tilted plate is pressed, then moves forward and back by `ways` [m]."""
    moves = " ".join(f"move:{math.copysign(speed, way):.5g},0,0,0,0,{abs(way) / speed:.5g}" for way in ways)
    return f"along{tilt:+d}{'-back' * (len(ways) > 1)} {shape} {tilt} press:{depth}@{speed} {moves}"


def landing(name, shape, tilt, mass, speed, forward=0.0):
    return f"{name} {shape} {tilt} move:{forward:g},0,{-speed:g},0,0,0.12,{mass:g}"


FIRST = [f"disc120 {DISC} 0 {press(0.025)}", f"square100 {SQUARE} 0 {press(0.025)}",
         f"square100-drag15 {SQUARE} 0 {press(0.015)} {drag()}"]
TILTS = [f"square100-tilt8 {SQUARE} 8 {press(0.02)}", f"square100-tilt15 {SQUARE} 15 {press(0.015)}",
         f"square100-tilt30 {SQUARE} 30 {press(0.008)}"]
REPRESS = [f"square100-again {SQUARE} 0 {press(0.02)} {press(-0.002)} {press(0.025)}"]
SWIPES = [f"square100-swipe15 {SQUARE} 0 {press(0.015)} swipe:10@0.5", f"disc120-swipe15 {DISC} 0 {press(0.015)} swipe:10@0.5"]

LANDINGS = [landing("sa01-1", SA01, 0, 20, 1), landing("sa01-2", SA01, 0, 20, 2), landing("sa01-3", SA01, 0, 10, 3),
            landing("sa01-heel", SA01, -10, 20, 1.5), landing("sa01-toe", SA01, 15, 20, 1.5),
            landing("sa01-forward", SA01, 0, 20, 1.5, 1), landing("g1-2", G1, 0, 40, 2),
            landing("g1-heel-forward", G1, -10, 20, 1.5, 0.5)]

DEEP_SOLE = [f"g1-deep {G1} 0 press:0.12@0.1", f"g1-land {G1} 0 move:0,0,-1.2,0,0,0.2,20"]

BLOCKS = [
    ("sand", FIRST),
    ("slick", FIRST),
    ("sand", [f"strip {STRIP} 0 {press(0.025)}", f"disc100 disc:0.1 0 {press(0.025)}", *TILTS,
              f"strip-tilt15 {STRIP} 15 {press(0.012)}"]),
    ("wide", [f"sa01 {SA01} 0 {press(0.02)}", f"g1 {G1} 0 {press(0.02)}", f"sa01-tilt8 {SA01} 8 {press(0.01)}",
              f"g1-tilt8 {G1} 8 {press(0.01)}"]),
    ("sand", [f"square100-load10 {SQUARE} 0 {press(0.01)} {drag(0.03, 'load')}",
              f"square100-load20 {SQUARE} 0 {press(0.02)} {drag(0.03, 'load')}",
              f"square100-drag25 {SQUARE} 0 {press(0.025)} {drag(0.02)}",
              f"disc120-load15 {DISC} 0 {press(0.015)} {drag(0.03, 'load')}", *SWIPES,
              f"square100-swipe5 {SQUARE} 0 {press(0.005)} swipe:5@0.5", *REPRESS]),
    ("sand", [f"square100-drop{int(10 * v):02d} {SQUARE} 0 drop:5@{v},0.15" for v in (0.2, 0.5, 1.0)]),
    ("fine", [f"disc60 disc:0.06 0 {press(0.02)}", f"strip {STRIP} 0 {press(0.02)}",
              f"strip-drag15 {STRIP} 0 {press(0.015)} {drag(0.02)}"]),
    ("wide", [f"disc160 disc:0.16 0 {press(0.02)}", f"slab rect:0.2,0.12 0 {press(0.02)}",
              f"sa01-load10 {SA01} 0 {press(0.01)} {drag(0.02, 'load')}", f"g1-drag15 {G1} 0 {press(0.015)} {drag(0.02)}"]),
    ("slick", [TILTS[1], f"disc100 disc:0.1 0 {press(0.025)}", f"square100-load10 {SQUARE} 0 {press(0.01)} {drag(0.03, 'load')}",
               SWIPES[0], *REPRESS]),
    ("fine", [f"strip-tilt15 {STRIP} 15 {press(0.01)}", f"strip-load10 {STRIP} 0 {press(0.01)} {drag(0.02, 'load')}",
              f"go1 {GO1} 0 {press(0.02)}", f"go1-drop10 {GO1} 0 drop:0.3@1,0.1"]),
    ("hertz", FIRST),
    ("rolling", FIRST),
    ("deep", [deep("square100-load80", SQUARE, 0.08), deep("square100-load80-tall", SQUARE + ",0.2", 0.08),
              deep("square100-load20", SQUARE, 0.02), deep("square100-load80-fast", SQUARE, 0.08, "load:0.05@0.5"),
              deep("square100-drag80", SQUARE, 0.08, "drag:0.03@0.05")]),
    ("deep", [deep("square100-load120", SQUARE, 0.12), deep("square100-load40", SQUARE, 0.04),
              deep("square100-load20-fast", SQUARE, 0.02, "load:0.05@0.5"), deep("disc120-load80", DISC, 0.08),
              deep("strip-load80", STRIP, 0.08), deep("square100-load120-tall", SQUARE + ",0.2", 0.12)]),
    ("sand", [f"ball100 {BALL100} 0 {press(0.04)}", f"ball100-load15 {BALL100} 0 {press(0.015)} {drag(0.03, 'load')}"]),
    ("slick", [f"ball100 {BALL100} 0 {press(0.04)}"]),
    ("wide", [f"ball160 {BALL160} 0 {press(0.03)}"]),
    ("fine", [f"ball60 {BALL60} 0 {press(0.03)}"]),
    ("deep", [deep("square100-drag40", SQUARE, 0.04, "drag:0.03@0.05"), deep("strip-drag40", STRIP, 0.04, "drag:0.03@0.05"),
              deep("strip-drag80", STRIP, 0.08, "drag:0.03@0.05")]),
    ("sand", [f"square100-tilt22 {SQUARE} 22 {press(0.01)}", f"strip-tilt22 {STRIP} 22 {press(0.01)}",
              f"disc120-tilt15 {DISC} 15 {press(0.012)}"]),  # predicted in lab/grains/README.md before they were made
    ("sand", [f"ball120 {BALL120} 0 {press(0.018)}"]),  # these four, too
    ("slick", [f"ball120 {BALL120} 0 {press(0.018)}"]),
    ("wide", [f"ball170 {BALL170} 0 {press(0.02)}"]),
    ("fine", [f"ball80 {BALL80} 0 {press(0.012)}"]),
    *((family, [f"disc{size} disc:{size / 1000:g} 0 {press(0.022)}" for size in (60, 80, 100)])
      for family in ("loose", "medium", "loose_thin", "loose_thick", "loose_thinner")),  # lab/grains/real-sand.md; all but the last predicted before
    # What follows was predicted by every model before it was made: lab/grains/predicted.csv
    ("led", [toward(PLATE, 0.06, tilt, angle) for angle, tilts in ((90, (0, 10, 20, 30)), (60, (-30, -15, 0, 15, 30)),
                                                                 (30, (-30, -15, 0, 15, 30))) for tilt in tilts]),
    ("led", [along(PLATE, tilt, 0.015, 0.03) for tilt in (-20, -10, 10, 20)] + [along(PLATE, -15, 0.015, 0.02, -0.02),
             f"onto-print {PLATE} 0 press:0.02@0.1 press:-0.005@0.2 move:0.2,0,0,0,0,0.275 press:0.025@0.1"]),
    ("landing", LANDINGS),
    ("led_wide", [f"walk {SA01} -12 move:0.25,0,-0.4,3.5,0,0.08 move:0.02,0,-0.03,0,0,0.25 move:0.1,0,0.05,2,0,0.12 move:0.2,0,0.4,0,0,0.1",
                  f"run {SA01} 5 move:1,0,-1.2,0,0,0.03 move:0.3,0,-0.2,-1,0,0.06 move:0.5,0,0.3,3,0,0.06 move:0.5,0,1,0,0,0.05",
                  f"roll-hold {SA01} -8 press:0.02@0.2 move:0,0,0,5,0,0.05 hold:0.2"]),
    ("led_deep", [f"along+0-thin {PLATE},0.02 0 press:0.04@0.2 move:0.1,0,0,0,0,0.3", f"along+0-tall {PLATE},0.2 0 press:0.04@0.2 move:0.1,0,0,0,0,0.3"]),
    ("led_fine", [toward(STRIP, 0.06, -15, 60, 0.2), toward(STRIP, 0.06, 15, 30, 0.2), along(STRIP, -15, 0.012, 0.03, speed=0.2)]),
    ("landing_stiff", LANDINGS),
    ("walk", FIRST),
    ("walk_rolling", FIRST),
    ("sole", DEEP_SOLE),
    ("sole_rolling", DEEP_SOLE),
]


def families():
    """A block for each family: its beds settle once."""
    whole = {}
    for family, cases in BLOCKS:
        whole.setdefault(family, []).extend(cases)
    return list(whole.items())


# ---- what it costs ----

def size_of(family):
    return [float(part) for part in FAMILIES[family]["box"].split(",")]


def grains_of(family):
    """Grains of one bed, about."""
    length, width, depth = size_of(family)
    return 0.59 * length * width * depth / (math.pi / 6 * FAMILIES[family]["grain"]**3)


def beds_of(family, seeds=""):
    return len(seeds_of(family, seeds))


def step_of(family):
    """Time step [s] of the program: `steps` in the collision of the two smallest grains."""
    bed = FAMILIES[family]
    radius = 0.45 * bed["grain"]
    stiffness = bed.get("stiffness", 1e6) * bed["grain"]
    if bed.get("contact") == "hertz":
        stiffness = 2 * bed["stiffness"] * math.sqrt(0.5 * radius * 0.01 * bed["grain"])
    return math.pi * math.sqrt(0.5 * 2500 * 4 / 3 * math.pi * radius**3 / stiffness) / bed.get("steps", 25)


def seconds_of(case):
    """Simulated time of a case [s]."""
    words, seconds = case.split(), 0.0
    depth = -0.0005 - 0.5 * area_of(words[1])[1] * math.sin(math.radians(float(words[2])))  # of the middle, as it begins
    for stage in words[3:]:
        kind, numbers = stage.split(":")
        amount, *rest = (float(number) for number in re.split("[@,]", numbers))
        if kind == "press":
            seconds += abs(amount - depth) / rest[0]
            depth = amount
        elif kind in ("hold", "drop"):
            seconds += rest[1] if rest else amount
        elif kind == "move":
            seconds += rest[4]
        else:
            seconds += abs(math.radians(amount) if kind == "swipe" else amount) / rest[0]
    return seconds


def settle_seconds(family):
    return 1.25 * FAMILIES[family].get("settle", 0.5)


def cost(family, seconds, seeds=""):
    """Grain-steps."""
    return grains_of(family) * beds_of(family, seeds) * seconds / step_of(family)


# ---- checks of the list ----

def area_of(shape):
    """Area of a plate [m^2] and its shorter side [m]."""
    kind, numbers = shape.split(":")
    v = [float(number) for number in numbers.split(",")]
    if kind == "polygon":
        points = list(zip(v[::2], v[1::2]))
        area = abs(sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(points, points[1:] + points[:1]))) / 2
        return area, min(max(p[k] for p in points) - min(p[k] for p in points) for k in (0, 1))
    if kind == "rect":
        return v[0] * v[1], min(v[:2])
    diameter = v[0] * (2 if kind == "sphere" else 1)
    return math.pi / 4 * diameter**2, diameter


def check():
    """Plates cover at most 8 % of their box; says which are narrower than 20 grains."""
    names = set()
    for family, cases in BLOCKS:
        length, width, _ = size_of(family)
        for case in cases:
            name, shape = case.split()[:2]
            area, side = area_of(shape)
            if area > 0.08 * length * width:
                fail(f"{family}/{name} covers {100 * area / (length * width):.1f} % of its box, 8 are allowed")
            if (family, name) in names:
                fail(f"two cases {family}/{name}")
            names.add((family, name))
            yield family, case, area / (length * width), side / FAMILIES[family]["grain"]


# ---- running ----

class Manifest:
    """manifest.json: {"FAMILY": bed, "FAMILY/CASE": case}, written whole after each case. It begins with that of `have`."""

    def __init__(self, folder, have):
        self.file, self.lock, self.rows = folder / "manifest.json", threading.Lock(), {}
        for file in (have / "manifest.json" if have else None, self.file):
            if file and file.exists():
                self.rows |= json.loads(file.read_text())

    def put(self, key, row):
        with self.lock:
            self.rows[key] = row
            part = self.file.with_suffix(".part")
            part.write_text(json.dumps(dict(sorted(self.rows.items())), indent=1) + "\n")
            part.replace(self.file)


def seeds_of(family, seeds):
    first, _, last = (seeds or FAMILIES[family]["seeds"]).partition("-")
    return range(int(first), int(last or first) + 1)


def missing(args, family, cases):
    """Cases of a block that are asked for and have not a record of each seed."""
    for case in cases:
        name = case.split()[0]
        files = [f"{family}/{name}-{seed}.csv" for seed in seeds_of(family, args.seeds)]
        there = all((args.out / file).exists() or (args.have and (args.have / file).exists()) for file in files)
        if re.search(args.only, f"{family}/{name}") and not there:
            yield case


def command(args, family, cases):
    options = {**FAMILIES[family], **({"seeds": args.seeds} if args.seeds else {}), "rows": args.rows}
    words = [str(word) for name, value in options.items() for word in (f"--{name}", value)]
    return words + [word for case in cases for word in ("--case", case)]


def run_block(args, manifest, family, cases, gpu):
    folder = args.out / family
    folder.mkdir(parents=True, exist_ok=True)
    environment = dict(os.environ, **({"CUDA_VISIBLE_DEVICES": gpu} if gpu else {}))
    words = command(args, family, cases)
    program = subprocess.Popen([args.program, "--out", folder, *words], stdout=subprocess.PIPE, text=True, env=environment)
    args.running.append(program)
    grains = grains_of(family) * beds_of(family, args.seeds)
    texts = {case.split()[0]: case for case in cases}
    for line in program.stdout:
        row = json.loads(line)
        row["when"] = datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC")
        row["device"] = args.device
        if "bed" in row:
            manifest.put(family, {**row.pop("bed"), **row, "options": command(args, family, [])})
            continue
        name = row.pop("case")
        rate = row["steps"] * grains / max(row["seconds"], 1e-3)
        row["hours"] = round(row.pop("seconds") / 3600, 5)
        row["command"] = f"lab/grains/run.py --only '^{family}/{name}$' --out FOLDER"
        row["case"], row["seeds"] = texts[name], args.seeds or FAMILIES[family]["seeds"]
        manifest.put(f"{family}/{name}", row)
        print(f"{family}/{name}: {3600 * row['hours']:.1f} s{' on GPU ' + gpu if gpu else ''}, {rate:.2g} grain-steps a second",
              flush=True)
    if program.wait() and not args.late.is_set():
        print(f"run.py: {family}: the program ended with {program.returncode}; its finished cases are kept", file=sys.stderr)
    return 0 if args.late.is_set() else program.returncode


def out_of_time(args):
    """Ends the programs; their finished cases are kept."""
    args.late.set()
    for program in args.running:
        program.terminate()


def worker(args, manifest, blocks, gpu, failures):
    while not args.late.is_set():
        try:
            family, cases = blocks.get_nowait()
        except queue.Empty:
            return
        cases = list(missing(args, family, cases))
        if cases and run_block(args, manifest, family, cases, gpu):
            failures.append(family)


def show(args):
    total = 0.0
    widths = {(family, case): (share, side) for family, case, share, side in check()}
    for family, cases in families() if args.together else BLOCKS:
        left = list(missing(args, family, cases))
        if not left:
            continue
        settle = cost(family, settle_seconds(family), args.seeds)
        total += settle
        print(f"{family}: {beds_of(family, args.seeds)} beds of {grains_of(family):.0f} grains, to settle {settle / args.rate:.0f} s")
        for case in left:
            work = cost(family, seconds_of(case), args.seeds)
            total += work
            share, side = widths[family, case]
            print(f"  {case.split()[0]:20} {work / args.rate:6.0f} s   {side:5.1f} grains wide, {100 * share:.1f} % of the box")
    gpus = len(args.gpus.split(","))
    print(f"{total / args.rate:.0f} s at {args.rate:.1e} grain-steps a second; {total / args.rate / gpus:.0f} s on {gpus}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=ROOT / "build" / "grains" / "grains", type=pathlib.Path)
    parser.add_argument("--gpus", default="", help="their numbers, e.g. 0,1; without it one program on what there is")
    parser.add_argument("--per-gpu", type=int, default=1, help="programs on each; the beds of one fill an H100")
    parser.add_argument("--together", action="store_true", help="family by family: beds settle once")
    parser.add_argument("--out", type=pathlib.Path, help="folder; without it out/records, for what lab/grains/records.tar.xz has not")
    parser.add_argument("--only", default="", help="cases FAMILY/CASE that this regular expression finds")
    parser.add_argument("--seeds", default="", help="A or A-B instead of each family's own")
    parser.add_argument("--rows", type=int, default=130, help="of a record, about")
    parser.add_argument("--have", type=pack.opened, help="folder or archive of records that need not be made again")
    parser.add_argument("--seconds", type=float, default=0, help="end after this time, and keep what is finished")
    parser.add_argument("--rate", type=float, default=2e9, help="grain-steps a second, for what it is expected to cost")
    parser.add_argument("--device", default="", help="what to call the machine in the manifest")
    parser.add_argument("--list", action="store_true")
    args = parser.parse_args()
    if not args.out:
        args.out, args.have = ROOT / "out" / "records", args.have or pack.opened(RECORDS)
    list(check())
    show(args)
    if args.list:
        return
    if not args.program.exists():
        fail(f"{args.program} is not there: cmake --build build --target grains (lab/grains/README.md)")
    args.out.mkdir(parents=True, exist_ok=True)
    args.running, args.late = [], threading.Event()
    blocks, failures, manifest = queue.Queue(), [], Manifest(args.out, args.have)
    for block in families() if args.together else BLOCKS:
        blocks.put(block)
    gpus = [gpu for gpu in args.gpus.split(",") for _ in range(args.per_gpu)] or [""]
    threads = [threading.Thread(target=worker, args=(args, manifest, blocks, gpu, failures), daemon=True) for gpu in gpus]
    timer = threading.Timer(args.seconds, out_of_time, [args])
    timer.daemon = True
    if args.seconds > 0:
        timer.start()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for part in args.out.glob("*/*.part"):
        part.unlink()
    if args.late.is_set():
        print("out of time; the same command goes on")
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
