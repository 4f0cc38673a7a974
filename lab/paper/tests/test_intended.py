#!/usr/bin/env python3
"""lab/paper/intended.py finds the smallest set that walks, for a made-up judge in place of trainings.
Usage: test_intended.py SOURCE_FOLDER"""
import importlib.util
import io
import itertools
import json
import pathlib
import random
import sys
import tempfile
from contextlib import redirect_stdout

path = pathlib.Path(sys.argv[1]) / "lab/paper/intended.py"
spec = importlib.util.spec_from_file_location("intended", path)
intended = importlib.util.module_from_spec(spec)
spec.loader.exec_module(intended)


class Judged(intended.Search):
    """Walks when every group of `needs` has one of its sentences among ours."""

    def train(self, ours, gpu):
        return {"ours": sorted(ours), "seed": self.seed, "upright": 1.0, "gap": 0.0,
                "walks": all(set(ours) & set(any_of) for any_of in self.needs)}


PROGRAM = """#!{python}
import json, os, sys
if sys.argv[1] == "eval":
    gap = 0.05 if "--task.clock=true" in open(sys.argv[3]).read() else 0.15
    row = dict(trials=10, success=9, velocity=0.3 - gap, speed=0.3)
    json.dump(dict(rows=[row, dict(row, velocity=None)]), open(sys.argv[-1], "w"))
else:
    os.mkdir(sys.argv[5])
    open(sys.argv[5] + "/policy.safetensors", "w").write(" ".join(sys.argv))
open({log!r}, "a").write(os.environ["CUDA_VISIBLE_DEVICES"] + " " + sys.argv[1] + "\\n")
"""


def trainings_share_the_gpus(folder):
    """A program in the place of mild: four trainings, two at a time, on GPUs 2 and 5; options and evaluation as they are meant."""
    program = pathlib.Path(folder) / "mild"
    program.write_text(PROGRAM.format(python=sys.executable, log=folder + "/log"))
    program.chmod(0o755)
    intended.MILD = str(program)
    search = intended.Search(folder, 2, 1e9, 1, ("2", "5"))
    names = list(search.all)
    assert search.walk([names, [], names[1:], ["the clock is observed"]]) == [True, False, True, True]
    tests = json.loads(search.file.read_text())
    assert [round(search.known(s)["gap"], 9) for s in (names, [])] == [0.05, 0.15] and tests[0]["upright"] == 0.9
    used = pathlib.Path(folder, "log").read_text().split("\n")
    assert all(used.count(f"{gpu} {what}") >= 1 for gpu in "25" for what in ("train", "eval")) and len(used) == 9


def judged(folder, needs, seconds=1e9):
    search = Judged(folder, 3, seconds, 1)
    search.needs = needs
    return search


def main():
    names = sorted(intended.sentences())
    assert len(names) > 20 and "the clock is observed" in names
    assert not any(key.startswith(intended.COMMON) for keys in intended.sentences().values() for key in keys)
    known = intended.read_keys(path.parents[2] / "configs/default.ini")
    assert all(key in known for keys in intended.SENTENCES.values() for key in keys)
    printed, meant = (intended.read_keys(path.parents[2] / "configs" / name) for name in ("paper.ini", "paper_intended.ini"))
    assert {key for key in {*printed, *meant} if printed.get(key) != meant.get(key)} == {"reward.feet_clearance"}
    assert float(meant["reward.feet_clearance"]) == -float(printed["reward.feet_clearance"])
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(io.StringIO()):
        trainings_share_the_gpus(folder)
    draw = random.Random(5)
    most = 0
    for size in itertools.chain(range(0, 9), [len(names)]):
        needs = [[name] for name in draw.sample(names, size)]
        if size in (3, 6):  # either of two serves
            needs[0].append(next(name for name in names if [name] not in needs))
        with tempfile.TemporaryDirectory() as folder, redirect_stdout(io.StringIO()):
            search = judged(folder, needs)
            needed, minimal = search.reduce()
            assert minimal and len(needed) == size, (needed, needs)
            assert all(set(needed) & set(any_of) for any_of in needs)
            most = max(most, len(search.tests))
            assert json.loads(search.file.read_text()) == search.tests
            search.file.write_text(json.dumps([{**t, "keys": "others"} for t in search.tests]))
            assert judged(folder, needs).known(names) is None  # trained with other keys
            search.file.write_text(json.dumps(search.tests))
            again = judged(folder, needs)  # everything is known: nothing is trained
            again.train = None
            assert again.reduce() == (needed, minimal)
        with tempfile.TemporaryDirectory() as folder, redirect_stdout(io.StringIO()):
            search = judged(folder, needs, -1.0)
            assert size == 0 or not search.reduce()[1]
    print(f"{len(names)} sentences, at most {most} trainings")


main()
