"""A network of somebody else's as a policy's file (mild.policy_file): `mild eval` acts as it does, and what does not fit is refused. rsl_rl's own
checkpoints are in check_learners.py."""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

from mild import envs, policy_file

ROOT = pathlib.Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests/export"))
import recorded  # noqa: E402

random = np.random.default_rng(1)


def network(widths, size=0.3):
    return [(random.normal(0, size, (out, into)), random.normal(0, 0.1, out)) for into, out in zip(widths, widths[1:])]


def act(layers, x):
    for index, (weight, bias) in enumerate(layers):
        x = weight @ x + bias
        x = x if index == len(layers) - 1 else np.where(x > 0, x, np.expm1(np.minimum(x, 0)))
    return x


def histories(frames, stride=8):
    """What the network saw at each decision: means of older frames, then the newest."""
    kept = np.tile(frames[0], (5 * stride, 1))
    for frame in frames:
        yield np.concatenate([kept.reshape(5, stride, -1).mean(axis=1).ravel(), frame])
        kept = np.vstack([kept[1:], frame])


class File(unittest.TestCase):
    def beside(self, hidden, keys=None, mean=None, scale=None, **where):
        """Largest difference of the actions that `mild eval` took from the network's own, and the trials."""
        opened = envs.open_envs(1, overrides=keys, **where)
        layers = network([opened.frames * opened.observation, *hidden, opened.actions], 0.05)
        with tempfile.TemporaryDirectory() as folder:
            policy_file.write(folder + "/p.safetensors", opened, layers, mean, scale, note="test")
            self.assertEqual(os.listdir(folder), ["p.safetensors"])
            subprocess.run([os.environ["MILD_PROGRAM"], "eval", "--policy", folder + "/p.safetensors", "--ground", "foam45", "--speed", "0.5",
                            "--trials", "2", "--seconds", "0.6", "--actions", folder + "/a.csv"], check=True, stdout=subprocess.DEVNULL)
            trials = recorded.trials(folder + "/a.csv")
        mean, scale = 0 if mean is None else mean, 1 if scale is None else scale
        worst = 0
        for trial in trials:
            for history, taken in zip(histories(trial.observation), trial.action):
                worst = max(worst, abs(np.clip(act(layers, (history - mean) / scale), -8, 8) - taken).max())
        self.assertGreater(abs(trials[0].action).max(), 0.1)
        self.assertGreater(len(trials[1].action), 20)
        opened.close()
        return worst, trials

    def test_actions(self):
        mean, scale = random.normal(0, 0.5, 282), random.uniform(0.3, 3, 282)
        for hidden, keys in (([64, 32], {}), ([24, 20, 16, 12], {"mean": mean, "scale": scale}), ([], {}), ([40], {"robot": "go1"})):
            worst, _ = self.beside(hidden, **keys)
            print(f"hidden {hidden}: {worst:.1e}")
            self.assertLess(worst, 1e-5)

    def test_task(self):
        """The file says how it walks: here with a gait of 0.5 s."""
        _, trials = self.beside([8], {"task.gait_period": 0.5, "task.gait_slowing": 0})
        np.testing.assert_allclose(np.diff(trials[0].phase[:20]), 0.02, atol=1e-6)

    def test_refused(self):
        opened, history = envs.open_envs(1), 282
        with tempfile.TemporaryDirectory() as folder:
            path = folder + "/p.safetensors"
            for layers, keys, line in ((network([281, 12]), {}, "281.*history of 282"), (network([history, 11]), {}, "12 actions"),
                                       (network([history, 8, 8, 8, 8, 8, 12]), {}, "5 hidden"),
                                       (network([history, 12]), {"scale": np.zeros(history)}, "above 0"),
                                       (network([history, 12]), {"mean": np.zeros(3)}, "282 numbers"),
                                       (network([history, 12], np.nan), {}, "not finite")):
                with self.assertRaisesRegex(ValueError, line):
                    policy_file.write(path, opened, layers, **keys)
                self.assertEqual(os.listdir(folder), [])
        opened.close()


if __name__ == "__main__":
    unittest.main()
