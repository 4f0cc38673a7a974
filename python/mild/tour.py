"""A tour of `mild trial`: waypoints, pushes and arms that somebody else moves (docs/public-policies.md). The course and its numbers are those of
rhoyn/teleop-walking-benchmark (MIT, 2026), without its code: every 5 s another waypoint and a push on a random joint."""
import dataclasses
import math
import re

import numpy as np

from . import trials
from ._stand import parents

SECONDS, LEG = 90.0, 5.0  # [s] of a tour, and of each waypoint
CENTER, RADIUS = 0.3, 1.0  # [m] of the disc before the start
GAIN = 1.5  # [1/s] of the command: speed for what is left to go
NEAR, FAR = 0.10, 0.20  # [m] who is as near as the first has arrived, who is as far as the second has left
FACES, TURNED = 0.05, 0.12  # [rad] the same of the heading
PUSH, HIT, FIRST = 14.24, 0.08, 0.1  # [N/kg] of the strongest, 500 N for a G1 of 35.1 kg; [s] how long; [s] when the first comes
WEAKEST, RAMP, SPREAD = 1 / 3, 60.0, 0.5  # the limit of pushes rises from this part to all of it in [s]; each is this part of it or more
ARMS = re.compile("shoulder|elbow|wrist|hand|(^|_)arm", re.IGNORECASE)  # in the name of a joint
STEP, STEPS, HOLD, DRAWS = 0.06, 25, 0.5, 8  # [rad] of the arms' walk, and how many until the next target; [s] for each; tries to find one
REACH = 0.1  # [m] hands stay this far before the shoulders, and below them
STIFF, DAMPED, ARMATURE = 10.0, 2.0, 0.01  # [Hz] and damping of an arm's joint, by its armature; without one its inertia, at most [kg m^2]


@dataclasses.dataclass
class Leg(trials.Walk):
    """One trial of a tour."""
    waypoints: int  # reached: place and heading at once
    error: float | None  # [m] left to go when a waypoint's time is over, mean over waypoints


class Tour(trials.Walker):
    """A robot on one ground, its policy, and who steers it. The command of the trial is not heeded."""

    def __init__(self, model, network, description, ground, options):
        import mujoco

        super().__init__(model, network, description, ground, options)
        r, m = self.robot, self.robot.model
        names = r.joints + r.held
        self.joints = [m.joint(name).id for name in names]
        self.arms = np.array([k for k, name in enumerate(names) if ARMS.search(name)], int)
        ids = [self.joints[k] for k in self.arms]
        self.range = np.where(m.jnt_limited[ids], m.jnt_range[ids].T, [[-math.pi], [math.pi]])
        places = {int(address): k for k, address in enumerate(r.qpos)}  # of r.joints, then of r.held
        seen = [places[int(address)] for address in r.seen[0]]
        self.hidden = np.array([k for k, place in enumerate(seen) if place in self.arms], int)  # arms among what the policy observes
        self.wanted = [(at, seen[at]) for at in self.hidden if seen[at] < len(r.joints)]
        self.probe = mujoco.MjData(m)
        self.probe.qpos[:] = r.start
        self.chains = []  # (shoulder, hand), bodies
        for body in [int(m.jnt_bodyid[joint]) for joint in ids]:
            shoulder = next((chain for chain in self.chains if chain[0] in parents(m, body)), None)
            if shoulder:
                shoulder[1] = max(shoulder[1], body)
            elif not any(chain[0] == body for chain in self.chains):
                self.chains.append([body, body])
        hands = self.hands(r.default[self.arms])
        self.bounds = np.minimum(hands[:, 0], REACH), np.maximum(hands[:, 1], 0)
        self.pairs = self.mirrored(ids)
        if description.actuator["kind"] != "model":
            self.stiffen()

    def hands(self, angles):
        """[m] of each arm: how far its hand is before and above its shoulder, in the axes of the body that carries the arm; (arms, 2)."""
        import mujoco

        m, d = self.robot.model, self.probe
        d.qpos[self.robot.qpos[self.arms]] = angles
        mujoco.mj_kinematics(m, d)
        return np.array([((d.xpos[hand] - d.xpos[shoulder]) @ d.xmat[m.body_parentid[shoulder]].reshape(3, 3))[[0, 2]]
                         for shoulder, hand in self.chains]).reshape(-1, 2)

    def mirrored(self, ids):
        """[(left, right or -1, sign)] places in self.arms, by where the joints are in the default pose."""
        d, base = self.probe, self.robot.base
        turn, pairs, taken = d.xmat[base].reshape(3, 3), [], set()
        places, axes = (d.xanchor[ids] - d.xpos[base]) @ turn, d.xaxis[ids] @ turn
        for left in range(len(ids)):
            alike = axes @ (axes[left] * [-1, 1, -1])  # an axis of rotation in a mirror
            away = np.linalg.norm(places - places[left] * [1, -1, 1], axis=1) + (np.abs(alike) < 0.9) + (np.arange(len(ids)) == left)
            right = int(away.argmin())
            if left not in taken:
                right = right if away[right] < 0.05 and right not in taken else -1
                pairs.append((left, right, math.copysign(1, alike[right])))
                taken |= {left, right}
        return pairs

    def stiffen(self):
        """Gives the joints of the arms gains by their armature, the same for every policy."""
        r, rate = self.robot, 2 * math.pi * STIFF
        for k in self.arms:
            inertia = r.model.dof_armature[r.qvel[k]] or min(ARMATURE, r.model.dof_M0[r.qvel[k]])
            r.kp[k], r.kd[k] = inertia * rate**2, 2 * DAMPED * inertia * rate
            if self.description.actuator["kind"] == "servo":
                r.model.actuator_gainprm[r.drive[k], 0] = r.kp[k]
                r.model.actuator_biasprm[r.drive[k], 1:3] = -r.kp[k], -r.kd[k]

    def wander(self, start):
        """The next target of the arms [rad]: steps at random, again until the hands are before and below the shoulders."""
        (lower, upper), default = self.range, self.robot.default[self.arms]
        for _ in range(DRAWS):
            angles = start.copy()
            for left, right, sign in self.pairs:
                for step in self.luck.uniform(-STEP, STEP, STEPS):
                    angles[left] = min(max(angles[left] + step, lower[left]), upper[left])
                if right >= 0:
                    angles[right] = default[right] + sign * (angles[left] - default[left])
            hands = self.hands(angles)
            if (hands[:, 0] >= self.bounds[0]).all() and (hands[:, 1] <= self.bounds[1]).all():
                return angles
        return start

    def place(self):
        """x, y [m] and heading [rad] of the base."""
        x, y, _, w, i, j, k = self.data.qpos[self.robot.place :][:7]
        return x, y, math.atan2(2 * (w * k + i * j), 1 - 2 * (j * j + k * k))

    def begin(self, command, seed):
        super().begin(command, seed)
        self.luck, random, count = np.random.default_rng([seed, 27]), np.random.default_rng([seed, 28]), math.ceil(self.options["seconds"] / LEG)
        self.origin, self.number, self.reached, self.left = self.place(), -1, set(), []
        far, bearing = RADIUS * np.sqrt(random.random(count)), random.uniform(0, 2 * math.pi, count)
        self.waypoints = np.column_stack([CENTER + far * np.cos(bearing), far * np.sin(bearing), random.uniform(-math.pi, math.pi, count)])
        ways = random.normal(size=(count, 3))
        limit = PUSH * self.robot.mass * (WEAKEST + (1 - WEAKEST) * np.minimum(LEG * np.arange(count) / RAMP, 1))
        self.pushes = (limit * random.uniform(SPREAD, 1, count) / np.linalg.norm(ways, axis=1))[:, None] * ways
        self.pushed = random.integers(len(self.joints), size=count)
        self.window, self.angles = 0, [self.robot.default[self.arms]] * 2

    def steer(self):
        """The command to the waypoint of now."""
        x, y, heading = self.place()
        number = min(int(self.data.time / LEG + 1e-9), len(self.waypoints) - 1)
        if number != self.number:
            self.left += [self.far] if self.number >= 0 else []
            self.number, self.there, self.faces = number, False, False
        (forth, aside, turn), c, s = self.waypoints[number], math.cos(self.origin[2]), math.sin(self.origin[2])
        dx, dy = self.origin[0] + c * forth - s * aside - x, self.origin[1] + s * forth + c * aside - y
        off = math.remainder(self.origin[2] + turn - heading, 2 * math.pi)
        self.far = math.hypot(dx, dy)
        self.there = self.far < (FAR if self.there else NEAR)
        self.faces = abs(off) < (TURNED if self.faces else FACES)
        if self.there and self.faces:
            self.reached.add(number)
        c, s, most = math.cos(heading), math.sin(heading), self.description.command
        speed = GAIN * np.array([0 if self.there else c * dx + s * dy, 0 if self.there else c * dy - s * dx, 0 if self.faces else off])
        low, high = most["forward"]
        self.state.command = np.clip(speed, [low, -most["sideways"], -most["turn"]], [high, most["sideways"], most["turn"]])

    def read(self):
        self.steer()
        super().read()
        if self.description.command["arms"] == "unseen":
            s = self.state
            s.joint_position[self.hidden], s.joint_velocity[self.hidden] = s.default[self.hidden], 0
            for at, joint in self.wanted:
                s.joint_position[at] += self.robot.scale[joint] * s.action[joint]

    def drive(self, target):
        """The arms' targets over those of the policy, and the push of now."""
        time, d, m = self.data.time, self.data, self.robot.model
        if len(self.arms):
            if time >= self.window * HOLD:
                self.window += 1
                self.angles = [self.angles[1], self.wander(self.angles[1])]
            target, part = target.copy(), time / HOLD - self.window + 1
            target[self.arms] = (1 - part) * self.angles[0] + part * self.angles[1]
        d.xfrc_applied[:] = 0
        number = min(int(max(time - FIRST, 0) / LEG), len(self.pushes) - 1)
        if 0 <= time - FIRST - number * LEG < HIT:
            joint, force = self.joints[self.pushed[number]], self.pushes[number]
            body = m.jnt_bodyid[joint]
            d.xfrc_applied[body] = [*force, *np.cross(d.xanchor[joint] - d.xipos[body], force)]
        super().drive(target)

    def walk(self, command, seed, film=None):
        """One trial, a Leg."""
        found = super().walk(command, seed, film)
        left = self.left + ([self.far] if found.end == "time" else [])
        return Leg(**dataclasses.asdict(found), waypoints=len(self.reached), error=float(np.mean(left)) if left else None)


def row(one):
    """What a row of a tour has beside the others, as docs/schema/trial.json."""
    errors = [walk.error for walk in one.walks if walk.error is not None]
    return {"survival": float(np.mean([walk.time for walk in one.walks])), "waypoints": float(np.mean([walk.waypoints for walk in one.walks])),
            "error": float(np.mean(errors)) if errors else None}


def text(table):
    """The table of tours."""
    seconds = table.about["seconds"]
    lines = [f"{'ground':<12}{'survival':>9}{'tours':>10}{'waypoints':>11}{'error':>7}{'cost':>7}{'torque':>8}  falls after"]
    for one in table.rows:
        more, falls = row(one), f"{one.falls[0]:.1f} to {one.falls[1]:.1f} s" if one.falls else ""
        lines.append(f"{one.ground:<12}{more['survival']:>9.1f}{f'{one.upright} of {len(one.walks)}':>10}{more['waypoints']:>11.1f}"
                     f"{trials.text(more['error'], 2):>7}{trials.text(one.mean('cost'), 2):>7}{one.torque:>8.0f}  {falls}".rstrip())
    return "\n".join([*lines, f"s of {seconds:g} (mean), tours that were completed, of {math.ceil(seconds / LEG)} waypoints (mean), "
                              "m left to go at their end, cost of transport, N m (largest)"])
