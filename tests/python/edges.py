"""What the tests of edges share: the program, and tables that it writes."""
import csv
import os
import pathlib
import re
import subprocess

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
MILD = os.environ["MILD_PROGRAM"]


def run(*arguments, code=0):
    """Standard output of the program; with `code` its one line of an error."""
    done = subprocess.run([MILD, *map(str, arguments)], capture_output=True, text=True, cwd=ROOT, env={**os.environ, "MILD_HOME": str(ROOT)})
    assert done.returncode == code, (arguments, done.returncode, done.stderr)
    return done.stderr.strip() if code else done.stdout


def rows(path):
    """Columns of a CSV file, by name; numbers where they are some."""
    with open(path, newline="", encoding="utf-8") as file:
        head, *table = csv.reader(file)
    return {name: np.array([float(x) if re.fullmatch(r"-?[\d.e+-]+|nan", x) else np.nan for x in column]) for name, column in zip(head, zip(*table))}
