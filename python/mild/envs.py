"""Opens the environments of the task (docs/task.md) for the adapters gym, rsl_rl and sb3."""
import collections.abc
import importlib
import importlib.util
import numbers
import os

import mild

from . import _mujoco, _processor

FILES = "_envs.*.so"  # of the module
DATA = _processor.HERE / "data"


def open_envs(num_envs=None, *, config=None, overrides=None, robot=None, device=None, seed=None, threads=None):
    """_envs.Envs with `num_envs` environments.

    config: a file over configs/default.ini, one of the package such as configs/quick.ini, or None. overrides: {"task.vx":
    "0 1"} or {"task.vx": (0, 1)}. The others are the config's keys train.envs, train.robot and so on; None leaves them as it
    says. robot: a name, or a folder with a slash. device: cpu, cuda or cuda:N. seed: 0 .. 2^64 - 1. threads: 0: one per core.
    Raises ValueError that names the key, ImportError without the module or its MuJoCo."""
    module = load()
    if not isinstance(overrides, (collections.abc.Mapping, type(None))):
        raise TypeError(f"overrides: a {type(overrides).__name__}, but it must be a dict of keys")
    keys = dict(overrides or {})
    for name, value in (("envs", num_envs), ("robot", robot), ("device", device), ("seed", seed), ("threads", threads)):
        if value is None:
            continue
        if f"train.{name}" in keys:
            raise ValueError(f"overrides: train.{name} is an argument of its own, which is given too")
        keys[f"train.{name}"] = value
    return module.Envs(config_path(config), [f"{key}={text_of(key, value)}" for key, value in keys.items()])


def load():
    """The module _envs: a build tree's, or in an installed package that for the MuJoCo that is imported."""
    os.environ["MILD_HOME"] = os.environ.get("MILD_HOME") or str(DATA)  # where the library finds configs and robots
    if importlib.util.find_spec("mild._envs") is None:
        if not _mujoco.versions(FILES):
            raise ImportError("this build of mild has no environments: their libraries were missing (docs/install.md)")
        try:
            mild.__path__.append(str(_mujoco.folder(FILES, "environments")))
        except RuntimeError as error:
            raise ImportError(str(error)) from error
    return importlib.import_module("mild._envs")


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
