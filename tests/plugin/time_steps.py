"""plugin_walk.py --time by a clock that only mj_step moves: with the plugin by 3 us a step, on MuJoCo's own floor by 2, without any ground
by 1. Each case begins a period where the walk did. Usage: time_steps.py SOURCE_FOLDER, with MILD_PLUGIN"""
import json
import pathlib
import sys
import tempfile
import types

import mujoco
import numpy as np

sys.path.insert(0, str(pathlib.Path(sys.argv[1]) / "scripts"))
import plugin_walk  # noqa: E402

now, seen, real_step = 0.0, {1: [], 2: [], 3: []}, mujoco.mj_step


def step(model, data, count):
    """Keeps what each period begins with, by the model's price."""
    global now
    price = 3 if model.nplugin else 2 if np.any(model.geom_contype) else 1
    seen[price].append(data.qpos.copy())
    real_step(model, data, count)
    now += 1e-6 * price * count


mujoco.mj_step = step
plugin_walk.time = types.SimpleNamespace(thread_time=lambda: now)
periods = plugin_walk.TIMED = 210
plugin_walk.REPEATS = 2
with tempfile.TemporaryDirectory() as folder:
    out = pathlib.Path(folder, "rows.json")
    sys.argv = ["plugin_walk.py", "sa01", "--ground", "sand_loose", "--step", "0.0025", "--speed", "0.6", "--time", "--json", str(out)]
    plugin_walk.main()
    rows = {row["case"]: row["value"] for row in json.loads(out.read_text())["rows"]}
assert set(rows) == {"sand_loose", "rigid", "air"}, rows
for case, us in (("sand_loose", 3), ("rigid", 2), ("air", 1)):
    assert abs(rows[case] - us) < 1e-9, rows
walked = {price: seen[price][:periods] for price in (2, 3)}  # the walks come first
for price, again in ((3, seen[3][periods:]), (2, seen[2][periods:]), (1, seen[1])):
    places = walked[2 if price == 2 else 3] * 2
    assert len(again) == len(places) and all(map(np.array_equal, again, places)), price
assert not np.array_equal(walked[2][30], walked[3][30])  # each ground has its own walk
assert np.ptp([place[0] for place in walked[3]]) > 0.05  # it walks
