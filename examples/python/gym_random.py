"""Robots on soft ground in Gymnasium, with random actions. python gym_random.py [ROBOTS]"""
import sys
import time

import gymnasium
import numpy as np

import mild  # registers the environments

robots = int(sys.argv[1]) if len(sys.argv) > 1 else 64
env = gymnasium.make_vec("mild/SA01-v0", num_envs=robots, config="configs/quick.ini", overrides={"task.vx": (0.2, 0.6)})
observations, _ = env.reset(seed=1)
print(f"{env.num_envs} robots, observations {observations.shape}, actions {env.action_space.shape}")

rng, steps = np.random.default_rng(1), 200
start, ends = time.perf_counter(), []
for step in range(steps):
    actions = 0.3 * rng.standard_normal(env.action_space.shape, np.float32)
    observations, rewards, terminated, truncated, info = env.step(actions)
    if info:  # some episodes ended: what the next observation no longer shows
        for i in np.flatnonzero(info["_final_obs"]):
            terms = dict(zip(env.reward_names, info["final_info"]["reward_terms"][i]))
            ends.append((terminated[i], terms["linear_velocity"], terms["orientation"]))
seconds = time.perf_counter() - start
print(f"{robots * steps / seconds:.0f} steps/s; {len(ends)} episodes ended, {sum(fell for fell, *_ in ends)} by a fall")
if ends:
    print("mean sums of the terms: linear_velocity {:.3f}, orientation {:.3f}".format(*np.mean(ends, axis=0)[1:]))
env.close()
