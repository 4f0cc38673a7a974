/* The frame in which a plane sole presses on ground whose cones merge (docs/model.md section 21).
 *
 * A yield force has a direction: a tilted sole that is pressed straight down is pushed sideways,
 * and one that is dragged is lifted where its underside faces the way. In grains it is along
 *
 *     e = n + t (m - n), normalised       n: normal of the ground, m: of the sole, both up
 * with t = frame_turn. The step is that of a level sole in a frame of which e is the normal: an
 * element penetrates along -e and slips across it. Its depth stays the vertical one. So the
 * equations keep their form, and what an element gains by a force along e it pays by a way along e.
 *
 * The frame is the smallest rotation Q from n to e, given by its axis times its sine,
 *
 *     v = n x e,   Q a = c a + v x a + v (v . a)/(1 + c),   c = sqrt(1 - v . v) */
#ifndef MILD_GROUND_FRAME_H
#define MILD_GROUND_FRAME_H

#include "ground/law/element.h"

#define FRAME_MOST REAL(0.32) /* [-] sine of the largest turn: of tilts of 31 degrees and more */
#define FRAME_TURN REAL(0.6)  /* [-] share of the tilt: eleven tilted plates on grains */

/* [-] t. Ground that springs back gives energy to a sole that it pushes along: its line unloads
 * along e, and a greater depth loads it again, by r/(1 - r) of what the line holds. So there is no
 * frame from the recovery r = 1/5 on. */
MILD_HD Real frame_turn(Real recovery) {
    return FRAME_TURN * real_max(1 - 5 * recovery, 0);
}

/* v. sole: normal of the sole's plane, either way. slope: gradient of the ground. turn: [-] t;
 * 0: v is 0. */
MILD_HD void frame_axis(const Real sole[3], Real slope_x, Real slope_y, Real turn, Real v[3]) {
    const Real side = sole[2] < 0 ? REAL(-1) : REAL(1);
    const Real upright = REAL_INVERSE_SQRT(1 + slope_x * slope_x + slope_y * slope_y);
    const Real n[3] = {-slope_x * upright, -slope_y * upright, upright};
    Real e[3], square = 0;
    for (int k = 0; k < 3; k++) {
        e[k] = n[k] + turn * (side * sole[k] - n[k]);
        square += e[k] * e[k];
    }
    const Real length = turn > 0 ? REAL_INVERSE_SQRT(real_max(square, REAL(1e-12))) : 0;
    v[0] = (n[1] * e[2] - n[2] * e[1]) * length;
    v[1] = (n[2] * e[0] - n[0] * e[2]) * length;
    v[2] = (n[0] * e[1] - n[1] * e[0]) * length;
    const Real sine = REAL_SQRT(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    const Real within = sine > FRAME_MOST ? FRAME_MOST / sine : 1;
    for (int k = 0; k < 3; k++) {
        v[k] *= within;
    }
}

/* Q a: a vector of the frame, in the world. */
MILD_HD void frame_to_world(const Real v[3], const Real a[3], Real world[3]) {
    const Real c = REAL_SQRT(real_max(1 - v[0] * v[0] - v[1] * v[1] - v[2] * v[2], 0));
    const Real along = (v[0] * a[0] + v[1] * a[1] + v[2] * a[2]) / (1 + c);
    const Real x = c * a[0] + v[1] * a[2] - v[2] * a[1] + along * v[0];
    const Real y = c * a[1] + v[2] * a[0] - v[0] * a[2] + along * v[1];
    world[2] = c * a[2] + v[0] * a[1] - v[1] * a[0] + along * v[2];
    world[0] = x;
    world[1] = y;
}

/* Q^T a: a vector of the world, in the frame. */
MILD_HD void frame_of_world(const Real v[3], const Real world[3], Real a[3]) {
    const Real back[3] = {-v[0], -v[1], -v[2]};
    frame_to_world(back, world, a);
}

/* [m/s] Velocity of an element in the world. x, y, descent: in the frame. slope: gradient of the
 * ground. */
MILD_HD void frame_velocity(const Real v[3], Real slope_x, Real slope_y, Real x, Real y,
                            Real descent, Real world[3]) {
    const Real own[3] = {x, y, slope_x * x + slope_y * y - descent};
    frame_to_world(v, own, world);
}

/* [m/s] By how much the depth of an element grows faster than it penetrates; as frame_velocity. */
MILD_HD Real frame_sinks(const Real v[3], Real slope_x, Real slope_y, Real x, Real y,
                         Real descent) {
    Real world[3];
    frame_velocity(v, slope_x, slope_y, x, y, descent, world);
    return slope_x * world[0] + slope_y * world[1] - world[2] - descent;
}

/* [m/s] By how much an element moves less along the normal of the sole than along e. The normal is,
 * in the frame, e + v x e (1 - t)/t. A sole that slices along its own slope reaches no fresh
 * ground. */
MILD_HD Real frame_slices(const Real v[3], Real x, Real y) {
    return real_max((1 - FRAME_TURN) / FRAME_TURN * (v[1] * x - v[0] * y), 0);
}

#endif
