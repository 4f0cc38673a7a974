#!/usr/bin/env python3
"""Trains the rival controller "HT-2" (Radosavovic et al. 2024, Learning Humanoid Locomotion over Challenging Terrain): a causal
transformer over 16 frames and the actions between them. Stage 1 predicts the next token, that is action and frame, of trajectories of
an earlier policy (policies/mild.safetensors) on flat ground; a learned mask token stands for actions that are missing. Stage 2 is PPO
on uneven rigid ground. Task, rewards and commands are those of configs/walk.ini.

  cmake -S . -B build -DMILD_CUDA=ON && cmake --build build --target _envs mild
  lab/paper/rivals/train_ht2.py --out runs/ht2
  build/mild eval --controller ht2 --policy runs/ht2/ht2.safetensors --config configs/walk.ini --ground rigid --speed 0.6
"""
import math
import pathlib
import time

import torch
from torch import nn

import files
import ht2
import ppo
import run

FLAT = {"terrain__kind": "flat", "task__assist": 0}
UNEVEN = {"task__assist": 0}
NOISE = 0.15  # of the earlier policy's actions, in half of the environments
MISSING = 0.25  # share of the trajectories without actions
RECORD, BATCH, RATE = 400, 4096, 1e-3  # policy steps, contexts of a gradient step, learning rate
WARM = 20  # iterations that train the critic alone
SETTINGS = ppo.Settings(steps=24, epochs=3, minibatches=8, gamma=0.994, decay=0.95, learning_rate=3e-5, rate_min=1e-6, rate_max=1e-3, critic_rate=1e-3,
                        std=0.25, kl_target=0.01)


class Teacher:
    """The earlier policy (src/learn/policy.h), without noise: its latent is the mean."""

    def __init__(self, path, device):
        tensors, texts = files.read(path)
        self.weights = {name: tensor.to(device) for name, tensor in tensors.items()}
        self.estimates, self.latent = (int(texts["policy." + key]) for key in ("estimates", "latent"))
        self.feet, self.seen = int(texts["policy.feet_velocity_offset"]), tensors["modulation.0.weight"].shape[1]

    def net(self, name, x):
        layers = sorted(int(key.split(".")[1]) for key in self.weights if key.startswith(name + ".") and key.endswith("weight"))
        for i in layers:
            x = nn.functional.linear(x, self.weights[f"{name}.{i}.weight"], self.weights[f"{name}.{i}.bias"])
            x = x if i == layers[-1] else nn.functional.elu(x)
        return x

    def act(self, history):
        """history: [rows][frames][observation]"""
        estimates, latent, _ = self.net("encoder", history.flatten(1)).split([self.estimates, self.latent, self.latent], 1)
        theta = self.net("modulation", torch.cat([estimates[:, self.feet :], history[:, -1, -2:]], 1)[:, : self.seen])
        return self.net("actor", torch.cat([history[:, -1], estimates, theta[:, :1] * latent + theta[:, 1:]], 1))


# ---- stage 1 ----


@torch.no_grad()
def record(envs, steps, teacher):
    """Trajectories of the teacher: a Memory of all steps, and its actions [steps][envs][actions]."""
    shape, teacher = envs.shape, Teacher(teacher, envs.device)
    memory = ht2.Memory(steps, shape.envs, shape.observation, ht2.CONTEXT, envs.device)
    actions = torch.zeros(steps, shape.envs, shape.actions, device=envs.device)
    noise = NOISE * (torch.arange(shape.envs, device=envs.device) % 2)[:, None]
    envs.reset()
    for t in range(steps):
        memory.take(t, envs.frame)
        actions[t] = teacher.act(envs.history)
        envs.step(actions[t] + noise * torch.randn_like(actions[t]))
        memory.step(envs.done)
    return memory, actions


def regression(net, memory, actions, scale, rows):
    """Loss of the next tokens of `rows` random contexts: (actions, frames)."""
    device, context = actions.device, net.context
    t = torch.randint(context, memory.steps, (rows,), device=device)
    env = torch.randint(memory.envs, (rows,), device=device)
    frames, seen = memory.contexts(t, env)
    tokens = torch.arange(context, device=device)
    absent = torch.rand(rows, 1, device=device) < MISSING
    missing = absent | ((tokens == 0) & (seen <= context)[:, None])
    known = tokens < seen.clamp(max=context)[:, None]
    x = net(frames, missing)
    time_of = (t - seen.clamp(max=context) + 1)[:, None] + tokens
    target = actions[time_of.clamp(max=memory.steps - 1), env[:, None]]
    wanted = (known & ~absent).float()[..., None]
    loss = (wanted * (net.action(x).float() - target) ** 2).sum() / (wanted.sum() * net.actions)
    following = known[:, 1:].float()[..., None]
    rest = net.split(frames)[0]
    error = (net.observation(x[:, :-1]).float() - rest[:, 1:]) / scale
    return loss, (following * error**2).sum() / (following.sum() * rest.shape[-1])


def pretrain(arguments, progress, device, autocast):
    """Of --pretrain steps, or as many as --imitation has time for."""
    envs = run.open_envs(arguments, FLAT)
    start = time.time()
    memory, actions = record(envs, arguments.record, arguments.teacher)
    shape, statistics = envs.shape, envs.statistics()
    envs.close()
    print(f"recorded {memory.steps} x {memory.envs} steps in {time.time() - start:.0f} s, {statistics['falls']} falls", flush=True)
    net = ht2.Ht2(shape.observation, shape.actions).to(device)
    print(f"{sum(p.numel() for p in net.parameters())} parameters", flush=True)
    scale = net.split(memory.frame[ht2.CONTEXT :])[0].flatten(0, 1).std(0) + 0.01
    optimizer = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=0.01, fused=device.type == "cuda")
    rows = min(BATCH, 64 * memory.envs)
    step, begun, shown = 0, progress.share(), 0.0
    while True:
        done = (progress.share() - begun) / max(arguments.imitation - begun, 1e-6) if arguments.imitation else step / arguments.pretrain
        if done >= 1:
            break
        for group in optimizer.param_groups:
            group["lr"] = RATE * min(1, (step + 1) / 100) * 0.5 * (1 + math.cos(math.pi * done))
        with autocast():
            action, frame = regression(net, memory, actions, scale, rows)
        optimizer.zero_grad(set_to_none=True)
        (action + 0.1 * frame).backward()
        nn.utils.clip_grad_norm_(net.parameters(), 1.0)
        optimizer.step()
        if done >= shown:
            print(f"{time.time() - start:6.0f} s  step {step:5d}  action {action.item():.5f}  frame {frame.item():.4f}", flush=True)
            shown += 0.1
        step += 1
    return net


# ---- stage 2 ----


class Learner:
    def __init__(self, net, envs, device, autocast, settings):
        shape = envs.shape
        self.envs, self.net, self.autocast = envs, net, autocast
        self.ppo = ppo.Ppo(net, ppo.make_critic(shape.critic).to(device), shape.actions, settings, device)
        self.rollout = ppo.Rollout(SETTINGS.steps, shape.envs, shape.actions, shape.critic, device)
        self.memory = ht2.Memory(SETTINGS.steps, shape.envs, shape.observation, net.context, device)
        self.every = torch.arange(shape.envs, device=device)
        envs.reset()

    def mean(self, t, env):
        with self.autocast():
            return self.net.act(*self.memory.contexts(t, env)).float()

    @torch.no_grad()
    def roll_out(self):
        r, envs = self.rollout, self.envs
        self.memory.begin()
        for t in range(SETTINGS.steps):
            self.memory.take(t, envs.frame)
            r.critic[t] = envs.critic
            r.mean[t] = self.mean(torch.full_like(self.every, t), self.every)
            r.action[t], r.log_prob[t] = self.ppo.sample(r.mean[t])
            envs.step(r.action[t])
            r.valid[t], r.done[t], r.timeout[t] = envs.valid, envs.done, envs.timeout
            r.reward[t] = torch.where(envs.valid > 0, envs.reward, 0)
            self.memory.step(envs.done)
        r.critic[-1] = envs.critic

    def update(self, actor):
        number = self.memory.envs
        return self.ppo.update(self.rollout, lambda rows: self.mean(rows // number, rows % number), actor=actor)


def train(arguments):
    device = run.begin(arguments)

    def autocast():
        return torch.autocast(device.type, dtype=torch.bfloat16, enabled=device.type == "cuda")

    path = arguments.out / "ht2.safetensors"
    progress = run.Progress(arguments)  # the clock of both stages
    envs = run.open_envs(arguments, UNEVEN)
    if arguments.go_on:
        net = ht2.Ht2(envs.shape.observation, envs.shape.actions).to(device)
    else:
        net = pretrain(arguments, progress, device, autocast)
        ht2.save(arguments.out / "ht2_first_stage.safetensors", net.state_dict(), ht2.HEADS, ht2.LAYERS,
                 "stage 1 of lab/paper/rivals/train_ht2.py")
    learner = Learner(net, envs, device, autocast, run.tuned(arguments, SETTINGS))
    if arguments.go_on:
        learner.ppo.load(arguments.go_on)
    steps = arguments.envs * SETTINGS.steps
    while not progress.over():
        learner.ppo.anneal(progress.share())
        begin = time.time()
        learner.roll_out()
        envs.wait()
        rollout = time.time() - begin
        report = learner.update(actor=arguments.go_on is not None or progress.iteration >= arguments.warm)
        if progress.log({**envs.statistics(), **report, "rollout_s": rollout}, steps):
            ht2.save(path, learner.ppo.mean_weights, ht2.HEADS, ht2.LAYERS,
                     f"lab/paper/rivals/train_ht2.py, iteration {progress.iteration} of {steps} steps")
            learner.ppo.save(arguments.out / "state.pt")
    envs.close()


if __name__ == "__main__":
    parser = run.options(__doc__, 8)
    parser.set_defaults(envs=4096)
    parser.add_argument("--record", type=int, default=RECORD, help=f"policy steps of the earlier policy (default {RECORD})")
    parser.add_argument("--warm", type=int, default=WARM, help=f"iterations of stage 2 that train the critic alone (default {WARM})")
    parser.add_argument("--teacher", type=pathlib.Path, default=run.ROOT / "policies/mild.safetensors",
                        help="the earlier policy (default: the shipped one)")
    parser.add_argument("--pretrain", type=int, default=3000, help="gradient steps of stage 1 (default 3000)")
    parser.add_argument("--imitation", type=float, default=0.0, help="share of --minutes after which stage 1 ends, in the place of --pretrain")
    train(parser.parse_args())
