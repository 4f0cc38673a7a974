"""Policies in safetensors files as src/learn/safetensors.h reads them: texts under __metadata__, of which crc32 is the checksum of the
whole file with its own eight digits as zeros."""
import json
import struct
import zlib

import torch


def write(path, tensors, texts):
    header, data = {"__metadata__": {"crc32": "00000000", **texts}}, b""
    for name, tensor in tensors.items():
        raw = tensor.detach().cpu().float().contiguous().numpy().tobytes()
        header[name] = {"dtype": "F32", "shape": list(tensor.shape), "data_offsets": [len(data), len(data) + len(raw)]}
        data += raw
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    whole = struct.pack("<Q", len(text)) + text + data
    crc = b'"crc32":"%08x"' % zlib.crc32(whole)
    with open(path, "wb") as file:
        file.write(whole.replace(b'"crc32":"00000000"', crc, 1))


TYPES = {"F32": torch.float32, "F16": torch.float16}


def read(path):
    """({name: tensor}, texts); tensors in 32 bits, whatever the file's. Other types, such as a trainer's counters, are left out."""
    with open(path, "rb") as file:
        whole = file.read()
    size = struct.unpack("<Q", whole[:8])[0]
    header = json.loads(whole[8 : 8 + size])
    texts, tensors = header.pop("__metadata__", {}), {}
    for name, entry in header.items():
        begin, end = entry["data_offsets"]
        if entry["dtype"] in TYPES:
            raw = bytearray(whole[8 + size + begin : 8 + size + end])
            tensors[name] = torch.frombuffer(raw, dtype=TYPES[entry["dtype"]]).reshape(entry["shape"]).float()
    return tensors, texts
