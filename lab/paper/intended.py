#!/usr/bin/env python3
"""Which sentences does the paper's training lack? The smallest set of our choices with which it walks.

Between configs/paper_intended.ini (the paper, its misprints as meant) and configs/models.ini (which walks) lie some eighty keys.
They are joined to sentences, such as "the clock is observed". A training takes some of the sentences as ours and the others as
the paper's, half a minute on one GPU, and is then judged on four grounds at 0.3 and 0.6 m/s: it walks when 90 % of 80 trials stay
up and the mean speed is within 0.1 m/s of what is asked. From all of ours, which walks, sentences are taken away while it still
walks: in ever smaller groups (delta debugging, Zeller and Hildebrandt 2002), JOBS trainings at a time, shared among the GPUs. The
result is minimal: without any one of its sentences it does not walk, or the search says that its time was over.

Budget, commands and the physics step are those of models.ini throughout. FOLDER/tests.json has every training; what is there is
not trained again. FOLDER/needed.json has the result. --figure draws them. lab/paper/intended.json is the tests.json of lab/paper/README.md.
"""

import argparse
import configparser
import hashlib
import json
import os
import pathlib
import queue
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor

ROOT = pathlib.Path(__file__).resolve().parents[2]
MILD = os.environ.get("MILD", str(ROOT / "build/mild"))
# Not searched: the budget, the commands and the step.
COMMON = ("train.", "task.vx", "task.vy", "task.wz", "task.backward_share", "task.standing_share", "task.straight_share",
          "task.physics_dt", "ppo.matmul", "task.solver", "randomize.patch_share")
# What belongs together, in the order of the effect that lab/paper/deviations.md measures: the last are likely to go at once. Any other
# key is a sentence of its own.
SENTENCES = {
    "helping hand": ("task.assist",),
    "the weights of tracking": ("reward.linear_velocity", "reward.yaw_rate"),
    "a gait to begin with": ("reward.reference_motion", "reward.air_time"),
    "the form of the clearance": ("reward.clearance_form", "reward.feet_clearance"),
    "scale and clip of the action": ("task.action_scale", "task.action_clip", "task.torque_share"),
    "tracked is a mean of 0.4 s": ("reward.tracking_time",),
    "how tracking falls off": ("reward.tracking_narrow", "reward.tracking_sharpness"),
    "a sum below 0 counts as 0": ("reward.clip_sum",),
    "balance and rest": ("reward.default_pose", "reward.base_height", "reward.feet_distance", "reward.orientation",
                         "reward.knee_distance", "reward.base_motion", "reward.base_acceleration", "reward.acceleration_form"),
    "means of the history": ("task.history_stride",),
    "the clock is observed": ("task.clock",),
    "exploration": ("policy.init_std", "ppo.std_max", "ppo.std_min"),
    "PPO's numbers": ("ppo.lambda", "ppo.clip_value", "ppo.kl_target", "ppo.epsilon"),
    "the form of the gait": ("reward.gait_form", "reward.gait"),
    "prices on effort": ("reward.torque", "reward.joint_acceleration", "reward.joint_speed", "reward.action_smoothness",
                         "reward.contact_force", "reward.power", "reward.slip", "reward.collision"),
    "mirror": ("ppo.mirror_weight", "ppo.mirror_share"),
    "scales of the estimates": ("task.velocity_scale", "task.height_scale"),
    "kinds of ground": ("randomize.rigid_share", "randomize.preset_share"),
    "ground that carries": ("randomize.sinkage_max", "randomize.bed_depth", "randomize.recovery"),
    "gains": ("task.kp", "task.kd"),
    "either contact near touchdown": ("task.double_support",),
    "anneal and average": ("ppo.anneal", "ppo.average"),
    "the mean of the latent": ("ppo.sample_latent",),
    "the decoder's target": ("ppo.decoder_target",),
    "small commands stand": ("task.standing_below",),
    "PD at every physics step": ("task.torque_hold",),
    "ground that creates no energy": ("randomize.passive",),
    "pushes": ("randomize.push_interval", "randomize.push_linear", "randomize.push_angular"),
    "randomised robots": ("randomize.link_mass", "randomize.armature", "randomize.gain", "randomize.strength",
                          "randomize.base_mass", "randomize.com_offset", "randomize.motor_offset", "randomize.latency"),
    "the start": ("randomize.initial_joint", "randomize.initial_velocity"),
    "sensor noise": ("task.observe_noise",),
    "theta for each dimension": ("policy.modulation_per_dimension",),
}


def read_keys(path):
    """{section.key: value} of an ini file."""
    parser = configparser.ConfigParser(inline_comment_prefixes=(";",))
    parser.read(path)
    return {f"{s}.{k}": " ".join(v.split()) for s in parser.sections() for k, v in parser[s].items()}


def fail(text):
    sys.exit(f"intended.py: {text}")


def run_mild(gpu, *words):
    done = subprocess.run([MILD, *words], capture_output=True, text=True, env={**os.environ, "CUDA_VISIBLE_DEVICES": gpu})
    if done.returncode != 0:
        fail(f"mild {words[0]}: {(done.stderr.strip() or 'no message').splitlines()[-1]}")


def same(left, right):
    """Bool: two values are the same text or the same numbers."""
    try:
        return [float(x) for x in left.split()] == [float(x) for x in right.split()]
    except ValueError:
        return left == right


def sentences():
    """{sentence: {key: (ours, the paper's)}} for all keys in which the two files differ."""
    default, paper, ours = (read_keys(ROOT / "configs" / f"{name}.ini") for name in ("default", "paper_intended", "models"))
    group = {key: name for name, keys in SENTENCES.items() for key in keys}
    found = {}
    for key in sorted({*paper, *ours}):
        pair = ours.get(key, default.get(key)), paper.get(key, default.get(key))
        if not same(*pair) and not key.startswith(COMMON):
            found.setdefault(group.get(key, key), {})[key] = pair
    order = list(SENTENCES)
    return dict(sorted(found.items(), key=lambda item: order.index(item[0]) if item[0] in order else len(order)))


def split(names, parts):
    """[(group, the others)] of so many parts."""
    groups = [names[len(names) * i // parts:len(names) * (i + 1) // parts] for i in range(parts)]
    return [(group, [name for name in names if name not in group]) for group in groups]


class Search:
    """Trainings, each by the set of sentences that are ours."""

    def __init__(self, folder, jobs, seconds, seed, gpus=("0",)):
        self.folder, self.jobs, self.seed = pathlib.Path(folder), jobs, seed
        self.gpus, self.lock = queue.SimpleQueue(), threading.Lock()
        for job in range(jobs):
            self.gpus.put(gpus[job % len(gpus)])
        self.end = time.time() + seconds
        self.longest = 0.0
        self.all = sentences()
        self.keys = hashlib.sha256(json.dumps(self.all, sort_keys=True).encode()).hexdigest()[:16]
        self.file = self.folder / "tests.json"
        try:
            self.tests = json.loads(self.file.read_text()) if self.file.exists() else []
        except ValueError as error:
            fail(f"{self.file}: {error}; remove it, or give another folder")

    def known(self, ours):
        """The training of these sentences by the same keys; a change of configs/*.ini makes it another."""
        wanted = set(ours), self.seed, self.keys
        return next((t for t in self.tests if (set(t["ours"]), t["seed"], t.get("keys")) == wanted), None)

    def train(self, ours, gpu):
        options = [f"--{key}={pair[0 if name in ours else 1].replace(' ', ',')}"
                   for name, keys in self.all.items() for key, pair in keys.items()]
        with tempfile.TemporaryDirectory() as work:
            run, result = f"{work}/run", f"{work}/eval.json"
            common = [f"--train.seed={self.seed}", *options]
            run_mild(gpu, "train", "--config", str(ROOT / "configs/models.ini"), "--out", run, *common)
            run_mild(gpu, "eval", "--policy", f"{run}/policy.safetensors", "--config", f"{run}/config.ini", "--ground",
                     "rigid,rubber,foam45,sand_loose", "--model", "mild", "--speed", "0.3,0.6", "--trials", "10", "--train.robots=batch",
                     "--json", result)
            rows = json.loads(pathlib.Path(result).read_text())["rows"]
        upright = sum(row["success"] for row in rows) / sum(row["trials"] for row in rows)
        gaps = [abs(row["velocity"] - row["speed"]) for row in rows if row["velocity"] is not None]
        gap = sum(gaps) / len(gaps) if gaps else None
        walks = upright >= 0.9 and gap is not None and gap < 0.1
        return {"ours": sorted(ours), "seed": self.seed, "upright": upright, "gap": gap, "walks": walks}

    def save(self, test):
        self.tests.append({**test, "keys": self.keys})
        part = self.file.with_suffix(".part")
        part.write_text("[\n" + ",\n".join(map(json.dumps, self.tests)) + "\n]\n")
        part.replace(self.file)
        lack = sorted(set(self.all) - set(test["ours"]))
        gap = "-" if test["gap"] is None else f"{test['gap']:.3f}"
        print(f"{'walks ' if test['walks'] else 'does not'} {test['upright']:.2f} {gap} "
              f"with {len(test['ours'])} of {len(self.all)}; not: {', '.join(lack)}", flush=True)

    def try_one(self, ours):
        """Trains on the next free GPU, if there is time for it."""
        begin = time.time()
        if begin + self.longest > self.end:
            return
        gpu = self.gpus.get()
        try:
            test = self.train(ours, gpu)
        finally:
            self.gpus.put(gpu)
        with self.lock:
            self.longest = max(self.longest, time.time() - begin)
            self.save(test)

    def walk(self, sets):
        """For each set whether it walks, None where the time is over; JOBS trainings at a time."""
        new = {frozenset(s): s for s in sets if not self.known(s)}
        with ThreadPoolExecutor(self.jobs) as pool:
            list(pool.map(self.try_one, new.values()))
        return [known["walks"] if (known := self.known(s)) else None for s in sets]

    def reduce(self):
        """(needed, bool minimal)."""
        needed, parts = list(self.all), 3
        while True:
            parts = min(parts, len(needed))
            groups = split(needed, parts)
            walks = self.walk([rest for _, rest in groups])
            spare = [(self.known(rest)["gap"], group) for (group, rest), good in zip(groups, walks) if good]
            spare = [group for _, group in sorted(spare)]  # first the one without which it follows the speed best
            if spare:  # all of them at once, or half of them, ...: the most that it walks without
                taken = [spare[:len(spare) >> k] for k in range(len(spare).bit_length())]
                fewer = [[s for s in needed if not any(s in group for group in some)] for some in taken]
                walks += self.walk(fewer)
                needed = next(rest for rest, good in zip(fewer, walks[parts:]) if good)
            elif parts == len(needed):
                return needed, None not in walks
            else:
                parts *= 2
            if None in walks or not needed:
                return needed, not needed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", help="for tests.json and needed.json")
    parser.add_argument("--jobs", type=int, default=3, help="trainings at a time on all GPUs")
    parser.add_argument("--gpus", default=os.environ.get("CUDA_VISIBLE_DEVICES") or "0", help="that share them, by number: 0,1 (0)")
    parser.add_argument("--seconds", type=float, default=1e9, help="no training begins that would not end by then")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--figure", metavar="PICTURE.png", help="draw the trainings of FOLDER, train nothing")
    parser.add_argument("--list", action="store_true", help="print the sentences and their keys, train nothing")
    asked = parser.parse_args()
    if asked.list:
        for name, keys in sentences().items():
            print(name + ": " + "; ".join(f"{key} = {ours} (the paper: {paper})" for key, (ours, paper) in keys.items()))
        return
    if not asked.folder:
        parser.error("give a folder")
    if asked.figure:
        import figures  # matplotlib is only asked of those who draw
        search = Search(asked.folder, 1, 0, asked.seed)
        figures.choices(list(search.all), [t for t in search.tests if (t.get("keys"), t["seed"]) == (search.keys, search.seed)]).savefig(asked.figure, dpi=100)
        return
    if not os.access(MILD, os.X_OK):
        fail(f"{MILD}: no such program; make build, or set MILD")
    pathlib.Path(asked.folder).mkdir(parents=True, exist_ok=True)
    search = Search(asked.folder, asked.jobs, asked.seconds, asked.seed, asked.gpus.split(","))
    every = list(search.all)
    walks = search.walk([every, [], *(part for pair in split(every, 3) for part in pair)])  # what reduce asks first, at once
    if not walks[0] or walks[1]:
        fail("the time is over" if walks[0] is None else "configs/models.ini does not walk" if not walks[0] else
             "the paper's training walks as it is")
    needed, minimal = search.reduce()
    result = {"needed": needed, "minimal": minimal, "trainings": len(search.tests), "sentences": len(search.all)}
    (search.folder / "needed.json").write_text(json.dumps(result, indent=1) + "\n")
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
