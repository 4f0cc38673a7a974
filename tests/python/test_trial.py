"""mild.trial: descriptions, observations, feet, policies and measures. With MILD_PLUGIN, a file, also walks on soft ground."""
import configparser
import contextlib
import io
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import types
import unittest
import unittest.mock
import zipfile

import mujoco
import numpy as np

import mild
from mild import _stand, networks, tour, trials
from mild.describe import FOLDER, Description, Observer, State, by_joint, choose, numbers

ROOT = pathlib.Path(__file__).resolve().parents[2]
PLUGIN = os.environ.get("MILD_PLUGIN", "")

# A biped of 12 kg: a trunk, two legs with hip and ankle, soles of 0.2 m x 0.1 m. Visual plates under the soles, stairs in the world.
BIPED = """<mujoco model="biped"><compiler angle="radian"/><option timestep="0.002"/>
<asset><mesh name="look" vertex="0 0 0  .01 0 0  0 .01 0  0 0 .01"/></asset>
<worldbody><geom name="stair" type="box" size="0.1 1 0.1" pos="0.6 0 0"/>
  <body name="trunk" pos="0 0 0.7"><freejoint/><geom type="box" size="0.08 0.1 0.1" mass="8"/><site name="imu" pos="0.03 0 0" euler="0 0 1.5707963"/>
    {legs}
  </body></worldbody>
<actuator>{motors}</actuator></mujoco>"""
LEG = """<body name="{s}_leg" pos="0 {y} -0.12"><joint name="{s}_hip" axis="0 1 0" range="-1 1" armature="0.01"/>
  <geom type="capsule" size="0.03" fromto="0 0 -0.03 0 0 -0.28" mass="1"/>
  <body name="{s}_foot" pos="0 0 -0.34"><joint name="{s}_ankle" axis="0 1 0" range="-1 1" armature="0.01"/>{foot}</body></body>"""
BOX = '<geom type="box" size="0.1 0.05 0.01" pos="0 0 -0.03" mass="1"/><geom type="mesh" mesh="look" contype="0" conaffinity="0" mass="0"/>'
BALL = '<geom type="sphere" size="0.03" pos="0 0 -0.01" mass="1"/>'


def biped(foot=BOX, motors='<motor name="{0}" joint="{0}" gear="2" ctrlrange="-40 40"/>', text=BIPED):
    legs = "".join(LEG.format(s=s, y=y, foot=foot) for s, y in (("left", 0.12), ("right", -0.12)))
    return text.format(legs=legs, motors="".join(motors.format(joint) for joint in ("left_hip", "left_ankle", "right_hip", "right_ankle")))


def stander(**more):
    """A description that holds the default angles with stiff joints."""
    return {"policy": {"step": 0.002, "decimation": 5}, "observation": {"gravity": 1, "joint_position": 1, "command": 1},
            "kp": {".*": 400}, "kd": {".*": 8}, **more}


def still(observation):
    return np.zeros(4)


class Descriptions(unittest.TestCase):
    def test_layouts(self):
        """Each layout of the package is read; those that the page names are there; an unknown one names them."""
        self.assertTrue({"unitree_rl_gym", "legged_gym", "isaac_lab", "mjlab", "rsl_rl", "mujoco_playground"} <= set(mild.layouts()))
        for name in mild.layouts():
            self.assertTrue(Description(name).terms, name)
        with self.assertRaisesRegex(ValueError, "'nobody'.*isaac_lab"):
            Description("nobody")
        self.assertEqual([t.name for t in Description("rsl_rl").terms], [t.name for t in Description("isaac_lab").terms])
        self.assertEqual(FOLDER.name, "layouts")

    def test_examples(self):
        """Those of the public policies are read, and each is in the script that runs them; one without is described by what its options name or
        what comes with it."""
        sys.path.insert(0, str(ROOT / "scripts"))
        import public_policies
        names = {path.stem for path in (ROOT / "examples/trial").glob("*.ini")}
        self.assertLessEqual(names, set(public_policies.POLICIES))
        for name, (_, model, policy, *own) in public_policies.POLICIES.items():
            self.assertTrue(name in names or policy.endswith(".onnx") or "--describe" in own[0], name)
            for file in (model, policy):
                self.assertTrue(file.startswith("/") or file.split("/")[0] in public_policies.REPOSITORIES, file)
        for name in names:
            Description(ROOT / f"examples/trial/{name}.ini")

    def test_wrong(self):
        """What is wrong is one line that names the section and the key."""
        for wrong, line in (({"polcy": {}}, r"no section \[polcy\]"), ({"policy": {"rate": 3}}, r"\[policy\] has no key 'rate'"),
                            ({"policy": {"step": "fast"}}, "policy.step"), ({"history": {"stack": "heap"}}, "none of frame, term"),
                            ({"kp": {"(": 1}}, r"\[kp\] \("), ({"kp": {".*": "much"}}, r"\[kp\] .*much"), ({"policy": {"decimation": 0}}, "1 or more"),
                            ({"observation": {"wind": 1}}, "no term 'wind'"), ({"observation": {"gravity": ""}}, "needs a scale"),
                            ({"observation": {"gravity": "1*x"}}, "observation.gravity")):
            with self.assertRaisesRegex(ValueError, line):
                Description({**stander(), **wrong})
        with self.assertRaisesRegex(ValueError, "has no term"):
            Description({"policy": {}})

    def test_layers(self):
        """A file completes its layout; its observation and tables replace those of the layout; changes come last."""
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "mine.ini"
            path.write_text("[policy]\nlayout = unitree_rl_gym\ndecimation = 4 ; of mine\n[scale]\nleft.* = 3\n")
            d = Description(path, {"clock.period": "0.5"})
            self.assertEqual((d.policy["decimation"], d.policy["step"], d.clock["period"]), (4, 0.002, 0.5))
            self.assertEqual([(p.pattern, v) for p, v in d.scale], [("left.*", 3.0)])
            self.assertEqual(len(d.terms), 8)
            path.write_text("[policy]\nlayout = unitree_rl_gym\n[observation]\ngravity = 1\ncommand = 1\ncommand.2 = 0*3\n")
            self.assertEqual([t.name for t in Description(path).terms], ["gravity", "command", "command"])
            path.write_text("[policy] layout = unitree_rl_gym\n[observation]\ngravity = 1\n")
            with self.assertRaisesRegex(ValueError, r"mine.ini.* line: 1 .*layout"):
                Description(path)
        self.assertEqual(numbers("0.5*2 -1"), [0.5, 0.5, -1.0])

    def test_joints(self):
        names = ["left_hip", "left_knee", "right_hip", "right_knee"]
        rows = Description({**stander(), "kp": {".*": 1, ".*knee": 2, "left_knee": 3}}).kp
        self.assertEqual(by_joint(rows, names, 0, "kp").tolist(), [1, 3, 1, 2])
        self.assertEqual(choose(["(left|right)_knee", ".*"], names, "joints"), [1, 3, 0, 2])
        with self.assertRaisesRegex(ValueError, r"\[kp\] .*knee.*hip"):
            by_joint(rows, ["hip"], 0, "kp")
        with self.assertRaisesRegex(ValueError, "joints: .*'foot'"):
            choose(["foot"], names, "joints")


class Observations(unittest.TestCase):
    def setUp(self):
        """A tilted robot that moves."""
        self.model = mujoco.MjModel.from_xml_string(biped())
        self.data = mujoco.MjData(self.model)
        random = np.random.default_rng(4)
        self.data.qpos[3:7] = random.normal(size=4)
        mujoco.mju_normalize4(self.data.qpos[3:7])
        self.data.qpos[7:], self.data.qvel[:] = random.normal(size=4), random.normal(size=10)
        self.data.time = 0.3

    def observe(self, sections, frame=None, times=1):
        d = Description(sections)
        state = State(d, self.model, self.data, frame or (mujoco.mjtObj.mjOBJ_XBODY, 1), (np.arange(7, 11), np.arange(6, 10)))
        state.command, state.action, state.default = np.array([0.5, -0.1, 0.2]), np.array([1.0, 2, 3, 4]), np.full(4, 0.1)
        observer, seen = Observer(d, 4, 4), []
        for _ in range(times):
            state.read(lambda amplitude, count: np.zeros(count))
            seen.append(observer.observe(state))
            self.data.time += 0.02
        return seen

    def test_gym(self):
        """The layout unitree_rl_gym is what its deploy_mujoco.py says in words: numbers worked out from the quaternion here."""
        q, w, x, y, z = self.data.qpos, *self.data.qpos[3:7]
        gravity = np.array([-2 * (x * z - w * y), -2 * (y * z + w * x), -(1 - 2 * (x * x + y * y))])
        phase = 2 * np.pi * 0.3 / 0.8
        wanted = np.concatenate([0.25 * self.data.qvel[3:6], gravity, [1.0, -0.2, 0.05], q[7:] - 0.1, 0.05 * self.data.qvel[6:], [1, 2, 3, 4],
                                 [math.sin(phase), math.cos(phase)]])
        seen = self.observe("unitree_rl_gym")[0]
        self.assertEqual(seen.dtype, np.float32)
        np.testing.assert_allclose(seen, wanted, atol=1e-6)

    def test_frame(self):
        """In the axes of a site: a velocimeter and a gyroscope of MuJoCo there say the same."""
        text = biped().replace("</mujoco>", '<sensor><velocimeter site="imu"/><gyro site="imu"/></sensor></mujoco>')
        other = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(other)
        data.qpos[:], data.qvel[:] = self.data.qpos, self.data.qvel
        mujoco.mj_forward(other, data)
        seen = self.observe(stander(observation={"linear_velocity": 1, "angular_velocity": 1}), (mujoco.mjtObj.mjOBJ_SITE, self.model.site("imu").id))[0]
        np.testing.assert_allclose(seen, data.sensordata, atol=1e-6)

    def test_euler(self):
        """Rolled by 0.3, then pitched by 0.2, then turned by -0.5 about the world's axes."""
        self.data.qpos[3:7] = [1, 0, 0, 0]
        for angle, axis in ((0.3, 0), (0.2, 1), (-0.5, 2)):
            turn, product = np.zeros(4), np.zeros(4)
            mujoco.mju_axisAngle2Quat(turn, np.eye(3)[axis], angle)
            mujoco.mju_mulQuat(product, turn, self.data.qpos[3:7])
            self.data.qpos[3:7] = product
        np.testing.assert_allclose(self.observe(stander(observation={"euler": 1}))[0], [0.3, 0.2, -0.5], atol=1e-6)

    def test_history(self):
        """Four ways to lay out two terms of three decisions: the phase tells them apart."""
        terms = {"observation": {"phase_sin": 1, "constant": 7}, "clock": {"period": 1}}
        a, b, c = (math.sin(2 * math.pi * t) for t in (0.3, 0.32, 0.34))
        for history, wanted in (({"frames": 3}, [a, 7, b, 7, c, 7]), ({"frames": 3, "newest": "first"}, [c, 7, b, 7, a, 7]),
                                ({"frames": 3, "stack": "term"}, [a, b, c, 7, 7, 7]),
                                ({"frames": 3, "stack": "term", "newest": "first"}, [c, b, a, 7, 7, 7])):
            self.data.time = 0.3
            np.testing.assert_allclose(self.observe({**stander(), **terms, "history": history}, times=3)[2], wanted, atol=1e-6)
        for start, before in (("repeat", [a, 7]), ("zero", [0, 0])):
            self.data.time = 0.3
            np.testing.assert_allclose(self.observe({**stander(), **terms, "history": {"frames": 2, "start": start}})[0], [*before, a, 7], atol=1e-6)

    def test_clock(self):
        """Two clocks half a period apart; standing stops them."""
        terms = {"phase_cos": 1, "phase_sin": 1}
        p = 2 * math.pi * 0.3 / 0.5
        moving = [math.cos(p), -math.cos(p), math.sin(p), -math.sin(p)]
        for clock, wanted in (({}, moving), ({"standing": 1}, [0, 0, 0, 0]), ({"standing": 1, "standing_phase": 0.5}, [-1, -1, 0, 0])):
            self.data.time = 0.3
            seen = self.observe(stander(observation=terms, clock={"period": 0.5, "offsets": "0 0.5", **clock}))[0]
            np.testing.assert_allclose(seen, wanted, atol=1e-6)

    def test_slow_clock(self):
        """The command counts 0.5 + 3 0.1 + 0.2 = 1 m/s, four fifths of slow_below: the period is longer by a fifth of slowing. Where the command
        changes, the clock goes on from where it is."""
        self.data.time = 0.3
        seen = self.observe(stander(observation={"phase_sin": 1}, clock={"period": 0.5, "slowing": 0.5, "slow_below": 1.25}))[0]
        np.testing.assert_allclose(seen, [math.sin(2 * math.pi * 0.3 / (0.5 * 1.1))], atol=1e-6)
        state = State(Description(stander(observation={"phase_sin": 1}, clock={"period": 0.5, "slowing": 1, "slow_below": 1})), self.model, self.data, None, (0, 0))
        for time, speed, turns in ((0.25, 1.0, 0.5), (0.5, 0.0, 0.75), (0.75, 1.0, 1.25), (0.1, 1.0, 0.2)):
            self.data.time, state.command = time, np.array([speed, 0, 0])
            np.testing.assert_allclose(state.clock(np.sin), [math.sin(2 * math.pi * turns)], atol=1e-9)

    def test_scales(self):
        """One for each number, a clip, and a scale that does not fit."""
        seen = self.observe(stander(observation={"joint_position": "0*2 1*2", "action": 1}, policy={"clip": 2.5}))[0]
        np.testing.assert_allclose(seen, [0, 0, *np.clip(self.data.qpos[9:11] - 0.1, -2.5, 2.5), 1, 2, 2.5, 2.5], atol=1e-6)
        with self.assertRaisesRegex(ValueError, r"\b2 scales .*\b4 numbers"):
            self.observe(stander(observation={"action": "1 2"}))


class Standing(unittest.TestCase):
    def stand(self, text, ground="rigid", **sections):
        return _stand.stand(text, Description(stander(**sections)), ground, {})

    def test_feet(self):
        """Feet are what is lowest; obstacles go; a floor comes; the shanks are low enough to meet soft ground."""
        robot = self.stand(biped())
        self.assertEqual(robot.feet.names, ["left_foot", "right_foot"])
        self.assertEqual(robot.feet.bodies, ["left_leg", "right_leg"])
        np.testing.assert_allclose([_stand.area(outline) for outline in robot.feet.outlines], 0.02, rtol=1e-6)
        self.assertEqual(robot.remark, "1 obstacles of the world are left out")
        self.assertAlmostEqual(robot.start[2], 0.12 + 0.34 + 0.04, places=6)
        world = [geom for geom in range(robot.model.ngeom) if robot.model.geom_bodyid[geom] == 0]
        self.assertEqual([robot.model.geom_type[geom] for geom in world], [int(mujoco.mjtGeom.mjGEOM_PLANE)])

    def test_heel(self):
        """Of a body and its child that are both low the child is the foot, and the other meets the ground on any side."""
        text = biped().replace('fromto="0 0 -0.03 0 0 -0.28" mass="1"/>', 'fromto="0 0 -0.03 0 0 -0.28" mass="1"/><geom type="sphere" size="0.02" pos="-0.15 0 -0.35"/>')
        robot = self.stand(text)
        self.assertEqual((robot.feet.names, robot.feet.bodies), (["left_foot", "right_foot"], ["left_leg", "right_leg"]))

    def test_fused(self):
        """Where fusestatic moves the shapes of a head and a tail to the trunk, and so all numbers, soles are those of the feet."""
        part = '<body name="{}"><geom size="0.05" pos="0 0 0.2"/><geom size="0.05" pos="0 0 0.3"/></body>'.format
        text = biped().replace('<compiler ', '<compiler fusestatic="true" ').replace('<body name="left_leg"', part("head") + '<body name="left_leg"')
        robot = self.stand(text.replace("</body></worldbody>", part("tail") + "</body></worldbody>"))
        self.assertEqual(robot.model.nbody, 6)
        self.assertEqual((robot.feet.names, robot.feet.bodies), (["left_foot", "right_foot"], ["left_leg", "right_leg"]))
        self.assertEqual([robot.model.body(robot.model.geom_bodyid[geom]).name for geom in robot.soles], robot.feet.names)

    def test_turned(self):
        """A foot whose body's axes lie gets a site whose z axis points up from the sole, also where the sole is not level at the start."""
        for euler, pose in (("1.5707963 0 0", 0), ("0 1.5707963 0", 0), ("0 0.2 0", -0.2), ("0 0 0", 0.05)):
            foot = f'<geom type="box" size="0.1 0.05 0.01" pos="0 0 -0.03" euler="{euler}" mass="1"/>'
            if pose != 0.05:  # the sole is level in the world at the start
                size = {"1.5707963 0 0": "0.1 0.01 0.05", "0 1.5707963 0": "0.01 0.05 0.1"}.get(euler, "0.1 0.05 0.01")
                foot = foot.replace("0.1 0.05 0.01", size)
            robot = self.stand(biped(foot), default={".*ankle": pose})
            np.testing.assert_allclose(_stand.area(robot.feet.outlines[0]), 0.02, rtol=0.01)
            data = mujoco.MjData(robot.model)
            data.qpos[:] = robot.start
            mujoco.mj_kinematics(robot.model, data)
            name = robot.feet.names[0]
            site = mujoco.mj_name2id(robot.model, mujoco.mjtObj.mjOBJ_SITE, name)
            up = (data.site_xmat[site] if site >= 0 else data.xmat[robot.model.body(name).id])[[2, 5, 8]]
            np.testing.assert_allclose(up, [math.sin(pose), 0, math.cos(pose)] if pose == 0.05 else [0, 0, 1], atol=1e-6)

    def test_round(self):
        """A foot that is a ball is round: the sole is that geom alone, of a body with other shapes too."""
        robot = self.stand(biped(BALL + '<geom type="capsule" size="0.01" fromto="0 0 0.02 0 0 0.1" mass="0.1"/>'))
        self.assertEqual(len(robot.feet.soles), 2)
        np.testing.assert_allclose(_stand.area(robot.feet.outlines[0]), math.pi * 0.03**2, rtol=0.01)

    def test_shapes(self):
        """The lowest point of every kind of shape: MuJoCo's own distance to a plane far below agrees."""
        shapes = {"sphere": "0.1", "capsule": "0.05 0.2", "box": "0.1 0.2 0.3", "cylinder": "0.1 0.2", "ellipsoid": "0.1 0.2 0.3"}
        for kind, size in shapes.items():
            model = mujoco.MjModel.from_xml_string(f'<mujoco><worldbody><geom type="plane" size="9 9 1" pos="0 0 -0.5"/><body euler="20 50 70">'
                                                   f'<freejoint/><geom type="{kind}" size="{size}"/></body></worldbody></mujoco>')
            data = mujoco.MjData(model)
            mujoco.mj_forward(model, data)
            away = mujoco.mj_geomDistance(model, data, 0, 1, 5, None)
            self.assertAlmostEqual(_stand.lowest(model, data, 1), away - 0.5, places=5, msg=kind)

    def test_torque(self):
        """kp (target - q) - kd qd, clipped, by the motors that are there (gear 2) and by new ones, is the torque of the joint."""
        for motors in ('<motor name="{0}" joint="{0}" gear="2"/>', '<position name="{0}" joint="{0}" kp="7"/>', ""):
            d = Description(stander(effort={".*ankle": 3}))
            walker = trials.Walker(biped(motors=motors), networks.Callable(still), d, "rigid", {"noise": 0.0, "attributes": {}, "seconds": 1})
            walker.begin((0, 0, 0), 1)
            walker.data.qvel[6:] = 0.1
            walker.drive(np.full(4, 0.02))
            mujoco.mj_forward(walker.robot.model, walker.data)
            np.testing.assert_allclose(walker.data.qfrc_actuator[6:], [400 * 0.02 - 0.8, 3, 400 * 0.02 - 0.8, 3], atol=1e-9)

    def test_servo(self):
        """servo makes MuJoCo's position actuators; model uses those of the file, and names joints that have none."""
        for kind, motors, kp in (("servo", '<motor joint="{0}"/>', 400), ("model", '<position joint="{0}" kp="70"/>', 70)):
            d = Description(stander(actuator={"kind": kind}))
            walker = trials.Walker(biped(motors=motors), networks.Callable(still), d, "rigid", {"noise": 0.0, "attributes": {}, "seconds": 1})
            walker.begin((0, 0, 0), 1)
            walker.drive(np.full(4, 0.02))
            mujoco.mj_forward(walker.robot.model, walker.data)
            np.testing.assert_allclose(walker.data.qfrc_actuator[6:], kp * 0.02, atol=1e-9)
        with self.assertRaisesRegex(ValueError, "left_hip"):
            self.stand(biped(motors=""), actuator={"kind": "model"})

    def test_base(self):
        """A base on three slides and a ball floats; one on a hinge does not."""
        slides = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1")) + '<joint type="ball"/>'
        robot, free = self.stand(biped().replace("<freejoint/>", slides)), self.stand(biped())
        self.assertEqual(robot.joints, free.joints)
        self.assertAlmostEqual(robot.zero + robot.start[2], free.start[2], places=6)
        with self.assertRaisesRegex(ValueError, "free joint"):
            self.stand(biped().replace("<freejoint/>", '<joint name="pole"/>'))

    def test_missing(self):
        """A mesh whose file is not there is left out where it has no mass, and refused where it makes one; old attributes go."""
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "robot.xml"
            text = biped().replace('vertex="0 0 0  .01 0 0  0 .01 0  0 0 .01"', 'file="look.stl"')
            path.write_text(text)
            self.assertIn("1 meshes whose files are not there are left out", self.stand(path).remark)
            path.write_text(text.replace('contype="0" conaffinity="0" mass="0"', 'density="1000"'))
            with self.assertRaisesRegex(ValueError, "left_foot, right_foot"):
                self.stand(path)
            path.write_text(biped().replace('timestep="0.002"/>', 'timestep="0.002"><flag sensornoise="enable"/></option>'))
            self.assertIn("no longer knows are left out: sensornoise", self.stand(path).remark)
            with self.assertRaisesRegex(ValueError, "no file"):
                self.stand(folder + "/other.xml")

    def test_keyframe(self):
        """The default angles are those of the keyframe."""
        robot = self.stand(biped().replace("</mujoco>", '<keyframe><key name="home" qpos="0 0 1 1 0 0 0 0.1 -0.1 0.1 -0.1"/></keyframe></mujoco>'),
                           start={"keyframe": "home"})
        np.testing.assert_allclose(robot.default, [0.1, -0.1, 0.1, -0.1])
        with self.assertRaisesRegex(ValueError, "'away'"):
            self.stand(biped(), start={"keyframe": "away"})


class Session:
    """onnxruntime's InferenceSession of a network that counts its calls in its state."""

    def __init__(self, path, options, providers):
        self.calls = []

    def get_inputs(self):
        return [types.SimpleNamespace(name=name, shape=shape, type="tensor(float)") for name, shape in (("obs", ["batch", 3]), ("h_in", [1, "batch", 2]))]

    def get_outputs(self):
        return [types.SimpleNamespace(name=name) for name in ("actions", "h_out")]

    def run(self, names, values):
        assert names == ["actions", "h_out"], names
        return 10 * values["h_in"].reshape(1, 2) + values["obs"][:, :2], values["h_in"] + 1


class Networks(unittest.TestCase):
    def test_onnx(self):
        """The state goes round, and is 0 again after a reset. The network is a stand-in, so that no onnxruntime is needed."""
        fake = types.SimpleNamespace(SessionOptions=types.SimpleNamespace, InferenceSession=Session)
        with tempfile.NamedTemporaryFile(suffix=".onnx") as file, unittest.mock.patch.dict(sys.modules, onnxruntime=fake):
            network = networks.load(file.name, Description(stander()))
            for _ in range(2):
                network.reset()
                self.assertEqual([network.act(np.array([1, 2, 3], np.float32)).tolist() for _ in range(3)], [[1, 2], [11, 12], [21, 22]])
            with self.assertRaisesRegex(ValueError, r"\b3 numbers.*\b4\b"):
                network.act(np.zeros(4, np.float32))
            for keys, line in (({"input": "x"}, "policy.input: .* no 'x'; there are obs"), ({"output": "y"}, "policy.output"),
                               ({"state": "h_in>nothing"}, "policy.state"), ({"state": ""}, "policy.state")):
                with self.assertRaisesRegex(ValueError, line):
                    networks.load(file.name, Description(stander(policy=keys)))
        with tempfile.NamedTemporaryFile(suffix=".onnx") as file, unittest.mock.patch.dict(sys.modules, onnxruntime=None):
            with self.assertRaisesRegex(RuntimeError, r"pip install mildground\[trial\]"):
                networks.load(file.name, Description(stander()))

    def test_checkpoint(self):
        """A learner's checkpoint is no policy; seen without torch."""
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "model_1.pt"
            with zipfile.ZipFile(path, "w") as archive:
                archive.writestr("model_1/data.pkl", b"")
            with self.assertRaisesRegex(ValueError, "model_1.pt has weights alone.*onnx"):
                networks.load(path, Description(stander()))

    def test_named(self):
        """FILE.py:NAME, a function or a class; what is none."""
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "mine.py"
            path.write_text("class P:\n    def reset(self):\n        self.n = 0\n    def __call__(self, o):\n        self.n += 1\n        return [self.n]\n")
            network = networks.load(f"{path}:P", Description(stander()))
            network.reset()
            self.assertEqual([network.act(None).tolist(), network.act(None).tolist()], [[1], [2]])
            for policy, line in ((f"{path}:Q", "no callable 'Q'"), (f"{folder}/no.py:P", "no file"), ("no.onnx", "no file"), ("no.txt", "must end in")):
                with self.assertRaisesRegex(ValueError, line):
                    networks.load(policy, Description(stander()))


class Measures(unittest.TestCase):
    def test_definitions(self):
        """A robot that goes round a circle at 0.5 m/s with 2 N m at 3 rad/s in one joint: speed, cost, torque and stances by hand."""
        model = types.SimpleNamespace(opt=types.SimpleNamespace(timestep=0.01, gravity=np.array([0, 0, -10.0])))
        robot = types.SimpleNamespace(model=model, place=0, qvel=np.array([6, 7]), mass=4.0, feet=types.SimpleNamespace(names=["a", "b"]))
        sensor = np.zeros((2, 12))
        data = types.SimpleNamespace(qpos=np.zeros(9), qvel=np.array([0] * 6 + [3.0, 0]), qfrc_actuator=np.array([9.0] * 6 + [2, -2.5]),
                                     sensor=lambda name: types.SimpleNamespace(data=sensor.ravel()))
        measure = trials.Measure(types.SimpleNamespace(robot=robot, data=data, ground="sand_loose"))
        for k in range(400):
            yaw = 0.3 * k * 0.01
            data.qpos[3:7] = math.cos(yaw / 2), 0, 0, math.sin(yaw / 2)
            data.qpos[:2] += 0.005 * np.array([math.cos(yaw), math.sin(yaw)])
            sensor[0, 10] = 0.02 + 0.01 * (k % 100 == 50) if k % 100 < 60 else 0  # four stances, each 30 mm at its deepest
            measure.step(k * 0.01)
        walk = measure.walk(7, 4.0, "time")
        self.assertAlmostEqual(walk.speed, 0.5, places=6)
        self.assertAlmostEqual(walk.sideways, 0.0, places=6)
        self.assertAlmostEqual(walk.cost, 2 * 3 / (4 * 10 * 0.5), places=6)
        self.assertAlmostEqual(walk.torque, 2.5)
        self.assertAlmostEqual(walk.sinkage, 0.03)
        short = measure.walk(7, 2.4, "tilt")
        self.assertEqual((short.speed, short.cost), (None, None))


class Trials(unittest.TestCase):
    def test_rigid(self):
        """A robot with stiff joints stands; one with the command to fold falls, at a time; noise moves it and the seed decides."""
        table = mild.trial(biped(), still, stander(), ground=["rigid"], speeds=[0, 0.5], trials=3, seconds=3)
        self.assertEqual([row.upright for row in table.rows], [3, 3])
        self.assertLess(abs(table.rows[0].mean("speed")), 0.02)
        self.assertIsNone(table.rows[0].mean("cost"))
        self.assertEqual(table.rows[0].mean("sinkage"), 0)
        with self.assertWarnsRegex(DeprecationWarning, "grounds is named ground"):
            again = mild.trial(biped(), still, stander(), grounds=["rigid"], speeds=[0, 0.5], trials=3, seconds=3)
        self.assertEqual(json.dumps(table.as_dict()), json.dumps(again.as_dict()))
        other = mild.trial(biped(), still, stander(), ground=["rigid"], speeds=[0, 0.5], trials=3, seconds=3, seed=2)
        self.assertEqual(other.rows[0].walks[0], table.rows[0].walks[1])
        self.assertNotEqual(table.rows[0].walks[0].torque, table.rows[0].walks[1].torque)
        fold = mild.trial(biped(), lambda o: np.full(4, 0.8), stander(), ground=["rigid"], trials=2, seconds=3)
        self.assertEqual([walk.end for walk in fold.rows[0].walks], ["tilt", "tilt"])
        self.assertTrue(0.05 < fold.rows[0].falls[0] <= fold.rows[0].falls[1] < 2)
        self.assertIn("0 of 2", str(fold))

    def test_own_floor(self):
        """A floor that is a body in the world, as mjlab has it, is the only one, and has the ground's colour; without one a trial has its own."""
        text = re.sub("<geom[^>]*plane[^>]*/>", "", biped())
        own = text.replace("<worldbody>", '<worldbody><body name="terrain"><geom name="own" type="plane" size="0 0 1"/></body>')
        for model, name in ((own, "own"), (text, "floor_of_trial")):
            model = _stand.stand(model, Description(stander()), "rigid", {}, painted=True).model
            floors = np.flatnonzero(model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE))
            self.assertEqual([model.geom(floor).name for floor in floors], [name])
            self.assertEqual(model.mat(model.geom_matid[floors[0]]).name, "floor_of_trial")

    def test_dented_floor(self):
        """In pictures soft ground is drawn dented, and the floor above the dents is not; the walk is the same."""
        walks = []
        for painted in (True, False):
            walker = trials.Walker(biped(), networks.Callable(still), Description(stander()), "foam28",
                                   {"noise": 0.0, "attributes": {}, "seconds": 0.5, "painted": painted})
            model = walker.robot.model
            floors = model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)
            self.assertEqual(bool(model.geom_rgba[floors, 3].any()), not painted)
            walks.append(walker.walk([0, 0, 0], 1))
            walker.data.qpos[walker.robot.place + 2] -= 0.02
            mujoco.mj_forward(model, walker.data)
            scene = mujoco.MjvScene(model, trials.GEOMS)
            mujoco.mjv_updateScene(model, walker.data, mujoco.MjvOption(), None, mujoco.MjvCamera(), int(mujoco.mjtCatBit.mjCAT_ALL), scene)
            ground = [geom for geom in scene.geoms[: scene.ngeom] if geom.category == int(mujoco.mjtCatBit.mjCAT_STATIC)]
            self.assertEqual(len(ground) > 1000, painted)
        self.assertEqual(walks[0], walks[1])

    def test_light(self):
        """A slanted light of the world shines through the robot wherever it is, from its own height; a spot stays."""
        lights = '<light type="directional" pos="1 0 3.5" dir="0.3 0.4 -1"/><light type="spot" pos="1 2 3" dir="0 0 -1"/>'
        model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{lights}</worldbody></mujoco>")
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        place = np.array([-2.0, 5.0, 0.7])
        trials._light(model, data, place)
        np.testing.assert_allclose(data.light_xpos, [[-2 - 0.3 * 2.8, 5 - 0.4 * 2.8, 3.5], [1, 2, 3]], atol=1e-12)

    def test_sunk_is_not_fallen(self):
        """A base 0.3 of its height above the ground stands on soles deep in it, and lies when they are as high as it."""
        d = Description(stander())
        walker = trials.Walker(biped(), networks.Callable(still), d, "rigid", {"noise": 0.0, "attributes": {}, "seconds": 1})
        walker.begin([0, 0, 0], 1)
        base, place = walker.robot.place + 2, walker.data.qpos
        place[base] -= 0.7 * walker.height
        self.assertLess(walker.lowest(), -0.6 * walker.height)
        self.assertEqual(walker.fallen(), "")
        soles = walker.lowest()
        with unittest.mock.patch.object(walker, "lowest", return_value=soles + 0.7 * walker.height):  # legs drawn up
            self.assertEqual(walker.fallen(), "base")

    def test_starts(self):
        """Starts differ in heading, place and joints, by as much as the description says; the soles just touch the floor."""
        d = Description(stander(noise={"start_place": 0.3, "start_joint": 0.1}))
        walker = trials.Walker(biped(), networks.Callable(still), d, "rigid", {"noise": 1.0, "attributes": {}, "seconds": 1})
        starts = []
        for seed in range(200):
            walker.begin((0, 0, 0), seed)
            self.assertAlmostEqual(walker.lowest(), 0, delta=1e-9)
            q = walker.data.qpos.copy()
            starts.append([2 * math.atan2(q[6], q[3]), *q[:2], *q[7:]])
        spread = np.abs(np.array(starts)).max(axis=0)
        bounds = np.array([math.pi, 0.3, 0.3, 0.1, 0.1, 0.1, 0.1])
        self.assertTrue((spread <= bounds + 1e-9).all() and (spread > 0.95 * bounds).all(), spread / bounds)

    def test_commands(self):
        """What the policy sees of the command, and the delay from an observation to its action."""
        seen = []

        def policy(observation):
            seen.append(observation)
            return np.full(4, float(len(seen)))

        d = Description(stander(observation={"command": "2 2 0.25", "action": 1}, action={"clip": 2}, scale={".*": 0.01}, policy={"delay": 0.004,
                                                                                                                             "decimation": 5}))
        walker = trials.Walker(biped(), networks.load(policy, d), d, "rigid", {"noise": 0.0, "attributes": {}, "seconds": 0.03})
        targets = []
        drive = walker.drive
        walker.drive = lambda target: (targets.append(target[0]), drive(target))
        walker.walk((0.5, 0.1, 0.4), 1)
        np.testing.assert_allclose(seen[0], [1, 0.2, 0.1, 0, 0, 0, 0], atol=1e-6)
        np.testing.assert_allclose([o[3] for o in seen], [0, 1, 2], atol=1e-6)
        np.testing.assert_allclose(targets, [0] * 2 + [0.01] * 5 + [0.02] * 8, atol=1e-9)
        first = seen[:]
        seen.clear()
        walker.walk((0.5, 0.1, 0.4), 1)  # another walk begins anew
        np.testing.assert_array_equal(seen, first)
        for rule, wanted in (("clipped", [2, 2]), ("raw", [8, 9])):  # the fourth and fifth action are clipped to 2
            d = Description(stander(observation={"action": 1}, action={"clip": 2, "seen": rule}, history={"frames": 2}, scale={".*": 0}))
            seen.clear()
            seen += [None] * 7
            walker = trials.Walker(biped(), networks.load(policy, d), d, "rigid", {"noise": 0.0, "attributes": {}, "seconds": 0.03})
            for _ in range(2):
                del seen[7:]
                walker.walk((0, 0, 0), 1)
                self.assertEqual([o[4] for o in seen[7:]], [0, *wanted])
                self.assertEqual(seen[7][0], 0)  # nothing is left of the walk before
        with self.assertRaisesRegex(ValueError, r"\b3 numbers.*\b4 joints"):
            mild.trial(biped(), lambda o: np.zeros(3), stander(), ground=["rigid"], trials=1)

    @unittest.skipUnless(PLUGIN, "MILD_PLUGIN names no plugin")
    def test_soft(self):
        """It stands on foam as deep as its soles carry its weight, to within a twentieth, and on a pair with the floor too."""
        table = mild.trial(biped(), still, stander(), ground="rubber,foam45", trials=2, seconds=3, noise=0)
        load = table.about["mass"] * 9.81 / 2
        for row in table.rows:
            wanted = mild.Sole([[-0.1, -0.05], [0.1, -0.05], [0.1, 0.05], [-0.1, 0.05]]).sinkage(mild.Material(row.ground), load)
            self.assertEqual(row.upright, 2)
            self.assertAlmostEqual(row.mean("sinkage"), wanted, delta=0.05 * wanted)
        pair = '<contact><pair geom1="sole" geom2="ground"/></contact></mujoco>'
        text = biped(BOX.replace("<geom type=\"box\"", '<geom name="SOLE" type="box"')).replace("<worldbody>", '<worldbody><geom name="ground" type="plane" size="9 9 1"/>')
        text = text.replace("SOLE", "sole", 1).replace("SOLE", "sole2").replace("</mujoco>", pair)
        paired = mild.trial(text, still, stander(), ground=["foam45"], trials=1, seconds=3, noise=0)
        self.assertAlmostEqual(paired.rows[0].mean("sinkage"), table.rows[1].mean("sinkage"), delta=1e-6)
        softer = mild.trial(biped(), still, stander(), ground=["foam45"], trials=1, seconds=3, noise=0, attributes={"ground__k_pen": 400})
        self.assertNotAlmostEqual(softer.rows[0].mean("sinkage"), table.rows[1].mean("sinkage"), places=4)

    @unittest.skipUnless(PLUGIN, "MILD_PLUGIN names no plugin")
    def test_looks(self):
        """A shin of a mesh that collides and a larger one that only looks meets the ground as the mesh that collides."""
        corners = [" ".join(f"{x} {y} {z}" for x in (-r, r) for y in (-r, r) for z in (-.25 - r, -.03)) for r in (.03, .05)]
        legs = {}
        for looks in (False, True):
            text = biped().replace("<asset>", f'<asset><mesh name="shin" vertex="{corners[0]}"/><mesh name="shell" vertex="{corners[1]}"/>')
            shin = '<geom type="mesh" mesh="shin" mass="1"/>' + looks * '<geom type="mesh" mesh="shell" contype="0" conaffinity="0" mass="0"/>'
            text = text.replace('<geom type="capsule" size="0.03" fromto="0 0 -0.03 0 0 -0.28" mass="1"/>', '<inertial pos="0 0 -0.15" mass="1" '
                                'diaginertia="0.01 0.01 0.01"/>' + shin)
            robot = _stand.stand(text, Description(stander()), "foam45", {})
            data = mujoco.MjData(robot.model)
            data.qpos[:] = robot.start
            data.qpos[2] -= 0.15  # the shins reach 50 mm deep
            mujoco.mj_step(robot.model, data)
            legs[looks] = data.sensor("feet_of_trial").data.reshape(-1, 12)[2:]
        self.assertGreater(legs[False][0, 2], 10)
        np.testing.assert_allclose(legs[True], legs[False], atol=1e-9)

    @unittest.skipUnless(PLUGIN, "MILD_PLUGIN names no plugin")
    def test_ours(self):
        """The shipped policy on its own robot walks on foam as in mild eval, which shares nothing with this module but the plugin's ground."""
        sys.path.insert(0, str(ROOT / "examples/python"))
        from policy import POSE, Policy

        class Walker:
            def reset(self):
                self.policy = Policy(ROOT / "policies/mild.safetensors")

            def __call__(self, frame):
                return self.policy.act(frame)

        names = [f"leg_{s}{k}_joint" for s in "lr" for k in range(1, 7)]
        six = lambda values: dict(zip(names, 2 * values))  # noqa: E731
        d = {"policy": {"step": 0.0025, "decimation": 4}, "observation": {"angular_velocity": 1, "command": "2 2 1", "gravity": 1, "joint_position": 1,
                                                                       "joint_velocity": 0.05, "action": 1, "phase_sin": 1, "phase_cos": 1},
             "clock": {"period": 0.8, "slowing": 0.5}, "scale": {".*": 0.5}, "kp": six([50, 50, 70, 70, 20, 20]), "kd": six([5, 5, 7, 7, 0.2, 0.2]),
             "default": six(POSE[:6].tolist()), "effort": six([86.8] * 4 + [20.4] * 2), "feet": {"names": "leg_l6_link leg_r6_link", "bodies": "-"}}
        ini = configparser.ConfigParser(inline_comment_prefixes=";")
        ini.read(ROOT / "robots/sa01/robot.ini")
        outline = "; ".join(" ".join(ini[f"foot.{side}"]["outline"].split()) for side in ("left", "right"))
        table = mild.trial(ROOT / "robots/sa01/sa01.xml", Walker(), d, ground=["foam45"], speeds=[0.6], trials=1, seconds=6,
                           attributes={"outline": outline, "sole_z": -0.055, "elements": 77}, noise=0)
        row = table.rows[0]
        with tempfile.TemporaryDirectory() as folder:
            exact, file = pathlib.Path(folder) / "exact.ini", pathlib.Path(folder) / "eval.json"
            exact.write_text((ROOT / "configs/walk.ini").read_text() + "\n[task]\nobserve_noise = false\n[randomize]\nlatency = 0 0\n")
            subprocess.run([os.environ["MILD_PROGRAM"], "eval", "--config", exact, "--ground", "foam45", "--speed", "0.6", "--trials", "2", "--seconds", "6",
                            "--task.physics_dt=0.0025", "--task.shells_stand=false", "--task.speed_hold=0", "--json", file], check=True, stdout=subprocess.DEVNULL)
            wanted = json.loads(file.read_text())["rows"][0]
        print(f"speed {row.mean('speed'):.3f} and {wanted['velocity']:.3f}, cost {row.mean('cost'):.3f} and {wanted['cot']:.3f}, "
              f"sinkage {row.mean('sinkage'):.4f} and {wanted['penetration']:.4f}")
        self.assertEqual(row.upright, 1)
        self.assertAlmostEqual(row.mean("speed"), wanted["velocity"], delta=0.01)
        self.assertAlmostEqual(row.mean("cost"), wanted["cot"], delta=0.03 * wanted["cot"])
        self.assertAlmostEqual(row.mean("sinkage"), wanted["penetration"], delta=0.05 * wanted["penetration"])


class Tours(unittest.TestCase):
    ARM = """<body name="{0}_arm" pos="0 {1} 0.1"><joint name="{0}_shoulder" axis="1 {2} 0" range="-2 2"/>
      <geom type="capsule" size="0.02" fromto="0 0 0 0.15 0 -0.15" mass="0.05"/>
      <body name="{0}_fore" pos="0.15 0 -0.15"><joint name="{0}_elbow" axis="0 1 0" range="-0.5 2"/>
        <geom type="capsule" size="0.02" fromto="0 0 0 0.1 0 0" mass="0.02"/></body></body>"""

    def tour(self, arms="seen", policy=still):
        """The biped with two arms that the policy does not move."""
        text = biped().replace('<body name="left_leg"', self.ARM.format("left", 0.15, 1) + self.ARM.format("right", -0.15, -1)
                                                      + '<body name="left_leg"')
        describe = stander(policy={"step": 0.002, "decimation": 5, "joints": ".*hip .*ankle", "observed": ".*"}, command={"arms": arms})
        return tour.Tour(text, networks.Callable(policy), Description(describe), "rigid", {"noise": 0.0, "attributes": {}, "seconds": 10.0})

    def test_arms(self):
        """Arms are moved as in a mirror, before the shoulders; the policy sees what they do, or nothing of it."""
        for arms in ("seen", "unseen"):
            seen, moved = [], []
            walker = self.tour(arms, lambda o: seen.append(o[3:11]) or moved.append(walker.data.qpos[7:].copy()) or np.zeros(4))
            names = [walker.robot.model.joint(j).name for j in range(1, 9)]
            self.assertEqual([walker.robot.held[k - 4] for k in walker.arms], ["left_shoulder", "left_elbow", "right_shoulder", "right_elbow"])
            self.assertEqual(walker.pairs, [(0, 2, -1.0), (1, 3, 1.0)])  # the right shoulder's axis points back
            with unittest.mock.patch.object(tour, "PUSH", 0.0):
                self.assertEqual(walker.walk((0, 0, 0), 3).end, "time")
            angle = {name: np.array(moved)[:, k] for k, name in enumerate(names)}
            for joint, sign in (("shoulder", -1), ("elbow", 1)):
                self.assertGreater(angle[f"left_{joint}"].std(), 0.1)
                np.testing.assert_allclose(angle[f"left_{joint}"], sign * angle[f"right_{joint}"], atol=0.05)
                self.assertEqual(np.abs(np.array(seen)[:, names.index(f"left_{joint}")]).max() > 0.1, arms == "seen")
            angles = walker.angles[0]
            for _ in range(100):
                angles = walker.wander(angles)
                self.assertTrue((walker.hands(angles)[:, 0] >= walker.bounds[0]).all() and (walker.hands(angles)[:, 1] <= walker.bounds[1]).all())

    def test_pushes(self):
        """One every 5 s for 0.08 s, as strong as its time and the robot's mass allow, at the joint's place; each seed has its own."""
        walker, pushes = self.tour(), []
        with unittest.mock.patch.object(tour.Tour, "wander", lambda self, start: start):
            for seed in range(40):
                walker.begin((0, 0, 0), seed)
                for time in np.arange(0.01, 10, 0.02):
                    walker.data.time = time
                    walker.drive(walker.target)
                    force = walker.data.xfrc_applied[:, :3]
                    pushes += [(time, np.linalg.norm(force.sum(axis=0)))] * bool(force.any())
        time, force = np.array(pushes).T
        np.testing.assert_allclose(time, np.tile([0.11, 0.13, 0.15, 0.17, 5.11, 5.13, 5.15, 5.17], 40))
        limit = 14.24 * walker.robot.mass / 3 * np.where(time < 5, 1, 1 + 2 * 5 / 60)
        self.assertTrue(((0.5 * limit < force) & (force < limit)).all())
        self.assertEqual(len(np.unique(force.round(9))), 80)
        for joint in range(len(walker.joints)):  # the torque is that of the force at the joint
            walker.pushed[0], walker.data.time = joint, 0.11
            walker.drive(walker.target)
            body = walker.robot.model.jnt_bodyid[walker.joints[joint]]
            self.assertEqual(np.flatnonzero(walker.data.xfrc_applied.any(axis=1)).tolist(), [body])
            arm = walker.data.xanchor[walker.joints[joint]] - walker.data.xipos[body]
            np.testing.assert_allclose(walker.data.xfrc_applied[body, 3:], np.cross(arm, walker.pushes[0]), atol=1e-9)

    def test_command(self):
        """It leads to the waypoint, in the axes of the robot, within the limits, and stops where both place and heading are reached."""
        walker = self.tour()
        walker.begin((0, 0, 0), 5)
        x, y, heading = walker.waypoints[0]
        self.assertLessEqual(math.hypot(x - 0.3, y), 1)
        place = walker.data.qpos
        for away, turned, wanted in (((-0.2, 0), 0, (0.3, 0, 0)), ((0, -0.2), 0, (0, 0.3, 0)), ((-3, 0), 0.2, (0.8, 0, -0.3)), ((2, 0), 1.0, (-0.4, 0, -0.8)),
                                     ((0.15, 0), 0, (-0.225, 0, 0)), ((0.05, 0), 0, (0, 0, 0)), ((0.15, 0), 0.1, (0, 0, 0)), ((0.25, 0), 0.15, (-0.375, 0, -0.225))):
            c, s = math.cos(heading + turned), math.sin(heading + turned)  # away: in the axes of the robot
            place[:2] = x + c * away[0] - s * away[1], y + s * away[0] + c * away[1]
            place[3:7] = math.cos((heading + turned) / 2), 0, 0, math.sin((heading + turned) / 2)
            walker.steer()
            np.testing.assert_allclose(walker.state.command, wanted, atol=1e-9, err_msg=str(away))
        self.assertEqual(walker.reached, {0})
        walker.data.time = 5.0
        walker.steer()
        self.assertEqual((walker.number, len(walker.left)), (1, 1))
        self.assertAlmostEqual(walker.left[0], 0.25)


class Remarks(unittest.TestCase):
    def test_rigid(self):
        """Falls and standing on rigid ground are said; a command of 0, and other grounds, are not."""
        def row(ground, command, speed, falls):
            return trials.Row(ground, (command, 0, 0), [trials.Walk(k, 10, "tilt" if k < falls else "time", speed, 0, None, 1, 0) for k in range(4)])
        for one, line in ((row("rigid", 0.5, 0.4, 0), ""), (row("rigid", 0.5, 0.4, 2), ""), (row("rigid", 0.5, 0.4, 3), "falls at 0.5 m/s.*--check"),
                          (row("rigid", 0.5, 0.1, 0), "stands at 0.5 m/s; a dead zone.*--speed 1$"), (row("rigid", 0, 0, 0), ""), (row("grass", 0.5, 0, 4), "")):
            self.assertRegex(" ".join(trials.Table({}, [one]).remarks()), f"^{'rigid: it ' if line else ''}{line}{'' if line else '$'}")


class Command(unittest.TestCase):
    def run_main(self, *arguments):
        out, error = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
            status = trials.main([str(argument) for argument in arguments])
        return status, out.getvalue(), error.getvalue()

    def test_command(self):
        """A table and a JSON that fits its schema; processes change nothing; each fault is one line and 2."""
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            (folder / "robot.xml").write_text(biped())
            (folder / "bad.xml").write_text("<mujoco>\n<worldbody>\n<bodies/></worldbody></mujoco>")
            (folder / "bare.xml").write_text(biped().replace("<geom ", '<geom contype="0" conaffinity="0" ').replace('contype="0" conaffinity="0" mass="0"', 'mass="0"'))
            (folder / "mine.py").write_text("import numpy as np\ndef still(o):\n    return np.zeros(4)\n")
            (folder / "mine.ini").write_text("[policy]\ndecimation = 5\n[observation]\ngravity = 1\n[kp]\n.* = 400\n[kd]\n.* = 8\n")
            model, policy, describe = folder / "robot.xml", f"{folder}/mine.py:still", ("--describe", folder / "mine.ini")
            short = ("--ground", "rigid", "--seconds", "0.2", "--trials", "2")
            for jobs in (1, 2):
                status, out, error = self.run_main(model, policy, *describe, *short, "--speed", "0,0.5", "--jobs", jobs, "--json", folder / f"{jobs}.json")
                self.assertEqual((status, error, out.count("2 of 2")), (0, "", 2))
            self.assertEqual((folder / "1.json").read_text(), (folder / "2.json").read_text())
            subprocess.run([sys.executable, ROOT / "tests/app/schema.py", ROOT / "docs/schema/trial.json", folder / "1.json"], check=True)
            status, out, _ = self.run_main(model, policy, *describe, *short, "--tour", "--json", folder / "tour.json")
            self.assertRegex(out, r"rigid +0.2 +2 of 2 +0.0")
            subprocess.run([sys.executable, ROOT / "tests/app/schema.py", ROOT / "docs/schema/trial.json", folder / "tour.json"], check=True)
            status, out, _ = self.run_main(model, policy, *describe, "--check")
            self.assertEqual(status, 0)
            for wanted in ("feet left_foot right_foot", "3 numbers", "kp 400", "action 0.000"):
                self.assertIn(wanted, out)
            status, out, _ = self.run_main("--keys")
            self.assertIn("[actuator]", out)
            for arguments, line in (((model,), "needs MODEL and POLICY"), ((model, policy), "needs --describe"), ((model, policy, "--describe", "nobody"), "no file 'nobody'"),
                                    ((model, policy, *describe, "--set", "a"), "KEY=VALUE"), ((model, policy, *describe, "--set", "policy.x=1"), "no key 'x'"),
                                    ((model, policy, *describe, "--trials", 0), "more than 0"), ((model, policy, *describe, "--tour", "--turn", "1"), "steers"),
                                    ((model, policy, *describe, "--tour", "--sweep", "friction"), "one of the two"), ((model, policy, *describe, "--set", "command.forward=1 2"), "0 between"),
                                    ((model, policy, *describe, "--set", "command.turn=nan"), "0 or more"), ((model, policy, *describe, "--set", "command.sideways=-1"), "0 or more"),
                                    ((model, policy, *describe, "--ground", "soup"), "soup"), ((model, policy, *describe, "--csv", folder / "a.csv"), "--sweep"),
                                    ((model, policy, *describe, *short, "--json", folder / "none/a.json"), "json: there is no folder"),
                                    ((model, policy, *describe, *short, "--json", folder), "is a folder"), ((model, folder / "a.safetensors"), "mild eval --policy"),
                                    ((folder / "bare.xml", policy, *describe, *short), "mild eval --robot"),
                                    ((folder / "no.xml", policy, *describe), "no file"), ((folder / "bad.xml", policy, *describe), "bodies"),
                                    ((model, policy, *describe, "--set", "observation.sensor:ear=1"), "sensor:ear: the model has no such"), ((model, "no.onnx", *describe), "no file")):
                status, _, error = self.run_main(*arguments)
                self.assertEqual((status, error.count("\n"), error.startswith("mild trial: ")), (2, 1, True), error)
                self.assertIn(line, error)
            with self.assertRaises(SystemExit), contextlib.redirect_stderr(io.StringIO()) as told:
                trials.main(["--speed", "fast"])
            self.assertIn("--speed: invalid float list value: 'fast'", told.getvalue())

    def test_module(self):
        """`python -m mild trial` warns of nothing, and mild.trial is a function."""
        done = subprocess.run([sys.executable, "-m", "mild", "trial", "--help"], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("--describe", done.stdout)
        code = "import mild; assert not isinstance(mild.trial, type(mild)); mild.trial('no.xml', 'no.onnx', 'rsl_rl')"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        self.assertIn("ValueError: policy: there is no file 'no.onnx'", done.stderr)


if __name__ == "__main__":
    unittest.main()
