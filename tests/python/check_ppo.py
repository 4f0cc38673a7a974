"""examples/python/train_ppo.py: its sums, that it learns, and that what it saves is a policy of mild; needs PyTorch. `make python-check` runs it."""
import argparse
import contextlib
import io
import pathlib
import subprocess
import sys
import tempfile
import types
import unittest

import torch

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "examples/python"))
import train_ppo  # noqa: E402

torch.set_num_threads(1)


class Aim:
    """Environments without a robot: the action should be the last three of the four numbers seen, the reward is 1 minus the squared error. An
    episode takes five steps and runs out of time; the numbers and the action have no other mirror image than themselves."""

    envs, frames, observation, critic, actions, period = 64, 1, 4, 2, 3, 0.01

    def __init__(self):
        self.count, self.draws = 0, torch.Generator().manual_seed(1)

    def mirror(self):
        return ([0, 1, 2, 3], [1.0] * 4), ([0, 1, 2], [1.0] * 3)

    def buffers(self, **arrays):
        return arrays

    def draw(self, arrays):
        arrays["history"].copy_(torch.randn(self.envs, 1, 4, generator=self.draws))
        self.seen = arrays["history"][:, 0, 1:].clone()

    def reset(self, arrays, stream):
        self.draw(arrays)

    def step(self, action, arrays, stream):
        arrays["reward"].copy_(1 - (action - self.seen).square().sum(1))
        self.count += 1
        arrays["done"][:] = arrays["timeout"][:] = self.count % 5 == 0
        arrays["valid"][:] = True
        self.draw(arrays)


class OneFile(unittest.TestCase):
    def test_advantages(self):
        """As defined (Schulman et al. 2016): the discounted sum of what each step was better than foreseen, to the end of its episode."""
        torch.manual_seed(1)
        rollout = train_ppo.Rollout(Aim(), 12, torch.device("cpu"))
        rollout.critic.normal_(), rollout.reward.normal_()
        rollout.done.copy_(torch.rand(12, 64) < 0.2)
        rollout.timeout.copy_(rollout.done & (torch.rand(12, 64) < 0.5))
        rollout.valid[:], rollout.valid[4, 3] = True, False
        found, target = rollout.advantages(lambda numbers: numbers[..., :1])
        value = rollout.critic[..., 0]
        for e in range(0, 64, 8):
            for t in range(12):
                wanted, weight = 0.0, 1.0
                for k in range(t, 12):
                    ahead = value[k + 1, e] if not rollout.done[k, e] else value[k, e] if rollout.timeout[k, e] else 0
                    wanted += weight * (rollout.reward[k, e] + train_ppo.GAMMA * ahead - value[k, e])
                    weight *= train_ppo.GAMMA * train_ppo.LAMBDA
                    if rollout.done[k, e]:
                        break
                self.assertAlmostEqual(float(found[t, e]), float(wanted), delta=1e-5)
        torch.testing.assert_close(target, found + value[:-1])
        self.assertEqual(float(found[4, 3]), 0)

    def test_learns(self):
        """From noise to what can be reached with it: a squared error of a tenth of the first."""
        torch.manual_seed(1)
        envs = Aim()
        learner, rollout, errors = train_ppo.Ppo(envs, [32], torch.device("cpu")), train_ppo.Rollout(envs, 16, torch.device("cpu")), []
        for iteration in range(80):
            rollout.fill(learner.policy)
            learner.anneal((iteration + 1) / 80)
            learner.update(rollout)
            errors.append(1 - float(rollout.reward.mean()))
        history = rollout.history[:-1].flatten(0, 1)[:, 0]
        apart = float((learner.average.net(history) - history[:, 1:]).square().sum(1).mean().detach())
        print(f"squared error with noise {errors[0]:.2f}, then {errors[-1]:.2f}; of the mean of the weights without {apart:.3f}; noise {rollout.std.mean():.2f}")
        self.assertLess(errors[-1], 0.1 * errors[0])
        self.assertLess(apart, 0.1)
        self.assertLessEqual(learner.policy.log_std.detach().exp().max().item(), train_ppo.STD_END + 1e-6)

    def test_saves(self):
        """Two iterations of robots, on one ground; `mild eval` walks with the file."""
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()) as said:
            rewards = train_ppo.train(argparse.Namespace(device="cpu", envs=8, rollout=4, steps=64, config="configs/quick.ini", robot=None, ground="foam45",
                                                         set=["task.vx=0 1"], hidden=[16, 8], seed=1, out=pathlib.Path(folder)))
            path = pathlib.Path(folder, "policy.safetensors")
            done = subprocess.run([sys.executable, "-m", "mild", "eval", "--policy", path, "--ground", "foam45", "--speed", "0.5", "--trials", "1", "--seconds", "1"],
                                  capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(len(rewards), 2)
        self.assertRegex(said.getvalue(), "2/2  0.00 M steps .* reward [0-9.]+/s")
        with self.assertRaisesRegex(ValueError, "snad"):
            train_ppo.train(types.SimpleNamespace(device="cpu", envs=8, config=None, robot=None, ground="snad", set=[], seed=1))


if __name__ == "__main__":
    unittest.main()
