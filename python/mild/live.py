"""The ground of a running simulation, changed between two steps: mild.ground(model, data)."""
import ctypes

from . import Material, spec

SIZE = 8192  # bytes of a material as text


class RunningGround:
    """What mild.ground returns. It keeps the model and the data alive."""

    def __init__(self, model, data, name=None):
        self._model, self._data, self._name = model, data, None if name is None else name.encode()
        self._library = ctypes.CDLL(str(spec.load_plugin()))
        self._ends = (ctypes.c_void_p(model._address), ctypes.c_void_p(data._address), self._name)
        self.material()  # there is one

    def material(self, label=0):
        """The Material of now; label: its place in the list that `ground` was, where terrain.patches is given."""
        text = ctypes.create_string_buffer(SIZE)
        if not 0 < self._library.mild_plugin_print(*self._ends, ctypes.c_int(label), text, ctypes.c_int(SIZE)) < SIZE:
            raise ValueError(f"ground: the model has no mild.ground{'' if self._name is None else f' {self._name.decode()!r}'} with a material {label}")
        return Material(**dict(line.split("=", 1) for line in text.value.decode().splitlines()))

    def set(self, ground=None, *, label=0, **numbers):
        """The ground is another one from the next step on. It carries no more than before at first: where it would, its surface
        lies lower under a foot until that lifts off. An imprint of foam is one in sand.

        ground: a preset, a soil's file or a Material; None: as it is. numbers: of the material, such as mu=0.2, over it. label: see
        material(). The ground model stays: a preset of `mild` is matched to it (docs/plugin.md). Raises ValueError for what is
        wrong; then nothing has changed. Not while another thread steps the data."""
        before = self.material(label) if ground is None else ground
        given = {key: spec.text_of(value) for key, value in numbers.items()}
        made = Material(**{**before.as_dict(), **given}) if isinstance(before, Material) else Material(before, **given)
        lines = "".join(f"{key}={value}\n" for key, value in made.as_dict().items())
        if ground is not None:
            lines += f"name={ground if isinstance(ground, str) and not ground.endswith('.ini') else 'own'}\n"
        error = ctypes.create_string_buffer(600)
        if self._library.mild_plugin_change(*self._ends, ctypes.c_int(label), lines.encode(), error, ctypes.c_int(600)):
            raise ValueError(f"ground: {error.value.decode()}")


def ground(model, data, name=None):
    """The ground under a mujoco.MjModel and its MjData, to be read and changed while the simulation runs; see RunningGround.

    name: of the plugin's instance; None: the only one. The change belongs to the data: mj_copyData copies it, mj_resetData and
    mj_setState leave it, and another MjData of the model has the model's own."""
    import mujoco

    if not isinstance(model, mujoco.MjModel) or not isinstance(data, mujoco.MjData):
        raise TypeError(f"ground: a {type(model).__name__} and a {type(data).__name__}, but it takes a mujoco.MjModel and its MjData")
    if data.model is not model and getattr(data.model, "_address", None) != model._address:
        raise ValueError("ground: the data is not one of this model")
    return RunningGround(model, data, name)
