/* End of an element's step: what it remembers. */
#ifndef MILD_GROUND_REMEMBER_H
#define MILD_GROUND_REMEMBER_H

#include "ground/law/friction.h"

#define REMEMBER_BAND REAL(1e-5) /* [m] horizontal motion below this is jitter, not drift */
#define REMEMBER_DRIFT REAL(0.1) /* [m] beyond this path length, drift adds no more resistance */
/* [m/s] A reversal from a lower speed adds less than 0.25 um of depth in 5 ms and is ignored. */
#define REMEMBER_TURN REAL(1e-4)

/* Bool: the element reversed within the step. before, after: downward speeds [m/s]. */
MILD_HD int element_turns(Real before, Real after) {
    return after < 0 && before > REMEMBER_TURN;
}

/* Greatest depth of the element in a step that ends at m1 [m], counted like the yield depth. It is
 * m1 unless the element reversed within the step. normal: I_z. speed: w after the step.
 *
 * An element that reversed was deepest between the two ends of the step. At the deeper end, p, it
 * was still moving down at the speed v. Its mass M is the mass that the impulse slowed from h to w.
 * Part of its energy M v^2/2 is spent on the unloading line up to the front. From the front, or
 * from p if that is deeper, the work F x + F' x^2/2 of the ground takes the rest. F includes half
 * the drag at p, which is its mean over the way.
 *
 * Elastic ground remembers this depth. Plastic ground gives back more speed than it should, and
 * takes that energy only when the foot returns, and then not all of it. So only half of the extra
 * depth is remembered. */
MILD_HD Real element_peak(const Element *e, int curves, Real normal, Real speed, Real middle) {
    const Real h = e->entry_speed;
    if (!element_turns(h, speed)) {
        return middle;
    }
    const Real a = e->yield_depth;
    const Real p = real_max(e->middle, middle);
    const Real v = middle > e->middle ? speed : h;

    const Real x0 = real_max(p - e->zero_depth, 0);
    const Real x1 = real_max(a - e->zero_depth, x0);
    const Real line_work = p < a ? e->unload_stiffness / 2 * (x1 * x1 - x0 * x0) : 0;
    const Real energy = real_over(normal / 2 * v * v, h - speed) - line_work;
    if (energy <= 0) {
        return middle;
    }

    const Real at = e->virgin_depth + real_max(p - a, 0);
    Real force = law_force(&e->law, curves, at) + law_elastic_force(&e->law, curves, at);
    if (curves & LAW_CONE) {
        force += real_max(e->law.drag_rate, 0) / 2 * law_moved_share(&e->law, curves, at) * v * v;
    }
    const Real slope = real_max(law_bedless_slope(&e->law, curves, at), 0) +
                       law_bed_slope(&e->law, at) + law_elastic_slope(&e->law, curves, at);
    const Real root = REAL_SQRT(force * force + 2 * slope * energy);
    if (force + root <= 0) {
        return middle; /* ground without force, as under a trailing face: only rounding slowed it */
    }
    const Real way = real_over(2 * energy, force + root);
    const Real beyond = real_max(real_max(p, a) + way - middle, 0);
    return middle + (1 + e->recovery) / 2 * beyond;
}

/* [m] Greatest depth after a step that ends at m1 [m], but for a reversal within it. */
MILD_HD Real element_deepest(const Element *e, Real middle) {
    return e->virgin_depth + real_max(middle - e->yield_depth, 0);
}

/* Memory after the step. Values are selected with ?:, never multiplied by 0, so that NaN is
 * forgotten too. normal: I_z. vx, vy, speed: velocity after the step, with `speed` downward. rate:
 * 1/dt. stays: bool, the element is still in the ground. Otherwise it forgets everything except
 * `middle`. */
MILD_HD ElementMemory element_remember(const Element *e, const ElementMemory *memory, Real dt,
                                       Real rate, Real normal, Real vx, Real vy, Real speed,
                                       int stays) {
    const Real middle = e->depth + dt / 2 * speed;
    const Real deepest = element_deepest(e, middle);
    ElementMemory after;
    after.depth_max = stays ? deepest : 0;
    after.middle = stays ? real_min(middle, deepest) : middle;

    /* The added mass takes on the speed that the element gained beyond the old front. The remaining
     * difference acts as an impact in the next step. */
    const int leads = middle > e->yield_depth && speed > e->yield_speed;
    const int led = e->front_speed > e->yield_speed || !(memory->depth_max > 0);
    after.front_speed = stays && leads ? speed - (led ? 0 : e->yield_speed) : 0;

    /* Motion is collected until it leaves the dead band, so that d_D depends neither on the step
     * size nor on jitter. d_D is the accumulated path length, as in the paper. */
    const Real x = memory->pending_x + dt * vx;
    const Real y = memory->pending_y + dt * vy;
    const Real square = x * x + y * y;
    const int counts = square > REMEMBER_BAND * REMEMBER_BAND;
    const Real drift = memory->drift + (counts ? REAL_SQRT(square) : 0);
    after.drift = stays ? real_min(drift, REMEMBER_DRIFT) : 0;
    after.pending_x = stays && !counts ? x : 0;
    after.pending_y = stays && !counts ? y : 0;

    /* Spring force of friction (friction.h). */
    const Real held_x = e->hold_x - e->hold_stiffness * vx;
    const Real held_y = e->hold_y - e->hold_stiffness * vy;
    const Real held = REAL_SQRT(held_x * held_x + held_y * held_y);
    const Real bound = friction_bound(e, normal);
    const Real share = rate * (held > bound ? real_over(bound, held) : 1);
    after.held_x = stays ? share * held_x : 0;
    after.held_y = stays ? share * held_y : 0;
    after.held_stiffness = stays ? rate * rate * e->hold_stiffness : 0;
    return after;
}

/* The same where the depth grew by `sinks` [m] more than the element penetrated (frame.h). The
 * added mass, which grows at most in proportion to the depth, gains no momentum. */
MILD_HD ElementMemory element_sunk(ElementMemory after, Real sinks, int stays) {
    const Real deepest = after.depth_max + sinks;
    after.front_speed *= sinks > 0 ? real_over(after.depth_max, deepest) : 1;
    after.depth_max = stays ? deepest : 0;
    after.middle += sinks;
    return after;
}

#endif
