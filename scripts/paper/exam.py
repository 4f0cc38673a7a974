#!/usr/bin/env python3
"""Walks a policy everywhere that docs/results.md speaks of, and says where it falls.

  scripts/paper/exam.py --out out/exam                       # the shipped policy, 6450 trials: ten minutes on two cores
  scripts/paper/exam.py --out out/exam --policy runs/mine/policy.safetensors --trials 2 --parts nine,snow
  scripts/paper/exam.py --out out/g1 --policy policies/g1.safetensors --config configs/g1.ini --parts sideways,turn,push -- --robot g1

Prints a line for each part: the trials that stay upright, what ended the others, the cell whose mean speed is furthest from the command,
the cost of transport, the largest torque in any trial, and the least distance of the legs. OUT/exam.json has the rows of `mild eval`.
Options after -- go to every `mild eval`."""
import argparse
import json
import os
import pathlib
import sys
import time

import random_grounds
import transitions
from measure import NINE, ROOT, mild, together

SOFT = "--ground.k_pen=75", "--ground.sigma_cone=5.5e4"
SPEEDS = [-1.3, -1.2, -0.6, 0, 0.3, 0.6, 0.9, 1.2, 1.3]

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
    "half": ("half of the softest foam", ["foam25"], [0.3, 0.6, 1.2], SOFT),
    "snow": ("snow (Bekker's)", ["snow"], [0.3, 0.6], []),
    "slippery": ("loose sand of friction 0.12", ["sand_loose"], [0.3, 0.6], ["--ground.mu=0.12"]),
    "quasi": ("ecc_quasi_3d", [g for g in NINE if g != "rigid"], [0.6], ["--model", "ecc_quasi_3d"]),
    "cone": ("con_cone", [g for g in NINE if g != "rigid"], [0.6], ["--model", "con_cone"]),
    "spring": ("con_spring", [g for g in NINE if g != "rigid"], [0.6], ["--model", "con_spring"]),
}


def cells_of(given, name):
    """Rows of `mild eval`, ground by ground."""
    _, grounds, speeds, more = PARTS[name]
    tasks = [(ground, speed) for ground in grounds for speed in speeds]

    def work(task):
        ground, speed = task
        return json.loads(mild("eval", *given.who, "--ground", ground, f"--speed={speed}", "--trials", given.trials, "--seed", given.seed,
                               "--threads", 1, "--json", "-", *more))["rows"][0]

    return together(given, work, tasks)


def random_cells(given):
    _, found = random_grounds.judge(given.who, "0.3,0.6,0.9", min(given.trials, 2), given.seed, given.jobs)
    return [row for rows in found for row in rows]


def summary(rows):
    """Of rows of `mild eval`: what a line says."""
    ends = {}
    for row in rows:
        for end, n in row["ends"].items():
            if n and end != "time":
                ends[end] = ends.get(end, 0) + n
    measured = [r for r in rows if r["velocity"] is not None and r["speed"]]
    worst = max(measured, key=lambda r: abs(r["velocity"] / r["speed"] - 1), default=None)
    costs = [r["cot"] for r in rows if r["cot"] is not None]
    legs = [t["legs"] for r in rows for t in r["each"] if t["legs"] is not None]
    return {"upright": sum(r["success"] for r in rows), "trials": sum(r["trials"] for r in rows), "ends": ends,
            "worst": worst and [worst["ground"], worst["speed"], worst["velocity"]], "cot": [min(costs), max(costs)] if costs else None,
            "torque": max(t["torque_max"] for r in rows for t in r["each"]), "legs": min(legs) if legs else None,
            "fell": [[r["ground"], r["speed"], r["trials"] - r["success"]] for r in rows if r["success"] < r["trials"]]}


def line(what, s):
    worst = f"{s['worst'][2]:+.3f} for {s['worst'][1]:+.2f} on {s['worst'][0]}" if s["worst"] else "-"
    cost = f"{s['cot'][0]:.2f} .. {s['cot'][1]:.2f}" if s["cot"] else "-"
    ends = "".join(f", {n} {end}" for end, n in s["ends"].items())
    where = " ".join(f"{g}@{v:g}:{n}" for g, v, n in s["fell"][:6])
    legs = "-" if s["legs"] is None else f"{1e3 * s['legs']:.0f} mm"
    return f"{what:32} {s['upright']:4} of {s['trials']:<4} {worst:36} {cost:14} {s['torque']:4.0f} N m {legs:>7}{ends} {where}".rstrip()


def crossing(given):
    """The summary of all 72 transitions, in the words of summary()."""
    cells = transitions.judge(given.who, transitions.PAIRS, transitions.SPEEDS, given.trials, given.seed, given.jobs)
    measured = [c for c in cells if c["error"] is not None]
    worst = max(measured, key=lambda c: abs(c["error"] / c["speed"]))
    total, legs = transitions.total(cells), [c["legs"] for c in cells if isinstance(c["legs"], (int, float))]
    return {"upright": total["upright"], "trials": total["trials"], "ends": total["ends"],
            "worst": [worst["pair"], worst["speed"], worst["speed"] + worst["error"]], "cot": [min(c["cot"] for c in measured), max(c["cot"] for c in measured)],
            "torque": total["torque"], "legs": min(legs) if legs else None,
            "fell": [[c["pair"], c["speed"], c["trials"] - c["upright"]] for c in cells if c["upright"] < c["trials"]]}, cells


def parse(words):
    own, more = (words[:words.index("--")], words[words.index("--") + 1:]) if "--" in words else (words, [])
    names = [*PARTS, "random", "transitions"]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--policy", type=pathlib.Path, default=ROOT / "policies/mild.safetensors")
    parser.add_argument("--config", type=pathlib.Path, default=ROOT / "configs/walk.ini")
    parser.add_argument("--parts", default=",".join(names), help="of " + " ".join(names) + " (default: all)")
    parser.add_argument("--trials", type=int, default=10, help="of each ground and speed (default 10; of each random ground at most 2)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="programs at a time (default: one per core)")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder to write to")
    given = parser.parse_args(own)
    given.parts = given.parts.split(",")
    if not set(given.parts) <= set(names):
        print(f"exam.py: --parts {' '.join(p for p in given.parts if p not in names)}: not of {' '.join(names)}", file=sys.stderr)
        sys.exit(2)
    given.who = ["--policy", given.policy.resolve(), "--config", given.config.resolve(), *more]
    return given


def main():
    given, begin, parts = parse(sys.argv[1:]), time.time(), {}
    given.out.mkdir(parents=True, exist_ok=True)
    print(f"{'':32} {'upright':>12} {'furthest from the command [m/s]':36} {'cost':14} {'torque':>8} {'legs':>7}", flush=True)
    for name in given.parts:
        what = PARTS[name][0] if name in PARTS else {"random": "60 random grounds of Table II", "transitions": "72 transitions"}[name]
        s, rows = crossing(given) if name == "transitions" else (None, random_cells(given) if name == "random" else cells_of(given, name))
        s = s or summary(rows)
        parts[name] = {"what": what, **s, "rows": rows}
        print(line(what, s), flush=True)
    (given.out / "exam.json").write_text(json.dumps({"policy": str(given.policy), "options": list(map(str, given.who[2:])), "seed": given.seed,
                                                     "version": mild("--version").strip(), "parts": parts}, indent=1) + "\n")
    print(f"{sum(t['upright'] for t in parts.values())} of {sum(t['trials'] for t in parts.values())} trials upright, {time.time() - begin:.0f} s: "
          f"{given.out / 'exam.json'}")


if __name__ == "__main__":
    main()
