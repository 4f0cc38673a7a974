"""A robot of any MJCF on a ground for mild.trial: its feet found, its actuators as the description says, compiled."""
import dataclasses
import pathlib
import re

import numpy as np

from .describe import TABLES, by_joint, choose
from .spec import MOST, attach, floors, planes

SOLE = 0.01  # [m] shapes within this of the lowest point of a foot are its sole, as in the plugin
COLORS = {"sandy_loam": (0.55, 0.43, 0.30), "sand": (0.80, 0.68, 0.48), "dry_sand": (0.80, 0.68, 0.48), "grass": (0.42, 0.55, 0.30),
          "foam": (0.55, 0.62, 0.72), "rubber": (0.35, 0.35, 0.38), "clay": (0.55, 0.38, 0.30), "snow": (0.93, 0.95, 0.98),
          "lunar": (0.5, 0.5, 0.5)}  # of presets, by how their names begin
NARROW = 1e-4  # [m^2] below this shapes have no sole
ROUND = 0.01  # [m] the smallest sphere that is a round foot and no corner of a sole


def read_spec(model):
    """A mujoco.MjSpec from a file, XML text, or a MjSpec, which is copied. Meshes whose files are not there are left out where
    they carry no mass; what was left out, as a line or ''."""
    import mujoco

    if isinstance(model, mujoco.MjSpec):
        return model.copy(), ""
    text = str(model)
    if text.lstrip().startswith("<"):
        return mujoco.MjSpec.from_string(text), ""
    path = pathlib.Path(text)
    if not path.is_file():
        raise ValueError(f"model: there is no file '{text}'")
    try:
        spec, remark = mujoco.MjSpec.from_file(text), ""
    except ValueError as error:
        spec, remark = _older(path, str(error))
    return spec, "; ".join(filter(None, (remark, _leave_out(spec, path.parent))))


def _older(path, error):
    """A file with attributes that MuJoCo knew once, without them."""
    import mujoco

    text, gone = path.read_text(), []
    while True:
        found = re.search(r"unrecognized attribute: '(\w+)'", error)
        if not found or found[1] in gone:
            raise ValueError(f"model: {' '.join(error.split())}")
        gone.append(found[1])
        text = re.sub(rf"\s{found[1]}\s*=\s*(\"[^\"]*\"|'[^']*')", "", text)
        try:
            spec = mujoco.MjSpec.from_string(text)
        except ValueError as next_error:
            error = str(next_error)
            continue
        spec.meshdir, spec.texturedir = str(path.parent / spec.meshdir), str(path.parent / spec.texturedir)
        return spec, f"attributes that MuJoCo no longer knows are left out: {', '.join(gone)}"


def _leave_out(spec, folder):
    """Deletes meshes without a file. A body whose mass they would make is refused."""
    gone, inferred = [], []
    for mesh in list(spec.meshes):
        if mesh.file and not any((place / mesh.file).is_file() for place in (folder / spec.meshdir, folder, pathlib.Path(spec.meshdir))):
            gone.append(mesh)
    names = {mesh.name or pathlib.Path(mesh.file).stem for mesh in gone}
    for geom in list(spec.geoms) if gone else ():
        if geom.meshname in names:
            if geom.parent != spec.worldbody and not geom.parent.explicitinertial and geom.mass != 0:
                inferred.append(geom.parent.name)
            spec.delete(geom)
    if inferred:
        raise ValueError(f"model: the mass of {', '.join(sorted(set(inferred)))} is that of meshes whose files are not there: "
                         f"{', '.join(sorted(names))}")
    for mesh in gone:
        spec.delete(mesh)
    return f"{len(gone)} meshes whose files are not there are left out" if gone else ""


@dataclasses.dataclass
class Feet:
    """What of a robot meets soft ground."""
    names: list  # of bodies or sites, z up from the sole
    bodies: list  # names of others that meet it on any side
    soles: list  # names of geoms
    outlines: list  # [m] (n, 2), of each foot


@dataclasses.dataclass
class Robot:
    """A compiled model and where its parts are. Arrays are in the order of the policy but where they say otherwise."""
    model: object
    joints: list  # names of those that the policy moves
    held: list  # names of those that it does not
    qpos: np.ndarray  # addresses of joints, then of held ones
    qvel: np.ndarray
    seen: tuple  # (qpos, qvel) addresses of the observed joints
    seen_default: np.ndarray
    kp: np.ndarray  # of joints, then of held ones, as the rest
    kd: np.ndarray
    default: np.ndarray
    effort: np.ndarray
    scale: np.ndarray  # of joints
    lower: np.ndarray  # [rad] limits of their targets
    upper: np.ndarray
    drive: np.ndarray  # actuator of each, -1: none
    gear: np.ndarray  # [N m] of an actuator's ctrl of 1
    base: int  # body
    place: int  # address of its place and rotation in qpos
    zero: float  # [m] height at which that place is 0
    frame: tuple  # (mjtObj, id)
    feet: Feet
    soles: list  # geoms of feet.soles
    start: np.ndarray  # qpos
    mass: float
    remark: str = ""


def joint_names(model):
    """Names of hinges and slides in the order of the model, but for those of the floating base."""
    import mujoco

    kinds, base = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)), floating(model)[0]
    return [model.joint(j).name for j in range(model.njnt) if model.jnt_type[j] in kinds and model.jnt_bodyid[j] != base]


def breadth(model):
    """Numbers of the joints of joint_names by depth in the tree of joints, those of one parent in the order of the model. Joints of one body
    follow each other, as in a URDF, where each has a link."""
    names, last, children = joint_names(model), {0: -1}, {}  # last: of each body, its last joint
    numbers = {model.joint(name).id: k for k, name in enumerate(names)}
    for body in range(1, model.nbody):
        last[body] = last[int(model.body_parentid[body])]
        for joint in range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body]):
            if joint in numbers:
                children.setdefault(last[body], []).append(numbers[joint])
                last[body] = numbers[joint]
    level, order = [-1], []
    while level:
        level = [child for one in level for child in children.get(one, ())]
        order += level
    return order


def numbered(model, description):
    """Numbers @k of the joints of joint_names, those of their motors where each has one, as robots' programs count; else their own order.
    Raises ValueError where numbers are used and only some joints have motors, in another order."""
    import mujoco

    names = joint_names(model)
    motors = [model.joint(model.actuator_trnid[a][0]).name for a in range(model.nu) if model.actuator_trntype[a] == int(mujoco.mjtTrn.mjTRN_JOINT)]
    motors = [name for name in motors if name in names]
    if sorted(motors) == sorted(names):
        return [motors.index(name) for name in names]
    patterns = [*(description.policy["joints"] or ()), *(description.policy["observed"] or ()),
                *(pattern.pattern for table in TABLES for pattern, _ in getattr(description, table))]
    if motors != [name for name in names if name in motors] and any(pattern.startswith("@") for pattern in patterns):
        raise ValueError(f"model: its joints are {', '.join(names)}, and its actuators those of {', '.join(motors)}, so that numbers of joints "
                         "(@0) may mean either; name the joints in an ini")
    return list(range(len(names)))


def _ordered(patterns, names, key, tree, order, numbers):
    """Indices of the joints that patterns name, in an order of policy.order."""
    chosen = choose(patterns, names, key, numbers)
    if order == "breadth":
        return [j for j in tree if j in chosen]
    if order == "grouped":
        groups = [choose([pattern], names, key, numbers) for pattern in patterns or [".*"]]
        return sorted(chosen, key=lambda j: (next(k for k, group in enumerate(groups) if j in group), tree.index(j)))
    return chosen


def _world(model, description, ground, painted):
    """The spec on a level floor, with the step and the integrator of the description, and what was left out."""
    import mujoco

    spec, remark = read_spec(model)
    if description.policy["step"]:
        spec.option.timestep = description.policy["step"]
    if description.policy["integrator"]:
        spec.option.integrator = getattr(mujoco.mjtIntegrator, "mjINT_" + description.policy["integrator"].upper())
    remark = "; ".join(filter(None, (remark, _clear(spec))))
    if not planes(spec):
        spec.worldbody.add_geom(name="floor_of_trial", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.05], rgba=[0.6, 0.6, 0.6, 1])
    if painted:
        _paint(spec, ground)
    return spec, remark


def stand(model, description, ground, attributes, painted=False):
    """The Robot on a ground: "rigid" is MuJoCo's own floor, that of the file if it has one. painted: for pictures, the floor has the ground's
    colour, and soft ground is dented."""
    d = description
    spec, remark = _world(model, d, ground, painted)
    if spec.compiler.fusestatic:
        spec.compile()  # fuses, so that bodies and shapes of the spec are numbered as the model's
    bare = spec.copy().compile()
    names = joint_names(bare)
    if d.policy["model_joints"] not in (0, len(names)):
        raise ValueError(f"model: it has {len(names)} joints, and {d.name} {d.policy['model_joints']}, by number; give the model that its "
                         "maker runs, or name policy.joints, policy.observed, kp, kd, default and scale in an ini")
    numbers, tree = numbered(bare, d), breadth(bare)
    order = _ordered(d.policy["joints"], names, "joints", tree, d.policy["order"], numbers)
    seen = _ordered(d.policy["observed"] or d.policy["joints"], names, "observed", tree, d.policy["observed_order"] or d.policy["order"], numbers)
    count = len(order)
    order += [j for j in range(len(names)) if j not in order]
    tables = {name: by_joint(getattr(d, name), names, otherwise, name, numbers)
              for name, otherwise in (("kp", 0.0), ("kd", 0.0), ("default", 0.0), ("effort", np.inf), ("armature", -1.0),
                                ("lower", -np.inf), ("upper", np.inf))}
    scale = by_joint(d.scale, names, 1.0, "scale", numbers)[order[:count]]
    if ground == "rigid" and not any(bare.geom_contype[geom] or bare.geom_conaffinity[geom] or bare.npair for geom in solids(bare)):
        raise ValueError("model: no shape of the robot collides (contype, conaffinity), so that it would fall through the rigid floor; "
                         "take its maker's MJCF, or `mild eval --robot` for a robot of mild")
    start = _start(bare, d, names, tables["default"])
    if d.start["keyframe"] and not d.default:  # its angles are the default ones
        tables["default"] = np.array([start[bare.joint(name).qposadr[0]] for name in names])
    feet = _feet(spec, bare, start, d)
    for name, armature in zip(names, tables["armature"]):
        if armature >= 0:
            spec.joint(name).armature = armature
    _actuate(spec, bare, d, names, tables)
    if ground != "rigid":
        _unpair(spec, feet.names + feet.bodies)
        _undress(spec, feet.bodies)
        attach(spec, feet.names, ground, body=feet.bodies, surface=painted, sensor="feet_of_trial", name="ground_of_trial",
               **{"sole": " ".join(feet.soles), **attributes})
    compiled = spec.compile()
    drive, gear = _drives(compiled, [names[j] for j in order])
    without = [names[order[i]] for i in np.flatnonzero(drive[:count] < 0)]
    if without:
        raise ValueError(f"actuator.kind: model has no actuator for {', '.join(without)}")
    ids = [compiled.joint(name).id for name in names]
    qpos, qvel = compiled.jnt_qposadr[ids], compiled.jnt_dofadr[ids]
    base, place, zero = floating(compiled)
    return Robot(compiled, [names[j] for j in order[:count]], [names[j] for j in order[count:]], qpos[order], qvel[order],
                 (qpos[seen], qvel[seen]), tables["default"][seen], tables["kp"][order], tables["kd"][order], tables["default"][order],
                 tables["effort"][order], scale,
                 tables["lower"][order[:count]], tables["upper"][order[:count]], drive, gear, base, place, zero, _frame(compiled, d, base), feet,
                 [compiled.geom(name).id for name in feet.soles], start,
                 float(compiled.body_subtreemass[base]), remark)


def _clear(spec):
    """Deletes what stands in the world beside planes, such as stairs and height fields: the ground of a trial is level. What went, as a line."""
    import mujoco

    bodies, gone = [spec.worldbody], 0
    while bodies:
        body = bodies.pop()
        bodies += [child for child in body.bodies if not child.joints and not child.mocap]
        for geom in list(body.geoms):
            if geom.type != mujoco.mjtGeom.mjGEOM_PLANE and (geom.contype or geom.conaffinity):
                spec.delete(geom)
                gone += 1
    return f"{gone} obstacles of the world are left out" if gone else ""


def _paint(spec, ground):
    """Gives the floor the ground's colour, in squares that show the way, under a bright sky."""
    import mujoco

    color = np.array(next((rgb for name, rgb in COLORS.items() if ground.startswith(name)), (0.6, 0.6, 0.62)))
    squares = spec.add_texture(name="floor_of_trial", type=mujoco.mjtTexture.mjTEXTURE_2D, builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
                               width=256, height=256, rgb1=color, rgb2=0.93 * color)
    paint = spec.add_material(name="floor_of_trial", texrepeat=[2, 2], texuniform=True, reflectance=0, specular=0)
    paint.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = squares.name
    for geom in planes(spec):
        geom.material, geom.rgba = paint.name, [1, 1, 1, 1]
    for texture in list(spec.textures):
        if texture.type == mujoco.mjtTexture.mjTEXTURE_SKYBOX:
            spec.delete(texture)
    spec.visual.rgba.haze, spec.visual.headlight.ambient = [0.95, 0.97, 1, 1], [0.3] * 3
    spec.add_texture(name="sky_of_trial", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
                     width=64, height=64, rgb1=[0.75, 0.85, 0.95], rgb2=[0.95, 0.97, 1])
    if not spec.worldbody.lights:
        spec.worldbody.add_light(pos=[0, 0, 4], dir=[0.2, 0.3, -1], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)


def floating(model):
    """The body that floats, the address of its place in qpos, and the height at which that place is 0. It floats on a free joint, or on
    three slides and a ball, whose coordinates are those of a free joint."""
    import mujoco

    free, slide, ball = (int(kind) for kind in (mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_BALL))
    for body in range(1, model.nbody):
        first, kinds = model.body_jntadr[body], model.jnt_type[model.body_jntadr[body] :][: model.body_jntnum[body]].tolist()
        if kinds == [free]:
            return body, int(model.jnt_qposadr[first]), 0.0
        if kinds == [slide, slide, slide, ball] and (model.jnt_axis[first : first + 3] == np.eye(3)).all():
            return body, int(model.jnt_qposadr[first]), float(model.body_pos[body][2])
    raise ValueError("model: no body has a free joint, or three slides along x, y, z and a ball")


def _frame(model, description, base):
    import mujoco

    name = description.policy["frame"]
    for kind in (mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_XBODY):
        index = mujoco.mj_name2id(model, kind, name) if name else -1
        if index >= 0:
            return kind, index
    if name:
        raise ValueError(f"policy.frame: the model has no site or body '{name}'")
    return mujoco.mjtObj.mjOBJ_XBODY, base


def _start(model, description, names, default):
    """qpos of the start, with the lowest point of the robot at 0."""
    import mujoco

    data = mujoco.MjData(model)
    key = description.start["keyframe"]
    if key:
        index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, key)
        if index < 0:
            raise ValueError(f"start.keyframe: the model has no keyframe '{key}'")
        mujoco.mj_resetDataKeyframe(model, data, index)
    else:
        for name, value in zip(names, default):
            data.joint(name).qpos = value
    place = floating(model)[1]
    mujoco.mj_kinematics(model, data)
    data.qpos[place + 2] -= min(lowest(model, data, geom) for geom in solids(model))
    return data.qpos.copy()


def solids(model):
    """Geoms of the robot that collide, by their type of contact or by a pair; all of them where none does."""
    own = [geom for geom in range(model.ngeom) if model.body_weldid[model.geom_bodyid[geom]]]
    pairs = {*model.pair_geom1.tolist(), *model.pair_geom2.tolist()}
    found = [geom for geom in own if model.geom_contype[geom] or model.geom_conaffinity[geom] or geom in pairs]
    if not own:
        raise ValueError("model: the robot has no shape")
    return found or own


def lowest(model, data, geom):
    """[m] height of the lowest point of a geom."""
    import mujoco

    kind, size, down = mujoco.mjtGeom(model.geom_type[geom]), model.geom_size[geom], data.geom_xmat[geom].reshape(3, 3)[2]
    kinds, z = mujoco.mjtGeom, data.geom_xpos[geom][2]
    if kind == kinds.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        return z + float((model.mesh_vert[first : first + count] @ down).min())
    if kind == kinds.mjGEOM_SPHERE:
        return z - size[0]
    if kind == kinds.mjGEOM_CAPSULE:
        return z - size[0] - size[1] * abs(down[2])
    if kind == kinds.mjGEOM_CYLINDER:
        return z - size[0] * np.hypot(down[0], down[1]) - size[1] * abs(down[2])
    if kind == kinds.mjGEOM_ELLIPSOID:
        return z - float(np.linalg.norm(size * down))
    return z - float(np.abs(size * down).sum())


def _feet(spec, model, start, description):
    """The Feet. Bodies and geoms that have no name get one."""
    import mujoco

    data = mujoco.MjData(model)
    data.qpos[:] = start
    mujoco.mj_kinematics(model, data)
    shapes = {}  # body: [(lowest point, geom)]
    for geom in solids(model):
        shapes.setdefault(int(model.geom_bodyid[geom]), []).append((lowest(model, data, geom), geom))
    low = {body: min(own)[0] for body, own in shapes.items()}
    given = description.feet["names"]
    if given:
        feet = [_body_of(model, name) for name in given]
    else:
        feet = [body for body in sorted(low) if low[body] < min(low.values()) + 0.03]
        feet = [body for body in feet if not any(body in parents(model, other) for other in feet)]
    names, soles, outlines = [], [], []
    for k, body in enumerate(feet):
        if body not in shapes:
            raise ValueError(f"feet.names: '{given[k]}' has no shape that collides")
        bottom = sorted(geom for depth, geom in shapes[body] if depth < low[body] + SOLE)
        ball = len(bottom) == 1 and model.geom_type[bottom[0]] == int(mujoco.mjtGeom.mjGEOM_SPHERE) and model.geom_size[bottom[0]][0] >= ROUND
        geoms = bottom if ball else [geom for _, geom in shapes[body]]
        if not ball and (description.feet["sole"] == ["all"] or area(_outline(model, data, geoms, _up(model, data, body, geoms))) < NARROW):
            geoms = [geom for geom in range(model.ngeom) if model.geom_bodyid[geom] == body]
        soles += [_name(spec.geoms[geom], f"sole_of_trial_{geom}") for geom in geoms]
        name, outline = _round(spec, model, body, geoms[0]) if ball else _flat(spec, model, data, body, geoms)
        names.append(given[k] if given else name)
        outlines.append(outline)
    half = 0.5 * data.xpos[floating(model)[0]][2]
    others = sorted((low[body], body) for body in low if body not in feet and low[body] < half)
    bodies = [_name(spec.bodies[body], f"body_of_trial_{body}") for _, body in others[: MOST - len(feet)]]
    wanted = description.feet["bodies"]
    sole = description.feet["sole"]
    return Feet(names, ([] if wanted == ["-"] else wanted) if wanted is not None else bodies, soles if sole in (None, ["all"]) else sole, outlines)


def _body_of(model, name):
    import mujoco

    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name)
    if body < 0 and site < 0:
        raise ValueError(f"feet.names: the model has no body or site '{name}'")
    return body if body >= 0 else int(model.site_bodyid[site])


def parents(model, body):
    found = []
    while body:
        body = int(model.body_parentid[body])
        found.append(body)
    return found


def _name(element, otherwise):
    if not element.name:
        element.name = otherwise
    return element.name


def _up(model, data, body, geoms):
    """Up from the sole [world]: of the axes of the body, those of its boxes, and the vertical at the start, the direction across which the
    sole is largest."""
    import mujoco

    boxes = [data.geom_xmat[g].reshape(3, 3).T for g in geoms if model.geom_type[g] == int(mujoco.mjtGeom.mjGEOM_BOX)]
    axes = np.vstack([data.xmat[body].reshape(3, 3).T, *boxes, np.array([[0, 0, 1.0]])])
    ways = [np.sign(way[2]) * way for way in axes if abs(way[2]) > 0.7]
    return max(ways, key=lambda way: round(area(_outline(model, data, geoms, way)), 6))


def _flat(spec, model, data, body, geoms):
    """The name and the outline of a flat foot: the body where its z axis points up from the sole, or a site on it."""
    import mujoco

    way, element = _up(model, data, body, geoms), spec.bodies[body]
    name, outline = _name(element, f"foot_of_trial_{body}"), _outline(model, data, geoms, way)
    if area(outline) < NARROW:
        raise ValueError(f"feet: the shapes of '{name}' have no flat side below; name its sole in feet.sole")
    up = data.xmat[body].reshape(3, 3).T @ way
    if up[2] > 0.9999:
        return name, outline
    quat = np.zeros(4)
    mujoco.mju_quatZ2Vec(quat, up)
    return element.add_site(name=f"foot_of_trial_{body}_up", pos=[0, 0, 0], quat=quat).name, outline


def _round(spec, model, body, geom):
    """The same of a round foot, a sphere."""
    angle = 2 * np.pi * np.arange(32) / 32
    return _name(spec.bodies[body], f"foot_of_trial_{body}"), model.geom_size[geom][0] * np.column_stack([np.cos(angle), np.sin(angle)])


def _points(model, data, geom, up):
    """Points of a geom (n, 3) [m], world, among which are its lowest along -up."""
    import mujoco

    kind, size, turn, place = mujoco.mjtGeom(model.geom_type[geom]), model.geom_size[geom], data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
    kinds, angle = mujoco.mjtGeom, 2 * np.pi * np.arange(16) / 16
    if kind == kinds.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        return place + model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]] @ turn.T
    if kind == kinds.mjGEOM_BOX:
        return place + (np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T * size) @ turn.T
    if kind in (kinds.mjGEOM_SPHERE, kinds.mjGEOM_CAPSULE):
        ends = place + (np.array([[0, 0, -1.0], [0, 0, 1.0]]) * (size[1] if kind == kinds.mjGEOM_CAPSULE else 0)) @ turn.T
        high = min(0.999 * SOLE, size[0])  # a ring of the ball as high above its lowest point
        side = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
        ring = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * np.cross(up, side)
        ring *= np.sqrt(high * (2 * size[0] - high)) / np.linalg.norm(side)
        return np.vstack([[end - size[0] * up, *(end + ring - (size[0] - high) * up)] for end in ends])
    rim = np.column_stack([size[0] * np.cos(angle), size[0 if kind == kinds.mjGEOM_CYLINDER else 1] * np.sin(angle), 0 * angle])
    if kind == kinds.mjGEOM_CYLINDER:
        return place + np.vstack([rim + [0, 0, size[1]], rim - [0, 0, size[1]]]) @ turn.T
    return place + np.vstack([rim, np.diag(size), -np.diag(size)]) @ turn.T


def _outline(model, data, geoms, up):
    """Corners [m] (n, 2) of the convex hull, seen along up, of what lies within SOLE of the lowest point."""
    points = np.vstack([_points(model, data, geom, up) for geom in geoms])
    height = points @ up
    points = points[height < height.min() + SOLE]
    side = np.cross(up, [1.0, 0, 0] if abs(up[0]) < 0.5 else [0, 1.0, 0])
    side /= np.linalg.norm(side)
    flat = sorted({(round(x, 6), round(y, 6)) for x, y in zip(points @ side, points @ np.cross(up, side))})
    hull = []
    for line in (flat, flat[::-1]):
        first = len(hull)
        for point in line:
            while len(hull) - first >= 2 and (hull[-1][0] - hull[-2][0]) * (point[1] - hull[-2][1]) <= \
                    (hull[-1][1] - hull[-2][1]) * (point[0] - hull[-2][0]):
                hull.pop()
            hull.append(point)
        hull.pop()
    return np.array(hull).reshape(-1, 2)


def area(outline):
    """[m^2] of a polygon."""
    x, y = outline.T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) if len(outline) > 2 else 0.0


def _unpair(spec, names):
    """Deletes pairs of geoms of these bodies with floors: exclusions do not hold for pairs."""
    bodies = {(spec.body(name) or spec.site(name).parent).name for name in names}
    owner = {geom.name: geom.parent.name for geom in spec.geoms if geom.name}
    grounds = floors(spec)
    for pair in list(spec.pairs):
        ends = {owner.get(pair.geomname1), owner.get(pair.geomname2)}
        if ends & grounds and ends & bodies:
            spec.delete(pair)


def _undress(spec, names):
    """Moves what only looks, of bodies that have a shape that collides, to bodies of its own: the plugin would take meshes that
    collide and those that look for one solid, which they are not where they coincide."""
    for name in names:
        body = spec.body(name)
        looks = [geom for geom in body.geoms if not geom.contype and not geom.conaffinity]
        if not looks or len(looks) == len(body.geoms) or (not body.explicitinertial and any(geom.density and geom.mass != 0 for geom in looks)):
            continue
        child = body.add_body(name=f"{name}_looks_of_trial")
        for geom in looks:
            child.add_geom(type=geom.type, meshname=geom.meshname, size=geom.size, pos=geom.pos, quat=geom.quat, rgba=geom.rgba,
                           material=geom.material, group=geom.group, contype=0, conaffinity=0, mass=0)
            spec.delete(geom)


def _actuate(spec, model, description, names, tables):
    """Motors without a law for torque, position actuators for servo; the model's own for model."""
    import mujoco

    kind = description.actuator["kind"]
    if kind == "model":
        return
    plain = {}  # joints with a motor of their own
    for a in range(model.nu):
        joint = model.joint(model.actuator_trnid[a][0]).name if model.actuator_trntype[a] == int(mujoco.mjtTrn.mjTRN_JOINT) else ""
        if (kind == "torque" and joint in names and model.actuator_gaintype[a] == int(mujoco.mjtGain.mjGAIN_FIXED)
                and model.actuator_biastype[a] == int(mujoco.mjtBias.mjBIAS_NONE) and model.actuator_dyntype[a] == int(mujoco.mjtDyn.mjDYN_NONE)):
            plain[a] = joint
    for a, actuator in reversed(list(enumerate(spec.actuators))):
        if a not in plain:
            for sensor in [one for one in spec.sensors if one.objname == actuator.name and actuator.name]:
                spec.delete(sensor)
            spec.delete(actuator)
    if len(plain) < model.nu:
        for key in list(spec.keys):
            key.ctrl = []
    for k, name in enumerate(names):
        if name in plain.values():
            continue
        motor = spec.add_actuator(name=f"{kind}_of_trial_{k}", target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        if np.isfinite(tables["effort"][k]):
            motor.forcelimited, motor.forcerange = mujoco.mjtLimited.mjLIMITED_TRUE, [-tables["effort"][k], tables["effort"][k]]
        if kind == "servo":
            motor.set_to_position(kp=tables["kp"][k], kv=tables["kd"][k])


def _drives(model, names):
    """For each joint its actuator, -1 without one, and the force of ctrl 1."""
    import mujoco

    drive, gear = np.full(len(names), -1), np.ones(len(names))
    for a in range(model.nu):
        if model.actuator_trntype[a] == int(mujoco.mjtTrn.mjTRN_JOINT):
            joint = model.joint(model.actuator_trnid[a][0]).name
            if joint in names:
                drive[names.index(joint)] = a
                gear[names.index(joint)] = model.actuator_gear[a][0] * model.actuator_gainprm[a][0]
    return drive, gear
