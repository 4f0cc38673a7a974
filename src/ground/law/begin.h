/* Start of an element's step: everything that does not depend on the new velocity. */
#ifndef MILD_GROUND_BEGIN_H
#define MILD_GROUND_BEGIN_H

#include "ground/law/friction.h"

#define BEGIN_STOP REAL(0.3)       /* [-] fit to the exact impact, see element_drag */
#define BEGIN_STOP_MOST REAL(0.75) /* [-] up to this value V never decreases with w */

/* Coefficients of drag: the impulse is the recruited depth times (exit_drag w + entry_drag h), with
 * h and w the speeds at the two ends of the way. Without the parts that create energy
 * (element_explicit), they follow from
 *
 *     mass w + (drag - mass) (h + w)/2 = (drag + mass)/2 w + (drag - mass)/2 h */
MILD_HD Real law_exit_drag(const Law *law) {
    return (real_max(law->drag_rate, 0) + real_max(law->mass_rate, 0)) / 2;
}

MILD_HD Real law_entry_drag(const Law *law) {
    return (real_max(law->drag_rate, 0) - real_max(law->mass_rate, 0)) / 2;
}

/* The unloading line runs from (a, F(a)) down to zero force. Its elastic travel is recovery a, but
 * at least ELEMENT_ELASTIC. It is never flatter than virgin ground at a, and therefore never above
 * it, because a concave curve lies above its chords and a convex curve above its tangents. Within
 * the bed it takes the steepest slope of the law. force: F(a). */
MILD_HD void element_unloading_line(Element *e, int curves, Real force) {
    const Real a = e->yield_depth;
    const Real travel = real_max(e->recovery * a, real_min(ELEMENT_ELASTIC, a));
    const Real bed = law_bed_slope(&e->law, a);
    const Real slope =
        bed > 0 ? law_steepest(&e->law, curves, a) : law_bedless_slope(&e->law, curves, a);
    const Real steep = slope + bed;
    const int chord = force >= steep * travel;
    const Real quotient = real_over(force, (chord ? travel : steep) + ELEMENT_TINY); /* one */
    e->unload_stiffness = chord ? quotient : steep;
    e->zero_depth = a - (chord ? travel : quotient);
}

/* [m/s] w_y, from `depth` and yield_depth. rate: 1/dt. */
MILD_HD Real element_yield_speed(const Element *e, Real rate) {
    return real_max(2 * (e->yield_depth - e->depth) * rate, 0);
}

/* element_begin without friction's spring. Returns the yield force [N], from which that follows. */
MILD_HD Real element_begin_still(Element *e, const ElementMemory *memory, int curves, Real dt,
                                 Real rate, Real speed) {
    /* Virgin ground begins at the greatest depth so far, which is at least where this step
     * starts. */
    e->middle = memory->middle > 0 ? memory->middle : e->depth - dt / 2 * speed;
    e->yield_depth = real_max(real_max(e->middle, memory->depth_max), 0);
    e->virgin_depth = e->yield_depth;
    const Real force = law_force(&e->law, curves, e->yield_depth);
    element_unloading_line(e, curves, force);

    /* The added mass is at the front. It has the speed that the element gave it, or rests until the
     * element arrives. */
    e->yield_speed = element_yield_speed(e, rate);
    e->front_speed = real_max(memory->front_speed, e->yield_speed);
    e->entry_speed = real_max(speed, 0);
    e->added_mass = 0;
    if (curves & LAW_CONE) {
        e->added_mass = real_max(e->law.mass_rate * law_moved(&e->law, curves, e->yield_depth), 0);
    }

    e->drift_bound = dt * e->k_drift * memory->drift * real_max(e->depth, 0);
    e->damping = e->depth > 0 ? dt * e->b_drift : 0;
    return force + law_elastic_force(&e->law, curves, e->middle);
}

/* Sets the fields that hold for a step from the material and `depth`, except explicit_impulse,
 * stop_drag, stop_growth and turn. speed: present downward speed. rate: 1/dt. */
MILD_HD void element_begin(Element *e, const ElementMemory *memory, int curves, Real dt, Real rate,
                           Real speed) {
    const Real force = element_begin_still(e, memory, curves, dt, rate, speed);
    friction_hold(e, memory, dt, rate, force);
}

/* [m] How far the element will go into virgin ground, beyond the elastic travel, at the downward
 * speed `speed`; 0 if it will not. */
MILD_HD Real element_virgin_way(const Element *e, Real dt, Real speed) {
    return real_max(e->depth + dt / 2 * speed - e->yield_depth - ELEMENT_ELASTIC, 0);
}

/* Drag of an element that will stop in virgin ground, beyond the exchange of momentum with the
 * recruited mass. Called after element_begin. gain: [m/s] by how much the free motion of the step
 * speeds the element up.
 *
 * The work of drag over the way is c_d m_a' times the integral of w^2. For an impulse that acts at
 * the mean speed (h + w)/2, V must be the mean of w^2 over the way divided by (h + w)/2, with h the
 * speed at the front.
 *
 *     slow change                V = (h + w)/2
 *     drag alone stops the foot  the mean of w^2 is logarithmic, (h^2 - w^2)/(2 ln(h/w)), and V
 *                                goes to 0 with w
 *     force F stops it           the mean of w^2 is (h^2 + w^2)/2
 * The last two cases are approximated by
 *
 *     V    = (h + w)/2 + (stop - 1/2) (h - w)^2/h      for w < h
 *     stop = V(0)/h = BEGIN_STOP + sqrt(F/(drag h^2))  at most BEGIN_STOP_MOST
 * fitted to the exact impact of a body on a force that grows from 0. When the present speed barely
 * reaches virgin ground, stop is 1/2. F is the force near the middle of the step. */
MILD_HD void element_drag(Element *e, int curves, Real dt, Real gain) {
    const Real a = e->yield_depth;
    const Real u0 = real_max(e->depth, a);
    const Real extra = real_max(2 * e->entry_drag, 0); /* [kg/m] (c_d - 1) m_a' at the surface */
    const int drags = extra > 0 && element_virgin_way(e, dt, e->entry_speed) > 0;
    if (ON_GPU(!drags, 0)) { /* what follows finds the same */
        e->stop_drag = 0;
        e->stop_growth = 0;
        return;
    }

    /* What the free motion adds to h^2 on the way to the front. */
    const Real faster = drags ? 2 * (real_over(gain, dt) * real_max(a - e->middle, 0)) : 0;
    const Real h = REAL_SQRT(e->entry_speed * e->entry_speed + faster);

    const Real slope = law_bedless_slope(&e->law, curves, a);
    const Real force = law_bedless_force(&e->law, curves, a) + slope / 2 * (u0 - a);
    const Real growth = law_moved(&e->law, curves, u0) - law_moved(&e->law, curves, a);
    const Real drag = extra * law_moved_share(&e->law, curves, a);
    const Real stop = real_min(
        BEGIN_STOP + REAL_SQRT(real_over(force, drag * h * h + ELEMENT_TINY)), BEGIN_STOP_MOST);

    e->entry_speed = h;
    e->stop_drag = drags ? real_over(extra * (stop - REAL(0.5)), h + ELEMENT_TINY) : 0;
    e->stop_growth = drags ? growth : 0;
}

/* Impulse of parameters that create energy (passive = false), which are negative added mass and
 * negative drag. It cannot be implicit, so it is computed from the free motion. Called after
 * element_begin. free: downward speed of the free motion [m/s]. */
MILD_HD Real element_explicit(const Element *e, int curves, Real dt, Real free) {
    const Real mass = e->law.mass_rate * law_moved(&e->law, curves, e->yield_depth);
    const Real drag = e->law.drag_rate * law_moved_share(&e->law, curves, e->yield_depth);
    return real_min(mass, 0) * (free - e->front_speed) +
           real_min(drag, 0) * dt * e->entry_speed * e->entry_speed;
}

#endif
