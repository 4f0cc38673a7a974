/* Where the centre of mass and the base of every trial went: a point after each policy step. */
#ifndef MILD_TRACK_H
#define MILD_TRACK_H

#include <stdio.h>

#include "env/trial.h"
#include "mild/error.h"

typedef struct {
    double mass_center[3]; /* [m] of the whole robot, world */
    double base[3];        /* [m] world */
    double roll, pitch;    /* [rad] of the base; positive pitch: forward */
} TrackPoint;

/* point: [trials][steps]; the first count[trial] of a trial are there. */
typedef struct {
    int trials, steps;
    TrackPoint *point;
    int *count; /* [trials] */
} Track;

MildStatus track_make(Track *track, int trials, int steps, MildError *error);
void track_free(Track *track);
/* Adds the point of a physics step. */
void track_take(Track *track, int trial, const EnvsSample *sample);
/* The names of the columns, and a row for each point; period: [s] of a policy step. */
void track_print_header(FILE *csv);
void track_print(const Track *track, const char *ground, double speed, double period, FILE *csv);

#endif
