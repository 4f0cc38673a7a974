#!/usr/bin/env python3
"""lab/paper/elements.py with a made-up mild: each training is made once, on its device and with its elements, and judged without them; what
is there is kept, a training that is too slow is given up, one that fails is named, and the table has means over the seeds.
Usage: test_elements.py SOURCE_FOLDER"""
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

work = pathlib.Path(tempfile.mkdtemp())
calls, out = work / "calls", work / "runs"

# As many trials stay up as its seed says, and the speed is off by a hundredth for each seed.
MILD = '''#!/usr/bin/env python3
import json, os, pathlib, re, sys, time
words = sys.argv[1:]
value = lambda key: words[words.index(key) + 1]
key = lambda name: next((word.split("=", 1)[1] for word in words if word.startswith(f"--{name}=")), "-")
with open(os.environ["CALLS"], "a") as log:
    log.write(" ".join([words[0], key("train.device"), key("task.sole_elements"), key("train.seed"), key("ppo.anneal")]) + "\\n")
if words[0] == "train":
    if os.environ.get("BROKEN") == key("task.sole_elements"):
        sys.exit("no memory")
    time.sleep(float(os.environ.get("SLOW", 0)))
    folder = pathlib.Path(value("--out"))
    folder.mkdir(parents=True)
    (folder / "policy.safetensors").write_text(key("train.seed"))
    (folder / "log.csv").write_text("rate/steps_per_s\\n1\\n2000\\n3000\\n")
else:
    seed = int(open(value("--policy")).read())
    row = {"speed": 0.6, "velocity": 0.6 + 0.01 * seed, "cot": 0.4, "clearance": 0.1, "torque_max": 50, "trials": 10, "success": 6 + seed}
    open(value("--json"), "w").write(json.dumps({"rows": [row]}))
'''
program(work, "mild", MILD)
common = {**os.environ, "MILD": str(work / "mild"), "CALLS": str(calls), "PYTHONDONTWRITEBYTECODE": "1"}


def run(*words, code=0, **variables):
    done = subprocess.run([sys.executable, root / "lab/paper/elements.py", out, "--elements", "77,10", *words], capture_output=True, text=True,
                          check=False, env={**common, **variables})
    assert done.returncode == code, (done.returncode, words, done.stdout, done.stderr)
    return done.stdout + done.stderr


def made():
    lines = calls.read_text().splitlines() if calls.exists() else []
    calls.unlink(missing_ok=True)
    return lines


# ---- each once, on two devices; a judge knows no elements ----
said = run("--seeds", "2", "--devices", "cuda:0,cuda:1", "--train")
lines = made()
assert sorted(re.sub(r"cuda:[01]", "cuda", line) for line in lines) == [f"train cuda {n} {seed} 280 400" for n in (10, 77) for seed in (1, 2)], lines
assert {line.split()[1] for line in lines} == {"cuda:0", "cuda:1"} and "4 of 4 trainings left" in said and "2.0 k policy steps/s" in said
assert "| **77** | 2 | 2.0 (2.0 to 2.0) | 15 of 20 | 0.015 (0.010 to 0.020) | 0.40 (0.40 to 0.40) |" in run("--seeds", "2", "--judge")
assert made() == ["eval cpu - - -"] * 4

# ---- again: nothing; after a loss: that one; options go to the trainings ----
run("--seeds", "2")
assert made() == []
(out / "10-2.safetensors").unlink()
run("--seeds", "2", "--devices", "cpu", "--", "--ppo.anneal=1 2")
assert [line.split()[0] for line in made()] == ["train", "eval"]  # the judge of the lost one is not that of the new one

# ---- one that is too slow is given up, one that fails is named; the next start makes them ----
said = run("--seeds", "3", "--seconds", "0.5", "--train", code=1, SLOW="9")
assert "77-3: given up" in said and not (out / "77-3.safetensors").exists() and "10-3" not in said, said
said = run("--seeds", "3", "--train", code=1, BROKEN="10")
assert "10-3: no memory" in said and (out / "77-3.safetensors").exists(), said
run("--seeds", "3")
assert len(json.loads((out / "10-3.json").read_text())["rows"]) == 1
shutil.rmtree(work)
print("trainings on few elements: all as expected")
