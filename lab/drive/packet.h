/* The packets between a robot and the runner of its policy (README.md). One UDP packet each,
 * little endian, numbers as 32-bit floats:
 *
 *    0  "MILD"
 *    4  version 2
 *    5  kind: 1 state (robot to runner), 2 target (runner to robot)
 *    6  joints n
 *    7  mode: a PacketMode
 *    8  sequence: counts the sender's packets
 *   12  answers: sequence of the newest packet of the other kind that was used, 0: none yet
 *   16  time [us] of the sender's own clock, 64 bits
 *   24  session: random number of the sender's session, 64 bits, not 0
 *   32  peer: session of the other side, 64 bits, 0: not known yet
 *   40  robot: packet_robot
 *   44  state: quaternion w x y z, angular velocity 3, angles n, speeds n
 *       target: angles n, kp n, kd n, torque limits n
 *
 * and at the end the seal of everything before it: without a key the CRC-32 (IEEE 802.3), with one
 * BLAKE2b of 16 bytes under that key */
#ifndef DRIVE_PACKET_H
#define DRIVE_PACKET_H

#include <stddef.h>
#include <stdint.h>

#include "mild/error.h"
#include "robot/limits.h"
#include "robot/robot.h"

/* ---- the key that a robot and its runner may share, and the numbers of sessions ---- */

/* A seal is BLAKE2b of 16 bytes under the key (--key). */

enum { KEY_SIZE_MIN = 32, KEY_SIZE_MAX = 64, SEAL_SIZE = 16 };

typedef struct {
    size_t size;
    uint8_t bytes[KEY_SIZE_MAX];
} Key;

/* The bytes of a file of KEY_SIZE_MIN to KEY_SIZE_MAX bytes that only its owner can read. */
MildStatus key_read(const char *path, Key *key, MildError *error);
void key_seal(const Key *key, const uint8_t *bytes, size_t size, uint8_t out[SEAL_SIZE]);
/* Bool: this is the seal of the bytes. Takes the same time wherever they differ. */
int key_fits(const Key *key, const uint8_t *bytes, size_t size, const uint8_t given[SEAL_SIZE]);

/* A random number that nobody can guess, not 0. */
MildStatus key_draw_session(uint64_t *session, MildError *error);

/* ---- packet.c ---- */

#define PACKET_VERSION 2

enum { PACKET_HEAD = 44, PACKET_MAX = PACKET_HEAD + 4 * 4 * ROBOT_JOINTS_MAX + SEAL_SIZE };

/* What both sides must have in common. */
typedef struct {
    int joints;
    uint32_t robot;
    const Key *key; /* borrowed; NULL: none */
} PacketFormat;
/* CRC-32 of the names of the joints in their order, with a newline between two. */
uint32_t packet_robot(const Robot *robot);

typedef enum { PACKET_STATE = 1, PACKET_TARGET = 2 } PacketKind;

#define PACKET_MODE_LIST(X)                                                                        \
    X(wait, "no step yet: a target that carries the session number and is not applied")            \
    X(walk, "the policy's targets, or a state as usual")                                           \
    X(hold, "the last targets again, because no new state came")                                   \
    X(damp, "kp is 0: the runner has given up until it is started anew")                           \
    X(end, "the sender ends; damp")
#define PACKET_MODE_ENUM(name, what) PACKET_##name,
typedef enum { PACKET_MODE_LIST(PACKET_MODE_ENUM) PACKET_MODES } PacketMode;
#undef PACKET_MODE_ENUM
extern const char *const packet_modes[PACKET_MODES];

typedef struct {
    PacketMode mode;
    uint32_t sequence, answers;
    uint64_t time; /* [us] */
    uint64_t session, peer;
    float quaternion[4];           /* [-] base to world, w x y z; of length 1 when it was decoded */
    float angular_velocity[3];     /* [rad/s] base axes */
    float angle[ROBOT_JOINTS_MAX]; /* [rad] */
    float speed[ROBOT_JOINTS_MAX]; /* [rad/s] */
} StatePacket;

typedef struct {
    PacketMode mode;
    uint32_t sequence, answers;
    uint64_t time; /* [us] */
    uint64_t session, peer;
    float angle[ROBOT_JOINTS_MAX]; /* [rad] */
    float kp[ROBOT_JOINTS_MAX];    /* [N m/rad] */
    float kd[ROBOT_JOINTS_MAX];    /* [N m s/rad] */
    float limit[ROBOT_JOINTS_MAX]; /* [N m] */
} TargetPacket;

/* Write a packet into bytes [PACKET_MAX]; return its size. */
size_t packet_write_state(const StatePacket *state, const PacketFormat *format, uint8_t *bytes);
size_t packet_write_target(const TargetPacket *target, const PacketFormat *format, uint8_t *bytes);

/* Why a packet was refused. Its receiver finds the last three. */
#define PACKET_FAULT_LIST(X)                                                                       \
    X(none)                                                                                        \
    X(size)                                                                                        \
    X(magic)                                                                                       \
    X(version)                                                                                     \
    X(kind) X(joints) X(robot) X(checksum) X(key) X(number) X(session) X(implausible) X(stranger)
#define PACKET_FAULT_ENUM(name) PACKET_FAULT_##name,
typedef enum { PACKET_FAULT_LIST(PACKET_FAULT_ENUM) PACKET_FAULTS } PacketFault;
#undef PACKET_FAULT_ENUM
extern const char *const packet_faults[PACKET_FAULTS];

/* Read a packet. Every number of one that is not refused is finite and at most 1e6; no gain or
 * torque limit is negative. */
PacketFault packet_read_state(const uint8_t *bytes, size_t size, const PacketFormat *format,
                              StatePacket *state);
PacketFault packet_read_target(const uint8_t *bytes, size_t size, const PacketFormat *format,
                               TargetPacket *target);
/* Says in a line what a person can do about a refused packet, or "". Returns `text`. */
const char *packet_explain(PacketFault fault, const uint8_t *bytes, const PacketFormat *format,
                           char *text, size_t size);

#endif
