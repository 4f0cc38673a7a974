/* The speed hold: its legs against MuJoCo's, its speed against feet that are planted in the world,
 * its loop against a robot that walks too slowly. */
#include "base/random.h"
#include "control/speed_hold.h"
#include "env/task/gait.h"
#include "robots.h"

/* ---- the legs ---- */

static double angle_of(const Robot *robot, Random *r, int joint) {
    const double low = robot_joint_low(robot)[joint], high = robot_joint_high(robot)[joint];
    return low + (high - low) * random_unit(r);
}

TEST(feet_are_where_mujoco_has_them) {
    static const char *const names[] = {"sa01", "g1"};
    const RobotVariation nominal = robot_variation_nominal();
    for (size_t n = 0; n < sizeof names / sizeof *names; n++) {
        MildError error = {0};
        Robot *robot = kit_robot_named(names[n]);
        RobotSim *sim = robot_sim_create(robot, 0.005, &error);
        SpeedHoldLegs legs;
        Random r = random_at(1, (uint32_t)n, 0);
        assert_non_null(sim);
        expect_good(speed_hold_legs(robot, 0.1, &legs, &error) == MILD_OK, &error);
        const double fast = legs.flying * legs.flying;
        expect_near("Froude number", fast / (9.81 * robot_stand_height(robot)), 0.08, 1e-12);
        for (int trial = 0; trial < 50; trial++) {
            RobotState at = {.qpos = {0, 0, 0, 1}};
            double foot[ROBOT_FEET_MAX][3];
            for (int i = 0; i < robot_joints(robot); i++) {
                at.qpos[7 + i] = angle_of(robot, &r, i);
            }
            robot_sim_load(sim, &at, &nominal);
            speed_hold_feet(&legs, at.qpos + 7, foot);
            for (int f = 0; f < robot_feet(robot); f++) {
                for (int i = 0; i < 3; i++) {
                    expect_near("foot", foot[f][i], robot_sim_foot(sim, f)->sole_center[i], 1e-12);
                }
            }
        }
        robot_sim_destroy(sim);
        robot_destroy(robot);
    }
}

/* A leg of one hinge, whose anchor and zero are its own, on a hip that is turned by 90 degrees. */
TEST(hinges_have_anchors_and_zeros) {
    SpeedHoldLegs legs = {.joints = 1, .feet = 1, .links = {1}, .sole_center = {{0, 0, -1}}};
    const double q[1] = {0.7};
    double foot[1][3];
    legs.link[0][0] = (SpeedHoldLink){.axis = {0, 1, 0},
                                      .anchor = {0, 0, 0.5},
                                      .zero = 0.2,
                                      .place = {0.1, 0.2, 0.3},
                                      .turn = {0, -1, 0, 1, 0, 0, 0, 0, 1}};
    speed_hold_feet(&legs, q, foot);
    expect_near("x", foot[0][0], 0.1, 1e-15);
    expect_near("y", foot[0][1], 0.2 - 1.5 * sin(0.5), 1e-15);
    expect_near("z", foot[0][2], 0.3 + 0.5 - 1.5 * cos(0.5), 1e-15);
}

TEST(round_feet_are_left_alone) {
    MildError error = {0};
    SpeedHoldLegs legs;
    Robot *robot = kit_robot_named("go1");
    expect_good(speed_hold_legs(robot, 0.1, &legs, &error) == MILD_OK, &error);
    assert_true(legs.gain == 0);
    robot_destroy(robot);
}

/* ---- a walker of two straight legs ---- */

#define LENGTH 0.9 /* [m] of a leg */
#define WIDTH 0.1  /* [m] of a foothold from the middle */
enum { JOINTS = 4, FRAME = 11 + 3 * JOINTS };
#define HALF 40 /* policy steps of a stance */

/* Its feet are where they were put, and between that they swing. */
typedef struct {
    SpeedHoldLegs legs;
    SpeedHold hold;
    double factor;  /* [-] its speed over that of the command */
    double turning; /* [rad/s] */
    double pitch;   /* [rad] */
    double sway;    /* [rad] amplitude of the pitch, two periods a cycle; 0: it stays */
    double bias;    /* [rad/s] of the gyroscope, about y */
    int late;       /* steps by which a foot comes down and another lifts off after the clock */
    int both;       /* steps before and after that in which both feet stand; below 0, none */
    double noise;   /* [-] share of the sensors' noise in training */
    int free;       /* bool: nothing corrects its command */
    double at[2];   /* [m] world */
    double yaw;     /* [rad] */
    double foot[2][2], from[2][2]; /* [m] world: now, and at lift-off */
    double wanted[3], command[3];
    int step;
    Random random;
} Walker;

static SpeedHoldLegs straight_legs(double gain) {
    SpeedHoldLegs legs = {
        .gain = gain, .flying = 0.75, .joints = JOINTS, .feet = 2, .gait_offset = {0, 0.5}};
    for (int f = 0; f < 2; f++) {
        legs.links[f] = 2;
        legs.sole_center[f][2] = -LENGTH;
        for (int i = 0; i < 2; i++) {
            legs.link[f][i] =
                (SpeedHoldLink){.joint = 2 * f + i, .turn = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
            legs.link[f][i].axis[i == 0 ? 1 : 0] = 1; /* pitch at the foot's end, then roll */
        }
    }
    return legs;
}

static Walker walker_at(double wanted, double factor) {
    return (Walker){.legs = straight_legs(0.1),
                    .factor = factor,
                    .both = 4,
                    .wanted = {wanted},
                    .command = {wanted},
                    .random = random_at(7, 0, 0)};
}

static double some_noise(Walker *w, double bound) {
    return w->noise * bound * (2 * random_unit(&w->random) - 1);
}

/* Beside where the body is half a stance later: there the foot is put. */
static void next_place(const Walker *w, int foot, double place[2]) {
    const double time = 0.5 * HALF * TASK_PERIOD, left = foot == 0 ? WIDTH : -WIDTH;
    const double mean = w->yaw + 0.5 * w->turning * time, then = w->yaw + w->turning * time;
    const double *v = w->command;
    place[0] =
        w->at[0] + w->factor * time * (cos(mean) * v[0] - sin(mean) * v[1]) - sin(then) * left;
    place[1] =
        w->at[1] + w->factor * time * (sin(mean) * v[0] + cos(mean) * v[1]) + cos(then) * left;
}

/* A foot stands from `both` steps before its start, which is `late` after the clock's, to as many
 * after the other's. */
static void move_feet(Walker *w) {
    for (int f = 0; f < 2; f++) {
        const int since = (w->step - w->late + (f == 0 ? 0 : HALF) + 8 * HALF) % (2 * HALF);
        const int lifted = since - (HALF + w->both), swing = HALF - 2 * w->both;
        if (lifted == 0) {
            w->from[f][0] = w->foot[f][0];
            w->from[f][1] = w->foot[f][1];
        }
        if (lifted > 0 && lifted <= swing) {
            double to[2];
            next_place(w, f, to);
            for (int i = 0; i < 2; i++) {
                w->foot[f][i] = w->from[f][i] + (to[i] - w->from[f][i]) * lifted / swing;
            }
        }
    }
}

/* The joints' angles that put a foot where it is. */
static void reach(const Walker *w, const double foot[2], double *pitch, double *roll) {
    const double dx = foot[0] - w->at[0], dy = foot[1] - w->at[1];
    const double x = cos(w->yaw) * dx + sin(w->yaw) * dy, y = cos(w->yaw) * dy - sin(w->yaw) * dx;
    const double z = -sqrt(LENGTH * LENGTH - x * x - y * y);
    const double bx = cos(w->pitch) * x - sin(w->pitch) * z;
    *pitch = -asin(bx / LENGTH);
    *roll = asin(y / (LENGTH * cos(*pitch)));
}

static void make_frame(Walker *w, float *frame) {
    const double phase = (double)w->step / (2 * HALF);
    const double g[3] = {sin(w->pitch), 0, -cos(w->pitch)};
    memset(frame, 0, FRAME * sizeof *frame);
    frame[0] = (float)(-w->turning * g[0]);
    frame[1] = (float)(w->bias + w->sway * cos(2 * TASK_TWO_PI * phase) * 2 * TASK_TWO_PI /
                                     (2 * HALF * TASK_PERIOD));
    frame[2] = (float)(-w->turning * g[2]);
    for (int i = 0; i < 3; i++) {
        frame[6 + i] = (float)(g[i] + some_noise(w, 0.075));
    }
    for (int f = 0; f < 2; f++) {
        double pitch, roll;
        reach(w, w->foot[f], &pitch, &roll);
        frame[9 + 2 * f] = (float)(pitch + some_noise(w, 0.03));
        frame[10 + 2 * f] = (float)(roll + some_noise(w, 0.03));
    }
    frame[9 + 3 * JOINTS] = (float)sin(TASK_TWO_PI * phase);
    frame[10 + 3 * JOINTS] = (float)cos(TASK_TWO_PI * phase);
}

static void walk(Walker *w, int steps) {
    for (int k = 0; k < steps; k++) {
        float frame[FRAME];
        const double c = cos(w->yaw), s = sin(w->yaw);
        w->at[0] += TASK_PERIOD * w->factor * (c * w->command[0] - s * w->command[1]);
        w->at[1] += TASK_PERIOD * w->factor * (s * w->command[0] + c * w->command[1]);
        w->yaw += TASK_PERIOD * w->turning;
        w->step++;
        w->pitch = w->sway != 0 ? w->sway * sin(2 * TASK_TWO_PI * w->step / (2 * HALF)) : w->pitch;
        move_feet(w);
        make_frame(w, frame);
        memcpy(w->command, w->wanted, sizeof w->command);
        speed_hold(&w->hold, &w->legs, frame, w->command);
        if (w->free) {
            w->hold.ratio[0] = w->hold.ratio[1] = 0;
            memcpy(w->command, w->wanted, sizeof w->command);
        }
    }
}

/* [m/s] Of its way in the next `cycles` cycles. */
static double speed_over(Walker *w, int cycles) {
    const double from[2] = {w->at[0], w->at[1]};
    walk(w, 2 * HALF * cycles);
    return hypot(w->at[0] - from[0], w->at[1] - from[1]) / (2 * HALF * cycles * TASK_PERIOD);
}

TEST(speed_is_that_of_the_feet) {
    for (int late = -2; late <= 4; late += 2) {
        for (int back = 0; back < 2; back++) {
            Walker w = walker_at(back ? -0.4 : 0.4, 1);
            w.free = 1;
            w.late = late;
            w.pitch = 0.1 * late;
            walk(&w, 2 * HALF * 6);
            for (int cycle = 0; cycle < 20; cycle++) {
                walk(&w, 2 * HALF);
                expect_near("forward", w.hold.speed[0], w.wanted[0], 2e-3 * 0.4);
                expect_near("left", w.hold.speed[1], 0, 1e-6);
            }
        }
    }
}

/* For two steps no foot stands: v(c) has a top and no plateau. */
TEST(the_top_is_that_of_a_parabola) {
    for (int late = -1; late <= 3; late++) {
        Walker w = walker_at(0.8, 1);
        w.free = 1;
        w.both = -1;
        w.late = late;
        walk(&w, 2 * HALF * 12);
        expect_near("forward", w.hold.speed[0], 0.8, 0.005 * 0.8);
    }
}

/* What is down moves with the base: where only gravity told it, it would come 0.2 s late. */
TEST(a_base_that_sways_is_followed) {
    Walker w = walker_at(0.9, 1);
    w.free = 1;
    w.sway = 0.1;
    walk(&w, 2 * HALF * 12);
    expect_near("forward", w.hold.speed[0], 0.9, 0.003 * 0.9);
    expect_near("left", w.hold.speed[1], 0, 1e-3);
}

TEST(a_gyroscope_may_be_wrong) {
    Walker w = walker_at(0.9, 1);
    w.free = 1;
    w.bias = 0.05;
    walk(&w, 2 * HALF * 50);
    expect_near("forward", w.hold.speed[0], 0.9, 0.01 * 0.9);
}

TEST(a_slow_walk_comes_to_its_speed) {
    static const double factors[] = {0.85, 1, 1.15};
    for (int i = 0; i < 6; i++) {
        Walker w = walker_at(i % 2 ? -0.5 : 0.5, factors[i / 2]);
        walk(&w, 2 * HALF * 60);
        expect_near("speed", speed_over(&w, 4), 0.5, 0.005 * 0.5);
        expect_near("ratio", w.hold.ratio[0], 1 / factors[i / 2] - 1, 0.005);
    }
}

/* The factor is the same in each cycle; its weight grows. */
TEST(doubt_ends_after_a_few_cycles) {
    Walker w = walker_at(0.5, 0.9);
    while (w.hold.cycles == 0) {
        walk(&w, 1);
    }
    for (int n = 1; n <= 5; n++) {
        const double weight = n * n / (n * n + 16.0);
        expect_near("ratio", w.hold.ratio[0], 1 / (1 - 0.1 * weight) - 1, 0.004);
        assert_int_equal(w.hold.cycles, n);
        walk(&w, 2 * HALF);
    }
}

TEST(noise_leaves_the_speed_right) {
    static const double wanted[] = {0.4, 0.9};
    for (int i = 0; i < 2; i++) {
        Walker w = walker_at(wanted[i], 0.9);
        w.noise = 1;
        walk(&w, 2 * HALF * 10);
        expect_near("speed under noise", speed_over(&w, 100), wanted[i], 0.015 * wanted[i]);
    }
}

TEST(sideways_is_held_too) {
    Walker w = walker_at(0.3, 0.9);
    w.wanted[1] = w.command[1] = 0.2;
    walk(&w, 2 * HALF * 60);
    expect_near("ratio forward", w.hold.ratio[0], 1 / 0.9 - 1, 0.005);
    expect_near("ratio left", w.hold.ratio[1], 1 / 0.9 - 1, 0.005);
}

TEST(the_ratio_is_bounded) {
    Walker w = walker_at(0.3, 0.5);
    walk(&w, 2 * HALF * 30);
    expect_near("ratio", w.hold.ratio[0], 0.2, 0);
    expect_near("command", w.command[0], 0.36, 1e-12);
}

TEST(turning_changes_nothing) {
    for (int i = -1; i <= 1; i++) {
        Walker w = walker_at(0.4, 1);
        w.turning = i;
        w.free = 1;
        walk(&w, 2 * HALF * 10);
        expect_near("forward", w.hold.speed[0], 0.4, 0.01 * 0.4); /* the chord of an arc */
        expect_near("left", w.hold.speed[1], 0, 0.03 * 0.4);
    }
}

/* ---- when it learns nothing ---- */

TEST(fast_turns_teach_nothing) {
    Walker w = walker_at(0.4, 0.8);
    w.wanted[2] = 0.5;
    walk(&w, 2 * HALF * 10);
    assert_true(w.hold.ratio[0] == 0 && w.command[0] == 0.4);
    w.wanted[2] = -0.5;
    walk(&w, 2 * HALF * 3);
    assert_true(w.hold.ratio[0] == 0);
    w.wanted[2] = -0.3;
    walk(&w, 2 * HALF * 3);
    assert_true(w.hold.ratio[0] > 0);
}

TEST(another_command_must_settle) {
    Walker w = walker_at(0.4, 0.9);
    walk(&w, 2 * HALF * 10);
    const double learned = w.hold.ratio[0];
    assert_true(learned > 0.05);
    w.wanted[0] = 0.6;
    walk(&w, 2 * HALF * 2 - HALF / 2);
    assert_true(w.hold.ratio[0] == learned); /* kept */
    expect_near("command", w.command[0], 0.6 * (1 + learned), 1e-12);
    walk(&w, 2 * HALF * 2);
    assert_true(w.hold.ratio[0] != learned); /* from there */
    expect_near("ratio", w.hold.ratio[0], learned, 0.02);
}

/* A stick that moves by 0.2 m/s each second. */
TEST(a_slow_ramp_teaches_nothing) {
    Walker w = walker_at(0.2, 0.9);
    walk(&w, 2 * HALF * 10);
    const double learned = w.hold.ratio[0];
    for (int k = 0; k < 4 * 2 * HALF; k++) {
        w.wanted[0] += 0.002;
        walk(&w, 1);
    }
    assert_true(w.hold.ratio[0] == learned);
}

/* A standing robot's clock is (0, 0). */
TEST(standing_forgets) {
    Walker w = walker_at(0.4, 0.9);
    float frame[FRAME] = {0};
    double command[3] = {0, 0, 0.3};
    walk(&w, 2 * HALF * 10);
    speed_hold(&w.hold, &w.legs, frame, command);
    assert_true(w.hold.ratio[0] == 0 && w.hold.frames == 0);
    assert_true(command[0] == 0 && command[1] == 0 && command[2] == 0.3);
}

TEST(off_changes_nothing) {
    Walker w = walker_at(0.4, 0.7);
    MildError error = {0};
    SpeedHoldLegs legs;
    Robot *robot = kit_robot_named("sa01");
    expect_good(speed_hold_legs(robot, 0, &legs, &error) == MILD_OK, &error);
    assert_true(legs.gain == 0 && legs.feet == 0);
    w.legs = legs;
    walk(&w, 2 * HALF * 10);
    assert_true(w.command[0] == 0.4 && w.hold.ratio[0] == 0);
    robot_destroy(robot);
}

TEST_MAIN(NULL, NULL)
