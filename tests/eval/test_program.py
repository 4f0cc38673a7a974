"""`mild eval --program` with a program that answers with libmild's own ground: the walk is that of `mild eval`, number by number.
test_program.py MILD GROUND_PROGRAM

Both are equal to the last digit that is written: questions and answers are the doubles of the one program, and the other makes the
same numbers of them. Shells do not stand on a program's ground, so they do not here."""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

MILD, PROGRAM = sys.argv[1:3]
GROUND = "sand_loose"


def walk(folder, name, *options):
    files = {kind: folder / f"{name}-{kind}.csv" for kind in ("feet", "track", "stances")}
    words = [MILD, "eval", "--ground", GROUND, "--speed", "0.6", "--trials", "2", "--seconds", "3", "--seed", "4", *options,
             "--task.shells_stand=false", "--json", folder / f"{name}.json"]
    for kind, file in files.items():
        words += [f"--{kind}", file]
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads((folder / f"{name}.json").read_text())["rows"][0], {kind: file.read_text() for kind, file in files.items()}


def refuses(names, *options):
    done = subprocess.run([MILD, "eval", "--trials", "1", "--seconds", "0.1", *options], capture_output=True, text=True)
    named = all(re.search(rf"(?<![\w.-]){re.escape(name)}(?![\w]|[.-]\w)", done.stderr) for name in names.split())
    assert done.returncode == 2 and named and done.stderr.count("\n") == 1, (options, done.returncode, done.stderr)


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    own, own_files = walk(folder, "own")
    other, other_files = walk(folder, "other", "--program", f"{PROGRAM} sa01 {GROUND}")
    wrong, wrong_files = walk(folder, "wrong", "--program", f"{PROGRAM} sa01 {GROUND} turned")
    print(f"own {own['success']}/{own['trials']} {own['velocity']:.6f} m/s cost {own['cot']:.6f}; by the program "
          f"{other['success']}/{other['trials']} {other['velocity']:.6f} m/s cost {other['cot']:.6f}; with the moments about y turned "
          f"{wrong['success']}/{wrong['trials']}")
    assert own["success"] == own["trials"] == 2 and abs(own["velocity"] - 0.6) < 0.1
    for kind, text in own_files.items():
        assert text == other_files[kind], f"--{kind}: the walks differ"
        assert text != wrong_files[kind], f"--{kind}: does not see a moment"
    assert own == other and own != wrong
    # mistakes
    refuses("--program trial 0 failed", "--ground", GROUND, "--program", "exit 3")
    refuses("--program trial 0 ended", "--ground", GROUND, "--program", "true")
    refuses("--ground rigid --program", "--ground", "rigid", "--program", "true")
    refuses("--program", "--ground", GROUND, "--program", "true", "--train.robots=batch")
    refuses("/dev/full", "--ground", GROUND, "--feet", "/dev/full")
print("a program's ground is felt as the ground of mild eval")
