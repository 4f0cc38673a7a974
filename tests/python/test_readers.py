"""mild.readers: configs of trainers as descriptions. Every config here is made by the test, for the biped of test_trial."""
import contextlib
import io
import json
import math
import pathlib
import sys
import tempfile
import types
import unittest
import unittest.mock

import mujoco
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from test_trial import biped  # noqa: E402

from mild import _stand, readers, trials  # noqa: E402
from mild.describe import Description, Observer, State  # noqa: E402

try:
    import yaml
except ImportError:
    yaml = None

JOINTS = ["left_hip", "left_ankle", "right_hip", "right_ankle"]  # of the model; by depth the two hips come first
DEPLOY = {"joint_ids_map": [4, 9, 5, 11], "step_dt": 0.02, "stiffness": [100, 90, 80, 70], "damping": [4, 3, 2, 1],
          "default_joint_pos": [0.1, 0.2, 0.3, 0.4],
          "actions": {"JointPositionAction": {"clip": None, "joint_names": [".*"], "scale": [0.5, 0.6, 0.7, 0.8], "offset": [0.1, 0.2, 0.3, 0.4],
                                              "joint_ids": None}},
          "observations": {name: {"params": {}, "clip": None, "scale": scale, "history_length": 3} for name, scale in (
              ("base_ang_vel", [0.2, 0.2, 0.2]), ("velocity_commands", [1, 1, 1]), ("joint_pos_rel", [1] * 4), ("joint_vel_rel", [0.05] * 4),
              ("last_action", [1] * 4))}}
ENV = """
sim: {dt: 0.004, gravity: !!python/tuple [0.0, 0.0, -9.81]}
decimation: 5
scene:
  robot:
    init_state: {joint_pos: {.*_hip: 0.2, .*_ankle: -0.2}, pos: !!python/tuple [0, 0, 1]}
    actuators:
      hips: {class_type: isaaclab.actuators.actuator_pd:ImplicitActuator, joint_names_expr: [.*_hip], stiffness: {left.*: 80.0, .*_hip: 90.0},
             damping: 3, effort_limit_sim: 50, armature: null}
      ankles: {class_type: isaaclab.actuators.actuator_pd:IdealPDActuator, joint_names_expr: [.*_ankle], stiffness: 20.0, damping: {.*: 1.0},
               effort_limit: 20, armature: 0.01}
observations:
  policy:
    concatenate_terms: true
    history_length: 2
    base_ang_vel: {func: isaaclab.envs.mdp.observations:base_ang_vel, params: {}, modifiers: null, clip: !!python/tuple [-100, 100], scale: 0.25,
                   noise: {func: !!python/object/apply:os.system ["exit"]}}
    pose: {func: isaaclab.envs.mdp.observations:joint_pos_rel, params: {asset_cfg: {joint_names: [.*], joint_ids: !!python/object/apply:builtins.slice [null, null, null]}},
           clip: null, scale: null}
    actions: {func: isaaclab.envs.mdp.observations:last_action, params: {}, clip: null, scale: null, history_length: 7}
actions:
  legs: {class_type: isaaclab.envs.mdp.actions.joint_actions:JointPositionAction, joint_names: [.*], scale: {.*_hip: 0.5, .*_ankle: 0.25},
         offset: 0.0, clip: {.*_hip: [-0.6, 0.7]}, preserve_order: false, use_default_offset: true}
"""
LAB = {"control_dt": 0.02, "history_length": 10, "joint2motor_idx": [4, 9, 5, 11], "kps": [100, 90, 80, 70], "kds": [4, 3, 2, 1],
       "default_joint_pos": [0.1, 0.2, 0.3, 0.4], "ang_vel_scale": 0.25, "dof_pos_scale": 1, "dof_vel_scale": 0.05, "action_scale": 0.5,
       "command_scale": [2, 2, 1], "gait_phase": {"enable": True, "period": 0.6, "offset": 0.5}}
RENKUN = {"policy_dt": 0.02, "joint_ids_map": [4, 9, 5, 11], "stiffness": [100, 90, 80, 70], "damping": [4, 3, 2, 1],
          "actions": {"JointPositionAction": {"scale": 0.5, "offset": [0.1, 0.2, 0.3, 0.4]}},
          "observations": {"stack": {"length": 3, "order": "newest_first"}, "terms": {"gait_phase_2": {"params": {"cycle_time": 0.5}}, "base_ang_vel_B": None,
                                                                                   "joint_vel": {"scale": [0.05] * 4}}}}
RL_SAR = {"biped": {"dt": 0.005, "decimation": 4, "joint_names": JOINTS}}
CONFIG = {"biped/walk": {"num_of_dofs": 4, "joint_mapping": [2, 0, 1, 3], "observations": ["commands", "ang_vel", "dof_pos", "actions"],
                         "observations_history": [0, 1, 2], "clip_obs": 100, "commands_scale": [2, 2, 1], "ang_vel_scale": 0.25, "dof_pos_scale": 1,
                         "clip_actions_lower": [-9] * 4, "clip_actions_upper": [9] * 4, "rl_kp": [100, 90, 80, 70], "rl_kd": [4, 3, 2, 1],
                         "torque_limits": [30] * 4, "default_dof_pos": [0.1, 0.2, 0.3, 0.4], "action_scale": [0.5, 0.6, 0.7, 0.8]}}
MJLAB = {"joint_names": ",".join(JOINTS), "joint_stiffness": "10.000,11.000,12.000,13.000", "joint_damping": "1,2,3,4",
         "default_joint_pos": "0.1,0.2,0.3,0.4", "action_scale": "0.5", "observation_names": "base_ang_vel,projected_gravity,joint_pos,joint_vel,actions,command"}
TERM = {"overloads": {"clip": None, "scale": None, "history_length": 0}}
IO = {"observations": {"policy": [{**TERM, "full_path": "isaaclab.envs.mdp.observations.projected_gravity"},
                                  {"overloads": {"scale": 0.05}, "full_path": "isaaclab.envs.mdp.observations.joint_vel_rel", "joint_names": JOINTS[::-1]}]},
      "actions": [{"full_path": "isaaclab.envs.mdp.actions.joint_actions.JointPositionAction", "joint_names": JOINTS[::-1], "scale": 0.25,
                   "offset": [0.4, 0.3, 0.2, 0.1], "clip": [[-1, 1]] * 4}],
      "articulations": {"robot": {"joint_names": JOINTS, "default_joint_pos": [0.1, 0.2, 0.3, 0.4], "default_joint_stiffness": [1, 2, 3, 4],
                                  "default_joint_damping": [5, 6, 7, 8], "default_joint_armature": [0.01] * 4}},
      "scene": {"physics_dt": 0.005, "decimation": 4}}

HOLOSOMA = {"simulator": {"config": {"sim": {"fps": 200, "control_decimation": 4}}},
            "observation": {"groups": {"actor_obs": {"history_length": 1, "terms": {
                "dof_pos": {"scale": 1.0}, "base_ang_vel": {"scale": 0.25}, "command_lin_vel": {"scale": 1.0}, "command_ang_vel": {"scale": 1.0},
                "sin_phase": {"scale": 1.0}}}}},
            "action": {"terms": {"joint_control": {"func": "a:b", "scale": 1.0}}},
            "command": {"setup_terms": {"locomotion_gait": {"params": {"gait_period": 0.9}}}},
            "robot": {"init_state": {"default_joint_angles": dict(zip(JOINTS, [0.1, 0.2, 0.3, 0.4]))}, "dof_effort_limit_list": [9] * 4,
                      "dof_armature_list": [0.01] * 4, "control": {"action_scale": 0.25, "action_clip_value": 100}}}


def onnxruntime(metadata, width):
    """A stand-in whose network answers with the first four numbers that it sees."""
    class Session:
        def __init__(self, path, options, providers):
            if pathlib.Path(path).read_text() == "broken":
                raise RuntimeError("no protobuf\nat all")

        def get_modelmeta(self):
            return types.SimpleNamespace(custom_metadata_map=metadata)

        def get_inputs(self):
            return [types.SimpleNamespace(name="obs", shape=[1, width], type="tensor(float)")]

        def get_outputs(self):
            return [types.SimpleNamespace(name="actions")]

        def run(self, names, values):
            return [values["obs"][:, :4]]

    return unittest.mock.patch.dict(sys.modules, onnxruntime=types.SimpleNamespace(SessionOptions=types.SimpleNamespace, InferenceSession=Session))


def change(document, path, value):
    """A copy with one value changed, or taken out where it is ...."""
    document = json.loads(json.dumps(document))
    part = document
    *way, last = path
    for key in way:
        part = part[key]
    if value is ...:
        del part[last]
    else:
        part[last] = value
    return document


def paths(document, way=()):
    """Ways to every part of a document."""
    for key, part in document.items() if isinstance(document, dict) else enumerate(document):
        yield (*way, key)
        if isinstance(part, (dict, list)):
            yield from paths(part, (*way, key))


class Files(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def write(self, document, name="deploy.yaml"):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(document if isinstance(document, str) else json.dumps(document))  # JSON is YAML
        return path

    def robot(self, description):
        return _stand.stand(biped(), description, "rigid", {})

    def onnx(self, metadata=MJLAB, width=21, **more):
        self.enterContext(onnxruntime({**metadata, **more}, width))
        return self.write("", "policy.onnx")


@unittest.skipUnless(yaml, "needs PyYAML")
class Yaml(Files):
    def test_deploy(self):
        """Gains go by motor, the rest by the policy's joints, whose motors are numbered; what is observed and moved follows."""
        d = Description(self.write(DEPLOY))
        robot = self.robot(d)
        order = ["left_hip", "right_hip", "left_ankle", "right_ankle"]  # motors 4, 9, 5, 11 are the joints 0, 2, 1, 3
        self.assertEqual(robot.joints, order)
        self.assertEqual([list(values) for values in (robot.default, robot.kp, robot.kd, robot.scale, robot.seen_default)],
                         [[0.1, 0.2, 0.3, 0.4], [100, 80, 90, 70], [4, 2, 3, 1], [0.5, 0.6, 0.7, 0.8], [0.1, 0.2, 0.3, 0.4]])
        self.assertEqual((d.policy["step"], d.policy["decimation"], d.history["frames"], d.history["stack"]), (0.002, 10, 3, "term"))
        self.assertEqual([(t.name, *t.scale[:1]) for t in d.terms], [("angular_velocity", 0.2), ("command", 1), ("joint_position", 1),
                                                                     ("joint_velocity", 0.05), ("action", 1)])
        more = {**DEPLOY["observations"], "gait_phase": {"params": {"period": 0.6}, "scale": [1, 2], "history_length": 3}, "use_gym_history": True}
        d = Description(self.write(change(DEPLOY, ["observations"], more)))
        self.assertEqual((d.history["stack"], d.clock["period"], [t.name for t in d.terms[-2:]], d.terms[-1].scale.tolist()),
                         ("frame", 0.6, ["phase_sin", "phase_cos"], [2]))

    def test_deploy_part(self):
        """An action of some joints, of which all are seen; limits of targets; an offset of 0."""
        action = {"clip": [[-1, 1], [-2, 2]], "scale": [0.5, 0.6], "offset": [0, 0], "joint_ids": [1, 2]}
        d = Description(self.write(change(DEPLOY, ["actions", "JointPositionAction"], action)))
        robot = self.robot(d)
        self.assertEqual((robot.joints, robot.scale.tolist(), robot.upper.tolist(), d.action["target"]),
                         (["right_hip", "left_ankle"], [0.5, 0.6], [1, 2], "zero"))
        self.assertEqual(robot.seen_default.tolist(), [0.1, 0.2, 0.3, 0.4])

    def test_deploy_walk(self):
        """The order of the history: term by term, oldest first, the first frame repeated."""
        d = Description(self.write(DEPLOY))
        model = mujoco.MjModel.from_xml_string(biped())
        data = mujoco.MjData(model)
        state = State(d, model, data, (mujoco.mjtObj.mjOBJ_XBODY, 1), (np.arange(7, 11), np.arange(6, 10)))
        state.action, state.default, observer = np.zeros(4), np.zeros(4), Observer(d, 4, 4)
        for turn in (1, 2):
            state.command = np.array([0, 0, turn])
            state.read(lambda amplitude, count: np.zeros(count))
            seen = observer.observe(state)
        self.assertEqual((len(seen), seen[9:18].tolist()), (54, [0, 0, 1, 0, 0, 1, 0, 0, 2]))

    def test_deploy_motors(self):
        """Rows of gains of motors that are not there; no numbers at all: the motors in their order."""
        sparse = {**DEPLOY, "stiffness": list(range(12)), "damping": [1] * 12}
        self.assertEqual(self.robot(Description(self.write(sparse))).kp.tolist(), [4, 9, 5, 11])
        self.assertEqual(self.robot(Description(self.write({**DEPLOY, "joint_ids_map": [None] * 4}))).joints, JOINTS)

    def test_programs(self):
        """Gains go by the policy's joints in the configs of programs that walk policies of others, and what they see has their order."""
        order = ["left_hip", "right_hip", "left_ankle", "right_ankle"]
        for document, terms, history, clock in ((LAB, ["angular_velocity", "gravity", "command", "joint_position", "joint_velocity", "action",
                                                       "phase_sin", "phase_cos"], (10, "last"), (0.6, [0, 0.5])),
                                                ({"policy": RENKUN}, ["phase_sin", "phase_cos", "angular_velocity", "joint_velocity"], (3, "first"), (0.5, [0]))):
            d = Description(self.write(document, "config.yaml"))
            robot = self.robot(d)
            self.assertEqual((robot.joints, [t.name for t in d.terms], (d.history["frames"], d.history["newest"]), (d.clock["period"], d.clock["offsets"])),
                             (order, terms, history, clock))
            self.assertEqual([list(values) for values in (robot.default, robot.kp, robot.kd, robot.scale)],
                             [[0.1, 0.2, 0.3, 0.4], [100, 90, 80, 70], [4, 3, 2, 1], [0.5] * 4])

    def test_rl_sar(self):
        with self.assertRaisesRegex(ValueError, "needs the base.yaml"):
            Description(self.write(CONFIG, "walk/config.yaml"))
        self.write(RL_SAR, "base.yaml")
        d = Description(self.write(CONFIG, "walk/config.yaml"))
        robot = self.robot(d)
        self.assertEqual((robot.joints, robot.kp.tolist(), robot.scale.tolist(), d.policy["decimation"], d.action["clip"], d.history["newest"]),
                         (["right_hip", "left_hip", "left_ankle", "right_ankle"], [100, 90, 80, 70], [0.5, 0.6, 0.7, 0.8], 4, 9, "first"))
        self.assertEqual([(t.name, t.scale[0]) for t in d.terms], [("command", 2), ("angular_velocity", 0.25), ("joint_position", 1), ("action", 1)])
        uneven = self.robot(Description(self.write(change(CONFIG, ["biped/walk", "clip_actions_lower"], [-1] * 4), "walk/config.yaml")))
        self.assertEqual(np.round(uneven.lower, 6).tolist(), [-0.4, -0.4, -0.4, -0.4])

    def test_isaac(self):
        """Python's tags are read and never called; joints by depth; patterns of a group of motors hold for its joints alone."""
        with unittest.mock.patch("os.system") as never:
            d = Description(self.write(ENV, "env.yaml"))
        never.assert_not_called()
        robot = self.robot(d)
        self.assertEqual(robot.joints, ["left_hip", "right_hip", "left_ankle", "right_ankle"])
        self.assertEqual([list(values) for values in (robot.default, robot.kp, robot.kd, robot.effort, robot.scale)],
                         [[0.2, 0.2, -0.2, -0.2], [90, 90, 20, 20], [3, 3, 1, 1], [50, 50, 20, 20], [0.5, 0.5, 0.25, 0.25]])
        self.assertEqual((robot.lower.tolist(), robot.upper.tolist()), ([-0.6, -0.6, -math.inf, -math.inf], [0.7, 0.7, math.inf, math.inf]))
        self.assertEqual((d.actuator["kind"], d.policy["integrator"], d.policy["step"], d.policy["decimation"]), ("servo", "implicitfast", 0.004, 5))
        self.assertEqual([(t.name, t.scale[0]) for t in d.terms], [("angular_velocity", 0.25), ("joint_position", 1), ("action", 1)])
        self.assertEqual(d.history["frames"], 2)  # that of the group goes before those of terms
        self.assertFalse(d.armature and d.armature[0][0].fullmatch("left_hip"))

    def test_isaac_orders(self):
        """preserve_order of the action and of the observation are two things; joints of one pattern go by depth."""
        listed = ENV.replace("joint_names: [.*], scale", f"joint_names: [{', '.join(JOINTS)}], scale").replace("preserve_order: false", "preserve_order: true")
        robot = self.robot(Description(self.write(listed, "env.yaml")))
        self.assertEqual((robot.joints, robot.seen[0].tolist()), (JOINTS, [7, 9, 8, 10]))
        seen = ENV.replace("asset_cfg: {joint_names: [.*]", "asset_cfg: {preserve_order: true, joint_names: [right.*, left_ankle, .*]")
        robot = self.robot(Description(self.write(seen, "env.yaml")))
        self.assertEqual((robot.joints, robot.seen[0].tolist()), (["left_hip", "right_hip", "left_ankle", "right_ankle"], [9, 10, 8, 7]))
        robot = self.robot(Description(self.write(ENV.replace("preserve_order: false", "preserve_order: true"), "env.yaml")))
        self.assertEqual(robot.joints, ["left_hip", "right_hip", "left_ankle", "right_ankle"])
        term = "    speed: {func: a:joint_vel_rel, params: {asset_cfg: {joint_names: [.*], preserve_order: true}}}\n"
        other = ENV.replace("    actions: {func", term + "    actions: {func")
        with self.assertRaisesRegex(ValueError, "speed: sees other joints than the first term of joints, or in another order"):
            Description(self.write(other, "env.yaml"))

    def test_motors(self):
        """Numbers are those of the model's motors; where only some joints have one, in another order, both orders are printed."""
        d = Description(self.write(DEPLOY))
        motors = "".join(f'<motor joint="{name}"/>' for name in (*JOINTS[2:], *JOINTS[:2]))
        for text, joints in ((motors, ["right_hip", "left_hip", "right_ankle", "left_ankle"]), ("", ["left_hip", "right_hip", "left_ankle", "right_ankle"])):
            robot = _stand.stand(biped(motors="").replace("</actuator>", text + "</actuator>"), d, "rigid", {})
            self.assertEqual((robot.joints, robot.default.tolist(), robot.kp.tolist()), (joints, [0.1, 0.2, 0.3, 0.4], [100, 80, 90, 70]))
        some = biped(motors="").replace("</actuator>", '<motor joint="right_hip"/><motor joint="left_hip"/></actuator>')
        with self.assertRaisesRegex(ValueError, "joints are left_hip, left_ankle, .*actuators those of right_hip, left_hip, so.*name the joints"):
            _stand.stand(some, d, "rigid", {})
        _stand.stand(some, Description({"observation": {"gravity": 1}, "kp": {".*": 1}}), "rigid", {})

    def test_layout_of_itself(self):
        for name, layout in (("mine.ini", "mine.ini"), ("mine.ini", "other.ini"), ("other.ini", "mine.ini")):
            path = self.write(f"[policy]\nlayout = {layout}\n[observation]\ngravity = 1\n", name)
        with self.assertRaisesRegex(ValueError, r"\w+.ini: policy.layout leads back"):
            Description(path)
        path.write_bytes(b"\xff\xfe\x00")
        with self.assertRaisesRegex(ValueError, "other.ini: is no text"):
            Description(path)
        with self.assertRaisesRegex(ValueError, "policy.step must be 0 or more"):
            Description({"observation": {"gravity": 1}}, {"policy.step": "nan"})
        self.assertEqual(Description(self.write(DEPLOY, "DEPLOY.YAML")).policy["model_joints"], 4)

    def test_isaac_gains(self):
        """Gains of the simulator's own file are asked for, and an ini gives them."""
        path = self.write(ENV.replace("stiffness: 20.0", "stiffness: null"), "env.yaml")
        with self.assertRaisesRegex(ValueError, r"\[kp\]: no number for left_ankle, right_ankle"):
            self.robot(Description(path))
        mine = self.write("[policy]\nlayout = env.yaml\n[kp]\n.* = 33\n", "mine.ini")
        self.assertEqual(self.robot(Description(mine)).kp.tolist(), [33] * 4)

    def test_unknown_term(self):
        """A term that is not known is named, and an ini's observation replaces it."""
        path = self.write(ENV.replace("observations:joint_pos_rel", "observations:height_scan"), "env.yaml")
        with self.assertRaisesRegex(ValueError, r"env.yaml: \[observation\] has no term 'height_scan'.*layout = .*env.yaml"):
            Description(path)
        mine = self.write("[policy]\nlayout = env.yaml\n[observation]\ngravity = 1\n", "mine.ini")
        self.assertEqual([t.name for t in Description(mine).terms], ["gravity"])

    def test_descriptors(self):
        d = Description(self.write(IO))
        robot = self.robot(d)
        self.assertEqual((robot.joints, robot.default.tolist(), robot.kp.tolist(), robot.kd.tolist(), robot.lower.tolist()),
                         (JOINTS[::-1], [0.4, 0.3, 0.2, 0.1], [4, 3, 2, 1], [8, 7, 6, 5], [-1] * 4))
        self.assertEqual(([(t.name, t.scale[0]) for t in d.terms], d.history["frames"]), ([("gravity", 1), ("joint_velocity", 0.05)], 1))

    def test_malformed(self):
        """Every fault is one line with the file, the key and a remedy."""
        faults = [("a: [", "is no YAML"), ("[1, 2]", "table of keys"), ("a: 1", "no deploy.yaml"), ("a: !unknown 1", "is no YAML"), ("", "table of keys"),
                  ("a: &x [*x]", "no deploy.yaml|is no YAML")]
        faults += [(change(DEPLOY, path, value), line) for path, value, line in (
            (["stiffness"], ..., "stiffness: is missing"), (["stiffness"], [1, 2], "stiffness: has 2 values, and there are 4 joints"),
            (["damping", 2], "stiff", r"damping\[2\]: must be a number, not 'stiff'"), (["damping"], 3, "damping: must be a list"),
            (["joint_ids_map"], [0, 1, 1, 2], "joint_ids_map: names a motor twice"), (["step_dt"], 0, "step_dt: must be the time"),
            (["step_dt"], True, "step_dt: must be a number"), (["actions"], {}, "actions: has 0 actions"), (["actions"], 3, "actions: must be a table"),
            (["actions"], {"JointVelocityAction": {}}, "JointVelocityAction cannot be read"),
            (["actions", "JointPositionAction", "joint_ids"], [7], "joint_ids: must be numbers from 0 to 3"),
            (["actions", "JointPositionAction", "offset"], [9, 9, 9, 9], "offset: must be 0 or the default"),
            (["actions", "JointPositionAction", "clip"], [[1]] * 4, "clip: must be pairs"),
            (["observations"], {}, "has no term"), (["observations", "last_action", "history_length"], 4, "last_action: has a history of 4"),
            (["observations", "last_action", "clip"], [-1, 1], "clip: limits of one term"),
            (["observations", "base_ang_vel", "scale"], "x", "base_ang_vel.scale.*'x'"),
            (["observations"], {"a": {"b": {"params": {}}}, "c": {"d": {"params": {}}}}, "2 groups"))]
        faults += [(change(IO, path, value), line) for path, value, line in (
            (["actions"], [], "list of one action"), (["observations", "policy", 0, "full_path"], ..., r"policy\[0\].full_path: is missing"),
            (["articulations", "robot", "default_joint_pos"], [1], "has 1 values"), (["scene"], ..., "scene: is missing"),
            (["actions", 0, "full_path"], "a.b.JointVelocityAction", r"actions\[0\]: JointVelocityAction cannot be read"),
            (["scene", "physics_dt"], -1, "physics_dt: must be more than 0, not -1"), (["scene", "decimation"], 10**400, "decimation: is too large"),
            (["scene", "decimation"], "x" * 9999, "decimation: must be a number, not '.{,40}'; describe"))]
        faults += [(ENV.replace(*pair), line) for pair, line in (
            (("concatenate_terms: true", "concatenate_terms: false"), "concatenate_terms: must be true"), (("  policy:", "  other:"), "no group"),
            (("decimation: 5", "decimation: many"), "decimation: must be a number"), (("modifiers: null", "modifiers: [1]"), "modifiers: cannot be read"),
            (("use_default_offset: true", "use_default_offset: false, offset: 1"), "offset: must be 0"), (("init_state", "state"), "init_state: is missing"),
            (("[-100, 100]", "[-1, 1]"), "clip: limits"), (("dt: 0.004", "dt: .nan"), "sim.dt: must be more than 0, not nan"))]
        for document, line in faults:
            path = self.write(document)
            with self.subTest(line), self.assertRaisesRegex(ValueError, line) as caught:
                Description(path)
            self.assertIn(path.name, str(caught.exception))
            self.assertNotIn("\n", str(caught.exception))

    def test_any(self):
        """Any value in the place of any other is read, or refused in one line."""
        env = readers._load(self.write(ENV, "env.yaml"))
        config = {"dof_names": json.dumps(JOINTS), "kp": "[1, 2, 3, 4]", "kd": "[1, 2, 3, 4]", "experiment_config": json.dumps(HOLOSOMA)}
        readings = [(read, document, ()) for read, document in ((readers._deploy, DEPLOY), (readers._isaac, env), (readers._descriptors, IO),
                                                             (readers._legged_lab, LAB), (readers._legged_rl_deploy, RENKUN))]
        readings += [(readers._mjlab, MJLAB, (21,)), (readers._holosoma, config, (21,)),
                     (lambda part, width: readers._holosoma(readers.Part({**config, "experiment_config": json.dumps(part.value)}, "f"), width), HOLOSOMA, (21,))]
        count = 0
        for read, document, more in readings:
            for path in paths(document):
                for value in (..., None, True, 0, -1.5, 10**400, "x", "nan", [], {}, [1], {"a": {"b": None}}, ["("]):
                    changed = change(document, path, value)
                    try:
                        Description(readers._texts(read(readers.Part(changed, "f"), *more)))
                    except ValueError as error:
                        self.assertNotIn("\n", str(error))
                    count += 1
        self.assertGreater(count, 2000)

    def test_model(self):
        """Joints by number need the model that has them all."""
        d = Description(self.write(change(change(DEPLOY, ["joint_ids_map"], [0, 1]), ["observations"], {"projected_gravity": {"params": {}}})
                                   | {"stiffness": [1, 2], "damping": [1, 2], "default_joint_pos": [0, 0],
                                      "actions": {"JointPositionAction": {"scale": [1, 1], "offset": [0, 0]}}}))
        with self.assertRaisesRegex(ValueError, "model: it has 4 joints, and .* 2, by number; give the model"):
            self.robot(d)

    def test_beside(self):
        """deploy.yaml before the file's own metadata before env.yaml, beside it or in params."""
        policy = self.folder / "exported/policy.pt"
        self.write("", "exported/policy.pt")
        with self.assertRaisesRegex(ValueError, "no deploy.yaml or env.yaml is beside it; needs --describe"):
            readers.find(policy)
        env = self.write(ENV, "params/env.yaml")
        self.assertEqual(readers.find(policy), env)
        self.enterContext(onnxruntime(MJLAB, 21))
        policy = self.write("", "exported/policy.onnx")
        self.assertEqual(readers.find(policy), policy)
        self.assertEqual(readers.find(policy), policy)
        deploy = self.write(DEPLOY, "params/deploy.yaml")
        self.assertEqual(readers.find(policy), deploy)
        with self.assertRaisesRegex(ValueError, "there is no file"):
            readers.find(self.folder / "nobody.onnx")


class NoYaml(Files):
    def test_missing(self):
        with unittest.mock.patch.dict(sys.modules, yaml=None), self.assertRaisesRegex(RuntimeError, r"PyYAML; `pip install mildground\[trial\]`"):
            Description(self.write(DEPLOY))


class Onnx(Files):
    def test_mjlab(self):
        """Names, gains, pose and terms; the frames are as many as the input takes."""
        d = Description(self.onnx())
        robot = self.robot(d)
        self.assertEqual((robot.joints, robot.kp.tolist(), robot.kd.tolist(), robot.default.tolist(), robot.scale.tolist()),
                         (JOINTS, [10, 11, 12, 13], [1, 2, 3, 4], [0.1, 0.2, 0.3, 0.4], [0.5] * 4))
        self.assertEqual([t.name for t in d.terms], ["angular_velocity", "gravity", "joint_position", "joint_velocity", "action", "command"])
        self.assertEqual((d.actuator["kind"], d.policy["step"], d.policy["decimation"], d.history["stack"]), ("servo", 0.005, 4, "term"))

    def command(self, *arguments):
        out, error = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
            status = trials.main([str(argument) for argument in arguments])
        return status, out.getvalue(), error.getvalue()

    def test_command(self):
        """Without --describe; widths of one frame, of three, and of none."""
        self.write(biped(), "robot.xml")
        for width, line in ((21, "21 numbers, 21 with"), (63, "21 numbers, 63 with")):
            status, out, error = self.command(self.folder / "robot.xml", self.onnx(width=width), "--check")
            self.assertEqual((status, error), (0, ""))
            self.assertIn(line, out)
        status, _, error = self.command(self.folder / "robot.xml", self.onnx(width=22), "--ground", "rigid")
        self.assertEqual((status, error.count("\n")), (2, 1))
        self.assertIn("it sees 22 numbers, and one frame of the description has 21", error)
        status, out, error = self.command(self.folder / "robot.xml", self.onnx(), "--ground", "rigid", "--trials", "1", "--seconds", "0.1")
        self.assertEqual((status, error), (0, ""))

    def test_phase(self):
        """The metadata has no period: it is asked for."""
        names = MJLAB["observation_names"] + ",phase"
        with self.assertRaisesRegex(ValueError, "clock whose period .*clock.period"):
            Description(self.onnx(observation_names=names))
        self.assertEqual(Description(self.onnx(observation_names=names), {"clock.period": 0.6}).clock["period"], 0.6)

    def test_holosoma(self):
        """Terms by name, two clocks; without its experiment the pose is asked for."""
        metadata = {"dof_names": json.dumps(JOINTS), "kp": "[1, 2, 3, 4]", "kd": "[5, 6, 7, 8]"}
        d = Description(self.onnx(metadata, experiment_config=json.dumps(HOLOSOMA)))
        robot = self.robot(d)
        self.assertEqual((robot.kp.tolist(), robot.default.tolist(), robot.effort.tolist(), robot.scale.tolist()),
                         ([1, 2, 3, 4], [0.1, 0.2, 0.3, 0.4], [9] * 4, [0.25] * 4))
        self.assertEqual([t.name for t in d.terms], ["angular_velocity", "command_turn", "command_linear", "joint_position", "phase_sin"])
        self.assertEqual((d.clock["period"], d.clock["offsets"], d.policy["step"]), (0.9, [0, 0.5], 0.005))
        with self.assertRaisesRegex(ValueError, "no number for left_hip"):
            self.robot(Description(self.onnx(metadata), {"observation.gravity": 1}))

    def test_malformed(self):
        for metadata, line in (({}, "no metadata of mjlab or holosoma.*deploy.yaml"), ({**MJLAB, "joint_damping": "1,2"}, "joint_damping: has 2 values"),
                               ({**MJLAB, "default_joint_pos": "a,b,c,d"}, r"default_joint_pos\[0\]: must be a number, not 'a'"),
                               ({**MJLAB, "action_scale": "1,2"}, "action_scale: has 2 values.*which it moves"),
                               ({**MJLAB, "observation_names": "base_ang_vel,radar"}, "no term 'radar'.*layout = .*policy.onnx"),
                               ({"joint_names": "a"}, "action_scale: is missing"), ({"dof_names": "not json"}, "dof_names: is no JSON"),
                               ({"dof_names": "[\"a\"]", "kp": "[1]", "kd": "[1]", "experiment_config": "{}"}, "robot: is missing"),
                               ({"dof_names": json.dumps(JOINTS), "kp": "[1, 2, 3, 4]", "kd": "[1, 2, 3, 4]", "experiment_config": json.dumps(change(
                                   HOLOSOMA, ["simulator", "config", "sim", "fps"], 0))}, "fps: must be more than 0, not 0")):
            path = self.onnx(metadata)
            with self.subTest(line), self.assertRaisesRegex(ValueError, line) as caught:
                Description(path)
            self.assertIn("policy.onnx", str(caught.exception))
        path = self.onnx()
        path.write_text("broken")
        with self.assertRaisesRegex(ValueError, "cannot read .*policy.onnx: no protobuf at all; .*git lfs pull"):
            Description(path)


class Joints(unittest.TestCase):
    def test_breadth(self):
        """By depth; joints of one body follow each other, as in a URDF; a body without joints adds no depth."""
        hinge = '<joint name="{}" axis="0 1 0"/><geom size="0.1"/>'
        text = ('<mujoco><worldbody><body><freejoint/><geom size="0.1"/>'
                f'<body>{hinge.format("a1")}<body><geom size="0.1"/><body>{hinge.format("a2")}</body></body></body>'
                f'<body>{hinge.format("b1")}{hinge.format("b2")}{hinge.format("b3")}</body></body></worldbody></mujoco>')
        model = mujoco.MjModel.from_xml_string(text)
        names = _stand.joint_names(model)
        self.assertEqual([names[k] for k in _stand.breadth(model)], ["a1", "b1", "a2", "b2", "b3"])

    def test_axes(self):
        """tangent_normal is that of a frame of the same heading, whose x and z it has level; the quaternion is MuJoCo's."""
        model = mujoco.MjModel.from_xml_string(biped())
        data = mujoco.MjData(model)
        d = Description({"observation": {"tangent_normal": 1, "quaternion": 1}})
        for pitch, wanted in ((0, [1, 0, 0, 0, 0, 1]), (0.3, [math.cos(0.3), 0, -math.sin(0.3), math.sin(0.3), 0, math.cos(0.3)])):
            turn, lean = np.array([math.cos(1), 0, 0, math.sin(1)]), np.array([math.cos(pitch / 2), 0, math.sin(pitch / 2), 0])
            mujoco.mju_mulQuat(data.qpos[3:7], turn, lean)
            state = State(d, model, data, (mujoco.mjtObj.mjOBJ_XBODY, 1), (np.arange(7, 11), np.arange(6, 10)))
            state.read(lambda amplitude, count: np.zeros(count))
            seen = Observer(d, 4, 4).observe(state)
            np.testing.assert_allclose(seen[:6], wanted, atol=1e-6)
            np.testing.assert_allclose(seen[6:], data.qpos[3:7], atol=1e-6)


if __name__ == "__main__":
    unittest.main()
