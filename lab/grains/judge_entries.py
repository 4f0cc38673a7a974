"""Models that judge.py judges. A model of your own is a function in a file: `judge.py --entry FILE.py:NAME`

    def NAME(depth, tilt, slip, sole):
        return force_x, force_y, force_z, moment_x, moment_y, moment_z

depth [m] of the middle of the bottom, tilt [rad] positive when the front (+x) is lower, slip [m] forward in the ground, sole:
x, y, area of its squares and depths(depth, tilt). The wrench is that on the sole, about the middle of its bottom, in world
axes. It is asked on ways down and forward; on a way up the force is 0. An object with a method `fit` is given
fit(records, ground) first: {case: (Case, rows)} of two level plates and a drag, and the manifest's numbers of the bed.

The same in C, `judge.py --entry LIB.so:NAME`, is a function of a shared library:

    void NAME(double depth, double tilt, double slip, const double *x, const double *y, const double *area, int squares,
              double wrench[6]);"""
import ctypes
import math

import numpy as np

import mild
from judge_cases import COLUMNS

STEP = 1e-3  # [s] of the ground models
PITCH = 0.005  # [m] of their soles' elements, a grain: half a grain wider on each side, a plate of whole grains is whole elements
REGAIN = 0.28  # [-] regain_length of mild_merged by its slip_length, from loads that slide on grains of 5 mm
GROWTH = 0.07  # [-] slip_growth: squares dragged 40 and 80 mm deep say 0.085 to 0.09, but then a load on small grains sinks too far (lab/grains/README.md)
REFILL = 0.22  # [-] from an imprint pressed again, sand/square100-again
HEAPS = 9  # [-] by the heap of a sole, the mass that moves with it: momentum of sand/square100-drop10 beyond that of a slow press


def row_times(case, rows=150):
    """Times of rows and their stages, and the pose (time, path, depth, pitch) that is led, as grains has them."""
    total = sum(way[1] for way in case.ways)
    times, stages, begin = [], [], 0.0
    for stage, way in enumerate(case.ways):
        count = max(10, round(rows * way[1] / total))
        times.append(begin + way[1] * (np.arange(count) + 1) / count)
        stages.append(np.full(count, stage))
        begin += way[1]
    return np.concatenate(times), np.concatenate(stages)


def as_rows(table, case):
    """Rows at the times of a record, from a table of every step."""
    times, stages = row_times(case)
    table = {name: np.array(column) for name, column in zip(COLUMNS, zip(*table))}
    rows = {name: np.interp(times, table["time"], table[name]) for name in COLUMNS if name != "stage"}
    return {**rows, "stage": stages}


def drag_share(rows):
    """Median of the horizontal force over the load after the first way down."""
    slides = rows["stage"] > 0
    return float(np.median(-rows["fx"][slides] / np.maximum(rows["fz"][slides], 1e-3)))


# ---- models of mild ----

class GroundEntry:
    """A ground model of mild, fitted to level presses by mild.GroundFit; its friction is the drag's. Or not fitted: with a
    material."""

    def __init__(self, model, material=None, pitch=PITCH, slips=False):
        self.name, self.model, self.material, self.pitch = model, model, material, pitch
        self.slips = slips or model == "mild_merged"

    def fit(self, records, ground):
        self.grain = ground["grain"]
        level = [(case, rows) for case, rows in records.values() if case.kind == "press"]
        drags = [(case, rows) for case, rows in records.values() if case.kind == "drag"]
        soles = [mild.Sole(case.sole.outline, self.pitch) for case, _ in level]
        parts = [mild.loading(rows["time"], rows["depth"], rows["fz"]) for _, rows in level]
        # the best curve, also where its parameters have no interval: a judge needs numbers
        data = [X[:, :1] for X, _ in parts], [y for _, y in parts]
        try:
            hold = {"alpha": 0.3} if self.slips else {}  # presses determine tan(alpha)/nu; alpha, the added mass in all
            self.material = mild.Material(mild.GroundFit(soles, self.model, hold=hold).fit(*data).material_, mu=0.5)
        except ValueError:  # a flatter cone keeps nu within its range
            self.material = mild.GroundFit(soles, self.model, hold={"alpha": 0.3}).fit(*data).material_
        if self.slips:
            self.weigh(ground)
            self.fit_slip(soles, data, drags)
        elif self.model.startswith("ecc_quasi"):  # whose coefficients contain friction
            self.material = mild.Material(self.material, mu=0, k_drift=0, b_drift=0)
        else:
            for case, rows in drags:
                self.fit_friction(case, rows)

    def weigh(self, ground):
        """The bed's density, which the soil at the sides of a sole presses with, the grains' friction, and the mass that moves
        with a sole; without merged cones the added mass per depth stays."""
        m, solid = self.material, float(np.mean(ground["solid"]))
        moves = {"c_g": m.c_g * m.phi * m.rho / (solid * ground["density"])}
        if self.model == "mild_merged":
            moves = {"c_d": 1, "c_g": HEAPS / math.tan(m.alpha)}
        self.material = mild.Material(m, phi=solid, rho=ground["density"], mu=ground["friction"], **moves)

    def fit_slip(self, soles, data, drags):
        """slip_length and grip as `mild fit` finds them (src/identify/fit_law.h). A level drag does not determine regain_length, and
        nothing fitted determines refill."""
        hold = {name: getattr(self.material, name) for name in ("alpha", "phi", "rho", "mu")}
        hold["slip_growth"] = GROWTH
        slides = [(mild.Sole(case.sole.outline, self.pitch), np.column_stack([rows[name] for name in ("path", "depth", "fz", "fx")]))
                  for case, rows in drags]
        found = mild.GroundFit(soles, self.model, hold=hold).fit(*data, drags=slides).material_
        self.material = mild.Material(self.material, slip_length=found.slip_length, slip_growth=GROWTH, grip=found.grip,
                                      regain_length=max(REGAIN * found.slip_length, 1e-4), refill=REFILL)

    def fit_friction(self, case, rows):
        """The friction with which the drag's horizontal force is the grains' share of the load."""
        wanted = drag_share(rows)
        for _ in range(4):
            got = max(drag_share(self.play(case)), 1e-6)
            self.material = mild.Material(self.material, mu=float(np.clip(self.material.mu * wanted / got, 0.02, 1.5)))

    def sole(self, case):
        radius = case.sole.radius
        if radius:  # as it comes from below: its frame is at the lowest point, as that of a plate
            return mild.Sole.surface([{"type": "sphere", "size": [radius], "pos": [0, 0, radius]}], self.pitch, radius / 6)
        sole = mild.Sole(case.sole.outline, self.pitch)
        return sole.concentric() if self.model.startswith("con_") else sole

    def play(self, case):
        """Rows of a case, or None for a foot that it has no sole for."""
        if case.sole.radius and self.model.startswith("con_"):  # one element, which has no surface
            return None
        ground = mild.Ground([self.sole(case)], self.material, dt=STEP, tiles=64 if case.kind == "again" else 0)
        table, pose, time, force = [], np.array([0.0, 0.0, -case.start, case.tilt, 0.0]), 0.0, 0.0  # x, y, z, pitch, yaw
        for stage, (kind, seconds, vx, vz, rate, mass, vy, yaw) in enumerate(case.ways):
            mass = mass or (force / 9.81 if kind == "load" else 0.0)
            steps = max(1, round(seconds / STEP))
            speed, dt = np.array([vx, vy, vz, rate, yaw]), seconds / steps
            ground_step(ground, None, mass, dt)
            for _ in range(steps):
                before = pose.copy()
                speed = ground_step(ground, (pose, speed), mass, dt)
                pose = before + dt * speed
                time += dt
                force = ground.force[0, 2]
                table.append((time, stage, -pose[2], pose[0], pose[3], ground.force[0, 0], force, ground.torque[0, 1]))
        return as_rows(table, case)


def ground_step(ground, motion, mass, dt):
    """One step of a plate that is led, or free in z with a mass; returns its speed after it."""
    ground.dt = dt
    ground.inverse_inertia[:] = 0.0
    if mass:
        ground.inverse_inertia[2, 2] = 1 / mass
    if motion is None:
        return None
    (x, y, z, pitch, yaw), (vx, vy, vz, rate, turning) = motion
    c, s, ahead, left = math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
    ground.position[0] = x, y, z
    ground.rotation[0] = [[ahead * c, -left, ahead * s], [left * c, ahead, left * s], [-s, 0, c]]
    ground.velocity[0] = vx, vy, vz, -left * rate, ahead * rate, turning
    ground.free_velocity[0] = vx, vy, vz - (9.81 * dt if mass else 0.0), -left * rate, ahead * rate, turning
    ground.solve()
    ground.advance()
    return np.array([vx, vy, ground.new_velocity[0, 2] if mass else vz, rate, turning])


# ---- functions f(depth, tilt, slip, sole) ----

class EntryError(Exception):
    """What an entry did wrong, in a line that names it."""


class FunctionEntry:
    """A function of the contract above."""

    def __init__(self, name, function):
        self.name, self.function = name, function

    def call(self, function, *arguments):
        try:
            return function(*arguments)
        except Exception as error:
            raise EntryError(f"--entry {self.name}: {type(error).__name__}: {error}") from error

    def fit(self, records, ground):
        if hasattr(self.function, "fit"):
            self.function.fit(records, ground)

    def wrench(self, depth, tilt, slip, sole):
        wrench = self.call(lambda: np.asarray(self.function(depth, tilt, slip, sole), float))
        if wrench.shape != (6,) or not np.isfinite(wrench).all():
            raise EntryError(f"--entry {self.name}: six finite numbers are wanted, fx fy fz mx my mz; at depth {depth:.4g} m, tilt {tilt:.4g} rad, "
                             f"slip {slip:.4g} m it returned {np.array2string(wrench, threshold=6)}".replace("\n", " "))
        return wrench

    def sunk(self, load, depth, tilt, slip, sole):
        """The depth, from `depth` on, at which the function carries a load."""
        low, high = depth, 0.3
        if self.wrench(low, tilt, slip, sole)[2] >= load:
            return low
        for _ in range(40):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self.wrench(middle, tilt, slip, sole)[2] > load else (middle, high)
        return high

    def play(self, case):
        table, depth, slip, tilt, time, load = [], case.start, 0.0, case.tilt, 0.0, 0.0
        for stage, (kind, seconds, vx, vz, rate, mass, *_) in enumerate(case.ways):
            steps = max(20, round(seconds / 5e-3)) if kind != "drop" else round(seconds / 2e-4)
            dt = seconds / steps
            for _ in range(steps):
                slip, tilt, time = slip + dt * vx, tilt + dt * rate, time + dt
                if kind == "load":
                    depth = self.sunk(load, depth, tilt, slip, case.sole)
                elif kind == "drop":
                    push = self.wrench(depth, tilt, slip, case.sole)[2]
                    vz = min(vz + dt * (push / mass - 9.81), 0.0)
                    depth -= dt * vz
                else:
                    depth -= dt * vz
                w = self.wrench(depth, tilt, slip, case.sole) if vz <= 0 else np.zeros(6)
                table.append((time, stage, depth, slip, tilt, w[0], w[2], w[4]))
            load = table[-1][6]
        return as_rows(table, case)


def c_function(file, name):
    """The function of a shared library, as Python's. Raises OSError or AttributeError where there is none."""
    function = getattr(ctypes.CDLL(file), name)
    function.restype = None
    real, reals = ctypes.c_double, np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
    function.argtypes = [real, real, real, reals, reals, reals, ctypes.c_int, reals]

    def wrench(depth, tilt, slip, sole):
        out = np.zeros(6)
        function(depth, tilt, slip, sole.x, sole.y, sole.area, len(sole.x), out)
        return out
    return wrench


def stress_wrench(sole, depth, tilt, pressure, shear):
    """Wrench of a vertical stress and one against +x [Pa] on the squares, on their projected areas."""
    area = sole.area * math.cos(tilt)
    fz, fx = pressure * area, -shear * area
    x = sole.x * math.cos(tilt) + sole.z * math.sin(tilt)
    z = sole.z * math.cos(tilt) - sole.x * math.sin(tilt)
    return fx.sum(), 0.0, fz.sum(), (sole.y * fz).sum(), (z * fx - x * fz).sum(), -(sole.y * fx).sum()


def chrono_scm(depth, tilt, slip, sole):
    """Chrono's SCM with the numbers of its own demo (demo_VEH_SCMTerrain: K_phi 0.2e6, K_c 0, n 1.1, c 0, 30 deg, K 0.01)."""
    sunk = np.maximum(sole.depths(depth, tilt), 0.0)
    pressure = 0.2e6 * sunk**1.1
    return stress_wrench(sole, depth, tilt, pressure, pressure * math.tan(math.radians(30)) * (1 - math.exp(-abs(slip) / 0.01)))


def wong_sand(depth, tilt, slip, sole):
    """The same law with Wong's dry sand (Theory of Ground Vehicles, table 2.3: n 1.1, k_c 0.99e3, k_phi 1528e3, c 1.04e3,
    28 deg), as Chrono's examples have it, K 0.02."""
    sunk = np.maximum(sole.depths(depth, tilt), 0.0)
    pressure = (0.99e3 / sole.width + 1528.43e3) * sunk**1.1
    strength = (1.04e3 * (sunk > 0) + pressure * math.tan(math.radians(28))) * (1 - math.exp(-abs(slip) / 0.02))
    return stress_wrench(sole, depth, tilt, pressure, strength)


class Archimedes:
    """F = K rho g V: the law of Kang, Feng, Liu, Blumenfeld 2018 (Nature Communications 9:1101), K measured on the level plates,
    as they measure it. It says nothing of slip."""

    stress = 0.0  # K rho g [Pa/m]

    def fit(self, records, ground):
        level = [(case, rows) for case, rows in records.values() if case.kind == "press"]
        volume = np.concatenate([np.maximum(rows["depth"], 0) * case.sole.area.sum() for case, rows in level])
        force = np.concatenate([rows["fz"] for _, rows in level])
        self.stress = float(volume @ force / (volume @ volume))

    def __call__(self, depth, tilt, slip, sole):
        return stress_wrench(sole, depth, tilt, self.stress * np.maximum(sole.depths(depth, tilt), 0.0), np.zeros(len(sole.x)))


def rft_stress(ground, friction):
    """3D-RFT without a fit: xi [Pa/m] from density and internal friction (Agarwal, Goldman, Kamrin, PNAS 120, 2023)."""
    density = ground["density"] * float(np.mean(ground["solid"]))
    return density * 9.81 * (894 * friction**3 - 386 * friction**2 + 89 * friction)


class TableEntry:
    """Predictions in a CSV: case,time_s,depth_m,force_x_n,force_z_n,moment_y_nm; what it lacks is not judged."""

    def __init__(self, name, file):
        self.name = name
        self.table = np.genfromtxt(file, delimiter=",", names=True, dtype=None, encoding="utf-8")

    def fit(self, records, ground):
        pass

    def play(self, case):
        rows = self.table[self.table["case"] == case.name]
        if len(rows) == 0:
            return None
        times, stages = row_times(case)
        names = {"depth": "depth_m", "fx": "force_x_n", "fz": "force_z_n", "my": "moment_y_nm"}
        found = {name: np.interp(times, rows["time_s"], rows[column]) for name, column in names.items()}
        begin = np.cumsum([0.0] + [way[1] for way in case.ways])
        path = np.interp(times, begin, np.cumsum([0.0] + [way[1] * way[2] for way in case.ways]))
        pitch = case.tilt + np.interp(times, begin, np.cumsum([0.0] + [way[1] * way[4] for way in case.ways]))
        return {**found, "time": times, "stage": stages, "path": path, "pitch": pitch}
