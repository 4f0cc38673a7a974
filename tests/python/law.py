"""The ground law `mild_merged` in NumPy, for one plane sole with a prescribed motion on level ground. It was written from docs/model.md by
somebody who had not read the sources; where the page left room, forces of the library decided. test_law.py compares the two. Names are
those of the page, and each function names its sections there.

Left out: uneven ground and terrains, imprints, shells of bodies, concentric soles, other models, `passive = false`, the solvers."""
import types

import numpy as np

PITCH = 0.0195  # [m] of the paper, which a material's numbers belong to: section 16
BED = 5e7  # [N/m^3] stiffness of the firm bed: section 3
ELASTIC = 1e-4  # [m] travel of plastic ground, and the way into virgin ground that is soon made good: sections 5 and 6
LAG = 5e-3  # [s] T, by which unloading ground and friction follow late: section 6
SMOOTH = 2e-6  # [m/s] E, over which the lag begins: section 6
TURNED = 1e-4  # [m/s] speed at the front above which a foot can have turned round within a step: section 6
SPRING = 2e-5  # [m] delta, over which friction is elastic: section 6
COUNTED, LONGEST = 1e-5, 0.1  # [m] least way that is counted, and greatest path: section 8
TURN = 0.6  # share of the tilt by which a sole presses along its normal: section 21
TURN_MOST = 0.32  # sine of the largest turn: section 21
TAIL = 0.02  # depth that moves beyond a heap, by depth: section 21
POINTS = 4  # along a cell's edge, for the distances in it: section 21
PRESSURE = 3  # K_p, passive earth pressure: section 22
GRAVITY = 9.81  # [m/s^2] for the ground at the sides: section 22


def over(a, b, otherwise=0.0):
    """a/b, and `otherwise` where b is not above 0."""
    return np.where(b > 0, a / np.where(b > 0, b, 1), otherwise)


def clipped(vectors, lengths):
    """Vectors in the plane, none longer than its length."""
    return vectors * np.minimum(1, over(lengths, np.hypot(*vectors.T), 1))[:, None]


def edge_distance(outline, points):
    """Distance to the edge of each point inside of the outline; 0 outside."""
    distance, inside = np.full(len(points), np.inf), np.zeros(len(points), bool)
    for a, b in zip(outline, np.roll(outline, -1, 0)):
        along, to = b - a, points - a
        share = np.clip(to @ along / (along @ along), 0, 1)
        distance = np.minimum(distance, np.hypot(*(to - share[:, None] * along).T))
        if a[1] != b[1]:
            inside ^= ((a[1] > points[:, 1]) != (b[1] > points[:, 1])) & (to[:, 0] < along[0] * to[:, 1] / along[1])
    return np.where(inside, distance, 0)


def heap(sole, outline):
    """Section 21, the mean over a cell: mean and deviation of the distance e [m] in each cell of a sole."""
    offsets = ((np.arange(POINTS) + 0.5) / POINTS - 0.5) * sole.pitch

    def distances(x, y):
        grid = np.stack(np.meshgrid(offsets, offsets), -1).reshape(1, -1, 2)
        points = np.column_stack([x, y])[:, None] + grid
        return edge_distance(outline, points.reshape(-1, 2)).reshape(len(x), -1)

    lines = (np.arange(x.min() - 2 * sole.pitch, x.max() + 2.5 * sole.pitch, sole.pitch) for x in (sole.x, sole.y))
    every = distances(*(axis.ravel() for axis in np.meshgrid(*lines)))
    x, y = outline.T
    area = abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2
    e = distances(sole.x, sole.y)
    scale = every.sum() * (sole.pitch / POINTS)**2 / area / e.mean()
    return scale * e.mean(1), scale * np.sqrt(e.var(1) + (sole.pitch / POINTS)**2 / 12)


class Law:
    """The numbers of a material under a sole, and the curves that need no memory; u [m] is a depth of each element."""

    def __init__(self, material, sole, outline):
        """Sections 3, 16 and 21."""
        m = material
        self.sole, self.s = sole, sole.pitch**2
        slope = np.tan(m.alpha) / m.nu  # T of section 21
        self.kappa, self.k0 = m.sigma_cone / np.cos(m.alpha), m.k_pen / PITCH**2
        self.moved = max(m.c_g, 0) * m.phi * m.rho * m.nu * self.s
        self.c_d, self.mu, self.recovery, self.bed_depth = max(m.c_d, 0.5), m.mu, m.recovery, m.bed_depth
        self.slip_length, self.regain_length, self.grip, self.slip_growth = m.slip_length, m.regain_length, m.grip, m.slip_growth
        drifts = (sole.pitch / PITCH)**2 if m.slip_length == 0 else 0  # section 22: slip has the opposite sign
        self.k_D, self.b_D = drifts * m.k_drift, drifts * m.b_drift
        self.side = PRESSURE * m.phi * m.rho * GRAVITY * self.s / (2 * sole.width) if m.slip_length > 0 and m.grip > 0 else 0
        mean, deviation = heap(sole, outline)
        width = np.minimum(np.sqrt(18) * deviation, 3 * mean)
        self.u_b, self.u_w, self.u_f = (mean - width / 3) * slope, width * slope, mean * slope

    def recruited(self, u):
        """P, section 21."""
        t = np.clip((u - self.u_b) / self.u_w, 0, 1)
        return np.minimum(u, self.u_b) + self.u_w * (t - t * t + t**3 / 3)

    def force(self, u):
        """F_g, sections 3 and 21."""
        u = np.maximum(u, 0)
        return self.s * (self.kappa * u + (self.k0 - self.kappa) * self.recruited(u))

    def stiffness(self, u):
        """K, sections 3 and 21."""
        flat = (1 - np.clip((u - self.u_b) / self.u_w, 0, 1))**2
        return self.s * (self.kappa + (self.k0 - self.kappa) * flat)

    def bed(self, u):
        """Section 3."""
        return BED * self.s * np.maximum(u - self.bed_depth, 0)

    def mass(self, u):
        """m_a, section 21."""
        u = np.maximum(u, 0)
        return self.moved * (np.minimum(u, 5 * self.u_f) * (1 / 5 - TAIL) + TAIL * u)

    def mass_slope(self, u):
        """m_a', section 21."""
        return self.moved * np.where(u / 5 < self.u_f, 1 / 5, TAIL)


def frame(rotation, recovery):
    """Q, section 21: the smallest rotation that takes the vertical to the direction in which the sole presses."""
    e = np.array([0, 0, 1]) + TURN * max(1 - 5 * recovery, 0) * (rotation[:, 2] - [0, 0, 1])
    e /= np.linalg.norm(e)
    v = np.array([-e[1], e[0], 0])
    v *= min(TURN_MOST / max(np.linalg.norm(v), 1e-12), 1)
    cross = np.array([[0, 0, v[1]], [0, 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + cross + cross @ cross / (1 + np.sqrt(1 - v @ v))


class Foot:
    """A sole that moves as prescribed, and what its elements remember: the table of section 5."""

    def __init__(self, material, sole, outline, dt):
        n = len(sole.x)
        self.law, self.dt = Law(material, sole, outline), dt
        self.u_max, self.middle, self.front_speed, self.drift, self.worn, self.held_stiffness = np.zeros((6, n))
        self.pending, self.held = np.zeros((2, n, 2))

    def step(self, position, rotation, twist, new_twist):
        """Section 6: the force [N] on each element, (n, 3), from the pose and twist now and the twist after the step."""
        Q = frame(rotation, self.law.recovery)
        e = self.motion(position, rotation, twist, new_twist, Q)
        self.share(e, rotation)
        self.unloading_line(e)
        self.front(e)
        e.I_z = np.maximum(0, self.path(e) + self.mass(e) + self.growth(e) + self.lag(e))
        I_xy = self.friction(e)
        self.remember(e)
        return np.column_stack([I_xy, e.I_z]) @ Q.T / self.dt

    def motion(self, position, rotation, twist, new_twist, Q):
        """Sections 1, 5, 6 and 21: depths [m] and speeds in the frame Q [m/s] of the elements; the step leads from the depth m0 to m1."""
        sole, dt = self.law.sole, self.dt
        p = np.column_stack([sole.x, sole.y, np.full(len(sole.x), sole.z)]) @ rotation.T
        before, after = ((V[:3] + np.cross(V[3:], p)) @ Q for V in (twist, new_twist))
        e = types.SimpleNamespace(u0=-(position[2] + p[:, 2]), w0=-before[:, 2], w=-after[:, 2], v0=before[:, :2], v=after[:, :2])
        e.sinks = -after @ Q[2] - e.w  # how much faster the depth grows than the way along the normal
        e.slices = np.maximum((1 - TURN) / TURN * (e.v @ Q[:2, 2]), 0)  # along the sole's slope
        e.m0 = np.where(self.middle > 0, self.middle, e.u0 - dt * e.w0 / 2)
        e.m1 = e.u0 + dt * e.w / 2
        e.a = np.maximum(np.maximum(e.m0, self.u_max), 0)
        return e

    def share(self, e, rotation):
        """Sections 21 and 22: c and q, held in a step; q falls at once when the sole tilts."""
        e.c = rotation[2, 2]
        e.q = np.minimum(1 - self.worn, e.c)

    def unloading_line(self, e):
        """Sections 5 and 22: F_a of the whole load, its bed, k and u_z; in the bed the line takes the steepest slope of the law."""
        law, a = self.law, e.a
        e.F_a, e.bed_a = law.force(a), law.bed(a)
        travel = np.maximum(law.recovery * a, np.minimum(ELASTIC, a))
        steepest = law.s * (max(law.k0, law.kappa) + BED)
        e.k = np.maximum(over(e.F_a + e.bed_a, travel), np.where(a > law.bed_depth, steepest, law.stiffness(a)))
        e.u_z = a - (e.q * e.F_a + e.bed_a) / e.k

    def front(self, e):
        """Section 6: w_y, w_a, the speed h at the front, and where the step leads into virgin ground by more than is soon made good."""
        law, dt, down = self.law, self.dt, np.maximum(e.w0, 0)
        e.w_y = np.maximum(2 * (e.a - e.u0) / dt, 0)
        e.w_a = np.maximum(self.front_speed, e.w_y)
        e.deep = (e.u0 + dt * down / 2 - e.a > ELASTIC) & (law.c_d > 1)
        free = np.maximum((e.w - e.w0) / dt, 0)  # a prescribed motion is the free motion
        e.h = np.where(e.deep, np.sqrt(down**2 + 2 * free * np.maximum(e.a - e.m0, 0)), down)

    def energy(self, e, m):
        """E(m) of section 6 but for the bed beyond a: the unloading line up to a, then virgin ground by Simpson's rule."""
        deep = np.maximum(m, e.a)
        line = e.k / 2 * np.maximum(np.minimum(m, e.a) - e.u_z, 0)**2
        ends = self.law.force(e.a) + 4 * self.law.force((e.a + deep) / 2) + self.law.force(deep)
        return line + (deep - e.a) / 6 * e.q * ends + (deep - e.a) * self.law.bed(deep)

    def path(self, e):
        """Section 6: mean static force over the way."""
        way = e.m1 - e.m0
        moves = np.abs(way) > 1e-15
        static = np.where(e.m1 <= e.a, e.k * np.maximum(e.m1 - e.u_z, 0), e.q * self.law.force(e.m1) + self.law.bed(e.m1))
        return self.dt * np.where(moves, (self.energy(e, e.m1) - self.energy(e, e.m0)) / np.where(moves, way, 1), static)

    def mass(self, e):
        """Section 6: added mass at the front."""
        return self.law.mass(e.a) * (np.maximum(e.w, e.w_y) - e.w_a)

    def growth(self, e):
        """Section 6: mass recruited on the way, and drag. A foot that turns round was stopped first."""
        law, h, w = self.law, e.h, np.maximum(e.w, 0)
        stop = 0.5
        if law.c_d > 1:
            F = e.q * (e.F_a + law.stiffness(e.a) * (np.maximum(e.u0, e.a) - e.a) / 2)
            drag = (law.c_d - 1) * law.mass_slope(e.a) * h**2
            stop = np.where(e.deep, np.minimum(0.3 + np.sqrt(over(F, drag, np.inf)), 0.75), 0.5)
        V = (h + w) / 2 + (stop - 0.5) * over(np.maximum(h - w, 0)**2, h) if law.c_d >= 1 else (w + np.minimum(w, h)) / 2
        m = np.maximum(law.mass(e.m1) - law.mass(e.a), 0)
        stopped = np.maximum(m, np.minimum(2 * m, law.mass(np.maximum(e.u0, e.a)) - law.mass(e.a)))
        return np.where(e.deep, stopped, m) * (w + (law.c_d - 1) * V)

    def lag(self, e):
        """Section 6: unloading ground follows the foot late."""
        x = np.minimum(e.w + e.h, 0)
        return self.dt * LAG * e.k * np.where(x > -SMOOTH, -x * x / (2 * SMOOTH), x + SMOOTH / 2)

    def friction_coefficient(self, e):
        """Section 22: mu_q where ground yields, the firm bed too, mu where it is struck."""
        law = self.law
        if law.slip_length == 0 or law.grip == 0:
            return np.full_like(e.q, law.mu)
        share, h = e.q / e.c, np.maximum(e.w0, 0)
        mu_q = np.minimum(law.mu, (3 + np.sqrt(8)) * law.grip * (1 - share) / (2 - share))
        G = law.c_d * law.mass_slope(e.a) * h * np.maximum(e.u0 + self.dt * h / 2 - e.a, 0) / self.dt
        yields = e.q * e.F_a + e.bed_a
        slides = (e.v0**2).sum(1)
        struck = law.mu * over(slides, slides + h**2, 0)
        return over(mu_q * yields + struck * G, yields + G, mu_q)

    def friction(self, e):
        """Sections 6, 8 and 22: a spring below its bound r, with damping; drift resistance and the ground at the sides are in r too."""
        law, dt, u = self.law, self.dt, np.maximum(e.u0, 0)
        mu, others = self.friction_coefficient(e), law.k_D * self.drift * u + law.side * u**2
        r = mu * e.I_z + dt * others
        k = (mu * (e.q * e.F_a + e.bed_a) + others) / SPRING
        self.held *= np.minimum(1, over(k, self.held_stiffness, 1))[:, None]
        self.held_stiffness = k
        spring = dt * self.held - (dt * dt * k)[:, None] * e.v
        e.slides = np.hypot(*spring.T) >= r
        self.held = clipped(spring, r) / dt
        return clipped(spring - (r * LAG / SPRING)[:, None] * e.v, r) - dt * law.b_D * (e.u0 > 0)[:, None] * e.v

    def peak(self, e):
        """Section 6, `element_peak`: the depth that is remembered where a foot turned round within the step; else m1."""
        law, p, v = self.law, np.maximum(e.m0, e.m1), np.where(e.m1 > e.m0, e.w, e.h)
        ends = np.maximum(p - e.u_z, 0), np.maximum(e.a - e.u_z, 0)
        E = over(e.I_z, e.h - e.w) * v**2 / 2 - np.where(p < e.a, e.k / 2 * (ends[1]**2 - ends[0]**2), 0)
        begin = np.maximum(p, e.a)
        F = e.q * law.force(begin) + law.bed(begin) + law.c_d * law.mass_slope(begin) / 2 * v**2
        slope = e.q * law.stiffness(begin) + BED * law.s * (begin > law.bed_depth)
        x = over(2 * E, F + np.sqrt(F * F + 2 * slope * np.maximum(E, 0)))
        turns = (e.w < 0) & (e.h > TURNED) & (E > 0)
        return np.where(turns, e.m1 + (1 + law.recovery) / 2 * (begin + x - e.m1), e.m1)

    def wear(self, e):
        """Sections 8 and 22: the share q after the step; slip takes support away, fresh penetration brings it back."""
        law, growth = self.law, 1.0
        length = np.hypot(*self.pending.T)
        counted = length > COUNTED
        q = e.q
        if law.slip_length > 0:
            counted |= e.slides  # where friction slides, path counts at once
            growth = 1 + law.slip_growth * np.maximum(e.u0, 0) / law.slip_length
            q = 1 / (1 / q + np.where(counted, length, 0) / (law.slip_length * growth * e.c))
        self.drift = np.where(counted, np.minimum(self.drift + length, LONGEST), self.drift)
        self.pending[counted] = 0
        line = e.a - e.u_z  # shorter than the elastic travel where ground is stiffer than its chord, and in the first 0.1 mm
        fresh = np.maximum(e.m1 - e.a - self.dt * e.slices, 0)
        e.regains = (fresh > 0) & (law.recovery * e.a <= ELASTIC) & (line >= (e.q - 1e-6) * ELASTIC)
        return np.where(e.regains, e.c - (e.c - q) * np.exp(-fresh / (law.regain_length * growth)), q)

    def remember(self, e):
        """Sections 5, 6 and 22: the memory after the step; all but `middle` is forgotten above the surface."""
        self.pending = self.pending + self.dt * e.v
        q = self.wear(e)
        shift = self.dt * e.sinks
        led = np.maximum(e.m1, e.a) + shift + np.where(e.regains, ELASTIC * np.maximum(q - e.q, 0), 0)
        deepest = np.maximum(self.peak(e) + shift, led)
        in_ground = (e.m1 > 0) & (np.maximum(e.m1, e.a) + shift > 0)
        leads = (e.m1 > e.a) & (e.w > e.w_y)
        from_above = (self.u_max > 0) & (e.w_a <= e.w_y)  # has given the mass w - w_y only
        given = np.where(from_above, e.w - e.w_y, e.w)
        self.front_speed = np.where(in_ground & leads, given * over(e.m1 + np.minimum(shift, 0), led), 0)  # the same momentum at the depth led to
        self.u_max, self.worn = np.where(in_ground, deepest, 0), np.where(in_ground, 1 - q, 0)
        self.middle = e.m1 + shift
        for memory in (self.drift, self.held_stiffness, self.held, self.pending):
            memory[~in_ground] = 0
