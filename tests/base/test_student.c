/* Student's t against an integral of the density that shares no formula with it. */
#include "base/student.h"
#include "kit.h"

/* The density integrated by Simpson's rule from 0 to t, over that from 0 to infinity: 0.95. With
 * t = sqrt(n) tan(a) the density is cos(a)^(n-1), up to a constant. */
static double power_integral(int power, double end) {
    enum { STEPS = 20000 };
    double sum = 0;
    for (int i = 0; i <= STEPS; i++) {
        double weight = i == 0 || i == STEPS ? 1 : i % 2 ? 4 : 2;
        sum += weight * pow(cos(end * i / STEPS), power);
    }
    return sum * end / (3 * STEPS);
}

TEST(share_of_the_density) {
    double worst = 0;
    for (int n = 1; n <= 200; n += n < 20 ? 1 : 17) {
        double angle = atan(student_95(n) / sqrt(n));
        double share = power_integral(n - 1, angle) / power_integral(n - 1, acos(-1.0) / 2);
        worst = fmax(worst, fabs(share - 0.95));
    }
    print_message("probability within the 95 %% points, by quadrature: worst %.1e\n", worst);
    assert_true(worst < 1e-12);
}

TEST(no_freedom) {
    assert_true(isnan(student_95(0)));
    assert_true(isnan(student_95(-3)));
}

TEST_MAIN(NULL, NULL)
