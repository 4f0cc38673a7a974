/* The element's impulse over one step as a function of its new velocity (one text for both solvers).
 *
 * An engine of the semi-implicit kind moves by its new velocity, u1 = u0 + dt w, so its velocities belong to the middles of
 * the steps: a body in free fall keeps w^2/2 - g m exactly, m = u + dt w/2 the depth in the middle of the step. The ground
 * keeps to that clock. The step in hand leads from the middle m0 of the step before to m1 = u0 + dt w/2, and the impulse is
 *     I = dt (E(m1) - E(m0))/(m1 - m0),    dE/dm = F(m): the unloading line up to the front a, virgin ground beyond it
 * the mean force over the way. Since m1 - m0 = dt (w0 + w)/2, the work at the mean velocity I (w0 + w)/2 dt is what E gains:
 * nothing is created or lost at any step size, and the error is of second order in dt. The mean of a rising function rises
 * with m1, so I(w) never falls with w and the whole step is the minimum of a convex function. Beyond E,
 *     mass    m_a(a) (max(w, reach) - w_a): the added mass moves with the front at w_a and joins without bouncing
 *     growth  (m_a(m1) - m_a(a)) (c_d (w0 + w)/2 + (w - w0)/2): drag, and mass that is recruited at w0 and leaves at w
 *     damping dt T line e(w + max(w0, 0)): unloading ground lags behind the foot by T = STEP_LAG; e(s) is 0 for s > 0, s + E/2
 *             below -E and -s^2/(2 E) between, so that a resting foot has no kink under it (E = STEP_EASE)
 * c_d < 1 takes min(w, w0) for w0: so the last term never pushes and gives no energy for c_d >= 1/2. */
#ifndef MILD_GROUND_STEP_H
#define MILD_GROUND_STEP_H

#include "ground/contact.h"

#define STEP_TINY 1e-30
#define STEP_LAG 5e-3  /* [s] of the force behind the depth on the unloading line; the same at every step size */
#define STEP_EASE 2e-6 /* [m/s] over which it begins */

static inline double step_max(double a, double b) {
    return a > b ? a : b;
}

static inline double step_min(double a, double b) {
    return a < b ? a : b;
}

/* [N s] impulse and [kg] its slope at downward speed w. */
static inline void step_normal(const Slots *s, int i, double dt, double w, double *impulse, double *slope) {
    double a = s->front[i], m0 = s->middle[i], m1 = s->depth[i] + 0.5 * dt * w, d = step_max(m1 - a, 0.0);
    double per_way = 1.0 / (fabs(m1 - m0) + STEP_TINY), virgin = m1 > a ? 1.0 : 0.0;

    /* Unloading line, force line * l, l the stretch from where it carries nothing. */
    double line = s->line[i], l0 = s->stretch[i], end = step_min(m1, a) - s->slack[i], l1 = step_max(end, 0.0);
    double on_line = 0.5 * line * (l0 + l1), line_share = (fabs(l1 - l0) + STEP_TINY) * per_way;
    double line_slope = 0.5 * line * line_share * (end > 0.0 ? 2.0 - line_share : line_share);

    /* Mean of F_g over [b, b + d] by Simpson's rule, exact for the cubic; the bed at its end. b = a but for resist.c. */
    double b = s->deep[i], flat = s->flat[i], cone = s->cone[i], inverse_full = s->inverse_full[i];
    double c0 = step_max(1.0 - b * inverse_full, 0.0), cm = step_max(1.0 - (b + 0.5 * d) * inverse_full, 0.0);
    double c1 = step_max(1.0 - (b + d) * inverse_full, 0.0), third = s->full[i] * (1.0 / 3.0);
    double c0_cube = c0 * c0 * c0, c1_square = c1 * c1, c1_cube = c1_square * c1, share = d * per_way;
    double in_bed = b + d - s->bed[i], stiffness = s->bed_stiffness[i], bed = in_bed > 0.0 ? stiffness : 0.0;
    double mean_cube = (c0_cube + 4.0 * cm * cm * cm + c1_cube) * (1.0 / 6.0);
    double mean = flat * third * (1.0 - mean_cube) + cone * (b + 0.5 * d) + bed * in_bed;
    double mean_slope = flat * (2.0 * cm * cm + c1_square) * (1.0 / 6.0) + 0.5 * cone + bed;
    double virgin_slope = share * mean_slope + ((a - m0) * mean - on_line * (l1 - l0)) * per_way * per_way;

    double w0 = s->speed[i], reach = s->reach[i], mass = s->mass[i], growth = third * (c0_cube - c1_cube);
    double down = step_max(w, 0.0), join = s->join[i], leave = s->leave[i], old = leave < 0.0 ? step_min(down, w0) : w0;
    double recruited = join * down + leave * old, recruited_slope = w > 0.0 ? join + (old < w0 ? leave : 0.0) : 0.0;
    double lag = dt * STEP_LAG * line, back = w + w0, begin = step_min(step_max(back, -STEP_EASE), 0.0);
    double eased = step_min(back + STEP_EASE, 0.0) - begin * begin * (0.5 / STEP_EASE);

    double value = dt * (on_line * line_share + mean * share) + mass * (step_max(w, reach) - s->front_speed[i]) +
                   growth * recruited + lag * eased + s->explicit_impulse[i];
    double rate = 0.5 * dt * dt * (virgin > 0.0 ? virgin_slope : line_slope) + (w > reach ? mass : 0.0) +
                  virgin * 0.5 * dt * c1_square * recruited + growth * recruited_slope + lag * begin * (-1.0 / STEP_EASE);
    double pushes = value > 0.0 ? 1.0 : 0.0;
    *impulse = pushes * value;
    *slope = pushes * rate;
}

#endif
