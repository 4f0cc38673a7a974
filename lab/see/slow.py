#!/usr/bin/env python3
"""Does seeing save falls? On the trials of `lab/paper/exam.py --parts slip_border` the robot slows before a border that it sees.

  lab/see/slow.py                       # eight walkers, 288 trials each, and courses without slip
  lab/see/slow.py --seed 2 --walkers sees --threshold 0.5    # other trials

The robot compares what the ground ahead looks like with the ground of its last step. It is led by `mild eval --led`."""
import argparse
import concurrent.futures
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

FLOOR = (0.50, 0.40, 0.25)  # the look of `rigid`: darker than sand, of nearly its hue and texture
LOOK = {"rigid": FLOOR, **{name: look for look, names in see.LOOKS for name in names}}
COURSE = 3 * exam.PATCH  # [m]
SLOW, SECONDS = 0.3, exam.transitions.START + COURSE / min(exam.SLOWLY)  # [m/s], [s] of a trial of any walker
THRESHOLD, REACH, STEPS = 0.5, 0.8, 4  # looks that differ by more; [s] ahead in which it slows; steps beyond
COLUMNS = round((see.FRONT + 4 - see.BACK) / see.PITCH)


def look_along(names, rng):
    """[columns][rows][3] (brightness, hue, texture) of a course, as strips of see.py have them: in shades, firmer parts, and grains."""
    x = see.BACK + see.PITCH * (np.arange(COLUMNS) + 0.5)
    shade = {name: np.array(LOOK[name]) + rng.normal(0, see.SHADES, 3) for name in dict.fromkeys(names)}
    own = np.array([shade[name] for name in names])[np.clip((x // exam.PATCH).astype(int), 0, len(names) - 1)]
    rough = np.convolve(rng.normal(size=COLUMNS // 5 + 3), np.ones(3) / 3**0.5, "valid").repeat(round(see.CELL / see.PITCH))[:COLUMNS]
    own = own - 0.04 * (np.digitize(rough, (-0.5, 0.5)) - 1)[:, None]
    return np.maximum(own[:, None] + rng.normal(0, see.GRAIN, (COLUMNS, len(see.ACROSS), 3)), 0.02) * np.exp(rng.normal(0, see.GAIN))


class Walker:
    """Is told how fast to go, and says how fast it goes."""

    def __init__(self, told, names, rng, given):
        self.told, self.given, self.color, self.rng = told, given, look_along(names, rng), rng
        self.sum, self.count = np.zeros((COLUMNS, 3)), np.zeros(COLUMNS)
        self.delay, self.shots, self.next = rng.uniform(*see.DELAY), [], 0
        self.down, self.step, self.border, self.left = np.ones(2, bool), None, np.inf, 0
        self.passed, self.slow, self.alarms, self.at = None, 0, [], 0

    def speed(self, time, feet):
        """feet: [2][ankle 3, load]."""
        base, self.at = feet[:, 0].mean(), time
        for f in np.flatnonzero((feet[:, 3] > see.LOADED) & ~self.down):
            self.step = feet[f, 0] + 0.03
            self.left -= self.left > 0 and self.step > self.border
        self.down = (feet[:, 3] > see.LOADED) | self.down & (feet[:, 3] > 0)
        self.passed = time if self.passed is None and base > COURSE else self.passed
        border = self.find(time, base, feet)
        if border is not None:
            self.alarms += [base] * (self.left == 0)
            self.border, self.left = border, self.given.steps
        self.slow += self.left > 0
        return min(self.told, SLOW) if self.left else self.told

    def find(self, time, base, feet):
        """Blind."""

    def reach(self, base):
        return base + 0.1 + self.given.reach * self.told


def column(x):
    return np.clip(((np.asarray(x) - see.BACK) / see.PITCH).astype(int), 0, COLUMNS - 1)


def features(color):
    bright, hue, texture = np.log(np.maximum(color, 0.01)).T
    return np.stack([bright, hue - bright, texture - bright], -1) / 0.5


class Sees(Walker):
    def find(self, time, base, feet):
        """[m] Where the ground ahead begins to look different from that of the last step; None: nowhere in reach."""
        if time >= self.next:
            self.next = time + see.SEEN - 1e-9
            dx, dy = base + see.AHEAD - feet[:, :1], see.ACROSS - (feet[:, 1:2] - feet[:, 1].mean())
            hidden = ((dx > -0.1) & (dx < 0.22))[:, :, None] & (abs(dy) < 0.08)[:, None]
            shown = (self.rng.random(hidden.shape[1:]) > see.DROP) & ~hidden.any(0)
            taken = self.color[column(base + see.AHEAD)] + self.rng.normal(0, see.GRAIN, (*shown.shape, 3))
            self.shots.append((time + self.delay, (taken * shown[..., None]).sum(1), shown.sum(1)))
        new = False
        while self.shots and self.shots[0][0] <= time:
            _, color, count = self.shots.pop(0)
            np.add.at(self.sum, column(base + see.AHEAD), color)  # where the base is when it comes
            np.add.at(self.count, column(base + see.AHEAD), count)
            new = True
        if not new or self.step is None:
            return None
        return self.different(base)

    def different(self, base):
        first, last = column((self.step - 0.15, self.reach(base)))
        total, count = (np.lib.stride_tricks.sliding_window_view(array[first:min(last, column(base + 1.3)) + see.LONG], see.LONG, 0).sum(-1)
                        for array in (self.sum, self.count))
        seen = count > 20
        if len(seen) < 2 or not seen[0]:
            return None
        look = features(total / np.maximum(count, 1)[:, None])
        differs = np.flatnonzero(seen & (np.linalg.norm(look - look[0], axis=1) > self.given.threshold))
        return see.BACK + see.PITCH * (first + differs[0] + see.LONG / 2) if len(differs) else None


class Knows(Walker):
    """Where the borders are."""
    borders = exam.PATCH, 2 * exam.PATCH

    def find(self, time, base, feet):
        ahead = [x for x in self.borders if max(base, self.step or 0) < x < self.reach(base)]
        return min(ahead, default=None)


class Random(Knows):
    """As many borders, but anywhere."""

    def __init__(self, *given):
        super().__init__(*given)
        self.borders = self.rng.uniform(0.1, COURSE, 2)


class Steady(Walker):
    """At the mean speed of those who see."""

    def speed(self, time, feet):
        super().speed(time, feet)
        return self.given.mean.get(self.told, self.told)


WALKERS = {"blind": Walker, "sees": Sees, "knows": Knows, "random": Random, "steady": Steady}


def lead(kind, given, *arguments):
    """What `mild eval` prints, where walkers lead; each trial of a row says when it passed the course, and how long it was slow."""
    words = list(map(str, arguments))
    grounds, told = words[words.index("--ground") + 1].split(","), [float(v) for word in words if word.startswith("--speed=") for v in word[8:].split(",")]
    key = zlib.crc32(" ".join(words[words.index("--ground"):]).encode())
    rows, walkers = [(ground, v) for ground in grounds for v in told], []
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "rows.json"
        words[words.index("--json") + 1] = str(file)
        if "--seconds" in words:
            words[words.index("--seconds") + 1] = f"{SECONDS:g}"
        with subprocess.Popen([*exam.measure.MILD, *words, "--led"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                              cwd=ROOT) as process:
            while question := process.stdout.read(80):
                trial, time, *feet = np.frombuffer(question)
                if time < 0.015:
                    if trial == 0:
                        walkers.append([])
                    ground, v = rows[len(walkers) - 1]
                    walkers[-1].append(WALKERS[kind](v, ground.split("+"), np.random.default_rng((key, len(walkers), int(trial))), given))
                speed = walkers[-1][int(trial)].speed(time, np.reshape(feet, (2, 4)))
                process.stdin.write(np.float64(speed).tobytes())
                process.stdin.flush()
        report = json.loads(file.read_text())
    for row, own in zip(report["rows"], walkers):
        for one, walker in zip(row["each"], own):
            one.update(passed=walker.passed, slow=walker.slow / 100, alarms=walker.alarms)
    return json.dumps(report)
