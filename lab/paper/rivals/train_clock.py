#!/usr/bin/env python3
"""Trains the rival controller "Clock" (Singh et al. 2024, Robust Humanoid Walking on Compliant and Uneven Terrain with Deep
Reinforcement Learning): two layers of 256 ReLU that see one frame with the gait clock, 40 Hz, smoothed actions, a mirror loss, rigid
contact whose time constant is drawn. Task, rewards and commands are those of configs/walk.ini.

  cmake -S . -B build -DMILD_CUDA=ON && cmake --build build --target _envs mild
  lab/paper/rivals/train_clock.py --out runs/clock
  build/mild eval --controller clock --policy runs/clock/clock.safetensors --config configs/walk.ini --ground rigid --speed 0.6
"""
import time

import torch
from torch import nn

import files
import ppo
import run

HOLD = (2, 3)  # policy periods of 10 ms that decisions last in turn: 40 Hz
SMOOTHING = 0.5  # share of the new action
MIRROR_WEIGHT, MIRROR_SHARE = 1.0, 0.25
FORWARD = {"task__vx": [0, 1.5], "task__vy": [0, 0]}  # commands
# [s] solref of the rigid contact, which sinks by up to 80 mm under the robot at 0.4
STIFFER, COMPLIANT = {"randomize__rigid_time": [0.02, 0.1]}, {"randomize__rigid_time": [0.02, 0.4]}
# (share of the run at which it ends, keys): a gait, softer and softer ground, then the whole task on uneven ground
PHASES = (
    (0.25, {**FORWARD, **run.GAIT, "reward__tracking_sharpness": 3}),
    (0.35, {**FORWARD, **run.GAIT, **STIFFER}),
    (0.50, {**FORWARD, **run.GAIT, **COMPLIANT}),
    (1.00, {**FORWARD, **COMPLIANT, "task__assist": 0}),
)
SETTINGS = ppo.Settings(steps=24, gamma=0.99, decay=0.95, std=0.6, std_min=0.25, rate_max=2e-3, kl_target=0.015)


def make_actor(observation, actions):
    actor = ppo.mlp([observation, 256, 256, actions], nn.ReLU)
    with torch.no_grad():
        actor[-1].weight.mul_(0.1)
    return actor


class Clock:
    def __init__(self, envs, device, settings):
        shape = envs.shape
        self.actor = make_actor(shape.observation, shape.actions).to(device)
        self.critic = ppo.make_critic(shape.critic).to(device)
        self.ppo = ppo.Ppo(self.actor, self.critic, shape.actions, settings, device)
        self.rollout = ppo.Rollout(SETTINGS.steps, shape.envs, shape.actions, shape.critic, device)
        self.frame = torch.zeros(SETTINGS.steps, shape.envs, shape.observation, device=device)
        self.mirror_frame, self.mirror_action = envs.mirror()

    def begin(self, envs):
        """In environments that were opened anew."""
        self.envs = envs
        envs.reset()
        self.held = torch.zeros(envs.shape.envs, envs.shape.actions, device=envs.device)

    def hold(self, k):
        """A decision lasts HOLD periods; what is left of it when an episode ends, the new one stands in the default pose."""
        envs, r = self.envs, self.rollout
        alive = torch.ones_like(envs.reward)
        for rows in (r.reward, r.done, r.timeout):
            rows[k] = 0
        r.valid[k] = 1
        for _ in range(HOLD[k % 2]):
            envs.step(self.held)
            valid, done = envs.valid.float(), envs.done.float()
            r.reward[k] += alive * torch.where(envs.valid > 0, envs.reward, 0)
            r.timeout[k] += alive * envs.timeout
            r.valid[k] *= 1 - alive * (1 - valid)
            alive = alive * (1 - done)
            self.held = self.held * (1 - done[:, None])
        r.done[k] = 1 - alive

    @torch.no_grad()
    def roll_out(self):
        r = self.rollout
        for k in range(SETTINGS.steps):
            self.frame[k], r.critic[k] = self.envs.frame, self.envs.critic
            r.mean[k] = self.actor(self.frame[k])
            r.action[k], r.log_prob[k] = self.ppo.sample(r.mean[k])
            self.held = SMOOTHING * r.action[k] + (1 - SMOOTHING) * self.held
            self.hold(k)
        r.critic[-1] = self.envs.critic

    def update(self):
        frame = self.frame.flatten(0, 1)
        (oi, os), (ai, signs) = self.mirror_frame, self.mirror_action

        def mirror(rows, mean):
            part = rows[: int(MIRROR_SHARE * len(rows))]
            image = self.actor(frame[part][:, oi] * os)[:, ai] * signs
            return MIRROR_WEIGHT * nn.functional.mse_loss(mean[: len(part)], image)

        return self.ppo.update(self.rollout, lambda rows: self.actor(frame[rows]), mirror)

    def save(self, path, note):
        tensors = {f"actor.{name}": weight for name, weight in self.ppo.mean_weights.items()}
        files.write(path, tensors, {"kind": "mild clock", "version": "1", "robot": "sa01", "note": note})


def train(arguments):
    device = run.begin(arguments)
    clock, progress, steps = None, run.Progress(arguments), arguments.envs * sum(HOLD) * SETTINGS.steps // 2
    path = arguments.out / "clock.safetensors"
    for end, keys in ((1.0, {}),) if arguments.model else PHASES[-1:] if arguments.go_on else PHASES:
        envs = run.open_envs(arguments, keys)
        clock = clock or Clock(envs, device, run.tuned(arguments, SETTINGS))
        if arguments.go_on:
            clock.ppo.load(arguments.go_on)
        clock.begin(envs)
        while progress.share() < end:
            clock.ppo.anneal(progress.share())
            begin = time.time()
            clock.roll_out()
            envs.wait()
            rollout = time.time() - begin
            report = clock.update()
            if progress.log({**envs.statistics(), **report, "rollout_s": rollout}, steps):
                clock.save(path, f"lab/paper/rivals/train_clock.py, iteration {progress.iteration}")
                clock.ppo.save(arguments.out / "state.pt")
        print(f"phase up to {end:g} of the run is over", flush=True)
        envs.close()
    clock.save(path, f"lab/paper/rivals/train_clock.py, {progress.iteration} iterations of {steps} steps")


if __name__ == "__main__":
    parser = run.options(__doc__, 8)
    parser.set_defaults(envs=2048)
    train(parser.parse_args())
