#!/usr/bin/env python3
"""Trains a plain network that sees the whole history by PPO (ppo.py) on the task of configs/quick.ini as it is, with quick.ini's numbers of
the learner. What samples.py compares are its options.

  scripts/rivals/train_walk.py --out runs/walk --iterations 260
  build/mild eval --policy runs/walk/last.safetensors
"""
import dataclasses
import math
import time

import torch
from torch import nn

import ppo
import run
import walker

MIRROR_WEIGHT = 1.0
HIDDEN = (512, 256, 128)
SETTINGS = ppo.Settings(steps=12, gamma=0.994, decay=0.95, std=0.6, std_min=0.05, rate_max=2e-3, kl_target=0.015, end=0.3, optimizer="muon")


class Walk:
    def __init__(self, envs, settings, share, symmetric):
        """share: of each minibatch with a mirror loss. symmetric: bool, actor and critic are symmetric by construction."""
        shape, device = envs.shape, envs.device
        self.envs, self.settings, self.share = envs, settings, share
        (index, sign), action = envs.mirror()
        frame = walker.Mirror(index, sign)
        self.mirror_history, self.mirror_action = frame.repeat(shape.frames), walker.Mirror(*action)
        actor = ppo.mlp([shape.frames * shape.observation, *HIDDEN, shape.actions], nn.ELU).to(device)
        with torch.no_grad():
            actor[-1].weight.mul_(0.1)
        critic = ppo.make_critic(shape.critic).to(device)
        if symmetric:
            actor = walker.Symmetric(actor, self.mirror_history, self.mirror_action)
            critic = walker.Symmetric(critic, walker.critic_mirror(frame, device))
        self.actor = actor
        self.ppo = ppo.Ppo(actor, critic, shape.actions, settings, device)
        self.rollout = ppo.Rollout(settings.steps, shape.envs, shape.actions, shape.critic, device)
        self.history = torch.zeros(settings.steps, shape.envs, shape.frames * shape.observation, device=device)
        envs.reset()

    @torch.no_grad()
    def roll_out(self, share):
        """share: of the run that is over. The noise is bounded between updates, so that an update compares with what was sampled."""
        self.ppo.anneal(share)
        self.ppo.log_std.clamp_(max=math.log(self.ppo.std_max))
        r, envs = self.rollout, self.envs
        for t in range(self.settings.steps):
            self.history[t], r.critic[t] = envs.history.flatten(1), envs.critic
            r.mean[t] = self.actor(self.history[t])
            r.action[t], r.log_prob[t] = self.ppo.sample(r.mean[t])
            envs.step(r.action[t])
            r.valid[t], r.done[t], r.timeout[t] = envs.valid, envs.done, envs.timeout
            r.reward[t] = torch.where(envs.valid > 0, envs.reward, 0)
        r.critic[-1] = envs.critic

    def update(self):
        history = self.history.flatten(0, 1)

        def mirror(rows, mean):
            part = rows[: int(self.share * len(rows))]
            image = self.mirror_action(self.actor(self.mirror_history(history[part])))
            return MIRROR_WEIGHT * nn.functional.mse_loss(mean[: len(part)], image)

        return self.ppo.update(self.rollout, lambda rows: self.actor(history[rows]), mirror if self.share else None)

    def save(self, path):
        actor = walker.with_weights(self.actor, self.ppo.mean_weights)
        layers = actor.layers() if isinstance(actor, walker.Symmetric) else walker.plain_layers(actor)
        walker.write_policy(path, self.envs, layers, "scripts/rivals/train_walk.py")


def train(arguments):
    run.begin(arguments)
    envs = walker.open_envs(arguments)
    asked = {name: getattr(arguments, name) for name in ("optimizer", "advantages", "priority")}
    settings = dataclasses.replace(run.tuned(arguments, SETTINGS), **asked)
    walk = Walk(envs, settings, 0 if arguments.symmetric else arguments.mirror, arguments.symmetric)
    walker.begun(arguments)
    progress, steps = run.Progress(arguments), arguments.envs * settings.steps
    snapshots = walker.Snapshots(arguments, walk.save)
    while not progress.over():
        begin = time.time()
        walk.roll_out(progress.share())
        envs.wait()
        rollout = time.time() - begin
        report = walk.update()
        statistics = envs.statistics()
        progress.log({**statistics, **report, "rollout_s": rollout}, steps)
        snapshots.look(progress.iteration * steps, 100 * statistics["paid"] / statistics["steps"], progress.over())
    envs.close()


if __name__ == "__main__":
    parser = run.options(__doc__, 10)
    walker.options(parser)
    parser.set_defaults(envs=4096)
    parser.add_argument("--optimizer", default=SETTINGS.optimizer, choices=("adam", "muon"), help=f"(default {SETTINGS.optimizer})")
    parser.add_argument("--mirror", type=float, default=0.25, help="share of each minibatch with a mirror loss (default 0.25)")
    parser.add_argument("--symmetric", action="store_true", help="actor and critic symmetric by construction, no mirror loss")
    parser.add_argument("--advantages", default="once", choices=("once", "epoch", "vtrace"),
                        help="once an update; anew in each epoch; by V-trace, too (default once)")
    parser.add_argument("--priority", type=float, default=0.0,
                        help="minibatches draw environments by their sum of |advantage| to this power; PufferLib's 0.8 (default 0: all alike)")
    train(parser.parse_args())
