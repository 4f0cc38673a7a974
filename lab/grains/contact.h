/* Force between two grains, or a grain and a wall, that overlap.
 *
 * Normal: a linear spring, or Hertz's; a dashpot for a given coefficient of restitution (Tsuji,
 * Tanaka, Ishida 1992 for Hertz); never a pull. Tangential: Mindlin's spring on the path slid, held
 * within Coulomb's cone (Cundall and Strack 1979). Rolling, optional: a spring and dashpot on the
 * path rolled, held within mu_roll times the normal force (Luding 2008). These are `hooke` or
 * `hertz`, `linear_history` and `sds` of LAMMPS's pair style `granular`, with which
 * lab/grains/tests/with_lammps.py compares. */
#ifndef GRAINS_CONTACT_H
#define GRAINS_CONTACT_H

#include "device.h"

struct Law {
    float stiffness; /* linear: k_n [N/m]; Hertz: E of E/(1 - nu^2)/2, per metre of radius [Pa] */
    float damping;   /* share of critical damping, from the restitution */
    float shear;     /* tangential stiffness over normal stiffness */
    float mu;        /* friction, walls and plates too */
    float mu_roll;   /* rolling resistance */
    float dt;        /* [s] */
    float density;   /* of a grain [kg/m^3] */
    float gravity;   /* [m/s^2] */
    bool hertz;
};

constexpr float SHEAR_DAMPING = 0.5f; /* tangential dashpot over the normal one */

/* Speed with which two parts part over that with which they met, at this share of critical damping:
 * the collision in units of its mass, stiffness and deepest overlap. As they never pull, it is more
 * than exp(-pi d/sqrt(1 - d^2)) (Schwager and Poeschel 2007). */
inline double contact_restitution(double damping, bool hertz) {
    const double dt = 1e-3;
    double x = 0, v = 1;
    do {
        const double slope = hertz ? 1.5 * sqrt(x) : 1, elastic = hertz ? sqrt(x) * x : x;
        const double share = (hertz ? sqrt(5.0 / 6) : 1) * damping;
        v -= dt * fmax(elastic + 2 * share * sqrt(slope) * v, 0);
        x += dt * v;
    } while (x > 0 && v > -1);
    return fmin(-v, 1);
}

/* The share of critical damping that gives this restitution. */
inline float contact_damping(float restitution, bool hertz) {
    double low = 0, high = 5;
    for (int k = 0; k < 40; k++) {
        const double middle = 0.5 * (low + high);
        const bool more = contact_restitution(middle, hertz) > (double)restitution;
        low = more ? middle : low;
        high = more ? high : middle;
    }
    return restitution >= 1 ? 0 : (float)low;
}

/* What one of the two, body a, sees. */
struct Contact {
    Vec3 normal;   /* from b to a, 1 */
    float overlap; /* [m] */
    float mass;    /* m_a m_b/(m_a + m_b) [kg] */
    float radius;  /* r_a r_b/(r_a + r_b) [m] */
    Vec3 velocity; /* of a's surface over b's at the contact [m/s] */
    Vec3 turning;  /* angular velocity of a over b [rad/s] */
};

/* What a contact remembers: the paths slid and rolled [m]. */
struct Memory {
    Vec3 slip, roll;
};

/* The vector in the plane across the normal, as long as before: the plane has turned. */
DEVICE Vec3 turned(Vec3 path, Vec3 normal) {
    const Vec3 flat = path - dot(path, normal) * normal;
    const float before = length(path), now = length(flat);
    return now > 0.0f ? (before / now) * flat : flat;
}

/* Force of a spring and dashpot on `path`, which slips so that it stays below `most`. */
DEVICE Vec3 held(Vec3 *path, Vec3 velocity, float stiffness, float damping, float most) {
    const Vec3 push = damping * velocity;
    const Vec3 force = vec(0, 0, 0) - stiffness * *path - push;
    const float size = length(force);
    if (size <= most) {
        return force;
    }
    const Vec3 least = (most / size) * force;
    *path = (-1.0f / stiffness) * (least + push);
    return least;
}

/* Force on a [N]; *torque is that of rolling resistance alone [N m]. */
DEVICE Vec3 contact_force(const Law &law, const Contact &c, Memory *memory, Vec3 *torque) {
    const float pressed = law.hertz ? sqrtf(c.radius * c.overlap) : 1.0f;
    const float slope = law.stiffness * pressed; /* dF/d overlap [N/m] */
    const float elastic = (law.hertz ? 2.0f / 3.0f : 1.0f) * slope * c.overlap;
    const float share = (law.hertz ? 0.9128709f : 1.0f) * law.damping; /* sqrt(5/6) */
    const float damping = 2.0f * share * sqrtf(c.mass * slope);
    const float closing = dot(c.velocity, c.normal);
    const float normal = fmaxf(elastic - damping * closing, 0.0f);

    const Vec3 sliding = c.velocity - closing * c.normal;
    const float stiff = law.shear * slope, damp = SHEAR_DAMPING * damping;
    memory->slip = turned(memory->slip, c.normal) + law.dt * sliding;
    const Vec3 shear = held(&memory->slip, sliding, stiff, damp, law.mu * normal);

    if (law.mu_roll > 0.0f) {
        const Vec3 rolling = c.radius * cross(c.turning, c.normal);
        memory->roll = turned(memory->roll, c.normal) + law.dt * rolling;
        const Vec3 force = held(&memory->roll, rolling, stiff, damp, law.mu_roll * normal);
        *torque = *torque + c.radius * cross(c.normal, force);
    }
    return normal * c.normal + shear;
}

/* ---- the rigid plate of a bed ----
 *
 * A block on an outline, or a sphere. Its origin lies in its bottom. In a case it moves and turns
 * as it is led, or falls with a mass; the sole of a robot moves freely (Ride). */

enum : int { SHAPE_POINTS = 64, BANDS = 64 };

struct Shape {
    int points;   /* of the outline, counter-clockwise or not; 0: a sphere, or no plate */
    float radius; /* of a sphere; 0: none [m] */
    float height; /* of the block [m] */
    float reach;  /* no point of it is farther from its origin [m] */
    float band;   /* width of a band of Plate.band; 0: none is summed [m] */
    float x[SHAPE_POINTS], y[SHAPE_POINTS];
};

/* Fixed point, so that a sum does not depend on its order: the same seed gives the same bits. */
enum : int { SUM_BITS = 30 };

struct Plate {
    /* of a case */
    double x, y, z;       /* place; the middle of the box and the floor are 0 [m] */
    double yaw, pitch;    /* turned by yaw about z, then by pitch about its own y [rad] */
    double vx, vy, vz;    /* [m/s] */
    double turning, rate; /* of yaw and pitch [rad/s] */
    double mass;          /* above 0: moves in z under this mass's weight [kg] */
    long long pushed;     /* sum[2] before this step */
    /* of all, what grains feel */
    long long sum[6];                /* force and moment about its origin, over the steps so far */
    uint32_t cell_x, cell_y, cell_z; /* its place in the units of the grains */
    float turn[9];                   /* its frame to the world, row major */
    long long band[BANDS];           /* force up by place, over the steps so far: shape_band */
    float side;                      /* -1: the shape's mirror image in its x-z plane, else 1 */
    Vec3 velocity, spin;             /* of its origin [m/s], [rad/s] */
};

/* The point of the shape that is nearest to `p`, in the plate's frame, and the normal from it to p.
 * Returns their distance [m], below 0 inside. */
DEVICE float outline_nearest(const Shape &s, float px, float py, float *qx, float *qy) {
    float best = 1e30f;
    bool inside = false;
    for (int i = 0, j = s.points - 1; i < s.points; j = i++) {
        const float ex = s.x[j] - s.x[i], ey = s.y[j] - s.y[i];
        const float wx = px - s.x[i], wy = py - s.y[i];
        const float t = fminf(fmaxf((wx * ex + wy * ey) / (ex * ex + ey * ey), 0.0f), 1.0f);
        const float dx = wx - t * ex, dy = wy - t * ey, d = dx * dx + dy * dy;
        if (d < best) {
            best = d;
            *qx = px - dx;
            *qy = py - dy;
        }
        if ((s.y[i] > py) != (s.y[j] > py) && wx < ex * wy / ey) {
            inside = !inside;
        }
    }
    return inside ? -sqrtf(best) : sqrtf(best);
}

DEVICE float shape_nearest(const Shape &s, Vec3 p, Vec3 *normal) {
    if (s.points == 0) { /* a sphere that rests on the origin */
        const Vec3 d = p - vec(0, 0, s.radius);
        const float far = length(d);
        *normal = (1.0f / fmaxf(far, 1e-12f)) * d;
        return far - s.radius;
    }
    float qx = 0, qy = 0;
    const float side = outline_nearest(s, p.x, p.y, &qx, &qy);
    const float over = s.height - p.z; /* a centre within goes back the shortest way */
    if (side < 0.0f && p.z > 0.0f && over > 0.0f && fminf(p.z, over) < -side) {
        *normal = vec(0, 0, p.z < over ? -1 : 1);
        return -fminf(p.z, over);
    }
    if (side < 0.0f && p.z > 0.0f && over > 0.0f) {
        const Vec3 out = vec(qx - p.x, qy - p.y, 0);
        *normal = (1.0f / fmaxf(length(out), 1e-12f)) * out;
        return side;
    }
    const float z = fminf(fmaxf(p.z, 0.0f), s.height);
    const Vec3 d = side < 0.0f ? vec(0, 0, p.z - z) : vec(p.x - qx, p.y - qy, p.z - z);
    const float far = length(d);
    *normal = (1.0f / fmaxf(far, 1e-12f)) * d;
    return far;
}

/* The band of a grain with the centre p, in the plate's frame, which it touches. What its centre
 * meets is the shape with its radius around it: under a block a band is as far from the edge of
 * that, and the last has the grains beside the block and over it; under a sphere it is as far from
 * the middle. */
DEVICE int shape_band(const Shape &s, Vec3 p, float radius) {
    float qx = 0, qy = 0;
    const float far = s.points == 0 ? sqrtf(p.x * p.x + p.y * p.y)
                                    : radius - outline_nearest(s, p.x, p.y, &qx, &qy);
    const bool beside = s.points > 0 && p.z > 0.0f;
    return beside || far > s.band * (BANDS - 1) ? BANDS - 1 : (int)fmaxf(far / s.band, 0.0f);
}

/* From the shape's frame to the world's, and back. */
DEVICE Vec3 plate_to_world(const Plate &plate, Vec3 p) {
    const float *t = plate.turn, y = plate.side * p.y;
    return vec(t[0] * p.x + t[1] * y + t[2] * p.z, t[3] * p.x + t[4] * y + t[5] * p.z,
               t[6] * p.x + t[7] * y + t[8] * p.z);
}

DEVICE Vec3 plate_from_world(const Plate &plate, Vec3 p) {
    const float *t = plate.turn;
    return vec(t[0] * p.x + t[3] * p.y + t[6] * p.z,
               plate.side * (t[1] * p.x + t[4] * p.y + t[7] * p.z),
               t[2] * p.x + t[5] * p.y + t[8] * p.z);
}

DEVICE void plate_add(Plate *plate, Vec3 force, Vec3 moment) {
    const float part[6] = {force.x, force.y, force.z, moment.x, moment.y, moment.z};
    for (int k = 0; k < 6; k++) {
        add_to(&plate->sum[k], (long long)((double)part[k] * (double)(1 << SUM_BITS)));
    }
}

#endif
