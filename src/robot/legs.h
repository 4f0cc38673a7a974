/* Contact between two legs: the same code for MuJoCo's robots (robot/legs.c) and for the batch
 * engine's (robot/engine/legs.h). A leg is a few capsules. Two capsules of different legs push
 * each other along their normal, without friction, with
 *
 *     F = max(0, -(v + r)/(dt (A + 1/m))),   r = d/dt apart, LEGS_RETURN d/dt in overlap:
 *
 * d is the distance of their surfaces, v its rate, A the inverse inertia along the normal, so that
 * F changes v by dt A F. The robot's mass m bounds the push where no joint can part them, A = 0.
 * Legs apart may just come to touch in a step. Legs in overlap stop, and take back a share of it,
 * less than what brought them there: the contact only takes energy, at any dt.
 * Other forces of the step act beside it; a steady force P between two legs holds them at
 * d = -P dt^2 A/LEGS_RETURN. The ground is solved after F and counts with it. */
#ifndef ROBOT_LEGS_H
#define ROBOT_LEGS_H

#include "base/hd.h"

#define LEGS_RETURN REAL(0.5)   /* [-] share of the overlap that a step takes back */
#define LEGS_NEAR REAL(0.01)    /* [m] legs further apart do not meet in a step */
#define LEGS_PARALLEL 1e-4      /* [-] see legs_gap */
#define LEGS_APART REAL(1e9)    /* [m] where there are no two legs */
#define LEGS_CROSSED REAL(1e-6) /* [m] nearer axes have no direction */

typedef struct {
    Real center[3]; /* [m] */
    Real half[3];   /* [m] from the centre to the end of the axis; 0: a sphere */
    Real radius;    /* [m] */
} LegCapsule;

typedef struct {
    Real gap;       /* [m] between the surfaces; negative: overlap */
    Real normal[3]; /* [-] from a to b */
    Real point[3];  /* [m] in the middle between the surfaces */
} LegGap;

MILD_HD Real legs_dot(const Real *a, const Real *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

MILD_HD Real legs_clip(Real x) {
    return x > 1 ? 1 : x < -1 ? -1 : x;
}

/* Bool: they may be nearer than LEGS_NEAR: spheres around them are. */
MILD_HD int legs_near(const LegCapsule *a, const LegCapsule *b) {
    Real square = 0;
    for (int k = 0; k < 3; k++) {
        square += (b->center[k] - a->center[k]) * (b->center[k] - a->center[k]);
    }
    const Real reach = REAL_SQRT(legs_dot(a->half, a->half)) +
                       REAL_SQRT(legs_dot(b->half, b->half)) + a->radius + b->radius + LEGS_NEAR;
    return square < reach * reach;
}

/* The nearest points c_a + s h_a and c_b + t h_b of the axes, |s|, |t| <= 1 (Ericson 2005, section
 * 5.1.9). Of parallel axes no two points are nearest. The small part LEGS_PARALLEL of s^2 and t^2
 * takes those in the middle; it makes the point a continuous function of the pose, and the gap too
 * large by 1e-5 m at most. across: [3] [-] the normal of axes that meet. */
MILD_HD void legs_gap(const LegCapsule *a, const LegCapsule *b, const Real *across, LegGap *out) {
    Real between[3]; /* from b's centre to a's */
    for (int k = 0; k < 3; k++) {
        between[k] = a->center[k] - b->center[k];
    }
    const Real aa = legs_dot(a->half, a->half) * (1 + REAL(LEGS_PARALLEL));
    const Real bb = legs_dot(b->half, b->half) * (1 + REAL(LEGS_PARALLEL));
    const Real ab = legs_dot(a->half, b->half);
    const Real pull = legs_dot(a->half, between), push = legs_dot(b->half, between);
    const Real det = aa * bb - ab * ab;
    Real s = det > 0 ? legs_clip((ab * push - pull * bb) / det) : 0;
    Real t = bb > 0 ? (ab * s + push) / bb : 0;
    if (t != legs_clip(t) || !(det > 0)) {
        t = legs_clip(t);
        s = aa > 0 ? legs_clip((ab * t - pull) / aa) : 0;
    }
    Real way[3];
    for (int k = 0; k < 3; k++) {
        way[k] = t * b->half[k] - s * a->half[k] - between[k];
    }
    const Real length = REAL_SQRT(legs_dot(way, way));
    out->gap = length - a->radius - b->radius;
    for (int k = 0; k < 3; k++) {
        const Real n = length > LEGS_CROSSED ? way[k] / length : across[k];
        out->normal[k] = n;
        out->point[k] = a->center[k] + s * a->half[k] + (a->radius + out->gap / 2) * n;
    }
}

/* [N] F. rate [m/s]: v; mobility [1/kg]: A + 1/m. */
MILD_HD Real legs_force(Real dt, Real gap, Real rate, Real mobility) {
    const Real back = gap < 0 ? LEGS_RETURN * gap : gap;
    return real_max(0, -(rate + back / dt)) / (dt * mobility);
}

#endif
