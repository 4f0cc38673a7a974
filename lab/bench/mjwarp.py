#!/usr/bin/env python3
"""MuJoCo Warp's step on a robot of ours with rigid ground: the peer of `mild bench robots`.

usage: mjwarp.py [ROBOT_FOLDER] [--worlds 4096,16384,65536] [--dt 0.0025,0.005] [--json FILE]

Needs mujoco, mujoco-warp, warp-lang, numpy and an NVIDIA GPU. The model is that of the engine: the robot of the folder
without visual geoms, the corners of robot.ini as spheres on a plane, a motor a joint. From the default pose, standing,
each world steps 40 times under its own random torques of 5 N m in a captured graph; best of five.
--processor needs no GPU: MuJoCo steps the same worlds on the CPU by mujoco.rollout, on one thread and on one a core.
--check needs neither: it steps one world and prints the contacts."""
import argparse
import configparser
import json
import os
import time

import mujoco
import numpy as np

STEPS = 40


def numbers(text):
    return [float(x) for x in text.split()]


def read_ini(path):
    """Values go over several lines and end in a remark."""
    text = configparser.ConfigParser(inline_comment_prefixes=(";",), empty_lines_in_values=False)
    text.read(path)
    return text


def model_of(folder):
    ini = read_ini(os.path.join(folder, "robot.ini"))
    spec = mujoco.MjSpec.from_file(os.path.join(folder, ini["robot"]["model"]))
    for thing in [g for g in spec.geoms if g.name != "floor"] + list(spec.cameras) + list(spec.lights):
        spec.delete(thing)
    if not any(g.name == "floor" for g in spec.geoms):
        spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.05])
    for section in (s for s in ini.sections() if s.startswith("foot.")):
        if "corners" not in ini[section]:
            raise SystemExit(f"{folder}/robot.ini: [{section}] has no corners, which the rigid contact needs here")
        corners = np.reshape(numbers(ini[section]["corners"]), (-1, 3))
        for corner in corners:
            spec.body(ini[section]["body"]).add_geom(
                type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=corner, mass=0, contype=1, conaffinity=1,
                size=[float(ini[section]["corner_radius"]), 0, 0])
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 1
    names = ini["joints"]["names"].split()
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    for name in names:
        spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    model = spec.compile()
    data = mujoco.MjData(model)
    for name, angle in zip(names, numbers(ini["joints"]["pose"])):
        data.qpos[model.joint(name).qposadr[0]] = angle
    mujoco.mj_forward(model, data)
    spheres = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE)
    data.qpos[2] -= np.min(data.geom_xpos[spheres, 2] - model.geom_size[spheres, 0]) + 1e-3
    return model, data.qpos.copy()


def torques(model, worlds):
    return np.random.default_rng(1).normal(0, 5, (worlds, model.nu)).astype(np.float32)


def start(model, qpos, dt):
    model.opt.timestep = dt
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_step(model, data)
    return data


def check(model, qpos, dt):
    data = start(model, qpos, dt)
    contacts = [data.ncon]
    for row in torques(model, STEPS):
        data.ctrl[:] = row
        mujoco.mj_step(model, data)
        contacts.append(data.ncon)
    print(f"dt {dt}: contacts {contacts[0]} at first, {np.mean(contacts):.1f} on the mean")


def row(case, value, unit="1/s"):
    """As `mild bench --json` has them."""
    return {"bench": "mjwarp", "case": case, "value": value, "unit": unit}


def bench(model, qpos, dt, worlds):
    """(versions, rows)"""
    import mujoco_warp as mjw
    import warp as wp
    data = start(model, qpos, dt)
    m = mjw.put_model(model)
    d = mjw.put_data(model, data, nworld=worlds, nconmax=16, njmax=80)
    first_qpos, first_qvel = wp.clone(d.qpos), wp.clone(d.qvel)
    wp.copy(d.ctrl, wp.array(torques(model, worlds), dtype=float))
    mjw.step(m, d)
    with wp.ScopedCapture() as capture:
        mjw.step(m, d)
    rates, contacts = [], []
    for attempt in range(6):
        wp.copy(d.qpos, first_qpos)
        wp.copy(d.qvel, first_qvel)
        wp.synchronize()
        begin = time.perf_counter()
        for _ in range(STEPS):
            wp.capture_launch(capture.graph)
            if attempt == 5:
                contacts.append(d.nacon.numpy()[0] / worlds)
        wp.synchronize()
        if attempt < 5:
            rates.append(1e-6 * STEPS * worlds / (time.perf_counter() - begin))
    print(f"mujoco {mujoco.__version__}, warp {wp.config.version}, rigid, dt {dt}, {worlds} worlds: "
          f"{max(rates):.2f} M physics steps/s; contacts of a world {contacts[0]:.1f} at first, "
          f"{np.mean(contacts):.1f} on the mean", flush=True)
    name = f"rigid_{1e3 * dt:g}ms_{worlds}"
    return ({"mujoco": mujoco.__version__, "warp": wp.config.version, "mujoco_warp": getattr(mjw, "__version__", "unknown")},
            [row(name, 1e6 * max(rates)), row(name + "_contacts", float(np.mean(contacts)), "-")])


def processor(model, qpos, dt, worlds):
    """(versions, rows)"""
    from mujoco import rollout
    data, rows = start(model, qpos, dt), []
    state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    controls = np.repeat(torques(model, worlds)[:, None, :], STEPS, axis=1).astype(float)
    for threads in sorted({1, os.cpu_count()}):
        datas, rates = [mujoco.MjData(model) for _ in range(threads)], []
        for _ in range(6):
            begin = time.perf_counter()
            rollout.rollout(model, datas, np.tile(state, (worlds, 1)), controls)
            rates.append(STEPS * worlds / (time.perf_counter() - begin))
        print(f"mujoco {mujoco.__version__}, rigid, dt {dt}, {worlds} worlds on {threads} threads: {max(rates[1:]):.4g} physics steps/s",
              flush=True)
        rows.append(row(f"rigid_{1e3 * dt:g}ms_{threads}_threads", max(rates[1:])))
    return {"mujoco": mujoco.__version__}, rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robot", nargs="?", default="robots/sa01")
    parser.add_argument("--worlds", default="4096,16384,65536")
    parser.add_argument("--dt", default="0.0025,0.005")
    parser.add_argument("--processor", action="store_true")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--json", metavar="FILE", help="write {versions, rows: [{bench, case, value, unit}]} to FILE")
    given = parser.parse_args()
    model, qpos = model_of(given.robot)
    found = {"versions": {}, "rows": []}
    for dt in (float(x) for x in given.dt.split(",")):
        if given.check:
            check(model, qpos, dt)
            continue
        for worlds in (int(x) for x in given.worlds.split(",")):
            versions, rows = (processor if given.processor else bench)(model, qpos, dt, worlds)
            found["versions"].update(versions)
            found["rows"] += rows
    if given.json:
        with open(given.json, "w", encoding="utf-8") as file:
            json.dump(found, file, indent=1)


if __name__ == "__main__":
    main()
