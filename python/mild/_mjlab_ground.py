"""mild.Batch as the ground of an environment of mjlab (mild.mjlab)."""
import re

import mujoco
import mujoco_warp as mjw
import numpy as np
import torch
import warp as wp
from mjlab.sensor.contact_sensor import ContactData
from mjlab.sim.sim import _suspend_gc
from mujoco import mjtGeom
from scipy.spatial import ConvexHull

from . import Batch, Sole
from ._mjlab_kernels import add_limits, apply, approach, contact_kernel


class SoftGround:
    """The ground under `env`, on its device. It acts once in each physics step, where MuJoCo Warp calls its control callback, when M and
    the bias forces exist: mjlab_kernels.py. On a GPU the callback runs while mjlab's graph of a step is captured, and is part of it."""

    def __init__(self, env, grounds, feet, soles, entity="robot", sensor="feet_ground_contact"):
        """feet: names of sites, in the order of `sensor`. soles: a regular expression of the geoms that they stand on; a foot has
        one sphere, or capsules."""
        self.env, self.sim, model, n = env, env.sim, env.sim.mj_model, env.num_envs
        self.m, self.d, self.on = self.sim.wp_model, self.sim.wp_data, False
        self.sites = [site_of(model, f"{entity}/{name}") for name in feet]
        body = [int(model.site_bodyid[site]) for site in self.sites]
        geoms = [[g for g in range(model.ngeom) if model.geom_bodyid[g] == b
                  and re.fullmatch(soles, model.geom(g).name.removeprefix(f"{entity}/"))] for b in body]
        self.round = is_round(model, feet, geoms, soles)
        self.radius = float(model.geom_size[geoms[0][0], 0])
        self.soles = [sole_of(model, g, self.radius, self.round) for g in geoms]
        self.batch = Batch(n, self.soles, model.opt.timestep, device=str(env.device), points=self.round)
        self.batch.set_materials(grounds)
        self.material = (torch.arange(n, device=env.device) % len(grounds)).int()
        feet, dofs, rows, self.size = len(body), model.nv, 6 * len(body), 3 if self.round else 6
        dense = np.full((dofs, dofs), self.m.nC)  # where M's element lies in the sparse M; beyond its end: 0
        i, j = self.m.M_fullm_i.numpy(), self.m.M_fullm_j.numpy()
        dense[i, j] = dense[j, i] = self.m.M_elemid.numpy()[i, j]
        moves = np.zeros((feet, dofs))  # whether a degree of freedom moves a foot
        for f, b in enumerate(body):
            while b:
                moves[f, model.body_dofadr[b] : model.body_dofadr[b] + model.body_dofnum[b]] = 1
                b = model.body_parentid[b]
        with wp.ScopedDevice(self.sim.wp_device):
            self.body, self.dense, self.moves = (wp.array(a, dtype=int) for a in (body, dense.ravel(), moves.astype(int)))
            self.diagonal = wp.array(dense.diagonal(), dtype=int)
            self.center = wp.array([model.geom_pos[g[0]] * self.round for g in geoms], dtype=wp.vec3)
            self.place, self.turn = wp.zeros((n, feet), dtype=wp.vec3), wp.full((n, feet), wp.mat33(np.eye(3)), dtype=wp.mat33)
            self.metric, self.jacobian = wp.zeros((n, self.m.nC), dtype=float), wp.zeros((n, dofs, feet * self.size + 1), dtype=float)
            self.twist, self.free, self.wrench_wp = (wp.zeros((n, rows), dtype=float) for _ in range(3))
            self.mobility = wp.zeros((n, rows, rows), dtype=float)
        self.contact, self.shape, self.after = contact_kernel(dofs, feet, self.size), *(torch.zeros(n, feet, 6, device=env.device) for _ in range(2))
        self.wrench = wp.to_torch(self.wrench_wp).view(n, feet, 6)
        self.inputs = [wp.to_torch(self.place), wp.to_torch(self.turn), wp.to_torch(self.twist).view(n, feet, 6),
                       wp.to_torch(self.mobility), wp.to_torch(self.free).view(n, feet, 6)]
        self.m.callback.control, self.step, self.reset, self.capture = self.act, self.sim.step, self.sim.reset, self.sim.create_graph
        self.sim.step, self.sim.reset, self.sim.create_graph = self.step_with, self.reset_with, self.capture_with
        if sensor is not None:
            env.scene[sensor]._extract_sensor_data = self.sense
        self.step_with(captured=False)  # compiles the kernels
        self.reset_with()
        self.capture_with()

    def act(self, m, d):
        if not self.on:
            return
        mjw.fwd_actuation(m, d)
        mjw.deriv_smooth_vel(m, d, self.metric)  # N = M - h dF/dv, the integrator's
        n, dofs, _ = self.jacobian.shape
        wp.launch(approach, dim=(n, len(self.soles), dofs), outputs=[self.place, self.turn, self.jacobian],
                  inputs=[self.body, m.body_rootid, self.center, self.moves, self.round, self.radius, d.xpos, d.xmat, d.subtree_com,
                          d.cdof, d.qfrc_passive, d.qfrc_bias, d.qfrc_actuator])
        wp.launch(add_limits, dim=n, outputs=[self.metric, self.jacobian],
                  inputs=[self.diagonal, m.jnt_dofadr, m.jnt_qposadr, m.jnt_range, d.qpos, d.qacc_warmstart, d.ne, d.nf, d.nl, d.efc.type,
                          d.efc.id, d.efc.D, d.efc.aref])
        wp.launch_tiled(self.contact, dim=n, block_dim=32, outputs=[self.mobility, self.twist, self.free],
                        inputs=[self.env.physics_dt, self.dense, self.metric, self.jacobian, d.qvel])
        self.batch.step(*self.inputs, material=self.material, wrench=self.wrench, new_velocity=self.after, foot=self.shape,
                        stream=wp.get_stream().cuda_stream if wp.get_device().is_cuda else 0)
        wp.launch(apply, dim=(n, dofs), inputs=[self.size, self.jacobian, self.wrench_wp], outputs=[d.qfrc_applied])

    def step_with(self, captured=True):
        self.on = True
        if captured:
            self.step()
        else:
            with wp.ScopedDevice(self.sim.wp_device):
                mjw.step(self.m, self.d)
        self.on = False

    def capture_with(self):
        self.capture()  # mjlab's own graphs; those of forward and reset stay
        if self.sim.use_cuda_graph:
            with _suspend_gc(), wp.ScopedDevice(self.sim.wp_device), wp.ScopedCapture() as capture:
                self.step_with(captured=False)
            self.sim.step_graph = capture.graph

    def reset_with(self, worlds=None):
        self.reset(worlds)
        which = torch.zeros(self.env.num_envs, dtype=torch.bool, device=self.env.device)
        which[slice(None) if worlds is None else worlds] = True
        self.batch.reset(which, stream=torch.cuda.current_stream().cuda_stream if which.is_cuda else 0)
        self.wrench.masked_fill_(which[:, None, None], 0), self.shape.masked_fill_(which[:, None, None], 0)

    def sense(self):
        """What mjlab's sensor of the feet's contacts reads: forces on the ground."""
        return ContactData(found=(self.shape[..., 5] > 0).float(), force=-self.wrench[..., :3])


def site_of(model, name):
    try:
        return model.site(name).id
    except KeyError:
        raise ValueError(f"feet: the model has no site '{name}'") from None


def is_round(model, feet, geoms, soles):
    """Whether each foot has one sphere (True) or capsules (False) of one radius."""
    for name, mine in zip(feet, geoms):
        if not mine:
            raise ValueError(f"soles: no geom on the body of '{name}' is named '{soles}'")
    kinds = {(int(model.geom_type[g]), len(mine) == 1) for mine in geoms for g in mine}
    if kinds == {(int(mjtGeom.mjGEOM_SPHERE), True)}:
        return True
    if {kind for kind, _ in kinds} != {int(mjtGeom.mjGEOM_CAPSULE)} or len({float(model.geom_size[g, 0]) for mine in geoms for g in mine}) > 1:
        raise ValueError("soles: each foot must have one sphere, or capsules of one radius")
    return False


def sole_of(model, geoms, radius, is_round):
    """Of a sphere, a disc; of capsules, the hull of their ends, in the frame of the body."""
    around = np.arange(32) * np.pi / 16
    circle = radius * np.stack([np.cos(around), np.sin(around)], 1)
    if is_round:
        return Sole(circle)
    axis = np.zeros((len(geoms), 3))
    for i, g in enumerate(geoms):
        mujoco.mju_rotVecQuat(axis[i], np.array([0, 0, model.geom_size[g, 1]]), model.geom_quat[g])
    ends = np.concatenate([model.geom_pos[geoms] + axis, model.geom_pos[geoms] - axis])
    points = (ends[:, None, :2] + circle).reshape(-1, 2)
    return Sole(points[ConvexHull(points).vertices], sole_z=float(ends[:, 2].min() - radius))
