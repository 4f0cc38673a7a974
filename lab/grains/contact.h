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

#endif
