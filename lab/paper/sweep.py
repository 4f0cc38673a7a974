#!/usr/bin/env python3
"""The trainings of the paper's experiments as one command, on a list of GPUs or under Slurm.

  lab/paper/sweep.py run runs/sweep --gpus 0,1 --jobs 2            # GNU parallel: 147 trainings, two at a time on each GPU
  lab/paper/sweep.py run runs/sweep models latent --seeds 1        # some experiments, GPU 0
  lab/paper/sweep.py slurm runs/sweep --sbatch "--gres=gpu:1 --time=30 --partition=gpu"    # a job array; --most 16: so many at a time
  lab/paper/sweep.py table runs/sweep                              # what is there, as one table: runs/sweep/table.csv

Experiments: models (lab/paper/train.sh), latent and deviations (changes.sh), factorial (factorial.py, a task for each controller, which
is many trainings). A task is one call of such a script for one name and one seed; then the policy walks, if the script
has not measured it, and FOLDER/EXPERIMENT/NAME-SEED.json has the result. Tasks with a result are done: the same command goes on where it
stopped, after a crash or with more seeds, and two launchers may share a folder. FOLDER/log/EXPERIMENT.NAME-SEED has what a task
printed. GNU parallel and Slurm are Debian's packages parallel and slurm-client. MILD is the program (default build/mild)."""
import argparse
import csv
import fcntl
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys

from deviations import measures

HERE = pathlib.Path(__file__).resolve().parent
MILD = os.environ.get("MILD", str(HERE.parents[1] / "build/mild"))
JUDGE = ["--model", "mild", "--train.device=cpu", "--train.robots=mujoco", "--ground", "rigid,rubber,foam45,sand_loose", "--speed", "0.3,0.6"]
SCRIPTS = {"models": ["train.sh"], "latent": ["changes.sh", "latent"], "deviations": ["changes.sh", "deviations"], "factorial": ["factorial.py"]}


def fail(text):
    print(f"sweep.py: {text}", file=sys.stderr)
    sys.exit(2)


# ---- tasks ----

def names_of(experiment):
    """Those that its script knows."""
    text = (HERE / SCRIPTS[experiment][0]).read_text(encoding="utf-8")
    if experiment == "models":
        return re.search(r"models=\((\w[^)]*)\)", text).group(1).split()
    if experiment == "factorial":
        return re.findall(r'"(\w+)": "', re.search(r"^CONTROLLERS = \{(.*)\}", text, re.M).group(1))
    return re.findall(r"^ *\[(\w+)\]=", re.search(rf"^{experiment}\(\) {{(.*?)^}}", text, re.M | re.S).group(1), re.M)


def tasks_of(experiments, seeds):
    """[experiment.name-seed], a seed of all first, so that a sweep that is cut short is whole in fewer seeds."""
    single = [e for e in experiments if e != "factorial"]
    found = [f"{e}.{name}-{seed}" for seed in range(1, seeds + 1) for e in single for name in names_of(e)]
    return found + [f"factorial.{name}-{seeds}" for name in names_of("factorial") if "factorial" in experiments]


def parts_of(folder, task):
    """(experiment, name, seed, FOLDER/EXPERIMENT/NAME-SEED)"""
    found = re.fullmatch(r"(\w+)\.(\w+)-(\d+)", task)
    if not found or found[1] not in SCRIPTS or found[2] not in names_of(found[1]):
        fail(f"unknown task {task}; lab/paper/sweep.py list prints them")
    return found[1], found[2], found[3], folder / found[1] / f"{found[2]}-{found[3]}"


def is_done(folder, task):
    target = parts_of(folder, task)[3]
    return target.with_name(target.name + ".json").is_file()


def call(words, **more):
    return subprocess.run(list(map(str, words)), check=False, **more).returncode


def work(folder, task, options):
    """Trains and measures it; exit code."""
    experiment, name, seed, target = parts_of(folder, task)
    result, policy = (target.with_name(target.name + end) for end in (".json", ".safetensors"))
    if experiment == "factorial":
        own = folder / "factorial" / f"{name}-{seed}"
        code = call([sys.executable, HERE / "factorial.py", own, "--controllers", name, "--seeds", seed, *options])
        if code == 0:
            shutil.copyfile(own / "factorial.json", result)
        return code
    code = call([HERE / SCRIPTS[experiment][0], *SCRIPTS[experiment][1:], target.parent, f"{seed}-{seed}", name])
    if code == 0 and not result.is_file() and policy.is_file():
        part = result.with_name(result.name + ".part")
        code = call([MILD, "eval", "--policy", policy, "--config", target.with_name(target.name + ".ini"), *JUDGE, "--json", part, *options],
                    stdout=subprocess.DEVNULL)
        if code == 0:
            part.replace(result)
    return code if code or result.is_file() else 1


def play(folder, task, options):
    """A task, unless it is done or another launcher has it."""
    (folder / "log").mkdir(parents=True, exist_ok=True)
    with open(folder / "log" / f"{task}.lock", "w", encoding="utf-8") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            print(f"{task}: another process has it")
            return 0
        if is_done(folder, task):
            return 0
        with open(folder / "log" / task, "a", encoding="utf-8") as log:
            sys.stdout.flush()
            os.dup2(log.fileno(), 1)
            os.dup2(log.fileno(), 2)
            return work(folder, task, options)


# ---- launchers ----

def waiting(given):
    tasks = tasks_of(given.experiments, given.seeds)
    left = [task for task in tasks if not is_done(given.folder, task)]
    print(f"{len(tasks)} tasks, {len(tasks) - len(left)} done", flush=True)
    return left


def words_of(given):
    """The command of one task, but for its name."""
    return [sys.executable, __file__, "task", given.folder, *(["--options", given.options] if given.options else [])]


def need(program, package):
    if not shutil.which(program):
        fail(f"{program} is missing: apt-get install {package}")


def run(given):
    """By GNU parallel: a slot for each job of each GPU."""
    need("parallel", "parallel")
    gpus = [gpu for gpu in given.gpus.split(",") if gpu]
    slots = max(1, len(gpus)) * given.jobs
    one = " ".join(shlex.quote(str(word)) for word in words_of(given)) + " {1}"
    if gpus:  # {%} is the slot, from 1
        one = f'gpus=({" ".join(gpus)}); CUDA_VISIBLE_DEVICES=${{gpus[$((({{%}} - 1) % {len(gpus)}))]}} {one}'
    left = waiting(given)
    given.folder.mkdir(parents=True, exist_ok=True)
    code = call(["parallel", "--will-cite", "--jobs", slots, "--joblog", given.folder / "joblog", one, ":::", *left],
                env={**os.environ, "PARALLEL_SHELL": "/bin/bash"}) if left else 0
    return table(given) if code == 0 else print_failures(given)


def print_failures(given):
    for task in tasks_of(given.experiments, given.seeds):
        log = given.folder / "log" / task
        if not is_done(given.folder, task) and log.is_file():
            last = (log.read_text(encoding="utf-8").strip().splitlines() or ["no message"])[-1]
            print(f"sweep.py: {task}: {last}", file=sys.stderr)
    return 1


def slurm(given):
    """A job array: element k is task k of FOLDER/tasks."""
    need("sbatch", "slurm-client")
    left = waiting(given)
    if not left:
        return table(given)
    (given.folder / "log").mkdir(parents=True, exist_ok=True)
    listed = given.folder / f"tasks.{os.getpid()}"  # of this array: another has a file of its own
    listed.write_text("".join(f"{task}\n" for task in left), encoding="utf-8")
    one = " ".join(shlex.quote(str(word)) for word in words_of(given))
    script = f"#!/bin/bash\nexec {one} \"$(sed -n \"$((SLURM_ARRAY_TASK_ID + 1))p\" {shlex.quote(str(listed))})\"\n"
    most = f"%{given.most}" if given.most else ""
    return call(["sbatch", f"--array=0-{len(left) - 1}{most}", "--job-name=sweep", f"--output={given.folder}/log/slurm-%A_%a",
                 *(["--wait"] if given.wait else []), *shlex.split(given.sbatch)], input=script, text=True)


# ---- the table ----

def last_of(path):
    """(policy steps, mean of the reward over the last tenth) of a training's log, or None for each."""
    try:
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        tail = [float(row["episode/reward"]) for row in rows[-max(1, len(rows) // 10):]]
        return float(rows[-1]["rate/steps"]), sum(tail) / len(tail)
    except (OSError, KeyError, IndexError):
        return None, None


def rows_of(folder):
    """A row for each result, whichever experiment."""
    found = []
    for experiment in SCRIPTS:
        for path in sorted((folder / experiment).glob("*-*.json")):
            name, seed = path.stem.rsplit("-", 1)
            steps, reward = last_of(path.with_suffix(".csv"))
            row = {"experiment": experiment, "name": name, "seed": seed, "policy_steps": steps, "reward": reward}
            if experiment == "factorial":
                found += [{**row, "name": f"{name} on {own['ground']}", "policy_steps": own.get("steps"), "upright": own[part]["upright"],
                           "trials": own[part]["trials"], "speed_error": own[part]["error"], "cost_of_transport": own[part]["cot"]}
                          for own in json.loads(path.read_text(encoding="utf-8"))["rows"] for part in ("nine grounds",)]
            else:
                up, trials, error, cost, clearance, torque = measures(path)
                found.append({**row, "upright": up, "trials": trials, "speed_error": error, "cost_of_transport": cost,
                              "clearance_mm": clearance, "torque_max": torque})
    return found


def text_of(value):
    return "" if value is None or value != value else f"{value:.4g}" if isinstance(value, float) else str(value)


def table(given):
    rows = rows_of(given.folder)
    columns = ["experiment", "name", "seed", "policy_steps", "reward", "upright", "trials", "speed_error", "cost_of_transport", "clearance_mm",
               "torque_max"]
    if not rows:
        fail(f"{given.folder} has no results; lab/paper/sweep.py run makes them")
    with open(given.folder / "table.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: text_of(row.get(key)) for key in columns} for row in rows)
    print("| " + " | ".join(columns) + " |\n" + "|---" * len(columns) + "|")
    for row in rows:
        print("| " + " | ".join(text_of(row.get(key)) for key in columns) + " |")
    left = [task for task in tasks_of(given.experiments, given.seeds) if not is_done(given.folder, task)]
    print(f"{len(rows)} rows in {given.folder / 'table.csv'}; {len(left)} tasks left")
    return 0


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words = parser.add_subparsers(metavar="run | slurm | task | table | list", required=True)
    for name, does in (("run", run), ("slurm", slurm), ("table", table), ("list", None)):
        one = words.add_parser(name)
        if does:
            one.add_argument("folder", type=pathlib.Path)
        one.add_argument("experiments", nargs="*", help=f"of {' '.join(SCRIPTS)} (default: the first three)")
        one.add_argument("--seeds", type=int, default=3)
        one.set_defaults(does=does)
        if name in ("run", "slurm"):
            one.add_argument("--options", default="", help="of mild eval after a training, or of factorial.py")
        if name == "run":
            one.add_argument("--gpus", default="0", help="numbers as of nvidia-smi, 0,1,3; empty: the tasks see all (default 0)")
            one.add_argument("--jobs", type=int, default=1, help="tasks at a time on each (default 1)")
        if name == "slurm":
            one.add_argument("--sbatch", default="", help="options of sbatch, for the cluster")
            one.add_argument("--most", type=int, default=0, help="tasks at a time (default: as the cluster says)")
            one.add_argument("--wait", action="store_true", help="until all have ended")
    task = words.add_parser("task")
    task.add_argument("folder", type=pathlib.Path)
    task.add_argument("name")
    task.add_argument("--options", default="")
    task.set_defaults(does=lambda given: play(given.folder, given.name, shlex.split(given.options)), experiments=[])
    given = parser.parse_args()
    unknown = [name for name in given.experiments if name not in SCRIPTS]
    if unknown:
        fail(f"unknown experiment {unknown[0]}; choose from {' '.join(SCRIPTS)}")
    if "seeds" in given:
        given.experiments = given.experiments or [name for name in SCRIPTS if name != "factorial"]
    if "folder" in given:
        given.folder = given.folder.resolve()
    return given


def main():
    given = parse()
    if given.does is None:
        print("\n".join(tasks_of(given.experiments, given.seeds)))
        return 0
    return given.does(given)


if __name__ == "__main__":
    sys.exit(main())
