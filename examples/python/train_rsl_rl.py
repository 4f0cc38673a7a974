"""Trains a walk on soft ground by rsl_rl's own PPO, and walks with it. python train_rsl_rl.py [--device cuda:0 --envs 4096]"""
import argparse

import torch
from rsl_rl.runners import OnPolicyRunner

from mild.rsl_rl import Env

parser = argparse.ArgumentParser()
parser.add_argument("--device", default="cuda:0" if torch.cuda.is_available() else "cpu")
parser.add_argument("--envs", type=int, default=4096)
parser.add_argument("--iterations", type=int, default=1500)
parser.add_argument("--config", default="configs/quick.ini")
parser.add_argument("--log", default="runs/rsl_rl")
options = parser.parse_args()

network = {"class_name": "MLPModel", "hidden_dims": [512, 256, 128], "activation": "elu", "obs_normalization": True}
config = {
    "num_steps_per_env": 24, "save_interval": 100, "logger": "tensorboard",
    "obs_groups": {"actor": ["policy"], "critic": ["policy", "critic"]},
    "actor": {**network, "distribution_cfg": {"class_name": "GaussianDistribution", "init_std": 0.6}},
    "critic": dict(network),
    "algorithm": {"class_name": "PPO", "num_learning_epochs": 5, "num_mini_batches": 4, "learning_rate": 1e-3, "schedule": "adaptive",
                  "desired_kl": 0.01, "gamma": 0.99, "lam": 0.95, "clip_param": 0.2, "entropy_coef": 0.002, "value_loss_coef": 1.0,
                  "use_clipped_value_loss": True, "max_grad_norm": 1.0}}
env = Env(options.envs, device=options.device, config=options.config)
runner = OnPolicyRunner(env, config, log_dir=options.log, device=options.device)
runner.learn(options.iterations)
env.close()

# Walk: no help, no pushes, a speed of 0.5 m/s; how often does it fall, and how fast is it?
walk = Env(64, device=options.device, config=options.config, log_every=0, seed=2, overrides={
    "task.vx": (0.5, 0.5), "task.wz": (0, 0), "task.assist": False, "task.episode": 10, "randomize.push_interval": 0})
policy, observations = runner.get_inference_policy(device=options.device), walk.get_observations()
with torch.inference_mode():
    for _ in range(2 * walk.max_episode_length):
        observations, *_ = walk.step(policy(observations))
found = walk.statistics()
print(f"{found['episodes']} episodes, {found['falls']} falls, speed error {found['speed_error']:.3f} m/s")
