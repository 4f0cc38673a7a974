"""What the learners of samples.py share: a network that sees the whole history, its mirror image, its file for `mild eval`, and the
clock of a run. The file is that of mild's own policies (python/mild/policy_file.py), with the keys of the task in it."""
import copy
import importlib.util
import json
import os
import time
import types

import torch
from torch import nn

from envs import ROOT, Envs

spec = importlib.util.spec_from_file_location("policy_file", ROOT / "python/mild/policy_file.py")  # without the package, which is compiled
policy_file = importlib.util.module_from_spec(spec)
spec.loader.exec_module(policy_file)


def plain_layers(net):
    return [(layer.weight.detach(), layer.bias.detach()) for layer in net if isinstance(layer, nn.Linear)]


# ---- left and right ----


class Mirror:
    """x'_i = sign_i x_index_i"""

    def __init__(self, index, sign):
        self.index, self.sign = index.long(), sign.float()

    def __call__(self, x):
        return x[..., self.index] * self.sign

    def repeat(self, count):
        """Of `count` such vectors in a row."""
        width = len(self.index)
        shift = width * torch.arange(count, device=self.index.device).repeat_interleave(width)
        return Mirror(self.index.repeat(count) + shift, self.sign.repeat(count))


def critic_mirror(frame, device):
    """Of the critic's 104 numbers (docs/task.md, section 6) of a robot with two feet; frame: the Mirror of their first 47."""
    swap, signs = list(range(57)), [1.0] * 57
    for first, second, width in ((3, 6, 3), (9, 10, 1), (11, 17, 6)):  # feet: velocities, heights, forces
        for i in range(width):
            swap[first + i], swap[second + i] = second + i, first + i
    for y in (1, 4, 7, 12, 18, 24, 31, 55):  # velocities, forces, push, centre of mass, smoothed velocity
        signs[y] = -1.0
    for axial in (26, 28, 56):  # push: roll and yaw; smoothed yaw rate
        signs[axial] = -1.0
    index = torch.cat([frame.index, 47 + torch.tensor(swap, device=device)])
    return Mirror(index, torch.cat([frame.sign, torch.tensor(signs, device=device)]))


class Symmetric(nn.Module):
    """(f(x) + M f(M x)) / 2: its output turns with its input (equivariant), or with no `after` does not (invariant)."""

    def __init__(self, net, before, after=None):
        super().__init__()
        self.net, self.before, self.after = net, before, after

    def forward(self, x):
        image = self.net(self.before(x))
        return 0.5 * (self.net(x) + (self.after(image) if self.after else image))

    def layers(self):
        """Of one plain network twice as wide that computes the same."""
        own = plain_layers(self.net)
        doubled = []
        for i, (weight, bias) in enumerate(own):
            if i == 0:  # W M x: entry j of M x is sign_j x_index_j
                image = torch.zeros_like(weight).index_add_(1, self.before.index, weight * self.before.sign)
                weight, bias = torch.cat([weight, image]), torch.cat([bias, bias])
            elif i < len(own) - 1:
                weight, bias = torch.block_diag(weight, weight), torch.cat([bias, bias])
            else:
                turned = [self.after(x.T).T if x.dim() == 2 else self.after(x) for x in (weight, bias)]
                weight, bias = 0.5 * torch.cat([weight, turned[0]], 1), 0.5 * (bias + turned[1])
            doubled.append((weight, bias))
        return doubled


# ---- environments and files ----


def open_envs(arguments, **keys):
    where = {"train__envs": arguments.envs, "train__device": arguments.device, "train__seed": arguments.seed}
    if arguments.device == "cpu":
        where["train__robots"] = arguments.robots
    envs = Envs(arguments.config, arguments.library, **where, **keys)
    if envs.device.type == "cuda":
        torch.cuda.set_device(envs.device)  # where graphs are captured
    return envs


def write_policy(path, envs, layers, note, mean=None, scale=None):
    shape = envs.shape
    names = types.SimpleNamespace(**{name: getattr(shape, name) for name in ("observation", "frames", "actions", "estimates", "critic")},
                                  robot=envs.library.mild_envs_robot(envs.envs).decode(), task=envs.library.mild_envs_task(envs.envs).decode())
    arrays = [(weight.cpu().float().numpy(), bias.cpu().float().numpy()) for weight, bias in layers]
    numbers = [None if x is None else x.cpu().float().numpy() for x in (mean, scale)]
    policy_file.write(path, names, arrays, *numbers, note=note)


def with_weights(module, weights):
    other = copy.deepcopy(module)
    other.load_state_dict(weights)
    return other


def age():
    """[s] since this process began, or was begun by samples.py."""
    if "SAMPLES_BEGAN" in os.environ:
        return time.time() - float(os.environ["SAMPLES_BEGAN"])
    with open("/proc/self/stat", encoding="ascii") as stat, open("/proc/uptime", encoding="ascii") as uptime:
        began = float(stat.read().rsplit(")", 1)[1].split()[19]) / os.sysconf("SC_CLK_TCK")
        return float(uptime.read().split()[0]) - began


class Snapshots:
    """Policies of a run at several ages [s] of its process, and at its end; saved.json says when each was written."""

    def __init__(self, arguments, save):
        """save(path): writes the policy."""
        self.folder, self.save, self.rows = arguments.out, save, []
        self.times = sorted(float(word) for word in arguments.snapshots.split(",") if word)

    def look(self, steps, reward, last=False):
        """steps: policy steps so far. reward: of the last iterations, per second."""
        due = [second for second in self.times if age() >= second]
        if not due and not last:
            return
        self.times = [second for second in self.times if second not in due]
        name = "last" if last else f"at{due[-1]:g}"
        self.save(self.folder / f"{name}.safetensors")
        self.rows.append({"name": name, "seconds": age(), "steps": steps, "reward": reward})
        (self.folder / "saved.json").write_text(json.dumps(self.rows) + "\n")


def options(parser):
    """Adds what both learners take to the options of run.py."""
    parser.set_defaults(config=ROOT / "configs/quick.ini")
    parser.add_argument("--robots", default="mujoco", help="mujoco or batch: what steps them with --device cpu (default mujoco)")
    parser.add_argument("--snapshots", default="", help="[s] ages of the process at which the policy is also saved: 10,20,40")
    parser.add_argument("--until", type=float, default=0, help="[s] age of the process at which the training ends, in the place of --minutes")


def begun(arguments):
    """Call before the training: its time is what --until leaves."""
    if arguments.until:
        arguments.minutes = max(arguments.until - age(), 1e-3) / 60
