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

#define LEAST_FORCE 1.0 /* [N] with less there is no centre of pressure */

MildStatus feet_make(Feet *feet, const Robot *robot, int trials, int steps, MildError *error) {
    *feet = (Feet){.trials = trials, .steps = steps, .feet = robot_feet(robot)};
    const size_t rows = (size_t)trials * (size_t)steps * (size_t)feet->feet;
    for (int f = 0; f < feet->feet; f++) {
        feet->sole[f] = mild_sole_z(robot_rasters(robot)[f]);
    }
    feet->row = calloc(rows, sizeof *feet->row);
    feet->count = calloc((size_t)trials, sizeof *feet->count);
    return feet->row && feet->count ? MILD_OK
                                    : mild_fail(error, MILD_ERROR_MEMORY,
                                                "out of memory for the feet of %d trials", trials);
}

void feet_free(Feet *feet) {
    free(feet->row);
    free(feet->count);
}

/* v in the foot's frame. */
static void to_foot(const double rotation[9], const double v[3], double out[3]) {
    for (int k = 0; k < 3; k++) {
        out[k] = rotation[k] * v[0] + rotation[3 + k] * v[1] + rotation[6 + k] * v[2];
    }
}

/* Where the force's line meets the sole's plane: there p x F has the torque's two parts in it. */
static void find_center(FeetRow *row, const double rotation[9], double sole) {
    double f[3], t[3];
    to_foot(rotation, row->force, f);
    to_foot(rotation, row->torque, t);
    if (f[2] > LEAST_FORCE) {
        row->center[0] = (sole * f[0] - t[1]) / f[2];
        row->center[1] = (sole * f[1] + t[0]) / f[2];
    }
}

static void take_foot(FeetRow *row, const EnvsFoot *foot, double sole) {
    const double *turn = foot->rotation;
    *row = (FeetRow){.depth = foot->depth, .height = foot->height};
    memcpy(row->ankle, foot->position, sizeof row->ankle);
    memcpy(row->force, foot->force, sizeof row->force);
    memcpy(row->torque, foot->torque, sizeof row->torque);
    row->rotation[0] = atan2(turn[7], turn[8]);
    row->rotation[1] = atan2(-turn[6], hypot(turn[7], turn[8]));
    row->rotation[2] = atan2(turn[3], turn[0]);
    find_center(row, turn, sole);
}

void feet_take(Feet *feet, int trial, const EnvsSample *sample) {
    const int at = trial * feet->steps + feet->count[trial]++;
    for (int f = 0; f < feet->feet; f++) {
        take_foot(&feet->row[at * feet->feet + f], &sample->foot[f], feet->sole[f]);
    }
}

void feet_print_header(FILE *csv) {
    fprintf(csv, "ground,speed_m_s,trial,foot,time_s,ankle_x_m,ankle_y_m,ankle_z_m,roll_rad,"
                 "pitch_rad,yaw_rad,force_x_n,force_y_n,force_z_n,torque_x_nm,torque_y_nm,"
                 "torque_z_nm,center_x_m,center_y_m,depth_m,height_m\n");
}

static void print_row(const FeetRow *row, FILE *csv) {
    const double *parts[] = {row->ankle, row->rotation, row->force, row->torque};
    for (int p = 0; p < 4; p++) {
        for (int k = 0; k < 3; k++) {
            fprintf(csv, p < 2 ? ",%.7f" : ",%.3f", parts[p][k]);
        }
    }
    fprintf(csv, ",%.4f,%.4f,%.6f,%.6f\n", row->center[0], row->center[1], row->depth, row->height);
}

void feet_print(const Feet *feet, const char *ground, double speed, double period, FILE *csv) {
    for (int i = 0; i < feet->trials * feet->steps * feet->feet; i++) {
        const int f = i % feet->feet, step = i / feet->feet % feet->steps;
        const int trial = i / feet->feet / feet->steps;
        if (step < feet->count[trial]) {
            fprintf(csv, "%s,%g,%d,%d,%.5f", ground, speed, trial, f, (step + 1) * period);
            print_row(&feet->row[i], csv);
        }
    }
}
