/* The speed hold: its loop against a robot that walks too slowly by a factor, whose estimate sways
 * with the gait and is noisy. */
#include "base/random.h"
#include "control/controller.h"
#include "robots.h"

enum { CYCLE = 80, CLOCK = 45, FRAME = 48 };

typedef struct {
    SpeedHoldDef def;
    SpeedHold hold;
    double factor;      /* speed over command, of both directions */
    double turned;      /* the same of turning */
    double sway, noise; /* [m/s] of the estimate */
    double pull, speed; /* [m/s^2] of speeding up, 0: it has its speed at once; [m/s] forward */
    double wanted[3], command[3];
    int step, stands; /* steps so far; at first, in which its clock stands */
    Random random;
} Walker;

static Walker walker_at(double wanted, double factor) {
    return (Walker){.def = {.gain = 0.1, .scale = 4, .clock = CLOCK},
                    .factor = factor,
                    .turned = 0.8,
                    .wanted = {wanted},
                    .command = {wanted},
                    .random = random_at(7, 0, 0)};
}

static void walk(Walker *w, int steps) {
    for (int k = 0; k < steps; k++) {
        const double phase = 6.283185307179586 * w->step / CYCLE;
        float frame[FRAME] = {0}, estimates[3] = {0};
        frame[CLOCK] = w->step < w->stands ? 0 : (float)sin(phase);
        frame[CLOCK + 1] = w->step < w->stands ? 0 : (float)cos(phase);
        for (int i = 0; i < 2; i++) {
            double own = w->factor * w->command[i];
            if (i == 0 && w->pull > 0) {
                const double most = w->pull * TASK_PERIOD;
                own = w->speed += fmax(fmin(own - w->speed, most), -most);
            }
            const double v =
                own + w->sway * sin(2 * phase) + w->noise * (2 * random_unit(&w->random) - 1);
            estimates[i] = (float)(w->def.scale * v);
        }
        frame[2] = (float)(w->turned * w->command[2] + w->sway * sin(phase));
        memcpy(w->command, w->wanted, sizeof w->command);
        speed_hold(&w->hold, &w->def, frame, estimates, w->command);
        w->step++;
    }
}

TEST(a_slow_walk_comes_to_its_speed) {
    static const double factors[] = {0.85, 1, 1.15};
    for (int i = 0; i < 6; i++) {
        Walker w = walker_at(i % 2 ? -0.5 : 0.5, factors[i / 2]);
        w.sway = 0.1;
        w.noise = 0.1;
        walk(&w, CYCLE * 60);
        expect_near("ratio", w.hold.ratio[0], 1 / factors[i / 2] - 1, 0.01);
        expect_near("speed", w.factor * w.command[0], w.wanted[0], 0.01 * 0.5);
        expect_near("yaw", w.command[2], 0, 0);
    }
}

/* The factor is the same in each cycle; its weight grows. */
TEST(doubt_ends_after_a_few_cycles) {
    Walker w = walker_at(0.5, 0.9);
    while (w.hold.cycles[SPEED_HOLD_LINEAR] == 0) {
        walk(&w, 1);
    }
    for (int n = 1; n <= 5; n++) {
        const double weight = n * n / (n * n + 1.0);
        expect_near("ratio", w.hold.ratio[0], 1 / (1 - 0.1 * weight) - 1, 0.002);
        assert_int_equal(w.hold.cycles[SPEED_HOLD_LINEAR], n);
        walk(&w, CYCLE);
    }
}

TEST(sideways_is_held_too) {
    Walker w = walker_at(0.3, 0.9);
    w.wanted[1] = w.command[1] = 0.2;
    walk(&w, CYCLE * 60);
    expect_near("ratio forward", w.hold.ratio[0], 1 / 0.9 - 1, 1e-3);
    expect_near("ratio left", w.hold.ratio[1], 1 / 0.9 - 1, 1e-3);
}

TEST(a_turn_is_held_by_the_gyro) {
    Walker w = walker_at(0.4, 0.9);
    w.wanted[1] = w.command[1] = 0.2;
    w.wanted[2] = w.command[2] = -0.8;
    w.sway = 0.3;
    walk(&w, CYCLE * 60);
    expect_near("turn", w.turned * w.command[2], -0.8, 0.01);
    assert_true(w.command[0] == 0.4 && w.command[1] == 0.2); /* it turns fast */
    w.turned = 0.6;
    walk(&w, CYCLE * 60);
    expect_near("bound", w.command[2], -0.8 * 1.4, 1e-12);
}

/* Who holds a heading turns otherwise in each step: no turn is learned, and the way is. */
TEST(steering_disturbs_no_speed) {
    Walker w = walker_at(0.4, 0.9);
    for (int k = 0; k < 20 * CYCLE; k++) {
        w.wanted[2] = 0.3 * sin(0.2 * k);
        walk(&w, 1);
    }
    expect_near("speed", w.factor * w.command[0], 0.4, 1e-3);
    assert_true(w.hold.ratio[2] == 0);
}

TEST(the_ratio_is_bounded) {
    Walker w = walker_at(0.3, 0.5);
    walk(&w, CYCLE * 30);
    expect_near("ratio", w.hold.ratio[0], 0.2, 0);
    expect_near("command", w.command[0], 0.36, 1e-12);
}

/* ---- when it learns nothing ---- */

TEST(fast_turns_teach_nothing) {
    Walker w = walker_at(0.4, 0.8);
    w.wanted[2] = 0.5;
    walk(&w, CYCLE * 10);
    assert_true(w.hold.ratio[0] == 0 && w.command[0] == 0.4);
    w.wanted[2] = -0.5;
    walk(&w, CYCLE * 3);
    assert_true(w.hold.ratio[0] == 0);
    w.wanted[2] = -0.3;
    walk(&w, CYCLE * 3);
    assert_true(w.hold.ratio[0] > 0);
}

TEST(another_command_must_settle) {
    Walker w = walker_at(0.4, 0.9);
    walk(&w, CYCLE * 10 + 2);
    const double learned = w.hold.ratio[0];
    assert_true(learned > 0.05);
    w.wanted[0] = 0.6;
    w.factor = 0.95;
    walk(&w, 2 * CYCLE + CYCLE / 2);
    assert_true(w.hold.ratio[0] == learned); /* kept */
    expect_near("command", w.command[0], 0.6 * (1 + learned), 1e-12);
    walk(&w, CYCLE);
    assert_true(w.hold.ratio[0] < learned); /* from there */
    walk(&w, CYCLE * 20);
    expect_near("ratio", w.hold.ratio[0], 1 / 0.95 - 1, 1e-3);
}

/* A run comes to 3 m/s in 2.5 s. Of those it must learn nothing, or it would command up to a fifth
 * more, and unlearn that in ten seconds. */
TEST(speeding_up_teaches_nothing) {
    for (int start = 0; start < 3; start++) { /* at once, in a second, while its clock stands */
        Walker w = walker_at(start == 1 ? 0 : 3, 0.97);
        w.stands = start == 2 ? 5 : 0;
        w.pull = 1.2;
        for (int k = 0; k < 20 * CYCLE; k++) {
            w.wanted[0] = fmin(3, w.wanted[0] + 0.03);
            walk(&w, 1);
            assert_true(w.hold.ratio[0] < 1 / 0.97 - 1 + 1e-3);
            assert_true(w.hold.ratio[0] == 0 || w.speed > 0.99 * 0.97 * 3);
        }
        expect_near("speed", w.speed, 3, 0.01);
        w.wanted[0] = -1; /* and it brakes for long */
        const double learned = w.hold.ratio[0];
        while (w.speed > -0.97) {
            walk(&w, 1);
            assert_true(w.hold.ratio[0] == learned);
        }
    }
}

/* Nor does a command that never rests, but not for long after it. */
TEST(restless_commands_are_forgotten) {
    Walker w = walker_at(0.5, 0.9);
    for (int k = 0; k < 6000; k++) {
        w.wanted[0] = 0.5 + 0.02 * (k % 2);
        walk(&w, 1);
        assert_true(w.hold.ratio[0] == 0);
    }
    walk(&w, 600 + 20 * CYCLE);
    expect_near("speed", 0.9 * w.command[0], w.wanted[0], 0.01);
}

/* A policy may stop where it never was in training: it is commanded there by who wants it alone. */
TEST(a_fast_command_is_bounded) {
    Walker w = walker_at(3.5, 0.9);
    w.def.most = 3.6;
    walk(&w, CYCLE * 20);
    expect_near("bound", w.command[0], 3.6, 1e-12);
    w.wanted[0] = 3.8;
    walk(&w, CYCLE * 20);
    expect_near("wanted", w.command[0], 3.8, 1e-12);
    w.wanted[0] = -0.5;
    w.wanted[1] = 0.2;
    walk(&w, CYCLE * 40);
    expect_near("back", w.command[0], -0.5 / 0.9, 0.005);
    expect_near("left", w.command[1], 0.2 / 0.9, 0.002);
}

/* A stick that moves by 0.2 m/s each second. */
TEST(a_slow_ramp_teaches_nothing) {
    Walker w = walker_at(0.2, 0.9);
    walk(&w, CYCLE * 10 + 2);
    const double learned = w.hold.ratio[0];
    for (int k = 0; k < 4 * CYCLE; k++) {
        w.wanted[0] += 0.002;
        walk(&w, 1);
    }
    assert_true(w.hold.ratio[0] == learned);
}

/* A standing robot's clock is (0, 0). */
TEST(standing_forgets) {
    Walker w = walker_at(0.4, 0.9);
    float frame[FRAME] = {0}, estimates[3] = {0};
    double command[3] = {0, 0, 0.3};
    walk(&w, CYCLE * 10);
    assert_true(w.hold.ratio[0] != 0);
    speed_hold(&w.hold, &w.def, frame, estimates, command);
    assert_true(w.hold.ratio[0] == 0 && w.hold.cycles[SPEED_HOLD_LINEAR] == 0);
    assert_true(command[0] == 0 && command[1] == 0 && command[2] == 0.3);
}

/* The clock and the scale of a robot; a controller that estimates nothing holds no speed. */
TEST(its_numbers_are_the_tasks) {
    TaskDef task = task_def_default();
    const Controller blind = {.name = "blind"};
    MildError error = {0};
    Robot *robot = kit_robot_named("sa01");
    Controller seeing;
    const char *file = MILD_SOURCE_DIR "/policies/mild.safetensors";
    expect_good(controller_learned(file, robot, NULL, 1, &seeing, &error) == MILD_OK, &error);
    task.speed_hold = 0.1;
    task.speed_hold_most = 3.6;
    task.velocity_scale = 3;
    const SpeedHoldDef def = speed_hold_def(&task, robot, &seeing);
    assert_true(def.gain == 0.1 && def.scale == 3 && def.most == 3.6);
    assert_int_equal(def.clock, task_shape(&task, robot).observation - 2);
    assert_true(speed_hold_def(&task, robot, &blind).gain == 0);
    Walker w = walker_at(0.4, 0.7);
    w.def.gain = 0;
    walk(&w, CYCLE * 10);
    assert_true(w.command[0] == 0.4 && w.hold.ratio[0] == 0);
    controller_destroy(&seeing);
    robot_destroy(robot);
}

TEST_MAIN(NULL, NULL)
