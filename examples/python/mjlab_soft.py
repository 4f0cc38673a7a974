"""Soft ground under mjlab's own velocity tasks of Go1 and G1: trains them by mjlab's runner, or lets them stand.
python mjlab_soft.py [Go1|G1] --ground sand_loose --envs 4096 --iterations 1000; --stand 4 needs no training."""
import argparse
import dataclasses

import mjlab.tasks  # noqa: F401 (fills the registry)
import mujoco
import mujoco_warp as mjw
import numpy as np
import torch
import warp as wp
from mjlab.envs import ManagerBasedRlEnv
from mjlab.rl import RslRlVecEnvWrapper
from mjlab.sensor.contact_sensor import ContactData
from mjlab.tasks.registry import load_env_cfg, load_rl_cfg, load_runner_cls

import mild

FEET = {"Go1": ("FR", "FL", "RR", "RL"), "G1": ("left_foot", "right_foot")}  # sites, in the order of mjlab's sensor


def config_of(robot, envs, soft):
    """mjlab's task on flat ground. Feet and calves, which sink, leave the floor's collisions (its bit is 1), and keep the robot's own."""
    config = load_env_cfg(f"Mjlab-Velocity-Flat-Unitree-{robot}")
    config.scene.num_envs = envs
    if soft:
        parts, low = config.scene.entities["robot"], r".*_(foot|calf|shin)\d*_collision\d*"
        parts.collisions = tuple(dataclasses.replace(c, contype={low: 2, ".*": 1}, conaffinity={low: 2, ".*": 3}) for c in parts.collisions)
    return config


class SoftGround:
    """The ground under `env`, in float on its device. It acts in each physics step where MuJoCo calls its control callback, when M and
    the bias forces exist: the feet's twists without ground, A = J N^-1 J^T in the integrator's metric N = M - h dF/dv, a step of
    mild.Batch, and the wrenches as joint forces. Joint limits and other contacts are solved after it."""

    def __init__(self, env, robot, ground):
        self.env, self.robot, model, sim = env, robot, env.sim.mj_model, env.sim
        self.m, self.d, n = sim.wp_model, sim.wp_data, env.num_envs
        self.body = [int(model.site_bodyid[model.site(f"robot/{name}").id]) for name in FEET[robot]]
        self.round = robot == "Go1"
        geoms = [[g for g in range(model.ngeom) if model.geom_bodyid[g] == b and "_foot" in model.geom(g).name] for b in self.body]
        self.radius = float(model.geom_size[geoms[0][0], 0])
        self.center = self.tensor([model.geom_pos[g[0]] if self.round else np.zeros(3) for g in geoms])
        self.soles = [self.sole(model, g) for g in geoms]
        self.batch = mild.Batch(n, self.soles, model.opt.timestep, device=str(env.device))
        self.batch.set_materials([ground])
        dofs, feet = model.nv, len(self.body)
        self.root = [int(model.body_rootid[b]) for b in self.body]
        moves = np.zeros((feet, dofs))  # whether a degree of freedom moves a foot
        for f, body in enumerate(self.body):
            while body:
                first = model.body_dofadr[body]
                moves[f, first : first + model.body_dofnum[body]] = 1
                body = model.body_parentid[body]
        self.moves = self.tensor(moves)[None, :, :, None]
        rows, columns = self.m.M_fullm_i.numpy(), self.m.M_fullm_j.numpy()
        self.place = torch.tensor(np.stack([rows * dofs + columns, columns * dofs + rows]), device=env.device)
        self.element = torch.tensor(self.m.M_elemid.numpy()[rows, columns], device=env.device).long()
        self.metric = wp.empty((n, self.m.nC), dtype=float, device=self.d.M.device)
        self.wrench, self.after, self.shape = (torch.zeros(n, feet, 6, device=env.device) for _ in range(3))
        self.level = torch.eye(3, device=env.device).expand(n, feet, 3, 3).contiguous()
        self.on, self.m.callback.control = False, self.act
        self.step, self.reset = sim.step, sim.reset
        sim.step, sim.reset = self.step_with, self.reset_with
        sim.step_graph = None  # captured before, without the ground; the kernels of a step are launched one by one
        env.scene["feet_ground_contact"]._extract_sensor_data = self.sense

    def tensor(self, numbers):
        return torch.tensor(np.array(numbers), dtype=torch.float32, device=self.env.device)

    def sole(self, model, geoms):
        """Of a sphere, a disc that stays level; of capsules, the hull of their ends, in the frame of the body."""
        around = np.arange(32) * np.pi / 16
        circle = self.radius * np.stack([np.cos(around), np.sin(around)], 1)
        if self.round:
            return mild.Sole(circle)
        axis = np.zeros((len(geoms), 3))
        for i, g in enumerate(geoms):
            mujoco.mju_rotVecQuat(axis[i], np.array([0, 0, model.geom_size[g, 1]]), model.geom_quat[g])
        ends = np.concatenate([model.geom_pos[geoms] + axis, model.geom_pos[geoms] - axis])
        points = (ends[:, None, :2] + circle).reshape(-1, 2)
        return mild.Sole(points[hull(points)], sole_z=float(ends[:, 2].min() - self.radius))

    def act(self, m, d):
        if not self.on:
            return
        mjw.fwd_actuation(m, d)
        mjw.deriv_smooth_vel(m, d, self.metric)
        at = {name: wp.to_torch(getattr(d, name)) for name in ("xpos", "xmat", "subtree_com", "cdof", "qvel", "qfrc_bias",
                                                               "qfrc_passive", "qfrc_actuator", "qfrc_applied")}
        n, dofs = at["qvel"].shape
        turn, place = at["xmat"][:, self.body].view(n, -1, 3, 3), at["xpos"][:, self.body]
        if self.round:
            place = place + (turn @ self.center[:, :, None])[..., 0] - self.tensor([0, 0, self.radius])
        spin, rate = at["cdof"][:, None].split(3, -1)  # motions about the robot's centre of mass, each (worlds, 1, dofs, 3)
        arm = (place - at["subtree_com"][:, self.root])[:, :, None].expand(-1, -1, dofs, -1)
        spin = spin.expand_as(arm)
        jacobian = torch.cat([rate + torch.linalg.cross(spin, arm), torch.zeros_like(spin) if self.round else spin], -1) * self.moves
        jacobian = jacobian.transpose(2, 3).reshape(n, -1, dofs)
        metric = torch.zeros(n, dofs * dofs, device=place.device)
        metric[:, self.place] = wp.to_torch(self.metric)[:, None, self.element]
        factor, _ = torch.linalg.cholesky_ex(metric.view(n, dofs, dofs))  # waits for nothing
        half = torch.linalg.solve_triangular(factor, jacobian.transpose(1, 2), upper=False)
        force = at["qfrc_passive"] - at["qfrc_bias"] + at["qfrc_actuator"]
        gain = torch.linalg.solve_triangular(factor, force[:, :, None], upper=False)
        velocity = jacobian @ at["qvel"][:, :, None]
        free = velocity + self.env.physics_dt * (half.transpose(1, 2) @ gain)
        self.batch.step(place.contiguous(), self.level if self.round else turn.contiguous(), velocity.view(n, -1, 6),
                        half.transpose(1, 2) @ half, free.view(n, -1, 6), wrench=self.wrench, new_velocity=self.after, foot=self.shape,
                        stream=torch.cuda.current_stream().cuda_stream if place.is_cuda else 0)
        at["qfrc_applied"].copy_((self.wrench.view(n, 1, -1) @ jacobian)[:, 0])

    def step_with(self):
        self.on = True
        self.step()
        self.on = False

    def reset_with(self, worlds=None):
        self.reset(worlds)
        which = torch.zeros(self.env.num_envs, dtype=torch.bool, device=self.env.device)
        which[slice(None) if worlds is None else worlds] = True
        self.batch.reset(which, stream=torch.cuda.current_stream().cuda_stream if which.is_cuda else 0)

    def sense(self):
        """What mjlab's sensor of the feet's contacts reads: forces on the ground."""
        return ContactData(found=(self.shape[..., 5] > 0).float(), force=-self.wrench[..., :3])


def hull(points):
    from scipy.spatial import ConvexHull
    return ConvexHull(points).vertices


def stand(env, soft, ground, seconds):
    """Lets the robot's weight come slowly, in the default pose, and compares the sinkage with that of its share on a sole. Joints are
    stiffer than mjlab's and a damper slows the trunk, because without a policy the robot tips over."""
    action = torch.zeros(env.num_envs, env.action_manager.total_action_dim, device=env.device)
    position, gravity = wp.to_torch(soft.d.qpos), wp.to_torch(soft.m.opt.gravity)
    wp.to_torch(soft.m.actuator_gainprm).mul_(5)
    wp.to_torch(soft.m.actuator_biasprm).mul_(5)
    wp.to_torch(soft.m.dof_damping)[..., :6] = 1000  # [N s/m, N m s/rad]
    feet = wp.to_torch(soft.d.site_xpos)[:, [env.sim.mj_model.site(f"robot/{name}").id for name in FEET[soft.robot]], 2]
    position[:, 2] -= feet.amin(1) - (soft.radius if soft.round else 0)
    for step in range(steps := round(seconds / env.step_dt)):
        gravity[..., 2] = -9.81 * min(1, 2 * step / steps)
        env.step(action)
    load = env.sim.mj_model.body_subtreemass[1:].max() * 9.81 / len(soft.soles)
    for world in range(min(env.num_envs, 2)):
        carried, sunk = soft.wrench[world, :, 2], soft.shape[world, :, 4]
        expected = [soft.soles[0].sinkage(ground, max(float(force), 1e-3)) for force in carried]
        print(f"feet carry {carried.sum():.2f} N of {load * len(soft.soles):.2f}; mean sinkage {1e3 * sunk.mean():.2f} mm, of these "
              f"loads {1e3 * np.mean(expected):.2f} mm, of equal ones {1e3 * soft.soles[0].sinkage(ground, load):.2f} mm", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("robot", nargs="?", default="Go1", choices=FEET)
    parser.add_argument("--ground", default="sand_loose")
    parser.add_argument("--envs", type=int, default=4096)
    parser.add_argument("--iterations", type=int, default=1000)
    parser.add_argument("--stand", type=float, default=0, help="seconds")
    parser.add_argument("--device", default="cuda:0" if torch.cuda.is_available() else "cpu")
    given = parser.parse_args()
    config = config_of(given.robot, given.envs, True)
    if given.stand:
        config.events.pop("push_robot"), config.events.pop("base_com")
        config.terminations.clear()
    env = ManagerBasedRlEnv(config, given.device)
    soft = SoftGround(env, given.robot, given.ground)
    if given.stand:
        env.reset()
        stand(env, soft, given.ground, given.stand)
    else:
        agent = dataclasses.asdict(load_rl_cfg(f"Mjlab-Velocity-Flat-Unitree-{given.robot}")) | {"logger": "tensorboard"}
        runner = load_runner_cls(f"Mjlab-Velocity-Flat-Unitree-{given.robot}")(
            RslRlVecEnvWrapper(env), agent, f"runs/mjlab_{given.robot}", given.device)
        runner.learn(given.iterations, init_at_random_ep_len=True)
