/* A robot's log: a CSV with a row for each policy step, the frames that its policy saw
 * (docs/identify.md). `mild drive --log` and `mild play --log` write it, and `mild eval --actions`
 * one with further columns. */
#ifndef IDENTIFY_BELIEF_LOG_H
#define IDENTIFY_BELIEF_LOG_H

#include <stdio.h>

#include "identify/belief/belief.h"
#include "mild/error.h"

typedef struct {
    float (*frame)[BELIEF_FRAME]; /* [count] the owner frees it */
    int count;
} BeliefLog;

/* Bool: the file's first line has the columns of a log. A file that cannot be read has not. */
int belief_log_is(const char *path);
/* Reads a log; `trial`: of a file with a column `trial`, which has rows of others too. Fails with
 * the line and a remedy. */
MildStatus belief_log_read(const char *path, int trial, BeliefLog *log, MildError *error);

/* time: [s] */
void belief_log_print_header(FILE *csv);
void belief_log_print(FILE *csv, double time, const float *frame);

#endif
