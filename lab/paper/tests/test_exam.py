#!/usr/bin/env python3
"""lab/paper/exam.py: its lines and its count by hand, two parts beside `mild eval`, a border. Usage: test_exam.py MILD SOURCE_FOLDER"""
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
import exam  # noqa: E402

COMMAND = root / "lab/paper/exam.py"


def row(ground, speed, velocity, trials, sideways=0.0, left=0.0):
    """trials: (end, largest torque, least distance of the legs)."""
    ends = {end: sum(t[0] == end for t in trials) for end in ("time", "tilt", "base")}
    legs = [t[2] for t in trials if t[2] is not None]
    return exam.with_errors({"case": "", "ground": ground, "speed": speed, "velocity": velocity, "sideways": sideways, "velocity_sideways": left,
                             "turn": 0, "velocity_turn": 0.1, "success": ends["time"], "trials": len(trials), "cot": speed or None, "ends": ends,
                             "legs": min(legs, default=None), "target_jump": speed + 1, "each": [{"torque_max": torque} for _, torque, _ in trials]})


def lines():
    rows = [row("rubber", 0.5, 0.49, [("time", 40, 0.02), ("time", 50, 0.01)]), row("snow", -0.5, -0.9, [("base", 80, -0.01), ("tilt", 70, None)]),
            row("snow", 0, 0.4, [("time", 30, 0.03), ("base", 20, 0.04)]), row("foam45", 0.9, None, [("time", 10, None)]),
            row("grass", 0.5, 0.5, [("time", 30, 0.03)], 0.2, 0.18)]
    assert rows[0]["error"] == 0.49 - 0.5 and rows[1]["error"] is None and rows[3]["error"] is None and abs(rows[4]["error_sideways"] + 0.02) < 1e-12
    s = exam.summary(rows)
    assert (s["upright"], s["trials"], s["ends"]) == (5, 8, {"base": 2, "tilt": 1})
    assert (s["within"], s["asked"]) == (1, 4)  # who fell or was not measured is not within; who stands is asked for nothing
    assert abs(s["share"] - (0.98 + 0.9) / 2) < 1e-12  # of who goes sideways, that
    assert s["worst"] == ["grass", 0.2, 0.18] and s["cot"] == [-0.5, 0.9] and s["torque"] == 80 and s["target_jump"] == 1.9
    assert (s["legs"], s["legs_at"]) == (-0.01, ["snow", -0.5])
    assert s["fell"] == [["snow", -0.5, 2], ["snow", 0, 1]]
    report = exam.line("what", s)
    for part in ("5 of 8", "1/4", "94 %", "+0.180 for +0.20 on grass", "80 N m", "1.90 rad", "-10 mm on snow@-0.5", "2 base", "1 tilt", "snow@-0.5:2, snow@0:1"):
        assert part in report, (part, report)


def parts():
    given = exam.parse(["--out", "out", "--mild", str(mild)])
    cells = sum(len(grounds) * len(speeds) for _, grounds, speeds, _ in exam.PARTS.values())
    slides = sum(24 * len(grounds) * len(speeds) for _, grounds, speeds, _ in exam.SLIDES.values())
    assert 10 * (cells + 72 * 5) + 2 * (60 * 3 + slides) == 7890 and given.parts == list(exam.WHAT)  # what docs/results.md says
    assert len(exam.tasks(given, "transitions")) == 360 and len(exam.tasks(given, "nine")) == 81
    other = exam.parse(["--out", "out", "--", "--robot=go1"])
    assert "snow" not in other.parts and "slip" in other.parts
    other = exam.parse(["--out", "out", "--", "--robot", "g1"])
    assert other.who[1].name == "g1.safetensors" and other.who[3].name == "g1.ini" and other.parts == given.parts
    assert exam.trained(other, exam.SPEEDS) == [-0.3, 0, 0.3, 0.6, 0.9] and exam.trained(other, [0.6, 1.2]) == [0.6]


def beside_eval():
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-B", COMMAND, "--out", folder, "--trials", "1", "--seed", "3", "--mild", mild]
        done = subprocess.run([*words, "--parts", "half,steps", "--", "--task.torque_share=0.5"], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        report = json.loads((pathlib.Path(folder) / "exam.json").read_text())["parts"]
        plain = eval_row("foam25", "--ground.k_pen=75", "--ground.sigma_cone=5.5e4", "--speed=0.6", "--seed", "3", "--task.torque_share=0.5")
        found = report["half"]["rows"][1]
        assert {key: found[key] for key in plain} == plain, (found, plain)
        assert found["error"] == plain["velocity"] - 0.6
        assert report["half"]["upright"] == sum(r["success"] for r in report["half"]["rows"]) and report["steps"]["trials"] == 2
        assert f"{report['half']['upright'] + report['steps']['upright']} of 5 trials upright" in done.stdout, done.stdout
        for wrong, what in ((["--parts", "half,ice"], "ice"), (["--mild", "none"], "none"), (["--", "--robot", "spot"], "spot.safetensors")):
            done = subprocess.run([*words, *wrong], capture_output=True, text=True)
            assert done.returncode == 2 and done.stderr.count("\n") == 1 and what in done.stderr, done
        done = subprocess.run([*words, "--jobs", "1", "--", "--task.vx=none"], capture_output=True, text=True)
        assert done.returncode == 1 and "task.vx" in done.stderr, done  # the first failure ends it, not the seven-hundredth


def eval_row(ground, *more):
    done = subprocess.run([mild, "eval", "--config", root / "configs/walk.ini", "--ground", ground, "--trials", "1", "--json", "-", *more],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["rows"][0]


def border():
    """The firm ground of a border stays firm where slip sinks."""
    course = "rigid+sand_loose", "--patch", "2", "--speed=0.6"
    slips = "--ground.slip_length=0.001", "--ground.grip=0.05"
    assert eval_row(*course, "--seconds", "3") == eval_row(*course, "--seconds", "3", *slips)
    assert eval_row(*course, "--seconds", "6") != eval_row(*course, "--seconds", "6", *slips)


lines()
parts()
beside_eval()
border()
