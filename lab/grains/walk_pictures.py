"""Stances, figure and video of the walks on grains, for lab/grains/walk.py."""
import csv
import json
import subprocess

import numpy as np

import walk_manifest

CONTACT, PAUSE, SHORTEST = 5.0, 0.03, 0.1  # [N] [s] [s] of a stance
ENDS = 0.05  # [s] at which its pressure centre is reported
PERIOD = 0.01  # [s] of the policy: of the rows of records of before 2026-11-23; later ones have a row for each physics step
COLOURS = {"grains": "#222222", "mild": "#1f77b4", "mild_merged": "#d62728", "bekker": "#2ca02c", "ecc_quasi_3d": "#9467bd", "newton_mpm": "#ff7f0e"}
# What walk-0.json of a ground by another program says of its walk, and what eval.json does.
REPORTED = {"grains": ("time_s", "lost_sole_s", "seconds", "steps", "late_lists", "full_lists", "surface_m"),
        "newton_mpm": ("time_s", "lost_sole_s", "seconds", "steps", "dt_s", "particles", "step_ms", "seconds_per_simulated_second",
                       "speed_off_m_s", "parameters", "device")}
WANTED = ("trials", "success", "ends", "seconds", "velocity", "cot", "penetration", "torque_max", "flight", "load_peak", "rise", "stride")
SHARE = np.linspace(0, 1, 41)  # of a stance
HEAP = 0.03  # [m] over the surface; what is higher flies


def read(file):
    table = np.genfromtxt(file, delimiter=",", names=True, dtype=None, encoding=None)
    return {name: np.atleast_1d(table[name]) for name in table.dtype.names}


# ---- stances ----

def policy_steps(feet):
    """Rows of PERIOD, as all records had them: forces are means, depths the deepest, the rest is as the step ends."""
    step = np.ceil(feet["time_s"] / PERIOD - 1e-3).astype(int)
    order = np.lexsort((step, feet["foot"], feet["trial"]))
    feet, step = {name: values[order] for name, values in feet.items()}, step[order]
    new = np.any([np.diff(values) != 0 for values in (feet["trial"], feet["foot"], step)], axis=0)
    first = np.concatenate([[0], np.flatnonzero(new) + 1])
    last = np.append(first[1:], len(step)) - 1
    rows = {name: values[last] for name, values in feet.items()}
    for name in ("force_x_n", "force_y_n", "force_z_n"):
        rows[name] = np.add.reduceat(feet[name], first) / (last - first + 1)
    return {**rows, "depth_m": np.maximum.reduceat(feet["depth_m"], first)}


class Stance:
    """Rows of one foot, from touchdown to lift-off."""

    def __init__(self, feet, rows):
        at = {name: values[rows] for name, values in feet.items()}
        self.trial, self.foot = int(at["trial"][0]), int(at["foot"][0])
        self.time, self.force = at["time_s"], at["force_z_n"]
        self.depth, self.center = at["depth_m"], at["center_x_m"]
        self.slide = np.hypot(at["force_x_n"], at["force_y_n"])
        self.way = float(np.hypot(np.ptp(at["ankle_x_m"]), np.ptp(at["ankle_y_m"])))
        self.pitch = at["pitch_rad"]

    def curve(self, values):
        share = (self.time - self.time[0]) / max(self.time[-1] - self.time[0], 1e-9)
        return np.interp(SHARE, share, values)

    def row(self):
        load = np.maximum(self.force, 0)
        ends = [self.center[part].mean() for part in (self.time < self.time[0] + ENDS - 1e-6, self.time > self.time[-1] - ENDS + 1e-6)]
        return {"trial": self.trial, "foot": self.foot, "start_s": f"{self.time[0]:.2f}",
                "duration_s": f"{self.time[-1] - self.time[0] + PERIOD:.2f}", "force_max_n": f"{self.force.max():.1f}",
                "force_mean_n": f"{self.force.mean():.1f}", "horizontal_max_n": f"{self.slide.max():.1f}",
                "depth_max_m": f"{self.depth.max():.4f}", "center_x_m": f"{(load * self.center).sum() / load.sum():.4f}",
                "center_x_first_m": f"{ends[0]:.4f}", "center_x_last_m": f"{ends[1]:.4f}",
                "ankle_way_m": f"{self.way:.4f}", "pitch_min_rad": f"{self.pitch.min():.3f}", "pitch_max_rad": f"{self.pitch.max():.3f}"}


def stances(file, skip=1.0):
    """Whole stances that begin after `skip` seconds; those of a fall's last half second are left out."""
    feet, found = policy_steps(read(file)), []
    for trial in np.unique(feet["trial"]):
        end = feet["time_s"][feet["trial"] == trial].max()
        for foot in np.unique(feet["foot"]):
            own = np.flatnonzero((feet["trial"] == trial) & (feet["foot"] == foot))
            loaded = own[feet["force_z_n"][own] > CONTACT]
            for rows in np.split(loaded, np.flatnonzero(np.diff(feet["time_s"][loaded]) > PAUSE + 0.011) + 1):
                if len(rows) < 2:
                    continue
                first, last = feet["time_s"][rows[0]], feet["time_s"][rows[-1]]
                if last - first >= SHORTEST and first >= skip and last < end - 0.05:
                    found.append(Stance(feet, rows))
    return found


def folders(out, family, speed):
    """Those that have been walked, grains first."""
    return {name: out / family / speed / name for name in COLOURS if (out / family / speed / name / "eval.json").exists()}


def number(value, digits):
    return "-" if value is None else f"{value:.{digits}f}"


def summary(folder):
    row = json.loads((folder / "eval.json").read_text())["rows"][0]
    ends = ", ".join(f"{count} {end}" for end, count in row["ends"].items() if count and end != "time")
    return {"upright": f"{row['success']}/{row['trials']}", "ends": ends, "seconds": number(row["seconds"], 1),
            "speed": number(row["velocity"], 3), "cost": number(row["cot"], 2), "sink": number(row["penetration"] * 1e3, 0)
            if row["penetration"] is not None else "-"}


def write_stances(out, families, speeds, file):
    with open(file, "w", newline="") as csv_file:
        writer = None
        for family in families:
            for speed in speeds:
                for name, folder in folders(out, family, speed).items():
                    for stance in stances(folder / "feet.csv"):
                        row = {"family": family, "speed_m_s": speed, "ground": name, **stance.row()}
                        writer = writer or csv.DictWriter(csv_file, row)
                        if csv_file.tell() == 0:
                            writer.writeheader()
                        writer.writerow(row)


def write_walks(out, families, speeds, file):
    """What became of each walk; of one on grains that was killed, how far it had come."""
    walks = []
    for family in families:
        for speed in speeds:
            for name in COLOURS:
                folder = out / family / speed / name
                row = {"family": family, "speed_m_s": float(speed), "ground": name}
                if name in REPORTED and (folder / "walk-0.json").exists():
                    report = json.loads((folder / "walk-0.json").read_text())
                    row[name] = {key: report[key] for key in REPORTED[name]}
                if (folder / "eval.json").exists():
                    judged = json.loads((folder / "eval.json").read_text())["rows"][0]
                    row |= {key: judged[key] for key in WANTED if key in judged}
                if len(row) > 3:
                    walks.append(row | walk_manifest.read(folder))
    file.write_text(json.dumps(walks, indent=1) + "\n")


# ---- figure ----

def draw_curves(axis, name, found, pick, scale):
    curves = np.array([stance.curve(pick(stance)) for stance in found]) * scale
    if name == "grains":
        axis.plot(100 * SHARE, curves.T, color=COLOURS[name], linewidth=0.5, alpha=0.45)
    middle = np.median(curves, 0)
    axis.plot(100 * SHARE, middle, color=COLOURS[name], linewidth=2.2 if name == "grains" else 1.6, label=name)


def figure(out, family, speeds, image):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    plots = (("force up [N]", lambda s: s.force, 1), ("pressure centre before the ankle [mm]", lambda s: s.center, 1e3),
             ("deepest point [mm]", lambda s: s.depth, 1e3))
    plt.rcParams.update({"font.size": 9, "svg.hashsalt": "walk"})
    figure_, axes = plt.subplots(len(speeds), 4, figsize=(13, 3.4 * len(speeds)), squeeze=False, gridspec_kw={"width_ratios": (1, 1, 1, 1.25)})
    for row, speed in zip(axes, speeds):
        walked = folders(out, family, speed)
        for name, folder in reversed(walked.items()):
            found = stances(folder / "feet.csv")
            for axis, (_, pick, scale) in zip(row, plots):
                if found:
                    draw_curves(axis, name, found, pick, scale)
        for axis, (label, _, _) in zip(row, plots):
            axis.set_xlabel("share of the stance [%]")
            axis.set_title(f"{speed} m/s: {label}", fontsize=9)
            axis.grid(alpha=0.25)
        row[3].axis("off")
        cells = [[name, s["upright"], s["seconds"], s["speed"], s["cost"], s["sink"]] for name, s in
                 ((name, summary(folder)) for name, folder in walked.items())]
        if cells:
            table = row[3].table(cells, colLabels=["ground", "upright", "s", "m/s", "cost", "sunk [mm]"], loc="center", cellLoc="center")
            table.auto_set_font_size(False)
            table.set_fontsize(8)
            table.scale(1.05, 1.5)
            table.auto_set_column_width(range(6))
            for line, cell in enumerate(cells, 1):
                table[line, 0].get_text().set_color(COLOURS[cell[0]])
    axes[0][0].legend(fontsize=7)
    figure_.tight_layout()
    image.parent.mkdir(parents=True, exist_ok=True)
    figure_.savefig(image, metadata={"Date": None} if image.suffix == ".svg" else None, dpi=110)


# ---- video ----

class Grains:
    """The places of a walk's grains, picture by picture. Places are [m], x and y from the robot's start, z from the surface."""

    def __init__(self, folder, trial=0):
        self.info = json.loads((folder / f"walk-{trial}.json").read_text())
        per, beds, self.tiles = (int(self.info[name]) for name in ("grains_of_tile", "beds", "tiles"))
        raw = np.fromfile(folder / f"beds-{trial}.bin", np.uint16).reshape(beds, per, 4)
        self.file = open(folder / f"frames-{trial}.bin", "rb")
        self.unit = self.info["unit_m"]
        tile = self.info["tile_m"] / self.unit
        self.place, self.radius, self.start = [], [], []
        for bed in raw:
            x = (bed[None, :, 0] + np.arange(self.tiles)[:, None] * tile).ravel()
            rest = [np.tile(bed[:, k], self.tiles).astype(np.int32) for k in (1, 2)]
            self.place.append(np.stack([np.rint(x).astype(np.int32), *rest], 1))
            self.radius.append(np.tile(bed[:, 3], self.tiles) * 1e-6)
            self.start.append(self.place[-1].copy())
        self.moved = [np.zeros(len(place), bool) for place in self.place]
        self.flies = [np.zeros(len(place), np.int16) for place in self.place]  # pictures since it last moved

    def step(self):
        """Bool: there is another picture."""
        for place, moved, flies in zip(self.place, self.moved, self.flies):
            head = self.file.read(4)
            if len(head) < 4:
                return False
            count = int(np.frombuffer(head, np.uint32)[0])
            number = np.cumsum(np.frombuffer(self.file.read(4 * count), np.uint32), dtype=np.uint32).astype(np.int64)
            way = np.frombuffer(self.file.read(6 * count), np.int16).reshape(3, count)
            place[number] += way.T
            moved[number] = True
            flies += 1
            flies[number] = 0
        return True

    def metres(self, bed, which, places=None):
        at = (self.place if places is None else places)[bed][which] * self.unit
        at[:, 0] -= 0.5 * self.tiles * self.info["tile_m"]
        at[:, 1] -= 0.5 * self.info["width_m"]
        at[:, 2] -= self.info["surface_m"][bed]
        return at


def colours(red, green, blue):
    return (np.rint(red) + 256 * np.rint(green) + 65536 * np.rint(blue)).astype(np.float32)


def grain_spheres(grains, eye_x, span=1.1, deep=0.15):
    """Left of the middle the left foot's bed, right of it the right foot's; sand in stripes of 50 mm where it lay at first."""
    parts = []
    for bed, side in ((0, 1), (1, -1)):
        place = grains.place[bed]
        x = place[:, 0] * grains.unit - 0.5 * grains.tiles * grains.info["tile_m"]
        y = place[:, 1] * grains.unit - 0.5 * grains.info["width_m"]
        z = place[:, 2] * grains.unit - grains.info["surface_m"][bed]
        near = (np.abs(x - eye_x) < span) & (side * y >= 0) & (grains.radius[bed] > 0)
        near &= (z < HEAP) | (grains.flies[bed] < 2)  # those that a window left in the air are not shown
        shown = np.flatnonzero(near & ((z > -0.025) | (grains.moved[bed] & (z > -deep)) | (np.abs(y) > 0.5 * grains.info["width_m"] - 0.012)))
        at = grains.metres(bed, shown)
        before = grains.metres(bed, shown, grains.start)
        stripe = (np.floor(before[:, 0] / 0.05).astype(int) % 2).astype(float)
        dark = np.clip(1 + before[:, 2] / 0.12, 0.45, 1)
        out = np.zeros((len(shown), 8), np.float32)
        out[:, :3], out[:, 3] = at, grains.radius[bed][shown]
        out[:, 7] = colours(dark * (214 + 22 * stripe), dark * (178 + 30 * stripe), dark * (122 + 42 * stripe))
        parts.append(out)
    return parts


def shape_points(kind, size, step):
    """Points and normals on a geom's surface, in its frame."""
    if kind == "BOX":
        points, normals = [], []
        for axis in range(3):
            a, b = [k for k in range(3) if k != axis]
            u, v = np.meshgrid(np.arange(-size[a], size[a] + step / 2, step), np.arange(-size[b], size[b] + step / 2, step))
            for sign in (-1, 1):
                face = np.zeros((u.size, 3))
                face[:, a], face[:, b], face[:, axis] = u.ravel(), v.ravel(), sign * size[axis]
                points.append(face)
                normals.append(np.tile(np.eye(3)[axis] * sign, (u.size, 1)))
        return np.concatenate(points), np.concatenate(normals)
    if kind == "ELLIPSOID":
        count = int(4 * np.pi * (max(size) / step)**2) + 20
        k = np.arange(count) + 0.5
        z, turn = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
        unit = np.stack([np.cos(turn) * np.sqrt(1 - z * z), np.sin(turn) * np.sqrt(1 - z * z), z], 1)
        normals = unit / size
        return unit * size, normals / np.linalg.norm(normals, axis=1)[:, None]
    radius, half = size[0], size[1]  # cylinder or capsule along z
    turn = np.arange(0, 2 * np.pi, step / radius)
    z, angle = np.meshgrid(np.arange(-half, half + step / 2, step), turn)
    side = np.stack([np.cos(angle.ravel()), np.sin(angle.ravel()), 0 * angle.ravel()], 1)
    points, normals = [side * radius + np.outer(z.ravel(), [0, 0, 1])], [side]
    if kind == "CAPSULE":
        ends, unit = shape_points("ELLIPSOID", np.full(3, radius), step)
        points.append(ends + np.outer(np.sign(ends[:, 2]) * half, [0, 0, 1]))
        normals.append(unit)
    else:
        for r in np.arange(step / 2, radius, step):
            ring = np.arange(0, 2 * np.pi, step / r)
            for sign in (-1, 1):
                points.append(np.stack([r * np.cos(ring), r * np.sin(ring), np.full(ring.size, sign * half)], 1))
                normals.append(np.tile([0, 0, sign], (ring.size, 1)))
    return np.concatenate(points), np.concatenate(normals)


class Body:
    """The robot as points, posed by the files of `mild eval`."""

    def __init__(self, root, robot, folder, step=0.004):
        import mujoco
        self.mujoco = mujoco
        self.model = mujoco.MjModel.from_xml_path(str(root / "robots" / robot / f"{robot}.xml"))
        self.data = mujoco.MjData(self.model)
        self.track, self.actions = read(folder / "track.csv"), read(folder / "actions.csv")
        own = self.track["trial"] == 0
        self.track = {name: values[own] for name, values in self.track.items()}
        own = self.actions["trial"] == 0
        self.actions = {name: values[own] for name, values in self.actions.items() if not name.startswith("observation")}
        self.parts = []
        for geom in range(self.model.ngeom):
            if self.model.geom_group[geom] != 1:
                continue
            kind = mujoco.mjtGeom(self.model.geom_type[geom]).name.removeprefix("mjGEOM_")
            name = self.model.body(self.model.geom_bodyid[geom]).name
            grey = (70, 74, 82) if "6_link" in name else (150, 156, 166) if "base" in name else (196, 200, 206)
            self.parts.append((geom, *shape_points(kind, self.model.geom_size[geom], step), colours(*grey)))
        self.step = step

    def pose(self, time):
        """Row k of the track is the state after k + 1 policy steps; row k of the actions the one before that step."""
        k = min(max(int(round(time / 0.01)), 1), len(self.actions["time_s"]) - 1)
        self.data.qpos[:3] = [self.track[f"base_{axis}_m"][k - 1] for axis in "xyz"]
        self.data.qpos[3:7] = [self.actions[f"quaternion_{part}"][k] for part in "wxyz"]
        for joint in range(1, self.model.njnt):
            self.data.qpos[self.model.jnt_qposadr[joint]] = self.actions[f"angle_{self.model.joint(joint).name}_rad"][k]
        self.mujoco.mj_forward(self.model, self.data)
        return float(self.data.qpos[0])

    def spheres(self):
        for geom, points, normals, colour in self.parts:
            turn, at = self.data.geom_xmat[geom].reshape(3, 3), self.data.geom_xpos[geom]
            out = np.empty((len(points), 8), np.float32)
            out[:, :3], out[:, 3], out[:, 4:7], out[:, 7] = points @ turn.T + at, 0.8 * self.step, normals @ turn.T, colour
            yield out


def camera(x, size, aim, distance):
    forward = np.array([-0.34, 0.80, -0.48])
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    target = np.array([x + aim[0], aim[1], aim[2]])
    return [*(target - distance * forward), *right, *np.cross(right, forward), *forward, 1.5 * size[0], *size]


def video(root, robot, folder, draw, file, still=None):
    """An MP4 of a walk, and with `still` = (picture, file) one of them as a PNG."""
    grains, body, size = Grains(folder), Body(root, robot, folder), (1920, 1080)
    rate = grains.info["pictures_per_s"]
    painter = subprocess.Popen([str(draw)], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    raw = ["ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}"]
    film = subprocess.Popen([*raw, "-r", f"{rate:g}", "-i", "pipe:0", "-vf", "scale=1280:720:flags=area", "-c:v", "libx264", "-crf", "24",
                             "-preset", "slow", "-pix_fmt", "yuv420p", "-movflags", "+faststart", str(file)], stdin=subprocess.PIPE)
    picture, smooth = 0, None
    while grains.step():
        x = body.pose(picture / rate)
        smooth = x if smooth is None else smooth + 0.15 * (x - smooth)
        parts = grain_spheres(grains, smooth) + list(body.spheres())
        head = np.array([*camera(smooth, size, (0.05, 0.02, 0.10), 2.15), sum(len(part) for part in parts)], np.float32)
        painter.stdin.write(head.tobytes() + b"".join(part.tobytes() for part in parts))
        painter.stdin.flush()
        frame = painter.stdout.read(3 * size[0] * size[1])
        film.stdin.write(frame)
        if still and picture == still[0]:
            subprocess.run([*raw, "-i", "pipe:0", "-vf", "scale=1280:720:flags=area", str(still[1])], input=frame, check=True)
        picture += 1
    painter.stdin.close()
    film.stdin.close()
    return picture, painter.wait() or film.wait()

