#!/usr/bin/env python3
"""scripts/paper/exam.py: its lines by hand, and two parts beside `mild eval`. Usage: test_exam.py MILD SOURCE_FOLDER"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

mild, root = (pathlib.Path(path).resolve() for path in sys.argv[1:])
os.environ["MILD"] = str(mild)
sys.path.insert(0, str(root / "scripts/paper"))
sys.dont_write_bytecode = True
import exam  # noqa: E402

COMMAND = root / "scripts/paper/exam.py"


def row(ground, speed, velocity, trials):
    """trials: (end, largest torque, least distance of the legs)."""
    ends = {end: sum(t[0] == end for t in trials) for end in ("time", "tilt", "base")}
    return {"ground": ground, "speed": speed, "velocity": velocity, "success": ends["time"], "trials": len(trials), "cot": speed or None,
            "ends": ends, "each": [{"end": end, "torque_max": torque, "legs": legs} for end, torque, legs in trials]}


def lines():
    rows = [row("rubber", 0.5, 0.49, [("time", 40, 0.02), ("time", 50, 0.01)]), row("snow", -0.5, -0.47, [("base", 80, -0.01), ("tilt", 70, None)]),
            row("snow", 0, 0.4, [("time", 30, 0.03), ("base", 20, 0.04)])]
    s = exam.summary(rows)
    assert (s["upright"], s["trials"], s["ends"]) == (3, 6, {"base": 2, "tilt": 1})
    assert s["worst"] == ["snow", -0.5, -0.47] and s["cot"] == [-0.5, 0.5] and s["torque"] == 80 and s["legs"] == -0.01  # standing has no share
    assert s["fell"] == [["snow", -0.5, 2], ["snow", 0, 1]]
    report = exam.line("what", s)
    for part in ("3 of 6", "-0.470 for -0.50 on snow", "80 N m", "-10 mm", "2 base", "1 tilt", "snow@-0.5:2", "snow@0:1"):
        assert part in report, (part, report)
    cells = sum(len(grounds) * len(speeds) for _, grounds, speeds, _ in exam.PARTS.values())
    assert 10 * (cells + 72 * 5) + 2 * 60 * 3 == 6450  # what docs/results.md and README.md say


def beside_eval():
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-B", COMMAND, "--out", folder, "--trials", "1", "--jobs", "1", "--seed", "3"]
        done = subprocess.run([*words, "--parts", "half,steps", "--", "--task.torque_share=0.5"], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        report = json.loads((pathlib.Path(folder) / "exam.json").read_text())["parts"]
        own = subprocess.run([mild, "eval", "--config", root / "configs/walk.ini", "--ground", "foam25", "--ground.k_pen=75", "--ground.sigma_cone=5.5e4",
                              "--speed=0.6", "--trials", "1", "--seed", "3", "--task.torque_share=0.5", "--json", "-"], capture_output=True, text=True)
        plain = json.loads(own.stdout)["rows"][0]
        assert report["half"]["rows"][1] == plain, (report["half"]["rows"][1], plain)
        assert report["half"]["upright"] == sum(r["success"] for r in report["half"]["rows"]) and report["steps"]["trials"] == 2
        assert f"{report['half']['upright'] + report['steps']['upright']} of 5 trials upright" in done.stdout, done.stdout
        wrong = subprocess.run([*words, "--parts", "half,ice"], capture_output=True, text=True)
        assert wrong.returncode == 2 and wrong.stderr.count("\n") == 1 and "ice" in wrong.stderr, wrong


lines()
beside_eval()
