#!/usr/bin/env python3
"""Walks on grounds drawn at random within the paper's Table II: each number by itself, evenly between the limits that [randomize] in
configs/default.ini has for it.

  lab/paper/random_grounds.py --out out/random                               # 60 grounds, three speeds, two trials: 360 trials
  lab/paper/random_grounds.py --out out/random --seed 2 -- --task.shells_stand=false

Prints how many trials stay upright at each speed, and the grounds on which some do not; OUT/random_grounds.csv has a row for each ground
and speed. Options after -- go to every `mild eval`."""
import argparse
import configparser
import json
import os
import pathlib
import random

from measure import ROOT, mild, save, together

KEYS = ("k_pen", "sigma_cone", "alpha", "nu", "c_g", "c_d", "phi", "mu", "rho", "k_drift", "b_drift", "recovery", "bed_depth")
DEFAULT = ROOT / "configs/default.ini"


def ranges():
    """{key: (low, high)}"""
    ini = configparser.ConfigParser(inline_comment_prefixes=("#", ";"))
    ini.read(DEFAULT)
    return {key: tuple(map(float, ini["randomize"][key].split())) for key in KEYS}


def draw(limits, chance):
    return {key: low + chance.random() * (high - low) for key, (low, high) in limits.items()}


def options(ground):
    return [f"--ground.{key}={value:.6g}" for key, value in ground.items()]


def drawn(seed, count=60):
    """The grounds."""
    limits, chance = ranges(), random.Random(seed)
    return [draw(limits, chance) for _ in range(count)]


def walk(who, ground, number, speeds, trials):
    """Rows of mild eval on ground number `number`. who: options of mild eval that say who walks."""
    return json.loads(mild("eval", "--ground", "foam45", *options(ground), f"--speed={speeds}", "--trials", trials, "--seed", number + 1,
                           "--threads", 1, "--json", "-", *who))["rows"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--grounds", type=int, default=60)
    parser.add_argument("--speeds", default="0.3,0.6,0.9")
    parser.add_argument("--trials", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("options", nargs="*", help="after --: of mild eval")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    grounds = drawn(given.seed, given.grounds)
    found = together(given, lambda n: walk(given.options, grounds[n], n, given.speeds, given.trials), range(len(grounds)))
    rows = [{"ground": number, "speed": row["speed"], "upright": row["success"], "trials": row["trials"], "velocity": row["velocity"],
             "cot": row["cot"], "torque_max": row["torque_max"], "shells": row["shells"],
             "ends": " ".join(f"{end}:{n}" for end, n in row["ends"].items() if n and end != "time"),
             **{key: float(f"{value:.6g}") for key, value in grounds[number].items()}} for number, own in enumerate(found) for row in own]
    save(given, "random_grounds", rows)
    for speed in sorted({row["speed"] for row in rows}):
        own = [row for row in rows if row["speed"] == speed]
        print(f"{speed:5.2f} m/s: {sum(r['upright'] for r in own)} of {sum(r['trials'] for r in own)} upright")
    for row in rows:
        if row["upright"] < row["trials"]:
            print(f"ground {row['ground']:2d} at {row['speed']:.2f} m/s: {row['upright']} of {row['trials']}, {row['ends']}; k_pen {row['k_pen']:.0f}, "
                  f"sigma_cone {row['sigma_cone']:.0f}, mu {row['mu']:.2f}, alpha {row['alpha']:.2f}, nu {row['nu']:.2f}")
    print(f"{sum(r['upright'] for r in rows)} of {sum(r['trials'] for r in rows)} trials upright")


if __name__ == "__main__":
    main()
