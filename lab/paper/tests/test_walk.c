/* The walk's plan with feet and a centre of mass that follow it exactly: where the feet go, for how
 * long, and that the targets are each other's derivatives. */
#include "kit.h"
#include "paper/control/walk.h"

#define DT 0.0025

/* A robot that follows its command, and what was seen of it. */
typedef struct {
    WalkDef def;
    Walk walk;
    WalkState state;
    WalkTarget target, before;
    double time;
    double apex;    /* [m] highest point of a swing over its start */
    double nearest; /* [m] smallest lateral distance of the feet */
    double slip;    /* [m/s, m/s^2] largest error of velocity and acceleration */
    int touches;    /* steps */
} Ideal;

static Ideal ideal_start(int left) {
    Ideal ideal = {.def = walk_def_default(), .nearest = 1e9, .target.swing = -1};
    ideal.state.support[left][1] = 0.08;
    ideal.state.support[1 - left][1] = -0.08;
    ideal.state.dcm[2] = ideal.def.height;
    walk_start(&ideal.walk, &ideal.def, &ideal.state);
    return ideal;
}

/* The swing's targets by differences, within one swing whose foothold does not move. */
static void check_rates(Ideal *ideal) {
    const WalkTarget *now = &ideal->target, *old = &ideal->before;
    const int late = ideal->walk.time > ideal->walk.duration; /* it feels for the ground */
    if (now->swing < 0 || old->swing != now->swing || late) {
        return;
    }
    for (int k = 0; k < 3; k++) {
        const double v = (now->position[k] - old->position[k]) / DT;
        const double a = (now->velocity[k] - old->velocity[k]) / DT;
        const double v_mean = 0.5 * (now->velocity[k] + old->velocity[k]);
        const double a_mean = 0.5 * (now->acceleration[k] + old->acceleration[k]);
        ideal->slip = fmax(ideal->slip, fmax(fabs(v - v_mean), 0.1 * fabs(a - a_mean)));
    }
}

/* For a time or for a number of steps, whichever ends first. */
static void ideal_run(Ideal *ideal, double vx, double vy, double wz, double seconds, int steps) {
    const double command[3] = {vx, vy, wz};
    const int last = ideal->touches + steps;
    for (double t = 0; t < seconds && ideal->touches < last; t += DT) {
        const int swung = ideal->target.swing;
        WalkState *state = &ideal->state;
        walk_advance(&ideal->walk, &ideal->def, state, command, DT);
        walk_target(&ideal->walk, &ideal->def, state, &ideal->target);
        check_rates(ideal);
        const int swing = ideal->target.swing;
        memset(state->force, 0, sizeof state->force);
        if (swing >= 0) {
            memcpy(state->support[swing], ideal->target.position, sizeof state->support[swing]);
            state->yaw[swing] = ideal->target.yaw;
            ideal->apex = fmax(ideal->apex, state->support[swing][2]);
            state->force[swing] = ideal->walk.time >= ideal->walk.duration - DT / 2 ? 100 : 0;
        }
        ideal->touches += swung >= 0 && swing < 0;
        memcpy(state->dcm, ideal->target.dcm, sizeof state->dcm);
        const double *a = state->support[0], *b = state->support[1];
        const double heading = ideal->walk.heading;
        const double apart = cos(heading) * (a[1] - b[1]) - sin(heading) * (a[0] - b[0]);
        ideal->nearest = fmin(ideal->nearest, fabs(apart));
        ideal->before = ideal->target;
        ideal->time += DT;
    }
}

static void middle(const Ideal *ideal, double point[2]) {
    for (int k = 0; k < 2; k++) {
        point[k] = 0.5 * (ideal->state.support[0][k] + ideal->state.support[1][k]);
    }
}

/* Ten steps at the full command move the middle of the feet by ten steps. */
TEST(speeds) {
    static const double commands[][2] = {{0.6, 0}, {-0.4, 0}, {0, 0.2}, {0.3, -0.3}};
    for (int c = 0; c < 4; c++) {
        for (int left = 0; left < 2; left++) {
            Ideal ideal = ideal_start(left);
            const double T = ideal.def.step_time;
            double from[2], to[2];
            ideal_run(&ideal, commands[c][0], commands[c][1], 0, 20, 10);
            const int steps = ideal.touches;
            middle(&ideal, from);
            ideal_run(&ideal, commands[c][0], commands[c][1], 0, 20, 10);
            middle(&ideal, to);
            printf("left %d, command %.1f %.1f: %.3f %.3f m in %d steps, feet %.3f m apart, apex "
                   "%.3f m\n",
                   left, commands[c][0], commands[c][1], to[0] - from[0], to[1] - from[1],
                   ideal.touches - steps, ideal.nearest, ideal.apex);
            assert_int_equal(ideal.touches, steps + 10);
            assert_true(fabs(to[0] - from[0] - 10 * T * commands[c][0]) < 0.01);
            assert_true(fabs(to[1] - from[1] - 10 * T * commands[c][1]) < 0.01);
            assert_true(ideal.nearest > ideal.def.width_least - 2e-3);
            assert_true(fabs(ideal.apex - ideal.def.clearance) < 1e-3);
            assert_true((ideal.state.support[left][1] > ideal.state.support[1 - left][1]));
        }
    }
}

/* Feet and base turn with the command. */
TEST(turns) {
    Ideal ideal = ideal_start(0);
    ideal_run(&ideal, 0.2, 0, 0.5, 20, 10);
    const double from = ideal.walk.heading;
    ideal_run(&ideal, 0.2, 0, 0.5, 20, 10);
    const double turned = ideal.walk.heading - from;
    assert_true(fabs(turned - 0.5 * 10 * ideal.def.step_time) < 1e-9);
    for (int f = 0; f < WALK_FEET; f++) {
        const double behind = remainder(ideal.walk.heading - ideal.state.yaw[f], 6.283185307179586);
        assert_true(fabs(behind) < 2 * 0.5 * ideal.def.step_time);
    }
}

/* Out of a stand and back: the last steps bring the feet side by side, and p goes between them. */
TEST(stops) {
    Ideal ideal = ideal_start(0);
    double point[2];
    ideal_run(&ideal, 0, 0, 0, 2, 99);
    assert_true(ideal.walk.phase == WALK_STAND && ideal.touches == 0);
    ideal_run(&ideal, 0.5, 0, 0, 4, 99);
    assert_true(ideal.walk.phase != WALK_STAND && ideal.touches >= 6);
    ideal_run(&ideal, 0, 0, 0, 6, 99);
    assert_true(ideal.walk.phase == WALK_STAND);
    assert_true(fabs(ideal.state.support[0][0] - ideal.state.support[1][0]) < 0.02);
    middle(&ideal, point);
    assert_true(fabs(ideal.target.point[0] - point[0]) < 1e-3);
    assert_true(fabs(ideal.target.point[1] - point[1]) < 1e-3);
    assert_true(ideal.target.still && ideal.target.swing < 0);
}

/* The targets of a swing are each other's derivatives, to the order of the differences. */
TEST(rates) {
    Ideal ideal = ideal_start(0);
    ideal.def.acceleration = 1e9; /* a command that changes moves the foothold */
    ideal_run(&ideal, 0.6, 0.1, 0, 4, 99);
    printf("rates off by %.1e\n", ideal.slip);
    assert_true(ideal.slip < 0.05);
}

TEST_MAIN(NULL, NULL)
