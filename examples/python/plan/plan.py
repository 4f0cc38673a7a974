"""Walks without a network: sampling MPC over the batch engine. Every 20 ms the plant's state is put into thousands of environments, which
try different plans of joint targets for half a second, around those of a gait or (--policy) of a policy; the best ones are averaged
(predictive sampling, CEM or MPPI, by `elite` and `temperature`), the first 20 ms are done, and the plan is shifted.

    python examples/python/plan/plan.py --robot go1 --ground foam45 --device cuda --samples 2048

Costs are the rewards of the task (docs/task.md, section 8). Their weights, the gait and the numbers of the planner are in plan.json. On
the CPU it needs NumPy, on a GPU PyTorch."""
import argparse
import json
import math
import pathlib
import sys
import time
import types

import numpy as np

from gait import Gait, Policy, robot_ini
from mild.envs import DATA, open_envs

HERE = pathlib.Path(__file__).resolve().parent
PERIOD = 0.01  # [s] policy step
# Nothing is drawn but how an episode begins.
KEYS = {"train.robots": "batch", "train.grounds": 1, "task.assist": False, "task.observe_noise": False, "task.episode": 1000,
        "task.command_interval": 1000, "task.velocity_scale": 1, "task.shells_stand": False, "task.history_stride": 1,
        "task.vy": (0, 0), "task.wz": (0, 0),
        "task.standing_share": 0, "task.backward_share": 0, "task.straight_share": 1, "reward.clip_sum": False,
        "randomize.patch_share": 0, "randomize.preset_jitter": 0, "randomize.slip_share": 0, "randomize.sinkage_max": 1,
        "randomize.base_mass": (0, 0), "randomize.com_offset": 0, "randomize.link_mass": (1, 1), "randomize.armature": (1, 1),
        "randomize.motor_offset": 0, "randomize.gain": (1, 1), "randomize.strength": (1, 1), "randomize.latency": (0, 0),
        "randomize.push_interval": 0, "randomize.mu": (0.8, 0.8)}


def ground_keys(ground):
    soft = ground != "rigid"
    return {"randomize.rigid_share": int(not soft), "randomize.preset_share": int(soft), "randomize.presets": ground if soft else ""}


class Arrays:
    """NumPy, or PyTorch on a GPU."""

    def __init__(self, device):
        self.gpu = device != "cpu"
        if self.gpu:
            import torch
            self.xp, self.device = torch, torch.device(device)
        else:
            self.xp, self.random = np, np.random.default_rng(0)

    def zeros(self, *shape, dtype="float32"):
        return self.xp.zeros(shape, dtype=getattr(self.xp, dtype), **({"device": self.device} if self.gpu else {}))

    def normal(self, *shape):
        return self.xp.randn(shape, device=self.device) if self.gpu else self.random.standard_normal(shape, np.float32)

    def of(self, x):
        return self.xp.as_tensor(np.float32(x), device=self.device) if self.gpu else np.float32(x)

    def host(self, x):
        return x.cpu().numpy() if self.gpu else x

    def sort(self, x):
        return self.xp.sort(x, dim=-1).values if self.gpu else np.sort(x)

    def stream(self):
        return self.xp.cuda.current_stream().cuda_stream if self.gpu else 0

    def graph(self, work):
        """`work` as one launch: on a GPU a captured graph."""
        if not self.gpu:
            return work
        torch = self.xp
        side = torch.cuda.Stream()
        side.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(side):
            work()
        torch.cuda.synchronize()
        graph = torch.cuda.CUDAGraph()
        try:
            with torch.cuda.graph(graph, stream=torch.cuda.Stream(), capture_error_mode="thread_local"):
                work()
            return graph.replay
        except RuntimeError as error:
            print(f"no graph: {error}", flush=True)
            return work


class Robots:
    """Environments and the arrays that their steps write."""

    def __init__(self, arrays, count, robot, keys, device, seed=1, threads=None):
        self.arrays = arrays
        self.envs = e = open_envs(count, robot=robot, overrides=keys, device=device, seed=seed, threads=threads)
        flags = {name: arrays.zeros(count, dtype="uint8") for name in ("done", "timeout", "valid")}
        self.done, self.reward = flags["done"], arrays.zeros(count)
        self.frame, self.estimate = arrays.zeros(count, e.observation), arrays.zeros(count, e.estimates)
        self.history, self.qpos = arrays.zeros(count, e.frames, e.observation), arrays.zeros(count, 7 + e.actions)
        self.buffers = e.buffers(history=self.history, reward=self.reward, frame=self.frame, estimate=self.estimate, **flags)
        e.reset(self.buffers, arrays.stream())

    def step(self, action):
        self.envs.step(action, self.buffers, self.arrays.stream())

    def read(self):
        self.envs.read(qpos=self.qpos, stream=self.arrays.stream())
        return self.qpos

    def close(self):
        self.envs.close()


def yaw_of(xp, qpos):
    w, x, y, z = (qpos[:, 3 + i] for i in range(4))
    return xp.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


class Planner:
    """Plans for `trials` robots at once, from their blocks and clocks."""

    def __init__(self, arrays, plant, robots, gait, numbers, own_ground, policy=None):
        self.arrays, self.plant, self.robots, self.gait, self.policy = arrays, plant, robots, gait, policy
        self.numbers, self.own_ground = numbers, own_ground
        self.trials = trials = plant.envs.envs
        self.samples, self.joints = robots.envs.envs // trials, robots.envs.actions
        self.steps, self.every = round(numbers["horizon"] / PERIOD), numbers["every"]
        knots = numbers["knots"]
        scale = (knots - 1) / (self.steps - 1)  # knots per step
        self.basis = arrays.of(self.hats(np.arange(self.steps) * scale, knots))
        self.shift = arrays.of(self.hats(np.arange(knots) + self.every * scale, knots) * numbers["keep"])
        self.sigma = arrays.of(gait.by_name(gait.joints, numbers["noise"]) / gait.scale)
        self.mean = arrays.zeros(trials, knots, self.joints)
        self.nominal, self.swings = (arrays.zeros(self.steps, trials, self.joints) for _ in range(2))
        self.feedback = arrays.of(np.hstack(gait.feedback))
        self.start = arrays.zeros(3, trials)  # x, y, yaw of the line that is walked
        self.score, self.first = arrays.zeros(trials, self.samples), arrays.zeros(self.every, trials, self.joints)
        self.wanted = arrays.of([gait.asked, 0])  # [m/s] of the base
        self.noise, self.run = arrays.zeros(trials, self.samples, knots, self.joints), None

    @staticmethod
    def hats(at, knots):
        return np.maximum(0, 1 - abs(np.minimum(at, knots - 1)[:, None] - np.arange(knots)))

    def follow(self, robots, action, t):
        """An action [trials, any, joints] of step t with the gait's answer to the errors of robots: velocity, turning, tilt;
        or with what the policy does."""
        if self.policy:
            return action + self.policy.act(robots.history).reshape(self.trials, -1, self.joints)
        frame, velocity = robots.frame[:, :9], robots.estimate[:, :2] - self.wanted
        answer = (velocity @ self.feedback[:2] + frame @ self.feedback[2:]).reshape(self.trials, -1, 2 * self.joints)
        return action + answer[:, :, :self.joints] + answer[:, :, self.joints:] * self.swings[t][:, None]

    def rollout(self, plans):
        """Scores [trials, samples] of knots [trials, samples, knots, joints]."""
        xp, n, robots = self.arrays.xp, self.numbers, self.robots
        actions = xp.einsum("tk,mnkj->tmnj", self.basis, plans) + self.nominal[:, :, None]
        robots.envs.fork(self.blocks, own_ground=self.own_ground, stream=self.arrays.stream())
        alive, score = self.arrays.zeros(robots.envs.envs) + 1, self.arrays.zeros(robots.envs.envs)
        for t in range(self.steps):
            robots.step(self.follow(robots if t else self.plant, actions[t], t).reshape(-1, self.joints))
            alive = alive * (robots.done == 0)
            velocity = robots.estimate[:, :2] - self.wanted
            cost = n["speed"] * (velocity * velocity).sum(-1)
            score += alive * (robots.reward - PERIOD * cost) - n["fall"] * PERIOD * (1 - alive)
        qpos, (x, y, yaw) = robots.read(), self.start[:, :, None]
        turned = (yaw_of(xp, qpos).reshape(self.trials, -1) - yaw + math.pi) % (2 * math.pi) - math.pi
        place = qpos.reshape(self.trials, self.samples, -1)
        side = (place[:, :, 1] - y) * xp.cos(yaw) - (place[:, :, 0] - x) * xp.sin(yaw)
        line = n["heading"] * turned * turned + n["side"] * side * side
        return (score - alive * line.reshape(-1)).reshape(self.trials, self.samples)

    def improve(self):
        xp, n = self.arrays.xp, self.numbers
        plans = self.mean[:, None] + self.sigma * self.noise
        plans[:, 0] = self.mean
        plans[:, 1] = 0
        score = self.rollout(plans)
        ranked = self.arrays.sort(score)
        best, least = ranked[:, -1:], ranked[:, -max(1, round(n["elite"] * self.samples)), None]
        elite = score >= least
        spread = ((best - score) * elite).sum(-1)[:, None] / elite.sum(-1)[:, None] + 1e-6
        weight = xp.exp((score - best) / (n["temperature"] * spread)) * elite
        weight = (weight / weight.sum(-1)[:, None]).reshape(self.trials, self.samples)
        self.score[:] = score
        self.mean[:] = xp.einsum("mn,mnkj->mkj", weight, plans)
        self.first[:] = xp.einsum("tk,mkj->tmj", self.basis[: self.every], self.mean) + self.nominal[: self.every]
        self.mean[:] = xp.einsum("lk,mkj->mlj", self.shift, self.mean)

    def plan(self, blocks, phase):
        """Actions [every, trials, joints] of the next steps."""
        clock = phase + np.arange(self.steps)[:, None] * PERIOD / self.gait.period
        nominal, swings = self.gait.actions(clock)
        self.nominal[:], self.swings[:] = self.arrays.of(nominal * (not self.policy)), self.arrays.of(swings)
        self.noise[:] = self.arrays.normal(*self.noise.shape)
        if self.run is None:
            self.blocks = blocks
            self.run = self.arrays.graph(self.improve)
            self.mean[:] = 0
        self.run()
        return self.first


def walk(given, numbers, log=print):
    """Trials side by side; returns what became of each, and the time that a plan takes."""
    robot, speed, device, believes = given.robot, given.speed * (not given.jump), given.device, given.believes or given.ground
    arrays = Arrays(device)
    keys = {**KEYS, **numbers["keys"], "task.vx": (speed, speed), "task.gait_period": numbers["gait"]["period"]}
    keys.update({**numbers["jump"]["keys"], "task.jump": (given.jump, given.jump), "task.jump_start": given.jump} if given.jump else {})
    policy = Policy(arrays, given.policy, robot) if given.policy else None
    keys.update(policy.keys if policy else {})
    plant = Robots(arrays, given.trials, robot, {**keys, **ground_keys(given.ground)}, device, given.seed, given.threads)
    # A GPU's time for a plan depends on the number of its steps, so the tried plans may have longer ones than the plant.
    tried = {**keys, **ground_keys(believes), **numbers["planner"].get("keys", {})}
    robots = Robots(arrays, given.trials * given.samples, robot, tried, device, given.seed, given.threads)
    gait = Gait(robot_ini(plant.envs.model), numbers["gait"], speed)
    numbers = {**numbers["planner"], **(numbers["jump"]["planner"] if given.jump else {})}
    planner = Planner(arrays, plant, robots, gait, numbers, bool(given.believes), policy)
    blocks = arrays.zeros(given.trials, plant.envs.block_bytes, dtype="uint8")
    start = np.array(arrays.host(plant.read()))
    yaw = yaw_of(np, start)
    planner.start[:] = arrays.of(np.stack([start[:, 0], start[:, 1], yaw]))
    clock = np.array(arrays.host(plant.frame))[:, -2:]
    phase = np.arctan2(clock[:, 0], clock[:, 1]) / (2 * np.pi)
    alive, upright, moved, times, path = np.ones(given.trials, bool), np.zeros(given.trials), np.zeros((3, given.trials)), [], []
    for k in range(round(given.seconds / PERIOD / planner.every)):
        before = time.perf_counter()
        plant.envs.save(blocks, stream=arrays.stream())
        actions = planner.plan(blocks, phase)
        arrays.host(actions[0, 0])  # waits for the device
        times.append(1e3 * (time.perf_counter() - before))
        for i in range(planner.every):
            plant.step(planner.follow(plant, actions[i][:, None], i)[:, 0])
            phase = phase + PERIOD / gait.period
            path.append(np.array(arrays.host(plant.read())))
            alive = alive & (arrays.host(plant.done) == 0)
            upright += PERIOD * alive
            (x, y), turned = (path[-1] - start)[:, :2].T, (yaw_of(np, path[-1]) - yaw + np.pi) % (2 * np.pi) - np.pi
            along = np.stack([x * np.cos(yaw) + y * np.sin(yaw), y * np.cos(yaw) - x * np.sin(yaw), turned])
            moved = np.where(alive, along, moved)
        if not alive.any():
            break
        if log and k % round(1 / PERIOD / planner.every) == 0:
            log(f"{k * planner.every * PERIOD:5.1f} s: {alive.sum()} upright, {moved[0].mean():.2f} m, {np.median(times):.1f} ms a plan",
                flush=True)
    plant.close(), robots.close()
    walked = alive & (abs(moved[0] / given.seconds - speed) <= 0.2 * max(speed, 0.1))
    trials = [{"upright": round(float(u), 2), "forward": float(m[0]), "side": float(m[1]), "turned": float(m[2]), "highest": float(h),
               "walked": bool(w)} for u, m, w, h in zip(upright, moved.T, walked, np.max(path, axis=0)[:, 2])]
    return {"robot": robot, "ground": given.ground, "believes": given.believes, "speed": speed, "jump": given.jump, "samples": given.samples,
            "walked": int(walked.sum()), "upright": int(alive.sum()), "trials": trials,
            "plan_ms": float(np.median(times[1:] or times))}, np.array(path)


def film(robot, path, file):
    """qpos [step, 7 + joints] as a video. What is below the surface of the ground is not seen."""
    import mujoco
    from mild.trials import Film
    spec = mujoco.MjSpec.from_file(str(DATA / "robots" / robot / f"{robot}.xml"))
    if all(geom.type != mujoco.mjtGeom.mjGEOM_PLANE for geom in spec.worldbody.geoms):
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.1], rgba=[0.76, 0.7, 0.58, 1])
    model = spec.compile()
    data, pictures = mujoco.MjData(model), Film(file)
    walker = types.SimpleNamespace(robot=types.SimpleNamespace(model=model, base=1), data=data, height=path[0, 2])
    for k, data.qpos[:] in enumerate(path):
        data.time = PERIOD * k
        mujoco.mj_forward(model, data)
        pictures.show(walker)
    pictures.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default, words in (
            ("robot", "go1", "sa01, g1 or go1"), ("ground", "rigid", "rigid, or a preset (mild info grounds)"),
            ("believes", "", "a ground that the planner believes in; empty: the true one"), ("speed", 0.5, "[m/s]"), ("seconds", 10.0, "of a walk"),
            ("jump", 0.0, "[m] jumps in place, so high above its nominal height; 0: it walks"),
            ("samples", 2048, "plans that are tried at once"), ("trials", 1, "side by side, with starts of their own"), ("seed", 1, "of the starts"),
            ("device", "cpu", "cpu, cuda or cuda:N"), ("threads", 0, "of the CPU; 0: one per core"),
            ("policy", "", "a policy's file: plans are offsets from its actions, in the gait's place"),
            ("numbers", str(HERE / "plan.json"), "costs and numbers of the planner"), ("video", "", "FILE.mp4 of the first trial"),
            ("path", "", "file for qpos [step, trial, 7 + joints], .npy")):
        parser.add_argument("--" + name, type=type(default), default=default, help=words)
    given = parser.parse_args()
    try:
        numbers = json.loads(pathlib.Path(given.numbers).read_text())
        names = [name for name in numbers if not given.jump or "jump" in numbers[name]]
        if given.robot not in names or given.jump and given.policy:
            parser.error(f"--robot {given.robot}: {given.numbers} has {', '.join(names)}" + ", which jump without --policy" * bool(given.jump))
        result, path = walk(given, numbers[given.robot])
        print(json.dumps(result), flush=True)
        if given.path:
            np.save(given.path, path)
        if given.video:
            film(given.robot, path[:max(1, round(result["trials"][0]["upright"] / PERIOD)), 0], given.video)
    except (ImportError, OSError, RuntimeError, ValueError) as error:
        sys.exit(f"plan: {error}")


if __name__ == "__main__":
    main()
