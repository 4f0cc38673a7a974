#!/usr/bin/env python3
"""Legs that turn through sand about a fixed hip: lift and thrust of a flat leg and of a C-leg by resistive force theory, beside measured
ones (docs/soil.md, "Wheels and C-legs"). The sand's one number, zeta, is that of the flat leg's greatest lift.

    .venv/bin/python scripts/c_leg.py

Needs the plugin, $MILD_PLUGIN or build/mujoco_plugin/libmild_plugin.so."""
import argparse
import math
import os
import pathlib
import tempfile

import mujoco
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
PLUGIN = os.environ.get("MILD_PLUGIN") or str(ROOT / "build/mujoco_plugin/libmild_plugin.so")

# Li, Zhang, Goldman (2013), Science 339, 1408, supplement: legs of 76.2 x 25.4 x 6.4 mm turn at 0.2 rad/s about a hip 20 mm above the
# ground. Figure S12, which the repository DaWei-Xu/project_MPM_robot_soil read off it (Fig_S12_A.csv and Fig_S12_B.csv at 438bc17b,
# "Yuma sand"; the supplement was not at hand): greatest lift and thrust [N], and where [rad]. `theory`: their own resistive force theory
# there. The third leg of the figure, the C-leg reversed, is left out: in that file its measured lift is a seventh of their theory's.
LENGTH, WIDTH, THICKNESS, HIP, RATE = 0.0762, 0.0254, 0.0064, 0.020, 0.2
MEASURED = {"flat": (7.18, -0.61, 9.02, -0.18), "C": (16.33, -0.70, 10.45, -0.19)}
THEORY = {"flat": (7.12, -0.72, 9.32, -0.18), "C": (22.01, -0.80, 11.23, -0.39)}


def boxes(leg, parts=16):
    """Half sizes, centres and angles about y of a leg that hangs down from the hip at the origin. C: a half circle that bulges to the
    side that it turns to."""
    if leg == "flat":
        return [(THICKNESS / 2, LENGTH / 2, 0.0, -LENGTH / 2, 0.0)]
    radius = LENGTH / 2
    made = []
    for i in range(parts):
        angle = math.pi * (i + 0.5) / parts  # from the hip to the tip
        x, z = -radius * math.sin(angle), -radius + radius * math.cos(angle)
        made.append((THICKNESS / 2, radius * math.pi / parts / 2, x, z, math.pi / 2 - angle))
    return made


def rig(leg, soil, pitch):
    shapes = "".join(
        f'<geom type="box" size="{thick:.9g} {WIDTH / 2} {half:.9g}" pos="{x:.9g} 0 {z:.9g}" euler="0 {-math.degrees(turn):.9g} 0" '
        'mass="0" contype="0" conaffinity="0"/>' for thick, half, x, z, turn in boxes(leg))
    return f"""<mujoco><option timestep="0.002" integrator="Euler" gravity="0 0 0"/>
<extension><plugin plugin="mild.ground"><instance name="ground"><config key="body" value="leg"/><config key="body_pitch" value="{pitch}"/>
<config key="ground" value="{soil}"/></instance></plugin></extension>
<worldbody><body name="leg" pos="0 0 {HIP}"><joint type="hinge" axis="0 1 0" armature="1e5"/>
<inertial pos="0 0 0" mass="0.1" diaginertia="1 1 1"/>{shapes}</body></worldbody>
<sensor><plugin name="feel" plugin="mild.ground" instance="ground"/></sensor></mujoco>"""


def turn(leg, soil, pitch=0.003):
    """Greatest lift [N] and its angle [rad], greatest thrust and its angle. Means over 0.02 rad."""
    model = mujoco.MjModel.from_xml_string(rig(leg, soil, pitch))
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = -0.75 * math.pi, RATE
    rows = []
    while data.qpos[0] < 0.75 * math.pi:
        mujoco.mj_step(model, data)
        feel = data.sensor("feel").data
        rows.append((data.qpos[0], feel[2], feel[0]))
    angle, lift, thrust = np.array(rows).T
    lift, thrust = (np.convolve(force, np.ones(50) / 50, mode="same") for force in (lift, thrust))
    return lift.max(), angle[lift.argmax()], thrust.max(), angle[thrust.argmax()]


def compute(model, folder):
    """{leg: peaks}. A stress is proportional to zeta, so that one turn of the flat leg determines it."""
    soil = pathlib.Path(folder) / f"{model}.ini"

    def sand(zeta):
        soil.write_text(f"[ground]\nmodel = {model}\nzeta = {zeta}\nmu = 0\nk_drift = 0\nb_drift = 0\nbed_depth = 1\n")
        return soil
    zeta = MEASURED["flat"][0] / turn("flat", sand(1))[0]
    return zeta, {leg: turn(leg, sand(zeta)) for leg in MEASURED}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.parse_args()
    mujoco.mj_loadPluginLibrary(PLUGIN)
    found = {"measured": MEASURED, "their theory": THEORY}
    with tempfile.TemporaryDirectory() as folder:
        for model in ("ecc_quasi", "ecc_quasi_3d"):
            zeta, peaks = compute(model, folder)
            found[f"{model}, zeta {zeta:.2f}"] = peaks
    print(f"{'':33}lift [N]  at [rad]  thrust [N]  at [rad]")
    for leg in MEASURED:
        for name, peaks in found.items():
            print(f"{leg:6}{name:26}" + "".join(f"{value:10.2f}" for value in peaks[leg]))


if __name__ == "__main__":
    main()
