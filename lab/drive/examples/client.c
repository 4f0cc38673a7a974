/* The robot's side of `mild drive` (lab/drive/README.md): sends what the sensors say, and hands the
 * drives what the policy asks for.
 *
 *     cc -std=c17 -O2 lab/drive/examples/client.c -o client
 *     ./client HOST PORT [--lockstep]
 *
 * JOINTS, robot_read and robot_write are yours to write for your robot. Here a robot is a pair of
 * pipes, behind which lab/drive/examples/simulated.py is one: it writes a line of numbers for each
 * state and reads a line for each target. --lockstep waits for the answer to each state, for a
 * robot whose time stands still meanwhile. */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <netdb.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

/* Names of the joints as in robot.ini, a newline between two; numbers are in this order. */
#define LEG(s)                                                                                     \
    "leg_" s "1_joint\nleg_" s "2_joint\nleg_" s "3_joint\nleg_" s "4_joint\nleg_" s "5_joint\n"   \
    "leg_" s "6_joint"
#define JOINTS LEG("l") "\n" LEG("r")
enum { N = 12, HEAD = 44, STATE = HEAD + 4 * (7 + 2 * N) + 4, TARGET = HEAD + 16 * N + 4 };
enum { WAIT, WALK, HOLD, DAMP, END };

#define SILENCE 0.1 /* [s] without a target after which the robot is damped */

typedef struct {
    float quaternion[4], omega[3]; /* base to world, w x y z; in the base's own axes [rad/s] */
    float angle[N], speed[N];      /* [rad, rad/s] */
} State;

typedef struct {
    float angle[N], kp[N], kd[N], limit[N]; /* [rad, N m/rad, N m s/rad, N m] */
} Target;

/* Both are floats alone, in the order of their packets. */
enum {
    STATE_NUMBERS = sizeof(State) / sizeof(float),
    TARGET_NUMBERS = sizeof(Target) / sizeof(float)
};

/* ---- the robot ---- */

/* Waits for the next state of the sensors; 0 when there is none any more. At 200 Hz or more. */
static int robot_read(State *state) {
    float number[STATE_NUMBERS];
    for (int i = 0; i < STATE_NUMBERS; i++) {
        if (scanf("%f", &number[i]) != 1) {
            return 0;
        }
    }
    memcpy(state, number, sizeof *state);
    return 1;
}

/* Torques clip(kp (angle - q) - kd qd, +-limit), as fast as the drives can, until the next call.
 * NULL: nothing has come yet, stand as you are. */
static void robot_write(const Target *target) {
    float number[TARGET_NUMBERS];
    memcpy(number, target ? target : &(Target){{0}, {0}, {0}, {0}}, sizeof number);
    for (int i = 0; target && i < TARGET_NUMBERS; i++) {
        printf("%.9g ", (double)number[i]);
    }
    printf("\n");
    fflush(stdout);
}

/* ---- packets ---- */

static uint32_t crc32(const uint8_t *bytes, size_t size) {
    uint32_t crc = 0xffffffffu;
    for (size_t i = 0; i < size; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++) {
            crc = (crc >> 1) ^ (0xedb88320u & (0u - (crc & 1u)));
        }
    }
    return ~crc;
}

static void put(uint8_t *to, uint64_t value, int bytes) {
    for (int i = 0; i < bytes; i++) {
        to[i] = (uint8_t)(value >> 8 * i);
    }
}

static uint64_t get(const uint8_t *from, int bytes) {
    uint64_t value = 0;
    for (int i = bytes; i-- > 0;) {
        value = value << 8 | from[i];
    }
    return value;
}

typedef struct {
    int socket, mode;         /* mode of the newest target */
    uint32_t robot, sequence; /* of the newest state */
    uint32_t newest, answers; /* sequence of the newest target; of the state that it answers */
    uint64_t session, runner; /* ours, the runner's; 0: not known yet */
    double heard;             /* [s] when the newest target came */
    Target target;
} Client;

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void send_state(Client *c, const State *state, int mode) {
    uint8_t packet[STATE] = {'M', 'I', 'L', 'D', 2, 1, N, (uint8_t)mode};
    put(packet + 8, ++c->sequence, 4);
    put(packet + 12, c->newest, 4);
    put(packet + 16, (uint64_t)(1e6 * seconds()), 8);
    put(packet + 24, c->session, 8);
    put(packet + 32, c->runner, 8);
    put(packet + 40, c->robot, 4);
    uint32_t bits[STATE_NUMBERS];
    memcpy(bits, state, sizeof bits);
    for (int i = 0; i < STATE_NUMBERS; i++) {
        put(packet + HEAD + 4 * i, bits[i], 4);
    }
    put(packet + STATE - 4, crc32(packet, STATE - 4), 4);
    send(c->socket, packet, STATE, 0); /* one that is lost is as one that never was */
}

/* Takes a packet, if it is a target for this robot and newer than the last one; anything else is
 * left alone. */
static void take(Client *c, const uint8_t *packet, ssize_t size) {
    const uint8_t head[] = {'M', 'I', 'L', 'D', 2, 2, N};
    if (size != TARGET || memcmp(packet, head, sizeof head) != 0 ||
        get(packet + TARGET - 4, 4) != crc32(packet, TARGET - 4) ||
        get(packet + 40, 4) != c->robot || get(packet + 32, 8) != c->session || packet[7] > END) {
        return;
    }
    const uint32_t sequence = (uint32_t)get(packet + 8, 4);
    const uint64_t runner = get(packet + 24, 8);
    if (c->runner && (runner != c->runner || (int32_t)(sequence - c->newest) <= 0)) {
        return;
    }
    float number[TARGET_NUMBERS];
    for (int i = 0; i < TARGET_NUMBERS; i++) {
        const uint32_t bits = (uint32_t)get(packet + HEAD + 4 * i, 4);
        memcpy(&number[i], &bits, 4);
        if (!isfinite(number[i]) || (i >= N && number[i] < 0)) { /* gains and limits */
            return;
        }
    }
    c->runner = runner;
    c->newest = sequence;
    c->answers = (uint32_t)get(packet + 12, 4);
    c->mode = packet[7];
    if (c->mode != WAIT) {
        memcpy(&c->target, number, sizeof c->target);
        c->heard = seconds();
    }
}

/* Takes what has come. In lockstep it waits for the answer to the newest state: 2 s, or 10 ms while
 * no runner is there. */
static void listen_for(Client *c, int lockstep) {
    const double until = seconds() + (lockstep ? c->runner ? 2 : 0.01 : 0);
    struct pollfd ready = {.fd = c->socket, .events = POLLIN, .revents = 0};
    for (;;) {
        const double left = until - seconds();
        const int answered = c->runner && c->answers == c->sequence;
        if (poll(&ready, 1, answered || left < 0 ? 0 : (int)(1000 * left) + 1) <= 0) {
            return;
        }
        uint8_t packet[2048];
        take(c, packet, recv(c->socket, packet, sizeof packet, 0));
    }
}

static int connect_to(const char *host, const char *port) {
    const struct addrinfo hints = {.ai_family = AF_INET, .ai_socktype = SOCK_DGRAM};
    struct addrinfo *found = NULL;
    if (getaddrinfo(host, port, &hints, &found) != 0) {
        return -1;
    }
    int made = socket(AF_INET, SOCK_DGRAM, 0);
    if (made >= 0 &&
        connect(made, found->ai_addr, found->ai_addrlen) != 0) { /* hears that address alone */
        close(made);
        made = -1;
    }
    freeaddrinfo(found);
    return made;
}

int main(int argc, char **argv) {
    Client c = {.socket = argc > 2 ? connect_to(argv[1], argv[2]) : -1,
                .mode = WAIT,
                .robot = crc32((const uint8_t *)JOINTS, sizeof JOINTS - 1)};
    const int lockstep = argc > 3 && strcmp(argv[3], "--lockstep") == 0;
    if (c.socket < 0 || getrandom(&c.session, sizeof c.session, 0) != (ssize_t)sizeof c.session ||
        c.session == 0) {
        fprintf(stderr, "usage: client HOST PORT [--lockstep], of a machine that is there\n");
        return 2;
    }
    State state = {0};
    int began = 0, ended = 0;
    while (!ended && robot_read(&state)) {
        send_state(&c, &state, WALK);
        listen_for(&c, lockstep);
        began |= c.mode != WAIT;
        if (began && seconds() - c.heard > SILENCE && !lockstep) {
            memset(c.target.kp, 0, sizeof c.target.kp); /* the runner is gone: damp */
        }
        robot_write(began ? &c.target : NULL);
        ended = c.mode == END;
    }
    for (int k = 0; k < 3; k++) {
        send_state(&c, &state, END);
    }
    fprintf(stderr, "client: %u states sent, the runner %s\n", c.sequence,
            c.mode == END ? "has ended"
            : c.runner    ? "still runs"
                          : "was never there");
    return c.runner ? 0 : 2;
}
