/* Runs the policy on what `mild eval --actions FILE.csv` recorded. Says how near its actions and
 * frames are and how long a step takes. Frames are made from the true state, so they are near only
 * where the record is without noise and delay.
 *
 *     cc -O3 -march=native example.c policy.c -lm -o example && ./example FILE.csv */
#define _POSIX_C_SOURCE 199309L

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "policy.h"

#define COLUMNS (15 + 3 * POLICY_JOINTS + POLICY_OBSERVATION) /* of a row */
#define TRIALS 64                                             /* of a record, at most */
#define STEPS 20000                                           /* timed */

/* A row: trial, [ground], speed, time, command 3, phase, quaternion 4, angular velocity 3, joints'
 * angles and speeds, observation, action. */
typedef struct {
    int trial;
    double phase;
    PolicyReadings readings;
    float observation[POLICY_OBSERVATION], action[POLICY_JOINTS];
} Row;

static void copy(const double *from, int count, float *to) {
    for (int i = 0; i < count; i++) {
        to[i] = (float)from[i];
    }
}

/* Returns 1 when the line is a row of numbers. */
static int read_row(char *line, Row *row) {
    double value[COLUMNS] = {0};
    int count = 0;
    for (char *word = strtok(line, ","); word && count < COLUMNS; word = strtok(NULL, ",")) {
        value[count++] = strtod(word, NULL); /* 0 for the name of the ground */
    }
    const double *w = value + 8, *angle = value + 15;
    row->trial = (int)value[0];
    row->phase = value[7];
    copy(value + 4, 3, row->readings.command);
    row->readings.gravity[0] = (float)(-2 * (w[1] * w[3] - w[0] * w[2]));
    row->readings.gravity[1] = (float)(-2 * (w[2] * w[3] + w[0] * w[1]));
    row->readings.gravity[2] = (float)(2 * (w[1] * w[1] + w[2] * w[2]) - 1);
    copy(value + 12, 3, row->readings.angular_velocity);
    copy(angle, POLICY_JOINTS, row->readings.angle);
    copy(angle + POLICY_JOINTS, POLICY_JOINTS, row->readings.speed);
    copy(angle + 2 * POLICY_JOINTS, POLICY_OBSERVATION, row->observation);
    copy(value + COLUMNS - POLICY_JOINTS, POLICY_JOINTS, row->action);
    return count == COLUMNS;
}

static double worst(const float *a, const float *b, int count, double so_far) {
    for (int i = 0; i < count; i++) {
        const double error = fabs((double)a[i] - (double)b[i]);
        so_far = isnan(so_far) || error <= so_far ? so_far : error;
    }
    return so_far;
}

static double seconds(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Times steps on the last frame. Where other programs have the core too, the clock counts them. */
static void bench(const char *what, clockid_t clock, PolicyState *state, const Row *row) {
    static double took[STEPS];
    float action[POLICY_JOINTS];
    for (int k = 0; k < STEPS; k++) {
        const double start = seconds(clock);
        policy_step(state, row->observation, action);
        took[k] = 1e6 * (seconds(clock) - start);
    }
    qsort(took, STEPS, sizeof *took, compare);
    printf("a step takes, %s: %.1f us, p99 %.1f us, p99.9 %.1f us, longest %.1f us\n", what,
           took[STEPS / 2], took[STEPS / 100 * 99], took[STEPS / 1000 * 999], took[STEPS - 1]);
}

int main(int argc, char **argv) {
    static char line[1 << 16];
    static PolicyState state[TRIALS]; /* a record has a row of each trial in turn */
    static Row row;
    FILE *file = argc == 2 ? fopen(argv[1], "r") : NULL;
    if (!file || !fgets(line, sizeof line, file)) {
        fprintf(stderr, "usage: %s FILE.csv, written by mild eval --actions\n", argv[0]);
        return 2;
    }
    float observation[POLICY_OBSERVATION], action[POLICY_JOINTS];
    double action_error = 0, frame_error = 0;
    int rows = 0;
    while (fgets(line, sizeof line, file) && read_row(line, &row) && row.trial < TRIALS) {
        PolicyState *own = &state[row.trial];
        if (!own->started) {
            policy_reset(own);
            own->phase = row.phase; /* 0, or 0.5 to begin with the other foot */
        }
        rows++;
        policy_observe(own, &row.readings, observation);
        policy_step(own, row.observation, action);
        frame_error = worst(observation, row.observation, POLICY_OBSERVATION, frame_error);
        action_error = worst(action, row.action, POLICY_JOINTS, action_error);
    }
    fclose(file);
    printf("%d steps: actions within %.1e, frames within %.1e\n", rows, action_error, frame_error);
    bench("by the clock", CLOCK_MONOTONIC, state, &row);
    bench("of the processor", CLOCK_PROCESS_CPUTIME_ID, state, &row);
    return 0;
}
