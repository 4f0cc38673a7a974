#!/usr/bin/env python3
"""A shipped policy on soft ground in plain MuJoCo: mj_step, the engine plugin, position actuators (docs/plugin.md).

    python scripts/plugin_walk.py go1 --ground foam45 --step 0.002
    python scripts/plugin_walk.py sa01 --ground sand_loose --step 0.0025 --integrator Euler --speed 0.6 --time

Needs mujoco, numpy and the plugin, $MILD_PLUGIN or build/mujoco_plugin/libmild_plugin.so. Prints how many trials of ten seconds
stayed upright, and their mean speed after the first two. --model takes the robot's MJCF from elsewhere, with the same names.

--time: mj_step along three seconds of that walk, which are played again 15 times, a control period of 10 ms at once: with the plugin,
in the same states without any ground, and along a walk on MuJoCo's own floor, where the corners of robot.ini are spheres. The three take
turns; a row is the mean over the periods of the medians of the repeats."""
import argparse
import configparser
import json
import os
import pathlib
import sys
import time

import mujoco
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples/python"))
from policy import Policy  # noqa: E402

PERIOD = 0.01  # [s] from one action to the next
TIMED, REPEATS = 300, 15  # periods of a walk
# Joints that the policy does not move: angle [rad] by a part of the name, else 0; kp, kd, armature, limit of the torque.
HELD = {"shoulder_pitch": 0.2, "left_shoulder_roll": 0.2, "right_shoulder_roll": -0.2, "elbow": 0.6}
HOLD = 2000, 40, 0.2, 1000


def fail(text):
    print(f"plugin_walk.py: {text}", file=sys.stderr)
    sys.exit(2)


def arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("robot", choices=["sa01", "go1", "g1"])
    parser.add_argument("--ground", default="rubber", help="mild info grounds")
    parser.add_argument("--step", type=float, default=0.002, help="[s] a part of 0.01")
    parser.add_argument("--integrator", default="implicitfast", choices=["Euler", "implicitfast", "implicit", "discrete"])
    parser.add_argument("--speed", type=float, default=0.5, help="[m/s]")
    parser.add_argument("--trials", type=int, default=10)
    parser.add_argument("--model", help="MJCF (default: the one in robots/)")
    parser.add_argument("--sole", nargs="*", help="geoms of --model that form the soles (default: the soles of robot.ini)")
    parser.add_argument("--plugin", default=os.environ.get("MILD_PLUGIN") or str(ROOT / "build/mujoco_plugin/libmild_plugin.so"))
    parser.add_argument("--time", action="store_true")
    parser.add_argument("--json", metavar="FILE", help="with --time: write {versions, rows: [{bench, case, value, unit}]} to FILE")
    return parser.parse_args()


def read(path):
    ini = configparser.ConfigParser(inline_comment_prefixes=(";",))
    ini.read(path)
    return ini


def numbers(text):
    return np.array(text.split(), float)


def stand_on(spec, feet, args):
    """Soft ground under the feet; their soles are those of robot.ini, or geoms of the model."""
    config = {"feet": " ".join(foot["body"] for foot in feet), "ground": args.ground, "pitch": feet[0].get("pitch", "0.0195")}
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


def stand_on_corners(spec, feet, args):
    """MuJoCo's own contact, of the corners of robot.ini with a floor."""
    if not all("corners" in foot for foot in feet):
        fail(f"--time: robots/{args.robot}/robot.ini has no corners, which MuJoCo's own floor needs")
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.05], contype=0, conaffinity=2)
    for foot in feet:
        for corner in numbers(foot["corners"]).reshape(-1, 3):
            spec.body(foot["body"]).add_geom(size=[float(foot["corner_radius"]), 0, 0], pos=corner, mass=0, contype=2, conaffinity=0)


def build(args, ini, feet, under=stand_on):
    """The model with a position actuator for each joint, the policy's first, and their names. under: what it stands on, or None."""
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
    if under:
        under(spec, feet, args)
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


def walk(model, joints, args, ini, policy, data, states=None):
    """Mean speed [m/s]; None after a fall. states: takes what mj_step begins with, a period each, and the walk ends with them."""
    for k in range(TIMED if states is not None else 1000):
        if k == 200:
            begin = data.qpos[0]
        w, x, y, z = data.qpos[3:7]
        gravity = -np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
        if -gravity[2] < np.cos(1):
            return None
        turn = np.clip(-np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)), -0.5, 0.5)  # holds the heading
        frame = policy.observe(data.qvel[3:6], gravity, [args.speed, 0, turn], data.qpos[joints], data.qvel[joints - 1])
        data.ctrl[: len(joints)] = policy.pose + float(ini["robot"]["action_scale"]) * policy.act(frame)
        if states is not None:
            states.append(state_of(model, data, mujoco.mjtState.mjSTATE_INTEGRATION))
        mujoco.mj_step(model, data, round(PERIOD / args.step))
    return (data.qpos[0] - begin) / 8


def trial_of(number, model, names, args, ini, feet, states=None):
    """walk() of one trial."""
    joints, pose, random = np.array([model.joint(name).qposadr[0] for name in names]), numbers(ini["joints"]["pose"]), np.random.default_rng(number)
    file = "mild" if args.robot == "sa01" else args.robot
    policy = Policy(ROOT / "policies" / f"{file}.safetensors", pose=pose)
    policy.phase = random.choice([0, 0.5])
    return walk(model, joints, args, ini, policy, start(model, joints, pose, feet, random), states)


def state_of(model, data, parts):
    state = np.empty(mujoco.mj_stateSize(model, parts))
    mujoco.mj_getState(model, data, state, parts)
    return state


def time_steps(args, ini, feet):
    """{case: [us] of a step}"""
    whole, common = mujoco.mjtState.mjSTATE_INTEGRATION, sum(int(part) for part in (
        mujoco.mjtState.mjSTATE_QPOS, mujoco.mjtState.mjSTATE_QVEL, mujoco.mjtState.mjSTATE_CTRL, mujoco.mjtState.mjSTATE_WARMSTART))
    played, soft = {}, None
    for case, under in ((args.ground, stand_on), ("rigid", stand_on_corners)):
        model, names = build(args, ini, feet, under)
        states = []
        if trial_of(0, model, names, args, ini, feet, states) is None:
            fail(f"--time: the robot fell on {case}; another --speed, --step or --ground")
        played[case], soft = (model, states, whole), soft or (model, states)
    data, states = mujoco.MjData(soft[0]), []
    for state in soft[1]:
        mujoco.mj_setState(soft[0], data, state, whole)
        states.append(state_of(soft[0], data, common))
    played["air"] = build(args, ini, feet, None)[0], states, common
    steps = round(PERIOD / args.step)
    datas, took = {case: mujoco.MjData(play[0]) for case, play in played.items()}, {case: np.empty((REPEATS, TIMED)) for case in played}
    for repeat in range(REPEATS):
        for case, (model, states, parts) in played.items():
            for period, state in enumerate(states):
                mujoco.mj_setState(model, datas[case], state, parts)
                begin = time.thread_time()
                mujoco.mj_step(model, datas[case], steps)
                took[case][repeat, period] = time.thread_time() - begin
    return {case: 1e6 * float(np.mean(np.median(each, axis=0))) / steps for case, each in took.items()}


def main():
    args = arguments()
    if not os.path.isfile(args.plugin):
        fail(f"{args.plugin} is not there; `make build` makes it, --plugin or MILD_PLUGIN names another")
    if abs(PERIOD / args.step - round(PERIOD / args.step)) > 1e-9 or args.step > PERIOD:
        fail(f"--step {args.step:g}: it must be a part of {PERIOD}")
    mujoco.mj_loadPluginLibrary(args.plugin)
    ini = read(ROOT / "robots" / args.robot / "robot.ini")
    feet = [ini[section] for section in ini.sections() if section.startswith("foot.")]
    if args.time:
        found = time_steps(args, ini, feet)
        print(f"mj_step of {args.robot} at {args.speed:g} m/s, {1e3 * args.step:g} ms {args.integrator}, MuJoCo {mujoco.__version__}: "
              + ", ".join(f"{case} {us:.2f} us" for case, us in found.items()))
        if args.json:
            rows = [{"bench": "plugin", "case": case, "value": us, "unit": "us"} for case, us in found.items()]
            pathlib.Path(args.json).write_text(json.dumps({"versions": {"mujoco": mujoco.__version__}, "rows": rows}, indent=1) + "\n", encoding="utf-8")
        return
    model, names = build(args, ini, feet)
    speeds = [trial_of(trial, model, names, args, ini, feet) for trial in range(args.trials)]
    stood = [speed for speed in speeds if speed is not None]
    print(f"{args.robot} {args.ground} {1e3 * args.step:g} ms {args.integrator}: {len(stood)} of {args.trials} upright, "
          f"{np.mean(stood or [0]):.4f} m/s")


if __name__ == "__main__":
    main()
