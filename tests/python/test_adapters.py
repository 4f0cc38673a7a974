"""What the adapters report to a learner about the end of an episode: a time-out where the robot still stands after the episode's time, no
time-out where it fell. Of PyTorch, rsl_rl and Stable-Baselines3 stand-ins of NumPy are enough; `make python-check` has the real ones."""
import pathlib
import sys
import tempfile
import types
import unittest

import numpy as np


class Tensor(np.ndarray):
    """The methods of a tensor that mild.rsl_rl calls."""

    def view(self, *shape):
        return self.reshape(shape)

    def long(self):
        return self.astype(np.int64)

    def detach(self):
        return self

    def to(self, device, kind):
        return self.astype(kind)

    def contiguous(self):
        return self

    def masked_fill_(self, mask, value):
        self[mask] = value


def tensor_of(make):
    def made(*shape, dtype=np.float32, device=None):
        return make(shape[0] if isinstance(shape[0], tuple) else shape, dtype).view(np.ndarray)
    return lambda *shape, **keys: np.ndarray.view(made(*shape, **keys), Tensor)


def stand_in(name, **members):
    sys.modules[name] = types.ModuleType(name)
    vars(sys.modules[name]).update(members)


class VecEnv:
    """Of either learner."""

    def __init__(self, num_envs=0, observation_space=None, action_space=None):
        self.num_envs, self._seeds = num_envs, [1] * num_envs

    def _reset_seeds(self):
        pass

    _reset_options = _reset_seeds


stand_in("torch", empty=tensor_of(np.empty), zeros=tensor_of(np.zeros), ones=tensor_of(np.ones), bool=np.bool_, long=np.int64,
         float32=np.float32, device=lambda name: types.SimpleNamespace(type=name))
stand_in("tensordict", TensorDict=lambda groups, **keys: groups)
for package, module in (("rsl_rl", "env"), ("stable_baselines3", "common.vec_env")):
    for at in range(len(module.split(".")) + 1):
        stand_in(".".join([package, *module.split(".")[:at]]), VecEnv=VecEnv)

from mild import gym, policy_file, rsl_rl, sb3  # noqa: E402

ENVS, LENGTH = 8, 50  # robots, steps of an episode
KEYS = {"task.episode": 0.5, "task.assist": False, "task.standing_share": 1}


def actions_of(step):
    """The first half of the robots stand, the other half fall."""
    actions = 8 * np.sin(2.7 * step + np.arange(12.0 * ENVS)).reshape(ENVS, 12).astype(np.float32)
    actions[: ENVS // 2] = 0
    return actions


class Ends(unittest.TestCase):
    def follow(self, step_of):
        """Steps of an environment, step_of(actions) = (done, timeout), beside what the lengths of the episodes say. An environment's
        first episode is of another length."""
        stands = np.arange(ENVS) < ENVS // 2
        length, first = np.zeros(ENVS, int), np.ones(ENVS, bool)
        times = falls = 0
        for step in range(6 * LENGTH):
            done, timeout = map(np.asarray, step_of(actions_of(step)))
            length += 1
            self.assertEqual((done.shape, timeout.shape), ((ENVS,), (ENVS,)))
            self.assertFalse((timeout & ~done).any())
            known = ~first & done
            over = length == LENGTH
            np.testing.assert_array_equal(timeout[known & stands], over[known & stands])
            self.assertFalse((timeout & known & ~over).any())  # a robot may fall in its last step
            times, falls = times + (timeout & known).sum(), falls + (~timeout & known).sum()
            first &= ~done
            length[done] = 0
        self.assertGreater(times, 4)
        self.assertGreater(falls, 4)

    def test_gym(self):
        env = gym.VectorEnv(ENVS, overrides=KEYS)
        env.reset(seed=1)

        def step(actions):
            _, _, ended, truncated, _ = env.step(actions)
            self.assertFalse((ended & truncated).any())
            return ended | truncated, truncated

        self.follow(step)
        env.close()

    def test_rsl_rl(self):
        env = rsl_rl.Env(ENVS, overrides=KEYS)
        self.assertEqual(env.max_episode_length, LENGTH)

        def step(actions):
            _, reward, done, extras = env.step(actions.view(Tensor))
            self.assertEqual(reward.shape, (ENVS,))
            self.assertTrue((np.asarray(env.episode_length_buf)[np.asarray(done) == 1] == 0).all())
            return np.asarray(done) == 1, extras["time_outs"]

        self.follow(step)
        env.close()

    def test_rsl_rl_policy(self):
        """A checkpoint's layers and statistics are those of the policy's file; another actor is refused."""
        class Values:
            def __init__(self, array):
                self.array = array

            def cpu(self):
                return self

            def numpy(self):
                return self.array

        env, random = rsl_rl.Env(ENVS, overrides=KEYS), np.random.default_rng(1)
        layers = [(random.normal(size=(out, into)), random.normal(size=out)) for into, out in ((282, 6), (6, 12))]
        mean, std = random.normal(size=(1, 282)), random.uniform(0, 2, (1, 282))
        state = {f"mlp.{2 * i}.{name}": Values(part) for i, layer in enumerate(layers) for name, part in zip(("weight", "bias"), layer)}
        state |= {"obs_normalizer._mean": Values(mean), "obs_normalizer._std": Values(std), "obs_normalizer.count": Values(np.array(9)),
                  "distribution.std_param": Values(np.ones(12))}
        with tempfile.TemporaryDirectory() as folder:
            ours, wanted = pathlib.Path(folder, "ours"), pathlib.Path(folder, "wanted")
            env.save({"actor_state_dict": state}, ours)
            policy_file.write(wanted, env._envs, layers, mean, std + 0.01, note="rsl_rl")
            self.assertEqual(ours.read_bytes(), wanted.read_bytes())
            for other in ({}, {"actor_state_dict": {}}, {"actor_state_dict": {**state, "rnn.weight": Values(mean)}}):
                with self.assertRaisesRegex(ValueError, "no actor"):
                    env.save(other, ours)
        env.close()

    def test_sb3(self):
        env = sb3.Env(ENVS, overrides=KEYS)
        env.reset()

        def step(actions):
            env.step_async(actions)
            _, _, done, infos = env.step_wait()
            for info, over in zip(infos, done, strict=True):
                self.assertEqual("TimeLimit.truncated" in info, over)
            return done, [info.get("TimeLimit.truncated", False) for info in infos]

        self.follow(step)
        env.close()


if __name__ == "__main__":
    unittest.main()
