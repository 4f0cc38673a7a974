"""Opens the environments of the task (docs/task.md) for the adapters gym, rsl_rl and sb3."""
import collections.abc
import numbers
import os
import pathlib

DATA = pathlib.Path(os.path.abspath(__file__)).parent / "data"


def open_envs(num_envs, *, config=None, overrides=None, robot="sa01", device="cpu", seed=1, threads=0):
    """_envs.Envs with `num_envs` environments.

    config: a file over configs/default.ini, one of the package such as configs/quick.ini, or None. overrides: {"task.vx":
    "0 1"} or {"task.vx": (0, 1)}. robot: a name, or a folder with a slash. device: cpu, cuda or cuda:N. seed: 0 .. 2^64 - 1.
    threads: 0: one per core. Raises ValueError that names the key, ImportError without the module or its MuJoCo."""
    module = load()
    if not isinstance(overrides, (collections.abc.Mapping, type(None))):
        raise TypeError(f"overrides: a {type(overrides).__name__}, but it must be a dict of keys")
    keys = dict(overrides or {})
    for name, value in (("envs", num_envs), ("robot", robot), ("device", device), ("seed", seed), ("threads", threads)):
        if f"train.{name}" in keys:
            raise ValueError(f"overrides: train.{name} is an argument of its own")
        keys[f"train.{name}"] = value
    return module.Envs(config_path(config), [f"{key}={text_of(key, value)}" for key, value in keys.items()])


def load():
    """The module _envs."""
    os.environ.setdefault("MILD_HOME", str(DATA))  # where the library finds configs and robots
    try:
        from . import _envs
    except ImportError as error:
        if "libmujoco" in str(error):
            raise ImportError(f"mild's environments need the MuJoCo that mild was built with: {error}; "
                              "reinstall mild, which brings it") from error
        raise ImportError("this build of mild has no environments: install libinih-dev and libpng-dev, then mild again"
                          ) from error
    return _envs


def config_path(config):
    """A file that is there, or one of the package; None stays None."""
    if not isinstance(config, (str, os.PathLike, type(None))):
        raise TypeError(f"config: a {type(config).__name__}, but it must be a file's name")
    if config is None or os.path.exists(config):
        return None if config is None else os.fspath(config)
    packaged = DATA / config
    if packaged.exists():
        return str(packaged)
    raise ValueError(f"config: there is no file '{config}', nor one of the package's configs/")


def text_of(key, value):
    if isinstance(value, (list, tuple)):
        return " ".join(text_of(key, number) for number in value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (str, numbers.Number)):
        return str(value)
    raise TypeError(f"overrides: {key} is a {type(value).__name__}, but it must be text, a number, or a list of these")
