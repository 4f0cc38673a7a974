#!/usr/bin/env python3
"""Does seeing save falls? The trials of `lab/paper/exam.py --parts slip_border`, and longer courses, by a robot that slows before a border
that it sees: where the ground ahead looks unlike that of its last step. `mild eval --led` asks it how fast to go.

  lab/see/slow.py                                             # all courses
  lab/see/slow.py --seed 2 --courses exam --walkers blind,sees

Walkers: blind; sees; alike: sees, but the floor looks like sand; knows the borders; random: slows as often, anywhere; steady: walks at the
mean speed of the one that sees."""
import argparse
import concurrent.futures
import itertools
import json
import pathlib
import subprocess
import sys
import tempfile
import zlib

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "lab/paper"), str(ROOT / "lab/see")]
import exam  # noqa: E402
import see  # noqa: E402

SAND = see.LOOKS[0][0]
LOOK = {"rigid": (0.50, 0.40, 0.25), "alike": SAND, **{name: look for look, names in see.LOOKS for name in names}}  # rigid: a grey floor
COURSES = {"exam": ("rigid+{0}+rigid", exam.SLOWLY, 24), "far": ("rigid+rigid+rigid+rigid+rigid+{0}+rigid", [0.6, 0.9], 28),
           "wide": ("rigid+{0}+{0}+{0}+rigid", [0.6, 0.9], 28)}  # {0}: a sand; patches of 1.5 m, speeds, seconds
PLAIN = {"one ground": ["rigid+rigid+rigid", "foam45", "grass", "rubber"],
         "harmless borders": [f"rigid+{soil}+rigid" for soil in ("foam45", "grass", "rubber")]}
SLOW = 0.3  # [m/s]
THRESHOLD, REACH, STEPS = 0.7, 0.8, 10  # by walks at constant speed without a robot; [s] ahead, and steps beyond: by trials of seed 2
COLUMNS = round((see.FRONT + 10 - see.BACK) / see.PITCH)


def color_of(names, rng):
    """[columns][rows][3] A course as see.py draws strips: a shade of each soil, firmer parts darker, grains, one light."""
    x = see.BACK + see.PITCH * (np.arange(COLUMNS) + 0.5)
    shade = {name: np.array(LOOK[name]) + rng.normal(0, see.SHADES, 3) for name in dict.fromkeys(names)}
    own = np.array([shade[name] for name in names])[np.clip((x // exam.PATCH).astype(int), 0, len(names) - 1)]
    rough = np.convolve(rng.normal(size=COLUMNS // 5 + 3), np.ones(3) / 3**0.5, "valid").repeat(round(see.CELL / see.PITCH))[:COLUMNS]
    own = own - 0.04 * (np.digitize(rough, (-0.5, 0.5)) - 1)[:, None]
    return np.maximum(own[:, None] + rng.normal(0, see.GRAIN, (COLUMNS, len(see.ACROSS), 3)), 0.02) * np.exp(rng.normal(0, see.GAIN))


def column(x):
    return np.clip(((np.asarray(x) - see.BACK) / see.PITCH).astype(int), 0, COLUMNS - see.LONG)


class Walker:
    """Is told how fast to go, and says how fast it goes. Which borders there are, only the judge knows."""

    def __init__(self, kind, told, names, rng, given):
        self.kind, self.told, self.given, self.rng, self.end = kind, told, given, rng, exam.PATCH * len(names)
        self.true = [exam.PATCH * (n + 1) for n in range(len(names) - 1) if names[n] != names[n + 1]]
        self.known = {"knows": self.true, "random": list(rng.uniform(0.1, self.end, len(self.true)))}.get(kind)
        self.color, self.sum, self.count = color_of(names, rng), np.zeros((COLUMNS, 3)), np.zeros(COLUMNS)
        self.delay, self.shots, self.next = rng.uniform(*see.DELAY), [], 0
        self.down, self.step, self.border, self.left = np.ones(2, bool), 0, 0, 0
        self.log = {"passed": None, "slow": 0, "alarms": 0, "met": [], "way": 0}

    def speed(self, time, feet):
        """feet: [2][ankle 3, load]."""
        base, steps = float(feet[:, 0].mean()), (feet[:, 3] > see.LOADED) & ~self.down
        self.down = (feet[:, 3] > see.LOADED) | self.down & (feet[:, 3] > 0)
        for f in np.flatnonzero(steps):
            self.step = float(feet[f, 0])
            self.left -= bool(self.left > 0 and self.step > self.border)
        border, log = self.find(time, base, feet), self.log
        if border is not None:
            log["alarms"] += int(self.left == 0)
            self.border, self.left = border, self.given.steps
        log.update(passed=log["passed"] or (time if base > self.end else None), slow=log["slow"] + (self.left > 0), way=base)
        log["met"] += [bool(self.left)] * (len(log["met"]) < len(self.true) and base > self.true[len(log["met"])])
        return self.given.mean[self.told] if self.kind == "steady" else min(self.told, SLOW) if self.left else self.told

    def find(self, time, base, feet):
        """[m] Where the ground in reach begins to look unlike that of the last step, by what has come of the camera; or None."""
        reach = base + 0.3 + REACH * self.told
        if self.known is not None:
            return min((x for x in self.known if max(base, self.step) < x < reach), default=None)
        if self.kind not in ("sees", "alike"):
            return None
        if time >= self.next:
            self.next = time + see.SEEN - 1e-9
            dx, dy = base + see.AHEAD - feet[:, :1], see.ACROSS - (feet[:, 1:2] - feet[:, 1].mean())
            hidden = (((dx > -0.1) & (dx < 0.22))[:, :, None] & (abs(dy) < 0.08)[:, None]).any(0)
            shown = (self.rng.random(hidden.shape) > see.DROP) & ~hidden
            taken = self.color[column(base + see.AHEAD)] + self.rng.normal(0, see.GRAIN, (*shown.shape, 3))
            self.shots.append((time + self.delay, (taken * shown[..., None]).sum(1), shown.sum(1)))
        if not self.shots or self.shots[0][0] > time:
            return None
        _, color, count = self.shots.pop(0)
        at = column(base + see.AHEAD)  # where the base is when it comes
        np.add.at(self.sum, at, color)
        np.add.at(self.count, at, count)
        first, last = column((self.step - see.PITCH * see.LONG / 2, min(reach, base + see.AHEAD[-1])))
        total, count = (np.lib.stride_tricks.sliding_window_view(array[first:max(first, last) + see.LONG], see.LONG, 0).sum(-1)
                        for array in (self.sum, self.count))
        bright, hue, texture = np.log(np.maximum(total, 1e-3) / np.maximum(count, 1)[:, None]).T / 0.5
        look = np.stack([bright, hue - bright, texture - bright], 1)
        unlike = np.flatnonzero((count > 20) & (np.linalg.norm(look - look[0], axis=1) > self.given.threshold)) if count[0] > 20 else []
        return see.BACK + see.PITCH * (first + unlike[0] + see.LONG / 2) if len(unlike) else None


def lead(kind, given, *arguments):
    """What `mild eval` prints, where walkers lead; each trial also has the walker's log."""
    words, walkers = list(map(str, arguments)), []
    grounds, key = words[words.index("--ground") + 1].split(","), zlib.crc32(" ".join(words[words.index("--ground"):]).encode())
    rows = [(ground.replace("rigid", "alike") if kind == "alike" else ground, float(v)) for ground in grounds
            for word in words if word.startswith("--speed=") for v in word[8:].split(",")]
    with tempfile.TemporaryDirectory() as folder:
        words[words.index("--json") + 1], words[words.index("--seconds") + 1] = f"{folder}/rows.json", str(given.seconds)
        with subprocess.Popen([*exam.measure.MILD, *words, "--led"], cwd=ROOT, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE) as process:
            for line in process.stdout:
                trial, time, *feet = map(float, line.split())
                if time < 0.015:
                    walkers += [[]] * (trial == 0)
                    ground, v = rows[len(walkers) - 1]
                    rng = np.random.default_rng((key, len(walkers), int(trial)))
                    walkers[-1] = [*walkers[-1], Walker(kind, v, ground.split("+"), rng, given)]
                process.stdin.write(f"{walkers[-1][int(trial)].speed(time, np.reshape(feet, (2, 4))):.9g}\n")
                process.stdin.flush()
            told = process.stderr.read()
        if process.returncode:
            sys.exit(f"slow: {told.strip()}")
        report = json.loads(pathlib.Path(folder, "rows.json").read_text())
    for row, own in zip(report["rows"], walkers):
        for one, walker in zip(row["each"], own):
            one.update(walker.log)
    return json.dumps(report)


def judge(kind, course, given):
    """[(speed, trial)] of the exam's part on a course."""
    form, speeds, given.seconds = COURSES[course]
    exam.SLIDES["slip_border"] = "", [form.format(sand) for sand in exam.SANDS], speeds, ["--patch", exam.PATCH]
    exam.mild = lambda *arguments: lead(kind, given, *arguments)
    with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
        rows = [row for rows in pool.map(lambda task: task(), exam.tasks(given.exam, "slip_border")) for row in rows]
    return [(row["speed"], one) for row in rows for one in row["each"]]


def wilson(k, n, z=1.96):
    """[%] 95 % interval."""
    middle, half = (k + z * z / 2) / (n + z * z), z / (n + z * z) * (k * (1 - k / n) + z * z / 4)**0.5
    return f"{100 * max(middle - half, 0):.0f}-{100 * (middle + half):.0f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, value in {"seed": 1, "jobs": 2, "courses": ",".join([*COURSES, "plain"]), "walkers": "blind,sees,alike,knows,random,steady",
                        "threshold": THRESHOLD, "steps": STEPS}.items():
        parser.add_argument(f"--{name}", type=type(value), default=value)
    given = parser.parse_args()
    if "steady" in given.walkers and "sees" not in given.walkers.split("steady")[0]:
        parser.error("--walkers: steady has the speed of sees, which comes before it")
    given.exam, given.mean = exam.parse(["--out", "out", "--seed", str(given.seed)]), {}
    for course in given.courses.split(","):
        for kind in given.walkers.split(",") if course in COURSES else ():
            trials, line = judge(kind, course, given), f"{course} {kind:7}"
            for v in (*COURSES[course][1], None):
                own = [one for speed, one in trials if v in (speed, None)]
                fell, took = sum(one["end"] != "time" for one in own), np.mean([one["passed"] for one in own if one["passed"]])
                met = [m for one in own for m in one["met"]]
                line += f" | {v or 'all'}: {fell:3} of {len(own)} ({wilson(fell, len(own))} %), {took:5.2f} s, {sum(met)} of {len(met)} met"
                if kind == "sees":
                    given.mean[v] = exam.PATCH * (COURSES[course][0].count("+") + 1) / took
            print(line, flush=True)
    if "plain" in given.courses:
        given.seconds = 12
        for (what, grounds), kind in itertools.product(PLAIN.items(), ("blind", "sees")):
            exam.mild = lambda *arguments, kind=kind: lead(kind, given, *arguments)
            for v in (0.6, 0.9):
                rows = exam.walk(given.exam, grounds, [v], 10, ["--patch", exam.PATCH, "--seconds", given.seconds])
                own = [one for row in rows for one in row["each"]]
                way, time, slow = (sum(one[key] for one in own) for key in ("way", "seconds", "alarms"))
                print(f"{what}, {kind}, told {v} m/s: {way / time:.3f} m/s, {slow} times slow in {way:.0f} m", flush=True)


if __name__ == "__main__":
    main()
