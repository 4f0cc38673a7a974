"""lab/grains/blow.py: a blow made by hand, the table of the records, a sole, and what is refused; direction.py: a landing made by hand,
the table of the records. test_blow.py SOURCE"""
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

SOURCE = pathlib.Path(sys.argv[1])
sys.dont_write_bytecode = True
sys.path.insert(0, str(SOURCE / "lab/grains"))
import blow  # noqa: E402
import direction  # noqa: E402
from judge_cases import Case  # noqa: E402


def rows(time, depth, force):
    table = np.zeros(len(time), dtype=[("time_s", float), ("depth_m", float), ("force_z_n", float)])
    table["time_s"], table["depth_m"], table["force_z_n"] = time, depth, force
    return table


def write(file, table):
    np.savetxt(file, np.column_stack([table[name] for name in table.dtype.names]), delimiter=",", header=",".join(table.dtype.names), comments="")


def run(*words):
    return subprocess.run([sys.executable, SOURCE / "lab/grains" / "blow.py", *map(str, words)], capture_output=True, text=True)


time = np.arange(1, 401) * 1e-4
depth = np.minimum(time - 0.004, 0.03)  # 1 m/s from 4 mm above the ground
slow = rows(np.linspace(0.1, 5, 200), np.linspace(-0.001, 0.035, 200), 1000 * np.maximum(np.linspace(-0.001, 0.035, 200), 0))
fast = rows(time, depth, 1000 * np.maximum(depth, 0) + 200 * ((time > 0.004) & (time <= 0.009)))
force, when, momentum = blow.blow(slow, fast)
assert abs(force - 205) < 0.5 and abs(when - (0.004 + 0.75 / 200)) < 2e-4 and abs(momentum - 1.0) < 0.03, (force, when, momentum)
with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    write(folder / "level-slow-1.csv", slow)
    write(folder / "level-fast-1.csv", fast)
    done = run("sole", folder)
    words = done.stdout.split("level")[1].split()
    assert 190 < float(words[1]) <= 200 and abs(float(words[2])) < 1 > abs(float(words[3])), done.stdout  # 0 to 5, 5 to 10 mm
of_records = run("table")
print(of_records.stdout)
row = of_records.stdout.split("\n")[1].split()
assert row[:2] == ["sand", "8"] and 220 < float(row[2]) < 245 and abs(float(row[4]) - 1.44) < 0.1 and abs(float(row[5]) - 54.1) < 1, row
led = [line.split()[2:] for line in run("law").stdout.split("\n") if line.startswith("mild_merged")]
assert len(led) == 2 and led[0][0] == "-" and float(led[0][1]) > float(led[1][1]) > 20, led  # a level sole is struck harder
listed = run("list").stdout
assert listed.count("build/grains/grains") == 7 and listed.count("--case 'tilted-") == 2
wrong = run("table", "none")
assert wrong.returncode == 2 and wrong.stderr.count("\n") == 1, wrong.stderr

# 100 N up and 20 N back from 10 ms on: the impulses of 10 and of 30 ms
rows_of = {"time": time, "stage": 0 * time, "depth": time, "fz": 100.0 * (time > 0.01), "fx": -20.0 * (time > 0.01)}
found = direction.numbers(Case("landing rect:0.1,0.1 0 move:1,0,-1,0,0,0.04,5"), rows_of)
wanted = {"impulse up 10 ms": 1, "impulse up 30 ms": 3, "impulse along 30 ms": -0.6, "peak": 100, "depth": 0.04}
assert found.keys() == wanted.keys() and all(abs(found[name] - wanted[name]) < 0.011 for name in wanted), found
assert direction.vectors({"along": 3, "up": 4}) == {"": 3 + 4j}
told = subprocess.run([sys.executable, SOURCE / "lab/grains/direction.py", "table"], capture_output=True, text=True).stdout
print(told)
line = next(line.split()[1:] for line in told.split("\n") if line.startswith("mild_merged  "))
assert [float(word) for word in line[:4]] == [17.7, 26.2, 7.4, 69.9], line  # lab/grains/README.md
