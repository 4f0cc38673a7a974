/* Friction and drift resistance of an element (paper eqs 13 and 14, docs/model.md section 6).
 *
 * Coulomb's law bounds the horizontal impulse:
 *
 *     r = mu I_z + dt k_D d_D u
 * Below the bound, friction is a damped spring with the travel FRICTION_ELASTIC (tangential springs
 * of Cundall and Strack 1979). With v the velocity of the element after the step, f the spring
 * force before it and k the stiffness:
 *
 *     c = r ELEMENT_LAG/FRICTION_ELASTIC
 *     t = dt f - (dt^2 k + c) v
 *     I = t min(1, r/|t|) - dt b_D v
 * A resting foot does not creep. Friction never creates energy. The spring stores f^2/(2 k). When k
 * grows, f is kept, so the stored energy falls. When k falls, f falls in proportion. Within a step,
 * the projection onto the disc gives |f_new|^2 - |f|^2 <= 2 k I . v, with k and f of the start of
 * the step. For a given r, I is minus the gradient of a convex function of v whose slopes are at
 * most dt^2 k + c. */
#ifndef MILD_GROUND_FRICTION_H
#define MILD_GROUND_FRICTION_H

#include "ground/law/element.h"

#define FRICTION_ELASTIC REAL(2e-5) /* [m] elastic travel of friction */
/* [s/m] c/r. Without a spring force, damping alone reaches the bound at 4 mm/s. */
#define FRICTION_LAG (ELEMENT_LAG / FRICTION_ELASTIC)

/* Sets the spring of friction. Its stiffness follows from the bound at the yield force [N]. rate:
 * 1/dt. */
MILD_HD void friction_hold(Element *e, const ElementMemory *memory, Real dt, Real rate,
                           Real yield_force) {
    const Real bound = e->mu * yield_force + e->drift_bound * rate;
    const Real k = bound * (1 / FRICTION_ELASTIC);
    const Real keeps = k < memory->held_stiffness ? real_over(k, memory->held_stiffness) : 1;
    e->hold_stiffness = dt * dt * k;
    e->hold_x = dt * keeps * memory->held_x;
    e->hold_y = dt * keeps * memory->held_y;
}

/* r [N s] at a normal impulse. */
MILD_HD Real friction_bound(const Element *e, Real normal) {
    return e->mu * normal + e->drift_bound;
}

/* Tangential impulse and its derivatives. */
typedef struct {
    Real x;       /* [N s] */
    Real y;       /* [N s] */
    Real fall_xx; /* [kg] -dI/dv */
    Real fall_xy; /* [kg] */
    Real fall_yy; /* [kg] */
    Real rise_x;  /* [-] dI/dI_z, through the bound */
    Real rise_y;  /* [-] */
} Friction;

/* Friction at the velocity (vx, vy) with the bound r, and the slopes for a step of Newton's method.
 * mu: derivative of r with respect to I_z, 0 when the solver holds the bound fixed.
 *
 * begins: bool, a step that begins, whose V may be far from the solution. Where an element slides,
 * I does not change along n, so such a step passes over the 4 mm/s in which it sticks, to sliding
 * the other way. Then an element slides that way if its spring before the step had half of the
 * bound there already. Any other has the slopes of I = t times a fixed min(1, r/|t|), whose energy
 * is nowhere below that of friction (as in lagged diffusivity; with f in place of the dual variable
 * of Chan, Golub and Mulet 1999). */
MILD_HD Friction friction_step(const Element *e, Real r, Real mu, int begins, Real vx, Real vy) {
    const Real stiffness = e->hold_stiffness + FRICTION_LAG * r;
    const Real tx = e->hold_x - stiffness * vx;
    const Real ty = e->hold_y - stiffness * vy;

    /* Projection onto the disc of radius r. n is the unit vector of t if the element slides, else
     * 0. */
    const Real length = REAL_SQRT(tx * tx + ty * ty);
    const Real inverse = 1 / (length + REAL_LEAST);
    const int slides = length > r;
    const Real scaled = r * inverse;
    const Real share = slides ? scaled : 1;
    const Real along = slides ? inverse : 0;
    const Real nx = along * tx;
    const Real ny = along * ty;

    /* The bound acts on the length of I and, through c, on t. */
    const Real yields = share * stiffness;
    const Real lag_x = -share * FRICTION_LAG * vx;
    const Real lag_y = -share * FRICTION_LAG * vy;
    const Real lag_n = 1 - (nx * lag_x + ny * lag_y);

    const int may_hold = begins && nx * e->hold_x + ny * e->hold_y < r / 2;
    const Real mx = may_hold ? 0 : nx;
    const Real my = may_hold ? 0 : ny;

    Friction result;
    result.x = share * tx - e->damping * vx;
    result.y = share * ty - e->damping * vy;
    result.fall_xx = e->damping + yields * (1 - mx * mx);
    result.fall_xy = -yields * mx * my;
    result.fall_yy = e->damping + yields * (1 - my * my);
    result.rise_x = mu * (lag_x + nx * lag_n);
    result.rise_y = mu * (lag_y + ny * lag_n);
    return result;
}

/* The same with its own derivatives. */
MILD_HD Friction friction_impulse(const Element *e, Real r, Real mu, Real vx, Real vy) {
    return friction_step(e, r, mu, 0, vx, vy);
}

/* Replaces the velocity by the one that friction opposes: the velocity minus its nearest point on
 * the segment from 0 to -turn (energy.c). */
MILD_HD void friction_turn(const Element *e, Real *vx, Real *vy) {
    const Real square = e->turn_x * e->turn_x + e->turn_y * e->turn_y;
    const Real along = *vx * e->turn_x + *vy * e->turn_y;
    const Real share = real_min(real_max(along / (square + REAL_LEAST), -1), 0);
    *vx -= share * e->turn_x;
    *vy -= share * e->turn_y;
}

/* friction_impulse at that velocity. While the nearest point is inside the segment, a change of
 * velocity along the segment has no effect. */
MILD_HD Friction friction_turned(const Element *e, Real r, Real mu, Real vx, Real vy) {
    const Real square = e->turn_x * e->turn_x + e->turn_y * e->turn_y;
    const Real along = vx * e->turn_x + vy * e->turn_y;
    const Real within = along < 0 && along > -square ? 1 / (square + REAL_LEAST) : 0;
    friction_turn(e, &vx, &vy);
    Friction result = friction_impulse(e, r, mu, vx, vy);
    const Real x = within * (result.fall_xx * e->turn_x + result.fall_xy * e->turn_y);
    const Real y = within * (result.fall_xy * e->turn_x + result.fall_yy * e->turn_y);
    result.fall_xx -= x * e->turn_x;
    result.fall_xy -= (x * e->turn_y + y * e->turn_x) / 2;
    result.fall_yy -= y * e->turn_y;
    return result;
}

/* Bool: friction is at its bound. */
MILD_HD int friction_slides(const Element *e, Real normal, Real vx, Real vy) {
    friction_turn(e, &vx, &vy);
    const Real r = friction_bound(e, normal);
    const Real stiffness = e->hold_stiffness + FRICTION_LAG * r;
    const Real tx = e->hold_x - stiffness * vx;
    const Real ty = e->hold_y - stiffness * vy;
    return tx * tx + ty * ty > r * r;
}

/* Shear strength that builds up with slip (Janosi and Hanamoto 1961), of one element:
 *
 *     s = (c + p mu) (1 - exp(-j/K))
 * j is the distance that the element has slid since it touched down, which is its drift
 * (ElementMemory in element.h). */

/* What the strength is made of. */
typedef struct {
    Real mu;       /* [-] of the whole strength */
    Real cohesion; /* c [N/m^2] */
    Real length;   /* K [m] */
    Real area;     /* [m^2] of the element */
} Shear;

/* Sets the friction of an element, after element_begin. force: [N] at the yield depth. rate:
 * 1/dt. */
MILD_HD void element_shear_of(Element *e, const ElementMemory *memory, const Shear *shear,
                              Real force, Real dt, Real rate) {
    const Real slid = memory->drift / shear->length;                       /* j/K [-] */
    const Real share = 1 - real_exp2(REAL(-1.4426950408889634074) * slid); /* 1/ln 2 */
    const Real cohesion = e->depth > 0 ? shear->cohesion : 0;
    e->mu = share * shear->mu;
    e->drift_bound += dt * share * cohesion * shear->area;
    friction_hold(e, memory, dt, rate, force);
}

/* The same with the force that the law has at the yield depth. */
MILD_HD void element_shear(Element *e, const ElementMemory *memory, const Shear *shear, int curves,
                           Real dt, Real rate) {
    const Real force =
        law_force(&e->law, curves, e->yield_depth) + law_elastic_force(&e->law, curves, e->middle);
    element_shear_of(e, memory, shear, force, dt, rate);
}

#endif
