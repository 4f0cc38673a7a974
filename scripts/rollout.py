#!/usr/bin/env python3
"""Rate of rollouts by Gymnasium against that of `mild bench train`, in turns; docs/python.md.
Usage: PYTHONPATH=build/python .venv/bin/python scripts/rollout.py [--mild build/mild] [--rounds 3] [--envs 1024]"""
import argparse
import json
import pathlib
import statistics
import subprocess
import tempfile
import time

import gymnasium
import numpy as np

import mild  # noqa: F401, registers the environments


def program(path, envs):
    """Steps per second of the environments in `mild bench train`: what its physics, ground and task take."""
    with tempfile.TemporaryDirectory() as folder:
        report = pathlib.Path(folder, "bench.json")
        subprocess.run([path, "bench", "train", f"--train.envs={envs}", "--json", report], check=True, stdout=subprocess.DEVNULL)
        rows = {row["case"]: row["value"] for row in json.loads(report.read_text())["rows"]}
    return 1e6 / (rows["physics"] + rows["ground"] + rows["task"])


def package(envs, seconds=20):
    """Steps per second of gymnasium.make_vec, with actions as a policy that begins draws them."""
    env = gymnasium.make_vec("mild/SA01-v0", num_envs=envs)
    env.reset(seed=1)
    actions = [np.random.default_rng(k).standard_normal(env.action_space.shape, np.float32) for k in range(8)]
    start, steps = time.perf_counter(), 0
    while time.perf_counter() - start < seconds:
        env.step(actions[steps % 8])
        steps += 1
    rate = steps * envs / (time.perf_counter() - start)
    env.close()
    return rate


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mild", default="build/mild")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--envs", type=int, default=1024)
    options = parser.parse_args()
    ratios = []
    for _ in range(options.rounds):
        ours, theirs = package(options.envs), program(options.mild, options.envs)
        ratios.append(ours / theirs)
        print(f"gymnasium {ours:9.0f} steps/s, bench train {theirs:9.0f} steps/s, ratio {ratios[-1]:.3f}", flush=True)
    print(f"median of the ratios {statistics.median(ratios):.3f}")


if __name__ == "__main__":
    main()
