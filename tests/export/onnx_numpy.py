"""A reader of ONNX files and their operators in numpy, as far as `mild export --onnx` needs them. It knows the numbers of fields in
ONNX's schema and shares nothing with what writes the file."""

import numpy as np


def fields(raw):
    """(number, value) of a message: whole numbers, or bytes."""
    at = 0

    def varint():
        nonlocal at
        value = shift = 0
        while True:
            byte = raw[at]
            at += 1
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    while at < len(raw):
        key = varint()
        if key & 7 == 0:
            yield key >> 3, varint()
        elif key & 7 == 2:
            size = varint()
            assert at + size <= len(raw), "a field goes on past the end"
            yield key >> 3, raw[at : at + size]
            at += size
        else:
            raise ValueError(f"wire type {key & 7}")


def first(raw, number, otherwise=None):
    return next((value for n, value in fields(raw) if n == number), otherwise)


def texts(raw, number):
    return [value.decode() for n, value in fields(raw) if n == number]


def tensor(raw):
    """Name and array of a TensorProto: dims 1, data_type 2, name 8, raw_data 9."""
    kind = {1: "<f4", 7: "<i8"}[first(raw, 2)]
    return first(raw, 8).decode(), np.frombuffer(first(raw, 9), kind).reshape([v for n, v in fields(raw) if n == 1])


def attribute(raw):
    """Name and value of an AttributeProto: name 1, i 3, ints 8."""
    integers = [v for n, v in fields(raw) if n == 8]
    return first(raw, 1).decode(), integers if integers else first(raw, 3)


def end(raw):
    """Name and shape of a ValueInfoProto: name 1, type 2 {tensor 1 {elem_type 1, shape 2 {dim 1 {value 1, param 2}}}}."""
    kind = first(first(raw, 2), 1)
    assert first(kind, 1) == 1, "not a tensor of floats"
    dims = [first(d, 1) or first(d, 2).decode() for n, d in fields(first(kind, 2)) if n == 1]
    return first(raw, 1).decode(), dims


class Model:
    """ModelProto: ir_version 1, producer_name 2, graph 7, opset_import 8, metadata_props 14."""

    def __init__(self, raw):
        graph = first(raw, 7)
        self.opset = first(first(raw, 8), 2)
        self.metadata = {first(v, 1).decode(): first(v, 2).decode() for n, v in fields(raw) if n == 14}
        self.constants = dict(tensor(v) for n, v in fields(graph) if n == 5)
        self.inputs = dict(end(v) for n, v in fields(graph) if n == 11)
        self.outputs = dict(end(v) for n, v in fields(graph) if n == 12)
        self.nodes = []  # NodeProto: input 1, output 2, op_type 4, attribute 5
        for raw_node in (v for n, v in fields(graph) if n == 1):
            attributes = dict(attribute(v) for n, v in fields(raw_node) if n == 5)
            self.nodes.append((first(raw_node, 4).decode(), texts(raw_node, 1), texts(raw_node, 2)[0], attributes))
        self.check()

    def check(self):
        """Every name is made once and before it is used."""
        known = set(self.constants) | set(self.inputs)
        assert len(known) == len(self.constants) + len(self.inputs)
        for operation, inputs, output, _ in self.nodes:
            assert set(inputs) <= known, f"{operation} {output} reads {set(inputs) - known}"
            assert output not in known, f"{output} is made twice"
            known.add(output)
        assert set(self.outputs) <= known

    def run(self, **given):
        values = dict(self.constants, **given)
        for operation, inputs, output, attributes in self.nodes:
            values[output] = getattr(self, operation)(*(values[name] for name in inputs), **attributes)
        return {name: values[name] for name in self.outputs}

    @staticmethod
    def Reshape(x, shape):
        return x.reshape([x.shape[i] if n == 0 else n for i, n in enumerate(shape)])

    @staticmethod
    def ReduceMean(x, axes):
        return x.mean(axis=tuple(axes), keepdims=True, dtype=x.dtype)

    @staticmethod
    def Slice(x, start, stop, axes):
        return x[tuple([slice(None)] * int(axes[0]) + [slice(int(start[0]), int(stop[0]))])]

    @staticmethod
    def Unsqueeze(x, axes):
        return np.expand_dims(x, int(axes[0]))

    @staticmethod
    def Concat(*parts, axis):
        return np.concatenate(parts, axis=axis)

    @staticmethod
    def Gemm(x, weight, bias, transB=0):
        return x @ (weight.T if transB else weight) + bias

    @staticmethod
    def Elu(x):
        return np.where(x > 0, x, np.expm1(np.minimum(x, 0)))

    @staticmethod
    def Cast(x, to):
        return x.astype({1: np.float32, 11: np.float64}[to])

    @staticmethod
    def Min(a, b):
        return np.minimum(a, b)

    @staticmethod
    def Max(a, b):
        return np.maximum(a, b)

    @staticmethod
    def Exp(x):
        return np.exp(x)

    @staticmethod
    def Sub(a, b):
        return a - b

    @staticmethod
    def Mul(a, b):
        return a * b

    @staticmethod
    def Add(a, b):
        return a + b

    @staticmethod
    def Clip(x, low, high):
        return np.clip(x, low, high)
