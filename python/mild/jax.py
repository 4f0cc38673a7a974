"""The batch ground inside jax.jit, by XLA's foreign functions: for MJX and simulators of your own in JAX (docs/python.md)."""
import jax
import jax.numpy as jnp
import numpy as np

from . import _ground

NAME = "mild_batch_step"
for _platform, _handler in zip(("cpu", "CUDA"), _ground._xla_steps()):
    jax.ffi.register_ffi_target(NAME, _handler, platform=_platform)


def step(batch, position, rotation, velocity, inverse_inertia, free_velocity, *, material=None, height=None, map_origin=None, begin=None, advance=True):
    """A contact step of every robot of a mild.Batch; returns (wrench, new_velocity, foot), float32 (robots, feet, 6) each.

    Arrays are those of Batch.step, of JAX, traced or not. begin: (robots,) bool, robots that begin anew before the step, on ground that
    remembers nothing. The ground's memory is in the batch, not among JAX's values: each run of the compiled function is a step, and
    what is jitted keeps to the order in which its arrays depend on each other, as in lax.scan. There are no derivatives and no vmap:
    the batch is the vmap. The batch must live while compiled functions have it, and lies where they run: device="cpu" or "cuda"."""
    n, feet = batch.robots, batch.feet
    like = [jax.ShapeDtypeStruct((n, feet, 6), jnp.float32)] * 3
    material = jnp.zeros((n, 1), jnp.int32) if material is None else jnp.asarray(material, jnp.int32).reshape(n, -1)
    height = jnp.zeros(n, jnp.float32) if height is None else jnp.asarray(height, jnp.float32)
    map_origin = jnp.zeros((n, 2), jnp.float32) if map_origin is None else jnp.asarray(map_origin, jnp.float32)
    flags = jnp.zeros(n, bool) if begin is None else jnp.asarray(begin, bool)
    inputs = [jnp.asarray(array, jnp.float32) for array in (position, rotation, velocity, inverse_inertia, free_velocity)]
    call = jax.ffi.ffi_call(NAME, like, has_side_effect=True)
    return tuple(call(*inputs, material, height, map_origin, flags, batch=np.int64(_ground._xla_number(batch)), advance=np.bool_(advance),
                      begins=np.bool_(begin is not None)))
