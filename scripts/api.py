#!/usr/bin/env python3
"""The interface of libmild as one page, and the check that every public name is documented.

    api.py HEADER...            prints the page (Markdown)
    api.py --check HEADER...    exit 1 and a line for each gap
    api.py --names HEADER...    every declaration without its remarks: what tests/install/api.txt keeps (VERSIONING.md)

A remark stands directly above a declaration, or behind a field. What it must say: a double's unit in brackets; an array's shape
in brackets (or "array of ..."); what happens on failure where there is a MildError; and, once at a header's top, thread safety.
Declarations without a blank line between them share the remark above the first one, which must name them all."""
import re
import sys


class Item:
    """A declaration: kind function, struct, enum, constant or section; fields for structs and enums."""

    def __init__(self, kind, name, code, doc, line, shared=False):
        self.kind, self.name, self.code, self.doc, self.line, self.shared = kind, name, code, doc, line, shared
        self.fields = []  # (code, name, doc, line)


def clean(comment):
    """The text of a comment without /*, */ and leading stars."""
    text = comment.strip()[2:-2]
    return "\n".join(re.sub(r"^\s*\*? ?", "", line, count=1) if i else line.strip() for i, line in enumerate(text.split("\n"))).strip()


def tokens(text):
    """(kind, text, line) of comments, blank lines, preprocessor lines, and declarations up to their semicolon."""
    at, line = 0, 1
    pattern = re.compile(r"(?P<comment>/\*.*?\*/)|(?P<blank>\n[ \t]*\n)|(?P<macro>\#(?:[^\n\\]|\\.|\\\n)*)|(?P<space>\s+)", re.S)
    while at < len(text):
        match = pattern.match(text, at)
        if match:
            yield match.lastgroup, match.group(), line
            end = match.end() - (1 if match.lastgroup == "blank" else 0)
        else:
            end, depth = at, 0
            while end < len(text):
                if text.startswith("/*", end):
                    end = text.index("*/", end) + 1
                depth += {"{": 1, "}": -1}.get(text[end], 0)
                end += 1
                if text[end - 1] == ";" and depth == 0:
                    break
            if text[at:end].startswith(("MILD_API_BEGIN", "MILD_API_END")):
                end = at + len(re.match(r"\w+", text[at:]).group())
            else:
                yield "code", text[at:end], line
        line += text.count("\n", at, end)
        at = end


def read_fields(item, body, line):
    """Members of a struct or an enum, each with the remark behind or above it."""
    separator = "," if item.kind == "enum" else ";"
    doc, pending = "", None
    for match in re.finditer(r"/\*.*?\*/|[^%s/]+%s?|/" % (separator, separator), body, re.S):
        piece, at = match.group(), line + body.count("\n", 0, match.start())
        if piece.startswith("/*"):
            before = body[:match.start()].rstrip(" \t")
            if pending and not before.endswith("\n"):
                pending[2] = clean(piece)
                doc = ""
            else:
                doc = clean(piece)
        elif re.search(r"\w", piece):
            code = " ".join(piece.replace(separator, " ").split())
            name = re.sub(r"\s*=.*", "", re.sub(r"\[.*?\]", "", code)).split()[-1].lstrip("*")
            pending = [code, name, doc, at + len(piece) - len(piece.lstrip("\n"))]
            item.fields.append(pending)
            doc = ""


def read(path):
    """(text at the header's top, items)."""
    items, doc, top, shared = [], "", None, False
    with open(path, encoding="utf-8") as file:
        text = file.read()
    for kind, piece, line in tokens(text):
        if kind == "comment":
            comment = clean(piece)
            if top is None:
                top = comment
            elif comment.startswith("----"):
                title, _, rest = comment[4:].partition("----")
                items.append(Item("section", title.strip(), "", rest.strip(), line))
                doc = rest.strip()
            elif items and items[-1].kind == "constant" and items[-1].line == line:
                items[-1].doc = comment  # behind a #define
                continue
            else:
                doc = comment
            shared = False
        elif kind == "blank":
            doc = ""
        elif kind == "macro":
            match = re.match(r"#define (MILD_\w+)(\(.*?\))?\s*(.*)", piece, re.S)
            if match and not match.group(1).endswith("_H"):
                code, _, remark = match.group(3).partition("/*")
                code = "" if match.group(2) else code.strip()
                items.append(Item("constant", match.group(1), code, clean("/*" + remark) if remark else doc, line))
        elif kind == "code":
            body = re.match(r"typedef (struct|enum)(?: \w+)? \{(.*)\}\s*(\w+);", piece, re.S)
            opaque = re.match(r"typedef struct \w+ \*?(\w+);", piece)
            function = re.search(r"(\w+)\s*\(", piece)
            data = re.match(r"extern .*?(\w+)(?:\[\w*\])?;", piece)
            if body:
                items.append(Item(body.group(1), body.group(3), "", doc, line))
                read_fields(items[-1], body.group(2), line + piece[:piece.index("{")].count("\n"))
            elif opaque:
                items.append(Item("opaque", opaque.group(1), piece, doc, line))
            elif data or function:
                name = data.group(1) if data else function.group(1)
                items.append(Item("data" if data else "function", name, " ".join(piece.split()), doc, line, shared))
                if shared:
                    items[-2].shared = True
                shared = True
                continue
            shared = False
    return top or "", items


def gaps(path):
    """One line for each gap in the documentation."""
    top, items = read(path)
    if "thread" not in top.lower():
        yield 1, "the top of the header says nothing of thread safety"
    for item in items:
        if item.kind == "section":
            continue
        doc = item.doc.lower()
        if not doc and item.kind != "enum":
            yield item.line, f"{item.name} has no remark"
        elif item.kind == "function":
            if item.shared and item.name.rsplit("_", 1)[-1].lower() not in doc:
                yield item.line, f"{item.name}: the shared remark does not name it"
            if "MildError" in item.code and not re.search(r"fail|error|null|refuse", doc):
                yield item.line, f"{item.name}: what happens on failure is not said"
            if item.code.startswith("double ") and "[" not in doc:
                yield item.line, f"{item.name}: the unit of its value is not said"
            if "double *" in item.code and not re.search(r"\[|array", doc):
                yield item.line, f"{item.name}: the shape of its array is not said"
        for code, name, remark, line in item.fields:
            if not remark:
                yield line, f"{item.name}.{name} has no remark"
            elif re.match(r"(const )?double\b", code) and "[" not in remark:
                yield line, f"{item.name}.{name}: the unit is not said"


def page(paths):
    print("# Interface of libmild\n\nMade from the headers by `make docs`; the headers are what is right.")
    for path in paths:
        name = "mild/" + path.rsplit("/", 1)[-1]
        top, items = read(path)
        print(f"\n## {name}\n\n```text\n{top}\n```")
        for item in items:
            if item.kind == "section":
                print(f"\n### {item.name}\n" + (f"\n{item.doc}\n" if item.doc else ""))
                continue
            if item.kind in ("function", "data", "opaque"):
                print(f"\n```c\n{item.code}\n```")
            else:
                print(f"\n**`{item.name}`** {item.code}".rstrip())
            sectioned = any(other.kind == "section" and other.doc == item.doc for other in items)
            if item.doc and not sectioned:
                print("\n" + item.doc)
            if item.fields:
                print("\n| member | |\n|---|---|")
                for code, _, remark, _ in item.fields:
                    print("| `" + code.replace("|", "\\|") + "` | " + " ".join(remark.split()).replace("|", "\\|") + " |")


def names(paths):
    """Each header's declarations, members and rows of lists in their order, because order is layout and numbers."""
    for path in sorted(paths):
        print("mild/" + path.rsplit("/", 1)[-1])
        with open(path, encoding="utf-8") as file:
            text = re.sub(r"/\*.*?\*/", "", file.read(), flags=re.S)
        for item in read(path)[1]:
            if item.kind == "section" or item.name.startswith("MILD_API_"):
                continue
            rows = re.search(rf"#define {item.name}\(ROW\)((?:[^\n\\]|\\\n)*)", text)
            if rows:
                print(f"  list {item.name}: " + ", ".join(re.sub(r"\s+", " ", row) for row in re.findall(r"ROW\(([^)]*)\)", rows.group(1))))
            elif item.kind == "constant":
                print(f"  constant {item.name} {' '.join(item.code.split())}".rstrip())
            elif item.kind in ("struct", "enum"):
                print(f"  {item.kind} {item.name}")
                for code, *_ in item.fields:
                    print(f"    {code}")
            else:
                print(f"  {item.code}")


def main(arguments):
    if arguments[:1] == ["--names"]:
        names(arguments[1:])
        return 0
    if arguments[:1] != ["--check"]:
        page(arguments)
        return 0
    missing = [(path, line, text) for path in arguments[1:] for line, text in gaps(path)]
    for path, line, text in missing:
        print(f"{path}:{line}: {text}")
    counted = sum(item.kind != "section" for path in arguments[1:] for item in read(path)[1])
    print(f"{counted} public names, {len(missing)} gaps")
    return bool(missing)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
