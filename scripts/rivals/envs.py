"""The environments of mild as tensors of PyTorch: src/run/envs/envs.h through ctypes, without copies."""
import ctypes
import os
import pathlib
from ctypes import POINTER, c_char, c_char_p, c_double, c_float, c_int, c_void_p

import torch

ROOT = pathlib.Path(__file__).resolve().parents[2]
REWARDS_MAX = 32


class Error(ctypes.Structure):
    _fields_ = [("status", c_int), ("text", c_char * 400)]


class Shape(ctypes.Structure):
    NAMES = ("envs", "actions", "observation", "frames", "critic", "estimates", "rewards", "device")
    _fields_ = [(name, c_int) for name in NAMES] + [(name, c_double) for name in ("period", "episode", "clip")]


class View(ctypes.Structure):
    NAMES = ("history", "critic", "estimate", "frame")
    _fields_ = [(name, c_void_p) for name in NAMES]


class Step(ctypes.Structure):
    NAMES = ("action", "reward", "done", "timeout", "valid", "cause")
    _fields_ = [(name, c_void_p) for name in NAMES] + [("next", View), ("last", View), ("terms", c_void_p)]


class Statistics(ctypes.Structure):
    COUNTS = ("episodes", "falls", "diverged")
    MEANS = ("steps", "paid", "length", "reward", "speed_error", "assist")
    _fields_ = [(n, c_int) for n in COUNTS] + [(n, c_double) for n in MEANS] + [("terms", c_double * REWARDS_MAX)]


def load_library(path=None):
    """path: of libmild_envs.so; else $MILD_ENVS, that of the build, or of a bundle (scripts/bundle.sh)."""
    os.environ.setdefault("MILD_HOME", str(ROOT))
    built = ROOT / "build" / "libmild_envs.so"
    library = ctypes.CDLL(str(path or os.environ.get("MILD_ENVS") or (built if built.exists() else ROOT / "lib" / "libmild_envs.so")))
    library.mild_envs_open.restype = c_void_p
    library.mild_envs_open.argtypes = [c_char_p, POINTER(c_char_p), c_int, POINTER(Error)]
    library.mild_envs_close.argtypes = [c_void_p]
    library.mild_envs_shape.restype = Shape
    library.mild_envs_shape.argtypes = [c_void_p]
    library.mild_envs_reward_name.restype = c_char_p
    for text in (library.mild_envs_robot, library.mild_envs_task):
        text.restype, text.argtypes = c_char_p, [c_void_p]
    library.mild_envs_mirror.argtypes = [c_void_p, POINTER(c_int), POINTER(c_float), POINTER(c_int), POINTER(c_float)]
    library.mild_envs_reset.argtypes = [c_void_p, POINTER(View), c_void_p, POINTER(Error)]
    library.mild_envs_step.argtypes = [c_void_p, POINTER(Step), c_void_p, POINTER(Error)]
    library.mild_envs_stats.argtypes = [c_void_p, POINTER(Statistics), c_void_p, POINTER(Error)]
    return library


class Envs:
    """train.envs environments. `history`, `critic`, `frame` hold the present observation, `reward`, `done`, `timeout` and `valid`
    what the last step gave; all are overwritten by the next."""

    def __init__(self, config=None, library=None, **keys):
        """keys: those of a config with __ for the dot, e.g. train__envs=4096; a string, a number, or a list of these."""
        self.library, self.error = load_library(library), Error()
        texts = [f"{key.replace('__', '.')}={text_of(value)}".encode() for key, value in keys.items()]
        self.envs = self.library.mild_envs_open(
            str(config).encode() if config else None, (c_char_p * len(texts))(*texts), len(texts), self.error)
        if not self.envs:
            raise RuntimeError(self.error.text.decode())
        self.shape = shape = self.library.mild_envs_shape(self.envs)
        self.device = torch.device(f"cuda:{shape.device}" if shape.device >= 0 else "cpu")
        rows, number, flag = shape.envs, dict(device=self.device), dict(dtype=torch.uint8, device=self.device)
        self.history = torch.zeros(rows, shape.frames, shape.observation, **number)
        self.critic = torch.zeros(rows, shape.critic, **number)
        self.frame = torch.zeros(rows, shape.observation, **number)
        self.reward = torch.zeros(rows, **number)
        self.done, self.timeout, self.valid = (torch.zeros(rows, **flag) for _ in range(3))
        self.view = View(self.history.data_ptr(), self.critic.data_ptr(), None, self.frame.data_ptr())
        results = [tensor.data_ptr() for tensor in (self.reward, self.done, self.timeout, self.valid)]
        self.call = Step(None, *results, None, self.view)

    def close(self):
        if self.envs:
            self.wait()
            self.library.mild_envs_close(self.envs)
            self.envs = None

    def wait(self):
        if self.device.type == "cuda":
            torch.cuda.synchronize(self.device)

    def stream(self):
        return torch.cuda.current_stream(self.device).cuda_stream if self.device.type == "cuda" else None

    def check(self, status):
        if status:
            raise RuntimeError(self.error.text.decode())

    def reset(self):
        self.check(self.library.mild_envs_reset(self.envs, self.view, self.stream(), self.error))

    def step(self, action):
        """action: [envs, actions] float32, contiguous, on the device."""
        self.call.action = action.data_ptr()
        self.check(self.library.mild_envs_step(self.envs, self.call, self.stream(), self.error))

    def statistics(self):
        """A dict; see EnvsStats."""
        numbers = Statistics()
        self.check(self.library.mild_envs_stats(self.envs, numbers, self.stream(), self.error))
        found = {name: getattr(numbers, name) for name in Statistics.COUNTS + Statistics.MEANS}
        for i in range(self.shape.rewards):
            found["reward." + self.library.mild_envs_reward_name(i).decode()] = numbers.terms[i]
        return found

    def mirror(self):
        """((index, sign) of a frame, (index, sign) of an action) on the device."""
        shape = self.shape
        arrays = [(kind * n)() for n in (shape.observation, shape.actions) for kind in (c_int, c_float)]
        self.library.mild_envs_mirror(self.envs, *arrays)
        tensors = [torch.tensor(list(array), device=self.device) for array in arrays]
        return (tensors[0], tensors[1]), (tensors[2], tensors[3])


def text_of(value):
    return " ".join(str(number) for number in value) if isinstance(value, (list, tuple)) else str(value)
