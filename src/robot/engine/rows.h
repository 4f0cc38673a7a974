/* A row of the constraints that constraint.h describes: how stiff it is, the rows of a sphere that
 * touches rigid ground, and what a row adds to the line search. */
#ifndef MILD_ENGINE_ROWS_H
#define MILD_ENGINE_ROWS_H

#include "robot/engine/ground.h"
#include "robot/engine/model.h"

#define REGULARIZER_LEAST REAL(1e-15)

/* x^power; 2 is MuJoCo's default. */
MILD_HD Real soft_power(Real x, Real power) {
    return power == 2 ? x * x : REAL_POW(x, power);
}

/* d(r) of a violation r < 0. */
MILD_HD Real soft_impedance(const EngineSoft *soft, Real violation) {
    const Real x = soft->width > 0 ? -violation / soft->width : 0;
    const Real middle = soft->midpoint;
    Real rise;
    if (!(soft->width > 0)) {
        rise = REAL(0.5);
    } else if (x >= 1) {
        rise = 1;
    } else if (soft->power <= 1) {
        rise = x;
    } else if (x <= middle) {
        rise = soft_power(x / middle, soft->power) * middle;
    } else {
        rise = 1 - soft_power((1 - x) / (1 - middle), soft->power) * (1 - middle);
    }
    return soft->nearest + rise * (soft->farthest - soft->nearest);
}

/* ---- a sphere on rigid ground ---- */

/* Unit normal of the surface, and the tangents that MuJoCo's mju_makeFrame takes. */
MILD_HD void surface_frame(const Real *slope, Real frame[3][3]) {
    const Real scale = REAL_INVERSE_SQRT(1 + slope[0] * slope[0] + slope[1] * slope[1]);
    frame[0][0] = -slope[0] * scale;
    frame[0][1] = -slope[1] * scale;
    frame[0][2] = scale;
    const int steep = !(REAL_ABS(frame[0][1]) < REAL(0.5));
    const Real along = steep ? frame[0][2] : frame[0][1];
    const Real length = REAL_SQRT(1 - along * along);
    for (int k = 0; k < 3; k++) {
        const Real unit = k == (steep ? 2 : 1);
        frame[1][k] = (unit - along * frame[0][k]) / length;
    }
    cross3(frame[0], frame[1], frame[2]);
}

/* The model's contact, with the robot's own time constant T instead of the model's: MuJoCo's solref
 * (T, 1), stiffness 1/(d T)^2 and damping 2/(d T) with d beyond the width, T at least two steps. */
MILD_HD EngineSoft corner_soft(const EngineModel *model, EngineRigid rigid) {
    EngineSoft soft = model->number.contact;
    if (rigid.time > 0) {
        const Real rate = 1 / (soft.farthest * real_max(rigid.time, 2 * model->number.dt));
        soft.stiffness = rate * rate;
        soft.damping = 2 * rate;
    }
    return soft;
}

/* Of a corner of a foot, or a point of a shell. */
typedef struct {
    Real radius;          /* [m] */
    Real inverse_inertia; /* [1/kg] body_invweight0 */
} EngineSphere;

/* The rows of its pyramid: the first of four. */
typedef struct {
    Real (*edge)[6];
    Real *reference;
    Real *weight;
} EngineEdges;

/* The four edges of a pyramid: normal plus and minus friction times each tangent. center: of the
 * sphere, point: that the edges and the twist refer to, both [m] from the base's origin; base: [m]
 * the base's height. */
MILD_HD void sphere_edges(const EngineSoft *soft, Real friction, const EngineSurface *surface,
                          Real base, const EngineSphere *sphere, const Real *center,
                          const Real *point, const Real *twist, const EngineEdges *to) {
    Real frame[3][3];
    Real arm[3];
    surface_frame(surface->slope, frame);
    const Real distance = (center[2] + base - surface->height) * frame[0][2] - sphere->radius;
    const Real d = soft_impedance(soft, distance);
    const Real regularizer =
        2 * friction * friction * (1 - d) / d * (1 + friction * friction) * sphere->inverse_inertia;
    for (int k = 0; k < 3; k++) { /* halfway between the surfaces */
        arm[k] = center[k] - ((distance / 2 + sphere->radius) * frame[0][k] + point[k]);
    }
    for (int e = 0; e < 4; e++) {
        const Real lean = e % 2 ? -friction : friction;
        Real *edge = to->edge[e];
        for (int k = 0; k < 3; k++) {
            edge[k] = frame[0][k] + lean * frame[1 + e / 2][k];
        }
        cross3(arm, edge, edge + 3);
        const Real speed = dot3(edge, twist) + dot3(edge + 3, twist + 3);
        to->reference[e] = -soft->damping * speed - soft->stiffness * d * distance;
        to->weight[e] = distance < 0 ? 1 / real_max(regularizer, REGULARIZER_LEAST) : REAL(0);
    }
}

MILD_HD Real edge_along(const Real *edge, const Real *twist) {
    return dot3(edge, twist) + dot3(edge + 3, twist + 3);
}

/* Row r of a stiffness times x [6]: the sum of weights times edge edge^T, on and below its
 * diagonal, row by row. */
MILD_HD Real stiffness_times(const Real *stiffness, int r, const Real *x) {
    Real sum = 0;
    ENGINE_LOOP
    for (int c = 0; c < 6; c++) {
        sum += stiffness[c < r ? r * (r + 1) / 2 + c : c * (c + 1) / 2 + r] * x[c];
    }
    return sum;
}

/* ---- of the line search ---- */

/* Slope and curvature along a Newton step at the length t, and how many rows begin or cease to push
 * between 0 and t. */
typedef struct {
    Real slope;
    Real curvature;
    Real changed;
} LinePoint;

/* Adds a row of residual x that changes by `change` over the whole step. */
MILD_HD void line_row(LinePoint *point, Real weight, Real x, Real change, Real t) {
    const Real now = x + t * change;
    point->slope += now < 0 ? weight * now * change : 0;
    point->curvature += now < 0 ? weight * change * change : 0;
    point->changed += (x < 0) != (now < 0);
}

#endif
