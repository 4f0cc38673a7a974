#!/usr/bin/env python3
"""S50 of a policy on a robot of robots/, by the engine plugin or by the batch engine: `mild trial --sweep` on the same model.

    PYTHONPATH=build/python .venv/bin/python lab/bench/s50_engines.py batch go1 examples/trial/policies.py:Go1 \\
        --describe examples/trial/mild_go1.ini --sweep stiffness --seconds 20 --range 0.03,30 --seed 1 --noise 1      # or plugin

Both walk robots/ROBOT with the description's gains, efforts and armature, on the soles of robot.ini and the shells of KEEP. The batch
engine steps a robot; what the policy sees and when it has fallen is computed by mild.trials from its qpos and qvel."""
import configparser
import pathlib
import sys
import tempfile

import mujoco
import numpy as np

import mild
from mild import envs, trials

ROOT = next(place for place in pathlib.Path(mild.__file__).resolve().parents if (place / "robots/g1").is_dir())
KEEP = {"g1": ("left_shin", "right_shin"), "sa01": ("leg_l4_link_box", "leg_r4_link_box"), "go1": ()}
PERIOD = 0.01  # [s] of a step of Envs
PLAIN = {"task.torque_share": 1, "task.action_clip": 100, "task.action_scale": 0.5, "task.observe_noise": False, "task.may_lie": True,
         "task.tilt_limit": 3.1, "task.episode": 1000, "task.assist": False, "train.robots": "batch", "train.grounds": 1,
         "randomize.base_mass": (0, 0), "randomize.com_offset": 0, "randomize.link_mass": (1, 1), "randomize.armature": (1, 1),
         "randomize.motor_offset": 0, "randomize.gain": (1, 1), "randomize.strength": (1, 1), "randomize.latency": (0, 0),
         "randomize.push_interval": 0, "randomize.initial_velocity": 0, "randomize.rigid_share": 0, "randomize.preset_share": 1,
         "randomize.preset_jitter": 0, "randomize.patch_share": 0, "randomize.slip_share": 0, "randomize.model": "own"}


def read(robot):
    ini = configparser.ConfigParser(inline_comment_prefixes=(";", "#"))
    ini.read(ROOT / "robots" / robot / "robot.ini")
    return ini, [ini[section] for section in ini.sections() if section.startswith("foot.")]


def model(robot):
    """The robot's MJCF with shapes that collide, its soles and KEEP, and the options of mild trial that go with it."""
    ini, feet = read(robot)
    spec = mujoco.MjSpec.from_file(str(ROOT / "robots" / robot / ini["robot"]["model"]))
    for geom in spec.geoms:
        geom.contype = int(geom.name in KEEP[robot])
    for foot in feet:
        if foot["shape"] == "round":
            shape = dict(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[float(foot["radius"]), 0, 0], pos=[float(x) for x in foot["center"].split()])
        else:
            x = np.array(foot["outline"].split(), float).reshape(-1, 2)
            half = 0.5 * (x.max(axis=0) - x.min(axis=0))
            shape = dict(type=mujoco.mjtGeom.mjGEOM_BOX, size=[*half, 0.005], pos=[*(x.min(axis=0) + half), float(foot["z"]) + 0.005])
        spec.body(foot["body"]).add_geom(name=f"sole_{foot['body']}", mass=0, contype=1, conaffinity=0, **shape)
    bodies = " ".join(dict.fromkeys(geom.parent.name for geom in spec.geoms if geom.name in KEEP[robot])) or "-"
    attach = [f"pitch={feet[0].get('pitch', '0.0195')}"]
    if feet[0]["shape"] == "outline":
        attach += ["outline=" + ";".join(foot["outline"].replace("\n", " ") for foot in feet), f"sole_z={feet[0]['z']}",
                   f"elements={feet[0].get('elements', '0')}"]
    return spec.to_xml(), ["--set", "feet.names=" + " ".join(foot["body"] for foot in feet), "--set", f"feet.bodies={bodies}",
                           *(word for one in attach for word in ("--attach", one))]


class Walker(trials.Walker):
    """A trial by the batch engine."""

    def __init__(self, model, network, description, ground, options):
        super().__init__(model, network, description, "rigid", {**options, "attributes": {}})
        name, r = pathlib.Path(model).stem, self.robot
        ini, spec = read(name)[0], mujoco.MjSpec.from_file(str(model))
        self.order = np.array([r.joints.index(joint) for joint in ini["joints"]["names"].split()])
        for joint, dof in zip(r.joints, r.qvel):
            spec.joint(joint).armature = r.model.dof_armature[dof]
        spec.body(ini["robot"]["base"]).add_geom(name="aloft", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0, 0], pos=[0, 0, 1], mass=0)
        ini["robot"]["shells"] = " ".join(KEEP[name] or ["aloft"])  # none is refused: one that touches nothing
        for section, key in (("robot", "legs"), ("joints", "speed"), ("joints", "full_speed")):
            ini[section].pop(key, None)
        effort = np.minimum(r.effort[: len(r.joints)], [spec.joint(joint).actfrcrange[1] for joint in r.joints])
        for key, values in (("pose", r.default), ("kp", r.kp), ("kd", r.kd), ("effort", effort)):
            ini["joints"][key] = " ".join(repr(float(values[k])) for k in self.order)
        self.folder = tempfile.TemporaryDirectory()
        place = pathlib.Path(self.folder.name)
        (place / ini["robot"]["model"]).write_text(spec.to_xml())
        with open(place / "robot.ini", "w") as file:
            ini.write(file)
        mild.Material(ground).save(place / "ground.ini")
        self.keys = {**PLAIN, "randomize.presets": str(place / "ground.ini"), "randomize.passive": bool(mild.Material(ground).passive),
                     "randomize.initial_joint": options["noise"] * description.noise["start_joint"], "task.physics_dt": r.model.opt.timestep}

    def begin(self, command, seed):
        super().begin(command, seed)
        self.envs = e = envs.open_envs(1, robot=self.folder.name, overrides=self.keys, device="cpu", seed=seed, threads=1)
        self.flags = {name: np.zeros(1, np.uint8) for name in ("done", "timeout", "valid")}
        self.buffers = e.buffers(history=np.zeros((1, e.frames, e.observation), np.float32), reward=np.zeros(1, np.float32), **self.flags)
        self.qpos, self.qvel, self.torque = (np.zeros((1, more + e.actions), np.float32) for more in (7, 6, 0))
        e.reset(self.buffers)
        self.take()

    def take(self):
        r, d = self.robot, self.data  # MuJoCo's data show the batch engine's robot
        self.envs.read(qpos=self.qpos, qvel=self.qvel, torque=self.torque)
        d.qpos[:7], d.qvel[:6] = self.qpos[0, :7], self.qvel[0, :6]
        d.qpos[r.qpos[self.order]], d.qvel[r.qvel[self.order]] = self.qpos[0, 7:], self.qvel[0, 6:]

    def walk(self, command, seed, film=None):
        self.begin(command, seed)
        every = self.description.policy["decimation"] * self.robot.model.opt.timestep / PERIOD
        if abs(every - round(every)) > 1e-9 or self.delay:
            raise ValueError("policy: the batch engine takes a decision every 10 ms, or every few, without a delay")
        end, k, torque = "time", 0, 0.0
        while k < round(self.options["seconds"] / PERIOD) and end == "time":
            target = self.decide() if k % round(every) == 0 else target
            self.envs.step(((target - self.robot.default)[self.order] / PLAIN["task.action_scale"]).astype(np.float32)[None], self.buffers)
            k += 1
            self.take()
            self.data.time, torque = k * PERIOD, max(torque, float(np.abs(self.torque).max()))
            end = "not_finite" if self.flags["done"][0] or not self.flags["valid"][0] else self.fallen() or "time"
        self.envs.close()
        return trials.Walk(seed, k * PERIOD, end, None, None, None, torque, None)


if __name__ == "__main__":
    side, robot, *rest = sys.argv[1:]
    text, options = model(robot)
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / f"{robot}.xml").write_text(text)
        trials.Walker = Walker if side == "batch" else trials.Walker
        sys.exit(trials.main([f"{folder}/{robot}.xml", *rest, *options]))
