#!/usr/bin/env python3
"""Compares the cases of the C tests with tests/cases.txt, so that none is lost when tests move. Ends with 1 if a case of the
list is not in the tree. A case that got another name gets it in the list too. Usage: scripts/cases.py [--write]"""
import collections
import pathlib
import re
import sys
import textwrap

ROOT = pathlib.Path(__file__).resolve().parent.parent
LIST = ROOT / "tests" / "cases.txt"
HEAD = "# Cases of the C tests, for scripts/cases.py: a name, as often as there are cases of it. --write adds new ones.\n"


def cases():
    found = collections.Counter()
    for path in (ROOT / "tests").rglob("*"):
        if path.suffix in {".c", ".cpp", ".cu", ".h", ".inc"}:
            found.update(re.findall(r"^TEST(?:_WITH)?\((\w+)", path.read_text(errors="replace"), re.M))
    return found


def main():
    found = cases()
    if "--write" in sys.argv[1:]:
        LIST.write_text(HEAD + "\n".join(textwrap.wrap(" ".join(sorted(found.elements())), 140)) + "\n")
    text = re.sub(r"^#.*\n", "", LIST.read_text(), flags=re.M)
    lost = collections.Counter(text.split()) - found
    print(f"{found.total()} cases in the tree, {len(text.split())} in tests/cases.txt, lost: {', '.join(lost.elements()) or 'none'}")
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main())
