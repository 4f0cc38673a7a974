/* Resistive force theory under one element: the sole is a plate that moves through the ground, and
 * the stress on it is zeta 1e6 N/m^3 times its depth times coefficients that depend on its
 * orientation and on the direction of its motion.
 *
 *     2D   Li, Zhang, Goldman, Science 339 (2013), generic coefficients; here in the vertical plane
 *          of each element's motion
 *     3D   Agarwal, Goldman, Kamrin, PNAS 120 (2023)
 * The implicit step uses the direction of motion at the start of the step. With it fixed, an
 * element has two yield stresses:
 *
 *     downward   the slope of virgin ground becomes share peak, share = alpha_z/RESIST_PEAK
 *     sideways   the radius of the friction disc grows by dt zeta 1e6 s u alpha_x. Friction opposes
 *                the motion and never reverses it, so the step stays convex
 *
 * Two horizontal forces on a tilted plate are left out: the one across its motion, and the one
 * before it moves sideways at all. They do not oppose the new velocity, so taken at the old
 * velocity they could create energy.
 *
 * At rest the direction is undefined, and an element may yield to any side. Below RESIST_REST the
 * direction blends to straight down for the downward yield stress, and to horizontal for the
 * sideways one.
 *
 * A change of direction must not create energy. The unloading line is therefore that of the peak
 * for every direction. Its upper end b lies ELEMENT_ELASTIC (1 - share) deeper than an element with
 * a smaller share has been. The element yields on that line, at the depth where the line gives its
 * yield force. An element that lands begins on the line of the peak from the surface, whose first
 * ELEMENT_ELASTIC is the whole of its travel, before it yields: what the line then holds, the
 * element has pressed into it. */
#ifndef MILD_GROUND_PLATE_H
#define MILD_GROUND_PLATE_H

#include "base/hd.h"
#include "ground/law/friction.h"

/* Once for each foot, so that it need not be inlined; gcc would round some last bits otherwise. */
#define PLATE_FN static MILD_BOTH __attribute__((unused))

#define RESIST_REST REAL(1e-3) /* [m/s] speed below which the direction of motion fades out */
/* [-] Upper bound on alpha_z in both theories, whose largest values are 1 (2D, level plate,
 * straight down) and 1.076 (3D, at 27 degrees). */
#define RESIST_PEAK REAL(1.08)
/* [-] alpha_z of the 3D theory for a level plate moving straight down. */
#define RESIST_LEVEL REAL(0.87504)

/* Coefficients of the force on a plate. */
typedef struct {
    Real x; /* [-] against its horizontal motion */
    Real z; /* [-] up */
} Alpha;

/* The 2D theory, with the generic coefficients of Li et al. 2013, table S3 [N/cm^3]. c2, s2: cosine
 * and sine of 2 beta. c, s: cosine and sine of gamma. */
MILD_HD Alpha plane_alpha(Real c2, Real s2, Real c, Real s) {
    const Real A00 = REAL(0.206), A10 = REAL(0.169), B11 = REAL(0.212);
    const Real B01 = REAL(0.358), BM11 = REAL(0.055);
    const Real C11 = REAL(-0.124), C01 = REAL(0.253), CM11 = REAL(0.007), D10 = REAL(0.088);
    const Real sum = s2 * c + c2 * s;        /* sin(2 beta + gamma) */
    const Real difference = c2 * s - s2 * c; /* sin(-2 beta + gamma) */
    Alpha alpha;
    alpha.x = C11 * (c2 * c - s2 * s) + C01 * c + CM11 * difference + D10 * s2;
    alpha.z = A00 + A10 * c2 + B11 * sum + B01 * s + BM11 * difference;
    return alpha;
}

/* The 3D theory (Agarwal et al. 2023, supplement): alpha = f1 n + f2 v + f3 (0, 0, -1). The
 * coefficients of f1, f2, f3 belong to powers of x1 = sin(gamma) = -v_z, x2 = cos(beta) = -n_z, x3
 * = n . v. */
MILD_HD_FN const Real *space_coefficients(int k) {
    static const Real coefficients[3][20] = {
        {REAL(0.00212), REAL(-0.02320), REAL(-0.20890), REAL(-0.43083), REAL(-0.00259),
         REAL(0.48872), REAL(-0.00415), REAL(0.07204),  REAL(-0.02750), REAL(-0.08772),
         REAL(0.01992), REAL(-0.45961), REAL(0.40799),  REAL(-0.10107), REAL(-0.06576),
         REAL(0.05664), REAL(-0.09269), REAL(0.01892),  REAL(0.01033),  REAL(0.15120)},
        {REAL(-0.06796), REAL(-0.10941), REAL(0.04725),  REAL(-0.06914), REAL(-0.05835),
         REAL(-0.65880), REAL(-0.11985), REAL(-0.25739), REAL(-0.26834), REAL(0.02692),
         REAL(-0.00736), REAL(0.63758),  REAL(0.08997),  REAL(0.21069),  REAL(0.04748),
         REAL(0.20406),  REAL(0.18589),  REAL(0.04934),  REAL(0.13527),  REAL(-0.33207)},
        {REAL(-0.02634), REAL(-0.03436), REAL(0.45256),  REAL(0.00835),  REAL(0.02553),
         REAL(-1.31290), REAL(-0.05532), REAL(0.06790),  REAL(-0.16404), REAL(0.02287),
         REAL(0.02927),  REAL(0.95406),  REAL(-0.00131), REAL(-0.11028), REAL(0.01487),
         REAL(-0.02730), REAL(0.10911),  REAL(-0.04097), REAL(0.07881),  REAL(-0.27519)}};
    return coefficients[k];
}

/* A polynomial of the 3D theory for a given plate, for which x2 = y is constant: coefficients of 1,
 * x1, x3, x1^2, x1 x3, x3^2, x1^3, x1^2 x3, x1 x3^2, x3^3. c: [20] space_coefficients. */
typedef Real Cubic[10];

PLATE_FN void cubic_at(const Real *c, Real y, Cubic a) {
    const Real square = y * y;
    a[0] = c[0] + c[2] * y + c[5] * square + c[11] * square * y;
    a[1] = c[1] + c[7] * y + c[13] * square;
    a[2] = c[3] + c[8] * y + c[16] * square;
    a[3] = c[4] + c[14] * y;
    a[4] = c[9] + c[19] * y;
    a[5] = c[6] + c[15] * y;
    a[6] = c[10];
    a[7] = c[17];
    a[8] = c[18];
    a[9] = c[12];
}

MILD_HD Real cubic(const Real *a, Real x, Real z) {
    return a[0] + x * (a[1] + x * (a[3] + x * a[6])) +
           z * (a[2] + z * (a[5] + z * a[9]) + x * (a[4] + x * a[7] + z * a[8]));
}

/* The sole as a plate. */
typedef struct {
    Real normal[3]; /* [-] unit vector into the ground, world */
    Real tilt;      /* [-] length of its horizontal part */
    Cubic f[3];     /* the polynomials at that normal */
} Plate;

/* normal: outward, of a face that points down. */
PLATE_FN Plate plate_facing(const Real normal[3]) {
    Plate plate;
    plate.normal[0] = normal[0];
    plate.normal[1] = normal[1];
    plate.normal[2] = real_min(normal[2], REAL(-1e-6));
    plate.tilt = REAL_SQRT(plate.normal[0] * plate.normal[0] + plate.normal[1] * plate.normal[1]) +
                 ELEMENT_TINY;
    for (int k = 0; k < 3; k++) {
        cubic_at(space_coefficients(k), -plate.normal[2], plate.f[k]);
    }
    return plate;
}

/* rotation: [9] of the foot. */
PLATE_FN Plate plate_of(const Real *rotation) {
    const Real side = rotation[8] > 0 ? -1 : 1; /* the face of the sole that points down */
    const Real normal[3] = {side * rotation[2], side * rotation[5], side * rotation[8]};
    return plate_facing(normal);
}

/* Coefficients against the heading and upward, for motion at the horizontal speed `level` and the
 * downward speed `down`. forward: component of the normal along the heading. in_space: bool, use
 * the 3D theory. */
MILD_HD Alpha plate_alpha(const Plate *plate, int in_space, Real forward, Real level, Real down) {
    const Real scale = 1 / REAL_SQRT(level * level + down * down);
    const Real c = level * scale;
    const Real s = down * scale;
    if (!in_space) {
        const Real slope = forward * (-1 / plate->normal[2]);
        const Real whole = 1 / (1 + slope * slope);
        return plane_alpha((1 - slope * slope) * whole, 2 * slope * whole, c, s);
    }
    const Real z = forward * c - plate->normal[2] * s;
    const Real faces = z < 0 ? 0 : 1 / RESIST_LEVEL;
    const Real f1 = cubic(plate->f[0], s, z);
    const Real f2 = cubic(plate->f[1], s, z);
    const Real f3 = cubic(plate->f[2], s, z);
    Alpha alpha;
    alpha.x = -faces * (f1 * forward + f2 * c);
    alpha.z = faces * (f1 * plate->normal[2] - f2 * s - f3);
    return alpha;
}

/* Adapts the law of an element to coefficients against the heading, `sideways`, and up, `downward`
 * [-]. strength: [N/m] slope for a level plate moving straight down. rate: 1/dt. */
MILD_HD void element_yield(Element *e, const ElementMemory *memory, int curves, Real dt, Real rate,
                           Real strength, Real sideways, Real downward) {
    /* The line of the peak starts deeper than the element has been, at least its travel deep. */
    const Real peak = RESIST_PEAK * strength;
    const Real share = real_min(real_max(downward / RESIST_PEAK, 0), 1);
    const Real lead = ELEMENT_ELASTIC * (1 - share);
    const Real led = real_max(e->middle + lead, ELEMENT_ELASTIC);
    const Real b = real_max(led, e->virgin_depth);

    const Real bed = law_bed_force(&e->law, b);
    const Real peak_force = peak * b + bed;
    const Real yield_force = share * peak * b + bed;
    const Real line = real_max(peak_force / ELEMENT_ELASTIC, peak + law_bed_slope(&e->law, b));
    const Real inverse = 1 / (line + ELEMENT_TINY); /* no strength: a line of no length */
    e->law.line_stiffness = share * peak;
    e->virgin_depth = b;
    e->unload_stiffness = line;
    e->zero_depth = b - peak_force * inverse;
    e->yield_depth = e->zero_depth + yield_force * inverse;
    e->yield_speed = real_max(2 * (e->yield_depth - e->depth) * rate, 0);

    e->drift_bound += dt * strength * real_max(sideways, 0) * real_max(e->depth, 0);
    const Real held = yield_force + law_elastic_force(&e->law, curves, e->middle);
    friction_hold(e, memory, dt, rate, held);
}

/* The motion of a plate, as plate_alpha takes it. */
typedef struct {
    Real forward; /* [-] component of the normal along the heading */
    Real level;   /* [m/s] horizontal speed; 0 where friction may still hold it */
    Real down;    /* [m/s] downward speed */
} PlateMotion;

/* vx and vy: velocity along the world's axes. descent: downward. */
MILD_HD PlateMotion plate_motion(const Plate *plate, Real vx, Real vy, Real descent) {
    /* The heading is that of the motion plus RESIST_REST along the tilt. If both vanish the plate
     * is level, and every heading gives the same result. */
    const Real rest = RESIST_REST / plate->tilt;
    const Real hx = vx + rest * plate->normal[0];
    const Real hy = vy + rest * plate->normal[1];
    const Real scale = 1 / (REAL_SQRT(hx * hx + hy * hy) + ELEMENT_TINY);
    const Real moves = REAL_SQRT(vx * vx + vy * vy);
    PlateMotion motion;
    motion.forward = (plate->normal[0] * hx + plate->normal[1] * hy) * scale;
    motion.level = moves * FRICTION_LAG < 1 ? 0 : moves;
    motion.down = real_max(descent, 0);
    return motion;
}

/* Adapts the law of an element to its velocity at the start of the step (vx and vy along the
 * world's axes, `descent` downward), after element_begin. */
MILD_HD void element_resist(Element *e, const ElementMemory *memory, const Plate *plate,
                            int in_space, int curves, Real dt, Real rate, Real strength, Real vx,
                            Real vy, Real descent) {
    const PlateMotion m = plate_motion(plate, vx, vy, descent);
    const Alpha sinking = plate_alpha(plate, in_space, m.forward, m.level, m.down + RESIST_REST);
    const Alpha sliding = plate_alpha(plate, in_space, m.forward, m.level + RESIST_REST, m.down);
    element_yield(e, memory, curves, dt, rate, strength, sliding.x, sinking.z);
}

#endif
