#!/usr/bin/env python3
"""Follows a tutorial of docs/tutorials block by block in an empty folder, as a reader does, and compares what it prints.

A block behind 'This is `FILE`' (or `FILE`, in a line that ends with a colon) is saved as FILE. Blocks of sh are run, with `mild` and
`python` on the PATH. A block of text is what the block before it prints: words are equal, numbers within 5 % or one of the last digit,
in a row of walks (it says 3/3 or yes, upright) the speed within 10 % and the rest within half: another processor rounds otherwise, and a
walk amplifies that. A line '...' stands for any lines. Trainings are cut short by SHORT. The page ends with a picture, which must have been made.
Usage: test_tutorials.py SOURCE_FOLDER PATH_TO_MILD PYTHON_PACKAGE PAGE [--keep FOLDER]

test_tutorials.py SOURCE_FOLDER (scripts/wheels.sh) follows the set-up, docs/tutorials/README.md: in an empty home, whose `mild` is the source
tree with its wheel made (`make wheel` itself is not repeated), with this Python as `python3`, without a display. pip fetches what it does for a
reader."""
import argparse
import os
import pathlib
import re
import socket
import subprocess
import sys
import tempfile

BLOCK = re.compile(r"^```(?P<kind>\w+)\n(?P<text>.*?)^```$", re.M | re.S)
FILE = re.compile(r"`(?P<name>[\w./-]+\.\w+)`[^`\n]*:\n\n$")
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
WALK = re.compile(r"\d+/\d+|yes")
LINES = 80
# What a reader waits for longer than a test may: (page, words of the page, words that are run).
SHORT = [
    ("README", "make wheel ", "make --dry-run wheel "),
    ("your-robot", "--train.minutes=5 --train.envs=512 --train.iterations=0", "--train.minutes=0 --train.envs=32 --train.iterations=2"),
    ("train-on-a-gpu", "--train.device=cuda", "--train.device=cpu --train.robots=batch --train.envs=32 --train.iterations=2"),
]


with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:  # another test may have the page's
    free.bind(("127.0.0.1", 0))
    PORT = free.getsockname()[1]


class Wrong(Exception):
    pass


def steps(text):
    """[(kind, text)] of the page: ("FILE", name, text), ("run", text), ("prints", text)."""
    found = []
    for block in BLOCK.finditer(text):
        named = FILE.search(text[:block.start()])
        if block["kind"] == "sh":
            found.append(("run", block["text"]))
        elif block["kind"] == "text":
            if not found or found[-1][0] != "run" and found[-1][0] != "prints":
                raise Wrong("a block of text stands behind no block of sh")
            found.append(("prints", block["text"]))
        elif named:
            found.append(("file", named["name"], block["text"]))
        else:
            raise Wrong(f"a block of {block['kind']} does not say which file it is")
    return found


def near(wanted, got, share=0.05):
    """Whether two words are equal but for differences of their numbers by `share`. How many of how many is no such number."""
    if re.fullmatch(r"\d+/\d+", wanted):
        return wanted == got
    if NUMBER.sub("#", wanted) != NUMBER.sub("#", got):
        return False
    for a, b in zip(NUMBER.findall(wanted), NUMBER.findall(got)):
        digits = len(a.split("e")[0].partition(".")[2])
        unit = 10.0 ** -digits * (10.0 ** int(a.split("e")[1]) if "e" in a else 1)
        if abs(float(a) - float(b)) > max(1.01 * unit, share * abs(float(a))):
            return False
    return True


def same(wanted, got):
    wanted, got = wanted.split(), got.split()
    shares = [0.05] * len(wanted)
    speed = next((i - 1 for i, word in enumerate(wanted) if word in ("+-", "m/s")), None)
    if speed is not None and any(WALK.fullmatch(word) for word in wanted):
        shares = [0.5] * len(wanted)
        shares[speed] = 0.1
    return len(wanted) == len(got) and all(map(near, wanted, got, shares))


def compare(wanted, printed):
    """The first line of `wanted` that is not printed in its place, or None."""
    lines, at, anywhere = printed.splitlines(), 0, False
    for line in wanted.splitlines():
        if line.strip() == "...":
            anywhere = True
            continue
        reach = range(at, len(lines)) if anywhere else range(at, min(at + 1, len(lines)))
        at = next((i + 1 for i in reach if same(line, lines[i])), None)
        if at is None:
            return line
        anywhere = False
    return None if anywhere or at == len(lines) else f"(no more, but) {lines[at]}"


def shorten(page, text, source):
    text = text.replace("~/mild/", f"{source}/").replace("127.0.0.1:9870", f"127.0.0.1:{PORT}").replace("127.0.0.1 9870", f"127.0.0.1 {PORT}")
    for name, words, instead in SHORT:
        text = text.replace(words, instead) if name == page else text
    return text


def follow(source, page, work, environment):
    text = (source / f"docs/tutorials/{page}.md").read_text(encoding="utf-8")
    if len(text.splitlines()) > LINES:
        raise Wrong(f"{len(text.splitlines())} lines, more than {LINES}")
    for name, words, _ in SHORT:
        if name == page and words not in text:
            raise Wrong(f"does not say {words}, which this test shortens")
    printed, count = "", 0
    for step in steps(text):
        count += 1
        if step[0] == "file":
            (work / step[1]).parent.mkdir(parents=True, exist_ok=True)
            (work / step[1]).write_text(step[2], encoding="utf-8")
        elif step[0] == "run":
            done = subprocess.run(["bash", "-e", "-c", shorten(page, step[1], source)], cwd=work, env=environment, stdin=subprocess.DEVNULL,
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=240, check=False)
            if done.returncode:
                raise Wrong(f"exit {done.returncode}:\n{step[1]}{done.stdout[-2000:]}{done.stderr[-2000:]}")
            printed = done.stdout
        else:
            missed = compare(step[1], printed)
            if missed is not None:
                raise Wrong(f"this is not printed: {missed}\nbut:\n{printed}")
    return count


def look_for_picture(source, page, work):
    text = (source / f"docs/tutorials/{page}.md").read_text(encoding="utf-8")
    picture = re.findall(r"!\[[^\]]+\]\(([\w-]+)\.\w+\)", text)[-1:]
    if not picture or not any((work / f"{picture[0]}.{ending}").is_file() for ending in ("png", "mp4")):
        raise Wrong(f"no picture {''.join(picture)} was made")


def check_itself():
    """What this test is for is seen."""
    differ = [("a 1.00", "a 1.06"), ("a 1", "b 1"), ("a", "a\nb"), ("a\nb", "a"), ("a\n...\nc", "a\nb"), ("1 mm", "1 m"), ("3/3", "2/3"),
              ("3/3 1 +- 0.1", "2/3 1 +- 0.1"), ("3/3 1.0 +- 0.10", "3/3 1.2 +- 0.10"), ("3/3 1.0 +- 0.10", "3/3 1.0 +- 0.16"),
              ("1.0 m/s yes", "1.2 m/s yes"), ("1.0 m/s yes", "1.0 m/s no"), ("9.0 1.0 m/s", "6.0 1.0 m/s")]
    equal = [("a 1.00", "a   1.02"), ("0.01", "0.02"), ("a\n...", "a\nb\nc"), ("...\nc 5e+05", "a\nc 5.1e+05"),
             ("3/3 1.0 +- 0.10 9", "3/3 1.1 +- 0.06 5"), ("1.0 m/s yes 9", "1.1 m/s yes 5")]
    for wanted, printed in differ:
        if compare(wanted, printed) is None:
            raise Wrong(f"the test does not distinguish {wanted!r} from {printed!r}")
    for wanted, printed in equal:
        if compare(wanted, printed) is not None:
            raise Wrong(f"the test distinguishes {wanted!r} from {printed!r}")



def programs(folder, **paths):
    """A folder of programs by these names."""
    folder.mkdir()
    for name, program in paths.items():
        (folder / name).write_text(f'#!/bin/sh\nexec "{program}" "$@"\n', encoding="utf-8")
        (folder / name).chmod(0o755)
    return folder


def walk_through(args, folder):
    """How many blocks of the page."""
    path = programs(folder / "bin", mild=args.mild.resolve(), python=sys.executable)
    environment = dict(os.environ, PATH=f"{path}:{os.environ['PATH']}", PYTHONPATH=args.package, PYTHONDONTWRITEBYTECODE="1")
    work = args.keep or folder / "work"
    work.mkdir(parents=True, exist_ok=True)
    count = follow(args.source.resolve(), args.page, work, environment)
    look_for_picture(args.source.resolve(), args.page, work)
    return count


def set_up(source, home):
    """How many blocks of the set-up."""
    (home / "mild").symlink_to(source)
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL", "MILD", "DISPLAY", "WAYLAND"))}
    environment.update(HOME=str(home), PATH=f"{programs(home / 'bin', python3=sys.executable)}:/usr/bin:/bin", PIP_DISABLE_PIP_VERSION_CHECK="1")
    return follow(source, "README", home, environment)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("source", type=pathlib.Path)
    parser.add_argument("mild", type=pathlib.Path, nargs="?")
    parser.add_argument("package", nargs="?", help="the folder that has the Python package mild")
    parser.add_argument("page", nargs="?", default="README")
    parser.add_argument("--keep", type=pathlib.Path, help="work in this folder, which stays")
    args = parser.parse_args()
    if args.mild and not args.package:
        parser.error("package is missing")
    with tempfile.TemporaryDirectory() as folder:
        try:
            check_itself()
            count = walk_through(args, pathlib.Path(folder)) if args.mild else set_up(args.source.resolve(), pathlib.Path(folder))
        except Wrong as wrong:
            sys.exit(f"FAIL: docs/tutorials/{args.page}.md: {wrong}")
    print(f"{args.page}: {count} blocks")


if __name__ == "__main__":
    main()
