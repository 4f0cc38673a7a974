#!/usr/bin/env python3
"""The structs of scripts/rivals/envs.py have the members of the headers that they stand for, in their order: ctypes cannot tell.
Usage: test_rivals.py SOURCE_FOLDER"""
import pathlib
import re
import sys

root = pathlib.Path(sys.argv[1])
header = "".join((root / "src" / path).read_text() for path in ("env/task/view.h", "env/envs_step.h", "run/envs/envs.h"))
script = (root / "scripts/rivals/envs.py").read_text()


def members(name):
    """Of a C struct, in their order."""
    body = re.search(r"typedef struct \{((?:(?!typedef).)*)\} " + name + ";", header, re.DOTALL).group(1)
    body = re.sub(r"/\*.*?\*/", "", body, flags=re.DOTALL)
    return re.findall(r"(\w+)(?:\[\w+\])?\s*;", body)


def fields(name):
    """Of a class of the script: its tuples of names, and the fields that stand by name."""
    body = re.search(rf"class {name}\(ctypes\.Structure\):\n((?:    .*\n)+)", script).group(1)
    tuples = dict(re.findall(r"    (\w+) = \(((?:\"\w+\",? ?)+)\)", body))
    found = []
    for own, single in re.findall(r"for \w+ in (\w+|\([^)]*\))|\(\"(\w+)\",", body[body.index("_fields_"):]):
        found += re.findall(r"\w+", tuples.get(own, own) or single)
    return found


for theirs, ours in (("MildEnvsShape", "Shape"), ("EnvsView", "View"), ("EnvsStep", "Step"), ("EnvsStats", "Statistics")):
    assert members(theirs) and members(theirs) == fields(ours), f"{ours}: {fields(ours)}, but {theirs} has {members(theirs)}"
    print(f"{ours}: {len(fields(ours))} members")
