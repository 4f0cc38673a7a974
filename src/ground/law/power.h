/* A force that grows with the power n of the depth u, and x^y without libm.
 *
 *     F(u) = S x q^m,   x = u/z0,   q = x^2 + e^2,   m = (n - 1)/2
 * is S x^n except within z0 e = 0.1 mm of the surface, where it is straight, because for n < 1 the
 * power alone is infinitely stiff there. At 10 mm the two differ by |n - 1|/2 1e-4. F is convex for
 * n > 1 and concave for n < 1. Its integral is S z0 q^(m + 1)/(2 m + 2). */
#ifndef MILD_GROUND_POWER_H
#define MILD_GROUND_POWER_H

#include <stdint.h>
#include <string.h>

#include "base/hd.h"

#define POWER_DEPTH REAL(0.01)  /* z0 [m] */
#define POWER_ROUND REAL(1e-4)  /* e^2 [-] */
#define POWER_SERIES REAL(0.15) /* |rho| below which power_way uses a series */

#ifndef MILD_REAL_FLOAT

/* The bits of a double, and back. */
MILD_HD uint64_t real_bits(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

MILD_HD double real_from_bits(uint64_t bits) {
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

#define POWER_MAGIC 0x1.8p52 /* the low bits of this plus an integer are the integer */

#endif

/* The mean of F over a way, up or down. */
typedef struct {
    Real mean;  /* [N] */
    Real slope; /* [N/m] its derivative with respect to the way */
} PowerWay;

/* POWER_CALLED: defined by a file whose vector loops need no power. It calls the functions of
 * element_law.c, in place of a copy for each use. */
#ifdef POWER_CALLED
Real real_exp2(Real x);
Real real_pow(Real x, Real y);
Real power_force(Real force, Real exponent, Real depth);
Real power_slope(Real force, Real exponent, Real depth);
PowerWay power_way(Real force, Real exponent, Real begin, Real way);
#else
#ifndef POWER_FN
#define POWER_FN MILD_HD
#endif

#ifdef MILD_REAL_FLOAT

POWER_FN Real real_exp2(Real x) {
    return exp2f(x);
}

POWER_FN Real real_pow(Real x, Real y) {
    return powf(x, y);
}

#else

/* 2^x for |x| < 1000, within 4e-16: 2^k exp(f ln 2) with |f| <= 1/2, using the series of exp up to
 * (ln 2/2)^13/13!. It has no branch, so that loops vectorise. */
POWER_FN Real real_exp2(Real x) {
    const double shifted = x + POWER_MAGIC;
    const double f = (x - (shifted - POWER_MAGIC)) * 0.69314718055994530942;
    double sum = 1.0 / 6227020800;
    sum = sum * f + 1.0 / 479001600;
    sum = sum * f + 1.0 / 39916800;
    sum = sum * f + 1.0 / 3628800;
    sum = sum * f + 1.0 / 362880;
    sum = sum * f + 1.0 / 40320;
    sum = sum * f + 1.0 / 5040;
    sum = sum * f + 1.0 / 720;
    sum = sum * f + 1.0 / 120;
    sum = sum * f + 1.0 / 24;
    sum = sum * f + 1.0 / 6;
    sum = sum * f + 0.5;
    sum = sum * f + 1.0;
    sum = sum * f + 1.0;
    return sum * real_from_bits((real_bits(shifted) << 52) + real_bits(1.0));
}

/* log2(x) for a normal x > 0: x = 2^k z with z near 1, and ln z = 2 artanh((z - 1)/(z + 1)), using
 * the series up to 0.172^19/19. */
MILD_HD Real real_log2(Real x) {
    const uint64_t half = 0x3fe6a09e667f3bcd; /* bits of sqrt(1/2) */
    const int64_t k = (int64_t)(real_bits(x) - half) >> 52;
    const double z = real_from_bits(real_bits(x) - ((uint64_t)k << 52));
    const double whole = real_from_bits(real_bits(POWER_MAGIC) + (uint64_t)k) - POWER_MAGIC;
    const double s = (z - 1.0) / (z + 1.0);
    const double t = s * s;
    double sum = 1.0 / 19;
    sum = sum * t + 1.0 / 17;
    sum = sum * t + 1.0 / 15;
    sum = sum * t + 1.0 / 13;
    sum = sum * t + 1.0 / 11;
    sum = sum * t + 1.0 / 9;
    sum = sum * t + 1.0 / 7;
    sum = sum * t + 1.0 / 5;
    sum = sum * t + 1.0 / 3;
    sum = sum * t + 1.0;
    return whole + s * sum * 2.8853900817779268147; /* 2/ln 2 */
}

/* x^y for a normal x > 0. */
POWER_FN Real real_pow(Real x, Real y) {
    return real_exp2(y * real_log2(x));
}

#endif

/* F(u) [N]. force: S [N], the force at z0. exponent: n [-]. */
POWER_FN Real power_force(Real force, Real exponent, Real depth) {
    const Real x = depth / POWER_DEPTH;
    return force * x * real_pow(x * x + POWER_ROUND, (exponent - 1) / 2);
}

/* F'(u) [N/m]. */
POWER_FN Real power_slope(Real force, Real exponent, Real depth) {
    const Real x = depth / POWER_DEPTH;
    const Real q = x * x + POWER_ROUND;
    const Real grown = real_pow(q, (exponent - 1) / 2) / q;
    return force / POWER_DEPTH * grown * (exponent * x * x + POWER_ROUND);
}

/* q^m over a way, with q and m as below: all that takes long. */
typedef struct {
    Real middle; /* [-] Q^m */
    Real begin;  /* [-] q0^m */
    Real end;    /* [-] q1^m */
} PowerOver;

/* The depths of a way. */
typedef struct {
    Real x0; /* [-] u/z0 at its begin */
    Real x1; /* [-] at its end */
    Real q0; /* [-] x0^2 + e^2 */
    Real q1; /* [-] x1^2 + e^2 */
} PowerEnds;

MILD_HD PowerEnds power_ends(Real begin, Real way) {
    PowerEnds ends;
    ends.x0 = begin / POWER_DEPTH;
    ends.x1 = (begin + way) / POWER_DEPTH;
    ends.q0 = ends.x0 * ends.x0 + POWER_ROUND;
    ends.q1 = ends.x1 * ends.x1 + POWER_ROUND;
    return ends;
}

MILD_HD PowerOver power_over(Real exponent, Real begin, Real way) {
    const Real m = (exponent - 1) / 2;
    const PowerEnds ends = power_ends(begin, way);
    PowerOver over;
    over.middle = real_pow((ends.q0 + ends.q1) / 2, m);
    over.begin = real_pow(ends.q0, m);
    over.end = real_pow(ends.q1, m);
    return over;
}

/* From x0 to x1 the mean is S (q1^(m+1) - q0^(m+1))/((2 m + 2) (x1 - x0)). Where that cancels, it
 * is expanded about the mean Q of q0 and q1, with h the mean of x0 and x1:
 *
 *     mean = S h Q^m g(rho),  rho = (q1 - q0)/(q1 + q0),  g = sum of C(m, 2 k) rho^2k/(2 k + 1)
 * up to rho^10. The remainder is below 1e-13 of the mean. */
MILD_HD PowerWay power_way_of(Real force, Real exponent, Real begin, Real way,
                              const PowerOver *grows) {
    const Real m = (exponent - 1) / 2;
    const PowerEnds ends = power_ends(begin, way);
    const Real x0 = ends.x0;
    const Real x1 = ends.x1;
    const Real h = (x0 + x1) / 2;
    const Real q0 = ends.q0;
    const Real q1 = ends.q1;
    const Real q = (q0 + q1) / 2;
    const Real rho = h * (x1 - x0) / q;
    const int near = rho < POWER_SERIES && rho > -POWER_SERIES;

    const Real c2 = m * (m - 1) / 2;
    const Real c4 = c2 * (m - 2) * (m - 3) / 12;
    const Real c6 = c4 * (m - 4) * (m - 5) / 30;
    const Real c8 = c6 * (m - 6) * (m - 7) / 56;
    const Real c10 = c8 * (m - 8) * (m - 9) / 90;
    const Real r = rho * rho;
    const Real g = 1 + r * (c2 / 3 + r * (c4 / 5 + r * (c6 / 7 + r * (c8 / 9 + r * (c10 / 11)))));
    const Real g_slope =
        rho *
        (c2 * 2 / 3 + r * (c4 * 4 / 5 + r * (c6 * 6 / 7 + r * (c8 * 8 / 9 + r * (c10 * 10 / 11)))));
    const Real grown = force * grows->middle;
    const Real turned = h * x1 / q * (m * g + (1 - rho) * g_slope);

    const Real inverse = 1 / (near ? 1 : x1 - x0);
    const Real far = force * (q1 * grows->end - q0 * grows->begin) / (2 * m + 2) * inverse;
    const Real far_slope = (force * x1 * grows->end - far) * inverse;

    PowerWay over;
    over.mean = near ? h * grown * g : far;
    over.slope = (near ? grown * (g / 2 + turned) : far_slope) / POWER_DEPTH;
    return over;
}

POWER_FN PowerWay power_way(Real force, Real exponent, Real begin, Real way) {
    const PowerOver grows = power_over(exponent, begin, way);
    return power_way_of(force, exponent, begin, way, &grows);
}

#endif

/* [N/m] The largest F' at any depth down to u. */
MILD_HD Real power_steepest(Real force, Real exponent, Real depth) {
    return real_max(power_slope(force, exponent, 0), power_slope(force, exponent, depth));
}

#endif
