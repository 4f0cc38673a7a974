#!/usr/bin/env python3
"""lab/paper/sweep.py with a made-up mild, and with GNU parallel and Slurm where there are any, else with a stand-in for each: each task
is done once, on its GPU, and again only if its result is lost; a training that fails is named; the table has everybody's numbers.
Usage: test_sweep.py SOURCE_FOLDER"""
import csv
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

root = pathlib.Path(sys.argv[1]).resolve()
sys.path.insert(0, str(root / "lab"))
from stand_in import program  # noqa: E402

sweep = root / "lab/paper/sweep.py"
work = pathlib.Path(tempfile.mkdtemp())

# A robot stays up in as many trials as the seed says, and falls in all where the change is `clip_sum`; one row has no speed.
MILD = '''#!/usr/bin/env python3
import json, os, pathlib, re, sys
words = sys.argv[1:]
log = open(os.environ["CALLS"], "a")
value = lambda key: words[words.index(key) + 1]
if words[0] == "train":
    log.write("train " + os.environ.get("CUDA_VISIBLE_DEVICES", "-") + " " + " ".join(words[5:]) + "\\n")
    if os.environ.get("BROKEN") and os.environ["BROKEN"] in words:
        sys.exit("no memory")
    out = pathlib.Path(value("--out"))
    out.mkdir(parents=True)
    (out / "config.ini").write_text(" ".join(words))
    (out / "policy.safetensors").write_text(" ".join(words))
    (out / "log.csv").write_text("rate/steps,episode/reward\\n" + "".join(f"{100 * i},{i}\\n" for i in range(1, 21)))
    print("training")
else:
    log.write("eval\\n")
    config = open(value("--config")).read()
    seed = int(re.search(r"--train.seed=(\\d+)", config)[1])
    falls = "--reward.clip_sum" in config
    row = {"speed": 0.6, "velocity": 0.5, "cot": 0.4, "clearance": 0.1, "torque_max": 50 + seed, "trials": 10, "success": 0 if falls else 5 + seed}
    rows = {"rows": [row, {**row, "velocity": None, "cot": None}]}
    if "--json" in words:
        open(value("--json"), "w").write(json.dumps(rows))
    if "--latent" in words:
        open(value("--latent"), "w").write("0,rigid\\n")
'''
# Of GNU parallel: --jobs N COMMAND ::: ITEM..., one after the other in slots that take turns.
PARALLEL = '''#!/usr/bin/env python3
import os, subprocess, sys
words = sys.argv[1:]
at, jobs = words.index(":::"), int(words[words.index("--jobs") + 1])
codes = [subprocess.call(["/bin/bash", "-c", words[at - 1].replace("{1}", item).replace("{%}", str(i % jobs + 1))])
         for i, item in enumerate(words[at + 1:])]
sys.exit(sum(code != 0 for code in codes))
'''
SBATCH = '''#!/usr/bin/env python3
import os, re, subprocess, sys
script = sys.stdin.read()
assert script.startswith("#!/bin/bash")
open(os.environ["SUBMITTED"], "w").write(" ".join(sys.argv[1:]))
last = next(int(re.match(r"--array=0-(\\d+)", word)[1]) for word in sys.argv if word.startswith("--array"))
for i in range(last + 1):
    subprocess.call(["/bin/bash", "-c", script], env={**os.environ, "SLURM_ARRAY_TASK_ID": str(i)})
'''


program(work, "mild", MILD)
program(work, "bin/sbatch", SBATCH)
if not shutil.which("parallel"):
    program(work, "bin/parallel", PARALLEL)
calls = work / "calls"
common = {**os.environ, "MILD": str(work / "mild"), "CALLS": str(calls), "PYTHONDONTWRITEBYTECODE": "1", "SUBMITTED": str(work / "submitted"),
          "PATH": f"{work / 'bin'}:{os.environ['PATH']}"}


def run(*words, code=0, **variables):
    done = subprocess.run([sys.executable, sweep, *map(str, words)], capture_output=True, text=True, check=False, env={**common, **variables})
    assert done.returncode == code, (done.returncode, words, done.stdout, done.stderr)
    return done.stdout + done.stderr


def made():
    """Lines of what was called since the last time."""
    lines = calls.read_text().splitlines() if calls.exists() else []
    calls.unlink(missing_ok=True)
    return lines


def rows_of(folder):
    with open(folder / "table.csv", newline="") as file:
        return {(row["experiment"], row["name"], row["seed"]): row for row in csv.DictReader(file)}


# ---- which tasks there are: those of the scripts, a seed of all first ----
listed = run("list").split()
assert listed[:2] == ["models.mild-1", "models.con_cone-1"] and listed[-1].endswith("-3") and len(set(listed)) == len(listed)
for experiment, first, count in (("deviations", "as_it_is", 31), ("latent", "none", 10)):
    said = subprocess.run([root / "lab/paper/changes.sh", experiment, work / "none", "1", "nosuch"], capture_output=True, text=True, check=False).stderr
    names = set(said.split("choose from ")[1].split())
    assert first in names and len(names) == count, said
    assert {f"{experiment}.{name}-2" for name in names} == {task for task in listed if task.startswith(experiment) and task.endswith("-2")}
assert run("list", "factorial", "--seeds", 2).split() == [f"factorial.{name}-2" for name in ("mlp", "clock", "ht2", "flat", "ours")]

# ---- by GNU parallel, on GPUs 2 and 5: each once ----
out = work / "runs"
printed = run("run", out, "models", "deviations", "--seeds", 1, "--gpus", "2,5")
tasks = run("list", "models", "deviations", "--seeds", 1).split()
lines = made()
trained = [line for line in lines if line.startswith("train")]
assert len(trained) == len(tasks) == lines.count("eval"), (len(trained), len(tasks))
assert {line.split()[1] for line in trained} == {"2", "5"}
assert sum("--randomize.model=bekker" in line for line in trained) == 0 and sum("--randomize.model=rigid" in line for line in trained) == 1
rows = rows_of(out)
assert set(rows) == {(*task.split(".")[:1], *task.split(".")[1].rsplit("-", 1)) for task in tasks} and "0 tasks left" in printed
assert rows["models", "mild", "1"] == {"experiment": "models", "name": "mild", "seed": "1", "policy_steps": "2000", "reward": "19.5", "upright": "12",
                                       "trials": "20", "speed_error": "0.1", "cost_of_transport": "0.4", "clearance_mm": "100", "torque_max": "51"}
fell = rows["deviations", "clip_sum", "1"]
assert fell["upright"] == "0" and fell["speed_error"] == "" and fell["torque_max"] == "", fell

# ---- again: nothing; after a loss: that one; with another seed: those ----
assert "0 tasks left" in run("run", out, "models", "deviations", "--seeds", 1) and made() == []
(out / "models/rigid-1.json").unlink()
run("run", out, "models", "deviations", "--seeds", 1, "--gpus", "")
assert made() == ["eval"]  # its policy was there
(out / "deviations/clock-1.json").unlink()
run("run", out, "models", "deviations", "--seeds", 1, "--gpus", "7")
lines = made()
assert len(lines) == 2 and lines[0].startswith("train 7") and "--task.clock=false" in lines[0] and "--train.seed=1" in lines[0], lines
run("run", out, "models", "--seeds", 2)
lines = made()
assert len(lines) == 16 and all("--train.seed=2" in line for line in lines if line != "eval"), lines
assert rows_of(out)["models", "mild", "2"]["upright"] == "14"

# ---- a training that fails is named, the others go on, and the next start makes it ----
printed = run("run", out, "models", "--seeds", 3, code=1, BROKEN="--randomize.model=ecc_quasi")
assert "models.ecc_quasi-3: no memory" in printed and (out / "models/rigid-3.json").exists() and not (out / "models/ecc_quasi-3.json").exists(), printed
made()
run("run", out, "models", "--seeds", 3)
assert len(made()) == 2

# ---- one seed alone; what changes.sh latent has measured walks like the others, by its own config ----
run("task", work / "alone", "models.mild-3")
assert [line.split()[-1] for line in made()] == ["--train.seed=3", "eval"]
run("task", work / "alone", "latent.window-2")
lines = made()
assert lines[0].startswith("train") and "--task.history_stride=16" in lines[0] and "--train.seed=2" in lines[0], lines
assert lines[1:] == ["eval"] * 4 and "history_stride=16" in (work / "alone/latent/window-2.ini").read_text(), lines
run("table", work / "alone", "latent")
assert rows_of(work / "alone")["latent", "window", "2"]["upright"] == "14"

# ---- as a job array: an element for each task that is left ----
(out / "models/mild-2.json").unlink()
(out / "models/rigid-3.json").unlink()
run("slurm", out, "models", "--sbatch", "--gres=gpu:1 --time=30", "--most", 4)
assert "--array=0-1%4" in (work / "submitted").read_text() and "--gres=gpu:1 --time=30" in (work / "submitted").read_text()
assert made() == ["eval", "eval"] and "0 tasks left" in run("slurm", out, "models")

# ---- two launchers in one folder: a task that is at work is left alone ----
(out / "models/mild-1.json").unlink()
holder = subprocess.Popen([sys.executable, "-c", "import fcntl, sys, time\nf = open(sys.argv[1], 'w')\nfcntl.flock(f, fcntl.LOCK_EX)\n"
                           "print('held', flush=True)\ntime.sleep(600)", out / "log/models.mild-1.lock"], stdout=subprocess.PIPE, text=True)
assert holder.stdout.readline() == "held\n"
assert "another process" in run("task", out, "models.mild-1") and made() == []
holder.kill()
holder.wait()
run("task", out, "models.mild-1")
assert made() == ["eval"]

# ---- the factorial's rows, a cell of controller and ground each ----
(out / "factorial").mkdir()
part = {"skill": 0.5, "upright": 90, "trials": 100, "error": 0.02, "cot": 0.6}
(out / "factorial/ours-3.json").write_text(json.dumps({"rows": [{"controller": "ours", "ground": "mild", "steps": 3e6, "nine grounds": part}]}))
run("table", out, "models", "factorial")
assert rows_of(out)["factorial", "ours on mild", "3"]["upright"] == "90"

# ---- mistakes ----
for pattern, words in (("nosuch", ("run", out, "nosuch")), ("models.nosuch-1", ("task", out, "models.nosuch-1")),
                       ("has no results", ("table", work / "none"))):
    printed = run(*words, code=2)
    assert pattern in printed and printed.count("\n") == 1, printed
shutil.rmtree(work)
print("a sweep of trainings: all as expected")
