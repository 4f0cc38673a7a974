/* Normal impulse of an element over a step, as a function of its new velocity (docs/model.md
 * section 6). Both solvers use it.
 * A semi-implicit engine moves by its new velocity, u1 = u0 + dt w, so its velocities belong to the
 * middles of the steps: a body in free fall conserves w^2/2 - g m exactly, where m = u + dt w/2 is
 * the depth in the middle of the step. The ground uses the same instants. A step goes from the
 * middle m0 of the step before to
 *
 *     m1 = u0 + dt w/2
 *
 * and its impulse is a sum of terms:
 *
 *     path    dt (E(m1) - E(m0))/(m1 - m0)            mean static force; E: its integral over depth
 *     mass    m_a(a) (max(w, w_y) - w_a)              the added mass moves with the front
 *     growth  (m_a(m1) - m_a(a)) (w + (c_d - 1) V)    mass recruited on the way, and drag
 *     lag     dt T k e(w + h)                         elastic ground lags behind the foot
 *     elastic (dt/(m1 - m0) + d) (E(m1) - E(m0))      ground without memory; d: its damping
 *
 * Since m1 - m0 = dt (w0 + w)/2, the work of path at the mean velocity (w0 + w)/2 equals the gain
 * of E. So path neither creates nor loses energy at any step size, and its error is of second order
 * in dt. The mean of an increasing function increases with m1, so I never decreases with w, and the
 * step minimises a convex function. */
#ifndef MILD_GROUND_IMPULSE_H
#define MILD_GROUND_IMPULSE_H

#include "ground/law/element.h"

#define IMPULSE_EASE REAL(2e-6) /* [m/s] speed range over which the lag sets in */

typedef struct {
    Real value; /* [N s] up, on the foot */
    Real slope; /* [kg] its derivative with respect to the new downward speed */
} Impulse;

/* Static force, as its mean over the way from m0 to m1. The way follows the unloading line up to
 * the yield depth a and virgin ground beyond it. Each part is weighted by its share of the way. */
MILD_HD Impulse path_impulse(const Element *e, Real dt, Real middle, Real virgin_way,
                             const LawWay *virgin) {
    const Real inverse_way = 1 / (REAL_ABS(middle - e->middle) + ELEMENT_TINY);

    /* On the line the force is k x, with x the depth below the depth of zero force. */
    const Real k = e->unload_stiffness;
    const Real end = real_min(middle, e->yield_depth) - e->zero_depth;
    const Real x0 = real_max(e->middle - e->zero_depth, 0);
    const Real x1 = real_max(end, 0);
    const Real line_mean = k / 2 * (x0 + x1);
    const Real line_share = (REAL_ABS(x1 - x0) + ELEMENT_TINY) * inverse_way;
    const Real line_slope = k / 2 * line_share * (end > 0 ? 2 - line_share : line_share);

    const Real virgin_share = virgin_way * inverse_way;
    const Real lost = (e->yield_depth - e->middle) * virgin->mean - line_mean * (x1 - x0);
    const Real virgin_slope = virgin_share * virgin->mean_slope + lost * inverse_way * inverse_way;

    Impulse path;
    path.value = dt * (line_mean * line_share + virgin->mean * virgin_share);
    path.slope = dt * dt / 2 * (middle > e->yield_depth ? virgin_slope : line_slope);
    return path;
}

/* Added mass at the front. It takes part once the speed exceeds w_y, at which the way ends at the
 * front. The collision is inelastic. */
MILD_HD Impulse mass_impulse(const Element *e, Real speed) {
    Impulse mass;
    mass.value = e->added_mass * (real_max(speed, e->yield_speed) - e->front_speed);
    mass.slope = speed > e->yield_speed ? e->added_mass : 0;
    return mass;
}

/* Mass is recruited at rest and leaves at the speed w. The rest of the drag acts at the speed V
 * (element_drag). For c_d < 1, V is (w + min(w, h))/2, so that drag never drives the foot down, and
 * creates no energy for c_d >= 1/2. An element that reverses within the step was stopped first: its
 * growth counts in full up to u0, as for w = 0, and half beyond. stops: bool, the element may have
 * stop_drag and stop_growth. */
MILD_HD Impulse growth_impulse(const Element *e, Real dt, Real speed, const LawWay *virgin,
                               int stops) {
    const Real down = real_max(speed, 0);
    const Real entry = e->entry_drag < 0 ? real_min(down, e->entry_speed) : e->entry_speed;
    Real drag = e->exit_drag * down + e->entry_drag * entry; /* [kg/m m/s] */
    Real drag_slope = e->exit_drag + (entry < e->entry_speed ? e->entry_drag : 0);
    Real recruited = virgin->recruited;
    Real recruited_slope = dt / 2 * virgin->recruited_slope;
    if (stops) {
        const Real lost = real_max(e->entry_speed - down, 0);
        const Real twice = 2 * recruited;
        drag += e->stop_drag * lost * lost;
        drag_slope -= 2 * e->stop_drag * lost;
        recruited_slope *= recruited < e->stop_growth ? (twice < e->stop_growth ? 2 : 0) : 1;
        recruited = real_max(recruited, real_min(twice, e->stop_growth));
    }
    Impulse growth;
    growth.value = recruited * drag;
    growth.slope = recruited_slope * drag + (speed > 0 ? recruited * drag_slope : 0);
    return growth;
}

/* Unloading ground follows the foot with the delay T = ELEMENT_LAG. This is the only damping of
 * elastic ground, and it does not depend on the step size. With E = IMPULSE_EASE, e(s) is 0 for s >
 * 0, s + E/2 for s < -E, and -s^2/(2 E) between, so there is no kink under a resting foot. */
MILD_HD Impulse lag_impulse(const Element *e, Real dt, Real speed) {
    const Real damping = dt * ELEMENT_LAG * e->unload_stiffness;
    const Real rise = speed + e->entry_speed;
    const Real ease = real_min(real_max(rise, -IMPULSE_EASE), 0);
    const Real eased = real_min(rise + IMPULSE_EASE, 0) - ease * ease * (1 / (2 * IMPULSE_EASE));
    Impulse lag;
    lag.value = damping * eased;
    lag.slope = damping * ease * (-1 / IMPULSE_EASE);
    return lag;
}

/* Ground without memory. The integral of its force F(u) (1 + d w) over the way is
 *
 *     dt mean F + d (E(m1) - E(m0))
 * The part of the way through the air has no force. Both terms increase with m1, so the step stays
 * convex. The damping term has the sign of the motion, so it takes energy. */
MILD_HD Impulse elastic_impulse(const Element *e, Real dt, Real middle, const PowerWay *power) {
    const Real x0 = real_max(e->middle, 0);
    const Real x1 = real_max(middle, 0);
    const PowerWay over = *power;
    const Real whole = REAL_ABS(middle - e->middle);
    const Real inside = REAL_ABS(x1 - x0);
    const Real inverse_way = 1 / (whole + ELEMENT_TINY);
    const Real share = (inside + ELEMENT_TINY) * inverse_way;
    const Real damping = e->law.elastic_damping;

    /* Derivatives with respect to m1. The share of the way in the ground grows on the way in and
     * shrinks on the way out. */
    const Real entered = over.mean * ((whole - inside) * inverse_way) * inverse_way;
    const Real left = over.mean * share * inverse_way;
    const Real static_slope = middle > 0 ? share * over.slope + entered : left;
    const Real end_force = middle > 0 ? over.mean + (x1 - x0) * over.slope : 0;

    Impulse elastic;
    elastic.value = over.mean * (dt * share + damping * (x1 - x0));
    elastic.slope = dt / 2 * (dt * static_slope + damping * end_force);
    return elastic;
}

/* The powers in an impulse. */
typedef struct {
    PowerWay virgin;  /* of virgin ground; unused without LAW_POWER */
    PowerWay elastic; /* of the elastic curve; unused without LAW_ELASTIC */
} ImpulsePowers;

/* The elastic curve over the part of the way from m0 to m1, `middle`, that is in the ground. */
MILD_HD PowerWay elastic_way(const Element *e, Real middle) {
    const Real x0 = real_max(e->middle, 0);
    const Real x1 = real_max(middle, 0);
    return power_way(e->law.elastic_force, e->law.elastic_exponent, x0, x1 - x0);
}

/* The powers of the curves that `curves` has, at the new downward speed. */
MILD_HD ImpulsePowers element_powers(const Element *e, int curves, Real dt, Real speed) {
    const Real middle = e->depth + dt / 2 * speed;
    const Real virgin_way = real_max(middle - e->yield_depth, 0);
    ImpulsePowers powers = {{0, 0}, {0, 0}};
    powers.virgin = law_power_way(&e->law, curves, e->virgin_depth, virgin_way);
    if (curves & LAW_ELASTIC) {
        powers.elastic = elastic_way(e, middle);
    }
    return powers;
}

/* The whole impulse at the new downward speed. curves: LawCurve bits of the law. stops: bool,
 * stop_drag, stop_growth or explicit_impulse may be nonzero. Both are constants in a loop over
 * elements. */
MILD_HD Impulse element_impulse_of(const Element *e, int curves, int stops, Real dt, Real speed,
                                   const ImpulsePowers *powers) {
    const Real middle = e->depth + dt / 2 * speed;
    const Real virgin_way = real_max(middle - e->yield_depth, 0);
    /* a GPU passes by where none of its lanes reaches virgin ground, a vector does not */
    const int reaches = ON_GPU(virgin_way > 0, 1);
    LawWay virgin = {0, 0, 0, 0};
    if (reaches) {
        virgin = law_way(&e->law, curves, e->virgin_depth, virgin_way, &powers->virgin);
    }

    Impulse sum = path_impulse(e, dt, middle, virgin_way, &virgin);
    const Impulse lag = lag_impulse(e, dt, speed);
    if (curves & LAW_CONE) {
        const Impulse mass = mass_impulse(e, speed);
        Impulse growth = {0, 0};
        if (reaches) {
            growth = growth_impulse(e, dt, speed, &virgin, stops);
        }
        sum.value += mass.value + growth.value;
        sum.slope += mass.slope + growth.slope;
    }
    if (curves & LAW_ELASTIC) {
        const Impulse elastic = elastic_impulse(e, dt, middle, &powers->elastic);
        sum.value += elastic.value;
        sum.slope += elastic.slope;
    }
    sum.value += lag.value + (stops ? e->explicit_impulse : 0);
    sum.slope += lag.slope;

    /* Soil never pulls. */
    const Real pushes = sum.value > 0 ? 1 : 0;
    sum.value *= pushes;
    sum.slope *= pushes;
    return sum;
}

/* The same with the powers. */
MILD_HD Impulse element_impulse(const Element *e, int curves, int stops, Real dt, Real speed) {
    const ImpulsePowers powers = element_powers(e, curves, dt, speed);
    return element_impulse_of(e, curves, stops, dt, speed, &powers);
}

#endif
