"""The stiffness, friction, slip length or damping of the ground at which half of a policy's trials stay up: `mild trial --sweep`
(docs/public-policies.md)."""
import csv
import dataclasses
import functools
import hashlib
import importlib.util
import io
import json
import math
import os
import pathlib
import re
import sys

import numpy as np

from . import networks, trials
from .describe import KEYS, TABLES, Description

CELL = 0.0195**2  # [m^2] of an element for which presets give k_pen
PRESSURE = 6.7e3  # [Pa] at which `mild info grounds` gives the stiffness of a preset
MEASURED = ("rubber_tile", "running_track", "artificial_turf", "gym_mat", "carpet", "groomed_snow", "moist_sand", "dry_sand_close", "dry_sand_loose")
PER_DECADE = 40  # places of the grid, 6 % apart
SAME = 1e-9  # relative: values that are one place of the grid, on any processor
ROUND = 4  # trials that are chosen at once; a round does not depend on the number of processes
PRIOR = 0.5  # exponent: shallow curves are taken for likelier
WITHIN = 1.3  # a sweep ends when its 90 % interval is no wider than this factor


@dataclasses.dataclass(frozen=True)
class Quantity:
    """What a sweep changes."""
    unit: str
    low: float
    high: float
    rises: int  # 1: more of it keeps robots up; 0: nobody knows
    ground: str  # preset that has all other numbers, where none is named
    fields: object  # value -> fields of a Material


def _straight(value):
    """A spring, straight as deep as a robot sinks: the cone carries what the flat part loses (docs/model.md, section 3)."""
    k = 1e6 * CELL * value
    return {"k_pen": k, "sigma_cone": min(5e6, k * np.cos(1.31) / CELL), "alpha": 1.31, "nu": 0.1, "bed_depth": 1.0}


QUANTITIES = {
    "stiffness": Quantity("MPa/m", 0.1, 1000.0, 1, "rubber_tile", _straight),
    "friction": Quantity("-", 0.02, 2.0, 1, "rubber_tile", lambda value: {"mu": value}),
    "slip": Quantity("mm", 0.1, 100.0, 1, "sand_dense", lambda value: {"slip_length": 1e-3 * value, "recovery": 0.0}),
    "damping": Quantity("s/m", 0.01, 10.0, 0, "gym_mat", lambda value: {"model": "hunt_crossley", "exponent": 1.0, "dissipation": value}),
}


def material(name, ground, value):
    """The Material of a sweep at a value [unit of the quantity]."""
    from . import Material

    return Material(ground, **QUANTITIES[name].fields(value))


def marks(name):
    """{preset: value [unit of the quantity]} of the measured grounds; empty for what they do not have."""
    from . import Material, Sole

    sole = Sole.plate(0.2, 0.1)
    load = PRESSURE * CELL * len(sole.x)
    grounds = {preset: Material(preset) for preset in MEASURED}
    if name == "stiffness":
        return {preset: 1e-6 * PRESSURE / sole.sinkage(one, load) for preset, one in grounds.items()}
    if name == "friction":
        return {preset: one.mu for preset, one in grounds.items()}
    return {preset: 1e3 * one.slip_length for preset, one in grounds.items() if one.slip_length > 0} if name == "slip" else {}


class Curve:
    """What trials say of p(x) = e + (1 - 2 e)/(1 + (S50/x)^b), the chance to stay up: probabilities on a grid of S50, b and e.

    The next trials are those after which S50 is least uncertain: the expected entropy of its distribution is least (the psi
    method of Kontsevich and Tyler 1999, b and e as Prins 2013). rises: 1, b > 0; 0, either sign. S50 may be outside low .. high."""

    def __init__(self, low, high, rises=1):
        steps, beyond = max(ROUND, round(PER_DECADE * np.log10(high / low))), PER_DECADE // 2
        self.values = np.geomspace(low, high, steps + 1)
        step = np.log(high / low) / steps
        self.s50 = np.log(low) + step * np.arange(-beyond, steps + 1 + beyond)
        self.inside = slice(beyond, beyond + steps + 1)
        b, e = np.geomspace(0.7, 40, 13), np.array([0, 0.03, 0.1])
        b = b if rises else np.concatenate([-b, b])
        self.b, e = (grid.ravel() for grid in np.meshgrid(b, e))
        away = np.log(self.values)[:, None] - self.s50[:, None, None]
        self.chance = e + (1 - 2 * e) / (1 + np.exp(-np.clip(self.b * away, -50, 50)))  # (S50, value, b and e)
        weight = np.abs(self.b) ** -PRIOR
        self.weight = np.tile(weight / weight.sum() / len(self.s50), (len(self.s50), 1))

    def add(self, value, upright):
        """One trial at a value of the grid."""
        chance = self.chance[:, np.abs(np.log(self.values / value)).argmin()]
        self.weight = self.weight * (chance if upright else 1 - chance)
        self.weight /= self.weight.sum()

    def choose(self, count):
        """Values [unit of the quantity] for the next trials, chosen one after the other without their outcomes."""
        leaves, chosen = self.weight[:, :, None], []  # (S50, b and e, outcomes of those chosen)
        while True:
            up = self.chance @ leaves
            sums = np.concatenate([up, leaves.sum(axis=1)[:, None] - up], axis=2)  # (S50, value, outcomes)
            total = sums.sum(axis=0)
            entropy = -(sums * np.log(np.maximum(sums, 1e-300) / np.maximum(total, 1e-300))).sum(axis=(0, 2))
            best = int(np.argmin(np.round(entropy, 9)))  # rounded: the choice is the same on another processor
            chosen.append(float(self.values[best]))
            if len(chosen) == count:
                return chosen
            chance = self.chance[:, best, :, None]
            leaves = np.concatenate([leaves * chance, leaves * (1 - chance)], axis=2)

    def quantile(self, share):
        """S50 below which it is with a probability."""
        sums = np.cumsum(self.weight.sum(axis=1))
        edges = np.append(self.s50, 2 * self.s50[-1] - self.s50[-2]) - 0.5 * (self.s50[1] - self.s50[0])
        return float(np.exp(np.interp(share, np.append(0, sums / sums[-1]), edges)))

    def fit(self):
        """Mean chance to stay up at each of values, and its 90 % interval."""
        rows = np.moveaxis(self.chance, 1, 0).reshape(len(self.values), -1)
        order = np.argsort(rows, axis=1)
        sums = np.cumsum(self.weight.ravel()[order], axis=1)
        places = [(sums < share).sum(axis=1).clip(max=rows.shape[1] - 1)[:, None] for share in (0.05, 0.95)]
        bounds = [np.take_along_axis(rows, np.take_along_axis(order, place, axis=1), axis=1)[:, 0] for place in places]
        return np.array([rows @ self.weight.ravel(), *bounds])

    def result(self):
        """(verdict, S50, (low, high) of 90 %): inside, never_falls, always_falls or open, that is not known yet; None: no bound."""
        first, last = self.values[[0, -1]]
        up, inside = self.weight[:, self.b > 0].sum(axis=1), self.inside
        down = self.weight.sum(axis=1) - up
        never, always = (below[: inside.start].sum() + above[inside.stop :].sum() for below, above in ((up, down), (down, up)))
        for verdict, chance, rising in (("never_falls", never, up), ("always_falls", always, down)):
            if chance >= 0.95:
                side = rising[: inside.start].sum() / chance  # below all that was tried
                return verdict, None, (None, float(first)) if side > 0.99 else (float(last), None) if side < 0.01 else (None, None)
        low, middle, high = (self.quantile(share) for share in (0.05, 0.5, 0.95))
        bounds = low if low >= first else None, high if high <= last else None
        known = None not in bounds and high / low <= WITHIN
        return "inside" if known else "open", middle if first <= middle <= last else None, bounds


@functools.lru_cache(maxsize=2)
def _load(policy, describe, changes):
    description = Description(describe, dict(changes))
    return description, networks.load(policy, description)


def _walk(arguments):
    """One trial as a dict, in any process."""
    (model, policy, describe, changes, options), name, ground, command, value, seed = arguments
    trials._quietly()
    description, network = _load(policy, describe, changes)
    walker = trials.Walker(model, network, description, material(name, ground, value), options)
    return {"value": value, **dataclasses.asdict(walker.walk(command, seed))}


@dataclasses.dataclass
class Sweep:
    """What sweep() returns."""
    about: dict
    curve: Curve
    each: list

    def as_dict(self):
        """As docs/schema/sweep.json."""
        verdict, s50, bounds = self.curve.result()
        return {**self.about, "trials": len(self.each), "verdict": verdict, "s50": s50, "interval": list(bounds), "each": self.each}

    def points(self):
        """Rows of a CSV: value, trials, upright, and the chance to stay up with its 90 % interval."""
        rows = []
        for value, chance, low, high in zip(self.curve.values, *self.curve.fit()):
            here = [walk["end"] == "time" for walk in self.each if math.isclose(walk["value"], value, rel_tol=SAME)]
            rows.append([f"{value:.4g}", len(here), sum(here), f"{chance:.3f}", f"{low:.3f}", f"{high:.3f}"])
        return rows

    def __str__(self):
        verdict, s50, (low, high) = self.curve.result()
        name, unit = self.about["sweep"], QUANTITIES[self.about["sweep"]].unit.replace("-", "")
        first, last = (f"{value:.3g}" for value in self.about["range"])
        count = f"{sum(walk['end'] == 'time' for walk in self.each)} of {len(self.each)} trials upright"
        if verdict in ("never_falls", "always_falls"):
            side = f"< {high:.3g} {unit}: below" if high else f"> {low:.3g} {unit}: above" if low else "is outside"
            return f"{name} S50 {side} all that was tried, {first} to {last}; {count}".replace(" :", ":")
        text = f"{name} S50 {'-' if s50 is None else f'{s50:.3g}'} {unit}".rstrip()
        text += f", 90 % {f'below {first}' if low is None else f'{low:.3g}'} to {f'above {last}' if high is None else f'{high:.3g}'}; {count}"
        return text + ("" if verdict == "inside" else f"; wider than a factor {WITHIN:g}")

    def plot(self, path):
        """Draws the curve, the trials and the measured grounds. Raises RuntimeError without matplotlib."""
        figure = _figure()(figsize=(8, 4.2), layout="constrained")
        axes, name = figure.add_subplot(), self.about["sweep"]
        mean, low, high = self.curve.fit()
        axes.fill_between(self.curve.values, low, high, color="C0", alpha=0.2, linewidth=0)
        axes.plot(self.curve.values, mean, "C0")
        points = np.array([row[:3] for row in self.points() if row[1]], float).reshape(-1, 3)
        axes.scatter(points[:, 0], points[:, 2] / points[:, 1], 12 + 12 * points[:, 1], "k", alpha=0.5, linewidth=0)
        _, s50, bounds = self.curve.result()
        if s50:
            axes.axvline(s50, color="C3", linewidth=1)
            axes.axvspan(*(bound or limit for bound, limit in zip(bounds, self.about["range"])), color="C3", alpha=0.15, linewidth=0)
        axes.set(xscale="log", xlim=self.about["range"], ylim=(-0.03, 1.03), ylabel="chance to stay up",
                 xlabel=f"{name} [{QUANTITIES[name].unit}]", title=str(self))
        axes.title.set_fontsize(9)
        top = axes.secondary_xaxis("top")
        here = {preset: value for preset, value in marks(name).items() if self.about["range"][0] <= value <= self.about["range"][1]}
        top.set_xticks(list(here.values()), [preset.replace("_", " ") for preset in here], rotation=60, ha="left", fontsize=7)
        top.set_xticks([], minor=True)
        figure.savefig(path, dpi=150)


def _figure():
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise RuntimeError("plot: needs matplotlib; `pip install matplotlib`") from None
    return Figure


def write(path, text):
    """Writes a whole file or none."""
    part = pathlib.Path(f"{path}.part")
    part.write_text(text, encoding="utf-8")
    os.replace(part, path)


def _sha256(*parts):
    return hashlib.sha256(b"\0".join(parts)).hexdigest()


def _of_model(model):
    """sha256 of an MJCF, text or file, and of the files that it includes."""
    if str(model).lstrip().startswith("<"):
        return _sha256(str(model).encode())
    files = [pathlib.Path(model)]
    if not files[0].is_file():
        raise ValueError(f"model: there is no file '{model}'")
    for file in files:
        names = re.findall(rb"<include\s[^>]*?file\s*=\s*[\"']([^\"']+)", file.read_bytes())
        files += [one for one in (files[0].parent / os.fsdecode(name) for name in names) if one.is_file() and one not in files]
    return _sha256(*(file.read_bytes() for file in files))


def _of_policy(policy):
    """sha256 of a policy's file and of its weights beside it, or of the file that has its code."""
    place = str(policy).rpartition(":")[0]
    try:
        module = importlib.util.find_spec(place) if place and not place.endswith(".py") else None
    except (ImportError, ValueError):
        module = None
    files = [pathlib.Path(one) for one in (policy, f"{policy}.data", getattr(module, "origin", None) or place)]
    found = [file.read_bytes() for file in files if file.is_file()]
    if not found:
        raise ValueError(f"policy: there is no file '{policy}'")
    return _sha256(*found)


def _of_description(description):
    """sha256 of what a description says, from wherever."""
    tables = {table: [(pattern.pattern, value) for pattern, value in getattr(description, table)] for table in TABLES}
    terms = [(term.name, term.scale.tolist(), term.count) for term in description.terms]
    return _sha256(json.dumps([{section: getattr(description, section) for section in KEYS if section != "command"}, tables, terms]).encode())


def _recorded(path, about):
    """Trials of a file that an earlier run of the same sweep left."""
    if not path or not pathlib.Path(path).is_file():
        return []
    try:
        found = json.loads(pathlib.Path(path).read_text(encoding="utf-8"))
    except ValueError:
        found = None
    if not isinstance(found, dict) or "sweep" not in found:
        raise ValueError(f"json: {path} is there, and is no sweep; name another file")
    other = next((key for key in about if found.get(key) != json.loads(json.dumps(about[key]))), None)
    if other:
        before, now = (str(one)[:12] if other.endswith("sha256") else one for one in (found.get(other), about[other]))
        raise ValueError(f"json: {path} is of another sweep, {other} {before} instead of {now}; name another file or remove it")
    each, keys = found.get("each"), {"value", *(field.name for field in dataclasses.fields(trials.Walk))}
    for walk in each if isinstance(each, list) else [None]:
        if not isinstance(walk, dict) or set(walk) != keys or not isinstance(walk["value"], (int, float)) or not isinstance(walk["end"], str):
            raise ValueError(f"json: {path} is broken: 'each' must be a list of trials; name another file or remove it")
    return each


def sweep(model, policy, describe, quantity, *, ground=None, limits=None, command=(0.5, 0.0, 0.0), most=60, seconds=10.0, seed=1, noise=1.0,
          changes=None, attributes=None, jobs=1, file=None, report=None):
    """Finds the value of a quantity at which half of the trials stay up. Returns a Sweep.

    model, policy, describe: files, as in mild.trial. quantity: stiffness, friction, slip, damping. ground: the preset that has all numbers
    but those of the sweep; None: QUANTITIES names it. limits: (low, high) [unit of the quantity]. most: number of trials at most. file:
    JSON, whole after every trial; a sweep that finds its own file goes on from there, and refuses that of another robot, policy,
    description or MuJoCo, by their sha256. report: called with the Sweep after every trial. The result does not depend on jobs, nor on
    interruptions. Other arguments, errors: mild.trial."""
    if quantity not in QUANTITIES:
        raise ValueError(f"sweep: '{quantity}' is none of {', '.join(QUANTITIES)}")
    q = QUANTITIES[quantity]
    ground, (low, high) = ground or q.ground, limits or (q.low, q.high)
    attributes, changes = dict(attributes or {}), dict(changes or {})
    if not 0 < low < high or most < 1 or not seconds > 0:
        raise ValueError("sweep: needs 0 < low < high, and more than 0 trials and seconds")
    for value in (low, high):
        material(quantity, ground, value)  # refuses what is out of range before a robot walks
    for key in ("model", *q.fields(low)):
        if f"ground__{key}" in attributes:
            raise ValueError(f"attach: ground.{key} is what the sweep sets")
    import mujoco

    _load.cache_clear()  # files may have changed
    about = {"version": trials._version(), "mujoco": mujoco.mj_versionString(), "model": trials._place(model), "policy": trials._place(policy),
             "describe": str(describe), "model_sha256": _of_model(model), "policy_sha256": _of_policy(policy),
             "describe_sha256": _of_description(Description(describe, changes)), "sweep": quantity,
             "unit": q.unit, "ground": ground, "range": [float(low), float(high)], "command": [float(one) for one in command],
             "seconds": float(seconds), "seed": int(seed), "noise": float(noise), "changes": changes, "attributes": attributes}
    result = Sweep(about, Curve(low, high, q.rises), [])
    found = _recorded(file, about)
    what = (str(model), str(policy), str(describe), tuple(changes.items()), dict(seconds=float(seconds), noise=float(noise), attributes=attributes))
    if jobs > 1:
        import multiprocessing

        with multiprocessing.get_context("spawn").Pool(min(jobs, ROUND)) as pool:
            _rounds(result, found, what, most, file, report, pool.imap)
    else:
        _rounds(result, found, what, most, file, report, map)
    return result


def _rounds(result, found, what, most, file, report, run):
    """Rounds of trials until the interval is narrow enough. The first is spread over the whole range, whatever the curve."""
    about, curve, each = result.about, result.curve, result.each
    while len(each) < most and (not each or curve.result()[0] == "open"):
        count = min(ROUND, most - len(each))
        values = curve.choose(count) if each else [float(curve.values[k]) for k in np.linspace(0, len(curve.values) - 1, ROUND).round().astype(int)[:count]]
        ready = found[len(each) : len(each) + count]
        if any(not math.isclose(walk["value"], value, rel_tol=SAME) for walk, value in zip(ready, values)):
            raise ValueError(f"json: {file} has trials that this sweep would not choose; name another file or remove it")
        first = len(each)
        walks = run(_walk, [(what, about["sweep"], about["ground"], tuple(about["command"]), value, about["seed"] + first + k)
                            for k, value in enumerate(values) if k >= len(ready)])
        for walk in (*ready, *walks):
            each.append(walk)
            if file and len(each) > len(found):
                _save(file, result)
            if report:
                report(result)
        for walk in each[first:]:
            curve.add(walk["value"], walk["end"] == "time")
    if file and len(each) >= len(found):
        _save(file, result)


def _save(file, result):
    write(file, json.dumps(result.as_dict(), indent=2) + "\n")


def run(arguments, changes, attributes):
    """The command: the arguments of mild.trials.parser."""
    grounds = arguments.ground if arguments.ground != list(trials.GROUNDS) else [None]
    if len(grounds) != 1 or grounds == ["rigid"] or len(arguments.speed) != 1 or arguments.video or len(arguments.range or (0, 1)) != 2:
        raise ValueError("sweep: takes one soft ground, one speed, --range LOW,HIGH, and no video")
    whole = arguments.json if arguments.json != "-" else None
    if arguments.plot:
        _figure()
    most = 60 if arguments.trials is None else arguments.trials

    def report(result):
        count = len(result.each)
        if count % ROUND == 0 or count == most:
            walks = ", ".join(f"{walk['value']:.3g} {'upright' if walk['end'] == 'time' else 'fell'}" for walk in result.each[(count - 1) // ROUND * ROUND :])
            print(f"{count} of at most {most} trials: {walks}", file=sys.stderr, flush=True)

    result = sweep(arguments.model, arguments.policy, arguments.describe, arguments.sweep, ground=grounds[0], limits=arguments.range,
                   command=(arguments.speed[0], arguments.sideways, arguments.turn), most=most,
                   seconds=arguments.seconds, seed=arguments.seed, noise=arguments.noise, changes=changes, attributes=attributes, jobs=arguments.jobs,
                   file=whole, report=report)
    print(result, file=sys.stderr if arguments.json == "-" else sys.stdout)
    if arguments.json == "-":
        json.dump(result.as_dict(), sys.stdout, indent=2)
    if arguments.csv:
        rows = io.StringIO()
        csv.writer(rows, lineterminator="\n").writerows([["value", "trials", "upright", "chance", "low", "high"], *result.points()])
        write(arguments.csv, rows.getvalue())
    if arguments.plot:
        result.plot(arguments.plot)
