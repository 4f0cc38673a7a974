#!/usr/bin/env python3
"""The makers' meshes of G1 and Go1, coarser, for pictures: writes robots/ROBOT/look.xml and the files beside it.

usage: meshes.py MJLAB [g1|go1 ...] [--faces 26000] [--out robots]

MJLAB is the folder mjlab of the package of that name: pip download --no-deps mjlab==1.6.0 && unzip mjlab-1.6.0-*.whl -d here; then here/mjlab.
Needs fast-simplification 0.2.0, mujoco and numpy (pip). Faces are shared out by the square root of a mesh's area. What is the mirror image
of a mesh of the left side is that mesh, mirrored. Vertices are rounded to 0.01 mm. The files are MuJoCo's MSH: numbers of vertices,
normals (0: MuJoCo makes them), texture coordinates (0) and faces, then vertices as floats and faces as integers."""
import argparse
import pathlib
import struct

import fast_simplification
import mujoco
import numpy as np

ROBOTS = {"g1": "unitree_g1", "go1": "unitree_go1"}
MATERIALS = {"black": "graphite", "silver": "shell", "dark": "graphite"}
LICENCE = {"g1": "LICENSE-G1.md", "go1": "LICENSE-GO1.md"}
MIRROR = 4e-3  # [m] from a vertex of the right side to the nearest of the mirrored left, where the surfaces may be nearer


def read_stl(path):
    """Vertices, each once, and triangles of a binary STL."""
    data = path.read_bytes()
    count = struct.unpack_from("<I", data, 80)[0]
    kind = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("rest", "<u2")])
    corners = np.frombuffer(data, kind, count, 84)["corner"].reshape(-1, 3)
    points, faces = np.unique(np.round(corners, 6), axis=0, return_inverse=True)
    faces = faces.reshape(-1, 3)
    return points, faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]


def area(points, faces):
    a, b, c = (points[faces[:, k]] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def coarser(points, faces, count):
    if len(faces) > count:
        points, faces = fast_simplification.simplify(points.astype(np.float32), faces.astype(np.int32), target_count=count, agg=3)
    points, index = np.unique(np.round(points, 5), axis=0, return_inverse=True)
    faces = index.reshape(-1)[faces]
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    used, faces = np.unique(faces, return_inverse=True)
    return points[used].astype("<f4"), faces.reshape(-1, 3).astype("<i4")


def write_msh(path, points, faces):
    path.write_bytes(struct.pack("<4i", len(points), 0, 0, len(faces)) + points.tobytes() + faces.tobytes())


def farthest(points, others):
    """The largest distance of some points from the nearest of others, coarsely: each tenth."""
    some = points[:: max(1, len(points) // 300)]
    return max(np.sqrt(((others - p) ** 2).sum(1).min()) for p in some)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mjlab", type=pathlib.Path)
    parser.add_argument("robots", nargs="*", metavar="ROBOT")
    parser.add_argument("--faces", type=int, default=26000, help="of a robot's files, about")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path(__file__).parents[1] / "robots")
    given = parser.parse_args()
    for robot in given.robots or ROBOTS:
        make(given.mjlab / "asset_zoo/robots" / ROBOTS[robot] / "xmls", robot, given.faces, given.out / robot)


def make(source, robot, budget, out):
    spec = mujoco.MjSpec.from_file(str(source / f"{robot}.xml"))
    files = {mesh.name or pathlib.Path(mesh.file).stem: source / spec.meshdir / mesh.file for mesh in spec.meshes}
    geoms = [geom for geom in spec.geoms if geom.meshname and geom.contype == 0 and geom.conaffinity == 0]
    meshes = {name: read_stl(files[name]) for name in sorted({geom.meshname for geom in geoms})}
    mirrored = {name: name.replace("right_", "left_") for name in meshes if name.startswith("right_")}
    for name, left in mirrored.copy().items():
        far = farthest(meshes[name][0] * [1, -1, 1], meshes[left][0])
        print(f"{robot}: {name} is {left} mirrored, within {1e3 * far:.2f} mm")
        if far > MIRROR:
            del mirrored[name]
    kept = {name: mesh for name, mesh in meshes.items() if name not in mirrored}
    share = {name: np.sqrt(area(*mesh)) for name, mesh in kept.items()}
    folder = out / "look"
    folder.mkdir(exist_ok=True)
    total, bytes_ = 0, 0
    for name, mesh in kept.items():
        points, faces = coarser(*mesh, max(150, int(budget * share[name] / sum(share.values()))))
        write_msh(folder / f"{name}.msh", points, faces)
        total, bytes_ = total + len(faces), bytes_ + (folder / f"{name}.msh").stat().st_size
    lines = [f"<!-- What pictures show of the {robot.upper()} in the place of {robot}.xml's shapes: Unitree's meshes, made coarser by scripts/meshes.py",
             f"     ({LICENCE[robot]}). Bodies are named as there; their frames are those of that file. -->",
             f'<mujoco model="{robot}">', '  <compiler meshdir="look"/>', "  <asset>"]
    for name in meshes:
        mirror = f' file="{mirrored[name]}.msh" scale="1 -1 1"' if name in mirrored else f' file="{name}.msh"'
        lines.append(f'    <mesh name="{name}"{mirror} inertia="shell"/>')
    lines += ["  </asset>", "  <worldbody>"]
    for body in spec.bodies:
        mine = [geom for geom in geoms if geom.parent == body]
        if mine:
            lines.append(f'    <body name="{body.name}">')
            for geom in mine:
                place = "" if not np.any(geom.pos) else f' pos="{geom.pos[0]:g} {geom.pos[1]:g} {geom.pos[2]:g}"'
                turn = "" if abs(geom.quat[0]) == 1 or not np.any(np.isfinite(geom.quat)) else ' quat="' + " ".join(f"{x:g}" for x in geom.quat) + '"'
                look = MATERIALS.get(geom.material, "graphite")
                lines.append(f'      <geom type="mesh" mesh="{geom.meshname}"{place}{turn} material="{look}"/>')
            lines.append("    </body>")
    lines += ["  </worldbody>", "</mujoco>", ""]
    (out / "look.xml").write_text("\n".join(lines))
    print(f"{robot}: {len(kept)} files, {total} faces of {sum(len(f) for _, f in kept.values())}, {bytes_ / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
