"""Trains a walk by PPO of Stable-Baselines3, on the CPU, and walks with it.

python train_sb3.py [STEPS] [--out runs/sb3]     every million steps what there is so far is saved
python train_sb3.py --load runs/sb3              walks with what was trained"""
import argparse
import pathlib

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from mild.sb3 import Env

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("steps", nargs="?", type=int, default=10_000_000)
parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("runs/sb3"))
parser.add_argument("--load", type=pathlib.Path, help="a folder of --out")
parser.add_argument("--config", default="configs/quick.ini")
parser.add_argument("--envs", type=int, default=256)
options = parser.parse_args()


class Save(BaseCallback):
    """The policy sees observations that VecNormalize has scaled: without its statistics the weights are worth nothing."""

    def _on_step(self):
        if self.num_timesteps % 1_000_000 < self.training_env.num_envs:
            save(self.model)
        return True


def save(model):
    for name, write in (("policy.zip", model.save), ("normalize.pkl", model.get_vec_normalize_env().save)):
        write(options.out / ("new." + name))
        (options.out / ("new." + name)).replace(options.out / name)


def train():
    if options.out.exists():
        parser.error(f"{options.out} exists; name another folder by --out")
    options.out.mkdir(parents=True)
    env = VecNormalize(VecMonitor(Env(options.envs, config=options.config)), norm_reward=False)
    model = PPO("MlpPolicy", env, n_steps=24, batch_size=6 * options.envs, n_epochs=5, gamma=0.99, gae_lambda=0.95, learning_rate=3e-4,
                verbose=1, device="cpu", policy_kwargs={"net_arch": [256, 128], "activation_fn": torch.nn.ELU, "log_std_init": -0.5})
    model.learn(options.steps, callback=Save())
    save(model)
    env.close()


def walk(folder):
    """Ten robots, without help or pushes, for 20 s: how many stay on their feet, and how far are their speeds from the commands?"""
    robots = Env(10, config=options.config, overrides={"task.assist": False, "task.episode": 1000, "randomize.push_interval": 0})
    robots.seed(2)
    env, policy = VecNormalize.load(folder / "normalize.pkl", robots), PPO.load(folder / "policy.zip", device="cpu")
    env.training = False
    observation, fallen = env.reset(), np.zeros(10, bool)
    for _ in range(2000):
        observation, _, done, infos = env.step(policy.predict(observation, deterministic=True)[0])
        fallen |= done & [not info.get("TimeLimit.truncated") for info in infos]
    means = robots.envs.statistics()
    print(f"{10 - fallen.sum()} of 10 stay on their feet for 20 s; {means['falls']} falls, speed error {means['speed_error']:.3f} m/s")
    env.close()


if not options.load:
    train()
walk(options.load or options.out)
