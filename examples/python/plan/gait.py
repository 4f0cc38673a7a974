"""The gait below a plan, and a search for its numbers in plan.json by itself, without the planner: a cross-entropy search over bend, speed
gain, period, sway, lean and the answers to errors, hundreds of candidates at once, each from several starts and on several grounds. Prints
the best so far as JSON.

    python examples/python/plan/gait.py --robot sa01 --device cuda --candidates 2048 --minutes 5"""
import argparse
import configparser
import json
import pathlib
import sys
import time

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))


def robot_ini(model):
    ini = configparser.ConfigParser(inline_comment_prefixes=";")
    ini.read(pathlib.Path(model).with_name("robot.ini"))
    return ini


class Gait:
    """Joint targets by clock and posture, in units of the action: a swing leg bends, a standing one sweeps back at the asked speed, both
    lean and sway (rad; sin, cos of the leg's clock, of twice it, ...; the mirrored leg the other way round) and follow the errors of
    `posture` [rad per unit], a swing leg those of `step` besides."""

    def __init__(self, ini, numbers, speed):
        self.joints = joints = ini["joints"]["names"].split()
        feet = [float(ini[section]["offset"]) for section in ini.sections() if section.startswith("foot.")]
        self.scale, self.offset = float(ini["robot"]["action_scale"]), np.array(feet)
        self.leg = np.arange(len(joints)) * len(feet) // len(joints)
        self.swing = np.array([float(x) for x in ini["joints"]["swing"].split()])
        mirror = [joints.index(name) < i for i, name in enumerate(ini["joints"]["mirror"].split())]
        side = np.where(mirror, np.array(ini["joints"]["mirror_sign"].split(), float), 1)
        self.sweep, self.lean = self.by_name(joints, numbers["sweep"]), side * self.by_name(joints, numbers["lean"])
        self.sway = side * self.by_name(joints, numbers["sway"], [0.0] * max(map(len, numbers["sway"].values()), default=2)).T
        self.period, self.asked, self.speed = numbers["period"], speed, speed * numbers["speed_gain"]
        self.feedback = [self.matrix(numbers[name]) for name in ("posture", "step")]
        self.bend = numbers["bend"] if abs(speed) >= 0.1 else 0  # below it stands: task.standing_below

    @staticmethod
    def by_name(joints, numbers, none=0.0):
        return np.array([next((value for end, value in numbers.items() if joint.endswith(end)), none) for joint in joints])

    def matrix(self, numbers):
        """[11, joints]: what the joints' targets get of a robot's errors: see Planner.follow."""
        return np.array([self.by_name(self.joints, numbers.get(name, {})) for name in
                         ("vx", "vy", "wx", "wy", "wz", "", "", "", "gx", "gy", "")]) / self.scale

    def actions(self, phase):
        """[..., joints] for the clock [...], and whether the joint is of a swing leg."""
        since = (np.asarray(phase)[..., None] - self.offset) % 1
        swings, s = since >= 0.5, 2 * since % 1
        bend = np.where(swings, np.sin(np.pi * s) ** 2, 0)
        ahead = 0.5 * self.period * self.speed * np.where(swings, -0.5 * np.cos(np.pi * s), 0.5 - s)  # [m] of the foot, of the hip
        sway = sum(self.sway[k] * (np.cos, np.sin)[k % 2 == 0](2 * np.pi * (k // 2 + 1) * since[..., self.leg]) for k in range(len(self.sway)))
        angle = self.bend * self.swing * bend[..., self.leg] + self.sweep * ahead[..., self.leg] + sway * (self.bend > 0) + self.lean
        return angle / self.scale, swings[..., self.leg] * (self.bend > 0)


import plan  # noqa: E402: it needs the class above

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
        return made[0], {"bend": of([g.bend for g in made]), "speed": of([g.speed for g in made]), "period": of([g.period for g in made]),
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
        offset, swing, sweep = a.of(base.offset), a.of(base.swing), a.of(base.sweep)
        leg = list(base.leg)
        wanted = a.of([given.speed, 0])
        for t in range(round(given.seconds / plan.PERIOD)):
            phase = grow(self.phase) + t * plan.PERIOD / c["period"][None]
            since = phase[:, :, None] - offset
            since = since - xp.floor(since)
            swings = (since >= 0.5) * (a.zeros(1) + 1)
            s = 2 * since - xp.floor(2 * since)
            up = swings * xp.sin(np.pi * s) ** 2
            ahead = swings * (-0.5 * xp.cos(np.pi * s)) + (1 - swings) * (0.5 - s)
            ahead = ahead * (0.5 * c["period"] * c["speed"])[None, :, None]
            target = c["bend"][None, :, None] * up[:, :, leg] * swing + ahead[:, :, leg] * sweep + c["lean"][None]
            for k in range(len(base.sway)):
                wave = (xp.cos, xp.sin)[k % 2 == 0](2 * np.pi * (k // 2 + 1) * since)
                target = target + c["sway"][None, :, k] * wave[:, :, leg]
            target = target / base.scale
            if t == 0:
                velocity, frame = self.first.estimate[:, None, :2], self.first.frame[:, None, :9]
                velocity, frame = velocity + zero[:, :, None], frame + zero[:, :, None]
            else:
                velocity, frame = robots.estimate.reshape(starts, count, -1)[:, :, :2], robots.frame.reshape(starts, count, -1)[:, :, :9]
            answer = xp.einsum("bcf,cfj->bcj", velocity - wanted, c["feedback"][:, :2]) + xp.einsum("bcf,cfj->bcj", frame, c["feedback"][:, 2:])
            action = target + answer[:, :, :joints] + answer[:, :, joints:] * swings[:, :, leg]
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
    numbers = everything[given.robot]
    where = places(numbers["gait"])
    mean, reach = np.array([lookup(numbers["gait"], path) for path, _, _ in where], float), np.array([high - low for _, low, high in where])
    low, high = (np.array([row[k] for row in where]) for k in (1, 2))
    width, random, best = given.width * reach, np.random.default_rng(given.seed), -1.0
    walks = [Walks(given, numbers, ground) for ground in given.grounds.split(",")]
    print(f"{len(where)} numbers, {given.candidates} candidates, {given.starts} starts", flush=True)
    generation, top, ini = 0, None, plan.robot_ini(walks[0].robots.envs.model)
    while time.time() < end:
        before = time.time()
        points = np.clip(mean + width * random.standard_normal((given.candidates, len(mean))), low, high)
        points[0] = mean
        if top is not None:
            points[1] = top
        gaits = [put(numbers["gait"], where, point) for point in points]
        made = [plan.Gait(ini, gait, given.speed) for gait in gaits]
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
