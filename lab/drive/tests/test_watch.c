/* Sensors that disagree damp the robot before it falls; those of ordinary walks do not. Prints the
 * tables of lab/drive/README.md, section 2. */
#include "walk_kit.h"

enum { SETTLED = 3 }; /* [s] of a walk before its sensor lies */

/* ---- faults ---- */

static void nothing(Walk *w, StatePacket *s, double since) {
    (void)w, (void)s, (void)since;
}

static void repeat_imu(Walk *w, StatePacket *s, double since) {
    (void)since;
    memcpy(s->quaternion, w->held.quaternion, sizeof s->quaternion);
    memcpy(s->angular_velocity, w->held.angular_velocity, sizeof s->angular_velocity);
}

static void repeat_all(Walk *w, StatePacket *s, double since) {
    repeat_imu(w, s, since);
    memcpy(s->angle, w->held.angle, sizeof s->angle);
    memcpy(s->speed, w->held.speed, sizeof s->speed);
}

static void repeat_joint(Walk *w, StatePacket *s, double since) {
    (void)since;
    s->angle[w->def.part] = w->held.angle[w->def.part];
    s->speed[w->def.part] = w->held.speed[w->def.part];
}

static void repeat_angle(Walk *w, StatePacket *s, double since) {
    (void)since;
    s->angle[w->def.part] = w->held.angle[w->def.part];
}

static void bias_gyro(Walk *w, StatePacket *s, double since) {
    (void)since;
    s->angular_velocity[w->def.part] += (float)w->def.size;
}

static void lean(Walk *w, StatePacket *s, double since) {
    double tip[3] = {0, 0, 0};
    tip[w->def.part] = w->def.size * since;
    walk_tip(s->quaternion, tip);
}

static void lean_with_gyro(Walk *w, StatePacket *s, double since) {
    lean(w, s, since);
    bias_gyro(w, s, since);
}

static void drift(Walk *w, StatePacket *s, double since) {
    s->angle[w->def.part] += (float)(w->def.size * since);
}

static void exchange_legs(Walk *w, StatePacket *s, double since) {
    (void)since;
    const int left = w->def.part, right = left + robot_joints(w->robot) / 2;
    const float angle = s->angle[left], speed = s->speed[left];
    s->angle[left] = s->angle[right];
    s->speed[left] = s->speed[right];
    s->angle[right] = angle;
    s->speed[right] = speed;
}

typedef struct {
    const char *name;
    WalkFault *fault;
    int part;
    double size;
    double within;   /* [s] noticed, upright; 0: not, or too late to rely on */
    const char *why; /* of it */
} Lie;

static const Lie lies[] = {
    {"nothing", nothing, 0, 0, 0, NULL},
    {"all numbers repeat", repeat_all, 0, 0, 0.15, "the IMU repeated"},
    {"the IMU repeats", repeat_imu, 0, 0, 0.15, "the IMU repeated"},
    {"roll gyro + 0.5 rad/s", bias_gyro, 0, 0.5, 0.3, "the gyro denies"},
    {"pitch gyro + 0.5 rad/s", bias_gyro, 1, 0.5, 0.3, "the gyro denies"},
    {"yaw gyro + 0.5 rad/s", bias_gyro, 2, 0.5, 0.3, "the gyro denies"},
    {"quaternion rolls, 0.05 rad/s", lean, 0, 0.05, 2, "the gyro denies"},
    {"quaternion pitches, 0.05 rad/s", lean, 1, 0.05, 2, "the gyro denies"},
    {"quaternion pitches, -0.05 rad/s", lean, 1, -0.05, 2, "the gyro denies"},
    {"hip roll drifts, 0.2 rad/s", drift, 0, 0.2, 2, "its speed denies"},
    {"hip pitch drifts, 0.2 rad/s", drift, 2, 0.2, 2, "its speed denies"},
    {"hip pitch drifts, -0.2 rad/s", drift, 2, -0.2, 0, NULL} /* just before it falls */,
    {"hip pitch stuck", repeat_joint, 2, 0, 0.2, "leg_l3_joint repeated"},
    {"hip pitch stuck, speed true", repeat_angle, 2, 0, 0.2, "leg_l3_joint repeated"},
    {"knee stuck", repeat_joint, 3, 0, 0.2, "leg_l4_joint repeated"},
    {"hip roll stuck", repeat_joint, 0, 0, 0.3, "leg_l1_joint repeated"},
    {"knee drifts, 0.05 rad/s", drift, 3, 0.05, 0, NULL},
    {"IMU pitches, gyro too, 0.05 rad/s", lean_with_gyro, 1, 0.05, 0, NULL},
    {"hip rolls exchanged", exchange_legs, 0, 0, 0, NULL},
};
enum { LIES = sizeof lies / sizeof *lies };

static RunnerDef limits_of(int noisy) {
    return (RunnerDef){.late = 0.02,
                       .damp_after = 0.1,
                       .stall_after = 0.05,
                       .glitch = 0.02,
                       .turn_limit = 10,
                       .speed_limit = noisy ? 100 : 30, /* noise alone has 3.8 rad/s */
                       .angle_limit = 0.5,
                       .torque_share = 1};
}

TEST(a_sensor_that_lies) {
    const RunnerDef limits = limits_of(0);
    print_message("%-34s%12s%16s%12s  %s\n", "", "noticed [s]", "speed [rad/s]", "tilt [rad]",
                  "what was said");
    for (int i = 0; i < LIES; i++) {
        const Lie *lie = &lies[i];
        const WalkDef def = {.robot = "sa01",
                             .config = "walk",
                             .ground = "rigid",
                             .command = {0.5, 0, 0},
                             .seconds = SETTLED + 12,
                             .seed = 1,
                             .fault = lie->fault,
                             .size = lie->size,
                             .part = lie->part,
                             .begins = SETTLED};
        Walk *w = walk_make(&def, &limits);
        while (walk_step(w)) {
        }
        print_message("%-34s%12.2f%16.1f%12.2f  %s\n", lie->name, w->damped, w->speed, w->tilt,
                      w->why[0]      ? w->why
                      : w->fell >= 0 ? "fell"
                                     : "walks");
        if (lie->within > 0) {
            assert_true(w->damped > 0 && w->damped <= lie->within && w->tilt < 0.4);
            assert_non_null(strstr(w->why, lie->why));
        } else {
            assert_true(lie->fault != nothing || (w->damped < 0 && w->fell < 0));
        }
        walk_free(w);
    }
}

/* ---- walks ---- */

typedef struct {
    double share[WATCH_CHECKS], seconds;
    int damped, fell;
} Walks;

static void walk_all(const char *robot, const char *config, int noisy, double seconds, Walks *all) {
    static const struct {
        const char *ground;
        double slope, command[3];
    } ways[] = {{"rigid", 0, {0.5, 0, 0}},        {"rigid", 0.1, {0.8, 0, 0.8}},
                {"foam25", 0, {0.9, 0, 0}},       {"foam25", -0.1, {-0.5, 0, -1}},
                {"sand_loose", 0, {0.5, 0.2, 0}}, {"sand_loose", 0.1, {0.4, 0, 0}},
                {"sand_loose", 0, {0, 0, 0}}};
    const RunnerDef limits = limits_of(noisy);
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        const WalkDef def = {
            .robot = robot,
            .config = config,
            .ground = ways[i].ground,
            .slope = ways[i].slope,
            .command = {ways[i].command[0], ways[i].command[1], ways[i].command[2]},
            .push = 1,
            .noisy = noisy,
            .seconds = seconds,
            .seed = 1 + i};
        Walk *w = walk_make(&def, &limits);
        while (walk_step(w)) {
        }
        const double *share = runner_report(w->runner)->watch.share;
        for (int c = 0; c < WATCH_CHECKS; c++) {
            all->share[c] = fmax(all->share[c], share[c]);
        }
        if (w->damped >= 0 || w->fell >= 0) {
            print_message("%s on %s after %.2f s: %s\n", robot, ways[i].ground,
                          TASK_PERIOD * w->tick, w->why[0] ? w->why : "fell");
        }
        all->damped += w->damped >= 0 && w->tilt < 0.8;
        all->fell += w->fell >= 0 || w->tilt >= 0.8;
        all->seconds += TASK_PERIOD * w->tick;
        walk_free(w);
    }
}

/* MILD_WALK_SECONDS: of each of the 42 walks. A bound is at least twice what they show. */
TEST(a_walk_is_never_damped) {
    static const char *const robots[3][2] = {{"sa01", "walk"}, {"g1", "g1"}, {"go1", "go1"}};
    const char *given = getenv("MILD_WALK_SECONDS");
    const double seconds = given ? atof(given) : 5;
    for (int noisy = 0; noisy < 2; noisy++) {
        for (int i = 0; i < 3; i++) {
            Walks all = {.seconds = 0};
            walk_all(robots[i][0], robots[i][1], noisy, seconds, &all);
            print_message("%-5s%s: of the bounds %.2f repeat, %.2f turn, %.2f angle; %.0f s, %d "
                          "damped, %d fell\n",
                          robots[i][0], noisy ? ", noise" : "", all.share[WATCH_REPEAT],
                          all.share[WATCH_TURN], all.share[WATCH_ANGLE], all.seconds, all.damped,
                          all.fell);
            for (int c = 0; c < WATCH_CHECKS; c++) {
                assert_true(all.share[c] < 0.5);
            }
            assert_int_equal(all.damped, 0);
        }
    }
}

TEST_MAIN(NULL, NULL)
