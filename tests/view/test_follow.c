/* The camera's filter: by time and not by frames, and not behind what moves evenly. */
#include "kit.h"
#include "view/follow.h"

#define LAG 0.4
#define SPEED 0.6

/* Where the camera looks along x after `seconds` behind a target that starts to move at once. */
static double followed(double seconds, double rate) {
    Follow follow;
    double target[3] = {1, 2, 3}, look[3];
    follow_jump(&follow, target);
    int frames = (int)lround(seconds * rate);
    for (int k = 1; k <= frames; k++) {
        target[0] = 1 + SPEED * k / rate;
        follow_step(&follow, target, 1 / rate, LAG);
    }
    follow_position(&follow, look);
    assert_true(look[1] == 2 && look[2] == 3);
    return look[0] - 1;
}

/* The response of (1 + 2 T s)/(1 + T s)^2 to the ramp v t: v t (1 - exp(-t/T)), by hand. Five
 * frames a second give what hundred give, up to the path within a frame of the filter's own output.
 */
TEST(same_at_any_frame_rate) {
    double worst = 0, seconds[] = {0.4, 1, 2, 5};
    for (int k = 0; k < 4; k++) {
        double t = seconds[k], wanted = SPEED * t * (1 - exp(-t / LAG));
        worst = fmax(worst, fabs(followed(t, 100) - wanted));
        worst = fmax(worst, 0.1 * fabs(followed(t, 5) - wanted));
    }
    print_message("camera off by %.2f mm\n", 1e3 * worst);
    assert_true(worst < 1e-3);
}

TEST(no_time_no_motion) {
    Follow follow;
    double look[3];
    follow_jump(&follow, (const double[3]){1, 1, 1});
    follow_step(&follow, (const double[3]){9, 9, 9}, 0, LAG);
    follow_position(&follow, look);
    assert_true(look[0] == 1 && look[1] == 1 && look[2] == 1);
}

TEST_MAIN(NULL, NULL)
