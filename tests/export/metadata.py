"""The numbers of an exported policy beside where else they stand: of the C the table of joints in docs/policy.md; of walk.onnx every number and
name of its metadata that a robot's program reads, in the robot's MJCF and robot.ini, the record of `mild eval --actions`, and that C.
Usage: metadata.py ROOT C_FOLDER [FILE.onnx ACTIONS.csv]"""

import configparser
import csv
import pathlib
import re
import sys

import onnx_numpy

root, folder, *more = map(pathlib.Path, sys.argv[1:])

# the page's table: order of the names, and of each joint the numbers
weights = (folder / "policy_weights.h").read_text(encoding="utf-8")
page = (root / "docs/policy.md").read_text(encoding="utf-8")
rows = [[cell.strip() for cell in line.split("|")] for line in page.splitlines() if line.startswith("| `leg_")]
pose, kp, kd, limit, low, high = ([float(x.rstrip("f")) for x in re.search(rf"policy_{name}\[.*{{(.*)}};", weights)[1].split(", ")]
                                  for name in ("pose", "kp", "kd", "limit", "low", "high"))
assert [row[1].split("`")[1] for row in rows] == re.findall(r'"(.*)"', weights)
for i, row in enumerate(rows):
    assert [float(cell) for cell in row[2:6]] == [pose[i], kp[i], kd[i], limit[i]], row
    assert row[6].endswith(f", {low[i]:g} to {high[i]:g}"), row
if not more:
    sys.exit()

graph, record = more
data = onnx_numpy.Model(graph.read_bytes()).metadata
numbers = {key: [float(x) for x in value.split(",")] for key, value in data.items() if re.fullmatch(r"[-+.\de,]+", value)}
header = (folder / "policy.h").read_text(encoding="utf-8")
defined = {name: float(x.rstrip("f")) for name, x in re.findall(r"#define POLICY_(\w+) ([-+.\de]+f?)", header)}
robot = configparser.ConfigParser(strict=False)
robot.read(root / "robots/sa01/robot.ini")

# the names: the joints' in the order of the actions, and of the frame
with open(record, newline="", encoding="utf-8") as file:
    columns = next(csv.reader(file))
names = data["joint_names"].split(",")
assert [f"action_{name}" for name in names] == [re.sub("_rad$", "", c) for c in columns if c.startswith("action_")], names
assert data["robot"] == "sa01" and data["producer"].startswith("mild ")
widths = dict(zip(data["observation_names"].split(","), map(int, data["observation_widths"].split(",")), strict=True))
assert list(widths) == ["base_ang_vel", "command", "projected_gravity", "joint_pos", "joint_vel", "last_action", "clock"]
assert list(widths.values()) == [3, 3, 3, 12, 12, 12, 2]

# a list for the joints each, as in robot.ini; 0.62 of the drives' torques and 0.85 at the ankles, and no limit of speed, as in the MJCF
joints = {key: value.partition(";")[0].split() for key, value in robot["joints"].items()}
assert joints["names"] == names
for key, name in (("default_joint_pos", "pose"), ("joint_stiffness", "kp"), ("joint_damping", "kd")):
    assert numbers[key] == list(map(float, joints[name])), (key, numbers[key])
assert numbers["joint_effort_limit"] == ([86.8] * 4 + [20.4] * 2) * 2 and numbers["joint_velocity_limit"] == ([25] * 4 + [31] * 2) * 2
mjcf = (root / "robots/sa01/sa01.xml").read_text(encoding="utf-8")
for name, low, high in zip(names, numbers["joint_pos_low"], numbers["joint_pos_high"], strict=True):
    assert re.search(rf'name="{name}"[^>]*range="([^"]*)"', mjcf)[1] == f"{low:g} {high:g}", (name, low, high)

# the clock and the rest, as in the C
for key, name in (("policy_period", "PERIOD"), ("action_scale", "ACTION_SCALE"), ("action_clip", "ACTION_CLIP"), ("history_means", "MEANS"),
                  ("history_stride", "STRIDE"), ("clock", "CLOCK"), ("gait_period", "GAIT_PERIOD"), ("gait_slowing", "GAIT_SLOWING"),
                  ("gait_slow_below", "GAIT_SLOW_BELOW"), ("standing_below", "STANDING_BELOW")):
    assert abs(numbers[key][0] - defined[name]) <= 1e-6 * abs(defined[name]), (key, data[key], defined[name])
assert data["estimate_rule"].startswith("base velocity times 4, ") and data["estimate_rule"].endswith("foot times 10")
print(f"metadata: {len(data)} keys")
