"""mjlab's velocity tasks of Go1 and G1 on soft ground (mild.mjlab): trains them by mjlab's runner for some minutes, and walks on other grounds.
python mjlab_soft.py [Go1|G1] --ground foam45,sand_loose --envs 4096 --minutes 4; --stand 6 needs no training.
Several GPUs, a process and --envs robots each: torchrun --standalone --nproc_per_node 4 mjlab_soft.py G1"""
import argparse
import dataclasses
import os
import time

import numpy as np
import torch
import warp as wp
from mjlab.envs import ManagerBasedRlEnv
from mjlab.rl import RslRlVecEnvWrapper
from mjlab.tasks.registry import load_rl_cfg, load_runner_cls

from mild.mjlab import GROUNDS, ROBOTS, config_of


def stand(env, ground, seconds):
    """Lets the robot's weight come slowly, in the default pose, and compares the sinkage with that of its share on a sole. Joints are
    stiffer than mjlab's and a damper slows the trunk, because without a policy the robot tips over."""
    env.reset()
    soft = env.soft_ground
    action = torch.zeros(env.num_envs, env.action_manager.total_action_dim, device=env.device)
    position, gravity = wp.to_torch(soft.d.qpos), wp.to_torch(soft.m.opt.gravity)
    wp.to_torch(soft.m.actuator_gainprm).mul_(5), wp.to_torch(soft.m.actuator_biasprm).mul_(5)
    wp.to_torch(soft.m.dof_damping)[..., :6] = 1000  # [N s/m, N m s/rad]
    feet = wp.to_torch(soft.d.site_xpos)[:, soft.sites, 2]
    position[:, 2] -= feet.amin(1) - (soft.radius if soft.round else 0)
    for step in range(steps := round(seconds / env.step_dt)):
        gravity[..., 2] = -9.81 * min(1, 2 * step / steps)
        env.step(action)
    load, carried, sunk = env.sim.mj_model.body_subtreemass[1:].max() * 9.81, soft.wrench[0, :, 2], soft.shape[0, :, 4]
    expected = [soft.soles[0].sinkage(ground, max(float(force), 1e-3)) for force in carried]
    print(f"feet carry {carried.sum():.2f} N of {load:.2f}; mean sinkage {1e3 * sunk.mean():.2f} mm, of these loads "
          f"{1e3 * np.mean(expected):.2f} mm, of equal ones {1e3 * soft.soles[0].sinkage(ground, load / len(carried)):.2f} mm", flush=True)


def walk(robot, policy, grounds, speed, device, seconds=10):
    """Ten robots on each ground, with another seed and without noise or pushes, with the command to walk straight ahead."""
    config, twist = config_of(robot, play=True, ground=grounds), {"heading": None, "lin_vel_y": (0, 0), "ang_vel_z": (0, 0)}
    command, config.seed, config.scene.num_envs = config.commands["twist"], 2, 10 * len(grounds)
    command.ranges = dataclasses.replace(command.ranges, lin_vel_x=(speed, speed), **twist)
    command.heading_command, command.rel_standing_envs, command.rel_heading_envs, command.rel_forward_envs = False, 0, 0, 0
    command.resampling_time_range = (1e9, 1e9)
    env = ManagerBasedRlEnv(config, device)
    wrapped, fallen, speeds = RslRlVecEnvWrapper(env), 0, []
    with torch.inference_mode():
        for step in range(round(seconds / env.step_dt)):
            _, _, done, _ = wrapped.step(policy(wrapped.get_observations()))
            fallen = done.bool() | fallen
            speeds.append(env.scene["robot"].data.root_link_lin_vel_b[:, 0].clone())
    mean = torch.stack(speeds[len(speeds) // 5 :]).mean(0)
    for index, ground in enumerate(grounds):
        here = env.soft_ground.material == index
        good = here & ~fallen & (mean > speed / 2)
        print(f"{ground:>12s} {speed:.2f} m/s: {int(good.sum())} of {int(here.sum())} walk, at {mean[here].mean():.3f} m/s", flush=True)


def progress(env, grounds, iteration):
    """How far the robots are from the commanded velocity, by ground, as a share of it: 1 if all stand."""
    asked, has = env.command_manager.get_command("twist")[:, :2], env.scene["robot"].data.root_link_lin_vel_b[:, :2]
    asked_speed, error, on = asked.norm(dim=1), (asked - has).norm(dim=1), env.soft_ground.material
    shares = [float(error[here].mean() / asked_speed[here].mean()) for here in (((on == k) & (asked_speed > 0.3)) for k in range(len(grounds)))]
    print(f"iteration {iteration}: off by " + ", ".join(f"{100 * share:.0f} % on {ground}" for share, ground in zip(shares, grounds)), flush=True)


def time_left(end, device):
    """Whether it is before `end`; of several processes the first one's clock decides, because all must take the same iterations."""
    left = torch.tensor([time.time() < end], device=device)
    if torch.distributed.is_initialized():
        torch.distributed.broadcast(left, 0)
    return bool(left)


def thaw(model):
    """Makes normal tensors of those that rsl_rl's normalizers left as inference tensors: of several processes, learn writes to them when it begins."""
    for module in model.modules():
        module._buffers.update({name: tensor.clone() for name, tensor in module._buffers.items() if tensor is not None})


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("robot", nargs="?", default="Go1", choices=ROBOTS)
    parser.add_argument("--ground", default=",".join(GROUNDS), type=lambda text: text.split(","))
    parser.add_argument("--test", default="foam60,foam45,sand_dense,sand_loose", type=lambda text: text.split(","), help="walked on")
    parser.add_argument("--speed", type=float, default=0.6)
    parser.add_argument("--envs", type=int, default=4096)
    parser.add_argument("--minutes", type=float, default=4)
    parser.add_argument("--load", help="a model_N.pt to go on with")
    parser.add_argument("--out", default="runs/mjlab")
    parser.add_argument("--stand", type=float, default=0, help="seconds")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--device", default=f"cuda:{os.environ.get('LOCAL_RANK', 0)}" if torch.cuda.is_available() else "cpu")
    given = parser.parse_args()
    config, task = config_of(given.robot, ground=given.ground), f"Mjlab-Velocity-Soft-Unitree-{given.robot}"
    config.scene.num_envs, config.seed = given.envs, given.seed + int(os.environ.get("RANK", 0))
    if given.stand:
        config.events.pop("push_robot"), config.events.pop("base_com"), config.terminations.clear(), config.curriculum.clear()
    env = ManagerBasedRlEnv(config, given.device)
    if given.stand:
        stand(env, given.ground[0], given.stand)
        raise SystemExit
    agent = dataclasses.asdict(load_rl_cfg(task)) | {"logger": "tensorboard", "save_interval": 10**6}
    runner = load_runner_cls(task)(RslRlVecEnvWrapper(env), agent, given.out, given.device)
    if given.load:
        runner.load(given.load)
    first, end = int(os.environ.get("RANK", 0)) == 0, time.time() + 60 * given.minutes
    while time_left(end, given.device):
        runner.learn(50, init_at_random_ep_len=runner.current_learning_iteration == 0)
        thaw(runner.alg.actor), thaw(runner.alg.critic)
        if first:
            progress(env, given.ground, runner.current_learning_iteration)
    if first:
        walk(given.robot, runner.get_inference_policy(given.device), given.test, given.speed, given.device)
