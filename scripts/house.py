#!/usr/bin/env python3
"""Checks what clang-format 14 does not: no line of C is wider than 100 columns, every body of an if,
else, for, while and do has braces, no file has more than 800 lines, and no function but main more
than 60; a table in it, that is an initialiser, counts as one line. No test compares the sentence of an
error: assert_error of tests/kit.h holds its status and what it names. A case of a test is TEST(name). Usage: scripts/house.py FILE..."""

import pathlib
import re
import sys

from mutate import partners, tokens_of

COLUMNS = 100
FILE_LINES = 800
FUNCTION_LINES = 60


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


def is_table(source, tokens, i):
    """Whether the { of tokens[i] begins an initialiser: `= {`, or `(Type){`."""
    before = tokens[i - 1]
    return before.text == "=" or (before.text == ")" and before.end == tokens[i].begin)


def table_lines(source, tokens, pair, begin, end):
    """Lines that the outermost tables between two tokens take beyond their first."""
    lines, i = 0, begin
    while i < end:
        if tokens[i].text == "{" and is_table(source, tokens, i):
            lines += source.count("\n", tokens[i].begin, tokens[pair[i]].end)
            i = pair[i]
        i += 1
    return lines


def function_name(tokens, pair, i):
    """Of the function whose body begins at tokens[i]; CONTACT(name)(...) { is one, too."""
    before = pair[i - 1] - 1
    return tokens[before].text if tokens[before].text != ")" else tokens[before - 1].text


def long_functions(source):
    """Functions that are longer than they may be, at their first brace."""
    tokens = [t for t in tokens_of(source) if t.text != "#define"]
    pair = partners(tokens)
    i = 0
    while i < len(tokens):
        if tokens[i].text != "{" or i not in pair:
            i += 1
            continue
        if tokens[i - 1].kind == "string":  # extern "C" {
            i += 1
            continue
        if tokens[i - 1].text == ")" and not is_table(source, tokens, i):
            name = function_name(tokens, pair, i)
            inside = source.count("\n", tokens[i].begin, tokens[pair[i]].begin) - 1
            lines = inside - table_lines(source, tokens, pair, i + 1, pair[i])
            if lines > FUNCTION_LINES and name != "main":
                line = source.count("\n", 0, tokens[i].begin) + 1
                yield line, f"{name} has {lines} lines, {FUNCTION_LINES} are allowed"
        i = pair[i] + 1


def long_files(source):
    lines = source.count("\n")
    if lines > FILE_LINES:
        yield lines, f"{lines} lines, {FILE_LINES} are allowed"


SENTENCE = re.compile(r"\b(strstr|strn?cmp|memcmp|assert_(?:string|memory)_(?:not_)?equal)\s*\(\s*"
                      r"(?:[^;]*?[^\w;])?e(?:rror)?\s*(?:\.|->)\s*text\b")


def sentences(path, source):
    """Comparisons of an error's text in tests, but for the kit's, the formatter's and the fuzzers' own."""
    if "tests" in path.parts and "fuzz" not in path.parts and path.name not in ("kit.h", "test_text.c"):
        for match in SENTENCE.finditer(source):
            yield source.count("\n", 0, match.start()) + 1, f"{match[1]} of an error's text: take assert_error of kit.h"


def lists(path, source):
    """Cases that stand in a list."""
    if "tests" in path.parts:
        for match in re.finditer(r"\bcmocka_unit_test", source):
            yield source.count("\n", 0, match.start()) + 1, "a case is TEST(name) of kit.h"


def main():
    found = 0
    for name in sys.argv[1:]:
        path = pathlib.Path(name)
        source = path.read_text(encoding="utf-8")
        faults = [*wide_lines(source), *bare_bodies(source), *long_files(source), *long_functions(source), *sentences(path, source),
                  *lists(path, source)]
        for number, what in sorted(faults):
            print(f"{name}:{number}: {what}")
            found += 1
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
