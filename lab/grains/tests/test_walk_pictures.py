"""The rows of lab/grains/walk.py: a walk's stances and what became of it, from files made by hand, and what
it was made by. test_walk_pictures.py SOURCE"""
import hashlib
import json
import pathlib
import sys
import tempfile
import types

SOURCE = pathlib.Path(sys.argv[1]).resolve()
sys.dont_write_bytecode = True
sys.path.insert(0, str(SOURCE / "lab/grains"))
import walk  # noqa: E402
import walk_pictures  # noqa: E402

COLUMNS = "trial,foot,time_s,ankle_x_m,ankle_y_m,pitch_rad,force_x_n,force_y_n,force_z_n,center_x_m,depth_m"
ROW = {"trials": 10, "success": 7, "ends": {"time": 7, "tilt": 3}, "seconds": 8.5, "velocity": 0.41, "cot": 0.92, "penetration": 0.1,
       "torque_max": 70.0, "clearance": 0.2}


def feet(file, rows=1):
    """One stance of 0.5 s that begins at 2 s, a touch of 20 ms, and a stance before the first second, which is left out. rows: in
    a policy step; forces swing about their mean, the ankle is there as the step ends, and is deepest before."""
    lines = [COLUMNS]
    for k in range(400):
        time = 0.01 * k
        loaded = 0.2 <= time < 0.6 or 1.995 <= time < 2.495 or 3.0 <= time < 3.015
        for i in range(1, rows + 1):
            swing, at = 2 * (i - 0.5 * (rows + 1)), k if i == rows else k - 0.4
            lines.append(f"0,1,{0.01 * (k - 1 + i / rows):.4f},{0.001 * at},0,{0.1 if k == 210 else 0},{3 + swing},4,{300 + swing if loaded else 0},0.05,"
                         f"{(0.08 if i == 1 else 0.07) if loaded else 0}")
    file.write_text("\n".join(lines) + "\n")


with tempfile.TemporaryDirectory() as name:
    out = pathlib.Path(name)
    grains, model = (out / "sand" / "0.6" / ground for ground in ("grains", "mild"))
    grains.mkdir(parents=True)
    model.mkdir()
    feet(grains / "feet.csv")
    found = walk_pictures.stances(grains / "feet.csv")
    assert len(found) == 1, found
    row = found[0].row()
    assert row == {"trial": 0, "foot": 1, "start_s": "2.00", "duration_s": "0.50", "force_max_n": "300.0", "force_mean_n": "300.0",
                   "horizontal_max_n": "5.0", "depth_max_m": "0.0800", "center_x_m": "0.0500", "center_x_first_m": "0.0500",
                   "center_x_last_m": "0.0500", "ankle_way_m": "0.0490", "pitch_min_rad": "0.000", "pitch_max_rad": "0.100"}, row
    feet(grains / "feet.csv", 4)
    found = walk_pictures.stances(grains / "feet.csv")
    assert len(found) == 1 and found[0].row() == row, found[0].row()
    feet(grains / "feet.csv")

    report = {"time_s": 7.0, "lost_sole_s": 1.8, "seconds": 190.0, "steps": 5, "late_lists": 3, "full_lists": 0, "surface_m": [0.2], "trial": 0}
    (grains / "walk-0.json").write_text(json.dumps(report))  # was killed: no eval.json
    (model / "eval.json").write_text(json.dumps({"rows": [ROW]}))
    walk_pictures.write_walks(out, ["sand"], ["0.6"], out / "walks.json")
    walks = json.loads((out / "walks.json").read_text())
    report.pop("trial")
    kept = {key: value for key, value in ROW.items() if key != "clearance"}
    where = {"family": "sand", "speed_m_s": 0.6}
    assert walks == [{**where, "ground": "grains", "grains": report}, {**where, "ground": "mild", **kept}], walks

    # what a walk was made by, from a program that stands in for mild
    stub = out / "mild"
    stub.write_text("#!/bin/sh\nfor last; do :; done\necho '%s' >$last\n" % json.dumps({"rows": [{**ROW, "ends": {}}]}))
    stub.chmod(0o755)
    policy = SOURCE / "lab/grains" / "walk" / "sand.safetensors"
    args = types.SimpleNamespace(mild=stub, policy=policy, seconds=1, seed=7, bed_seed=11, dt=0.0005, threads=1, robot="sa01", jump=0)
    for ground, program in (("mild", None), ("grains", ["grains", "--seeds", 11])):
        folder = out / "rolling" / "0.6" / ground
        walk.walk(args, folder, "0.6", ["--ground", "grass"], 1, "sa01", program)
    walk_pictures.write_walks(out, ["rolling"], ["0.6"], out / "walks.json")
    on_grains, on_mild = (row["made"] for row in json.loads((out / "walks.json").read_text()))
    assert on_grains["bed_seed"] == 11 and on_mild["bed_seed"] is None and on_mild["seed"] == 7
    assert on_mild["policy"] == "lab/grains/walk/sand.safetensors" and on_mild["policy_sha256"] == hashlib.sha256(policy.read_bytes()).hexdigest()
    assert on_mild["command"][1:6] == ["eval", "--robot", "sa01", "--policy", "lab/grains/walk/sand.safetensors"], on_mild["command"]
    assert "grains --seeds 11" in on_grains["command"]

# the walks of the repository, which were made before: the manifest names each
manifest = json.loads((SOURCE / "lab/grains" / "walk" / "manifest.json").read_text())
for file in sorted((SOURCE / "lab/grains" / "walk").glob("walks-*.json")):
    if all("made" in row for row in json.loads(file.read_text())):
        continue  # each says itself what made it
    report = manifest[file.name]
    where = {(row["family"], row["speed_m_s"], row["ground"]) for row in report["walks"]}
    walks = [row for row in json.loads(file.read_text()) if "made" not in row]
    assert {(row["family"], row["speed_m_s"], row["ground"]) for row in walks} <= where, file
    assert all(row["command"] or "command" in row["not_recorded"] for row in report["walks"])
    assert len(report["policy_sha256"]) == 64  # of a file that may be another one by now
print("one stance, two walks")
