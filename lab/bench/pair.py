#!/usr/bin/env python3
"""Is a build faster than another? Runs `mild bench` of both in turns and prints the median of the ratios new / old.

    lab/bench/pair.py OLD/build/mild build/mild step ground walk --rounds 9

Each program runs in its own tree (the folder above build/), so that it finds its own configs and policy."""
import argparse
import json
import pathlib
import statistics
import subprocess
import sys


def measure(program, benches):
    program = pathlib.Path(program).resolve()
    command = [program, "bench", *benches, "--json", "-"]
    output = subprocess.run(command, cwd=program.parents[1], check=True, capture_output=True, text=True).stdout
    rows = json.loads(output[output.index("{"): output.rindex("}") + 1])["rows"]  # the table for people stands before it
    return {(row["bench"], row["case"]): (row["value"], row["unit"]) for row in rows}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("bench", nargs="+")
    parser.add_argument("--rounds", type=int, default=9)
    options = parser.parse_args()
    pairs = {}
    for turn in range(options.rounds):
        programs = [options.old, options.new]
        if turn % 2:
            programs.reverse()
        results = {program: measure(program, options.bench) for program in programs}
        old, new = results[options.old], results[options.new]
        for key in old.keys() & new.keys():
            if old[key][0] and new[key][0]:
                pairs.setdefault(key, []).append((old[key][0], new[key][0], new[key][1]))
    print(f"{'bench':8} {'case':26} {'old':>10} {'new':>10} {'unit':5} {'ratio':>7}   quartiles of {options.rounds}")
    for (bench, case), rows in sorted(pairs.items()):
        ratios = [new / old for old, new, _ in rows]
        low, middle, high = statistics.quantiles(ratios, n=4) if len(ratios) > 1 else ratios * 3
        old, new = (statistics.median(row[i] for row in rows) for i in (0, 1))
        print(f"{bench:8} {case:26} {old:10.4g} {new:10.4g} {rows[0][2]:5} {middle:7.3f}   {low:.3f} {high:.3f}")


if __name__ == "__main__":
    sys.exit(main())
