#!/usr/bin/env python3
"""A robot walks on Newton's implicit MPM: the program at the other end of `mild eval --program` (lab/grains/README.md, "On Newton's MPM").

    pip install newton==1.8.0 warp-lang==1.19.0       optional, nothing else of mild needs them; a GPU is advised
    lab/grains/walk.py mpm                                the walks; this program is started by it

src/run/eval/other_ground.h has what is said. One window of particles is under all soles and goes with them."""
import argparse
import json
import os
import pathlib
import struct
import sys
import time

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import judge_mpm  # noqa: E402

GRAVITY = 9.81
DENSITY = 2500.0  # [kg/m3] of grains
SETTLE = 0.1  # [s] before the soles come
PRESS_SPEED = 0.25  # [m/s] of the soles before the first step
LEEWAY = 0.75  # [blocks] that the soles are off the window's middle before it follows
WALL = 0.1  # [m] thickness


# ---- what is said ----

class Question:
    """What the robot asks. Twists and rows are about the ankles, of each foot first the linear part, then the spin."""

    def __init__(self, time_, dt, trial, feet, free, response):
        self.time, self.dt, self.trial = time_, dt, int(trial)
        self.place, self.turn, self.twist = feet[:, :3], feet[:, 3:12].reshape(-1, 3, 3), feet[:, 12:]
        self.free, self.response = free, response


def read_question(file):
    """None at the end of the input."""
    def doubles(count):
        data = file.read(8 * count)
        return np.frombuffer(data) if len(data) == 8 * count else None
    head = doubles(4)
    if head is None:
        return None
    n = int(head[0])
    body = doubles(18 * n + 6 * n + 36 * n * n)
    if body is None:
        return None
    feet, free, response = np.split(body, (18 * n, 24 * n))
    return Question(*head[1:], feet.reshape(n, 18), free.reshape(n, 6), response.reshape(6 * n, 6 * n))


def quaternion(turn):
    """x y z w of any rotation; the largest of the four is found first."""
    m = np.asarray(turn)
    square = np.array([m[0, 0] - m[1, 1] - m[2, 2], m[1, 1] - m[0, 0] - m[2, 2], m[2, 2] - m[0, 0] - m[1, 1], np.trace(m)])
    k = int(square.argmax())
    skew = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    large = 0.5 * np.sqrt(1 + square[k])
    out = np.append(skew, 0) / (4 * large) if k == 3 else np.append((m[k] + m[:, k]) / (4 * large), skew[k] / (4 * large))
    out[k] = large
    return out


# ---- soles ----

class Soles:
    """Outlines [m] of the feet in their own frames, `height` below the ankle where it is negative."""

    def __init__(self, outlines, height):
        self.outlines, self.height = [np.asarray(outline, float) for outline in outlines], height
        self.points = [np.column_stack([outline, np.full(len(outline), height)]) for outline in self.outlines]

    def depths(self, q):
        """Of each foot: its deepest point and the middle of its outline, below the undisturbed surface [m]."""
        heights = [q.place[f, 2] + points @ q.turn[f, 2] for f, points in enumerate(self.points)]
        middles = [0.5 * (points.min(0) + points.max(0)) for points in self.points]
        return (np.array([-h.min() for h in heights]),
                np.array([-q.place[f, 2] - middle @ q.turn[f, 2] for f, middle in enumerate(middles)]))

    def middle(self, q):
        """x, y between the soles."""
        return np.mean([q.place[f, :2] + q.turn[f, :2] @ points.mean(0) for f, points in enumerate(self.points)], 0)

    def lost(self, q, floor):
        """Bool: one is upside down in the ground or at the floor."""
        deep, _ = self.depths(q)
        return bool(np.any(((q.turn[:, 2, 2] <= 0) & (deep >= 0)) | (deep >= floor)))


# ---- the window ----

class Window:
    """A grid of blocks of ground, each with its own particles. Ground is the same wherever a block lies, so the window goes on by
    laying the blocks that it leaves behind in front of it, as they were at first. A block lies on one place of its class modulo the
    window's size."""

    def __init__(self, blocks, block):
        self.blocks, self.block, self.middle = np.array(blocks), block, None
        index = np.stack(np.meshgrid(*map(np.arange, self.blocks), indexing="ij"), -1).reshape(-1, 2)
        self.index = index  # [blocks] (i, j)

    def homes(self, middle):
        """Places (in blocks) of all blocks when the window is around `middle`."""
        low = np.asarray(middle) - self.blocks // 2
        return low + (self.index - low) % self.blocks

    def follow(self, place):
        """Bools of the blocks that are laid anew, [blocks], or None. place: x, y [m] of what it follows."""
        at = np.asarray(place) / self.block - 0.5 * (self.blocks % 2)
        if self.middle is None:
            self.middle = np.rint(at).astype(int)
            return np.ones(len(self.index), bool)
        off = np.abs(at - self.middle) > LEEWAY
        if not off.any():
            return None
        before = self.homes(self.middle)
        self.middle = np.where(off, np.rint(at), self.middle).astype(int)
        return (self.homes(self.middle) != before).any(1)

    def corner(self):
        return (self.middle - self.blocks // 2) * self.block  # [m]

    def size(self):
        return self.blocks * self.block


# ---- the ground in newton ----

def load_newton():
    """Without what warp says of itself."""
    try:
        import warp
    except ImportError as error:
        judge_mpm.fail(f"{error}: pip install newton")
    warp.config.quiet = True
    import warp.sparse  # noqa: F401
    return judge_mpm.load_newton()


def coupling_kernels(wp):
    """fill: both sparse matrices of the coupling; gather: the impulses on each foot about its ankle."""
    mat33 = wp.mat33

    @wp.kernel
    def fill(position: wp.array(dtype=wp.vec3), collider: wp.array(dtype=int), body: wp.array(dtype=int), feet: int,
             ankle: wp.array(dtype=wp.vec3), response: wp.array2d(dtype=mat33), volume: float,
             row: wp.array(dtype=int), column: wp.array(dtype=int), value: wp.array(dtype=mat33),
             back_row: wp.array(dtype=int), back_column: wp.array(dtype=int), back: wp.array(dtype=mat33)):
        i = wp.tid()
        foot = int(-1)
        if collider[i] >= 0:
            foot = body[collider[i]]
        on = foot >= 0 and foot < feet
        for k in range(2):
            row[2 * i + k] = wp.where(on, i, -1)
            column[2 * i + k] = wp.where(on, 2 * foot + k, -1)
        for k in range(2 * feet):
            back_row[2 * feet * i + k] = wp.where(on, k, -1)
            back_column[2 * feet * i + k] = wp.where(on, i, -1)
        if on:
            lever = wp.skew(position[i] - ankle[foot])
            value[2 * i] = wp.identity(n=3, dtype=float)
            value[2 * i + 1] = -lever  # v + w x r
            for k in range(2 * feet):
                back[2 * feet * i + k] = volume * (response[k, 2 * foot] + response[k, 2 * foot + 1] @ lever)

    @wp.kernel
    def gather(impulse: wp.array(dtype=wp.vec3), position: wp.array(dtype=wp.vec3), collider: wp.array(dtype=int),
               body: wp.array(dtype=int), feet: int, ankle: wp.array(dtype=wp.vec3), out: wp.array2d(dtype=wp.float64)):
        i = wp.tid()
        foot = int(-1)
        if collider[i] >= 0:
            foot = body[collider[i]]
        if foot >= 0 and foot < feet:
            turn = wp.cross(position[i] - ankle[foot], impulse[i])
            for k in range(3):
                wp.atomic_add(out, foot, k, wp.float64(impulse[i][k]))
                wp.atomic_add(out, foot, k + 3, wp.float64(turn[k]))

    return fill, gather


def coupling(newton, wp):
    """Newton's solver with the robot's inertia. Its own finite-mass colliders are bodies that know nothing of each other, with one mass
    in all directions. The operator is made of two sparse matrices, J from the bodies' twists to nodes and M J^T back; here M is A."""
    mat33 = wp.mat33
    fill, gather = coupling_kernels(wp)

    class Coupled(newton.solvers.SolverImplicitMPM):
        feet = 0

        def set_robot(self, ankles, response):
            """The robot of the next step. response: A, or None: the soles are led."""
            self.feet, device = len(ankles), self.model.device
            rows = 2 * self.feet
            blocks = np.zeros((rows, rows, 3, 3)) if response is None else \
                response.reshape(rows, 3, rows, 3).transpose(0, 2, 1, 3)
            self.ankles = wp.array(np.asarray(ankles, np.float32), dtype=wp.vec3, device=device)
            self.response = wp.array(np.ascontiguousarray(blocks, np.float32), dtype=mat33, device=device)

        def _build_collider_rigidity_operator(self, state_in, scratch, cell_volume):
            position, collider = scratch.collider_position_field.dof_values, scratch.collider_ids
            nodes, rows, device = position.shape[0], 2 * self.feet, self.model.device
            row, column = (wp.empty(2 * nodes, dtype=int, device=device) for _ in range(2))
            back_row, back_column = (wp.empty(rows * nodes, dtype=int, device=device) for _ in range(2))
            value = wp.empty(2 * nodes, dtype=mat33, device=device)
            back = wp.empty(rows * nodes, dtype=mat33, device=device)
            wp.launch(fill, dim=nodes, device=device,
                      inputs=[position, collider, self.collider_body_index, self.feet, self.ankles, self.response, cell_volume],
                      outputs=[row, column, value, back_row, back_column, back])
            triplets = wp.sparse.bsr_from_triplets
            return (triplets(nodes, rows, row, column, value), triplets(rows, nodes, back_row, back_column, back))

        def impulses(self, state):
            """Of each foot about its ankle [N s, N m s]."""
            impulse, position, collider = self.collect_collider_impulses(state)
            out = wp.zeros((self.feet, 6), dtype=wp.float64, device=self.model.device)
            wp.launch(gather, dim=impulse.shape[0], device=self.model.device,
                      inputs=[impulse, position, collider, self.collider_body_index, self.feet, self.ankles], outputs=[out])
            return out.numpy()

    return Coupled


class Ground:
    """The window in newton, with floor, four walls that have no friction and go with the window, and the soles."""

    def __init__(self, args, soles):
        newton, wp = load_newton()
        self.wp, self.soles, self.args = wp, soles, args
        size = np.array(args.window)
        per_block = max(1, round(args.block / args.voxel))
        self.window = Window(np.maximum(2, np.rint(size[:2] / (per_block * args.voxel))).astype(int), per_block * args.voxel)
        layers = max(2, round(size[2] / args.voxel))
        self.depth = layers * args.voxel
        # Of each block, its lower corner in x and y the origin.
        corner = np.array([0.5 * self.window.block, 0.5 * self.window.block, 0.0])
        self.fresh = [corner + judge_mpm.particles_of(np.array([per_block, per_block, layers]), args.voxel, args.particles, (args.seed, k))
                      for k in range(len(self.window.index))]
        builder = newton.ModelBuilder(gravity=(0.0, 0.0, -GRAVITY))
        solver = coupling(newton, wp)
        solver.register_custom_attributes(builder)
        self.add_particles(builder)
        self.add_bodies(builder, newton)
        self.model = builder.finalize(device=args.device or None)
        self.model.mpm.friction.fill_(args.friction)
        config = solver.Config()
        config.voxel_size, config.max_iterations, config.tolerance = args.voxel, args.iterations, args.tolerance
        config.collider_basis = args.basis
        self.solver = solver(self.model, config=config)
        self.state = self.model.state()
        self.versions = {"newton": newton.__version__, "warp": wp.config.version, "device": self.model.device.name}

    def add_particles(self, builder):
        spacing, points = self.args.voxel / self.args.particles, np.concatenate(self.fresh)
        self.count = len(points)
        builder.add_particles(pos=points.tolist(), vel=[(0.0, 0.0, 0.0)] * self.count,
                              mass=[DENSITY * self.args.solid * spacing**3] * self.count, radius=[spacing / 2] * self.count)

    def add_bodies(self, builder, newton):
        wp, shape = self.wp, newton.ModelBuilder.ShapeConfig
        rough, smooth = shape(mu=self.args.plate_friction, density=0), shape(mu=0.0, density=0)
        for outline in self.soles.outlines:
            points, faces = judge_mpm.plate_mesh(outline, self.args.sole_height)
            points = points + [0, 0, self.soles.height]
            mesh = newton.Mesh(points.astype(np.float32), faces.astype(np.int32).ravel(), compute_inertia=False)
            builder.add_shape_mesh(builder.add_body(), mesh=mesh, cfg=rough)
        frame, size = builder.add_body(), self.window.size()
        high = 0.5 * (self.depth + 0.2)

        def box(middle, half, config):
            builder.add_shape_box(frame, xform=wp.transform(wp.vec3(*map(float, middle)), wp.quat_identity()), hx=float(half[0]),
                                  hy=float(half[1]), hz=float(half[2]), cfg=config)
        box((*0.5 * size, -self.depth - WALL), (*0.5 * size + 4 * WALL, WALL), rough)
        for axis in (0, 1):
            for sign in (-1, 1):
                middle, half = 0.5 * size, 0.5 * size + 4 * WALL
                middle[axis] += sign * (0.5 * size[axis] + WALL)
                half[axis] = WALL
                box((*middle, high - self.depth), (*half, high), smooth)

    def follow(self, place):
        """Bool: the window went on."""
        anew = self.window.follow(place)
        if anew is None:
            return False
        homes, at = self.window.homes(self.window.middle), 0
        for k, points in enumerate(self.fresh):
            own = slice(at, at + len(points))
            at += len(points)
            if anew[k]:
                self.state.particle_q[own].assign((points + [*homes[k] * self.window.block, 0]).astype(np.float32))
                self.state.particle_qd[own].zero_()
                self.state.mpm.particle_qd_grad[own].zero_()
        return True

    def step(self, places, turns, twists, response, dt):
        """Mean wrenches [feet][6] about the ankles of soles with twists that they would have without ground."""
        still, corner = np.zeros(6), self.window.corner()
        poses = [[*place, *quaternion(turn)] for place, turn in zip(places, turns)] + [[*corner, 0, 0, 0, 0, 1]]
        self.state.body_q.assign(np.array(poses, np.float32))
        self.state.body_qd.assign(np.array([*twists, still], np.float32))
        self.solver.set_robot(places, response)
        self.solver.step(self.state, self.state, control=None, contacts=None, dt=dt)
        return self.solver.impulses(self.state) / dt

    def begin(self, q):
        """Settles, and lowers the soles to where the robot stands at first. Returns how far [m]."""
        deep, _ = self.soles.depths(q)
        way, none = max(0.0, float(deep.max()) + 0.0005), np.zeros((len(q.place), 6))
        self.follow(self.soles.middle(q))
        up = q.place + [0, 0, way + self.args.voxel]
        for _ in range(max(1, round(SETTLE / q.dt))):
            self.step(up, q.turn, none, None, q.dt)
        steps = int(np.ceil((way + self.args.voxel) / PRESS_SPEED / q.dt))
        down = np.array([0, 0, -(way + self.args.voxel) / steps])
        led = none + [*(down / q.dt), 0, 0, 0]
        for k in range(steps):
            self.step(up + k * down, q.turn, led, None, q.dt)
        return way


# ---- the walk ----

class Walk:
    """Answers questions. From a lost sole on there is no ground: the robot falls, and those who judge it end the trial by their own rule."""

    def __init__(self, ground, soles, floor, folder=None, outcome=None):
        self.ground, self.soles, self.floor, self.folder = ground, soles, floor, folder
        self.outcome, self.last, self.costs = dict(outcome or {}), None, []
        self.outcome |= {"lost_sole_s": None, "steps": 0, "windows": 0, "speed_off_m_s": 0.0, "pressed_m": 0.0}

    def answer(self, q):
        if self.outcome["lost_sole_s"] is None and self.soles.lost(q, self.floor):
            self.outcome["lost_sole_s"] = float(q.time)
        out = np.zeros((len(q.place), 8))
        if self.outcome["lost_sole_s"] is not None:
            return out
        if self.outcome["steps"] == 0:
            self.outcome["pressed_m"] = self.ground.begin(q)
        else:
            self.outcome["speed_off_m_s"] = max(self.outcome["speed_off_m_s"], float(np.abs(q.twist - self.last)[:, :3].max()))
        begin = time.time()
        self.outcome["windows"] += self.ground.follow(self.soles.middle(q))
        wrench = self.ground.step(q.place, q.turn, q.free, q.response, q.dt)
        self.costs.append(time.time() - begin)
        self.outcome["steps"] += 1
        self.last = q.free + q.dt * (q.response @ wrench.ravel()).reshape(wrench.shape)
        deep, mean = self.soles.depths(q)
        out[:, :6] = wrench
        stands = wrench[:, 2] > 1
        out[stands, 6:] = np.maximum(np.column_stack([deep, mean]), 0)[stands]
        return out

    def report(self, q):
        if self.folder is None:
            return
        seconds = float(np.median(self.costs)) if self.costs else 0.0
        self.outcome |= {"trial": q.trial, "time_s": float(q.time), "dt_s": float(q.dt), "seconds": float(np.sum(self.costs)),
                      "step_ms": 1e3 * seconds, "seconds_per_simulated_second": seconds / float(q.dt), "surface_m": [0.0] * len(q.place)}
        part = self.folder / f"walk-{q.trial}.part"
        part.write_text(json.dumps(self.outcome, indent=1) + "\n")
        part.replace(self.folder / f"walk-{q.trial}.json")


def serve(walk, questions, answers):
    """Files are whole after each tenth of a second, so a walk that is killed leaves what it has."""
    reported, q = 0.0, None
    while (new := read_question(questions)) is not None:
        q = new
        out = walk.answer(q)
        try:
            answers.write(struct.pack(f"{out.size}d", *out.ravel()))
            answers.flush()
        except BrokenPipeError:  # a robot that has gone is the end of the walk
            break
        if q.time >= reported:
            walk.report(q)
            reported = q.time + 0.1
    if q is not None:
        walk.report(q)


def outlines_of(text, sides):
    """`polygon:X,Y,...` of the first foot; a side of -1 is its mirror image."""
    words = text.removeprefix("polygon:").split(",")
    points = np.array([float(word) for word in words]).reshape(-1, 2)
    return [points * [1, side] for side in sides]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sole", required=True, help="polygon:X,Y,... of the first foot, in its frame [m]; the second is its mirror image")
    parser.add_argument("--sole-z", type=float, required=True, help="[m] of the sole in the foot's frame")
    parser.add_argument("--sole-height", type=float, default=judge_mpm.HEIGHT, help="[m] of the block that a foot is")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder of walk-TRIAL.json")
    parser.add_argument("--window", default="0.88,0.56,0.2", help="[m] length, width and depth of the ground that moves with the robot")
    parser.add_argument("--block", type=float, default=0.04, help="[m] by which it goes on")
    parser.add_argument("--friction", type=float, required=True, help="of the ground")
    parser.add_argument("--plate-friction", type=float, default=0.5, help="of soles and floor")
    parser.add_argument("--solid", type=float, default=0.59, help="share of solid volume")
    parser.add_argument("--voxel", type=float, default=0.01, help="[m]")
    parser.add_argument("--particles", type=int, default=2, help="along a voxel's edge")
    parser.add_argument("--iterations", type=int, default=250)
    parser.add_argument("--tolerance", type=float, default=1e-4)
    parser.add_argument("--basis", default="S2", help="of the contact: S2, Q1, pic27")
    parser.add_argument("--seed", type=int, default=1, help="of the particles' places")
    parser.add_argument("--device", default="", help="cuda:0 or cpu; default: Warp's")
    args = parser.parse_args()
    args.window = [float(word) for word in args.window.split(",")]
    return args


def main():
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print is no answer
    args = arguments()
    soles = Soles(outlines_of(args.sole, (1, -1)), args.sole_z)
    ground = Ground(args, soles)
    outcome = {"ground": "newton_mpm", "particles": ground.count, "parameters": {name: value for name, value in vars(args).items()
            if name not in ("sole", "out", "device")}, **ground.versions}
    serve(Walk(ground, soles, ground.depth, args.out, outcome), sys.stdin.buffer, answers)


if __name__ == "__main__":
    main()
