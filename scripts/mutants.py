#!/usr/bin/env python3
"""Mutation testing: makes small random faults in one layer, runs that layer's tests on each, and
prints the share that the tests catch and the faults that survive. docs/testing.md explains it.

A fault (mutant) changes one place of src/LAYER: an operator, a number, a condition, an index, the
order of two arguments, a sign, or it removes a statement. Text inside comments, strings, error
messages and assertions stays. Everything happens in a copy of the tree under build/mutants."""

import argparse
import concurrent.futures
import dataclasses
import fcntl
import hashlib
import json
import math
import os
import pathlib
import re
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
WORK = ROOT / "build" / "mutants"
TREE = WORK / "tree"
BUILD = WORK / "build"
NAMED = ROOT / "tests" / "mutants.txt"

# Share of their draws that the ground's random tests make (tests/ground/ground_kit.h).
DRAWS = "0.1"

# A layer without a folder of tests is tested by the layer above it.
TESTED_BY = {"control": ("control", "eval")}

# ---------------------------------------------------------------------------------------------
# Mutants: made from tokens, not from a syntax tree. The tree is formatted by clang-format, and so
# a binary operator is one with a space on both sides, and a function begins in the first column.

TOKEN = re.compile(
    r"""(?P<comment>/\*.*?\*/|//[^\n]*)
      | (?P<string>"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')
      | (?P<directive>^[ \t]*\#[ \t]*\w+)
      | (?P<number>(?:0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)[uUlLfF]*)
      | (?P<name>[A-Za-z_]\w*)
      | (?P<space>(?:\s|\\\n)+)
      | (?P<sign>->|\+\+|--|<<=|>>=|\.\.\.|[-+*/%&|^<>=!]=|<<|>>|&&|\|\||\#\#|.)""",
    re.X | re.S | re.M)

TYPES = set("void char short int long float double signed unsigned const static struct union enum "
            "extern typedef inline volatile restrict register size_t _Bool bool".split())
KEYWORDS = set("return if else for while do switch case default goto break continue sizeof".split())
BINARY = {
    "+": ["-"], "-": ["+"], "*": ["/"], "/": ["*"], "%": ["*"],
    "+=": ["-=", "="], "-=": ["+=", "="], "*=": ["/="], "/=": ["*="], "|=": ["&="], "&=": ["|="],
    "<": ["<=", ">="], "<=": ["<", ">"], ">": [">=", "<="], ">=": [">", "<"],
    "==": ["!="], "!=": ["=="], "&&": ["||"], "||": ["&&"],
    "&": ["|"], "|": ["&"], "^": ["|"], "<<": [">>"], ">>": ["<<"],
}
KIND = {"+": "arithmetic", "-": "arithmetic", "*": "arithmetic", "/": "arithmetic",
        "%": "arithmetic", "<": "relation", "<=": "relation", ">": "relation", ">=": "relation",
        "==": "relation", "!=": "relation", "&&": "logic", "||": "logic", "&": "bits", "|": "bits",
        "^": "bits", "<<": "bits", ">>": "bits"}
FUNCTIONS = {"fmin": "fmax", "fmax": "fmin", "sin": "cos", "cos": "sin", "floor": "ceil",
             "ceil": "floor", "fabs": "", "fabsf": "", "sqrt": "", "abs": "", "isfinite": "!isfinite"}
# The first two arguments exchanged: the same memory, the same verdict on equality, the same number.
SYMMETRIC = set("calloc strcmp strncmp memcmp fmin fmax hypot".split())
# Not mutated inside: messages, assertions, and what frees (the sanitizers watch leaks). Nor removed.
QUIET_CALL = re.compile(r"(static_)?assert|_Static_assert|\w*printf|fputs|puts|perror|\w*_fail|"
                        r"\w*_message|usage")
FREEING_CALL = re.compile(r"free|fclose|close|unlink|remove|\w*_(free|destroy|close)")


@dataclasses.dataclass
class Token:
    kind: str
    text: str
    begin: int
    end: int


@dataclasses.dataclass
class Mutant:
    path: str  # relative to the root
    line: int
    function: str
    kind: str
    begin: int
    end: int
    text: str  # in place of source[begin:end]
    before: str
    after: str
    name: str = ""  # "path function: before -> after", the same wherever the lines move

    def key(self):
        return (self.path, self.function, self.before, self.after)


def tokens_of(source):
    """Tokens that may change: no comments, no directives but the bodies of #define."""
    tokens, position = [], 0
    while position < len(source):
        match = TOKEN.match(source, position)
        kind, position = match.lastgroup, match.end()
        if kind == "directive":
            if match.group().split("#")[1].strip() == "define":
                # skip the macro's name and, directly behind it, its parameters
                head = re.compile(r"[ \t]+\w+(\([^)]*\))?").match(source, position)
                tokens.append(Token("sign", "#define", match.start(), head.end()))
                position = head.end()
            else:
                position = re.compile(r"(?:\\\n|/\*.*?\*/|[^\n])*", re.S).match(source, position).end()
        elif kind not in ("space", "comment"):
            tokens.append(Token(kind, match.group(), match.start(), match.end()))
    return tokens


def partners(tokens):
    """Index of the closing token of every opening one, and back."""
    pair, stack = {}, []
    for i, token in enumerate(tokens):
        if token.kind != "sign":
            continue
        if token.text in "([{":
            stack.append(i)
        elif token.text in ")]}" and stack:
            opening = stack.pop()
            pair[opening], pair[i] = i, opening
    return pair


def is_type(token):
    return token.kind == "name" and (token.text in TYPES or token.text.endswith("_t") or
                                     re.fullmatch(r"(mj)?[A-Z][a-z]\w*|FILE|Real", token.text) is not None)


class File:
    """One source file and all mutants of it."""

    def __init__(self, path):
        self.path = path
        self.source = (TREE / path).read_text()
        self.tokens = tokens_of(self.source)
        self.pair = partners(self.tokens)
        self.starts = [0] + [m.end() for m in re.finditer("\n", self.source)]
        self.quiet = self.quiet_places()
        self.functions = self.function_of_line()

    def line_of(self, position):
        low, high = 0, len(self.starts)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self.starts[middle] <= position else (low, middle)
        return low

    def function_of_line(self):
        """The function, table or macro that each line belongs to, by its first column."""
        names, current = [], ""
        for line in self.source.split("\n"):
            if re.match(r"[A-Za-z_]", line):
                found = re.search(r"([A-Za-z_]\w*)\s*(?:\(|\[|=|\{)", line)
                current = found.group(1) if found else current
            elif line.startswith("#define"):
                current = re.match(r"#define\s+(\w+)", line).group(1)
            names.append(current)
        return names

    def quiet_places(self):
        quiet = set()
        for i, token in enumerate(self.tokens[:-1]):
            silent = QUIET_CALL.fullmatch(token.text) or FREEING_CALL.fullmatch(token.text)
            if token.kind == "name" and silent and i + 1 in self.pair:
                quiet.update(range(i, self.pair[i + 1] + 1))
        return quiet

    def spaced(self, i):
        token = self.tokens[i]
        return (self.source[token.begin - 1].isspace() and token.end < len(self.source) and
                self.source[token.end].isspace())

    def declares(self, i):
        """Whether the `[` at i belongs to a declaration (its number is a size, not an index)."""
        while self.tokens[i - 1].text == "]" and i - 1 in self.pair:
            i = self.pair[i - 1]
        before = i - 2  # what stands before the name
        while before > 0 and self.tokens[before].text == "*":
            before -= 1
        if before >= 0 and is_type(self.tokens[before]):
            return True
        # a further name of a declaration: back to the start of the statement, over no `=` of ours
        depth, j = 0, i - 1
        while j >= 0:
            text = self.tokens[j].text
            if text in ")]}" and j in self.pair:
                j = self.pair[j]
            elif text in (";", "{", "}", "(", "#define"):
                break
            elif text == "," and depth == 0:
                depth = 1
            elif text == "=" and depth == 0:
                return False
            j -= 1
        return depth == 1 and j + 1 < i and is_type(self.tokens[j + 1])

    def make(self, kind, begin, end, text):
        first, last = self.line_of(begin), self.line_of(max(begin, end - 1))
        head = self.source[self.starts[first]:begin]
        stop = self.source.find("\n", max(begin, end - 1))
        tail = self.source[end:stop if stop >= 0 else None]
        text += "\n" * (self.source[begin:end].count("\n") - text.count("\n"))
        squeeze = lambda s: " ".join(s.replace("\\\n", " ").rstrip("\\").split())
        before, after = squeeze(head + self.source[begin:end] + tail), squeeze(head + text + tail)
        return Mutant(self.path, first + 1, self.functions[first], kind, begin, end, text, before,
                      after, f"{self.path} {self.functions[first]}: {before} -> {after}")

    def mutants(self):
        found = []
        for i, token in enumerate(self.tokens):
            if i in self.quiet:
                continue
            if token.kind == "number":
                found += self.numbers(i)
            elif token.kind == "sign":
                found += self.operators(i)
                if token.text == "[" and i in self.pair:
                    found += self.indices(i)
            elif token.kind == "name":
                found += self.names(i)
                found += self.removal(i)
        unique = {}
        for mutant in found:
            if mutant.before != mutant.after:
                same = unique.setdefault(mutant.key(), [])
                if all(other.begin != mutant.begin for other in same):
                    same.append(mutant)
        for same in unique.values():  # the second of two alike is told apart by its number
            for number, mutant in enumerate(same[1:], 2):
                mutant.name += f" #{number}"
        return [mutant for same in unique.values() for mutant in same]

    def numbers(self, i):
        token, opening = self.tokens[i], i - 1
        in_brackets = self.tokens[opening].text == "[" and self.pair.get(opening) == i + 1
        if in_brackets and (self.declares(opening) or self.tokens[opening - 1].text in "{,"):
            return []
        text, suffix = re.fullmatch(r"(.*?)([uUlLfF]*)", token.text).groups()
        if re.match("0[xX]", token.text):
            values = [f"({token.text} ^ 1)"]
        elif re.fullmatch(r"\d+", text):
            value = int(text)
            near = (value + 1, value - 1) if value < 10 else (2 * value, value // 2)
            values = [f"{v}{suffix}" for v in near if v >= 0]
        else:
            value = float(text)
            values = [f"{v!r}{suffix}" for v in (0.0, 1.0, 2 * value, 0.8 * value) if v != value]
            if value:
                values.append(f"(-{token.text})")
        kind = "index" if in_brackets else "number"
        return [self.make(kind, token.begin, token.end, v) for v in values]

    def operators(self, i):
        token = self.tokens[i]
        found = []
        if token.text in BINARY and (self.spaced(i)):
            kind = KIND.get(token.text, "assignment")
            found += [self.make(kind, token.begin, token.end, t) for t in BINARY[token.text]]
        elif token.text == "-" and not self.spaced(i):
            found.append(self.make("sign", token.begin, token.end, ""))
        elif token.text == "!":
            found.append(self.make("condition", token.begin, token.end, ""))
        elif token.text in ("++", "--") and not self.in_for(i):
            found.append(self.make("assignment", token.begin, token.end,
                                   "--" if token.text == "++" else "++"))
        return found

    def in_for(self, i):
        """Whether i is in the head of a loop: counting there the other way only ever hangs."""
        j = i
        while j > 0 and self.tokens[j].text not in "{}":
            if self.tokens[j].text == "(" and self.tokens[j - 1].text == "for":
                return self.pair.get(j, 0) > i
            j -= 1
        return False

    def indices(self, i):
        closing, before = self.pair[i], self.tokens[i - 1]
        if (before.kind != "name" and before.text not in ")]") or is_type(before):
            return []
        if closing == i + 1 or self.tokens[i + 1].kind == "number" or self.declares(i):
            return []
        end = self.tokens[closing].begin
        return [self.make("index", end, end, text) for text in (" + 1", " - 1")]

    def names(self, i):
        token, following = self.tokens[i], i + 1
        if following not in self.pair or self.tokens[following].text != "(":
            return []
        begin, end = self.tokens[following].end, self.tokens[self.pair[following]].begin
        if token.text in ("if", "while"):
            return [self.make("condition", begin, end, f"!({self.source[begin:end]})")]
        if token.text in KEYWORDS or token.text in TYPES or not self.source[token.end] == "(":
            return []
        found = []
        if token.text in FUNCTIONS:
            found.append(self.make("function", token.begin, token.end, FUNCTIONS[token.text]))
        else:
            for a, b in (("min", "max"), ("max", "min")):
                other = re.sub(rf"(^|_){a}(?=_|$)", rf"\g<1>{b}", token.text)
                if other != token.text:
                    found.append(self.make("function", token.begin, token.end, other))
        arguments, start, j = [], begin, following + 1
        while j <= self.pair[following]:
            text = self.tokens[j].text
            if text in "([{" and j in self.pair:
                j = self.pair[j]
            elif text == "," or j == self.pair[following]:
                arguments.append((start, self.tokens[j].begin))
                start = self.tokens[j].end
            j += 1
        declaration = self.source[:token.begin].endswith("\n") or is_type(self.tokens[i - 1]) or (
            self.tokens[i - 1].text == "*" and is_type(self.tokens[i - 2]))
        if not declaration:
            pairs = list(zip(arguments, arguments[1:]))
            for (a, b), (c, d) in pairs[1:] if token.text in SYMMETRIC else pairs:
                first, second = self.source[a:b].strip(), self.source[c:d].strip()
                if first != second:
                    a += len(self.source[a:b]) - len(self.source[a:b].lstrip())
                    found.append(self.make("arguments", a, d, f"{second}, {first}"))
        return found

    def removal(self, i):
        """The statement that begins at i, removed; declarations and what returns or frees stay."""
        before, token = self.tokens[i - 1], self.tokens[i]
        begins = before.text in (";", "{", "}", "else") or (
            before.text == ")" and self.tokens[self.pair.get(i - 1, 0) - 1].text in ("if", "for", "while"))
        if not begins or self.in_for(i) or is_type(token) or FREEING_CALL.fullmatch(token.text) or (
                token.text in KEYWORDS and token.text not in ("break", "continue")):
            return []
        following = self.tokens[i + 1]
        if following.kind == "name" or (following.text == "*" and not self.spaced(i + 1)):
            return []  # a declaration with a type that we do not know
        j = i
        while j < len(self.tokens) and self.tokens[j].text != ";":
            if self.tokens[j].text in "([" and j in self.pair:
                j = self.pair[j]
            elif self.tokens[j].text in "{})]:,#define":
                return []
            j += 1
        if j == len(self.tokens):
            return []
        return [self.make("removal", token.begin, self.tokens[j].begin, "")]


def draw(files, seed):
    """All mutants in random order: a line is as likely as any other, and on it a kind as any
    other. Each has a random number of its own, so an edit moves only the mutants of its line."""
    order = []
    for file in files:
        lines = {}
        for mutant in file.mutants():
            lines.setdefault(mutant.line, {}).setdefault(mutant.kind, []).append(mutant)
        for kinds in lines.values():
            for alike in kinds.values():
                weight = 1 / (len(kinds) * len(alike))
                for mutant in alike:
                    digest = hashlib.sha256(f"{seed}:{mutant.name}".encode()).digest()
                    uniform = (int.from_bytes(digest[:8], "big") + 0.5) / 2.0**64
                    order.append((-math.log(uniform) / weight, mutant.name, mutant))
    return [mutant for _, _, mutant in sorted(order, key=lambda entry: entry[:2])]


# ---------------------------------------------------------------------------------------------
# tests/mutants.txt: equivalent mutants, each with its reason.


def read_named():
    named, entry = {}, {}
    if not NAMED.exists():
        return named
    for number, line in enumerate(NAMED.read_text().splitlines() + [""], 1):
        if line.startswith("#"):
            continue
        if not line.strip():
            if entry:
                missing = {"at", "-", "+", "="} - set(entry)
                if missing:
                    sys.exit(f"mutants: {NAMED.name} line {number}: an entry without {sorted(missing)}")
                named[entry["at"] + ": " + entry["-"] + " -> " + entry["+"]] = entry["="]
            entry = {}
        elif line[0] in "-+=" and line[1:2] == " ":
            entry[line[0]] = (entry.get(line[0], "") + " " + line[2:].strip()).strip()
        else:
            entry["at"] = line.strip()
    return named


def entry_of(mutant):
    suffix = mutant.name.rpartition(" #")[2] if " #" in mutant.name[-4:] else ""
    plus = mutant.after + (f" #{suffix}" if suffix else "")
    return f"{mutant.path} {mutant.function}\n- {mutant.before}\n+ {plus}\n"


# ---------------------------------------------------------------------------------------------
# The copy of the tree, its build, and what each test is linked from.


def copy_tree():
    """The working tree as it stands, without what git ignores; a file that is the same is left."""
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "-z"], cwd=ROOT,
                            capture_output=True, check=False)
    if listed.returncode == 0:
        names = [n for n in listed.stdout.decode().split("\0") if n and (ROOT / n).is_file()]
    else:  # an archive without git
        names = [str(p.relative_to(ROOT)) for p in ROOT.rglob("*") if p.is_file() and
                 p.relative_to(ROOT).parts[0] not in ("build", ".venv", "out", "runs")]
    wanted = set(names)
    for old in [p for p in TREE.rglob("*") if p.is_file() and not p.is_symlink()]:
        if str(old.relative_to(TREE)) not in wanted:
            old.unlink()
    for name in names:
        source, target = ROOT / name, TREE / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.is_symlink() or not target.exists() or source.read_bytes() != target.read_bytes():
            shutil.copy(source, target)
    venv = TREE / ".venv"
    if not venv.exists() and (ROOT / ".venv").exists():
        venv.symlink_to((ROOT / ".venv").resolve())


@dataclasses.dataclass
class Test:
    name: str
    command: list
    links: dict  # path of an executable in the command -> (folder, link command)
    seconds: float = 0  # processor time of the run without a fault


@dataclasses.dataclass
class Object:
    path: pathlib.Path  # the .o
    source: pathlib.Path
    command: list
    folder: str
    depends: set


def run_quiet(command, **more):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          errors="replace", check=False, **more)
    if done.returncode:
        sys.exit(f"mutants: failed: {shlex.join(map(str, command))}\n{done.stdout[-4000:]}")
    return done.stdout


def find_tests(layers):
    """Tests of a layer from what CMake wrote for ctest, which knows them before they are built."""
    tests = []
    text = (BUILD / "tests" / "CTestTestfile.cmake").read_text()
    for name, arguments in re.findall(r"^add_test\(\[=\[(.*?)\]=\] (.*)\)$", text, re.M):
        command = [m.replace('\\"', '"') for m in re.findall(r'"((?:\\.|[^"\\])*)"', arguments)]
        if name.partition("/")[0] in layers:
            tests.append(Test(name, command, {}))
    return tests


def build_tests(layers, jobs):
    flags = ["-DCMAKE_BUILD_TYPE=None", "-DCMAKE_C_FLAGS=-O3", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON",
             "-DMILD_WERROR=ON", "--log-level=ERROR"]
    if shutil.which("ccache"):
        flags.append("-DCMAKE_C_COMPILER_LAUNCHER=ccache")
    run_quiet(["cmake", "-S", TREE, "-B", BUILD, "-G", "Unix Makefiles", "-Wno-dev", *flags])
    tests = find_tests(layers)
    executables = {c: pathlib.Path(c).name for t in tests for c in t.command
                   if c.startswith(str(BUILD)) and not c.endswith(".sh") and c != str(BUILD)}
    if not tests:
        sys.exit(f"mutants: there is no test of {' or '.join(layers)} (ctest -N lists all)")
    run_quiet(["cmake", "--build", BUILD, "--parallel", str(jobs), "--target",
               *sorted(set(executables.values()))])
    scripts = {p.parent.name[:-4]: p for p in BUILD.rglob("link.txt")}
    for test in tests:
        for argument in test.command:
            script = scripts.get(executables.get(argument))
            if script:
                test.links[argument] = (str(script.parent.parent.parent),
                                        shlex.split(script.read_text().splitlines()[0]))
    return [t for t in tests if t.links]


def find_objects():
    """Every object that was built, with the files that it was made from (by the compiler's .d)."""
    objects = {}
    for entry in json.loads((BUILD / "compile_commands.json").read_text()):
        command = shlex.split(entry["command"])
        if os.path.basename(command[0]) == "ccache":
            command = command[1:]
        at = command.index("-o")
        path = pathlib.Path(entry["directory"], command[at + 1])
        depfile = pathlib.Path(str(path) + ".d")
        if not depfile.exists():
            continue
        names = depfile.read_text().replace("\\\n", " ").partition(":")[2].split()
        depends = {os.path.realpath(os.path.join(entry["directory"], n)) for n in names}
        objects[path.resolve()] = Object(path.resolve(), pathlib.Path(entry["file"]), command,
                                         entry["directory"], depends)
    return objects


def linked_objects(test, objects):
    """Objects that a test's executables are linked from: those named, and those in its archives."""
    used = set()
    for folder, command in test.links.values():
        for argument in command:
            path = pathlib.Path(folder, argument).resolve()
            if path in objects:
                used.add(path)
            elif argument.endswith(".a") and str(path).startswith(str(BUILD)):
                members = path.parent / "CMakeFiles" / (path.stem.removeprefix("lib") + ".dir")
                used.update(o for o in objects if members in o.parents)
    return used


# ---------------------------------------------------------------------------------------------
# One worker compiles one mutant, links and runs.


class Worker:
    def __init__(self, number, objects, tests, originals):
        self.folder = WORK / f"worker{number}"
        shutil.rmtree(self.folder, ignore_errors=True)
        self.overlay = self.folder / "overlay"
        self.run_folder = self.folder / "run"
        self.run_folder.mkdir(parents=True)
        for entry in TREE.iterdir():  # tests read and write relative to the root of the tree
            (self.run_folder / entry.name).symlink_to(entry)
        self.objects, self.tests, self.originals = objects, tests, originals

    def compile(self, path, source):
        """Objects that depend on path, made with source in its place: {object: bytes}, or the
        compiler's message."""
        original = TREE / path
        shutil.rmtree(self.overlay, ignore_errors=True)
        layer_path = pathlib.Path(path).relative_to("src")
        changed = self.overlay / layer_path
        changed.parent.mkdir(parents=True)
        changed.write_text(f'#line 1 "{original}"\n{source}')
        made = {}
        for number, (name, item) in enumerate(self.affected(original)):
            output = self.folder / f"{number}.o"
            command = [a for a in item.command if not a.startswith("-M")]
            command[command.index("-o") + 1] = str(output)
            if item.source.resolve() == original.resolve():
                command[command.index("-c") + 1] = str(changed)
            command[1:1] = [f"-I{self.overlay}"]
            done = subprocess.run(command, cwd=item.folder, capture_output=True, text=True,
                                  errors="replace", check=False)
            if done.returncode:
                return done.stderr
            made[name] = (output, output.read_bytes())
        return made

    def affected(self, original):
        real = os.path.realpath(original)
        return sorted((n, o) for n, o in self.objects.items() if real in o.depends)

    def original_bytes(self, path, source):
        if path not in self.originals:
            made = self.compile(path, source)
            if isinstance(made, str):
                sys.exit(f"mutants: {path} does not compile unchanged:\n{made}")
            self.originals[path] = {name: data for name, (_, data) in made.items()}
        return self.originals[path]

    def link(self, test, changed):
        """The test's command with executables that hold the changed objects."""
        command = list(test.command)
        for argument, (folder, link) in test.links.items():
            link, added, replaced = list(link), [], set()
            for i, word in enumerate(link):
                path = pathlib.Path(folder, word).resolve()
                if word.endswith(".o") and path in changed:
                    link[i] = str(changed[path])
                    replaced.add(path)
            members = linked_objects(Test("", [], {argument: (folder, link)}), self.objects)
            # before the archives: whoever comes first defines the symbols
            added = [str(new) for old, new in changed.items() if old in members - replaced]
            at = link.index("-o")
            output = self.folder / pathlib.Path(argument).name
            link[at + 1] = str(output)
            link[at:at] = added
            done = subprocess.run(link, cwd=folder, capture_output=True, text=True, check=False)
            if done.returncode:
                return done.stderr
            command = [str(output) if c == argument else c for c in command]
        return command

    def run(self, command, seconds):
        """(caught by, processor seconds); seconds is the processor time that it may take."""

        def limit():
            cpu = int(math.ceil(seconds))
            resource.setrlimit(resource.RLIMIT_CPU, (cpu, cpu + 1))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 30, 1 << 30))

        environment = dict(os.environ, CMOCKA_TEST_ABORT="1", TMPDIR=str(self.folder),
                           MILD_TEST_DRAWS=DRAWS)
        log = self.folder / "log"
        with open(log, "wb") as out:
            child = subprocess.Popen(command, cwd=self.run_folder, stdout=out, stderr=out,
                                     stdin=subprocess.DEVNULL, env=environment, preexec_fn=limit,
                                     start_new_session=True)
            timer = threading.Timer(20 + 10 * seconds, os.killpg, (child.pid, signal.SIGKILL))
            timer.start()
            _, status, usage = os.wait4(child.pid, 0)
            timer.cancel()
            child.returncode = os.waitstatus_to_exitcode(status)
        return child.returncode, usage.ru_utime + usage.ru_stime

    def judge(self, mutant, source):
        """(verdict, detail): refused, same, caught or survived."""
        original = self.original_bytes(mutant.path, source)
        text = source[:mutant.begin] + mutant.text + source[mutant.end:]
        made = self.compile(mutant.path, text)
        if isinstance(made, str):
            return "refused", made.strip().splitlines()[0] if made.strip() else "compiler"
        changed = {name: path for name, (path, data) in made.items() if data != original[name]}
        if not changed:
            return "same", ""
        reached = False
        for test in self.tests:
            if not any(name in test.members for name in changed):
                continue
            reached = True
            command = self.link(test, changed)
            if isinstance(command, str):
                return "refused", command.strip().splitlines()[-1]
            code, seconds = self.run(command, 2 + 4 * test.seconds)
            if code:
                hang = code in (-signal.SIGXCPU, -signal.SIGKILL)
                return "caught", test.name + (" (hang)" if hang else "")
        return ("survived", "") if reached else ("survived", "in no test's program")


def measure(tests, worker, jobs):
    """Runs every test once without a fault; what did not change since the last time is not run."""
    store = WORK / "times.json"
    known = json.loads(store.read_text()) if store.exists() else {}
    for test in tests:
        digest = hashlib.sha256()
        for argument in test.command:
            if os.path.isfile(argument):
                digest.update(pathlib.Path(argument).read_bytes())
        key = test.name + " " + digest.hexdigest()
        if key not in known:
            code, seconds = worker.run(test.command, 600)
            if code:
                tail = (worker.folder / "log").read_text(errors="replace")[-3000:]
                sys.exit(f"mutants: {test.name} fails without a fault (exit {code}):\n{tail}")
            known = {k: v for k, v in known.items() if not k.startswith(test.name + " ")}
            known[key] = seconds
            store.write_text(json.dumps(known))
        test.seconds = known[key]
    tests.sort(key=lambda t: t.seconds)


# ---------------------------------------------------------------------------------------------


def report_text(options, results, named, wanted, seconds):
    caught = [r for r in results if r[1] == "caught"]
    survived = [r for r in results if r[1] == "survived"]
    refused = sum(r[1] == "refused" for r in results)
    same = sum(r[1] == "same" for r in results)
    count = len(caught) + len(survived)
    lines = [f"layer {options.layer}, seed {options.seed}: {len(caught)} of {count} mutants caught"
             f" ({100 * len(caught) / max(count, 1):.1f} %), {len(survived)} survived",
             f"not counted: {refused} that the compiler refuses, {same} with the same object code, "
             f"{len(named)} equivalent by {NAMED.relative_to(ROOT)}; {seconds:.0f} s"]
    if count < wanted:
        lines.append(f"there are no more than {count} mutants")
    kinds = sorted({r[0].kind for r in caught + survived})
    table = [f"{k} {sum(r[0].kind == k for r in caught)}/"
             f"{sum(r[0].kind == k for r in caught + survived)}" for k in kinds]
    lines.append("caught by kind: " + ", ".join(table))
    if survived:
        lines += ["", "survivors:", ""]
        for mutant, _, detail in sorted(survived, key=lambda r: (r[0].path, r[0].line)):
            note = f" ({detail})" if detail else ""
            lines.append(f"# line {mutant.line}, {mutant.kind}{note}\n{entry_of(mutant)}")
    if named:
        lines += ["", "equivalent, with the reason:", ""]
        for mutant, reason in named:
            lines.append(f"{entry_of(mutant)}= {reason}\n")
    return "\n".join(lines) + "\n"


def choose(options):
    folder = pathlib.Path("src") / options.layer
    paths = sorted(p.relative_to(TREE) for p in (TREE / folder).rglob("*")
                   if p.suffix in (".c", ".h") and (not options.file or p.name == options.file))
    if not paths:
        sys.exit(f"mutants: no source in {folder}/{options.file or ''}; layers: "
                 f"{' '.join(sorted(p.name for p in (ROOT / 'src').iterdir() if p.is_dir()))}")
    files = {str(p): File(str(p)) for p in paths}
    return files, draw(files.values(), options.seed)


def judge_all(options, files, order, workers):
    """Judges in the drawn order until N count; workers take the next one each."""
    results, lock, position = {}, threading.Lock(), [0]
    wanted = options.n

    def counted():
        return sum(r[1] in ("caught", "survived") for r in results.values())

    def work(worker):
        while True:
            with lock:
                if counted() >= wanted or position[0] == len(order):
                    return
                index = position[0]
                position[0] += 1
            mutant = order[index]
            verdict, detail = worker.judge(mutant, files[mutant.path].source)
            with lock:
                results[index] = (mutant, verdict, detail)
                if verdict == "survived":
                    print(f"{mutant.path}:{mutant.line}: {mutant.before}\n    -> {mutant.after}",
                          flush=True)
                done = counted()
                if verdict in ("caught", "survived") and done % 20 == 0:
                    print(f"mutants: {done} of {wanted}", flush=True)

    with concurrent.futures.ThreadPoolExecutor(len(workers)) as pool:
        for future in [pool.submit(work, w) for w in workers]:
            future.result()
    kept, count = [], 0
    for index in sorted(results):  # the first N in order, whichever worker was faster
        count += results[index][1] in ("caught", "survived")
        if count <= wanted:
            kept.append(results[index])
    return kept


def parse_options():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--layer", default="task", help="folder of src/ (task)")
    parser.add_argument("-n", type=int, default=200, help="mutants that count (200)")
    parser.add_argument("--seed", default="1", help="the same seed draws the same mutants (1)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="at once (all cores)")
    parser.add_argument("--file", help="only this file of the layer, e.g. reward.c")
    parser.add_argument("--again", action="store_true",
                        help="only what survived in the last report of this layer")
    parser.add_argument("--list", action="store_true", help="print the mutants drawn, run nothing")
    return parser.parse_args()


def main():
    options = parse_options()
    begin = time.time()
    TREE.mkdir(parents=True, exist_ok=True)
    lock = open(WORK / "lock", "w")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        sys.exit("mutants: another run uses build/mutants; wait for it")
    copy_tree()
    files, order = choose(options)
    report = WORK / f"{options.layer}.txt"
    if options.again:
        last = report.read_text() if report.exists() else ""
        last = last.partition("equivalent, with the reason:")[0]
        order = [m for m in order if entry_of(m) + "\n" in last + "\n"]
        report = WORK / f"{options.layer}.again.txt"
    reasons = read_named()
    present = {m.name for m in order}
    for name in reasons:
        if name.startswith(f"src/{options.layer}/") and not (options.file or options.again or
                                                             name in present):
            print(f"mutants: {NAMED.name} names what is no longer there: {name}", flush=True)
    named = [(m, reasons[m.name]) for m in order if m.name in reasons]
    order = [m for m in order if m.name not in reasons]
    if options.list:
        print("\n".join(f"{m.path}:{m.line}: {m.kind}: {m.before} -> {m.after}"
                        for m in order[:options.n]))
        return
    tests = build_tests(TESTED_BY.get(options.layer, (options.layer,)), options.jobs)
    objects = find_objects()
    for test in tests:
        test.members = linked_objects(test, objects)
    used = set().union(*(t.members for t in tests))
    objects = {name: item for name, item in objects.items() if name in used}
    originals = {}
    workers = [Worker(k, objects, tests, originals) for k in range(max(1, options.jobs))]
    measure(tests, workers[0], options.jobs)
    print(f"mutants: {len(order)} possible in src/{options.layer}; a run of its {len(tests)} tests "
          f"takes {sum(t.seconds for t in tests):.1f} s", flush=True)
    results = judge_all(options, files, order, workers)
    text = report_text(options, results, named, min(options.n, len(order)), time.time() - begin)
    details = "\n".join(f"{v:8} {m.path}:{m.line}: {m.before} -> {m.after}  [{d}]"
                        for m, v, d in results)
    report.write_text(text + "\nall:\n" + details + "\n")
    print("\n" + text + f"report: {report.relative_to(ROOT)}")
    for worker in workers:
        shutil.rmtree(worker.folder, ignore_errors=True)


if __name__ == "__main__":
    main()
