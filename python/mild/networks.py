"""Policies of any kind as one thing: reset() before a walk, act(observation) at every decision."""
import importlib.util
import io
import pathlib
import warnings
import zipfile

import numpy as np


def load(policy, description):
    """A policy from a file (.onnx, .pt, FILE.py:NAME, MODULE:NAME), or from a callable. Raises ValueError, or RuntimeError where a
    package is missing."""
    if callable(policy):
        return Callable(policy)
    text = str(policy)
    if pathlib.Path(text).suffix == ".onnx":
        return Onnx(_file(text), description.policy)
    if pathlib.Path(text).suffix in (".pt", ".pth", ".jit"):
        return TorchScript(_file(text))
    if ":" in text:
        return Callable(_named(text))
    raise ValueError(f"policy: '{text}' must end in .onnx or .pt, or be FILE.py:NAME, or a callable")


def _file(text):
    path = pathlib.Path(text)
    if not path.is_file():
        raise ValueError(f"policy: there is no file '{text}'")
    return path


def _named(text):
    """What FILE.py:NAME or MODULE:NAME names; a class is made without arguments."""
    place, _, name = text.rpartition(":")
    if place.endswith(".py"):
        spec = importlib.util.spec_from_file_location("_policy_of_trial", _file(place))
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    else:
        module = importlib.import_module(place)
    found = getattr(module, name, None)
    if not callable(found):
        raise ValueError(f"policy: {place} has no callable '{name}'")
    return found() if isinstance(found, type) else found


class Callable:
    """A function of the observation (n,), float32, that returns the action; its reset(), if it has one, begins a walk."""

    def __init__(self, function):
        self.function = function

    def reset(self):
        if hasattr(self.function, "reset"):
            self.function.reset()

    def act(self, observation):
        return np.asarray(self.function(observation), float).ravel()


def session(path):
    """onnxruntime's session of a file, on one thread. Raises ValueError for what is no ONNX."""
    try:
        import onnxruntime
    except ImportError:
        raise RuntimeError("policy: ONNX needs onnxruntime; `pip install mildground[trial]`") from None
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    try:
        return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    except Exception as error:  # onnxruntime's own kinds have no common one
        raise ValueError(f"policy: onnxruntime cannot read {path}: {' '.join(str(error).split())}; is it a whole ONNX file, and its .data beside it? "
                         "Git LFS leaves a text of three lines where `git lfs pull` has not run") from None


class Onnx:
    """A graph with one row; other inputs are recurrent state, which comes back as other outputs."""

    def __init__(self, path, keys):
        self.session = session(path)
        inputs, outputs = {i.name: i for i in self.session.get_inputs()}, [o.name for o in self.session.get_outputs()]
        self.seen, self.output = keys["input"] or [next(iter(inputs))], keys["output"] or outputs[0]
        for name, names, key in [*((name, inputs, "input") for name in self.seen), (self.output, outputs, "output")]:
            if name not in names:
                raise ValueError(f"policy.{key}: {path.name} has no '{name}'; there are {', '.join(names)}")
        widths = [inputs[name].shape[-1] if inputs[name].shape else 1 for name in self.seen]
        if len(widths) > 1 and not all(isinstance(width, int) for width in widths):
            raise ValueError(f"policy.input: {path.name} does not say how wide {', '.join(self.seen)} are")
        self.size = sum(widths) if len(widths) > 1 else widths[0]
        self.cuts = np.cumsum(widths[:-1]) if len(widths) > 1 else []
        rest = [name for name in inputs if name not in self.seen]
        pairs = [tuple(pair.split(">")) for pair in keys["state"]] if keys["state"] is not None else \
            list(zip(rest, [name for name in outputs if name != self.output]))
        if sorted(pair[0] for pair in pairs) != sorted(rest) or any(len(pair) != 2 or pair[1] not in outputs for pair in pairs):
            raise ValueError(f"policy.state: {path.name} has inputs {', '.join(inputs)} and outputs {', '.join(outputs)}; "
                             "each input but the observation needs INPUT>OUTPUT")
        self.pairs, self.inputs = pairs, inputs
        self.names = [self.output, *(pair[1] for pair in pairs)]
        self.reset()

    def reset(self):
        self.state = {name: np.zeros([n if isinstance(n, int) else 1 for n in self.inputs[name].shape], _kind(self.inputs[name].type))
                      for name, _ in self.pairs}

    def act(self, observation):
        if isinstance(self.size, int) and self.size != len(observation):
            raise ValueError(f"policy: it sees {self.size} numbers, and the description makes {len(observation)}")
        rows = {name: part.reshape((1,) * (len(self.inputs[name].shape) - 1) + (-1,)) for name, part in zip(self.seen, np.split(observation, self.cuts))}
        action, *state = self.session.run(self.names, {**rows, **self.state})
        self.state = {pair[0]: value for pair, value in zip(self.pairs, state)}
        return np.asarray(action, float).ravel()


def _kind(text):
    return {"tensor(int64)": np.int64, "tensor(int32)": np.int32, "tensor(double)": np.float64}.get(text, np.float32)


class TorchScript:
    """A module of one argument. State that it keeps in buffers is that of the file again at each reset."""

    def __init__(self, path):
        if zipfile.is_zipfile(path):
            with zipfile.ZipFile(path) as archive:
                exported = any(name.endswith("/constants.pkl") for name in archive.namelist())
        else:
            exported = True  # torch says what it is
        if not exported:
            raise ValueError(f"policy: {path} has weights alone, as a learner's checkpoint; give what was exported of it (mjlab writes an .onnx beside it)")
        try:
            import torch
        except ImportError:
            raise RuntimeError("policy: TorchScript needs PyTorch; `pip install torch`") from None
        self.torch = torch
        torch.set_num_threads(1)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # PyTorch 2.15 would have another format
                self.module = torch.jit.load(io.BytesIO(path.read_bytes()), map_location="cpu").eval()
        except RuntimeError as error:
            raise ValueError(f"policy: {path} is no TorchScript: {str(error).splitlines()[0]}") from None
        self.start = {name: value.clone() for name, value in self.module.named_buffers()}

    def reset(self):
        with self.torch.no_grad():
            for name, value in self.module.named_buffers():
                value.copy_(self.start[name])

    def act(self, observation):
        with self.torch.no_grad():
            try:
                action = self.module(self.torch.from_numpy(observation)[None])
            except RuntimeError as error:
                raise ValueError(f"policy: it does not take {len(observation)} numbers: {str(error).strip().splitlines()[-1]}") from None
        return (action[0] if isinstance(action, tuple) else action).numpy().astype(float).ravel()
