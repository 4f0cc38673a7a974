/* Student's t: printed tables, and an integral of the density that shares no formula with it. */
#include "base/student.h"
#include "kit.h"

/* Two sided, 95 % (e.g. Abramowitz and Stegun, table 26.10). */
TEST(printed_tables) {
    static const struct {
        int freedom;
        double t;
    } table[] = {{1, 12.7062},      {2, 4.3027},   {3, 3.1824},   {4, 2.7764},   {5, 2.5706},
                 {6, 2.4469},       {7, 2.3646},   {8, 2.3060},   {9, 2.2622},   {10, 2.2281},
                 {15, 2.1314},      {20, 2.0860},  {25, 2.0595},  {30, 2.0423},  {40, 2.0211},
                 {60, 2.0003},      {100, 1.9840}, {120, 1.9799}, {500, 1.9647}, {1000, 1.9623},
                 {10000000, 1.9600}};
    double worst = 0;
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        worst = fmax(worst, fabs(student_95(table[i].freedom) - table[i].t));
    }
    print_message("95 %% points against printed tables: worst %.1e\n", worst);
    assert_true(worst < 1e-4);
}

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
