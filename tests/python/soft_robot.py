"""A robot of two feet of any kind on soft ground: what the engine plugin does to it in MuJoCo, for other engines to be held to."""
import mujoco
import numpy as np

import mild

SOILS = ["sand_loose", "foam45", "grass"]
XML = """<mujoco>
<compiler angle="radian"/><option timestep="0.002" integrator="INTEGRATOR"/>
<asset><mesh name="shoe" vertex="-.1 -.04 -.12  .1 -.05 -.12  .1 .05 -.12  -.1 .04 -.12  0 0 .02  0 .03 -.1"/></asset>
<worldbody>
  <geom name="floor" type="plane" size="5 5 .1"/>
  <body name="trunk" pos="0 0 .4"><freejoint/><geom type="box" size=".15 .1 .1" mass="8"/>
    <body name="left" pos="0 .14 -.3">
      <joint name="l1" type="hinge" axis="0 1 0" damping="1" range="-1.5 1.5"/>
      <joint name="l2" type="slide" axis="0 0 1" range="-.1 .1" damping="20" stiffness="2000"/>
      <geom name="leg" type="capsule" fromto="0 0 .1 0 0 -.02" size=".02" mass=".2"/> FEET
    </body>
    <body name="right" pos="0 -.14 -.3">
      <joint name="r1" type="hinge" axis="1 0 0" damping="1" range="-1.5 1.5"/>
      <joint name="r2" type="slide" axis="0 0 1" range="-.1 .1" damping="20" stiffness="2000"/> FEET
    </body>
  </body>
</worldbody>
<actuator><motor joint="l1"/><motor joint="r1"/><position joint="l2" kp="500" kv="5"/></actuator>
</mujoco>"""
KINDS = {"box": '<geom type="box" size=".1 .05 .02" pos=".02 0 -.1" euler=".02 .03 .3" mass="1"/>',
         "capsules": '<geom type="capsule" fromto="-.08 0 -.1 .08 .01 -.1" size=".03" mass=".5"/>'
                     '<geom type="capsule" fromto="-.08 .04 -.1 .08 .04 -.1" size=".03" mass=".5"/>',
         "cylinder": '<geom type="cylinder" size=".06 .01" pos="0 0 -.11" mass="1"/>',
         "ellipsoid": '<geom type="ellipsoid" size=".12 .06 .03" pos=".02 .01 -.1" mass="1"/>',
         "mesh": '<geom type="mesh" mesh="shoe" mass="1"/>',
         "site": '<site name="SIDE" pos=".02 0 -.12" euler=".05 -.05 .4"/><geom type="box" size=".1 .05 .02" pos=".02 0 -.1" mass="1"/>',
         "sphere": '<geom type="sphere" size=".04" pos=".01 0 -.08" mass="1"/>'}
CTRL, APPLIED, PUSH = [1, -0.5, 0.02], [0, 0, 0, 0, 0, 0, 0.4, -20, -0.3, 10], [5, -3, -20, 0.3, 0.2, 0.1]


def robot(kind, integrator="implicitfast"):
    """A trunk on two feet of a kind. Beside a mesh or a sphere there is no leg, which would be the foot instead, or another foot."""
    text = XML.replace("INTEGRATOR", integrator)
    if kind in ("mesh", "sphere"):
        text = text.replace('<geom name="leg" type="capsule" fromto="0 0 .1 0 0 -.02" size=".02" mass=".2"/>', "")
    for side in ("left", "right"):
        text = text.replace("FEET", KINDS[kind].replace("SIDE", f"{side}_sole"), 1)
    return text, [f"{side}_sole" if kind == "site" else side for side in ("left", "right")]


def start(data, seed):
    """A state near the ground; each has other velocities."""
    random = np.random.default_rng(seed)
    data.qpos[2], data.qpos[3:7] = 0.395, [1, *random.uniform(-0.02, 0.02, 3)]
    data.qpos[7:], data.qvel[:] = random.uniform(-0.02, 0.02, 4), random.uniform(-0.2, 0.2, 10)
    data.qvel[[2, 7, 9]] = -0.5, 0, 0
    data.ctrl[:], data.qfrc_applied[:], data.xfrc_applied[1] = CTRL, APPLIED, PUSH


def reference(spec, feet, soil, seed, steps):
    """Forces and torques of the engine plugin, (steps, feet, 6), and the data at the end."""
    mild.attach(spec, feet=feet, ground=soil, sensor="feet", surface=False)
    model = spec.compile()
    data, seen = mujoco.MjData(model), []
    start(data, seed)
    for _ in range(steps):
        mujoco.mj_step(model, data)
        seen.append(data.sensordata.reshape(2, 12)[:, :6].copy())
    return np.array(seen), data
