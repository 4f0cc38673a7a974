#!/usr/bin/env python3
"""What makes a policy robust on soft ground? Trains a G1 by several recipes, a training of half a minute each, and judges them all.

  scripts/recipes.py runs/recipes --gpus 0,1 --seeds 10        # an H200 takes 2 min 20 s for the recipes of one seed
  scripts/recipes.py runs/recipes --report                     # the table of what is there

Every recipe is configs/g1.ini, 350 updates, and what RECIPES changes. Judged at 0.5 m/s, 20 trials a cell: S50, the stiffness at which
half of the trials of 20 s stay up, on straight springs (as `mild trial --sweep stiffness`) of STIFFNESS, between whose places it is
interpolated; then GROUNDS. A number is the interquartile mean over the seeds (of fewer than four the mean) with its 90 % bootstrap interval
(Agarwal et al. 2021). FOLDER keeps policies and results, and a command that is run again goes on from there."""
import argparse
import concurrent.futures
import json
import math
import os
import pathlib
import queue
import shlex
import shutil
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "build/python"))
try:
    import numpy as np
    from mild import sweep
except ImportError as missing:
    sys.exit(f"recipes.py: {missing}: make build, then .venv/bin/python scripts/recipes.py")

MILD = shlex.split(os.environ.get("MILD", str(ROOT / "build/mild")))
RIGID = ["--randomize.rigid_share=1", "--randomize.preset_share=0"]
LOW = ["--task.swing_apex=0.05", "--reward.reference_amplitude=0.25"]
RECIPES = {
    "rigid": ("rigid floor, feet lifted 110 mm", RIGID),
    "rigid_low": ("rigid floor, feet lifted 55 mm", RIGID + LOW),
    "rigid_wide": ("rigid floor, wide stance, short steps", RIGID + ["--task.gait_period=0.5", "--reward.feet_range=0.26 0.36"]),
    "springs": ("elastic ground of random stiffness", ["--randomize.preset_share=0", "--randomize.recovery=1 1"]),
    "slipless": ("all grounds, slip costs nothing", ["--randomize.slip_share=0"]),
    "all": ("all grounds: configs/g1.ini", []),
    "all_low": ("all grounds, feet lifted 55 mm", LOW),
}
SHORT = ["--train.iterations=350", "--ppo.anneal=240 350", "--train.device=cuda"]
STIFFNESS = np.geomspace(0.1, 10, 11)  # [MPa/m]
GROUNDS = {"rigid": [], "foam45": [], "sand_loose": [], "dry_sand_loose": [],
           "slipping sand": ["--ground.slip_length=0.0025", "--ground.grip=0.1"]}  # of sand_loose
WALK = ["--robot", "g1", "--speed", 0.5, "--trials", 20, "--seconds", 20, "--seed", 7]


def mild(*arguments, **options):
    return subprocess.run([*MILD, *map(str, arguments)], capture_output=True, text=True, check=False, **options)


def train(folder, name, seed, gpu):
    """Trains FOLDER/NAME-SEED.safetensors."""
    run = folder / f"{name}-{seed}"
    shutil.rmtree(run, ignore_errors=True)  # of a training that was interrupted
    done = mild("train", "--config", ROOT / "configs/g1.ini", *SHORT, *RECIPES[name][1], f"--train.seed={seed}", "--out", run,
                env={**os.environ, "CUDA_VISIBLE_DEVICES": gpu})
    if done.returncode:
        raise RuntimeError(f"{name}, seed {seed}: {done.stderr.strip()}")
    os.replace(run / "policy.safetensors", run.with_suffix(".safetensors"))


def rows(policy, *arguments):
    done = mild("eval", "--policy", policy, *WALK, *arguments, "--json", "-")
    if done.returncode:
        raise RuntimeError(f"{policy}: {done.stderr.strip()}")
    return json.loads(done.stdout[done.stdout.index("{"):])["rows"]


def spring(value):
    """Options that make a ground a straight spring of value [MPa/m]."""
    spring = sweep.QUANTITIES["stiffness"]
    return ["--ground", spring.ground, *(f"--ground.{key}={number:.9g}" for key, number in spring.fields(value).items())]


def s50(shares):
    """Where the share of trials that stay up crosses a half, between places of STIFFNESS; its ends where it does not."""
    above = np.flatnonzero(np.array(shares) < 0.5)
    if not len(above):
        return STIFFNESS[0]
    i = above[-1]
    if i + 1 == len(STIFFNESS):
        return STIFFNESS[-1]
    part = (0.5 - shares[i]) / (shares[i + 1] - shares[i])
    return float(STIFFNESS[i] * (STIFFNESS[i + 1] / STIFFNESS[i]) ** part)


def judge(policy):
    """Writes POLICY.json."""
    shares = [rows(policy, *spring(value))[0]["success"] / 20 for value in STIFFNESS]
    table = {}
    for name, options in GROUNDS.items():
        row = rows(policy, "--ground", "sand_loose" if options else name, *options)[0]
        table[name] = {"up": row["success"] / row["trials"], "speed": row["velocity"], "cost": row["cot"]}
    text = json.dumps({"stiffness": list(STIFFNESS), "up": shares, "s50": s50(shares), "grounds": table}, indent=1)
    part = policy.with_suffix(".part")
    part.write_text(text + "\n", encoding="utf-8")
    os.replace(part, policy.with_suffix(".json"))


def middle(values):
    """Interquartile mean with its 90 % bootstrap interval."""
    def mean(sample):
        ordered = np.sort(sample, axis=-1)
        cut = ordered.shape[-1] // 4
        return ordered[..., cut : ordered.shape[-1] - cut].mean(-1)

    values = np.array(values, float)
    again = mean(np.random.default_rng(1).choice(values, (4000, len(values))))
    return mean(values), *np.quantile(again, [0.05, 0.95])


def report(folder):
    """Prints a Markdown table."""
    print("| trained on | seeds | S50 [MPa/m] |", " | ".join(f"up on {ground}, m/s" for ground in GROUNDS), "| cost of transport on rigid |")
    print("|" + "---|" * (len(GROUNDS) + 4))
    for name, (what, _) in RECIPES.items():
        found = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.glob(f"{name}-[0-9]*.json"))]
        if not found:
            continue
        centre, low, high = np.exp(middle([math.log(one["s50"]) for one in found]))
        cells = []
        for ground in GROUNDS:
            up, least, most = (100 * share for share in middle([one["grounds"][ground]["up"] for one in found]))
            speeds = [one["grounds"][ground]["speed"] for one in found if one["grounds"][ground]["up"] > 0.5]
            cells.append(f"{up:.0f} % ({least:.0f}..{most:.0f})" + (f", {middle(speeds)[0]:.2f}" if speeds else ""))
        cost = middle([one["grounds"]["rigid"]["cost"] or np.nan for one in found])[0]
        print(f"| {what} | {len(found)} | {centre:.3g} ({low:.3g}..{high:.3g}) |", " | ".join(cells), f"| {cost:.2f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--gpus", default="0", help="numbers of the GPUs, a training on each at a time")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="policies that are judged at a time")
    parser.add_argument("--seconds", type=float, default=math.inf, help="no training begins that would end later")
    parser.add_argument("--report", action="store_true")
    given = parser.parse_args()
    if not given.report:
        end = time.monotonic() + given.seconds
        given.folder.mkdir(parents=True, exist_ok=True)
        waiting = queue.SimpleQueue()
        judges = concurrent.futures.ThreadPoolExecutor(given.jobs)
        judged = []
        for seed in range(1, given.seeds + 1):
            for name in RECIPES:
                policy = given.folder / f"{name}-{seed}.safetensors"
                if not policy.exists() and not policy.with_suffix(".json").exists():
                    waiting.put((name, seed))
                elif not policy.with_suffix(".json").exists():
                    judged.append(judges.submit(judge, policy))

        def work(gpu):
            longest = 30.0
            while time.monotonic() + longest < end:
                try:
                    name, seed = waiting.get_nowait()
                except queue.Empty:
                    return
                began = time.monotonic()
                train(given.folder, name, seed, gpu)
                longest = max(longest, time.monotonic() - began)
                judged.append(judges.submit(judge, given.folder / f"{name}-{seed}.safetensors"))

        gpus = given.gpus.split(",")
        with concurrent.futures.ThreadPoolExecutor(len(gpus)) as trainers:
            trained = [trainers.submit(work, gpu) for gpu in gpus]
        try:
            for one in (*trained, *judged):
                one.result()
        except RuntimeError as error:
            sys.exit(f"recipes.py: {error}")
    report(given.folder)


if __name__ == "__main__":
    main()
