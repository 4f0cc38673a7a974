"""All estimates of an exported policy, and its targets, beside what `mild eval` recorded with --actions and --latent of the same trials.
Usage: estimates.py ACTIONS.csv LATENT.csv ACTION_SCALE POLICY.so [FILE.onnx], POLICY.so: policy.c and estimates.c of this folder"""

import csv
import ctypes
import pathlib
import sys

import numpy as np
import onnx_numpy
import recorded

actions, latent, scale, library, *graph = sys.argv[1:]
VELOCITY, HEIGHT = 4, 10  # [task] velocity_scale and height_scale


def wanted():
    """Of each trial [steps, estimates] in the policy's units: velocity of the base, velocities of the feet, heights of the feet."""
    with open(latent, newline="", encoding="utf-8") as file:
        names, *rows = csv.reader(file)
    base, feet = names.index("velocity_x_m_s"), names.index("foot0_velocity_x_m_s")
    height = names.index("foot0_height_m")
    order = [f"velocity_{c}_m_s" for c in "xyz"] + [f"foot{f}_velocity_{c}_m_s" for f in (0, 1) for c in "xyz"]
    assert names[base : base + 3] + names[feet : feet + 6] == order and names[height : height + 2] == ["foot0_height_m", "foot1_height_m"]
    units = [VELOCITY] * 3 + [1] * 6 + [HEIGHT] * 2
    numbers = np.array([[float(row[i]) for i in [*range(base, base + 3), *range(feet, feet + 6), height, height + 1]] for row in rows]) * units
    trial = np.array([int(row[0]) for row in rows])
    return [numbers[trial == k] for k in range(trial.max() + 1)]


def of_c(frames):
    program = ctypes.CDLL(str(pathlib.Path(library).resolve()))
    found, targets = np.empty((len(frames), 11), np.float32), np.empty((len(frames), 12), np.float32)
    frames = np.ascontiguousarray(frames, np.float32)
    program.run(frames.ctypes, len(frames), found.ctypes, targets.ctypes)
    return found, targets


def of_onnx(frames):
    model = onnx_numpy.Model(pathlib.Path(graph[0]).read_bytes())
    held = int(model.metadata["history_means"]) * int(model.metadata["history_stride"])
    state, found = np.repeat(frames[:1, None], held, axis=1), []
    for frame in frames:
        out = model.run(obs=frame[None], frames_in=state)
        state = out["frames_out"]
        found.append(out["estimates"][0])
    return np.array(found), None


pose = np.array([0, 0, -0.24, 0.48, -0.24, 0] * 2)  # [rad] of SA01
for name, run in [("C", of_c)] + [("ONNX", of_onnx)] * len(graph):
    worst = np.zeros(11)
    for trial, truth in zip(recorded.trials(actions), wanted(), strict=True):
        found, targets = run(trial.observation)
        worst = np.maximum(worst, abs(found - truth).max(axis=0))
        if targets is not None:
            assert abs(targets - pose - float(scale) * trial.action).max() < 1e-5, "targets"
        assert np.ptp(truth, axis=0).min() > 1e-2, "an estimate that stays the same shows nothing"
    print(f"{name}: estimates within {worst.max():.1e}")
    assert worst.max() < 1e-4, worst
