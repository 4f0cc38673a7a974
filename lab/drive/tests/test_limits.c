/* States that no robot can be in, one that is tilted, and torques that it shall not get. */
#include "runner_kit.h"

#include "base/random.h"

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
TEST(a_glitch) {
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
TEST(impossible_states) {
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
TEST(many_glitches) {
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
TEST(what_the_policy_is_shown) {
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
TEST(a_tilt) {
    for (int sign = -1; sign <= 1; sign += 2) {
        Runner *runner = make_runner();
        for (uint32_t k = 0; k < 22; k++) {
            const double pitch = 0.02 + 0.05 * k; /* the limit is 1 */
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

/* A tenth of the torque: 11.9 N m at the knee, which is 1.5 rad off and moves. */
TEST(a_share_of_the_torque) {
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

/* ---- who the runner listens to: greetings, strangers, other sessions, garbage ---- */

/* Nothing is sent before five good states in a row, and until the robot has answered no more
 * packets than it sent, which have no stiffness. */
TEST(a_greeting) {
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
TEST(a_broken_greeting) {
    for (int how = 0; how < 3; how++) {
        Runner *runner = make_runner();
        TargetPacket target;
        double now = 0;
        for (uint32_t k = 0; k < 4 + GREETINGS; k++) {
            now += how == 1 && k == 4 ? 0.2 : 0.01;
            StatePacket state = standing(2 * k + 10, now);
            state.session += how == 2 && k >= 4;
            if (how == 0 && k == 4) {
                StatePacket bad = standing(2 * k + 9, now);
                bad.angular_velocity[0] = 1e5f;
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
TEST(a_stranger) {
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
TEST(the_peer) {
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
TEST(other_sessions) {
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

/* Garbage of any size, and states with a few bits changed: refused, and nothing changes. */
TEST(garbage) {
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

TEST_MAIN(setup, teardown)
