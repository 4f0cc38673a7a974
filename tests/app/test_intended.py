#!/usr/bin/env python3
"""scripts/paper/intended.py finds the smallest set that walks, for a made-up judge in place of trainings.
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

path = pathlib.Path(sys.argv[1]) / "scripts/paper/intended.py"
spec = importlib.util.spec_from_file_location("intended", path)
intended = importlib.util.module_from_spec(spec)
spec.loader.exec_module(intended)


class Judged(intended.Search):
    """Walks when every group of `needs` has one of its sentences among ours."""

    def train(self, ours):
        return {"ours": sorted(ours), "seed": self.seed, "upright": 1.0, "gap": 0.0,
                "walks": all(set(ours) & set(any_of) for any_of in self.needs)}


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
