#include "app/progress.h"

#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/text.h"

static const double terminal_interval = 0.1, file_interval = 10.0; /* [s] */

Progress progress_begin(const char *what) {
    double now = clock_seconds();
    return (Progress){.what = what,
                      .start = now,
                      .shown = now - file_interval,
                      .terminal = isatty(STDERR_FILENO)};
}

/* A line wider than the terminal would wrap, and could then not be updated in place. */
static void cut_to_terminal(char *line) {
    struct winsize window;
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &window) == 0 && window.ws_col > 1 &&
        strlen(line) >= window.ws_col) {
        line[window.ws_col - 1] = '\0';
    }
}

static void show_line(Progress *progress, double share, const char *format, va_list arguments) {
    char line[400], time[32];
    double elapsed = clock_seconds() - progress->start;
    int length = snprintf(line, sizeof line, "%s", progress->what);
    if (share >= 0) {
        length += snprintf(line + length, sizeof line - (size_t)length, " %3.0f %%",
                           100 * (share < 1 ? share : 1));
    }
    length += snprintf(line + length, sizeof line - (size_t)length, "  %s",
                       text_duration(elapsed, time, sizeof time));
    if (share > 0.005 && share < 1) {
        text_duration(elapsed * (1 - share) / share, time, sizeof time);
        length += snprintf(line + length, sizeof line - (size_t)length, ", %s left", time);
    }
    length += snprintf(line + length, sizeof line - (size_t)length, "  ");
    vsnprintf(line + length, sizeof line - (size_t)length, format, arguments);
    if (progress->terminal) {
        cut_to_terminal(line);
        fprintf(stderr, "\r%-*s", progress->width, line);
        progress->width = (int)strlen(line);
    } else {
        fprintf(stderr, "%s\n", line);
    }
    fflush(stderr);
}

void progress_show(Progress *progress, double share, const char *format, ...) {
    double now = clock_seconds();
    if (now - progress->shown < (progress->terminal ? terminal_interval : file_interval)) {
        return;
    }
    progress->shown = now;
    va_list arguments;
    va_start(arguments, format);
    show_line(progress, share, format, arguments);
    va_end(arguments);
}

void progress_end(Progress *progress, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    show_line(progress, -1, format, arguments);
    va_end(arguments);
    if (progress->terminal) {
        fputc('\n', stderr);
    }
}

/* No thread that computes may run a signal handler: the generated code of oneDNN 2.6 keeps data
 * below the stack pointer, where the system puts a handler's frame, so a Ctrl-C during a product
 * corrupted the heap. The signals are blocked, later threads inherit that, and one thread waits for
 * them. */
static atomic_int interrupted;

static void *wait_for_signals(void *signals) {
    for (int signal_number; sigwait(signals, &signal_number) == 0;) {
        int before = atomic_exchange(&interrupted, 1);
        /* a closing terminal may hang up twice */
        if (before && (signal_number == SIGINT || signal_number == SIGTERM)) {
            _exit(128 + signal_number);
        }
    }
    return NULL;
}

void interrupt_install(void) {
    static sigset_t signals;
    pthread_t thread;
    struct sigaction hangup;
    sigemptyset(&signals);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGUSR1);
    if (sigaction(SIGHUP, NULL, &hangup) == 0 && hangup.sa_handler != SIG_IGN) {
        sigaddset(&signals, SIGHUP); /* the terminal was closed; ignored under nohup */
    }
    pthread_sigmask(SIG_BLOCK, &signals, NULL);
    if (pthread_create(&thread, NULL, wait_for_signals, &signals) == 0) {
        pthread_detach(thread);
    } else {
        pthread_sigmask(SIG_UNBLOCK, &signals, NULL); /* an abrupt end is better than none */
    }
}

int interrupt_requested(void) {
    return atomic_load(&interrupted);
}
