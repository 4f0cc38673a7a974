/* Friction and drift resistance of an element (paper eqs 13 and 14; one text for both solvers).
 *
 * Coulomb's law bounds the horizontal impulse by r = mu I_z + dt k_D d_D u. Below the bound the
 * ground is elastic, as it is below its yield load, over FRICTION_ELASTIC, and lags by STEP_LAG
 * (Mindlin's contact as Cundall and Strack 1979 compute it, with damping): t = dt f - (dt^2 k + c)
 * v,    c = r STEP_LAG/FRICTION_ELASTIC,    I = t min(1, r/|t|) - dt b_D v with v the element's
 * velocity after the step, f the force held before and k its stiffness. A resting foot is held
 * without creep. k takes energy only: E = f^2/(2 k) falls as k grows at the same force; where k
 * falls the force falls with it. With k and f of the step's beginning the disc's projection gives
 * |f_new|^2 - |f|^2 <= 2 k I . v, so nothing is gained. For given r, I is minus the gradient of a
 * convex function of v, with slopes of at most dt^2 k + c. */
#ifndef MILD_GROUND_FRICTION_H
#define MILD_GROUND_FRICTION_H

#include "ground/step.h"

#define FRICTION_TINY 1e-300
#define FRICTION_ELASTIC 2e-5 /* [m] */
#define FRICTION_LAG                                                                               \
    (STEP_LAG /                                                                                    \
     FRICTION_ELASTIC) /* [s/m] c/r: without a force held, friction reaches its bound at 4 mm/s */

/* What holds the element at rest: k from the bound at the front's yield force [N]; rate = 1/dt. */
static inline void slot_grip(const Slots *s, int i, double dt, double rate, double yield) {
    double k = (s->mu[i] * yield + s->drift_radius[i] * rate) * (1.0 / FRICTION_ELASTIC),
           old = s->held_grip[i];
    double keeps = k < old ? k / old : 1.0;
    s->grip[i] = dt * dt * k;
    s->hold_x[i] = dt * keeps * s->held_x[i];
    s->hold_y[i] = dt * keeps * s->held_y[i];
}

/* Impulse [N s] under the bound r, which changes by mu with I_z. What it falls by with v [kg] is
 * left in the slot's hxx, hxy and hyy, what it rises by with I_z [-] in rise. */
static inline void friction_at(const Slots *s, int i, double r, double mu, double vx, double vy,
                               double *ix, double *iy, double *rise_x, double *rise_y) {
    double stiff = s->grip[i] + FRICTION_LAG * r, b = s->damping[i];
    double tx = s->hold_x[i] - stiff * vx, ty = s->hold_y[i] - stiff * vy,
           length = sqrt(tx * tx + ty * ty);
    double inverse = 1.0 / (length + FRICTION_TINY), reach = r * inverse,
           share = length > r ? reach : 1.0;
    double along = length > r ? inverse : 0.0, nx = along * tx, ny = along * ty,
           yields = share * stiff;
    double lag_x = -share * FRICTION_LAG * vx, lag_y = -share * FRICTION_LAG * vy,
           lag_n = 1.0 - (nx * lag_x + ny * lag_y);
    *ix = share * tx - b * vx;
    *iy = share * ty - b * vy;
    s->hxx[i] = b + yields * (1.0 - nx * nx);
    s->hxy[i] = -yields * nx * ny;
    s->hyy[i] = b + yields * (1.0 - ny * ny);
    *rise_x = mu * (lag_x + nx * lag_n);
    *rise_y = mu * (lag_y + ny * lag_n);
}

/* Bool: friction is at its bound at that velocity. */
static inline int friction_slides(const Slots *s, int i, double vx, double vy) {
    double r = s->mu[i] * s->iz[i] + s->drift_radius[i], stiff = s->grip[i] + FRICTION_LAG * r;
    double tx = s->hold_x[i] - stiff * vx, ty = s->hold_y[i] - stiff * vy;
    return tx * tx + ty * ty > r * r;
}

#endif
