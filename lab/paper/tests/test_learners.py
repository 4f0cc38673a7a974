#!/usr/bin/env python3
"""The learner of lab/paper/rivals: advantages against numbers by hand and a plain sum, Clock finds the best action of a task made up here, and
both rivals train in the package's environments. Exits with 77 where PyTorch or the package is missing. Usage: test_learners.py SOURCE_FOLDER"""
import dataclasses
import pathlib
import subprocess
import sys
import tempfile
import types
import unittest

root = pathlib.Path(sys.argv.pop(1)).resolve()
sys.dont_write_bytecode = True
sys.path.insert(0, str(root / "lab/paper/rivals"))
try:
    import torch

    import files
    import ppo
    import train_clock
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

torch.set_num_threads(1)
CPU = torch.device("cpu")


class Made:
    """Environments of 20 steps whose reward is 0.1 exp(-2 mean (a - best)^2); best is its own mirror image."""

    best = torch.tensor([0.0, 0, 1, 1, 1, 0] * 2)

    def __init__(self, envs=64):
        self.shape, self.device = types.SimpleNamespace(envs=envs, actions=12, observation=47, critic=104), CPU
        self.time, self.valid = torch.arange(envs) % 20, torch.ones(envs, dtype=torch.uint8)
        self.reward = torch.zeros(envs)
        self.paid = []
        self.reset()

    def mirror(self):
        return (torch.arange(46, -1, -1), torch.ones(47)), ((torch.arange(12) + 6) % 12, torch.tensor([-1.0, -1, 1, 1, 1, -1] * 2))

    def reset(self):
        self.frame = torch.randn(self.shape.envs, 47)
        self.critic = torch.cat([self.frame, 0 * self.frame, 0 * self.frame[:, :10]], 1)

    def step(self, action):
        self.reward = 0.1 * torch.exp(-2 * ((action - self.best) ** 2).mean(1))
        self.paid.append(self.reward.mean().item() / 0.1)
        self.time = (self.time + 1) % 20
        self.done = self.timeout = (self.time == 0).to(torch.uint8)
        self.reset()


class Advantages(unittest.TestCase):
    def test_by_hand(self):
        """Two steps, gamma 0.5, lambda 0.8: the errors are 1 + 0.5 2 - 1 = 1 and 3 + 0.5 4 - 2 = 3, so the advantages 3 and 1 + 0.4 3."""
        r = ppo.Rollout(2, 1, 1, 1, CPU)
        r.reward = torch.tensor([[1.0], [3.0]])
        advantage, returns = r.advantages(torch.tensor([[1.0], [2.0], [4.0]]), 0.5, 0.8)
        torch.testing.assert_close(advantage, torch.tensor([[2.2], [3.0]]))
        torch.testing.assert_close(returns, torch.tensor([[3.2], [5.0]]))

    def test_sum(self):
        """Sum over t of (gamma lambda)^(t-s) times the errors until the episode ends; an end by time has the value before after it."""
        r, value = ppo.Rollout(9, 7, 1, 1, CPU), torch.randn(10, 7, dtype=torch.float64)
        r.reward = torch.rand(9, 7, dtype=torch.float64)
        r.done = (torch.rand(9, 7) < 0.2).double()
        r.timeout = r.done * (torch.rand(9, 7) < 0.5)
        wanted = torch.zeros(9, 7, dtype=torch.float64)
        for e in range(7):
            for s in range(9):
                share = 1.0
                for t in range(s, 9):
                    after = value[t, e] if r.timeout[t, e] else 0.0 if r.done[t, e] else value[t + 1, e]
                    wanted[s, e] += share * (r.reward[t, e] + 0.97 * after - value[t, e])
                    share *= 0.97 * 0.9 * (1 - r.done[t, e])
        torch.testing.assert_close(r.advantages(value, 0.97, 0.9)[0], wanted)


class Learning(unittest.TestCase):
    def test_clock(self):
        torch.manual_seed(2)
        envs = Made()
        clock = train_clock.Clock(envs, CPU, dataclasses.replace(train_clock.SETTINGS, gamma=0.5, kl_target=0.03))
        clock.begin(envs)
        rates = []
        for i in range(12):
            envs.paid.clear()
            clock.ppo.anneal(i / 12)
            clock.roll_out()
            clock.update()
            rates.append(sum(envs.paid) / len(envs.paid))
        print(f"Clock: {rates[0]:.3f} of the greatest reward, then {rates[-1]:.3f}")
        self.assertGreater(rates[-1], rates[0] + 0.08)
        with tempfile.TemporaryDirectory() as folder:
            clock.save(folder + "/clock.safetensors", "made up")
            tensors, texts = files.read(folder + "/clock.safetensors")
        self.assertEqual((texts["kind"], texts["note"]), ("mild clock", "made up"))
        for name, weight in clock.ppo.mean_weights.items():
            self.assertTrue(torch.equal(tensors[f"actor.{name}"], weight))

    def test_in_the_environments(self):
        """Two iterations of each rival, by its command."""
        with tempfile.TemporaryDirectory() as folder:
            for name, more in (("clock", ()), ("ht2", ("--record", "40", "--pretrain", "2", "--warm", "1"))):
                out = pathlib.Path(folder, name)
                subprocess.run([sys.executable, "-B", root / f"lab/paper/rivals/train_{name}.py", "--out", out, "--device", "cpu", "--envs", "4",
                                "--iterations", "2", *more], check=True, stdout=subprocess.DEVNULL)
                rows = (out / "log.csv").read_text().splitlines()
                self.assertEqual(len(rows), 3)
                tensors, texts = files.read(out / f"{name}.safetensors")
                self.assertEqual(texts["kind"], f"mild {name}")
                self.assertTrue(all(torch.isfinite(tensor).all() for tensor in tensors.values()))


unittest.main()
