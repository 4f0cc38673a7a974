#!/usr/bin/env python3
"""What contact costs in a step of mjlab's velocity task: rigid, the batch ground of mild.mjlab, and none.

usage: mjlab_time.py [Go1|G1] [--policy MODEL.pt] [--envs 4096] [--steps 100] [--rounds 3]

Needs mjlab, mild with CUDA, and an NVIDIA GPU. The three have the same task and policy and take turns; of each turn the mean time of
a step of the environment (rollout: policy, 4 steps of physics, rewards, resets) and of one step of physics alone is printed. Without
contact, feet and calves pass through the floor as with the batch ground, and there is no gravity, so that nothing else touches it."""
import argparse
import contextlib
import dataclasses
import io
import statistics
import time

import torch
import warp as wp
from mjlab.envs import ManagerBasedRlEnv
from mjlab.rl import RslRlVecEnvWrapper
from mjlab.tasks.registry import load_env_cfg, load_rl_cfg, load_runner_cls

from mild.mjlab import config_of


def clock(function, count, device):
    """Mean time of a call [ms]."""
    wait = torch.cuda.synchronize if "cuda" in device else lambda: None
    wait()
    begin = time.perf_counter()
    for _ in range(count):
        function()
    wait()
    return 1e3 * (time.perf_counter() - begin) / count


def task_of(robot):
    return f"Mjlab-Velocity-Flat-Unitree-{robot}"


class Case:
    def __init__(self, name, given):
        config = load_env_cfg(task_of(given.robot)) if name == "rigid" else config_of(given.robot)
        config.scene.num_envs = given.envs
        if name == "none":
            del config.events["ground"]
        self.name, self.env = name, ManagerBasedRlEnv(config, given.device)
        if name == "none":
            wp.to_torch(self.env.sim.wp_model.opt.gravity).zero_()
        self.wrapped = RslRlVecEnvWrapper(self.env)
        agent = dataclasses.asdict(load_rl_cfg(task_of(given.robot))) | {"logger": "tensorboard"}
        runner = load_runner_cls(task_of(given.robot))(self.wrapped, agent, None, given.device)
        if given.policy:
            runner.load(given.policy)
        self.policy, self.observations = runner.get_inference_policy(given.device), self.wrapped.get_observations()
        self.whole, self.physics, self.contacts, self.ended = [], [], 0, 0

    def step(self):
        self.observations, _, done, _ = self.wrapped.step(self.policy(self.observations))
        self.ended += done.float().mean()

    def turn(self, steps, device):
        """A rollout, and then as many steps of physics under the last actions."""
        self.ended = 0
        self.whole.append(clock(self.step, steps, device))
        state = [wp.clone(a) for a in (self.env.sim.wp_data.qpos, self.env.sim.wp_data.qvel)]
        self.physics.append(clock(self.env.sim.step, 20, device))
        wp.copy(self.env.sim.wp_data.qpos, state[0]), wp.copy(self.env.sim.wp_data.qvel, state[1])
        self.contacts = wp.to_torch(self.env.sim.wp_data.nefc).float().mean().item()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robot", nargs="?", default="Go1")
    parser.add_argument("--policy", help="a model_N.pt of mjlab_soft.py")
    parser.add_argument("--envs", type=int, default=4096)
    parser.add_argument("--steps", type=int, default=100)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--device", default="cuda:0" if torch.cuda.is_available() else "cpu")
    given = parser.parse_args()
    task = f"Mjlab-Velocity-Soft-Unitree-{given.robot}"
    with contextlib.redirect_stdout(io.StringIO()):
        cases = [Case(name, given) for name in ("rigid", "soft", "none")]
    with torch.inference_mode():
        for case in cases:  # warms up; robots are on their way then
            clock(case.step, given.steps, given.device)
        for _ in range(given.rounds):
            for case in cases:
                case.turn(given.steps, given.device)
                print(f"{case.name:>5s}: step of the environment {case.whole[-1]:.3f} ms, of physics {case.physics[-1]:.3f} ms, "
                      f"{case.contacts:.1f} constraints a robot, {100 * float(case.ended) / given.steps:.2f} % of steps end an episode",
                      flush=True)
    rigid, soft, none = (
        [statistics.median(times) for times in (case.whole, case.physics)] for case in cases)
    for name, index in (("environment", 0), ("physics", 1)):
        print(f"{given.robot}, {given.envs} robots, step of the {name}: rigid contact costs {rigid[index] - none[index]:.3f} ms, "
              f"the batch ground {soft[index] - none[index]:.3f} ms, of {none[index]:.3f} ms without (medians of {given.rounds})")
