"""Soft ground in MuJoCo Warp: mild.Batch under the feet of all worlds, on their device (docs/python.md).

    ground = mild.warp.Ground(model, m, d, feet=["left_foot", "right_foot"], ground=["sand_loose", "foam45"])
    ground.step()                                          # in the place of mujoco_warp.step(m, d)

mild.mjlab and mild.newton stand on it."""
import contextlib

import mujoco
import mujoco_warp as mjw
import numpy as np
import warp as wp

from . import Batch
from ._soles import feet_of, frame_of, geoms_of
from ._warp_kernels import add_damping, add_limits, apply, approach, contact_kernel, forget

EULER, IMPLICIT = int(mujoco.mjtIntegrator.mjINT_EULER), int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)


class Ground:
    """The ground under the feet of a model in MuJoCo Warp. It acts once in each physics step, where MuJoCo Warp calls its control
    callback, when M and the bias forces exist; in a CUDA graph of a step it is captured with it.

    wrench, foot: Warp arrays (worlds, feet, 6) of the last step: force and torque of the ground [N, N m], and pressure centre, largest
    and mean depth, area [m, m^2]. material: (worlds,), which of the grounds each world has; it may be assigned."""

    def __init__(self, model, m, d, feet, ground="sand_loose", *, soles=None, through=(), exclude=True, timestep=None):
        """model: the mujoco.MjModel of m and d, which are MuJoCo Warp's; of two devices, theirs. feet: 1 .. 4 names of bodies or sites, z
        up from the sole. ground: a preset, a soil's file, a Material, or a list of them, which the worlds take in turn. soles: None: the
        geoms of a foot's body give its sole, as they do in mild.attach; a regular expression: those geoms of it with such names alone; or
        a list of a mild.Sole for each foot, in its frame. A foot with a single sphere is round. exclude: feet, and the bodies named in
        `through`, no longer touch the world body's geoms or planes and height fields fixed in the world; all else touches them as before.
        timestep: [s] of each step; None: the model's. Raises ValueError with what does not fit."""
        check_options(m)
        self.model, self.m, self.d, self.on = model, m, d, False
        self.timestep = float(timestep or model.opt.timestep)
        bodies, axes, self.soles, self.radius, center = feet_of(model, feet, soles)
        worlds, dofs, feet = d.nworld, model.nv, len(feet)
        self.round, self.device = all(self.radius), m.opt.timestep.device
        self.size = 3 if self.round else 6
        self.batch = Batch(worlds, self.soles, self.timestep, device=str(self.device), points=self.round)
        grounds = list(ground) if isinstance(ground, (list, tuple)) else [ground]
        self.batch.set_materials(grounds)
        dense, moves = layout(model, m, bodies)
        with wp.ScopedDevice(self.device):
            self.body, self.dense, self.moves = (wp.array(a, dtype=int) for a in (bodies, dense.ravel(), moves))
            self.diagonal = wp.array(dense.diagonal(), dtype=int)
            self.center, self.lift = wp.array(center, dtype=wp.vec3), wp.array(self.radius, dtype=float)
            self.axes = wp.array(axes, dtype=wp.mat33)
            self.place, self.turn = wp.zeros((worlds, feet), dtype=wp.vec3), wp.full((worlds, feet), wp.mat33(np.eye(3)), dtype=wp.mat33)
            self.metric, self.jacobian = wp.zeros((worlds, m.nC), dtype=float), wp.zeros((worlds, dofs, feet * self.size + 1), dtype=float)
            self.twist, self.free = (wp.zeros((worlds, 6 * feet), dtype=float) for _ in range(2))
            self.mobility = wp.zeros((worlds, 6 * feet, 6 * feet), dtype=float)
            self.applied, self.given = (wp.zeros((worlds, dofs), dtype=float) for _ in range(2))
            self.wrench, self.foot, self.after = (wp.zeros((worlds, feet, 6), dtype=float) for _ in range(3))
            self.material = wp.array(np.arange(worlds) % len(grounds), dtype=int)
        self.contact = contact_kernel(dofs, feet, self.size)
        self.inputs = [Shared(a) for a in (self.place, self.turn, self.twist.reshape((worlds, feet, 6)), self.mobility,
                                           self.free.reshape((worlds, feet, 6)))]
        self.outputs = {"material": Shared(self.material), "wrench": Shared(self.wrench), "new_velocity": Shared(self.after), "foot": Shared(self.foot)}
        self.low, self.floor = geoms_of(model, [*bodies, *(frame_of(model, name)[0] for name in through)])
        if exclude:
            leave_floor(m, self.low, self.floor)
        m.callback.control = self.act

    @property
    def stream(self):
        return wp.get_stream(self.device).cuda_stream if self.device.is_cuda else 0

    def act(self, m, d):
        """MuJoCo Warp's control callback: adds the ground's forces to qfrc_applied."""
        if not self.on:
            return
        mjw.fwd_actuation(m, d)
        if int(m.opt.integrator) == IMPLICIT:
            mjw.deriv_smooth_vel(m, d, self.metric)  # N, the integrator's
        else:
            wp.copy(self.metric, d.M.reshape(self.metric.shape))
            if not m.opt.disableflags & (mujoco.mjtDisableBit.mjDSBL_EULERDAMP | mujoco.mjtDisableBit.mjDSBL_DAMPER):
                wp.launch(add_damping, dim=(d.nworld, m.nv), inputs=[self.timestep, self.diagonal, m.dof_damping], outputs=[self.metric])
        wp.copy(self.given, d.qfrc_applied)
        wp.copy(self.applied, d.qfrc_applied)
        mjw.xfrc_accumulate(m, d, self.applied)
        worlds, dofs, _ = self.jacobian.shape
        wp.launch(approach, dim=(worlds, len(self.soles), dofs), outputs=[self.place, self.turn, self.jacobian],
                  inputs=[self.body, m.body_rootid, self.center, self.axes, self.moves, self.lift, self.size, d.xpos, d.xmat, d.subtree_com,
                          d.cdof, d.qfrc_passive, d.qfrc_bias, d.qfrc_actuator, self.applied])
        wp.launch(add_limits, dim=worlds, outputs=[self.metric, self.jacobian],
                  inputs=[self.diagonal, m.jnt_dofadr, m.jnt_qposadr, m.jnt_range, d.qpos, d.qacc_warmstart, d.ne, d.nf, d.nl, d.efc.type,
                          d.efc.id, d.efc.D, d.efc.aref])
        wp.launch_tiled(self.contact, dim=worlds, block_dim=32, outputs=[self.mobility, self.twist, self.free],
                        inputs=[self.timestep, self.dense, self.metric, self.jacobian, d.qvel])
        self.batch.step(*self.inputs, **self.outputs, stream=self.stream)
        wp.launch(apply, dim=(worlds, dofs), inputs=[self.size, self.jacobian, self.wrench], outputs=[d.qfrc_applied])

    @contextlib.contextmanager
    def acting(self):
        """A step of MuJoCo Warp within has the ground in it; qfrc_applied is afterwards what it was."""
        self.on = True
        try:
            yield
        finally:
            self.on = False
        wp.copy(self.d.qfrc_applied, self.given)

    def step(self):
        """mujoco_warp.step with the ground."""
        with wp.ScopedDevice(self.device), self.acting():
            mjw.step(self.m, self.d)

    def reset(self, which=None):
        """Worlds whose flag in `which`, a Warp array (worlds,) of uint8, is not 0 stand on fresh ground; None: all."""
        if which is None:
            self.wrench.zero_(), self.foot.zero_()
            self.batch.reset(None, stream=self.stream)
            return
        self.batch.reset(Shared(which), stream=self.stream)
        wp.launch(forget, dim=self.wrench.shape, inputs=[which], outputs=[self.wrench, self.foot], device=self.device)


class Shared:
    """A Warp array as what mild.Batch takes. It has no stream of its own, so that nothing waits while a graph is captured."""

    def __init__(self, array):
        self.array = array

    def __dlpack__(self, **_):
        return self.array.__dlpack__(stream=-1)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


def check_options(m):
    if int(m.opt.integrator) not in (EULER, IMPLICIT):
        raise ValueError("integrator: the ground's step is part of Euler's and implicitfast's; set opt.integrator to one of these")
    if m.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_ACTUATION:
        raise ValueError("actuation: it is disabled, and the ground acts where MuJoCo Warp calls the control; enable it")
    if m.opt.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP:
        raise ValueError("sleep: soft ground moves robots that rest; disable it")


def layout(model, m, bodies):
    """Where each element of the dense M lies in the sparse one, beyond whose end is 0; and which degrees of freedom move which foot."""
    dense = np.full((model.nv, model.nv), m.nC)
    i, j = m.M_fullm_i.numpy(), m.M_fullm_j.numpy()
    dense[i, j] = dense[j, i] = m.M_elemid.numpy()[i, j]
    moves = np.zeros((len(bodies), model.nv), int)
    for foot, body in enumerate(bodies):
        while body:
            moves[foot, model.body_dofadr[body] : model.body_dofadr[body] + model.body_dofnum[body]] = 1
            body = model.body_parentid[body]
    return dense, moves


def leave_floor(m, low, floor):
    """Takes the pairs of low geoms and the floor's out of MuJoCo Warp's collisions."""
    pairs, state = m.nxn_geom_pair.numpy(), m.nxn_pairid.numpy()
    a, b = pairs.T
    state[(low[a] & floor[b]) | (low[b] & floor[a]), 0] = -2  # MuJoCo Warp's mark of a pair that makes no contacts
    kept = (state[:, 0] > -2) | (state[:, 1] >= 0)
    with wp.ScopedDevice(m.nxn_pairid.device):
        m.nxn_pairid = wp.array(state, dtype=wp.vec2i)
        m.nxn_geom_pair_filtered, m.nxn_pairid_filtered = wp.array(pairs[kept], dtype=wp.vec2i), wp.array(state[kept], dtype=wp.vec2i)
