#!/usr/bin/env python3
"""`mild web` of an installed program serves each file of its page as it is; one without a page says so. scripts/wheels.sh
Usage: check_page.py MILD FOLDER_OF_THE_PAGE"""
import pathlib
import re
import subprocess
import sys
import urllib.request

FILES = ["draw.js", "g1.bin", "g1_jump.bin", "g1_run.bin", "go1.bin", "index.html", "mild.js", "mild.wasm", "sa01.bin", "style.css"]

mild, folder = sys.argv[1], pathlib.Path(sys.argv[2])
if not folder.exists():
    said = subprocess.run([mild, "web", "--port", "0"], capture_output=True, text=True, timeout=60, check=False)
    assert said.returncode == 2 and "this installation has no page" in said.stderr, said
    sys.exit()
there = sorted(path.name for path in folder.iterdir())
assert there == FILES, f"{folder} has {there}"
with subprocess.Popen([mild, "web", "--port", "0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as server:
    try:
        address = re.search(r"http://[\d.:]+/", server.stdout.readline())[0]
        for name in FILES:
            with urllib.request.urlopen(address + name, timeout=30) as answer:
                assert answer.read() == (folder / name).read_bytes(), f"{address}{name} is not the page's {name}"
        with urllib.request.urlopen(address, timeout=30) as answer:
            assert b"mild.js" in answer.read(), address
    finally:
        server.terminate()
print(f"mild web: {len(FILES)} files")
