#!/usr/bin/env python3
"""The mean of two policies of one training, weight by weight: average.py A.safetensors B.safetensors SHARE_OF_B OUT.safetensors. Stages that
went on from one another lie in one valley, so that the mean walks between the two; it takes the texts of A."""
import json
import pathlib
import struct
import sys
import zlib


def split(path):
    """Header as text and as a dict, and the numbers, of a file whose tensors are all float; src/learn/safetensors.h says what is in it."""
    whole = pathlib.Path(path).read_bytes()
    size = struct.unpack("<Q", whole[:8])[0]
    header = json.loads(whole[8 : 8 + size])
    shapes = {name: (entry["shape"], entry["data_offsets"]) for name, entry in header.items() if name != "__metadata__"}
    if any(entry["dtype"] != "F32" for name, entry in header.items() if name != "__metadata__"):
        sys.exit(f"average: {path}: weights are not F32")
    return header, shapes, struct.unpack(f"<{(len(whole) - 8 - size) // 4}f", whole[8 + size :])


def average(first, second, share):
    header, shapes, a = split(first)
    _, others, b = split(second)
    if shapes != others:
        sys.exit(f"average: {first} and {second} have other networks")
    header["__metadata__"]["crc32"] = "00000000"
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    data = struct.pack(f"<{len(a)}f", *((1 - share) * x + share * y for x, y in zip(a, b)))
    whole = struct.pack("<Q", len(text)) + text + data
    return whole.replace(b'"crc32":"00000000"', b'"crc32":"%08x"' % zlib.crc32(whole), 1)


def main():
    if len(sys.argv) != 5:
        sys.exit(f"average: {__doc__}")
    try:
        whole = average(sys.argv[1], sys.argv[2], float(sys.argv[3]))
    except (OSError, ValueError, KeyError, struct.error) as error:
        sys.exit(f"average: {error}")
    pathlib.Path(sys.argv[4]).write_bytes(whole)


if __name__ == "__main__":
    main()
