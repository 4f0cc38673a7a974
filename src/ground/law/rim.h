/* What the rim of a rounded body leaves of its load (docs/model.md section 23).
 *
 * Under a merged sole (law.h) the pressure at the distance e from the edge is that of the ground
 * beside the edge, at the edge's depth d, and what the heap adds on the way in:
 *
 *     p = kappa d + (k0 - kappa) T e          once the cone is complete; T = tan(alpha)/nu
 * Below a plane sole d is the depth u of the element, and this is its law. A rounded body is deeper
 * inside than at its rim, and ground there bears no more for it than under a plate whose heap is
 * just complete, u = T e. So an element of a shell carries the share
 *
 *     c = (kappa max(d, T e) + (k0 - kappa) T e)/(kappa u + (k0 - kappa) P(u)),  at most 1
 * of its load (share.h). The rim is found from moments of the elements in the ground, weighted by
 * projected area. The plane of least squares through the depths, u ~ mean + g (x - mean), says how
 * the body leans, and what is left of them, v, how round it is: over a paraboloid v is uniform
 * between 0 at the rim and H, so H^2 = 12 var(v), and
 *
 *     d = mean u - H/2 + g (x - mean x)       [m] depth of the rim's plane under the element
 *     b = 2 sqrt(least eigenvalue of cov x)   [m] half the breadth: the radius of a disc
 *     e = b (1 - sqrt(1 - v/H))               [m] distance to the rim
 * Elements steeper than 60 degrees are walls, which grains pass (the angle of SHARE_PASSIVE): they
 * are outside the rim and keep SHARE_LEAN of their load. */
#ifndef MILD_GROUND_RIM_H
#define MILD_GROUND_RIM_H

#include "ground/law/share.h"

#define RIM_STEEP REAL(0.5)      /* [-] least cosine of an element that is no wall */
#define RIM_FLAT REAL(2e-4)      /* [m] H of a shell that counts as half round */
#define RIM_HAIR REAL(2e-5)      /* [m] rounds off the root of H^2, which is a difference */
#define RIM_RIDGE REAL(1e-4)     /* [-] of an element's own moment: a row has no slope across */
#define RIM_MEAN REAL(5.0 / 9.0) /* [-] v/H where e is b/3, the mean under a disc */
#define RIM_RADIUS REAL(0.0110016969) /* [m] of the disc of an element of MATERIAL_PITCH */
#define RIM_DISC REAL(0.07957747155)  /* 1/(4 pi): second moment of a disc over its area squared */

/* Sums over the elements in the ground of the weight times z_i z_j, j <= i, where z = (1, x, y, u),
 * row by row; and of the weight times the second moment of an element's own disc. */
enum {
    RIM_W,
    RIM_X,
    RIM_XX,
    RIM_Y,
    RIM_XY,
    RIM_YY,
    RIM_U,
    RIM_XU,
    RIM_YU,
    RIM_UU,
    RIM_OWN,
    RIM_SUMS
};

typedef struct {
    Real x, y;     /* [m] middle of the elements, as their places */
    Real depth;    /* [m] of the rim's plane there */
    Real slope[2]; /* [-] g */
    Real height;   /* [m] H */
    Real breadth;  /* [m] b */
} Rim;

/* [m] The depth u that counts: the greatest that the element's ground remembers; 0 in the air. */
MILD_HD Real rim_depth(Real depth, Real deepest) {
    return depth > 0 ? real_max(depth, deepest) : 0;
}

/* Adds an element at (x, y) [m], with u of rim_depth [m]. down: [-] downward part of its outward
 * normal. area: [m^2] of the element. */
MILD_HD void rim_add(Real *sums, Real x, Real y, Real u, Real down, Real area) {
    const Real w = u > 0 && down >= RIM_STEEP ? down * area : 0;
    const Real z[4] = {1, x, y, u};
    for (int i = 0, k = 0; i < 4; i++) {
        for (int j = 0; j <= i; j++) {
            sums[k++] += w * z[i] * z[j];
        }
    }
    sums[RIM_OWN] += w * area * RIM_DISC;
}

MILD_HD Rim rim_of(const Real *sums) {
    const Real scale = 1 / real_max(sums[RIM_W], REAL(1e-12));
    const Real middle[4] = {1, sums[RIM_X] * scale, sums[RIM_Y] * scale, sums[RIM_U] * scale};
    Real moment[RIM_OWN];
    for (int i = 0, k = 0; i < 4; i++) {
        for (int j = 0; j <= i; j++, k++) {
            moment[k] = sums[k] * scale - middle[i] * middle[j];
        }
    }
    const Real xx = moment[RIM_XX], xy = moment[RIM_XY], yy = moment[RIM_YY];
    const Real xu = moment[RIM_XU], yu = moment[RIM_YU];
    const Real own = sums[RIM_OWN] * scale;
    const Real half = (xx - yy) / 2;
    const Real least = (xx + yy) / 2 - REAL_SQRT(half * half + xy * xy) + own;
    const Real a = xx + RIM_RIDGE * own, b = yy + RIM_RIDGE * own;
    const Real inverse = 1 / real_max(a * b - xy * xy, REAL(1e-20));
    const Real gx = (b * xu - xy * yu) * inverse;
    const Real gy = (a * yu - xy * xu) * inverse;
    const Real rest = 12 * real_max(moment[RIM_UU] - gx * xu - gy * yu, 0);
    const Real height = REAL_SQRT(rest + RIM_HAIR * RIM_HAIR) - RIM_HAIR;
    const Rim rim = {middle[1], middle[2], middle[3] - height / 2,
                     {gx, gy},  height,    2 * REAL_SQRT(real_max(least, 0))};
    return rim;
}

/* [-] c: what an element bears over what it would bear alone. law: its own. */
MILD_HD Real rim_share(const Law *law, Real recovery, Real bears, Real alone) {
    const Real level = real_over(bears, alone + ELEMENT_TINY);
    /* Ground that springs back is no grains. */
    const Real blend = level + (1 - level) * recovery;
    return law->flat_stiffness > 0 ? real_min(real_max(blend, SHARE_LEAN), 1) : 1;
}

/* [N] Force of an element alone at the depth u. */
MILD_HD Real rim_force(const Law *law, Real u) {
    return law_bedless_force(law, LAW_CONE | LAW_HEAP, u);
}

/* [N] What an element of a rounded body bears. width: [-] as in SoleHeap. u: [m] its depth, above
 * 0. */
MILD_HD Real rim_bears(const Rim *rim, const Law *law, Real width, Real x, Real y, Real u,
                       Real down) {
    const Real d = rim->depth + rim->slope[0] * (x - rim->x) + rim->slope[1] * (y - rim->y);
    const Real v = (u - d + RIM_MEAN * RIM_FLAT) / (rim->height + RIM_FLAT);
    const Real inside = 1 - REAL_SQRT(1 - real_min(real_max(v, 0), 1));
    const Real heap = law->cone_depth * (inside * rim->breadth / (RIM_RADIUS * width));
    const Real bears = law->line_stiffness * real_max(d, heap) + law->flat_stiffness * heap;
    return down >= RIM_STEEP ? bears : 0;
}

#endif
