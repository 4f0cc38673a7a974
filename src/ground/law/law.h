/* The law of virgin ground: the force on an element that goes deeper than it has been before.
 *
 * A law is a sum of curves over the depth u, each scaled by numbers of Law:
 *
 *     line    F = kappa u                        springs, resistive force theory
 *     cone    F = (k_pen - kappa) P(u)           the developing cone (paper eqs 1 to 5)
 *     power   F = S (u/z0)^n                     pressure and sinkage (power.h)
 *     elastic F = S (u/z0)^n (1 + d w)           the same without memory, damped; w: downward speed
 *     bed     F = k_bed max(u - u_bed, 0)        the firm bed, part of every law
 *
 * Developing cone, read as in docs/model.md section 3: the stress acts per element area, the added
 * mass is positive, and the flat area stays 0 once the cone is complete. With R the radius of a
 * disc of the element's area s, and
 *
 *     u_f    = R tan(alpha)/nu                   depth at which the cone is complete
 *     t      = min(u/u_f, 1)
 *     S_flat = s (1 - t)^2                       eq 1
 *     kappa  = sigma_cone s/cos(alpha)
 *
 * the integral of the flat area's share is
 *
 *     P(u)   = u_f (t - t^2 + t^3/3)             recruited depth [m]
 *     P'(u)  = (1 - t)^2                         share of the area that is still flat
 *
 * and the law is
 *
 *     F_g    = (k_pen - kappa) P + kappa u       eq 4
 *     m_a    = c_g phi rho nu s P                eq 3
 * Nothing cancels at small u or small nu/tan(alpha), because u_f is the only length left. F_g is
 * concave when k_pen > kappa, convex otherwise, and straight beyond u_f.
 *
 * A heap (docs/model.md section 21) is a cone that closes from the depth u_b on:
 *
 *     P(u)   = min(u, u_b) + u_f (t - t^2 + t^3/3),   t = clamp((u - u_b)/u_f, 0, 1)
 * With u_b = 0 it is the cone above. F_g stays, but the ground that moves with a sole is set in
 * motion more slowly, in proportion to the depth, until it is as much as the whole heap, and more
 * slowly still from there:
 *
 *     m_a    = c_g phi rho nu s P_m
 *     P_m(u) = min(u/LAW_MOVES, u_m) + LAW_TAIL max(u - LAW_MOVES u_m, 0),   u_m = u_b + u_f/3
 * P_m of a cone is P.
 *
 * The elastic curve is the only one that is not about virgin ground. It acts at every depth, on
 * the way down and up, in a term of its own (impulse.h).
 *
 * To add a curve, add its numbers to Law and LAW_NUMBERS, a bit to LawCurve and LAW_ALL, and its
 * term to each function of this file that takes `curves`, to law_curves and to law_between
 * (element_law.c). A model's `law` (model.h) fills in the numbers. `curves` is a constant in the
 * vector loops, so a curve costs nothing on ground that does not have it. law_variant says which
 * loop serves a foot; for a loop of the new curve alone, add it there and to the switches of
 * pass.c and prepare.c. Look at element_drag's callers (prepare.c, contact.inc) if the
 * curve has a drag, and at model_resist.c if a resistive force may be blended with it. */
#ifndef MILD_GROUND_LAW_H
#define MILD_GROUND_LAW_H

#include "ground/law/power.h"

#define LAW_HEAP_LEAST REAL(1e-9) /* [-] least `begin` of a heap: what begins at 0 is a cone */
#define LAW_MOVES REAL(5)         /* [-] depth per recruited depth of what moves with a heap */
#define LAW_TAIL REAL(0.02)       /* [-] recruited depth per depth beyond that */

/* The curves that a law has besides line and bed. All elements of a foot use the union of its
 * materials' bits, because a law without a curve has 0 for that curve's numbers. */
typedef enum {
    LAW_LINE = 0,    /* none */
    LAW_CONE = 1,    /* the developing cone, its added mass and its drag */
    LAW_POWER = 2,   /* the power of the depth */
    LAW_ELASTIC = 4, /* the elastic curve without memory */
    LAW_ALL = LAW_CONE | LAW_POWER | LAW_ELASTIC,
    LAW_HEAP = 8, /* the cone may begin to close below the surface, and the element may carry a
                     share of its load (share.h). LAW_ALL and the loops for it leave it out */
    LAW_ANY = LAW_ALL | LAW_HEAP
} LawCurve;

/* How an element's law or friction depends on its motion so far; bits beside those of LawCurve. */
typedef enum {
    LAW_PLANE = 1 << 16, /* resistive force theory in the plane of motion (plate.h) */
    LAW_SPACE = 1 << 17, /* the same in three dimensions */
    LAW_SHEAR = 1 << 18, /* shear strength that builds up with slip (friction.h) */
    LAW_RESIST = LAW_PLANE | LAW_SPACE,
    LAW_CREATES = 1 << 19 /* negative added mass or drag: element_explicit may not be 0 */
} LawMotion;

/* Bool: the ground of a law may create energy (passive = false). */
MILD_HD int law_creates(Real mass_rate, Real drag_rate) {
    return mass_rate < 0 || drag_rate < 0;
}

typedef struct {
    Real flat_stiffness;     /* k_pen - kappa [N/m] of the cone, per recruited depth        eq 4 */
    Real line_stiffness;     /* kappa [N/m] of the line, per depth                          eq 4 */
    Real cone_depth;         /* u_f [m] depth at which the cone is complete                 eq 1 */
    Real inverse_cone_depth; /* 1/u_f [1/m] */
    Real mass_rate;          /* c_g phi rho nu s [kg/m] added mass per recruited depth      eq 3 */
    Real drag_rate;          /* c_d times that [kg/m]                                       eq 5 */
    Real bed_depth;          /* u_bed [m] */
    Real bed_stiffness;      /* k_bed [N/m] */
    Real power_force;        /* S [N] of the power at POWER_DEPTH */
    Real power_exponent;     /* n [-] */
    Real elastic_force;      /* S [N] of the elastic curve */
    Real elastic_exponent;   /* n [-] */
    Real elastic_damping;    /* d [s/m] relative growth of its force with the downward speed */
    Real cone_begin; /* u_b [m] depth from which a heap closes, only with LAW_HEAP; 0: a cone */
} Law;

/* The numbers of Law in order, but for cone_begin, which belongs to the place of an element in its
 * sole. Slots, loads, stores and checks are generated from this list. */
#define LAW_NUMBERS(NUMBER)                                                                        \
    NUMBER(flat_stiffness)                                                                         \
    NUMBER(line_stiffness)                                                                         \
    NUMBER(cone_depth)                                                                             \
    NUMBER(inverse_cone_depth)                                                                     \
    NUMBER(mass_rate)                                                                              \
    NUMBER(drag_rate)                                                                              \
    NUMBER(bed_depth)                                                                              \
    NUMBER(bed_stiffness)                                                                          \
    NUMBER(power_force)                                                                            \
    NUMBER(power_exponent)                                                                         \
    NUMBER(elastic_force)                                                                          \
    NUMBER(elastic_exponent)                                                                       \
    NUMBER(elastic_damping)

/* The bits of the compiled loop that serves these curves: the loop of a single curve, that of a
 * heap, or that of any. */
MILD_HD int law_variant(int curves) {
    const int one =
        curves == LAW_LINE || curves == LAW_CONE || curves == LAW_POWER || curves == LAW_ELASTIC;
    if (curves == LAW_HEAP || curves == (LAW_CONE | LAW_HEAP)) {
        return LAW_CONE | LAW_HEAP;
    }
    return one ? curves : LAW_ANY;
}

/* The law of an element of a merged sole, from that of a disc. begin, width: [-] as in SoleHeap;
 * begin = 0 leaves a cone. */
MILD_HD Law law_of_heap(Law law, Real begin, Real width) {
    law.cone_begin = law.cone_depth * begin;
    law.cone_depth *= width;
    law.inverse_cone_depth = 1 / law.cone_depth;
    return law;
}

/* t [-], 1 when the cone is complete. */
MILD_HD Real law_cone_progress(const Law *law, int curves, Real depth) {
    const Real below = depth - law->cone_begin;
    /* real_to_one cuts what is below 0 where it is an instruction */
    const Real closing = curves & LAW_HEAP ? ON_GPU(below, real_max(below, 0)) : depth;
    return real_to_one(closing * law->inverse_cone_depth);
}

/* 1 - (1 - t)^3 [-], the recruited share of what the complete cone recruits. */
MILD_HD Real law_cone_share(const Law *law, int curves, Real depth) {
    const Real t = law_cone_progress(law, curves, depth);
    return t * (3 - t * (3 - t));
}

/* P(u) [m], u >= 0. */
MILD_HD Real law_recruited(const Law *law, int curves, Real depth) {
    const Real closing = law->cone_depth * REAL(1.0 / 3.0) * law_cone_share(law, curves, depth);
    return curves & LAW_HEAP ? real_min(depth, law->cone_begin) + closing : closing;
}

/* P'(u) [-], 1 at the surface, 0 once the cone is complete. */
MILD_HD Real law_flat_share(const Law *law, int curves, Real depth) {
    const Real open = 1 - law_cone_progress(law, curves, depth);
    return open * open;
}

/* Bool: the law of an element of a merged sole. */
MILD_HD int law_is_heap(const Law *law, int curves) {
    return curves & LAW_HEAP && law->cone_begin > 0;
}

/* LAW_MOVES u_m [m], depth at which all of a heap's ground moves. */
MILD_HD Real law_moved_depth(const Law *law) {
    return LAW_MOVES * law->cone_begin + LAW_MOVES / 3 * law->cone_depth;
}

/* P_m(u) [m] */
MILD_HD Real law_moved(const Law *law, int curves, Real depth) {
    const Real heap =
        real_min(depth, law_moved_depth(law)) * (1 / LAW_MOVES - LAW_TAIL) + LAW_TAIL * depth;
    return law_is_heap(law, curves) ? heap : law_recruited(law, curves, depth);
}

/* P_m'(u) [-] */
MILD_HD Real law_moved_share(const Law *law, int curves, Real depth) {
    const Real heap = depth < law_moved_depth(law) ? 1 / LAW_MOVES : LAW_TAIL;
    return law_is_heap(law, curves) ? heap : law_flat_share(law, curves, depth);
}

/* Force of the firm bed [N]. Any depth is allowed, and so is a bed at infinity. */
MILD_HD Real law_bed_force(const Law *law, Real depth) {
    return law->bed_stiffness * real_max(depth - law->bed_depth, 0);
}

/* Its slope [N/m]. */
MILD_HD Real law_bed_slope(const Law *law, Real depth) {
    return depth > law->bed_depth ? law->bed_stiffness : 0;
}

/* F(u) [N] above the bed. */
MILD_HD Real law_bedless_force(const Law *law, int curves, Real depth) {
    Real force = law->line_stiffness * depth;
    if (curves & LAW_CONE) {
        force = law->flat_stiffness * law_recruited(law, curves, depth) + force;
    }
    if (curves & LAW_POWER) {
        force += power_force(law->power_force, law->power_exponent, depth);
    }
    return force;
}

/* F'(u) [N/m] above the bed. */
MILD_HD Real law_bedless_slope(const Law *law, int curves, Real depth) {
    Real slope = law->line_stiffness;
    if (curves & LAW_CONE) {
        slope = law->flat_stiffness * law_flat_share(law, curves, depth) + slope;
    }
    if (curves & LAW_POWER) {
        slope += power_slope(law->power_force, law->power_exponent, depth);
    }
    return slope;
}

/* F(u) [N]. */
MILD_HD Real law_force(const Law *law, int curves, Real depth) {
    return law_bedless_force(law, curves, depth) + law_bed_force(law, depth);
}

/* F'(u) [N/m]. */
MILD_HD Real law_slope(const Law *law, int curves, Real depth) {
    return law_bedless_slope(law, curves, depth) + law_bed_slope(law, depth);
}

/* [N/m] Upper bound on F' above the bed, at any depth down to u. */
MILD_HD Real law_steepest(const Law *law, int curves, Real depth) {
    Real slope = law->line_stiffness;
    if (curves & LAW_CONE) {
        slope = real_max(law->flat_stiffness, 0) + slope;
    }
    if (curves & LAW_POWER) {
        slope += power_steepest(law->power_force, law->power_exponent, depth);
    }
    return slope;
}

/* [N] Force of the elastic curve at rest. Any depth is allowed. */
MILD_HD Real law_elastic_force(const Law *law, int curves, Real depth) {
    const Real u = real_max(depth, 0);
    return curves & LAW_ELASTIC ? power_force(law->elastic_force, law->elastic_exponent, u) : 0;
}

/* Its slope [N/m], depth >= 0. */
MILD_HD Real law_elastic_slope(const Law *law, int curves, Real depth) {
    return curves & LAW_ELASTIC ? power_slope(law->elastic_force, law->elastic_exponent, depth) : 0;
}

/* Virgin ground on a way down from a depth to depth + way. */
typedef struct {
    Real mean;            /* [N] mean force over the way */
    Real mean_slope;      /* [N/m] its derivative with respect to the way */
    Real recruited;       /* [m] P(end) - P(begin) */
    Real recruited_slope; /* [-] its derivative with respect to the way */
} LawWay;

/* The mean uses Simpson's rule, which is exact for lines and for cubics such as P. The bed enters
 * with its force at the end of the way, because it is so stiff that a mean would make no
 * difference. On a way of length 0 the recruited depth is set to 0, because a fused multiply-add
 * may leave a rounding error in the difference. */
MILD_HD LawWay law_way(const Law *law, int curves, Real begin, Real way, const PowerWay *power) {
    const Real half = begin + way / 2;
    const Real end = begin + way;
    LawWay over;
    over.mean = law->line_stiffness * half + law_bed_force(law, end);
    over.mean_slope = law->line_stiffness / 2 + law_bed_slope(law, end);
    over.recruited = 0;
    over.recruited_slope = 0;
    if (curves & LAW_CONE) {
        const Real whole = law->cone_depth * REAL(1.0 / 3.0);
        const Real share_begin = law_cone_share(law, curves, begin);
        const Real share_half = law_cone_share(law, curves, half);
        const Real share_end = law_cone_share(law, curves, end);
        const Real share_mean = (share_begin + 4 * share_half + share_end) * REAL(1.0 / 6.0);
        const Real flat_half = law_flat_share(law, curves, half);
        const Real flat_end = law_flat_share(law, curves, end);
        over.mean += law->flat_stiffness * whole * share_mean;
        over.mean_slope += law->flat_stiffness * (2 * flat_half + flat_end) * REAL(1.0 / 6.0);
        over.recruited = way > 0 ? whole * (share_end - share_begin) : 0;
        over.recruited_slope = way > 0 ? flat_end : 0;
    }
    if (curves & LAW_HEAP) {
        const Real open_begin = real_min(begin, law->cone_begin);
        const Real open_half = real_min(half, law->cone_begin);
        const Real open_end = real_min(end, law->cone_begin);
        over.mean +=
            law->flat_stiffness * ((open_begin + 4 * open_half + open_end) * REAL(1.0 / 6.0));
        const Real moved = law_moved_depth(law);
        const Real moves =
            (real_min(end, moved) - real_min(begin, moved)) * (1 / LAW_MOVES - LAW_TAIL) +
            LAW_TAIL * way;
        const Real moves_slope = end < moved ? 1 / LAW_MOVES : LAW_TAIL;
        const int heap = law_is_heap(law, curves) && way > 0;
        over.recruited = heap ? moves : over.recruited;
        over.recruited_slope = heap ? moves_slope : over.recruited_slope;
    }
    if (curves & LAW_POWER) {
        over.mean += power->mean;
        over.mean_slope += power->slope;
    }
    return over;
}

/* The power over that way, for law_way; 0 where the law has none. */
MILD_HD PowerWay law_power_way(const Law *law, int curves, Real begin, Real way) {
    PowerWay power = {0, 0};
    if (curves & LAW_POWER) {
        power = power_way(law->power_force, law->power_exponent, begin, way);
    }
    return power;
}

#endif
