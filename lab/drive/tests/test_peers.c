/* Who the runner listens to: greetings, strangers, other sessions, garbage. */
#include "runner_kit.h"

#include "base/random.h"

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
