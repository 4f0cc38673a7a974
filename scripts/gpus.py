#!/usr/bin/env python3
"""Checks and times training by several GPUs of one machine, a process each (docs/ranks.md).

  scripts/gpus.py -n 2                    with the programs of build/
  build/bundle/gpus.py -n 8 --only speed  with those of a bundle (scripts/bundle.sh ranks)

sums    sums over the GPUs have the bits of one tree; how long they take, by 2, 4 .. n
parts   the learner on the GPUs against one on the processor
split   the first iteration by 1, 2 .. n GPUs: log and parameters; by n twice: the same bits
resume  a checkpoint of all goes on with 1, and with all
killed  a process that dies ends all with one line, and training goes on from the last checkpoint
few     more processes than GPUs: one line, exit code 2
speed   policy steps/s by 1, 2 .. n GPUs, --robots of each
model   what 1 .. 256 GPUs should cost, by sums and speed (scripts/ranks_model.py)

Exits with 1 when something is not as it should be."""
import argparse
import csv
import json
import math
import os
import pathlib
import re
import shutil
import signal
import statistics
import struct
import subprocess
import sys
import tempfile
import time

import ranks_model

HERE = pathlib.Path(__file__).resolve().parent
BUNDLE = HERE if (HERE / "run").exists() else None
ROOT = BUNDLE or HERE.parent
STEPS = ("sums", "parts", "split", "resume", "killed", "few", "speed", "model")
BARS = {2: 1.9, 8: 7.0}  # times the steps/s of one GPU, at least
failures = []
took = {}  # [s] a sum, by (GPUs, bytes)
iterations = {}  # [s] an iteration, by GPUs


def fail(text):
    failures.append(text)
    print(f"FAIL: {text}", flush=True)


class Programs:
    """Command lines of mild and its tests, alone and by several processes."""

    def __init__(self, arguments):
        self.arguments = arguments
        # as root too; no network; more processes than cores, for a trial on a processor
        defaults = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_btl": "self,vader",
                    "OMPI_MCA_btl_vader_single_copy_mechanism": "none", "OMPI_MCA_rmaps_base_oversubscribe": "1"}
        self.environment = {**defaults, **os.environ}

    def program(self, name):
        if BUNDLE:
            return [str(BUNDLE / "run"), name]
        layer = {"test_ranks": "ranks", "test_parts": "gpu"}
        path = f"tests/{layer[name]}_{name}" if name in layer else name
        return [str(pathlib.Path(self.arguments.build).resolve() / path)]

    def by(self, count, name, *options):
        """The program by so many processes; by one, without MPI."""
        command = [*self.program(name), *options]
        if count == 1:
            return command
        launcher = [str(HERE / "ranks.py"), "-n", str(count), *command]
        return [str(BUNDLE / "run"), *launcher] if BUNDLE else launcher

    def train(self, count, folder, *options):
        common = ["--train.robots=batch", f"--train.device={self.arguments.device}", "--train.minutes=0",
                  "--train.checkpoint_every=1000000"]
        start = [] if "--resume" in options else [
            "--config", str(ROOT / "configs" / "quick.ini"), "--ppo.steps=24", "--ppo.optimizer=adam", "--ppo.matmul=fp32"]
        return self.by(count, "mild", "train", "--out", str(folder), *start, *common, *options, *self.arguments.options)

    def run(self, command, seconds=300, **variables):
        """Exit code and output."""
        done = subprocess.run(command, env={**self.environment, **variables}, stdin=subprocess.DEVNULL, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=seconds, check=False)
        return done.returncode, done.stdout

    def good(self, command):
        code, output = self.run(command)
        if code != 0:
            fail(f"exit code {code}: {' '.join(command)}\n{output}")
        return code == 0, output


# ---- checkpoints and logs ----


def tensors(folder):
    """{name: bytes} of the newest checkpoint."""
    path = max(folder.glob("checkpoint_*.safetensors"))
    data = path.read_bytes()
    begin = 8 + struct.unpack("<Q", data[:8])[0]
    header = json.loads(data[8:begin])
    return {name: data[begin + entry["data_offsets"][0] : begin + entry["data_offsets"][1]]
            for name, entry in header.items() if name != "__metadata__"}


def policy(numbers):
    """Its parameters."""
    names = sorted(name for name in numbers if not name.startswith("train."))
    data = b"".join(numbers[name] for name in names)
    return struct.unpack(f"<{len(data) // 4}f", data)


def distance(a, b):
    return math.sqrt(sum((x - y) ** 2 for x, y in zip(a, b)))


def log(folder):
    with open(folder / "log.csv", newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def counts(most):
    return [count for count in (1, 2, 4, 8) if count <= most]


# ---- steps ----


def sums(programs, arguments, _):
    for count in counts(arguments.n)[1:]:
        found, output = programs.good(programs.by(count, "test_ranks"))
        found_line = f"the same sums on {count} GPUs"
        if found and found_line not in output and arguments.device == "cuda":
            fail(f"no '{found_line}' in {output}")
        print(f"sums: {found_line if found_line in output else 'on processors'}")
        for size, us in re.findall(rf"a sum of (\d+) B by {count} GPUs takes ([\d.]+) us", output):
            took[count, int(size)] = 1e-6 * float(us)
            print(f"sums: {size} B by {count} GPUs: {us} us")


def parts(programs, arguments, _):
    found, output = programs.good(programs.by(arguments.n, "test_parts"))
    found_line = re.search(r"\d+ processes: way.*", output)
    if found and not found_line:
        fail(f"test_parts did not run: {output}")
    print(f"parts: {found_line.group(0) if found_line else 'failed'}")


def compare(name, before, one, other):
    """Distance of what two runs have learned, relative to the way from `before`."""
    start, mine, theirs = (policy(tensors(folder)) for folder in (before, one, other))
    apart = distance(mine, theirs) / distance(mine, start)
    first, second = (log(folder)[-1] for folder in (one, other))
    gaps = {key: abs(float(first[key]) - float(second[key])) / max(abs(float(first[key])), 0.01)
            for key in ("episode/reward", "loss/value", "loss/surrogate", "loss/kl", "loss/reconstruction", "ppo/gradient")}
    print(f"{name}: parameters {apart:.1e} of the way apart; " + ", ".join(f"{key} {gap:.0e}" for key, gap in gaps.items()))
    # where feet meet the ground rounding grows: other products on one processor part them by 0.05, of 512 robots
    if not apart < 0.2 or not gaps["loss/value"] < 0.01 or not gaps["ppo/gradient"] < 0.05:
        fail(f"{name}: not the same iteration")


def split(programs, arguments, work):
    options = [f"--train.envs={arguments.robots // 4 * arguments.n}", "--ppo.matmul=fp32"]
    start = work / "start"
    programs.good(programs.train(1, start, *options, "--train.iterations=0", "--train.minutes=1e-9"))
    for count in counts(arguments.n):
        if not programs.good(programs.train(count, work / f"by{count}", *options, "--train.iterations=1"))[0]:
            return
        if count > 1:
            compare(f"split: iteration 1 by 1 and {count} GPUs", start, work / "by1", work / f"by{count}")
    programs.good(programs.train(arguments.n, work / "again", *options, "--train.iterations=1"))
    same = tensors(work / f"by{arguments.n}") == tensors(work / "again")
    print(f"split: by {arguments.n} GPUs twice: {'the same bits' if same else 'other bits'}")
    if not same:
        fail("two runs differ")


def resume(programs, arguments, work):
    options = [f"--train.envs={arguments.robots // 4 * arguments.n}", "--ppo.matmul=fp32"]
    first = work / "first"
    programs.good(programs.train(arguments.n, first, *options, "--train.iterations=2"))
    for count in (1, arguments.n):
        shutil.copytree(first, work / f"on{count}")
        if not programs.good(programs.train(count, work / f"on{count}", "--resume", "--train.iterations=3"))[0]:
            return
    compare(f"resume: iteration 3 by 1 and {arguments.n} GPUs", first, work / "on1", work / f"on{arguments.n}")


def children(process):
    """Of a process and of its children."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            text = path.read_text(encoding="utf-8")
        except OSError:
            continue
        if int(text.rsplit(")", 1)[1].split()[1]) == process:
            found += [int(path.parent.name), *children(int(path.parent.name))]
    return found


def trainers(launcher):
    names = {}
    for process in children(launcher):
        try:
            names[process] = pathlib.Path(f"/proc/{process}/comm").read_text(encoding="utf-8")
        except OSError:
            pass
    return [process for process, name in names.items() if name.startswith("mild")]


def killed(programs, arguments, work):
    folder = work / "killed"
    command = programs.train(arguments.n, folder, f"--train.envs={arguments.robots // 4 * arguments.n}",
                             "--train.iterations=0", "--train.checkpoint_every=2")
    with open(work / "killed.err", "w", encoding="utf-8") as errors:
        process = subprocess.Popen(command, env=programs.environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                   stderr=errors)
        for _ in range(1200):
            if list(folder.glob("checkpoint_*.safetensors")) or process.poll() is not None:
                break
            time.sleep(0.1)
        victims = trainers(process.pid)
        if len(victims) != arguments.n:
            fail(f"killed: {len(victims)} processes train")
            process.send_signal(signal.SIGTERM)
        else:
            os.kill(victims[-1], signal.SIGKILL)
        before = time.monotonic()
        code = process.wait(60)
    seconds = time.monotonic() - before
    text = (work / "killed.err").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("training ")]
    print(f"killed: exit code {code} after {seconds:.1f} s: {' | '.join(lines)}")
    if code != 137 or seconds > 10 or len(lines) != 1:
        fail(f"killed: not one line within 10 s: {text}")
    last = int(max(folder.glob("checkpoint_*.safetensors")).stem[-9:])
    programs.good(programs.train(arguments.n, folder, "--resume", f"--train.iterations={last + 1}"))


def few(programs, arguments, work):
    command = programs.train(2, work / "few", "--train.envs=64", "--train.iterations=1")
    code, output = programs.run(command, CUDA_VISIBLE_DEVICES="0")
    print(f"few: exit code {code}: {output.strip().splitlines()[-1] if output.strip() else ''}")
    if arguments.device == "cuda" and (code != 2 or "2 processes on a machine with 1 GPUs" not in output):
        fail(f"few: {output}")


def speed(programs, arguments, work):
    alone = None
    for count in counts(arguments.n):
        folder = work / f"speed{count}"
        done, _ = programs.good(programs.train(count, folder, f"--train.envs={arguments.robots * count}", "--ppo.matmul=bf16",
                                               f"--train.iterations={arguments.iterations}"))
        if not done:
            return
        rates = [float(row["rate/steps_per_s"]) for row in log(folder)][arguments.iterations // 3 :]
        rate = statistics.median(rates)
        alone = alone or rate
        steps = [float(row["rate/steps"]) for row in log(folder)[-2:]]
        iterations[count] = (steps[1] - steps[0]) / rate
        print(f"speed: {count} GPUs, {arguments.robots * count} robots: {rate:.4g} policy steps/s ({min(rates):.3g} .. "
              f"{max(rates):.3g}), {rate / alone:.2f} times one", flush=True)
        if rate / alone < BARS.get(count, 0) and arguments.device == "cuda":
            fail(f"{count} GPUs: {rate / alone:.2f} times one, the bar is {BARS[count]}")


def model(_, arguments, __):
    if not took or 1 not in iterations:
        print("model: it needs sums and speed of the same call, on GPUs")
        return
    print(f"iterations: {' '.join(f'{count}:{seconds:.5g}' for count, seconds in iterations.items())} s, {arguments.robots} robots a GPU\n"
          f"{ranks_model.Model(iterations, took).table()}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=2, choices=(2, 4, 8), help="GPUs (default 2)")
    parser.add_argument("--robots", type=int, default=16384, help="of each GPU (default 16384; the checks take a quarter)")
    parser.add_argument("--iterations", type=int, default=45, help="of `speed`; the first third is not counted (default 45)")
    parser.add_argument("options", nargs="*", metavar="-- OPTION", help="of every training, as --task.shells_stand=false")
    parser.add_argument("--only", nargs="+", choices=STEPS, default=STEPS, metavar="STEP", help=", ".join(STEPS))
    parser.add_argument("--build", default=str(ROOT / "build"), help="folder of the programs, without a bundle")
    parser.add_argument("--device", default="cuda", help="cpu tries this script on a processor")
    arguments = parser.parse_args()
    programs = Programs(arguments)
    with tempfile.TemporaryDirectory() as folder:
        for step in STEPS:
            if step in arguments.only:
                before = time.monotonic()
                globals()[step](programs, arguments, pathlib.Path(folder))
                print(f"{step}: took {time.monotonic() - before:.0f} s", flush=True)
    print(f"{len(failures)} failures" if failures else "all as it should be")
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
