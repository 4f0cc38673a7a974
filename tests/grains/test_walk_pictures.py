"""The rows of grains/walk.py: a walk's stances and what became of it, from files made by hand. test_walk_pictures.py SOURCE"""
import json
import pathlib
import sys
import tempfile

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(sys.argv[1]) / "grains"))
import walk_pictures  # noqa: E402

COLUMNS = "trial,foot,time_s,ankle_x_m,ankle_y_m,pitch_rad,force_x_n,force_y_n,force_z_n,center_x_m,depth_m"
ROW = {"trials": 10, "success": 7, "ends": {"time": 7, "tilt": 3}, "seconds": 8.5, "velocity": 0.41, "cot": 0.92, "penetration": 0.1,
       "torque_max": 70.0, "clearance": 0.2}


def feet(file):
    """One stance of 0.5 s that begins at 2 s, a touch of 20 ms, and a stance before the first second, which is left out."""
    lines = [COLUMNS]
    for k in range(400):
        time = 0.01 * k
        loaded = 0.2 <= time < 0.6 or 1.995 <= time < 2.495 or 3.0 <= time < 3.015
        lines.append(f"0,1,{time:.2f},{0.001 * k},0,{0.1 if k == 210 else 0},3,4,{300 if loaded else 0},0.05,{0.08 if loaded else 0}")
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

    told = {"time_s": 7.0, "lost_sole_s": 1.8, "seconds": 190.0, "steps": 5, "late_lists": 3, "full_lists": 0, "surface_m": [0.2], "trial": 0}
    (grains / "walk-0.json").write_text(json.dumps(told))  # was killed: no eval.json
    (model / "eval.json").write_text(json.dumps({"rows": [ROW]}))
    walk_pictures.write_walks(out, ["sand"], ["0.6"], out / "walks.json")
    walks = json.loads((out / "walks.json").read_text())
    told.pop("trial")
    kept = {key: value for key, value in ROW.items() if key != "clearance"}
    where = {"family": "sand", "speed_m_s": 0.6}
    assert walks == [{**where, "ground": "grains", "grains": told}, {**where, "ground": "mild", **kept}], walks
print("one stance, two walks")
