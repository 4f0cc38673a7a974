"""Runs policies/mild.safetensors from its file alone (docs/policy.md). Needs numpy."""
import json

import numpy as np

POSE = np.array([0, 0, -0.24, 0.48, -0.24, 0] * 2)  # [rad] default pose of SA01, joints as in the table


def read(path):
    """The tensors of a policy's file by name, and the keys of the task that it was trained for, with its `robot`."""
    raw = open(path, "rb").read()
    end = 8 + int.from_bytes(raw[:8], "little")
    header = json.loads(raw[8:end])
    about = header.pop("__metadata__")
    task = dict(key.split(" = ") for key in about["task"].split("; ")) if about.get("task") else {}
    return {k: np.frombuffer(raw[end + v["data_offsets"][0] : end + v["data_offsets"][1]],
                             {"F32": "<f4", "F16": "<f2"}[v["dtype"]]).astype(np.float32)
            .reshape(v["shape"]) for k, v in header.items()}, {**task, "robot": about.get("robot", "sa01")}


class Policy:
    def __init__(self, path, pose=POSE):
        (self.tensors, task), self.pose = read(path), pose
        self.stride, self.clip = int(task.get("history_stride", 8)), float(task.get("action_clip", 8))
        self.period, self.slowing = float(task.get("gait_period", 0.8)), float(task.get("gait_slowing", 0))
        self.slow_below = float(task.get("gait_slow_below", 1.2))
        self.frames = None  # the last 5 * stride frames, oldest first; none before the first
        self.phase, self.last = 0.0, np.zeros(12)

    def observe(self, omega, gravity, command, q, qd):
        """The frame [47] of readings in SI units; gravity: unit vector, base frame."""
        stand = np.all(np.abs(command) < 0.1)
        turn = 2 * np.pi * self.phase
        clock = [0, 0] if stand else [np.sin(turn), np.cos(turn)]
        return np.concatenate([omega, np.multiply(command, [2, 2, 1]), gravity,
                               q - self.pose, 0.05 * qd, self.last, clock])

    def network(self, name, x):
        layers = sorted({int(k.split(".")[1]) for k in self.tensors if k.startswith(name + ".")})
        for i in layers:
            x = self.tensors[f"{name}.{i}.weight"] @ x + self.tensors[f"{name}.{i}.bias"]
            x = x if i == layers[-1] else np.where(x > 0, x, np.expm1(np.minimum(x, 0)))  # ELU
        return x

    def act(self, frame):
        """The action [12] for the newest frame; 10 ms later comes the next one."""
        if self.frames is None:
            self.frames = np.tile(frame, (5 * self.stride, 1))
        means = self.frames.reshape(5, self.stride, -1).mean(axis=1)
        heads = self.network("encoder", np.concatenate([means.ravel(), frame]))
        n = 2 * (self.tensors["actor.0.weight"].shape[1] - len(frame)) - len(heads)
        estimates, mu = heads[:n], heads[n : (n + len(heads)) // 2]  # the rest: log variance, unused
        seen = np.concatenate([estimates[3:], frame[-2:]])  # feet's velocities, heights and the clock: the first or all
        theta = self.network("modulation", seen[: self.tensors["modulation.0.weight"].shape[1]])
        half = len(theta) // 2
        z = theta[:half] * mu + theta[half:]
        action = self.network("actor", np.concatenate([frame, estimates, z]))
        self.last = np.clip(action, -self.clip, self.clip)
        self.frames = np.vstack([self.frames[1:], frame])
        slow = max(0, 1 - np.abs(frame[3:6]) @ [0.5, 1.5, 1] / self.slow_below)  # the clock slows with the command
        self.phase = (self.phase + 0.01 / (self.period * (1 + self.slowing * slow))) % 1
        return self.last  # the joints' targets are POSE + 0.5 * action
