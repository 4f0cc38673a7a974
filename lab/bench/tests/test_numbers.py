#!/usr/bin/env python3
"""The numbers of mild bench, each held to another way to know it. Usage: test_numbers.py PATH_TO_MILD"""
import json
import os
import subprocess
import sys
import tempfile

mild = os.path.realpath(sys.argv[1])


def near(what, value, wanted, within):
    assert abs(value - wanted) <= within, f"{what}: {value}, not {wanted} +- {within}"


def true(what, holds):
    assert holds, what


def printed_by(*arguments):
    return subprocess.run([mild, *arguments], capture_output=True, text=True, check=True).stdout


def memory_rows(envs):
    """(rows of the bench, the largest memory that the system saw) [B]"""
    child = subprocess.Popen([mild, "bench", "memory", f"--train.envs={envs}", "--train.threads=1", "--ppo.epochs=1", "--json", "memory.json"],
                             stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    near("exit code of bench memory", child.returncode, 0, 0)
    with open("memory.json", encoding="utf-8") as file:
        return {row["case"]: row["value"] for row in json.load(file)["rows"]}, 1024 * usage.ru_maxrss


def memory():
    """The peak is the system's; what training needs for another 1024 robots is what the process needs more."""
    few, few_peak = memory_rows(512)
    many, many_peak = memory_rows(1536)
    near("envs", many["envs"], 1536, 0)
    near("process_peak of few", few["process_peak"], few_peak, 0.05 * few_peak)
    near("process_peak of many", many["process_peak"], many_peak, 0.05 * many_peak)
    more = many["training"] - few["training"]
    near("training, of 1024 robots more", more, many_peak - few_peak, 0.1 * more)
    true("training is within the peak", 0.5 * many_peak < many["training"] < many_peak)


def benches():
    """The table of mild bench and its file: the same rows in the same order, each with its number and its unit."""
    lines = printed_by("bench", "memory", "robots", "update", "--train.envs=4", "--train.threads=1", "--ppo.steps=4", "--json", "bench.json").splitlines()
    with open("bench.json", encoding="utf-8") as file:
        report = json.load(file)
    true("machine and version", lines[0] == f"{report['machine']}, mild {report['version']}")
    true("rows of the table", len(lines) - 1 == len(report["rows"]) > 15)
    for line, row in zip(lines[1:], report["rows"]):
        bench, case, value, *unit = line.split()
        unit = unit[0] if unit else "-"
        size = {"B": 1, "KiB": 2**10, "MiB": 2**20, "GiB": 2**30}.get(unit)
        true(f"the name of {bench} {case}", (bench, case) == (row["bench"], row["case"]))
        true(f"the unit of {bench} {case}", (unit if size is None else "B") == row["unit"])
        near(f"{bench} {case}", float(value) * (size or 1), row["value"], 6e-4 * abs(row["value"]) if size is None else 0.006 * (size or 1))
    rows = {row["case"]: row["value"] for row in report["rows"] if row["bench"] == "update"}
    near("act and update", rows["act_and_update"], rows["act"] + rows["update"], 1e-6)
    near("rate", rows["rate"], 1e-12 * rows["flops"] / (1e-6 * rows["act_and_update"]), 1e-9)


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    memory()
    benches()
    os.chdir("/")
print("the numbers of bench agree with other ways to know them")
