#include "robot/engine.h"

#include <errno.h>
#include <fcntl.h>
#include <mujoco/mujoco.h>
#include <setjmp.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* Where engine_call continues on this thread when MuJoCo gives up; NULL outside of engine_call. */
static _Thread_local sigjmp_buf *rescue;
static _Thread_local char
    reason[200]; /* empty after an exception, which always means out of memory */
static void (*on_error)(const char *text);

/* Ignores everything below an error. */
static void take_message(const mjLogMessage *message) {
    if (message->level < mjLOG_ERROR) {
        return;
    }
    char line[sizeof reason];
    int length = (int)strcspn(message->subject, "\r\n");
    snprintf(line, sizeof line, "%.*s", length < 190 ? length : 190, message->subject);
    if (rescue) {
        memcpy(reason, line, sizeof reason);
        siglongjmp(*rescue, 1);
    }
    if (on_error) {
        on_error(line);
    }
}

void engine_on_error(void (*fatal)(const char *text)) {
    on_error = fatal;
    mju_setLogHandler(take_message);
}

/* An uncaught std::bad_alloc ends in abort() on the thread that threw it. */
static void take_abort(int number) {
    if (rescue) {
        siglongjmp(*rescue, 1);
    }
    signal(number, SIG_DFL);
    raise(number);
}

/* Redirects standard error, because the C++ library announces the abort there and we report it
 * ourselves. Returns a copy of the descriptor, to be restored later, or -1 if it could not be
 * made. */
static int silence(void) {
    fflush(stderr);
    int kept = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
    int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (kept >= 0 && nowhere >= 0) {
        dup2(nowhere, STDERR_FILENO);
    }
    if (nowhere >= 0) {
        close(nowhere);
    }
    return kept;
}

static void restore(int kept) {
    if (kept >= 0) {
        fflush(stderr);
        dup2(kept, STDERR_FILENO);
        close(kept);
    }
}

/* Runs the work with the jump target set. Returns 1 when MuJoCo gave up. */
static int attempt(MildStatus (*work)(void *context, MildError *error), void *context,
                   MildStatus *status, MildError *error) {
    sigjmp_buf here;
    reason[0] = '\0';
    if (sigsetjmp(here, 1)) {
        rescue = NULL;
        return 1;
    }
    rescue = &here;
    *status = work(context, error);
    rescue = NULL;
    return 0;
}

MildStatus engine_call(MildStatus (*work)(void *context, MildError *error), void *context,
                       const char *what, MildError *error) {
    struct sigaction mine = {.sa_handler = take_abort}, before;
    MildError cause = {0};
    MildStatus status = MILD_OK;
    mjfLogHandler handler = mju_setLogHandler(take_message);
    int kept = silence();
    sigaction(SIGABRT, &mine, &before);
    errno = 0;
    int gave_up = attempt(work, context, &status, &cause);
    int no_memory = errno == ENOMEM;
    sigaction(SIGABRT, &before, NULL);
    restore(kept);
    mju_setLogHandler(handler);
    if (gave_up && reason[0]) {
        return mild_fail(error, MILD_ERROR_MEMORY, "%.150s: MuJoCo failed: %s", what, reason);
    }
    /* MuJoCo's parser reports a failed allocation as an error in the file */
    if (gave_up || (status != MILD_OK && no_memory)) {
        return mild_fail(error, MILD_ERROR_MEMORY, "%.200s: out of memory", what);
    }
    return status == MILD_OK ? MILD_OK : mild_fail(error, cause.status, "%s", cause.text);
}
