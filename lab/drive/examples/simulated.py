"""A robot to try a client of `mild drive` with: in MuJoCo on soft ground, in a process of its own (lab/drive/README.md).

    python simulated.py [--robot sa01|g1|go1] [--ground NAME] [--seconds T] [--lockstep] [--log FILE.csv] -- CLIENT ARGUMENTS...

It starts the client, writes it a line for each state (quaternion 4, angular velocity 3, angles 12, speeds 12) and reads a line for each
target (angles 12, kp 12, kd 12, torque limits 12; an empty one: stand). It is as a robot is: it goes on when no target comes, 400
states a second. With --lockstep its time stands still until each state, one every 10 ms, is answered."""
import argparse
import configparser
import pathlib
import subprocess
import sys
import time

import mujoco
import numpy as np

import mild

PATIENCE = 60  # [s] for the first target
parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--robot", default="sa01", help="with 12 joints: sa01, g1, go1")
parser.add_argument("--ground", default="sand_loose")
parser.add_argument("--seconds", type=float, default=5)
parser.add_argument("--lockstep", action="store_true")
parser.add_argument("--log", help="time, place, height and torques, a row for each state")
parser.add_argument("client", nargs="+")
given = parser.parse_args()

folder = pathlib.Path(mild.__file__).parent / "data/robots" / given.robot
ini = configparser.ConfigParser(inline_comment_prefixes=";")
ini.read(folder / "robot.ini")
feet = [ini[section] for section in ini.sections() if section.startswith("foot.")]
spec = mujoco.MjSpec.from_file(str(folder / ini["robot"]["model"]))
if feet[0]["shape"] == "round":
    for foot in feet:
        spec.body(foot["body"]).add_geom(name="ball_" + foot["body"], size=[float(foot["radius"]), 0, 0], mass=0, contype=0, conaffinity=0,
                                         pos=[float(word) for word in foot["center"].split()])
    soles = {"sole": " ".join("ball_" + foot["body"] for foot in feet)}
else:
    soles = {"sole_z": float(feet[0]["z"]), "elements": int(feet[0].get("elements", "0")),
             "outline": " ; ".join(" ".join(foot["outline"].split()) for foot in feet)}
mild.attach(spec, [foot["body"] for foot in feet], given.ground, **soles)
if not spec.actuators:
    for name in ini["joints"]["names"].split():
        spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT).set_to_motor()
model = spec.compile()
model.opt.timestep = 0.0025
data = mujoco.MjData(model)
data.qpos[7:] = [float(word) for word in ini["joints"]["pose"].split()]
data.qpos[2] = height = float(ini["robot"]["height"]) + 0.01  # [m]
client = subprocess.Popen(given.client, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
target, rows = None, []
begin, steps = time.monotonic(), 4 if given.lockstep else 1
try:
    while data.time < given.seconds and data.qpos[2] > 0.6 * height:
        client.stdin.write(" ".join(f"{number:.9g}" for number in (*data.qpos[3:7], *data.qvel[3:6], *data.qpos[7:], *data.qvel[6:])) + "\n")
        line = client.stdout.readline()
        if not line:
            break
        if line.strip():
            if target is None:
                print("simulated: the first target has come", file=sys.stderr, flush=True)
                begin = time.monotonic()
            target = np.array(line.split(), float).reshape(4, 12)
        if target is None:  # held by its stand
            if time.monotonic() - begin > PATIENCE:
                print(f"simulated: no target for {PATIENCE} s", file=sys.stderr)
                break
            time.sleep(model.opt.timestep)
            continue
        angle, kp, kd, limit = target
        for _ in range(steps):
            data.ctrl = np.clip(kp * (angle - data.qpos[7:]) - kd * data.qvel[6:], -limit, limit)
            mujoco.mj_step(model, data)
        rows.append([data.time, data.qpos[0], data.qpos[2], *data.ctrl])
        if not given.lockstep:
            time.sleep(max(0, begin + data.time - time.monotonic()))
    client.stdin.close()
except BrokenPipeError:
    pass
code = client.wait()
if given.log:
    np.savetxt(given.log, rows, delimiter=",", header="time_s,x_m,height_m," + ",".join(f"torque_{i}_nm" for i in range(12)), comments="", fmt="%.6g")
print(f"{given.ground}: {data.qpos[0]:.2f} m in {data.time:.2f} s, {'upright' if data.qpos[2] > 0.6 * height else 'fallen'}")
sys.exit(code)
