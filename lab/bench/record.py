#!/usr/bin/env python3
"""A record of speed that others can check: ours and the peers in one call, with versions, clocks, command lines and raw output.

  mild bench record out/record                    # all that this machine can measure, ten minutes on two cores; --list: what that is
  mild bench record out/record --rounds 1 --only step,walk,mujoco
  mild bench record check out/record              # raw output, rows, ratios and page belong together
  mild bench record add out/record                # a line of lab/bench/record.jsonl: our numbers by commit
  mild bench record history                       # that file as tables; exit code 1 if the last record of a machine is slow
  mild bench record history --picture lab/bench/record.png

lab/bench/record.py is the same. The first measures, in turns: each round has every command once, ours and the peers', and a ratio is of one round. OUT/record.json (schema:
docs/schema/record.json) has medians and every round's number, OUT/raw what the commands wrote, OUT/record.md is the page, made from
record.json alone. A peer that is not installed, or has no GPU to run on, is named with the reason. --python is the interpreter that
has them: `pip install -r scripts/newton.txt` brings MuJoCo, MuJoCo Warp and Newton, scripts/mjlab.txt mjlab."""
import argparse
import csv
import functools
import hashlib
import json
import math
import os
import pathlib
import platform
import re
import shlex
import statistics
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
SLOW = 0.1  # share by which the last record may be worse than the median of those before it
SAMPLE = 1.0  # [s] from one reading of the clocks to the next
WORLDS = (4096, 16384, 65536)
SHELLS = ("", "_without_shells")  # with trunk and shanks on the ground, and as in the days when the bars were asked for
GPU_KEYS = ("name", "driver_version", "memory.total", "clocks.max.sm", "clocks.max.mem", "power.limit", "mig.mode.current")
GPU_CLOCKS = ("clocks.sm", "clocks.mem", "power.draw", "temperature.gpu")
STEPS_5MS = "--task.physics_dt=0.005"
QUICK = ["train", "--config", "configs/quick.ini", "--train.device=cuda", "--ppo.steps=24", "--ppo.optimizer=adam"]
NANOG1 = "its engine is a fork of PufferLib in no registry, which its scripts build on Modal; its page says 1.28 M samples/s and 58.9 s to a " \
         "walk on an RTX PRO 6000"


def fail(text):
    print(f"record.py: {text}", file=sys.stderr)
    sys.exit(2)


# ---- what is measured ----

class Command:
    """words: MILD, PYTHON, PLUGIN and FILE stand for the program, the peers' interpreter, the plugin beside the program and the file for its
    rows. read: (folder, file, seconds)
    -> [(case, value, unit)]. modules: what the interpreter must have."""

    def __init__(self, name, who, words, read=None, gpu=False, modules=(), before="", rounds=0):
        self.name, self.who, self.words, self.read, self.gpu = name, who, words, read or rows_of_bench, gpu
        self.modules, self.before, self.rounds = modules, before, rounds  # rounds: at most, 0 for no limit


def rows_of_bench(_, file, __):
    return [(row["case"], row["value"], row["unit"]) for row in json.loads(file.read_text(encoding="utf-8"))["rows"]]


def rows_of_log(folder, _, __):
    """The rate of a training: the median without the first third of its iterations."""
    with open(folder / "log.csv", newline="", encoding="utf-8") as file:
        rates = [float(row["rate/steps_per_s"]) for row in csv.DictReader(file)]
    return [("policy_steps_per_s", statistics.median(rates[len(rates) // 3:]), "1/s")]


def rows_of_walk(folder, file, seconds):
    """A walk from nothing: the training's seconds, from the start of the process to its end, and what MuJoCo says of it."""
    walked = json.loads(file.read_text(encoding="utf-8"))["rows"]
    with open(folder / "seconds.txt", encoding="utf-8") as text:
        trained = float(text.read())
    return [("seconds", trained, "s"), ("upright", sum(row["success"] for row in walked), "-"),
            ("trials", sum(row["trials"] for row in walked), "-"),
            *((f"speed_{row['ground']}", row["velocity"] if row["velocity"] is not None else 0.0, "m/s") for row in walked)]


def rows_of_mpm(folder, _, __):
    bed = json.loads((folder / "mpm/manifest.json").read_text(encoding="utf-8"))["sand/disc120"]["beds"]["1"]
    return [("plate_seconds_per_simulated_second", bed["seconds_per_simulated_second"], "s"), ("plate_step", bed["step_ms"], "ms")]


def rows_of_mjlab(_, file, __):
    found = re.findall(r"step of the physics: rigid contact costs ([-.\d]+) ms, the batch ground ([-.\d]+) ms, of ([-.\d]+) ms",
                       file.read_text(encoding="utf-8"))
    return [(name, float(value), "ms") for values in found for name, value in zip(("rigid", "batch_ground", "without"), values)]


def bench(name, *words, **more):
    return Command(name, "mild", ["MILD", "bench", *words, "--json", "FILE"], **more)


def commands():
    cuda = ("--train.device=cuda",)
    walk = 'begin=$(date +%s.%N); "$0" train --config configs/quick.ini --out "$1/run" --train.device=cuda && ' \
           'date +%s.%N | awk -v b="$begin" \'{ print $1 - b }\' >"$1/seconds.txt" && ' \
           '"$0" eval --policy "$1/run/policy.safetensors" --config configs/quick.ini --ground rigid,foam45,sand_loose --speed 0.6 --json "$2"'
    plugin = ["PYTHON", "scripts/plugin_walk.py", "sa01", "--ground", "sand_loose", "--step", "0.0025", "--integrator", "Euler", "--speed", "0.6",
              "--time", "--plugin", "PLUGIN", "--json", "FILE"]
    peer = ["PYTHON", "lab/bench/mjwarp.py", "robots/sa01", "--dt", "0.005", "--json", "FILE"]
    found = [
        bench("step", "step"), bench("walk", "walk"),
        Command("plugin", "MuJoCo with the plugin", plugin, modules=("mujoco", "numpy")),
        Command("mujoco", "MuJoCo", [*peer, "--processor", "--worlds", "512"], modules=("mujoco", "numpy")),
        bench("ground", "ground"), bench("elements", "elements"), bench("batch", "batch"),
        bench("robots", "robots", "--train.envs=64", STEPS_5MS), bench("train", "train", "memory", rounds=1),
        bench("batch_cuda", "batch", *cuda, gpu=True),
    ]
    for worlds in WORLDS:
        found.append(bench(f"robots_{worlds}", "robots", *cuda, f"--train.envs={worlds}", STEPS_5MS, gpu=True))
        found.append(Command(f"mjwarp_{worlds}", "MuJoCo Warp", [*peer, "--worlds", str(worlds)], gpu=True,
                             modules=("mujoco", "mujoco_warp", "warp", "numpy")))
    found += [
        bench("robots_16384_without_shells", "robots", *cuda, "--train.envs=16384", STEPS_5MS, "--task.shells_stand=false", gpu=True),
        bench("update_cuda", "update", *cuda, "--train.envs=16384", "--ppo.matmul=bf16", "--ppo.mirror_share=0.25", gpu=True),
        *(Command("train_16384" + name, "mild", ["MILD", *QUICK, "--train.envs=16384", "--train.iterations=45", "--out", "FOLDER", *more],
                  rows_of_log, gpu=True) for name, more in (("", []), ("_without_shells", ["--task.shells_stand=false"]))),
        Command("walk_from_nothing", "mild", ["bash", "-c", walk, "MILD", "FOLDER", "FILE"], rows_of_walk, gpu=True, rounds=1),
        Command("newton_mpm", "Newton's MPM", ["PYTHON", "lab/grains/judge_mpm.py", "--out", "FOLDER/mpm", "--friction", "0.42", "--only",
                                               "^sand/disc120$", "--seconds", "120"], rows_of_mpm, gpu=True,
                modules=("newton", "warp", "numpy"), rounds=1),
        Command("mjlab", "mjlab", ["bash", "-c", '"$0" lab/bench/mjlab_time.py Go1 >"$1"', "PYTHON", "FILE"], rows_of_mjlab, gpu=True,
                modules=("mjlab", "mild", "torch"), rounds=1),
    ]
    return found


# name: over, under, factor. Both are of the same round.
RATIOS = {
    "a step standing on sand over MuJoCo's own on a rigid floor": ("step/newton", "step/engine_rigid", 1),
    **{f"a step walking on {ground} over MuJoCo's own on a rigid floor": (f"walk/{ground}_newton", f"walk/{ground}_engine_rigid", 1)
       for ground in ("sand_loose", "foam45", "grass")},
    "a step of MuJoCo with the plugin walking on sand_loose over ours": ("plugin/sand_loose", "walk/sand_loose_newton_tight", 1),  # both to 1e-9
    "a step of MuJoCo with the plugin walking on sand_loose over MuJoCo's own on a rigid floor": ("plugin/sand_loose", "plugin/rigid", 1),
    **{f"physics steps/s of {n} walking robots on soft ground over MuJoCo Warp's on a rigid floor":
       (f"robots_{n}/walking_policy_steps_per_s", f"mjwarp_{n}/rigid_5ms_{n}", 2) for n in WORLDS},
    "physics steps/s of 16384 walking robots, their feet alone on soft ground, over MuJoCo Warp's on a rigid floor":
        ("robots_16384_without_shells/walking_policy_steps_per_s", "mjwarp_16384/rigid_5ms_16384", 2),
}
# What is asked, of a row or a ratio: the bar, and whether more is better.
BARS = {
    "a step standing on sand over MuJoCo's own on a rigid floor": (0.55, False),
    **{f"a step walking on {ground} over MuJoCo's own on a rigid floor": (0.42, False) for ground in ("sand_loose", "foam45", "grass")},
    "train/policy_steps_per_s": (12000, True),
    "physics steps/s of 16384 walking robots on soft ground over MuJoCo Warp's on a rigid floor": (2.8, True),
    "physics steps/s of 16384 walking robots, their feet alone on soft ground, over MuJoCo Warp's on a rigid floor": (2.8, True),
    **{f"robots_16384{name}/walking_policy_steps_per_s": (12e6, True) for name in SHELLS},
    **{f"robots_16384{name}/memory_per_robot": (12288, False) for name in SHELLS},
    **{f"train_16384{name}/policy_steps_per_s": (3.5e6, True) for name in SHELLS},
    "walk_from_nothing/seconds": (12, False),
}
# Rows of the history, and whether more is better. Ratios are in it too.
KEPT = {
    "step/newton": False, "walk/sand_loose_newton": False, "plugin/sand_loose": False, "walk/sand_loose_iterations": False, "ground/newton_stick_advance": False,
    "elements/stick_154": False, "elements/stick_2000": False, "train/policy_steps_per_s": True, "train/total": False,
    "batch_cuda/advance_16384": True, "batch_cuda/advance_65536": True, "robots_16384/walking_policy_steps_per_s": True,
    "robots_16384/memory_per_robot": False, "train_16384/policy_steps_per_s": True, "walk_from_nothing/seconds": False,
}


# ---- the machine ----

def output_of(*words):
    try:
        return subprocess.run(words, capture_output=True, text=True, check=True, cwd=ROOT, timeout=60).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""


def gpu_values(keys):
    """[{key: text}], a GPU each."""
    lines = output_of("nvidia-smi", "--query-gpu=" + ",".join(keys), "--format=csv,noheader,nounits").splitlines()
    return [dict(zip(keys, (cell.strip() for cell in line.split(",")))) for line in lines]


def processor_text(key):
    try:
        return re.findall(rf"^{key}\s*: (.*)$", pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8"), re.M)
    except OSError:
        return []


def machine():
    flags = " ".join(processor_text("flags")[:1]).split()
    return {"processor": (processor_text("model name") or [platform.processor() or "unknown"])[0], "cores": os.cpu_count(),
            "vectors": next((name for flag, name in (("avx512f", "AVX-512"), ("avx2", "AVX2"), ("asimd", "NEON")) if flag in flags), "none"),
            "system": f"{platform.system()} {platform.machine()}", "gpus": gpu_values(GPU_KEYS)}


class Clocks(threading.Thread):
    """Reads clocks and load while a command runs."""

    def __init__(self):
        super().__init__(daemon=True)
        self.stop, self.seen = threading.Event(), {}

    def read(self):
        found = {"processor_mhz": [float(x) for x in processor_text("cpu MHz")], "load": [os.getloadavg()[0]]}
        for gpu in gpu_values(GPU_CLOCKS):
            for key, text in gpu.items():
                if re.fullmatch(r"[\d.]+", text):
                    found.setdefault("gpu_" + key, []).append(float(text))
        for key, values in found.items():
            self.seen.setdefault(key, []).extend(values)

    def run(self):
        self.read()
        while not self.stop.wait(SAMPLE):
            self.read()

    def over(self):
        self.stop.set()
        self.join()
        return {key: [min(v), statistics.median(v), max(v)] for key, v in self.seen.items() if v}


def versions(mild, python):
    found = {"mild": output_of(mild, "--version").removeprefix("mild ")}
    for line in output_of(mild, "info", "build").splitlines():
        key, _, value = line.partition(" ")
        if key in ("compiler", "flags", "MuJoCo", "oneDNN", "CUDA"):
            found[f"mild: {key}"] = value.strip()
    script = ("import importlib.metadata as m\n"
              "for n in ('mujoco', 'mujoco-core', 'mujoco-warp', 'warp-lang', 'newton', 'mjlab', 'torch', 'numpy'):\n"
              "    try: print(n, m.version(n))\n"
              "    except m.PackageNotFoundError: pass\n")
    found["python"] = output_of(python, "--version").removeprefix("Python ")
    for line in output_of(python, "-c", script).splitlines():
        found[line.split()[0]] = line.split()[1]
    return found


@functools.cache
def imports(python, module):
    return output_of(python, "-c", f"import {module}; print(1)").endswith("1")


def plugin_of(mild):
    return pathlib.Path(mild).parent / "mujoco_plugin/libmild_plugin.so"


def missing_of(command, given, gpus):
    """Why it cannot run here, or None."""
    absent = [module for module in command.modules if not imports(given.python, module)]
    if absent:
        return f"{', '.join(absent)} not installed for {pathlib.Path(given.python).name}"
    if "PLUGIN" in command.words and not plugin_of(given.mild).is_file():
        return f"no mujoco_plugin/{plugin_of('').name} beside the program"
    return "no NVIDIA GPU" if command.gpu and not gpus else None


# ---- measuring ----

def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def raw_files(folder):
    """{path below the folder: sha256} of what rows are read from."""
    return {str(path.relative_to(folder)): digest(path) for path in sorted(folder.rglob("*"))
            if path.is_file() and path.name in ("rows.json", "output.txt", "log.csv", "seconds.txt", "manifest.json")}


def play(command, folder, given):
    """Runs it once. {seconds, exit, clocks, files} and what it said last."""
    folder.mkdir(parents=True, exist_ok=True)
    stand = {"MILD": given.mild, "PYTHON": given.python, "PLUGIN": str(plugin_of(given.mild)), "FILE": str(folder / "rows.json"), "FOLDER": str(folder)}
    words = [stand.get(word, word.replace("FOLDER/", f"{folder}/")) for word in command.words]
    clocks, begin = Clocks(), time.time()
    clocks.start()
    with open(folder / "output.txt", "w", encoding="utf-8") as file:
        code = subprocess.run(words, cwd=ROOT, stdout=file, stderr=subprocess.STDOUT, check=False).returncode
    found = {"seconds": time.time() - begin, "exit": code, "why": "", "clocks": clocks.over()}
    try:
        if code:
            raise ValueError((folder / "output.txt").read_text(encoding="utf-8").strip()[-300:])
        read(command, folder, found["seconds"])
    except (OSError, ValueError, KeyError, TypeError, IndexError, statistics.StatisticsError) as error:
        found |= {"exit": code or 1, "why": f"exit code {code}: {error}"}
    for path in folder.rglob("*"):  # weights and checkpoints are no part of a record
        if path.suffix in (".safetensors",) or path.name.startswith("events.out"):
            path.unlink()
    return {**found, "files": raw_files(folder)}


def read(command, folder, seconds):
    """{case: (value, unit)}; raises ValueError for what is no measurement."""
    rows = {case: (float(value), unit) for case, value, unit in command.read(folder, folder / "rows.json", seconds)}
    if not rows or not all(math.isfinite(value) and value >= 0 for value, _ in rows.values()):
        raise ValueError(f"{command.name}: no numbers, or one that is none")
    return rows


def place(out, name, turn):
    return out / "raw" / name / str(turn)


def rows_from(out, runs):
    """[row] of all runs that ended well, from the raw files alone: a case of a command, with a value of each round."""
    by_name, found = {c.name: c for c in commands()}, {}
    for run in runs:
        if run["exit"] == 0:
            for case, (value, unit) in read(by_name[run["name"]], place(out, run["name"], run["round"]), run["seconds"]).items():
                row = found.setdefault((run["name"], case), {"id": f"{run['name']}/{case}", "by": by_name[run["name"]].who, "unit": unit,
                                                             "rounds": {}})
                row["rounds"][str(run["round"])] = value
    for row in found.values():
        row["value"] = statistics.median(row["rounds"].values())
    return list(found.values())


def ratios_of(rows):
    by_id, found = {row["id"]: row["rounds"] for row in rows}, []
    for name, (over, under, factor) in RATIOS.items():
        each = [factor * by_id[over][turn] / by_id[under][turn] for turn in by_id.get(over, {}) if by_id.get(under, {}).get(turn)]
        if each:
            found.append({"name": name, "over": over, "under": under, "factor": factor, "value": statistics.median(each),
                          "least": min(each), "most": max(each)})
    return found


def bars_of(rows, ratios):
    values = {**{row["id"]: row["value"] for row in rows}, **{ratio["name"]: ratio["value"] for ratio in ratios}}
    return [{"name": name, "value": values[name], "bar": bar, "more_is_better": more,
             "reached": values[name] >= bar if more else values[name] <= bar} for name, (bar, more) in BARS.items() if name in values]


def measure(given):
    if not given.out:
        fail("run: which folder? For example `mild bench record out/record`")
    if given.rounds < 1:
        fail(f"--rounds {given.rounds}: at least 1")
    given.mild = os.path.abspath(given.mild)
    if "/" in given.python:
        given.python = os.path.abspath(given.python)
    out, chosen = given.out.resolve(), [c for c in commands() if not given.only or c.name in given.only.split(",")]
    unknown = set(given.only.split(",") if given.only else ()) - {c.name for c in commands()}
    if unknown:
        fail(f"--only {sorted(unknown)[0]}: choose from {' '.join(c.name for c in commands())}")
    if (out / "record.json").exists() or (out / "raw").exists():
        fail(f"{out} has a record; choose another folder")
    if not pathlib.Path(given.mild).is_file():
        fail(f"{given.mild}: no such program; build it, or name it with --mild")
    whole = {"time": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()), "machine": machine(), "versions": versions(given.mild, given.python),
             "only": [c.name for c in chosen], "missing": [], "runs": []}
    ready = []
    for command in chosen:
        why = missing_of(command, given, whole["machine"]["gpus"])
        whole["missing"] += [{"name": command.name, "by": command.who, "why": why}] if why else []
        ready += [] if why else [command]
    whole["missing"].append({"name": "nanog1", "by": "nanoG1", "why": NANOG1})
    for turn in range(1, given.rounds + 1):
        for command in ready:
            if command.rounds and turn > command.rounds:
                continue
            run = {"name": command.name, "round": turn, "command": shlex.join(command.words), **play(command, place(out, command.name, turn), given)}
            whole["runs"].append(run)
            print(f"round {turn}: {command.name}: {run['seconds']:.1f} s {run['why']}".rstrip(), flush=True)
            if run["exit"] != 0:
                whole["missing"].append({"name": command.name, "by": command.who, "why": f"round {turn}: {run['why']}"})
    whole["rows"] = rows_from(out, whole["runs"])
    whole["ratios"] = ratios_of(whole["rows"])
    whole["bars"] = bars_of(whole["rows"], whole["ratios"])
    (out / "record.json").write_text(json.dumps(whole, indent=1) + "\n", encoding="utf-8")
    (out / "record.md").write_text(page(whole), encoding="utf-8")
    print(f"{out / 'record.md'}\n{sum(b['reached'] for b in whole['bars'])} of {len(whole['bars'])} bars reached")
    return 1 if any(run["exit"] and c.who == "mild" for run in whole["runs"] for c in ready if c.name == run["name"]) else 0


# ---- the page ----

def number(value):
    return f"{value:.4g}" if abs(value) < 1e5 else f"{value / 1e6:.4g} M"


def table(heads, rows):
    return "\n".join("| " + " | ".join(map(str, cells)) + " |" for cells in [heads, ["---"] * len(heads), *rows]) + "\n"


def spread(run):
    return ", ".join(f"{key.replace('_', ' ')} {low:.4g} / {middle:.4g} / {high:.4g}" for key, (low, middle, high) in run["clocks"].items())


def page(whole):
    """Markdown, from record.json alone."""
    box = whole["machine"]
    gpus = "; ".join(f"{g['name']}, driver {g['driver_version']}, at most {g['clocks.max.sm']} MHz, {g['power.limit']} W" for g in box["gpus"])
    text = [f"# Speed, measured {whole['time']}\n",
            f"mild {whole['versions']['mild']} on {box['processor']}, {box['cores']} cores, {box['vectors']}, {box['system']}; "
            f"{gpus or 'no NVIDIA GPU'}. Medians over the rounds; a ratio is of one round, and its range that of the rounds.\n",
            "## Against the peers\n", table(["ratio", "median", "least", "most"],
                                            [[r["name"], f"{r['value']:.3f}", f"{r['least']:.3f}", f"{r['most']:.3f}"] for r in whole["ratios"]]),
            "## What is asked\n", table(["", "measured", "bar", ""],
                                        [[b["name"], number(b["value"]), f"{'at least' if b['more_is_better'] else 'at most'} {number(b['bar'])}",
                                          "reached" if b["reached"] else "**missed**"] for b in whole["bars"]]),
            "## Missing\n", table(["", "what", "why"], [[m["by"], m["name"], m["why"]] for m in whole["missing"]]),
            "## Rows\n", table(["row", "by", "median", "unit", "least", "most", "rounds"],
                               [[r["id"], r["by"], number(r["value"]), r["unit"], number(min(r["rounds"].values())),
                                 number(max(r["rounds"].values())), len(r["rounds"])] for r in whole["rows"]]),
            "## Commands\n\nIn this order. MILD is `build/mild`, PYTHON the interpreter of the peers, PLUGIN the plugin beside MILD. Clocks: least, median and largest reading.\n",
            table(["round", "name", "s", "clocks", "command"],
                  [[r["round"], r["name"], f"{r['seconds']:.1f}", spread(r), f"`{r['command']}`"] for r in whole["runs"]]),
            "## Versions\n", table(["", ""], list(whole["versions"].items()))]
    return "\n".join(text)


# ---- checking ----

def faults(out):
    """Yields what in a record does not belong together."""
    whole = json.loads((out / "record.json").read_text(encoding="utf-8"))
    other = [run for run in whole["runs"] if raw_files(place(out, run["name"], run["round"])) != run["files"]]
    for run in other:
        yield f"raw output of {run['name']}, round {run['round']}, is not what was recorded"
    if other:
        return
    known = {c.name: c for c in commands()}
    for run in whole["runs"]:
        if run["name"] not in known or shlex.join(known[run["name"]].words) != run["command"]:
            yield f"{run['name']}: this version of record.py runs another command"
            return
    silent = set(whole["only"]) - {run["name"] for run in whole["runs"]} - {absent["name"] for absent in whole["missing"]}
    if silent:
        yield f"{sorted(silent)[0]} was neither run nor named as missing"
    if "nanog1" not in {absent["name"] for absent in whole["missing"]}:
        yield "nanog1 is not named as missing"
    for key, computed in (("rows", rows_from(out, whole["runs"])), ("ratios", ratios_of(whole["rows"])),
                      ("bars", bars_of(whole["rows"], whole["ratios"]))):
        if computed != whole[key]:
            other = next((a for a, b in zip(whole[key], computed) if a != b), None)
            yield f"{key} do not follow from the raw output: {json.dumps(other) if other else f'{len(whole[key])} in place of {len(computed)}'}"
    if (out / "record.md").read_text(encoding="utf-8") != page(whole):
        yield "the page has other numbers than record.json"


def opened(out):
    """A record that fits together."""
    if not (out / "record.json").is_file():
        fail(f"{out} has no record.json")
    try:
        found = list(faults(out))
    except (OSError, ValueError, KeyError, TypeError) as error:
        found = [f"torn: {error!r}"]
    for fault in found:
        print(f"{out}: {fault}", file=sys.stderr)
    if found:
        sys.exit(1)
    return json.loads((out / "record.json").read_text(encoding="utf-8"))


def check(given):
    whole = opened(given.out)
    print(f"{len(whole['rows'])} rows of {len(whole['runs'])} runs, {len(whole['ratios'])} ratios: all follow from the raw output")
    return 0


# ---- history ----

def name_of(box):
    """Records with the same name may be compared."""
    return ", ".join([f"{box['processor']}, {box['cores']} cores", *(g["name"] for g in box["gpus"])])


def add(given):
    whole = opened(given.out)
    version = whole["versions"]["mild"]
    if "dirty" in version and not given.dirty:
        fail(f"mild {version} was built with changes that are in no commit; --dirty takes it all the same")
    values = {row["id"]: row["value"] for row in whole["rows"] if row["id"] in KEPT}
    values |= {ratio["name"]: ratio["value"] for ratio in whole["ratios"]}
    load = max((run["clocks"].get("load", [0, 0, 0])[1] for run in whole["runs"]), default=0)
    line = {"time": whole["time"], "version": version, "machine": name_of(whole["machine"]), "load": round(load, 2),
            "record": digest(given.out / "record.json")[:16], "values": {k: float(f"{v:.5g}") for k, v in values.items()}}
    if any(known["record"] == line["record"] for known in history_lines(given.file)):
        fail(f"{given.file} has this record")
    try:
        with open(given.file, "a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
    except OSError as error:
        fail(f"{given.file}: {error.strerror}; --file names another")
    print(f"{given.file}: {version}, {len(values)} numbers")
    return 0


def history_lines(path):
    if not path.is_file():
        return []
    found = []
    for n, text in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        try:
            line = json.loads(text)
            if not {"machine", "version", "record", "values"} <= set(line):
                raise ValueError
        except (ValueError, TypeError):
            fail(f"{path}, line {n}: no record of `mild bench record add`; take the line out")
        found.append(line)
    return found


def more_is_better(name):
    return KEPT.get(name, BARS.get(name, (0, False))[1] if name in BARS else "physics steps/s" in name)


def series(lines):
    """{machine: {name: [(version, value)]}} in the order of the file."""
    found = {}
    for line in lines:
        for name, value in line["values"].items():
            found.setdefault(line["machine"], {}).setdefault(name, []).append((line["version"], value))
    return found


def slower(name, values):
    """Share by which the last value is worse than the median of those before it; 0 for the first."""
    if len(values) < 2 or not values[-1]:
        return 0.0
    before = statistics.median(values[:-1])
    return before / values[-1] - 1 if more_is_better(name) else values[-1] / before - 1


def history(given):
    found, late = series(history_lines(given.file)), 0
    if not found:
        fail(f"{given.file} has no record; `mild bench record add OUT` adds one")
    for box, numbers in found.items():
        rows = []
        for name, points in numbers.items():
            worse = slower(name, [value for _, value in points])
            late += worse > given.slow
            rows.append([name, len(points), *(number(points[i][1]) if len(points) >= -i else "" for i in (-3, -2, -1)),
                         points[-1][0], f"{100 * worse:+.1f} %" + (" **slow**" if worse > given.slow else "")])
        print(f"{box}\n\n" + table(["", "records", "", "", "last", "of", "worse than the median before"], rows))
    if given.picture:
        draw(found, given.picture)
    return 1 if late else 0


def draw(found, path):
    try:
        import matplotlib
        matplotlib.use("Agg")
        import matplotlib.pyplot as plt
    except ImportError:
        fail("--picture: matplotlib is missing (scripts/requirements.txt)")
    names = list(dict.fromkeys(name for numbers in found.values() for name in numbers))
    figure, axes = plt.subplots(len(names), 1, figsize=(7, 1.5 * len(names)), layout="constrained", squeeze=False)
    for each, name in zip(axes[:, 0], names):
        for box, numbers in found.items():
            points = numbers.get(name, [])
            each.plot(range(len(points)), [value for _, value in points], ".-", label=box)
            each.set_xticks(range(len(points)), [version.split("+g")[-1] for version, _ in points], fontsize=6)
        if name in BARS:
            each.axhline(BARS[name][0], color="0.6", linestyle=":")
        each.set_title(f"{name} ({'more' if more_is_better(name) else 'less'} is better)", fontsize=7)
        each.set_ylim(bottom=0)
        each.tick_params(labelsize=6)
        each.spines[["top", "right"]].set_visible(False)
    axes[0][0].legend(frameon=False, fontsize=6)
    figure.savefig(path, dpi=110)
    print(path)


class Parser(argparse.ArgumentParser):
    def error(self, message):
        fail(f"{message}; --help lists all")


def main():
    parser = Parser(prog="mild bench record", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words = parser.add_subparsers(metavar="[run] | check | add | history")
    run = words.add_parser("run")
    run.add_argument("out", type=pathlib.Path, nargs="?")
    run.add_argument("--rounds", type=int, default=3)
    run.add_argument("--only", help="names, see --list")
    run.add_argument("--list", action="store_true")
    run.add_argument("--mild", default=os.environ.get("MILD", str(ROOT / "build/mild")))
    run.add_argument("--python", default=sys.executable, help="with the peers (default: this one)")
    run.set_defaults(work=measure)
    for name, work in (("check", check), ("add", add)):
        one = words.add_parser(name)
        one.add_argument("out", type=pathlib.Path)
        one.add_argument("--file", type=pathlib.Path, default=ROOT / "lab/bench/record.jsonl")
        one.add_argument("--dirty", action="store_true")
        one.set_defaults(work=work)
    past = words.add_parser("history")
    past.add_argument("--file", type=pathlib.Path, default=ROOT / "lab/bench/record.jsonl")
    past.add_argument("--slow", type=float, default=SLOW, help=f"share of a slow-down that ends with exit code 1 (default {SLOW})")
    past.add_argument("--picture", type=pathlib.Path)
    past.set_defaults(work=history)
    line = sys.argv[1:]
    given = parser.parse_args(line if line[:1] and line[0] in (*words.choices, "-h", "--help") else ["run", *line])
    if given.work is measure and given.list:
        gpus = machine()["gpus"]
        for command in commands():
            print(f"{command.name:28} {command.who:14} {missing_of(command, given, gpus) or 'ready'}")
        sys.exit(0)
    sys.exit(given.work(given))


if __name__ == "__main__":
    main()
