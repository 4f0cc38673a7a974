#!/usr/bin/env python3
"""Plays the judge's cases (lab/grains/README.md) in Newton's implicit MPM, and keeps records as lab/grains/run.py does.

    pip install newton==1.8.0 warp-lang==1.19.0            optional, nothing else of mild needs them; a GPU is advised
    lab/grains/judge_mpm.py --list                            cases, in the order in which they are played
    lab/grains/judge_mpm.py --out out/mpm                     friction is fitted to the level press of the records of grains
    lab/grains/judge_mpm.py --out out/mpm5 --friction 0.42 --voxel 0.005 --only '^sand/' --seconds 300
    lab/grains/judge_mpm.py --check --friction 0.42           what the bed loses of momentum and weight, nothing is written
    lab/grains/judge.py --rival newton=out/mpm                judges them beside the models of mild

Records are OUT/FAMILY/CASE-SEED.csv. OUT/manifest.json has versions, parameters, the fit, and each case's cost in seconds per
simulated second. An interrupted run goes on where it stopped, case by case; other parameters want another folder."""
import argparse
import importlib.util
import json
import math
import pathlib
import platform
import re
import sys
import time

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))

import pack  # noqa: E402
from judge_cases import Case, measures  # noqa: E402

GRAVITY = 9.81
HEIGHT = 0.06  # [m] of a plate, as grains have it: above every depth
SETTLE = 0.1  # [s] before a case: the bed comes to rest, and kernels are compiled before the clock runs
LEVER = 100.0  # [m] see Bed.collide
COLUMNS = ("time_s,stage,depth_m,path_m,pitch_rad,sinkage_m,force_x_n,force_y_n,force_z_n,moment_x_nm,moment_y_nm,moment_z_nm,"
           "cop_x_m,cop_y_m")
# The most important cases first; the others of these families follow.
ORDER = ("sand/disc120", "sand/square100", "sand/square100-drag15", "sand/square100-tilt15", "sand/square100-tilt30", "sand/strip",
         "sand/square100-load10", "wide/sa01", "sand/square100-again", "sand/square100-swipe15", "sand/square100-drop05")
# Family: the case whose force fits the friction of the ground.
FITS = {"sand": "sand/disc120", "wide": "sand/disc120", "slick": "slick/disc120", "fine": "fine/disc60"}
PARAMETERS = ("voxel", "dt", "travel", "iterations", "tolerance", "basis", "particles", "margin", "friction", "plate_friction", "edge")


def fail(text):
    print(f"judge_mpm.py: {text}", file=sys.stderr)
    sys.exit(2)


def grains_run():
    """lab/grains/run.py: the cases and boxes."""
    spec = importlib.util.spec_from_file_location("run", ROOT / "lab/grains" / "run.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def cases(run):
    """{FAMILY/NAME: text} in the order of ORDER, then of run.py."""
    every = {f"{family}/{case.split()[0]}": case for family, block in run.BLOCKS for case in block if family in FITS}
    return {key: every[key] for key in (*ORDER, *(key for key in every if key not in ORDER))}


# ---- geometry, without newton ----

def triangles_of(outline):
    """Triangles (n - 2, 3) of an outline that goes counter-clockwise: ears are cut, the roundest first."""
    def turn(a, b, c):
        return (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])

    def quality(left, k):
        corners = [left[k - 1], left[k], left[(k + 1) % len(left)]]
        a, b, c = outline[corners]
        others = outline[[i for i in left if i not in corners]]
        inside = (turn(a, b, others) >= 0) & (turn(b, c, others) >= 0) & (turn(c, a, others) >= 0)
        return -1 if inside.any() else turn(a, b, c) / max(((p - q)**2).sum() for p, q in ((a, b), (b, c), (c, a)))
    left, faces = list(range(len(outline))), []
    while len(left) > 2:
        best = max(range(len(left)), key=lambda k: quality(left, k))
        if quality(left, best) <= 0:
            fail("an outline crosses itself")
        faces.append([left[best - 1], left[best], left[(best + 1) % len(left)]])
        del left[best]
    return np.array(faces)


def plate_mesh(outline, height=HEIGHT):
    """A block on an outline, its bottom at z = 0: points (n, 3), outward triangles (m, 3)."""
    outline = np.asarray(outline, float)
    ahead, count = np.roll(outline, -1, 0), len(outline)
    if (outline[:, 0] * ahead[:, 1] - ahead[:, 0] * outline[:, 1]).sum() < 0:
        outline = outline[::-1]
    points = np.vstack([np.column_stack([outline, np.full(count, z)]) for z in (0.0, height)])
    face, k = triangles_of(outline), np.arange(count)
    n = (k + 1) % count
    sides = [np.column_stack(side) for side in ((k, n, count + n), (k, count + n, count + k))]
    return points, np.vstack([face[:, ::-1], face + count, *sides])


def box_of(run, family, case, voxel, margin):
    """Voxels of the bed (x, y, z): the family's box, or `margin` [m] of free ground around the plate and its way."""
    size = np.array(run.size_of(family))
    if margin:
        low, high = case.sole.outline.min(0), case.sole.outline.max(0)
        way = sum(abs(way[1] * way[2]) for way in case.ways)
        reach = 2 * np.maximum(np.abs(low), np.abs(high)) + 2 * margin + [2 * way, 0]
        size[:2] = np.minimum(size[:2], reach)
    across = [2 * max(2, round(length / 2 / voxel)) for length in size[:2]]  # even, so that walls stand on planes of nodes
    return np.array([*across, max(2, round(size[2] / voxel))])


def particles_of(voxels, voxel, per_edge, seed):
    """Places [m] of the particles, the surface at 0: `per_edge` along a voxel's edge, each anywhere in its own cell."""
    spacing, random = voxel / per_edge, np.random.default_rng(seed)
    axes = [np.arange(count * per_edge) for count in voxels]
    index = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    corner = -voxel * np.array([voxels[0] / 2, voxels[1] / 2, voxels[2]])
    return corner + spacing * (index + random.random(index.shape))


# ---- the bed in newton ----

def load_newton():
    try:
        import newton
        import warp
    except ImportError as error:
        fail(f"{error}: pip install newton")
    return newton, warp


class Bed:
    """A box of particles, floor and walls, and one plate. Walls have no friction, as a mirror; grains have periodic sides."""

    def __init__(self, args, sole, voxels, density, ground_friction, friction, seed):
        self.newton, self.wp = load_newton()
        solver = self.newton.solvers.SolverImplicitMPM
        builder = self.newton.ModelBuilder(gravity=(0.0, 0.0, -GRAVITY))
        solver.register_custom_attributes(builder)
        self.add_ground(builder, args, voxels, density, friction, seed)
        self.add_plate(builder, sole, friction)
        self.model = builder.finalize(device=args.device or None)
        self.model.mpm.friction.fill_(ground_friction)
        config = solver.Config()
        config.voxel_size, config.max_iterations, config.tolerance = args.voxel, args.iterations, args.tolerance
        config.collider_basis = args.basis
        self.solver = solver(self.model, config=config)
        self.state = self.model.state()
        self.collide(0.0)

    def add_ground(self, builder, args, voxels, density, friction, seed):
        points = particles_of(voxels, args.voxel, args.particles, seed)
        spacing, count = args.voxel / args.particles, len(points)
        self.particles = count
        builder.add_particles(pos=points.tolist(), vel=[(0.0, 0.0, 0.0)] * count, mass=[density * spacing**3] * count,
                              radius=[spacing / 2] * count)
        length, width, depth = args.voxel * voxels / [2, 2, 1]
        thick, high = 4 * args.voxel, depth + 0.2
        shape = self.newton.ModelBuilder.ShapeConfig
        self.add_box(builder, (0, 0, -depth - thick), (length + 3 * thick, width + 3 * thick, thick), shape(mu=friction, density=0))
        for sign in (-1, 1):
            for middle, half in (((sign * (length + thick), 0), (thick, width + 3 * thick)),
                                 ((0, sign * (width + thick)), (length + 3 * thick, thick))):
                self.add_box(builder, (*middle, high / 2 - depth), (*half, high / 2), shape(mu=0.0, density=0))

    def add_box(self, builder, middle, half, config):
        builder.add_shape_box(-1, xform=self.wp.transform(self.wp.vec3(*map(float, middle)), self.wp.quat_identity()),
                              hx=float(half[0]), hy=float(half[1]), hz=float(half[2]), cfg=config)

    def add_plate(self, builder, sole, friction):
        config = self.newton.ModelBuilder.ShapeConfig(mu=friction, density=0)
        body = builder.add_body()
        if sole.radius:
            up = self.wp.transform(self.wp.vec3(0.0, 0.0, sole.radius), self.wp.quat_identity())
            builder.add_shape_sphere(body, xform=up, radius=sole.radius, cfg=config)
            return
        points, faces = plate_mesh(sole.outline)
        mesh = self.newton.Mesh(points.astype(np.float32), faces.astype(np.int32).ravel(), compute_inertia=False)
        builder.add_shape_mesh(body, mesh=mesh, cfg=config)

    def collide(self, mass):
        """The plate is led (mass 0), or free in z. Newton's colliders are free in all directions, so the mass stands at the end of
        a long lever: the plate's body has no other inertia than that of turning about a pivot LEVER ahead of it."""
        wp, device = self.wp, self.model.device
        turning = np.zeros((1, 3, 3), np.float32)
        turning[0, 1, 1] = 1 / (mass * LEVER**2) if mass else 0
        with wp.ScopedDevice(device):
            self.solver.setup_collider(body_mass=wp.array([1e9 if mass else 0.0], dtype=float),
                                       body_inv_inertia=wp.array(turning, dtype=wp.mat33),
                                       body_com=wp.array([[LEVER if mass else 0.0, 0.0, 0.0]], dtype=wp.vec3))
        self.plate = int(np.flatnonzero(self.solver.collider_body_index.numpy() == 0)[0])

    def step(self, pose, speed, dt):
        """A step of a plate at pose (x, z, pitch) with speed: force and moment on it (6) about the middle of its bottom."""
        (x, z, pitch), (vx, vz, rate) = pose, speed
        self.state.body_q.assign(np.array([[x, 0, z, 0, math.sin(pitch / 2), 0, math.cos(pitch / 2)]], np.float32))
        self.state.body_qd.assign(np.array([[vx, 0, vz, 0, rate, 0]], np.float32))
        self.solver.step(self.state, self.state, control=None, contacts=None, dt=dt)
        return self.wrenches(np.array([x, 0, z]), dt)[self.plate]

    def wrenches(self, about, dt):
        """Of every collider: force and moment on it."""
        impulse, place, collider = (array.numpy() for array in self.solver.collect_collider_impulses(self.state))
        out = np.zeros((self.solver.collider_body_index.shape[0], 6))
        touched = collider >= 0
        force = impulse[touched].astype(float) / dt
        np.add.at(out, collider[touched], np.column_stack([force, np.cross(place[touched] - about, force)]))
        return out

    def momentum(self):
        velocity, mass = self.state.particle_qd.numpy().astype(float), self.model.particle_mass.numpy().astype(float)
        return mass @ velocity


# ---- a case ----

class OutOfTime(Exception):
    pass


def in_time(args):
    if args.ends and time.time() > args.ends:
        raise OutOfTime


def stage_steps(way, args):
    """Steps of a stage and their length [s]; a plate goes at most --travel in one."""
    fastest = max(abs(way[2]), abs(way[3]))
    dt = min(args.dt, args.travel / fastest) if fastest else args.dt
    steps = max(1, math.ceil(way[1] / dt - 1e-9))
    return steps, way[1] / steps


def play(case, bed, args):
    """Rows of a case (means over their steps, the pose at their end) and the seconds of each step. bed.step(pose, speed, dt)
    gives the wrench."""
    total = sum(way[1] for way in case.ways)
    pose, rows, costs, now = np.array([0.0, -case.start, case.tilt]), [], [], 0.0
    for _ in range(round(SETTLE / args.dt)):
        in_time(args)
        bed.step(pose, np.zeros(3), args.dt)
    for stage, (kind, seconds, vx, vz, rate, mass, *_) in enumerate(case.ways):
        steps, dt = stage_steps(case.ways[stage], args)
        mass = mass or (rows[-1]["wrench"][2] / GRAVITY if kind == "load" else 0.0)
        if kind in ("load", "drop") and mass <= 0:
            raise ValueError(f"{case.name}: a load stage begins on a plate that carries nothing")
        bed.collide(mass)
        count = min(steps, max(10, round(args.rows * seconds / total)))
        speed, begin, sums, first = np.array([vx, vz, rate]), -pose[1], [], 0
        for step in range(steps):
            in_time(args)
            clock = time.time()
            free = speed - [0, GRAVITY * dt if mass else 0, 0]
            sums.append(bed.step(pose, free, dt))
            speed = free + [0, sums[-1][2] * dt / mass if mass else 0, 0]
            pose, now = pose + dt * speed, now + dt
            costs.append(time.time() - clock)
            if (step + 1) * count // steps > first:
                first, wrench, sums = first + 1, np.mean(sums, 0), []
                rows.append({"time": now, "stage": stage, "depth": -pose[1], "path": pose[0], "pitch": pose[2],
                             "sinkage": -pose[1] - begin, "wrench": wrench})
    return rows, costs


def row_text(row):
    """A line as lab/grains/record.h writes it."""
    w, s, c = row["wrench"], math.sin(row["pitch"]), math.cos(row["pitch"])
    normal, mx = s * w[0] + c * w[2], c * w[3] - s * w[5]
    center = (-w[4] / normal, mx / normal) if abs(normal) > 1e-3 else (0, 0)
    words = [f"{row['time']:.5g}", f"{row['stage']}", f"{row['depth']:.5g}", f"{row['path']:.5g}", f"{row['pitch']:.4g}",
             f"{row['sinkage']:.4g}", *(f"{part:.4g}" for part in w), *(f"{part:.3g}" for part in center)]
    return ",".join(words)


def write_rows(file, rows):
    file.parent.mkdir(parents=True, exist_ok=True)
    part = file.with_suffix(".part")
    part.write_text("\n".join([COLUMNS, *map(row_text, rows)]) + "\n")
    part.replace(file)


def columns(rows):
    """Rows as judge_cases.measures takes them."""
    table = {name: np.array([row[name] for row in rows]) for name in ("time", "stage", "depth", "path", "pitch")}
    wrench = np.array([row["wrench"] for row in rows])
    return {**table, "fx": wrench[:, 0], "fz": wrench[:, 2], "my": wrench[:, 4]}


# ---- the friction of the ground ----

def grains_force(args, key, case):
    """Force of a level press in grains, mean over beds."""
    name = re.escape(key.split("/")[1])
    files = [file for file in sorted(args.records.glob(f"{key}-*.csv")) if re.fullmatch(name + r"-\d+", file.stem)]
    if not files:
        fail(f"{args.records / key}-*.csv is not there: make it with lab/grains/run.py, or give --friction")
    names = {"time_s": "time", "stage": "stage", "depth_m": "depth", "path_m": "path", "force_x_n": "fx", "force_z_n": "fz",
             "moment_y_nm": "my"}
    tables = [np.genfromtxt(file.read_text().splitlines(), delimiter=",", names=True) for file in files]
    return float(np.mean([measures(case, {short: table[name] for name, short in names.items()})["force"] for table in tables]))


def next_friction(tried, wanted):
    """The friction to try next, from [friction, force] of those tried: secant of the force's logarithm."""
    error = [math.log(max(force, 1e-3) / wanted) for _, force in tried]
    order = sorted(range(len(tried)), key=lambda k: abs(error[k]))
    best = tried[order[0]][0]
    slope = 6.0  # per unit of friction: 0.40 to 0.45 is 0.86 to 1.15 of the grains
    if len(tried) > 1:
        (a, b), run = order[:2], tried[order[0]][0] - tried[order[1]][0]
        slope = max((error[a] - error[b]) / run, 2.0) if run else slope
    return float(np.clip(best - np.clip(error[order[0]] / slope, -0.08, 0.08), 0.05, 1.2))


def friction_of(args, manifest, family, every):
    """--friction, or the one with which the level press has the grains' force within 1 %, or the best of five."""
    if args.friction:
        return args.friction
    key = FITS[family]
    case = case_of(args, key, every[key])
    fit = manifest.rows.setdefault("fits", {}).setdefault(key, {"grains": grains_force(args, key, case), "tried": []})
    tried = fit["tried"]

    def error(pair):
        return abs(math.log(max(pair[1], 1e-3) / fit["grains"]))
    while not tried or (min(map(error, tried)) > 0.01 and len(tried) < 5):
        friction = next_friction(tried, fit["grains"]) if tried else 0.42
        rows, _ = play(case, make_bed(args, key.split("/")[0], case, friction, args.seeds[0]), args)
        tried.append([friction, float(measures(case, columns(rows))["force"])])
        print(f"{key}: friction {friction:.4f} gives {tried[-1][1]:.4g} N, grains {fit['grains']:.4g} N", flush=True)
        manifest.write()
    return min(tried, key=error)[0]


# ---- running ----

class Manifest:
    """manifest.json, written whole after each case: families and cases as lab/grains/run.py has them; newton: versions, parameters."""

    def __init__(self, args):
        self.file = args.out / "manifest.json"
        self.rows = json.loads(self.file.read_text()) if self.file.exists() else {}
        wanted = {name: getattr(args, name) for name in PARAMETERS}
        had = {"edge": 0.0, **self.rows.setdefault("newton", {"parameters": wanted})["parameters"]}  # 0 in records from before --edge
        other = [name for name in PARAMETERS if had.get(name) != wanted[name]]
        if other:
            fail(f"{self.file}: its records have --{other[0].replace('_', '-')} {had.get(other[0])}: give another --out")

    def write(self):
        self.file.parent.mkdir(parents=True, exist_ok=True)
        part = self.file.with_suffix(".part")
        part.write_text(json.dumps(self.rows, indent=1) + "\n")
        part.replace(self.file)


def solid_of(args, family):
    file = args.records / "manifest.json"
    row = json.loads(file.read_text()).get(family, {}) if file.exists() else {}
    return float(np.mean(row.get("solid", [0.59])))


def make_bed(args, family, case, friction, seed):
    voxels = box_of(args.run, family, case, args.voxel, args.margin)
    grains = args.run.FAMILIES[family]["friction"]
    plate = grains if args.plate_friction is None else args.plate_friction
    return Bed(args, case.sole, voxels, 2500 * solid_of(args, family), friction, plate, seed)


def case_of(args, key, text):
    return Case(text, args.edge * args.run.FAMILIES[key.split("/")[0]]["grain"])


def run_case(args, manifest, key, text, friction):
    family, case = key.split("/")[0], case_of(args, key, text)
    row = manifest.rows.setdefault(key, {"case": text, "seeds": args.seed_text, "friction": friction, "beds": {}})
    options = [word for name, value in args.run.FAMILIES[family].items() for word in (f"--{name}", str(value))]
    manifest.rows[family] = {"solid": [solid_of(args, family)], "options": options}
    for seed in args.seeds:
        file = args.out / f"{key}-{seed}.csv"
        if file.exists():
            continue
        begin, bed = time.time(), make_bed(args, family, case, friction, seed)
        rows, costs = play(case, bed, args)
        write_rows(file, rows)
        simulated = sum(way[1] for way in case.ways)
        cost = float(np.median(costs)) * len(costs) / simulated  # of the median step: without what was compiled in between
        row["beds"][str(seed)] = {"particles": bed.particles, "voxels": box_of(args.run, family, case, args.voxel, args.margin)
                                  .tolist(), "steps": len(costs), "step_ms": 1e3 * float(np.median(costs)), "simulated_s": simulated,
                                  "seconds_per_simulated_second": cost, "wall_s": time.time() - begin}
        manifest.write()
        found = ", ".join(f"{name} {value:.4g}" for name, value in measures(case, columns(rows)).items())
        print(f"{key}-{seed}: {bed.particles} particles, {len(costs)} steps of {1e3 * np.median(costs):.1f} ms, {cost:.2f} s per "
              f"simulated second, {time.time() - begin:.1f} s; {found}", flush=True)


def identify(args, manifest):
    newton, wp = load_newton()
    device = wp.get_device(args.device or None)
    manifest.rows["newton"] |= {"newton": newton.__version__, "warp": wp.config.version, "python": platform.python_version(),
                                "device": device.name, "settle_s": SETTLE, "walls": "frictionless", "else": "Newton's defaults"}


def check(args, every):
    """Momentum that particles and colliders exchange in a press of the disc, against the weight of the bed."""
    case = Case(every["sand/disc120"])
    bed = make_bed(args, "sand", case, args.friction or 0.42, args.seeds[0])
    weight = GRAVITY * float(bed.model.particle_mass.numpy().sum())
    pose, speed, got, plate = np.array([0.0, -case.start, 0.0]), np.array([0.0, -0.05, 0.0]), np.zeros(3), 0.0
    for _ in range(round(SETTLE / args.dt)):
        bed.step(pose, np.zeros(3), args.dt)
    before, steps = bed.momentum(), 40
    for _ in range(steps):
        plate += bed.step(pose, speed, args.dt)[2] / steps
        got -= args.dt * bed.wrenches(np.zeros(3), args.dt)[:, :3].sum(0)
        pose = pose + args.dt * speed
    given = weight * steps * args.dt
    lost = (bed.momentum() - before - got + [0, 0, given]) / given
    print(f"bed {weight:.2f} N, plate {plate:.2f} N; colliders give {got[2] / given:.5f} of the weight's impulse; "
          f"momentum that nothing gave, over it: {lost[0]:+.1e} {lost[1]:+.1e} {lost[2]:+.1e}")


def seeds_of(text):
    first, _, last = text.partition("-")
    if not re.fullmatch(r"\d+(-\d+)?", text):
        fail(f"--seeds {text}: it must be A or A-B")
    return list(range(int(first), int(last or first) + 1))


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "out" / "mpm")
    parser.add_argument("--records", type=pack.opened, default=f"{ROOT}/lab/grains/records.tar.xz", help="of grains, for the friction")
    parser.add_argument("--only", default="", help="cases FAMILY/CASE that this regular expression finds")
    parser.add_argument("--seconds", type=float, default=0, help="end after this time, and keep what is finished")
    parser.add_argument("--seeds", default="1", help="A or A-B: places of the particles")
    parser.add_argument("--rows", type=int, default=130, help="of a record, about")
    parser.add_argument("--friction", type=float, help="of the ground; without it it is fitted")
    parser.add_argument("--plate-friction", type=float, help="of plate and floor; default: that of the grains")
    parser.add_argument("--voxel", type=float, default=0.01, help="[m]")
    parser.add_argument("--particles", type=int, default=2, help="along a voxel's edge")
    parser.add_argument("--margin", type=float, default=0, help="[m] of ground around the plate; 0: the box that grains have")
    parser.add_argument("--dt", type=float, default=0.005, help="[s]")
    parser.add_argument("--travel", type=float, default=0.001, help="[m] that a plate goes in a step at most")
    parser.add_argument("--iterations", type=int, default=250)
    parser.add_argument("--tolerance", type=float, default=1e-4)
    parser.add_argument("--basis", default="S2", help="of the contact: S2, Q1, pic, pic27")
    parser.add_argument("--edge", type=float, default=0.0, help="[grains] by which the plate is wider on each side, as lab/grains/judge.py has it for "
                        "models: 0.5")
    parser.add_argument("--device", default="", help="cuda:0 or cpu; default: Warp's")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--check", action="store_true")
    return parser.parse_args()


def main():
    args = arguments()
    args.ends = time.time() + args.seconds if args.seconds > 0 else 0
    args.run, args.seed_text, args.seeds = grains_run(), args.seeds, seeds_of(args.seeds)
    for name in ("voxel", "dt", "travel", "iterations", "particles"):
        if not getattr(args, name) > 0:
            fail(f"--{name} must be above 0")
    every = cases(args.run)
    wanted = {key: text for key, text in every.items() if re.search(args.only, key)}
    if not wanted:
        fail(f"--only {args.only}: no case has such a name")
    if args.list:
        for key, text in wanted.items():
            print(f"{key:28} {sum(way[1] for way in Case(text).ways):.2f} s")
        return
    if args.check:
        check(args, every)
        return
    manifest = Manifest(args)
    identify(args, manifest)
    try:
        for key, text in wanted.items():
            if not all((args.out / f"{key}-{seed}.csv").exists() for seed in args.seeds):
                run_case(args, manifest, key, text, friction_of(args, manifest, key.split("/")[0], every))
    except OutOfTime:
        print("out of time; the same command goes on")


if __name__ == "__main__":
    main()
