"""What is below a plan: a gait, joint targets by a clock that answer tilt and speed, with numbers in plan.json that gait_search.py finds; or a
learned policy."""
import configparser
import math
import pathlib
import sys

import numpy as np


def robot_ini(model):
    ini = configparser.ConfigParser(inline_comment_prefixes=";")
    ini.read(pathlib.Path(model).with_name("robot.ini"))
    return ini


def joint_angles(xp, legs, phase, bend, stride, lean, sway):
    """[..., joints] rad for the clock [...], and 1 for the joints of a swing leg, 0 for others: a swing leg bends, a standing one sweeps
    back by `stride` [m a period], and both lean and sway. legs: what `leg`, `offset`, `swing` and `sweep` say of the joints; bend, stride:
    [...]; lean: [..., joints]; sway: waves [..., joints] of sin and cos of the leg's clock, of twice it, and so on."""
    since = phase[..., None] - legs["offset"]
    since = since - xp.floor(since)
    swings, s = (since >= 0.5) * 1.0, 2 * since - xp.floor(2 * since)
    up = swings * xp.sin(math.pi * s) ** 2
    ahead = 0.5 * stride[..., None] * (swings * (-0.5 * xp.cos(math.pi * s)) + (1 - swings) * (0.5 - s))  # [m] of the foot, of the hip
    since, swings, up, ahead = (x[..., legs["leg"]] for x in (since, swings, up, ahead))
    angle = bend[..., None] * legs["swing"] * up + legs["sweep"] * ahead + lean
    for k, wave in enumerate(sway):
        angle = angle + wave * (xp.sin, xp.cos)[k % 2](2 * math.pi * (k // 2 + 1) * since)
    return angle, swings


class Gait:
    """Numbers of plan.json for a robot at a speed. Joints are named by the ends of their names; what a number does to a leg it does to the
    other one the other way round, if it is its mirror image. The errors of `posture` [rad per unit] are followed by all legs, those of
    `step` by a swing leg."""

    def __init__(self, ini, numbers, speed):
        self.joints = joints = ini["joints"]["names"].split()
        feet = [float(ini[section]["offset"]) for section in ini.sections() if section.startswith("foot.")]
        self.scale = float(ini["robot"]["action_scale"])
        self.legs = {"leg": list(np.arange(len(joints)) * len(feet) // len(joints)), "offset": np.array(feet),
                     "swing": np.array([float(x) for x in ini["joints"]["swing"].split()]), "sweep": self.by_name(joints, numbers["sweep"])}
        mirror = [joints.index(name) < i for i, name in enumerate(ini["joints"]["mirror"].split())]
        side = np.where(mirror, np.array(ini["joints"]["mirror_sign"].split(), float), 1)
        waves = max(map(len, numbers["sway"].values()), default=0)
        self.lean = side * self.by_name(joints, numbers["lean"])
        self.sway = side * self.by_name(joints, numbers["sway"], [0.0] * waves).T
        self.period, self.asked = numbers["period"], speed
        self.stride = self.period * speed * numbers["speed_gain"]
        self.feedback = [self.matrix(numbers[name]) for name in ("posture", "step")]
        self.bend = numbers["bend"]

    @staticmethod
    def by_name(joints, numbers, none=0.0):
        return np.array([next((value for end, value in numbers.items() if joint.endswith(end)), none) for joint in joints])

    def matrix(self, numbers):
        """[11, joints]: what the joints' targets get of a robot's errors: see Planner.follow."""
        return np.array([self.by_name(self.joints, numbers.get(name, {})) for name in
                         ("vx", "vy", "wx", "wy", "wz", "", "", "", "gx", "gy", "")]) / self.scale

    def actions(self, phase):
        """[..., joints] in units of the action for the clock [...], and 1 for joints of a swing leg. Below 0.1 m/s it stands
        (task.standing_below)."""
        moves = abs(self.asked) >= 0.1
        angle, swings = joint_angles(np, self.legs, np.asarray(phase), np.float64(moves * self.bend), np.float64(self.stride), self.lean,
                                     self.sway if moves else [])
        return angle / self.scale, swings * moves


class Policy:
    """A learned policy (docs/policy.md), whose actions plans then are offsets from."""

    def __init__(self, arrays, path, robot):
        sys.path.append(str(pathlib.Path(__file__).resolve().parents[1]))
        import policy
        try:
            tensors, self.task = policy.read(path)
        except (KeyError, ValueError) as error:
            raise ValueError(f"{path} is no policy, or cut short") from error
        if self.task.pop("robot") != robot:
            raise ValueError(f"{path} is not a policy of {robot}")
        self.xp, self.tensors = arrays.xp, {name: arrays.of(values) for name, values in tensors.items()}
        self.keys = {f"task.{key}": value for key, value in self.task.items() if key != "velocity_scale"}

    def network(self, name, x):
        layers = sorted(int(key.split(".")[1]) for key in self.tensors if key.startswith(name) and key.endswith("weight"))
        for i in layers:
            x = x @ self.tensors[f"{name}.{i}.weight"].T + self.tensors[f"{name}.{i}.bias"]
            x = x if i == layers[-1] else self.xp.where(x > 0, x, self.xp.exp(self.xp.clip(x, None, 0)) - 1)
        return x

    def act(self, history):
        frame, heads = history[:, -1], self.network("encoder", history.reshape(len(history), -1))
        n = 2 * (self.tensors["actor.0.weight"].shape[1] - frame.shape[1]) - heads.shape[1]
        seen = self.xp.concatenate([heads[:, 3:n], frame[:, -2:]], 1)
        theta = self.network("modulation", seen[:, : self.tensors["modulation.0.weight"].shape[1]])
        half = theta.shape[1] // 2
        z = theta[:, :half] * heads[:, n : (n + heads.shape[1]) // 2] + theta[:, half:]
        return self.network("actor", self.xp.concatenate([frame, heads[:, :n], z], 1))
