#include "base/student.h"

#include <math.h>

#define WANTED 0.95
#define NORMAL_95 1.959963984540054 /* the normal distribution's value, smaller than every t */

/* Probability that |t| <= sqrt(freedom) tan(angle), and its derivative with respect to the angle.
 * For an integer number of degrees of freedom it is a finite sum (Abramowitz and Stegun 26.7.3,
 * 26.7.4). */
static double probability_within(int freedom, double angle, double *slope) {
    const double c = cos(angle);
    const int odd = freedom % 2;
    const double scale = odd ? 2 / acos(-1.0) : 1;
    double term = odd ? c : 1;
    double sum = 0;
    for (int k = odd ? 3 : 2; k <= freedom; k += 2) {
        sum += term;
        term *= c * c * (k - 1) / k;
    }
    *slope = scale * freedom * term / c;
    return scale * (sin(angle) * sum + (odd ? angle : 0));
}

double student_95(int freedom) {
    if (freedom < 1) {
        return NAN;
    }
    const double root = sqrt(freedom);
    double angle = atan(NORMAL_95 / root);
    /* The probability is concave in the angle. So Newton's method approaches the solution from
     * below and never overshoots, until rounding stops it. */
    for (double rise = angle; rise > 1e-14 * angle; angle += fmax(rise, 0)) {
        double slope;
        const double within = probability_within(freedom, angle, &slope);
        rise = (WANTED - within) / slope;
    }
    return root * tan(angle);
}
