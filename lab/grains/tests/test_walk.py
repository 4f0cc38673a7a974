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
sys.path.insert(0, str(SOURCE / "lab/grains"))
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
    row, report, load = stand(folder, "0.8", "0.45,0.24,0.15", "0.3")
    late = [value for time, value in load.items() if time > 0.6]
    carried, weight = sum(late) / len(late), MASS * 9.81
    print(f"{report['beds']} beds of {report['grains_of_tile']} grains, {report['seconds']:.0f} s; the feet carry {carried:.1f} N, weight "
          f"{weight:.1f} N (3 %); poses apart by {1e3 * report['pose_off_m']:.3f} mm, {report['pose_off_rad']:.4f} rad")
    assert row["success"] == 1 and report["lost_sole_s"] is None and report["pictures"] >= 8
    assert abs(carried / weight - 1) < 0.03
    assert report["pose_off_m"] < 1e-4 and report["pose_off_rad"] < 2e-3  # the grains' soles are the robot's


def a_robot_without_ground_falls(folder):
    row, report, load = stand(folder, "2", "0.45,0.24,0.05", "0.02", "--sole-z", "-0.3")  # below the floor
    ends = {end for end, count in row["ends"].items() if count}
    print(f"a sole is lost after {report['lost_sole_s']} s, and the robot falls: {ends} after {report['time_s']} s")
    assert report["lost_sole_s"] == 0.001 and row["success"] == 0 and ends <= {"base", "tilt"} and report["time_s"] < 1
    assert load and not any(load.values())


def question(time, feet, response):
    """feet: place, rotation, twist, twist without ground of each."""
    numbers = [2, time, 0.001, 0]
    for place, turn, twist, _ in feet:
        numbers += [*place, *turn, *twist]
    numbers += [value for foot in feet for value in foot[3]]
    numbers += [response[row % 6] if row == column else 0 for row in range(12) for column in range(12)]
    return struct.pack(f"{len(numbers)}d", *numbers)


class Program:
    """The program alone, with questions of ours."""

    def __init__(self, folder):
        self.folder, self.time = folder, 0
        self.child = subprocess.Popen(program(folder, "0.3,0.15,0.06", "0.02"), stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def ask(self, feet, response=(1 / 15,) * 6):
        self.time += 1
        self.child.stdin.write(question(0.001 * self.time, feet, response))
        self.child.stdin.flush()
        return struct.unpack("16d", self.child.stdout.read(128))

    def end(self, killed=False):
        if killed:
            self.child.kill()
        self.child.stdin.close()
        code = self.child.wait()
        assert killed or code == 0
        self.child.stdout.close()
        return json.loads((self.folder / "walk-0.json").read_text())


def still(turn, height=0.06):
    return [((0, 0, height), turn, (0,) * 6, (0,) * 6)] * 2


def turned(roll):
    c, s = math.cos(roll), math.sin(roll)
    return [1, 0, 0, 0, c, -s, 0, s, c]


def a_sole_may_turn_over(folder):
    one = Program(folder)
    turns = [turned(0)] * 3 + [turned(math.pi)] * 2 + [turned(0)] * 2
    for turn in turns:  # in the air nothing is lost
        one.ask(still(turn))
    assert one.end()["lost_sole_s"] is None
    one = Program(folder)
    answers = [one.ask(still(turn, 0.06 if turn == turned(0) else -0.06)) for turn in turns]
    report = one.end()
    assert report["lost_sole_s"] == 0.004 and report["robot_steps"] == 3, report
    assert all(value == 0 for answer in answers[3:] for value in answer) and all(map(math.isfinite, sum(answers, ())))
    one = Program(folder)
    one.ask(still([-1, 0, 0, 0, -1, 0, 0, 0, 1]))  # a robot that walks back is not upside down
    assert one.end()["lost_sole_s"] is None


def a_walk_that_is_killed_leaves_its_pictures(folder):
    one = Program(folder)
    for _ in range(105):
        one.ask(still(turned(0)))
    report, frames = one.end(killed=True), (folder / "frames-0.bin").read_bytes()
    pictures, at = 0, 0
    while at < len(frames):  # of two beds; each moved grain has its number, and three ways
        for _ in range(2):
            at += 4 + struct.unpack_from("I", frames, at)[0] * 10
        pictures += 1
    assert at == len(frames) and pictures == report["pictures"] == 2, (pictures, report)


def two_free_feet_go_where_the_grains_say(folder):
    """Each has mass 4 kg, and 0.02 kg m2 about its ankle; they fall and slide. The robot's velocity with the answer's wrench is that which
    the sole has among the grains, so no force is late and no moment about another point. What is left is the turn of the lever from ankle to
sole in a step, w^2 r dt."""
    one, response, dt = Program(folder), [1 / 4] * 3 + [1 / 0.02] * 3, 0.001
    feet = [[[0, 0, 0.055], turned(0.05 * side), [0.3, 0.1 * side, -0.3, 0, 0, 0.5]] for side in (1, -1)]
    felt = fastest = 0
    for _ in range(60):
        free = [[value - (9.81 * dt if k == 2 else 0) for k, value in enumerate(twist)] for _, _, twist in feet]
        answer = one.ask([(*foot, without) for foot, without in zip(feet, free)], response)
        for f, (place, turn, twist) in enumerate(feet):
            wrench = answer[8 * f:8 * f + 6]
            felt = max(felt, *map(abs, wrench[3:]))
            twist[:] = [free[f][k] + dt * response[k] * wrench[k] for k in range(6)]
            place[:] = [place[k] + dt * twist[k] for k in range(3)]
            fastest = max(fastest, math.hypot(*twist[3:]))
            w, columns = twist[3:], [[turn[k], turn[3 + k], turn[6 + k]] for k in range(3)]
            for k, c in enumerate(columns):
                by = [w[1] * c[2] - w[2] * c[1], w[2] * c[0] - w[0] * c[2], w[0] * c[1] - w[1] * c[0]]
                c[:] = [c[i] + dt * by[i] for i in range(3)]
            x, y = columns[0], columns[1]
            x = [v / math.hypot(*x) for v in x]
            y = [v - x[k] * sum(map(float.__mul__, x, y)) for k, v in enumerate(y)]
            y = [v / math.hypot(*y) for v in y]
            z = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]]
            turn[:] = [x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]]
    report = one.end()
    bound = 1.2 * fastest**2 * 0.055 * dt
    print(f"moments up to {felt:.1f} N m; speeds apart by {report['speed_off_m_s']:.1e} m/s (bound {bound:.1e}), poses by {report['pose_off_m']:.1e} m, "
          f"{report['pose_off_rad']:.1e} rad in a step")
    assert felt > 1 and report["lost_sole_s"] is None and report["full_lists"] == 0  # no contact is left out
    assert report["speed_off_m_s"] < bound


for test in (two_free_feet_go_where_the_grains_say, a_sole_may_turn_over, a_walk_that_is_killed_leaves_its_pictures, a_robot_without_ground_falls, a_robot_stands):
    with tempfile.TemporaryDirectory() as name:
        test(pathlib.Path(name))
print("a robot stands on grains")
