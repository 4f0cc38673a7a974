/* The runner with time that the test gives: its targets are those of the task's own environment;
 * lost, late and old packets; a dead robot; commands; the end. */
#include "runner_kit.h"

#include "control/speed_hold.h"
#include "run/eval/scene.h"

/* ---- the task's own environment ---- */

typedef struct {
    TaskEnv *env;
    RobotSim *sim;
    Controller controller;
    float action[JOINTS];
} World;

static World make_world(void) {
    MildError error = {0};
    const EnvsView none = {0};
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
TEST(the_same_as_the_task) {
    const EnvsView none = {0};
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

/* Eight seconds of a walk whose speed is held: the runner commands what a speed hold makes of the
 * task's own frames. */
TEST(the_speed_is_held_as_in_the_task) {
    const EnvsView none = {0};
    SpeedHold hold = {.cycles = {0}};
    World w = make_world();
    noisy.speed_hold = 0.1;
    const SpeedHoldDef held = speed_hold_def(&noisy, robot, &w.controller);
    Runner *runner = make_runner();
    noisy.speed_hold = 0;
    double worst = 0;
    for (uint32_t k = 0; k < 800; k++) {
        const double now = 0.01 * k;
        const StatePacket state = state_of(&w, k + 1, now);
        double command[3] = {forward[0], 0, 0};
        give(runner, &state, now);
        const TargetPacket target = tick(runner, now, forward);
        w.controller.act(w.controller.self, 1, &w.env, w.action);
        for (int i = 0; i < JOINTS; i++) {
            const double kp = robot_kp(robot)[i], limit = 0.85 * robot_effort(robot)[i];
            const double wanted = robot_default_pose(robot)[i] + 0.5 * (double)w.action[i];
            const double torque = kp * (wanted - (double)state.angle[i]) -
                                  robot_kd(robot)[i] * (double)state.speed[i];
            if (fabs(torque) <= limit) {
                worst = fmax(worst, fabs((double)target.angle[i] - wanted));
            }
        }
        speed_hold(&hold, &held, task_env_frame(w.env), controller_estimates(&w.controller, 0),
                   command);
        memcpy(w.env->command, command, sizeof command);
        assert_true(!task_env_step(w.env, &task, robot, w.sim, w.action, 0, &none, NULL).done);
    }
    print_message("targets within %.1e, a command of %.4f m/s\n", worst, w.env->command[0]);
    assert_true(fabs(w.env->command[0] - forward[0]) > 1e-3);
    assert_true(worst < 2e-5);
    runner_destroy(runner);
    free_world(&w);
}

/* ---- packets on bad ways ---- */

/* Nothing before the first state; then a state for every tick but some. */
TEST(lost_states) {
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
TEST(old_states) {
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
    state = standing(12 + 0x7fffffffu, 0.02);
    give(runner, &state, 0.02);
    state = standing(3, 0.03);
    give(runner, &state, 0.03);
    assert_int_equal(report->reordered, 2);
    /* a newer number at an older time */
    state = standing(4, 0.029);
    give(runner, &state, 0.04);
    assert_int_equal(report->reordered, 3);
    runner_destroy(runner);
}

/* Ways of 3 ms; then some of 35 ms, in order; then all of them. */
TEST(late_states) {
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
TEST(a_slow_clock) {
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
TEST(a_dead_robot) {
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

/* The runner itself stood still, though the robot's states are young. */
TEST(a_stall) {
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

/* Commands end at the task's ranges, and what is no number is 0: by the action that comes out. */
TEST(commands) {
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

/* A robot ends the run once it walks, by a packet that is new and in time. Others are counted. */
TEST(the_end) {
    uint8_t bytes[PACKET_MAX];
    const PacketFormat format = {JOINTS, packet_robot(robot), NULL};
    Runner *runner = make_runner();
    StatePacket end = standing(3, 0), state = standing(100, 0);
    end.mode = PACKET_end;
    assert_int_equal(take(runner, &end, -1), PACKET_FAULT_none); /* of no robot that walks */
    assert_true(runner_sender(runner) == 0 && runner_end(runner, 5, bytes) == 0);
    runner_destroy(runner);
    runner = make_runner();
    const RunnerReport *report = runner_report(runner);
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
    assert_error(&error, MILD_ERROR_IO, "no_such.safetensors");
}

TEST_MAIN(setup, teardown)
