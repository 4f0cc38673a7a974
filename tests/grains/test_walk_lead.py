"""grains/walk.py lead: the feet of a walk on mild_merged, led through mild_merged, find about the forces of that walk, up and
forward; through ground of twice its strength they find more. test_walk_lead.py SOURCE MILD"""
import contextlib
import io
import json
import pathlib
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
SOURCE, MILD = pathlib.Path(sys.argv[1]), sys.argv[2]
sys.path.insert(0, str(SOURCE / "grains"))
import walk  # noqa: E402
import walk_lead  # noqa: E402

NUMBERS = json.loads(walk.GROUNDS.read_text())["sand"]["mild_merged"]


def forces(folder, numbers):
    """Force up of the walk and of the model, and forward of both, in each window."""
    told = io.StringIO()
    with contextlib.redirect_stdout(told):
        walk_lead.compare(folder, SOURCE / "robots" / "sa01" / "robot.ini", numbers, "mild_merged")
    rows = [line.split("ms", 1)[1].split() for line in told.getvalue().splitlines() if " ms " in line]
    return [[float(word) for word in row[:4]] for row in rows]


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    (folder / "grains").mkdir()
    subprocess.run([MILD, "eval", "--policy", SOURCE / "policies" / "sand.safetensors", "--speed", "0.6", "--trials", "1", "--seconds", "3", "--task.physics_dt",
                    "0.0005", "--feet", folder / "grains" / "feet.csv", *walk.ground_of("sand", "mild_merged")], check=True, stdout=subprocess.DEVNULL)
    same, stiff = forces(folder, NUMBERS), forces(folder, {**NUMBERS, **{key: str(2 * float(NUMBERS[key])) for key in ("k_pen", "sigma_cone")}})
    print("force up of the walk, led, forward of the walk, led; up, led through twice the strength:", [(*a, b[1]) for a, b in zip(same, stiff)])
    assert len(same) == len(walk_lead.WINDOWS)
    assert all(0.75 < led / walked < 1.25 for walked, led, _, _ in same)
    assert same[0][2] < -50 and all(abs(led - walked) < 0.3 * abs(walked) + 15 for _, _, walked, led in same)
    assert all(b[1] > 1.3 * a[1] for a, b in zip(same[1:], stiff[1:]))
