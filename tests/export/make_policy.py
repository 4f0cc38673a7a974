"""A random policy for SA01 in the place of a trained one: other widths, one theta1 and theta2 for each dimension of z, which depend
on the clock, and an actor that does not see it.
Usage: make_policy.py POLICY OTHER [SEED]"""

import json
import sys
import zlib

import numpy as np

raw = open(sys.argv[1], "rb").read()
size = int.from_bytes(raw[:8], "little")
header = json.loads(raw[8 : 8 + size])
texts = header["__metadata__"]
texts.update(
    {
        "crc32": "00000000",
        "note": "random */ \\ for tests",
        "policy.latent": "5",
        "policy.encoder_hidden": "40 17 0 0",
        "policy.modulation_hidden": "9",
        "policy.modulation_per_dimension": "true",
        "policy.modulation_input": "feet_phase",
        "policy.actor_phase": "false",
        "policy.actor_hidden": "33 0 0 0",
        "policy.decoder_hidden": "8 0 0 0",
        "policy.critic_hidden": "8 0 0 0",
    }
)
for key in ("policy.decoder_frame", "policy.ground_offset", "policy.ground_count"):  # without: a frame
    texts.pop(key, None)
shapes = {
    "encoder": [282, 40, 17, 11 + 2 * 5],
    "decoder": [16, 8, 47],
    "modulation": [8 + 2, 9, 10],
    "actor": [47 + 11 + 5, 33, 12],
    "critic": [104, 8, 1],
}
random = np.random.default_rng(int(sys.argv[3]) if len(sys.argv) > 3 else 1)
tensors, data = {}, b""
for net, widths in shapes.items():
    for layer, (columns, rows) in enumerate(zip(widths, widths[1:])):
        for what, shape in (("weight", [rows, columns]), ("bias", [rows])):
            numbers = (random.normal(size=shape) / np.sqrt(columns)).astype("<f4")
            if what == "weight" and layer == 0 and net in ("encoder", "actor"):
                for frame in range(0, 282 if net == "encoder" else 47, 47):
                    numbers[:, frame + 45 : frame + 47] = 0  # the clock
            span = [len(data), len(data) + numbers.nbytes]
            tensors[f"{net}.{2 * layer}.{what}"] = {"dtype": "F32", "shape": shape, "data_offsets": span}
            data += numbers.tobytes()
tensors["log_std"] = {"dtype": "F32", "shape": [12], "data_offsets": [len(data), len(data) + 48]}
data += bytes(48)
text = json.dumps({"__metadata__": texts, **tensors}, separators=(",", ":")).encode()
text += b" " * (-len(text) % 8)
whole = len(text).to_bytes(8, "little") + text + data
crc = f"{zlib.crc32(whole):08x}".encode()
at = whole.index(b'"crc32":"') + 9
open(sys.argv[2], "wb").write(whole[:at] + crc + whole[at + 8 :])
