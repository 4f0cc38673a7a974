#!/usr/bin/env python3
"""The net or the ground? Trains five controllers on three grounds, with several seeds, one task (configs/factorial.ini), and judges them all.

  lab/paper/factorial.py runs/factorial                                            # on one GPU; 65 trainings, two hours and a half
  lab/paper/factorial.py runs/factorial --devices cuda:0,cuda:1 --seconds 1500
  lab/paper/factorial.py runs/factorial --judge                                    # what is trained, without a GPU
  lab/paper/factorial.py runs/factorial --report                                   # table and figure of what is there

Controllers: mlp (the layers of ours, with no target but the reward, and no modulation), clock, ht2 (lab/paper/rivals/README.md), flat (ours whose
modulation does not learn), ours. Grounds: rigid, ecc_spring, mild (randomize.model). Each training has the same wall time, --minutes;
--steps N trains to N policy steps instead, for all but ht2, all with 4096 robots, into another folder. HT-2 imitates policies/paper/rigid-1 first, within its time.
They are judged on nine grounds at four speeds, nine transitions at 0.6 and 1.2 m/s, and grounds that none of them met.

One tuning budget: before that each controller is trained on `mild`, seed 1, a quarter of the time, with each of the four choices of
SEARCH (KL target that leads the learning rate, robots that are simulated at the same time); the one with the highest score is taken for
all of its trainings. With fewer robots an iteration has fewer samples, and there are more of them: the KL target bounds how far a policy
moves in one. All have the same weight of the entropy. Score: the mean of the skill on nine grounds and of the share of their time that the
trials last, so that controllers of which nobody stays up differ, too. Skill: mean over cells of upright share times
1 - |speed error| / speed, not below 0.

Equal wall time: of a training alone on its GPU. With --jobs 2 each has half of one, which does not count with those that had all of it.

FOLDER/results.jsonl gets a line when a training ends and one when it is judged; started again, the command goes on from there, also after
it was killed. What was trained with another --minutes, --jobs, --steps or config is not counted. No training begins that would not end by
--seconds, and no judge that would not if it took as long as the longest so far. So it may be run in pieces, one after another or on
several machines: --take PIECE,PIECE puts the results and policies of other folders into this one first. FOLDER/policies has those of the trainings, in half precision, and those of the search
until they are judged. As in

  lab/paper/factorial.py runs/third --take runs/first,runs/second --seconds 570    # what they have not done
  lab/paper/factorial.py runs/factorial --take runs/first,runs/second,runs/third --report

Keys after -- go to the trainings of mlp, flat and ours, as -- --ppo.epochs=3."""
import argparse
import csv
import hashlib
import itertools
import json
import os
import pathlib
import queue
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import transitions
from half import halve
from measure import MILD, NINE, ROOT, UNSEEN, law_of, mean, mild

CONTROLLERS = {"mlp": "MLP", "clock": "Clock", "ht2": "HT-2", "flat": "ours, no modulation", "ours": "ours"}
GROUNDS = ["rigid", "ecc_spring", "mild"]
SEARCH = [(kl_target, robots) for kl_target in (0.01, 0.02) for robots in (1024, 4096)]
ENTROPY = 0.004  # its weight; docs/log.md says why it is not searched for
EQUAL = 4096  # robots of every training with --steps: 250 M steps of 1024 take ten minutes of a GPU
TUNING = 0.25  # share of the time
STARTING = 8  # [s] beside the time of a training, until one has been seen
IMITATION = 0.2  # share of the time in which HT-2 imitates
SETTLED = 0.7  # share of the time at which the annealing begins
OURS = {"mlp": ["--ppo.epsilon=0", "--ppo.modulation=false"], "flat": ["--ppo.modulation=false"], "ours": []}
TEACHER = ROOT / "policies/paper/rigid-1.safetensors"
SPEEDS = [0.3, 0.6, 0.9, 1.2]
TRIAL = 20  # [s]
PAIRS = [f"{ground}>{NINE[(i + 4) % len(NINE)]}" for i, ground in enumerate(NINE)]  # each ground is left once and entered once
PARTS = ("nine grounds", "transitions", "unseen grounds")
DEFAULT = ROOT / "configs/default.ini"


def fail(text):
    print(f"factorial.py: {text}", file=sys.stderr)
    sys.exit(2)


# ---- measures ----

def skill(cells):
    """0: all fall or stand still; 1: all stay up at the asked speed."""
    return mean(c["upright"] / c["trials"] * max(0.0, 1 - abs(c["error"]) / abs(c["speed"])) if c["error"] is not None else 0.0 for c in cells)


def score(cells):
    """By which the search chooses."""
    return (skill(cells) + mean(c["lasted"] for c in cells)) / 2


def cell_of(row):
    """Of a row of mild eval whose trials last TRIAL."""
    return {"ground": row["ground"], "speed": row["speed"], "trials": row["trials"], "upright": row["success"], "cot": row["cot"],
            "error": None if row["velocity"] is None else row["velocity"] - row["speed"], "torque": row["torque_max"],
            "lasted": mean(min(1.0, t["seconds"] / TRIAL) for t in row["each"])}


def who_of(controller, policy, config):
    """Options of mild eval."""
    return ["--policy", policy, "--config", config, "--controller", controller if controller in ("clock", "ht2") else "learned"]


def walked(given, who, grounds, speeds, *more):
    printed = mild("eval", *who, *law_of(grounds, more), "--ground", ",".join(grounds), "--speed=" + ",".join(map(str, speeds)), "--trials", given.trials, "--seconds", TRIAL,
                   "--threads", given.threads, "--json", "-", *more)
    return [cell_of(row) for row in json.loads(printed)["rows"]]


def judged(given, who):
    """{part: cells}"""
    unseen = [{**cell, "kind": kind} for kind, grounds, more in UNSEEN if kind not in GROUNDS
              for cell in walked(given, who, grounds, [0.6], *more)]
    return {PARTS[0]: walked(given, who, NINE, SPEEDS),
            PARTS[1]: transitions.judge(who, PAIRS, [0.6, 1.2], given.trials, jobs=given.threads), PARTS[2]: unseen}


# ---- trainings ----

def last_of(path, column):
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    if not rows:
        raise RuntimeError(f"{path}: no iteration within the time")
    return float(rows[-1][column])


def run(words, log):
    with open(log, "a", encoding="utf-8") as file:
        done = subprocess.run(list(map(str, words)), stdout=file, stderr=subprocess.STDOUT, cwd=ROOT, check=False)
    if done.returncode:
        lines = pathlib.Path(log).read_text(encoding="utf-8").strip().splitlines() or ["no message"]
        raise RuntimeError(f"{' '.join(map(str, words[:4]))}: {lines[-1]}")


class Factorial:
    """Trainings and their results. A task: {kind, controller, ground, seed, choice}; kind tune or train, choice: a place in given.search."""

    def __init__(self, given):
        self.given, self.folder = given, given.folder.resolve()
        self.file = self.folder / "results.jsonl"
        self.end = time.time() + given.seconds
        self.longest_judge = 0.0  # [s] of those that this call has seen
        self.lock, self.failed = threading.Lock(), []
        settings = [given.minutes, given.jobs, given.steps, given.config.read_text(encoding="utf-8"), given.search, ENTROPY, IMITATION, OURS, given.options]
        self.settings = hashlib.sha256(json.dumps(settings).encode()).hexdigest()[:16]
        self.lines = []
        for text in self.file.read_text(encoding="utf-8").splitlines() if self.file.exists() else []:
            try:
                line = json.loads(text)
            except ValueError:
                continue  # killed while it was written
            if line.get("settings") == self.settings:
                self.lines.append(line)

    def known(self, done, task):
        """The last line of this task that was written when it was `done`, trained or judged."""
        return next((x for x in reversed(self.lines) if x["done"] == done and x["task"] == task), None)

    def add(self, done, task, found):
        return self.write({"done": done, "task": task, **found, "settings": self.settings})

    def write(self, line):
        self.folder.mkdir(parents=True, exist_ok=True)
        with self.lock:
            self.lines.append(line)
            torn = self.file.exists() and not self.file.read_bytes().endswith(b"\n") and self.file.stat().st_size > 0
            with open(self.file, "a", encoding="utf-8") as file:
                file.write(("\n" if torn else "") + json.dumps(line) + "\n")
                file.flush()
                os.fsync(file.fileno())
        return line

    def take(self, folder):
        """Results and policies of another folder that count here and are not here yet."""
        other = Factorial(argparse.Namespace(**{**vars(self.given), "folder": folder}))
        for line in other.lines:
            if self.known(line["done"], line["task"]):
                continue
            if line["done"] == "trained" and other.policy_of(line["task"]).is_file():
                place = self.policy_of(line["task"])
                place.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(other.policy_of(line["task"]), place)
            self.write(line)

    # ---- one training ----

    def policy_of(self, task):
        of = f"tune{task['choice']}" if task["kind"] == "tune" else f"{task['seed']}"
        return self.folder / "policies" / f"{task['controller']}-{task['ground']}-{of}.safetensors"

    def seconds_of(self, task):
        """[s] of its training, if time is the budget."""
        return 60 * self.given.minutes * (TUNING if task["kind"] == "tune" else 1)

    def train_ours(self, task, folder, device):
        kl_target, robots = self.given.search[task["choice"]]
        minutes, log, words = self.seconds_of(task) / 60, folder / "run/log.csv", [*MILD, "train", "--out", folder / "run"]
        first = ["--config", self.given.config.resolve(), f"--train.device={device}", f"--randomize.model={task['ground']}",
                 f"--train.seed={task['seed']}", f"--train.envs={robots}", f"--ppo.kl_target={kl_target}", f"--ppo.entropy={ENTROPY}",
                 f"--train.threads={max(1, os.cpu_count() // self.given.slots)}", *OURS[task["controller"]],
                 *(["--train.robots=batch"] if device == "cpu" else []), *self.given.options]
        if self.given.steps:
            count = round(self.given.steps * (TUNING if task["kind"] == "tune" else 1) / (robots * self.rollout()))
            run([*words, *first, f"--train.iterations={count}", f"--ppo.anneal={round(SETTLED * count)},{count}"], folder / "log")
        else:  # how many iterations fit is known when most of them are done; those left anneal
            run([*words, *first, f"--train.minutes={SETTLED * minutes}"], folder / "log")
            done = int(last_of(log, "iteration"))
            count = done + max(1, round(done * (1 - SETTLED) / SETTLED))
            run([*words, "--resume", f"--train.minutes={(1 - SETTLED) * minutes}", f"--train.iterations={count}", f"--ppo.anneal={done},{count}"],
                folder / "log")
        return {"steps": last_of(log, "rate/steps"), "file": folder / "run/policy.safetensors"}

    def rollout(self):
        """Policy steps of each robot in an iteration of mild train."""
        for path in (self.given.config, DEFAULT):
            found = [line.split("=")[1].split(";")[0] for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("steps =")]
            if found:
                return int(found[0])
        raise RuntimeError(f"{DEFAULT}: ppo.steps is missing")

    def train_rival(self, task, folder, device):
        kl_target, robots = self.given.search[task["choice"]]
        name, minutes, more = task["controller"], self.seconds_of(task) / 60, []
        if self.given.steps:
            minutes, more = 1e6, ["--iterations", round(self.given.steps * (TUNING if task["kind"] == "tune" else 1) / (robots * 60))]
        if name == "ht2":  # of its own 8 minutes, 20 iterations of 4096 robots train the critic alone
            warm = max(1, round(20 * min(1.0, minutes / 8) * 4096 / robots))
            more += ["--teacher", TEACHER, "--imitation", IMITATION, "--warm", warm]
        run([self.given.python, ROOT / f"lab/paper/rivals/train_{name}.py", "--out", folder / "run", "--config", self.given.config.resolve(),
             "--model", task["ground"], "--seed", task["seed"], "--envs", robots, "--kl-target", kl_target, "--entropy", ENTROPY,
             "--device", device, "--minutes", minutes, *more], folder / "log")
        return {"steps": last_of(folder / "run/log.csv", "policy_steps"), "file": folder / f"run/{name}.safetensors"}

    def train(self, task, device):
        """Trains; {seconds, steps}. The policy is in policy_of(task)."""
        begin = time.time()
        with tempfile.TemporaryDirectory() as work:
            found = (self.train_ours if task["controller"] in OURS else self.train_rival)(task, pathlib.Path(work), device)
            place = self.policy_of(task)
            place.parent.mkdir(parents=True, exist_ok=True)
            place.with_suffix(".part").write_bytes(halve(pathlib.Path(found["file"]).read_bytes()))
            place.with_suffix(".part").replace(place)
        return {"seconds": time.time() - begin, "steps": found["steps"], "device": device}

    def judge(self, task):
        """{part: cells}"""
        who = who_of(task["controller"], self.policy_of(task), self.given.config.resolve())
        if task["kind"] == "tune":
            return {"tuning": walked(self.given, who, NINE, SPEEDS)}
        return judged(self.given, who)

    # ---- many ----

    def begins(self, task):
        """Bool: it would end in time."""
        like = [x["seconds"] for x in self.lines if x["done"] == "trained" and all(x["task"][key] == task[key] for key in ("kind", "controller"))]
        return not self.given.judge and time.time() + max(like, default=self.seconds_of(task) + STARTING) <= self.end

    def work(self, task, devices, judges):
        """Trains on the next free device, if it is not done or its policy was lost; its judge starts when it is."""
        if not self.known("judged", task) and not (self.known("trained", task) and self.policy_of(task).is_file()):
            device = devices.get()
            try:
                if not self.begins(task):
                    return None
                self.add("trained", task, self.train(task, device))
            finally:
                devices.put(device)
        return None if self.known("judged", task) else judges.submit(self.conclude, task)

    def conclude(self, task):
        begin = time.time()
        if begin + self.longest_judge > self.end:  # judged when it goes on
            return
        parts = self.judge(task)
        self.longest_judge = max(self.longest_judge, time.time() - begin)
        judged = {"skill": {part: skill(cells) for part, cells in parts.items()}, "cells": parts}
        if task["kind"] == "tune":
            judged["score"] = score(parts["tuning"])
            self.policy_of(task).unlink(missing_ok=True)
        line = self.add("judged", task, judged)
        kl_target, robots = self.given.search[task["choice"]]
        trained = self.known("trained", task)
        print(f"{task['kind']} {task['controller']} on {task['ground']}, seed {task['seed']}, kl {kl_target:g}, {robots} robots: "
              f"{trained['steps'] / 1e6:.1f} M steps in {trained['seconds']:.0f} s; skill "
              + ", ".join(f"{part} {value:.3f}" for part, value in line["skill"].items())
              + (f"; score {line['score']:.3f}" if "score" in line else ""), flush=True)

    def all_of(self, tasks):
        """Bool: all are trained and judged."""
        devices = queue.Queue()
        for device in self.given.devices * self.given.jobs:
            devices.put(device)
        with ThreadPoolExecutor(self.given.slots) as trainers, ThreadPoolExecutor(self.given.judges) as judges:
            waiting = [(task, trainers.submit(self.work, task, devices, judges)) for task in tasks]
            for task, future in waiting:
                try:
                    last = future.result()
                    if last:
                        last.result()
                except (Exception, SystemExit) as error:  # the others go on
                    self.failed.append(f"{task['controller']} on {task['ground']}, seed {task['seed']}: {error}")
                    print(f"failed: {self.failed[-1]}", file=sys.stderr, flush=True)
        return all(self.known("judged", task) for task in tasks)

    def choices(self):
        """{controller: place in given.search} of those whose search is done."""
        found = {}
        for name in self.given.controllers:
            lines = [self.known("judged", tuning(name, i)) for i in range(len(self.given.search))]
            if all(lines):
                found[name] = max(range(len(self.given.search)), key=lambda i: lines[i]["score"])
        return found

    def run(self):
        """Bool: everything is done."""
        self.folder.mkdir(parents=True, exist_ok=True)
        done = self.all_of([tuning(name, i) for name in self.given.controllers for i in range(len(self.given.search))])
        chosen = self.choices()
        done &= self.all_of([{"kind": "train", "controller": name, "ground": ground, "seed": seed, "choice": chosen[name]}
                             for seed in range(1, self.given.seeds + 1) for name in chosen for ground in GROUNDS])
        return done


def tuning(name, i):
    return {"kind": "tune", "controller": name, "ground": "mild", "seed": 1, "choice": i}


# ---- what came out ----

def shares(values):
    """Of the variance of {(net, ground, seed): value}, which must have the same seeds everywhere: what net, ground, both together and the
    seed make."""
    nets, grounds, seeds = (list(dict.fromkeys(key[i] for key in values)) for i in range(3))
    middle = mean(values.values())
    of_net = {n: mean(values[n, g, s] for g in grounds for s in seeds) - middle for n in nets}
    of_ground = {g: mean(values[n, g, s] for n in nets for s in seeds) - middle for g in grounds}
    cell = {(n, g): mean(values[n, g, s] for s in seeds) for n in nets for g in grounds}
    whole = sum((v - middle) ** 2 for v in values.values())
    found = {"net": len(grounds) * len(seeds) * sum(v * v for v in of_net.values()),
             "ground": len(nets) * len(seeds) * sum(v * v for v in of_ground.values()),
             "both": len(seeds) * sum((cell[n, g] - middle - of_net[n] - of_ground[g]) ** 2 for n in nets for g in grounds),
             "seed": sum((v - cell[n, g]) ** 2 for (n, g, _), v in values.items())}
    return {name: value / whole if whole else 0.0 for name, value in found.items()}


def shares_of(values, seeds):
    """{part: shares} of these seeds; that of a single seed cannot be separated from the rest."""
    found = {part: shares({key: v for key, v in own.items() if key[2] in seeds}) for part, own in values.items()}
    return {part: {name: v for name, v in own.items() if name != "seed" or len(seeds) > 1} for part, own in found.items()}


def leads(values):
    """Of {(net, ground, seed): value}: {(net, ground): [by how much ours is above that net, of each seed that both have]}."""
    found = {}
    for (net, ground, seed), value in values.items():
        if net != "ours" and ("ours", ground, seed) in values:
            found.setdefault((net, ground), []).append(values["ours", ground, seed] - value)
    return found


def whole_seeds(values):
    """Seeds that all nets have on all grounds, of {(net, ground, seed): value}."""
    nets, grounds, seeds = (sorted({key[i] for key in values}) for i in range(3))
    return [s for s in seeds if all((n, g, s) in values for n in nets for g in grounds)]


def table(lines):
    """Rows of the table: a controller and a ground, over its seeds."""
    rows = []
    for name, ground in itertools.product(CONTROLLERS, GROUNDS):
        own = [x for x in lines if x["task"]["controller"] == name and x["task"]["ground"] == ground]
        if not own:
            continue
        row = {"controller": name, "ground": ground, "seeds": len(own)}
        for part in PARTS:
            cells = [c for x in own for c in x["cells"][part]]
            stood = [c for c in cells if c["upright"] and c["error"] is not None]
            each = [x["skill"][part] for x in own]
            row[part] = {"skill": mean(each), "least": min(each), "most": max(each), "upright": sum(c["upright"] for c in cells),
                         "trials": sum(c["trials"] for c in cells), "error": mean(abs(c["error"]) for c in stood) if stood else None,
                         "cot": mean(c["cot"] for c in stood if c["cot"] is not None) if stood else None}
        rows.append(row)
    return rows


def table2(lines):
    """Table II again: speed, cost and torque on each ground at each command, means over the seeds' cells in which anybody stayed up."""
    rows = []
    for name, ground, walked_on in itertools.product(CONTROLLERS, GROUNDS, NINE):
        cells = [c for x in lines if (x["task"]["controller"], x["task"]["ground"]) == (name, ground) for c in x["cells"][PARTS[0]]
                 if c["ground"] == walked_on]
        if cells:
            by_speed = {v: [c for c in cells if c["speed"] == v and c["upright"] and c["error"] is not None] for v in SPEEDS}
            rows.append({"controller": name, "ground": ground, "walked": walked_on,
                         "upright": sum(c["upright"] for c in cells), "trials": sum(c["trials"] for c in cells),
                         "velocity": [mean(v + c["error"] for c in by_speed[v]) if by_speed[v] else None for v in SPEEDS],
                         "cot": [mean(c["cot"] for c in by_speed[v]) if by_speed[v] else None for v in SPEEDS],
                         "torque": [mean(c["torque"] for c in by_speed[v]) if by_speed[v] else None for v in SPEEDS]})
    return rows


def text_of(value, form):
    return "-" if value is None else format(value, form)


def sentence(part, found, seeds):
    return (f"{part}: of the variance of the skill the net makes {found['net']:.0%}, the ground {found['ground']:.0%}, both together {found['both']:.0%}"
            + (f", the seed {found['seed']:.0%}" if "seed" in found else "") + f" (seeds {seeds})")


def print_leads(values):
    found = {part: leads(own) for part, own in values.items()}
    nets = [name for name in CONTROLLERS if any(net == name for own in found.values() for net, _ in own)]
    if not nets:
        return
    print("\n| judged on | trained on |" + "".join(f" ours less {CONTROLLERS[net].removeprefix('ours, ')} |" for net in nets) + "\n" + "|---" * (2 + len(nets)) + "|")
    for part, ground in itertools.product(found, GROUNDS):
        each = [found[part].get((net, ground)) for net in nets]
        if any(each):
            print(f"| {part} | {ground} |" + "".join(f" {mean(v):+.3f} ({min(v):+.3f} to {max(v):+.3f}) |" if v else " - |" for v in each))


def report(factorial):
    """Prints the tables, writes FOLDER/factorial.json and, where there is matplotlib, factorial.png."""
    lines = [x for x in factorial.lines if x["done"] == "judged" and x["task"]["kind"] == "train" and x["task"]["controller"] in factorial.given.controllers]
    if not lines:
        print("nothing is judged yet")
        return
    trained = [factorial.known("trained", x["task"]) for x in lines]
    rows, second = table(lines), table2(lines)
    print("| controller | trained on | seeds | M steps | seconds |" + "".join(f" {p}: skill | upright | error [m/s] | cost |" for p in PARTS))
    print("|---" * (5 + 4 * len(PARTS)) + "|")
    for row in rows:
        own = [t for t in trained if (t["task"]["controller"], t["task"]["ground"]) == (row["controller"], row["ground"])]
        row["steps"], row["seconds"] = (mean(t[key] for t in own) for key in ("steps", "seconds"))
        print(f"| {CONTROLLERS[row['controller']]} | {row['ground']} | {row['seeds']} | {row['steps'] / 1e6:.1f} | {row['seconds']:.0f} |"
              + "".join(f" {p['skill']:.3f} ({p['least']:.3f} to {p['most']:.3f}) | {p['upright']} of {p['trials']} | "
                        f"{text_of(p['error'], '.3f')} | {text_of(p['cot'], '.2f')} |" for p in (row[part] for part in PARTS)))
    print("\n| controller | trained on | walked on | upright | m/s at " + ", ".join(map(str, SPEEDS)) + " | cost of transport | torque [N m] |\n"
          "|---|---|---|---|---|---|---|")
    for row in second:
        cells = (", ".join(text_of(v, form) for v in row[key]) for key, form in (("velocity", ".2f"), ("cot", ".2f"), ("torque", ".0f")))
        print(f"| {CONTROLLERS[row['controller']]} | {row['ground']} | {row['walked']} | {row['upright']} of {row['trials']} | " + " | ".join(cells) + " |")
    values = {part: {(x["task"]["controller"], x["task"]["ground"], x["task"]["seed"]): x["skill"][part] for x in lines} for part in PARTS}
    seeds = whole_seeds(values[PARTS[0]])
    answer = shares_of(values, seeds) if seeds else None
    grounds = {key[1] for key in values[PARTS[0]]} - {"rigid"}
    of_soft = {part: {key: v for key, v in own.items() if key[1] in grounds} for part, own in values.items()}
    soft = shares_of(of_soft, seeds) if seeds and len(grounds) > 1 else None
    print_leads(values)
    print("\n" + ("\n".join(sentence(part, found, seeds) for part, found in answer.items()) if seeds else
                  "the net or the ground: not before each net has all grounds with a seed"))
    if soft:
        print("\nof those trained on soft ground alone:\n" + "\n".join(sentence(part, found, seeds) for part, found in soft.items()))
    search = [{**{k: t["task"][k] for k in ("controller", "choice")}, "kl_target": factorial.given.search[t["task"]["choice"]][0],
               "robots": factorial.given.search[t["task"]["choice"]][1], "skill": t["skill"]["tuning"], "score": t["score"]}
              for t in factorial.lines if t["done"] == "judged" and t["task"]["kind"] == "tune"]
    summary = {"minutes": factorial.given.minutes, "steps": factorial.given.steps, "settings": factorial.settings, "search": search,
               "chosen": factorial.choices(), "rows": rows, "table2": second, "shares": answer, "shares_soft": soft, "seeds": seeds}
    (factorial.folder / "factorial.json").write_text(json.dumps(summary, indent=1) + "\n")
    try:
        import figures
    except ImportError:
        print("no figure: matplotlib is missing (scripts/requirements.txt)")
        return
    figures.factorial(values, answer, CONTROLLERS, GROUNDS).savefig(factorial.folder / "factorial.png", dpi=110)
    print(factorial.folder / "factorial.png")


def parse(words):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--minutes", type=float, default=3.0, help="[min] of each training (default 3)")
    parser.add_argument("--steps", type=float, default=0, help="policy steps of each training in the place of minutes; not for ht2")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--controllers", default=None, help="some of " + ",".join(CONTROLLERS) + ", in --report too (default: all)")
    parser.add_argument("--config", type=pathlib.Path, default=ROOT / "configs/factorial.ini", help="the task")
    parser.add_argument("--devices", default="cuda", help="of the trainings: cuda:0,cuda:1 (default cuda)")
    parser.add_argument("--jobs", type=int, default=1, help="trainings at a time on each device, which share it (default 1)")
    parser.add_argument("--judges", type=int, default=2, help="judges at a time, which share half of the cores (default 2)")
    parser.add_argument("--trials", type=int, default=5, help="of each cell (default 5)")
    parser.add_argument("--seconds", type=float, default=1e9, help="[s] no training begins that would not end by then")
    parser.add_argument("--python", default=sys.executable, help="with PyTorch and mild, for clock and ht2 (default: this one)")
    parser.add_argument("--take", default="", metavar="FOLDER[,FOLDER]", help="other folders of this command, whose results belong to these")
    parser.add_argument("--judge", action="store_true", help="train nothing, judge what is trained")
    parser.add_argument("--report", action="store_true", help="train and judge nothing")
    own, more = (words[:words.index("--")], words[words.index("--") + 1:]) if "--" in words else (words, [])
    given = parser.parse_args(own)
    given.options = more
    given.controllers = given.controllers.split(",") if given.controllers else [c for c in CONTROLLERS if not (given.steps and c == "ht2")]
    unknown = [name for name in given.controllers if name not in CONTROLLERS]
    if unknown:
        fail(f"--controllers {unknown[0]}: choose from {' '.join(CONTROLLERS)}")
    if given.steps and "ht2" in given.controllers:
        fail("--steps: ht2 would take days; leave it out")
    if not given.config.is_file():
        fail(f"{given.config}: no such file")
    given.take = [pathlib.Path(name) for name in given.take.split(",") if name]
    missing = [folder for folder in given.take if not (folder / "results.jsonl").is_file()]
    if missing:
        fail(f"--take: {missing[0]} has no results.jsonl")
    given.devices = given.devices.split(",")
    given.search = [choice for choice in SEARCH if choice[1] == EQUAL or not given.steps]
    given.slots = len(given.devices) * given.jobs
    given.threads = max(1, os.cpu_count() // (2 * given.judges))
    return given


def main():
    given = parse(sys.argv[1:])
    factorial = Factorial(given)
    for folder in given.take:
        factorial.take(folder)
    done = given.report or factorial.run()
    report(factorial)
    for text in factorial.failed:
        print(f"factorial.py: failed: {text}", file=sys.stderr)
    if not done and not factorial.failed:
        print("factorial.py: the time is over; start it again to go on", file=sys.stderr)
    sys.exit(0 if done else 1)


if __name__ == "__main__":
    main()
