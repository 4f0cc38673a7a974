/* The plan of the DCM against its differential equation b xi' = xi - p, integrated step by step. */
#include "base/random.h"
#include "kit.h"
#include "paper/control/dcm.h"

static double point_at(const DcmSegment *s, int k, double t) {
    return s->from[k] + (s->to[k] - s->from[k]) * t / s->duration +
           s->sway[k] * cos(s->angle + s->rate * t);
}

/* Runge and Kutta's fourth order over one segment. */
static double integrate(const DcmSegment *s, int k, double b, double xi) {
    const int steps = 2000;
    const double h = s->duration / steps;
    for (int i = 0; i < steps; i++) {
        const double t = i * h;
        const double p0 = point_at(s, k, t), p1 = point_at(s, k, t + h / 2),
                     p2 = point_at(s, k, t + h);
        const double k1 = (xi - p0) / b, k2 = (xi + h / 2 * k1 - p1) / b;
        const double k3 = (xi + h / 2 * k2 - p1) / b, k4 = (xi + h * k3 - p2) / b;
        xi += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
    return xi;
}

/* From where the plan says, xi arrives at rest at the end of the last segment. Errors grow with
 * exp(t / b), here 2e4. */
TEST(plan_ends_at_rest) {
    const double b = 0.24;
    double worst = 0;
    for (uint32_t draw = 0; draw < 20; draw++) {
        enum { COUNT = 6 };
        Random r = random_at(7, draw, 0);
        DcmSegment segments[COUNT] = {0};
        double xi[3];
        for (int s = 0; s < COUNT; s++) {
            segments[s].duration = 0.3 + 0.2 * random_unit(&r);
            segments[s].angle = 3 * random_unit(&r);
            segments[s].rate = 9 * random_unit(&r);
            for (int k = 0; k < 3; k++) {
                segments[s].from[k] = s ? segments[s - 1].to[k] : random_unit(&r);
                segments[s].to[k] = random_unit(&r);
                segments[s].sway[k] = s + 1 < COUNT ? 0.1 * random_unit(&r) : 0;
            }
        }
        segments[2].duration = 0; /* is nothing; the next one begins where it does */
        dcm_plan(segments, COUNT, b, xi);
        for (int k = 0; k < 3; k++) {
            double at = xi[k];
            for (int s = 0; s < COUNT; s++) {
                at = s == 2 ? at : integrate(&segments[s], k, b, at);
            }
            worst = fmax(worst, fabs(at - segments[COUNT - 1].to[k]));
        }
        double point[3];
        dcm_point(&segments[0], point);
        assert_true(fabs(point[1] - point_at(&segments[0], 1, 0)) < 1e-15);
    }
    printf("end of the plan missed by %.1e m\n", worst);
    assert_true(worst < 1e-6);
}

/* Where p rests, so does xi; after a step of p it was there before by exp(-T / b). */
TEST(rest_and_step) {
    const double b = 0.25, step = 0.1, wait = 0.4;
    DcmSegment segments[2] = {{.duration = wait}, {.from = {step}, .to = {step}, .duration = 1}};
    double xi[3];
    dcm_plan(segments + 1, 1, b, xi);
    assert_true(xi[0] == step && xi[1] == 0);
    dcm_plan(segments, 2, b, xi);
    assert_true(fabs(xi[0] - step * exp(-wait / b)) < 1e-15);
}

TEST_MAIN(NULL, NULL)
