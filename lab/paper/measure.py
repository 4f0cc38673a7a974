"""Runs build/mild, several at a time, and keeps what it measures."""
import concurrent.futures
import csv
import json
import math
import os
import pathlib
import shlex
import struct
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
MILD = shlex.split(os.environ.get("MILD", str(ROOT / "build/mild")))
SHIPPED = ROOT / "policies/paper"  # seed 1 of each, in half precision
SEVEN = ["rigid", "rubber", "foam60", "foam45", "foam28", "grass", "sand_loose"]  # the paper's six and the rigid plane
OF_PAPER = ["--model", "mild"]  # its law on sand too, where slip costs nothing
ALONE = ["--task.speed_hold=0"]  # a policy is judged without the speed hold
NINE = ["rigid", "rubber", "foam60", "foam45", "foam28", "foam25", "grass", "sand_loose", "sand_dense"]
TRAINED = ["mild", "con_cone", "con_spring", "ecc_spring", "ecc_quasi", "ecc_quasi_3d", "mild_merged", "rigid"]
SLIPS = ["mild_slips", "mild_merged_slips"]  # trained where slip sinks: train.sh

# [what, grounds, further options]: laws and numbers with which the shipped policy was never trained
UNSEEN = [["Bekker's published soils", ["dry_sand", "sandy_loam", "clay", "snow", "lunar_soil"], []],
          ["hunt_crossley", SEVEN[1:], ["--model", "hunt_crossley"]],
          ["ecc_spring", SEVEN[1:], ["--model", "ecc_spring"]],
          ["ecc_quasi_3d", SEVEN[1:], ["--model", "ecc_quasi_3d"]],
          ["half as stiff as the softest foam", ["foam25"], ["--ground.k_pen=75", "--ground.sigma_cone=5.5e4"]],
          ["a course of three grounds, 1 m each", ["rubber+foam28+sand_loose+rubber+foam28+sand_loose"], ["--patch", 1]]]


def mild(*arguments):
    """Runs build/mild; what it prints."""
    done = subprocess.run([*MILD, *map(str, arguments)], capture_output=True, text=True, cwd=ROOT, check=False)
    if done.returncode:
        sys.exit(f"mild {' '.join(map(str, arguments))}:\n{done.stderr}")
    return done.stdout


def together(given, work, items):
    """[work(item)] in the order of the items, given.jobs at a time."""
    with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
        return list(pool.map(work, items))


def law_of(grounds, more):
    """Options: the paper's law, unless another one is given or the grounds are none of its nine."""
    known = all(part in NINE for ground in grounds for part in ground.split("+"))
    return OF_PAPER if known and "--model" not in more else []


def evaluate(given, policy, grounds, speeds, *more):
    """Rows of `mild eval`; no policy: --controller says who walks. NaN: not measured."""
    who = ["--policy", policy] if policy else []
    rows = json.loads(mild("eval", "--seed", given.seed, *who, "--ground", ",".join(grounds), "--speed=" + ",".join(map(str, speeds)),
                           "--trials", given.trials, "--threads", 1, "--json", "-", *ALONE, *law_of(grounds, more), *more))["rows"]
    return [{key: float("nan") if value is None else value for key, value in row.items()} for row in rows]


def save(given, name, rows):
    """rows: [{column: value}] to OUT/NAME.csv."""
    with open(given.out / f"{name}.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows({k: round(v, 6) if isinstance(v, float) else v for k, v in row.items()} for row in rows)


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def mean(values):
    """Of what was measured."""
    values = [value for value in values if value == value]
    return sum(values) / len(values) if values else float("nan")


def deviation(values):
    values = list(values)
    middle = mean(values)
    return math.sqrt(sum((v - middle) ** 2 for v in values) / (len(values) - 1)) if len(values) > 1 else 0.0


def models_of(given, names=TRAINED):
    """{model: [policy of each seed]} of those that are there."""
    found = {model: sorted(given.models.glob(f"{model}-[0-9]*.safetensors")) for model in names}
    return {model: files for model, files in found.items() if files}


def rivals_of(given):
    """{name in the paper: (controller, [weights of each seed])} of those that are there, or shipped."""
    found = {}
    for name, kind in {"HT-2": "ht2", "Clock": "clock"}.items():
        for folder in (given.models, SHIPPED):
            files = sorted(f for f in folder.glob(f"{kind}*.safetensors") if "first_stage" not in f.name)
            if files and name not in found:
                found[name] = kind, files
    return found


def note_of(path):
    """What the file says of how it was trained."""
    with open(path, "rb") as file:
        size = struct.unpack("<Q", file.read(8))[0]
        return json.loads(file.read(size)).get("__metadata__", {}).get("note", "")

