#!/usr/bin/env python3
"""lab/bench/record.py with made-up programs in the place of mild, of the peers and of nvidia-smi: the numbers of a record are theirs, what
is missing is named, and a number that was changed afterwards is seen. With the real program: what its benches write is read.
Usage: test_record.py PATH_TO_MILD SOURCE_FOLDER"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

mild, root = (pathlib.Path(name).resolve() for name in sys.argv[1:3])
sys.path.insert(0, str(root / "lab"))
from stand_in import program  # noqa: E402

record = root / "lab/bench/record.py"

# A step takes 6 us on soft ground and 8 with rigid contact; with a GPU 16384 robots make 5e6 policy steps/s, MuJoCo Warp 4e6 physics steps/s.
MILD = '''#!/bin/sh
case "$1" in
--version) echo "mild 0.9.0+gabcdef012$DIRTY"; exit ;;
info) echo "compiler  made up"; exit ;;
eval) for last; do :; done
    echo '{"rows": [{"ground": "rigid", "success": 9, "trials": 10, "velocity": 0.5}, {"ground": "foam45", "success": 8, "trials": 10, "velocity": null}]}' >"$last"; exit ;;
train) while [ "$1" != --out ]; do shift; done
    mkdir -p "$2"; printf 'rate/steps_per_s\\n1\\n2000000\\n3000000\\n4000000\\n' >"$2/log.csv"; touch "$2/policy.safetensors"; exit ;;
esac
name=$2; for last; do :; done
if [ "$name" = step ] && [ "$TURNS" ]; then echo >>"$TURNS"; NEWTON=$(sed -n "$(wc -l <"$TURNS")p" "$TURNS.values"); fi
row() { printf '{"bench": "%s", "case": "%s", "value": %s, "unit": "us"}%s' "$name" "$1" "$2" "$3"; }
{ printf '{"machine": "m", "version": "0.9.0", "rows": ['
case "$name" in
step) row newton "${NEWTON:-6}" ,; row engine_rigid 8 ;;
walk) row sand_loose_newton 5 ,; row sand_loose_newton_tight 7.5 ,; row sand_loose_engine_rigid 10 ;;
train) row policy_steps_per_s "${RATE:-13000}" ;;
robots) row walking_policy_steps_per_s 5000000 ,; row memory_per_robot 13000 ;;
*) row anything 1 ;;
esac
printf ']}'; } >"$last"
[ "$name" != "$BROKEN" ]
'''
PYTHON = '''#!/bin/sh
case "$1 $2" in
"--version ") echo Python 3.99; exit ;;
"-c import mujoco_warp"*|"-c import mujoco;"*|"-c import warp"*|"-c import numpy"*|"-c import newton"*) echo 1; exit ;;
"-c import importlib"*) echo mujoco 9.9.9; exit ;;
"-c "*) exit 1 ;;
*plugin_walk*) for last; do :; done
    case "$*" in *--plugin*/mujoco_plugin/libmild_plugin.so*) ;; *) exit 1 ;; esac
    echo '{"rows": [{"bench": "plugin", "case": "sand_loose", "value": 15, "unit": "us"}, {"bench": "plugin", "case": "rigid", "value": 12, "unit": "us"}]}' >"$last"; exit ;;
*judge_mpm*) mkdir -p "$3"; echo '{"sand/disc120": {"beds": {"1": {"seconds_per_simulated_second": 9.5, "step_ms": 34}}}}' >"$3/manifest.json"; exit ;;
esac
while [ "$1" != --json ]; do shift; done
echo '{"rows": [{"bench": "mjwarp", "case": "rigid_5ms_16384", "value": 4000000, "unit": "1/s"}]}' >"$2"
'''
SMI = '''#!/bin/sh
case "$1" in
*driver_version*) echo "Made Up 100, 1.2, 80000, 1980, 2619, 700, [N/A]" ;;
*) echo "1700, 2619, 400.5, 55" ;;
esac
'''
work = pathlib.Path(tempfile.mkdtemp())


def run(*words, code=0, **variables):
    done = subprocess.run([sys.executable, record, *map(str, words)], capture_output=True, text=True, check=False,
                          env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1", **variables})
    assert done.returncode == code, (done.returncode, words, done.stdout, done.stderr)
    return done.stdout + done.stderr


def one_line(pattern, *words, **variables):
    printed = run(*words, code=2, **variables)
    assert pattern in printed and printed.count("\n") == 1, printed


def read(out):
    return json.loads((out / "record.json").read_text())


def changed(out, change, pattern):
    """A copy in which a number was changed; `check` sees it."""
    copy = work / "changed"
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(out, copy)
    change(copy)
    printed = run("check", copy, code=1)
    assert pattern in printed, (pattern, printed)


def edit(**parts):
    """Of record.json: key = (place, name, value)."""
    def change(out):
        whole = read(out)
        for key, (i, name, value) in parts.items():
            whole[key][i][name] = value
        (out / "record.json").write_text(json.dumps(whole, indent=1) + "\n")
    return change


def fits(out):
    printed = subprocess.run([sys.executable, root / "tests/app/schema.py", root / "docs/schema/record.json", out / "record.json"],
                          capture_output=True, text=True, check=False)
    assert printed.returncode == 0 and not printed.stdout, printed.stdout


made, peers = program(work, "mild", MILD), program(work, "python", PYTHON)
program(work, "bin/nvidia-smi", SMI)
program(work, "mujoco_plugin/libmild_plugin.so", "")
with_gpu = {"PATH": f"{work / 'bin'}:{os.environ['PATH']}"}
no_gpu = {"PATH": os.environ["PATH"]}

# ---- with a GPU: all but mjlab and nanoG1, and the numbers are the programs' ----
out = work / "gpu"
run("run", out, "--rounds", 2, "--mild", made, "--python", peers, **with_gpu)
fits(out)
assert "all follow" in run("check", out)
whole = read(out)
values = {row["id"]: row for row in whole["rows"]}
assert [x["name"] for x in whole["missing"]] == ["mjlab", "nanog1"], whole["missing"]
assert values["step/newton"]["value"] == 6 and values["step/newton"]["rounds"] == {"1": 6, "2": 6}
assert values["train_16384/policy_steps_per_s"]["value"] == 3e6  # the median of the last two thirds
assert values["walk_from_nothing/upright"]["value"] == 17 and values["walk_from_nothing/trials"]["value"] == 20
assert list(values["train/policy_steps_per_s"]["rounds"]) == ["1"] and values["newton_mpm/plate_seconds_per_simulated_second"]["value"] == 9.5
ratios = {ratio["over"]: ratio["value"] for ratio in whole["ratios"]}
assert ratios["step/newton"] == 0.75 and ratios["walk/sand_loose_newton"] == 0.5
by_under = {ratio["under"]: ratio["value"] for ratio in whole["ratios"] if ratio["over"] == "plugin/sand_loose"}
assert by_under == {"walk/sand_loose_newton_tight": 2, "plugin/rigid": 1.25}
assert ratios["robots_16384/walking_policy_steps_per_s"] == 2.5  # 2 physics steps a policy step
bars = {bar["name"]: bar["reached"] for bar in whole["bars"]}
assert bars["train/policy_steps_per_s"] and not bars["robots_16384/memory_per_robot"] and not bars["train_16384/policy_steps_per_s"]
assert whole["machine"]["gpus"][0]["name"] == "Made Up 100" and whole["runs"][0]["clocks"]["gpu_clocks.sm"] == [1700, 1700, 1700]
assert whole["versions"]["mujoco"] == "9.9.9" and whole["versions"]["mild"] == "0.9.0+gabcdef012"
order = [(run["round"], run["name"]) for run in whole["runs"]]
assert order.index((1, "robots_16384")) + 1 == order.index((1, "mjwarp_16384")) < order.index((2, "step")), order  # in turns
page = (out / "record.md").read_text()
assert "| step/newton | mild | 6 | us |" in page and "**missed**" in page and "nanoG1" in page and "Made Up 100" in page
assert not list(out.rglob("*.safetensors"))

# ---- numbers that were changed ----
rows = [row["id"] for row in whole["rows"]]
changed(out, edit(rows=(rows.index("step/newton"), "value", 4.0)), "rows do not follow")
changed(out, edit(ratios=(0, "value", 0.55)), "ratios do not follow")
changed(out, edit(runs=(0, "command", "MILD bench step --task.physics_dt=0.001")), "another command")
changed(out, lambda x: (x / "raw/step/2/rows.json").write_text((x / "raw/step/2/rows.json").read_text().replace("6", "4")), "raw output of step, round 2")
changed(out, lambda x: (x / "record.md").write_text(page.replace("| 0.750 |", "| 0.550 |")), "the page has other numbers")
changed(out, lambda x: shutil.rmtree(x / "raw/walk/1"), "raw output of walk")


def without(key, name):
    def change(copy):
        kept = read(copy)
        kept[key] = [x for x in kept[key] if x.get("name") != name]
        (copy / "record.json").write_text(json.dumps(kept, indent=1) + "\n")
    return change


changed(out, without("missing", "nanog1"), "nanog1")
changed(out, without("runs", "mjwarp_16384"), "mjwarp_16384 was neither run")

# ---- without a GPU, and with a bench that fails or has no number ----
slow = work / "slow"
run(slow, "--rounds", 1, "--mild", made, "--python", peers, NEWTON="8", RATE="6500", **no_gpu)
fits(slow)
absent = {x["name"]: x["why"] for x in read(slow)["missing"]}
if not shutil.which("nvidia-smi"):
    assert absent["mjwarp_16384"] == "no NVIDIA GPU" and absent["train_16384"] == "no NVIDIA GPU" and "robots_16384" in absent, absent
(work / "mujoco_plugin/libmild_plugin.so").rename(work / "plugin")
without_plugin = work / "without_plugin"
run(without_plugin, "--rounds", 1, "--only", "walk,plugin", "--mild", made, "--python", peers, **no_gpu)
assert "no mujoco_plugin" in next(x["why"] for x in read(without_plugin)["missing"] if x["name"] == "plugin")
(work / "plugin").rename(work / "mujoco_plugin/libmild_plugin.so")
broken = work / "broken"
run("run", broken, "--rounds", 1, "--only", "step,walk", "--mild", made, "--python", peers, code=1, BROKEN="walk", **no_gpu)
assert {x["name"] for x in read(broken)["missing"]} == {"walk", "nanog1"} and {r["id"] for r in read(broken)["rows"]} == {"step/newton", "step/engine_rigid"}
run("check", broken)
for no_number in ("NaN", "Infinity", "-6", "six"):
    none = work / f"none{no_number}"
    run("run", none, "--rounds", 1, "--only", "step,walk", "--mild", made, "--python", peers, code=1, NEWTON=no_number, **no_gpu)
    assert "step" in {x["name"] for x in read(none)["missing"]}, no_number

# ---- medians of rounds, and of the rounds' quotients ----
(work / "turns.values").write_text("10\n6\n7\n")
median = work / "median"
run("run", median, "--rounds", 3, "--only", "step", "--mild", made, "--python", peers, TURNS=str(work / "turns"), **no_gpu)
assert {row["id"]: row["value"] for row in read(median)["rows"]} == {"step/newton": 7, "step/engine_rigid": 8}
assert [read(median)["ratios"][0][key] for key in ("value", "least", "most")] == [7 / 8, 6 / 8, 10 / 8]

# ---- the history: a line a record, and a slow one is seen ----
lines = work / "history.jsonl"
fast = work / "fast"
run("run", fast, "--rounds", 1, "--mild", made, "--python", peers, **no_gpu)
assert not lines.exists()
run("add", fast, "--file", lines)
one_line("has this record", "add", fast, "--file", lines)
assert "slow" not in run("history", "--file", lines)
run("add", slow, "--file", lines)
printed = run("history", "--file", lines, code=1)  # 8 us in the place of 6
assert "step/newton" in printed and "+33.3 % **slow**" in printed and "walk/sand_loose_newton" in printed, printed
assert "+100.0 % **slow**" in printed and printed.count("**slow**") == 3, printed  # half the rate, and the ratio of the step
assert "**slow**" not in run("history", "--file", lines, "--slow", 1.1)
assert len(lines.read_text().splitlines()) == 2 and json.loads(lines.read_text().splitlines()[0])["values"]["step/newton"] == 6
dirty = work / "dirty"
run("run", dirty, "--rounds", 1, "--only", "step", "--mild", made, "--python", peers, DIRTY=".dirty", **no_gpu)
one_line("in no commit", "add", dirty, "--file", lines)

# ---- mistakes ----
one_line("choose another folder", "run", out, "--mild", made)
one_line("nosuch", "run", work / "new", "--only", "nosuch", "--mild", made)
one_line("nosuch", "run", work / "new", "--mild", work / "nosuch")
one_line("no record.json", "check", work / "new")
one_line("has no record", "history", "--file", work / "none")
one_line("mild bench record out/record", "run")
one_line("--rounds 0", work / "new", "--rounds", 0)
one_line("--wrong", work / "new", "--wrong")
one_line("No such file", "add", fast, "--file", work / "none/history.jsonl")
for torn in ("{", "7", '{"values": {}}'):
    (work / "torn.jsonl").write_text(lines.read_text() + torn + "\n")
    one_line("torn.jsonl, line 3", "history", "--file", work / "torn.jsonl")
    one_line("torn.jsonl, line 3", "add", dirty, "--dirty", "--file", work / "torn.jsonl")
if (root / "lab/bench/record.jsonl").exists():  # ours can be read
    history = subprocess.run([sys.executable, record, "history"], capture_output=True, text=True, check=False)
    assert history.returncode in (0, 1) and not history.stderr and "| step/newton |" in history.stdout, history

# ---- the real program ----
real = work / "real"
run(real, "--rounds", 1, "--only", "step,walk,batch", MILD=str(mild))  # as `mild bench record` sets it
fits(real)
run("check", real)
values = {row["id"]: row["value"] for row in read(real)["rows"]}
ratios = {ratio["over"]: ratio["value"] for ratio in read(real)["ratios"]}
for bench, ground in (("step", ""), ("walk", "sand_loose_"), ("walk", "grass_")):  # the program's own quotient
    assert abs(ratios[f"{bench}/{ground}newton"] / values[f"{bench}/{ground}ratio_to_rigid"] - 1) < 1e-9
shutil.rmtree(work)
print("records of speed: all as expected")
