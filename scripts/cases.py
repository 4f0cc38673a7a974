#!/usr/bin/env python3
"""Compares the cases of the C tests with tests/cases.txt, so that none is lost when tests move. Ends with 1 if a case of the
list is not in the tree. A case that got another name gets it in the list too. Where git has the commit FIRST, its cases are
compared as well, through tests/cases_renamed.txt. Usage: scripts/cases.py [--write]"""
import collections
import pathlib
import re
import shutil
import subprocess
import sys
import textwrap

ROOT = pathlib.Path(__file__).resolve().parent.parent
LIST = ROOT / "tests" / "cases.txt"
RENAMED = ROOT / "tests" / "cases_renamed.txt"
FIRST = "1425647"
HEAD = "# Cases of the C tests, for scripts/cases.py: a name, as often as there are cases of it. --write adds new ones.\n"


def cases():
    found = collections.Counter()
    for path in (ROOT / "tests").rglob("*"):
        if path.suffix in {".c", ".cpp", ".cu", ".h", ".inc"}:
            found.update(re.findall(r"^TEST(?:_WITH)?\((\w+)", path.read_text(errors="replace"), re.M))
    return found


def first_cases():
    """The cases of the commit FIRST; empty where git does not have it, as in an archive."""
    if not shutil.which("git"):
        return collections.Counter()
    found = subprocess.run(["git", "-C", ROOT, "grep", "-hoE", r"cmocka_unit_test(_[a-z_]+)?\(\s*\w+", FIRST, "--", "tests"],
                           check=False, capture_output=True, text=True)
    return collections.Counter(line.split("(")[1].strip() for line in found.stdout.splitlines())


def renamed():
    """{name at FIRST: [names today]}"""
    lines = [line.split("#")[0] for line in RENAMED.read_text().splitlines()]
    return {old.strip(): new.split() for old, new in (line.split(":") for line in lines if line.strip())}


def is_first_whole(found):
    """Compares the cases of FIRST, prints what came of it; bool."""
    first, table = first_cases(), renamed()
    lost = sorted(set(first - found) - set(table))
    lost += sorted(new for names in table.values() for new in names if new not in found)
    spare = sorted(old for old in table if first and first[old] <= found[old])
    what = f"{first.total()} cases at {FIRST}" if first else f"git does not have {FIRST}: its cases are not compared"
    print(f"{what}, {len(table)} renamed, lost: {', '.join(lost) or 'none'}{', renamed in vain: ' if spare else ''}{', '.join(spare)}")
    return not lost and not spare


def main():
    found = cases()
    if "--write" in sys.argv[1:]:
        LIST.write_text(HEAD + "\n".join(textwrap.wrap(" ".join(sorted(found.elements())), 140)) + "\n")
    text = re.sub(r"^#.*\n", "", LIST.read_text(), flags=re.M)
    lost = collections.Counter(text.split()) - found
    print(f"{found.total()} cases in the tree, {len(text.split())} in tests/cases.txt, lost: {', '.join(lost.elements()) or 'none'}")
    return 0 if is_first_whole(found) and not lost else 1


if __name__ == "__main__":
    sys.exit(main())
