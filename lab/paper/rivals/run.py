"""What the training scripts of the rivals share: options, phases, the log, saving."""
import argparse
import dataclasses
import pathlib
import sys
import time

import torch

from envs import ROOT, Envs

CONFIG = ROOT / "configs" / "walk.ini"  # our task: commands, rewards, randomisation
# Stages, whose rewards the rivals get too.
GAIT = {
    "terrain__kind": "flat", "task__wz": [-1, 1], "randomize__push_linear": 0.3, "randomize__push_angular": 0.3,
    "reward__linear_velocity": 5, "reward__yaw_rate": 1.5, "reward__reference_motion": 2.2, "reward__torque": -1e-10,
    "reward__power": 0}
RIGID = {"randomize__model": "rigid", "train__grounds": 16}


def options(text, minutes):
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, type=pathlib.Path, help="folder to write to")
    parser.add_argument("--minutes", type=float, default=minutes, help=f"[min] of training (default {minutes:g})")
    parser.add_argument("--iterations", type=int, default=0, help="stop after so many; 0: no limit")
    parser.add_argument("--envs", type=int, default=8192, help="environments (default 2048 for clock, 4096 for ht2)")
    parser.add_argument("--device", default="cuda", help="cuda, cuda:N or cpu (default cuda)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--go-on", type=pathlib.Path, help="state.pt of an earlier run: only the last phase is trained, from there")
    parser.add_argument("--config", type=pathlib.Path, default=CONFIG, help="the task (default configs/walk.ini)")
    parser.add_argument("--model", help="train on this ground model and the task of --config as they are, in the place of stages on rigid "
                        "ground (lab/paper/factorial.py)")
    parser.add_argument("--kl-target", type=float, help="[nat] of the learner (default: the method's)")
    parser.add_argument("--entropy", type=float, help="weight of the learner (default: the method's)")
    return parser


def begin(arguments):
    """Sets PyTorch up and returns the device."""
    if (arguments.out / "log.csv").exists():
        sys.exit(f"{arguments.out} holds a run, which would be overwritten; choose another --out")
    arguments.out.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(arguments.seed)
    torch.backends.cuda.matmul.allow_tf32 = True
    torch.backends.cudnn.allow_tf32 = True
    return torch.device(arguments.device)


def tuned(arguments, settings):
    """Settings of the learner with what the options set."""
    asked = {"kl_target": arguments.kl_target, "entropy": arguments.entropy}
    return dataclasses.replace(settings, **{name: value for name, value in asked.items() if value is not None})


def open_envs(arguments, keys):
    """keys: of a stage; with --model only its helping hand, which is the method's and not the task's."""
    where = {"train__envs": arguments.envs, "train__device": arguments.device, "train__seed": arguments.seed}
    if arguments.device == "cpu":
        where["train__robots"] = "mujoco"
    if arguments.model:
        keys = {"randomize__model": arguments.model, **{key: value for key, value in keys.items() if key == "task__assist"}}
    else:
        keys = {**RIGID, **keys}
    return Envs(arguments.config, **where, **keys)


class Progress:
    """Time of a run, and its log: a line for people every `every` seconds, a row of log.csv for every iteration."""

    def __init__(self, arguments, every=10):
        self.limit, self.iterations, self.every = 60 * arguments.minutes, arguments.iterations, every
        self.start = self.shown = self.last = time.time()
        self.iteration, self.file, self.names = 0, open(arguments.out / "log.csv", "w", encoding="ascii"), None

    def share(self):
        """0 .. 1 of the run."""
        by_time = (time.time() - self.start) / self.limit
        return max(by_time, self.iteration / self.iterations) if self.iterations else by_time

    def over(self):
        return self.share() >= 1

    def log(self, numbers, steps):
        """steps: policy steps of all environments in this iteration. Returns whether a line was shown."""
        now = time.time()
        row = {"iteration": self.iteration, "seconds": now - self.start, "steps_per_s": steps / (now - self.last),
               "policy_steps": steps * (self.iteration + 1), **numbers}
        if not self.names:
            self.names = list(row)
            print(",".join(self.names), file=self.file)
        print(",".join(f"{row.get(name, 0):.6g}" for name in self.names), file=self.file, flush=True)
        self.last, self.iteration = now, self.iteration + 1
        if now - self.shown < self.every and not self.over():
            return False
        self.shown = now
        falls = row["falls"] / row["episodes"] if row["episodes"] else 0
        print(f"{row['seconds']:6.0f} s  iteration {row['iteration']:5d}  {row['steps_per_s'] / 1e6:.2f} M steps/s  "
              f"reward {100 * row['paid'] / max(row['steps'], 1):6.2f}/s  episode {row['length']:5.1f} s  falls {100 * falls:3.0f} %  "
              f"speed error {row['speed_error']:.2f} m/s  assist {row['assist']:.2f}  rate {row['rate']:.1e}  std {row['std']:.2f}  "
              f"kl {row.get('kl', 0):.4f}  rollout {row['rollout_s']:.2f} s  diverged {row['diverged']}", flush=True)
        return True
