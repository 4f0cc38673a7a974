"""The SA01 on grains of 30 mm, by `mild eval --program` and `grains --sole`: it stands, and the two feet carry its weight; a sole that is
lost ends the trial by the rule of eval; a walk that is killed leaves what it has. test_walk.py MILD GRAINS SOURCE"""
import json
import math
import pathlib
import re
import shlex
import struct
import subprocess
import sys
import tempfile

MILD, GRAINS, SOURCE = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
sys.dont_write_bytecode = True
sys.path.insert(0, str(SOURCE / "grains"))
import walk  # noqa: E402

SOLE, HEIGHT = walk.outline("sa01")
MASS = float(re.search(r"sa01: .* ([\d.]+) kg", subprocess.run([MILD, "info", "robots"], capture_output=True, text=True).stdout).group(1))


def program(folder, box, settle, *more):
    return [GRAINS, "--sole", SOLE, "--sole-z", HEIGHT, "--out", str(folder), "--grain", "0.03", "--box", box, "--settle", settle,
            "--reach", "0.15", "--track", "0.05", "--frames", "10", *more]


def stand(folder, seconds, box, settle, *more):
    """One trial: its row, what the program says, the vertical force of both feet after each policy step."""
    words = [MILD, "eval", "--controller", "stand", "--ground", "sand_loose", "--speed", "0", "--trials", "1", "--seconds", seconds,
             "--task.physics_dt", "0.001", "--feet", folder / "feet.csv", "--json", folder / "eval.json",
             "--program", shlex.join(program(folder, box, settle, *more))]
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    rows = [line.split(",") for line in (folder / "feet.csv").read_text().splitlines()]
    time, force, load = rows[0].index("time_s"), rows[0].index("force_z_n"), {}
    for row in rows[1:]:
        load[float(row[time])] = load.get(float(row[time]), 0) + float(row[force])
    return json.loads((folder / "eval.json").read_text())["rows"][0], json.loads((folder / "walk-0.json").read_text()), load


def a_robot_stands(folder):
    row, told, load = stand(folder, "0.8", "0.45,0.24,0.15", "0.3")
    late = [value for time, value in load.items() if time > 0.6]
    carried, weight = sum(late) / len(late), MASS * 9.81
    print(f"{told['beds']} beds of {told['grains_of_tile']} grains, {told['seconds']:.0f} s; the feet carry {carried:.1f} N, weight "
          f"{weight:.1f} N (3 %); poses apart by {1e3 * told['pose_off_m']:.3f} mm, {told['pose_off_rad']:.4f} rad")
    assert row["success"] == 1 and told["lost_sole_s"] is None and told["pictures"] >= 8
    assert abs(carried / weight - 1) < 0.03
    assert told["pose_off_m"] < 1e-4 and told["pose_off_rad"] < 2e-3  # the grains' soles are the robot's


def a_robot_without_ground_falls(folder):
    row, told, load = stand(folder, "2", "0.45,0.24,0.05", "0.02", "--sole-z", "-0.3")  # below the floor
    ends = {end for end, count in row["ends"].items() if count}
    print(f"a sole is lost after {told['lost_sole_s']} s, and the robot falls: {ends} after {told['time_s']} s")
    assert told["lost_sole_s"] == 0.001 and row["success"] == 0 and ends <= {"base", "tilt"} and told["time_s"] < 1
    assert load and not any(load.values())


def question(time, turn, height=0.06):
    """Of two feet that nothing but the ground moves."""
    foot = [0, 0, height, *turn, *[0] * 6]
    response = [1 / 15 if row == column else 0 for row in range(12) for column in range(12)]
    numbers = [2, time, 0.001, 0, *foot, *foot, *[0] * 12, *response]
    return struct.pack(f"{len(numbers)}d", *numbers)


def ask(folder, turns, killed):
    """Answers of the program itself, each 16 numbers; then it is killed, or its input ends."""
    child = subprocess.Popen(program(folder, "0.3,0.15,0.06", "0.02"), stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    answers = []
    for k, turn in enumerate(turns):
        child.stdin.write(question(0.001 * (k + 1), turn))
        child.stdin.flush()
        answers.append(struct.unpack("16d", child.stdout.read(128)))
    if killed:
        child.kill()
    child.stdin.close()
    code = child.wait()
    assert killed or code == 0
    return answers, json.loads((folder / "walk-0.json").read_text())


def turned(roll):
    c, s = math.cos(roll), math.sin(roll)
    return [1, 0, 0, 0, c, -s, 0, s, c]


def a_sole_may_turn_over(folder):
    turns = [turned(0)] * 3 + [turned(math.pi)] * 2 + [turned(0)] * 2
    answers, told = ask(folder, turns, killed=False)
    assert told["lost_sole_s"] == 0.004 and told["robot_steps"] == 3, told
    assert all(value == 0 for answer in answers[3:] for value in answer) and all(map(math.isfinite, sum(answers, ())))
    turns = [[-1, 0, 0, 0, -1, 0, 0, 0, 1]] * 2  # a robot that walks back is not upside down
    assert ask(folder, turns, killed=False)[1]["lost_sole_s"] is None


def a_walk_that_is_killed_leaves_its_pictures(folder):
    _, told = ask(folder, [turned(0)] * 105, killed=True)
    frames = (folder / "frames-0.bin").read_bytes()
    pictures, at = 0, 0
    while at < len(frames):  # of two beds; each moved grain has its number, and three ways
        for _ in range(2):
            at += 4 + struct.unpack_from("I", frames, at)[0] * 10
        pictures += 1
    assert at == len(frames) and pictures == told["pictures"] == 2, (pictures, told)


for test in (a_sole_may_turn_over, a_walk_that_is_killed_leaves_its_pictures, a_robot_without_ground_falls, a_robot_stands):
    with tempfile.TemporaryDirectory() as name:
        test(pathlib.Path(name))
print("a robot stands on grains")
