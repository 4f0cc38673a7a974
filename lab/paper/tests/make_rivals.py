#!/usr/bin/env python3
"""Writes the references of test_rivals.c: small networks of both kinds with random weights, frames of two episodes, and the actions
that PyTorch computes in double precision. Usage: make_rivals.py FOLDER (lab/paper/tests), with PyTorch."""
import pathlib
import sys

import torch

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "rivals"))
import files
import ht2
import ppo

OBSERVATION, ACTIONS = 47, 12
STEPS, SECOND = 13, 8  # policy steps, and where the second episode begins
CONTEXT, WIDTH, HEADS, LAYERS, RATIO = 4, 24, 3, 2, 2


def scatter(net):
    for parameter in net.parameters():
        parameter.data = parameter.data + 0.25 * torch.randn_like(parameter)
    return net.float().double()


def write(path, net, prefix, kind, texts, frames, actions):
    tensors = {prefix + name: weight for name, weight in net.state_dict().items()}
    tensors["train.frames"], tensors["train.actions"] = frames, actions
    files.write(path, tensors, {"kind": kind, "version": "1", "robot": "sa01", "note": "lab/paper/tests/make_rivals.py", **texts})


def clock(frames):
    """Decides in periods 0 and 2 of every five, half the way to the new action."""
    net = scatter(ppo.mlp([OBSERVATION, 20, 16, ACTIONS], torch.nn.ReLU))
    actions = torch.zeros(STEPS, ACTIONS).double()
    for t in range(STEPS):
        period = t if t < SECOND else t - SECOND
        last = actions[t - 1] if period else torch.zeros(ACTIONS).double()
        actions[t] = 0.5 * last + 0.5 * net(frames[t]) if period % 5 in (0, 2) else last
    return net, actions


def transformer(frames):
    """Every step anew from the frames of its episode."""
    net = scatter(ht2.Ht2(OBSERVATION, ACTIONS, CONTEXT, WIDTH, HEADS, LAYERS, RATIO))
    actions = torch.zeros(STEPS, ACTIONS).double()
    for t in range(STEPS):
        begin = 0 if t < SECOND else SECOND
        first = max(begin, t - CONTEXT + 1)
        missing = torch.arange(first, t + 1)[None] == begin
        actions[t] = net.action(net(frames[None, first : t + 1], missing))[0, -1]
    return net, actions


def main():
    folder = pathlib.Path(sys.argv[1])
    torch.manual_seed(5)
    frames = torch.randn(STEPS, OBSERVATION).double()
    with torch.no_grad():
        net, actions = clock(frames)
        write(folder / "clock.safetensors", net, "actor.", "mild clock", {}, frames, actions)
        net, actions = transformer(frames)
        write(folder / "ht2.safetensors", net, "", "mild ht2", {"heads": str(HEADS), "layers": str(LAYERS)}, frames, actions)


if __name__ == "__main__":
    main()
