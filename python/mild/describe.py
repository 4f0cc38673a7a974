"""What a policy sees and does, as a small ini file (docs/public-policies.md): the robot's side of mild.trial.

A Description is read from a file, from a layout of the package (mild.layouts()), or from a dict of sections. It makes the
observation from MuJoCo's state and turns the action into targets of the joints."""
import configparser
import dataclasses
import math
import pathlib
import re

import numpy as np

from . import readers

FOLDER = pathlib.Path(__file__).parent / "layouts"
TABLES = ("kp", "kd", "default", "effort", "scale", "armature", "lower", "upper")  # sections of numbers by joint, keys are regular expressions


@dataclasses.dataclass(frozen=True)
class Key:
    """A key of a description: how it is read, what it is without a line, and what it says."""
    read: object
    default: object
    help: str


def words(text):
    return text.split()


def numbers(text):
    """Numbers, of which 0.5*3 is three."""
    found = []
    for word in text.split():
        value, _, times = word.partition("*")
        found += [float(value)] * int(times or 1)
    return found


def choice(*names):
    def read(text):
        if text not in names:
            raise ValueError(f"'{text}' is none of {', '.join(names)}")
        return text
    return read


KEYS = {
    "policy": {
        "layout": Key(str, None, "a layout of the package, or a file beside this one, that this file completes"),
        "joints": Key(words, None, "joints of the action, in its order: regular expressions; without: all hinges and slides"),
        "observed": Key(words, None, "joints of the observation; without: those of the action"),
        "order": Key(choice("listed", "breadth", "grouped"), "listed", "listed: joints as they are named; breadth: by depth in the tree, as in Isaac "
                     "Lab; grouped: as they are named, those of one pattern by depth, as its preserve_order"),
        "observed_order": Key(choice("", "listed", "breadth", "grouped"), "", "the same of the joints of the observation; without: order"),
        "model_joints": Key(int, 0, "joints that the model must have, where they are named by number, @0 its first motor; 0: any"),
        "step": Key(float, 0.0, "[s] of physics; 0: that of the model"),
        "decimation": Key(int, 10, "steps of physics from decision to decision"),
        "delay": Key(float, 0.0, "[s] from an observation to its action, in whole steps of physics"),
        "integrator": Key(choice("", "Euler", "implicitfast", "implicit"), "", "without: that of the model"),
        "clip": Key(float, math.inf, "largest number of the observation"),
        "input": Key(words, None, "ONNX: the inputs of the observation, one after the other; without: the first"),
        "output": Key(str, "", "ONNX: the output of the action; without: the first"),
        "state": Key(words, None, "ONNX: recurrent state, INPUT>OUTPUT for each; without: the other inputs and outputs in order"),
        "frame": Key(str, "", "body or site in whose axes the base's velocities and gravity are; without: the floating base"),
    },
    "history": {
        "frames": Key(int, 1, "observations that the policy sees at once; 0: as many as the input of its ONNX holds"),
        "newest": Key(choice("last", "first"), "last", "place of the newest"),
        "stack": Key(choice("frame", "term"), "frame", "frame: whole observations in a row; term: the history of each term"),
        "start": Key(choice("repeat", "zero"), "repeat", "what is before the first observation"),
    },
    "clock": {
        "period": Key(float, 0.8, "[s] of the gait"),
        "slowing": Key(float, 0.0, "part of the period by which that of a command of no speed is longer"),
        "slow_below": Key(float, 1.2, "[m/s] commands below this slow the clock: |forward| + 3 |left| + 1 m |turn|"),
        "offsets": Key(numbers, [0.0], "parts of a period by which the clocks are ahead, one for each clock"),
        "standing": Key(float, -1.0, "the clock stands when the command is shorter than this"),
        "standing_phase": Key(float, None, "phase of every clock that stands; without: sine and cosine are 0"),
    },
    "action": {
        "clip": Key(float, math.inf, "largest number of the action"),
        "seen": Key(choice("clipped", "raw"), "clipped", "what the next observation has as the last action"),
        "target": Key(choice("default", "zero", "last"), "default", "to what the scaled action is added: the default angles, 0, "
                      "or the last target"),
    },
    "actuator": {
        "kind": Key(choice("torque", "servo", "model"), "torque", "torque: kp (target - q) - kd qd at every step of physics; servo: "
                    "MuJoCo's position actuators with kp and kd; model: the model's own actuators get the targets"),
    },
    "command": {  # of a tour
        "forward": Key(numbers, [-0.4, 0.8], "[m/s] least and largest that a tour gives; 0 between"),
        "sideways": Key(float, 0.4, "[m/s] largest, either way"),
        "turn": Key(float, 0.8, "[rad/s] largest, either way"),
        "arms": Key(choice("seen", "unseen"), "seen", "what a policy sees of arms that a tour moves: their angles and speeds, or still arms "
                    "where it wants them, their default angles if it does not move them"),
    },
    "start": {
        "keyframe": Key(str, "", "of the model; without: the default angles"),
        "lift": Key(float, 0.0, "[m] of the feet above where they carry the robot"),
    },
    "feet": {
        "names": Key(words, None, "bodies or sites; without: found by what is lowest at the start"),
        "sole": Key(words, None, "geoms that are the soles; without: those of the feet that collide; all: every geom of the feet"),
        "bodies": Key(words, None, "other bodies that meet soft ground; without: those that are low at the start; -: none"),
    },
    "noise": {  # +-, uniform; half of what most trainings have
        "angular_velocity": Key(float, 0.1, "[rad/s]"),
        "linear_velocity": Key(float, 0.05, "[m/s]"),
        "gravity": Key(float, 0.025, "parts of a unit vector"),
        "joint_position": Key(float, 0.005, "[rad]"),
        "joint_velocity": Key(float, 0.5, "[rad/s]"),
        "start_joint": Key(float, 0.05, "[rad] of each joint at the start"),
        "start_place": Key(float, 0.5, "[m] of the place of the start; its heading is any"),
    },
}


def _sensor(state, name):
    try:
        return state.data.sensor(name).data
    except KeyError:
        raise ValueError(f"observation.sensor:{name}: the model has no such sensor") from None


# Terms of an observation: how many numbers (of the joints seen, the joints moved and the words after the scale), and which.
TERMS = {
    "angular_velocity": (lambda seen, moved, clocks: 3, lambda s: s.angular_velocity),
    "linear_velocity": (lambda seen, moved, clocks: 3, lambda s: s.linear_velocity),
    "gravity": (lambda seen, moved, clocks: 3, lambda s: s.gravity),
    "euler": (lambda seen, moved, clocks: 3, lambda s: s.euler()),
    "tangent_normal": (lambda seen, moved, clocks: 6, lambda s: s.tangent_normal()),
    "quaternion": (lambda seen, moved, clocks: 4, lambda s: s.quaternion()),
    "command": (lambda seen, moved, clocks: 3, lambda s: s.command),
    "command_linear": (lambda seen, moved, clocks: 2, lambda s: s.command[:2]),
    "command_turn": (lambda seen, moved, clocks: 1, lambda s: s.command[2:]),
    "joint_position": (lambda seen, moved, clocks: seen, lambda s: s.joint_position - s.default),
    "joint_angle": (lambda seen, moved, clocks: seen, lambda s: s.joint_position),
    "joint_velocity": (lambda seen, moved, clocks: seen, lambda s: s.joint_velocity),
    "action": (lambda seen, moved, clocks: moved, lambda s: s.action),
    "phase_sin": (lambda seen, moved, clocks: clocks, lambda s: s.clock(np.sin)),
    "phase_cos": (lambda seen, moved, clocks: clocks, lambda s: s.clock(np.cos)),
    "height": (lambda seen, moved, clocks: 1, lambda s: s.height),
}


@dataclasses.dataclass(frozen=True)
class Term:
    name: str
    scale: np.ndarray  # (1,) or one for each number
    count: int  # of a constant; 0 elsewhere


def layouts() -> list[str]:
    """Names of the layouts that come with the package."""
    return sorted(path.stem for path in FOLDER.glob("*.ini"))


class Description:
    """The keys of a description: .policy, .history, .clock, .action, .actuator, .start, .feet, .noise are dicts, .terms a list of
    Term, .kp and the other tables lists of (pattern, number)."""

    def __init__(self, source: "str | pathlib.Path | dict | None" = None, changes=()):
        """source: a file (an ini, or one that mild.readers reads), the name of a layout, a dict of sections, or None; changes:
        {"section.key": text}, over the file."""
        parser = _parser()
        self.name = source if isinstance(source, (str, pathlib.Path)) else "a dict"
        _read(parser, source)
        for key, value in dict(changes).items():
            section, _, key = key.partition(".")
            if not key:
                raise ValueError(f"{section}: must be SECTION.KEY")
            parser.read_dict({section: {key: str(value)}})
        for section in parser.sections():
            if section not in KEYS and section not in TABLES and section != "observation":
                raise ValueError(f"{self.name}: no section [{section}]; there are {', '.join([*KEYS, 'observation', *TABLES])}")
        for section, keys in KEYS.items():
            setattr(self, section, _section(self.name, parser, section, keys))
        for table in TABLES:
            setattr(self, table, _table(self.name, parser, table))
        self.terms = [_term(self.name, *line) for line in (parser.items("observation") if parser.has_section("observation") else [])]
        if not self.terms:
            raise ValueError(f"{self.name}: [observation] has no term; there are {', '.join([*TERMS, 'constant', 'sensor:NAME'])}")
        if self.policy["decimation"] < 1 or self.history["frames"] < 0:
            raise ValueError(f"{self.name}: policy.decimation must be 1 or more, history.frames 0 or more")
        if not 0 <= self.policy["step"] < math.inf:
            raise ValueError(f"{self.name}: policy.step must be 0 or more")
        if len(self.command["forward"]) != 2 or not self.command["forward"][0] <= 0 <= self.command["forward"][1]:
            raise ValueError(f"{self.name}: command.forward must be two numbers, the least and the largest, and 0 between")
        for side in ("sideways", "turn"):
            if not 0 <= self.command[side] < math.inf:
                raise ValueError(f"{self.name}: command.{side} must be 0 or more")
        if not self.clock["period"] > 0:
            raise ValueError(f"{self.name}: the observation has a clock whose period it does not say; give clock.period [s], such as "
                             "--set clock.period=0.8, or the deploy.yaml that has it")


def _parser():
    parser = configparser.ConfigParser(delimiters=("=",), comment_prefixes=("#", ";"), inline_comment_prefixes=("#", ";"),
                                       interpolation=None, empty_lines_in_values=False)
    parser.optionxform = str
    parser.SECTCRE = re.compile(r"\[(?P<header>[^]]+)\]$")  # its own drops without a word what stands behind a section
    return parser


def _read(parser, source, above=()):
    """A file after the layout that it completes; a section [observation] replaces that of the layout. above: files whose layout it is."""
    if source is None:
        return
    if isinstance(source, dict):
        own = _parser()
        own.read_dict({section: {key: str(value) for key, value in keys.items()} for section, keys in source.items()})
        folder = pathlib.Path()
    else:
        path = pathlib.Path(source)
        if not path.is_file():
            path = FOLDER / f"{source}.ini"
        if not path.is_file():
            raise ValueError(f"describe: there is no file '{source}', and no such layout; there are {', '.join(layouts())}")
        if path.resolve() in above:
            raise ValueError(f"describe: {source}: policy.layout leads back to this file; name another")
        own, folder, above = _parser(), path.parent, (*above, path.resolve())
        try:
            config = path.suffix.lower() in readers.SUFFIXES
            own.read_dict(readers.sections(path)) if config else own.read_string(path.read_text(encoding="utf-8"), str(source))
        except UnicodeDecodeError:
            raise ValueError(f"describe: {source}: is no text; give an ini or a config of a trainer") from None
        except configparser.Error as error:
            raise ValueError(f"describe: {' '.join(str(error).split())}") from None
    base = own.get("policy", "layout", fallback=None)
    if base:
        _read(parser, folder / base if (folder / base).is_file() else base, above)
    for section in own.sections():
        if section == "observation" or section in TABLES:
            parser.remove_section(section)
        parser.read_dict({section: dict(own.items(section))})


def _section(name, parser, section, keys):
    given = dict(parser.items(section)) if parser.has_section(section) else {}
    for key in given:
        if key not in keys:
            raise ValueError(f"{name}: [{section}] has no key '{key}'; there are {', '.join(keys)}")
    values = {}
    for key, row in keys.items():
        try:
            values[key] = row.read(given[key]) if key in given else row.default
        except ValueError as error:
            raise ValueError(f"{name}: {section}.{key}: {error}") from None
    return values


def _table(name, parser, section):
    rows = []
    for pattern, text in parser.items(section) if parser.has_section(section) else ():
        try:
            rows.append((re.compile(pattern), float(text)))
        except (re.error, ValueError) as error:
            raise ValueError(f"{name}: [{section}] {pattern} = {text}: {error}") from None
    return rows


def _term(name, key, text):
    kind = key.split(".")[0]  # command.2: a second time
    if kind not in TERMS and kind != "constant" and not kind.startswith("sensor:"):
        raise ValueError(f"{name}: [observation] has no term '{kind}'; there are {', '.join([*TERMS, 'constant', 'sensor:NAME'])}" +
                         f"; an ini with `[policy] layout = {name}` and an [observation] of its own replaces it"
                         * (pathlib.Path(str(name)).suffix.lower() in readers.SUFFIXES))
    try:
        values = numbers(text)
    except ValueError as error:
        raise ValueError(f"{name}: observation.{key}: {error}") from None
    if not values:
        raise ValueError(f"{name}: observation.{key}: needs a scale, one number or one for each")
    return Term(kind, np.array(values), len(values) if kind == "constant" else 0)


def _matches(pattern, joints, numbers=None):
    """For each joint whether a pattern matches its whole name, or is @ and its number; without numbers its place."""
    try:
        return [re.fullmatch(pattern, joint) is not None or pattern == f"@{k}" for k, joint in zip(numbers or range(len(joints)), joints)]
    except re.error as error:
        raise ValueError(f"joints: '{pattern}' is no regular expression: {error}") from None


def by_joint(rows, joints, otherwise, section, numbers=None):
    """A number for each joint: that of the last pattern that matches its whole name."""
    values = np.full(len(joints), np.nan if otherwise is None else otherwise)
    for pattern, value in rows:
        hit = _matches(pattern.pattern, joints, numbers)
        if not any(hit):
            raise ValueError(f"[{section}] {pattern.pattern}: no joint has such a name; there are {', '.join(joints)}")
        values[hit] = value
    if np.isnan(values).any():
        raise ValueError(f"[{section}]: no number for {', '.join(np.array(joints)[np.isnan(values)])}")
    return values


def choose(patterns, joints, key, numbers=None):
    """Indices of joints in the order of the patterns that match their whole names; None: all."""
    if patterns is None:
        return list(range(len(joints)))
    order = []
    for pattern in patterns:
        found = [i for i, hit in enumerate(_matches(pattern, joints, numbers)) if hit and i not in order]
        if not found:
            raise ValueError(f"policy.{key}: no joint is left for '{pattern}'; there are {', '.join(joints)}")
        order += found
    return order


class Observer:
    """Makes what a policy sees, decision by decision, from a State."""

    def __init__(self, description, seen, moved, size=None):
        """seen, moved: how many joints it observes and moves; size: how many numbers the policy takes, where history.frames is 0."""
        d = self.description = description
        self.size, self.length = size, d.history["frames"]
        self.counts = [term.count or (TERMS[term.name][0](seen, moved, len(d.clock["offsets"])) if term.name in TERMS else 0)
                       for term in d.terms]
        for term, count in zip(d.terms, self.counts):
            if count and term.name != "constant" and len(term.scale) not in (1, count):
                raise ValueError(f"observation.{term.name}: {len(term.scale)} scales for {count} numbers")
        self.frames = []

    def reset(self):
        self.frames = []

    def fit(self, count):
        """How many frames of count numbers the policy takes."""
        if not isinstance(self.size, int):
            raise ValueError("history.frames: 0 needs an ONNX file whose input says its width; give the number of frames")
        if self.size % count:
            raise ValueError(f"policy: it sees {self.size} numbers, and one frame of the description has {count}, which is no part of it; "
                             "--check lists them")
        return self.size // count

    def frame(self, state):
        """A list of arrays, one for each term."""
        parts = []
        for term in self.description.terms:
            if term.name == "constant":
                parts.append(term.scale)
            elif term.name.startswith("sensor:"):
                parts.append(term.scale * _sensor(state, term.name[7:]))
            else:
                parts.append(term.scale * TERMS[term.name][1](state))
        return [np.clip(part, -self.description.policy["clip"], self.description.policy["clip"]) for part in parts]

    def observe(self, state):
        """The observation (n,), float32."""
        history, newest = self.description.history, self.frame(state)
        if not self.frames:
            before = newest if history["start"] == "repeat" else [np.zeros_like(part) for part in newest]
            self.frames = [before] * (self.length or self.fit(sum(map(len, newest))))
        self.frames = [*self.frames[1:], newest]
        frames = self.frames if history["newest"] == "last" else self.frames[::-1]
        parts = [part for frame in frames for part in frame] if history["stack"] == "frame" else \
                [frame[k] for k in range(len(newest)) for frame in frames]
        return np.concatenate(parts).astype(np.float32)


class State:
    """What a policy may know at one decision, without noise until `disturb`. Vectors are in the axes of policy.frame."""

    def __init__(self, description, model, data, frame, seen):
        """frame: (mjtObj, id) of the base's axes; seen: (qpos, qvel) addresses of the observed joints."""
        self.description, self.model, self.data, self.at, (self.qpos, self.qvel) = description, model, data, frame, seen
        self.command, self.action, self.default = np.zeros(3), None, None
        self.twist, self.rotation = np.zeros(6), np.eye(3)
        self.then, self.turns = 0.0, 0.0  # [s] and periods of the clock, whose period may change with the command

    def read(self, draw):
        """Reads the state; draw(amplitude, count): noise."""
        import mujoco

        m, d, noise = self.model, self.data, self.description.noise
        mujoco.mj_kinematics(m, d)  # mj_step leaves the places of the step before
        mujoco.mj_comPos(m, d)
        mujoco.mj_comVel(m, d)
        kind, index = self.at
        mujoco.mj_objectVelocity(m, d, kind, index, self.twist, 1)
        self.rotation = (d.site_xmat if kind == mujoco.mjtObj.mjOBJ_SITE else d.xmat)[index].reshape(3, 3)
        self.height = np.array([(d.site_xpos if kind == mujoco.mjtObj.mjOBJ_SITE else d.xpos)[index][2]])
        self.angular_velocity = self.twist[:3] + draw(noise["angular_velocity"], 3)
        self.linear_velocity = self.twist[3:] + draw(noise["linear_velocity"], 3)
        self.gravity = -self.rotation[2] + draw(noise["gravity"], 3)
        self.joint_position = d.qpos[self.qpos] + draw(noise["joint_position"], len(self.qpos))
        self.joint_velocity = d.qvel[self.qvel] + draw(noise["joint_velocity"], len(self.qvel))

    def euler(self):
        """Roll, pitch, yaw [rad] of the frame."""
        r = self.rotation
        return np.array([math.atan2(r[2, 1], r[2, 2]), math.asin(max(-1.0, min(1.0, -r[2, 0]))), math.atan2(r[1, 0], r[0, 0])])

    def tangent_normal(self):
        """x and z axes of the frame, seen from a frame of the same heading."""
        c, s = (function(self.euler()[2]) for function in (math.cos, math.sin))
        return (np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ self.rotation[:, [0, 2]]).T.ravel()

    def quaternion(self):
        """w, x, y, z of the frame."""
        import mujoco

        found = np.zeros(4)
        mujoco.mju_mat2Quat(found, self.rotation.ravel())
        return found

    def clock(self, function):
        clock = self.description.clock
        offsets = np.array(clock["offsets"])
        if np.linalg.norm(self.command) < clock["standing"]:
            phase = clock["standing_phase"]
            return np.zeros(len(offsets)) if phase is None else np.full(len(offsets), function(2 * np.pi * phase))
        time, slow = self.data.time, max(0.0, 1 - np.abs(self.command) @ [1, 3, 1] / clock["slow_below"])
        period = clock["period"] * (1 + clock["slowing"] * slow)
        if time < self.then:  # another walk
            self.then = self.turns = 0.0
        self.turns, self.then = self.turns + (time - self.then) / period, time
        return function(2 * np.pi * ((self.turns if clock["slowing"] else time / period) + offsets))
