"""Soft ground in MJX: mild.jax.step under the feet of all worlds, inside jax.jit and lax.scan (docs/python.md).

    ground = mild.mjx.Ground(spec, feet=["left_foot", "right_foot"], ground=["sand_loose", "foam45"], worlds=1024)
    d = ground.data()                                      # of all worlds
    d, wrench, foot = ground.step(d)                       # in the place of jax.vmap(mjx.step)"""
import jax
import jax.numpy as jnp
import mujoco
from mujoco import mjx

from . import Batch
from . import jax as _jax
from ._soles import feet_of
from .spec import exclude_world

EULER, IMPLICIT = mjx.IntegratorType.EULER, mjx.IntegratorType.IMPLICITFAST


class Ground:
    """The ground under the feet of a model. model: its mujoco.MjModel; m: that of MJX; batch: the mild.Batch with the ground's memory."""

    def __init__(self, spec, feet, ground="sand_loose", *, worlds, soles=None, through=()):
        """spec: a mujoco.MjSpec, which is compiled here. feet: 1 .. 4 names of bodies or sites, z up from the sole. ground: a preset, a soil's
        file, a Material, or a list of them, which the worlds take in turn. soles: as of mild.warp.Ground. The feet and the bodies named in
        `through` no longer touch the world's geoms. Raises ValueError for what does not fit."""
        self.body, self.axes, self.soles, self.radius, self.center = feet_of(spec.compile(), feet, soles)
        for name in through:
            if spec.body(name) is None:
                raise ValueError(f"through: the spec has no body '{name}'")
        exclude_world(spec, [*feet, *through])
        self.model = spec.compile()
        self.m = mjx.put_model(self.model)
        if self.m.opt.integrator not in (EULER, IMPLICIT):
            raise ValueError("integrator: the ground's step is part of Euler's and implicitfast's; set option.integrator to one of these")
        grounds = list(ground) if isinstance(ground, (list, tuple)) else [ground]
        self.batch = Batch(worlds, self.soles, self.model.opt.timestep, device="cpu" if jax.default_backend() == "cpu" else "cuda", points=all(self.radius))
        self.batch.set_materials(grounds)
        self.material = jnp.arange(worlds, dtype=jnp.int32) % len(grounds)

    def data(self):
        """MJX's data of all worlds, at the model's first positions."""
        one = mjx.make_data(self.model)
        return jax.tree.map(lambda value: jnp.broadcast_to(value, (self.batch.robots, *value.shape)), one)

    def step(self, d, *, material=None, begin=None):
        """A step of all worlds with the ground in it: (data, wrench, foot), the latter two (worlds, feet, 6): force and torque of the ground,
        and pressure centre, largest and mean depth, area. material: (worlds,) which of the grounds each has; None: in turn. begin:
        (worlds,) bool, worlds that begin anew, on fresh ground. For jax.jit, as mild.jax.step, whose memory is the batch's too. Products of
        matrices are in full float32, also on GPUs that round what they multiply to 10 bits by default."""
        with jax.default_matmul_precision("highest"):
            return self._step(d, self.material if material is None else material, begin)

    def _step(self, d, material, begin):
        given = d.qfrc_applied
        d, jacobian, *contact = jax.vmap(self.approach)(d)
        wrench, _, foot = _jax.step(self.batch, *contact, material=material, begin=begin)
        d = d.replace(qfrc_applied=given + jnp.einsum("nri,nr->ni", jacobian, wrench.reshape(len(wrench), -1)))
        return jax.vmap(self.finish)(d).replace(qfrc_applied=given), wrench, foot

    def approach(self, d):
        """One world before its accelerations: data, J, and what mild.Batch asks for: positions, rotations, V, A and V_free."""
        m, h = self.m, self.m.opt.timestep
        d = mjx.sensor_pos(m, mjx.fwd_position(m, d))
        d = mjx.fwd_actuation(m, mjx.sensor_vel(m, mjx.fwd_velocity(m, d)))
        metric = mjx.full_m(m, d)  # the integrator's
        if m.opt.integrator == IMPLICIT:
            change = mjx.deriv_smooth_vel(m, d)
            metric = metric if change is None else metric - h * change
        elif not m.opt.disableflags & mjx.DisableBit.EULERDAMP:
            metric = metric + h * jnp.diag(m.dof_damping)
        force = d.qfrc_passive - d.qfrc_bias + d.qfrc_actuator + d.qfrc_applied + mjx.xfrc_accumulate(m, d)
        limits, weight, wanted = limits_of(d)
        metric, force = metric + limits.T * weight @ limits, force + limits.T @ (weight * wanted)
        rows, places, turns = [], [], []
        for body, axes, radius, center in zip(self.body, self.axes, self.radius, self.center):
            place = d.xpos[body] + d.xmat[body] @ jnp.asarray(center, jnp.float32) - jnp.array([0, 0, radius])
            linear, angular = mjx.jac(m, d, place, jnp.asarray(body))
            rows += [linear.T, jnp.zeros_like(angular.T) if radius else angular.T]  # a round foot's sole is a level disc below its centre
            places.append(place)
            turns.append(jnp.eye(3) if radius else d.xmat[body] @ axes)
        jacobian = jnp.concatenate(rows)
        solved = jnp.linalg.solve(metric, jnp.column_stack([jacobian.T, force]))
        velocity, mobility = jacobian @ d.qvel, jacobian @ solved[:, :-1]
        mobility, free = (mobility + mobility.T) / 2, velocity + h * jacobian @ solved[:, -1]
        return d, jacobian, jnp.stack(places), jnp.stack(turns), velocity.reshape(-1, 6), mobility, free.reshape(-1, 6)

    def finish(self, d):
        """The rest of MJX's step."""
        m = self.m
        d = mjx.fwd_acceleration(m, d)
        if d._impl.efc_J.size:
            d = mjx.sensor_acc(m, mjx.solve(m, d))
        else:
            d = d.replace(qacc=d.qacc_smooth)
        return (mjx.implicit if m.opt.integrator == IMPLICIT else mjx.euler)(m, d)


def limits_of(d):
    """Rows, weights and wanted accelerations of constraints; the weight is that of joint limits that pushed at the last acceleration, else 0."""
    inside = d._impl
    pushed = (inside.efc_type == int(mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT)) & (inside.efc_J @ d.qacc_warmstart < inside.efc_aref)
    return inside.efc_J, jnp.where(pushed, inside.efc_D, 0), inside.efc_aref
