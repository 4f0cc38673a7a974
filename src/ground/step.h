/* The element's impulse over one step as a function of its new velocity (one text for both
 * solvers).
 *
 * An engine of the semi-implicit kind moves by its new velocity, u1 = u0 + dt w, so its velocities
 * belong to the middles of the steps: a body in free fall keeps w^2/2 - g m exactly, m = u + dt w/2
 * the depth in the middle of the step. The ground keeps to that clock. The step in hand leads from
 * the middle m0 of the step before to m1 = u0 + dt w/2, and the impulse is I = dt (E(m1) -
 * E(m0))/(m1 - m0),    dE/dm = F(m): the unloading line up to the front a, virgin ground beyond it
 * the mean force over the way. Since m1 - m0 = dt (w0 + w)/2, the work at the mean velocity I (w0 +
 * w)/2 dt is what E gains: nothing is created or lost at any step size, and the error is of second
 * order in dt. The mean of a rising function rises with m1, so I(w) never falls with w and the
 * whole step is the minimum of a convex function. Beyond E, mass    m_a(a) (max(w, reach) - w_a):
 * the added mass moves with the front at w_a and joins without bouncing growth  (m_a(m1) - m_a(a))
 * (w + (c_d - 1) V): mass that is recruited at rest and leaves at w, and drag damping dt T line e(w
 * + h): unloading ground lags behind the foot by T = STEP_LAG; e(s) is 0 for s > 0, s + E/2 below
 * -E and -s^2/(2 E) between, so that a resting foot has no kink under it (E = STEP_EASE)
 *
 * Drag. Its work over the way is c_d m_a' times the integral of w^2; the V that belongs to an
 * impulse is the mean of w^2 over the way by (h + w)/2, h the speed at the front. For slow changes
 * it is (h + w)/2. A light foot stops within the step: where drag alone slows it, the mean of w^2
 * is logarithmic, (h^2 - w^2)/(2 ln(h/w)), and goes to 0 with w; where the force F of the ground
 * does the rest, it is (h^2 + w^2)/2. Both are near
 *     V = (h + w)/2 + (still - 1/2) (h - w)^2/h   for w < h,    still = V(0)/h = STEP_STILL +
 * sqrt(F/(drag h^2)), a fit to the exact impact of a body on a force that grows from 0; still is
 * 3/4 at most, up to where V does not fall with w. Where the present speed leads hardly into virgin
 * ground (step_virgin_way) still is 1/2. A foot that turns round within the step has been stopped
 * first: growth is taken up to u0, as for w = 0, while it gets half as far. c_d < 1 takes (w +
 * min(w, w0))/2 for V: so it never pushes and gives no energy for c_d >= 1/2. */
#ifndef MILD_GROUND_STEP_H
#define MILD_GROUND_STEP_H

#include "ground/contact.h"

#define STEP_TINY 1e-30
#define STEP_LAG                                                                                   \
    5e-3 /* [s] of the force behind the depth on the unloading line; the same at every step size   \
          */
#define STEP_EASE 2e-6       /* [m/s] over which it begins */
#define STEP_STILL 0.3       /* [-] */
#define STEP_STILL_MOST 0.75 /* [-] up to here V does not fall with w */
#define STEP_TURN                                                                                  \
    1e-4 /* [m/s] a foot that turned round from less has not been deeper to speak of: 0.25 um in 5 \
            ms */

static inline double step_max(double a, double b) {
    return a > b ? a : b;
}

static inline double step_min(double a, double b) {
    return a < b ? a : b;
}

/* [m] by how much an element goes into virgin ground at its present speed, beyond the elastic
 * travel; else 0. */
static inline double step_virgin_way(double depth, double speed, double front, double dt) {
    return step_max(depth + 0.5 * dt * speed - front - CONTACT_ELASTIC, 0.0);
}

/* [N s] impulse and [kg] its slope at downward speed w. bent: the slots' bend, stopped and
 * explicit_impulse are not all 0. */
ALWAYS_INLINE void step_normal(const Slots *s, int i, double dt, int bent, double w,
                               double *impulse, double *slope) {
    double a = s->front[i], m0 = s->middle[i], m1 = s->depth[i] + 0.5 * dt * w,
           d = step_max(m1 - a, 0.0);
    double per_way = 1.0 / (fabs(m1 - m0) + STEP_TINY), virgin = m1 > a ? 1.0 : 0.0;

    /* Unloading line, force line * l, l the stretch from where it carries nothing. */
    double line = s->line[i], slack = s->slack[i], end = step_min(m1, a) - slack;
    double l0 = step_max(m0 - slack, 0.0), l1 = step_max(end, 0.0);
    double on_line = 0.5 * line * (l0 + l1), line_share = (fabs(l1 - l0) + STEP_TINY) * per_way;
    double line_slope = 0.5 * line * line_share * (end > 0.0 ? 2.0 - line_share : line_share);

    /* Mean of F_g over [b, b + d] by Simpson's rule, exact for the cubic; the bed at its end. b = a
     * but for resist.c. */
    double b = s->deep[i], flat = s->flat[i], cone = s->cone[i], inverse_full = s->inverse_full[i];
    double c0 = step_max(1.0 - b * inverse_full, 0.0),
           cm = step_max(1.0 - (b + 0.5 * d) * inverse_full, 0.0);
    double c1 = step_max(1.0 - (b + d) * inverse_full, 0.0), third = s->full[i] * (1.0 / 3.0);
    double c0_cube = c0 * c0 * c0, c1_square = c1 * c1, c1_cube = c1_square * c1,
           share = d * per_way;
    double in_bed = b + d - s->bed[i], stiffness = s->bed_stiffness[i],
           bed = in_bed > 0.0 ? stiffness : 0.0;
    double mean_cube = (c0_cube + 4.0 * cm * cm * cm + c1_cube) * (1.0 / 6.0);
    double mean = flat * third * (1.0 - mean_cube) + cone * (b + 0.5 * d) + bed * in_bed;
    double mean_slope = flat * (2.0 * cm * cm + c1_square) * (1.0 / 6.0) + 0.5 * cone + bed;
    double virgin_slope =
        share * mean_slope + ((a - m0) * mean - on_line * (l1 - l0)) * per_way * per_way;

    double reach = s->reach[i], mass = s->mass[i], growth = third * (c0_cube - c1_cube),
           stop = bent ? s->stopped[i] : 0.0;
    double twice = 2.0 * growth, stopped = bent ? step_max(growth, step_min(twice, stop)) : growth;
    double stopped_slope =
        bent && growth < stop ? twice < stop ? 2.0 : 0.0 : 1.0; /* [-] of that of growth */
    double h = s->speed[i], down = step_max(w, 0.0), lost = step_max(h - down, 0.0),
           bend = bent ? s->bend[i] : 0.0;
    double join = s->join[i], leave = s->leave[i], old = leave < 0.0 ? step_min(down, h) : h;
    double recruited = join * down + leave * old + (bent ? bend * lost * lost : 0.0);
    double recruited_slope =
        w > 0.0 ? join + (old < h ? leave : 0.0) - (bent ? 2.0 * bend * lost : 0.0) : 0.0;
    double lag = dt * STEP_LAG * line, back = w + h,
           begin = step_min(step_max(back, -STEP_EASE), 0.0);
    double eased = step_min(back + STEP_EASE, 0.0) - begin * begin * (0.5 / STEP_EASE);

    double value = dt * (on_line * line_share + mean * share) +
                   mass * (step_max(w, reach) - s->front_speed[i]) + stopped * recruited +
                   lag * eased + (bent ? s->explicit_impulse[i] : 0.0);
    double rate = 0.5 * dt * dt * (virgin > 0.0 ? virgin_slope : line_slope) +
                  (w > reach ? mass : 0.0) +
                  stopped_slope * virgin * 0.5 * dt * c1_square * recruited +
                  stopped * recruited_slope + lag * begin * (-1.0 / STEP_EASE);
    double pushes = value > 0.0 ? 1.0 : 0.0;
    *impulse = pushes * value;
    *slope = pushes * rate;
}

/* Bool: the element turned round within the step. */
static inline int step_turns(double before, double after) {
    return after < 0.0 && before > STEP_TURN;
}

/* [m] how deep the element has been in a step that ended at w and m1. A foot that turns round
 * within it was deepest between its ends: at the deeper one, p, it still went down with the speed
 * v, and its mass M is that which the impulse slowed from h to w. What it needs to be back at the
 * front is the line's; from there, or from p beyond it, the ground's work F s + F' s^2/2 takes the
 * rest of M v^2/2; the drag is on the mean half of what it is there. Elastic ground remembers this
 * depth. From plastic ground the foot springs up with what is left and pays when it is back, but
 * not with all of it: half the way is remembered. */
static inline double step_peak(const Slots *s, int i, double w, double m1) {
    double h = s->speed[i], m0 = s->middle[i], a = s->front[i], line = s->line[i],
           p = step_max(m0, m1), v = m1 > m0 ? w : h;
    if (!step_turns(h, w)) {
        return m1;
    }
    double loose = step_max(p - s->slack[i], 0.0), taut = step_max(a - s->slack[i], loose);
    double rest =
        0.5 * s->iz[i] * v * v / (h - w) - 0.5 * line * (p < a ? taut * taut - loose * loose : 0.0);
    if (rest <= 0.0) {
        return m1;
    }
    double past = step_max(p - a, 0.0), from = s->deep[i], to = from + past,
           in_bed = step_max(to - s->bed[i], 0.0);
    double c0 = step_max(1.0 - from * s->inverse_full[i], 0.0),
           c1 = step_max(1.0 - to * s->inverse_full[i], 0.0);
    double square = c1 * c1, drag = 0.5 * step_max(s->drag[i], 0.0) * square * v * v;
    double virgin =
        s->flat[i] * s->full[i] * (1.0 / 3.0) * (c0 * c0 * c0 - square * c1) + s->cone[i] * past;
    double force =
        line * (a - s->slack[i]) + virgin + s->bed_stiffness[i] * step_min(in_bed, past) + drag;
    double slope = step_max(s->flat[i] * square + s->cone[i], 0.0) +
                   (in_bed > 0.0 ? s->bed_stiffness[i] : 0.0);
    double way = 2.0 * rest / (force + sqrt(force * force + 2.0 * slope * rest) + STEP_TINY);
    return m1 + 0.5 * (1.0 + s->recovery[i]) * step_max(step_max(p, a) + way - m1, 0.0);
}

#endif
