/* Sensors that disagree damp the robot before it falls; those of ordinary walks do not. Prints the
 * tables of lab/drive/README.md, section 2. */
#include "base/random.h"
#include "drive/runner.h"
#include "kit.h"
#include "run/config/experiment_keys.h"
#include "run/eval/scene.h"

/* ---- a robot that walks in MuJoCo under a runner, packet by packet, in its own time: with noise
 * and latencies of training, with pushes, and with a sensor that lies from some time on ---- */

#define PUSH_EVERY 4.0 /* [s] */
#define TIP                                                                                        \
    0.02 /* [rad] noise of the quaternion: that of training's gravity is refused as a glitch */

typedef struct Walk Walk;
/* Changes a state that the robot sends, `since` [s] after the fault has begun. */
typedef void WalkFault(Walk *walk, StatePacket *state, double since);

typedef struct {
    const char *robot, *config, *ground;
    double slope;      /* [-] */
    double push;       /* [m/s] in a random direction, every PUSH_EVERY */
    int noisy;         /* bool: sensors and latencies of training */
    int coarse;        /* bool: sensors of few bits */
    double command[3]; /* [m/s, m/s, rad/s] */
    double seconds;
    uint64_t seed;
    WalkFault *fault; /* NULL: none */
    double size;      /* of the fault */
    int part;         /* of the fault: an axis or a joint */
    double begins;    /* [s] the fault */
} WalkDef;

enum { WALK_LAG = 3 }; /* readings that are kept */

struct Walk {
    WalkDef def;
    Robot *robot;
    TaskDef task;
    MildMap *map;
    TaskEnv *env;
    RobotSim *sim;
    Runner *runner;
    StatePacket read[WALK_LAG]; /* at the last physics steps, newest first */
    StatePacket held;           /* when the fault began */
    int lag_command, lag_motor, lag_imu;
    TargetPacket target[2]; /* now, and before */
    uint32_t tick;
    /* what came of it */
    double fell;   /* [s] of the fault's time when it had fallen; negative: it has not */
    double damped; /* [s] when it was damped; negative: it was not */
    double speed;  /* [rad/s] the fastest joint since the fault, before it was damped */
    double tilt;   /* [rad] at the end */
    char why[240]; /* it was damped */
};

static inline StatePacket walk_read(const Walk *w) {
    const double *qpos = robot_sim_qpos(w->sim), *qvel = robot_sim_qvel(w->sim);
    StatePacket state = {.mode = PACKET_walk};
    for (int i = 0; i < 4; i++) {
        state.quaternion[i] = (float)qpos[3 + i];
    }
    for (int i = 0; i < 3; i++) {
        state.angular_velocity[i] = (float)qvel[3 + i];
    }
    for (int i = 0; i < robot_joints(w->robot); i++) {
        state.angle[i] = (float)qpos[7 + i];
        state.speed[i] = (float)qvel[6 + i];
    }
    return state;
}

/* q times a small rotation in the base. */
static inline void walk_tip(float q[4], const double by[3]) {
    const double v[3] = {by[0] / 2, by[1] / 2, by[2] / 2}, w = (double)q[0], x = (double)q[1],
                 y = (double)q[2], z = (double)q[3];
    const double n = 1 / sqrt(1 + v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    q[0] = (float)(n * (w - x * v[0] - y * v[1] - z * v[2]));
    q[1] = (float)(n * (x + w * v[0] + y * v[2] - z * v[1]));
    q[2] = (float)(n * (y + w * v[1] + z * v[0] - x * v[2]));
    q[3] = (float)(n * (z + w * v[2] + x * v[1] - y * v[0]));
}

static inline double walk_noise(Random *r, double most) {
    return most * (2 * random_unit(r) - 1);
}

/* To steps of 14 bits a turn, of 16 bits of 35 rad/s, and what such an encoder makes of speeds. */
static inline void walk_round(StatePacket *state, int joints) {
    for (int i = 0; i < 4; i++) {
        state->quaternion[i] = 1e-4f * roundf(1e4f * state->quaternion[i]);
    }
    for (int i = 0; i < 3; i++) {
        state->angular_velocity[i] = 1e-3f * roundf(1e3f * state->angular_velocity[i]);
    }
    for (int i = 0; i < joints; i++) {
        state->angle[i] = 4e-4f * roundf(2500 * state->angle[i]);
        state->speed[i] = 0.04f * roundf(25 * state->speed[i]);
    }
}

static inline StatePacket walk_state(Walk *w) {
    const TaskDef *t = &w->task;
    StatePacket state = w->read[w->lag_motor];
    memcpy(state.quaternion, w->read[w->lag_imu].quaternion, sizeof state.quaternion);
    memcpy(state.angular_velocity, w->read[w->lag_imu].angular_velocity,
           sizeof state.angular_velocity);
    Random r = random_at(w->def.seed, 77, w->tick);
    if (w->def.noisy) {
        const double tip[3] = {walk_noise(&r, TIP), walk_noise(&r, TIP), walk_noise(&r, TIP)};
        walk_tip(state.quaternion, tip);
        for (int i = 0; i < 3; i++) {
            state.angular_velocity[i] += (float)walk_noise(&r, t->noise_omega);
        }
        for (int i = 0; i < robot_joints(w->robot); i++) {
            state.angle[i] += (float)walk_noise(&r, t->noise_q);
            state.speed[i] += (float)walk_noise(&r, 20 * t->noise_qd);
        }
    }
    if (w->def.coarse) {
        walk_round(&state, robot_joints(w->robot));
    }
    const double time = TASK_PERIOD * w->tick, since = time - w->def.begins;
    if (since < TASK_PERIOD / 2) {
        w->held = state;
    } else if (w->def.fault) {
        w->def.fault(w, &state, since);
    }
    state.sequence = ++w->tick;
    state.time = (uint64_t)llround(1e6 * (100 + time));
    state.session = 2;
    state.peer = 1;
    return state;
}

static inline Walk *walk_make(const WalkDef *def, const RunnerDef *runner) {
    MildError error = {0};
    const EnvsView none = {0};
    char named[TRAIN_ROBOT_SIZE], policy[512], config[512];
    Walk *w = calloc(1, sizeof *w);
    RunnerDef own = *runner;
    Scene scene;
    w->def = *def;
    w->fell = w->damped = -1;
    snprintf(config, sizeof config, "%s/configs/%s.ini", MILD_SOURCE_DIR, def->config);
    robot_policy(def->robot, policy);
    expect_good(experiment_task(&w->task, 0, named, config, policy, &error) == MILD_OK, &error);
    w->robot = robot_open(def->robot, &error);
    expect_good(w->robot != NULL, &error);
    expect_good(scene_make(&scene, def->ground, 1, &error) == MILD_OK, &error);
    robot_set_shells(w->robot, w->task.shells_stand);
    expect_good(task_set_robot(&w->task, w->robot, &error) == MILD_OK, &error);
    if (def->slope != 0) {
        MildMapDef map = mild_map_def_default();
        map.kind = MILD_MAP_SLOPE;
        map.slope = def->slope;
        w->map = mild_map_create(&map, &error);
        expect_good(w->map != NULL, &error);
        w->task.map = w->map;
    }
    w->sim = robot_sim_create(w->robot, w->task.physics_dt, &error);
    w->env = aligned_alloc(64, task_env_bytes(&w->task, w->robot));
    task_env_init(w->env, &w->task, w->robot, def->seed, 0);
    w->env->command_frozen = 1;
    task_env_reset_on(w->env, &w->task, w->robot, w->sim, &scene.terrain, scene.rigid, &none);
    task_env_rest(w->env)->terrain.map = w->task.map;
    robot_sim_set_solver(w->sim, (MildSolver)w->task.solver, w->task.contact_tolerance,
                         w->task.contact_iterations);
    Random r = random_at(def->seed, 78, 0);
    w->lag_command = def->noisy ? (int)(3 * random_unit(&r)) : 0;
    w->lag_motor = def->noisy ? (int)(3 * random_unit(&r)) : 0;
    w->lag_imu = def->noisy ? (int)(3 * random_unit(&r)) : 0;
    own.robot = w->robot;
    own.policy = policy;
    own.task = &w->task;
    own.session = 1;
    w->runner = runner_create(&own, &error);
    expect_good(w->runner != NULL, &error);
    for (int i = 0; i < WALK_LAG; i++) {
        w->read[i] = walk_read(w);
    }
    return w;
}

static inline void walk_free(Walk *w) {
    runner_destroy(w->runner);
    robot_sim_destroy(w->sim);
    free(w->env);
    mild_map_destroy(w->map);
    robot_destroy(w->robot);
    free(w);
}

static inline void walk_push(Walk *w) {
    const long every = (long)(PUSH_EVERY / TASK_PERIOD + 0.5);
    if (w->def.push == 0 || w->tick % every != every / 2) {
        return;
    }
    RobotState state = {.qpos = {0}};
    const RobotVariation variation = task_env_variation(w->env);
    Random r = random_at(w->def.seed, 79, w->tick);
    const double angle = 6.283185307179586 * random_unit(&r);
    robot_sim_store(w->sim, &state);
    state.qvel[0] += w->def.push * cos(angle);
    state.qvel[1] += w->def.push * sin(angle);
    robot_sim_load(w->sim, &state, &variation);
}

/* Bool: the simulation diverged. */
static inline int walk_physics(Walk *w) {
    const int steps = (int)(TASK_PERIOD / w->task.physics_dt + 0.5);
    for (int k = 0; k < steps; k++) {
        const TargetPacket *target = &w->target[k < w->lag_command];
        const double *q = robot_sim_qpos(w->sim) + 7, *qd = robot_sim_qvel(w->sim) + 6;
        double torque[ROBOT_JOINTS_MAX];
        for (int i = 0; i < robot_joints(w->robot); i++) {
            const TaskMotor motor = {.target = {(double)target->angle[i]},
                                     .kp = (double)target->kp[i],
                                     .kd = (double)target->kd[i],
                                     .limit = (double)target->limit[i],
                                     .fastest = robot_speed(w->robot)[i]};
            torque[i] = task_torque(&motor, 0, q[i], qd[i]);
        }
        if (robot_sim_step(w->sim, torque, NULL, task_env_terrain(w->env),
                           task_env_ground(w->env))) {
            return 1;
        }
        memmove(w->read + 1, w->read, (WALK_LAG - 1) * sizeof *w->read);
        w->read[0] = walk_read(w);
    }
    return 0;
}

/* Targets for a state, at `now` [s] of the runner's clock. */
static inline void walk_exchange(Walk *w) {
    uint8_t bytes[PACKET_MAX];
    const PacketFormat format = {robot_joints(w->robot), packet_robot(w->robot), NULL};
    const double now = 5 + TASK_PERIOD * w->tick;
    const StatePacket state = walk_state(w);
    const size_t sent = packet_write_state(&state, &format, bytes);
    runner_take(w->runner, bytes, sent, 3 << 16 | 4000, now);
    const size_t size = runner_tick(w->runner, now, w->def.command, bytes);
    TargetPacket target;
    if (size > 0 && packet_read_target(bytes, size, &format, &target) == PACKET_FAULT_none) {
        w->target[1] = w->target[0].session ? w->target[0] : target;
        w->target[0] = target;
    }
}

/* A tick. Bool: it goes on. */
static inline int walk_step(Walk *w) {
    const double since = TASK_PERIOD * w->tick - w->def.begins;
    walk_exchange(w);
    if (runner_mode(w->runner) == PACKET_damp && w->damped < 0) {
        w->damped = since;
        snprintf(w->why, sizeof w->why, "%s", runner_report(w->runner)->why);
    }
    if (w->target[0].mode < PACKET_walk) {
        return 1;
    }
    walk_push(w);
    const int diverged = walk_physics(w);
    for (int i = 0; i < robot_joints(w->robot) && w->damped < 0 && since >= 0; i++) {
        w->speed = fmax(w->speed, fabs(robot_sim_qvel(w->sim)[6 + i]));
    }
    w->tilt = acos(fmin(robot_sim_base_rotation(w->sim)[8], 1));
    const int down =
        diverged || w->tilt > 1 || robot_sim_base_clearance(w->sim, task_env_terrain(w->env)) < 0;
    if (down && w->fell < 0) {
        w->fell = since;
    }
    return !down && w->damped < 0 && TASK_PERIOD * w->tick < w->def.seconds;
}

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
