#!/usr/bin/env python3
"""Counts the functions inside of layers that tests call: those which a header of src or lab declares and which no other layer,
nor the Python package, the plugin or exported C, names. Tests of a layer's seam, what these and the public headers call, leave its
inside free to change (docs/testing.md). Ends with 1 if there are more than --most. Usage: scripts/seams.py [--list] [--most N]"""
import argparse
import collections
import itertools
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PUBLIC = ("include", "python", "plugin", "src/deploy/export/c")  # the last is the C that mild export writes, which others call
CODE = {".c", ".h", ".cu", ".cpp", ".inc"}
DECLARED = re.compile(r"^(?:\w[\w]*[\s*]+)+([a-z_]\w*)\s*\(", re.M)  # at the beginning of a line
OWN = re.compile(r"^static [^=;{}()]*\b([a-z_]\w*)\s*\(", re.M)
STAND_IN = re.compile(r"^(?:\w[\w]*[\s*]+)+([a-z_]\w*)\s*\([^;{}]*\)\s*\{", re.M)  # a function that a test has in the place of ours


def sources(folder):
    for path in sorted((ROOT / folder).rglob("*")):
        if path.suffix in CODE:
            text = re.sub(r"/\*.*?\*/|//[^\n]*", " ", path.read_text(errors="replace"), flags=re.S)
            yield path.relative_to(ROOT / folder), re.sub(r'"(\\.|[^"\\\n])*"', '""', text)


def lab(tests):
    """The sources of lab's layers, either those of tests or the others; grains is a program, not a layer."""
    return ((path, text) for path, text in sources("lab") if ("tests" in path.parts) == tests and path.parts[0] != "grains")


def inside():
    """{layer: {function}} of the functions that only their own layer names, and the headers that declare them."""
    declared, named = {}, collections.defaultdict(set)
    public = {name for folder in PUBLIC for _, text in sources(folder) for name in re.findall(r"\w+", text)}
    for path, text in itertools.chain(sources("src"), lab(tests=False)):
        layer = "app" if path.name.startswith("cmd_") else str(path.parent)  # the lab's commands, too
        for name in set(re.findall(r"\b[a-z_]\w*\b", text)):
            named[name].add(layer)
        if path.suffix == ".h":
            for name in DECLARED.findall(text):
                declared.setdefault(name, layer)
    return {name: layer for name, layer in declared.items() if named[name] <= {layer} and name not in public}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", action="store_true", help="print them, with the folders of tests that call them")
    parser.add_argument("--most", type=int, help="exit 1 above this number")
    options = parser.parse_args()
    private = inside()
    calls = collections.defaultdict(set)
    for path, text in itertools.chain(sources("tests"), lab(tests=True)):
        own = {*OWN.findall(text), *STAND_IN.findall(text)}
        for name in re.findall(r"\b([a-z_]\w*)\s*\(", text):
            if name in private and name not in own:
                calls[name].add(path.parts[0])
    layers = collections.Counter(private[name] for name in calls)
    if options.list:
        for name in sorted(calls, key=lambda name: (private[name], name)):
            print(f"{private[name]:16} {name:32} {' '.join(sorted(calls[name]))}")
    print(f"{len(calls)} of {len(private)} functions inside of layers are called by tests:",
          ", ".join(f"{layer} {count}" for layer, count in layers.most_common()))
    if options.most is not None and len(calls) > options.most:
        print(f"at most {options.most} may be: test what other layers call instead, or say in tests/CMakeLists.txt why not", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
