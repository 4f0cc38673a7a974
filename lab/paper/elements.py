#!/usr/bin/env python3
"""What a coarser raster of the soles costs: policies of configs/quick.ini trained on n elements a foot, judged on all of the SA01's 77.

  lab/paper/elements.py runs/elements --devices cuda:0,cuda:1 --jobs 2 --train     # 12 trainings, two at a time on each GPU
  lab/paper/elements.py runs/elements --devices cuda:0,cuda:1 --jobs 2 --train --seconds 570     # what fits; again: it goes on
  lab/paper/elements.py runs/elements --judge                                      # of what is trained, on the CPU, and the table
  lab/paper/elements.py runs/elements --elements 77,10 --seeds 1 --trials 3 -- --train.iterations=20   # options of mild train

Without --train and --judge it does both. FOLDER/N-SEED.safetensors is a policy, .csv the log of its training, .log what that printed,
.json its judge. What is there is kept. A seed of all n comes first, so that what was cut is whole in fewer seeds. No training begins
that would not end by --seconds, after the longest of this start; one that does not end by then is given up. The rate is the median over
a training's iterations, so with --jobs 2 that of half a GPU. MILD is the program (default build/mild)."""
import argparse
import csv
import pathlib
import queue
import statistics
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor

from deviations import measures, spread
from measure import ALONE, MILD, NINE, OF_PAPER, ROOT, mild

CONFIG = ROOT / "configs/quick.ini"
TRAIN = ["--train.envs=4096", "--train.minutes=0", "--train.iterations=400", "--ppo.anneal=280 400", "--ppo.steps=24", "--ppo.optimizer=adam",
         "--reward.linear_velocity=5"]
GPU = ["--ppo.matmul=bf16"]
SPEEDS = "0.3,0.6"


class Trainings:
    """Of tasks (elements, seed), each on the next free device."""

    def __init__(self, given):
        self.given, self.end, self.longest = given, time.monotonic() + given.seconds, 0
        self.devices = queue.Queue()
        for device in given.devices * given.jobs:
            self.devices.put(device)

    def train(self, task, device, work):
        """Its exit code; None: given up. Its files are whole, because the policy comes last."""
        given, log = self.given, path_of(self.given, task, "log")
        words = [*MILD, "train", "--config", CONFIG, "--out", work / "run", f"--train.device={device}", *TRAIN,
                 *(GPU if device != "cpu" else ["--train.robots=batch"]), f"--train.seed={task[1]}", f"--task.sole_elements={task[0]}", *given.options]
        with open(log, "w", encoding="utf-8") as file:
            left = self.end - time.monotonic()
            try:
                code = subprocess.run(list(map(str, words)), stdout=file, stderr=subprocess.STDOUT, cwd=ROOT, check=False, timeout=left).returncode
            except subprocess.TimeoutExpired:
                return None
        if code == 0:
            path_of(given, task, "json").unlink(missing_ok=True)
            for name, end in (("log.csv", "csv"), ("policy.safetensors", "safetensors")):
                part = path_of(given, task, "part")
                part.write_bytes((work / "run" / name).read_bytes())
                part.replace(path_of(given, task, end))
        return code

    def work(self, task):
        """Whether it is trained."""
        name = "%d-%d" % task
        device = self.devices.get()
        try:
            begin = time.monotonic()
            if begin + self.longest >= self.end:
                return False
            print(f"{name}: begins on {device}", flush=True)
            with tempfile.TemporaryDirectory() as work:
                code = self.train(task, device, pathlib.Path(work))
            seconds = time.monotonic() - begin
        finally:
            self.devices.put(device)
        if code == 0:
            self.longest = max(self.longest, seconds)
            print(f"{name}: {seconds:.0f} s, {rate_of(self.given, task) / 1e3:.1f} k policy steps/s", flush=True)
        elif code is None:
            print(f"{name}: given up after {seconds:.0f} s", flush=True)
        else:
            last = (path_of(self.given, task, "log").read_text(encoding="utf-8").strip().splitlines() or ["no message"])[-1]
            print(f"elements.py: {name}: {last}", file=sys.stderr, flush=True)
        return code == 0


def tasks_of(given):
    """A seed of all first."""
    return [(n, seed) for seed in range(1, given.seeds + 1) for n in given.elements]


def path_of(given, task, end):
    return given.folder / ("%d-%d.%s" % (*task, end))


def has(given, task, end):
    return path_of(given, task, end).is_file()


def rate_of(given, task):
    """[policy steps/s]; 0 of a policy that came without its log."""
    if not has(given, task, "csv"):
        return 0.0
    with open(path_of(given, task, "csv"), newline="", encoding="utf-8") as file:
        return statistics.median(float(row["rate/steps_per_s"]) for row in csv.DictReader(file))


def train(given):
    """Whether all are trained."""
    tasks = [task for task in tasks_of(given) if not has(given, task, "safetensors")]
    print(f"{len(tasks)} of {len(tasks_of(given))} trainings left", flush=True)
    trainings = Trainings(given)
    with ThreadPoolExecutor(len(given.devices) * given.jobs) as pool:
        return all(list(pool.map(trainings.work, tasks)))


def judge(given):
    """On the robot's own raster, whatever the training had."""
    for task in tasks_of(given):
        if has(given, task, "safetensors") and not has(given, task, "json"):
            part = path_of(given, task, "part")
            begin = time.monotonic()
            mild("eval", "--policy", path_of(given, task, "safetensors"), "--config", CONFIG, *ALONE, *OF_PAPER, "--train.device=cpu", "--train.robots=mujoco", "--ground",
                 given.ground, "--speed", SPEEDS, "--trials", given.trials, "--json", part)
            part.replace(path_of(given, task, "json"))
            print("%d-%d: judged in %.0f s" % (*task, time.monotonic() - begin), flush=True)


def table(given):
    print("| elements a foot | seed | k policy steps/s | upright | speed off [m/s] | cost of transport |\n|---|---|---|---|---|---|")
    for n in given.elements:
        rows = []
        for task in tasks_of(given):
            if task[0] == n and has(given, task, "json"):
                rows.append((rate_of(given, task) / 1e3, *measures(path_of(given, task, "json"))[:4]))
                rate, up, trials, error, cost = rows[-1]
                print(f"| {n} | {task[1]} | {rate:.1f} | {up} of {trials} | {error:.3f} | {cost:.2f} |")
        if rows:
            rate, up, trials, error, cost = zip(*rows)
            print(f"| **{n}** | {len(rows)} | {spread(rate, 1)} | {sum(up)} of {sum(trials)} | {spread(error, 3)} | {spread(cost, 2)} |")


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--train", action="store_true", help="train only")
    parser.add_argument("--judge", action="store_true", help="judge what is trained, and print the table")
    parser.add_argument("--elements", default="77,38,20,10", help="of a foot (default 77,38,20,10)")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--devices", default="cuda", help="of the trainings: cuda:0,cuda:1, or cpu (default cuda)")
    parser.add_argument("--jobs", type=int, default=1, help="trainings at a time on each device (default 1)")
    parser.add_argument("--seconds", type=float, default=1e6, help="[s] for the trainings")
    parser.add_argument("--ground", default=",".join(NINE), help="of the judge (default: nine)")
    parser.add_argument("--trials", type=int, default=10, help="of the judge, of each ground and speed (default 10)")
    words = sys.argv[1:] + ([] if "--" in sys.argv else ["--"])
    given = parser.parse_args(words[:words.index("--")])
    given.options = words[words.index("--") + 1:]
    given.folder = given.folder.resolve()
    given.elements = [int(n) for n in given.elements.split(",")]
    given.devices = given.devices.split(",")
    if given.seeds < 1 or given.jobs < 1:
        parser.error("--seeds and --jobs are at least 1")
    return given


def main():
    given = parse()
    given.folder.mkdir(parents=True, exist_ok=True)
    both = given.train == given.judge
    whole = not (both or given.train) or train(given)
    if both or given.judge:
        judge(given)
        table(given)
    return 0 if whole else 1


if __name__ == "__main__":
    sys.exit(main())
