#include "run/eval/other_ground.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

enum { HEAD = 4, FOOT = 18, ANSWER = 8 }; /* doubles */

#define PATIENCE 600 /* [s] for an answer: a bed of grains settles before the first */

typedef struct {
    pid_t child;
    int socket; /* -1: closed */
    int feet, trial;
    int failed;  /* bool: it gave no answer */
    int late;    /* bool: for it did not end either */
    double time; /* [s] */
} Child;

struct OtherGround {
    int trials;
    Child *child;        /* [trials] */
    RobotGround *ground; /* [trials] */
};

/* ---- a question and its answer ---- */

/* Unlike a pipe, a socket is written without a SIGPIPE when the child is dead. Returns 1 then. */
static int send_all(int socket, const void *data, size_t size) {
    const char *at = data;
    while (size > 0) {
        const ssize_t sent = send(socket, at, size, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR) {
            continue;
        }
        if (sent <= 0) {
            return 1;
        }
        at += sent;
        size -= (size_t)sent;
    }
    return 0;
}

static int receive_all(int socket, void *data, size_t size) {
    char *at = data;
    while (size > 0) {
        errno = 0;
        const ssize_t got = recv(socket, at, size, 0);
        if (got < 0 && errno == EINTR) {
            continue;
        }
        if (got <= 0) {
            return 1;
        }
        at += got;
        size -= (size_t)got;
    }
    return 0;
}

/* Rows of A are those of all bodies near the ground, of which the feet are the first. */
static int rows_of(const MildContactInput *input) {
    int bodies = 0;
    for (uint32_t bits = input->rows; bits; bits &= bits - 1) {
        bodies++;
    }
    return 6 * (bodies ? bodies : input->feet);
}

/* Returns the number of doubles. */
static int write_question(const Child *child, const MildContactInput *input, double *out) {
    const int n = child->feet, rows = rows_of(input);
    double *at = out;
    *at++ = n;
    *at++ = child->time;
    *at++ = input->dt;
    *at++ = child->trial;
    for (int f = 0; f < n; f++, at += FOOT) {
        memcpy(at, input->position[f], 3 * sizeof *at);
        memcpy(at + 3, input->rotation[f], 9 * sizeof *at);
        memcpy(at + 12, input->velocity[f], 6 * sizeof *at);
    }
    memcpy(at, input->free_velocity, 6 * (size_t)n * sizeof *at);
    at += (ptrdiff_t)6 * n;
    for (int i = 0; i < 6 * n; i++, at += (ptrdiff_t)6 * n) {
        memcpy(at, input->inverse_inertia + i * rows, 6 * (size_t)n * sizeof *at);
    }
    return (int)(at - out);
}

static int solve(void *self, const MildTerrain *terrain, MildGround *ground,
                 const MildContactInput *input, MildContactResult *result) {
    (void)terrain;
    (void)ground;
    Child *child = self;
    double question[HEAD + ROBOT_FEET_MAX * (FOOT + 6 + 36 * ROBOT_FEET_MAX)];
    double answer[ROBOT_FEET_MAX * ANSWER] = {0};
    child->time += input->dt;
    const size_t size = (size_t)write_question(child, input, question) * sizeof *question;
    const size_t back = (size_t)child->feet * ANSWER * sizeof *answer;
    errno = 0;
    if (child->failed || send_all(child->socket, question, size) ||
        receive_all(child->socket, answer, back)) {
        child->late |= !child->failed && errno == EAGAIN;
        child->failed = 1;
        return 1;
    }
    for (int f = 0; f < child->feet; f++) {
        const double *at = answer + (ptrdiff_t)f * ANSWER;
        MildFootResult *foot = &result->foot[f];
        memcpy(foot->force, at, sizeof foot->force);
        memcpy(foot->torque, at + 3, sizeof foot->torque);
        foot->depth_max = at[6];
        foot->depth_mean = at[7];
    }
    return 0;
}

/* ---- the children ---- */

static MildStatus start_child(Child *child, const char *command, MildError *error) {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) {
        return mild_fail(error, MILD_ERROR_IO, "--program: no socket: %s", strerror(errno));
    }
    const struct timeval patience = {PATIENCE, 0};
    fcntl(ends[0], F_SETFD, FD_CLOEXEC);
    setsockopt(ends[0], SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    char shell[] = "sh", option[] = "-c", *text = strdup(command);
    char *arguments[] = {shell, option, text, NULL};
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_addclose(&actions, ends[1]);
    const int failure =
        text ? posix_spawnp(&child->child, "sh", &actions, NULL, arguments, environ) : ENOMEM;
    posix_spawn_file_actions_destroy(&actions);
    free(text);
    close(ends[1]);
    if (failure) {
        close(ends[0]);
        return mild_fail(error, MILD_ERROR_IO, "--program: cannot start a shell: %s",
                         strerror(failure));
    }
    child->socket = ends[0];
    return MILD_OK;
}

OtherGround *other_ground_start(const char *command, const Robot *robot, int trials,
                                MildError *error) {
    OtherGround *other = calloc(1, sizeof *other);
    Child *child = other ? calloc((size_t)trials, sizeof *child) : NULL;
    RobotGround *ground = child ? calloc((size_t)trials, sizeof *ground) : NULL;
    if (!ground) {
        free(child);
        free(other);
        mild_fail(error, MILD_ERROR_MEMORY, "--program: out of memory for %d trials", trials);
        return NULL;
    }
    *other = (OtherGround){trials, child, ground};
    for (int i = 0; i < trials; i++) {
        child[i] = (Child){.socket = -1, .feet = robot_feet(robot), .trial = i};
        ground[i] = (RobotGround){solve, &child[i]};
    }
    for (int i = 0; i < trials; i++) {
        const MildStatus status = start_child(&child[i], command, error);
        if (status != MILD_OK) {
            other_ground_stop(other, status, error);
            return NULL;
        }
    }
    return other;
}

const RobotGround *other_ground_of(const OtherGround *other) {
    return other->ground;
}

MildStatus other_ground_stop(OtherGround *other, MildStatus status, MildError *error) {
    for (int i = 0; i < other->trials; i++) {
        Child *child = &other->child[i];
        int code = 0;
        if (child->socket < 0) {
            continue;
        }
        close(child->socket);
        if (child->late) {
            kill(child->child, SIGTERM);
        }
        while (waitpid(child->child, &code, 0) < 0 && errno == EINTR) {
            continue;
        }
        const int well = WIFEXITED(code) && WEXITSTATUS(code) == 0;
        if (status == MILD_OK && child->late) {
            status = mild_fail(error, MILD_ERROR_IO, "--program: of trial %d: no answer for %d s",
                               i, PATIENCE);
        } else if (status == MILD_OK && (child->failed || !well)) {
            status = mild_fail(error, MILD_ERROR_IO, "--program: of trial %d: %s", i,
                               well ? "it ended without an answer" : "it failed");
        }
    }
    free(other->ground);
    free(other->child);
    free(other);
    return status;
}
