"""The graph of `mild export --onnx` on what `mild eval` saw and did: computed by numpy, or by ONNX Runtime where --runtime is given.
--double: the graph is of `mild export --onnx --double`.
Usage: test_onnx.py [--runtime] [--double] FILE.onnx RECORD.csv... [KEY=NUMBER...], of its metadata"""

import pathlib
import sys

import numpy as np
import onnx_numpy
import recorded

runtime, double = "--runtime" in sys.argv, "--double" in sys.argv
path, *records = [word for word in sys.argv[1:] if word[:2] != "--" and "=" not in word]
wanted = [word for word in sys.argv[1:] if "=" in word]
# Of the largest action, in 32 bits: ONNX Runtime adds the products of a row one after the other. Where they are large and cancel, as in the
# actor's last two layers, the last digits of the greatest partial sum stay. In 64 bits what eval rounds is left.
TOLERANCE = 5e-7 if double else 1e-6


def make_run(model):
    if not runtime:
        return model.run
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    assert session.get_modelmeta().custom_metadata_map == model.metadata
    names = [output.name for output in session.get_outputs()]
    return lambda **given: dict(zip(names, session.run(names, given)))


def walk(run, trials):
    """Largest error of the actions, all trials at once, each from a history of its first frame."""
    shortest = min(len(trial.action) for trial in trials)
    held = int(model.metadata["history_means"]) * int(model.metadata["history_stride"])
    obs = np.stack([trial.observation[0] for trial in trials])
    frames = np.repeat(obs[:, None], held, axis=1)
    worst = scale = 0.0
    for k in range(shortest):
        obs = np.stack([trial.observation[k] for trial in trials])
        wanted = np.stack([trial.action[k] for trial in trials])
        out = run(obs=obs, frames_in=frames)
        frames = out["frames_out"]
        worst = max(worst, abs(out["actions"] - wanted).max())
        scale = max(scale, abs(wanted).max())
        assert all(out[name].dtype == np.float32 for name in out)
        assert (frames[:, -1] == obs).all() and out["estimates"].shape[0] == len(trials)
    assert not np.isnan(worst)
    return worst, scale


model = onnx_numpy.Model(pathlib.Path(path).read_bytes())
width = sum(map(int, model.metadata["observation_widths"].split(",")))
held = int(model.metadata["history_means"]) * int(model.metadata["history_stride"])
moved = len(model.metadata.get("action_joint_names", model.metadata["joint_names"]).split(","))  # the others are driven
assert model.opset == 13
operators = {node[0] for node in model.nodes}
assert ("Cast" in operators) == double and ("Elu" in operators) != double
assert model.inputs == {"obs": ["batch", width], "frames_in": ["batch", held, width]}
assert list(model.outputs) == ["actions", "frames_out", "estimates"]
assert model.outputs["actions"] == ["batch", moved] and model.outputs["frames_out"] == model.inputs["frames_in"]
for key, value in (word.split("=") for word in wanted):
    assert float(model.metadata[key]) == float(value), (key, model.metadata[key], value)
run = make_run(model)
for record in records:
    error, scale = walk(run, recorded.trials(record))
    print(f"{'ONNX Runtime' if runtime else 'numpy'}: actions of up to {scale:.1f} within {error:.1e}")
    assert error < TOLERANCE * max(scale, 1)
