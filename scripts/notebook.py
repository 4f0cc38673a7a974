#!/usr/bin/env python3
"""Makes a notebook of a tutorial: its text in cells of Markdown, its files by %%writefile, its commands by %%bash, which run in the folder
in which Jupyter was started, with `mild` of the environment it was started in, and its picture. Usage: scripts/notebook.py PAGE.md FILE.ipynb"""
import json
import os
import pathlib
import re
import sys

BLOCK = re.compile(r"^```(?P<kind>\w+)\n(?P<text>.*?)^```$\n?", re.M | re.S)
FILE = re.compile(r"`(?P<name>[\w./-]+\.\w+)`[^`\n]*:\n\n$")  # as tests/install/test_tutorials.py has it


PICTURE = re.compile(r"^!\[[^\]]*\]\((?P<name>[\w-]+)\.(?P<kind>png|webp)\)$", re.M)


def shown(picture):
    """The code that shows what the page shows: a picture, or what it became a moving picture of."""
    how, kind = ("Image", "png") if picture["kind"] == "png" else ("Video", "mp4")
    return f"from IPython.display import {how}\n\n{how}('{picture['name']}.{kind}')"


def words(text):
    """The text of a cell, whose links would lead nowhere, and the picture in it."""
    text = re.sub(r"(?<!!)\[([^\]]+)\]\((?!https?:)[^)]*\)", r"\1", text)
    picture = PICTURE.search(text)
    return [(False, text[:picture.start()]), (True, shown(picture)), (False, text[picture.end():])] if picture else [(False, text)]


def cells(text):
    """[(is it code, text)]"""
    found, at = [], 0
    for block in BLOCK.finditer(text):
        before, named = text[at:block.start()], FILE.search(text[:block.start()])
        at = block.end()
        if block["kind"] == "text":
            found += words(before + block.group())
            continue
        found += words(before)
        found.append((True, f"%%writefile {named['name']}\n{block['text']}" if block["kind"] != "sh" else f"%%bash\n{block['text']}"))
    found.insert(1, (True, "%env MPLBACKEND=agg"))  # Jupyter's own is for what it draws itself
    return [(code, part.strip("\n")) for code, part in [*found, *words(text[at:])] if part.strip()]


def notebook(text):
    made = [{"cell_type": "code" if code else "markdown", "id": f"cell-{i}", "metadata": {}, "source": part.splitlines(keepends=True),
             **({"execution_count": None, "outputs": []} if code else {})} for i, (code, part) in enumerate(cells(text))]
    return json.dumps({"cells": made, "metadata": {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}},
                       "nbformat": 4, "nbformat_minor": 5}, indent=1, ensure_ascii=False) + "\n"


def main(page, file):
    pathlib.Path(file).write_text(notebook(pathlib.Path(page).read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) != 3 or not os.path.isfile(sys.argv[1]):
        sys.exit(__doc__)
    main(*sys.argv[1:])
