"""Feet of a mujoco.MjModel: their frames, and the soles that their geoms give, as in the engine plugin."""
import re

import mujoco
import numpy as np

from . import Sole

CIRCLE = (np.arange(32) + 0.5) * np.pi / 16  # corners of a round outline
BAND = 0.01  # [m] what lies higher above the lowest point is not the sole
PLANE, HFIELD, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX, MESH = (
    int(getattr(mujoco.mjtGeom, "mjGEOM_" + name)) for name in ("PLANE", "HFIELD", "SPHERE", "CAPSULE", "ELLIPSOID", "CYLINDER", "BOX", "MESH"))


def find(table, name):
    try:
        return table(name)
    except KeyError:
        return None


def feet_of(model, names, soles=None):
    """Bodies, axes, soles, radii (0: not round) and origins of feet, five tuples. soles: as of mild.warp.Ground."""
    frames = [frame_of(model, name) for name in names]
    made = list(soles) if soles is not None and not isinstance(soles, str) else [
        sole_of(model, name, frame, soles, site=find(model.site, name) is not None) for name, frame in zip(names, frames)]
    made = [one if isinstance(one, tuple) else (one, 0, frame[1]) for one, frame in zip(made, frames)]
    if not frames or len(made) != len(frames):
        raise ValueError(f"soles: {len(made)} for {len(frames)} feet")
    return tuple(list(part) for part in zip(*[(body, axes, *one) for (body, _, axes), one in zip(frames, made)]))


def frame_of(model, name):
    """Body, origin and axes of a foot in the frame of its body."""
    body, site = find(model.body, name), find(model.site, name)
    if body is not None:
        if model.body_weldid[body.id] == 0:
            raise ValueError(f"feet: body '{name}' is fixed to the world; it must move")
        return body.id, np.zeros(3), np.eye(3)
    if site is None:
        raise ValueError(f"feet: the model has no body or site '{name}'")
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, site.quat)
    return int(model.site_bodyid[site.id]), np.array(site.pos), axes.reshape(3, 3)


def sole_of(model, name, frame, soles, site):
    """Sole, radius and centre of a foot: of a single sphere, a disc; else the hull of what lies lowest, as in the engine plugin."""
    body, origin, axes = frame
    mine = [g for g in range(model.ngeom) if model.geom_bodyid[g] == body]
    if soles is not None:
        mine = [g for g in mine if re.fullmatch(soles, model.geom(g).name)]
        if not mine:
            raise ValueError(f"soles: no geom on the body of '{name}' is named '{soles}'")
    elif any(model.geom_type[g] != MESH for g in mine):
        mine = [g for g in mine if model.geom_type[g] != MESH]
    if len(mine) == 1 and model.geom_type[mine[0]] == SPHERE and not site:
        radius = float(model.geom_size[mine[0], 0])
        reach = radius * np.sqrt(np.pi / (16 * np.sin(np.pi / 16)))  # a polygon of the disc's area
        return Sole(reach * np.stack([np.cos(CIRCLE), np.sin(CIRCLE)], 1)), radius, model.geom_pos[mine[0]]
    cloud = np.concatenate([points_of(model, g, origin, axes) for g in mine] + [np.zeros((0, 3))])
    lowest = cloud[:, 2].min(initial=np.inf)
    outline = hull(cloud[cloud[:, 2] <= lowest + BAND, :2])
    if len(outline) < 3:
        raise ValueError(f"feet: the body of '{name}' has no geom with a flat outline; give soles=[mild.Sole(...), ...]")
    return Sole(outline, sole_z=float(lowest)), 0, origin


def points_of(model, geom, origin, axes):
    """Points on the surface of a geom, in the frame of the foot."""
    kind, size, turn = model.geom_type[geom], model.geom_size[geom], np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])

    def placed(local):
        return ((np.reshape(local, (-1, 3)) @ turn.reshape(3, 3).T + model.geom_pos[geom]) - origin) @ axes

    if kind in (SPHERE, CAPSULE):  # a ball's widest circle, at the height of its lowest point
        ends = placed([[0, 0, z] for z in ((size[1], -size[1]) if kind == CAPSULE else (0,))])
        around = np.stack([np.cos(CIRCLE), np.sin(CIRCLE), -np.ones(32)], 1) * size[0]
        return (ends[:, None] + around).reshape(-1, 3)
    if kind == BOX:
        return placed([[x * size[0], y * size[1], z * size[2]] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    if kind == CYLINDER:
        return placed([[size[0] * np.cos(a), size[0] * np.sin(a), z] for z in (-size[1], size[1]) for a in CIRCLE])
    if kind == ELLIPSOID:
        up = np.cos(CIRCLE[:, None] / 2)
        rings = np.sqrt(1 - up * up)
        return placed(np.stack([rings * np.cos(CIRCLE) * size[0], rings * np.sin(CIRCLE) * size[1], up * size[2] + 0 * CIRCLE], -1))
    if kind == MESH:
        mesh = model.geom_dataid[geom]
        return placed(model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]])
    return np.zeros((0, 3))


def hull(points):
    """Corners of the convex hull (monotone chain)."""
    points, corners = sorted(set(map(tuple, points))), []
    for some in (points, points[::-1]):
        start = len(corners)
        for p in some:
            while len(corners) >= start + 2 and cross(corners[-2], corners[-1], p) <= 0:
                corners.pop()
            corners.append(p)
        corners.pop() if corners else None
    return np.array(corners)


def cross(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def geoms_of(model, bodies):
    """Which geoms are these bodies', and which the floor's."""
    of = model.geom_bodyid
    return np.isin(of, bodies), (of == 0) | ((model.body_weldid[of] == 0) & np.isin(model.geom_type, (PLANE, HFIELD)))
