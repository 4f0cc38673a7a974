#!/usr/bin/env python3
"""Holds the numbers of `mild eval --json` to what the program says elsewhere: eval_numbers.py TABLE JSON STANCES TRACK ACTIONS THREE TURN TURN_JSON.
Table and JSON of two trials, their stances, track and actions as CSV, JSON of three trials, table and JSON of a walk that turns."""
import csv
import json
import math
import re
import statistics
import sys

failures = 0


def near(what, is_, wanted, within):
    global failures
    if not abs(is_ - wanted) <= within:
        print(f"{what}: {is_}, but {wanted} +- {within} is printed elsewhere")
        failures += 1


def cells(path):
    """The numbers of the table's last line, behind the ground's name."""
    with open(path, encoding="utf-8") as file:
        return [float(n) for n in re.findall(r"-?\d+\.?\d*", file.read().strip().splitlines()[-1].split(None, 1)[1])]


def rows(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def row(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)["rows"][0]


def mean(values):
    values = list(values)
    return sum(values) / len(values)


table, both, stances, track, actions, three, turn_table, turning = sys.argv[1:]
m, r, s, t, a = row(three), row(both), rows(stances), rows(track), rows(actions)
speed, upright, trials, velocity, half, cot, torque, clearance, sink, drift, power, sideways, asked_sideways = cells(table)[:13]
for what, is_, wanted, within in (
        ("speed", r["speed"], speed, 0.005), ("success", r["success"], upright, 0), ("trials", r["trials"], trials, 0),
        ("velocity", r["velocity"], velocity, 5e-4), ("cot", r["cot"], cot, 0.005), ("torque_max", r["torque_max"], torque, 0.05),
        ("velocity_low", r["velocity_low"], r["velocity"] - half, 5e-4), ("velocity_high", r["velocity_high"], r["velocity"] + half, 5e-4),
        ("clearance", 1e3 * r["clearance"], clearance, 0.5), ("penetration", 1e3 * r["penetration"], sink, 0.05),
        ("drift", 1e3 * r["drift"], drift, 0.05), ("energy", r["energy"] / r["seconds"], power, 0.5),
        ("velocity_sideways", r["velocity_sideways"], sideways, 5e-4), ("sideways", r["sideways"], asked_sideways, 0.005),
        ("measured", r["measured"], 2, 0), ("turn", r["turn"], 0, 0), ("push", r["push"], 0, 0)):
    near(what, is_, wanted, within)

# what ended the trials, one by one
near("trials by their ends", sum(r["ends"].values()), trials, 0)
near("trials one by one", len(r["each"]), trials, 0)
for end, count in r["ends"].items():
    near(f"trials ended by {end}", count, sum(x["end"] == end for x in r["each"]), 0)
near("least distance of the legs", r["legs"], min(x["legs"] for x in r["each"]), 0)
near("seconds of the trials", mean(x["seconds"] for x in r["each"]), r["seconds"], 1e-9)
near("trials ended by time", r["ends"]["time"], upright, 0)

# the stances: what the means are of
near("penetration of the stances", r["penetration"], mean(float(x["depth_m"]) for x in s), 1e-6)
near("drift_forward", r["drift_forward"], mean(abs(float(x["forward_m"])) for x in s), 1e-6)
near("drift_left", r["drift_left"], mean(abs(float(x["left_m"])) for x in s), 1e-6)
near("drift of the stances", r["drift"], mean(math.hypot(float(x["forward_m"]), float(x["left_m"])) for x in s), 2e-6)

near("largest torque of the stances", max(x["torque_max"] for x in r["each"]), max(float(x["torque_n_m"]) for x in s), 1e-3)
near("torque_max of the trials", r["torque_max"], mean(x["torque_max"] for x in r["each"]), 1e-9)
strides = [(math.hypot(float(b["x_m"]) - float(a["x_m"]), float(b["y_m"]) - float(a["y_m"])), float(b["start_s"]) - float(a["start_s"]))
           for k in "01" for foot in "01"
           for own in [[x for x in s if (x["trial"], x["foot"]) == (k, foot) and float(x["start_s"]) >= 2]] for a, b in zip(own, own[1:])]
near("stride", r["stride"], mean(way for way, _ in strides), 0.02)  # the last one, whose stance does not end, counts too
near("cadence", r["cadence"], 1 / mean(time for _, time in strides), 0.02)

# the track: speed, sideways speed, time, and how far the base goes up and down after 2 s
trial = [[x for x in t if x["trial"] == str(k)] for k in range(2)]
steady = [[x for x in own if float(x["time_s"]) >= 2] for own in trial]


def rate(own, column):
    return (float(own[-1][column]) - float(own[0][column])) / (float(own[-1]["time_s"]) - float(own[0]["time_s"]))


height = [[float(x["base_z_m"]) for x in own] for own in steady]
near("seconds", r["seconds"], mean(float(own[-1]["time_s"]) for own in trial), 0.011)
near("velocity of the track", r["velocity"], mean(rate(own, "base_x_m") for own in steady), 0.005)
for one_of, own in zip(r["each"], trial):
    near("place of the base at the end", one_of["x"], float(own[-1]["base_x_m"]), 1e-5)
near("velocity_sideways of the track", r["velocity_sideways"], mean(rate(own, "base_y_m") for own in steady), 0.005)
near("base_oscillation", r["base_oscillation"], mean(max(own) - min(own) for own in height), 2e-3)

# the actions: how smoothly it moves after the first second (the last step's end is not in them)
def columns(own, name, unit=""):
    return [[float(x[c]) for c in own[0] if c.startswith(name) and c.endswith(unit)] for x in own]


def changes(own, steps):
    """[rad] of the targets, at the SA01's 0.5 rad per unit action."""
    targets = columns(own, "action")
    return [[0.5 * (b - a) for a, b in zip(*pair)] for pair in zip(targets[100 - steps:], targets[100:])]


def rms(values):
    return math.sqrt(mean(v * v for row in values for v in row))


walks = [[x for x in a if x["trial"] == str(k)] for k in range(2)]
settled = [x for own in walks for x in own[101:]]
near("target_jump", r["target_jump"], max(abs(v) for own in walks for row in changes(own, 1) for v in row), 1e-7)
near("action_jerk", r["action_jerk"], rms([row for own in walks for row in changes(own, 2)]) / 0.25, 1e-6)
near("tilt_rate", r["tilt_rate"], math.sqrt(2) * rms([w[:2] for w in columns(settled, "omega")]), 0.002 * r["tilt_rate"])
near("yaw_rate", r["yaw_rate"], rms([w[2:] for w in columns(settled, "omega")]), 0.002 * r["yaw_rate"])
near("flight of a walk", r["flight"], 0, 0.005)
near("joint_speed", r["joint_speed"], rms(columns(settled, "speed_", "_rad_s")), 0.002 * r["joint_speed"])

# The third trial beside the two is known by the means, and its deviation from them by theirs. (Not one beside two: a network rounds a row
# that is alone otherwise.)
for key in ("velocity", "cot", "torque_max"):
    name = f"{key.removesuffix('_max')}_deviation"
    third = 3 * m[key] - 2 * r[key]
    near(name, m[name], math.sqrt((r[name]**2 + 2 * (r[key] - m[key])**2 + (third - m[key])**2) / 2), 1e-9 * m[key])
    if row(turning)[name] is not None:
        near(f"{name} of one trial", 1, 0, 0)
near("torque_deviation", r["torque_deviation"], statistics.stdev(one_of["torque_max"] for one_of in r["each"]), 1e-9 * r["torque_max"])

turned, asked = cells(turn_table)[10:12]
near("velocity_turn", row(turning)["velocity_turn"], turned, 5e-4)
near("turn", row(turning)["turn"], asked, 0.005)
sys.exit(failures > 0)
