#include "drive/drive.h"

#include <signal.h>
#include <string.h>

#include "base/clock.h"

#define DAMP_TIME 1.0 /* [s] for which damping is sent before the end */
#define END_PACKETS 3

static volatile sig_atomic_t stopped;

static void stop(int signal) {
    (void)signal;
    stopped = 1;
}

static void take_packets(const DriveDef *def, DriveReport *report, double *arrived) {
    uint8_t bytes[PACKET_MAX + 1]; /* one more, so that a longer packet is not of the right size */
    struct sockaddr_in from;
    int size;
    while ((size = udp_receive(def->udp, bytes, sizeof bytes, &from)) >= 0) {
        if (def->udp->has_peer && !udp_same(&from, &def->udp->peer)) {
            report->strangers++;
            continue;
        }
        const double now = clock_seconds();
        if (runner_take(def->runner, bytes, (size_t)size, now) == PACKET_FAULT_none) {
            def->udp->peer = from;
            def->udp->has_peer = 1;
            *arrived = now;
        }
    }
}

/* Until it is time for the next tick, or the end. */
static void wait_for(const DriveDef *def, DriveReport *report, double deadline, double *arrived) {
    do {
        udp_wait(def->udp, deadline - clock_seconds());
        take_packets(def, report, arrived);
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
        wait_for(def, report, deadline, &arrived);
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
    struct sigaction action = {.sa_handler = stop}, before[2];
    memset(report, 0, sizeof *report);
    stopped = 0;
    sigaction(SIGINT, &action, &before[0]);
    sigaction(SIGTERM, &action, &before[1]);
    run(def, report);
    for (int i = 0; i < END_PACKETS; i++) {
        udp_send(def->udp, bytes, runner_end(def->runner, clock_seconds(), bytes));
    }
    sigaction(SIGINT, &before[0], NULL);
    sigaction(SIGTERM, &before[1], NULL);
}
