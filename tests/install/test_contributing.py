#!/usr/bin/env python3
"""Follows the recipes of CONTRIBUTING.md and of docs/tutorials/add-a-model.md in a copy of the tree, block by block, and compiles what comes out: every file that a recipe
touches with the compiler of this machine and, when nvcc is found, the reward and the model as a GPU has them. With --run it builds
the program and runs the commands of the recipes. The blocks of the page are its only source, so the pages cannot be wrong for long.

A block of C stands behind the words 'In [FILE](...), before `LINE`:' or 'New file [FILE](...):'; a block of sh has commands.
Usage: test_contributing.py SOURCE_FOLDER [--run] [--jobs N]"""
import argparse
import csv
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

BLOCK = re.compile(r"^(?P<fence>```)(?P<kind>c|sh)\n(?P<text>.*?)^```$", re.M | re.S)
PLACE = re.compile(r"(?:In \[(?P<file>[^\]]+)\]\([^)]*\),\s+before\s+`(?P<before>[^`]+)`|New file \[(?P<new>[^\]]+)\]\([^)]*\)):\n\n$")
RECIPES = ["A reward", "A task", "A ground model", "A terrain", "A controller", "A command"]
LEFT_OUT = {".git", ".venv", "out", "runs", "docs"}
NVCC = ["nvcc", "/usr/local/cuda/bin/nvcc"]


class Wrong(Exception):
    pass


def recipes(text, tutorial=None):
    """{recipe: [(what, ...)]} in the order of the page: ("insert", file, line, code), ("file", name, code), ("run", command).
    tutorial: (recipe, text) of a page that is one recipe."""
    found = {}
    parts = [part.partition("\n")[::2] for part in re.split(r"^## ", text, flags=re.M)[1:]]
    for title, body in parts + ([tutorial] if tutorial else []):
        steps = found.setdefault(title.strip(), [])
        for block in BLOCK.finditer(body):
            if block["kind"] == "sh":
                steps += [("run", line) for line in block["text"].splitlines() if line.strip()]
                continue
            place = PLACE.search(body[:block.start()])
            if not place:
                raise Wrong(f"{title}: a block of C does not say where it goes: 'In [FILE](FILE), before `LINE`:'")
            if place["new"]:
                steps.append(("file", place["new"], block["text"]))
            else:
                steps.append(("insert", place["file"], place["before"], block["text"]))
    missing = [name for name in RECIPES if not any(step[0] != "run" for step in found.get(name, []))]
    if missing:
        raise Wrong(f"no block of C under {', '.join(missing)}")
    return found


def insert(path, before, code):
    """Puts code before the one line that begins with `before`, with an empty line behind it where that line had one before it."""
    if not path.is_file():
        raise Wrong(f"there is no {path.name} to change")
    lines = path.read_text(encoding="utf-8").split("\n")
    at = [i for i, line in enumerate(lines) if line.startswith(before)]
    if len(at) != 1:
        raise Wrong(f"{path.name} has {len(at)} lines that begin with '{before}', not one")
    gap = [""] if at[0] > 0 and not lines[at[0] - 1].strip() else []
    lines[at[0]:at[0]] = code.rstrip("\n").split("\n") + gap
    path.write_text("\n".join(lines), encoding="utf-8")


def apply(tree, steps):
    """Does what a recipe says to files; returns those that it touched."""
    touched = []
    for step in steps:
        if step[0] == "file":
            path = tree / step[1]
            if path.exists():
                raise Wrong(f"{step[1]} is there already")
            path.write_text(step[2], encoding="utf-8")
        elif step[0] == "insert":
            insert(tree / step[1], step[2], step[3])
        if step[0] != "run":
            touched.append(step[1])
    return touched


def copy(source, tree):
    """The tree without what it ignores at its top and without its pages, which nothing here compiles."""
    def left_out(folder, names):
        top = pathlib.Path(folder) == source
        return [name for name in names if name == "__pycache__" or top and (name in LEFT_OUT or name.startswith("build"))]
    shutil.copytree(source, tree, symlinks=True, ignore=left_out)
    (tree / "docs").symlink_to(source / "docs")
    if (source / ".venv").exists():
        (tree / ".venv").symlink_to((source / ".venv").resolve())


def call(command, cwd, **more):
    done = subprocess.run(command, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, **more)
    if done.returncode:
        raise Wrong(f"exit {done.returncode}: {command if isinstance(command, str) else ' '.join(map(str, command))}\n{done.stdout[-4000:]}")
    return done.stdout


def include_flags(tree):
    """Every layer's include root, as src/CMakeLists.txt makes it, and the headers that no layer has."""
    mujoco = sorted((tree / ".venv").glob("lib/python3*/site-packages/mujoco/include"))
    return ["-Isrc", "-Iinclude", *(f"-I{path}" for path in mujoco)]


def units(tree, touched):
    """The units that see what the recipes changed: each file, and for a header those that its rows make."""
    made = {"src/env/task/task_def.h": ["src/env/task/task_def.c"], "src/env/task/reward.h": ["src/env/task/env.c"],
            "src/env/task/state.h": ["src/env/task/shape.c", "src/deploy/export/describe.c"], "src/env/task/randomize.h": ["src/env/task/env.c"],
            "include/mild/ground.h": ["src/ground/models/models.c", "src/ground/models/material.c"],
            "include/mild/map.h": ["src/ground/terrain/map.c"], "src/control/controller.h": ["src/control/controllers.c"],
            "src/app/commands.h": ["src/app/main.c"]}
    found = []
    for name in touched:
        if name.endswith(".h") and name not in made:
            raise Wrong(f"this test does not know which unit the rows of {name} make: add it to units()")
        found += made.get(name, [name])
    return list(dict.fromkeys(found))


def compile_c(tree, names):
    compiler = os.environ.get("CC", "cc")
    for name in names:
        call([compiler, "-std=c17", "-O0", "-D_POSIX_C_SOURCE=200809L", "-Wall", "-Wextra", "-Wconversion", "-Werror",
              "-fopenmp-simd", *include_flags(tree), "-Itests", f'-DMILD_SOURCE_DIR="{tree}"', "-c", name, "-o", os.devnull], tree)


def compile_cuda(tree, nvcc):
    """The environments and the batch ground as a GPU has them; PTX only, because that is where a recipe can be wrong."""
    unit = tree / "recipe.cu"
    unit.write_text('#define ENVS_KERNELS envs_kernels_any\n#include "env/batch_device.cu"\n', encoding="utf-8")
    call([nvcc, "-std=c++17", "-O0", "-arch=sm_90", "-Werror", "cross-execution-space-call", *include_flags(tree), "-ptx", unit.name, "-o", os.devnull],
         tree)


def check_rewards(tree, command):
    """In the log of a training, the rewards that its command turns on are numbers, and not 0."""
    out = re.search(r" train .*--out (\S+)", command)
    for name in re.findall(r"--reward\.(\w+)=", command) if out else []:
        with open(tree / out[1] / "log.csv", encoding="utf-8") as log:
            column = [float(row[f"reward/{name}"]) for row in csv.DictReader(log)]
        if not any(math.isfinite(number) and number != 0 for number in column):
            raise Wrong(f"reward/{name} counts nowhere in {out[1]}/log.csv: {column}")


def run_commands(tree, steps, jobs):
    call(["cmake", "-S", ".", "-B", "build", "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_C_FLAGS_RELEASE=-O1", "-DMILD_WERROR=ON",
          "-DMILD_PYTHON=OFF", "-DMILD_PLUGIN=OFF", "--log-level=WARNING"], tree)
    call(["cmake", "--build", "build", "--parallel", str(jobs), "--target", "mild"], tree)
    tests = sorted(set(re.findall(r"-R '([^']*)'", "\n".join(step[1] for step in steps if step[0] == "run"))))
    listed = call(["ctest", "--test-dir", "build", "-N", "-R", "|".join(tests)], tree)
    names = [name.replace("/", "_", 1) for name in re.findall(r"Test +#\d+: (\S+)", listed)]
    known = call(["cmake", "--build", "build", "--target", "help"], tree)
    call(["cmake", "--build", "build", "--parallel", str(jobs), "--target",
          *[name for name in names if re.search(rf"\b{re.escape(name)}\b", known)]], tree)
    for step in steps:
        if step[0] == "run":
            print(f"  {step[1]}", flush=True)
            call(step[1], tree, shell=True)
            check_rewards(tree, step[1])


def check_itself(work):
    """What this test is for is seen: a line that is not there, a block without a place, a reward that counts nowhere."""
    (work / "one.c").write_text("int a;\nint b;\nint b;\n", encoding="utf-8")
    for before in ("int c;", "int b;"):
        try:
            insert(work / "one.c", before, "int d;")
        except Wrong:
            continue
        raise Wrong(f"a line that is there not once is no fault: {before}")
    (work / "log.csv").write_text("reward/a,reward/b\nnan,nan\n0,-0.5\n", encoding="utf-8")
    check_rewards(work, "mild train --out . --reward.b=-1")
    try:
        check_rewards(work, "mild train --out . --reward.a=1")
    except Wrong:
        pass
    else:
        raise Wrong("a reward of nan and 0 is no fault")
    try:
        recipes("## A reward\n\nHere:\n\n```c\nint a;\n```\n")
    except Wrong as wrong:
        if "does not say where" in str(wrong):
            return
    raise Wrong("a block without a place is no fault")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("source", type=pathlib.Path)
    parser.add_argument("--run", action="store_true")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    args = parser.parse_args()
    source = args.source.resolve()
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        try:
            check_itself(work)
            found = recipes((source / "CONTRIBUTING.md").read_text(encoding="utf-8"),
                            ("A ground model", (source / "docs/tutorials/add-a-model.md").read_text(encoding="utf-8")))
            tree = work / "tree"
            copy(source, tree)
            steps = [step for name in RECIPES for step in found[name]]
            names = units(tree, apply(tree, steps))
            compile_c(tree, names)
            nvcc = next((path for path in map(shutil.which, NVCC) if path), None)
            if nvcc:
                compile_cuda(tree, nvcc)
            if args.run:
                run_commands(tree, steps, args.jobs)
        except Wrong as wrong:
            sys.exit(f"FAIL: CONTRIBUTING.md: {wrong}")
    print(f"{len(RECIPES)} recipes, {sum(step[0] != 'run' for step in steps)} blocks, {len(names)} units"
          f"{', nvcc' if nvcc else ', no nvcc here'}{', commands run' if args.run else ''}")


if __name__ == "__main__":
    main()
