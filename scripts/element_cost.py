#!/usr/bin/env python3
"""Where the time of a ground element goes on a CPU (docs/performance.md): instructions of a step by callgrind, and the loops over elements by
llvm-mca, cycles for a vector of four beside the operations of their formulas.

    cmake -S . -B v3 -DCMAKE_BUILD_TYPE=Release -DMILD_MARCH=x86-64-v3 && cmake --build v3 --target mild    # Valgrind has no AVX-512
    scripts/element_cost.py v3/mild                                                                         # valgrind, llvm

A robot stands on loose sand: 154 elements, steps of 2.5 ms, the difference of two runs."""
import collections
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

STEPS, ELEMENTS, LANES = 2400, 154, 4
CORE = "znver3"  # the newest of LLVM 14 with AVX2
WITHIN = 0xffffff  # bits of an address that do not depend on where the program was loaded
GROUPS = {  # of the functions in src/ground
    "pass": "forces and their derivatives, a pass of Newton's method", "moments": "their sums over a sole", "foot_begin": "what a step begins with",
    "remember": "what an element remembers", "gather": "which elements touch", "newton": "Newton's 12 x 12 system", "rest": "the rest"}


def group_of(function):
    if function in ("pass", "moments", "lanes_sum", "factor_add"):
        return "pass" if function == "pass" else "moments"
    if "remember" in function or "advance" in function:
        return "remember"
    if function == "foot_begin":
        return function
    if re.match(r"slots_|foot_(list|locate|set_pose|is_away|motion|finish|descent)", function):
        return "gather"
    return "newton" if re.match(r"rows_|system_|point_step|newton_", function) else "rest"


def counted(program, seconds, folder):
    """{address: (instructions, function)} of the program's own code in src/ground."""
    out = folder / f"{seconds}.out"
    subprocess.run(["valgrind", "--quiet", "--tool=callgrind", "--dump-instr=yes", "--compress-pos=no", "--compress-strings=no",
                    f"--callgrind-out-file={out}", program, "eval", "--controller", "stand", "--speed", "0", "--ground", "sand_loose", "--trials", "1",
                    "--seconds", str(seconds), "--threads", "1", "--task.physics_dt=0.0025"], check=True, stdout=subprocess.DEVNULL)
    counts, function, ours, skip = {}, "", False, False
    for line in out.read_text().splitlines():
        if line.startswith("fn="):
            function = line[3:].split("'")[0].split(".")[0]
        elif line.startswith("fl="):
            ours = "src/ground/" in line or "/ground/ground/" in line
        elif line.startswith("calls="):
            skip = True  # the next line is the cost of the callee
        elif line.startswith("0x"):
            if ours and not skip:
                address, _, cost = line.split()[:3]
                counts[int(address, 16)] = (counts.get(int(address, 16), (0, ""))[0] + int(cost), function)
            skip = False
    return counts


def loops(program, counts):
    """(function, times a step, body) of the innermost loops of vectors that run."""
    code = []
    for line in subprocess.run(["objdump", "-d", "--no-show-raw-insn", program], capture_output=True, text=True, check=True).stdout.splitlines():
        found = re.match(r"\s+([0-9a-f]+):\s+(.*)", line)
        if found:
            code.append((int(found[1], 16), found[2].strip()))
    low = {a & WITHIN: a for a in counts}
    place = {a: i for i, (a, _) in enumerate(code)}
    for i, (address, text) in enumerate(code):
        jump = re.match(r"j\w+\s+([0-9a-f]+) ", text)
        if not jump or (start := place.get(int(jump[1], 16))) is None or start >= i:
            continue
        body, here = [t for _, t in code[start:i]], low.get(address & WITHIN)
        vectors = [t for t in body if "ymm" in t]
        if here is not None and len(vectors) > 15 and not any(re.match(r"j\w+ |call", t) for t in body):
            yield counts[here][1], counts[here][0] / STEPS, body


def main():
    if len(sys.argv) != 2:
        sys.exit("element_cost.py: usage: scripts/element_cost.py v3/mild")
    program = sys.argv[1]
    if not os.access(program, os.X_OK):
        sys.exit(f"element_cost.py: {program}: no such program; the head of this file says how it is made")
    for tool in ("valgrind", "objdump", "llvm-mca"):
        if not shutil.which(tool):
            sys.exit(f"element_cost.py: {tool} is missing; apt-get install valgrind binutils llvm")
    with tempfile.TemporaryDirectory() as name:
        short, long = (counted(program, seconds, pathlib.Path(name)) for seconds in (3, 9))
    counts = {a: (n - short.get(a, (0, ""))[0], f) for a, (n, f) in long.items()}
    groups = collections.Counter()
    for number, function in counts.values():
        groups[group_of(function)] += number / STEPS
    whole = sum(groups.values())
    print(f"{whole:.0f} instructions of the ground a step, {whole / ELEMENTS:.0f} an element\n\n| | instructions an element | share |\n|---|---|---|")
    for key, text in GROUPS.items():
        print(f"| {text} | {groups[key] / ELEMENTS:.0f} | {groups[key] / whole:.0%} |")
    print("\n| loop in | vectors a step | instructions | operations | divisions, roots | cycles: ports, with latencies |\n|---|---|---|---|---|---|")
    for function, times, body in sorted(loops(program, counts), key=lambda row: -row[1] * len(row[2])):
        vector = [t.split()[0] for t in body if "ymm" in t]
        work = sum(2 if re.match(r"vfn?m", t) else 1 for t in vector if re.match(r"v(add|sub|mul|div|sqrt|max|min|fn?m)", t))
        text = "\n".join(re.sub(r"<.*?>|#.*", "", t) for t in body)
        said = subprocess.run(["llvm-mca", f"-mcpu={CORE}", "-iterations=200"], input=text, capture_output=True, text=True, check=True).stdout
        cycles, ports = (float(re.search(key + r":\s+([\d.]+)", said)[1]) for key in ("Total Cycles", "Block RThroughput"))
        slow = sum("div" in t for t in vector), sum("sqrt" in t for t in vector)
        print(f"| `{function}` | {times:.0f} | {len(body)} | {work} | {slow[0]}, {slow[1]} | {ports:.0f}, {cycles / 200:.0f} |")


if __name__ == "__main__":
    main()
