/* Velocity field of a foot. The element at (x, y) in the foot frame has the velocity
 *
 *     v_x = x[0] + x[1] x + x[2] y
 *
 * along the x axis of the world, and likewise along y and z. */
#ifndef MILD_GROUND_MOTION_H
#define MILD_GROUND_MOTION_H

#include "base/hd.h"

typedef struct {
    Real x[3];    /* [m/s], [1/s], [1/s] */
    Real y[3];    /* the same */
    Real z[3];    /* the same */
    Real lift[3]; /* [1/s] along x, y and z, for each metre above the plane: shells only */
} Motion;

/* The field of a foot with the twist V (linear, angular). arm: the point (0, 0, z) of the frame's
 * sole plane, then its x and y axes, world. */
MILD_HD Motion motion_of(const Real arm[3][3], const Real *V) {
    Motion m;
    for (int k = 0; k < 3; k++) {
        const Real *q = arm[k];
        m.x[k] = V[4] * q[2] - V[5] * q[1] + (k ? 0 : V[0]);
        m.y[k] = V[5] * q[0] - V[3] * q[2] + (k ? 0 : V[1]);
        m.z[k] = V[3] * q[1] - V[4] * q[0] + (k ? 0 : V[2]);
        m.lift[k] = 0;
    }
    return m;
}

/* One component at a point. */
MILD_HD Real motion_at(const Real m[3], Real x, Real y) {
    return m[0] + m[1] * x + m[2] * y;
}

#endif
