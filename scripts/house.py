#!/usr/bin/env python3
"""Checks what clang-format 14 does not: no line of C is wider than 100 columns, and every body of an
if, else, for, while and do has braces. Usage: scripts/house.py FILE..."""

import pathlib
import sys

from mutate import partners, tokens_of

COLUMNS = 100


def wide_lines(source):
    for number, line in enumerate(source.splitlines(), 1):
        if len(line) > COLUMNS:
            yield number, f"{len(line)} columns, {COLUMNS} are allowed"


def bare_bodies(source):
    """Lines where a body without braces starts."""
    tokens = tokens_of(source)
    pair = partners(tokens)
    for i, token in enumerate(tokens[:-1]):
        if token.kind != "name":
            continue
        body = None
        if token.text in ("if", "for", "while") and i + 1 in pair and tokens[i + 1].text == "(":
            body = pair[i + 1] + 1
            if token.text == "while" and i - 1 in pair and tokens[pair[i - 1] - 1].text == "do":
                continue
        elif token.text in ("else", "do"):
            body = i + 1
        if body is None or body >= len(tokens) or tokens[body].text == "{":
            continue
        if token.text == "else" and tokens[body].text == "if":
            continue
        line = source[source.rfind("\n", 0, token.begin) + 1 : token.begin]
        if line.startswith("#define"):
            continue  # a loop whose body stands behind the macro
        yield source.count("\n", 0, token.begin) + 1, f"the body of this {token.text} has no braces"


def main():
    found = 0
    for name in sys.argv[1:]:
        source = pathlib.Path(name).read_text(encoding="utf-8")
        for number, what in sorted([*wide_lines(source), *bare_bodies(source)]):
            print(f"{name}:{number}: {what}")
            found += 1
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
