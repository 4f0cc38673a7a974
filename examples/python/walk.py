"""The shipped policy walks on soft ground in MuJoCo. python walk.py [GROUND] [--view] [--picture FILE.png]

The robot is an MJCF, the ground comes by mild.attach, the policy is policy.py: nothing here is special to mild's program.
--view opens MuJoCo's viewer (`pip install glfw`), --picture writes how it looks at the end (`pip install pillow pyopengl`)."""
import contextlib
import pathlib
import sys
import threading
import time

import mujoco
import numpy as np
from policy import POSE, Policy

import mild

ROOT = pathlib.Path(__file__).resolve().parents[2]
KP = np.array([50, 50, 70, 70, 20, 20] * 2)  # [N m/rad] docs/policy.md, section 5
KD = np.array([5, 5, 7, 7, 0.2, 0.2] * 2)  # [N m s/rad]
LIMIT = 0.85 * np.array([140, 140, 140, 140, 24, 24] * 2)  # [N m]
SECONDS, COMMAND = 8, [0.6, 0, 0]  # forward, to the left [m/s], turning left [rad/s]

words = sys.argv[1:]
view, picture = "--view" in words, words[words.index("--picture") + 1] if "--picture" in words else None
ground = next((word for word in words if word not in ("--view", "--picture", picture)), "sand_loose")

spec = mujoco.MjSpec.from_file(str(ROOT / "robots/sa01/sa01.xml"))
mild.attach(spec, ["leg_l6_link", "leg_r6_link"], ground, prints=256)
model = spec.compile()
model.opt.timestep = 0.0025
data = mujoco.MjData(model)
data.qpos[2], data.qpos[7:] = 0.84, POSE
policy, rotation = Policy(ROOT / "policies/mild.safetensors"), np.zeros(9)
window, threads = contextlib.nullcontext(), set(threading.enumerate())
if view:
    import mujoco.viewer
    window = mujoco.viewer.launch_passive(model, data, show_left_ui=False, show_right_ui=False)
with window as viewer:
    if viewer:
        viewer.cam.type, viewer.cam.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, model.camera("track").id
    start = time.monotonic()
    while data.time < SECONDS:
        mujoco.mju_quat2Mat(rotation, data.qpos[3:7])
        frame = policy.observe(data.qvel[3:6], -rotation[6:9], COMMAND, data.qpos[7:], data.qvel[6:])
        target = POSE + 0.5 * policy.act(frame)
        for _ in range(4):  # 10 ms
            data.ctrl = np.clip(KP * (target - data.qpos[7:]) - KD * data.qvel[6:], -LIMIT, LIMIT)
            mujoco.mj_step(model, data)
        if viewer:
            viewer.sync()
            time.sleep(max(0, start + data.time - time.monotonic()))
for thread in set(threading.enumerate()) - threads:
    thread.join()  # the viewer draws until its window is gone; a program that ends before crashes
print(f"{ground}: {data.qpos[0]:.2f} m in {data.time:.1f} s, {'upright' if data.qpos[2] > 0.6 else 'fallen'}")
if picture:
    from PIL import Image
    model.vis.global_.offwidth, model.vis.global_.offheight = 1920, 1080
    camera = mujoco.MjvCamera()
    camera.lookat[:], camera.distance, camera.azimuth, camera.elevation = [data.qpos[0] - 0.3, data.qpos[1], 0.35], 2.3, 140, -18
    data.light("sun").xpos[:2] += data.qpos[:2]  # it casts shadows only near its own place
    renderer = mujoco.Renderer(model, 1080, 1920, max_geom=10000)
    renderer.update_scene(data, camera)
    Image.fromarray(renderer.render()).resize((960, 540), Image.LANCZOS).quantize(128).save(picture)
