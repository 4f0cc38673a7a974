#!/usr/bin/env python3
"""How many changes of ground can be detected at all (docs/identify.md): borders flagged within two and four footsteps, from the sensors of the
SA01 and from its true states, by the same watch, at equal false alarms.

  scripts/know_limit.py walk --out out/limit     # 12 000 walks over borders, 20 h without; half an hour of two quiet cores, 10 GB
  scripts/know_limit.py limit out/limit

The watch compares the last two footsteps with those before of the same foot, since the command last changed. It is not the alarm that the
program has (scripts/know.py), which it does not beat on the sensors; it needs no network of its own for the true states. Needs NumPy."""
import argparse
import math
import os
import pathlib
import subprocess
import sys

import numpy as np

sys.dont_write_bytecode = True
import know  # noqa: E402

TRACE, SEEN = 64, 48  # sums of a footstep that are compared, and by which the watch knows the walk
ODDS = 4 * TRACE + SEEN + 2, 96, 32  # widths: input, hidden
PAUSE, REFERENCE = 2, 12  # footsteps after a sudden change of the command; of the same foot in a mean, of more the oldest fade
SUDDEN = np.array([0.2, 0.2, 0.25])  # change of the command from one footstep to the next, as in the frames
WALKS = {**{f"border{seed}": ("--grounds", 3000, "--seed", seed, "--changes", 1) for seed in (11, 12, 13, 14)},
         "calm": ("--grounds", 2400, "--seconds", 30, "--changes", 0, "--seed", 21)}


class Differences:
    """The last two footsteps less the mean of those before of the same side, since the command last changed or the walk began: [n, features] newer and
    older, mean of both sides, [n, 2] numbers of footsteps in the means."""

    def __init__(self, steps):
        channels = (steps.features.shape[1] - 4) // (know.BINS + 1)
        command = steps.features[:, know.BINS * channels : know.BINS * channels + 3].copy()
        command[steps.right, 1:] *= -1
        rows, newer, older, mean, count = [], [], [], [], []
        for j, side in enumerate(steps.right.astype(int)):
            if j == 0 or steps.walk[j] != steps.walk[j - 1]:
                n, sums, last, pause = [0, 0], [None, None], [], PAUSE
            elif (abs(command[j] - command[j - 1]) > SUDDEN).any():
                n, last, pause = [0, 0], [], PAUSE
            if pause:
                pause -= 1
                continue
            if len(last) == 2:
                k = last.pop(0)
                at = int(steps.right[k])
                n[at] = min(n[at] + 1, REFERENCE)
                sums[at] = steps.features[k].copy() if n[at] == 1 else sums[at] + (steps.features[k] - sums[at]) / np.float32(n[at])
            last.append(j)
            if len(last) == 2 and min(n) > 0 and steps.right[last[0]] != steps.right[j]:
                rows.append(j)
                newer.append(steps.features[j] - sums[side])
                older.append(steps.features[last[0]] - sums[1 - side])
                mean.append((sums[0] + sums[1]) / 2)
                count.append((n[side], n[1 - side]))
        self.newer, self.older, self.mean = (np.array(x, np.float32) for x in (newer, older, mean))
        self.count, self.minutes = np.array(count), steps.minutes
        self.walk, self.calm, self.crossed = steps.walk[rows], steps.calm[rows], steps.crossed[rows]

    def take(self, chosen):
        part = object.__new__(Differences)
        part.__dict__ = {k: v if np.ndim(v) == 0 else v[chosen] for k, v in self.__dict__.items()}
        return part


class Watch:
    """Log odds that the last two footsteps are on other ground. Of a footstep it sees TRACE numbers, the directions in which a change of
    ground stands out most from the scatter of walking (Fisher's), and of the means before these two SEEN more, their largest components."""

    def __init__(self, walks, rng):
        old, new = walks.calm, walks.crossed == 2
        own = walks.newer[old] / np.sqrt(1 + 1 / walks.count[old, :1]).astype(np.float32)
        scale = own.std(0) + 1e-6
        within = np.linalg.inv(np.linalg.cholesky(np.cov((own[::3] / scale).T) + 0.02 * np.eye(len(scale))))
        other = np.concatenate([walks.newer[new], walks.older[new]]) / scale
        vectors = np.linalg.eigh(within @ (other.T @ other / len(other)) @ within.T)[1][:, ::-1]
        mean, spread = walks.mean.mean(0), walks.mean.std(0) + 1e-6
        seen = np.linalg.eigh(np.cov(((walks.mean - mean) / spread).T))[1][:, ::-1][:, :SEEN] / spread[:, None]
        seen /= (walks.mean @ seen).std(0)
        self.trace = np.concatenate([(within.T @ vectors)[:, :TRACE] / scale[:, None], seen], 1).astype(np.float32)
        self.bias = (-mean @ self.trace).astype(np.float32)
        self.layers = [know.layer(rng, inputs, outputs) for inputs, outputs in zip(ODDS, (*ODDS[1:], 1))]

    def see(self, walks):
        compared = [x @ self.trace[:, :TRACE] / np.sqrt(1 + 1 / walks.count[:, k, None]) for k, x in enumerate((walks.newer, walks.older))]
        return np.concatenate([*compared, *map(abs, compared), walks.mean @ self.trace[:, TRACE:] + self.bias[TRACE:],
                               1 / walks.count], 1).astype(np.float32)

    def read(self, x, rng=None, drop=0.15):
        """rng: for training, whose inputs of layers and dropouts are kept."""
        self.inputs, self.kept = [], []
        for i, (weight, bias) in enumerate(self.layers):
            self.inputs.append(x)
            x = x @ weight + bias
            if i < len(self.layers) - 1:
                x = know.elu(x)
                self.kept.append((x, 1 if rng is None else (rng.random(x.shape, dtype=np.float32) > drop) / np.float32(1 - drop)))
                x = x * self.kept[-1][1]
        return x[:, 0]

    def train(self, walks, rng, steps, rate=1.5e-3):
        """A batch has 768 calm footsteps, 256 second ones on other ground and 96 first, third and fourth ones."""
        adam = know.Adam([p for pair in self.layers for p in pair], 0.1)
        kinds = [(np.flatnonzero(chosen), n) for chosen, n in ((walks.calm, 768), (walks.crossed == 2, 256),
                                                              (np.isin(walks.crossed, (1, 3, 4)) & ~walks.calm, 96))]
        x = self.see(walks)
        new = np.r_[np.zeros(768), np.ones(352)].astype(np.float32)
        for k in range(steps):
            own = np.concatenate([rng.choice(rows, n) for rows, n in kinds])
            share = 1 / (1 + np.exp(-np.clip(self.read(x[own], rng), -30, 30)))
            g, gradients = ((share - new) / len(own)).astype(np.float32)[:, None], []
            for i in range(len(self.layers) - 1, -1, -1):
                gradients = [self.inputs[i].T @ g, g.sum(0), *gradients]
                if i:
                    out, keep = self.kept[i - 1]
                    g = g @ self.layers[i][0].T * keep * np.where(out > 0, 1, out + 1)
            adam.step(gradients, rate * 0.5 * (1 + math.cos(math.pi * k / steps)))
        return self

    def threshold(self, walks, per_10_min):
        """So that alarms in calm walks are so many; within four footsteps of another one of the same walk it is the same."""
        odds, calm = self.read(self.see(walks)), np.flatnonzero(walks.calm)
        allowed, best = per_10_min * walks.minutes / 10, math.inf
        for bar in np.sort(odds[calm])[::-1][: int(20 * allowed) + 2]:
            rows = calm[odds[calm] >= bar]
            again = (np.diff(rows) <= 4) & (np.diff(walks.walk[rows]) == 0)
            if len(rows) - again.sum() > allowed:
                break
            best = bar
        return float(best)

    def flagged(self, walks, bar):
        """Shares of the borders with four footsteps behind them, of which the first two or four are flagged."""
        odds, whole = self.read(self.see(walks)), np.unique(walks.walk[walks.crossed >= 4])
        return [len(np.intersect1d(whole, walks.walk[(odds > bar) & ~walks.calm & (walks.crossed >= 1) & (walks.crossed <= n)])) / len(whole)
                for n in (2, 4)]


def walk(given):
    given.out.mkdir(parents=True, exist_ok=True)
    for name, options in WALKS.items():
        subprocess.run([os.environ.get("MILD", know.ROOT / "build/mild"), "know", "--quiet", "0.2", *map(str, options),
                        "--walks", given.out / f"{name}.npy"], check=True)


def limit(given):
    for kind, true_states in (("the sensors", False), ("the true states", True)):
        rng = np.random.default_rng(given.seed)
        walks = Differences(know.Crossings([given.walks / f"{name}.npy" for name in WALKS], true_states))
        held = walks.walk % 5 == 0
        watch = Watch(walks.take(~held), rng).train(walks.take(~held), rng, given.steps)
        rest = walks.take(held)
        rest.minutes /= 5
        for rate in (0.3, 0.6, 0.9):
            two, four = watch.flagged(rest, watch.threshold(rest, rate))
            print(f"{kind}, {rate} false alarms in 10 min: {two:.3f} of the borders within two footsteps, {four:.3f} within four", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parts = parser.add_subparsers(required=True)
    one = parts.add_parser("walk")
    one.add_argument("--out", type=pathlib.Path, required=True)
    one.set_defaults(run=walk)
    one = parts.add_parser("limit")
    one.add_argument("walks", type=pathlib.Path)
    one.add_argument("--seed", type=int, default=1)
    one.add_argument("--steps", type=int, default=6000, help="of the watch's training")
    one.set_defaults(run=limit)
    given = parser.parse_args()
    given.run(given)


if __name__ == "__main__":
    main()
