#!/usr/bin/env python3
"""scripts/ranks_model.py and scripts/gpus.py's use of it, against numbers by hand. Usage: test_model.py SOURCE_FOLDER"""
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(sys.argv[1]).resolve()
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "scripts"))
import gpus  # noqa: E402
import ranks_model  # noqa: E402


def near(value, wanted, share=1e-3):
    assert abs(value - wanted) <= share * wanted, (value, wanted)


# The mean of the largest of n, from tables of order statistics (Harter 1961).
for count, wanted in ((1, 0), (2, 0.56419), (4, 1.02938), (8, 1.42360), (16, 1.76599), (64, 2.34373)):
    assert abs(ranks_model.largest(count) - wanted) < 1e-4, (count, ranks_model.largest(count))

# A sum of 80 B takes 10 us on two GPUs and 14 on four: a hop 2 us, the start 8. 1 MB more takes 20 us on one hop, 60 on three: 50 GB/s.
SUMS = {(2, 80): 10e-6, (2, 1000080): 30e-6, (4, 80): 14e-6, (4, 1000080): 74e-6}
SHORT = 16 * 80 / 50e9 + 2 * 64 / 50e9  # what the 80 and 64 bytes themselves take, a hop
ONE = 0.1


def model(iterations=None, sums=None, **more):
    return ranks_model.Model(iterations or {1: ONE}, sums or SUMS, gradient=1e6, **more)


eight = model()
near(eight.hop, 2e-6)
near(eight.start, 8e-6)
near(1 / eight.per_byte, 50e9)
near(eight.ring(8, 1e6), 162e-6)  # 8 + 7 (2 + 20)
near(eight.pairs(8, 1e6), 74e-6)  # 8 + 3 (2 + 20)
near(eight.sums(8), 16 * (162e-6 + 22e-6) + 2 * 22e-6 + 7 * SHORT)
near(eight.times_one(8), 8 * ONE / (ONE + 2.988e-3))  # 7.768
assert eight.sums(1) == eight.waiting(1) == eight.waiting(8) == 0 and eight.times_one(1) == 1

# Beyond a host a hop takes 20 us and 40 GB/s: on a ring every one of them, in pairs the fourth round, with all eight GPUs' numbers.
near(model(network=40e9).ring(16, 1e6), 683e-6)  # 8 + 15 (20 + 25)
near(model(network=40e9).pairs(16, 1e6), 294e-6)  # 74 + 20 + 200
near(model(host=16, network=40e9).ring(16, 1e6), 338e-6)  # 8 + 15 (2 + 20)
near(model(network=1e12, network_hop=1e-6).ring(16, 1e6), 338e-6)  # a network is no faster than the host

# Two GPUs that took 1.2 ms beyond their sums: 16 (30 + 10) + 2 10 = 660 us. Four are then 1.2 ms * 1.02938 / 0.56419 slower.
late = model({1: ONE, 2: ONE + 660e-6 + 1.2e-3})
near(late.waiting(2), 1.2e-3)
near(late.waiting(4), 2.1894e-3)
near(late.waiting(256), 6.0127e-3)  # 2.8269
near(late.times_one(4), 4 * ONE / (ONE + 16 * (74e-6 + 14e-6) + 2 * 14e-6 + 2.1894e-3))
assert model({1: ONE, 2: ONE}).waiting(8) == 0  # faster than the sums alone: no spread

# On two GPUs alone, all but the bytes is a hop.
two = model(sums={key: value for key, value in SUMS.items() if key[0] == 2})
assert abs(two.start) < 1e-12
near(two.hop, 10e-6)
near(two.ring(256, 80), 255 * 20e-6)

# ---- the command line: the same numbers, and mistakes are one line ----
GOOD = ["--iteration", "1:0.1", "--sum", "2:80:10", "2:1000080:30", "4:80:14", "4:1000080:74", "--gradient", "1e6"]


def run(*words, code=0):
    done = subprocess.run([sys.executable, ROOT / "scripts/ranks_model.py", *words], capture_output=True, text=True, check=False)
    assert done.returncode == code, (words, done.stdout, done.stderr)
    return done.stdout + done.stderr


def one_line(pattern, *words):
    printed = run(*words, code=2)
    assert pattern in printed and printed.count("\n") == 1, printed


table = run(*GOOD)
assert "start 8.0 us, hop 2.0 us, 50 GB/s, spread of a rollout 0.00 ms" in table and "| 8 | 2.99 | 0.00 | 7.768 | 0.97 |" in table, table
assert "| 64 |" in table and "| 128 (not built) |" in table and "| 256 (not built) |" in table
one_line("--iteration 1:SECONDS")
one_line("--iteration 2:x", "--iteration", "2:x")
one_line("--iteration 3:1", "--iteration", "3:1")
one_line("--sum 2:80::", "--iteration", "1:0.1", "--sum", "2:80:")
one_line("--sum 2:80", "--iteration", "1:0.1", "--sum", "2:80")
one_line("two numbers of BYTES", "--iteration", "1:0.1", "--sum", "2:80:10")
one_line("two numbers of BYTES", "--iteration", "1:0.1")
one_line("measure again", "--iteration", "1:0.1", "--sum", "2:80:10", "2:1000080:9")
one_line("must be more than 0", *GOOD, "--network", "0")

# ---- gpus.py reads what the test of the sums says ----


class Stand:
    def by(self, count, name):
        return count, name

    def good(self, command):
        return True, (f"the same sums on {command[0]} GPUs\na sum of 80 B by {command[0]} GPUs takes 10.25 us\n"
                      f"a sum of 2600000 B by {command[0]} GPUs takes 40.50 us\n")


gpus.sums(Stand(), type("Arguments", (), {"n": 4, "device": "cuda"}), None)
assert not gpus.failures and set(gpus.took) == {(count, size) for count in (2, 4) for size in (80, 2600000)}, gpus.took
near(gpus.took[4, 80], 10.25e-6)
near(gpus.took[2, 2600000], 40.5e-6)
print("the model of many GPUs: all as by hand")
