"""A search for the numbers of a gait (gait.py) in plan.json, without the planner: a cross-entropy search over bend, speed gain, period, sway,
lean and the answers to errors, hundreds of candidates at once, each from several starts and on several grounds. Prints the best so far as
JSON.

    python examples/python/plan/gait_search.py --robot sa01 --device cuda --candidates 2048 --minutes 5"""
import argparse
import json
import pathlib
import time

import numpy as np

import plan
from gait import Gait, joint_angles, robot_ini

HERE = pathlib.Path(__file__).resolve().parent
ERRORS = ("vx", "vy", "wx", "wy", "wz", "gx", "gy")
ROWS = [0, 1, 2, 3, 4, 8, 9]  # of Gait.matrix


def places(gait):
    """(path, low, high) of the numbers that are searched; joints by the ends of their names."""
    found = [(("bend",), 0.05, 2.2), (("speed_gain",), -0.5, 2), (("period",), 0.3, 1.2)]
    found += [(("lean", joint), -0.5, 0.9) for joint in gait["lean"]]
    found += [(("sway", joint, k), -0.5, 0.5) for joint, waves in gait["sway"].items() for k in range(len(waves))]
    for kind in ("posture", "step"):
        for error, joints in gait[kind].items():
            reach = 10 if error[0] == "g" else 1.5
            found += [((kind, error, joint), -reach, reach) for joint in joints]
    return found


def lookup(node, path):
    for part in path:
        node = node[part]
    return node


def put(gait, where, point):
    gait = json.loads(json.dumps(gait))
    for (path, low, high), value in zip(where, point):
        lookup(gait, path[:-1])[path[-1]] = float(f"{np.clip(value, low, high):.4g}")
    return gait


class Walks:
    """Candidates on one ground, from `starts` starts each."""

    def __init__(self, given, numbers, ground):
        self.a = plan.Arrays(given.device)
        keys = {**plan.KEYS, **numbers["keys"], "task.vx": (given.speed, given.speed), **plan.ground_keys(ground)}
        first = plan.Robots(self.a, given.starts, given.robot, keys, given.device, given.seed, given.threads)
        blocks = self.a.zeros(given.starts, first.envs.block_bytes, dtype="uint8")
        first.envs.save(blocks, stream=self.a.stream())
        self.given, self.ground, self.blocks, self.first = given, ground, blocks, first
        self.robots = plan.Robots(self.a, given.starts * given.candidates, given.robot, keys, given.device, given.seed, given.threads)
        clock = np.array(self.a.host(first.frame))[:, -2:]
        self.phase = np.arctan2(clock[:, 0], clock[:, 1]) / (2 * np.pi)

    def rows(self, made):
        """What differs from candidate to candidate, [candidates, ...]."""
        of = self.a.of
        return made[0], {"bend": of([g.bend for g in made]), "stride": of([g.stride for g in made]), "period": of([g.period for g in made]),
                         "sway": of([g.sway for g in made]), "lean": of([g.lean for g in made]),
                         "feedback": of([np.hstack(g.feedback) for g in made])}

    def run(self, made):
        """Scores [candidates], and of the best: upright [s], forward [m], side [m]."""
        given, a, xp, robots = self.given, self.a, self.a.xp, self.robots
        base, c = self.rows(made)
        starts, count, joints = given.starts, given.candidates, len(base.joints)
        grow = lambda x: a.of(x)[:, None]
        robots.envs.fork(self.blocks, stream=a.stream())
        origin = robots.read() + 0.0
        yaw = plan.yaw_of(xp, origin)
        zero = a.zeros(starts, count)
        alive, upright, forward, side, turned = zero + 1, zero + 0, zero + 0, zero + 0, zero + 0
        legs = {name: value if name == "leg" else a.of(value) for name, value in base.legs.items()}
        wanted = a.of([given.speed, 0])
        for t in range(round(given.seconds / plan.PERIOD)):
            phase = grow(self.phase) + t * plan.PERIOD / c["period"][None]
            angle, swings = joint_angles(xp, legs, phase, c["bend"], c["stride"], c["lean"], [c["sway"][:, k] for k in range(len(base.sway))])
            if t == 0:
                velocity, frame = self.first.estimate[:, None, :2], self.first.frame[:, None, :9]
                velocity, frame = velocity + zero[:, :, None], frame + zero[:, :, None]
            else:
                velocity, frame = robots.estimate.reshape(starts, count, -1)[:, :, :2], robots.frame.reshape(starts, count, -1)[:, :, :9]
            answer = xp.einsum("bcf,cfj->bcj", velocity - wanted, c["feedback"][:, :2]) + xp.einsum("bcf,cfj->bcj", frame, c["feedback"][:, 2:])
            action = angle / base.scale + answer[:, :, :joints] + answer[:, :, joints:] * swings
            robots.step(a.of(np.clip(action, -8, 8)).reshape(-1, joints) if not a.gpu else xp.clamp(action, -8, 8).reshape(-1, joints).contiguous())
            alive = alive * (robots.done == 0).reshape(starts, count)
            qpos = robots.read()
            x, y = qpos[:, 0] - origin[:, 0], qpos[:, 1] - origin[:, 1]
            turn = plan.yaw_of(xp, qpos) - yaw
            turn = turn - 2 * np.pi * xp.floor(turn / (2 * np.pi) + 0.5)
            upright = upright + alive * plan.PERIOD
            stays = alive > 0
            forward = xp.where(stays, (x * xp.cos(yaw) + y * xp.sin(yaw)).reshape(starts, count), forward)
            side = xp.where(stays, (y * xp.cos(yaw) - x * xp.sin(yaw)).reshape(starts, count), side)
            turned = xp.where(stays, turn.reshape(starts, count), turned)
        upright, forward, side, turned = (np.array(a.host(v), np.float64) for v in (upright, forward, side, turned))
        lived = np.maximum(upright, 0.3)
        slow = np.minimum(1, abs(forward - given.speed * lived) / (given.speed * lived))
        share = upright / given.seconds
        score = share * (1 - 0.7 * slow - 0.1 * np.minimum(1, abs(turned)) - 0.1 * np.minimum(1, abs(side)))
        return score.mean(0), upright.mean(0), forward.mean(0), abs(side).mean(0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default, words in (
            ("robot", "sa01", ""), ("grounds", "rigid,foam45,sand_loose", "of each candidate"), ("speed", 0.5, "[m/s]"), ("seconds", 4.0, "of a walk"),
            ("candidates", 512, "at once"), ("starts", 4, "of each"), ("minutes", 5.0, ""), ("seed", 1, ""), ("device", "cpu", ""), ("threads", 0, ""),
            ("width", 0.1, "of the first candidates, of the range"), ("numbers", str(HERE / "plan.json"), ""), ("out", "", "a file like plan.json, with the best gait")):
        parser.add_argument("--" + name, type=type(default), default=default, help=words)
    given = parser.parse_args()
    end = time.time() + 60 * given.minutes
    everything = json.loads(pathlib.Path(given.numbers).read_text())
    if given.robot not in everything:
        parser.error(f"--robot {given.robot}: {given.numbers} has {', '.join(everything)}")
    numbers = everything[given.robot]
    where = places(numbers["gait"])
    mean, reach = np.array([lookup(numbers["gait"], path) for path, _, _ in where], float), np.array([high - low for _, low, high in where])
    low, high = (np.array([row[k] for row in where]) for k in (1, 2))
    width, random, best = given.width * reach, np.random.default_rng(given.seed), -1.0
    walks = [Walks(given, numbers, ground) for ground in given.grounds.split(",")]
    print(f"{len(where)} numbers, {given.candidates} candidates, {given.starts} starts", flush=True)
    generation, top, ini = 0, None, robot_ini(walks[0].robots.envs.model)
    while time.time() < end:
        before = time.time()
        points = np.clip(mean + width * random.standard_normal((given.candidates, len(mean))), low, high)
        points[0] = mean
        if top is not None:
            points[1] = top
        gaits = [put(numbers["gait"], where, point) for point in points]
        made = [Gait(ini, gait, given.speed) for gait in gaits]
        found = [walk.run(made) for walk in walks]
        score = np.mean([f[0] for f in found], 0)
        order = np.argsort(-score)
        elite = points[order[:max(4, given.candidates // 16)]]
        text = "; ".join(f"{walk.ground} {f[1][order[0]]:.2f} s {f[2][order[0]]:.2f} m {f[3][order[0]]:.2f} m" for walk, f in zip(walks, found))
        print(f"{generation}: best {score[order[0]]:.4f}, mean's {score[0]:.4f}, elite {score[order[:len(elite)]].mean():.4f}; {text}; "
              f"{time.time() - before:.1f} s", flush=True)
        if score[order[0]] > best:
            best, top = score[order[0]], points[order[0]]
            print("BEST " + json.dumps({"robot": given.robot, "score": round(float(best), 4), "gait": gaits[order[0]]}), flush=True)
            if given.out:
                all_with = {**everything, given.robot: {**numbers, "gait": gaits[order[0]]}}
                pathlib.Path(given.out).write_text(json.dumps(all_with, indent=1) + "\n")
        mean = 0.3 * mean + 0.7 * elite.mean(0)
        width = 0.5 * width + 0.5 * (elite.std(0) + 0.005 * reach)
        generation += 1
    print("RESULT " + json.dumps({"robot": given.robot, "score": round(float(best), 4),
                                  "gait": put(numbers["gait"], where, top), "mean": put(numbers["gait"], where, mean)}), flush=True)


if __name__ == "__main__":
    main()
