/* The runner with time that the test gives: its targets are those of the task's own environment;
 * lost, late, old and damaged packets; a dead robot; limits. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/random.h"
#include "deploy/drive/runner.h"
#include "run/eval/scene.h"
#include "sa01.h"

#define POLICY MILD_SOURCE_DIR "/policies/mild.safetensors"

enum {
    JOINTS = 12,
    GREETINGS = 5, /* states before the first answer */
    SESSION = 1001,
    ROBOT_SESSION = 2002,
    SENDER = 3 << 16 | 4000,
    STRANGER = 3 << 16 | 4001
};

static Robot *robot;
static TaskDef task,
    noisy; /* the environment's; the runner's, which adds no noise to a robot's own */
static const double forward[3] = {0.5, 0, 0};

static int setup(void **state) {
    (void)state;
    MildError error = {0};
    robot = robot_create(SA01, &error);
    task = task_def_default();
    task_def_make_nominal(&task);
    task.randomize.latency[0] = task.randomize.latency[1] = 0;
    noisy = task;
    task.observe_noise = 0;
    return robot == NULL;
}

static int teardown(void **state) {
    (void)state;
    robot_destroy(robot);
    return 0;
}

static RunnerDef usual(void) {
    return (RunnerDef){.policy = POLICY,
                       .robot = robot,
                       .task = &noisy,
                       .late = 0.02,
                       .damp_after = 0.1,
                       .stall_after = 0.05,
                       .glitch = 0.025,
                       .turn_limit = 10,
                       .speed_limit = 30,
                       .angle_limit = 0.2,
                       .torque_share = 1,
                       .session = SESSION};
}

static Runner *make_runner_of(const RunnerDef *def) {
    MildError error = {0};
    Runner *runner = runner_create(def, &error);
    assert_non_null(runner);
    return runner;
}

static Runner *make_runner(void) {
    const RunnerDef def = usual();
    return make_runner_of(&def);
}

/* A robot that stands upright in its default pose, and knows the runner. Its clock is 95 s ahead of
 * the runner's. */
static StatePacket standing(uint32_t sequence, double time) {
    StatePacket state = {.mode = PACKET_walk,
                         .sequence = sequence,
                         .time = (uint64_t)llround(1e6 * (100 + time)),
                         .session = ROBOT_SESSION,
                         .peer = SESSION,
                         .quaternion = {1, 0, 0, 0}};
    for (int i = 0; i < JOINTS; i++) {
        state.angle[i] = (float)robot_default_pose(robot)[i];
    }
    return state;
}

static PacketFault take_from(Runner *runner, const StatePacket *state, uint64_t sender,
                             double arrived) {
    uint8_t bytes[PACKET_MAX];
    const PacketFormat format = {JOINTS, packet_robot(robot), NULL};
    const size_t size = packet_write_state(state, &format, bytes);
    return runner_take(runner, bytes, size, sender, 5 + arrived);
}

static PacketFault take(Runner *runner, const StatePacket *state, double arrived) {
    return take_from(runner, state, SENDER, arrived);
}

/* As this state, before it, every 10 ms. */
static void greet(Runner *runner, const StatePacket *state, double arrived) {
    for (int k = GREETINGS; k > 0; k--) {
        StatePacket before = *state;
        before.sequence -= (uint32_t)k;
        before.time -= (uint64_t)k * 10000;
        assert_int_equal(take(runner, &before, arrived - 0.01 * k), PACKET_FAULT_none);
    }
}

/* arrived: [s] at the runner, which knows the robot by then. */
static void give(Runner *runner, const StatePacket *state, double arrived) {
    if (!runner_sender(runner)) {
        greet(runner, state, arrived);
    }
    assert_int_equal(take(runner, state, arrived), PACKET_FAULT_none);
}

static int tick_to(Runner *runner, double now, const double *command, TargetPacket *target) {
    uint8_t bytes[PACKET_MAX];
    const PacketFormat format = {JOINTS, packet_robot(robot), NULL};
    const size_t size = runner_tick(runner, 5 + now, command, bytes);
    if (size == 0) {
        return 0;
    }
    assert_int_equal(packet_read_target(bytes, size, &format, target), PACKET_FAULT_none);
    assert_true(fabs((double)target->time - 1e6 * (5 + now)) <= 1);
    assert_true(target->session == SESSION && target->peer == ROBOT_SESSION);
    return 1;
}

static TargetPacket tick(Runner *runner, double now, const double *command) {
    TargetPacket target = {0};
    assert_true(tick_to(runner, now, command, &target));
    return target;
}

/* ---- the task's own environment ---- */

typedef struct {
    TaskEnv *env;
    RobotSim *sim;
    Controller controller;
    float action[JOINTS];
} World;

static World make_world(void) {
    MildError error = {0};
    const TaskView none = {0};
    Scene scene;
    World w = {.env = aligned_alloc(64, task_env_bytes(&task, robot)),
               .sim = robot_sim_create(robot, task.physics_dt, &error)};
    assert_non_null(w.env);
    assert_non_null(w.sim);
    assert_int_equal(controller_learned(POLICY, robot, NULL, 1, &w.controller, &error), MILD_OK);
    assert_int_equal(scene_make(&scene, "foam45", 1, &error), MILD_OK);
    for (uint32_t index = 0;; index++) { /* one whose clock starts at 0, as the runner's does */
        task_env_init(w.env, &task, robot, 1, index);
        w.env->command_frozen = 1;
        memcpy(w.env->command, forward, sizeof forward);
        task_env_reset_on(w.env, &task, robot, w.sim, &scene.terrain, 0, &none);
        if (w.env->phase == 0) {
            return w;
        }
    }
}

static void free_world(World *w) {
    controller_destroy(&w->controller);
    robot_sim_destroy(w->sim);
    free(w->env);
}

static StatePacket state_of(const World *w, uint32_t sequence, double time) {
    StatePacket state = standing(sequence, time);
    const TaskPose *s = &w->env->robot;
    for (int i = 0; i < 4; i++) {
        state.quaternion[i] = (float)s->qpos[3 + i];
    }
    for (int i = 0; i < 3; i++) {
        state.angular_velocity[i] = (float)s->qvel[3 + i];
    }
    for (int i = 0; i < JOINTS; i++) {
        state.angle[i] = (float)s->qpos[7 + i];
        state.speed[i] = (float)s->qvel[6 + i];
    }
    return state;
}

/* Two seconds of a walk that turns and then stands: every target is what the task's motor would
 * get, but for the torque limit. */
static void the_same_as_the_task(void **unused) {
    (void)unused;
    const TaskView none = {0};
    World w = make_world();
    Runner *runner = make_runner();
    double worst = 0, farthest = 0;
    int limited = 0;
    for (uint32_t k = 0; k < 200; k++) {
        const double now = 0.01 * k,
                     command[3] = {k < 150 ? 0.5 : 0, 0, k > 80 && k < 150 ? 0.4 : 0};
        const StatePacket state = state_of(&w, k + 1, now);
        give(runner, &state, now);
        const TargetPacket target = tick(runner, now, command);
        assert_int_equal(target.mode, PACKET_walk);
        assert_int_equal(target.answers, k + 1);
        w.controller.act(w.controller.self, 1, &w.env, w.action);
        for (int i = 0; i < JOINTS; i++) {
            const double kp = robot_kp(robot)[i], kd = robot_kd(robot)[i],
                         limit = 0.85 * robot_effort(robot)[i], q = (double)state.angle[i],
                         qd = (double)state.speed[i];
            const double wanted = robot_default_pose(robot)[i] + 0.5 * (double)w.action[i];
            const double torque = kp * (wanted - q) - kd * qd;
            assert_true(fabs((double)target.kp[i] - kp) < 1e-5);
            assert_true(fabs((double)target.kd[i] - kd) < 1e-5);
            assert_true(fabs((double)target.limit[i] - limit) < 1e-4);
            if (fabs(torque) <= limit) {
                worst = fmax(worst, fabs((double)target.angle[i] - wanted));
            } else { /* the PD then asks for the limit */
                const double asked = kp * ((double)target.angle[i] - q) - kd * qd;
                assert_true(fabs(asked - copysign(limit, torque)) < 1e-3);
                limited++;
            }
            farthest = fmax(farthest, fabs(wanted - robot_default_pose(robot)[i]));
        }
        memcpy(w.env->command, command, sizeof command); /* in the next frame */
        const TaskStep step = task_env_step(w.env, &task, robot, w.sim, w.action, 0, &none, NULL);
        assert_true(!step.done);
    }
    const RunnerReport *report = runner_report(runner);
    print_message("targets of up to %.2f rad within %.1e, %d limited\n", farthest, worst, limited);
    assert_true(worst < 2e-5 && farthest > 0.3);
    assert_true(report->steps == 200 && report->holds == 0 && report->lost == 0);
    assert_int_equal(report->targets_limited, limited);
    runner_destroy(runner);
    free_world(&w);
}

/* ---- packets on bad ways ---- */

/* Nothing before the first state; then a state for every tick but some. */
static void lost_states(void **unused) {
    (void)unused;
    uint8_t bytes[PACKET_MAX];
    Runner *runner = make_runner();
    const RunnerReport *report = runner_report(runner);
    TargetPacket before = {0};
    assert_int_equal(runner_tick(runner, 5, forward, bytes), 0);
    for (uint32_t k = 0; k < 50; k++) {
        const int lost = k % 10 == 7 || k % 10 == 8;
        const StatePacket state = standing(k + 1, 0.01 * k);
        if (!lost) {
            give(runner, &state, 0.01 * k);
        }
        const TargetPacket target = tick(runner, 0.01 * k, forward);
        assert_int_equal(target.mode, lost ? PACKET_hold : PACKET_walk);
        assert_int_equal(target.sequence, k + 1);
        if (lost) {
            assert_memory_equal(target.angle, before.angle, sizeof target.angle);
            assert_memory_equal(target.kp, before.kp, sizeof target.kp);
        }
        before = target;
    }
    assert_true(report->received == 40 + GREETINGS && report->lost == 10 && report->holds == 10);
    assert_true(report->steps == 40 && report->late == 0 && report->damps == 0);
    runner_destroy(runner);
}

/* States of 400 Hz: the newest counts. An old one that comes behind it does not. */
static void old_states(void **unused) {
    (void)unused;
    Runner *runner = make_runner();
    const RunnerReport *report = runner_report(runner);
    StatePacket state = standing(10, 0);
    give(runner, &state, 0);
    state = standing(12, 0.005);
    give(runner, &state, 0.005);
    state = standing(11, 0.0025);
    give(runner, &state, 0.006);
    state = standing(12, 0.005); /* the newest once more */
    give(runner, &state, 0.007);
    const TargetPacket target = tick(runner, 0.01, forward);
    assert_int_equal(target.answers, 12);
    assert_true(report->received == 4 + GREETINGS && report->reordered == 2 && report->lost == 1);
    assert_true(report->age.count == 1 && fabs(report->age.longest - 0.005) < 1e-9);
    /* the counter goes through zero */
    state = standing(0xffffffffu, 0.02);
    state.sequence = 12 + 0x7fffffffu;
    give(runner, &state, 0.02);
    state = standing(12 + 0x7fffffffu + 3, 0.03);
    give(runner, &state, 0.03);
    assert_int_equal(report->reordered, 2);
    /* a newer number at an older time */
    state = standing(12 + 0x7fffffffu + 4, 0.029);
    give(runner, &state, 0.04);
    assert_int_equal(report->reordered, 3);
    runner_destroy(runner);
}

/* Ways of 3 ms; then some of 35 ms, in order; then all of them. */
static void late_states(void **unused) {
    (void)unused;
    Runner *runner = make_runner();
    const RunnerReport *report = runner_report(runner);
    double now = 0;
    for (uint32_t k = 0; k < 40; k++) {
        const double sent = 0.01 * k;
        const StatePacket state = standing(k + 1, sent);
        const int late = k == 20 || k == 30;
        now = sent + (late ? 0.035 : 0.003);
        give(runner, &state, now);
        const TargetPacket target = tick(runner, now, forward);
        assert_int_equal(target.mode, late ? PACKET_hold : PACKET_walk);
        assert_int_equal(target.answers, late ? k : k + 1); /* what was used */
    }
    assert_true(report->late == 2 && report->holds == 2 && report->steps == 38);
    assert_int_equal(report->lost, 0);
    for (uint32_t k = 40; k < 60; k++) {
        const StatePacket state = standing(k + 1, 0.01 * k);
        give(runner, &state, 0.01 * k + 0.035);
        tick(runner, 0.01 * k + 0.035, forward);
    }
    assert_int_equal(runner_mode(runner), PACKET_damp);
    assert_non_null(strstr(report->why, "no state for 0.1"));
    assert_true(report->late == 22 && report->lost == 0 && report->received == 60 + GREETINGS);
    runner_destroy(runner);
}

/* A clock that runs slow by 0.05 % is 30 ms behind after a minute: nothing is late. */
static void a_slow_clock(void **unused) {
    (void)unused;
    Runner *runner = make_runner();
    for (uint32_t k = 0; k < 6000; k++) {
        const StatePacket state = standing(k + 1, 0.01 * k * (1 - 5e-4));
        give(runner, &state, 0.01 * k);
        assert_int_equal(tick(runner, 0.01 * k, forward).mode, PACKET_walk);
    }
    assert_int_equal(runner_report(runner)->late, 0);
    runner_destroy(runner);
}

/* Holds for 0.1 s, then damps, also when the robot comes back. */
static void a_dead_robot(void **unused) {
    (void)unused;
    Runner *runner = make_runner();
    const RunnerReport *report = runner_report(runner);
    for (uint32_t k = 0; k < 10; k++) {
        const StatePacket state = standing(k + 1, 0.01 * k);
        give(runner, &state, 0.01 * k);
        tick(runner, 0.01 * k, forward);
    }
    for (int k = 10; k < 40; k++) {
        const TargetPacket target = tick(runner, 0.01 * k + 0.001, forward);
        assert_int_equal(target.mode, k < 19 ? PACKET_hold : PACKET_damp);
        for (int i = 0; i < JOINTS; i++) {
            assert_true((target.kp[i] > 0) == (k < 19) && target.kd[i] > 0);
        }
    }
    const StatePacket back = standing(100, 0.4);
    give(runner, &back, 0.4);
    assert_int_equal(tick(runner, 0.4, forward).mode, PACKET_damp);
    assert_true(report->holds == 9 && report->steps == 10 && report->damps == 22);
    runner_destroy(runner);
}

/* ---- limits ---- */

/* What can be wrong with a state that a sensor made, and what the runner says of it. */
typedef struct {
    float omega;        /* of each axis */
    float speed;        /* of joint 4 */
    float angle, along; /* of joint 9: added to its 0.48, and its speed */
    float pitch;
    double clock;    /* [s] */
    const char *why; /* NULL: nothing is wrong */
} Fault;

static const Fault faults[] = {
    {.omega = 2.8f},
    {.omega = 2.95f, .why = "the turning of the base changed by 5.1 rad/s in 0.010 s"},
    {.omega = 1e5f, .why = "the base turns at 173205.1 rad/s, the limit is 10"},
    {.omega = -1e6f, .why = "the base turns at"},
    {.omega = 5.9f, .why = "the base turns at 10.2 rad/s, the limit is 10"},
    {.speed = -29},
    {.speed = -31, .why = "leg_l5_joint moves at 31.0 rad/s, the limit is 30"},
    {.speed = 1e6f, .why = "leg_l5_joint moves at"},
    {.angle = 0.09f},
    {.angle = 0.11f, .why = "leg_r4_joint moved by 0.11 rad in 0.010 s, and says 0.0 rad/s"},
    {.angle = 0.37f, .along = 28},
    {.angle = 0.39f, .along = 28, .why = "leg_r4_joint moved by 0.39 rad in 0.010 s"},
    {.angle = -1, .why = "leg_r4_joint is 0.37 rad beyond its range, the limit is 0.2"},
    {.angle = 9e5f, .why = "beyond its range"},
    {.pitch = 0.045f},
    {.pitch = -0.055f, .why = "the base tipped by 0.05 rad in 0.010 s"},
    {.pitch = 3, .why = "the base tipped by 3.00 rad"},
    {.clock = 0.9},
    {.clock = 1.1, .why = "its clock jumped forward by 1.1 s"},
    {.clock = 1e9, .why = "its clock jumped forward by 1e+09 s"},
};
enum { FAULTS = sizeof faults / sizeof *faults };

static StatePacket with_fault(const Fault *fault, uint32_t sequence, double time) {
    StatePacket state = standing(sequence, time + fault->clock);
    for (int i = 0; i < 3; i++) {
        state.angular_velocity[i] = fault->omega;
    }
    state.speed[4] = fault->speed;
    state.angle[9] += fault->angle;
    state.speed[9] = fault->along;
    state.quaternion[0] = (float)cos((double)fault->pitch / 2);
    state.quaternion[2] = (float)sin((double)fault->pitch / 2);
    return state;
}

/* One impossible state is a hold, and leaves no trace: all targets after it are those of a runner
 * that never got it. */
static void a_glitch(void **unused) {
    (void)unused;
    for (int f = 0; f < FAULTS; f++) {
        Runner *hit = make_runner(), *missed = make_runner();
        const RunnerReport *report = runner_report(hit);
        TargetPacket target = {0}, same;
        for (uint32_t k = 0; k < 60; k++) {
            const double now = 0.01 * k;
            StatePacket state = standing(k + 1, now);
            state.speed[3] = (float)sin(0.3 * k);
            if (k == 20 && faults[f].why) {
                const TargetPacket before = target;
                const StatePacket bad = with_fault(&faults[f], k + 1, now);
                assert_int_equal(take(hit, &bad, now), PACKET_FAULT_implausible);
                assert_non_null(strstr(report->refusal, faults[f].why));
                target = tick(hit, now, forward);
                same = tick(missed, now, forward);
                assert_memory_equal(target.angle, before.angle, sizeof target.angle);
            } else {
                state = k == 20 ? with_fault(&faults[f], k + 1, now) : state;
                give(hit, &state, now);
                give(missed, &state, now);
                target = tick(hit, now, forward);
                same = tick(missed, now, forward);
            }
            assert_int_equal(target.mode, k == 20 && faults[f].why ? PACKET_hold : PACKET_walk);
            assert_memory_equal(&target, &same, sizeof target);
            k +=
                faults[f].clock > 0 && !faults[f].why && k == 20 ? 60 : 0; /* all others are late */
        }
        assert_int_equal(report->refused[PACKET_FAULT_implausible], faults[f].why != NULL);
        assert_string_equal(report->why, "");
        runner_destroy(hit);
        runner_destroy(missed);
    }
}

/* Impossible states for longer than `glitch` damp, and the reason names the number. */
static void impossible_states(void **unused) {
    (void)unused;
    for (int f = 0; f < FAULTS; f++) {
        Runner *runner = make_runner();
        StatePacket state = standing(1, 0);
        give(runner, &state, 0);
        tick(runner, 0, forward);
        for (uint32_t k = 1; k < 5 && faults[f].why; k++) {
            state = with_fault(&faults[f], k + 1, 0.01 * k);
            take(runner, &state, 0.01 * k);
            const TargetPacket target = tick(runner, 0.01 * k, forward);
            /* some jumps are possible after 20 ms */
            const int possible = k > 1 && strstr(faults[f].why, " in 0.010 s") != NULL;
            assert_int_equal(target.mode, possible ? PACKET_walk
                                          : k < 4  ? PACKET_hold
                                                   : PACKET_damp);
            assert_true((target.kp[0] == 0) == (target.mode == PACKET_damp) && target.kd[0] > 0);
            if (k == 4 && !possible) {
                assert_non_null(
                    strstr(runner_report(runner)->why, "impossible states for 0.030 s"));
                assert_non_null(strstr(runner_report(runner)->why, faults[f].why));
            }
        }
        runner_destroy(runner);
    }
}

/* Every second state is impossible: the others walk. Then none is possible, and the newest gets too
 * old, because a limit of `glitch` allows it. */
static void many_glitches(void **unused) {
    (void)unused;
    RunnerDef def = usual();
    def.glitch = 10;
    def.damp_after = 0.105;
    Runner *runner = make_runner_of(&def);
    const Fault *fault = &faults[2];
    for (uint32_t k = 0; k < 40; k++) {
        const double now = 0.01 * k;
        const int bad = k % 2 == 1 || k >= 20;
        const StatePacket state = bad ? with_fault(fault, k + 1, now) : standing(k + 1, now);
        bad ? (void)take(runner, &state, now) : give(runner, &state, now);
        const TargetPacket target = tick(runner, now, forward);
        assert_int_equal(target.mode, !bad ? PACKET_walk : k < 29 ? PACKET_hold : PACKET_damp);
    }
    assert_non_null(strstr(runner_report(runner)->why, "no possible state for 0.110"));
    assert_int_equal(runner_report(runner)->refused[PACKET_FAULT_implausible], 30);
    runner_destroy(runner);
}

/* Without limits any number passes, and the policy is shown the nearest that training knows. */
static void what_the_policy_is_shown(void **unused) {
    (void)unused;
    enum { GIVEN = 8 };
    const Fault given[GIVEN] = {{.omega = 1e5f}, {.omega = 5},  {.omega = -77}, {.omega = -5},
                                {.speed = 9000}, {.speed = 50}, {.speed = 0},   {.speed = 0}};
    RunnerDef def = usual();
    def.turn_limit = def.speed_limit = 0;
    def.angle_limit = -1;
    def.torque_share = 1;
    TargetPacket target[GIVEN];
    for (int g = 0; g < GIVEN; g++) {
        Runner *runner = make_runner_of(&def);
        for (uint32_t k = 0; k < 3; k++) {
            const StatePacket state = with_fault(&given[g], k + 1, 0.01 * k);
            give(runner, &state, 0.01 * k);
            target[g] = tick(runner, 0.01 * k, forward);
        }
        target[g].angle[4] = 0; /* its PD, and so its limit, has the speed itself */
        runner_destroy(runner);
    }
    for (int g = 0; g < GIVEN; g += 2) {
        assert_memory_equal(target[g].angle, target[g + 1].angle, sizeof target[g].angle);
        assert_memory_not_equal(target[g].angle, target[(g + 2) % GIVEN].angle,
                                sizeof target[g].angle);
    }
}

/* A robot that tips over, as fast as it can fall, damps at once. */
static void a_tilt(void **unused) {
    (void)unused;
    for (int sign = -1; sign <= 1; sign += 2) {
        Runner *runner = make_runner();
        double pitch = 0.02;
        for (uint32_t k = 0; pitch < 1.1; k++, pitch += 0.05) { /* the limit is 1 */
            StatePacket state = standing(k + 1, 0.01 * k);
            state.quaternion[0] = (float)cos(pitch / 2);
            state.quaternion[2] = (float)(sign * sin(pitch / 2));
            state.angular_velocity[1] = (float)(5 * sign);
            give(runner, &state, 0.01 * k);
            const TargetPacket target = tick(runner, 0.01 * k, forward);
            assert_int_equal(target.mode, pitch < 1 ? PACKET_walk : PACKET_damp);
        }
        assert_non_null(strstr(runner_report(runner)->why, "tilted by 1.02 rad"));
        runner_destroy(runner);
    }
}

/* ---- who speaks ---- */

/* Nothing is sent before five good states in a row, and until the robot has answered no more
 * packets than it sent, which have no stiffness. */
static void a_greeting(void **unused) {
    (void)unused;
    Runner *runner = make_runner();
    TargetPacket target;
    for (uint32_t k = 0; k < 30; k++) {
        const double now = 0.01 * k;
        StatePacket state = standing(k + 1, now);
        state.peer = 0;
        assert_int_equal(take(runner, &state, now), PACKET_FAULT_none);
        const int answered = tick_to(runner, now, forward, &target);
        assert_int_equal(answered, k + 1 >= GREETINGS);
        assert_false(tick_to(runner, now + 0.005, forward, &target)); /* nothing came */
        if (answered) {
            assert_int_equal(target.mode, PACKET_wait);
            assert_true(target.kp[3] == 0 && target.answers == k + 1);
        }
    }
    const StatePacket state = standing(31, 0.3);
    give(runner, &state, 0.3);
    target = tick(runner, 0.3, forward);
    assert_true(target.mode == PACKET_walk && target.kp[3] > 0);
    assert_int_equal(runner_report(runner)->steps, 1);
    runner_destroy(runner);
}

/* A series that is broken begins anew: by an impossible state, a pause, another session. */
static void a_broken_greeting(void **unused) {
    (void)unused;
    for (int how = 0; how < 3; how++) {
        Runner *runner = make_runner();
        TargetPacket target;
        double now = 0;
        for (uint32_t k = 0; k < 4 + GREETINGS; k++) {
            now += how == 1 && k == 4 ? 0.2 : 0.01;
            StatePacket state = standing(2 * k + 10, now);
            state.session += how == 2 && k >= 4;
            if (how == 0 && k == 4) {
                StatePacket bad = with_fault(&faults[2], 2 * k + 9, now);
                assert_int_equal(take(runner, &bad, now), PACKET_FAULT_implausible);
            }
            assert_int_equal(take(runner, &state, now), PACKET_FAULT_none);
            if (k + 1 < 4 + GREETINGS) {
                assert_false(tick_to(runner, now, forward, &target));
            }
        }
        uint8_t bytes[PACKET_MAX];
        assert_true(runner_tick(runner, 5 + now, forward, bytes) > 0);
        assert_int_equal(runner_mode(runner), PACKET_walk);
        runner_destroy(runner);
    }
}

/* A stranger who is first is forgotten when he falls silent, or does not answer. The robot is then
 * heard, and nobody else. */
static void a_stranger(void **unused) {
    (void)unused;
    for (int states = 1; states <= 120; states += 119) {
        Runner *runner = make_runner();
        const RunnerReport *report = runner_report(runner);
        TargetPacket target;
        double now = 0;
        long taken = 0, answers = 0;
        for (int k = 0; k < states; k++, now += 0.01) { /* never learns the runner's session */
            StatePacket state = standing((uint32_t)k, now);
            state.peer = 0;
            taken += take_from(runner, &state, STRANGER, now) == PACKET_FAULT_none;
            answers += tick_to(runner, now, forward, &target);
            state.session++;
            assert_true(k >= 100 || take(runner, &state, now) == PACKET_FAULT_stranger ||
                        states == 1);
        }
        assert_true(answers <= taken - GREETINGS + 1 || states == 1);
        now += 0.11;
        for (uint32_t k = 0; k < 20; k++, now += 0.01) {
            const StatePacket state = standing(k + 1, now);
            assert_int_equal(take(runner, &state, now), PACKET_FAULT_none);
            assert_int_equal(take_from(runner, &state, STRANGER, now), PACKET_FAULT_stranger);
            tick_to(runner, now, forward, &target);
        }
        assert_int_equal(target.mode, PACKET_walk);
        assert_true(runner_sender(runner) == SENDER && report->steps == 20 - GREETINGS + 1);
        assert_true(report->refused[PACKET_FAULT_stranger] >= 20);
        runner_destroy(runner);
    }
}

/* --peer: of this port, or of any port of this host. */
static void the_peer(void **unused) {
    (void)unused;
    const struct {
        uint64_t peer, sender;
        int heard;
    } cases[] = {{SENDER, SENDER, 1},    {SENDER, STRANGER, 0}, {3 << 16, SENDER, 1},
                 {3 << 16, STRANGER, 1}, {2 << 16, SENDER, 0},  {2 << 16 | 4000, SENDER, 0}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        RunnerDef def = usual();
        def.peer = cases[c].peer;
        Runner *runner = make_runner_of(&def);
        const StatePacket state = standing(1, 0);
        assert_int_equal(take_from(runner, &state, cases[c].sender, 0),
                         cases[c].heard ? PACKET_FAULT_none : PACKET_FAULT_stranger);
        runner_destroy(runner);
    }
}

/* States of another session, of the robot's or of the runner's, are refused, also such as greet. */
static void other_sessions(void **unused) {
    (void)unused;
    Runner *runner = make_runner();
    const RunnerReport *report = runner_report(runner);
    StatePacket state = standing(1, 0);
    state.peer = SESSION + 1; /* what somebody recorded before the runner was started */
    assert_int_equal(take(runner, &state, 0), PACKET_FAULT_session);
    state = standing(1, 0);
    state.session = 0;
    assert_int_equal(take(runner, &state, 0), PACKET_FAULT_session);
    state = standing(1, 0);
    give(runner, &state, 0);
    assert_int_equal(tick(runner, 0, forward).mode, PACKET_walk);
    for (int how = 0; how < 4; how++) {
        state = standing(100, 0.01);
        state.session += how == 0;
        state.peer = how == 1 ? 0 : how == 2 ? SESSION - 1 : state.peer;
        state.mode = how == 3 ? PACKET_end : PACKET_walk;
        state.session += how == 3;
        assert_int_equal(take(runner, &state, 0.01), PACKET_FAULT_session);
    }
    assert_true(report->refused[PACKET_FAULT_session] == 6 && !runner_peer_ended(runner));
    assert_int_equal(tick(runner, 0.01, forward).mode, PACKET_hold);
    state = standing(2, 0.02);
    give(runner, &state, 0.02);
    assert_int_equal(tick(runner, 0.02, forward).mode, PACKET_walk);
    runner_destroy(runner);
}

/* The runner itself stood still, though the robot's states are young. */
static void a_stall(void **unused) {
    (void)unused;
    for (int late = 0; late < 2; late++) {
        Runner *runner = make_runner();
        StatePacket state = standing(1, 0);
        give(runner, &state, 0);
        tick(runner, 0, forward);
        const double now = late ? 0.051 : 0.049;
        state = standing(2, now - 0.001);
        give(runner, &state, now);
        assert_int_equal(tick(runner, now, forward).mode, late ? PACKET_damp : PACKET_walk);
        if (late) {
            assert_non_null(strstr(runner_report(runner)->why, "itself stood still for 0.051 s"));
        }
        runner_destroy(runner);
    }
}

/* A tenth of the torque: 11.9 N m at the knee, which is 1.5 rad off and moves. */
static void a_share_of_the_torque(void **unused) {
    (void)unused;
    RunnerDef def = usual();
    def.torque_share = 0.1;
    Runner *runner = make_runner_of(&def);
    StatePacket state = standing(1, 0);
    state.angle[3] += 1.5f;
    state.speed[3] = -2;
    give(runner, &state, 0);
    const TargetPacket target = tick(runner, 0, forward);
    const double asked = 70 * (double)(target.angle[3] - state.angle[3]) - 7 * -2.0;
    assert_true(fabs((double)target.limit[3] - 11.9) < 1e-4 && fabs(asked + 11.9) < 1e-3);
    assert_true(runner_report(runner)->targets_limited >= 1);
    runner_destroy(runner);
}

/* Commands end at the task's ranges, and what is no number is 0: by the action that comes out. */
static void commands(void **unused) {
    (void)unused;
    enum { GIVEN = 10 };
    const double given[GIVEN][3] = {{9, 0, 0},      {1.2, 0, 0},   {0.5, 0, NAN}, {0.5, 0, 0},
                                    {-9, 0, 0},     {-0.6, 0, 0},  {0.5, 0.9, 0}, {0.5, 0.3, 0},
                                    {0.5, 0, -1.9}, {0.5, 0, -1.5}};
    TargetPacket target[GIVEN];
    for (int c = 0; c < GIVEN; c++) {
        Runner *runner = make_runner();
        for (uint32_t k = 0; k < 5; k++) {
            const StatePacket state = standing(k + 1, 0.01 * k);
            give(runner, &state, 0.01 * k);
            target[c] = tick(runner, 0.01 * k, given[c]);
        }
        runner_destroy(runner);
    }
    for (int c = 0; c < GIVEN; c += 2) { /* two that are alike, and unlike those before */
        assert_memory_equal(target[c].angle, target[c + 1].angle, sizeof target[0].angle);
        assert_memory_not_equal(target[c].angle, target[(c + 2) % GIVEN].angle,
                                sizeof target[0].angle);
    }
}

/* Garbage of any size, and states with a few bits changed: refused, and nothing changes. */
static void garbage(void **unused) {
    (void)unused;
    Runner *runner = make_runner();
    const RunnerReport *report = runner_report(runner);
    uint8_t bytes[PACKET_MAX];
    const PacketFormat format = {JOINTS, packet_robot(robot), NULL};
    StatePacket state = standing(1, 0);
    give(runner, &state, 0);
    long refused = 0;
    for (uint32_t k = 0; k < 20000; k++) {
        Random r = random_at(1, 0, k);
        state = standing(k + 2, 0.001 * k);
        size_t size = packet_write_state(&state, &format, bytes);
        if (k % 2) {
            size = (size_t)(random_unit(&r) * PACKET_MAX);
            for (size_t i = k % 4 == 1 ? 0 : 8; i < size; i++) {
                bytes[i] = (uint8_t)random_bits(&r);
            }
        } else {
            for (int bits = 1 + (int)(random_unit(&r) * 3); bits > 0; bits--) {
                const size_t bit = (size_t)(random_unit(&r) * 8 * (double)size);
                bytes[bit / 8] ^= (uint8_t)(1 << bit % 8);
            }
        }
        const PacketFault fault = runner_take(runner, bytes, size, SENDER, 5.001);
        assert_true(fault != PACKET_FAULT_none || (k % 2 == 0 && report->received > 1 + GREETINGS));
    }
    for (int i = PACKET_FAULT_none + 1; i < PACKET_FAULTS; i++) {
        refused += report->refused[i];
    }
    assert_true(refused + report->received == 20001 + GREETINGS &&
                report->received <= 2 + GREETINGS);
    assert_int_equal(tick(runner, 0.002, forward).mode, PACKET_walk);
    runner_destroy(runner);
}

/* A robot ends the run once it walks, by a packet that is new and in time. Others are counted. */
static void the_end(void **unused) {
    (void)unused;
    uint8_t bytes[PACKET_MAX];
    const PacketFormat format = {JOINTS, packet_robot(robot), NULL};
    Runner *runner = make_runner();
    const RunnerReport *report = runner_report(runner);
    StatePacket end = standing(3, 0), state = standing(100, 0);
    end.mode = PACKET_end;
    assert_int_equal(take(runner, &end, -1), PACKET_FAULT_none); /* of no robot that walks */
    assert_true(runner_sender(runner) == 0 && runner_end(runner, 5, bytes) == 0);
    runner_destroy(runner);
    runner = make_runner();
    report = runner_report(runner);
    give(runner, &state, 0);
    tick(runner, 0, forward);
    assert_int_equal(take(runner, &end, 0.01), PACKET_FAULT_none); /* an old number */
    end = standing(101, -0.02);
    end.mode = PACKET_end;
    assert_int_equal(take(runner, &end, 0.01), PACKET_FAULT_none); /* an old time */
    end = standing(101, 0.01);
    end.mode = PACKET_end;
    assert_int_equal(take(runner, &end, 0.035), PACKET_FAULT_none); /* late */
    assert_true(report->ends_ignored == 3 && !runner_peer_ended(runner));
    state = standing(102, 0.035);
    give(runner, &state, 0.04);
    assert_int_equal(tick(runner, 0.04, forward).mode, PACKET_walk);
    end = standing(103, 0.05);
    end.mode = PACKET_end;
    assert_int_equal(take(runner, &end, 0.05), PACKET_FAULT_none);
    assert_true(runner_peer_ended(runner) && report->ends_ignored == 3);
    TargetPacket target;
    const size_t size = runner_end(runner, 5.06, bytes);
    assert_int_equal(packet_read_target(bytes, size, &format, &target), PACKET_FAULT_none);
    assert_true(target.mode == PACKET_end && target.kp[3] == 0 && target.kd[3] > 0);
    runner_destroy(runner);

    MildError error = {0};
    const RunnerDef none = {.policy = "no_such.safetensors", .robot = robot, .task = &task};
    assert_null(runner_create(&none, &error));
    assert_non_null(strstr(error.text, "no_such.safetensors"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_same_as_the_task),
        cmocka_unit_test(lost_states),
        cmocka_unit_test(old_states),
        cmocka_unit_test(late_states),
        cmocka_unit_test(a_slow_clock),
        cmocka_unit_test(a_dead_robot),
        cmocka_unit_test(a_glitch),
        cmocka_unit_test(impossible_states),
        cmocka_unit_test(many_glitches),
        cmocka_unit_test(what_the_policy_is_shown),
        cmocka_unit_test(a_tilt),
        cmocka_unit_test(a_greeting),
        cmocka_unit_test(a_broken_greeting),
        cmocka_unit_test(a_stranger),
        cmocka_unit_test(the_peer),
        cmocka_unit_test(other_sessions),
        cmocka_unit_test(a_stall),
        cmocka_unit_test(a_share_of_the_torque),
        cmocka_unit_test(commands),
        cmocka_unit_test(garbage),
        cmocka_unit_test(the_end),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
