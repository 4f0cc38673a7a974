"""What a grain simulation is and what is measured of it, for judge.py: cases as lab/grains/run.py writes them, soles, the way of a
plate, and the numbers in which a model and the grains are compared."""
import math

import numpy as np

COLUMNS = ("time", "stage", "depth", "path", "pitch", "fx", "fz", "my")  # of rows; SI, about the middle of the bottom
GAP = 0.0005  # [m] above the surface, where a case begins
EDGE = 0.5  # [-] of a grain: how much wider than it is a body touches, on each side (Sole)


def widened(outline, by):
    """An outline with every side moved outward by `by` [m]; corners stay corners."""
    side = np.roll(outline, -1, 0) - outline
    out = np.column_stack([side[:, 1], -side[:, 0]]) / np.hypot(*side.T)[:, None]
    before = np.roll(out, 1, 0)  # the corner moves by what moves both of its sides
    return outline + by * (before + out) / (1 + (before * out).sum(1))[:, None]


class Sole:
    """A plate: kind, outline (points, 2) [m], the radius of a sphere or 0, and squares of it: x, y, z (from the lowest
    point) and area.

    edge [m]: what grains of the radius r = edge touch. A grain touches a body where its centre is r from it, so what the
    centres meet is the body with r around it; and they begin r below the surface, which is where a plate touches first. A
    ball of the radius R that is u deep thus touches the grains of a level layer within sqrt(2 (R + r) u - u^2): it is a ball of R + r. The edge
    of a plate is a ball of R = 0: it touches within sqrt(2 r u - u^2) beyond the outline, and within r from u = r on."""

    def __init__(self, text, pitch=0.004, edge=0.0):
        self.text, (self.kind, numbers) = text, text.split(":")
        v = [float(number) for number in numbers.split(",")]
        self.radius = v[0] + edge if self.kind == "sphere" else 0.0
        if self.kind in ("disc", "sphere"):
            angle = 2 * math.pi * np.arange(48) / 48
            self.outline = (0.5 * v[0] if self.kind == "disc" else v[0]) * np.column_stack([np.cos(angle), np.sin(angle)])
        elif self.kind == "rect":
            self.outline = 0.5 * np.array([[-v[0], -v[1]], [v[0], -v[1]], [v[0], v[1]], [-v[0], v[1]]])
        else:
            self.outline = np.array(v).reshape(-1, 2)
        self.outline = widened(self.outline, edge) if edge else self.outline
        (x0, y0), (x1, y1) = self.outline.min(0), self.outline.max(0)
        self.length, self.width = x1 - x0, min(x1 - x0, y1 - y0)
        nx, ny = math.ceil((x1 - x0) / pitch), math.ceil((y1 - y0) / pitch)
        x, y = np.meshgrid(x0 + (np.arange(nx) + 0.5) * (x1 - x0) / nx, y0 + (np.arange(ny) + 0.5) * (y1 - y0) / ny)
        inside = self._inside(x.ravel(), y.ravel())
        self.x, self.y = x.ravel()[inside], y.ravel()[inside]
        self.area = np.full(len(self.x), (x1 - x0) / nx * (y1 - y0) / ny)
        self.z = self.radius - np.sqrt(np.maximum(self.radius**2 - self.x**2 - self.y**2, 0)) if self.radius else 0 * self.x

    def _inside(self, x, y):
        inside = np.zeros(len(x), bool)
        for (ax, ay), (bx, by) in zip(self.outline, np.roll(self.outline, 1, 0)):
            with np.errstate(divide="ignore", invalid="ignore"):
                inside ^= ((ay > y) != (by > y)) & (x < ax + (bx - ax) * (y - ay) / (by - ay))
        return inside

    def depths(self, depth, tilt):
        """Depth of each square [m] when the middle of the bottom is at `depth`."""
        return depth + self.x * math.sin(tilt) - self.z * math.cos(tilt)


def outline_distance(sole):
    """[m] Of each square of a sole to its outline."""
    distance, points = np.full(len(sole.x), np.inf), np.column_stack([sole.x, sole.y])
    for a, b in zip(sole.outline, np.roll(sole.outline, -1, 0)):
        along = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        distance = np.minimum(distance, np.hypot(*(points - a - along[:, None] * (b - a)).T))
    return distance


class Case:
    """NAME SHAPE TILT STAGE..., as lab/grains/plan.h has it. ways: (kind, seconds, vx, vz up, pitch rate, mass, vy, yaw rate) of each stage;
    plate: the body; sole: what of it touches grains whose radius is `edge` [m], which models are given."""

    def __init__(self, text, edge=0.0):
        self.key = ""  # FAMILY/NAME, for who knows the family
        self.name, shape, tilt, *stages = text.split()
        self.text, self.plate, self.sole, self.tilt = text, Sole(shape), Sole(shape, edge=edge), math.radians(float(tilt))
        self.start = -GAP - max(float((self.plate.outline[:, 0] * math.sin(self.tilt)).max()), 0.0) * (not self.plate.radius)
        self.ways, self.deepest, depth = [], self.start, self.start  # deepest: where the last way down or up leads
        for stage in stages:
            kind, numbers = stage.split(":")
            v = [float(number) for number in numbers.replace("@", ",").split(",")]
            if kind == "press":
                self.ways.append((kind, abs(v[0] - depth) / v[1], 0.0, math.copysign(v[1], depth - v[0]), 0.0, 0.0, 0.0, 0.0))
                depth = self.deepest = v[0]
            elif kind in ("drag", "load"):
                self.ways.append((kind, abs(v[0]) / v[1], math.copysign(v[1], v[0]), 0.0, 0.0, 0.0, 0.0, 0.0))
            elif kind == "swipe":
                angle = math.radians(v[0])
                self.ways.append((kind, abs(angle) / v[1], 0.0, 0.0, math.copysign(v[1], angle), 0.0, 0.0, 0.0))
            elif kind == "drop":
                self.ways.append((kind, v[2], 0.0, -v[1], 0.0, v[0], 0.0, 0.0))
            elif kind == "move":
                vx, vy, vz, pitch, yaw, seconds, *mass = v
                self.ways.append((kind, seconds, vx, vz, pitch, mass[0] if mass else 0.0, vy, yaw))
                depth -= vz * seconds * (not mass)
            else:
                self.ways.append((kind, v[0], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))

    @property
    def kind(self):
        return "again" if sum(way[0] == "press" for way in self.ways) > 1 else self.ways[-1][0]


# ---- measures ----

# name: (what it is in words, unit of the error: "rel" of the grains' value, "F0" of the force before, "mm")
MEASURES = {
    "force": ("mean force, deepest 40 % of the way", "rel"),
    "moment": ("mean true moment, the same rows", "rel"),
    "pressure_center": ("centre of pressure, the same rows", "mm"),
    "traction": ("horizontal force over the force up, the same rows, tilted", "F0"),
    "load_10mm": ("force after 10 mm of drag over that before", "F0"),
    "load_end": ("force at the end of the drag over that before", "F0"),
    "grip": ("largest horizontal force over F0; under load, its mean over the load", "F0"),
    "swipe": ("largest moment of a turn over width times force before", "F0"),
    "sinkage": ("depth gained under load and slip, or of a fall", "mm"),
    "again": ("work to press the imprint again over the first", "F0"),
}


def before(rows, stage):
    """Force at the end of the stage before: mean of its last three rows."""
    return rows["fz"][rows["stage"] == stage - 1][-3:].mean()


def measure_press(case, rows):
    stage = rows["stage"] == len(case.ways) - 1
    start = max(case.start, rows["depth"][stage][0])
    deep = stage & (rows["depth"] > start + 0.6 * (rows["depth"][stage][-1] - start))
    force, moment = rows["fz"][deep].mean(), rows["my"][deep].mean()
    normal = math.cos(case.tilt) * force + math.sin(case.tilt) * rows["fx"][deep].mean()
    out = {"force": force}
    if case.tilt:  # of a level plate it is noise, or says only where the outline's middle is
        out["moment"] = moment
        out["traction"] = rows["fx"][deep].mean() / force if force else math.nan
    if case.tilt or case.plate.kind == "polygon":
        out["pressure_center"] = -1e3 * moment / normal if normal else math.nan
    return out


def measure_slip(case, rows, kind):
    stage = rows["stage"] == len(case.ways) - 1
    first, force, way = before(rows, len(case.ways) - 1), rows["fz"][stage], rows["path"][stage] - rows["path"][stage][0]
    if kind == "load":
        return {"sinkage": 1e3 * (rows["depth"][stage][-1] - rows["depth"][~stage][-1]),
                "grip": np.abs(rows["fx"][stage]).mean() / max(force.mean(), 1e-9)}
    return {"load_10mm": force[np.abs(way - 0.01) < 0.002].mean() / first, "load_end": force[-len(force) // 4:].mean() / first,
            "grip": np.abs(rows["fx"][stage]).max() / first}


def measure_again(rows):
    def work(stage):
        way = rows["stage"] == stage
        depth, force = rows["depth"][way], rows["fz"][way]
        top = rows["depth"][rows["stage"] == 0][-1]
        keep = (depth >= 0) & (depth <= top)
        return np.trapezoid(force[keep], depth[keep]) if hasattr(np, "trapezoid") else np.trapz(force[keep], depth[keep])
    return {"again": work(2) / work(0)}


def measures(case, rows):
    """{name: value} of MEASURES that this case has. rows: a dict of arrays, COLUMNS."""
    kind = case.kind
    if kind == "again":
        return measure_again(rows)
    if kind in ("drag", "load"):
        return measure_slip(case, rows, kind)
    if kind == "swipe":
        stage = rows["stage"] == len(case.ways) - 1
        return {"swipe": np.abs(rows["my"][stage]).max() / (case.plate.length * before(rows, len(case.ways) - 1))}
    if kind == "drop":
        return {"sinkage": 1e3 * rows["depth"].max()}
    return measure_press(case, rows)


def scale(name, value):
    """What an error of this measure is divided by; with the sign of the grains' number, so that an error is a ratio less 1."""
    return value if MEASURES[name][1] == "rel" else 1.0
