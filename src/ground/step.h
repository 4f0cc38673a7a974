/* The element's impulse over one step as a function of its new velocity (one text for both solvers).
 *
 * Normal. w is the new downward speed, u1 = u0 + dt w. I(w) is continuous and never falls with w, so the whole step is the
 * minimum of a convex function. `front` a = max(u0, u_max) is where virgin ground begins.
 *   u1 <= a: the unloading line through (a, F_g(a)), taken at the end of the step (damps; unconditionally stable)
 *   u1 >  a: virgin ground, three terms:
 *     spring  dt chi f mean of F_g over [a, u1]   (discrete gradient: the work done is the energy stored)
 *     mass    m_a(a) (w - w_a): the added mass moves with the front at w_a and joins without bouncing
 *     drag    c_d (m_a(u1) - m_a(a)) max((w + w0)/2, w)
 *   f: share of the step spent in the ground when it is met within the step.
 *   chi = 1/2 + w/(w0 + w) for a braking element: an engine moves by dt w, the new speed, while work is done at the
 *     mean speed (w0 + w)/2. chi = 2 w/(w0 + w) would conserve energy exactly and overshoots in the last step, chi = 1
 *     brakes too early by half a step; between them the first-order errors cancel (stop depth within 0.6 % at 0.25 ms,
 *     most within 2 % at 5 ms). chi never falls below the passive bound. `blend` fades it out for slow elements. */
#ifndef MILD_GROUND_STEP_H
#define MILD_GROUND_STEP_H

#include "ground/contact.h"

#define STEP_TINY 1e-30
#define STEP_HUGE 1e30

static inline double step_max(double a, double b) {
    return a > b ? a : b;
}

static inline double step_min(double a, double b) {
    return a < b ? a : b;
}

/* [N s] impulse and [kg] its slope at downward speed w. */
static inline void step_normal(const Slots *s, int i, double dt, double w, double *impulse, double *slope) {
    double a = s->front[i], u1 = s->depth[i] + dt * w;
    double virgin = u1 > a ? 1.0 : 0.0, d = step_max(u1 - a, 0.0);

    /* Mean of F_g over [a, a + d] by Simpson's rule, exact for the cubic; the bed at its end. */
    double flat = s->flat[i], cone = s->cone[i], inverse_full = s->inverse_full[i], third = s->full[i] * (1.0 / 3.0);
    double c0 = step_max(1.0 - a * inverse_full, 0.0), cm = step_max(1.0 - (a + 0.5 * d) * inverse_full, 0.0);
    double c1 = step_max(1.0 - (a + d) * inverse_full, 0.0);
    double c0_cube = c0 * c0 * c0, c1_square = c1 * c1, c1_cube = c1_square * c1;
    double mean_cube = (c0_cube + 4.0 * cm * cm * cm + c1_cube) * (1.0 / 6.0);
    double mean = flat * third * (1.0 - mean_cube) + cone * (a + 0.5 * d);
    double mean_slope = flat * (2.0 * cm * cm + c1_square) * (1.0 / 6.0) + 0.5 * cone;
    double in_bed = a + d - s->bed[i];

    double gap = s->gap[i], w0 = s->speed[i], blend = s->blend[i], wc = step_min(step_max(w, 0.0), w0);
    double way = d + gap + STEP_TINY, speeds = w0 + wc + STEP_TINY, both = 1.0 / (way * speeds); /* one division for two */
    double path = speeds * both, sum = way * both, share = (d + STEP_TINY) * path;
    double chi = 1.0 - blend * (0.5 - wc * sum), braking = (w > 0.0 ? 1.0 : 0.0) * (w < w0 ? 1.0 : 0.0);
    double chi_slope = braking * blend * w0 * sum * sum;

    double drag_mass = s->drag_now[i] * third * (c0_cube - c1_cube), drag_speed = step_max(0.5 * (w + w0), w);
    double reach = s->reach[i], mass = s->mass[i];
    double bed_stiffness = s->bed_stiffness[i], bed_on = in_bed > 0.0 ? bed_stiffness : 0.0;

    double on_virgin = dt * (mean * share * chi + bed_on * in_bed) + mass * (step_max(w, reach) - s->front_speed[i]) +
                       drag_mass * drag_speed + s->explicit_impulse[i];
    double virgin_slope =
        dt * (virgin * dt * (mean_slope * share * chi + mean * chi * gap * path * path + bed_on) + mean * share * chi_slope) +
        (w > reach ? mass : 0.0) +
        virgin * (s->drag_now[i] * c1_square * dt * drag_speed + drag_mass * (w < w0 ? 0.5 : 1.0));

    double line = s->line[i], on_line = dt * (s->front_force[i] + line * (u1 - a)), bound = u1 > a ? STEP_HUGE : on_line;
    double value = step_min(bound, on_virgin), rate = bound < on_virgin ? dt * dt * line : virgin_slope;
    double pushes = value > 0.0 ? 1.0 : 0.0;
    *impulse = pushes * value;
    *slope = pushes * rate;
}

#endif
