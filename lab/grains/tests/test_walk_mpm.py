"""walk_mpm.py without newton: what is said, the window, the soles, and the SA01 on springs by `mild eval --program`. Where newton is there, on
the CPU: the operator of its solver is the robot's, new ground, a light foot at rest, two feet of one body. With `newton`, ten minutes more: the
numbers of lab/grains/README.md.
test_walk_mpm.py MILD [newton], or as the program: test_walk_mpm.py springs FOLDER OUTLINE HEIGHT"""
import io
import json
import math
import os
import pathlib
import re
import shlex
import struct
import subprocess
import sys
import tempfile
import types

import numpy as np

SOURCE = pathlib.Path(__file__).resolve().parents[3]
sys.dont_write_bytecode = True
sys.path.insert(0, str(SOURCE / "lab/grains"))
import walk  # noqa: E402
import walk_mpm  # noqa: E402

SQUARE = np.array([[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]])


def turned(axis, angle):
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


class Springs:
    """A ground of springs and dashpots under the corners of the soles; no slip within a step of 5 mm."""

    def __init__(self, soles):
        self.soles, self.held = soles, {}

    def begin(self, q):
        self.low = min(float(place[2] + (points @ turn.T)[:, 2].min()) for place, turn, points in zip(q.place, q.turn, self.soles.points)) + 0.01
        return 0.0

    def follow(self, place):
        return False

    def step(self, places, turns, twists, response, dt):
        out = np.zeros((len(places), 6))
        for f, points in enumerate(self.soles.points):
            levers = points @ turns[f].T
            for k, lever in enumerate(levers):
                at, speed = places[f] + lever, twists[f, :3] + np.cross(twists[f, 3:], lever)
                deep = self.low - at[2]
                if deep <= 0:
                    self.held.pop((f, k), None)
                    continue
                off = at[:2] - self.held.setdefault((f, k), at[:2].copy())
                up = max(0.0, 900 * deep - 5 * speed[2])
                force = np.array([*(-900 * off - 5 * speed[:2]), up])
                out[f] += [*force, *np.cross(lever, force)]
        return out


def springs(folder, outline, height):
    answers = os.fdopen(os.dup(1), "wb")
    soles = walk_mpm.Soles(walk_mpm.outlines_of(outline, (1, -1)), float(height))
    walk_mpm.serve(walk_mpm.Walk(Springs(soles), soles, 1.0, pathlib.Path(folder)), sys.stdin.buffer, answers)


def question(time, dt, place, turn, twist, free, response):
    feet = np.column_stack([place, np.reshape(turn, (len(place), 9)), twist])
    return walk_mpm.Question(time, dt, 0, feet, np.asarray(free, float), np.asarray(response, float))


# ---- without newton ----

def questions_are_read_whole():
    numbers = np.arange(4 + 2 * 18 + 12 + 144, dtype=float)
    numbers[:4] = 2, 0.5, 0.0025, 7
    data = struct.pack(f"{len(numbers)}d", *numbers)
    file = io.BytesIO(data + data[:-8])
    q = walk_mpm.read_question(file)
    assert (q.time, q.dt, q.trial) == (0.5, 0.0025, 7)
    assert q.place[1].tolist() == [22, 23, 24] and q.turn[1, 1].tolist() == [28, 29, 30] and q.twist[1].tolist() == [34, 35, 36, 37, 38, 39]
    assert q.free.tolist() == [list(range(40, 46)), list(range(46, 52))] and q.response[2, 1] == 52 + 24 + 1
    assert walk_mpm.read_question(file) is None and walk_mpm.read_question(file) is None


def quaternions_are_those_of_the_rotation():
    random, worst = np.random.default_rng(1), 0.0
    for angle in (0, 1e-9, 0.1, math.pi / 2, 3.1, math.pi):
        for axis in (*np.eye(3), *random.normal(size=(20, 3))):
            x, y, z, w = walk_mpm.quaternion(turned(axis, angle))
            again = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                              [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                              [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
            worst = max(worst, np.abs(again - turned(axis, angle)).max())
    assert worst < 1e-7, worst  # half a turn: the sine is lost


def the_window_goes_with_the_robot():
    """Each place of the window has one block; a block is laid anew when it got another place, and only then."""
    window, random, place = walk_mpm.Window((7, 4), 0.05), np.random.default_rng(2), np.zeros(2)
    laid, moves = None, 0
    for _ in range(400):
        place = place + random.normal(size=2) * [0.02, 0.01] + [0.01, 0]
        anew = window.follow(place)
        homes = window.homes(window.middle)
        if laid is None:
            assert anew.all()
        else:
            changed = (homes != laid).any(1)
            assert (changed == (np.zeros(28, bool) if anew is None else anew)).all()
            moves += anew is not None
        laid = homes
        low, size = window.corner(), window.size()
        assert len({tuple(home) for home in homes}) == 28
        assert (homes.min(0) * 0.05 == low).all() and np.allclose((homes.max(0) + 1) * 0.05, low + size)
        assert (np.abs(low + 0.5 * size - place) <= (walk_mpm.LEEWAY + 1e-9) * 0.05).all()  # the robot is near its middle
    print(f"a window went on {moves} times over {place[0]:.1f} m")
    assert 50 < moves < 350


def soles_are_lost_or_not():
    soles = walk_mpm.Soles([SQUARE, SQUARE], -0.06)

    def lost(height, turn):
        return soles.lost(question(0, 0.005, [[0, 0, height]] * 2, [turn, np.eye(3)], np.zeros((2, 6)), np.zeros((2, 6)), np.eye(12)), 0.2)
    tilted = question(0, 0.005, [[0, 0, 0.05]] * 2, [np.eye(3), turned((0, 1, 0), 0.1)], np.zeros((2, 6)), np.zeros((2, 6)), np.eye(12))
    deep, mean = soles.depths(tilted)
    assert np.allclose(deep, [0.01, -(0.05 - 0.06 * math.cos(0.1) - 0.05 * math.sin(0.1))]) and np.allclose(mean, [0.01, 0.06 * math.cos(0.1) - 0.05])
    assert not lost(0.05, np.eye(3)) and lost(-0.15, np.eye(3)) and not lost(-0.13, np.eye(3))
    over = turned((1, 0, 0), math.pi)
    assert lost(-0.1, over) and not lost(0.5, over) and not lost(0.05, turned((0, 0, 1), math.pi))


def a_lost_sole_ends_the_ground():
    soles = walk_mpm.Soles([SQUARE, SQUARE], -0.06)
    one = walk_mpm.Walk(Springs(soles), soles, 0.2)
    answers = [one.answer(question(0.001 * k, 0.001, [[0, 0, height]] * 2, [np.eye(3)] * 2, np.zeros((2, 6)), np.zeros((2, 6)), np.eye(12)))
               for k, height in enumerate((0.055, 0.05, -0.2, 0.05), 1)]
    assert (answers[1][:, 2] > 1).all() and (answers[1][:, 6] > 0).all() and one.outcome["lost_sole_s"] == 0.003
    assert not answers[2].any() and not answers[3].any() and one.outcome["steps"] == 2


def the_robot_stands_on_springs(mild, folder):
    """The feet carry its weight, and the robot has the velocity that V_free + dt A W says, but for the turn of its legs in a step."""
    outline, height = walk.outline("sa01")
    program = [sys.executable, __file__, "springs", folder, outline, height]
    words = [mild, "eval", "--controller", "stand", "--ground", "sand_loose", "--speed", "0", "--trials", "1", "--seconds", "1",
             "--task.physics_dt", "0.001", "--feet", folder / "feet.csv", "--json", folder / "eval.json",
             "--program", shlex.join(str(word) for word in program)]
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    rows = [line.split(",") for line in (folder / "feet.csv").read_text().splitlines()]
    time, force = rows[0].index("time_s"), rows[0].index("force_z_n")
    late = [float(row[force]) for row in rows[1:] if float(row[time]) > 0.7]
    info = subprocess.run([mild, "info", "robots"], capture_output=True, text=True).stdout
    weight = 9.81 * float(re.search(r"sa01: .* ([\d.]+) kg", info).group(1))
    outcome = json.loads((folder / "walk-0.json").read_text())
    print(f"on springs the feet carry {2 * np.mean(late):.1f} N, weight {weight:.1f} N; speeds apart by {outcome['speed_off_m_s']:.4f} m/s")
    assert json.loads((folder / "eval.json").read_text())["rows"][0]["success"] == 1
    assert abs(2 * np.mean(late) / weight - 1) < 0.03 and outcome["steps"] == 1000 and outcome["lost_sole_s"] is None
    assert outcome["speed_off_m_s"] < 0.01


# ---- with newton ----

def ground(outlines, **others):
    args = types.SimpleNamespace(**{"window": [0.48, 0.36, 0.15], "block": 0.06, "friction": 0.45, "plate_friction": 0.5, "solid": 0.59, "voxel": 0.03,
                                    "particles": 2, "iterations": 250, "tolerance": 1e-4, "basis": "S2", "seed": 1, "device": "cpu",
                                    "sole_height": 0.06, **others})
    soles = walk_mpm.Soles(outlines, 0.0)
    made = walk_mpm.Ground(args, soles)
    return walk_mpm.Walk(made, soles, made.depth)


def go(one, place, force, response, seconds, dt=0.005, falls=0.0):
    """Free bodies with forces [feet][6] on them: places, twists and wrenches after each step."""
    twist, turn, out = np.zeros((len(place), 6)), np.tile(np.eye(3), (len(place), 1, 1)), []
    twist[:, 2] = falls
    for k in range(round(seconds / dt)):
        free = twist + dt * (response @ force.ravel()).reshape(twist.shape)
        answer = one.answer(question(k * dt, dt, place, turn, twist, free, response))
        twist = free + dt * (response @ answer[:, :6].ravel()).reshape(twist.shape)
        place = place + dt * twist[:, :3]
        turn = np.array([turned(spin, dt * np.linalg.norm(spin)) @ t if np.linalg.norm(spin) > 1e-12 else t for spin, t in zip(twist[:, 3:], turn)])
        out.append((place.copy(), twist.copy(), answer[:, :6].copy()))
    return out


def the_solver_has_the_robots_inertia():
    """J says the velocity of each node on a sole, and what is after it is A J^T, both against cross products; all blocks of A are random."""
    random, one = np.random.default_rng(3), ground([SQUARE, SQUARE])
    root, had = random.normal(size=(12, 12)), []
    response, place = root @ root.T, np.array([[0.01, 0.1, -0.01], [-0.02, -0.1, -0.02]])
    solver, turns = one.ground.solver, np.stack([turned((1, 2, 3), 0.1), turned((1, -1, 0), 0.05)])
    built = solver._build_collider_rigidity_operator

    def build(state, scratch, volume):
        had.append((*built(state, scratch, volume), scratch.collider_position_field.dof_values.numpy().copy(),
                    solver.collider_body_index.numpy(), scratch.collider_ids.numpy().copy(), volume))
        return had[-1][:2]
    solver._build_collider_rigidity_operator = build
    one.ground.follow((0.0, 0.0))
    one.ground.step(place, turns, np.zeros((2, 6)), response, 0.005)
    velocity_of, back, nodes, bodies, colliders, volume = had[0]
    foot = np.where(colliders >= 0, bodies[np.maximum(colliders, 0)], -1)
    feet = [np.flatnonzero(foot == f) for f in (0, 1)]

    def times(matrix, vector):
        wp = one.ground.wp
        out = wp.zeros(matrix.nrow, dtype=wp.vec3, device="cpu")
        wp.sparse.bsr_mv(matrix, wp.array(vector.astype(np.float32), dtype=wp.vec3, device="cpu"), out)
        return out.numpy()
    twist, impulse = random.normal(size=(4, 3)), random.normal(size=(len(nodes), 3))
    speed, wrench = np.zeros((len(nodes), 3)), np.zeros(12)
    for f, own in enumerate(feet):
        lever = nodes[own] - place[f]
        speed[own] = twist[2 * f] + np.cross(twist[2 * f + 1], lever)
        wrench[6 * f:6 * f + 6] = [*impulse[own].sum(0), *np.cross(lever, impulse[own]).sum(0)]
    changed = volume * (response @ wrench).reshape(4, 3)
    off = np.abs(times(velocity_of, twist) - speed).max() / np.abs(speed).max(), np.abs(times(back, impulse) - changed).max() / np.abs(changed).max()
    print(f"{[len(own) for own in feet]} nodes on two soles: J is off by {off[0]:.1e}, A J^T by {off[1]:.1e}")
    assert min(len(own) for own in feet) >= 4 and max(off) < 1e-5


def new_ground_is_laid_ahead():
    """A print is left behind, and where the window comes again the ground is as at first."""
    one = ground([SQUARE])
    down = np.array([[0, 0, -0.5, 0, 0, 0]])
    one.ground.follow((0.0, 0.0))
    first = one.ground.state.particle_q.numpy().copy()
    for k in range(16):
        one.ground.step(np.array([[0, 0, -0.0025 * k]]), np.eye(3)[None], down, None, 0.005)
    pressed = one.ground.state.particle_q.numpy().copy()
    assert np.abs(pressed - first).max() > 0.01
    assert one.ground.follow((0.12, 0.0))
    moved, size = one.ground.state.particle_q.numpy().copy(), one.ground.window.size()
    anew = (moved != pressed).any(1)
    assert np.isclose(anew.mean(), 2 / 8, atol=0.01) and np.allclose(moved[anew], first[anew] + [size[0], 0, 0], atol=1e-6)
    assert not one.ground.state.particle_qd.numpy()[anew].any()
    one.ground.follow((2.0, 0.0))
    afar = one.ground.state.particle_q.numpy().copy()
    assert np.allclose((afar - first)[:, 1:], 0, atol=1e-6) and (afar[:, 0] > 2.0 - 0.6 * size[0]).all()


def a_light_foot_comes_to_rest_at_its_load():
    """Plates of 0.3 kg with 49 N on them, which forces that come a step late throw off (below), stay and carry it."""
    one, response = ground([SQUARE, SQUARE]), np.diag([1 / 0.3] * 3 + [1 / 0.001] * 3 + [1 / 0.3] * 3 + [1 / 0.001] * 3)
    place, force = np.array([[0, 0.1, 0.0], [0, -0.1, 0.0]]), np.zeros((2, 6))
    force[:, 2] = -49
    rows = go(one, place, force, response, 0.2)
    carried, sunk = np.mean([wrench[:, 2] for _, _, wrench in rows[-10:]], 0), -rows[-1][0][:, 2]
    print(f"plates of 0.3 kg with 49 N carry {carried} N, {1e3 * sunk} mm deep, speed {rows[-1][1][:, 2]} m/s")
    assert np.allclose(carried, 49, rtol=0.01) and (np.abs(rows[-1][1][:, 2]) < 2e-3).all() and ((sunk > 0.004) & (sunk < 0.02)).all()


def two_feet_of_one_body_move_as_one():
    """A = B B^T of a rigid body of 1 kg with both plates on it, loaded off its middle: each plate's twist is that of the body."""
    one, arms = ground([SQUARE, SQUARE]), np.array([[0, 0.1, 0.0], [0, -0.1, 0.0]])
    rows = np.vstack([np.block([[np.eye(3), -np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])], [np.zeros((3, 3)), np.eye(3)]]) for r in arms])
    response = rows @ np.diag([1, 1, 1, 1 / 0.02, 1 / 0.02, 1 / 0.02]) @ rows.T
    force = np.zeros((2, 6))
    force[:, 2] = -60, -30
    out = go(one, arms.copy(), force, response, 0.15)
    body = np.linalg.lstsq(rows, out[-1][1].ravel(), rcond=None)[0]
    apart = np.abs(rows @ body - out[-1][1].ravel()).max()
    carried = np.mean([wrench[:, 2] for _, _, wrench in out[-6:]], 0)
    shaken = np.std([wrench[:, 2] for _, _, wrench in out[-6:]], 0).max()
    print(f"one body on two plates: carried {carried} N, by {shaken:.2f} N from step to step, twists apart by {apart:.1e}")
    assert apart < 1e-9 and abs(carried.sum() / 90 - 1) < 0.03 and carried[0] > 1.3 * carried[1] and shaken < 3


def forces_from_step_to_step_throw_it_off():
    """The plates are led with the velocity that the force of the step before gave them."""
    for mass in (5, 1, 0.3):
        one, place, turn, twist, forces = ground([SQUARE, SQUARE]), np.array([[0, 0.1, 0.0], [0, -0.1, 0.0]]), np.tile(np.eye(3), (2, 1, 1)), np.zeros((2, 6)), []
        one.ground.begin(question(0, 0.005, place, turn, twist, twist, np.eye(12)))
        for _ in range(40):
            wrench = one.ground.step(place, turn, twist, None, 0.005)
            twist[:, 2] += 0.005 * (wrench[:, 2] - 49) / mass
            place = place + 0.005 * twist[:, :3]
            forces.append(wrench[:, 2])
        print(f"led, {mass} kg with 49 N: force {np.mean(forces[-10:]):.0f} +- {np.std(forces[-10:]):.0f} N, up to {np.max(forces):.0f}; at the end "
              f"{1e3 * place[:, 2]} mm")
        assert np.std(forces[-10:]) > 20


def a_fall_is_less_deep_with_shorter_steps():
    """5 kg fall at 1 m/s, free in z, voxels of 15 mm."""
    deepest = []
    for dt in (0.005, 0.0025, 0.00125):
        one = ground([SQUARE], voxel=0.015, window=[0.33, 0.33, 0.12], block=0.03)
        rows = go(one, np.array([[0, 0, 0.001]]), np.array([[0, 0, -49.05, 0, 0, 0]]), np.diag([0.2] * 3 + [0] * 3), 0.14, dt, -1.0)
        deepest.append(-1e3 * min(place[0, 2] for place, _, _ in rows))
        print(f"a fall at 1 m/s with steps of {1e3 * dt} ms: {deepest[-1]:.1f} mm deep, momentum of the first 20 ms "
              f"{dt * sum(wrench[0, 2] for _, _, wrench in rows[:round(0.02 / dt)]):.2f} N s")
    assert deepest[0] > deepest[1] > deepest[2] and deepest[0] - deepest[1] > deepest[1] - deepest[2]


def main():
    mild = sys.argv[1]
    questions_are_read_whole()
    quaternions_are_those_of_the_rotation()
    the_window_goes_with_the_robot()
    soles_are_lost_or_not()
    a_lost_sole_ends_the_ground()
    with tempfile.TemporaryDirectory() as name:
        the_robot_stands_on_springs(mild, pathlib.Path(name))
    try:
        import warp  # noqa: F401
    except ImportError:
        print("newton is not there: its part is left out")
        return
    the_solver_has_the_robots_inertia()
    new_ground_is_laid_ahead()
    a_light_foot_comes_to_rest_at_its_load()
    two_feet_of_one_body_move_as_one()
    if sys.argv[2:] != ["newton"]:
        return
    forces_from_step_to_step_throw_it_off()
    a_fall_is_less_deep_with_shorter_steps()


if __name__ == "__main__":
    springs(*sys.argv[2:]) if sys.argv[1] == "springs" else main()
