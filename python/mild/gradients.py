"""The contact step of a mild.Ground as a function that PyTorch and JAX differentiate (docs/gradients.md)."""
import copy

import numpy as np

from ._ground import Terrain

INPUTS = "position", "rotation", "velocity", "free_velocity", "inverse_inertia"


class Step:
    """What solves of one ground give by some of their inputs.

    by: names of INPUTS, which are its arrays, and of numbers of its material, if it is level and of one material. What is not named stays as
    the ground has it. What the ground remembers is an input that has no derivative: every call takes what it remembers then, and leaves it.
    A call overwrites the named arrays and numbers of the ground; those of the last call stay in it. Raises ValueError for a wrong name or a
    wrong number of inputs, RuntimeError for a step that has not converged."""

    def __init__(self, ground, by):
        self.ground, self.by = ground, tuple(by)
        self.fields = [name for name in self.by if name not in INPUTS]
        self.shapes = [getattr(ground, name).shape if name in INPUTS else () for name in self.by]
        ground_by = {"pose": {"position", "rotation"} & set(self.by), "velocity": {"velocity"} & set(self.by)}
        self.asked = {name: bool(wanted) for name, wanted in ground_by.items()} | {"fields": self.fields}
        for name in self.fields:
            if not isinstance(getattr(ground.terrain.materials[0], name, None), float):
                raise ValueError(f"by: {name!r} is neither one of {', '.join(INPUTS)} nor a number of a material")
            if len(ground.terrain.materials) != 1 or ground.terrain.map is not None:
                raise ValueError(f"by: {name!r}: the ground must be level and of one material")

    def solve(self, inputs):
        """wrench and new_velocity, (feet, 6) each, and their derivatives by each input, (2, feet, 6) + its shape."""
        ground, feet, dt = self.ground, self.ground.feet, self.ground.dt
        if self.fields:
            state, soil = ground.state, copy.copy(ground.terrain.materials[0])
            for name, value in zip(self.by, inputs, strict=True):
                if name in self.fields:
                    setattr(soil, name, float(value))
            ground.state = state  # ends the step before, so that the terrain changes now
            ground.terrain, ground.state = Terrain(soil, height=ground.terrain.height), state  # and the memory stays that of the call
        for name, value in zip(self.by, inputs, strict=True):
            if name in INPUTS:
                getattr(ground, name)[...] = value
        if not ground.solve():
            raise RuntimeError("gradients: the step has not converged")
        wrench = np.concatenate([ground.force, ground.torque], 1)
        found = ground.derivative(**self.asked)
        slopes = [self._slope(name, shape, found, wrench.ravel(), feet, dt) for name, shape in zip(self.by, self.shapes)]
        return wrench, np.array(ground.new_velocity), slopes

    def _slope(self, name, shape, found, wrench, feet, dt):
        A, rows = self.ground.inverse_inertia, 6 * feet
        if name == "free_velocity":
            both = found["wrench_by_free"], found["velocity_by_free"]
        elif name == "inverse_inertia":  # dV = (1 + A H)^-1 dA P, H = -dt law
            law = np.zeros((rows, rows))
            for f in range(feet):
                law[6 * f:6 * f + 6, 6 * f:6 * f + 6] = found["law"][f]
            moved = np.einsum("ij,k->ijk", np.linalg.inv(np.eye(rows) - dt * A @ law), dt * wrench)
            both = np.tensordot(law, moved, 1), moved
        else:
            force = self._by_motion(name, found, feet) if name in INPUTS else found["wrench_by_material"][:, self.fields.index(name)]
            both = force, dt * np.tensordot(A, force, 1)
        return np.stack(both).reshape((2, feet, 6) + shape)

    def _by_motion(self, name, found, feet):
        if name == "velocity":
            return found["wrench_by_velocity"]
        pose = found["wrench_by_pose"].reshape(-1, feet, 2, 3)
        if name == "position":
            return pose[:, :, 0]
        # a change dR turns by the vector of dR R^T: only what keeps R a rotation counts
        turn, R = np.zeros((feet, 3, 3, 3)), self.ground.rotation
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            turn[:, k, j], turn[:, k, i] = R[:, i] / 2, -R[:, j] / 2
        return np.einsum("rfk,fkij->rfij", pose[:, :, 1], turn)


def torch(ground, by):
    """A function of tensors of float64, one for each name in `by` (Step), that returns (wrench, new_velocity), (feet, 6) each: force and
    torque on each foot [N, N m], its twist after the step. On the CPU. torch.func.vmap solves one after the other. First derivatives only:
    second ones raise RuntimeError. ground.advance() after a call keeps its step."""
    import torch as th

    step = Step(ground, by)

    class First(th.autograd.Function):
        """Products with the slopes, which follow the inputs in a way that nobody computes: no once_differentiable, which torch.func drops."""
        generate_vmap_rule = True

        @staticmethod
        def forward(given, *rest):
            return tuple(th.tensordot(given, slope, 3) for slope in rest[: len(step.by)])

        @staticmethod
        def setup_context(ctx, inputs, output):
            pass

        @staticmethod
        def backward(ctx, *given):
            raise RuntimeError("gradients: first derivatives only")

    class Solve(th.autograd.Function):
        @staticmethod
        def forward(*inputs):
            wrench, velocity, slopes = step.solve([tensor.detach().numpy() for tensor in inputs])
            return tuple(map(th.from_numpy, [wrench, velocity, *slopes]))

        @staticmethod
        def setup_context(ctx, inputs, output):
            ctx.mark_non_differentiable(*output[2:])
            ctx.save_for_backward(*output[2:], *inputs)

        @staticmethod
        def backward(ctx, wrench, velocity, *_):
            return First.apply(th.stack([wrench, velocity]), *ctx.saved_tensors)

        @staticmethod
        def vmap(info, in_dims, *inputs):
            each = [[tensor if axis is None else tensor.select(axis, i) for tensor, axis in zip(inputs, in_dims)] for i in range(info.batch_size)]
            outputs = [th.stack(parts) for parts in zip(*(Solve.apply(*one) for one in each))]
            return tuple(outputs), (0,) * len(outputs)

    return lambda *inputs: Solve.apply(*inputs)[:2]


def jax(ground, by):
    """The same of JAX's arrays, in its jit, grad and vmap (one after the other). With jax_enable_x64 numbers are float64, else float32, which
    the derivatives keep to 1e-6. What the compiled function runs on is the ground as it is then; advance() is not among JAX's values: wait for the results
    (jax.block_until_ready) before it. First derivatives only."""
    import jax as j
    import jax.numpy as jnp

    step = Step(ground, by)
    real = jnp.zeros(0).dtype
    like = [j.ShapeDtypeStruct(shape, real) for shape in [(ground.feet, 6)] * 2 + [(2, ground.feet, 6) + shape for shape in step.shapes]]

    def run(*inputs):
        wrench, velocity, slopes = step.solve([np.asarray(array, float) for array in inputs])
        return tuple(np.asarray(array, real) for array in [wrench, velocity, *slopes])

    def forward(*inputs):
        wrench, velocity, *slopes = j.pure_callback(run, tuple(like), *inputs, vmap_method="sequential")
        return (wrench, velocity), slopes

    @j.custom_vjp
    def solve(*inputs):
        return forward(*inputs)[0]

    solve.defvjp(forward, lambda slopes, given: tuple(jnp.tensordot(jnp.stack(given), slope, 3) for slope in slopes))
    return solve
