"""The network of the rival "HT-2" (lab/paper/control/controller_ht2.c says how it computes) and what acts on its contexts."""
import math

import torch
from torch import nn

import files

CONTEXT, WIDTH, HEADS, LAYERS, RATIO = 16, 192, 4, 4, 2


class Layer(nn.Module):
    def __init__(self, width, heads, ratio):
        super().__init__()
        self.heads = heads
        self.norm1, self.norm2 = nn.LayerNorm(width), nn.LayerNorm(width)
        self.qkv, self.out = nn.Linear(width, 3 * width), nn.Linear(width, width)
        self.up, self.down = nn.Linear(width, ratio * width), nn.Linear(ratio * width, width)

    def forward(self, x):
        rows, tokens, width = x.shape
        q, k, v = self.qkv(self.norm1(x)).view(rows, tokens, 3, self.heads, width // self.heads).permute(2, 0, 3, 1, 4)
        mixed = nn.functional.scaled_dot_product_attention(q, k, v, is_causal=True)
        return self.finish(x, mixed.transpose(1, 2).reshape(rows, tokens, width))

    def finish(self, x, mixed):
        x = x + self.out(mixed)
        return x + self.down(nn.functional.gelu(self.up(self.norm2(x))))

    def newest(self, x, place):
        """Row `place` of each context alone, of which forward computes all."""
        rows, tokens, width = x.shape
        every = torch.arange(rows, device=x.device)
        q, k, v = self.qkv(self.norm1(x)).view(rows, tokens, 3, self.heads, width // self.heads).unbind(2)
        weight = (q[every, place][:, None] * k).sum(-1) / math.sqrt(width // self.heads)
        later = torch.arange(tokens, device=x.device) > place[:, None]
        weight = weight.masked_fill(later[..., None], -math.inf).softmax(1)
        return self.finish(x[every, place], (weight[..., None] * v).sum(1).flatten(1))


class Ht2(nn.Module):
    def __init__(self, observation, actions, context=CONTEXT, width=WIDTH, heads=HEADS, layers=LAYERS, ratio=RATIO):
        super().__init__()
        self.actions, self.place, self.context = actions, 9 + 2 * actions, context
        self.embed_observation = nn.Linear(observation - actions, width)
        self.embed_action = nn.Linear(actions, width, bias=False)
        self.mask = nn.Parameter(0.02 * torch.randn(width))
        self.position = nn.Parameter(0.02 * torch.randn(context, width))
        self.layers = nn.ModuleList(Layer(width, heads, ratio) for _ in range(layers))
        self.norm = nn.LayerNorm(width)
        self.action = nn.Linear(width, actions)
        self.observation = nn.Linear(width, observation - actions)  # of the next token, for the first stage

    def split(self, frames):
        """Frames without their last action, and that action."""
        last = frames[..., self.place : self.place + self.actions]
        return torch.cat([frames[..., : self.place], frames[..., self.place + self.actions :]], -1), last

    def embed(self, frames, missing):
        rest, last = self.split(frames)
        action = torch.where(missing[..., None], self.mask, self.embed_action(last))
        return self.embed_observation(rest) + action + self.position[: frames.shape[1]]

    def forward(self, frames, missing):
        """frames: [rows][tokens][observation], oldest first; missing: [rows][tokens] bool, the action before is not known."""
        x = self.embed(frames, missing)
        for layer in self.layers:
            x = layer(x)
        return self.norm(x)

    def act(self, frames, seen):
        """Mean actions of contexts whose newest frame is number `seen` (from 1) of its episode; frames behind it do not matter."""
        tokens = torch.arange(frames.shape[1], device=frames.device)
        missing = (tokens == 0) & (seen <= self.context)[:, None]
        x = self.embed(frames, missing)
        for layer in self.layers[:-1]:
            x = layer(x)
        return self.action(self.norm(self.layers[-1].newest(x, seen.clamp(max=self.context) - 1)))


def save(path, state, heads, layers, note):
    texts = {"kind": "mild ht2", "version": "1", "robot": "sa01", "note": note, "heads": str(heads), "layers": str(layers)}
    files.write(path, state, texts)


class Memory:
    """Frames of a rollout [steps][envs] and of the context before it."""

    def __init__(self, steps, envs, observation, context, device):
        self.steps, self.context, self.envs = steps, context, envs
        self.frame = torch.zeros(context - 1 + steps, envs, observation, device=device)
        self.count = torch.zeros(steps, envs, dtype=torch.long, device=device)
        self.now = torch.ones(envs, dtype=torch.long, device=device)  # of the frame to come, at most context + 1

    def begin(self):
        """The last frames of the rollout before are the context of this one."""
        before = self.frame[self.steps :].clone()
        self.frame[: self.context - 1] = before

    def take(self, t, frame):
        self.frame[self.context - 1 + t] = frame
        self.count[t] = self.now

    def step(self, done):
        self.now = torch.where(done > 0, 1, (self.now + 1).clamp(max=self.context + 1))

    def contexts(self, t, env):
        """[rows][context][observation] of these times and environments, oldest first, and their counts."""
        seen = self.count[t, env]
        oldest = t + self.context - seen.clamp(max=self.context)
        index = oldest[:, None] + torch.arange(self.context, device=t.device)
        index = torch.minimum(index, (t + self.context - 1)[:, None])
        return self.frame.flatten(0, 1)[index * self.envs + env[:, None]], seen
