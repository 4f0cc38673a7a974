"""rsl_rl: environments whose tensors the library writes, on the CPU or a CUDA device; and its policies as files of mild:
python -m mild.rsl_rl model_1500.pt --config configs/quick.ini --out walk.safetensors"""
import argparse
import os
import itertools

import torch
from rsl_rl.env import VecEnv
from tensordict import TensorDict

from . import policy_file
from .envs import open_envs

EPSILON = 1e-2  # of rsl_rl's EmpiricalNormalization


class Env(VecEnv):
    """`num_envs` robots on soft ground (docs/task.md) for rsl_rl 5.4 and 5.5; None: as many as the config's train.envs.

    Observation groups: "policy" (num_envs, frames * observation), noisy, and "critic" (num_envs, critic), noiseless; the
    runner's obs_groups choose. extras: "time_outs" (num_envs,) bool, and every `log_every` steps "log", means over the
    episodes that ended since; that waits for the device. device: cpu or cuda:N, where all tensors are. config, overrides,
    robot, seed, threads: see mild.envs.open_envs. Actions that are not finite raise ValueError, on a GPU at the next log."""

    def __init__(self, num_envs=None, *, device=None, config=None, overrides=None, robot=None, seed=None, threads=None,
                 log_every=24):
        self._envs = open_envs(num_envs, config=config, overrides=overrides, robot=robot, seed=seed, threads=threads,
                               device=None if device is None else str(device))
        num_envs = self.num_envs = self._envs.envs
        self.num_actions = self._envs.actions
        self.max_episode_length = round(self._envs.episode / self._envs.period)
        self.device = torch.device(f"cuda:{self._envs.device}" if self._envs.device >= 0 else "cpu")
        self.episode_length_buf = torch.zeros(num_envs, dtype=torch.long, device=self.device)
        self.cfg = {"config": str(config), "overrides": dict(overrides or {}), "robot": robot, "seed": seed}
        self.log_every, self._steps = log_every, 0
        self._finite = torch.ones((), dtype=torch.bool, device=self.device)  # all actions since the last log
        self._tensors = self._new()
        self._envs.reset(self._envs.buffers(**self._tensors), stream=self._stream())

    def _new(self):
        """New tensors for a step; the allocator of PyTorch gives back those of earlier steps."""
        shape, rows, where = self._envs, self.num_envs, {"device": self.device}
        tensors = {"history": torch.empty(rows, shape.frames, shape.observation, **where),
                   "critic": torch.empty(rows, shape.critic, **where),
                   "reward": torch.empty(rows, **where)}
        tensors.update((name, torch.empty(rows, dtype=torch.bool, **where)) for name in ("done", "timeout", "valid"))
        return tensors

    def _stream(self):
        return torch.cuda.current_stream(self.device).cuda_stream if self.device.type == "cuda" else 0

    def get_observations(self):
        """The present observations: a TensorDict of the groups."""
        groups = {"policy": self._tensors["history"].view(self.num_envs, -1), "critic": self._tensors["critic"]}
        return TensorDict(groups, batch_size=[self.num_envs], device=self.device)

    def step(self, actions):
        """actions: (num_envs, num_actions) in units of the action scale. Returns (observations, rewards (num_envs,), dones
        (num_envs,) long, extras)."""
        tensors = self._new()
        actions = actions.detach().to(self.device, torch.float32).contiguous()
        if self.device.type == "cuda":  # without waiting for it; on the CPU the library looks
            self._finite &= actions.isfinite().all()
        self._envs.step(actions, self._envs.buffers(**tensors), stream=self._stream())
        self._tensors, self._actions = tensors, actions  # kept until the device has read them
        self.episode_length_buf += 1
        self.episode_length_buf.masked_fill_(tensors["done"], 0)
        extras = {"time_outs": tensors["timeout"]}
        self._steps += 1
        if self.log_every and self._steps % self.log_every == 0:
            extras["log"] = self._log()
        return self.get_observations(), tensors["reward"], tensors["done"].long(), extras

    def statistics(self):
        """Means over the episodes that ended since the last call or log: a dict, see EnvsStats of src/env/envs_step.h.
        Waits for the device."""
        if not self._finite:
            raise ValueError(f"actions: some were not finite by step {self._steps}")
        return self._envs.statistics(stream=self._stream())

    def _log(self):
        found = self.statistics()
        names = ["length", "speed_error"] if found["episodes"] else []
        names += [name for name in found if name.startswith("reward.")] if found["episodes"] else []
        return {"/mild/" + name: found[name] for name in [*names, "assist"]}

    def mirror(self, obs=None, actions=None):
        """Left and right exchanged: the arguments with their mirror images below them, as rsl_rl's symmetry wants it. Only
        the group "policy" is mirrored: enough for a mirror loss of an actor that sees it; data augmentation needs a critic
        that sees it too. rsl_rl's configuration names the function: "data_augmentation_func": "mild.rsl_rl:mirror"."""
        if not hasattr(self, "_mirror"):
            pairs = self._envs.mirror()
            self._mirror = [(torch.tensor(index, device=self.device), torch.tensor(sign, device=self.device))
                            for index, sign in pairs]
        (index, sign), (action_index, action_sign) = self._mirror
        if obs is not None:
            other = obs.clone()
            frames = obs["policy"].view(len(obs), self._envs.frames, self._envs.observation)
            other["policy"] = (sign * frames[:, :, index]).reshape(len(obs), -1)
            obs = torch.cat([obs, other])
        if actions is not None:
            actions = torch.cat([actions, action_sign * actions[:, action_index]])
        return obs, actions

    def save(self, checkpoint, path):
        """Writes the policy of a checkpoint, a model_N.pt or what is in one, as a policy's file; see policy_of."""
        policy_of(self._envs, checkpoint, path)

    def close(self):
        """Ends the threads; further steps raise RuntimeError."""
        if self.device.type == "cuda":
            torch.cuda.synchronize(self.device)
        self._envs.close()


def mirror(env, obs=None, actions=None):
    """Env.mirror, in the form that rsl_rl's symmetry_cfg calls."""
    return env.mirror(obs, actions)


def policy_of(envs, checkpoint, path):
    """Writes a policy's file that acts as the actor of a checkpoint of rsl_rl, without its noise: an MLPModel with activation "elu" (a
    checkpoint does not say which), at most four hidden layers, and normalised observations or none, that sees the group "policy" alone.

    envs: _envs.Envs that it was trained on. checkpoint: a model_N.pt, or what is in one. Raises ValueError for another network."""
    name = ""
    if not isinstance(checkpoint, dict):
        name, checkpoint = str(checkpoint), torch.load(checkpoint, map_location="cpu", weights_only=True)
    state = {key: value.cpu().numpy() for key, value in checkpoint.get("actor_state_dict", {}).items()}
    layers = []
    for index in itertools.count(0, 2):  # activations are between them
        if f"mlp.{index}.weight" not in state:
            break
        layers.append((state.pop(f"mlp.{index}.weight"), state.pop(f"mlp.{index}.bias")))
    others = [key for key in state if not key.startswith(("obs_normalizer.", "distribution."))]
    if not layers or others:
        raise ValueError(f"checkpoint: {name or 'it'} has no actor that is an MLPModel" + (f": {', '.join(others)}" if others else ""))
    mean, std = (state.get(f"obs_normalizer._{key}") for key in ("mean", "std"))
    policy_file.write(path, envs, layers, mean, None if std is None else std + EPSILON, note=f"rsl_rl {name}".strip())


def main():
    parser = argparse.ArgumentParser(prog="python -m mild.rsl_rl", description="Writes the policy of a checkpoint of rsl_rl as a file for mild eval, play, "
                                     "drive and export.", epilog="--SECTION.KEY=VALUE: overrides of the training, e.g. --task.gait_period=0.7")
    parser.add_argument("checkpoint", help="model_N.pt")
    parser.add_argument("--out", required=True, help="a file, FILE.safetensors")
    parser.add_argument("--config", help="that of the training, such as configs/quick.ini")
    parser.add_argument("--robot", help="a name, or a folder with a slash")
    given, overrides = parser.parse_known_args()
    for text in overrides:
        if not text.startswith("--") or "." not in text or "=" not in text:
            parser.error(f"unknown option {text}")
    if os.path.exists(given.out) and os.path.exists(given.checkpoint) and os.path.samefile(given.out, given.checkpoint):
        parser.error(f"--out: {given.out} is the checkpoint; name another file")
    try:
        envs = open_envs(1, config=given.config, overrides=dict(text[2:].split("=", 1) for text in overrides), robot=given.robot, device="cpu", threads=1)
        policy_of(envs, given.checkpoint, given.out)
    except (ValueError, OSError) as error:
        parser.error(str(error))
    print(f"mild eval --policy {given.out}")


if __name__ == "__main__":
    main()
