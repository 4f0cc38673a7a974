#include "drive/drive.h"

#include <signal.h>
#include <string.h>

#include "base/clock.h"

#define DAMP_TIME 1.0 /* [s] for which damping is sent before the end */
#define END_PACKETS 3
#define PACKETS 512 /* taken at once */

static volatile sig_atomic_t stopped;

static void stop(int signal) {
    (void)signal;
    stopped = 1;
}

/* After a nohup a hang-up stays ignored. A process that is stopped from the terminal leaves its
 * robot alone, so that is an end, too. */
void drive_catch_signals(void) {
    static const int ends[] = {SIGINT, SIGTERM, SIGQUIT, SIGTSTP, SIGHUP};
    const struct sigaction end = {.sa_handler = stop}, ignore = {.sa_handler = SIG_IGN};
    struct sigaction before;
    stopped = 0;
    for (size_t i = 0; i < sizeof ends / sizeof *ends; i++) {
        sigaction(ends[i], NULL, &before);
        if (ends[i] != SIGHUP || before.sa_handler != SIG_IGN) {
            sigaction(ends[i], &end, NULL);
        }
    }
    sigaction(SIGPIPE, &ignore, NULL);
}

/* Those that have come. Not without end: a flood must not keep a tick from its time. */
static void take_packets(const DriveDef *def, double *arrived) {
    uint8_t bytes[PACKET_MAX + 1]; /* one more, so that a longer packet is not of the right size */
    struct sockaddr_in from;
    const RunnerReport *report = runner_report(def->runner);
    int size;
    for (int i = 0; i < PACKETS && (size = udp_receive(def->udp, bytes, sizeof bytes, &from)) >= 0;
         i++) {
        const double now = clock_seconds();
        const PacketFault fault =
            runner_take(def->runner, bytes, (size_t)size, udp_sender(&from), now);
        if (fault == PACKET_FAULT_none && runner_sender(def->runner) == udp_sender(&from)) {
            def->udp->peer = from;
            def->udp->has_peer = 1;
            *arrived = now;
        } else if (report->refusal[0] && report->refused[fault] == 1) {
            def->refused(report->refusal);
        }
    }
}

/* Until it is time for the next tick, or the end. */
static void wait_for(const DriveDef *def, double deadline, double *arrived) {
    do {
        udp_wait(def->udp, deadline - clock_seconds());
        take_packets(def, arrived);
    } while (!stopped && clock_seconds() < deadline);
}

/* What ends the run; NULL: nothing. damped: [s] since damping began. */
static const char *why_end(const DriveDef *def, const DriveReport *report, double damped) {
    return stopped                                               ? "signal"
           : runner_peer_ended(def->runner)                      ? "robot"
           : damped > DAMP_TIME                                  ? "damped"
           : def->seconds > 0 && report->seconds >= def->seconds ? "time"
                                                                 : NULL;
}

static void tick(const DriveDef *def, DriveReport *report, double deadline, double arrived) {
    uint8_t bytes[PACKET_MAX];
    const double woken = clock_seconds();
    if (input_poll(def->input)) {
        runner_damp(def->runner, "by key or button");
    }
    const size_t size = runner_tick(def->runner, woken, def->input->command, bytes);
    if (size > 0) {
        udp_send(def->udp, bytes, size);
    }
    if (size > 0 && runner_mode(def->runner) != PACKET_wait) {
        const double sent = clock_seconds();
        report->ticks++;
        times_add(&report->wakeup, woken - deadline);
        times_add(&report->compute, sent - woken);
        if (runner_mode(def->runner) == PACKET_walk) {
            times_add(&report->reply, sent - arrived);
        }
    }
}

static void run(const DriveDef *def, DriveReport *report) {
    double deadline = clock_seconds(), arrived = 0, first = 0, damp_from = 0;
    do {
        wait_for(def, deadline, &arrived);
        tick(def, report, deadline, arrived);
        const double now = clock_seconds();
        first = report->ticks == 1 ? now : first;
        report->seconds = report->ticks > 0 ? now - first : 0;
        damp_from = runner_mode(def->runner) == PACKET_damp ? damp_from : now;
        report->end = why_end(def, report, now - damp_from);
        deadline += TASK_PERIOD;
        for (; deadline < now && report->ticks > 0; deadline += TASK_PERIOD) {
            report->missed++;
        }
    } while (!report->end);
}

void drive_run(const DriveDef *def, DriveReport *report) {
    uint8_t bytes[PACKET_MAX];
    memset(report, 0, sizeof *report);
    run(def, report);
    for (int i = 0; i < END_PACKETS; i++) {
        const size_t size = runner_end(def->runner, clock_seconds(), bytes);
        if (size > 0) {
            udp_send(def->udp, bytes, size);
        }
    }
}
