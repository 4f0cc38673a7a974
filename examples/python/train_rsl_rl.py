"""Trains a walk on soft ground by rsl_rl's own PPO, and walks with it. python train_rsl_rl.py [--device cuda:0 --envs 4096]"""
import argparse

import torch
from rsl_rl.runners import OnPolicyRunner

import mild
from mild.rsl_rl import Env

parser = argparse.ArgumentParser()
parser.add_argument("--device", default="cuda:0" if torch.cuda.is_available() else "cpu")
parser.add_argument("--envs", type=int, default=4096)
parser.add_argument("--iterations", type=int, default=1500)
parser.add_argument("--config", default="configs/quick.ini")
parser.add_argument("--log", default="runs/rsl_rl")
parser.add_argument("--load", help="a model_N.pt to begin with")
options = parser.parse_args()

network = {"class_name": "MLPModel", "hidden_dims": [512, 256, 128], "activation": "elu", "obs_normalization": True}
config = {
    "num_steps_per_env": 24, "save_interval": 100, "logger": "tensorboard",
    "obs_groups": {"actor": ["policy"], "critic": ["policy", "critic"]},
    "actor": {**network, "distribution_cfg": {"class_name": "GaussianDistribution", "init_std": 0.6}},
    "critic": dict(network),
    "algorithm": {"class_name": "PPO", "num_learning_epochs": 5, "num_mini_batches": 4, "learning_rate": 1e-3, "schedule": "adaptive",
                  "desired_kl": 0.01, "gamma": 0.994, "lam": 0.95, "clip_param": 0.2, "entropy_coef": 0.001, "value_loss_coef": 1.0,
                  "use_clipped_value_loss": False, "max_grad_norm": 1.0, "symmetry_cfg": {
                      "data_augmentation_func": "mild.rsl_rl:mirror", "use_mirror_loss": True, "mirror_loss_coeff": 1.0}}}
env = Env(options.envs, device=options.device, config=options.config)
runner = OnPolicyRunner(env, config, log_dir=options.log, device=options.device)
if options.load:
    runner.load(options.load, map_location=options.device)
runner.learn(options.iterations)
env.save(runner.alg.save(), f"{options.log}/policy.safetensors")  # for mild eval, play, drive and export
env.close()


# Walk without help or pushes: how many of ten robots stay on their feet for 20 s, and how fast are they?
def walk(policy, ground, speed):
    keys = {"task.vx": (speed, speed), "task.wz": (0, 0), "task.assist": False, "task.episode": 1000, "randomize.push_interval": 0,
            "randomize.patch_share": 0, "randomize.preset_share": 0, "randomize.sinkage_max": 1,
            "randomize.rigid_share": int(ground == "rigid")}
    material = mild.Material("rubber", mu=0.8) if ground == "rigid" else mild.Material(ground)
    for name in ("k_pen", "sigma_cone", "alpha", "nu", "c_g", "c_d", "phi", "mu", "rho", "k_drift", "b_drift", "recovery", "bed_depth"):
        keys["randomize." + name] = (getattr(material, name),) * 2
    robots = Env(10, device=options.device, config=options.config, log_every=0, seed=2, overrides=keys)
    fallen, speeds = torch.zeros(10, dtype=torch.bool, device=options.device), []
    with torch.inference_mode():
        for step in range(2000):
            observations, _, done, extras = robots.step(policy(robots.get_observations()))
            fallen |= done.bool() & ~extras["time_outs"]
            speeds += [observations["critic"][:, -3]] if step >= 200 else []  # smoothed forward speed, docs/task.md section 6
    speeds = torch.stack(speeds).mean(0)[~fallen]
    print(f"{ground:10} {speed:.2f} m/s: {len(speeds)} of 10 walk" + (f", at {speeds.mean().item():.3f} m/s" if len(speeds) else ""))


for kind in ("rigid", "foam45", "sand_loose"):
    walk(runner.get_inference_policy(device=options.device), kind, 0.6)
