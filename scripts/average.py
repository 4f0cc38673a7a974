#!/usr/bin/env python3
"""The mean of two policies of one training, weight by weight: average.py A.safetensors B.safetensors SHARE_OF_B OUT.safetensors. Stages that
went on from one another lie in one valley, so that the mean walks between the two; it takes the texts of A."""
import json
import pathlib
import struct
import sys
import zlib


def fail(text):
    print(f"average: {text}", file=sys.stderr)
    sys.exit(2)


def split(path):
    """Header as a dict, shapes and places of the tensors, and their numbers; src/learn/safetensors.h says what is in such a file."""
    try:
        whole = pathlib.Path(path).read_bytes()
        size = struct.unpack("<Q", whole[:8])[0]
        header = json.loads(whole[8 : 8 + size])
        shapes = {name: (entry["shape"], entry["data_offsets"]) for name, entry in header.items() if name != "__metadata__"}
        if any(header[name]["dtype"] != "F32" for name in shapes):
            fail(f"{path}: weights are not F32; a policy in half precision cannot be one of the two")
        return header, shapes, struct.unpack(f"<{max(end for _, (_, end) in shapes.values()) // 4}f", whole[8 + size :])
    except OSError as error:
        fail(f"{path}: {error.strerror}")
    except (ValueError, KeyError, TypeError, AttributeError, struct.error):
        fail(f"{path}: not a whole policy")


def average(first, second, share):
    header, shapes, a = split(first)
    _, others, b = split(second)
    if shapes != others:
        fail(f"{first} and {second} have other networks")
    header["__metadata__"]["crc32"] = "00000000"
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    data = struct.pack(f"<{len(a)}f", *((1 - share) * x + share * y for x, y in zip(a, b)))
    whole = struct.pack("<Q", len(text)) + text + data
    return whole.replace(b'"crc32":"00000000"', b'"crc32":"%08x"' % zlib.crc32(whole), 1)


def main():
    if len(sys.argv) != 5:
        fail("usage: average.py A.safetensors B.safetensors SHARE_OF_B OUT.safetensors")
    try:
        share = float(sys.argv[3])
    except ValueError:
        fail(f"{sys.argv[3]}: not a number; give the share of the second policy, 0 .. 1")
    out = pathlib.Path(sys.argv[4])
    if any(out.exists() and pathlib.Path(name).exists() and out.samefile(name) for name in sys.argv[1:3]):
        fail(f"{out}: is also an input and would be overwritten; name another file")
    whole = average(sys.argv[1], sys.argv[2], share)
    try:
        out.write_bytes(whole)
    except OSError as error:
        fail(f"{sys.argv[4]}: {error.strerror}")


if __name__ == "__main__":
    main()
