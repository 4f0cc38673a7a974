#!/usr/bin/env python3
"""Table of the trainings of lab/paper/changes.sh deviations: deviations.py FOLDER. A row per change, over its seeds: trials that stayed up, mean error of
the speed, cost of transport and swing clearance over grounds and speeds, largest torque."""
import json
import pathlib
import sys

FIRST = "as_it_is"


def fail(text):
    print(f"deviations: {text}", file=sys.stderr)
    sys.exit(2)


def measures(path):
    """Upright trials, trials, and means over the rows in which at least half of the trials stayed up and there is a number."""
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))["rows"]
    except (ValueError, KeyError, TypeError):
        fail(f"{path}: not a table of mild eval --json")
    walked = [row for row in rows if 2 * row["success"] >= row["trials"]]

    def mean(key, function):
        values = [function(row) for row in walked if row[key] is not None]
        return sum(values) / len(values) if values else float("nan")
    return (sum(row["success"] for row in rows), sum(row["trials"] for row in rows), mean("velocity", lambda row: abs(row["velocity"] - row["speed"])),
            mean("cot", lambda row: row["cot"]), mean("clearance", lambda row: 1e3 * row["clearance"]),
            max((row["torque_max"] for row in walked), default=float("nan")))


def spread(values, digits):
    """Mean, with the range of several seeds."""
    text = f"{sum(values) / len(values):.{digits}f}"
    return text if len(values) == 1 else f"{text} ({min(values):.{digits}f} to {max(values):.{digits}f})"


def main():
    if len(sys.argv) != 2:
        fail("usage: deviations.py FOLDER")
    runs = {}
    for path in sorted(pathlib.Path(sys.argv[1]).glob("*-*.json")):
        runs.setdefault(path.stem.rsplit("-", 1)[0], []).append(measures(path))
    if not runs:
        fail(f"no NAME-SEED.json in {sys.argv[1]}; lab/paper/changes.sh deviations makes them")
    print("| set back | seeds | upright | speed off [m/s] | cost of transport | clearance [mm] | largest torque [N m] |\n|---|---|---|---|---|---|---|")
    for name in sorted(runs, key=lambda name: (name != FIRST, name)):
        up, trials, error, cost, clearance, torque = zip(*runs[name])
        print(f"| {name} | {len(up)} | {sum(up)} of {sum(trials)} | {spread(error, 3)} | {spread(cost, 2)} | {spread(clearance, 0)} | {spread(torque, 0)} |")


if __name__ == "__main__":
    main()
