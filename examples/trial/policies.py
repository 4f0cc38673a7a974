"""This project's policies for `mild trial`: policies.py:G1, :G1_29, :Go1. They remember 41 frames, so they are callables that begin anew."""
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "examples/python"))
from policy import Policy  # noqa: E402


class Walker:
    def reset(self):
        self.policy = Policy(ROOT / "policies" / self.file)

    def __call__(self, frame):
        return self.policy.act(frame)


class G1(Walker):
    file = "g1.safetensors"


class G1_29(Walker):
    file = "g1_29.safetensors"


class Go1(Walker):
    file = "go1.safetensors"
