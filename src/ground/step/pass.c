/* The loops over a foot's slots have no branches, so that they vectorise. Normal impulses and
 * friction have a loop each. A single loop would be one dependency chain, too long for the
 * processor to overlap several vectors. */
#include <string.h>

#include "ground/law/friction.h"
#include "ground/law/impulse.h"
#include "ground/step/step.h"

#ifdef MILD_REAL_FLOAT
/* In halves: sixteen in a row would take as long as the loop before them. */
void lanes_sum(const Lanes *lanes, int count, double *sums) {
    for (int k = 0; k < count; k++) {
        Lanes part;
        memcpy(part, lanes[k], sizeof part);
#pragma GCC unroll 4
        for (int half = SLOT_LANES / 2; half > 0; half /= 2) {
#pragma omp simd
            for (int l = 0; l < half; l++) {
                part[l] += part[l + half];
            }
        }
        sums[k] = (double)part[0];
    }
}
#else
void lanes_sum(const Lanes *lanes, int count, double *sums) {
    for (int k = 0; k < count; k++) {
        double sum = 0.0;
        for (int l = 0; l < SLOT_LANES; l++) {
            sum += lanes[k][l];
        }
        sums[k] = sum;
    }
}
#endif

MILD_HD void slot_normal(Slots *s, int i, Real dt, const Motion *motion, int kind, int curves,
                         int stops) {
    const Element element = slot_loaded(s, i, curves);
    const SlotVelocity v = slot_velocity(s, i, motion, kind);
    const ImpulsePowers powers = {{s->power[0][i], s->power[1][i]},
                                  {s->elastic[0][i], s->elastic[1][i]}};
    const Impulse normal = element_impulse_of(&element, curves, stops, dt, v.descent, &powers);
    s->iz[i] = normal.value;
    s->hzz[i] = normal.slope;
}

/* Normal impulses and their derivatives. */
MILD_HD void foot_normal(const FootScratch *foot, Real dt, const Motion *m, int kind, int curves,
                         int stops) {
    const Motion motion = *m;
    for (Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
#pragma omp simd
        for (int i = 0; i < SLOT_LANES; i++) {
            slot_normal(s, i, dt, &motion, kind, curves, stops);
        }
    }
}

/* The way of a slot's element over which the law has a power of the depth. */
MILD_HD void slot_way(const Slots *s, int i, Real dt, const Motion *motion, int curve, Real *begin,
                      Real *way) {
    const SlotVelocity v = slot_velocity(s, i, motion, SLOT_UNEVEN | SLOT_SHELL);
    const Real middle = s->depth[i] + dt / 2 * v.descent;
    const Real from = real_max(s->middle[i], 0);
    *begin = curve == LAW_POWER ? s->virgin_depth[i] : from;
    *way =
        curve == LAW_POWER ? real_max(middle - s->yield_depth[i], 0) : real_max(middle, 0) - from;
}

/* Sets what element_powers gives a slot for a curve, LAW_POWER or LAW_ELASTIC: Slots.power or
 * elastic. The same loops do it for both, and for the three powers of each. */
static __attribute__((noinline)) void foot_powers(const FootScratch *foot, Real dt, const Motion *m,
                                                  int curve) {
    const Motion motion = *m;
    for (Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
        const Real *exponent = curve == LAW_POWER ? s->power_exponent : s->elastic_exponent;
        Lanes *power = curve == LAW_POWER ? s->power : s->elastic;
        Lanes begin, way, grown[3];
#pragma omp simd
        for (int i = 0; i < SLOT_LANES; i++) {
            slot_way(s, i, dt, &motion, curve, &begin[i], &way[i]);
            const PowerEnds ends = power_ends(begin[i], way[i]);
            grown[0][i] = (ends.q0 + ends.q1) / 2;
            grown[1][i] = ends.q0;
            grown[2][i] = ends.q1;
        }
#pragma GCC unroll 3
        for (int k = 0; k < 3; k++) {
#pragma omp simd
            for (int i = 0; i < SLOT_LANES; i++) {
                grown[k][i] = real_pow(grown[k][i], (exponent[i] - 1) / 2);
            }
        }
#pragma omp simd
        for (int i = 0; i < SLOT_LANES; i++) {
            const PowerOver grows = {grown[0][i], grown[1][i], grown[2][i]};
            const Real force =
                curve == LAW_POWER ? s->power_force[i] * s->share[i] : s->elastic_force[i];
            const PowerWay over = power_way_of(force, exponent[i], begin[i], way[i], &grows);
            power[0][i] = over.mean;
            power[1][i] = over.slope;
        }
    }
}

/* Picks the loop compiled for the curves and the slope of the ground under the foot. On level
 * ground the slopes are 0, so a loop for uneven ground does for both where a second one would gain
 * little. */
static void foot_normals(const FootScratch *foot, Real dt, const Motion *motion) {
    switch (foot_variant(foot)) {
    case LAW_CONE:
        if (!foot->uneven && !foot->stops) {
            foot_normal(foot, dt, motion, 0, LAW_CONE, 0);
            return;
        } /* else a heap that begins at the surface and carries all of its load */
        // fall through
    case LAW_CONE | LAW_HEAP:
        if (foot->uneven || foot->stops) {
            foot_normal(foot, dt, motion, SLOT_UNEVEN, LAW_CONE | LAW_HEAP, 1);
        } else {
            foot_normal(foot, dt, motion, 0, LAW_CONE | LAW_HEAP, 0);
        }
        return;
    case LAW_LINE: /* a power without force */
    case LAW_POWER: foot_normal(foot, dt, motion, SLOT_UNEVEN, LAW_POWER, 0); return;
    case LAW_ELASTIC: foot_normal(foot, dt, motion, SLOT_UNEVEN, LAW_ELASTIC, 0); return;
    default: foot_normal(foot, dt, motion, SLOT_UNEVEN | SLOT_SHELL, LAW_ANY, 1); return;
    }
}

/* Adds friction to the impulses. Where the ground is not level the normal impulse is I_z g with g =
 * (-slope, 1) = -grad u, so it does work exactly when u changes. Its vertical part is the paper's.
 * With
 *
 *     f = -d friction/dv,   k = -dI_z/dw,   c = g + d friction/dI_z
 *
 * the derivative is
 *
 *     h = -dI/dv = f + k c g^T
 *
 * kind: SLOT_UNEVEN, SLOT_SHELL. held: bool, the friction bounds are Slots.bound. turned: bool,
 * some elements have a reversal velocity in Slots.turn_x and turn_y (energy.c). */
MILD_HD void block_friction(Slots *s, const Motion *motion, int kind, int held, int turned) {
#pragma omp simd
    for (int i = 0; i < SLOT_LANES; i++) {
        const SlotVelocity v = slot_velocity(s, i, motion, kind);
        const Real iz = s->iz[i];
        const Real k = s->hzz[i];
        const Element element = slot_element(s, i);
        const Real bound = held ? s->bound[i] : friction_bound(&element, iz);
        const Real mu = held ? 0 : element.mu;
        const Friction friction = turned ? friction_turned(&element, bound, mu, v.x, v.y)
                                         : friction_impulse(&element, bound, mu, v.x, v.y);
        Real ix = friction.x;
        Real iy = friction.y;
        Real hxz = friction.rise_x * k;
        Real hyz = friction.rise_y * k;
        Real hxx = friction.fall_xx;
        Real hxy = friction.fall_xy;
        Real hyy = friction.fall_yy;
        if (kind & SLOT_UNEVEN) {
            const Real gx = -s->slope_x[i];
            const Real gy = -s->slope_y[i];
            ix += gx * iz;
            iy += gy * iz;
            hxz += k * gx;
            hyz += k * gy;
            s->hyx[i] = hxy + hyz * gx;
            hxx += hxz * gx;
            hxy += hxz * gy;
            hyy += hyz * gy;
            s->hzx[i] = k * gx;
            s->hzy[i] = k * gy;
        }
        s->hxx[i] = hxx;
        s->hxy[i] = hxy;
        s->hyy[i] = hyy;
        s->hxz[i] = hxz;
        s->hyz[i] = hyz;
        s->ix[i] = ix;
        s->iy[i] = iy;
    }
}

MILD_HD void foot_friction(const FootScratch *foot, const Motion *m, int kind, int held,
                           int turned) {
    const Motion motion = *m;
    for (Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
        block_friction(s, &motion, kind, held, turned);
    }
}

/* Sums over the foot of I, x I, y I and, for a shell, height I. */
static void foot_sums(const FootScratch *foot, double sums[12]) {
    LaneVector all[12] = {{0.0}};
    for (const Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
        const LaneVector x = lanes_load(s->x), y = lanes_load(s->y);
        const LaneVector ix = lanes_load(s->ix), iy = lanes_load(s->iy), iz = lanes_load(s->iz);
        all[0] += ix;
        all[1] += iy;
        all[2] += iz;
        all[3] += x * ix;
        all[4] += x * iy;
        all[5] += x * iz;
        all[6] += y * ix;
        all[7] += y * iy;
        all[8] += y * iz;
    }
    for (const Slots *s = foot->slot, *end = slots_end(foot); foot->shell && s < end; s++) {
        const LaneVector z = lanes_load(s->z);
        all[9] += z * lanes_load(s->ix);
        all[10] += z * lanes_load(s->iy);
        all[11] += z * lanes_load(s->iz);
    }
    lanes_sum((const Lanes *)all, 12, sums);
}

/* torque += p x I */
static __attribute__((noinline)) void cross_add(const double *p, const double *I, double *torque) {
    torque[0] += p[1] * I[2] - p[2] * I[1];
    torque[1] += p[2] * I[0] - p[0] * I[2];
    torque[2] += p[0] * I[1] - p[1] * I[0];
}

/* Picks the loop compiled for the ground under the foot. Reversals and held bounds are seldom: one
 * loop does for both, and for shells. */
static void foot_frictions(const FootScratch *foot, const Motion *motion, int held) {
    if (held || foot->turned || foot->shell) {
        foot_friction(foot, motion, SLOT_UNEVEN | SLOT_SHELL, held, 1);
    } else if (foot->uneven) {
        foot_friction(foot, motion, SLOT_UNEVEN, 0, 0);
    } else {
        foot_friction(foot, motion, 0, 0, 0);
    }
}

static void pass(MildScratch *scratch, double dt, const double *twist, int held) {
    for (int k = 0; k < scratch->listed; k++) {
        const int f = scratch->list[k];
        const FootScratch *foot = &scratch->foot[f];
        double *sums = scratch->sums[f];
        double *wrench = scratch->wrench + 6 * f;
        const Motion motion = foot_moves(foot, twist + 6 * k);
        if (foot->curves & LAW_POWER) { /* elsewhere they are multiplied by 0 */
            foot_powers(foot, dt, &motion, LAW_POWER);
        }
        if (foot->curves & LAW_ELASTIC) {
            foot_powers(foot, dt, &motion, LAW_ELASTIC);
        }
        foot_normals(foot, dt, &motion);
        foot_frictions(foot, &motion, held);
        foot_sums(foot, sums);
        /* sum of B^T I = (sum I, sum p x I), p = arm0 + x arm1 + y arm2 + height arm3 */
        memcpy(wrench, sums, 3 * sizeof *sums);
        memset(wrench + 3, 0, 3 * sizeof *wrench);
        for (int i = 0; i < 3; i++) {
            cross_add(foot->lever[i], sums + 3 * i, wrench + 3);
        }
        if (foot->shell) {
            cross_add(foot->lever[3], sums + 9, wrench + 3);
        }
    }
}

void contact_pass(MildScratch *scratch, double dt, const double *twist) {
    pass(scratch, dt, twist, 0);
}

void contact_pass_held(MildScratch *scratch, double dt, const double *twist) {
    pass(scratch, dt, twist, 1);
}

/* Sums over slots of each of a, b and c times 1, x, y, x^2, xy, y^2. The arrays are those of the
 * first block of slots. Three at a time are as many sums as the registers hold. end: slots, rounded
 * up to whole blocks. */
static void moments(const Real *xs, const Real *ys, int end, const Real *a, const Real *b,
                    const Real *c, double sums[3][6]) {
    LaneVector A[6] = {{0.0}}, B[6] = {{0.0}}, C[6] = {{0.0}};
    for (int i = 0; i < end * (int)SLOT_NUMBERS; i += SLOT_LANES * (int)SLOT_NUMBERS) {
        const LaneVector x = lanes_load(xs + i), y = lanes_load(ys + i);
        const LaneVector xx = x * x, xy = x * y, yy = y * y;
        const LaneVector p = lanes_load(a + i), q = lanes_load(b + i), r = lanes_load(c + i);
        A[0] += p;
        A[1] += p * x;
        A[2] += p * y;
        A[3] += p * xx;
        A[4] += p * xy;
        A[5] += p * yy;
        B[0] += q;
        B[1] += q * x;
        B[2] += q * y;
        B[3] += q * xx;
        B[4] += q * xy;
        B[5] += q * yy;
        C[0] += r;
        C[1] += r * x;
        C[2] += r * y;
        C[3] += r * xx;
        C[4] += r * xy;
        C[5] += r * yy;
    }
    lanes_sum((const Lanes *)A, 6, sums[0]);
    lanes_sum((const Lanes *)B, 6, sums[1]);
    lanes_sum((const Lanes *)C, 6, sums[2]);
}

/* Three times the loop for x and y, over (x, y), (y, z) and (z, x): a loop of its own would be
 * faster and larger. */
static void shell_moments(const FootScratch *foot, ShellMoments M) {
    static const uint8_t place[3][6] = {{0, 1, 2, 4, 5, 6}, {0, 2, 3, 6, 7, 8}, {0, 3, 1, 8, 9, 4}};
    const Slots *s = foot->slot;
    const Real *const at[3] = {s->x, s->y, s->z};
    const Real *const h[3][3] = {
        {s->hxx, s->hxy, s->hxz}, {s->hyx, s->hyy, s->hyz}, {s->hzx, s->hzy, s->hzz}};
    for (int row = 0; row < 3; row++) {
        for (int pair = 0; pair < 3; pair++) {
            double sums[3][6];
            moments(at[pair], at[(pair + 1) % 3], foot_end(foot), h[row][0], h[row][1], h[row][2],
                    sums);
            for (int c = 0; c < 3; c++) {
                for (int k = 0; k < 6; k++) {
                    M[row][c][place[pair][k]] = sums[c][k];
                }
            }
        }
    }
}

/* Sums over the foot of each entry of h times 1, x, y, x^2, xy, y^2. They determine the foot's
 * hessian, because p is linear in x and y. */
typedef double Moments[3][3][6];
static void foot_moments(const FootScratch *foot, Moments M) {
    const Slots *s = foot->slot;
    const int end = foot_end(foot);
    moments(s->x, s->y, end, s->hxx, s->hxy, s->hxz, M[0]);
    if (foot->uneven) {
        moments(s->x, s->y, end, s->hyx, s->hyy, s->hyz, M[1]);
        moments(s->x, s->y, end, s->hzx, s->hzy, s->hzz, M[2]);
        return;
    }
    double rest[3][6];
    moments(s->x, s->y, end, s->hyy, s->hyz, s->hzz, rest);
    memcpy(M[1][0], M[0][1], sizeof M[1][0]);
    memcpy(M[1][1], rest, 2 * sizeof *rest);
    memset(M[2], 0, 2 * sizeof M[2][0]);
    memcpy(M[2][2], rest[2], sizeof *rest);
}

/* Three numbers in a register. */
typedef double Three __attribute__((vector_size(4 * sizeof(double))));

/* Adds to H what the factor k of p does (foot_hessian). One text for the three factors. */
static __attribute__((noinline)) void factor_add(const FootScratch *foot, const Moments M, int k,
                                                 double *H) {
    static const int product[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    Three rows[6] = {{0.0}}; /* of the three rows of h: [M_k0, N_k] */
    for (int l = 0; l < 3; l++) {
        const double *p = foot->lever[l];
        const int at = product[k][l];
        Three m[3]; /* M_kl */
#pragma GCC unroll 3
        for (int c = 0; c < 3; c++) {
            m[c] = (Three){M[0][c][at], M[1][c][at], M[2][c][at]};
            rows[c] = l == 0 ? m[c] : rows[c];
        }
        rows[3] += p[1] * m[2] - p[2] * m[1]; /* -m [p]x = p x m */
        rows[4] += p[2] * m[0] - p[0] * m[2];
        rows[5] += p[0] * m[1] - p[1] * m[0];
    }
    const double *q = foot->lever[k];
    for (int c = 0; c < 6; c++) {
        const Three row = rows[c];
        for (int r = 0; k == 0 && r < 3; r++) {
            H[6 * r + c] = row[r];
        }
        H[18 + c] += q[1] * row[2] - q[2] * row[1];
        H[24 + c] += q[2] * row[0] - q[0] * row[2];
        H[30 + c] += q[0] * row[1] - q[1] * row[0];
    }
}

/* H = sum of B^T h B, with B = [1, -[p]x] and p = sum over k of (1, x, y)_k arm_k. With M_kl the
 * moment of h by the product of factors k and l, and N_k = -sum over l of M_kl [arm_l]x,
 *
 *     force rows     [M_00, N_0]
 *     torque rows    sum over k of [arm_k]x [M_k0, N_k] */
static void foot_hessian(const FootScratch *foot, const Moments M, double *H) {
    memset(H, 0, 36 * sizeof *H);
    for (int k = 0; k < 3; k++) {
        factor_add(foot, M, k, H);
    }
}

void contact_hessian(MildScratch *scratch) {
    for (int k = 0; k < scratch->listed; k++) {
        const int f = scratch->list[k];
        const FootScratch *foot = &scratch->foot[f];
        if (foot->shell) {
            ShellMoments moved;
            shell_moments(foot, moved);
            shell_hessian(foot, moved, scratch->hessian[f]);
            continue;
        }
        Moments sums;
        foot_moments(foot, sums);
        foot_hessian(foot, sums, scratch->hessian[f]);
    }
}
