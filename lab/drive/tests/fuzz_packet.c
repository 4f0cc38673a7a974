/* Any bytes as packets of a robot, and any numbers in a whole state, to a runner with limits and to
 * one without: refused, or every number that it sends back is finite and within its bounds. */
#include <unistd.h>

#include "drive/runner.h"
#include "fuzz.h"
#include "learn/policy.h"

enum { JOINTS = 12, STEPS_MAX = 40, GREETINGS = 5, SESSION = 77, ROBOT_SESSION = 78, SENDER = 79 };

static Robot *robot;
static TaskDef task;
static PacketFormat format = {.joints = JOINTS};
static char narrow[] = "/tmp/fuzz_packet_XXXXXX"; /* file of the policy */

static void remove_policy(void) {
    unlink(narrow);
}

/* The shipped policy's shape with hidden layers of four, because each input reads the file anew. */
static void write_policy(void) {
    MildError error = {0};
    const int file = mkstemp(narrow);
    Policy *shipped = policy_load(MILD_SOURCE_DIR "/policies/mild.safetensors", NULL, 0, &error);
    fuzz_check(file >= 0 && shipped != NULL);
    close(file);
    atexit(remove_policy);
    PolicyDef def = *policy_def(shipped);
    int *const hidden[] = {def.encoder_hidden, def.decoder_hidden, def.actor_hidden,
                           def.critic_hidden};
    for (int n = 0; n < 4; n++) {
        memset(hidden[n], 0, sizeof def.encoder_hidden);
        hidden[n][0] = 4;
    }
    Policy *policy = policy_create(&def, 1, &error);
    fuzz_check(policy && policy_save(policy, narrow, "", &error) == MILD_OK);
    policy_destroy(policy);
    policy_destroy(shipped);
}

static Runner *make_runner(int limited) {
    MildError error = {0};
    if (!robot) {
        robot = robot_create(MILD_SOURCE_DIR "/robots/sa01", &error);
        format.robot = packet_robot(robot);
        task = task_def_default();
        task_def_make_nominal(&task);
        write_policy();
    }
    const RunnerDef def = {.policy = narrow,
                           .robot = robot,
                           .task = &task,
                           .late = 0.02,
                           .damp_after = 0.1,
                           .stall_after = 0.05,
                           .glitch = 0.02,
                           .session = SESSION,
                           .turn_limit = limited ? 10 : 0,
                           .speed_limit = limited ? 30 : 0,
                           .angle_limit = limited ? 0.2 : -1,
                           .torque_share = 1};
    Runner *runner = runner_create(&def, &error);
    fuzz_check(runner != NULL);
    return runner;
}

static float take_float(Bytes *bytes) {
    uint8_t raw[4];
    float number;
    for (int i = 0; i < 4; i++) {
        raw[i] = (uint8_t)take_byte(bytes);
    }
    memcpy(&number, raw, sizeof number);
    return number;
}

/* A state with a right checksum: numbers near those of a standing robot, or any. */
static size_t write_state(Bytes *bytes, uint32_t step, uint8_t *packet) {
    const int wild = take_below(bytes, 4) == 0;
    StatePacket state = {.mode = (PacketMode)take_below(bytes, PACKET_MODES),
                         .sequence = step + (uint32_t)take_below(bytes, 3) - 1,
                         .time = 10000u * step + 100u * take_byte(bytes),
                         .session = take_below(bytes, 32) ? ROBOT_SESSION : take_byte(bytes),
                         .peer = take_below(bytes, 32) ? SESSION : take_byte(bytes),
                         .quaternion = {1, 0, 0, 0}};
    for (int i = 0; i < JOINTS; i++) {
        state.angle[i] = (float)robot_default_pose(robot)[i];
    }
    float *number = wild ? &state.angle[take_below(bytes, JOINTS)] : &state.angular_velocity[0];
    *number = take_float(bytes);
    state.speed[take_below(bytes, JOINTS)] =
        take_below(bytes, 4) ? (float)take_byte(bytes) / 4 - 32 : take_float(bytes);
    return packet_write_state(&state, &format, packet);
}

static void check_target(const uint8_t *packet, size_t size) {
    TargetPacket target;
    fuzz_check(packet_read_target(packet, size, &format, &target) == PACKET_FAULT_none);
    for (int i = 0; i < JOINTS; i++) {
        fuzz_check(target.kp[i] >= 0 && target.kd[i] > 0 && target.limit[i] > 0);
        fuzz_check(target.mode == PACKET_walk || target.mode == PACKET_hold || target.kp[i] == 0);
    }
}

/* Good states, until the runner walks. */
static double greet(Runner *runner) {
    double now = 1;
    for (uint32_t k = 0; k < GREETINGS; k++, now += 0.005) {
        uint8_t packet[PACKET_MAX];
        StatePacket state = {.mode = PACKET_walk,
                             .sequence = 0u - GREETINGS + k,
                             .time = k,
                             .session = ROBOT_SESSION,
                             .peer = SESSION,
                             .quaternion = {1, 0, 0, 0}};
        for (int i = 0; i < JOINTS; i++) {
            state.angle[i] = (float)robot_default_pose(robot)[i];
        }
        const size_t size = packet_write_state(&state, &format, packet);
        fuzz_check(runner_take(runner, packet, size, SENDER, now) == PACKET_FAULT_none);
    }
    return now;
}

static void run(Runner *runner, Bytes *bytes) {
    double now = take_below(bytes, 8) ? greet(runner) : 1;
    for (uint32_t step = 1; step < STEPS_MAX && bytes->at < bytes->end; step++) {
        const double command[3] = {take_number(bytes, 2), take_number(bytes, 2), 0};
        uint8_t packet[PACKET_MAX];
        const size_t size = write_state(bytes, step, packet);
        if (take_below(bytes, 8) == 0) {
            packet[take_byte(bytes) % size] ^= (uint8_t)take_byte(bytes);
        }
        runner_take(runner, packet, size, SENDER, now);
        now += 1e-4 * take_byte(bytes);
        const size_t sent = runner_tick(runner, now, command, packet);
        if (sent > 0) {
            check_target(packet, sent);
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    StatePacket state;
    TargetPacket target;
    static const Key key = {KEY_SIZE_MIN, {0}};
    PacketFormat any = {.joints =
                            size > 6 && data[6] >= 1 && data[6] <= ROBOT_JOINTS_MAX ? data[6] : 1,
                        .key = size > 7 && data[7] & 1 ? &key : NULL};
    char text[200];
    const PacketFault fault = packet_read_state(data, size, &any, &state);
    packet_explain(fault, data, &any, text, sizeof text);
    packet_read_target(data, size, &any, &target);
    if (fuzz_sample(data, size, 4)) { /* a runner reads its policy */
        Bytes bytes = {data, data + size};
        Runner *runner = make_runner(take_below(&bytes, 2));
        run(runner, &bytes);
        runner_destroy(runner);
    }
    return 0;
}
