/* What the tests of the runner share: a robot that stands, whose packets come when the test says,
 * and a runner that has heard it. */
#ifndef RUNNER_KIT_H
#define RUNNER_KIT_H

#include "drive/runner.h"
#include "kit.h"
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

static inline int setup(void **state) {
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

static inline int teardown(void **state) {
    (void)state;
    robot_destroy(robot);
    return 0;
}

static inline RunnerDef usual(void) {
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

static inline Runner *make_runner_of(const RunnerDef *def) {
    MildError error = {0};
    Runner *runner = runner_create(def, &error);
    assert_non_null(runner);
    return runner;
}

static inline Runner *make_runner(void) {
    const RunnerDef def = usual();
    return make_runner_of(&def);
}

/* A robot that stands upright in its default pose, and knows the runner. Its clock is 95 s ahead of
 * the runner's, and the last bits of its sensors flicker as real ones do. */
static inline StatePacket standing(uint32_t sequence, double time) {
    StatePacket state = {.mode = PACKET_walk,
                         .sequence = sequence,
                         .time = (uint64_t)llround(1e6 * (100 + time)),
                         .session = ROBOT_SESSION,
                         .peer = SESSION,
                         .quaternion = {1, 0, 0, 0}};
    const float flicker = sequence % 2 ? 1e-6f : 0;
    state.angular_velocity[2] = flicker;
    for (int i = 0; i < JOINTS; i++) {
        state.angle[i] = (float)robot_default_pose(robot)[i] + flicker;
    }
    return state;
}

static inline PacketFault take_from(Runner *runner, const StatePacket *state, uint64_t sender,
                                    double arrived) {
    uint8_t bytes[PACKET_MAX];
    const PacketFormat format = {JOINTS, packet_robot(robot), NULL};
    const size_t size = packet_write_state(state, &format, bytes);
    return runner_take(runner, bytes, size, sender, 5 + arrived);
}

static inline PacketFault take(Runner *runner, const StatePacket *state, double arrived) {
    return take_from(runner, state, SENDER, arrived);
}

/* As this state, before it, every 10 ms. */
static inline void greet(Runner *runner, const StatePacket *state, double arrived) {
    for (int k = GREETINGS; k > 0; k--) {
        StatePacket before = *state;
        before.sequence -= (uint32_t)k;
        before.time -= (uint64_t)k * 10000;
        assert_int_equal(take(runner, &before, arrived - 0.01 * k), PACKET_FAULT_none);
    }
}

/* arrived: [s] at the runner, which knows the robot by then. */
static inline void give(Runner *runner, const StatePacket *state, double arrived) {
    if (!runner_sender(runner)) {
        greet(runner, state, arrived);
    }
    assert_int_equal(take(runner, state, arrived), PACKET_FAULT_none);
}

static inline int tick_to(Runner *runner, double now, const double *command, TargetPacket *target) {
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

static inline TargetPacket tick(Runner *runner, double now, const double *command) {
    TargetPacket target = {0};
    assert_true(tick_to(runner, now, command, &target));
    return target;
}

#endif
