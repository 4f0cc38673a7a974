#include "drive/packet.h"

#include <math.h>
#include <string.h>
#include <zlib.h>

#define MODE_NAME(name, what) #name,
const char *const packet_modes[PACKET_MODES] = {PACKET_MODE_LIST(MODE_NAME)};
#undef MODE_NAME
#define FAULT_NAME(name) #name,
const char *const packet_faults[PACKET_FAULTS] = {PACKET_FAULT_LIST(FAULT_NAME)};
#undef FAULT_NAME

#define NUMBER_MAX 1e6f /* in any unit: beyond it something is wrong */

static const char magic[4] = {'M', 'I', 'L', 'D'};

typedef struct {
    uint8_t *at;
} Writer;

typedef struct {
    const uint8_t *at;
    int sound; /* bool: all floats so far are finite and not huge */
} Reader;

static void put(Writer *w, uint64_t number, int bytes) {
    for (int i = 0; i < bytes; i++) {
        *w->at++ = (uint8_t)(number >> (8 * i));
    }
}

static uint64_t take(Reader *r, int bytes) {
    uint64_t number = 0;
    for (int i = 0; i < bytes; i++) {
        number |= (uint64_t)*r->at++ << (8 * i);
    }
    return number;
}

static void put_floats(Writer *w, const float *numbers, int count) {
    for (int i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &numbers[i], sizeof bits);
        put(w, bits, 4);
    }
}

static void take_floats(Reader *r, float *numbers, int count) {
    for (int i = 0; i < count; i++) {
        const uint32_t bits = (uint32_t)take(r, 4);
        memcpy(&numbers[i], &bits, sizeof bits);
        r->sound = r->sound && fabsf(numbers[i]) <= NUMBER_MAX; /* false for one that is none */
    }
}

static int state_floats(int joints) {
    return 7 + 2 * joints;
}

static int target_floats(int joints) {
    return 4 * joints;
}

static size_t whole_size(int floats) {
    return PACKET_HEAD + 4 * (size_t)floats + 4;
}

/* ---- writing ---- */

static Writer begin(uint8_t *bytes, PacketKind kind, int joints, PacketMode mode, uint32_t sequence,
                    uint32_t answers, uint64_t time) {
    Writer w = {bytes};
    memcpy(w.at, magic, sizeof magic);
    w.at += sizeof magic;
    put(&w, PACKET_VERSION, 1);
    put(&w, kind, 1);
    put(&w, (uint64_t)joints, 1);
    put(&w, mode, 1);
    put(&w, sequence, 4);
    put(&w, answers, 4);
    put(&w, time, 8);
    return w;
}

static size_t seal(Writer *w, uint8_t *bytes) {
    put(w, crc32(0, bytes, (uInt)(w->at - bytes)), 4);
    return (size_t)(w->at - bytes);
}

size_t packet_write_state(const StatePacket *state, int joints, uint8_t *bytes) {
    Writer w = begin(bytes, PACKET_STATE, joints, state->mode, state->sequence, state->answers,
                     state->time);
    put_floats(&w, state->quaternion, 4);
    put_floats(&w, state->angular_velocity, 3);
    put_floats(&w, state->angle, joints);
    put_floats(&w, state->speed, joints);
    return seal(&w, bytes);
}

size_t packet_write_target(const TargetPacket *target, int joints, uint8_t *bytes) {
    Writer w = begin(bytes, PACKET_TARGET, joints, target->mode, target->sequence, target->answers,
                     target->time);
    put_floats(&w, target->angle, joints);
    put_floats(&w, target->kp, joints);
    put_floats(&w, target->kd, joints);
    put_floats(&w, target->limit, joints);
    return seal(&w, bytes);
}

/* ---- reading ---- */

/* Everything but the floats. */
static PacketFault check(const uint8_t *bytes, size_t size, PacketKind kind, int joints) {
    if (size < PACKET_HEAD + 4) {
        return PACKET_FAULT_size;
    }
    if (memcmp(bytes, magic, sizeof magic) != 0) {
        return PACKET_FAULT_magic;
    }
    if (bytes[4] != PACKET_VERSION) {
        return PACKET_FAULT_version;
    }
    if (bytes[5] != kind || bytes[7] >= PACKET_MODES) {
        return PACKET_FAULT_kind;
    }
    if (bytes[6] != joints) {
        return PACKET_FAULT_joints;
    }
    if (size != whole_size(kind == PACKET_STATE ? state_floats(joints) : target_floats(joints))) {
        return PACKET_FAULT_size;
    }
    Reader end = {bytes + size - 4, 1};
    return take(&end, 4) == crc32(0, bytes, (uInt)(size - 4)) ? PACKET_FAULT_none
                                                              : PACKET_FAULT_checksum;
}

static Reader begin_reading(const uint8_t *bytes, PacketMode *mode, uint32_t *sequence,
                            uint32_t *answers, uint64_t *time) {
    Reader r = {bytes + 7, 1};
    *mode = (PacketMode)take(&r, 1);
    *sequence = (uint32_t)take(&r, 4);
    *answers = (uint32_t)take(&r, 4);
    *time = take(&r, 8);
    return r;
}

/* Bool: the quaternion is nearly of length 1, and is exactly so afterwards. */
static int normalise(float quaternion[4]) {
    double sum = 0;
    for (int i = 0; i < 4; i++) {
        sum += (double)quaternion[i] * (double)quaternion[i];
    }
    for (int i = 0; i < 4; i++) {
        quaternion[i] = (float)((double)quaternion[i] / sqrt(sum));
    }
    return sum > 0.9 && sum < 1.1;
}

PacketFault packet_read_state(const uint8_t *bytes, size_t size, int joints, StatePacket *state) {
    PacketFault fault = check(bytes, size, PACKET_STATE, joints);
    if (fault != PACKET_FAULT_none) {
        return fault;
    }
    Reader r = begin_reading(bytes, &state->mode, &state->sequence, &state->answers, &state->time);
    take_floats(&r, state->quaternion, 4);
    take_floats(&r, state->angular_velocity, 3);
    take_floats(&r, state->angle, joints);
    take_floats(&r, state->speed, joints);
    return r.sound && normalise(state->quaternion) ? PACKET_FAULT_none : PACKET_FAULT_number;
}

PacketFault packet_read_target(const uint8_t *bytes, size_t size, int joints,
                               TargetPacket *target) {
    PacketFault fault = check(bytes, size, PACKET_TARGET, joints);
    if (fault != PACKET_FAULT_none) {
        return fault;
    }
    Reader r =
        begin_reading(bytes, &target->mode, &target->sequence, &target->answers, &target->time);
    take_floats(&r, target->angle, joints);
    take_floats(&r, target->kp, joints);
    take_floats(&r, target->kd, joints);
    take_floats(&r, target->limit, joints);
    return r.sound ? PACKET_FAULT_none : PACKET_FAULT_number;
}
