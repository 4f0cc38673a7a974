#include "drive/packet.h"

#include <math.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <zlib.h>

#include "base/file.h"

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
} PacketWriter;

typedef struct {
    const uint8_t *at;
    int sound; /* bool: all floats so far are finite and not huge */
} PacketReader;

static void put(PacketWriter *w, uint64_t number, int bytes) {
    for (int i = 0; i < bytes; i++) {
        *w->at++ = (uint8_t)(number >> (8 * i));
    }
}

static uint64_t take(PacketReader *r, int bytes) {
    uint64_t number = 0;
    for (int i = 0; i < bytes; i++) {
        number |= (uint64_t)*r->at++ << (8 * i);
    }
    return number;
}

static void put_floats(PacketWriter *w, const float *numbers, int count) {
    for (int i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &numbers[i], sizeof bits);
        put(w, bits, 4);
    }
}

static void take_floats(PacketReader *r, float *numbers, int count) {
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

static size_t body_size(PacketKind kind, int joints) {
    return PACKET_HEAD +
           4 * (size_t)(kind == PACKET_STATE ? state_floats(joints) : target_floats(joints));
}

uint32_t packet_robot(const Robot *robot) {
    uLong crc = 0;
    for (int i = 0; i < robot_joints(robot); i++) {
        const char *name = robot_joint_name(robot, i);
        crc = i > 0 ? crc32(crc, (const Bytef *)"\n", 1) : crc;
        crc = crc32(crc, (const Bytef *)name, (uInt)strlen(name));
    }
    return (uint32_t)crc;
}

/* ---- writing ---- */

/* What both kinds of packets begin with. */
typedef struct {
    PacketMode mode;
    uint32_t sequence, answers;
    uint64_t time, session, peer;
} Head;

static PacketWriter begin(uint8_t *bytes, PacketKind kind, const PacketFormat *format,
                          const Head *head) {
    PacketWriter w = {bytes};
    memcpy(w.at, magic, sizeof magic);
    w.at += sizeof magic;
    put(&w, PACKET_VERSION, 1);
    put(&w, kind, 1);
    put(&w, (uint64_t)format->joints, 1);
    put(&w, head->mode, 1);
    put(&w, head->sequence, 4);
    put(&w, head->answers, 4);
    put(&w, head->time, 8);
    put(&w, head->session, 8);
    put(&w, head->peer, 8);
    put(&w, format->robot, 4);
    return w;
}

static size_t seal_size(const Key *key) {
    return key ? SEAL_SIZE : 4;
}

static size_t seal(PacketWriter *w, const PacketFormat *format, uint8_t *bytes) {
    const size_t size = (size_t)(w->at - bytes);
    if (format->key) {
        key_seal(format->key, bytes, size, w->at);
    } else {
        put(w, crc32(0, bytes, (uInt)size), 4);
    }
    return size + seal_size(format->key);
}

size_t packet_write_state(const StatePacket *s, const PacketFormat *format, uint8_t *bytes) {
    const Head head = {s->mode, s->sequence, s->answers, s->time, s->session, s->peer};
    PacketWriter w = begin(bytes, PACKET_STATE, format, &head);
    put_floats(&w, s->quaternion, 4);
    put_floats(&w, s->angular_velocity, 3);
    put_floats(&w, s->angle, format->joints);
    put_floats(&w, s->speed, format->joints);
    return seal(&w, format, bytes);
}

size_t packet_write_target(const TargetPacket *t, const PacketFormat *format, uint8_t *bytes) {
    const Head head = {t->mode, t->sequence, t->answers, t->time, t->session, t->peer};
    PacketWriter w = begin(bytes, PACKET_TARGET, format, &head);
    put_floats(&w, t->angle, format->joints);
    put_floats(&w, t->kp, format->joints);
    put_floats(&w, t->kd, format->joints);
    put_floats(&w, t->limit, format->joints);
    return seal(&w, format, bytes);
}

/* ---- reading ---- */

static uint32_t robot_of(const uint8_t *bytes) {
    PacketReader r = {bytes + PACKET_HEAD - 4, 1};
    return (uint32_t)take(&r, 4);
}

/* The end of a packet: its size, and the seal. */
static PacketFault check_seal(const uint8_t *bytes, size_t size, size_t body, const Key *key) {
    if (size != body + seal_size(key)) { /* perhaps as without a key, or as with one */
        return size == body + 4 || size == body + SEAL_SIZE ? PACKET_FAULT_key : PACKET_FAULT_size;
    }
    if (key) {
        return key_fits(key, bytes, body, bytes + body) ? PACKET_FAULT_none : PACKET_FAULT_key;
    }
    PacketReader end = {bytes + body, 1};
    return take(&end, 4) == crc32(0, bytes, (uInt)body) ? PACKET_FAULT_none : PACKET_FAULT_checksum;
}

/* Everything but the floats. */
static PacketFault check(const uint8_t *bytes, size_t size, PacketKind kind,
                         const PacketFormat *format) {
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
    if (bytes[6] != format->joints) {
        return PACKET_FAULT_joints;
    }
    if (robot_of(bytes) != format->robot) {
        return PACKET_FAULT_robot;
    }
    return check_seal(bytes, size, body_size(kind, format->joints), format->key);
}

const char *packet_explain(PacketFault fault, const uint8_t *bytes, const PacketFormat *format,
                           char *text, size_t size) {
    text[0] = '\0';
    if (fault == PACKET_FAULT_version) {
        snprintf(text, size, "it has version %d of the packets, and this program has %d", bytes[4],
                 PACKET_VERSION);
    } else if (fault == PACKET_FAULT_joints) {
        snprintf(text, size, "its robot has %d joints, and that of the policy %d; see --robot",
                 bytes[6], format->joints);
    } else if (fault == PACKET_FAULT_robot) {
        snprintf(text, size,
                 "it is of robot %08x, and the policy is for %08x: other names of joints, or "
                 "another order; see --robot",
                 (unsigned)robot_of(bytes), (unsigned)format->robot);
    } else if (fault == PACKET_FAULT_key) {
        snprintf(text, size,
                 format->key ? "it is not sealed with the key of --key"
                             : "it is sealed with a key; name its file, --key FILE");
    }
    return text;
}

static PacketReader begin_reading(const uint8_t *bytes, Head *head) {
    PacketReader r = {bytes + 7, 1};
    head->mode = (PacketMode)take(&r, 1);
    head->sequence = (uint32_t)take(&r, 4);
    head->answers = (uint32_t)take(&r, 4);
    head->time = take(&r, 8);
    head->session = take(&r, 8);
    head->peer = take(&r, 8);
    r.at += 4; /* the robot, which was compared */
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

PacketFault packet_read_state(const uint8_t *bytes, size_t size, const PacketFormat *format,
                              StatePacket *state) {
    const PacketFault fault = check(bytes, size, PACKET_STATE, format);
    Head h;
    if (fault != PACKET_FAULT_none) {
        return fault;
    }
    PacketReader r = begin_reading(bytes, &h);
    *state =
        (StatePacket){h.mode, h.sequence, h.answers, h.time, h.session, h.peer, {0}, {0}, {0}, {0}};
    take_floats(&r, state->quaternion, 4);
    take_floats(&r, state->angular_velocity, 3);
    take_floats(&r, state->angle, format->joints);
    take_floats(&r, state->speed, format->joints);
    return r.sound && normalise(state->quaternion) ? PACKET_FAULT_none : PACKET_FAULT_number;
}

/* Bool: none is negative. */
static int none_negative(const float *numbers, int count) {
    int positive = 1;
    for (int i = 0; i < count; i++) {
        positive = positive && numbers[i] >= 0;
    }
    return positive;
}

PacketFault packet_read_target(const uint8_t *bytes, size_t size, const PacketFormat *format,
                               TargetPacket *target) {
    const PacketFault fault = check(bytes, size, PACKET_TARGET, format);
    const int joints = format->joints;
    Head h;
    if (fault != PACKET_FAULT_none) {
        return fault;
    }
    PacketReader r = begin_reading(bytes, &h);
    *target = (TargetPacket){h.mode, h.sequence, h.answers, h.time, h.session,
                             h.peer, {0},        {0},       {0},    {0}};
    take_floats(&r, target->angle, joints);
    take_floats(&r, target->kp, joints);
    take_floats(&r, target->kd, joints);
    take_floats(&r, target->limit, joints);
    return r.sound && none_negative(target->kp, joints) && none_negative(target->kd, joints) &&
                   none_negative(target->limit, joints)
               ? PACKET_FAULT_none
               : PACKET_FAULT_number;
}

#define REMEDY "make one with: (umask 077; head -c 32 /dev/urandom >%.200s)"

MildStatus key_read(const char *path, Key *key, MildError *error) {
    struct stat about;
    char *bytes = file_read(path, 1 << 16, &key->size, error);
    if (!bytes) {
        return error->status;
    }
    MildStatus status = MILD_OK;
    if (key->size < KEY_SIZE_MIN || key->size > KEY_SIZE_MAX) {
        status = mild_fail(error, MILD_ERROR_ARGUMENT,
                           "--key: %.200s has %zu bytes, a key has %d to %d; " REMEDY, path,
                           key->size, KEY_SIZE_MIN, KEY_SIZE_MAX, path);
    } else if (stat(path, &about) != 0 || (about.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
        status =
            mild_fail(error, MILD_ERROR_ARGUMENT,
                      "--key: others than its owner may open %.200s; chmod 600 %.200s", path, path);
    } else {
        memcpy(key->bytes, bytes, key->size);
    }
    sodium_memzero(bytes, key->size);
    free(bytes);
    return status;
}

void key_seal(const Key *key, const uint8_t *bytes, size_t size, uint8_t out[SEAL_SIZE]) {
    crypto_generichash(out, SEAL_SIZE, bytes, size, key->bytes, key->size);
}

int key_fits(const Key *key, const uint8_t *bytes, size_t size, const uint8_t given[SEAL_SIZE]) {
    uint8_t right[SEAL_SIZE];
    key_seal(key, bytes, size, right);
    return sodium_memcmp(right, given, SEAL_SIZE) == 0;
}

MildStatus key_draw_session(uint64_t *session, MildError *error) {
    if (sodium_init() < 0) {
        return mild_fail(error, MILD_ERROR_IO, "no random numbers from the system");
    }
    do {
        randombytes_buf(session, sizeof *session);
    } while (*session == 0);
    return MILD_OK;
}
