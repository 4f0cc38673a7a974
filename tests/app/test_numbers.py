#!/usr/bin/env python3
"""The numbers that `mild` prints and writes, each held to another way to know it: a formula, another command, the system.
Usage: test_numbers.py PATH_TO_MILD [press|info|play ...]"""
import csv
import json
import math
import os
import re
import subprocess
import sys
import tempfile

mild = os.path.realpath(sys.argv[1])
failures, count_of = 0, {}
PITCH, GRAVITY = 0.0195, 9.81  # of the paper's elements [m], [m/s^2]
PAPER = f"{11 * PITCH},{7 * PITCH}"  # the paper's sole
SLOW = 5e-4  # [m/s] a press without inertia


def near(what, value, wanted, within):
    global failures
    if not abs(value - wanted) <= within:
        count_of[what] = count_of.get(what, 0) + 1
        if count_of[what] <= 2:  # a column has thousands of rows
            print(f"FAIL: {what}: {value}, not {wanted} +- {within}")
        failures += 1


def true(what, holds):
    near(what, int(bool(holds)), 1, 0)


def printed_by(*arguments, code=0):
    """Standard output, or with another code the error."""
    done = subprocess.run([mild, *map(str, arguments)], capture_output=True, text=True, check=False)
    true(f"exit code {code} of mild {' '.join(map(str, arguments))}: {done.stderr[-300:]}", done.returncode == code)
    return done.stderr if code else done.stdout


def pressed(*arguments):
    """Rows of the CSV, the same by column, and what is printed beside the file."""
    printed = printed_by("press", *arguments, "--csv", "press.csv")
    with open("press.csv", newline="", encoding="utf-8") as file:
        rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
    return rows, {k: [row[k] for row in rows] for k in rows[0]}, printed


def found(pattern, text):
    """The numbers that a pattern's groups hold in a text."""
    match = re.search(pattern, text)
    true(f"'{pattern}' in {text!r}", match)
    return [float(g) for g in match.groups()] if match else [math.nan] * re.compile(pattern).groups


def integral(x, y):
    return sum((b - a) * (p + q) / 2 for a, b, p, q in zip(x, x[1:], y, y[1:]))


def table(printed):
    """Rows of numbers of a printed table."""
    return [[float(n) for n in line.split()] for line in printed.splitlines() if re.fullmatch(r"[ \d.+e-]+", line) and line.strip()]


# ---- mild press ----


def press_straight():
    """Down and up at 0.01 m/s: the summary says what the rows add up to."""
    options = ("--ground", "grass", "--depth", 0.02, "--speed", 0.01)
    rows, c, printed = pressed(*options)
    turn = c["depth_m"].index(max(c["depth_m"]))
    for row in rows[:turn + 1]:
        near("depth at constant speed", row["depth_m"], 0.01 * row["time_s"], 1e-9)
    near("time of the whole press", c["time_s"][-1], 4.0, 1e-6)
    elements, area, deepest, speed = found(r"(\d+) elements, ([\d.]+) m\^2, to ([\d.]+) mm at ([\d.]+) m/s", printed)
    peak, pressure, inward, outward, imprint = found(
        r"peak ([\d.]+) N \(([\d.]+) kPa\), work in ([\d.]+) J, work returned ([\d.]+) J, imprint ([\d.]+) mm", printed)
    near("area", area, elements * PITCH**2, 5e-5)
    near("deepest", deepest, 20, 0.05)
    near("speed", speed, 0.01, 0)
    near("peak", peak, max(c["force_n"]), 0.051)
    near("kPa", pressure, 1e-3 * peak / (elements * PITCH**2), 0.006)
    near("work in", inward, integral(c["depth_m"][:turn + 1], c["force_n"][:turn + 1]), 1e-3 * inward + 6e-4)
    near("work returned", outward, -integral(c["depth_m"][turn:], c["force_n"][turn:]), 1e-2 * outward + 6e-4)
    near("imprint", imprint, next(1e3 * r["depth_m"] for r in rows[turn:] if r["force_n"] == 0), 0.1)
    true("work comes back in part", 0.02 * inward < outward < inward / 2)
    for depth, down, up in table(printed_by("press", *options)):
        near("table, down", down, min(rows[:turn + 1], key=lambda r: abs(r["depth_m"] - 1e-3 * depth))["force_n"], 0.5)
        near("table, up", up, min(rows[turn:], key=lambda r: abs(r["depth_m"] - 1e-3 * depth))["force_n"], 0.01 * (up + 50))


def press_dropped():
    """A free fall, a first stop, and at rest the weight."""
    options = ("--ground", "sand_loose", "--drop", 0.03, "--impact", 0.2, "--mass", 8, "--tilt", 3)
    rows, c, printed = pressed(*options)
    falling = [r for r in rows if r["force_n"] == 0 and r["time_s"] < 0.03]
    true("falls", len(falling) > 100)
    start = c["depth_m"][0]
    for r in falling:
        t = r["time_s"]
        near("free fall", r["depth_m"], start + 0.2 * t + GRAVITY * t * t / 2, GRAVITY * 1e-4 * (t + 1e-4))
        near("tilt of the fall", r["tilt_rad"], math.radians(3), 1e-9)
        near("way of the fall", r["x_m"], c["x_m"][0], 1e-9)
    near("time between rows", c["time_s"][11] - c["time_s"][1], 1e-3, 1e-9)
    near("weight at rest", c["force_n"][-1], 8 * GRAVITY, 0.01 * 8 * GRAVITY)
    true("it comes to rest flatter", 0 < abs(c["tilt_rad"][-1]) < math.radians(3))
    stop = next(i for i, (a, b) in enumerate(zip(c["depth_m"], c["depth_m"][1:])) if i > 100 and b < a)
    mass, height, impact, tilt = found(r", ([\d.]+) kg dropped from ([\d.]+) mm at ([\d.]+) m/s, tilted ([\d.]+) deg", printed)
    depth, after, peak, end, speed = found(r"first stop ([\d.]+) mm deep after ([\d.]+) ms, peak ([\d.]+) N; at the end ([\d.]+) mm "
                                           r"deep, ([\d.e+-]+) m/s", printed)
    for what, value, wanted, within in (
            ("mass", mass, 8, 0), ("height", height, 30, 0), ("impact", impact, 0.2, 0), ("tilt", tilt, 3, 0),
            ("peak of the drop", peak, max(c["force_n"]), 0.06), ("end of the drop", end, 1e3 * c["depth_m"][-1], 0.01),
            ("first stop", depth, 1e3 * c["depth_m"][stop], 0.02), ("its time", after, 1e3 * c["time_s"][stop], 0.25),
            ("speed at the end", speed, 0, 1e-3)):
        near(what, value, wanted, within)
    for time, deep, force, tilt in table(printed_by("press", *options)):
        row = min(rows, key=lambda r: abs(r["time_s"] - 1e-3 * time))
        near("table of the drop, depth", deep, 1e3 * row["depth_m"], 0.1)
        near("table of the drop, force", force, row["force_n"], 0.02 * peak)
        near("table of the drop, tilt", tilt, math.degrees(row["tilt_rad"]), 0.02)


def press():
    press_straight()
    press_dropped()


# ---- mild info ----


def sinks(force, *options):
    """[mm] where a slow press on the paper's sole turns at a force."""
    printed = printed_by("press", "--plate", PAPER, "--speed", SLOW, "--force", force, *options)
    return found(r"m\^2, to ([\d.]+) mm", printed)[0]


def columns(text, name):
    """{ground: cell} of the row `name` of one of the tables of `mild info grounds`."""
    grounds = text.strip().splitlines()[0].split()
    row = next(line for line in text.splitlines() if line.split()[:len(name)] == name)
    return dict(zip(grounds, row.split()[len(name):]))


def info_presets(text, table):
    """Every number of a block, laid over another preset of the law, gives the preset itself; the sinkage is a press's."""
    grounds = text.strip().splitlines()[0].split()
    fields = [line.split()[0] for line in text.strip().splitlines()[1:]]
    true("fields", len(fields) > 9 and len(grounds) > 1)
    move = ("--depth", 0.008, "--drag", 0.02, "--speed", 0.3, "--tilt", 3)
    for ground in grounds:
        law, stiffness, sinkage = table[ground]
        values = [f"--ground.{field}={columns(text, [field])[ground]}" for field in fields]
        base = next(other for other in table if other != ground and table[other][0] == law)
        for a, b in zip(pressed("--ground", ground, *move)[0], pressed("--ground", base, *move, *values)[0]):
            for key in ("force_n", "force_x_n", "moment_y_nm"):
                near(f"{ground}: {key} with the numbers of info", b[key], a[key], 2e-3 * (abs(a[key]) + a["force_n"] + 1))
        near(f"{ground}: sinkage", sinkage, sinks(20 * GRAVITY, "--ground", ground), 0.15)
        near(f"{ground}: stiffness", stiffness, 20 * GRAVITY / (77 * 0.0195**2) / sinkage / 1e3, 0.01 * stiffness)


def info_matched(text, sinkage, grounds):
    """A model with the numbers that `mild info grounds` prints sinks as deep as mild under 20 kg."""
    models = {}
    for line in text.split("parameters\n")[0].splitlines():
        words = line.split()
        if len(words) == 2 + len(grounds) and re.fullmatch(r"[\d.e+-]+", words[2]):
            models.setdefault(words[0], []).append((words[1], dict(zip(grounds, words[2:]))))
    near("models that are matched", len(models), 9, 0)
    for model, rows in models.items():
        for ground in ("foam28", "sand_loose", "rubber"):
            values = [f"--ground.{key}={cells[ground]}" for key, cells in rows]
            near(f"{model} matched on {ground}", sinks(20 * GRAVITY, "--ground", ground, "--model", model, *values),
                 float(sinkage[ground]), 0.15)


def info_ranges(text):
    """A value outside is refused with the range that is printed."""
    ranges = re.findall(r"^  (\w+) +(\S+) \.\. (\S+) ", text, re.M)
    true("ranges", len(ranges) > 18)
    for name, low, high in ranges:
        error = printed_by("press", "--ground", "sand_loose", f"--ground.{name}=1e300", code=2)
        said_low, said_high = found(r"outside (\S+) \.\. ([^\s:]+)", error)
        true(f"{name}: {low} .. {high} in: {error}", said_low == float(low) and said_high == float(high))


def info_robots():
    """Joints and feet of robot.ini, the sum of the MJCF's masses, the height at which it stands."""
    text = printed_by("info", "robots")
    robots = re.findall(r"^(\w+): (\d+) joints, (\d+) feet, ([\d.]+) kg, base ([\d.]+) m high\n((?:  .*\n)+)", text, re.M)
    true("robots", len(robots) >= 3)
    for name, joints, feet, mass, height, more in robots:
        words = dict.fromkeys(("feet", "joints"), "") | dict(re.findall(r"^  (\w+) +((?:\S.*\n(?:   +.*\n)*))", more, re.M))
        near(f"{name}: joints", len(words["joints"].split()), int(joints), 0)
        near(f"{name}: feet", len(words["feet"].split()), int(feet), 0)
        with open(words["model"].strip(), encoding="utf-8") as file:
            near(f"{name}: mass", float(mass), sum(float(m) for m in re.findall(r'<inertial[^>]*?mass="([\d.e+-]+)"', file.read())), 0.051)
        printed_by("eval", "--robot", name, "--controller", "stand", "--ground", "rigid", "--trials", 1, "--seconds", 0.5, "--track", "track.csv")
        with open("track.csv", newline="", encoding="utf-8") as file:
            near(f"{name}: height", float(height), float(list(csv.DictReader(file))[-1]["base_z_m"]), 0.02)


def info():
    table, rest = printed_by("info", "grounds").split("\nnumbers, SI units")
    table = {ground: (law, float(stiffness), float(sinkage)) for ground, law, stiffness, sinkage in
             re.findall(r"^  (\w+) +(\w+) +([\d.]+) +([\d.]+) +\d+ +[\d.]+ +[\d.-]+ +[\d.-]+  \S", table, re.M)}
    blocks = [block.split("\n", 1)[1] for block in rest.split("\nground models")[0].split("\n\n") if block.startswith("of ")]
    near("grounds", len(table), sum(len(block.splitlines()[0].split()) for block in blocks), 0)
    for block in blocks:
        info_presets(block, table)
    info_matched(rest.split("Parameters of the other models")[1], {ground: row[2] for ground, row in table.items()}, blocks[0].splitlines()[0].split())
    info_ranges(rest.split("\nparameters\n")[1])
    info_robots()
    size, unit = re.search(r"memory +([\d.]+) (\w+)", printed_by("info", "devices")).groups()
    near("memory of this machine", float(size), os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") /
         {"MiB": 2**20, "GiB": 2**30, "TiB": 2**40}[unit], 0.006)
    true("the version", printed_by("--version").split()[1] == re.search(r"^mild +(\S+)", printed_by("info", "build"), re.M).group(1))


# ---- mild play ----


def play():
    """The table's row is what eval measures of the same walk, within what another start and another length change."""
    header, row = printed_by("play", "--ground", "sand_loose", "--speed", 0.5, "--seconds", 9, "--pressure", "play.csv").splitlines()[:2]
    true("columns", header.split() == ["ground", "distance", "time", "speed", "upright", "clearance", "deepest", "COT"])
    way, time, speed, clearance, sinkage, cot = found(
        r"sand_loose +([\d.-]+) m +([\d.]+) s +([\d.-]+) m/s +yes +([\d.]+) mm +([\d.]+) mm +([\d.]+)", row)
    printed_by("eval", "--ground", "sand_loose", "--speed", 0.5, "--seconds", 9, "--trials", 4, "--json", "eval.json",
               "--task.observe_noise=false")  # play has none
    with open("eval.json", encoding="utf-8") as file:
        measured = json.load(file)["rows"][0]
    near("time after the start", time, 8, 0.06)
    near("speed is distance by time", speed, way / time, 0.006)
    near("speed", speed, measured["velocity"], 0.1 * measured["velocity"])
    near("clearance", clearance, 1e3 * measured["clearance"], 0.25 * 1e3 * measured["clearance"])
    near("sinkage", sinkage, 1e3 * measured["penetration"], 0.15 * 1e3 * measured["penetration"])
    near("cost of transport", cot, measured["cot"], 0.15 * measured["cot"])


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    for part in (press, info, play):
        if len(sys.argv) < 3 or part.__name__ in sys.argv[2:]:
            part()
    os.chdir("/")
if not failures:
    print("the numbers of press, info and play agree with other ways to know them")
sys.exit(failures > 0)
