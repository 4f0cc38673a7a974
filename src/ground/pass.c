#include <string.h>

#include "ground/step.h"

/* The normal law at every slot of a foot: branch-free, so that it runs in vectors. */
static void foot_normal(const Slots *s, int start, int end, double dt, const double *V) {
    const double v2 = V[2], w0 = V[3], w1 = V[4];
#pragma omp simd
    for (int i = start; i < end; i++) {
        double impulse, slope;
        step_normal(s, i, dt, w1 * s->px[i] - w0 * s->py[i] - v2, &impulse, &slope);
        s->iz[i] = impulse;
        s->hzz[i] = slope;
    }
}

/* The same where the ground is not level. */
static void foot_normal_uneven(const Slots *s, int start, int end, double dt, const double *V) {
#pragma omp simd
    for (int i = start; i < end; i++) {
        double impulse, slope;
        step_normal(s, i, dt, slot_descent(s, i, V), &impulse, &slope);
        s->iz[i] = impulse;
        s->hzz[i] = slope;
    }
}

/* The normal impulse is I_z g, g = (-slope, 1): the gradient of -u, so that it does work exactly where u changes. Its
 * vertical part is the paper's; the horizontal one joins the friction. */
static void foot_lean(const Slots *s, int start, int end) {
#pragma omp simd
    for (int i = start; i < end; i++) {
        s->ix[i] -= s->slope_x[i] * s->iz[i];
        s->iy[i] -= s->slope_y[i] * s->iz[i];
    }
}

/* Coulomb friction and drift resistance of radius r = mu I_z + dt k_D d_D u (paper eqs 13 and 14), made single-valued by a
 * stick region |v| < eps, plus the drift damping: I = -(r/max(|v|, eps) + dt b_D) v. Both oppose the new velocity, so they
 * can neither push a resting foot nor reverse a motion. */
static void foot_tangent(const Slots *s, int start, int end, const double *V, double eps) {
    const double v0 = V[0], v1 = V[1], w0 = V[3], w1 = V[4], w2 = V[5];
#pragma omp simd
    for (int i = start; i < end; i++) {
        double vx = v0 + w1 * s->pz[i] - w2 * s->py[i], vy = v1 + w2 * s->px[i] - w0 * s->pz[i];
        double speed = sqrt(vx * vx + vy * vy), along = 1.0 / (speed > eps ? speed : eps);
        double pull = (s->mu[i] * s->iz[i] + s->drift_radius[i]) * along, b = s->damping[i];
        double nx = vx * along, ny = vy * along, slip = speed > eps ? pull : 0.0, couple = s->mu[i] * s->hzz[i];
        s->ix[i] = -(pull + b) * vx;
        s->iy[i] = -(pull + b) * vy;
        s->hxx[i] = pull + b - slip * nx * nx;
        s->hyy[i] = pull + b - slip * ny * ny;
        s->hxy[i] = -slip * nx * ny;
        s->hxz[i] = -couple * nx; /* the friction bound falls as the foot rises */
        s->hyz[i] = -couple * ny;
    }
}

/* The friction's direction as an unknown of its own (Chan, Golub and Mulet's method for sums of norms): l stands for
 * v/max(|v|, eps) and obeys |v| l = v, linearised at the old v as l = (v_new - l_old (n . dv))/|v_old| and kept in the unit
 * disc. A slipping element then loses stiffness along l and n instead of n twice: one whose direction is still in doubt,
 * as at the point a foot turns about, stays stiff, where Newton's method on v alone jumps to and fro across it. */
static void foot_dual(const Slots *s, int start, int end, const double *from, const double *V, double eps) {
#pragma omp simd
    for (int i = start; i < end; i++) {
        double px = s->px[i], py = s->py[i], pz = s->pz[i];
        double ox = from[0] + from[4] * pz - from[5] * py, oy = from[1] + from[5] * px - from[3] * pz;
        double vx = V[0] + V[4] * pz - V[5] * py, vy = V[1] + V[5] * px - V[3] * pz;
        double before = sqrt(ox * ox + oy * oy), ahead = 1.0 / (before > eps ? before : eps);
        double turn = before > eps ? ahead * (ox * (vx - ox) + oy * (vy - oy)) : 0.0;
        double lx = (vx - s->lx[i] * turn) * ahead, ly = (vy - s->ly[i] * turn) * ahead, square = lx * lx + ly * ly;
        double shorten = 1.0 / sqrt(square > 1.0 ? square : 1.0);
        s->lx[i] = lx * shorten;
        s->ly[i] = ly * shorten;
    }
}

/* Puts l into the derivatives that foot_tangent has just made at V. */
static void foot_dual_stiffness(const Slots *s, int start, int end, const double *V, double eps) {
#pragma omp simd
    for (int i = start; i < end; i++) {
        double vx = V[0] + V[4] * s->pz[i] - V[5] * s->py[i], vy = V[1] + V[5] * s->px[i] - V[3] * s->pz[i];
        double speed = sqrt(vx * vx + vy * vy), along = 1.0 / (speed > eps ? speed : eps), nx = vx * along, ny = vy * along;
        double slip = speed > eps ? (s->mu[i] * s->iz[i] + s->drift_radius[i]) * along : 0.0;
        double mx = nx - s->lx[i], my = ny - s->ly[i];
        s->hxx[i] += slip * nx * mx;
        s->hyy[i] += slip * ny * my;
        s->hxy[i] += 0.5 * slip * (nx * my + ny * mx);
    }
}

/* sum of B^T I = (sum I, sum p x I). */
static void foot_wrench(const Slots *s, int start, int end, double *wrench) {
    double fx = 0.0, fy = 0.0, fz = 0.0, tx = 0.0, ty = 0.0, tz = 0.0;
#pragma omp simd reduction(+ : fx, fy, fz, tx, ty, tz)
    for (int i = start; i < end; i++) {
        double px = s->px[i], py = s->py[i], pz = s->pz[i], ix = s->ix[i], iy = s->iy[i], iz = s->iz[i];
        fx += ix;
        fy += iy;
        fz += iz;
        tx += py * iz - pz * iy;
        ty += pz * ix - px * iz;
        tz += px * iy - py * ix;
    }
    wrench[0] = fx;
    wrench[1] = fy;
    wrench[2] = fz;
    wrench[3] = tx;
    wrench[4] = ty;
    wrench[5] = tz;
}

void contact_pass(MildScratch *scratch, double dt, const double *twist, double eps) {
    for (int f = 0; f < scratch->feet; f++) {
        int start = scratch->foot[f].start, end = foot_end(&scratch->foot[f]);
        int uneven = scratch->foot[f].uneven;
        (uneven ? foot_normal_uneven : foot_normal)(&scratch->slot, start, end, dt, twist + 6 * f);
        foot_tangent(&scratch->slot, start, end, twist + 6 * f, eps);
        if (uneven) foot_lean(&scratch->slot, start, end);
        foot_wrench(&scratch->slot, start, end, scratch->wrench + 6 * f);
    }
}

void contact_dual(MildScratch *scratch, const double *from, const double *twist, double eps) {
    for (int f = 0; f < scratch->feet; f++)
        foot_dual(&scratch->slot, scratch->foot[f].start, foot_end(&scratch->foot[f]), from + 6 * f, twist + 6 * f, eps);
}

void contact_dual_start(MildScratch *scratch, const double *twist, double eps) {
    for (int f = 0; f < scratch->feet; f++) {
        int start = scratch->foot[f].start;
        size_t bytes = (size_t)(foot_end(&scratch->foot[f]) - start) * sizeof(double);
        memset(scratch->slot.lx + start, 0, bytes);
        memset(scratch->slot.ly + start, 0, bytes);
    }
    contact_dual(scratch, twist, twist, eps); /* from nothing: l = v/max(|v|, eps) */
}

void contact_dual_stiffness(MildScratch *scratch, const double *twist, double eps) {
    for (int f = 0; f < scratch->feet; f++)
        foot_dual_stiffness(&scratch->slot, scratch->foot[f].start, foot_end(&scratch->foot[f]), twist + 6 * f, eps);
}

/* With the rows Jx = (1,0,0, 0,pz,-py), Jy = (0,1,0, -pz,0,px), Jz = (0,0,1, py,-px,0) of B and the element's
 * X = hxx Jx + hxy Jy + hxz Jz,  Y = hxy Jx + hyy Jy + hyz Jz,  Z = hzz Jz
 * the sum of B^T h B has the rows  X, Y, Z, py Z - pz Y, pz X - px Z, px Y - py X. */
static void hessian_linear(const Slots *s, int start, int end, double *H) {
    double x0 = 0.0, x1 = 0.0, x2 = 0.0, x3 = 0.0, x4 = 0.0, x5 = 0.0, y1 = 0.0, y2 = 0.0, y3 = 0.0, y4 = 0.0, y5 = 0.0;
    double z2 = 0.0, z3 = 0.0, z4 = 0.0;
#pragma omp simd reduction(+ : x0, x1, x2, x3, x4, x5, y1, y2, y3, y4, y5, z2, z3, z4)
    for (int i = start; i < end; i++) {
        double px = s->px[i], py = s->py[i], pz = s->pz[i], hxx = s->hxx[i], hxy = s->hxy[i], hyy = s->hyy[i];
        double hxz = s->hxz[i], hyz = s->hyz[i], hzz = s->hzz[i];
        x0 += hxx;
        x1 += hxy;
        x2 += hxz;
        x3 += hxz * py - hxy * pz;
        x4 += hxx * pz - hxz * px;
        x5 += hxy * px - hxx * py;
        y1 += hyy;
        y2 += hyz;
        y3 += hyz * py - hyy * pz;
        y4 += hxy * pz - hyz * px;
        y5 += hyy * px - hxy * py;
        z2 += hzz;
        z3 += hzz * py;
        z4 += hzz * px;
    }
    const double rows[18] = {x0, x1, x2, x3, x4, x5, x1, y1, y2, y3, y4, y5, 0.0, 0.0, z2, z3, -z4, 0.0};
    for (int k = 0; k < 18; k++) H[k] = rows[k];
}

static void hessian_angular(const Slots *s, int start, int end, double *H) {
    double a0 = 0.0, a1 = 0.0, a2 = 0.0, a3 = 0.0, a4 = 0.0, a5 = 0.0, b0 = 0.0, b1 = 0.0, b2 = 0.0, b3 = 0.0, b4 = 0.0;
    double b5 = 0.0, c0 = 0.0, c1 = 0.0, c2 = 0.0, c3 = 0.0, c4 = 0.0, c5 = 0.0;
#pragma omp simd reduction(+ : a0, a1, a2, a3, a4, a5, b0, b1, b2, b3, b4, b5, c0, c1, c2, c3, c4, c5)
    for (int i = start; i < end; i++) {
        double px = s->px[i], py = s->py[i], pz = s->pz[i], hxx = s->hxx[i], hxy = s->hxy[i], hyy = s->hyy[i];
        double hxz = s->hxz[i], hyz = s->hyz[i], hzz = s->hzz[i];
        double x3 = hxz * py - hxy * pz, x4 = hxx * pz - hxz * px, x5 = hxy * px - hxx * py;
        double y3 = hyz * py - hyy * pz, y4 = hxy * pz - hyz * px, y5 = hyy * px - hxy * py;
        double z3 = hzz * py, z4 = hzz * px;
        a0 += pz * hxy; /* the signs of pz Y are set below */
        a1 += pz * hyy;
        a2 += py * hzz - pz * hyz;
        a3 += py * z3 - pz * y3;
        a4 += py * z4 + pz * y4;
        a5 += pz * y5;
        b0 += pz * hxx;
        b1 += pz * hxy;
        b2 += pz * hxz - px * hzz;
        b3 += pz * x3 - px * z3;
        b4 += pz * x4 + px * z4;
        b5 += pz * x5;
        c0 += px * hxy - py * hxx;
        c1 += px * hyy - py * hxy;
        c2 += px * hyz - py * hxz;
        c3 += px * y3 - py * x3;
        c4 += px * y4 - py * x4;
        c5 += px * y5 - py * x5;
    }
    const double rows[18] = {-a0, -a1, a2, a3, -a4, -a5, b0, b1, b2, b3, b4, b5, c0, c1, c2, c3, c4, c5};
    for (int k = 0; k < 18; k++) H[k] = rows[k];
}

/* What g != (0, 0, 1) adds to minus the impulse's derivative, an element's 3 x 3 block: with k = hzz, the friction's
 * coupling c = (hxz, hyz, 0) and e = (0, 0, 1)
 *     k (g g^T - e e^T) + c (g - e)^T,
 * carried to the foot's twist by B^T: each vector v becomes (v, p x v). */
static void hessian_uneven(const Slots *s, int start, int end, double *H) {
    for (int i = start; i < end; i++) {
        double px = s->px[i], py = s->py[i], pz = s->pz[i], a = -s->slope_x[i], b = -s->slope_y[i];
        double k = s->hzz[i], cx = s->hxz[i], cy = s->hyz[i];
        const double lean[6] = {a, b, 0.0, -pz * b, pz * a, px * b - py * a}, up[6] = {0.0, 0.0, 1.0, py, -px, 0.0};
        const double couple[6] = {cx, cy, 0.0, -pz * cy, pz * cx, px * cy - py * cx};
        for (int r = 0; r < 6; r++)
            for (int c = 0; c < 6; c++)
                H[6 * r + c] += k * (lean[r] * (up[c] + lean[c]) + up[r] * lean[c]) + couple[r] * lean[c];
    }
}

void contact_hessian(MildScratch *scratch) {
    for (int f = 0; f < scratch->feet; f++) {
        int start = scratch->foot[f].start, end = foot_end(&scratch->foot[f]);
        double *H = scratch->hessian[f];
        hessian_linear(&scratch->slot, start, end, H);
        hessian_angular(&scratch->slot, start, end, H + 18);
        if (scratch->foot[f].uneven) hessian_uneven(&scratch->slot, start, end, H);
    }
}

double contact_residual(int n, const double *inverse_inertia, const double *impulse, const double *wrench) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
        double row = 0.0;
        for (int j = 0; j < n; j++) row += inverse_inertia[i * n + j] * (impulse[j] - wrench[j]);
        sum += (impulse[i] - wrench[i]) * row;
    }
    return sqrt(fmax(sum, 0.0));
}
