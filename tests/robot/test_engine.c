/* MuJoCo's failures: each way of giving up becomes one error, and nothing of the call stays behind,
 * neither handlers nor descriptors; errors outside of a call reach the program as one line. */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <mujoco/mujoco.h>

#include "kit.h"
#include "robot/engine.h"

typedef struct {
    MildStatus status; /* that the work returns */
    int number;        /* of errno that it leaves */
    char text[400];    /* of mju_error; empty: none */
    int aborts, warns;
    int was_silent; /* bool: standard error went to /dev/null */
} Work;

static MildStatus do_work(void *context, MildError *error) {
    Work *work = context;
    struct stat nowhere, out;
    assert_int_equal(stat("/dev/null", &nowhere), 0);
    assert_int_equal(fstat(STDERR_FILENO, &out), 0);
    work->was_silent = S_ISCHR(out.st_mode) && out.st_rdev == nowhere.st_rdev;
    if (work->warns) {
        mju_warning("a warning");
    }
    if (work->text[0]) {
        mju_error("%s", work->text);
    }
    if (work->aborts) {
        abort();
    }
    errno = work->number;
    return work->status == MILD_OK ? MILD_OK : mild_fail(error, work->status, "own words");
}

static int open_descriptors(void) {
    int count = 0;
    for (int file = 0; file < 64; file++) {
        count += fcntl(file, F_GETFD) >= 0;
    }
    return count;
}

static void some_handler(const mjLogMessage *message) {
    (void)message;
}

/* Runs it; checks that all is as before. */
static void expect(Work work, MildStatus wanted, const char *names) {
    MildError error = {0};
    struct stat before, after;
    struct sigaction handler;
    int files = open_descriptors();
    mjfLogHandler old = mju_setLogHandler(some_handler);
    assert_int_equal(fstat(STDERR_FILENO, &before), 0);
    MildStatus status = engine_call(do_work, &work, "the model", &error);
    assert_int_equal(fstat(STDERR_FILENO, &after), 0);
    assert_true(before.st_ino == after.st_ino && before.st_dev == after.st_dev);
    assert_int_equal(open_descriptors(), files);
    assert_int_equal(sigaction(SIGABRT, NULL, &handler), 0);
    assert_true(handler.sa_handler == SIG_DFL);
    assert_true(mju_setLogHandler(old) == some_handler);
    assert_true(work.was_silent);
    assert_int_equal(status, wanted);
    assert_false(kit_named(error.text, "second")); /* lines are not joined */
    if (wanted == MILD_OK) {
        assert_true(error.status == MILD_OK && !error.text[0]);
    } else {
        assert_error(&error, wanted, names);
    }
}

TEST(test_calls) {
    signal(SIGABRT, SIG_DFL);                 /* not cmocka's */
    for (int round = 0; round < 2; round++) { /* a failure does not spoil the next call */
        expect((Work){.status = MILD_OK}, MILD_OK, "");
        expect((Work){.status = MILD_OK, .number = ENOMEM}, MILD_OK, "");
        expect((Work){.warns = 1}, MILD_OK, "");
        expect((Work){.status = MILD_ERROR_FORMAT}, MILD_ERROR_FORMAT, "own words");
        expect((Work){.status = MILD_ERROR_FORMAT, .number = EINVAL}, MILD_ERROR_FORMAT,
               "own words");
        expect((Work){.status = MILD_ERROR_FORMAT, .number = ENOMEM}, MILD_ERROR_MEMORY,
               "model memory");
        expect((Work){.aborts = 1}, MILD_ERROR_MEMORY, "model memory");
        expect((Work){.text = "first\nsecond"}, MILD_ERROR_MEMORY, "model MuJoCo first");
    }
}

TEST(test_long_message) {
    Work work = {.status = MILD_OK};
    char wanted[400] = "model ";
    memset(work.text, 'x', 300);
    memset(wanted + strlen(wanted), 'x', 190);
    signal(SIGABRT, SIG_DFL);
    expect(work, MILD_ERROR_MEMORY, wanted);
}

/* ---- outside of a call ---- */

static jmp_buf back;
static char heard[300];

static void take_line(const char *text) {
    snprintf(heard, sizeof heard, "%s", text);
    longjmp(back, 1);
}

TEST(test_on_error) {
    engine_on_error(take_line);
    heard[0] = '\0';
    mju_warning("a warning");
    assert_string_equal(heard, "");
    if (!setjmp(back)) {
        mju_error("out of\r\nluck");
        fail_msg("mju_error came back");
    }
    assert_string_equal(heard, "out of");
    signal(SIGABRT, SIG_DFL);
    Work work = {.text = "inside"};
    MildError error = {0};
    assert_refused(engine_call(do_work, &work, "it", &error), MILD_ERROR_MEMORY, &error,
                   "it MuJoCo inside");
    assert_string_equal(heard, "out of"); /* the call's errors are the call's */
}

TEST_MAIN(NULL, NULL)
