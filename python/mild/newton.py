"""Soft ground under the feet of robots in Newton, whose SolverMuJoCo is MuJoCo Warp; Isaac Lab 3 gives such a solver (docs/python.md).

    solver = newton.solvers.SolverMuJoCo(model)
    ground = mild.newton.attach(solver, feet=["left_foot", "right_foot"], ground=["sand_loose", "foam45"], dt=0.005)
    solver.step(state_0, state_1, control, contacts, 0.005)          # the ground acts in it; solver.reset puts worlds on fresh ground

Attach before a graph of the solver's step is captured."""
import numpy as np
import warp as wp

from ._warp_kernels import FLOOR, LOW, leave_contacts
from .warp import Ground


def attach(solver, feet, ground="sand_loose", *, dt, soles=None, through=()):
    """Puts soft ground under the feet of all worlds of a newton.solvers.SolverMuJoCo; returns the mild.warp.Ground, with the forces.

    feet, through: names of bodies, or what they end with after a '/'. dt: [s], that of every step. The rest: help(mild.warp.Ground).
    The feet no longer touch the floor, and sensors of contact do not feel it: they stand on `ground`. Raises TypeError for what is no
    such solver, ValueError for what does not fit."""
    if not hasattr(solver, "mjw_model") or not hasattr(solver, "use_mujoco_cpu"):
        raise TypeError(f"solver: a {type(solver).__name__}, but it must be a newton.solvers.SolverMuJoCo")
    if solver.use_mujoco_cpu:
        raise ValueError("solver: it runs MuJoCo on the CPU; make it with use_mujoco_cpu=False, or use mild.attach in MuJoCo")
    if hasattr(solver, "soft_ground"):
        raise ValueError("solver: it has soft ground already")
    model = solver.mj_model
    made = Ground(model, solver.mjw_model, solver.mjw_data, [named(solver, name) for name in feet], ground, soles=soles,
                  through=[named(solver, name) for name in through], timestep=dt)
    step, reset, worlds, kinds = solver.step, solver.reset, made.d.nworld, None
    if not solver.mjw_model.opt.run_collision_detection:  # contacts are Newton's, made before the step
        kinds = kinds_of(solver, made)

    def step_with(state_in, state_out, control, contacts, dt, **keys):
        if abs(dt - made.timestep) > 1e-9:
            raise ValueError(f"dt: {dt:g} s, but the ground was attached with {made.timestep:g} s")
        with wp.ScopedDevice(made.device), made.acting():
            if kinds is not None and contacts is not None:
                wp.launch(leave_contacts, dim=contacts.rigid_contact_max, inputs=[contacts.rigid_contact_count, kinds],
                          outputs=[contacts.rigid_contact_shape0, contacts.rigid_contact_shape1])
            step(state_in, state_out, control, contacts, dt, **keys)

    def reset_with(state, world_mask=None, *given, **keys):
        reset(state, world_mask, *given, **keys)
        made.reset(None if world_mask is None else flags_of(world_mask, worlds))

    solver.step, solver.reset, solver.soft_ground = step_with, reset_with, made
    return made


def isaaclab(env, env_ids, feet, ground="sand_loose", soles=None, through=()):
    """An event of Isaac Lab 3 for a task whose physics is newton_mjwarp; the rest is attach's. The forces: NewtonManager._solver.soft_ground.

    cfg.events.ground = EventTermCfg(func=mild.newton.isaaclab, mode="startup", params={"feet": [...], "ground": ["sand_loose", "foam45"]})"""
    from isaaclab_newton.physics import NewtonManager
    attach(NewtonManager._solver, feet, ground, dt=NewtonManager.get_solver_dt(), soles=soles, through=through)
    NewtonManager._invalidate_graph()  # one that was captured before would have no ground


def kinds_of(solver, ground):
    """For each of Newton's shapes whether it is a foot's or passes the floor too (LOW), or the floor's (FLOOR)."""
    shapes, kinds = solver.mjc_geom_to_newton_shape.numpy(), np.zeros(solver.model.shape_count, np.int32)
    for mask, kind in ((ground.low, LOW), (ground.floor, FLOOR)):
        found = shapes[:, mask]
        kinds[found[found >= 0]] = kind
    return wp.array(kinds, dtype=int, device=ground.device)


def flags_of(mask, worlds):
    """A mask of worlds, perhaps with a last element for what belongs to all of them, as bytes; nothing is copied."""
    return wp.array(ptr=mask.ptr, dtype=wp.uint8, shape=worlds, device=mask.device, copy=False)


def named(solver, name):
    """MuJoCo's name of the body whose label is `name`, or the only one whose label ends with it after a '/'."""
    label = {i: solver.model.body_label[body] for i, body in enumerate(solver.mjc_body_to_newton.numpy()[0]) if body >= 0}
    found = [i for i in label if label[i] == name] or [i for i in label if label[i].endswith("/" + name)]
    if len(found) != 1:
        raise ValueError(f"feet: {len(found) or 'no'} bodies are labelled '{name}'; there are {', '.join(label.values())}")
    return solver.mj_model.body(found[0]).name
