"""A policy that somebody else trained on mild's environments as a policy's file (docs/policy.md), which `mild eval`, `play`, `drive` and `export` take."""
import json
import os
import struct
import zlib

import numpy as np

LATENT_MAX, LAYERS_MAX = 1024, 4


def write(path, envs, layers, mean=None, scale=None, note=""):
    """Writes the file of a network that sees a whole history and gives the actions' means.

    envs: _envs.Envs that it was trained on. layers: [(weight (out, in), bias (out,)), ...], ELU between them, of which at most four are
    hidden. mean, scale: of the history, (history - mean) / scale is what the first layer sees; None: the history itself. Raises
    ValueError for a network that does not fit.

    A policy of mild has an encoder and, behind the newest frame and what it estimates, an actor. Here the encoder only takes the mean
    away, to a latent vector as long as the history, and the actor, whose first weights have the scale in them, looks at nothing else:
    the same sums, so the same actions within rounding."""
    history, frame, heads = envs.frames * envs.observation, envs.observation, envs.estimates
    layers = [(np.asarray(weight, np.float32), np.asarray(bias, np.float32)) for weight, bias in layers]
    mean = np.zeros(history) if mean is None else np.asarray(mean, float).reshape(-1)
    scale = np.ones(history) if scale is None else np.asarray(scale, float).reshape(-1)
    check(layers, mean, scale, history, envs.actions)
    moved = 3 * (heads - 3) // 4  # velocities of the feet, behind the base's; then come their heights
    tensors = {
        "encoder.0.weight": np.vstack([np.zeros((heads, history)), np.eye(history), np.zeros((history, history))]),
        "encoder.0.bias": np.concatenate([np.zeros(heads), -mean, np.zeros(history)]),
        "decoder.0.weight": np.zeros((1, heads + history)), "decoder.0.bias": np.zeros(1),  # of training alone, as the critic
        "decoder.2.weight": np.zeros((frame, 1)), "decoder.2.bias": np.zeros(frame),
        "modulation.0.weight": np.zeros((1, moved)), "modulation.0.bias": np.zeros(1),
        "modulation.2.weight": np.zeros((2, 1)), "modulation.2.bias": np.array([1, 0]),  # z = 1 mean + 0
    }
    for index, (weight, bias) in enumerate(layers):
        if index == 0:
            weight = np.hstack([np.zeros((len(weight), frame + heads)), weight / scale])
        tensors[f"actor.{2 * index}.weight"], tensors[f"actor.{2 * index}.bias"] = weight, bias
    tensors |= {"critic.0.weight": np.zeros((1, envs.critic)), "critic.0.bias": np.zeros(1),
                "critic.2.weight": np.zeros((1, 1)), "critic.2.bias": np.zeros(1), "log_std": np.zeros(envs.actions)}
    hidden = [len(bias) for _, bias in layers[:-1]]
    texts = {"kind": "mild policy", "version": "1", "note": note, "robot": envs.robot, "task": envs.task}
    numbers = {"observation": frame, "frames": envs.frames, "critic_input": envs.critic, "actions": envs.actions, "estimates": heads,
               "feet_velocity_offset": 3, "feet_velocity_count": moved, "latent": history, "encoder_hidden": "0 0 0 0",
               "decoder_hidden": "1 0 0 0", "modulation_hidden": 1, "modulation_per_dimension": "false",
               "actor_hidden": " ".join(str(width) for width in hidden + [0] * (LAYERS_MAX - len(hidden))),
               "critic_hidden": "1 0 0 0", "init_std": 1}
    save(path, texts | {f"policy.{name}": str(value) for name, value in numbers.items()}, tensors)


def check(layers, mean, scale, history, actions):
    widths = [history] + [len(bias) for _, bias in layers]
    if [weight.shape for weight, _ in layers] != list(zip(widths[1:], widths)) or widths[-1] != actions:
        raise ValueError(f"layers: {[weight.shape for weight, _ in layers]} do not lead from a history of {history} to {actions} actions")
    if len(layers) > LAYERS_MAX + 1:
        raise ValueError(f"layers: {len(layers) - 1} hidden ones, but a policy has at most {LAYERS_MAX}")
    if history > LATENT_MAX:
        raise ValueError(f"layers: a history of {history} numbers is longer than {LATENT_MAX}")
    if mean.shape != (history,) or scale.shape != (history,) or not (scale > 0).all():
        raise ValueError(f"mean, scale: not {history} numbers each, the scales above 0")
    if not all(np.isfinite(part).all() for part in (mean, scale, *(array for layer in layers for array in layer))):
        raise ValueError("layers: a number is not finite")


def save(path, texts, tensors):
    """A safetensors file with a checksum, as src/learn/safetensors.c reads it; under another name until it is whole."""
    header, at = {"__metadata__": {"crc32": "00000000", **texts}}, 0
    for name, values in tensors.items():
        header[name] = {"dtype": "F32", "shape": list(values.shape), "data_offsets": [at, at + 4 * values.size]}
        at += 4 * values.size
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    whole = struct.pack("<Q", len(text)) + text + b"".join(np.ascontiguousarray(values, "<f4").tobytes() for values in tensors.values())
    temporary = f"{os.fspath(path)}.tmp"
    with open(temporary, "wb") as file:
        file.write(whole.replace(b'"crc32":"00000000"', b'"crc32":"%08x"' % zlib.crc32(whole), 1))
    os.replace(temporary, path)
