"""Descriptions that trainers write themselves, as sections of mild.describe.Description (docs/public-policies.md): the metadata of mjlab's,
holosoma's ONNX files, Unitree's deploy.yaml, Isaac Lab's env.yaml and IO descriptors, the configs of rl_sar, legged_rl_deploy and LeggedLabDeploy.

What a file leaves out and a walk needs is nan or an unknown term, which Description reports, so that an ini with
`layout = FILE` can complete it."""
import json
import math
import pathlib
import re
import reprlib

SUFFIXES = (".onnx", ".yaml", ".yml")
REMEDY = "describe the policy in an ini, with the keys of `mild trial --keys`"
PHYSICS = 0.002  # [s] step of a config that has only the time of a decision, as Unitree's program for MuJoCo
# Names of observations: by function in Isaac Lab and Unitree's program, by term in mjlab, whose joint_pos is relative to the default.
ISAAC = {"base_lin_vel": "linear_velocity", "base_ang_vel": "angular_velocity", "projected_gravity": "gravity", "generated_commands": "command",
         "velocity_commands": "command", "keyboard_velocity_commands": "command", "joint_pos_rel": "joint_position", "joint_pos": "joint_angle",
         "joint_vel_rel": "joint_velocity", "joint_vel": "joint_velocity", "last_action": "action", "gait_phase": "phase",
         "base_pos_z": "height", "root_local_rot_tan_norm": "tangent_normal"}
MJLAB = {**ISAAC, "joint_pos": "joint_position", "actions": "action", "command": "command", "twist": "command", "phase": "phase"}
HOLOSOMA = {"base_lin_vel": "linear_velocity", "base_ang_vel": "angular_velocity", "projected_gravity": "gravity", "command_lin_vel": "command_linear",
            "command_ang_vel": "command_turn", "dof_pos": "joint_position", "dof_vel": "joint_velocity", "actions": "action",
            "sin_phase": "phase_sin", "cos_phase": "phase_cos"}
BESIDE = ("deploy.yaml", "env.yaml")


def find(policy):
    """The description that comes with a policy's file: deploy.yaml, its own metadata, or env.yaml, which are beside it or in params, where
    Unitree and Isaac Lab leave them. Raises ValueError where there is none."""
    path = pathlib.Path(str(policy))
    folders = (path.parent, path.parent / "params", path.parent.parent / "params")
    beside = [folder / name for name in BESIDE for folder in folders if path.is_file() and (folder / name).is_file()]
    if beside and beside[0].name == BESIDE[0]:
        return beside[0]
    if path.suffix.lower() == ".onnx" and path.is_file() and _kind(_metadata(path)[0]):
        return path
    if beside:
        return beside[0]
    if path.suffix.lower() == ".safetensors":
        raise ValueError(f"policy: '{policy}' may be one of mild's own; `mild eval --policy {policy}` lets it walk")
    if path.suffix.lower() in (".onnx", ".pt") and not path.is_file():
        raise ValueError(f"policy: there is no file '{policy}'")
    raise ValueError(f"describe: '{path}' has no metadata of mjlab or holosoma, and no {' or '.join(BESIDE)} is beside it; needs --describe "
                     "with a config or an ini (docs/public-policies.md)")


def sections(path):
    """{section: {key: text}} of a file in one of SUFFIXES. Raises ValueError with file, key and remedy."""
    path = pathlib.Path(path)
    if path.suffix.lower() == ".onnx":
        metadata, width = _metadata(path)
        read = {"joint_names": _mjlab, "dof_names": _holosoma}.get(_kind(metadata))
        if not read:
            raise ValueError(f"describe: {path} has no metadata of mjlab or holosoma; give its deploy.yaml or env.yaml, or {REMEDY}")
        return _texts(read(Part(metadata, path), width))
    document = Part(_load(path), path)
    if "joint_ids_map" in document:
        return _texts(_deploy(document))
    if "articulations" in document and "observations" in document:
        return _texts(_descriptors(document))
    if "sim" in document and "observations" in document:
        return _texts(_isaac(document))
    if "joint2motor_idx" in document:
        return _texts(_legged_lab(document))
    if "policy" in document and "joint_ids_map" in document["policy"]:
        return _texts(_legged_rl_deploy(document["policy"]))
    if len(document.value) == 1 and "rl_kp" in document.items()[0][1]:
        return _texts(_rl_sar(document.items()[0][1]))
    raise ValueError(f"describe: {path} is no deploy.yaml of Unitree (no joint_ids_map) and no env.yaml of Isaac Lab (no sim, observations); "
                     f"{REMEDY}")


def _texts(found):
    def text(value):
        return " ".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)
    return {section: {key: text(value) for key, value in keys.items()} for section, keys in found.items()}


class Part:
    """A part of a document, which knows where it is."""

    def __init__(self, value, file, key=""):
        self.value, self.file, self.key = value, file, key

    def wrong(self, what):
        return ValueError(f"describe: {self.file}: {self.key + ': ' if self.key else ''}{what}; {REMEDY}")

    def __contains__(self, key):
        return isinstance(self.value, dict) and self.value.get(key) is not None

    def get(self, key, default=None):
        """A part by its key; default where it is not there or null."""
        if not isinstance(self.value, dict):
            raise self.wrong("must be a table of keys")
        found = self.value.get(key)
        return Part(default if found is None else found, self.file, f"{self.key}.{key}".lstrip("."))

    def __getitem__(self, key):
        found = self.get(key)
        if found.value is None:
            raise found.wrong("is missing")
        return found

    def items(self):
        if not isinstance(self.value, dict):
            raise self.wrong("must be a table of keys")
        return [(str(key), Part(value, self.file, f"{self.key}.{key}".lstrip("."))) for key, value in self.value.items()]

    def number(self):
        try:
            if isinstance(self.value, bool):
                raise ValueError
            return float(self.value)
        except OverflowError:
            raise self.wrong("is too large") from None
        except (TypeError, ValueError):
            raise self.wrong(f"must be a number, not {reprlib.repr(self.value)}") from None

    def positive(self):
        value = self.number()
        if not 0 < value < math.inf:
            raise self.wrong(f"must be more than 0, not {value:g}")
        return value

    def list(self, count=None):
        """Its values, of a list or of mjlab's text with commas; count: how many there must be."""
        values = self.value.split(",") if isinstance(self.value, str) else self.value
        if not isinstance(values, list):
            raise self.wrong("must be a list")
        if count is not None and len(values) != count:
            raise self.wrong(f"has {len(values)} values, and there are {count} joints")
        return values

    def numbers(self, count=None):
        return [Part(value, self.file, f"{self.key}[{k}]").number() for k, value in enumerate(self.list(count))]

    def names(self):
        if any(not isinstance(value, str) for value in self.list()):
            raise self.wrong("must be a list of names")
        return [value.strip() for value in self.list()]

    def integer(self):
        value = self.number()
        if not math.isfinite(value) or value != round(value):
            raise self.wrong(f"must be a whole number, not {reprlib.repr(self.value)}")
        return int(value)

    def json(self):
        try:
            return Part(json.loads(self.value), self.file, self.key)
        except (TypeError, ValueError) as error:
            raise self.wrong(f"is no JSON: {error}") from None


def _load(path):
    """A YAML document without Python's objects: their tags are read as the list, table or text that follows them."""
    try:
        import yaml
    except ImportError:
        raise RuntimeError("describe: YAML needs PyYAML; `pip install mildground[trial]`") from None

    class Loader(yaml.SafeLoader):
        pass

    def plain(loader, tag, node):
        if isinstance(node, yaml.MappingNode):
            return loader.construct_mapping(node, deep=True)
        return loader.construct_sequence(node, deep=True) if isinstance(node, yaml.SequenceNode) else loader.construct_scalar(node)

    Loader.add_multi_constructor("tag:yaml.org,2002:python/", plain)
    try:
        document = yaml.load(path.read_text(encoding="utf-8"), Loader)
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError, ValueError) as error:
        raise ValueError(f"describe: {path}: is no YAML: {' '.join(str(error).split())}; {REMEDY}") from None
    if not isinstance(document, dict):
        raise ValueError(f"describe: {path}: must be a table of keys; {REMEDY}")
    return document


def _metadata(path):
    """({key: text} of an ONNX file, width of its first input or None)."""
    from .networks import session

    opened = session(path)
    shape = opened.get_inputs()[0].shape
    return dict(opened.get_modelmeta().custom_metadata_map), shape[-1] if shape and isinstance(shape[-1], int) else None


def _kind(metadata):
    return next((key for key in ("joint_names", "dof_names") if key in metadata), None)


class Observation:
    """Terms in their order, as the keys of [observation]."""

    def __init__(self, names):
        self.names, self.keys, self.clock = names, {}, {}

    def add(self, name, scale=(1,)):
        """A term by its foreign name; one that is not known keeps it, and Description says so."""
        term = self.names.get(name, name)
        for part in ("phase_sin", "phase_cos") if term == "phase" else (term,):
            again = sum(key.split(".")[0] == part for key in self.keys)
            own = scale if term != "phase" or len(scale) == 1 else scale[part == "phase_cos"::2]
            self.keys[f"{part}.{again + 1}" if again else part] = [f"{value:.10g}" for value in own]


# ---- Unitree's deploy.yaml ----
def _deploy(document):
    """Joints have numbers: the place of a motor among those of joint_ids_map is that of a motor in the model (_stand.numbered)."""
    ids = document["joint_ids_map"].list()
    ids = list(range(len(ids))) if all(one is None for one in ids) else document["joint_ids_map"].numbers()
    if len(set(ids)) < len(ids):
        raise document["joint_ids_map"].wrong("names a motor twice")
    count, places = len(ids), [sorted(ids).index(one) for one in ids]
    default = document["default_joint_pos"].numbers(count)
    action = _only(document["actions"], ("JointPositionAction",))
    moved = action.get("joint_ids").value
    if isinstance(moved, list) and any(one is not None for one in moved):  # [null, null, null] is a slice of all
        numbers = action["joint_ids"].numbers()
        if any(one not in range(count) for one in numbers):
            raise action["joint_ids"].wrong(f"must be numbers from 0 to {count - 1}")
        moved = [int(one) for one in numbers]
    else:
        moved = list(range(count))
    scale = action.get("scale", [1.0] * len(moved)).numbers(len(moved))
    decision = document["step_dt"].number()
    if not 0 < decision < 1:
        raise document["step_dt"].wrong("must be the time of a decision [s]")
    step = PHYSICS if math.isclose(decision / PHYSICS, round(decision / PHYSICS), abs_tol=1e-6) else decision / 10
    found = {"policy": {"model_joints": count, "joints": [f"@{places[one]}" for one in moved], "observed": [f"@{place}" for place in places],
                        "step": f"{step:g}", "decimation": round(decision / step)},
             "action": {"seen": "raw", "target": _target(action, [default[one] for one in moved])},
             "default": {f"@{place}": value for place, value in zip(places, default)},
             "scale": {f"@{places[one]}": value for one, value in zip(moved, scale)}, **_limits(action, [f"@{places[one]}" for one in moved])}
    for section, key in (("kp", "stiffness"), ("kd", "damping")):  # by motor, unlike the rest; some files have rows of motors that are not there
        gains = document[key].numbers(None if len(document[key].list()) > max(ids, default=-1) else count)
        found[section] = {f"@{place}": gains[int(one)] if len(gains) > count else gains[place] for one, place in zip(ids, places)}
    return found | _deploy_observation(document["observations"])


def _deploy_observation(part):
    groups = [one for _, one in part.items() if isinstance(one.value, dict) and "params" not in one.value and "scale" not in one.value]
    if len(groups) > 1:
        raise part.wrong(f"has {len(groups)} groups, and one can be read")
    terms, frames, stack, clock = Observation(ISAAC), [], "term", {}
    for name, term in (groups[0] if groups else part).items():
        if name == "use_gym_history":
            stack = "frame" if term.value else "term"
        elif name != "scale_first":
            _no_clip(term)
            terms.add(name, term.get("scale", [1.0]).numbers())
            frames.append((term, term.get("history_length", 1).integer()))
            if name == "gait_phase":
                clock = {"period": term["params"]["period"].number(), "standing": 0.1}
    return {"observation": terms.keys, "clock": clock, "history": {"frames": _one_length(frames), "stack": stack}}


def _one_length(frames):
    for part, length in frames:
        if length != frames[0][1]:
            raise part.wrong(f"has a history of {length} frames, and the first term one of {frames[0][1]}")
    return max(1, frames[0][1]) if frames else 1


def _no_clip(part):
    """Limits of one term of the observation that a robot reaches are not read; those of 10 or more are no limits."""
    if "clip" in part and any(abs(bound) < 10 for bound in part["clip"].numbers()):
        raise part.get("clip").wrong("limits of one term cannot be read")


def _limits(action, joints):
    """[lower] and [upper] of the targets, of a table by pattern or a list of pairs; {} without."""
    if "clip" not in action:
        return {}
    clip = action["clip"]
    rows = clip.items() if isinstance(clip.value, dict) else \
        [(joint, Part(row, clip.file, f"{clip.key}[{k}]")) for k, (joint, row) in enumerate(zip(joints, clip.list(len(joints))))]
    pairs = [(joint, row.numbers()) for joint, row in rows]
    if any(len(pair) != 2 for _, pair in pairs):
        raise clip.wrong("must be pairs of the lowest and the highest target")
    return {"lower": {joint: pair[0] for joint, pair in pairs}, "upper": {joint: pair[1] for joint, pair in pairs}}


def _only(actions, kinds):
    """The one action of a table, if it is among those kinds."""
    rows = actions.items()
    if len(rows) != 1:
        raise actions.wrong(f"has {len(rows)} actions, and one can be read")
    name, action = rows[0]
    return _of_kind(action, action.get("class_type", name), kinds)


def _of_kind(action, kind, kinds):
    """An action, if its kind is among those that can be read."""
    last = re.split(r"[:.]", str(kind.value))[-1]
    if last not in kinds:
        raise action.wrong(f"{last[:80]} cannot be read, but {' and '.join(kinds)}")
    return action


def _target(action, default):
    offset = action.get("offset", 0.0)
    values = offset.numbers(len(default)) if isinstance(offset.value, list) else [offset.number()] * len(default)
    if all(math.isclose(a, b, abs_tol=1e-6) for a, b in zip(values, default)):
        return "default"
    if any(values):
        raise offset.wrong("must be 0 or the default angles")
    return "zero"


# ---- programs that walk policies of several trainers ----
RL_SAR = {"lin_vel": "linear_velocity", "ang_vel": "angular_velocity", "gravity_vec": "gravity", "commands": "command",
          "dof_pos": "joint_position", "dof_vel": "joint_velocity", "actions": "action"}
LEGGED_RL_DEPLOY = {**ISAAC, "base_ang_vel_B": "angular_velocity", "eulerZYX_rpy": "euler", "joint_pos": "joint_position", "gait_phase_2": "phase"}


def _rl_sar(part):
    """fan-ziqi/rl_sar's config.yaml, whose base.yaml above it names the robot's joints."""
    robot = part.key.split("/")[0]
    base = next((folder / "base.yaml" for folder in list(pathlib.Path(part.file).parents)[:4] if (folder / "base.yaml").is_file()), None)
    if base is None:
        raise part.wrong("needs the base.yaml of its robot in a folder above")
    base = Part(_load(base), base)[robot]
    names, moved = base["joint_names"].names(), [int(one) for one in part["joint_mapping"].numbers(part["num_of_dofs"].integer())]
    if any(one not in range(len(names)) for one in moved):
        raise part["joint_mapping"].wrong(f"must be numbers from 0 to {len(names) - 1}")
    joints = [names[one] for one in moved]
    terms, count = Observation(RL_SAR), len(joints)
    for name in part["observations"].names():
        key = {"commands": "commands_scale"}.get(name, f"{name}_scale")
        terms.add(name, part[key].numbers() if isinstance(part.get(key).value, list) else [part.get(key, 1.0).number()])
    history, default, scale = part.get("observations_history", []).numbers(), part["default_dof_pos"].numbers(count), part["action_scale"].numbers(count)
    low, high = (part[f"actions_{end}"].numbers(count) if f"actions_{end}" in part else part[f"clip_actions_{end}"].numbers(count) for end in ("lower", "upper"))
    even = len({-one for one in low} | set(high)) == 1
    found = {"policy": {"joints": joints, "step": f"{base['dt'].positive():g}", "decimation": base["decimation"].integer(),
                        "clip": part["clip_obs"].number()},
             "observation": terms.keys, "action": {"clip": high[0]} if even else {},
             "history": {"frames": max(1, len(history)), "newest": "first" if history[:2] == sorted(history[:2]) else "last",
                         "stack": "term" if part.get("observations_history_priority", "time").value == "term" else "frame"},
             "kp": dict(zip(joints, part["rl_kp"].numbers(count))), "kd": dict(zip(joints, part["rl_kd"].numbers(count))),
             "effort": dict(zip(joints, part["torque_limits"].numbers(count))), "default": dict(zip(joints, default)), "scale": dict(zip(joints, scale))}
    if not even:  # limits of the action, as those of the targets
        for section, bounds in (("lower", low), ("upper", high)):
            found[section] = {joint: pose + bound * factor for joint, pose, bound, factor in zip(joints, default, bounds, scale)}
    return found


def _legged_lab(document):
    """LeggedLabDeploy's config: the standard observation of motors with numbers, whole frames, oldest first."""
    ids = document["joint2motor_idx"].numbers()
    count, joints = len(ids), [f"@{sorted(ids).index(one)}" for one in ids]
    names = ["base_ang_vel", "projected_gravity", "command", "joint_pos", "joint_vel", "actions"]
    terms, gait = Observation(MJLAB), document.get("gait_phase", {})
    scales = {"base_ang_vel": "ang_vel_scale", "joint_pos": "dof_pos_scale", "joint_vel": "dof_vel_scale"}
    for name in names:
        terms.add(name, document["command_scale"].numbers() if name == "command" else [document[scales[name]].number() if name in scales else 1.0])
    if gait.get("enable", False).value is True:
        terms.add("phase")
        terms.clock = {"period": gait["period"].number(), "offsets": [0, gait["offset"].number()]}
    return {"policy": {"model_joints": count, "joints": joints, "step": f"{PHYSICS:g}", "decimation": round(document["control_dt"].positive() / PHYSICS),
                       "clip": 100},
            "observation": terms.keys, "clock": terms.clock, "history": {"frames": document["history_length"].integer()}, "action": {"clip": 100},
            "kp": dict(zip(joints, document["kps"].numbers(count))), "kd": dict(zip(joints, document["kds"].numbers(count))),
            "default": dict(zip(joints, document["default_joint_pos"].numbers(count))), "scale": {".*": document["action_scale"].number()}}


def _legged_rl_deploy(part):
    """Renkunzhao/legged_rl_deploy's config.yaml: as Unitree's deploy.yaml, with gains in the order of the policy."""
    ids = part["joint_ids_map"].numbers()
    count, joints = len(ids), [f"@{sorted(ids).index(one)}" for one in ids]
    action, stack = _only(part["actions"], ("JointPositionAction",)), part["observations"].get("stack", {})
    terms, clock = Observation(LEGGED_RL_DEPLOY), {}
    for name, term in part["observations"]["terms"].items():
        term.value = {} if term.value is None else term.value
        scale = term.get("scale", 1.0)
        terms.add(name, scale.numbers() if isinstance(scale.value, list) else [scale.number()])
        if name == "gait_phase_2":
            clock = {"period": term["params"]["cycle_time"].number()}
    scale = action.get("scale", 1.0)
    found = {"policy": {"model_joints": count, "joints": joints, "step": f"{PHYSICS:g}", "decimation": round(part["policy_dt"].positive() / PHYSICS)},
             "observation": terms.keys, "clock": clock, "default": dict(zip(joints, action["offset"].numbers(count))),
             "history": {"frames": stack.get("length", 1).integer(), "newest": "first" if stack.get("order").value == "newest_first" else "last"},
             "scale": dict(zip(joints, scale.numbers(count) if isinstance(scale.value, list) else [scale.number()] * count)), "action": {"seen": "raw"}}
    for section, key in (("kp", "stiffness"), ("kd", "damping")):
        found[section] = dict(zip(joints, part[key].numbers(count)))
    return found


# ---- Isaac Lab's env.yaml ----
def _isaac(document):
    """Joints are in the order of the simulator, breadth first; where preserve_order is true, in that of the patterns that name them."""
    robot = document["scene"]["robot"]
    action = _only(document["actions"], ("JointPositionAction",))
    listed = action.get("preserve_order", False).value is True
    whole = action.get("use_default_offset", True).value is True
    if not whole and action.get("offset", 0.0).value != 0:
        raise action["offset"].wrong("must be 0 where use_default_offset is not true")
    implicit = False
    tables = {name: {} for name in ("kp", "kd", "effort", "armature")}
    for _, motor in robot["actuators"].items():
        implicit |= str(motor.get("class_type", "").value).endswith("ImplicitActuator")
        for table, keys in (("kp", ("stiffness",)), ("kd", ("damping",)), ("effort", ("effort_limit_sim", "effort_limit")), ("armature", ("armature",))):
            tables[table].update(_of_motor(motor, keys, table))
    found = {"policy": {"joints": action["joint_names"].names(), "order": _order(listed), "step": f"{document['sim']['dt'].positive():g}",
                        "decimation": document["decimation"].integer()},
             "action": {"seen": "raw", "target": "default" if whole else "zero"},
             "actuator": {"kind": "servo" if implicit else "torque"},
             "default": {key: value.number() for key, value in robot["init_state"]["joint_pos"].items()},
             "scale": _by_pattern(action.get("scale", 1.0), action["joint_names"].names()), **tables,
             **_limits(action, action["joint_names"].names())}
    if implicit:
        found["policy"]["integrator"] = "implicitfast"
    group = next((document["observations"][name] for name in ("policy", "actor") if name in document["observations"]), None)
    if group is None:
        raise document["observations"].wrong("has no group 'policy' or 'actor'")
    return _with(found, _isaac_observation(group))


def _order(preserved):
    return "grouped" if preserved else "breadth"


def _isaac_observation(group):
    if group.get("concatenate_terms", True).value is not True:
        raise group["concatenate_terms"].wrong("must be true")
    terms, frames, seen, whole = Observation(ISAAC), [], [], group.get("history_length", 0).integer()
    for name, term in group.items():
        if not isinstance(term.value, dict) or "func" not in term:
            continue
        if term.get("modifiers").value:
            raise term["modifiers"].wrong("cannot be read")
        _no_clip(term)
        function = re.split(r"[:.]", str(term["func"].value))[-1]
        scale = term.get("scale", 1.0)
        terms.add(function, scale.numbers() if isinstance(scale.value, list) else [scale.number()])
        frames.append((term, whole or term.get("history_length", 0).integer()))
        if function.startswith("joint_"):
            of = term.get("params", {}).get("asset_cfg", {})
            joints = of.get("joint_names", ".*").value
            seen.append((term, (joints if isinstance(joints, list) else [joints], _order(of.get("preserve_order", False).value is True))))
        if function == "gait_phase":
            terms.clock = {"period": term["params"]["period"].number()}
    for term, joints in seen:
        if joints != seen[0][1]:
            raise term.wrong("sees other joints than the first term of joints, or in another order")
    return {"policy": dict(zip(("observed", "observed_order"), seen[0][1])) if seen else {}, "observation": terms.keys, "clock": terms.clock,
            "history": {"frames": _one_length(frames), "stack": "term"}}


def _descriptors(document):
    """What Isaac Lab's export_io_descriptors writes: every number by joint."""
    robot, rows = document["articulations"]["robot"], document["actions"]
    if not isinstance(rows.value, list) or len(rows.value) != 1:
        raise rows.wrong("must be a list of one action")
    action = Part(rows.value[0], document.file, "actions[0]")
    _of_kind(action, action["full_path"], ("JointPositionAction",))
    names, moved = robot["joint_names"].names(), action["joint_names"].names()
    scale, count = action.get("scale", 1.0), len(names)
    default = dict(zip(names, robot["default_joint_pos"].numbers(count)))
    rows, terms, frames, seen = document["observations"]["policy"], Observation(ISAAC), [], []
    for k, row in enumerate(rows.list()):
        term = Part(row, document.file, f"{rows.key}[{k}]")
        form = term.get("overloads", {})
        factor = form.get("scale", 1.0)
        terms.add(str(term["full_path"].value).split(".")[-1], factor.numbers() if isinstance(factor.value, list) else [factor.number()])
        frames.append((term, form.get("history_length", 0).integer()))
        if "joint_names" in term:
            seen.append((term, term["joint_names"].names()))
            if seen[-1][1] != seen[0][1]:
                raise term.wrong("sees other joints than the first term of joints")
    found = {"policy": {"joints": moved, "observed": seen[0][1] if seen else moved, "step": f"{document['scene']['physics_dt'].positive():g}",
                        "decimation": document["scene"]["decimation"].integer(), "integrator": "implicitfast"},
             "action": {"seen": "raw", "target": _target(action, [default.get(name, 0.0) for name in moved])}, "actuator": {"kind": "servo"},
             "observation": terms.keys, "history": {"frames": _one_length(frames), "stack": "term"}, "default": default,
             "scale": dict(zip(moved, scale.numbers(len(moved)) if isinstance(scale.value, list) else [scale.number()] * len(moved)))}
    for section, key in (("kp", "default_joint_stiffness"), ("kd", "default_joint_damping"), ("armature", "default_joint_armature")):
        found[section] = dict(zip(names, robot[key].numbers(count)))
    return found | _limits(action, moved)


def _of_motor(motor, keys, table):
    """{pattern: number} of one key of a group of actuators. Gains that are null are those of the simulator's own file, which is not here: nan."""
    joints = motor["joint_names_expr"].names()
    part = next((motor.get(key) for key in keys if key in motor), None)
    if part is not None:
        return _by_pattern(part, joints)
    return {pattern: math.nan for pattern in joints} if table in ("kp", "kd") else {}


def _by_pattern(part, joints):
    """{pattern: number} of a number for all of these joints, or of a table of patterns that hold for them alone."""
    if not isinstance(part.value, dict):
        return dict.fromkeys(joints, part.number())
    alone = f"(?=(?:{'|'.join(joints)})$)"
    return {key if key in joints else f"{alone}(?:{key})": value.number() for key, value in part.items()}


def _with(found, more):
    for section, keys in more.items():
        found[section] = {**found.get(section, {}), **keys}
    return found


# ---- metadata of ONNX files ----
def _mjlab(about, width):
    """mjlab's step, decisions and actuators are those of its velocity tasks, the layout mjlab; how many frames it sees is found from the input."""
    joints = about["joint_names"].names()
    moved = about["action_joint_names"].names() if "action_joint_names" in about else joints  # of mild's own, where others are driven
    scale = about["action_scale"].numbers()
    if len(scale) not in (1, len(moved)):
        raise about["action_scale"].wrong(f"has {len(scale)} values, and there are {len(moved)} joints, so that it is not known which it moves")
    terms = Observation(MJLAB)
    for name in about["observation_names"].names():
        terms.add(name)
    found = {"policy": {"layout": "mjlab", "joints": moved, **({"observed": joints} if moved is not joints else {})}, "observation": terms.keys,
             "history": {"frames": 0, "stack": "term"}, "scale": dict(zip(moved, scale * len(moved) if len(scale) == 1 else scale))}
    for section, key in (("kp", "joint_stiffness"), ("kd", "joint_damping"), ("default", "default_joint_pos")):
        found[section] = dict(zip(joints, about[key].numbers(len(joints))))
    if "phase_sin" in terms.keys:  # the metadata have no period
        found["clock"] = {"period": math.nan, "standing": 0.1}
    return found


def _holosoma(about, width):
    """Its program sorts the observation by name. Files without experiment_config lack the pose and the observation."""
    joints = about["dof_names"].json().names()
    found = {"policy": {"joints": joints, "step": 0.005, "decimation": 4, "integrator": "implicitfast"}, "actuator": {"kind": "servo"},
             "kp": dict(zip(joints, about["kp"].json().numbers(len(joints)))), "kd": dict(zip(joints, about["kd"].json().numbers(len(joints)))),
             "default": {".*": math.nan}}
    if "experiment_config" not in about:
        return found
    config = about["experiment_config"].json()
    robot, group, sim = config["robot"], config["observation"]["groups"]["actor_obs"], config["simulator"]["config"]["sim"]
    terms = Observation(HOLOSOMA)
    for name, term in sorted(group["terms"].items()):
        terms.add(name, [term.get("scale", 1.0).number()])
    control, action = robot["control"], _only(config["action"]["terms"], ("joint_control",))
    if control.get("action_scales_by_effort_limit_over_p_gain", False).value:
        raise control["action_scales_by_effort_limit_over_p_gain"].wrong("must be false")
    gait = config["command"]["setup_terms"].get("locomotion_gait", {}).get("params", {})
    return _with(found, {
        "policy": {"step": f"{1 / sim['fps'].positive():g}", "decimation": sim["control_decimation"].integer()},
        "default": {name: value.number() for name, value in robot["init_state"]["default_joint_angles"].items()},
        "scale": {".*": control["action_scale"].number() * action.get("scale", 1.0).number()}, "observation": terms.keys,
        "effort": dict(zip(joints, robot["dof_effort_limit_list"].numbers(len(joints)))),
        "armature": dict(zip(joints, robot["dof_armature_list"].numbers(len(joints)))),
        "action": {"clip": control.get("action_clip_value", math.inf).number()},
        "history": {"frames": group.get("history_length", 1).integer(), "stack": "term"},
        "clock": {"period": gait.get("gait_period", 1.0).number(), "offsets": [0, 0.5], "standing": 0.01, "standing_phase": 0.5}})

