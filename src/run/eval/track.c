#include "run/eval/track.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

MildStatus track_make(Track *track, int trials, int steps, MildError *error) {
    *track = (Track){.trials = trials, .steps = steps};
    track->point = calloc((size_t)trials * (size_t)steps, sizeof *track->point);
    track->count = calloc((size_t)trials, sizeof *track->count);
    return track->point && track->count
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_MEMORY, "out of memory for %d tracks of %d points",
                           trials, steps);
}

void track_free(Track *track) {
    free(track->point);
    free(track->count);
}

void track_take(Track *track, int trial, const EnvsSample *sample) {
    const double *q = sample->quaternion;
    const double up[3] = {2 * (q[1] * q[3] - q[0] * q[2]), 2 * (q[2] * q[3] + q[0] * q[1]),
                          1 - 2 * (q[1] * q[1] + q[2] * q[2])}; /* in the base's axes */
    TrackPoint *point = track->point + (size_t)trial * (size_t)track->steps + track->count[trial]++;
    memcpy(point->mass_center, sample->mass_center, sizeof point->mass_center);
    memcpy(point->base, sample->base, sizeof point->base);
    point->roll = atan2(up[1], up[2]);
    point->pitch = atan2(-up[0], hypot(up[1], up[2]));
}

void track_print_header(FILE *csv) {
    fprintf(csv, "ground,speed_m_s,trial,time_s,com_x_m,com_y_m,com_z_m,base_x_m,base_y_m,"
                 "base_z_m,roll_rad,pitch_rad\n");
}

void track_print(const Track *track, const char *ground, double speed, double period, FILE *csv) {
    for (int trial = 0; trial < track->trials; trial++) {
        for (int i = 0; i < track->count[trial]; i++) {
            const TrackPoint *p = track->point + (size_t)trial * (size_t)track->steps + i;
            const double *c = p->mass_center, *b = p->base;
            fprintf(csv, "%s,%g,%d,%.2f,%.5f,%.5f,%.5f,%.5f,%.5f,%.5f,%.5f,%.5f\n", ground, speed,
                    trial, (i + 1) * period, c[0], c[1], c[2], b[0], b[1], b[2], p->roll, p->pitch);
        }
    }
}
