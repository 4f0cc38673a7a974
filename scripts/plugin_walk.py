#!/usr/bin/env python3
"""A shipped policy on soft ground in plain MuJoCo: mj_step, the engine plugin, position actuators (docs/plugin.md).

    python scripts/plugin_walk.py go1 --ground foam45 --step 0.002

Needs mujoco, numpy and the plugin, $MILD_PLUGIN or build/mujoco_plugin/libmild_plugin.so. Prints how many trials of ten seconds
stayed upright, and their mean speed after the first two. --model takes the robot's MJCF from elsewhere, with the same names."""
import argparse
import configparser
import os
import pathlib
import sys

import mujoco
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples/python"))
from policy import Policy  # noqa: E402

PLUGIN = os.environ.get("MILD_PLUGIN") or str(ROOT / "build/mujoco_plugin/libmild_plugin.so")
# Joints that the policy does not move: angle [rad] by a part of the name, else 0; kp, kd, armature, limit of the torque.
HELD = {"shoulder_pitch": 0.2, "left_shoulder_roll": 0.2, "right_shoulder_roll": -0.2, "elbow": 0.6}
HOLD = 2000, 40, 0.2, 1000


def arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("robot", choices=["sa01", "go1", "g1"])
    parser.add_argument("--ground", default="rubber", help="mild info grounds")
    parser.add_argument("--step", type=float, default=0.002, help="[s] 0.001, 0.002 or 0.005")
    parser.add_argument("--integrator", default="implicitfast", choices=["Euler", "implicitfast", "implicit", "discrete"])
    parser.add_argument("--speed", type=float, default=0.5, help="[m/s]")
    parser.add_argument("--trials", type=int, default=10)
    parser.add_argument("--model", help="MJCF (default: the one in robots/)")
    parser.add_argument("--sole", nargs="*", help="geoms of --model that form the soles (default: the soles of robot.ini)")
    return parser.parse_args()


def read(path):
    ini = configparser.ConfigParser(inline_comment_prefixes=(";",))
    ini.read(path)
    return ini


def numbers(text):
    return np.array(text.split(), float)


def stand_on(spec, feet, args):
    """Soft ground under the feet; their soles are those of robot.ini, or geoms of the model."""
    config = {"feet": " ".join(foot["body"] for foot in feet), "ground": args.ground}
    if args.sole:
        config["sole"] = " ".join(args.sole)
    elif feet[0]["shape"] == "outline":
        config["sole_z"], config["elements"] = feet[0]["z"], feet[0].get("elements", "0")
        config["outline"] = ";".join(foot["outline"].replace("\n", " ") for foot in feet)
    else:
        config["sole"] = " ".join("ball_" + foot["body"] for foot in feet)
        for foot in feet:
            spec.body(foot["body"]).add_geom(name="ball_" + foot["body"], size=[float(foot["radius"]), 0, 0],
                                             pos=numbers(foot["center"]), mass=0, contype=0, conaffinity=0)
    spec.activate_plugin("mild.ground")
    spec.add_plugin(name="ground", plugin_name="mild.ground", active=True).config = config


def build(args, ini, feet):
    """The model with a position actuator for each joint, the policy's first, and their names."""
    own = mujoco.MjSpec.from_file(str(ROOT / "robots" / args.robot / ini["robot"]["model"]))
    spec = mujoco.MjSpec.from_file(args.model) if args.model else own
    names = ini["joints"]["names"].split()
    efforts = [0.85 * own.joint(name).actfrcrange[1] for name in names]
    gains = zip(numbers(ini["joints"]["kp"]), numbers(ini["joints"]["kd"]), [own.joint(name).armature for name in names], efforts)
    motors = dict(zip(names, gains))
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    for name in names + [j.name for j in spec.joints if j.type == mujoco.mjtJoint.mjJNT_HINGE and j.name not in names]:
        kp, kd, spec.joint(name).armature, limit = motors.get(name, HOLD)
        actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, forcerange=[-limit, limit])
        actuator.set_to_position(kp=kp, kv=kd)
    stand_on(spec, feet, args)
    spec.option.timestep = args.step
    spec.option.integrator = getattr(mujoco.mjtIntegrator, "mjINT_" + args.integrator.upper())
    return spec.compile(), names


def start(model, joints, pose, feet, random):
    """A robot near its pose that just touches the ground."""
    data = mujoco.MjData(model)
    for i in range(model.nu):
        name = model.actuator(i).name
        data.ctrl[i] = data.joint(name).qpos = next((angle for part, angle in HELD.items() if part in name), 0)
    data.qpos[joints] = pose + random.uniform(-0.1, 0.1, len(pose))
    mujoco.mj_kinematics(model, data)
    data.qpos[2] -= min(data.body(f["body"]).xpos[2] + (float(f["z"]) if f["shape"] == "outline" else
                                                        numbers(f["center"])[2] - float(f["radius"])) for f in feet)
    return data


def walk(model, joints, args, ini, policy, data):
    """Mean speed [m/s]; None after a fall."""
    for k in range(1000):
        if k == 200:
            begin = data.qpos[0]
        w, x, y, z = data.qpos[3:7]
        gravity = -np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
        if -gravity[2] < np.cos(1):
            return None
        turn = np.clip(-np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)), -0.5, 0.5)  # holds the heading
        frame = policy.observe(data.qvel[3:6], gravity, [args.speed, 0, turn], data.qpos[joints], data.qvel[joints - 1])
        data.ctrl[: len(joints)] = policy.pose + float(ini["robot"]["action_scale"]) * policy.act(frame)
        mujoco.mj_step(model, data, round(0.01 / args.step))
    return (data.qpos[0] - begin) / 8


def main():
    args = arguments()
    mujoco.mj_loadPluginLibrary(PLUGIN)
    ini = read(ROOT / "robots" / args.robot / "robot.ini")
    feet = [ini[section] for section in ini.sections() if section.startswith("foot.")]
    model, names = build(args, ini, feet)
    joints = np.array([model.joint(name).qposadr[0] for name in names])
    pose, speeds = numbers(ini["joints"]["pose"]), []
    for trial in range(args.trials):
        random = np.random.default_rng(trial)
        file = "mild" if args.robot == "sa01" else args.robot
        policy = Policy(ROOT / "policies" / f"{file}.safetensors", pose=pose)
        policy.phase = random.choice([0, 0.5])
        speeds.append(walk(model, joints, args, ini, policy, start(model, joints, pose, feet, random)))
    stood = [speed for speed in speeds if speed is not None]
    print(f"{args.robot} {args.ground} {1e3 * args.step:g} ms {args.integrator}: {len(stood)} of {args.trials} upright, "
          f"{np.mean(stood or [0]):.4f} m/s")


main()
