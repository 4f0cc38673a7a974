#!/usr/bin/env python3
"""Trains a plain network that sees the whole history from a replay memory, on the task of configs/quick.ini as it is: FastTD3 (Seo et al.
2025, arXiv:2505.22642) or, with --sac, FastSAC (Seo et al. 2025, arXiv:2512.01996): many environments, large batches, two critics of a
distribution (C51, Bellemare et al. 2017), a small memory, returns of n steps, half of each batch mirrored left to right.

  scripts/rivals/offpolicy.py --out runs/td3 --until 60
  build/mild eval --policy runs/td3/last.safetensors

Ours: layer norms in the critics of both; the actor's bound is made of two ELU layers, so that mild reads it. An episode that ended by time
goes on with the value of the observation before the step, as in ppo.py: on a GPU the environments do not give the one after it."""
import copy
import math
import time
from dataclasses import dataclass

import torch
from torch import nn

import ppo
import replay
import run
import walker


@dataclass
class Settings:
    sac: bool = False
    gamma: float = 0.99
    returns: int = 3  # n, steps of a return
    batch: int = 32768
    updates: int = 2  # of the critics after each step
    every: int = 2  # of these, one moves the actor, too
    memory: int = 512  # steps of all environments
    least: float = 0.0  # support of the returns; rewards are never below 0
    most: float = 25.0
    atoms: int = 101
    rate: float = 3e-4  # learning rate
    actor: float = 1e-4  # that of the actor
    decay: float = 1e-3  # of the weights
    tau: float = 0.1  # by which the critics that give targets follow
    noise: tuple = (0.02, 0.6)  # least and greatest standard deviation of an environment's noise, TD3
    smooth: tuple = (0.1, 0.2)  # standard deviation and bound of the target's noise, TD3
    limit: float = 3.0  # greatest action; linear up to half of it
    warm: int = 200  # updates of the critics before the actor moves
    alpha: float = 1e-3  # weight of the entropy at the start, SAC
    entropy: float = -0.5  # its target for each action, SAC
    mirror: float = 0.5  # share of a batch that is mirrored
    hidden: tuple = (1024, 512, 256)  # widths of the critics


def bounded(x):
    """x up to +-1, and on towards +-2 with a slope that falls as exp: 1 - elu(1 - (elu(x + 1) - 1))."""
    return 1 - nn.functional.elu(2 - nn.functional.elu(x + 1))


def log_slope(x):
    return -nn.functional.relu(x.abs() - 1)


def bounded_layers(layers, actions, limit):
    """Of the plain network limit/2 bounded(net(x)); layers: of net, whose first `actions` outputs count."""
    one, (weight, bias) = torch.eye(actions, device=layers[-1][0].device), layers[-1]
    return [*layers[:-1], (weight[:actions], bias[:actions] + 1), (-one, 0 * one[0] + 2), (-limit / 2 * one, 0 * one[0] + limit / 2)]


def make_critic(width, hidden, atoms):
    layers = []
    for a, b in zip((width, *hidden), hidden):
        layers += [nn.Linear(a, b), nn.LayerNorm(b), nn.SiLU()]
    last = nn.Linear(hidden[-1], atoms)
    nn.init.zeros_(last.weight)  # an actor that follows random critics goes to its bounds, and comes back late
    return nn.Sequential(*layers, last)


class Learner:
    def __init__(self, envs, settings, graphs):
        s, shape, device = settings, envs.shape, envs.device
        self.settings, self.envs, self.device, self.actions = s, envs, device, shape.actions
        self.memory = replay.Memory(s.memory, envs, device)
        self.actor = ppo.mlp([shape.frames * shape.observation, 512, 256, shape.actions * (2 if s.sac else 1)], nn.ELU).to(device)
        with torch.no_grad():
            self.actor[-1].weight.mul_(0.1)
        self.critics = nn.ModuleList(make_critic(shape.critic + shape.actions, s.hidden, s.atoms) for _ in range(2)).to(device)
        self.slow = copy.deepcopy(self.critics)
        self.atoms = torch.linspace(s.least, s.most, s.atoms, device=device)
        self.see, self.know = replay.Scale(shape.frames * shape.observation, device), replay.Scale(shape.critic, device)
        self.log_alpha = nn.Parameter(torch.tensor(math.log(s.alpha), device=device))
        cuda = {"fused": True, "capturable": True} if device.type == "cuda" else {}

        def optimizer(parameters, rate, decay):
            return torch.optim.AdamW(parameters, lr=rate, weight_decay=decay, betas=(0.9, 0.95), **cuda)
        self.optimizers = [optimizer(self.critics.parameters(), s.rate, s.decay), optimizer(self.actor.parameters(), s.actor, s.decay),
                           optimizer([self.log_alpha], s.rate, 0)]
        (index, sign), action = envs.mirror()
        frame = walker.Mirror(index, sign)
        self.mirrors = frame.repeat(shape.frames), walker.critic_mirror(frame, device), walker.Mirror(*action)
        self.std = torch.zeros(shape.envs, 1, device=device).uniform_(*s.noise)
        self.report = torch.zeros(4, device=device)  # loss of the critics, value, entropy, alpha
        self.updates, self.calls = 0, [0, 0]
        self.steps = [self.step_critics, self.step_actor]
        self.graphs = [None, None] if graphs and device.type == "cuda" else None
        envs.reset()
        self.memory.see(envs)

    # ---- acting ----

    def act(self, history):
        """Of normalised histories: actions without noise (TD3) or drawn (SAC), and the logarithms of their densities or None."""
        half, out = self.settings.limit / 2, self.actor(history).float()
        if not self.settings.sac:
            return half * bounded(out), None
        mean, raw = out.chunk(2, -1)
        log_std = -2.5 + 2.5 * torch.tanh(raw + 0.5)  # -5 .. 0
        x = mean + log_std.exp() * torch.randn_like(mean)
        return half * bounded(x), ppo.log_density(x, mean, log_std) - (log_slope(x) + math.log(half)).sum(-1)

    @torch.no_grad()
    def walk(self):
        """A step of all environments."""
        envs, s = self.envs, self.settings
        self.see.take(envs.history.flatten(1))
        self.know.take(envs.critic)
        action = self.act(self.see(envs.history.flatten(1)))[0]
        if not s.sac:
            action = (action + self.std * torch.randn_like(action)).clamp(-s.limit, s.limit)
        envs.step(action)
        self.memory.take(action, envs)
        self.std = torch.where(envs.done[:, None] > 0, torch.empty_like(self.std).uniform_(*s.noise), self.std)

    # ---- learning ----

    def histories(self, t, env, mirrored):
        x = self.memory.history[t, env].float()
        return self.see(torch.where(mirrored, self.mirrors[0](x), x))

    def states(self, t, env, mirrored):
        x = self.memory.critic[t, env].float()
        return self.know(torch.where(mirrored, self.mirrors[1](x), x))

    def sample(self):
        s = self.settings
        t, env = self.memory.draw(s.batch, s.returns)
        return t, env, torch.rand(s.batch, 1, device=self.device) < s.mirror

    def autocast(self):
        return torch.autocast(self.device.type, dtype=torch.bfloat16, enabled=self.device.type == "cuda", cache_enabled=False)

    def means(self, logits):
        return (logits.float().softmax(-1) * self.atoms).sum(-1)

    def step_critics(self):
        s = self.settings
        t, env, mirrored = self.sample()
        total, after, factor, weight = self.memory.returns(t, env, s.returns, s.gamma)
        with torch.no_grad(), self.autocast():
            action, density = self.act(self.histories(after, env, mirrored))
            if s.sac:
                total = total - factor * self.log_alpha.exp() * density
            else:
                noise = (s.smooth[0] * torch.randn_like(action)).clamp(-s.smooth[1], s.smooth[1])
                action = (action + noise).clamp(-s.limit, s.limit)
            x = torch.cat([self.states(after, env, mirrored), action], -1)
            both = torch.stack([net(x) for net in self.slow]).float()
            chance = both.softmax(-1)
            if s.sac:
                chance = chance.mean(0)
            else:
                value = self.means(both)
                chance = torch.where((value[0] < value[1])[:, None], chance[0], chance[1])
            target = replay.project(chance, total, factor, self.atoms)
        action = self.memory.action[t, env]
        action = torch.where(mirrored, self.mirrors[2](action), action)
        with self.autocast():
            x = torch.cat([self.states(t, env, mirrored), action], -1)
            logs = torch.stack([net(x) for net in self.critics]).float().log_softmax(-1)
        loss = -(weight * (target * logs).sum(-1)).mean(1).sum()
        self.move(0, loss)
        with torch.no_grad():
            torch._foreach_lerp_(list(self.slow.parameters()), list(self.critics.parameters()), s.tau)
            self.report[0].copy_(loss)

    def step_actor(self):
        s = self.settings
        t, env, mirrored = self.sample()
        with self.autocast():
            action, density = self.act(self.histories(t, env, mirrored))
            x = torch.cat([self.states(t, env, mirrored), action], -1)
            value = self.means(torch.stack([net(x) for net in self.critics]))
        if s.sac:
            loss = (self.log_alpha.exp().detach() * density - value.mean(0)).mean()
            wanted = s.entropy * self.actions
            self.move(2, -(self.log_alpha * (density.detach().mean() + wanted)))
            self.report[2].copy_(-density.detach().mean())
            self.report[3].copy_(self.log_alpha.detach().exp())
        else:
            loss = -value.amin(0).mean()
        self.move(1, loss)
        self.report[1].copy_(value.detach().mean())

    def move(self, which, loss):
        optimizer = self.optimizers[which]
        parameters = [p for group in optimizer.param_groups for p in group["params"]]
        for parameter, gradient in zip(parameters, torch.autograd.grad(loss, parameters)):
            parameter.grad = gradient
        optimizer.step()

    def run(self, which):
        """One step of the critics (0) or the actor (1), on a GPU as a CUDA graph after the first ones."""
        if self.graphs and self.graphs[which] is None and self.calls[which] >= 4:
            torch.cuda.synchronize(self.device)
            self.graphs[which] = torch.cuda.CUDAGraph()
            with torch.cuda.graph(self.graphs[which]):
                self.steps[which]()
        self.calls[which] += 1
        if self.graphs and self.graphs[which]:
            self.graphs[which].replay()
        else:
            self.steps[which]()

    def learn(self):
        for _ in range(self.settings.updates):
            self.run(0)
            self.updates += 1
            if self.updates > self.settings.warm and self.updates % self.settings.every == 0:
                self.run(1)

    def save(self, path):
        s = self.settings
        layers = bounded_layers(walker.plain_layers(self.actor), self.actions, s.limit)
        walker.write_policy(path, self.envs, layers, "scripts/rivals/offpolicy.py" + (" --sac" if s.sac else ""), self.see.mean, self.see.std())


NUMBERS = {"gamma": "discount", "returns": "steps of a return", "batch": "samples of an update", "updates": "after each step",
           "memory": "steps of all environments that are kept", "most": "greatest return of the critics", "rate": "learning rate", "actor": "that of the actor",
           "mirror": "share of a batch that is mirrored"}


def train(arguments):
    run.begin(arguments)
    envs = walker.open_envs(arguments)
    settings = Settings(arguments.sac, hidden=tuple(map(int, arguments.hidden.split(","))), **{name: getattr(arguments, name) for name in NUMBERS})
    learner = Learner(envs, settings, not arguments.eager)
    walker.begun(arguments)
    progress, snapshots = run.Progress(arguments), walker.Snapshots(arguments, learner.save)
    while not progress.over():
        begin = time.time()
        for _ in range(arguments.chunk):
            learner.walk()
            if learner.memory.row > 2 * settings.returns or learner.updates:
                learner.learn()
        loss, value, entropy, alpha = learner.report.tolist()
        statistics = envs.statistics()
        progress.log({**statistics, "value_loss": loss, "value": value, "entropy": entropy, "alpha": alpha, "rate": settings.rate,
                      "std": learner.std.mean().item(), "rollout_s": time.time() - begin}, arguments.chunk * arguments.envs)
        snapshots.look(progress.iteration * arguments.chunk * arguments.envs, 100 * statistics["paid"] / statistics["steps"], progress.over())
    envs.close()


if __name__ == "__main__":
    parser = run.options(__doc__, 1)
    walker.options(parser)
    parser.set_defaults(envs=4096)
    parser.add_argument("--sac", action="store_true", help="FastSAC; else FastTD3")
    parser.add_argument("--eager", action="store_true", help="no CUDA graphs")
    parser.add_argument("--chunk", type=int, default=24, help="steps of a line of the log (default 24)")
    parser.add_argument("--hidden", default="1024,512,256", help="widths of the critics (default 1024,512,256)")
    for name, text in NUMBERS.items():
        default = getattr(Settings, name)
        parser.add_argument("--" + name, type=type(default), default=default, help=f"{text} (default {default})")
    train(parser.parse_args())
