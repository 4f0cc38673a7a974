/* A force that grows with a power of the depth, as the dense reference takes it: from docs/model.md
 * section 19, by libm and quadrature. */
#ifndef DENSE_POWER_H
#define DENSE_POWER_H

#include <math.h>

#define DENSE_ROUND 1e-4 /* [m] within which it is straight */
#define DENSE_DEPTH 0.01 /* [m] at which it is given */

/* F z q^((n - 1)/2) with z = u/10 mm and q = (u^2 + e^2)/(10 mm)^2. */
static inline double power_at(double force, double n, double u) {
    double z = u / DENSE_DEPTH, e = DENSE_ROUND / DENSE_DEPTH;
    return force * z * pow(z * z + e * e, 0.5 * (n - 1.0));
}

/* Its derivative: F q^((n - 3)/2) (n z^2 + e^2), by the depth. */
static inline double power_rise(double force, double n, double u) {
    double z = u / DENSE_DEPTH, e = DENSE_ROUND / DENSE_DEPTH;
    return force / DENSE_DEPTH * pow(z * z + e * e, 0.5 * (n - 3.0)) * (n * z * z + e * e);
}

/* Its mean from the depth u over a way down: Gauss's rule of eight points on pieces that are short
 * beside the distance to the curve's poles at +-e i. */
static inline double power_mean(double force, double n, double u, double way) {
    static const double place[4] = {0.18343464249564980, 0.52553240991632899, 0.79666647741362674,
                                    0.96028985649753623};
    static const double weight[4] = {0.36268378337836198, 0.31370664587788729, 0.22238103445337447,
                                     0.10122853629037626};
    double sum = 0.0;
    if (force == 0.0) {
        return 0.0;
    }
    for (double done = 0.0, piece; done < 1.0; done += piece) {
        double at = u + done * way, short_way = 0.5 * hypot(at, DENSE_ROUND);
        piece = way > (1.0 - done) * 1e-9 ? fmin(1.0 - done, short_way / way) : 1.0 - done;
        for (int k = 0; k < 8; k++) {
            double x = k < 4 ? place[k] : -place[k - 4];
            double here = at + 0.5 * piece * way * (1.0 + x);
            sum += 0.5 * piece * weight[k % 4] * power_at(force, n, here);
        }
    }
    return sum;
}

#endif
