#!/usr/bin/env python3
"""Walks a policy everywhere that docs/results.md speaks of, and says where it falls.

  lab/paper/exam.py --out out/exam                       # the shipped policy, 7890 trials: thirteen minutes on two cores
  lab/paper/exam.py --out out/exam --policy runs/mine/policy.safetensors --trials 2 --parts nine,slip,snow
  lab/paper/exam.py --out out/g1 -- --robot g1           # policies/g1.safetensors as configs/g1.ini says, at the speeds of its training

Prints a line for each part: the trials that stay upright; the cells (a ground, a speed) within 5 % of the command, the mean share of it
that they have, and the one that is furthest from it; the cost of transport; the largest torque of any trial; the largest change of a
joint's target in 10 ms; the least distance of the legs, and where; what ended the other trials, and where. OUT/exam.json has the rows of
`mild eval`, each with the error of its speed [m/s]. Options after -- go to every `mild eval`."""
import argparse
import concurrent.futures
import configparser
import itertools
import json
import os
import pathlib
import shutil
import sys
import time

import measure
import random_grounds
import transitions
from measure import NINE, ROOT, mild

SOFT = [ground for ground in NINE if ground != "rigid"]
SANDS = ["sand_loose", "sand_dense"]
SPEEDS = [-1.3, -1.2, -0.6, 0, 0.3, 0.6, 0.9, 1.2, 1.3]
SLIPS = [(law, length, grip) for law in ("mild", "mild_merged") for length in (1, 2, 5, 10) for grip in (0.05, 0.14, 0.3)]  # [mm], [-]
SLOWLY = [0.3, 0.6, 0.9]
PATCH = 1.5  # [m] of each ground of slip_border

# {name: (what, grounds, speeds, further options)}
PARTS = {
    "nine": ("nine grounds", NINE, SPEEDS, []),
    "slow": ("nine grounds, slowly", NINE, [0.15], []),
    "up": ("up a slope of 0.2", NINE, [0.6], ["--terrain.kind=slope", "--terrain.slope=0.2"]),
    "down": ("down a slope of 0.2", NINE, [0.6], ["--terrain.kind=slope", "--terrain.slope=-0.2"]),
    "push": ("pushes of 0.8 m/s every 4 s", NINE, [0, 0.6, 1.2], ["--push", 0.8]),
    "hard": ("pushes of 1 m/s every 4 s", NINE, [0.6], ["--push", 1]),
    "sideways": ("sideways at 0.3 m/s", NINE, [0, 0.6], ["--sideways", 0.3]),
    "turn": ("turning at 1 rad/s", NINE, [0, 0.6], ["--turn", 1]),
    "stop": ("stops after 8 s", NINE, [-1.2, -0.6, 0.6, 1.2], ["--stop", 8, "--seconds", 14]),
    "steps": ("steps of 80 mm of loose sand", ["sand_loose"], [0.3, 0.6], ["--terrain.kind=steps", "--terrain.amplitude=0.08"]),
    "half": ("half of the softest foam", ["foam25"], [0.3, 0.6, 1.2], ["--ground.k_pen=75", "--ground.sigma_cone=5.5e4"]),
    "snow": ("snow (Bekker's)", ["snow"], [0.3, 0.6], []),
    "slippery": ("loose sand of friction 0.12", ["sand_loose"], [0.3, 0.6], ["--ground.mu=0.12"]),
    "quasi": ("ecc_quasi_3d", SOFT, [0.6], ["--model", "ecc_quasi_3d"]),
    "cone": ("con_cone", SOFT, [0.6], ["--model", "con_cone"]),
    "spring": ("con_spring", SOFT, [0.6], ["--model", "con_spring"]),
}
# The same on each of SLIPS, at most two trials of a cell.
SLIDES = {
    "slip": ("where slip sinks", SANDS, SLOWLY, ["--seconds", 10]),
    "slip_up": ("the same, up a slope of 0.1", SANDS, SLOWLY, ["--seconds", 10, "--terrain.kind=slope", "--terrain.slope=0.1"]),
    "slip_down": ("the same, down a slope of 0.1", SANDS, SLOWLY, ["--seconds", 10, "--terrain.kind=slope", "--terrain.slope=-0.1"]),
    "slip_push": ("the same, pushes of 0.5 m/s", SANDS, SLOWLY, ["--seconds", 10, "--push", 0.5]),
    "slip_border": ("the same, from rigid and onto it", [f"rigid+{sand}+rigid" for sand in SANDS], SLOWLY, ["--patch", PATCH]),
}
OTHERS = {"random": "60 random grounds of Table II", "transitions": "72 transitions"}
WHAT = {**{name: part[0] for name, part in {**PARTS, **SLIDES}.items()}, **OTHERS}
TOO_SOFT = {"go1": {"random", "snow"}}  # parts where its small feet sink until the trunk lies on the ground


# ---- the walks ----

def with_errors(row):
    """A row of `mild eval` with what is measured less what is asked: [m/s], [m/s], [rad/s]; None: nobody stayed up."""
    errors = {key: row[is_] - row[asked] if row["success"] and row[is_] is not None else None for key, asked, is_ in
              (("error", "speed", "velocity"), ("error_sideways", "sideways", "velocity_sideways"), ("error_turn", "turn", "velocity_turn"))}
    return {**row, **errors}


def walk(given, grounds, speeds, trials, options, case=""):
    """Rows of `mild eval`, one for each ground and speed."""
    report = mild("eval", *given.who, "--ground", ",".join(grounds), "--speed=" + ",".join(map(str, speeds)), "--trials", trials, "--seed", given.seed,
                  "--threads", 1, "--json", "-", *options)
    return [{"case": case, **with_errors(row)} for row in json.loads(report)["rows"]]


def walk_at_random(given, ground, number, speeds):
    rows = random_grounds.walk(given.who, ground, number, ",".join(map(str, speeds)), min(given.trials, 2))
    return [{"case": f"ground {number}", **with_errors(row)} for row in rows]


def slide(given, name, slip, speeds):
    _, grounds, _, more = SLIDES[name]
    law, length, grip = slip
    options = ["--model", law, f"--ground.slip_length={1e-3 * length:g}", f"--ground.grip={grip:g}", *more]
    if name == "slip_border":
        options += ["--seconds", f"{transitions.START + 3 * PATCH / min(speeds):.2f}"]
    return walk(given, grounds, speeds, min(given.trials, 2), options, f"{law} {length} mm {grip:g}")


def tasks(given, name):
    """What a part walks: functions, each a process and some rows."""
    if name == "transitions":
        return [lambda pair=pair, speed=speed: [transitions.walk_over(given.who, pair, speed, given.trials, given.seed)]
                for pair in transitions.PAIRS for speed in trained(given, transitions.SPEEDS)]
    if name == "random":
        return [lambda n=n, ground=ground: walk_at_random(given, ground, n, trained(given, SLOWLY))
                for n, ground in enumerate(random_grounds.drawn(given.seed))]
    if name in SLIDES:
        speeds = trained(given, SLIDES[name][2])
        groups = [[v] for v in speeds] if name == "slip_border" else [speeds]  # a border is crossed at each speed in its own time
        return [lambda slip=slip, group=group: slide(given, name, slip, group) for slip in SLIPS for group in groups]
    _, grounds, speeds, more = PARTS[name]
    return [lambda ground=ground, speed=speed: walk(given, [ground], [speed], given.trials, more)
            for ground in grounds for speed in trained(given, speeds)]


def trained(given, speeds):
    """Those of the speeds that the robot's training had; backward at least one, if it had any."""
    if given.limits is None:
        return speeds
    low, high = given.limits
    kept = [v for v in speeds if low <= v <= high]
    return [max(low, -0.3), *kept] if min(speeds) < 0 and low < 0 and min(kept, default=0) >= 0 else kept


# ---- what is said of them ----

def cell(row):
    """What counts of a row of `mild eval`, or of a transition."""
    if "pair" in row:
        return {**row, "where": [row["pair"], row["speed"]], "axes": [(row["speed"], row["error"] if row["upright"] else None)]}
    axes = [(row[asked], row[error]) for asked, error in (("speed", "error"), ("sideways", "error_sideways"), ("turn", "error_turn")) if row[asked]]
    return {"where": [f"{row['ground']} {row['case']}".strip(), row["speed"]], "axes": axes, "upright": row["success"], "trials": row["trials"],
            "ends": row["ends"], "cot": row["cot"], "torque": max(t["torque_max"] for t in row["each"]), "legs": row["legs"],
            "target_jump": row["target_jump"]}


def summary(rows):
    """Of rows of a part: what a line says. fell: [[ground, speed, trials]]."""
    cells, ends = [cell(row) for row in rows], {}
    for c in cells:
        for end, n in c["ends"].items():
            if n and end != "time":
                ends[end] = ends.get(end, 0) + n
    asked = [c for c in cells if c["axes"]]
    off = [(abs(error / command), c["where"][0], command, command + error) for c in asked for command, error in c["axes"] if error is not None]
    shares = [1 + error / command for command, error in (c["axes"][-1] for c in asked) if error is not None]  # sideways or turning where asked
    good = [c for c in asked if all(error is not None and abs(error / command) <= 0.05 for command, error in c["axes"])]
    costs = [c["cot"] for c in cells if c["cot"] is not None]
    legs = min(((c["legs"], *c["where"]) for c in cells if c["legs"] is not None), default=None)
    return {"upright": sum(c["upright"] for c in cells), "trials": sum(c["trials"] for c in cells), "ends": ends,
            "within": len(good), "asked": len(asked), "share": sum(shares) / len(shares) if shares else None,
            "worst": list(max(off)[1:]) if off else None,
            "cot": [min(costs), max(costs)] if costs else None, "torque": max(c["torque"] for c in cells),
            "target_jump": max((c["target_jump"] for c in cells if c["target_jump"] is not None), default=None),
            "legs": legs and legs[0], "legs_at": legs and list(legs[1:]),
            "fell": [[*c["where"], c["trials"] - c["upright"]] for c in cells if c["upright"] < c["trials"]]}


HEAD = f"{'':32} {'upright':>12} {'within 5 %':>10} {'mean':>5} {'furthest from the command [m/s]':44} {'cost':14} {'torque':>8} {'jump':>8} {'legs':>7}"


def line(what, s):
    worst = f"{s['worst'][2]:+.3f} for {s['worst'][1]:+.2f} on {s['worst'][0]}" if s["worst"] else "-"
    cost = f"{s['cot'][0]:.2f} .. {s['cot'][1]:.2f}" if s["cot"] else "-"
    jump = "-" if s["target_jump"] is None else f"{s['target_jump']:.2f} rad"
    legs = "-" if s["legs"] is None else f"{1e3 * s['legs']:4.0f} mm on {s['legs_at'][0]}@{s['legs_at'][1]:g}"
    ends = "".join(f", {n} {end}" for end, n in s["ends"].items())
    where = ", ".join(f"{g}@{v:g}:{n}" for g, v, n in s["fell"][:6])
    within, share = f"{s['within']}/{s['asked']}", "-" if s["share"] is None else f"{100 * s['share']:.0f} %"
    return f"{what:32} {s['upright']:4} of {s['trials']:<4} {within:>10} {share:>5} {worst:44} {cost:14} {s['torque']:4.0f} N m {jump:>8} {legs}{ends} {where}".rstrip()


# ---- the command ----

def fail(text):
    print(f"exam.py: {text}", file=sys.stderr)
    sys.exit(2)


def robot_of(options):
    for i, word in enumerate(options):
        if word == "--robot" and i + 1 < len(options):
            return options[i + 1]
        if word.startswith("--robot="):
            return word.split("=", 1)[1]
    return "sa01"


def limits_of(config):
    """[m/s] The speeds forward that a training with this configuration commands."""
    ini = configparser.ConfigParser(inline_comment_prefixes=("#", ";"))
    ini.read([random_grounds.DEFAULT, config])
    task = ini["task"]
    low, high = map(float, task["vx"].split())
    return (min(low, float(task["backward_vx"].split()[0])) if float(task["backward_share"]) else low), high


def parse(words):
    own, more = (words[:words.index("--")], words[words.index("--") + 1:]) if "--" in words else (words, [])
    robot = robot_of(more)
    policy, config = ("mild", "walk") if robot == "sa01" else (robot, robot)
    names = [name for name in WHAT if name not in TOO_SOFT.get(robot, ())]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--policy", type=pathlib.Path, default=ROOT / f"policies/{policy}.safetensors")
    parser.add_argument("--config", type=pathlib.Path, default=ROOT / f"configs/{config}.ini")
    parser.add_argument("--mild", type=pathlib.Path, help="the program (default: $MILD, or build/mild)")
    parser.add_argument("--parts", default=",".join(names), help="of " + " ".join(WHAT) + " (default: all; of the Go1 all but "
                        + " ".join(sorted(TOO_SOFT["go1"])) + ")")
    parser.add_argument("--trials", type=int, default=10, help="of each ground and speed (default 10; where slip sinks and on random grounds at most 2)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="programs at a time (default: one per core)")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder to write to")
    given = parser.parse_args(own)
    given.parts = given.parts.split(",")
    if not set(given.parts) <= set(WHAT):
        fail(f"--parts {' '.join(p for p in given.parts if p not in WHAT)}: not of {' '.join(WHAT)}")
    if given.mild:
        measure.MILD = [str(given.mild.resolve())]
    if not shutil.which(measure.MILD[0]):
        fail(f"{measure.MILD[0]}: no such program; make build, or give --mild PATH")
    for file in (given.policy, given.config):
        if not file.is_file():
            fail(f"{file}: no such file; give --policy and --config")
    given.who = ["--policy", given.policy.resolve(), "--config", given.config.resolve(), *more]
    given.limits = None if robot == "sa01" else limits_of(given.config)
    return given


def examine(given):
    """{part: what is said of it, and its rows}. All processes wait in one queue, so that no core idles at the end of a part."""
    parts = {}
    with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
        waiting = {name: [pool.submit(task) for task in tasks(given, name)] for name in given.parts}
        try:
            for name, futures in waiting.items():
                rows = list(itertools.chain.from_iterable(future.result() for future in futures))
                parts[name] = {"what": WHAT[name], **summary(rows), "rows": rows}
                print(line(WHAT[name], parts[name]), flush=True)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return parts


def main():
    given, begin = parse(sys.argv[1:]), time.time()
    given.out.mkdir(parents=True, exist_ok=True)
    print(HEAD, flush=True)
    parts = examine(given)
    (given.out / "exam.json").write_text(json.dumps({"policy": str(given.policy), "options": list(map(str, given.who[2:])), "seed": given.seed,
                                                     "version": mild("--version").strip(), "parts": parts}, indent=1) + "\n")
    upright, trials, within, asked = (sum(part[key] for part in parts.values()) for key in ("upright", "trials", "within", "asked"))
    print(f"{upright} of {trials} trials upright, {within} of {asked} cells within 5 % of the command, {time.time() - begin:.0f} s: "
          f"{given.out / 'exam.json'}")


if __name__ == "__main__":
    main()
