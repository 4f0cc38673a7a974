#!/usr/bin/env python3
"""How deep will the foot go? Learned for the cells ahead of a walking robot, before contact: from prints that a height scan sees, from
what the ground looks like, and from the robot's own last steps.

  lab/see/see.py walk out/see      # 640 strips of ground, each walked by two robots, one after the other
  lab/see/see.py train out/see     # NumPy alone; writes out/see/weights.npz
  lab/see/see.py judge out/see     # on strips that were not learned from

On a strip the shipped policy walks under `mild eval --program`, whose soft ground is this file, by mild.Ground."""
import argparse
import configparser
import itertools
import math
import os
import pathlib
import subprocess
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "lab/know"))
from know import Adam, elu  # noqa: E402

# ---- strips of ground ----

CELL, BACK, FRONT, SIDE = 0.25, -1.5, 11.0, 0.55  # [m] of the pattern; extent of the strip
BATCH = 8  # strips whose walkers are asked for one speed
KINDS, VARIANTS, SOFTEST, WEIGHT = 4, 3, 0.07, 325.0  # soils of a strip, each in variants; [m] randomize.sinkage_max; [N] of the SA01
# What looks alike: (brightness, hue, texture), and presets
LOOKS = (((0.75, 0.62, 0.35), ("sand_loose", "sand_dense", "dry_sand_loose", "dry_sand_close", "moist_sand")),
         ((0.60, 0.45, 0.30), ("foam60", "foam45", "foam28", "foam25")), ((0.35, 0.70, 0.70), ("grass", "artificial_turf")),
         ((0.90, 0.30, 0.25), ("fresh_snow", "groomed_snow")), ((0.25, 0.40, 0.45), ("rubber", "rubber_tile", "running_track")),
         ((0.40, 0.55, 0.60), ("gym_mat", "carpet")))
RANGES = {"k_pen": (8, 1400), "sigma_cone": (1e4, 2.4e5), "alpha": (0.698, 1.31), "nu": (0.8, 2.4), "c_g": (0, 4.6), "c_d": (0.5, 28),
          "phi": (0.5, 0.64), "mu": (0.2, 1.3), "recovery": (0, 1), "bed_depth": (0.1, 0.15)}
SHADES, GAIN, GRAIN = 0.05, 0.25, 0.03  # of looks: between soils of a family, of the light [log], from cell to cell


def soles_of(robot):
    import mild
    ini = configparser.ConfigParser(inline_comment_prefixes=";")
    ini.read(ROOT / f"robots/{robot}/robot.ini")
    return [mild.Sole(np.array(ini[part]["outline"].split(), float).reshape(-1, 2), 0.0, ini[part].getfloat("z"), ini[part].getint("elements", 0))
            for part in ini.sections() if part.startswith("foot.")]


def draw_soil(rng, sole):
    """(material, look [3]), as randomize of configs/default.ini draws it. What stays dented looks like sand or snow, what springs back
    like foam, rubber or a mat, what does half of it like grass."""
    import mild
    if rng.random() < 5 / 9:
        look, name = [(look, name) for look, names in LOOKS for name in names][rng.integers(18)]
        soil = mild.Material(name)
        for field in ("k_pen", "sigma_cone", "mu", "c_d", "c_g", "k_drift", "b_drift"):
            setattr(soil, field, getattr(soil, field) * rng.uniform(0.8, 1.2))
    else:
        draw = rng.integers(6)
        soil = mild.Material("sand_loose", model="mild", slip_length=0, grip=0, slip_growth=0, k_drift=400, b_drift=0.1,
                             **{field: rng.uniform(*ends) for field, ends in RANGES.items()})
        alike = (0, 3) if soil.recovery < 0.35 else (1, 4, 5) if soil.recovery > 0.65 else (2,)
        look = LOOKS[alike[draw % len(alike)]][0]
        while sole.sinkage(mild.Material(soil, bed_depth=10), WEIGHT) > SOFTEST:
            soil.k_pen, soil.sigma_cone = 1.1 * soil.k_pen, 1.1 * soil.sigma_cone
        if soil.recovery <= 0.2:
            soil = soil.match("mild_merged", sole, WEIGHT / 2)
            soil.slip_length, soil.grip = rng.uniform(0.001, 0.01), rng.uniform(0.08, 0.3)
    return soil, np.array(look)


class Strip:
    """Number `number` of all strips: soils in patches of 1 to 3 m along x, each with firmer and softer parts."""

    def __init__(self, number, sole=None):
        rng = np.random.default_rng((2026, number))
        self.soils, looks = [], []
        edges, kinds = [BACK + 1.5 + rng.uniform(1, 3)], [int(rng.integers(KINDS))]
        while edges[-1] < FRONT:
            kinds.append(int((kinds[-1] + rng.integers(1, KINDS)) % KINDS))
            edges.append(edges[-1] + rng.uniform(1, 3))
        self.edges, self.kinds = np.array(edges), np.array(kinds)
        self.speed, self.gain, self.dy = rng.uniform(0.4, 0.9, 2), np.exp(rng.normal(0, GAIN)), rng.normal(0, 0.03)
        self.earlier = "g1" if number // BATCH % 3 == 2 else "sa01"
        if rng.random() < 0.4:
            self.dy = rng.choice([-1, 1]) * rng.uniform(0.15, 0.35)  # the earlier walker went beside, not here
        self.stretch = np.cumsum(rng.uniform(0.8, 2.5, 12)) - rng.uniform(0, 2)  # its prints are left in every other
        middle = BACK + CELL * (np.arange(round((FRONT - BACK) / CELL)) + 0.5)
        rough = np.convolve(rng.normal(size=len(middle) + 2), np.ones(3) / math.sqrt(3), "valid")
        self.labels = VARIANTS * self.kinds[self.patch(middle)] + np.digitize(rough, (-0.5, 0.5))  # [columns]; along y all is the same
        seeds = rng.integers(2**31, size=KINDS)
        for seed in seeds[:KINDS * (sole is not None)]:
            own = np.random.default_rng(seed)
            soil, look = draw_soil(own, sole)
            look = look + np.random.default_rng((seed, 1)).normal(0, SHADES, 3)
            for z in range(VARIANTS):
                factor = math.exp(own.uniform(0.1, 0.25) * (z - 1))
                self.soils.append(type(soil)(soil, k_pen=soil.k_pen * factor, sigma_cone=min(soil.sigma_cone * factor, 5e6)))
                looks.append(look - 0.04 * (z - 1))  # the firmer, the darker
        self.looks = np.array(looks)

    def label(self, x):
        return self.labels[np.clip(((np.asarray(x) - BACK) / CELL).astype(int), 0, len(self.labels) - 1)]

    def patch(self, x):
        return np.searchsorted(self.edges, x)


# ---- the ground under `mild eval --program` ----

GRID = 0.02  # [m] of the map of prints
LOADED, PAUSE, SHORTEST, SEEN = 20.0, 0.06, 0.15, 0.03  # [N], [s] between two stances, [s] of a stance, [s] between two scans


def stances_of(rows, sole):
    """[dict] of a foot's rows [time, force up, ankle 3, rotation 9] while it bore something."""
    points = np.stack([sole.x, sole.y, np.full(sole.elements, sole.z)], 1)
    for own in np.split(rows, np.flatnonzero(np.diff(rows[:, 0]) > PAUSE) + 1) if len(rows) else []:
        if own[:, 1].max() > LOADED and own[-1, 0] - own[0, 0] > SHORTEST:
            middle = own[:, 4] + own[:, 11:14] @ points.mean(0)
            at = own[np.argmin(middle)]
            yield {"begin": own[0, 0], "end": own[-1, 0], "points": at[2:4] + points @ at[5:14].reshape(3, 3)[:2].T, "rows": own,
                   "depth": max(-middle.min(), 0)}


def earlier_prints(ground, strip, file):
    """Leads an earlier walker's feet as they went; depth of its prints, and what is seen of it, on a grid [rows][columns]; where they are."""
    with np.load(file) as log:
        foot, place, cuts, rows, velocity = log["foot"], log["place"], np.r_[0, np.cumsum(log["count"])], log["rows"], log["velocity"]
    left = np.searchsorted(strip.stretch, place[:, 0]) % 2 == 0
    for k in np.flatnonzero(left):
        f, away = 2 + foot[k], (np.r_[0, 0, 0, 0, 10, np.eye(3).ravel()], np.zeros(6))
        for own, twist in [*zip(rows[cuts[k]:cuts[k + 1]], velocity[cuts[k]:cuts[k + 1]]), away]:
            ground.position[f], ground.rotation[f] = own[2:5], own[5:14].reshape(3, 3)
            ground.velocity[f] = ground.free_velocity[f] = twist
            ground.solve()
            ground.advance()
    x, y = np.arange(BACK, FRONT, GRID), np.arange(-SIDE, SIDE, GRID)
    depth = np.array([[ground.print_at(a, b) for a in x] for b in y], np.float32)
    recovery = np.array([soil.recovery for soil in strip.soils], np.float32)[strip.label(x)]
    return {"old": depth, "visible": depth * (1 - recovery), "old_place": place[left]}


def ground(given):
    """Answers the questions of src/run/eval/other_ground.h."""
    import mild
    soles, need = soles_of("sa01"), 8 * (4 + 2 * 18 + 12 + 144)  # bytes of a question
    raw = sys.stdin.buffer.read(need)
    if len(raw) < need:
        return
    dt, number = float(np.frombuffer(raw)[2]), given.first + int(np.frombuffer(raw)[3])
    strip = Strip(number, soles[0])
    soles = soles + soles_of(strip.earlier) if given.turn else soles_of(strip.earlier)
    pattern = mild.Map("flat", patches="image", labels=strip.labels[None], patch_size=CELL, cell=0.05, border=0.1)
    under = mild.Ground(soles, mild.Terrain(strip.soils, map=pattern, map_x=(BACK + FRONT) / 2), dt, tiles=2048)
    under.position[:] = 0, 0, 10
    extra = earlier_prints(under, strip, given.folder / f"{number}-0.npz") if given.turn else {}
    rows, speeds, frames, answer, shift, lane = ([], []), ([], []), [], np.zeros((2, 8)), np.zeros((2, 3)), (strip.dy, 0)[given.turn]
    position, rotation, velocity, free = (array[:2] for array in (under.position, under.rotation, under.velocity, under.free_velocity))
    for k in itertools.count():
        question = np.frombuffer(raw)
        feet = question[4:40].reshape(2, 18)
        for f in (0, 1):  # along y all is the same: a foot in the air goes on in the lane, from which the robot drifts
            shift[f, 1] = lane - feet[:, 1].mean() if answer[f, 6] == 0 else shift[f, 1]
        position[:], rotation[:], velocity[:] = feet[:, :3] + shift, feet[:, 3:12].reshape(2, 3, 3), feet[:, 12:]
        free[:], under.inverse_inertia[:12, :12] = question[40:52].reshape(2, 6), question[52:].reshape(12, 12)
        under.solve()
        answer[:, :3], answer[:, 3:6], answer[:, 6], answer[:, 7] = under.force[:2], under.torque[:2], under.depth_max[:2], under.depth_mean[:2]
        sys.stdout.buffer.write(answer.tobytes())
        sys.stdout.buffer.flush()
        for f in np.flatnonzero(answer[:, 6]):
            rows[f].append(np.concatenate([(question[1], answer[f, 2]), position[f], rotation[f].ravel()]))
            speeds[f].append(under.new_velocity[f].copy())
        if k % round(SEEN / dt) == 0:
            frames.append(np.concatenate([(question[1],), position.ravel()]))
        under.advance()
        raw = sys.stdin.buffer.read(need)
        if len(raw) < need:
            break
    stances = sorted((dict(one, foot=f) for f in (0, 1) for one in stances_of(np.array(rows[f]), soles[f])), key=lambda one: one["begin"])
    log, frames = {name: np.array([one[name] for one in stances]) for name in ("begin", "end", "points", "depth", "foot")}, np.array(frames)
    if given.turn == 0:
        speed = [dict(zip((row[0] for row in rows[f]), speeds[f])) for f in (0, 1)]
        extra = {"rows": np.concatenate([one["rows"] for one in stances]), "count": [len(one["rows"]) for one in stances],
                 "velocity": np.array([speed[one["foot"]][row[0]] for one in stances for row in one["rows"]])}
    np.savez(given.folder / f"{number}-{given.turn}.npz", frames=frames, place=log["points"].mean(1), **log, **extra)


def walk(given):
    """Each strip twice: by the earlier walker, then by the one that is asked."""
    given.folder.mkdir(parents=True, exist_ok=True)
    for first, turn in itertools.product(range(given.first, given.first + given.strips, BATCH), (0, 1)):
        strip = Strip(first)
        if not (given.folder / f"{first + BATCH - 1}-{turn}.npz").exists():
            subprocess.run([os.environ.get("MILD", ROOT / "build/mild"), "eval", "--robot", "sa01" if turn else strip.earlier, "--ground", "rubber",
                            "--speed", f"{strip.speed[turn]:.3f}", "--trials", str(BATCH), "--seconds", str(given.seconds), "--threads", "1", "--seed",
                            str(first + turn), "--program", f"{sys.executable} {__file__} ground {given.folder} --first {first} --turn {turn}"],
                           check=True, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}, stdout=subprocess.DEVNULL)


# ---- what the robot sees and knows before a foot lands ----

LEAD, KNOWN = 0.3, 0.25  # [s] before contact at which it is asked; after which it knows how deep a foot went that stands
AHEAD, ACROSS = np.arange(0.1, 1.31, 0.1), np.arange(-0.45, 0.451, 0.05)  # [m] of the scan: 247 points
NOISE, OFFSET, DROP, DELAY = 0.02, 0.03, 0.02, (0.02, 0.06)  # randomize.scan_noise and so on
PITCH, LONG, WIDE, BEHIND = 0.05, 5, 2, 2  # [m] of the robot's map of heights; cells of it under a sole; [m] kept behind
STEPS, PRINTS, LEAST, SIGNIFICANT, MM = 12, 10, 0.004, 2.3, 1e-3  # last steps and deepest prints; [m] under a cell; 4 deviations
OWN_NOISE, OWN_SCALE, AIM = 0.002, 0.1, 0.02  # [m], [-] of the depth of its own steps; [m] of where the foot lands
CASES = ("border, look alone", "border, prints there", "border, walked before", "onto an old print", "same patch")
ELEMENT, QUERY, MIDDLE = 10, 7, -4.5  # numbers of a piece of evidence, of the cell; middle of log depths


def log_depth(depth):
    """Of [m], with a millimetre more, about 0."""
    return np.log(MM + np.maximum(depth, 0)) - MIDDLE


class Scan:
    """The map that a robot makes of the heights around it, of scans that are noisy, late, dropped and hidden by its legs."""

    def __init__(self, log, lane, rng):
        self.time, ankles = log["frames"][:, 0], log["frames"][:, 1:].reshape(-1, 2, 3)
        self.base, self.x0 = ankles[:, :, 0].mean(1), BACK - 1
        self.delay, self.next = rng.uniform(*DELAY), 0
        late = np.interp(self.time + self.delay, self.time, self.base)  # where the base is when a scan comes
        x, y = (grid.ravel() for grid in np.meshgrid(AHEAD, ACROSS))
        at_x, at_y = self.base[:, None] + x, ankles[:, :, 1].mean(1)[:, None] + y
        height = rng.uniform(-NOISE, NOISE, at_x.shape) + rng.uniform(-OFFSET, OFFSET)
        if "visible" in log:
            height -= log["visible"][grid_at(log, at_x, at_y)]
        hidden = rng.random(height.shape) < DROP
        for foot in (0, 1):
            dx, dy = at_x - ankles[:, foot, :1], at_y - ankles[:, foot, 1:2]
            hidden |= (dx > -0.1) & (dx < 0.22) & (abs(dy) < 0.08)
        self.columns = round((FRONT + 2 - self.x0) / PITCH)
        self.y0, rows = lane + ACROSS[0] - 0.15, round((ACROSS[-1] - ACROSS[0] + 0.3) / PITCH)
        row, column = np.clip(((at_y - self.y0) / PITCH).astype(int), 0, rows - 1), ((late[:, None] + x - self.x0) / PITCH).astype(int)
        self.cells, self.height, self.shown = row * self.columns + column, np.where(hidden, 0, height), ~hidden * 1.0
        self.sum, self.count = np.zeros((2, rows * self.columns))

    def until(self, time):
        """(sum over scans of the depth below the level around, number of scans) [rows][columns]; columns in view, of all scans that came."""
        new = slice(self.next, max(int(np.searchsorted(self.time, time - self.delay, side="right")), self.next))
        for total, weight in ((self.sum, self.height), (self.count, self.shown)):
            total += np.bincount(self.cells[new].ravel(), weight[new].ravel(), len(total))
        self.next, base = new.stop, float(np.interp(time, self.time, self.base))
        total, count = self.sum.reshape(-1, self.columns), self.count.reshape(-1, self.columns)
        near = slice(max(int((base - BEHIND - self.x0) / PITCH), 0), int((base + AHEAD[-1] + 0.1 - self.x0) / PITCH))
        seen = count[:, near] > 2
        level = np.median(total[:, near][seen] / count[:, near][seen]) if seen.any() else 0
        return level * count - total, count, near

    def under(self, depth, count, x, y):
        """[m] mean depth under a sole whose middle is (x, y)."""
        i, j = round((y - self.y0) / PITCH - WIDE / 2), round((x - self.x0 - PITCH * LONG / 2) / PITCH)
        box = slice(max(i, 0), max(i, 0) + WIDE), slice(j, j + LONG)
        return depth[box].sum() / max(count[box].sum(), 1)

    def prints(self, depth, count, near):
        """[(depth, x, y)] of the deepest prints in view."""
        boxes = [np.lib.stride_tricks.sliding_window_view(array[:, near], (WIDE, LONG)).sum((2, 3)) for array in (depth, count)]
        mean, found = boxes[0] / np.maximum(boxes[1], 1), []
        sure = mean - SIGNIFICANT * NOISE / np.sqrt(np.maximum(boxes[1], 10))
        while len(found) < PRINTS and sure.max(initial=0) > MM:
            i, j = np.unravel_index(sure.argmax(), sure.shape)
            found.append((mean[i, j], self.x0 + PITCH * (near.start + j + LONG / 2), self.y0 + PITCH * (i + WIDE / 2)))
            sure[max(i - WIDE, 0):i + WIDE + 1, max(j - LONG, 0):j + LONG + 1] = 0
        return found


def grid_at(log, x, y):
    rows, columns = log["visible"].shape
    return np.clip(((y + SIDE) / GRID).astype(int), 0, rows - 1), np.clip(((x - BACK) / GRID).astype(int), 0, columns - 1)


def looks_of(strip, rng, lie):
    """What a camera says of a place x: log brightness, and log hue and texture by it. lie: each patch looks as another soil does."""
    x = BACK + PITCH * (np.arange(round((FRONT - BACK) / PITCH)) + 0.5)
    label = strip.label(x)
    if lie:
        label = (label + VARIANTS * rng.integers(1, KINDS, len(strip.kinds) + 1)[strip.patch(x)]) % (KINDS * VARIANTS)
    color = np.maximum(strip.looks[label] + rng.normal(0, GRAIN / math.sqrt(WIDE), (len(x), 3)), 0.02) * strip.gain

    def at(x):
        j = int(np.clip((x - BACK) / PITCH - LONG / 2, 0, len(color) - LONG))
        bright, hue, texture = np.log(color[j:j + LONG].mean(0))
        return np.array([bright + 0.8, hue - bright, texture - bright]) / 0.5
    return at


def sights(folder, number, turn, sole, lie=False, draw=0):
    """Of one walk, for each footstep from 2 s on: evidence [STEPS + PRINTS][ELEMENT], whose first number says that it is there, query
    [QUERY], truth, and what the judge wants."""
    strip, rng = Strip(number, sole), np.random.default_rng((7, number, turn, draw))
    if turn == 0 and strip.earlier != "sa01":
        return []
    with np.load(folder / f"{number}-{turn}.npz") as file:
        log = {name: file[name] for name in file.files if name not in ("rows", "velocity", "count")}
    scan, look, place, frames, begin = Scan(log, strip.dy * (turn == 0), rng), looks_of(strip, rng, lie), log["place"], log["frames"][:, 0], log["begin"]
    seen, old, left = np.zeros(len(place)), np.zeros(len(place)), np.zeros((0, 2))
    if turn:  # under the sole before contact: depth that is seen, that was pressed; prints that are seen
        seen, old = (log[name][grid_at(log, log["points"][..., 0], log["points"][..., 1])].mean(1) for name in ("visible", "old"))
        left = log["old_place"][log["visible"][grid_at(log, *log["old_place"].T)] > 2 * MM]
    kind, patch = strip.label(place[:, 0]) // VARIANTS, strip.patch(place[:, 0])
    speed = Strip(number // BATCH * BATCH).speed[turn]  # a batch has the speed of its first
    scale, error, told, found = np.exp(rng.normal(0, OWN_SCALE, len(place))), rng.normal(0, OWN_NOISE, len(place)), np.zeros(len(place)), []
    for k in range(len(place)):
        when = begin[k] - LEAD
        depth, count, near = scan.until(when)
        x, y = place[k] + rng.normal(0, AIM, 2)
        told[k] = scan.under(depth, count, x, y)
        if begin[k] < 2 or log["end"][k] > frames[-1] - 0.5:
            continue
        here, evidence, base = look(x), np.zeros((STEPS + PRINTS, ELEMENT)), np.interp(when, frames, scan.base)
        known = np.flatnonzero(begin < when - KNOWN)[-STEPS:][::-1]
        measured = log_depth(log["depth"] * scale + error - told)
        for n, m in enumerate(known):
            evidence[n] = [1, 1, measured[m], *(look(place[m, 0]) - here), place[m, 0] - x, n / 4, log_depth(told[m]) + 2, 0]
        for n, (deep, px, py) in enumerate(scan.prints(depth, count, near)):
            evidence[STEPS + n] = [1, 0, log_depth(deep), *(look(px) - here), px - x, abs(py - y) * 5, 0, strip.earlier == "g1"]
        there = (strip.patch(left[:, 0]) == patch[k]) & (left[:, 0] < base + 1.4)
        case = 3 if old[k] > 2 * MM else 4 if len(known) and patch[known[0]] == patch[k] else 1 if there.any() else 2 * (kind[known] == kind[k]).any()
        others = (patch == patch[k]) & (old < 2 * MM) & (np.arange(len(place)) != k) & (begin > 2)
        found.append({"evidence": evidence, "recovery": strip.soils[strip.label(place[k, 0])].recovery, "case": case,
                      "query": [*here, log_depth(told[k]) + 2, 4 * speed - 2.5, 1, 1],
                      "truth": log_depth(log["depth"][k] - seen[k]), "last": measured[known[0]] if len(known) else np.nan,
                      "after": log_depth(log["depth"][others]).mean() if others.sum() > 1 else np.nan, "x": place[k, 0], "walk": 2 * number + turn})
    return found


def arrays(rows):
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def footsteps(folder, groups, lie=False, draws=1):
    """Arrays over the footsteps of all walks whose batch number modulo 10 is in `groups`."""
    sole, numbers = soles_of("sa01")[0], sorted(int(path.name[:-6]) for path in folder.glob("*-1.npz"))
    return arrays([row for number in numbers if number // BATCH % 10 in groups for turn in (0, 1) for draw in range(draws)
                   for row in sights(folder, number, turn, sole, lie, draw)])


# ---- the network ----

WIDTH, HEADS, LAST = 32, 2, 32
LEARN, CALIBRATE, TEST = (6, 7, 8, 9), (0, 1, 5), (2, 3, 4)  # batches modulo 10
SHARE, LIKE, GROUPS = 0.9, 0.3, 6  # [-] nominal coverage; hue and texture that differ by less are alike


def without(evidence, query, drop):
    """Copies in which rows lack sources, drop [rows][3]: prints, look, own steps."""
    evidence, query = evidence.astype(np.float32), query.astype(np.float32)
    evidence[drop[:, 0], STEPS:], evidence[drop[:, 1], :, 3:6], evidence[drop[:, 2], :STEPS] = 0, 0, 0
    for column, source in ((0, 1), (1, 1), (2, 1), (3, 0), (5, 1), (6, 0)):
        query[drop[:, source], column] = 0
    return evidence, query


class Network:
    """Attention to each piece of evidence beside the cell, or to none -> mean and log variance of log depth. The mean is that of the
    evidence, by the first head's attention, and what the layers behind add."""

    def __init__(self, rng=None, parameters=None):
        shapes = ((ELEMENT, WIDTH), (QUERY, WIDTH), (1, WIDTH), (WIDTH, WIDTH), (1, WIDTH), (WIDTH, HEADS), (HEADS * (WIDTH + 1) + QUERY, LAST), (1, LAST),
                  (LAST, 2), (1, 2))
        self.parameters = parameters or [(rng.standard_normal((a, b)) * (a > 1) / math.sqrt(a)).astype(np.float32) for a, b in shapes]

    def forward(self, e, q):
        w_e, w_q, b_1, w_2, b_2, w_s, w_3, b_3, w_4, b_4 = self.parameters
        h_1 = elu(e @ w_e + (q @ w_q + b_1)[:, None])
        h_2 = elu(h_1 @ w_2 + b_2)
        share = np.exp(np.clip(h_2 @ w_s, -20, 20)) * e[..., :1]
        share /= 1 + share.sum(1, keepdims=True)
        z = np.concatenate([(share.transpose(0, 2, 1) @ h_2).reshape(len(q), -1), share.sum(1), q], 1)
        g = elu(z @ w_3 + b_3)
        out = g @ w_4 + b_4
        self.kept = e, q, h_1, h_2, share, z, g
        return out[:, 0] + (share[..., 0] * e[..., 2]).sum(1), np.clip(out[:, 1], -6, 2)

    def gradients(self, mean, log_variance, truth):
        w_e, w_q, b_1, w_2, b_2, w_s, w_3, b_3, w_4, b_4 = self.parameters
        e, q, h_1, h_2, share, z, g = self.kept
        error, weight = truth - mean, np.exp(-log_variance)
        self.loss = 0.5 * (error**2 * weight + log_variance).mean()
        d = (np.stack([-error * weight, 0.5 * (1 - error**2 * weight)], 1) / len(q)).astype(np.float32)
        d_g = d @ w_4.T * np.where(g > 0, 1, g + 1)
        d_z = d_g @ w_3.T
        d_pooled = d_z[:, :HEADS * WIDTH].reshape(-1, HEADS, WIDTH)
        d_share = h_2 @ d_pooled.transpose(0, 2, 1) + d_z[:, None, HEADS * WIDTH:HEADS * (WIDTH + 1)]
        d_share[..., 0] += d[:, :1] * e[..., 2]
        d_score = share * (d_share - (share * d_share).sum(1, keepdims=True))
        d_h2 = (share @ d_pooled + d_score @ w_s.T) * np.where(h_2 > 0, 1, h_2 + 1)
        d_h1 = d_h2 @ w_2.T * np.where(h_1 > 0, 1, h_1 + 1)
        d_q = d_h1.sum(1)
        pairs = [(e, d_h1), (q, d_q), (None, d_q), (h_1, d_h2), (None, d_h2), (h_2, d_score), (z, d_g), (None, d_g), (g, d), (None, d)]
        flat = [[None if array is None else array.reshape(-1, array.shape[-1]) for array in pair] for pair in pairs]
        return [out.sum(0, keepdims=True) if of is None else of.T @ out for of, out in flat]

    def learn(self, rows, steps, rng, rate=2e-3, batch=256):
        adam = Adam(self.parameters, 0.3)
        for k in range(steps):
            own = rng.integers(len(rows["truth"]), size=batch)
            drop = (rng.random((batch, 1)) < 0.4) & (rng.random((batch, 3)) < 0.5)
            e, q = without(rows["evidence"][own], rows["query"][own], drop)
            e *= rng.random((*e.shape[:2], 1)) > 0.15
            adam.step(self.gradients(*self.forward(e, q), rows["truth"][own]), rate * 0.5 * (1 + math.cos(math.pi * k / steps)))
        return self

    def said(self, rows, drop=(0, 0, 0)):
        """(mean, standard deviation) of log depth."""
        mean, log_variance = self.forward(*without(rows["evidence"], rows["query"], np.tile(np.array(drop, bool), (len(rows["truth"]), 1))))
        return mean, np.exp(0.5 * log_variance)


def group(rows):
    """What the robot can tell apart: a print under the cell; its last steps, the last, a print, an earlier step on ground that looks
    alike; none."""
    e = rows["evidence"]
    like = (np.linalg.norm(e[..., 4:6], axis=-1) < LIKE) & (e[..., 0] > 0)
    under = rows["query"][:, 3] > log_depth(LEAST) + 2
    return np.select([under, like[:, 0] & like[:, 1], like[:, 0], like[:, STEPS:].any(1), like[:, :STEPS].any(1)], [0, 1, 2, 3, 4], 5)


def widths(network, rows):
    """Factors [GROUPS] of the standard deviation by which intervals of these walks cover in every case, which the robot cannot tell."""
    mean, deviation = network.said(rows)
    ratio, of, factors = abs(rows["truth"] - mean) / deviation, group(rows), np.full(GROUPS, 1.7)

    def loss(factors):
        inside = ratio <= factors[of]
        return sum((inside[rows["case"] == c].mean() - SHARE)**2 for c in np.unique(rows["case"])) + 1e-4 * np.log(factors).var()
    for _, g in itertools.product(range(20), range(GROUPS)):
        factors = min((np.where(np.arange(GROUPS) == g, factors * by, factors) for by in (1, 0.9, 0.97, 0.99, 1.01, 1.03, 1.1)), key=loss)
    return factors


# ---- commands ----

def train(given):
    rng, rows = np.random.default_rng(given.seed), footsteps(given.folder, LEARN, draws=2)
    network = Network(rng).learn(rows, given.steps, rng)
    print(f"{len(rows['truth'])} footsteps, the last loss {network.loss:.2f}")
    np.savez(given.folder / "weights.npz", *network.parameters, widths=widths(network, footsteps(given.folder, CALIBRATE, draws=2)))


def read(folder):
    with np.load(folder / "weights.npz") as file:
        return Network(parameters=[file[f"arr_{i}"] for i in range(10)]), file["widths"]


def r2(truth, said):
    return 1 - np.nanmean((truth - said)**2) / truth[np.isfinite(said)].var()


WITHOUT = {"all": (0, 0, 0), "prints": (0, 1, 1), "look": (1, 0, 1), "own steps": (1, 1, 0), "-prints": (1, 0, 0), "-look": (0, 1, 0), "-own": (0, 0, 1)}


def judge(given):
    (network, factors), rows, found = read(given.folder), footsteps(given.folder, TEST, lie=given.lie), {}
    by = {name: network.said(rows, drop) for name, drop in WITHOUT.items()}
    mean, reach, truth = by["all"][0], factors[group(rows)] * by["all"][1], rows["truth"]
    inside, border, dented = abs(truth - mean) <= reach, rows["case"] < 3, (rows["case"] == 1) & (rows["recovery"] <= 0.2)
    for case, own in (*((name, rows["case"] == c) for c, name in enumerate(CASES)), ("prints, stays dented", dented), ("all borders", border),
                      ("all", border | True)):
        off = np.bincount(np.unique(rows["walk"][own], return_inverse=True)[1], inside[own] - SHARE)
        found[case] = {"footsteps": own.sum(), "covered": inside[own].mean(), "+-": np.sqrt((off**2).sum()) / own.sum(),
                       "factor": np.exp(2 * np.median(reach[own])), "r2": r2(truth[own], mean[own]), "r2 mm": r2(np.exp(truth[own]), np.exp(mean[own])),
                       "last": r2(truth[own], rows["last"][own]), "after": r2(truth[own], rows["after"][own]),
                       **{name: r2(truth[own], both[0][own]) for name, both in list(by.items())[1:]}}
    print(" " * 22 + "".join(f"{name:>10s}" for name in found["all"]))
    for case, numbers in found.items():
        print(f"{case:22s}" + "".join(f"{value:10.{0 if name == 'footsteps' else 2}f}" for name, value in numbers.items()))
    noticed = [np.convolve(~inside[rows["walk"] == walk], np.ones(8)).max() >= 4 for walk in np.unique(rows["walk"])]
    print(f"4 of 8 footsteps outside in {100 * np.mean(noticed):.0f} % of the walks")


def draw(given):
    """One walk: true depths, and what was said before contact."""
    import matplotlib.pyplot as plt
    sole, (network, factors) = soles_of("sa01")[0], read(given.folder)
    strip, rows = Strip(given.number, sole), arrays(sights(given.folder, given.number, 1, sole))
    (mean, deviation), x, case = network.said(rows), rows["x"], rows["case"]
    reach = factors[group(rows)] * deviation
    low, middle, high, true = (np.maximum(1e3 * (np.exp(MIDDLE + z) - MM), 0.3) for z in (mean - reach, mean, mean + reach, rows["truth"]))
    figure, axes = plt.subplots(figsize=(9, 3.2), layout="constrained")
    for at in np.arange(x.min() - 0.2, x.max() + 0.2, 0.1):
        axes.axvspan(at, at + 0.1, color=np.clip(strip.looks[strip.label(at)], 0, 1), alpha=0.5, lw=0)
    axes.vlines(x, low, high, color="k", label="90 % interval, 0.3 s before contact")
    axes.plot(x, middle, "_k", ms=9)
    for c in np.unique(case):
        axes.plot(x[case == c], true[case == c], "os^Dv"[c], ms=5, color="tab:red", label=CASES[c])
    axes.set(yscale="log", xlabel="way [m]", ylabel="depth of the foot [mm]", ylim=(0.2, 2000), xlim=(x.min() - 0.2, x.max() + 0.2))
    axes.legend(fontsize=7, ncols=3)
    figure.savefig(given.picture, dpi=80)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = {run.__name__: run for run in (walk, ground, train, judge, draw)}
    parser.add_argument("command", choices=commands, help="ground: the program under mild eval")
    parser.add_argument("folder", type=pathlib.Path, help="of the walks")
    for name, value in {"first": 0, "strips": 640, "seconds": 12.0, "turn": 0, "steps": 4000, "seed": 1, "number": 16, "picture": "see.png"}.items():
        parser.add_argument(f"--{name}", type=type(value), default=value)
    parser.add_argument("--lie", action="store_true", help="each patch looks as another soil does")
    given = parser.parse_args()
    commands[given.command](given)


if __name__ == "__main__":
    main()
