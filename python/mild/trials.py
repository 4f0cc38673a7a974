"""Anybody's policy on soft ground (docs/public-policies.md): mild.trial, and the command `mild trial`."""
import argparse
import contextlib
import dataclasses
import json
import math
import os
import pathlib
import subprocess
import sys
import types
import typing
import warnings
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from . import _processor, networks, readers
from ._stand import area, lowest, stand
from .describe import KEYS, TABLES, TERMS, Description, Observer, State, layouts

if typing.TYPE_CHECKING:
    import mujoco

GROUNDS = ("rigid", "rubber", "foam60", "foam45", "foam28", "foam25", "grass", "sand_loose", "sand_dense")
TILT = 1.0  # [rad] a base that leans more has fallen
LOW = 0.4  # a base that is less than this part of its height at the start above the ground and above its lowest sole has fallen
STANDS = 0.25  # who walks at less than this part of the command stands
SPEED, SECONDS = 0.5, 10.0  # [m/s], [s] of a trial for which nobody says
SETTLE, LEAST = 2.0, 2.5  # [s] speed and cost count after the first, of walks longer than the second; as in mild eval


@dataclasses.dataclass
class Walk:
    """One trial."""
    seed: int
    time: float  # [s] until it fell or ended
    end: str  # time, tilt, base, not_finite
    speed: float | None  # [m/s] along its heading
    sideways: float | None
    cost: float | None  # cost of transport
    torque: float  # [N m] largest
    sinkage: float | None  # [m] deepest element of a stance, mean over stances


@dataclasses.dataclass
class Row:
    """One ground and one speed."""
    ground: str
    command: tuple[float, float, float]
    walks: list[Walk]

    @property
    def upright(self) -> int:
        return sum(walk.end == "time" for walk in self.walks)

    def mean(self, key: str) -> float | None:
        """Of a key of Walk; of speeds and cost over those that stayed upright."""
        walks = self.walks if key == "sinkage" else [walk for walk in self.walks if walk.end == "time"]
        values = [getattr(walk, key) for walk in walks if getattr(walk, key) is not None]
        return float(np.mean(values)) if values else None

    @property
    def torque(self) -> float:
        return max(walk.torque for walk in self.walks)

    @property
    def falls(self) -> tuple[float, ...]:
        """[s] first and last time of a fall; empty without one."""
        times = [walk.time for walk in self.walks if walk.end != "time"]
        return (min(times), max(times)) if times else ()


@dataclasses.dataclass
class Table:
    """What mild.trial returns: rows, and about what."""
    about: dict[str, object]
    rows: list[Row]

    def as_dict(self) -> dict:
        """As docs/schema/trial.json."""
        rows = [{"ground": row.ground, "command": list(row.command), "trials": len(row.walks), "upright": row.upright,
                 "speed": row.mean("speed"), "sideways": row.mean("sideways"), "cost": row.mean("cost"), "torque": row.torque,
                 "sinkage": row.mean("sinkage"), "falls": list(row.falls),
                 **self.more(row), "each": [dataclasses.asdict(walk) for walk in row.walks]} for row in self.rows]
        return {**self.about, "rows": rows}

    def more(self, row: Row) -> dict:
        """What a row has of a tour alone."""
        return _tour().row(row) if self.about.get("course") == "tour" else {}

    def remarks(self) -> list[str]:
        """What its rows on rigid ground say against the description, as lines; of a tour nothing."""
        lines = []
        for row in [] if self.about.get("course") else self.rows:
            speed, wanted = row.mean("speed"), row.command[0]
            if row.ground == "rigid" and wanted and 2 * row.upright < len(row.walks):
                lines.append(f"rigid: it falls at {wanted:g} m/s; unless it is known to, the description is wrong: compare --check with its training")
            elif row.ground == "rigid" and speed is not None and abs(speed) < STANDS * abs(wanted):
                lines.append(f"rigid: it stands at {wanted:g} m/s; a dead zone of its command, or a wrong description: try --speed {2 * wanted:g}")
        return lines

    def __str__(self) -> str:
        if self.about.get("course") == "tour":
            return _tour().text(self)
        lines = [f"{'ground':<12}{'command':>8}{'upright':>10}{'speed':>8}{'cost':>7}{'torque':>8}{'sinkage':>9}  falls after"]
        for row in self.rows:
            falls = f"{row.falls[0]:.1f} to {row.falls[1]:.1f} s" if row.falls else ""
            sinkage = row.mean("sinkage")
            upright, sinkage = f"{row.upright} of {len(row.walks)}", text(None if sinkage is None else 1e3 * sinkage, 0)
            lines.append(f"{row.ground:<12}{row.command[0]:>8.2f}{upright:>10}{text(row.mean('speed'), 2):>8}"
                         f"{text(row.mean('cost'), 2):>7}{row.torque:>8.0f}{sinkage:>9}  {falls}")
        lines.append("m/s, cost of transport, N m (largest), mm (mean over stances of the deepest element); speed and cost of those upright")
        return "\n".join(line.rstrip() for line in lines)


def _tour():
    from . import tour

    return tour


def text(value, digits):
    return "-" if value is None else f"{value:.{digits}f}"


def trial(model: "str | os.PathLike | mujoco.MjSpec", policy: "str | os.PathLike | Callable[[np.ndarray], Sequence[float]]",
          describe: "str | os.PathLike | Mapping | Description | None" = None, *, ground: "str | Sequence[str]" = GROUNDS, speeds: Sequence[float] = (SPEED,),
          sideways: float = 0.0, turn: float = 0.0, trials: int = 10, seconds: "float | None" = None, seed: int = 1, noise: float = 1.0,
          changes: Mapping[str, object] = types.MappingProxyType({}), attributes: Mapping[str, object] = types.MappingProxyType({}),
          video: "str | os.PathLike | None" = None, jobs: int = 1, report: "Callable[[Row], None] | None" = None,
          grounds: "Sequence[str] | None" = None, tour: bool = False) -> "Table":
    """Lets a policy walk on grounds, and returns a Table, whose text is one row for each ground and speed.

    model: an MJCF file, XML text, or a mujoco.MjSpec. policy: a file .onnx or .pt (TorchScript), FILE.py:NAME, or a callable that
    makes an action (n,) of an observation (m,); its reset(), if there is one, begins a walk. describe: what it sees and does, a
    file (an ini, or a config of its trainer, mild.readers), a layout (mild.layouts()), a dict of sections, or a Description; None: what comes
    with the policy. ground: presets of mild.presets(), a list or a text with commas, and "rigid", which is
    MuJoCo's own floor. speeds: forward commands [m/s]. trials: of each row, which differ by seed, heading, place, joints and
    noise; seconds: of each, None: 10, of a tour 90; noise: times that of the description. changes: {"section.key": text} over the description. attributes: of mild.attach,
    such as ground__mu. video: a file, the first trial of each row. jobs: processes; more than one need policy, model and describe
    as files. report: called with each Row. tour: instead of a command straight ahead, waypoints, pushes, and arms that are moved
    (mild.tour); no speeds. Raises ValueError with one line for what is wrong, RuntimeError for what is missing."""
    describe = readers.find(policy) if describe is None else describe
    d = describe if isinstance(describe, Description) else Description(describe, changes)
    if grounds is not None:
        warnings.warn("trial: grounds is named ground now", DeprecationWarning, stacklevel=2)
        ground = grounds
    cells = [(one, (float(speed), float(sideways), float(turn)))
             for one in (ground.split(",") if isinstance(ground, str) else ground) for speed in speeds]
    if seconds is None:
        seconds = _tour().SECONDS if tour else SECONDS
    if not cells or trials < 1 or not seconds > 0:
        raise ValueError("trial: needs a ground, a speed, and more than 0 trials and seconds")
    if tour and (list(speeds) != [SPEED] or sideways or turn):
        raise ValueError("tour: it steers the robot itself; no speed, sideways or turn")
    options = dict(trials=int(trials), seconds=float(seconds), seed=int(seed), noise=float(noise), attributes=dict(attributes), painted=bool(video),
                   tour=bool(tour))
    if jobs > 1 and not video:
        rows, about = _rows_of_processes((str(model), str(policy), str(describe), dict(changes), options), cells, jobs, report)
    else:
        network, rows, about = networks.load(policy, d), [], None
        with _film(video) as film:
            for ground, command in cells:
                walker = _walker(options)(model, network, d, ground, options)
                rows.append(Row(ground, command, [walker.walk(command, seed + k, film if k == 0 else None) for k in range(trials)]))
                about = about or walker.about()
                if report:
                    report(rows[-1])
    about = {"version": _version(), "model": _place(model), "policy": _place(policy), "describe": str(d.name), **about,
             "seconds": options["seconds"], "seed": options["seed"], "noise": options["noise"], **({"course": "tour"} if tour else {})}
    return Table(about, rows)


def _walker(options):
    return _tour().Tour if options["tour"] else Walker


def _version():
    from . import __version__
    return __version__


def _place(thing):
    return str(thing) if isinstance(thing, (str, pathlib.Path)) and "<" not in str(thing) else type(thing).__name__


def _quietly():
    """MuJoCo's and the ground's warnings, of robots that fall most of all, go nowhere; what ended a walk says what counts."""
    import mujoco

    mujoco.set_mju_user_warning(lambda text: None)


def _cell(arguments):
    _quietly()
    (model, policy, describe, changes, options), ground, command = arguments
    d = Description(describe, changes)
    walker = _walker(options)(model, networks.load(policy, d), d, ground, options)
    row = Row(ground, command, [walker.walk(command, options["seed"] + k) for k in range(options["trials"])])
    return row, walker.about()


def _rows_of_processes(what, cells, jobs, report):
    import multiprocessing

    rows, about = [], None
    with multiprocessing.get_context("spawn").Pool(jobs) as pool:
        for row, one in pool.imap(_cell, [(what, *cell) for cell in cells]):
            rows.append(row)
            about = about or one
            if report:
                report(row)
    return rows, about


class Walker:
    """A robot on one ground, and its policy."""

    def __init__(self, model, network, description, ground, options):
        import mujoco

        self.network, self.description, self.ground, self.options = network, description, ground, options
        self.robot = stand(model, description, ground, options["attributes"], options.get("painted", False))
        self.data = mujoco.MjData(self.robot.model)
        r = self.robot
        self.state = State(description, r.model, self.data, r.frame, r.seen)
        self.observer = Observer(description, len(r.seen[0]), len(r.joints), getattr(network, "size", None))
        self.delay = round(description.policy["delay"] / r.model.opt.timestep)
        given = options["attributes"]  # soles that the plugin is given
        self.outlines = [np.array(text.split(), float).reshape(-1, 2) for text in given["outline"].split(";")] if "outline" in given else []
        self.sole_z = float(given.get("sole_z", 0))
        self.depth = 0.0 if ground == "rigid" else self.standing_depth()

    def about(self):
        """Of the robot, as docs/schema/trial.json."""
        import mujoco

        r, d = self.robot, self.description
        return {"mujoco": mujoco.mj_versionString(), "mass": r.mass, "feet": r.feet.names, "bodies": r.feet.bodies,
                "sole": [area(outline) for outline in r.feet.outlines], "joints": r.joints,
                "step": r.model.opt.timestep, "rate": 1 / (d.policy["decimation"] * r.model.opt.timestep), "actuator": d.actuator["kind"],
                "remark": r.remark}

    def standing_depth(self):
        """[m] at which virgin ground carries the robot at rest, level, where a trial starts; as in mild eval."""
        from . import Material, Sole

        r, given = self.robot, self.options["attributes"]
        material = Material(self.ground, **{key[8:]: float(value) for key, value in given.items()
                                            if key.startswith("ground__") and key not in ("ground__model",)})
        load = r.mass * float(np.linalg.norm(r.model.opt.gravity)) / len(r.feet.names)
        return float(np.mean([Sole(outline).sinkage(material, load) for outline in self.outlines or r.feet.outlines]))

    def lowest(self):
        """[m] height of the lowest point of the soles."""
        import mujoco

        r, d = self.robot, self.data
        mujoco.mj_kinematics(r.model, d)
        if not self.outlines:
            return min(lowest(r.model, d, geom) for geom in r.soles)
        heights = []
        for k, name in enumerate(r.feet.names):
            site, body = (mujoco.mj_name2id(r.model, kind, name) for kind in (mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_BODY))
            place, turn = (d.xpos[body], d.xmat[body]) if body >= 0 else (d.site_xpos[site], d.site_xmat[site])
            corners = np.insert(self.outlines[k % len(self.outlines)], 2, self.sole_z, axis=1)
            heights.append(place[2] + float((corners @ turn.reshape(3, 3)[2]).min()))
        return min(heights)

    def begin(self, command, seed):
        """Puts the robot at a start of its own."""
        import mujoco

        self.random = np.random.default_rng([seed, 26])
        r, s, noise = self.robot, self.state, self.description.noise
        mujoco.mj_resetData(r.model, self.data)
        q, free = r.start.copy(), r.place
        yaw, turned = math.pi * self.draw(1, 1)[0], np.zeros(4)
        mujoco.mju_mulQuat(turned, np.array([math.cos(yaw / 2), 0, 0, math.sin(yaw / 2)]), q[free + 3 : free + 7])
        q[free + 3 : free + 7] = turned
        q[free : free + 2] += self.draw(noise["start_place"], 2)
        q[r.qpos] += self.draw(noise["start_joint"], len(r.qpos))
        self.data.qpos[:] = q
        self.data.qpos[free + 2] += self.description.start["lift"] - self.depth - self.lowest()
        mujoco.mj_forward(r.model, self.data)
        s.command, s.action, s.default = np.array(command), np.zeros(len(r.joints)), r.seen_default
        self.observer.reset()
        self.network.reset()
        self.height, self.target = r.zero + r.start[free + 2], r.default.copy()

    def draw(self, amplitude, count):
        return self.options["noise"] * amplitude * self.random.uniform(-1, 1, count)

    def read(self):
        """What the policy may know of now."""
        self.state.read(self.draw)

    def decide(self):
        """Asks the policy; the targets [rad] of all joints."""
        r, s, action = self.robot, self.state, self.description.action
        self.read()
        raw = self.network.act(self.observer.observe(s))
        if len(raw) != len(r.joints):
            raise ValueError(f"policy: it answers {len(raw)} numbers, and moves {len(r.joints)} joints: {', '.join(r.joints)}")
        clipped = np.clip(raw, -action["clip"], action["clip"])
        s.action = clipped if action["seen"] == "clipped" else raw
        target, count = self.target.copy(), len(r.joints)
        zero = {"default": r.default[:count], "zero": 0.0, "last": target[:count]}[action["target"]]
        target[:count] = np.clip(zero + r.scale * clipped, r.lower, r.upper)
        return target

    def drive(self, target):
        """Sets the controls of one step of physics."""
        r, d = self.robot, self.data
        if self.description.actuator["kind"] == "torque":
            torque = np.clip(r.kp * (target - d.qpos[r.qpos]) - r.kd * d.qvel[r.qvel], -r.effort, r.effort)
            d.ctrl[r.drive] = torque / r.gear
        else:
            moved = r.drive >= 0
            d.ctrl[r.drive[moved]] = target[moved]

    def walk(self, command, seed, film=None):
        """One trial, a Walk."""
        import mujoco

        self.begin(command, seed)
        r, d, pd = self.robot, self.data, self.description.policy["decimation"]
        count, step = round(self.options["seconds"] / r.model.opt.timestep), r.model.opt.timestep
        due, measure, end = [], Measure(self), "time"
        for k in range(count):
            if k % pd == 0:
                due.append((k + self.delay, self.decide()))
            while due and due[0][0] <= k:
                self.target = due.pop(0)[1]
            self.drive(self.target)
            mujoco.mj_step(r.model, d)
            measure.step(k * step)
            end = self.fallen()
            if end:
                self.lie(film)
                break
            if film:
                film.show(self)
            end = "time"
        return measure.walk(seed, (k + 1) * step, end)

    def lie(self, film):
        """Shows a second more of a robot that has fallen, with its last targets."""
        import mujoco

        until = self.data.time + 1 if film else 0
        while self.data.time < until:
            self.drive(self.target)
            mujoco.mj_step(self.robot.model, self.data)
            film.show(self)

    def fallen(self):
        import mujoco

        r, d = self.robot, self.data
        if d.warning[mujoco.mjtWarning.mjWARN_BADQACC].number or d.warning[mujoco.mjtWarning.mjWARN_BADQPOS].number \
                or d.warning[mujoco.mjtWarning.mjWARN_BADQVEL].number or not np.isfinite(d.qpos).all():
            return "not_finite"
        x, y = d.qpos[r.place + 4 : r.place + 6]
        if 1 - 2 * (x * x + y * y) < math.cos(TILT):
            return "tilt"
        base, low = d.qpos[r.place + 2], LOW * self.height
        return "base" if r.zero + base < low and base - self.lowest() < low else ""  # who has sunk on its feet stands


class Measure:
    """What one walk is judged by, from step to step; definitions as in mild eval (docs/schema/eval.json)."""

    def __init__(self, walker):
        self.r, self.d, self.ground = walker.robot, walker.data, walker.ground
        self.free = self.r.place
        self.place = self.d.qpos[self.free : self.free + 2].copy()
        self.path, self.work, self.torque = np.zeros(2), 0.0, 0.0
        self.deep, self.stances, self.lifted = np.zeros(len(self.r.feet.names)), [], False

    def step(self, time):
        r, d = self.r, self.d
        torque = d.qfrc_actuator[r.qvel]
        self.torque = max(self.torque, float(np.abs(torque).max()))
        if time >= SETTLE:
            w, x, y, z = d.qpos[self.free + 3 : self.free + 7]
            yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
            moved, c, s = d.qpos[self.free : self.free + 2] - self.place, math.cos(yaw), math.sin(yaw)
            self.path += (c * moved[0] + s * moved[1], c * moved[1] - s * moved[0])
            self.work += float(np.abs(torque * d.qvel[r.qvel]).sum()) * r.model.opt.timestep
        self.place = d.qpos[self.free : self.free + 2].copy()
        if self.ground != "rigid":
            depth = d.sensor("feet_of_trial").data.reshape(-1, 12)[: len(r.feet.names), 10]
            for foot in np.flatnonzero((depth == 0) & (self.deep > 0)):
                self.stances.append(self.deep[foot])
            self.deep = np.where(depth > 0, np.maximum(self.deep, depth), 0)

    def walk(self, seed, time, end):
        steady, forward, left = time - SETTLE, *map(float, self.path)
        long = time > LEAST
        rigid = self.ground == "rigid"
        stances = self.stances or [depth for depth in self.deep if depth > 0]
        weight = self.r.mass * float(np.linalg.norm(self.r.model.opt.gravity))
        return Walk(seed, time, end, forward / steady if long else None, left / steady if long else None,
                    self.work / (weight * math.hypot(forward, left)) if long and math.hypot(forward, left) > 0.05 * steady else None,
                    self.torque, 0.0 if rigid else float(np.mean(stances)) if stances else None)


# ---- video ----
FILM = (960, 540, 30)  # width, height, pictures a second
GEOMS = 20000  # of a picture: a dent is plates of 20 mm (docs/plugin.md)


@contextlib.contextmanager
def _film(path):
    """A Film, or None; ends ffmpeg."""
    if not path:
        yield None
        return
    film, whole = Film(path), False
    try:
        yield film
        whole = True
    finally:
        film.close()
        if not whole:
            pathlib.Path(path).unlink(missing_ok=True)


def _light(model, data, place):
    """Moves the directional lights of the world so that they shine through a place, because they cast shadows only near their own line."""
    import mujoco

    for light in np.flatnonzero((model.light_bodyid == 0) & (model.light_type == int(mujoco.mjtLightType.mjLIGHT_DIRECTIONAL))):
        way, own = data.light_xdir[light], data.light_xpos[light]
        if way[2] < 0:
            own[:2] = place[:2] - way[:2] * (place[2] - own[2]) / way[2]


class Film:
    """Pictures of MuJoCo's renderer to ffmpeg."""

    def __init__(self, path):
        width, height, rate = FILM
        try:
            self.ffmpeg = subprocess.Popen([_processor.ffmpeg() or "ffmpeg", "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24",
                                            "-s", f"{width}x{height}", "-r", str(rate), "-i", "-", "-pix_fmt", "yuv420p", "-crf", "23", str(path)],
                                           stdin=subprocess.PIPE)
        except OSError:
            raise RuntimeError("video: needs ffmpeg; pip install 'mildground[video]', or apt-get install ffmpeg") from None
        self.renderer = self.of = None

    def show(self, walker):
        import mujoco

        width, height, rate = FILM
        r, d = walker.robot, walker.data
        if self.of is not r.model:
            if self.renderer:
                self.renderer.close()
            screen = r.model.vis.global_
            screen.offwidth, screen.offheight = max(width, screen.offwidth), max(height, screen.offheight)
            try:
                self.renderer, self.of, self.next = mujoco.Renderer(r.model, height, width, max_geom=GEOMS), r.model, 0.0
            except (ImportError, RuntimeError, AttributeError) as error:
                raise RuntimeError(f"video: MuJoCo cannot draw: {error}; set MUJOCO_GL=egl before Python starts, "
                                   "and `pip install pyopengl`") from None
            self.camera = mujoco.MjvCamera()
            self.camera.type, self.camera.trackbodyid = mujoco.mjtCamera.mjCAMERA_TRACKING, r.base
            self.camera.distance, self.camera.azimuth, self.camera.elevation = 2.6 * walker.height + 0.5, 130, -15
        if d.time < 1.5 / rate:
            self.next = 0.0
        if d.time >= self.next:
            self.next += 1 / rate
            _light(r.model, d, d.xpos[r.base])
            self.renderer.update_scene(d, self.camera)
            try:
                self.ffmpeg.stdin.write(self.renderer.render().tobytes())
            except BrokenPipeError:
                raise RuntimeError("video: ffmpeg failed") from None

    def close(self):
        if self.renderer:
            self.renderer.close()
        with contextlib.suppress(BrokenPipeError):
            self.ffmpeg.stdin.close()
        if self.ffmpeg.wait():
            raise RuntimeError("video: ffmpeg failed")


# ---- the command ----
def _list(read):
    def values(text):
        return [read(word) for word in text.split(",") if word]
    values.__name__ = f"{read.__name__} list"  # argparse calls it so: invalid float list value
    return values


EXAMPLES = """examples:
  mild trial robot.xml policy.onnx --check
  mild trial robot.xml policy.pt --describe unitree_rl_gym --set policy.decimation=4 --ground rigid,grass
  mild trial robot.xml mine.py:Policy --describe mine.ini --speed 0.3,0.6 --attach ground.mu=0.5 --video walk.mp4
  mild trial robot.xml policy.onnx --describe mine.ini --sweep stiffness --json s50.json --plot s50.png
  mild trial robot.xml policy.onnx --tour --ground rigid,gym_mat --jobs 2"""


def parser():
    p = argparse.ArgumentParser(prog="mild trial", description="Lets any policy walk on rigid and soft ground, and prints one row for each "
                                "ground and speed.", formatter_class=argparse.RawDescriptionHelpFormatter, epilog=EXAMPLES)
    p.add_argument("model", nargs="?", help="MJCF of the robot")
    p.add_argument("policy", nargs="?", help="policy: .onnx, .pt (TorchScript), or FILE.py:NAME")
    p.add_argument("--describe", metavar="FILE|LAYOUT", help="what it sees and does: an ini, a config of its trainer (deploy.yaml, env.yaml, ONNX "
                   f"metadata), or a layout: {', '.join(layouts())}; without: what comes with the policy")
    p.add_argument("--ground", type=_list(str), default=list(GROUNDS), metavar="NAME[,NAME]", help="rigid (MuJoCo's own floor) and presets (default: nine)")
    p.add_argument("--speed", type=_list(float), default=[SPEED], metavar="V[,V]", help="[m/s] forward (default 0.5)")
    p.add_argument("--sideways", type=float, default=0.0, metavar="V", help="[m/s] to the left")
    p.add_argument("--turn", type=float, default=0.0, metavar="W", help="[rad/s] to the left")
    p.add_argument("--trials", type=int, metavar="N", help="of each row (default 10); of a sweep, at most (default 60)")
    p.add_argument("--seconds", type=float, metavar="S", help="of a trial (default 10, of a tour 90)")
    p.add_argument("--tour", action="store_true", help="a tour instead: waypoints, pushes, and arms that are moved, as rhoyn/teleop-walking-benchmark does")
    p.add_argument("--seed", type=int, default=1, metavar="N", help="of the first trial of each row (default 1)")
    p.add_argument("--noise", type=float, default=1.0, metavar="X", help="times the noise of the description; 0: none (default 1)")
    p.add_argument("--jobs", type=int, default=1, metavar="N", help="processes (default 1); the results do not depend on it")
    p.add_argument("--set", action="append", default=[], metavar="SECTION.KEY=VALUE", help="over the description, again and again")
    p.add_argument("--attach", action="append", default=[], metavar="KEY=VALUE", help="an attribute of the ground, such as ground.mu=0.8")
    p.add_argument("--video", metavar="FILE", help="the first trial of each row, by MuJoCo's renderer and ffmpeg")
    p.add_argument("--json", metavar="FILE", help="also write the table as JSON; - for standard output")
    p.add_argument("--sweep", metavar="WHAT", help="one number instead: the stiffness [MPa/m], friction, slip length [mm] or damping [s/m] of the ground at "
                   "which half of the trials stay up: stiffness, friction, slip, damping; --json FILE is whole after every trial, and a sweep goes on from it")
    p.add_argument("--range", type=_list(float), metavar="LOW,HIGH", help="of a sweep")
    p.add_argument("--csv", metavar="FILE", help="also write the curve of a sweep: value, trials, upright, chance to stay up")
    p.add_argument("--plot", metavar="FILE", help="draw the curve of a sweep, measured grounds on its axis; needs matplotlib")
    p.add_argument("--keys", action="store_true", help="print the keys of a description")
    p.add_argument("--check", action="store_true", help="print what the description makes of the model, without a walk")
    return p


def _pairs(lines, option):
    for line in lines:
        if "=" not in line:
            raise ValueError(f"--{option}: '{line}' must be KEY=VALUE")
    return dict(line.split("=", 1) for line in lines)


def _keys():
    lines = []
    for section, keys in KEYS.items():
        lines.append(f"[{section}]")
        for name, key in keys.items():
            default = "" if key.default in (None, "") else f" (default {key.default})"
            lines.append(f"  {name:<18}{key.help}{default}")
    lines.append("[observation]  terms in their order, TERM = SCALE [SCALE ...]; a second one of a kind: command.2")
    lines.append(f"  {', '.join(TERMS)}, constant, sensor:NAME")
    lines.append(f"[{'] ['.join(TABLES)}]  PATTERN = NUMBER, the last pattern that matches a joint's whole name holds")
    return "\n".join(lines)


def _check(arguments, description):
    """What the description makes of the model, and of the policy."""
    walker = Walker(arguments.model, networks.load(arguments.policy, description) if arguments.policy else networks.Callable(lambda o: np.zeros(1)),
                    description, "rigid", dict(noise=0.0, attributes={}, seconds=1.0))
    r = walker.robot
    walker.begin((arguments.speed[0], arguments.sideways, arguments.turn), 0)
    walker.state.read(walker.draw)
    frame = walker.observer.frame(walker.state)
    print(f"{r.mass:.1f} kg, step {r.model.opt.timestep:g} s, {walker.about()['rate']:g} Hz; feet {' '.join(r.feet.names)}, soles "
          f"{' '.join(f'{1e4 * area(outline):.0f}' for outline in r.feet.outlines)} cm^2; bodies {' '.join(r.feet.bodies) or '-'}")
    for k, name in enumerate(r.joints + r.held):
        print(f"{name:<32}{'held' if k >= len(r.joints) else f'scale {r.scale[k]:g}':<12} default {r.default[k]:7.3f}  kp {r.kp[k]:g}  "
              f"kd {r.kd[k]:g}  effort {r.effort[k]:g}")
    at = 0
    for term, part in zip(description.terms, frame):
        print(f"{at:>4} {term.name:<18}{' '.join(f'{value:.3f}' for value in part)}")
        at += len(part)
    print(f"{at} numbers, {at * (walker.observer.length or walker.observer.fit(at))} with the history")
    if r.remark:
        print(r.remark)
    if arguments.policy:
        print("action", " ".join(f"{value:.3f}" for value in walker.network.act(walker.observer.observe(walker.state))))


def main(argv=None):
    """The command; 0, or 2 after one line on what is wrong."""
    arguments = parser().parse_args(argv)
    if arguments.keys:
        print(_keys())
        return 0
    try:
        if not arguments.model or not (arguments.policy or arguments.check and arguments.describe):
            raise ValueError("needs MODEL and POLICY; --help has an example of each")
        arguments.describe = arguments.describe or readers.find(arguments.policy)
        changes = _pairs(arguments.set, "set")
        if arguments.check:
            _check(arguments, Description(arguments.describe, changes))
            return 0
        attributes = {key.replace(".", "__"): value for key, value in _pairs(arguments.attach, "attach").items()}
        if arguments.video:
            os.environ.setdefault("MUJOCO_GL", "egl")  # MuJoCo reads it once, when it is imported
        _quietly()
        for option in ("json", "csv", "plot", "video"):  # before an hour of walks
            file = pathlib.Path(getattr(arguments, option) or "-")
            if str(file) != "-" and (file.is_dir() or not file.absolute().parent.is_dir()):
                raise ValueError(f"{option}: " + (f"'{file}' is a folder" if file.is_dir() else f"there is no folder '{file.parent}'"))
        if arguments.sweep:
            from . import sweep

            if arguments.tour:
                raise ValueError("tour: a sweep walks straight ahead; name one of the two")
            arguments.seconds = SECONDS if arguments.seconds is None else arguments.seconds

            sweep.run(arguments, changes, attributes)
            return 0
        if arguments.range or arguments.csv or arguments.plot:
            raise ValueError("range, csv, plot: are of a sweep; name one with --sweep")
        out = sys.stderr if arguments.json == "-" else sys.stdout
        table = trial(arguments.model, arguments.policy, arguments.describe, ground=arguments.ground, speeds=arguments.speed,
                      sideways=arguments.sideways, turn=arguments.turn, trials=10 if arguments.trials is None else arguments.trials, seconds=arguments.seconds, seed=arguments.seed,
                      noise=arguments.noise, changes=changes, attributes=attributes, video=arguments.video, jobs=arguments.jobs, tour=arguments.tour)
        print(table, file=out)
        for line in filter(None, (table.about["remark"], *table.remarks())):
            print(line, file=out)
        if arguments.json == "-":
            json.dump(table.as_dict(), sys.stdout, indent=2)
        elif arguments.json:
            pathlib.Path(arguments.json).write_text(json.dumps(table.as_dict(), indent=2) + "\n")
    except (ValueError, RuntimeError, OSError) as error:
        print(f"mild trial: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    return 0
