#!/usr/bin/env python3
"""lab/paper/transitions.py: cells, totals and strides by hand, and one pair walked both ways. Usage: test_transitions.py MILD SOURCE_FOLDER"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

mild, root = (pathlib.Path(path).resolve() for path in sys.argv[1:])
os.environ["MILD"] = str(mild)
sys.path.insert(0, str(root / "lab/paper"))
sys.dont_write_bytecode = True
import transitions  # noqa: E402

COMMAND = root / "lab/paper/transitions.py"


def cells_and_totals():
    assert len(transitions.PAIRS) == 72 == len(set(transitions.PAIRS)) and "rigid>foam25" in transitions.PAIRS
    row = {"speed": -0.6, "trials": 3, "success": 2, "velocity": -0.57, "cot": 0.5, "legs": 0.01, "ends": {"time": 2, "tilt": 1, "shell": 0},
           "each": [{"end": "time", "x": -4.1, "torque_max": 60}, {"end": "time", "x": -2.4, "torque_max": 70},
                    {"end": "tilt", "x": -3.0, "torque_max": 90}]}
    cell = transitions.cell_of("rigid>foam25", row)
    assert cell["crossed"] == 1 and cell["upright"] == 2 and cell["torque"] == 90 and cell["ends"] == {"tilt": 1}
    assert abs(cell["error"] - 0.03) < 1e-12
    other = {**cell, "pair": "foam25>rigid", "trials": 3, "upright": 3, "crossed": 3, "error": -0.12, "cot": 0.7, "torque": 50, "ends": {}}
    fell = {**cell, "speed": 0.6, "upright": 0, "error": 0.5, "cot": 9, "torque": 100, "crossed": 0, "ends": {"tilt": 1, "base": 2}}
    found = transitions.totals([cell, other, fell])
    assert list(found) == ["-0.6", "0.6", "all"]
    own, every = found["-0.6"], found["all"]
    assert (own["upright"], own["trials"], own["whole"], own["cells"], own["torque"], own["torque_upright"]) == (5, 6, 1, 2, 90, 50)
    assert abs(own["error"] - 0.075) < 1e-12 and abs(own["worst_error"] - 0.2) < 1e-12 and abs(own["cot"] - 0.6) < 1e-12
    assert every["ends"] == {"base": 2, "tilt": 2} and every["crossed"] == 4 and every["torque"] == 100 and abs(every["cot"] - 0.6) < 1e-12
    assert found["0.6"]["error"] is None and found["0.6"]["torque_upright"] is None


def strides_of_a_walk():
    """Foot 0 comes down each second, 0.6 m further on; foot 1 half a second later; backward. z~ is 2 before 5 s, then 6, on a line where
    1 is the first ground and 5 the second."""
    stances = [{"trial": "0", "foot": str(foot), "start_s": f"{k + 0.5 * foot}", "x_m": f"{-0.6 * (k + 0.5 * foot)}",
                "apex_m": f"{0.1 + 0.01 * k}", "torque_n_m": f"{40 + k}"} for foot in range(2) for k in range(10)]
    latent = [{"trial": "0", "time_s": f"{0.1 * i}", "modulated0": "2" if i < 50 else "6", "modulated1": "3"} for i in range(100)]
    alone = [[{"time_s": "3", "modulated0": value, "modulated1": "3"}, {"time_s": "1", "modulated0": "100", "modulated1": "100"}]
             for value in "15"]  # the first two seconds do not count
    found = transitions.strides_of(stances, latent, transitions.axis_between(*alone), -1)
    assert len(found) == 7 + 7 and all(abs(s["length"] - 0.6) < 1e-9 and s["duration"] == 1 for s in found)
    first = found[0]
    assert first["time"] == 3 and first["torque"] == 42 and abs(first["clearance"] - 0.13) < 1e-12 and abs(first["place"] - 1.8) < 1e-12
    assert abs(first["z"] - 0.25) < 1e-12 and abs(found[6]["z"] - 1.25) < 1e-12
    rows = {row["number"]: row for row in transitions.over_border(found, 2.5)}
    # beyond 2.5 m come foot 0 at 5 s and foot 1 at 4.5 s
    assert rows[0]["strides"] == 2 and rows[-1]["strides"] == 2 and min(rows) == -2 and rows[4]["strides"] == 2
    assert abs(rows[0]["torque"] - (44 + 43) / 2) < 1e-12 and rows[0]["cadence"] == 1
    assert rows[0]["z"] == 0.25 and abs(rows[1]["z"] - (1.25 + 0.75) / 2) < 0.06


def one_pair():
    with tempfile.TemporaryDirectory() as folder:
        words = ["--out", folder, "--pairs", "rubber>grass", "--speeds=-1.2,1.2", "--trials", "1", "--jobs", "1"]
        done = subprocess.run([sys.executable, "-B", COMMAND, *words], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        report = json.loads((pathlib.Path(folder) / "transitions.json").read_text())
        assert [c["speed"] for c in report["cells"]] == [-1.2, 1.2] and report["totals"]["all"]["crossed"] == 2, report
        assert all(abs(c["error"]) < 0.1 for c in report["cells"]), report
        assert "crossed 2" in done.stdout and "rubber>grass" in done.stdout
        stopped = subprocess.run([sys.executable, "-B", COMMAND, *words, "--", "--task.torque_share=0.1"], capture_output=True, text=True)
        assert "upright 0 of 2" in stopped.stdout and "ended by" in stopped.stdout, stopped  # what comes after -- reaches eval
        for bad in (["--pairs", "rubber>snow"], ["--speeds", "0"], ["--speeds", "fast"]):
            done = subprocess.run([sys.executable, "-B", COMMAND, "--out", folder, *bad], capture_output=True, text=True)
            assert done.returncode == 2 and done.stderr.count("\n") == 1, (bad, done)


cells_and_totals()
strides_of_a_walk()
one_pair()
print("72 pairs; cells, totals and strides by hand")
