/* The share q of its virgin load that an element carries (docs/model.md sections 21 and 22). Two
 * things lower it: a sole that is tilted against the ground presses with its projected area, and
 * slip wears the support away.
 *
 *     F <= q F_g(u)                      at rest: the yield load
 *     q <= c                             c: cosine between sole and ground; 1 unless projected
 *     1/q <- 1/q + ds/(j0 c)             ds: horizontal path in the ground
 *     c - q <- (c - q) exp(-da/u0)       da: fresh penetration, beyond the yield depth
 * The element remembers 1 - q, its wear. Both lengths grow with the depth u by the same factor
 * 1 + g u, so a load that slides sinks the same way. In grains j0 is some 1 mm and 7 to 9 % of the
 * depth, for soles of any width (lab/grains/README.md).
 *
 * A sliding element at the share lambda = q/c of its yield load is held by at most
 *     H = (3 + sqrt 8) t lambda (1 - lambda)/(2 - lambda) F_g,
 * whose greatest value is t F_g, at lambda = 2 - sqrt 2. Grains hold a sole that slides under load
 * so (lab/grains/README.md); a parabola, as of footings, would hold it by a third less. Two things
 * hold it besides. Ground that the sole strikes and sets in motion pushes with the force G of the
 * drag: it is held by mu v^2/(v^2 + h^2), v: the speed along, so the coefficient is the mean of
 * both by F and G. And ground at the sides of a sole that is u deep, of the width W, which is
 * pushed away (Rankine):
 *
 *     G = c_d m_a' h^2                   h: speed at which virgin ground is reached
 *     H <= mu F + K_p phi rho g u^2 s/(2 W)
 * Summed over a sole that is W u^2/2 of it times its length by its width, near the mean over all
 * directions of its width (SHARE_PASSIVE).
 *
 * A shell has walls of its own. A face presses along its normal n; the law has the vertical part
 * of that, F. Where the face moves into the ground the horizontal part of it resists, too:
 *
 *     H <= mu F + F (n_x v_x + n_y v_y)/(-n_z (|v| + w))     mu F alone where it moves out
 * with the level velocity v and the descent w >= 0, whose work F does already: a wheel that rolls
 * turns its faces into the ground from above. It fades out at rest. F is that of the depth before
 * the step.
 *
 * The share is held in a step. It scales virgin ground; the unloading stiffness k stays that of the
 * whole load, so the element yields at q F_g(a) and the line ends at a - q F_g(a)/k.
 *
 * It creates no energy. The line stores k x^2/2 with x the compression. A falling q moves the end
 * of the line down: x falls. A growing q would move it up; therefore the yield depth moves ahead of
 * the element by what keeps the end where it is, ELEMENT_ELASTIC times the growth. The line is then
 * stiffer by F'/F of that lead; the fresh penetration that the growth comes with has paid for it.
 * That needs u0 no shorter than the elastic travel. So q grows on plastic ground alone. */
#ifndef MILD_GROUND_SHARE_H
#define MILD_GROUND_SHARE_H

#include "ground/law/remember.h"

#define SHARE_LEAN REAL(0.02)                 /* [-] least cosine: a sole on its edge */
#define SHARE_YIELD REAL(5.8284271247461903)  /* 3 + sqrt 8 */
#define SHARE_PASSIVE 3.0                     /* [-] K_p of ground with 30 degrees of friction */
#define SHARE_GRAVITY 9.81                    /* [m/s^2] */
#define SHARE_REST REAL(1e-3)                 /* [m/s] below it ploughing fades out */
#define SHARE_STEEP REAL(0.17364817766693034) /* [-] cosine of 80 degrees: no face beyond */
#define SHARE_FORGET REAL(40)                 /* [-] da/u0 beyond which nothing is left */
#define SHARE_LEAST REAL(1e-6)                /* [-] least share */
#define SHARE_GRIP REAL(0.1)                  /* [-] least friction of a sole without a frame */
#ifdef MILD_REAL_FLOAT
#define SHARE_ROUND REAL(1e-3) /* [-] of the elastic travel: what rounding may take from it */
#else
#define SHARE_ROUND REAL(1e-6)
#endif

/* What the share depends on. */
typedef struct {
    Real projects;    /* [-] 1: the sole presses with its projected area; 0: with all of it */
    Real slip_rate;   /* [1/m] 1/j0; 0: slip costs nothing */
    Real regain_rate; /* [1/m] 1/u0 */
    Real grip;        /* [-] t, the greatest friction by the virgin load; 0: mu alone */
    Real growth;      /* [1/m] growth of j0 and u0 with the depth, relative */
    Real side;        /* [N/m^2] K_p phi rho g s/(2 W) */
    Real mu;          /* [-] of the material */
    Real worn;        /* [-] memory: 1 - q */
    Real lean;        /* [-] c */
    Real q;           /* [-] the share of this step */
} Share;

/* [-] c where the cosine between sole and ground is `level`. */
MILD_HD Real share_lean(const Share *share, Real level) {
    return 1 - share->projects * (1 - level);
}

/* [N] Yield load at the share q. The firm bed is not worn. */
MILD_HD Real share_force(const Element *e, Real q) {
    const Real bed = law_bed_force(&e->law, e->yield_depth);
    return q * (e->unload_stiffness * (e->yield_depth - e->zero_depth) - bed) + bed;
}

/* [N] What resists ploughing, of a face with the outward normal n and the velocity v, world, after
 * element_begin. level: as there. descent: [m/s] speed at which its depth grows. */
MILD_HD Real share_ahead(const Element *e, const Share *share, Real level, const Real n[3], Real vx,
                         Real vy, Real descent) {
    const Real q = real_min(1 - share->worn, share_lean(share, level));
    const Real force = share_force(e, q) - e->unload_stiffness * (e->yield_depth - e->depth);
    const Real into = real_max(n[0] * vx + n[1] * vy, 0);
    const Real way = REAL_SQRT(vx * vx + vy * vy) + real_max(descent, 0) + SHARE_REST;
    return share->slip_rate > 0 ? real_max(force, 0) * into / (real_max(-n[2], SHARE_STEEP) * way)
                                : 0;
}

/* What a share makes of an element's yield load. */
typedef struct {
    Real force;  /* [N] without that of ground without memory */
    int changes; /* bool: it is not that of the element, or friction is another */
} ShareLoad;

/* [-] Least friction: none under a plane sole where cones merge, which the frame holds (frame.h).
 * Shells and ground of `mild` have none. */
MILD_HD Real share_least(const Share *share) {
    return share->projects * share->side > 0 ? 0 : SHARE_GRIP;
}

/* [-] Friction of an element at the share q of c, whose yield load is `force` [N]. slides: square
 * of its speed along the ground [m^2/s^2], of a sole in its frame. rate: 1/dt. */
MILD_HD Real share_grip(const Element *e, const Share *share, Real dt, Real rate, Real q, Real c,
                        Real force, Real slides) {
    const Real lost = 1 - real_over(q, c);
    const Real grips = real_over(SHARE_YIELD * share->grip * lost, 1 + lost);
    const Real held = real_min(share->mu, real_max(grips, share_least(share)));

    /* The recruited mass is set in motion along by mu and the square of the sine of the way. */
    const Real a = e->yield_depth;
    const Real h = e->entry_speed;
    const Real way = real_max(e->depth + dt / 2 * h - a, 0);
    const Real drag = real_max(e->law.drag_rate, 0) * law_moved_share(&e->law, LAW_HEAP, a);
    const Real strikes = drag * way * h * rate;
    const Real moves = real_over(strikes, strikes + force + ELEMENT_TINY);
    const Real struck = share->mu * real_over(slides, slides + h * h + ELEMENT_TINY);
    return share->grip > 0 ? held + (struck - held) * moves : share->mu;
}

/* element_share without friction's spring. */
MILD_HD ShareLoad element_share_still(Element *e, Share *share, Real dt, Real rate, Real level,
                                      Real ahead, Real slides) {
    const Real a = e->yield_depth;
    const Real k = e->unload_stiffness;
    const Real c = share_lean(share, level);
    const Real q = real_min(1 - share->worn, c);
    const Real force = share_force(e, q);
    /* a GPU passes by where nothing grips, a vector does not */
    const int grips = ON_GPU(share->grip > 0, 1);
    const Real mu = grips ? share_grip(e, share, dt, rate, q, c, force, slides) : share->mu;
    const Real sides = share->side * e->depth * real_max(e->depth, 0) + ahead;
    const ShareLoad load = {force, q < 1 || mu != e->mu || sides > 0};
    share->lean = c;
    share->q = q;
    e->drift_bound += dt * sides;
    e->zero_depth = q < 1 ? a - real_over(force, k + ELEMENT_TINY) : e->zero_depth;
    e->mu = mu;
    return load;
}

/* Sets lean and q, and with them the unloading line and friction, after element_begin: the line
 * says the whole force at the yield depth. elastic: [N] force of ground without memory. level:
 * cosine between sole and ground. ahead: [N] share_ahead of a face, 0 of a sole. slides: as in
 * share_grip. */
MILD_HD void element_share(Element *e, const ElementMemory *memory, Share *share, Real elastic,
                           Real dt, Real rate, Real level, Real ahead, Real slides) {
    const ShareLoad load = element_share_still(e, share, dt, rate, level, ahead, slides);
    Element still = *e;
    friction_hold(&still, memory, dt, rate, load.force + elastic);
    e->hold_x = load.changes ? still.hold_x : e->hold_x;
    e->hold_y = load.changes ? still.hold_y : e->hold_y;
    e->hold_stiffness = load.changes ? still.hold_stiffness : e->hold_stiffness;
}

/* Virgin ground as the element feels it. Called wherever an element with LAW_HEAP is loaded for
 * the law of a step. */
MILD_HD void element_share_virgin(Element *e, Real q) {
    e->law.flat_stiffness *= q;
    e->law.line_stiffness *= q;
    e->law.power_force *= q;
}

/* Bool: the ground at the yield depth is plastic, so that the share may grow. */
MILD_HD int share_grows(const Element *e, const Share *share) {
    const Real travel = e->yield_depth - e->zero_depth;
    return e->recovery * e->yield_depth <= ELEMENT_ELASTIC &&
           travel >= (share->q - SHARE_ROUND) * ELEMENT_ELASTIC;
}

/* exp(-x) within 1e-14, 0 <= x <= SHARE_FORGET, and 1 at 0. The series of real_exp2, of which each
 * term waits for the one before, in two that do not: 3 % of a step. */
MILD_HD Real share_left(Real x) {
#ifdef MILD_REAL_FLOAT
    return real_exp2(REAL(-1.4426950408889634074) * x);
#else
    const Real power = REAL(-1.4426950408889634074) * x; /* 1/ln 2 */
    const Real shifted = power + POWER_MAGIC;
    const Real f = (power - (shifted - POWER_MAGIC)) * REAL(0.69314718055994530942);
    const Real square = f * f;
    Real even = REAL(1.0 / 3628800);
    Real odd = REAL(1.0 / 39916800);
    even = even * square + REAL(1.0 / 40320);
    odd = odd * square + REAL(1.0 / 362880);
    even = even * square + REAL(1.0 / 720);
    odd = odd * square + REAL(1.0 / 5040);
    even = even * square + REAL(1.0 / 24);
    odd = odd * square + REAL(1.0 / 120);
    even = even * square + REAL(0.5);
    odd = odd * square + REAL(1.0 / 6);
    even = even * square + 1;
    odd = odd * square + 1;
    return (even + odd * f) * real_from_bits((real_bits(shifted) << 52) + real_bits(1.0));
#endif
}

/* [-] Growth of j0 and u0 at the depth of an element. */
MILD_HD Real share_growth(const Element *e, const Share *share) {
    return 1 + share->growth * real_max(e->depth, 0);
}

/* [-] What slip leaves of the share in a step. slid: [m] horizontal path. */
MILD_HD Real share_slipped(const Element *e, const Share *share, Real slid) {
    const Real q = share->q;
    const Real whole = share->lean * share_growth(e, share);
    return q * real_over(whole, whole + q * slid * share->slip_rate);
}

/* [-] The share after a step. slid: [m] horizontal path; fresh: [m] penetration. */
MILD_HD Real share_after(const Element *e, const Share *share, Real slid, Real fresh) {
    const Real c = share->lean;
    const Real grows = share_growth(e, share);
    const Real slipped = share_slipped(e, share, slid);
    const Real spent = real_min(real_over(fresh * share->regain_rate, grows), SHARE_FORGET);
    const Real left = share_left(spent);
    const Real grown = slipped + (c - slipped) * (1 - left);
    return real_max(share_grows(e, share) ? grown : slipped, SHARE_LEAST);
}

/* Horizontal path [m] that a step counts. Where slip costs support, path counts at once where
 * friction slides, so that the loss does not depend on the step; so the path of `after` replaces
 * what element_remember has found. */
MILD_HD Real element_slide(const Element *e, const ElementMemory *memory, const Share *share,
                           ElementMemory *after, Real dt, Real normal, Real vx, Real vy,
                           int stays) {
    const Real x = memory->pending_x + dt * vx;
    const Real y = memory->pending_y + dt * vy;
    const Real square = x * x + y * y;
    const Real held_x = e->hold_x - e->hold_stiffness * vx;
    const Real held_y = e->hold_y - e->hold_stiffness * vy;
    const Real bound = friction_bound(e, normal);
    const int slides = held_x * held_x + held_y * held_y >= bound * bound;
    const Real least = share->slip_rate > 0 ? REAL(-1) : REMEMBER_BAND * REMEMBER_BAND;
    const int counts = square > (slides ? least : REMEMBER_BAND * REMEMBER_BAND);
    const Real slid = counts ? REAL_SQRT(square) : 0;
    after->drift = stays ? real_min(memory->drift + slid, REMEMBER_DRIFT) : 0;
    after->pending_x = stays && !counts ? x : 0;
    after->pending_y = stays && !counts ? y : 0;
    return slid;
}

/* [m] Penetration of a step beyond the yield depth. slices: frame_slices (frame.h). */
MILD_HD Real element_fresh(const Element *e, Real dt, Real speed, Real slices) {
    return real_max(e->depth + dt * (speed / 2 - slices) - e->yield_depth, 0);
}

/* Bool: slip lowers the share in a step. */
MILD_HD int share_slips(const Share *share, Real slid) {
    return slid * share->slip_rate > 0;
}

/* Bool: fresh penetration may raise the share in a step, also what slip takes from it then. Where
 * it does not, share_after is share_slipped, and where slip does not lower it either, q. */
MILD_HD int share_regains(const Share *share, Real slid, Real fresh) {
    return (fresh > 0) & ((share->q < share->lean) | share_slips(share, slid));
}

/* Moves the greatest depth ahead by what the share grows. Returns the wear to remember. */
MILD_HD Real element_wear(const Element *e, const Share *share, ElementMemory *after, Real slid,
                          Real fresh, int stays) {
    const Real q = share_after(e, share, slid, fresh);
    const Real lead = real_max(q - share->q, 0) * ELEMENT_ELASTIC;
    /* The added mass grows with the lead; it keeps its momentum. P is concave. */
    after->front_speed *= real_over(after->depth_max, after->depth_max + lead + ELEMENT_TINY);
    after->depth_max = stays ? after->depth_max + lead : 0;
    return stays ? 1 - q : 0;
}

/* element_slide and element_wear where nothing is in vectors. slices: frame_slices (frame.h). */
MILD_HD Real element_wear_alone(const Element *e, const ElementMemory *memory, const Share *share,
                                ElementMemory *after, Real dt, Real normal, Real vx, Real vy,
                                Real speed, Real slices, int stays) {
    const Real slid = element_slide(e, memory, share, after, dt, normal, vx, vy, stays);
    const Real fresh = element_fresh(e, dt, speed, slices);
    if (stays && (share_slips(share, slid) || share_regains(share, slid, fresh))) {
        return element_wear(e, share, after, slid, fresh, stays);
    }
    return stays ? 1 - share->q : 0;
}

#endif
