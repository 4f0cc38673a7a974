"""The environments under rsl_rl and Stable-Baselines3; needs PyTorch. `make python-check` runs it."""
import importlib.metadata
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import torch
from rsl_rl.runners import OnPolicyRunner
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.vec_env import VecNormalize

from mild import gym, rsl_rl, sb3

torch.set_num_threads(2)
SHORT = {"task.episode": 1, "task.assist": False}
CONFIG = {
    "num_steps_per_env": 16, "save_interval": 100, "obs_groups": {"actor": ["policy"], "critic": ["critic"]},
    "algorithm": {"class_name": "PPO", "num_learning_epochs": 2, "num_mini_batches": 2, "learning_rate": 1e-3, "schedule": "adaptive",
                  "gamma": 0.99, "lam": 0.95, "desired_kl": 0.01, "entropy_coef": 0.005, "value_loss_coef": 1.0, "clip_param": 0.2,
                  "use_clipped_value_loss": True, "max_grad_norm": 1.0},
    "actor": {"class_name": "MLPModel", "hidden_dims": [64], "activation": "elu", "obs_normalization": True,
              "distribution_cfg": {"class_name": "GaussianDistribution", "init_std": 0.6}},
    "critic": {"class_name": "MLPModel", "hidden_dims": [64], "activation": "elu", "obs_normalization": True}}


class Rivals(unittest.TestCase):
    def test_teacher(self):
        """What HT-2 learns from is the shipped policy, read from its file."""
        root = pathlib.Path(__file__).parents[2]
        sys.path[:0] = [str(root / "lab/paper/rivals"), str(root / "examples/python")]
        import policy
        import train_ht2
        path = root / "policies/mild.safetensors"
        frames = np.random.default_rng(1).normal(0, 0.3, (1, 6, 47)).astype(np.float32)
        ours = policy.Policy(path)
        ours.stride, ours.clip, ours.frames = 1, 1e9, frames[0, :5]
        action = train_ht2.Teacher(path, "cpu").act(torch.from_numpy(frames))
        np.testing.assert_allclose(action[0].numpy(), ours.act(frames[0, 5]), atol=2e-5)


class RslRl(unittest.TestCase):
    def test_numbers_of_gymnasium(self):
        """The same observations, rewards and ends as the Gymnasium environment of the same seed."""
        env = rsl_rl.Env(6, seed=3, overrides=SHORT)
        other = gym.VectorEnv(6, overrides=SHORT)
        seen, _ = other.reset(seed=3)
        np.testing.assert_array_equal(env.get_observations()["policy"].numpy(), seen)
        ended = 0
        for step in range(150):
            actions = torch.sin(0.3 * step + torch.arange(72.0)).reshape(6, 12)
            before = env.get_observations()["policy"]
            kept = before.clone()
            observations, reward, done, extras = env.step(actions)
            self.assertTrue(torch.equal(before, kept))  # a step leaves the tensors of the last one alone
            seen, paid, over, truncated, _ = other.step(actions.numpy())
            np.testing.assert_array_equal(observations["policy"].numpy(), seen)
            np.testing.assert_array_equal(reward.numpy(), paid)
            np.testing.assert_array_equal(done.bool().numpy(), over | truncated)
            np.testing.assert_array_equal(extras["time_outs"].numpy(), truncated)
            self.assertTrue((env.episode_length_buf[done.bool()] == 0).all())
            ended += int(done.sum())
        self.assertGreater(ended, 6)
        self.assertEqual(env.max_episode_length, 100)
        env.close()
        other.close()

    def test_runner(self):
        env = rsl_rl.Env(16, config="configs/quick.ini", overrides=SHORT)
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            symmetry = {"data_augmentation_func": "mild.rsl_rl:mirror", "use_mirror_loss": True, "mirror_loss_coeff": 1.0}
            config = {**CONFIG, "logger": "tensorboard", "algorithm": {**CONFIG["algorithm"], "symmetry_cfg": symmetry}}
            runner = OnPolicyRunner(env, config, log_dir=folder, device="cpu")
            before = [p.clone() for p in runner.alg.get_policy().parameters()]
            runner.learn(4, init_at_random_ep_len=True)
            after = list(runner.alg.get_policy().parameters())
        self.assertTrue(all(torch.isfinite(p).all() for p in after))
        self.assertTrue(any(not torch.equal(a, b) for a, b in zip(before, after)))
        env.close()

    def test_mirror(self):
        """The mirror image of the mirror image is the thing itself, and no thing is its own."""
        env = rsl_rl.Env(4)
        observations, actions = env.get_observations(), torch.randn(4, 12)
        both, moves = env.mirror(observations, actions)
        twice, again = env.mirror(both[4:], moves[4:])
        self.assertTrue(torch.equal(twice["policy"][4:], observations["policy"]))
        self.assertTrue(torch.equal(again[4:], actions))
        self.assertFalse(torch.equal(moves[4:], actions))
        env.close()

    def test_policy_file(self):
        """A policy of rsl_rl, with statistics of its observations, is a policy of mild: `mild eval` acts as it does."""
        torch.manual_seed(1)
        env = rsl_rl.Env(8, config="configs/quick.ini", overrides=SHORT)
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            runner = OnPolicyRunner(env, {**CONFIG, "logger": "tensorboard"}, log_dir=folder, device="cpu")
            runner.learn(2)
            policy, path, actions = runner.get_inference_policy(device="cpu"), folder + "/p.safetensors", folder + "/a.csv"
            runner.save(folder + "/model.pt")
            program = [sys.executable, "-m", "mild"]
            said = subprocess.run([sys.executable, "-m", "mild.rsl_rl", folder + "/model.pt", "--config", "configs/quick.ini", "--out", path],
                                  check=True, capture_output=True, text=True).stdout
            self.assertEqual(said, f"mild eval --policy {path}\n")
            subprocess.run([*program, "eval", "--policy", path, "--ground", "foam45", "--speed", "0.5", "--trials", "2", "--seconds", "1", "--actions",
                            actions], check=True, stdout=subprocess.DEVNULL)
            env.save(folder + "/model.pt", folder + "/q.safetensors")
            saved = torch.load(folder + "/model.pt", weights_only=True)
            with self.assertRaisesRegex(ValueError, "no actor"):
                env.save({"critic_state_dict": saved["critic_state_dict"]}, folder + "/r.safetensors")
            sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "export"))
            import recorded
            worst, seen = 0, 0
            for trial in recorded.trials(actions):
                frames = np.tile(trial.observation[0], (40, 1))
                for frame, action in zip(trial.observation, trial.action):
                    history = np.concatenate([frames.reshape(5, 8, -1).mean(axis=1).ravel(), frame]).astype(np.float32)
                    frames = np.vstack([frames[1:], frame])
                    with torch.inference_mode():
                        wanted = policy({"policy": torch.from_numpy(history)[None], "critic": torch.zeros(1, 104)})[0].clip(-8, 8).numpy()
                    worst, seen = max(worst, abs(wanted - action).max()), seen + 1
        print(f"rsl_rl's policy in mild eval: {seen} actions, apart by at most {worst:.1e}")
        self.assertGreater(seen, 40)
        self.assertLess(worst, 1e-5)
        env.close()

    def test_misuse(self):
        env = rsl_rl.Env(2)
        with self.assertRaisesRegex(ValueError, "action"):
            env.step(torch.zeros(2, 11))
        env.close()
        with self.assertRaisesRegex(RuntimeError, "closed"):
            env.step(torch.zeros(2, 12))
        with self.assertRaisesRegex(ValueError, "task.vx"):
            rsl_rl.Env(2, overrides={"task.vxy": 1})


class StableBaselines(unittest.TestCase):
    def test_check_env(self):
        check_env(gym.Env(overrides=SHORT), skip_render_check=True)

    def test_terminal_observation(self):
        env, other = sb3.Env(4, overrides=SHORT), gym.VectorEnv(4, overrides=SHORT)
        env.seed(5)
        np.testing.assert_array_equal(env.reset(), other.reset(seed=5)[0])
        ended = 0
        for step in range(150):
            actions = np.sin(0.3 * step + np.arange(48)).reshape(4, 12)
            observation, reward, done, infos = env.step(actions)
            seen, paid, over, truncated, info = other.step(actions)
            np.testing.assert_array_equal(observation, seen)
            for i in np.flatnonzero(done):
                np.testing.assert_array_equal(infos[i]["terminal_observation"], info["final_obs"][i])
                self.assertEqual(infos[i]["TimeLimit.truncated"], truncated[i])
                ended += 1
        self.assertGreater(ended, 4)
        env.close()
        other.close()


    def test_example(self):
        """What examples/python/train_sb3.py saves walks as what it has trained: policy and statistics of the observations. A folder
        that is there is left alone."""
        example = pathlib.Path(__file__).parents[2] / "examples/python/train_sb3.py"
        with tempfile.TemporaryDirectory() as folder:
            def run(*arguments):
                return subprocess.run([sys.executable, example, *arguments], cwd=folder, capture_output=True, text=True)
            self.assertIn("'snad'", run("2000", "--ground", "snad", "--out", "o").stderr)  # and leaves no folder
            trained = run("2000", "--envs", "8", "--out", "o")
            self.assertEqual(trained.returncode, 0, trained.stderr)
            said = trained.stdout.splitlines()[-1]
            self.assertRegex(said, "of 10 stay on their feet for 20 s")
            self.assertEqual(run("--load", "o").stdout.splitlines()[-1], said)
            kept = {path.name: path.read_bytes() for path in pathlib.Path(folder, "o").iterdir()}
            self.assertEqual(set(kept), {"policy.zip", "normalize.pkl"})
            again = run("2000", "--out", "o")
            self.assertEqual((again.returncode, "o exists" in again.stderr), (2, True))
            self.assertEqual(kept, {path.name: path.read_bytes() for path in pathlib.Path(folder, "o").iterdir()})
            model, env = PPO.load(pathlib.Path(folder, "o/policy.zip")), sb3.Env(2, config="configs/quick.ini")
            scaled = VecNormalize.load(pathlib.Path(folder, "o/normalize.pkl"), env)
            self.assertGreater(scaled.obs_rms.count, 1999)
            raw = env.reset()
            self.assertGreater(np.abs(model.predict(scaled.normalize_obs(raw), deterministic=True)[0]
                                      - model.predict(raw, deterministic=True)[0]).max(), 0.001)
            env.close()


if __name__ == "__main__":
    print("rsl-rl-lib", importlib.metadata.version("rsl-rl-lib"), "stable-baselines3",
          importlib.metadata.version("stable-baselines3"), "torch", torch.__version__)
    unittest.main()
