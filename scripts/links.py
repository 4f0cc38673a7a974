#!/usr/bin/env python3
"""Checks the relative links of our Markdown: every file that is named exists, every #anchor is a heading of it.
Usage: scripts/links.py [FILE.md...]; without one, all pages below the folder that the script lies in."""
import os
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
NOT_OURS = {"build", "out", "runs", ".venv", ".git"}
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s]+)\)")


def pages():
    """All Markdown files of the tree."""
    found = []
    for folder, folders, names in os.walk(ROOT):
        folders[:] = [name for name in folders if name not in NOT_OURS and not name.startswith("build")]
        found += [pathlib.Path(folder) / name for name in names if name.endswith(".md")]
    return sorted(found)


def prose(text):
    """The text with its code blanked out, line by line, so that positions stay."""
    lines, fence, before = [], None, ""
    for line in text.split("\n"):
        mark = re.match(r"\s{0,3}(```+|~~~+)", line)
        if fence or mark:
            fence = None if fence and mark and mark.group(1).startswith(fence) else fence or mark.group(1)
            lines.append(" " * len(line))
        elif line.startswith("    ") and not before.strip():  # an indented block begins behind an empty line and goes on
            lines.append(" " * len(line))
            continue
        else:
            lines.append(re.sub(r"(`+)(?!`).*?(?<!`)\1(?!`)", lambda code: " " * len(code.group()), line))
        before = line
    return "\n".join(lines)


def anchors(text):
    """The anchors of the headings, as code hosts make them."""
    found = set()
    for heading in re.findall(r"^#{1,6} +(.*?) *#*$", prose_of_headings(text), re.M):
        plain = re.sub(r"[`*]", "", LINK.sub(r"\2", heading)).lower()
        slug = re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")
        again, name = 0, slug
        while name in found:
            again += 1
            name = f"{slug}-{again}"
        found.add(name)
    return found


def prose_of_headings(text):
    """The text without fenced code, whose # are no headings."""
    return re.sub(r"^(```+|~~~+).*?^\1", "", text, flags=re.M | re.S)


def links(text):
    """(line, target) of each link that is not a URL."""
    for match in LINK.finditer(prose(text)):
        if not re.match(r"[a-z]+:", match.group(3)):
            yield text.count("\n", 0, match.start()) + 1, match.group(3)


def faults(page):
    """(line, what is wrong) for each link of the page that leads nowhere."""
    text = page.read_text(encoding="utf-8")
    for line, target in links(text):
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        if not file.exists():
            yield line, f"{target}: there is no {name}"
        elif ROOT not in file.parents and file != ROOT:
            yield line, f"{target}: outside the tree"
        elif anchor and file.suffix == ".md" and anchor not in anchors(file.read_text(encoding="utf-8")):
            yield line, f"{target}: no heading of {file.name} has this anchor"


def main(names):
    found = count = 0
    for page in [pathlib.Path(name).resolve() for name in names] or pages():
        count += 1
        for line, what in faults(page):
            print(f"{page.relative_to(ROOT) if ROOT in page.parents else page}:{line}: {what}")
            found += 1
    print(f"{count} pages, {found} links lead nowhere", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
