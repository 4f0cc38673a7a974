#!/usr/bin/env python3
"""Learns the weights by which a robot knows its ground (docs/identify.md), from walks that `mild know --walks` writes.

  lab/know/know.py walk --out out/know       # 18 000 walks for the posterior, 12 000 over borders and 28 h without for the alarm
  lab/know/know.py train out/know --out policies/knows.safetensors
  lab/know/know.py alarm out/know --weights policies/knows.safetensors    # the alarm of these weights alone
  lab/know/know.py bound out/know            # R2 of the sensors beside that of the true states, by the same networks

Needs NumPy alone. One network embeds each footstep, the mean of the embeddings over the footsteps is all that is remembered, and
another reads from it the mean and the variance of each parameter, in standard deviations of its prior. The loss is the likelihood.
Every fifth walk is held out; on these the standard deviations are calibrated. The alarm is set on walks of its own."""
import argparse
import csv
import json
import math
import os
import pathlib
import subprocess
import zlib

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
NAMES = ("sinkage", "k_pen", "sigma_cone", "mu", "slip_length")
COUNT = len(NAMES)
FRAME, BINS, EMBED, HIDDEN, KNOTS, MEMORY = 47, 8, 96, 64, 31, 24
ODDS = 3 * EMBED + 8, 48, 16  # widths of the alarm: input, hidden
START, SHORTEST, LONGEST = 2, 20, 80  # footsteps that are not looked at; frames of a footstep
SHARE, PER_10_MIN = 0.9, 0.6  # nominal coverage; false alarms in 10 minutes that the threshold is set to
COMMAND = slice(BINS * 42, BINS * 42 + 3)  # among the features
LEGS = np.array([6, 7, 8, 9, 10, 11, 0, 1, 2, 3, 4, 5])
SIGNS = np.array([-1, -1, 1, 1, 1, -1] * 2)
LEARN = ("--seconds", 12, "--changes", 0.35, "--quiet", 0.2)
WALKS = {"learn1": ("--grounds", 6000, "--seed", 1, *LEARN),
         "learn2": ("--grounds", 6000, "--seed", 2, *LEARN),
         "learn3": ("--grounds", 6000, "--seed", 3, *LEARN),
         **{f"border{seed}": ("--grounds", 3000, "--seed", seed, "--changes", 1, "--quiet", 0.2) for seed in (11, 12, 13, 14)},
         "calm21": ("--grounds", 2400, "--seconds", 30, "--changes", 0, "--quiet", 0.2, "--seed", 21),
         "long22": ("--grounds", 480, "--seconds", 60, "--changes", 0, "--quiet", 0.2, "--seed", 22)}


# ---- footsteps ----

def mirrored(frames):
    """The mirror image, left to right, of frames [..., 47]."""
    out = frames.copy()
    out[..., [0, 2, 4, 5, 7, 45, 46]] *= -1
    for first in (9, 21, 33):
        out[..., first : first + 12] = frames[..., first : first + 12][..., LEGS] * SIGNS
    return out


def mirrored_truth(truth):
    """The same of true velocities of base and feet, heights and depths of the feet."""
    out, sides = truth.copy(), np.array([1, -1, 1])
    out[..., 0:3] = truth[..., 0:3] * sides
    out[..., 3:6], out[..., 6:9] = truth[..., 6:9] * sides, truth[..., 3:6] * sides
    out[..., [9, 10, 11, 12]] = truth[..., [10, 9, 12, 11]]
    return out


def features(readings, phase):
    """Of one footstep: means of [n, channels], the command at 3..5, over eighths; command; log variances; length. None: too few."""
    bins = np.minimum((phase * 2 % 1 * BINS).astype(int), BINS - 1)
    count = np.bincount(bins, minlength=BINS)
    if not SHORTEST <= len(bins) <= LONGEST or not count.all():
        return None
    select = (bins == np.arange(BINS)[:, None]).astype(float)
    means = select @ readings / count[:, None]
    channels = np.r_[0:3, 6 : readings.shape[1]]
    rest = ((readings - means[bins])[:, channels] ** 2).mean(0)
    return np.concatenate([means[:, channels].ravel(), readings[:, 3:6].mean(0), np.log(rest + 1e-8), [len(bins) / 50]])


def footsteps(frames, truth=None):
    """[(features, first frame, frame behind it)] of frames [n, 47]. truth: [n, 60] what to look at in the frames' place."""
    sine, cosine = frames[:, 45].astype(float), frames[:, 46].astype(float)
    moving = abs(sine) + abs(cosine) > 0.5
    phase = np.arctan2(sine, cosine) / (2 * np.pi) % 1
    right = phase >= 0.5
    edge = np.flatnonzero((right[1:] != right[:-1]) | (moving[1:] != moving[:-1])) + 1
    found, waiting = [], START
    for begin, end in zip(edge[:-1], edge[1:]):
        if not moving[begin] or not moving[begin - 1]:
            waiting = START  # it stands, or this is the rest of a footstep whose beginning was not seen
            continue
        readings = frames[begin:end].astype(float)
        readings = (mirrored(readings) if right[begin] else readings)[:, :45]
        if truth is not None:
            own = truth[begin:end].astype(float)
            noiseless, rest = own[:, :FRAME], own[:, FRAME:]
            if right[begin]:
                noiseless, rest = mirrored(noiseless), mirrored_truth(rest)
            readings = np.concatenate([noiseless[:, :45], rest], 1)
        values = features(readings, phase[begin:end])
        if values is None:
            continue
        if waiting:
            waiting -= 1
            continue
        found.append((values, begin, end))
    return found


def read_walks(path, true_states=False):
    """Footsteps of the walks of a file: features [n, :], number of the walk [n], share of the second ground [n]; the table of walks."""
    walks = np.load(path, mmap_mode="r")
    with open(path.with_suffix(".csv"), newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    table = {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}
    kept, number, second = [], [], []
    for i, lasted in enumerate(table["lasted"].astype(int)):
        fell = lasted < walks.shape[1]
        walk = np.asarray(walks[i, : lasted - 50 if fell else lasted])  # a fall is not walking
        if lasted < 300:
            continue
        for values, begin, end in footsteps(walk[:, :FRAME], walk[:, FRAME:107] if true_states else None):
            under = walk[begin:end, 107:109]
            under = under[under >= 0]
            kept.append(values.astype(np.float32))
            number.append(i)
            second.append(under.mean() if len(under) else -1)
    return np.array(kept), np.array(number), np.array(second), table


# ---- priors ----

def normal(z):
    return 0.5 * (1 + math.erf(z / math.sqrt(2)))


def prior_knots(values):
    """Quantiles of log values at -3, -2.8 .. 3 standard deviations, each above the one before."""
    knots = np.quantile(values, [normal(z) for z in np.linspace(-3, 3, KNOTS)])
    return np.maximum.accumulate(knots + 1e-6 * np.arange(KNOTS))


class Walks:
    """Footsteps cut into pieces on one ground each; targets of the pieces."""

    def __init__(self, paths, true_states=False, knots=None):
        parts = [read_walks(path, true_states) for path in paths]
        first = np.cumsum([0] + [len(table["walk"]) for *_, table in parts])
        self.features = np.concatenate([part[0] for part in parts])
        self.walk = np.concatenate([part[1] + at for part, at in zip(parts, first)])
        self.second = np.concatenate([part[2] for part in parts])
        self.table = {key: np.concatenate([part[3][key] for part in parts]) for key in parts[0][3]}
        ground = np.where(self.second < 0.02, 0, np.where(self.second > 0.98, 1, -1))
        cut = np.flatnonzero((np.diff(self.walk) != 0) | (np.diff(ground) != 0)) + 1
        begin, end = np.r_[0, cut], np.r_[cut, len(self.walk)]
        on = ground[begin] >= 0
        self.begin, self.end, self.of = begin[on], end[on], self.walk[begin[on]]
        where = ground[begin[on]]
        self.log = np.stack([np.log(np.where(where == 0, self.table[f"{name}0"][self.of],
                                             np.maximum(self.table[f"{name}1"][self.of], 1e-9))) for name in NAMES], 1)
        self.knots = knots if knots is not None else np.stack([prior_knots(np.log(self.table[f"{name}0"])) for name in NAMES])
        at = np.linspace(-3, 3, KNOTS)
        self.target = np.stack([np.interp(self.log[:, i], self.knots[i], at) for i in range(COUNT)], 1).astype(np.float32)
        self.held = self.of % 5 == 0


# ---- networks ----

def elu(x):
    return np.where(x > 0, x, np.expm1(np.minimum(x, 0)))


class Adam:
    def __init__(self, parameters, decay):
        self.parameters, self.decay, self.t = parameters, decay, 0
        self.first, self.second = ([np.zeros_like(p) for p in parameters] for _ in range(2))

    def step(self, gradients, rate):
        self.t += 1
        for p, g, m, v in zip(self.parameters, gradients, self.first, self.second):
            m += 0.1 * (g - m)
            v += 0.001 * (g * g - v)
            if p.ndim == 2:
                p *= np.float32(1 - rate * self.decay)
            p -= np.float32(rate) * (m / np.float32(1 - 0.9**self.t)) / (np.sqrt(v / np.float32(1 - 0.999**self.t)) + np.float32(1e-8))


def layer(rng, inputs, outputs, scale=1.0):
    return (scale * rng.standard_normal((inputs, outputs)) / math.sqrt(inputs)).astype(np.float32), np.zeros(outputs, np.float32)


class Network:
    """embed -> mean over footsteps -> hidden -> mean and log variance of each parameter."""

    def __init__(self, inputs, rng):
        self.mean, self.scale = np.zeros(inputs, np.float32), np.ones(inputs, np.float32)
        self.embed, self.embed_bias = layer(rng, inputs, EMBED)
        self.hidden, self.hidden_bias = layer(rng, EMBED + 2, HIDDEN)
        self.out, self.out_bias = layer(rng, HIDDEN, 2 * COUNT, 0.1)

    def parameters(self):
        return [self.embed, self.embed_bias, self.hidden, self.hidden_bias, self.out, self.out_bias]

    def embedded(self, x):
        return elu((x - self.mean) / self.scale @ self.embed + self.embed_bias)

    def read(self, mean, n):
        """(means, standard deviations) [rows, COUNT] from mean embeddings of n footsteps."""
        x = np.concatenate([mean, (1 / n)[:, None], (np.log(n) / 3)[:, None]], 1).astype(np.float32)
        out = elu(x @ self.hidden + self.hidden_bias) @ self.out + self.out_bias
        return out[:, :COUNT], np.exp(0.5 * np.clip(out[:, COUNT:], -6, 3))

    def train(self, walks, rng, epochs, rate=2e-3, decay=0.1, drop=0.1, batch=256):
        self.mean, self.scale = walks.features.mean(0), walks.features.std(0) + np.float32(1e-6)
        x = (walks.features - self.mean) / self.scale
        pieces, adam = np.flatnonzero(~walks.held), Adam(self.parameters(), decay)
        steps = epochs * len(pieces) // 128
        for k in range(steps):
            own = rng.choice(pieces, batch)
            length = walks.end[own] - walks.begin[own]
            n = np.minimum(np.exp(rng.random(batch) * math.log(MEMORY + 0.999)).astype(int), length)
            first = walks.begin[own] + (rng.random(batch) * (length - n + 1)).astype(int)
            rows = np.concatenate([np.arange(a, a + b) for a, b in zip(first, n)])
            adam.step(self.gradients(x[rows], n, walks.target[own], rng, drop), rate * 0.5 * (1 + math.cos(math.pi * k / steps)))
            if k % (steps // 8) == 0:
                print(f"step {k} of {steps}: loss {self.loss:.3f}", flush=True)
        return self

    def gradients(self, x, n, target, rng, drop):
        starts = np.r_[0, np.cumsum(n)[:-1]]
        h = elu(x @ self.embed + self.embed_bias)
        mean = np.add.reduceat(h, starts, 0) / n[:, None]
        z = np.concatenate([mean, (1 / n)[:, None], (np.log(n) / 3)[:, None]], 1).astype(np.float32)
        wide = elu(z @ self.hidden + self.hidden_bias)
        keep = (rng.random(wide.shape, dtype=np.float32) > drop) / np.float32(1 - drop)
        out = wide * keep @ self.out + self.out_bias
        log_variance = np.clip(out[:, COUNT:], -6, 3)
        error, weight = target - out[:, :COUNT], np.exp(-log_variance)
        self.loss = 0.5 * (error**2 * weight + log_variance).sum(1).mean()
        g = (np.concatenate([-error * weight, 0.5 * (1 - error**2 * weight)], 1) / len(n)).astype(np.float32)
        g_wide = g @ self.out.T * keep * np.where(wide > 0, 1, wide + 1)
        g_mean = (g_wide @ self.hidden[:EMBED].T) / n[:, None].astype(np.float32)
        g_h = np.repeat(g_mean, n, 0) * np.where(h > 0, 1, h + 1)
        return [x.T @ g_h, g_h.sum(0), z.T @ g_wide, g_wide.sum(0), (wide * keep).T @ g, g.sum(0)]


def halves(array):
    """As the file holds it."""
    return array.astype(np.float16).astype(np.float32)


# ---- what is said of held-out walks ----

def said(network, walks, pieces, n, rng):
    """(means, standard deviations) of n footsteps of each piece, at a place of it drawn."""
    first = walks.begin[pieces] + (rng.random(len(pieces)) * (walks.end[pieces] - walks.begin[pieces] - n + 1)).astype(int)
    h = network.embedded(walks.features[(first[:, None] + np.arange(n)).ravel()]).reshape(len(pieces), n, -1)
    return network.read(h.mean(1), np.full(len(pieces), float(n)))


def scores(network, walks, pieces, n):
    """R2 of each logarithm by the posterior's mean."""
    at, weights = np.polynomial.hermite_e.hermegauss(15)
    center, spread = said(network, walks, pieces, n, np.random.default_rng(7))
    r2 = []
    for i in range(COUNT):
        guess = sum(w * np.interp(center[:, i] + spread[:, i] * z, np.linspace(-3, 3, KNOTS), walks.knots[i])
                    for z, w in zip(at, weights / weights.sum()))
        r2.append(1 - ((walks.log[pieces, i] - guess) ** 2).mean() / walks.log[pieces, i].var())
    return r2


def calibrated(network, walks):
    """Factors [COUNT, 6] of the standard deviations after 1, 2, 4, 8, 16 and 32 footsteps, so that held-out intervals cover; of walks of
    12 s few have more than 20."""
    quantile, rng, factors = 1.6448536, np.random.default_rng(3), np.ones((COUNT, 6), np.float32)
    for d, n in enumerate((1, 2, 4, 8, 16, 20)):
        pieces = np.flatnonzero(walks.held & (walks.end - walks.begin >= n))
        ratio = []
        for _ in range(4):
            center, spread = said(network, walks, pieces, n, rng)
            ratio.append(abs(walks.target[pieces] - center) / spread)
        factors[:, d] = np.quantile(np.concatenate(ratio), SHARE, axis=0) / quantile
    return factors


# ---- the alarm ----

class Crossings:
    """Footsteps of walks for the alarm: [n] features, walk, bool right, bool calm (before the first contact with other ground), crossed
    (footsteps on it so far, as the program's judge counts them), minutes of calm walking."""

    def __init__(self, paths, true_states=False):
        parts = [self.read(path, true_states) for path in paths]
        first = np.cumsum([0] + [part[-1] for part in parts])
        self.features, self.right, self.calm, self.crossed = (np.concatenate([part[k] for part in parts]) for k in (0, 2, 3, 4))
        self.walk = np.concatenate([part[1] + at for part, at in zip(parts, first)])
        self.minutes = sum(part[5] for part in parts)

    @staticmethod
    def read(path, true_states):
        walks = np.load(path, mmap_mode="r")
        with open(path.with_suffix(".csv"), newline="", encoding="utf-8") as file:
            lasted = [int(row["lasted"]) for row in csv.DictReader(file)]
        kept, number, frames = [], [], []
        touched = np.zeros(len(walks), int)
        for i, last in enumerate(lasted):
            walk = np.asarray(walks[i, :last])
            on_new = np.flatnonzero((walk[:, 107:109] == 1).any(1))
            touched[i] = on_new[0] if len(on_new) else 0
            for values, begin, end in footsteps(walk[:, :FRAME], walk[:, FRAME:107] if true_states else None):
                kept.append(values.astype(np.float32))
                number.append(i)
                frames.append((begin, end, np.arctan2(walk[begin, 45], walk[begin, 46]) < 0))
        return Crossings.counted(np.array(kept), np.array(number), np.array(frames), touched, np.array(lasted), walks.shape[1])

    @staticmethod
    def counted(features, number, frames, touched, lasted, steps):
        """frames: [n] first frame, frame behind the last, bool right."""
        keep = frames[:, 1] < np.where(lasted < steps, lasted - 50, steps + 1)[number]  # a fall is not walking
        features, number, frames = features[keep], number[keep], frames[keep]
        begin, end, at = frames[:, 0], frames[:, 1], touched[number]
        calm = (at == 0) | (end < at)
        first = np.r_[True, np.diff(number) != 0]
        began = np.where(first, 0, np.r_[0, end[:-1]])
        new = (at > 0) & (end >= at) & (2 * (end - at) >= end - began)
        sums = np.cumsum(new)
        crossed = sums - np.repeat((sums - new)[first], np.diff(np.r_[np.flatnonzero(first), len(new)]))
        return features, number, frames[:, 2] > 0, calm, crossed, (end - begin)[calm].sum() * 0.01 / 60, len(lasted)


def walks_of(steps):
    begin = np.flatnonzero(np.r_[True, np.diff(steps.walk) != 0])
    return [np.arange(a, b) for a, b in zip(begin, np.r_[begin[1:], len(steps.walk)])]


def compared(h, command, rows, bar=math.inf, odds=None):
    """Inputs of the alarm at the footsteps `rows` of a walk but the first two, as the program has them; `odds` of them, where an alarm (odds
    above `bar`) begins anew."""
    mean, asked, before, last, inputs, said = np.zeros(EMBED, np.float32), np.zeros(3, np.float32), 0, [], [], []
    for j in rows:
        if len(last) == 2:
            before = min(before + 1, MEMORY)
            mean = mean + (h[last[0]] - mean) / np.float32(before)
            asked = asked + (command[last[0]] - asked) / np.float32(before)
        last = [*last, j][-2:]
        said.append(-math.inf)
        if before:
            inputs.append(np.concatenate([h[j] - mean, h[last[0]] - mean, mean, command[j] - asked, command[last[0]] - asked,
                                          [1 / before, math.log(before) / 3]]).astype(np.float32))
            if odds:
                said[-1] = odds(inputs[-1][None])[0]
                before, mean, asked = (0, 0 * mean, 0 * asked) if said[-1] > bar else (before, mean, asked)
    return np.array(said) if odds else inputs


def windows(embedded, steps):
    """Inputs of the alarm at each footstep but the first two of each walk; bool: on other ground, for one to four footsteps."""
    h, command, inputs, new = embedded(steps.features), steps.features[:, COMMAND], [], []
    for rows in walks_of(steps):
        chosen = steps.calm[rows[2:]] | ((steps.crossed[rows[2:]] >= 1) & (steps.crossed[rows[2:]] <= 4))
        inputs += [x for x, ok in zip(compared(h, command, rows), chosen) if ok]
        new.append(~steps.calm[rows[2:]][chosen])
    return np.array(inputs), np.concatenate(new)


class Alarm:
    """Log odds that the last two footsteps are on other ground."""

    def __init__(self, rng):
        self.layers = [layer(rng, inputs, outputs) for inputs, outputs in zip(ODDS, (*ODDS[1:], 1))]

    def read(self, x, rng=None, drop=0.15):
        """rng: for training, whose inputs of layers and dropouts are kept."""
        self.inputs, self.kept = [], []
        for i, (weight, bias) in enumerate(self.layers):
            self.inputs.append(x)
            x = x @ weight + bias
            if i < len(self.layers) - 1:
                x = elu(x)
                self.kept.append((x, 1 if rng is None else (rng.random(x.shape, dtype=np.float32) > drop) / np.float32(1 - drop)))
                x = x * self.kept[-1][1]
        return x[:, 0]

    def train(self, x, new, rng, steps=10000, rate=1e-3, batch=512):
        adam = Adam([p for pair in self.layers for p in pair], 0.3)
        old, late = np.flatnonzero(~new), np.flatnonzero(new)
        for k in range(steps):
            own = np.r_[rng.choice(old, batch * 3 // 4), rng.choice(late, batch // 4)]
            share = 1 / (1 + np.exp(-np.clip(self.read(x[own], rng), -30, 30)))
            g, gradients = ((share - new[own]) / batch).astype(np.float32)[:, None], []
            for i in range(len(self.layers) - 1, -1, -1):
                gradients = [self.inputs[i].T @ g, g.sum(0), *gradients]
                if i:
                    out, keep = self.kept[i - 1]
                    g = g @ self.layers[i][0].T * keep * np.where(out > 0, 1, out + 1)
            adam.step(gradients, rate * 0.5 * (1 + math.cos(math.pi * k / steps)))
        return self


    def set_bar(self, embedded, steps, per_10_min):
        """The lowest threshold, in halves, with at most so many alarms in these walks without a border."""
        h, command, walks = embedded(steps.features), steps.features[:, COMMAND], walks_of(steps)
        most, best = [compared(h, command, rows, odds=self.read).max() for rows in walks], math.inf
        for bar in np.arange(16, 0, -1) / 2:
            if sum((compared(h, command, rows, bar, self.read) > bar).sum() for rows, odds in zip(walks, most) if odds > bar) > \
                    per_10_min * steps.minutes / 10:
                break
            best = bar
        return float(best)


# ---- commands ----

HALVES = ("embed", "hidden", "odds", "odds_second", "odds_out")  # are in half precision in the file


def load(path):
    """Tensors of a safetensors file by name; its note."""
    raw = pathlib.Path(path).read_bytes()
    end = 8 + int.from_bytes(raw[:8], "little")
    header = json.loads(raw[8:end])
    note = header.pop("__metadata__")["note"]
    return {name: np.frombuffer(raw[end + at["data_offsets"][0] : end + at["data_offsets"][1]], {"F32": "<f4", "F16": "<f2"}[at["dtype"]])
            .reshape(at["shape"]) for name, at in header.items()}, note


def save(path, tensors, note):
    """A safetensors file with the checksum that the program asks for (src/learn/safetensors.h)."""
    header, at = {"__metadata__": {"crc32": "00000000", "note": note}}, 0
    kinds = {name: "f2" if name in HALVES else "f4" for name in sorted(tensors, key=lambda name: name not in HALVES)}
    for name, kind in kinds.items():
        size = tensors[name].size * int(kind[1])
        header[name] = {"dtype": {"f4": "F32", "f2": "F16"}[kind], "shape": list(tensors[name].shape), "data_offsets": [at, at + size]}
        at += size
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    whole = len(text).to_bytes(8, "little") + text + b"".join(tensors[name].astype("<" + kind).tobytes() for name, kind in kinds.items())
    pathlib.Path(path).write_bytes(whole.replace(b'"crc32":"00000000"', f'"crc32":"{zlib.crc32(whole):08x}"'.encode(), 1))


def walk(given):
    given.out.mkdir(parents=True, exist_ok=True)
    for name, options in WALKS.items():
        subprocess.run([os.environ.get("MILD", ROOT / "build/mild"), "know", "--threads", str(given.threads), *map(str, options),
                        "--walks", given.out / f"{name}.npy"], check=True)


def learn(walks, rng, epochs, kind):
    network = Network(walks.features.shape[1], rng).train(walks, rng, epochs)
    for n in (1, 4, 16):
        pieces = np.flatnonzero(walks.held & (walks.end - walks.begin >= n))
        print(f"{kind}, {n:2d} footsteps of {len(pieces)} held-out walks: R2 of log " +
              ", ".join(f"{name} {value:.2f}" for name, value in zip(NAMES, scores(network, walks, pieces, n))), flush=True)
    return network


def bound(given):
    for kind, true_states in (("the sensors", False), ("the true states", True)):
        learn(Walks(sorted(given.walks.glob("learn*.npy")), true_states), np.random.default_rng(given.seed), given.epochs, kind)


def train(given):
    rng = np.random.default_rng(given.seed)
    walks = Walks(sorted(given.walks.glob("learn*.npy")))
    network = learn(walks, rng, given.epochs, "the sensors")
    # as the program has it: the features' scale within the weights, in half precision
    network.embed_bias = network.embed_bias - network.mean / network.scale @ network.embed
    network.embed = halves(network.embed / network.scale[:, None])
    network.mean, network.scale = np.zeros_like(network.mean), np.ones_like(network.scale)
    network.hidden = halves(network.hidden)
    widen = calibrated(network, walks)
    save(given.out, {"embed": network.embed, "embed_bias": network.embed_bias, "hidden": network.hidden, "hidden_bias": network.hidden_bias,
                     "out": network.out, "out_bias": network.out_bias, "prior": walks.knots, "widen": widen,
                     **learn_alarm(given, network.embedded)}, f"lab/know/know.py train --seed {given.seed}")


def crossings(given, *kinds):
    return Crossings([path for kind in kinds for path in sorted(given.walks.glob(f"{kind}*.npy"))])


def learn_alarm(given, embedded):
    """Tensors of the alarm."""
    rng = np.random.default_rng(given.seed)
    alarm = Alarm(rng).train(*windows(embedded, crossings(given, "border", "calm")), rng)
    alarm.layers = [(halves(weight), bias) for weight, bias in alarm.layers]
    long = crossings(given, "long")
    bar = alarm.set_bar(embedded, long, PER_10_MIN)
    print(f"alarm at log odds of {bar}, by {long.minutes:.0f} min of calm walks")
    tensors = {"alarm": np.array([bar])}
    for name, (weight, bias) in zip(("odds", "odds_second", "odds_out"), alarm.layers):
        tensors[name], tensors[f"{name}_bias"] = weight, bias
    return tensors


def alarm_alone(given):
    tensors, note = load(given.weights)
    embed, bias = (tensors[name].astype(np.float32) for name in ("embed", "embed_bias"))
    learned = learn_alarm(given, lambda features: elu(features @ embed + bias))
    save(given.weights, {**tensors, **learned}, note.split("; ")[0] + f"; lab/know/know.py alarm --seed {given.seed}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parts = parser.add_subparsers(required=True)
    one = parts.add_parser("walk")
    one.add_argument("--out", type=pathlib.Path, required=True)
    one.add_argument("--threads", type=int, default=0)
    one.set_defaults(run=walk)
    for name, run, epochs in (("train", train, 60), ("bound", bound, 60)):
        one = parts.add_parser(name)
        one.add_argument("walks", type=pathlib.Path)
        one.add_argument("--seed", type=int, default=1)
        one.add_argument("--epochs", type=int, default=epochs)
        one.set_defaults(run=run)
        if run is train:
            one.add_argument("--out", type=pathlib.Path, required=True)
    one = parts.add_parser("alarm")
    one.add_argument("walks", type=pathlib.Path)
    one.add_argument("--weights", type=pathlib.Path, required=True, help="read, and written again")
    one.add_argument("--seed", type=int, default=1)
    one.set_defaults(run=alarm_alone)
    given = parser.parse_args()
    given.run(given)


if __name__ == "__main__":
    main()
