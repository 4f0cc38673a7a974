/* The packets, byte by byte as lab/drive/README.md says, and what is refused; the histogram; the
 * gamepad. */
#include <linux/joystick.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/random.h"
#include "drive/drive.h"
#include "drive/packet.h"
#include "drive/runner.h"
#include "files.h"

#define SA01_CRC 0x974b2030u
#define SA01_TEXT "974b2030"
#define GO1_CRC 0x83c4bf2cu
#define GO1_TEXT "83c4bf2c"

enum { JOINTS = 12, STATE_SIZE = 44 + 4 * (7 + 24) + 4, TARGET_SIZE = 44 + 4 * 48 + 4 };

static const PacketFormat format = {JOINTS, 0xcafe0123u, NULL};

static StatePacket any_state(void) {
    StatePacket state = {.mode = PACKET_walk,
                         .sequence = 0x01020304,
                         .answers = 7,
                         .time = 0x1122334455667788,
                         .session = 0x0102030405060708,
                         .peer = 0xa1a2a3a4a5a6a7a8,
                         .quaternion = {0.6f, 0, 0.8f, 0},
                         .angular_velocity = {1, 2, 3}};
    for (int i = 0; i < JOINTS; i++) {
        state.angle[i] = (float)i;
        state.speed[i] = (float)-i;
    }
    return state;
}

/* CRC-32 bit by bit: polynomial 0xEDB88320, all ones before and after. */
static uint32_t crc(const uint8_t *bytes, size_t size) {
    uint32_t c = 0xffffffffu;
    for (size_t i = 0; i < size; i++) {
        c ^= bytes[i];
        for (int b = 0; b < 8; b++) {
            c = c & 1 ? c >> 1 ^ 0xedb88320u : c >> 1;
        }
    }
    return ~c;
}

static uint32_t word(const uint8_t *bytes) {
    return bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static double number(const uint8_t *bytes) {
    const uint32_t bits = word(bytes);
    float value;
    memcpy(&value, &bits, sizeof value);
    return (double)value;
}

TEST(the_bytes) {
    uint8_t bytes[PACKET_MAX];
    const StatePacket state = any_state();
    assert_int_equal(packet_write_state(&state, &format, bytes), STATE_SIZE);
    assert_memory_equal(bytes, "MILD\2\1\14\1\4\3\2\1\7\0\0\0\x88\x77\x66\x55\x44\x33\x22\x11", 24);
    assert_memory_equal(bytes + 24,
                        "\10\7\6\5\4\3\2\1\xa8\xa7\xa6\xa5\xa4\xa3\xa2\xa1\x23\1\xfe\xca", 20);
    assert_true(number(bytes + 44) == (double)0.6f && number(bytes + 44 + 16) == 1);
    assert_true(number(bytes + 44 + 28 + 4 * 11) == 11 && number(bytes + STATE_SIZE - 8) == -11);
    assert_int_equal(word(bytes + STATE_SIZE - 4), crc(bytes, STATE_SIZE - 4));

    TargetPacket target = {.mode = PACKET_damp, .sequence = 9, .answers = 8, .time = 1};
    for (int i = 0; i < JOINTS; i++) {
        target.angle[i] = (float)i;
        target.kp[i] = 100;
        target.kd[i] = 2;
        target.limit[i] = (float)(50 + i);
    }
    assert_int_equal(packet_write_target(&target, &format, bytes), TARGET_SIZE);
    assert_memory_equal(bytes, "MILD\2\2\14\3\11\0\0\0\10\0\0\0\1\0\0\0\0\0\0\0", 24);
    assert_true(number(bytes + 44 + 4) == 1 && number(bytes + 44 + 48) == 100);
    assert_true(number(bytes + 44 + 96) == 2 && number(bytes + TARGET_SIZE - 8) == 61);
    assert_int_equal(word(bytes + TARGET_SIZE - 4), crc(bytes, TARGET_SIZE - 4));
}

TEST(there_and_back) {
    uint8_t bytes[PACKET_MAX];
    StatePacket state = any_state(), read = {0};
    size_t size = packet_write_state(&state, &format, bytes);
    assert_int_equal(packet_read_state(bytes, size, &format, &read), PACKET_FAULT_none);
    assert_true(read.mode == state.mode && read.sequence == state.sequence);
    assert_true(read.answers == state.answers && read.time == state.time);
    assert_true(read.session == state.session && read.peer == state.peer);
    assert_memory_equal(read.angle, state.angle, sizeof state.angle);
    assert_memory_equal(read.speed, state.speed, sizeof state.speed);
    assert_memory_equal(read.angular_velocity, state.angular_velocity,
                        sizeof read.angular_velocity);
    assert_true(fabs((double)read.quaternion[2] - 0.8) < 1e-6);
    TargetPacket target = {.mode = PACKET_hold, .limit = {1, 2}}, back = {0};
    size = packet_write_target(&target, &format, bytes);
    assert_int_equal(packet_read_target(bytes, size, &format, &back), PACKET_FAULT_none);
    assert_memory_equal(&back, &target, sizeof back);
    /* a quaternion that is a little too long is of length 1 afterwards */
    state.quaternion[0] = 0.62f;
    size = packet_write_state(&state, &format, bytes);
    assert_int_equal(packet_read_state(bytes, size, &format, &read), PACKET_FAULT_none);
    const double w = (double)read.quaternion[0], y = (double)read.quaternion[2];
    assert_true(fabs(w * w + y * y - 1) < 1e-6 && fabs(y / w - 0.8 / 0.62) < 1e-6);
}

/* Changes a byte and makes the checksum right again. */
static PacketFault with_byte(size_t at, uint8_t value) {
    uint8_t bytes[PACKET_MAX];
    StatePacket state = any_state();
    const size_t size = packet_write_state(&state, &format, bytes);
    bytes[at] = value;
    const uint32_t sum = crc(bytes, size - 4);
    for (int i = 0; i < 4; i++) {
        bytes[size - 4 + (size_t)i] = (uint8_t)(sum >> (8 * i));
    }
    return packet_read_state(bytes, size, &format, &state);
}

static PacketFault with_numbers(float quaternion, float speed) {
    uint8_t bytes[PACKET_MAX];
    StatePacket state = any_state();
    state.quaternion[1] = quaternion;
    state.speed[JOINTS - 1] = speed;
    const size_t size = packet_write_state(&state, &format, bytes);
    return packet_read_state(bytes, size, &format, &state);
}

TEST(what_is_refused) {
    uint8_t bytes[PACKET_MAX + 1];
    StatePacket state = any_state();
    TargetPacket target;
    const size_t size = packet_write_state(&state, &format, bytes);
    assert_int_equal(with_byte(3, 'X'), PACKET_FAULT_magic);
    assert_int_equal(with_byte(4, 1), PACKET_FAULT_version);
    assert_int_equal(with_byte(40, 0x24), PACKET_FAULT_robot);
    assert_int_equal(with_byte(5, 2), PACKET_FAULT_kind);
    assert_int_equal(with_byte(7, PACKET_MODES), PACKET_FAULT_kind);
    assert_int_equal(with_byte(6, 11), PACKET_FAULT_joints);
    assert_int_equal(with_numbers(NAN, 0), PACKET_FAULT_number);
    assert_int_equal(with_numbers(0.5f, 0), PACKET_FAULT_number);
    assert_int_equal(with_numbers(0, INFINITY), PACKET_FAULT_number);
    assert_int_equal(with_numbers(0, 1.1e6f), PACKET_FAULT_number);
    assert_int_equal(with_numbers(0, -1e6f), PACKET_FAULT_none);
    assert_int_equal(packet_read_target(bytes, size, &format, &target), PACKET_FAULT_kind);
    for (size_t cut = 0; cut < size; cut++) {
        assert_int_equal(packet_read_state(bytes, cut, &format, &state), PACKET_FAULT_size);
    }
    assert_int_equal(packet_read_state(bytes, size + 1, &format, &state), PACKET_FAULT_size);
    /* every single bit counts */
    for (size_t bit = 0; bit < 8 * size; bit++) {
        bytes[bit / 8] ^= (uint8_t)(1 << bit % 8);
        assert_int_not_equal(packet_read_state(bytes, size, &format, &state), PACKET_FAULT_none);
        bytes[bit / 8] ^= (uint8_t)(1 << bit % 8);
    }
    assert_int_equal(packet_read_state(bytes, size, &format, &state), PACKET_FAULT_none);
}

/* A target asks for no negative stiffness, damping or limit: such a joint would drive itself. */
TEST(negative_gains) {
    uint8_t bytes[PACKET_MAX];
    for (int part = 0; part < 4; part++) {
        TargetPacket target = {.mode = PACKET_walk}, read;
        float *const parts[] = {target.angle, target.kp, target.kd, target.limit};
        parts[part][JOINTS - 1] = -1;
        const size_t size = packet_write_target(&target, &format, bytes);
        assert_int_equal(packet_read_target(bytes, size, &format, &read),
                         part == 0 ? PACKET_FAULT_none : PACKET_FAULT_number);
    }
}

/* A packet of another robot, version or number of joints is refused with what is wrong and what to
 * do. The numbers are zlib.crc32(b"leg_l1_joint\nleg_l2_joint..."), by Python's zlib. */
TEST(another_robot) {
    char text[160];
    uint8_t bytes[PACKET_MAX];
    MildError error = {0};
    Robot *sa01 = robot_create(MILD_SOURCE_DIR "/robots/sa01", &error),
          *go1 = robot_create(MILD_SOURCE_DIR "/robots/go1", &error);
    assert_true(sa01 && go1);
    assert_int_equal(packet_robot(sa01), SA01_CRC);
    assert_int_equal(packet_robot(go1), GO1_CRC);
    const PacketFormat ours = {JOINTS, SA01_CRC, NULL}, theirs = {JOINTS, GO1_CRC, NULL},
                       small = {JOINTS - 1, SA01_CRC, NULL};
    StatePacket state = any_state(), read;
    size_t size = packet_write_state(&state, &theirs, bytes);
    PacketFault fault = packet_read_state(bytes, size, &ours, &read);
    assert_int_equal(fault, PACKET_FAULT_robot);
    packet_explain(fault, bytes, &ours, text, sizeof text);
    print_message("%s\n", text);
    assert_names(text, GO1_TEXT " " SA01_TEXT " --robot");
    size = packet_write_state(&state, &small, bytes);
    fault = packet_read_state(bytes, size, &ours, &read);
    assert_int_equal(fault, PACKET_FAULT_joints);
    assert_names(packet_explain(fault, bytes, &ours, text, sizeof text), "11 joints");
    bytes[4] = 1;
    fault = packet_read_state(bytes, size, &ours, &read);
    assert_names(packet_explain(fault, bytes, &ours, text, sizeof text), "version 1");
    assert_string_equal(packet_explain(PACKET_FAULT_size, bytes, &ours, text, sizeof text), "");
    robot_destroy(sa01);
    robot_destroy(go1);
}

/* The seal of a key is BLAKE2b (RFC 7693) of 16 bytes. These are of Python's
 * hashlib.blake2b(b"abc", key=bytes(range(32)), digest_size=16). */
TEST(a_key) {
    static const uint8_t of_abc[SEAL_SIZE] = {0x1a, 0x64, 0xbe, 0x47, 0xe4, 0x72, 0x9d, 0x95,
                                              0x1c, 0x30, 0x2e, 0xe5, 0x43, 0xf9, 0x7c, 0xf3};
    uint8_t bytes[PACKET_MAX];
    char text[160];
    Key key = {.size = 32}, other;
    for (int i = 0; i < 32; i++) {
        key.bytes[i] = (uint8_t)i;
    }
    other = key;
    other.bytes[31] ^= 1;
    key_seal(&key, (const uint8_t *)"abc", 3, bytes);
    assert_memory_equal(bytes, of_abc, SEAL_SIZE);

    const PacketFormat sealed = {JOINTS, format.robot, &key},
                       wrong = {JOINTS, format.robot, &other};
    StatePacket state = any_state(), read;
    TargetPacket target = {.mode = PACKET_walk};
    size_t size = packet_write_state(&state, &sealed, bytes);
    assert_int_equal(size, STATE_SIZE - 4 + SEAL_SIZE);
    assert_int_equal(packet_read_state(bytes, size, &sealed, &read), PACKET_FAULT_none);
    assert_int_equal(packet_read_state(bytes, size, &wrong, &read), PACKET_FAULT_key);
    assert_int_equal(packet_read_state(bytes, size, &format, &read), PACKET_FAULT_key);
    assert_names(packet_explain(PACKET_FAULT_key, bytes, &format, text, sizeof text), "--key FILE");
    for (size_t bit = 0; bit < 8 * size; bit++) { /* every single bit counts */
        bytes[bit / 8] ^= (uint8_t)(1 << bit % 8);
        assert_int_not_equal(packet_read_state(bytes, size, &sealed, &read), PACKET_FAULT_none);
        bytes[bit / 8] ^= (uint8_t)(1 << bit % 8);
    }
    bytes[5] = PACKET_TARGET; /* a state is no target, also where the sizes agree */
    assert_int_not_equal(packet_read_target(bytes, size, &sealed, &target), PACKET_FAULT_none);
    size = packet_write_state(&state, &format, bytes);
    assert_int_equal(packet_read_state(bytes, size, &sealed, &read), PACKET_FAULT_key);
    size = packet_write_target(&target, &sealed, bytes);
    assert_int_equal(packet_read_target(bytes, size, &sealed, &target), PACKET_FAULT_none);
    assert_int_equal(packet_read_target(bytes, size, &wrong, &target), PACKET_FAULT_key);
}

static MildStatus read_key(const char *path, size_t size, mode_t mode, MildError *error) {
    static const uint8_t zeros[100];
    Key key;
    kit_write(path, zeros, size);
    assert_int_equal(chmod(path, mode), 0);
    const MildStatus status = key_read(path, &key, error);
    assert_true(status != MILD_OK || key.size == size);
    return status;
}

TEST(key_files) {
    char path[] = "/tmp/mild_key_XXXXXX", names[64];
    MildError error = {0};
    uint64_t one, two;
    close(mkstemp(path));
    assert_int_equal(read_key(path, 32, 0600, &error), MILD_OK);
    assert_int_equal(read_key(path, 64, 0400, &error), MILD_OK);
    snprintf(names, sizeof names, "--key %s 31 32 64", path);
    assert_int_not_equal(read_key(path, 31, 0600, &error), MILD_OK);
    assert_error(&error, MILD_ERROR_ARGUMENT, names);
    snprintf(names, sizeof names, "--key %s 65 32 64 /dev/urandom", path);
    assert_int_not_equal(read_key(path, 65, 0600, &error), MILD_OK);
    assert_error(&error, MILD_ERROR_ARGUMENT, names);
    snprintf(names, sizeof names, "--key %s chmod 600", path);
    assert_int_not_equal(read_key(path, 32, 0640, &error), MILD_OK);
    assert_error(&error, MILD_ERROR_ARGUMENT, names);
    assert_int_not_equal(read_key(path, 32, 0604, &error), MILD_OK);
    unlink(path);
    assert_int_equal(key_draw_session(&one, &error), MILD_OK);
    assert_int_equal(key_draw_session(&two, &error), MILD_OK);
    assert_true(one != 0 && one != two);
}

TEST(the_histogram) {
    Times times = {0};
    assert_true(times_quantile(&times, 0.5) == 0);
    for (int i = 1; i <= 10000; i++) {
        times_add(&times, 1e-6 * i); /* 1 us to 10 ms */
    }
    const double half = times_quantile(&times, 0.5), most = times_quantile(&times, 0.999);
    assert_true(half >= 5e-3 && half < 5e-3 * 1.11 && most >= 9.99e-3 && most <= 1e-2);
    assert_true(times.longest == 1e-2 && times.count == 10000);
    times_add(&times, -1), times_add(&times, 0), times_add(&times, 1e9);
    assert_true(times.bin[0] >= 2 && times.bin[TIMES_BINS - 1] == 1);
    assert_true(times_quantile(&times, 1) == 1e9);
    assert_true(fabs(times_edge(TIMES_DECADE) / 1e-5 - 1) < 1e-12);
}

static int play(Input *input, int file, uint8_t type, uint8_t index, int16_t value) {
    const struct js_event event = {0, value, type, index};
    assert_int_equal(write(file, &event, sizeof event), sizeof event);
    return input_poll(input);
}

/* A pipe in the place of the device. */
TEST(the_gamepad) {
    const double start[3] = {0.3, 0, 0}, range[3] = {1.2, 0.4, 1.5};
    MildError error = {0};
    Input input;
    int ends[2];
    char path[64];
    assert_int_equal(pipe(ends), 0);
    snprintf(path, sizeof path, "/dev/fd/%d", ends[0]);
    assert_int_equal(input_open(&input, start, range, 0, path, &error), MILD_OK);
    assert_int_equal(input_poll(&input), 0);
    /* a stick that is held from the start on, or is stuck, does nothing until it was at rest */
    assert_int_equal(play(&input, ends[1], JS_EVENT_AXIS | JS_EVENT_INIT, 1, -32767), 0);
    assert_int_equal(play(&input, ends[1], JS_EVENT_AXIS, 1, -30000), 0);
    assert_true(input.command[0] == 0.3);
    for (uint8_t axis = 0; axis < 4; axis++) {
        assert_int_equal(play(&input, ends[1], JS_EVENT_AXIS | JS_EVENT_INIT, axis, 0), 0);
    }
    assert_true(input.command[0] == 0.3);                                 /* until a stick moves */
    assert_int_equal(play(&input, ends[1], JS_EVENT_AXIS, 1, -32767), 0); /* up: forward */
    assert_true(input.command[0] == 1.2 && input.command[1] == 0);
    assert_int_equal(play(&input, ends[1], JS_EVENT_AXIS, 1, 32767), 0);
    assert_true(input.command[0] == -1.2);
    assert_int_equal(play(&input, ends[1], JS_EVENT_AXIS, 0, 16384), 0); /* right */
    assert_true(fabs(input.command[1] + 0.2) < 1e-4);
    assert_int_equal(play(&input, ends[1], JS_EVENT_AXIS, 3, -16384), 0); /* left: turns left */
    assert_true(fabs(input.command[2] - 0.75) < 1e-4);
    assert_int_equal(play(&input, ends[1], JS_EVENT_AXIS, 3, 3000), 0); /* at rest */
    assert_true(input.command[2] == 0);
    assert_int_equal(play(&input, ends[1], JS_EVENT_AXIS, 7, 32767), 0); /* another axis */
    assert_int_equal(play(&input, ends[1], JS_EVENT_BUTTON, 0, 1), 0);
    assert_int_equal(play(&input, ends[1], JS_EVENT_BUTTON, 1, 0), 0);
    assert_int_equal(play(&input, ends[1], JS_EVENT_BUTTON | JS_EVENT_INIT, 1, 1), 0);
    assert_int_equal(play(&input, ends[1], JS_EVENT_BUTTON, 1, 1), 1);
    assert_int_equal(play(&input, ends[1], JS_EVENT_AXIS, 1, -32767), 0);
    close(ends[1]); /* unplugged */
    assert_int_equal(input_poll(&input), 0);
    assert_true(input.command[0] == 0 && input.gamepad == -1);
    input_close(&input);
    close(ends[0]);
    assert_int_not_equal(input_open(&input, start, range, 0, "/dev/input/none", &error), MILD_OK);
    assert_error(&error, MILD_ERROR_IO, "--gamepad /dev/input/none");
    assert_int_not_equal(input_open(&input, start, range, 0, "/dev/null", &error), MILD_OK);
    assert_error(&error, MILD_ERROR_ARGUMENT, "--gamepad /dev/null");
}

TEST_MAIN(NULL, NULL)
