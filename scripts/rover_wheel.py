#!/usr/bin/env python3
"""A rigid wheel at a held slip on a soil fitted from plates and shear alone: drawbar pull, torque and sinkage of our models beside
measured ones and the formulas of Wong and Reece (docs/soil.md, "Wheels").

    .venv/bin/python scripts/rover_wheel.py                      # the table: build/mild fit, then MuJoCo with the plugin
    .venv/bin/python scripts/rover_wheel.py --figure docs/rover-wheel.png

Needs build/mild and the plugin, $MILD_PLUGIN or build/mujoco_plugin/libmild_plugin.so."""
import argparse
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import mujoco
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
PLUGIN = os.environ.get("MILD_PLUGIN") or str(ROOT / "build/mujoco_plugin/libmild_plugin.so")

# Ding, Gao, Deng, Nagatani, Yoshida (2011): Experimental study and analysis on driving wheels' performance for planetary exploration
# rovers moving in deformable soil, J. Terramechanics 48, 27-45. Soil: table 2, K 9.7 to 13.1 mm. Wheel without lugs (Wh34), 80 N:
# figure 9. The paper was not at hand: numbers are those that the repository Autonomous-Mission-Systems-Lab/roverdevkit read off it
# (data/soil_simulants.csv and data/validation/single_wheel_experiments.csv at 69e1c815, "digitised, approximate").
SOIL = {"k_c": 15.6e3, "k_phi": 2407.4e3, "exponent": 1.10, "cohesion": 250.0, "angle": 31.9, "shear_length": 0.0114}
RADIUS, WIDTH, LOAD = 0.15735, 0.165, 80.0
SLIPS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.6)
MEASURED = {"pull": (-6.5, 11.0, 14.5, 15.0, 15.0, 15.0), "torque": (0.0, 3.0, 4.2, 4.8, 5.0, 5.3),
            "sinkage": (0.005, 0.0055, 0.0075, 0.010, 0.0125, 0.0175)}
GRAINS = {"slip_length": 0.0019, "regain_length": 0.00068, "grip": 0.123}  # docs/model.md, section 22
GRAVITY, SPEED, TURN = 9.81, 0.1, 1.2  # [m/s^2], [m/s] of the hub, [rad] that the wheel rolls before it is measured


# ---- the soil, from plates and shear ----

def pressure(depth, width):
    return (SOIL["k_c"] / width + SOIL["k_phi"]) * depth ** SOIL["exponent"]


def strength(stress, slid):
    return (SOIL["cohesion"] + stress * math.tan(math.radians(SOIL["angle"]))) * -np.expm1(-slid / SOIL["shear_length"])


def write(path, header, *columns):
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="")


def fit(mild, folder):
    """The files of the soils, {name: path}, by `mild fit`. The records are what the published numbers say of two plates, pressed
    slowly by 20 mm, and of shear under three pressures."""
    time, depth = np.linspace(0, 20, 400), np.linspace(0, 0.02, 400)
    plates = []
    for width in (0.08, WIDTH):
        write(folder / f"plate{width}.csv", "time_s,depth_m,force_n", time, depth, pressure(depth, width) * 2 * width * width)
        plates += ["--plate", f"{2 * width},{width}"]
    slid = np.linspace(0, 0.08, 400)
    for stress in (3e3, 6e3, 12e3):
        write(folder / f"shear{stress:.0f}.csv", "slip_m,shear_pa,pressure_pa", slid, strength(stress, slid), np.full(400, stress))
    files = {"bekker": folder / "bekker.ini", "mild": folder / "mild.ini", "ecc_quasi": folder / "ecc_quasi.ini"}
    mu = math.tan(math.radians(SOIL["angle"]))
    wide = [str(folder / f"plate{WIDTH}.csv")]
    jobs = {
        "bekker": [str(path) for path in sorted(folder.glob("*.csv"))] + plates + ["--hold", "k_drift=0,b_drift=0,bed_depth=1,recovery=0"],
        # Slow presses determine neither added mass nor, on their own, nu: those of loose sand.
        "mild": wide + plates[2:] + ["--fit", "k_pen,sigma_cone", "--hold-from", "sand_loose"],
        "ecc_quasi": wide + plates[2:] + ["--hold", "bed_depth=1,mu=0,k_drift=0,b_drift=0"],
    }
    for model, arguments in jobs.items():
        done = subprocess.run([mild, "fit", *arguments, "--model", model, "--soil", str(files[model])], capture_output=True, text=True)
        if done.returncode:
            sys.exit(done.stderr)
    text = files["mild"].read_text()
    for name, value in {"mu": mu, "bed_depth": 1}.items():
        text = re.sub(rf"^{name} = .*$", f"{name} = {value}", text, flags=re.M)
    files["mild"].write_text(text)
    files["mild, slip"] = folder / "slip.ini"
    for name, value in GRAINS.items():
        text = re.sub(rf"^{name} = .*$", f"{name} = {value}", text, flags=re.M)
    files["mild, slip"].write_text(text)
    return files


# ---- the wheel ----

def rim(sides=96, radius=RADIUS, width=WIDTH):
    angle = 2 * math.pi * np.arange(sides) / sides
    ring = np.stack([radius * np.cos(angle), np.zeros(sides), radius * np.sin(angle)], axis=1)
    return np.concatenate([ring + (0, y, 0) for y in (-width / 2, width / 2)])


def rig(ground, pitch, points, radius=RADIUS, load=LOAD, timestep=0.001):
    """A hub of the wheel's load on a vertical slide, on a carriage too heavy for the wheel to slow; so is the wheel's inertia."""
    vertices = " ".join(f"{x:.9g}" for x in points.ravel())
    return f"""<mujoco><compiler balanceinertia="true"/><option timestep="{timestep}" integrator="Euler"/>
<extension><plugin plugin="mild.ground"><instance name="ground"><config key="body" value="wheel"/><config key="ground" value="{ground}"/>
<config key="body_pitch" value="{pitch}"/></instance></plugin></extension>
<asset><mesh name="rim" vertex="{vertices}"/></asset>
<worldbody><body><joint type="slide" axis="1 0 0"/><inertial pos="0 0 0" mass="1e7" diaginertia="1 1 1"/>
<body pos="0 0 {radius + 1e-4}"><joint type="slide" axis="0 0 1"/><inertial pos="0 0 0" mass="{load / GRAVITY / 2}" diaginertia="1 1 1"/>
<body name="wheel"><joint type="hinge" axis="0 1 0" armature="1e7"/><inertial pos="0 0 0" mass="{load / GRAVITY / 2}" diaginertia="1 1 1"/>
<geom type="mesh" mesh="rim" contype="0" conaffinity="0" mass="0"/></body></body></body></worldbody>
<sensor><plugin name="feel" plugin="mild.ground" instance="ground"/></sensor></mujoco>"""


def roll(ground, slip, pitch=0.012, speed=SPEED):
    """Means over the second half of the way: pull [N], torque [N m], sinkage [m]."""
    model = mujoco.MjModel.from_xml_string(rig(ground, pitch, rim()))
    data = mujoco.MjData(model)
    turn = speed / (RADIUS * (1 - slip))
    data.qvel[:] = speed, 0, turn
    rows = []
    while turn * data.time < 2 * TURN:
        mujoco.mj_step(model, data)
        feel = data.sensor("feel").data
        rows.append((feel[0], -feel[4], -(data.qpos[1] + 1e-4)))
    assert abs(data.qvel[0] - speed) < 1e-3 * speed and abs(data.qvel[2] - turn) < 1e-3 * turn
    return np.mean(rows[len(rows) // 2:], axis=0)


# ---- Wong and Reece (1967), "Prediction of rigid wheel performance based on the analysis of soil-wheel stresses", part I ----

def integrate(stress, slip, sinkage, c1, c2):
    """[N, N, N m] weight, pull and torque of a driven wheel. stress: [Pa] of a sinkage."""
    front = math.acos(1 - sinkage / RADIUS)
    top = (c1 + c2 * slip) * front  # where the radial stress is greatest
    angle = np.linspace(0, front, 2001)
    folded = np.where(angle >= top, angle, front - angle / top * (front - top))
    radial = stress(RADIUS * np.maximum(np.cos(folded) - math.cos(front), 0))
    slid = RADIUS * ((front - angle) - (1 - slip) * (math.sin(front) - np.sin(angle)))
    shear = strength(radial, slid)

    def total(values):
        return RADIUS * WIDTH * np.sum((values[1:] + values[:-1]) / 2) * (angle[1] - angle[0])
    return (total(radial * np.cos(angle) + shear * np.sin(angle)), total(shear * np.cos(angle) - radial * np.sin(angle)),
            RADIUS * total(shear))


def wong(slip, c1=0.18, c2=0.32):
    """Pull [N], torque [N m], sinkage [m]. c1 and c2 are measured under wheels: theirs on loose sand; on compact sand 0.43 and 0.32 (as
    printed in public code that cites them)."""
    low, high = 1e-5, RADIUS / 2
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if integrate(lambda z: pressure(z, WIDTH), slip, middle, c1, c2)[0] < LOAD else (low, middle)
    _, pull, torque = integrate(lambda z: pressure(z, WIDTH), slip, low, c1, c2)
    return pull, torque, low


# ---- the table ----

def compute(mild, models=None):
    """{name: (slips, 3) pull, torque, sinkage}"""
    mujoco.mj_loadPluginLibrary(PLUGIN)
    found = {"measured": np.array([MEASURED[name] for name in ("pull", "torque", "sinkage")]).T,
             "Wong-Reece": np.array([wong(slip) for slip in SLIPS])}
    with tempfile.TemporaryDirectory() as folder:
        for name, path in fit(mild, pathlib.Path(folder)).items():
            if models is None or name in models:
                found[name] = np.array([roll(path, slip) for slip in SLIPS])
    return found


def show(found):
    for column, (what, scale) in enumerate((("drawbar pull [N]", 1), ("torque [N m]", 1), ("sinkage [mm]", 1000))):
        print(f"{what:18}" + "".join(f"{slip:8.1f}" for slip in SLIPS) + "   mean error, slip 0.1 and more")
        for name, rows in found.items():
            error = np.abs(rows[1:, column] - found["measured"][1:, column]).mean() * scale
            print(f"  {name:16}" + "".join(f"{value * scale:8.1f}" for value in rows[:, column]) +
                  (f"   {error:.1f}" if name != "measured" else ""))


def draw(found, path):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(1, 3, figsize=(9, 2.6))
    for column, (axis, what, scale) in enumerate(zip(axes, ("drawbar pull [N]", "torque [N m]", "sinkage [mm]"), (1, 1, 1000))):
        for name, rows in found.items():
            style = {"measured": "ko", "Wong-Reece": "k--"}.get(name, "-")
            axis.plot(SLIPS, rows[:, column] * scale, style, label=name, markersize=4, linewidth=1.2)
        axis.set_xlabel("slip ratio")
        axis.set_title(what, fontsize=9)
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=80)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mild", default=str(ROOT / "build/mild"), help="the program")
    parser.add_argument("--model", nargs="*", help="of bekker, mild, 'mild, slip', ecc_quasi (default: all)")
    parser.add_argument("--figure", help="draw it, PNG")
    options = parser.parse_args()
    found = compute(options.mild, options.model)
    show(found)
    if options.figure:
        draw(found, options.figure)


if __name__ == "__main__":
    main()
