#!/usr/bin/env python3
"""scripts/rivals/samples.py with a made-up Python and a made-up mild in place of both: what is trained and judged, what a restart does
again, and what the table says. Usage: test_samples.py SOURCE_FOLDER"""
import json
import os
import pathlib
import stat
import subprocess
import sys
import tempfile

root = pathlib.Path(sys.argv[1]).resolve()
TRAINER = """#!{python}
import json, pathlib, sys
words = dict(zip(sys.argv[2::2], sys.argv[3::2]))
out, off = pathlib.Path(words["--out"]), "offpolicy" in sys.argv[1]
with open({calls!r}, "a") as file:
    file.write(" ".join(sys.argv[1:]).replace(sys.argv[1], pathlib.Path(sys.argv[1]).name) + "\\n")
if off and "--eager" not in sys.argv:
    sys.exit("graphs fail here")
seed = int(words["--seed"])
saved = [{{"name": name, "seconds": seconds + seed, "steps": 2e6 * seed, "reward": 10.0 + seed}}
         for name, seconds in ((("at10", 10), ("last", 60)) if off else (("last", 20),))]
for row in saved:
    (out / (row["name"] + ".safetensors")).write_text(f"{{out.name}}/{{row['name']}}")
(out / "saved.json").write_text(json.dumps(saved))
"""
# falls once after 10 s; slow on sand with 130 iterations
JUDGE = """#!{python}
import json, pathlib, sys
words = dict(zip(sys.argv[2::2], sys.argv[3::2]))
what = pathlib.Path(words["--policy"]).read_text()
rows = [{{"ground": ground, "trials": 10, "success": 9 if "at10" in what and ground == "rigid" else 10, "cot": 0.5, "success_ci": [0, 1],
         "velocity": None if "at10" in what else 0.56 if ground == "sand_loose" and "-130-" in what else 0.62}} for ground in words["--ground"].split(",")]
print(json.dumps({{"rows": rows}}))
"""

with tempfile.TemporaryDirectory() as work:
    work = pathlib.Path(work)
    calls = work / "calls"
    for name, text in (("python", TRAINER), ("mild", JUDGE)):
        (work / name).write_text(text.format(python=sys.executable, calls=str(calls)))
        (work / name).chmod(0o755 | stat.S_IXUSR)

    def run(*words, code=0):
        done = subprocess.run([sys.executable, root / "scripts/rivals/samples.py", work / "out", "--python", work / "python", *words], capture_output=True,
                              text=True, env={**os.environ, "MILD": str(work / "mild")}, check=False)
        assert done.returncode == code, (done.returncode, done.stderr)
        return done

    def lines():
        found = calls.read_text().splitlines() if calls.exists() else []
        calls.unlink(missing_ok=True)
        return found

    assert run("--judge", code=2).stderr == f"samples.py: {work / 'out'}: no results.jsonl\n"
    assert "--only ppg: choose from ppo adam" in run("--only", "ppg", code=2).stderr
    assert "--seeds 1,x: whole numbers" in run("--seeds", "1,x", code=2).stderr
    run("--only", "ppo,td3", "--seeds", "1,2", "--devices", "cuda:0", "--train", "--", "--envs", "64")
    found = lines()
    assert len(found) == 4 + 3, found  # two lengths; FastTD3 the first time again without graphs, then at once
    assert sum("--iterations 130" in line for line in found) == sum("--iterations 260" in line for line in found) == 2
    assert sum("--until 60.0 --snapshots 20,40" in line for line in found) == 3 and sum("--eager" in line for line in found) == 2, found
    assert all("--envs 64" in line and "--device cuda:0" in line for line in found)
    assert "0 of 0" in run("--report").stdout
    with open(work / "out/results.jsonl", "a") as file:
        file.write('{"done": "trai')  # killed
    said = run("--only", "ppo,symmetric", "--seeds", "1,2", "--lengths", "130").stdout
    found = lines()
    assert len(found) == 2 and all("--symmetric" in line for line in found), found  # what is trained is not trained again
    table = [line for line in said.splitlines() if line.startswith("| ")]
    assert "| PPO: Muon, mirror loss on 0.25 (`ppo`) | 130 iterations | 3.0 | 21.5 | 11.50 | 0 of 2 | 60 of 60 | 0.62 0.62 | 0.62 0.62 | 0.56 0.56 |" in table, said
    assert "| PPO: Muon, mirror loss on 0.25 (`ppo`) | 260 iterations | 3.0 | 21.5 | 11.50 | 2 of 2 | 60 of 60 | 0.62 0.62 | 0.62 0.62 | 0.62 0.62 |" in table, said
    assert "| FastTD3 (`td3`) | 12 s | 3.0 | 11.5 | 11.50 | 0 of 2 | 58 of 60 | - - | - - | - - |" in table, said
    assert "| FastTD3 (`td3`) | 62 s | 3.0 | 61.5 | 11.50 | 2 of 2 | 60 of 60 | 0.62 0.62 | 0.62 0.62 | 0.62 0.62 |" in table, said
    rows = json.loads((work / "out/results.json").read_text())["rows"]
    assert [(row["arm"], row["length"], row["name"]) for row in rows] == [("ppo", 130, "last"), ("ppo", 260, "last"), ("symmetric", 130, "last"),
                                                                        ("td3", 60.0, "at10"), ("td3", 60.0, "last")], rows
    (work / "mild").write_text(f"#!{sys.executable}\nimport sys\nsys.exit('no ground')\n")
    said = run("--only", "vtrace", "--seeds", "1", "--lengths", "130")
    assert "vtrace-130-1/last: no ground" in said.stderr and "0 of 0" in said.stdout
    (work / "mild").write_text(JUDGE.format(python=sys.executable))
    lines()
    assert "(`vtrace`) | 130 iterations | 2.0 | 21.0 | 11.00 | 0 of 1 |" in run("--judge").stdout and not lines()
    assert "1 trainings are left" in run("--only", "vtrace", "--seeds", "2", "--lengths", "130", "--limit", "0", code=1).stderr
    (work / "python").write_text(f"#!{sys.executable}\nimport sys\nsys.exit('no memory')\n")
    assert "vtrace-130-3: 1: no memory" in run("--only", "vtrace", "--seeds", "3", "--lengths", "130").stderr
print("samples.py: trained, judged, gone on")
