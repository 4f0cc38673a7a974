/* The ground of another program, which this test is itself: with a first word it answers questions
 * in that way. What is asked and answered number by number, signals in between, children that die,
 * leave, come too late, or cannot be started. */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "kit.h"
#include "run/eval/other_ground.h"

enum { FEET = 4, BODIES = 6, QUESTION = 4 + 24 * FEET + 36 * FEET * FEET, ANSWER = 8 * FEET };

#define DT 0.0025

static Robot *robot;
static double question[QUESTION];
static int sockets;           /* until one cannot be made; 0: all can */
static int sends = -1;        /* calls of send so far; -1: all that is asked for is sent */
static struct timeval wanted; /* how long an answer may take */
static int microseconds;      /* in its place; 0: as wanted */

WRAPS(socketpair);
int __wrap_socketpair(int domain, int type, int protocol, int ends[2]) {
    return sockets > 0 && --sockets == 0 ? -1 : __real_socketpair(domain, type, protocol, ends);
}

/* As a full socket that signals interrupt: a few bytes, or none. */
WRAPS(send);
ssize_t __wrap_send(int socket, const void *data, size_t size, int flags) {
    if (sends >= 0 && sends++ % 3 == 1) {
        errno = EINTR;
        return -1;
    }
    return __real_send(socket, data, sends >= 0 && size > 1000 ? 1000 : size, flags);
}

WRAPS(setsockopt);
int __wrap_setsockopt(int socket, int level, int name, const void *value, socklen_t size) {
    const struct timeval shorter = {0, microseconds};
    assert_true(level == SOL_SOCKET && name == SO_RCVTIMEO && size == sizeof wanted);
    memcpy(&wanted, value, sizeof wanted);
    return __real_setsockopt(socket, level, name, microseconds ? &shorter : value, size);
}

/* ---- the program ---- */

static void wait_for(double seconds) {
    struct timespec left = {(time_t)seconds, (long)(1e9 * (seconds - (double)(time_t)seconds))};
    while (nanosleep(&left, &left) != 0) {
    }
}

static int descriptors(void) {
    int count = 0;
    for (int file = 3; file < 256; file++) {
        const int flags = fcntl(file, F_GETFD);
        count += flags >= 0 && !(flags & FD_CLOEXEC);
    }
    return count;
}

/* The k-th answer: 8 numbers a foot of the question, from 8 k feet on, and so on from its start. */
static int answer_as(const char *how) {
    for (int k = 0; fread(question, sizeof *question, QUESTION, stdin) == QUESTION; k++) {
        double answer[ANSWER];
        for (int i = 0; i < ANSWER; i++) {
            answer[i] = question[(k * ANSWER + i) % QUESTION];
        }
        answer[0] = strcmp(how, "descriptors") == 0 ? descriptors() : answer[0];
        if (k == 1 && strcmp(how, "die") == 0) {
            return 3;
        }
        if (k == 1 && strcmp(how, "leave") == 0) {
            return 0;
        }
        if (strcmp(how, "late") == 0) {
            wait_for(1000);
        }
        if (strcmp(how, "slow") == 0) {
            wait_for(0.05);
        }
        const size_t cut[] = {0, 1, sizeof answer - 1, sizeof answer};
        for (int piece = 0; piece < 3; piece++) {
            fwrite((char *)answer + cut[piece], cut[piece + 1] - cut[piece], 1, stdout);
            if (strcmp(how, "pieces") == 0) {
                fflush(stdout);
                wait_for(0.002);
            }
        }
        fflush(stdout);
    }
    if (strcmp(how, "slow") == 0) {
        wait_for(0.2); /* to its end */
    }
    return 0;
}

static OtherGround *start(const char *how, int trials) {
    char path[400], command[500];
    const ssize_t length = readlink("/proc/self/exe", path, sizeof path - 1);
    MildError error = {0};
    assert_true(length > 0);
    path[length] = '\0';
    snprintf(command, sizeof command, "exec '%s' %s", path, how);
    OtherGround *other = other_ground_start(command, robot, trials, &error);
    expect_good(other != NULL, &error);
    return other;
}

static void stop_well(OtherGround *other) {
    MildError error = {0};
    expect_good(other_ground_stop(other, MILD_OK, &error) == MILD_OK, &error);
}

/* ---- questions ---- */

/* Numbers of their own everywhere, and A of the feet and of two bodies more. */
static MildContactInput make_input(double *inertia, int bodies) {
    MildContactInput input = {.feet = FEET, .dt = DT, .inverse_inertia = inertia};
    double number = 0;
    for (int f = 0; f < FEET; f++) {
        for (int k = 0; k < 9; k++) {
            input.position[f][k % 3] = number += 1;
            input.rotation[f][k] = number += 1;
            input.velocity[f][k % 6] = number += 1;
        }
    }
    for (int i = 0; i < 6 * FEET; i++) {
        input.free_velocity[i] = number += 1;
    }
    for (int i = 0; i < 36 * bodies * bodies; i++) {
        inertia[i] = number += 1;
    }
    return input;
}

/* As other_ground.h has it. */
static void wanted_question(const MildContactInput *input, int bodies, double time, int trial,
                            double out[QUESTION]) {
    int at = 0;
    out[at++] = FEET;
    out[at++] = time;
    out[at++] = DT;
    out[at++] = trial;
    for (int f = 0; f < FEET; f++) {
        for (int k = 0; k < 18; k++) {
            out[at++] = k < 3    ? input->position[f][k]
                        : k < 12 ? input->rotation[f][k - 3]
                                 : input->velocity[f][k - 12];
        }
    }
    for (int i = 0; i < 6 * FEET; i++) {
        out[at++] = input->free_velocity[i];
    }
    for (int i = 0; i < 36 * FEET * FEET; i++) {
        out[at++] = input->inverse_inertia[i / (6 * FEET) * 6 * bodies + i % (6 * FEET)];
    }
    assert_int_equal(at, QUESTION);
}

static void compare(const MildContactResult *result, const double *asked, int k) {
    for (int i = 0; i < ANSWER; i++) {
        const MildFootResult *foot = &result->foot[i / 8];
        const int c = i % 8;
        const double got = c < 3    ? foot->force[c]
                           : c < 6  ? foot->torque[c - 3]
                           : c == 6 ? foot->depth_max
                                    : foot->depth_mean;
        expect_entry("answer", k * ANSWER + i, got, asked[(k * ANSWER + i) % QUESTION], 1e-12);
    }
}

/* Every number of the question comes back more than once, in other places of the answer. */
static void check_dialogue(const char *how, int bodies, uint32_t rows, int questions) {
    static double inertia[36 * BODIES * BODIES];
    OtherGround *other = start(how, 2);
    const RobotGround *ground = other_ground_of(other);
    MildContactInput input = make_input(inertia, bodies);
    input.rows = rows;
    for (int k = 0; k < questions; k++) {
        for (int trial = 0; trial < 2; trial++) {
            double asked[QUESTION];
            MildContactResult result;
            memset(&result, 0x55, sizeof result);
            assert_int_equal(ground[trial].solve(ground[trial].self, NULL, NULL, &input, &result),
                             0);
            wanted_question(&input, bodies, (k + 1) * DT, trial, asked);
            compare(&result, asked, k);
        }
    }
    stop_well(other);
}

TEST(every_number_arrives) {
    check_dialogue("echo", FEET, 0, 2 * QUESTION / ANSWER + 2);
    check_dialogue("echo", BODIES, 0x12f, QUESTION / ANSWER + 2); /* the feet and two bodies */
    check_dialogue("pieces", FEET, 0xf, 4);
    sends = 0;
    check_dialogue("echo", FEET, 0, QUESTION / ANSWER + 2);
    assert_true(sends > 100);
    sends = -1;
}

static void ignore(int number) {
    (void)number;
}

/* Signals that interrupt the wait for an answer, and for the end, change nothing. */
TEST(signals_interrupt) {
    const struct sigaction action = {.sa_handler = ignore};
    const struct itimerval often = {{0, 3000}, {0, 3000}}, never = {{0, 0}, {0, 0}};
    struct sigaction before;
    sigaction(SIGALRM, &action, &before);
    OtherGround *other = start("slow", 1);
    static double inertia[36 * FEET * FEET];
    const MildContactInput input = make_input(inertia, FEET);
    const RobotGround *ground = other_ground_of(other);
    MildContactResult result = {0};
    setitimer(ITIMER_REAL, &often, NULL);
    const int failed = ground->solve(ground->self, NULL, NULL, &input, &result);
    MildError error = {0};
    const MildStatus status = other_ground_stop(other, MILD_OK, &error);
    setitimer(ITIMER_REAL, &never, NULL);
    sigaction(SIGALRM, &before, NULL);
    assert_int_equal(failed, 0);
    assert_int_equal(status, MILD_OK);
}

/* ---- children ---- */

/* The second question has no answer, nor has one after it; the trial is named at the end. */
static void check_end(const char *how, const char *names) {
    static double inertia[36 * FEET * FEET];
    OtherGround *other = start(how, 2);
    const RobotGround *ground = other_ground_of(other);
    const MildContactInput input = make_input(inertia, FEET);
    MildContactResult result = {0};
    MildError error = {0};
    const int late = strcmp(how, "late") == 0;
    if (!late) {
        assert_int_equal(ground[1].solve(ground[1].self, NULL, NULL, &input, &result), 0);
    }
    for (int k = 0; k < 2; k++) {
        assert_int_equal(ground[1].solve(ground[1].self, NULL, NULL, &input, &result), 1);
    }
    assert_refused(other_ground_stop(other, MILD_OK, &error), MILD_ERROR_IO, &error, names);
}

TEST(ends_are_reported) {
    check_end("die", "--program trial 1 failed");
    check_end("leave", "--program trial 1 ended");
    microseconds = 100000;
    check_end("late", "--program trial 1 600");
    microseconds = 0;
    assert_true(wanted.tv_sec == 600 && wanted.tv_usec == 0);
    MildError error = {0}; /* the failure before has its own report */
    OtherGround *other = start("echo", 1);
    assert_int_equal(other_ground_stop(other, MILD_ERROR_RANGE, &error), MILD_ERROR_RANGE);
    assert_int_equal(error.status, MILD_OK);
    other = other_ground_start("exit 3", robot, 3, &error);
    assert_non_null(other);
    assert_refused(other_ground_stop(other, MILD_OK, &error), MILD_ERROR_IO, &error,
                   "--program trial 0 failed");
}

/* A child has its standard files and what this program leaves open for anyone, not another's ends.
 */
TEST(a_child_has_its_own_ends_only) {
    static double inertia[36 * FEET * FEET];
    const int before = descriptors();
    OtherGround *other = start("descriptors", 3);
    const RobotGround *ground = other_ground_of(other);
    const MildContactInput input = make_input(inertia, FEET);
    for (int trial = 0; trial < 3; trial++) {
        MildContactResult result = {0};
        assert_int_equal(ground[trial].solve(ground[trial].self, NULL, NULL, &input, &result), 0);
        expect_near("descriptors", result.foot[0].force[0], before, 0);
    }
    stop_well(other);
    assert_int_equal(descriptors(), before);
}

/* When the third cannot be started the first two end; a child of somebody else is left alone. */
TEST(a_start_that_fails_ends_the_others) {
    MildError error = {0};
    const int before = descriptors();
    const pid_t mine = fork();
    if (mine == 0) {
        _exit(7);
    }
    sockets = 3;
    assert_null(other_ground_start("cat >/dev/null", robot, 4, &error));
    assert_error(&error, MILD_ERROR_IO, "--program socket");
    int code = 0;
    assert_int_equal(waitpid(mine, &code, 0), mine);
    assert_true(WIFEXITED(code) && WEXITSTATUS(code) == 7);
    assert_int_equal(waitpid(-1, &code, WNOHANG), -1); /* no child is left */
    assert_int_equal(descriptors(), before);
}

static int setup(void **state) {
    (void)state;
    MildError error = {0};
    robot = robot_create(MILD_SOURCE_DIR "/robots/go1", &error);
    return !robot || robot_feet(robot) != FEET;
}

static int teardown(void **state) {
    (void)state;
    robot_destroy(robot);
    return 0;
}

int main(int count, char **word) {
    return count > 1 ? answer_as(word[1]) : run_cases(setup, teardown);
}
