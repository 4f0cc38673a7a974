"""The environments of the package mild (mild.envs) as tensors of PyTorch, without copies."""
import pathlib
import sys

import torch

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path += [str(ROOT / "build/python"), str(ROOT / "python")]  # where it is not installed: that of the build, of a bundle
from mild.envs import open_envs  # noqa: E402


class Envs:
    """train.envs environments. `history`, `critic`, `frame` hold the present observation, `reward`, `done`, `timeout` and `valid`
    what the last step gave; all are overwritten by the next. shape: see _envs.Envs."""

    def __init__(self, config=None, **keys):
        """keys: those of a config with __ for the dot, e.g. train__envs=4096; a string, a number, or a list of these."""
        self.shape = shape = open_envs(config=config, overrides={key.replace("__", "."): value for key, value in keys.items()})
        self.device = torch.device(f"cuda:{shape.device}" if shape.device >= 0 else "cpu")
        rows, number, flag = shape.envs, dict(device=self.device), dict(dtype=torch.uint8, device=self.device)
        self.history = torch.zeros(rows, shape.frames, shape.observation, **number)
        self.critic = torch.zeros(rows, shape.critic, **number)
        self.frame = torch.zeros(rows, shape.observation, **number)
        self.reward = torch.zeros(rows, **number)
        self.done, self.timeout, self.valid = (torch.zeros(rows, **flag) for _ in range(3))
        self.buffers = shape.buffers(history=self.history, critic=self.critic, frame=self.frame, reward=self.reward, done=self.done,
                                     timeout=self.timeout, valid=self.valid)

    def wait(self):
        if self.device.type == "cuda":
            torch.cuda.synchronize(self.device)

    def close(self):
        self.wait()
        self.shape.close()

    def stream(self):
        return torch.cuda.current_stream(self.device).cuda_stream if self.device.type == "cuda" else 0

    def reset(self):
        self.shape.reset(self.buffers, self.stream())

    def step(self, action):
        """action: [envs, actions] float32, contiguous, on the device."""
        self.shape.step(action, self.buffers, self.stream())

    def statistics(self):
        """A dict; see EnvsStats."""
        return self.shape.statistics(self.stream())

    def mirror(self):
        """((index, sign) of a frame, (index, sign) of an action) on the device."""
        return [[torch.tensor(numbers, device=self.device) for numbers in pair] for pair in self.shape.mirror()]
