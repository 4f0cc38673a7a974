#!/usr/bin/env python3
"""Runs the notebook of each tutorial, as scripts/notebook.py makes it for the site, in Jupyter's kernel, in an empty folder, with the `mild` and the
`python` of the environment it is started in. A cell that fails ends it. Commands are cut short as in test_tutorials.py; each picture that
the page shows must have been shown. Writes the notebooks as they came out. Usage: check_notebooks.py SOURCE_FOLDER OUT_FOLDER [PAGE ...]"""
import os
import pathlib
import shutil
import sys
import time

import nbclient
import nbformat

source, out = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
sys.path[:0] = [str(source / "scripts"), str(source / "tests/install")]
import notebook  # noqa: E402
from test_tutorials import SHORT, shorten  # noqa: E402

BIN = pathlib.Path(sys.executable).parent  # not resolved: of the environment
PAGES = ["your-simulator", "your-robot", "your-soil", "train-on-a-gpu", "deploy"]
os.environ["PATH"] = f"{BIN}:{os.environ['PATH']}"


def run(page):
    text = (source / f"docs/tutorials/{page}.md").read_text(encoding="utf-8")
    book = nbformat.reads(notebook.notebook(text), as_version=4)
    work = out / page
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    code = [cell for cell in book.cells if cell.cell_type == "code"]
    for cell in code:
        cell.source = shorten(page, cell.source, source)
        if cell.source.startswith("%%bash"):
            cell.source = cell.source.replace("%%bash", "%%bash -e", 1)  # a command in the middle that fails, fails here
    client = nbclient.NotebookClient(book, timeout=240, kernel_name="python3", resources={"metadata": {"path": str(work)}})
    try:
        client.execute()
    except nbclient.exceptions.CellExecutionError as error:
        sys.exit(f"FAIL: the notebook of {page}: {error}")
    finally:
        nbformat.write(book, work / f"{page}.ipynb")
    for cell in code:
        if "from IPython.display" in cell.source:
            kinds = [kind for output in cell.outputs for kind in output.get("data", {})]
            if not {"image/png", "text/html"} & set(kinds):
                sys.exit(f"FAIL: the notebook of {page} shows {kinds} by: {cell.source}")
    return len(code)


for page in sys.argv[3:] or PAGES:
    begin = time.monotonic()
    print(f"{page}: {run(page)} cells ran in Jupyter, {time.monotonic() - begin:.0f} s", flush=True)
