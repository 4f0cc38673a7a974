"""Trains a walk by PPO of Stable-Baselines3, on the CPU, and walks with it.

python train_sb3.py [STEPS] [--out runs/sb3]     every million steps what there is so far is saved
python train_sb3.py --load runs/sb3              walks with what was trained
python train_sb3.py --load runs/sb3 --ground ./mars.ini --video walk.mp4     10 s of it to watch, on a ground of your own (docs/soil.md)"""
import argparse
import pathlib
import subprocess

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
parser.add_argument("--ground", type=lambda text: text.split(","), help="presets and files of soils, these alone (default: what the config draws)")
parser.add_argument("--video", type=pathlib.Path, metavar="FILE.mp4", help="needs MuJoCo's renderer and ffmpeg")
options = parser.parse_args()


class Save(BaseCallback):
    """The policy sees observations that VecNormalize has scaled: without its statistics the weights are worth nothing."""

    def _on_step(self):
        if self.num_timesteps % 1_000_000 < self.training_env.num_envs:
            save(self.model)
        return True


def save(model):
    options.out.mkdir(parents=True, exist_ok=True)
    for name, write in (("policy.zip", model.save), ("normalize.pkl", model.get_vec_normalize_env().save)):
        write(options.out / ("new." + name))
        (options.out / ("new." + name)).replace(options.out / name)


def train():
    if options.out.exists():
        parser.error(f"{options.out} exists; name another folder by --out")
    env = VecNormalize(VecMonitor(Env(options.envs, config=options.config, ground=options.ground)), norm_reward=False)
    model = PPO("MlpPolicy", env, n_steps=24, batch_size=6 * options.envs, n_epochs=5, gamma=0.99, gae_lambda=0.95, learning_rate=3e-4,
                verbose=1, device="cpu", policy_kwargs={"net_arch": [256, 128], "activation_fn": torch.nn.ELU, "log_std_init": -0.5})
    model.learn(options.steps, callback=Save())
    save(model)
    env.close()


CALM = {"task.assist": False, "randomize.push_interval": 0}


def load(folder, robots):
    robots.seed(2)
    env = VecNormalize.load(folder / "normalize.pkl", robots)
    env.training = False
    return env, PPO.load(folder / "policy.zip", device="cpu")


def film(folder, path):
    """One robot for 10 s, every other step a picture."""
    robot = Env(1, config=options.config, ground=options.ground, max_episode_steps=100_000, overrides=CALM, render_mode="rgb_array")
    env, policy = load(folder, robot)
    observation = env.reset()
    height, width = robot.get_images()[0].shape[:2]
    command = ["ffmpeg", "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", "50", "-i", "-",
               "-pix_fmt", "yuv420p", str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as ffmpeg:
        for step in range(1000):
            observation = env.step(policy.predict(observation, deterministic=True)[0])[0]
            if step % 2:
                ffmpeg.stdin.write(robot.get_images()[0].tobytes())
    env.close()


def walk(folder):
    """Ten robots, without help or pushes, for 20 s: how many stay on their feet, and how far are their speeds from the commands?"""
    robots = Env(10, config=options.config, ground=options.ground, max_episode_steps=100_000, overrides=CALM)
    env, policy = load(folder, robots)
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
if options.video:
    film(options.load or options.out, options.video)
