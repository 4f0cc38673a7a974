"""Trains by PPO of Stable-Baselines3, on the CPU. python train_sb3.py [STEPS]"""
import sys

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from mild.sb3 import Env

steps = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000_000
env = VecNormalize(VecMonitor(Env(256, config="configs/quick.ini")), norm_reward=False)
model = PPO("MlpPolicy", env, n_steps=24, batch_size=1536, n_epochs=5, gamma=0.99, gae_lambda=0.95, learning_rate=3e-4, verbose=1,
            device="cpu", policy_kwargs={"net_arch": [256, 128], "activation_fn": torch.nn.ELU, "log_std_init": -0.5})
model.learn(steps)
model.save("runs/sb3")
env.close()
