#!/usr/bin/env python3
"""Walks from one ground onto another: all 72 ordered pairs of the nine grounds, at several speeds, over a border as sharp as it is.

  lab/paper/transitions.py --out out/transitions                  # the shipped policy, 3600 trials: 4 minutes on two cores
  lab/paper/transitions.py --out out/one --pairs 'rigid>foam25,foam25>rigid' --speeds=-1.2,1.2 --trials 20
  lab/paper/transitions.py --out out/figure --trials 4 --figure 'rubber>foam28' --pairs ''

Prints, for each pair and speed, how many of the trials stay upright, the error of the mean speed, the cost of transport, and the
largest torque in any trial; OUT/transitions.json has them, with the causes of the ends, one by one. A trial lasts two seconds and the
time of two patches at the commanded speed: the robot starts on the first ground, whose end is a patch ahead. What it measures is what
`mild eval` measures of the course; options after -- go to every `mild eval`, as -- --task.shells_stand=false.

--figure walks FIRST>SECOND>FIRST forward and backward and draws every stride over the borders, above an embedding of z~: OUT/transition.png,
with the strides in OUT/strides.csv. It needs what lab/paper/requirements.txt names."""
import argparse
import itertools
import json
import os
import pathlib
import sys
import time
from types import SimpleNamespace

from measure import NINE, ROOT, mean, mild, read, save, together

PATCH = 2.5  # [m] of each ground
START = 2.0  # [s] that a walk may take to get going
SPEEDS = [-1.2, -0.6, 0.6, 0.9, 1.2]
PAIRS = [f"{a}>{b}" for a, b in itertools.permutations(NINE, 2)]


# ---- the table ----

def cell_of(pair, row):
    """What is kept of a row of mild eval."""
    each, way = row["each"], 1 if row["speed"] >= 0 else -1
    crossed = sum(t["end"] == "time" and way * t["x"] > PATCH for t in each)
    error = None if row["velocity"] is None else row["velocity"] - row["speed"]
    return {"pair": pair, "speed": row["speed"], "trials": row["trials"], "upright": row["success"], "crossed": crossed, "error": error,
            "cot": row["cot"], "torque": max(t["torque_max"] for t in each), "legs": row["legs"],
            "target_jump": row.get("target_jump"), "ends": {end: n for end, n in row["ends"].items() if n and end != "time"}}


def walk_over(who, pair, speed, trials, seed):
    """The cell of a pair at a speed. who: options of mild eval that say who walks."""
    seconds = START + 2 * PATCH / abs(speed)
    report = mild("eval", *who, "--ground", pair.replace(">", "+"), f"--speed={speed}", "--patch", PATCH, "--trials", trials, "--seed", seed,
                "--seconds", f"{seconds:.2f}", "--threads", 1, "--json", "-")
    return cell_of(pair, json.loads(report)["rows"][0])


def judge(who, pairs, speeds, trials, seed=1, jobs=1):
    """Cells in the order of pairs and speeds."""
    cells = list(itertools.product(pairs, speeds))
    return together(SimpleNamespace(jobs=jobs), lambda cell: walk_over(who, *cell, trials, seed), cells)


def total(cells):
    """Of several cells: sums, the means of error and cost over the cells in which anybody stayed up, the largest torque of those who did
    not fall and of all."""
    stood = [c for c in cells if c["upright"] and c["error"] is not None]
    worst = max(stood, key=lambda c: abs(c["error"] / c["speed"]), default=None)
    return {"trials": sum(c["trials"] for c in cells), "upright": sum(c["upright"] for c in cells), "crossed": sum(c["crossed"] for c in cells),
            "whole": sum(c["upright"] == c["trials"] for c in cells), "cells": len(cells),
            "error": mean(abs(c["error"]) for c in stood) if stood else None,
            "worst_error": abs(worst["error"] / worst["speed"]) if worst else None,
            "cot": mean(c["cot"] for c in stood) if stood else None, "torque": max(c["torque"] for c in cells),
            "torque_upright": max((c["torque"] for c in cells if c["upright"] == c["trials"]), default=None),
            "ends": {end: n for end in sorted({e for c in cells for e in c["ends"]}) if (n := sum(c["ends"].get(end, 0) for c in cells))}}


def totals(cells):
    """{"all" or the speed: total}"""
    speeds = list(dict.fromkeys(c["speed"] for c in cells))
    return {**{f"{v:g}": total([c for c in cells if c["speed"] == v]) for v in speeds}, "all": total(cells)}


def number(value, form):
    return "-" if value is None else format(value, form)


def print_table(cells):
    speeds = list(dict.fromkeys(c["speed"] for c in cells))
    print(f"{'from > onto':24}" + "".join(f"{f'{v:g} m/s: upright, error, cost, N m':>36}" for v in speeds))
    for pair in dict.fromkeys(c["pair"] for c in cells):
        own = [c for c in cells if c["pair"] == pair]
        print(f"{pair:24}" + "".join(f"{c['upright']:>18}/{c['trials']:<2} {number(c['error'], '+.3f'):>6} {number(c['cot'], '.2f'):>4} "
                                     f"{c['torque']:3.0f}" for c in own))


def print_totals(cells):
    for name, t in totals(cells).items():
        ends = ", ".join(f"{n} {end}" for end, n in t["ends"].items())
        print(f"{name if name == 'all' else name + ' m/s':10} upright {t['upright']} of {t['trials']}, crossed {t['crossed']}, whole cells {t['whole']} of "
              f"{t['cells']}, speed off by {number(t['error'], '.3f')} m/s (worst cell {number(t['worst_error'], '.1%')}), cost "
              f"{number(t['cot'], '.2f')}, torque {t['torque']:.0f} N m (whole cells {number(t['torque_upright'], '.0f')})"
              + (f"; ended by {ends}" if ends else ""))


# ---- strides over a border ----

def course_of(pair):
    """FIRST+SECOND+FIRST, as the paper walks it."""
    first, second = pair.split(">")
    return f"{first}+{second}+{first}"


def strides_of(stances, latent, axis, way):
    """Rows, a stride each, from the touchdown of a foot to its next one: its place along the walk (that of its end), length, duration,
    clearance, largest torque, and z~ as axis(rows) gives it, from START on. stances, latent: rows of the CSVs of one walk with several
    trials."""
    rows = []
    for trial, foot in sorted({(s["trial"], s["foot"]) for s in stances}):
        own = sorted((s for s in stances if (s["trial"], s["foot"]) == (trial, foot)), key=lambda s: float(s["start_s"]))
        inside = [z for z in latent if z["trial"] == trial]
        for a, b in zip(own, own[1:]):
            begin, end = float(a["start_s"]), float(b["start_s"])
            if begin < START:
                continue
            during = [z for z in inside if begin <= float(z["time_s"]) < end]
            rows.append({"trial": int(trial), "foot": int(foot), "time": end, "place": way * float(b["x_m"]),
                         "length": way * (float(b["x_m"]) - float(a["x_m"])), "duration": end - begin, "clearance": float(b["apex_m"]),
                         "torque": float(a["torque_n_m"]), "z": axis(during) if during else None})
    return rows


def numbered(strides, border):
    """Strides with their number: 0 is a foot's first that ends beyond the border [m], of each trial."""
    found = []
    for key in dict.fromkeys((s["trial"], s["foot"]) for s in strides):
        own = [s for s in strides if (s["trial"], s["foot"]) == key]
        first = next((i for i, s in enumerate(own) if s["place"] > border), None)
        if first is not None:
            found += [{"number": i - first, **s} for i, s in enumerate(own)]
    return found


QUANTITIES = {"length": ("stride [m]", 1), "cadence": ("cadence [strides/s]", 1), "clearance": ("clearance [mm]", 1e3),
              "torque": ("torque [N m]", 1), "z": ("z~ [-]", 1)}


def over_border(strides, border, numbers=range(-4, 5)):
    """[{number, strides, each quantity}]: means over trials and feet. z~: 0 as on the first ground alone, 1 as on the second."""
    found, rows = numbered(strides, border), []
    for n in numbers:
        own = [{**s, "cadence": 1 / s["duration"]} for s in found if s["number"] == n]
        if own:
            rows.append({"number": n, "strides": len(own), **{k: mean(s[k] for s in own if s[k] is not None) for k in QUANTITIES}})
    return rows


def walk(given, ground, speed, name):
    """(stances, latent) of a walk, as rows of text."""
    files = [given.out / f"{name}_{kind}.csv" for kind in ("stances", "latent")]
    mild("eval", *given.who, "--ground", ground, f"--speed={speed}", "--patch", PATCH, "--trials", given.trials, "--seed", given.seed,
         "--seconds", f"{START + 3 * PATCH / abs(speed):.2f}", "--threads", 1, "--stances", files[0], "--latent", files[1])
    found = [read(file) for file in files]
    for file in files:
        file.unlink()
    return found


def modulated(row):
    return [float(value) for name, value in row.items() if name.startswith("modulated")]


def axis_between(first, second):
    """A function: where the mean of z~ of some rows is on the line from its mean in `first` to its mean in `second`."""
    def middle(rows):
        values = list(zip(*map(modulated, rows)))
        return [sum(v) / len(v) for v in values]

    a, b = (middle([r for r in rows if float(r["time_s"]) >= START]) for rows in (first, second))
    square = sum((y - x) ** 2 for x, y in zip(a, b))
    return lambda rows: sum((m - x) * (y - x) for m, x, y in zip(middle(rows), a, b)) / square


def crossing(given, pair, speed, name):
    """{strides, latent} of the course of a pair; z~ is measured between the means of walks on either ground alone."""
    alone = [walk(given, ground, speed, f"{name}_{ground}")[1] for ground in pair.split(">")]
    stances, latent = walk(given, course_of(pair), speed, name)
    return {"strides": strides_of(stances, latent, axis_between(*alone), 1 if speed > 0 else -1), "latent": latent}


def figure(given, pair, speed):
    """Draws it, and prints the strides about both borders."""
    import figures
    ways = {"forward": speed, "backward": -speed}
    found = {way: crossing(given, pair, v, way) for way, v in ways.items()}
    first, second = pair.split(">")
    for way, walked in found.items():
        for border, text in ((PATCH, pair), (2 * PATCH, f"{second}>{first}")):
            print(f"\n{way}, {text}: strides from the first that ends beyond the border\n" + " ".join(f"{h:>10}" for h in ("number", *QUANTITIES)))
            for row in over_border(walked["strides"], border):
                print(f"{row['number']:>10} " + " ".join(f"{row[k] * scale:10.3f}" for k, (_, scale) in QUANTITIES.items()))
    save(given, "strides", [{"way": way, **s} for way, walked in found.items() for s in walked["strides"]])
    figures.transition({way: walked["strides"] for way, walked in found.items()}, {way: walked["latent"] for way, walked in found.items()},
                       (first, second), PATCH, QUANTITIES).savefig(given.out / "transition.png", dpi=110)
    print(given.out / "transition.png")


# ---- the command ----

def fail(text):
    print(f"transitions.py: {text}", file=sys.stderr)
    sys.exit(2)


def check_pair(pair):
    grounds = pair.split(">")
    if len(grounds) != 2 or not set(grounds) <= set(NINE):
        fail(f"{pair}: no pair FIRST>SECOND of {' '.join(NINE)}")
    return pair


def parse(words):
    own, more = (words[:words.index("--")], words[words.index("--") + 1:]) if "--" in words else (words, [])
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--policy", type=pathlib.Path, default=ROOT / "policies/mild.safetensors")
    parser.add_argument("--controller", default="learned")
    parser.add_argument("--config", type=pathlib.Path, default=ROOT / "configs/walk.ini")
    parser.add_argument("--pairs", default=",".join(PAIRS), help="FIRST>SECOND[,...] (default: all 72)")
    parser.add_argument("--speeds", default=",".join(map(str, SPEEDS)), help="[m/s] (default %(default)s)")
    parser.add_argument("--trials", type=int, default=10, help="of each pair and speed (default 10)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="programs at a time (default: one per core)")
    parser.add_argument("--figure", metavar="PAIR", help="also draw the strides and z~ over the borders of FIRST>SECOND>FIRST, at 0.6 m/s")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder to write to")
    given = parser.parse_args(own)
    given.pairs = [check_pair(pair) for pair in given.pairs.split(",") if pair]
    try:
        given.speeds = [float(v) for v in given.speeds.split(",")]
    except ValueError:
        given.speeds = []
    if not given.speeds or any(abs(v) < 0.1 or abs(v) > 3 for v in given.speeds):
        fail("--speeds: numbers of at least 0.1 and at most 3 m/s forward or backward, with commas between them")
    if given.figure:
        check_pair(given.figure)
    given.who = ["--policy", given.policy.resolve(), "--config", given.config.resolve(), "--controller", given.controller, *more]
    return given


def main():
    given = parse(sys.argv[1:])
    given.out.mkdir(parents=True, exist_ok=True)
    if given.pairs:
        begin = time.time()
        cells = judge(given.who, given.pairs, given.speeds, given.trials, given.seed, given.jobs)
        report = {"policy": str(given.policy), "options": list(map(str, given.who[2:])), "version": mild("--version").strip(), "seed": given.seed,
                "patch": PATCH, "totals": totals(cells), "cells": cells}
        (given.out / "transitions.json").write_text(json.dumps(report, indent=1) + "\n")
        print_table(cells)
        print_totals(cells)
        print(f"{sum(c['trials'] for c in cells)} trials in {time.time() - begin:.0f} s: {given.out / 'transitions.json'}")
    if given.figure:
        figure(given, given.figure, 0.6)


if __name__ == "__main__":
    main()
