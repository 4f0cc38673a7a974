#!/usr/bin/env python3
"""Follows the set-up of docs/tutorials/README.md as test_tutorials.py follows the other pages: in an empty home, whose `mild` is the source
tree with its wheel made (`make wheel` itself is not repeated), with this Python as `python3`, without a display. pip fetches what it does for a reader.
scripts/wheels.sh runs it. Usage: check_setup.py SOURCE_FOLDER"""
import os
import pathlib
import sys
import tempfile

from test_tutorials import Wrong, check_itself, follow

source = pathlib.Path(sys.argv[1]).resolve()
with tempfile.TemporaryDirectory() as folder:
    home = pathlib.Path(folder)
    (home / "mild").symlink_to(source)
    (home / "bin").mkdir()
    (home / "bin/python3").write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n', encoding="utf-8")
    (home / "bin/python3").chmod(0o755)
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL", "MILD", "DISPLAY", "WAYLAND"))}
    environment.update(HOME=folder, PATH=f"{home / 'bin'}:/usr/bin:/bin", PIP_DISABLE_PIP_VERSION_CHECK="1")
    try:
        check_itself()
        count = follow(source, "README", home, environment)
    except Wrong as wrong:
        sys.exit(f"FAIL: docs/tutorials/README.md: {wrong}")
print(f"set-up: {count} blocks")
