#!/usr/bin/env python3
"""Copies a policy with its weights in half precision, which every reader widens again: half.py IN.safetensors OUT.safetensors"""
import json
import pathlib
import struct
import sys
import zlib


def halve(whole):
    """The same file, each F32 tensor as F16, rounded to nearest; src/learn/safetensors.h says what is in it."""
    size = struct.unpack("<Q", whole[:8])[0]
    header, data = json.loads(whole[8 : 8 + size]), b""
    header["__metadata__"]["crc32"] = "00000000"
    for name, entry in header.items():
        if name != "__metadata__":
            begin, end = entry["data_offsets"]
            raw = whole[8 + size + begin : 8 + size + end]
            if entry["dtype"] == "F32":
                count = len(raw) // 4
                raw = struct.pack(f"<{count}e", *struct.unpack(f"<{count}f", raw))
                entry["dtype"] = "F16"
            entry["data_offsets"] = [len(data), len(data) + len(raw)]
            data += raw
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    half = struct.pack("<Q", len(text)) + text + data
    return half.replace(b'"crc32":"00000000"', b'"crc32":"%08x"' % zlib.crc32(half), 1)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    pathlib.Path(sys.argv[2]).write_bytes(halve(pathlib.Path(sys.argv[1]).read_bytes()))
