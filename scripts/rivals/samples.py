#!/usr/bin/env python3
"""Fewer samples: trains the task of configs/quick.ini by learners that differ in one thing each, with several seeds, and judges what they
save: seconds and policy steps to 30 of 30 trials upright at 0.6 m/s within 5 % on rigid, foam45 and sand_loose.

  scripts/rivals/samples.py runs/samples --devices cuda:0,cuda:1 --jobs 3         # trains and judges
  scripts/rivals/samples.py runs/samples --judge                                  # what is saved and not judged yet, without a GPU
  scripts/rivals/samples.py runs/samples --report                                 # table and results.json of what is there

PPO ends by iterations (--lengths), because its last ones anneal: each length is a training of its own. The others end by time (--seconds)
and save at the ages of --at, too. Seconds are from the start of the process to the saved policy; those of trainings that share a GPU
(--jobs above 1) are longer. FOLDER/results.jsonl gets a line when a training ends and one when a policy is judged; started again, the
command goes on from there. No training begins after --limit.

$MILD is the program (default build/mild), $MILD_ENVS the library libmild_envs.so, $MILD_HOME the folder of robots and grounds."""
import argparse
import json
import os
import pathlib
import queue
import shlex
import shutil
import statistics
import subprocess
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
MILD = shlex.split(os.environ.get("MILD", str(ROOT / "build/mild")))
WALK, OFF = "train_walk.py", "offpolicy.py"
# name: (script, options, what it is)
ARMS = {
    "ppo": (WALK, [], "PPO: Muon, mirror loss on 0.25"),
    "adam": (WALK, ["--optimizer", "adam"], "Adam"),
    "epoch": (WALK, ["--advantages", "epoch"], "advantages anew in each epoch"),
    "vtrace": (WALK, ["--advantages", "vtrace"], "and by V-trace"),
    "mirror0": (WALK, ["--mirror", "0"], "no mirror loss"),
    "mirror1": (WALK, ["--mirror", "1"], "mirror loss on all samples"),
    "symmetric": (WALK, ["--symmetric"], "actor and critic symmetric by construction"),
    "priority": (WALK, ["--priority", "0.8"], "minibatches of environments with large advantages"),
    "td3": (OFF, [], "FastTD3"),
    "sac": (OFF, ["--sac"], "FastSAC"),
}
GROUNDS, SPEED, WITHIN = ["rigid", "foam45", "sand_loose"], 0.6, 0.05


def fail(text):
    print(f"samples.py: {text}", file=sys.stderr)
    sys.exit(2)


class Results:
    """Lines of results.jsonl. A task: [arm, length or seconds, seed]."""

    def __init__(self, folder):
        self.folder, self.file, self.lock, self.lines = folder, folder / "results.jsonl", threading.Lock(), []
        for text in self.file.read_text(encoding="utf-8").splitlines() if self.file.exists() else []:
            try:
                self.lines.append(json.loads(text))
            except ValueError:
                continue  # killed while it was written

    def add(self, line):
        with self.lock:
            self.lines.append(line)
            torn = self.file.exists() and not self.file.read_bytes().endswith(b"\n") and self.file.stat().st_size > 0
            with open(self.file, "a", encoding="utf-8") as file:
                file.write(("\n" if torn else "") + json.dumps(line) + "\n")

    def of(self, done):
        with self.lock:
            return [line for line in self.lines if line["done"] == done]

    def place(self, task):
        return self.folder / "-".join(f"{part}" for part in task)

    def unjudged(self):
        """[(task, name)] of saved policies."""
        judged = [(line["task"], line["name"]) for line in self.of("judged")]
        return [(line["task"], saved["name"]) for line in self.of("trained") for saved in line["saved"] if (line["task"], saved["name"]) not in judged]


def tasks_of(given):
    """Seeds in the outer loop, so that every arm has one first."""
    return [[arm, length, seed] for seed in given.seeds for arm in given.only
            for length in (given.lengths if ARMS[arm][0] == WALK else [given.seconds])]


def words_of(given, task, place, device):
    """The command of a training."""
    arm, length, seed = task
    script, options, _ = ARMS[arm]
    ends = ["--iterations", length, "--minutes", 60] if script == WALK else ["--until", length, "--snapshots", given.at]
    return [given.python, ROOT / "scripts/rivals" / script, "--out", place, "--seed", seed, "--device", device, *ends, *options, *given.options]


def train(given, results, task, device):
    """Trains, and again without CUDA graphs where they fail; then all later ones without."""
    place, graphs = results.place(task), ARMS[task[0]][0] == OFF and device != "cpu"
    for again in [[], ["--eager"]][given.eager and graphs : 1 + graphs]:
        shutil.rmtree(place, ignore_errors=True)  # what a killed one left
        place.mkdir(parents=True)
        with open(place / "output", "w", encoding="utf-8") as file:
            try:
                code = subprocess.run(list(map(str, [*words_of(given, task, place, device), *again])), stdout=file, stderr=subprocess.STDOUT, cwd=ROOT,
                                      env={**os.environ, "SAMPLES_BEGAN": str(time.time()), **({"OMP_NUM_THREADS": "1"} if device == "cpu" else {})},
                                      timeout=given.patience, check=False).returncode
            except subprocess.TimeoutExpired:
                code = "too slow"
        if code == 0:
            given.eager = given.eager or bool(again)
            results.add({"done": "trained", "task": task, "saved": json.loads((place / "saved.json").read_text()), "device": device, "jobs": given.jobs,
                         "eager": bool(again)})
            return
        said = (place / "output").read_text(encoding="utf-8").strip().splitlines() or ["no message"]
        print(f"samples.py: {place.name}{' --eager' if again else ''}: {code}: {said[-1]}", file=sys.stderr, flush=True)


def judge(given, results, task, name):
    words = ["eval", "--policy", results.place(task) / f"{name}.safetensors", "--ground", ",".join(GROUNDS), "--speed", SPEED, "--trials", given.trials,
             "--threads", given.threads, "--json", "-"]
    done = subprocess.run([*MILD, *map(str, words)], capture_output=True, text=True, cwd=ROOT, check=False)
    if done.returncode:
        print(f"samples.py: {results.place(task).name}/{name}: {done.stderr.strip()}", file=sys.stderr, flush=True)
        return
    rows = [{key: row[key] for key in ("ground", "trials", "success", "velocity", "cot")} for row in json.loads(done.stdout)["rows"]]
    results.add({"done": "judged", "task": task, "name": name, "rows": rows})


def work(given, results):
    """Trains all tasks, --jobs at a time on each device, and judges meanwhile."""
    waiting, end, busy = queue.Queue(), time.time() + given.limit, [1]
    trained = [line["task"] for line in results.of("trained")]
    for task in tasks_of(given) if not given.judge else []:
        if task not in trained:
            waiting.put(task)
    asked, lock = [], threading.Lock()

    def trainer(device):
        while time.time() < end:
            try:
                task = waiting.get_nowait()
            except queue.Empty:
                return
            began = time.time()
            train(given, results, task, device)
            print(f"{results.place(task).name}: {time.time() - began:.0f} s on {device}", flush=True)

    def judges():
        while True:
            over = not busy[0]  # before it looks
            with lock:
                left = [item for item in results.unjudged() if item not in asked]
                asked.extend(left[:1])
            if left:
                judge(given, results, *left[0])
            elif over:
                return
            else:
                time.sleep(0.2)

    trainers = [threading.Thread(target=trainer, args=(device,)) for device in given.devices for _ in range(given.jobs)]
    others = [threading.Thread(target=judges) for _ in range(0 if given.train else given.judges)]
    for thread in trainers + others:
        thread.start()
    for thread in trainers:
        thread.join()
    busy[0] = 0
    for thread in others:
        thread.join()
    return waiting.qsize()


# ---- report ----


def passes(rows):
    return all(row["success"] == row["trials"] and row["velocity"] is not None and abs(row["velocity"] - SPEED) <= WITHIN * SPEED for row in rows)


def summary(results):
    """A row for each arm, length and name of a policy, over the seeds that were judged."""
    judged = {json.dumps([line["task"], line["name"]]): line["rows"] for line in results.of("judged")}
    groups = {}
    for line in results.of("trained"):
        arm, length, seed = line["task"]
        for saved in line["saved"]:
            rows = judged.get(json.dumps([line["task"], saved["name"]]))
            groups.setdefault((arm, length, saved["name"]), []).append({**saved, "seed": seed, "jobs": line["jobs"], "rows": rows})
    order = list(ARMS)
    rows = []
    for (arm, length, name), runs in sorted(groups.items(), key=lambda item: (order.index(item[0][0]), item[0][1], item[1][0]["seconds"])):
        runs.sort(key=lambda run: run["seed"])
        seen = [run for run in runs if run["rows"]]
        middle = {key: statistics.median(run[key] for run in runs) for key in ("seconds", "steps", "reward")}
        rows.append({"arm": arm, "what": ARMS[arm][2], "length": length, "name": name, "seeds": [run["seed"] for run in runs], **middle,
                     "jobs": max(run["jobs"] for run in runs), "judged": len(seen), "pass": sum(passes(run["rows"]) for run in seen),
                     "upright": sum(row["success"] for run in seen for row in run["rows"]),
                     "trials": sum(row["trials"] for run in seen for row in run["rows"]),
                     "velocity": {g: [row["velocity"] for run in seen for row in run["rows"] if row["ground"] == g] for g in GROUNDS},
                     "cot": {g: [row["cot"] for run in seen for row in run["rows"] if row["ground"] == g] for g in GROUNDS}})
    return rows


def report(results):
    rows = summary(results)
    (results.folder / "results.json").write_text(json.dumps({"rows": rows}, indent=1) + "\n")
    print("| learner | ends | M steps | seconds | reward a second | seeds that pass | upright | m/s on " + " | ".join(GROUNDS) + " |\n"
          "|---|---|---|---|---|---|---|---|---|---|")
    for row in rows:
        ends = f"{row['length']} iterations" if ARMS[row["arm"]][0] == WALK else f"{row['seconds']:.0f} s"
        speeds = (" ".join("-" if v is None else f"{v:.2f}" for v in row["velocity"][g]) for g in GROUNDS)
        print(f"| {row['what']} (`{row['arm']}`) | {ends} | {row['steps'] / 1e6:.1f} | {row['seconds']:.1f} | {row['reward']:.2f} | "
              f"{row['pass']} of {row['judged']} | {row['upright']} of {row['trials']} | " + " | ".join(speeds) + " |")


def parse(words):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--devices", default="cuda:0", help="of the trainings: cuda:0,cuda:1 or cpu (default cuda:0)")
    parser.add_argument("--jobs", type=int, default=1, help="trainings at a time on each device (default 1)")
    parser.add_argument("--seeds", default="1,2,3", help="(default 1,2,3)")
    parser.add_argument("--only", help="some of " + ",".join(ARMS) + " (default: all)")
    parser.add_argument("--lengths", default="130,260", help="iterations of PPO, each a training (default 130,260)")
    parser.add_argument("--seconds", type=float, default=60.0, help="[s] age at which FastTD3 and FastSAC end (default 60)")
    parser.add_argument("--at", default="20,40", help="[s] ages at which these save, too (default 20,40)")
    parser.add_argument("--limit", type=float, default=1e9, help="[s] no training begins after it")
    parser.add_argument("--patience", type=float, default=300, help="[s] a training that takes longer is ended (default 300)")
    parser.add_argument("--trials", type=int, default=10, help="on each ground (default 10)")
    parser.add_argument("--judges", type=int, default=4, help="at a time, which share half of the cores (default 4)")
    parser.add_argument("--python", default=sys.executable, help="with PyTorch (default: this one)")
    parser.add_argument("--train", action="store_true", help="judge nothing")
    parser.add_argument("--judge", action="store_true", help="train nothing")
    parser.add_argument("--report", action="store_true", help="train and judge nothing")
    own, more = (words[: words.index("--")], words[words.index("--") + 1 :]) if "--" in words else (words, [])
    given = parser.parse_args(own)
    given.eager, given.options = False, more  # after --: of every training
    given.only = given.only.split(",") if given.only else list(ARMS)
    unknown = [name for name in given.only if name not in ARMS]
    if unknown:
        fail(f"--only {unknown[0]}: choose from {' '.join(ARMS)}")
    for name in ("seeds", "lengths"):
        try:
            setattr(given, name, [int(word) for word in getattr(given, name).split(",")])
        except ValueError:
            fail(f"--{name} {getattr(given, name)}: whole numbers with commas between them")
    given.devices = given.devices.split(",")
    given.threads = max(1, os.cpu_count() // (2 * given.judges))
    if (given.judge or given.report) and not (given.folder / "results.jsonl").is_file():
        fail(f"{given.folder}: no results.jsonl")
    given.folder = given.folder.resolve()
    return given


def main():
    given = parse(sys.argv[1:])
    given.folder.mkdir(parents=True, exist_ok=True)
    results = Results(given.folder)
    left = 0 if given.report else work(given, results)
    report(results)
    if left:
        print(f"samples.py: {left} trainings are left; start it again to go on", file=sys.stderr)
    sys.exit(1 if left else 0)


if __name__ == "__main__":
    main()
