#!/usr/bin/env python3
"""lab/paper/factorial.py with a made-up trainer and judge in place of both: what is trained, with which choice, what a restart does
again, and what the table says. Usage: test_factorial.py SOURCE_FOLDER"""
import io
import json
import pathlib
import sys
import tempfile
import threading
import time
from contextlib import redirect_stderr, redirect_stdout

root = pathlib.Path(sys.argv[1]).resolve()
sys.dont_write_bytecode = True
sys.path.insert(0, str(root / "lab/paper"))
import factorial  # noqa: E402

NETS = {"mlp": 0.1, "clock": 0.2, "ht2": 0.3, "flat": 0.4, "ours": 0.5}
BEST = {"mlp": 0, "clock": 1, "ht2": 2, "flat": 3, "ours": 0}


class MadeUp(factorial.Factorial):
    """The skill is that of the net, plus what the ground gives; in the search it is best with BEST. Nobody of HT-2 and Clock stays up
    after the search: those of BEST fall last."""

    grounds, broken, pause = {"rigid": 0.0, "ecc_spring": 0.1, "mild": 0.2}, None, 0.0

    def __init__(self, given):
        super().__init__(given)
        self.calls, self.busy, self.most, self.guard = [], {}, {}, threading.Lock()

    def train(self, task, device):
        with self.guard:
            self.calls.append(task)
            self.busy[device] = self.busy.get(device, 0) + 1
            self.most[device] = max(self.most.get(device, 0), self.busy[device])
        time.sleep(self.pause)
        with self.guard:
            self.busy[device] -= 1
        if self.broken and all(task[key] == value for key, value in self.broken.items()):
            raise RuntimeError("no memory")
        self.policy_of(task).parent.mkdir(parents=True, exist_ok=True)
        self.policy_of(task).write_text(f"{self.folder.name} {task}")
        return {"seconds": 2.0, "steps": 3e6, "device": device}

    def judge(self, task):
        def cells(skill, upright=10, lasted=1.0):
            return [{"ground": "rigid", "speed": v, "trials": 10, "upright": upright, "cot": 0.5, "error": v * (skill - 1) if upright else None,
                     "torque": 60.0, "lasted": lasted} for v in factorial.SPEEDS]
        assert self.policy_of(task).is_file(), task
        if task["kind"] == "tune":
            best = task["choice"] == BEST[task["controller"]]
            return {"tuning": cells(0, 0, 0.3 if best else 0.2) if task["controller"] in ("clock", "ht2") else cells(0.9 if best else 0.3)}
        return {part: cells(NETS[task["controller"]] + self.grounds[task["ground"]]) for part in factorial.PARTS}


def made(folder, *words, kind=MadeUp):
    return kind(factorial.parse([str(folder), *words]))


def quietly(work):
    with redirect_stdout(io.StringIO()) as printed, redirect_stderr(io.StringIO()) as wrong:
        found = work()
    return found, printed.getvalue(), wrong.getvalue()


def measures():
    cell = {"speed": -0.5, "trials": 4, "upright": 2, "error": 0.1}
    assert abs(factorial.skill([cell]) - 0.5 * 0.8) < 1e-12
    assert factorial.skill([{**cell, "error": 0.5}]) == 0 and factorial.skill([{**cell, "error": -0.7}]) == 0
    assert factorial.skill([{**cell, "error": None}, {**cell, "upright": 4, "error": 0}]) == 0.5
    assert abs(factorial.score([{**cell, "lasted": 0.6}, {**cell, "lasted": 1.0}]) - (0.4 + 0.8) / 2) < 1e-12
    each = [{"seconds": s} for s in (5, 20.001, 0)]
    row = {"ground": "rigid", "speed": 1, "trials": 3, "success": 1, "cot": None, "velocity": None, "torque_max": 1.0, "each": each}
    assert abs(factorial.cell_of(row)["lasted"] - 1.25 / 3) < 1e-12
    values = {(n, g, s): 1.0 * n + 2.0 * g for n in range(2) for g in range(2) for s in range(3)}
    found = factorial.shares(values)  # squares 0.25 of the net and 1 of the ground in each
    assert all(abs(found[k] - v) < 1e-12 for k, v in {"net": 0.2, "ground": 0.8, "both": 0, "seed": 0}.items()), found
    crossed = factorial.shares({(n, g, s): float(n == g) for n in range(2) for g in range(2) for s in range(2)})
    assert abs(crossed["both"] - 1) < 1e-12
    seeds = factorial.shares({(n, g, s): float(s) for n in range(2) for g in range(2) for s in range(2)})
    assert abs(seeds["seed"] - 1) < 1e-12
    assert factorial.whole_seeds(values) == [0, 1, 2]
    alone = factorial.shares_of({"a part": {("ours", g, 1): 1.0 * g for g in range(2)}}, [1])["a part"]
    assert abs(alone["ground"] - 1) < 1e-12 and "seed" not in alone, alone
    led = factorial.leads({("ours", "mild", 1): 0.5, ("ours", "mild", 2): 0.7, ("mlp", "mild", 1): 0.75, ("mlp", "mild", 3): 9, ("flat", "rigid", 1): 9})
    assert led == {("mlp", "mild"): [-0.25]}, led
    del values[1, 0, 1]
    assert factorial.whole_seeds(values) == [0, 2]
    assert len(factorial.PAIRS) == 9 and all(len({p.split(">")[i] for p in factorial.PAIRS}) == 9 for i in range(2))
    assert all(p in factorial.transitions.PAIRS for p in factorial.PAIRS)


def all_of_it():
    with tempfile.TemporaryDirectory() as folder:
        words = ("--devices", "cuda:0,cuda:1", "--jobs", "2", "--seeds", "3")
        search = made(folder, *words)
        search.pause = 0.01
        done, printed, wrong = quietly(search.run)
        assert done and not wrong and len(search.calls) == 5 * 4 + 5 * 3 * 3
        assert all(task["kind"] == "tune" for task in search.calls[:17])
        assert set(search.most) <= {"cuda:0", "cuda:1"} and max(search.most.values()) <= 2, search.most
        assert search.choices() == BEST
        assert all(task["choice"] == BEST[task["controller"]] for task in search.calls if task["kind"] == "train")
        assert printed.count("3.0 M steps in 2 s") == 65 and printed.count("; score 0.150") == 2 and printed.count("; score 0.950") == 3
        left = {path.name for path in (pathlib.Path(folder) / "policies").iterdir()}  # of the search none
        assert left == {search.policy_of(task).name for task in search.calls if task["kind"] == "train"} and len(left) == 45
        lines = [json.loads(text) for text in search.file.read_text().splitlines()]
        assert [x["done"] for x in lines].count("trained") == 65 == [x["done"] for x in lines].count("judged")

        # killed in the middle: three are not trained, another is not judged, and the last line is torn
        lost = [task for task in search.calls if task["kind"] == "train"][-4:]
        kept = [x for x in lines if x["task"] not in lost or (x["task"] == lost[0] and x["done"] == "trained")]
        torn = json.dumps({"done": "trained", "task": lost[1]})[:40]
        search.file.write_text("".join(json.dumps(x) + "\n" for x in kept) + torn)
        again = made(folder, *words)
        assert quietly(again.run)[0] and len(again.calls) == 3 and all(task in again.calls for task in lost[1:]), again.calls
        third = made(folder, *words)
        assert quietly(third.run)[0] and not third.calls
        lines = [json.loads(text) for text in third.file.read_text().splitlines() if text != torn]
        assert [x["done"] for x in lines].count("judged") == 65

        _, printed, _ = quietly(lambda: factorial.report(third))
        assert "| ours | mild | 3 | 3.0 | 2 | 0.700 (0.700 to 0.700) |" in printed, printed
        whole = 3 * 3 * sum((v - 0.3) ** 2 for v in NETS.values())
        share = whole / (whole + 5 * 3 * 2 * 0.01)
        assert f"nine grounds: of the variance of the skill the net makes {share:.0%}" in printed and "the seed 0%" in printed, printed
        soft = whole / 3 * 2 / (whole / 3 * 2 + 5 * 3 * 2 * 0.0025)  # the two soft grounds are 0.1 apart
        assert f"\nof those trained on soft ground alone:\nnine grounds: of the variance of the skill the net makes {soft:.0%}" in printed, printed
        assert "| transitions | mild | +0.400 (+0.400 to +0.400) | +0.300 (+0.300 to +0.300) | +0.200" in printed, printed
        _, fewer, _ = quietly(lambda: factorial.report(made(folder, *words, "--controllers", "clock,ours")))
        assert "| ours | mild | 3 |" in fewer and "| MLP |" not in fewer and "ours less Clock |\n" in fewer, fewer
        quietly(lambda: factorial.report(third))
        result = json.loads((pathlib.Path(folder) / "factorial.json").read_text())
        assert result["chosen"] == BEST and len(result["search"]) == 20 and len(result["rows"]) == 15
        last = result["table2"][-1]
        assert len(result["table2"]) == 15 and (last["controller"], last["ground"], last["walked"]) == ("ours", "mild", "rigid"), last
        assert abs(last["velocity"][3] - 0.7 * 1.2) < 1e-12 and (last["upright"], last["trials"]) == (120, 120), last

        # a policy that was lost before its judge is trained again
        kept = [x for x in lines if not (x["task"] == lost[0] and x["done"] == "judged")]
        third.file.write_text("".join(json.dumps(x) + "\n" for x in kept))
        third.policy_of(lost[0]).unlink()
        fourth = made(folder, *words)
        assert quietly(fourth.run)[0] and fourth.calls == [lost[0]], fourth.calls

        for more in (["--minutes", "1"], ["--jobs", "1"]):  # another budget: nothing of it counts
            assert not made(folder, *words, *more).lines

        # without a GPU: what is trained is judged, what is not is left
        kept = [x for x in lines if x["task"] not in lost[:2] or (x["task"] == lost[1] and x["done"] == "trained")]
        third.file.write_text("".join(json.dumps(x) + "\n" for x in kept))
        fifth = made(folder, *words, "--judge")
        done, printed, _ = quietly(fifth.run)
        assert not done and not fifth.calls and printed.count("M steps") == 1 and fifth.known("judged", lost[1]) and not fifth.known("judged", lost[0])


def what_stops():
    with tempfile.TemporaryDirectory() as folder:
        late = made(folder, "--seconds", "170")  # a training of the search takes 45 s; one of three minutes does not fit
        done, _, _ = quietly(late.run)
        assert not done and len(late.calls) == 20 and all(task["kind"] == "tune" for task in late.calls)
        unjudged = late.known("judged", late.calls[0])
        over = made(folder, "--seconds", "-1")
        over.lines.remove(unjudged)
        over.policy_of(late.calls[0]).write_text("trained")
        assert not quietly(over.run)[0] and not over.calls and not over.known("judged", late.calls[0])
        over.longest_judge, over.end = 60, time.time() + 30  # a judge would take longer than there is
        assert not quietly(over.run)[0] and not over.known("judged", late.calls[0])
        none = made(folder, "--seconds", "10")
        assert not quietly(none.run)[0] and not none.calls
        assert "nothing is judged yet" in quietly(lambda: factorial.report(none))[1]
        part = made(folder, "--controllers", "ours,clock", "--seeds", "1")
        part.broken = {"kind": "train", "controller": "clock", "ground": "mild"}
        done, _, wrong = quietly(part.run)
        assert not done and len(part.calls) == 6 and part.failed == ["clock on mild, seed 1: no memory"] and "no memory" in wrong
        assert "not before each net has all grounds" in quietly(lambda: factorial.report(part))[1]
        for words in (["--controllers", "cpg"], ["--steps", "1e8", "--controllers", "ht2"], ["--config", "nosuch.ini"]):
            try:
                _, _, wrong = quietly(lambda: made(folder, *words))
                raise AssertionError(words)
            except SystemExit as stopped:
                assert stopped.code == 2, stopped


def equal_steps():
    """Without HT-2, and with one number of robots for all: two choices each in the search."""
    with tempfile.TemporaryDirectory() as folder:
        whole = made(folder, "--steps", "1e8", "--seeds", "1")
        assert {robots for _, robots in whole.given.search} == {4096} and len(whole.given.search) == 2
        done, printed, wrong = quietly(whole.run)
        assert done and not wrong and len(whole.calls) == 4 * 2 + 4 * 3 and printed.count("4096 robots") == 20, printed
        assert not any(task["controller"] == "ht2" for task in whole.calls)
        timed = made(folder, "--seeds", "1")
        assert timed.given.search == factorial.SEARCH and not timed.lines  # of another budget nothing counts


def in_pieces():
    """Two machines, each with some controllers; a third puts both together, trains what is left, and reports."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for name, controllers in (("first", "mlp,clock"), ("second", "clock,ht2,flat")):
            assert quietly(made(folder / name, "--controllers", controllers).run)[0]
        both = ("--take", f"{folder / 'first'},{folder / 'second'}")
        whole = made(folder / "whole", *both)
        for piece in whole.given.take:
            whole.take(piece)
        lines = [json.loads(text) for text in whole.file.read_text().splitlines()]
        assert len(lines) == 2 * 4 * 13 == len({json.dumps([x["done"], x["task"]]) for x in lines})
        assert len(list((folder / "whole/policies").iterdir())) == 4 * 9
        clock = next(x["task"] for x in lines if x["task"]["controller"] == "clock" and x["task"]["kind"] == "train")
        assert whole.policy_of(clock).read_text().startswith("first ")  # who comes first
        assert quietly(whole.run)[0] and len(whole.calls) == 13 and {task["controller"] for task in whole.calls} == {"ours"}
        assert "of the variance of the skill" in quietly(lambda: factorial.report(whole))[1]
        other = made(folder / "other", "--minutes", "1")  # another budget: nothing of it counts
        other.take(folder / "first")
        assert not other.lines and not other.file.exists()
        _, _, wrong = quietly(lambda: stops(folder / "whole", "--take", str(folder)))
        assert "has no results.jsonl" in wrong


def stops(folder, *words):
    try:
        made(folder, *words)
        raise AssertionError(words)
    except SystemExit as stopped:
        assert stopped.code == 2, stopped


def shipped(folder, *words):
    """Of the budget and config that lab/paper/README.md names, and each skill is that of its cells."""
    found, name = factorial.Factorial(factorial.parse([str(root / folder), *words])), f"{folder}/results.jsonl"
    texts = found.file.read_text(encoding="utf-8").splitlines()
    assert texts and len(found.lines) == len(texts), f"{name}: lines of other settings than configs/factorial.ini and {words}"
    judged = [line for line in found.lines if line["done"] == "judged"]
    assert len({json.dumps(line["task"]) for line in judged}) == len(judged) == len(texts) / 2
    for line in judged:
        where = f"{name}: {line['task']}"
        assert found.known("trained", line["task"]), where
        assert line["skill"].keys() == line["cells"].keys(), where
        assert all(abs(factorial.skill(cells) - line["skill"][part]) < 1e-12 for part, cells in line["cells"].items()), where
        assert "score" not in line or abs(line["score"] - factorial.score(line["cells"]["tuning"])) < 1e-12, where
    chosen = found.choices()
    assert all(x["task"]["choice"] == chosen[x["task"]["controller"]] for x in judged if x["task"]["kind"] == "train")


measures()
shipped("lab/paper/factorial", "--minutes", "3", "--jobs", "2")
shipped("lab/paper/factorial/equal", "--steps", "250e6", "--jobs", "2", "--", "--ppo.matmul=bf16")
all_of_it()
equal_steps()
in_pieces()
what_stops()
print("65 trainings, restarted, stopped and printed")
