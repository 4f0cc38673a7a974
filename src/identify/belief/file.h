/* The weights of a belief, from a safetensors file that lab/know/know.py writes. */
#ifndef IDENTIFY_BELIEF_FILE_H
#define IDENTIFY_BELIEF_FILE_H

#include <stdio.h>

#include "identify/belief/belief.h"
#include "mild/error.h"

/* The file that ships with the policy of SA01 (path_data). */
#define BELIEF_SHIPPED "policies/knows.safetensors"

/* The caller frees it. NULL, with one line in *error, for a file that is missing, damaged, or not
 * such a file. */
BeliefNet *belief_read(const char *path, MildError *error);

/* Bool: a robot of this name has weights that ship. */
int belief_has(const char *robot);
/* The shipped weights for a robot; *net is NULL for one that has none. The caller frees them. */
MildStatus belief_open(const char *robot, BeliefNet **net, MildError *error);

/* A robot's log: a CSV with a row for each policy step, the frames that its policy saw
 * (docs/identify.md). `mild drive --log` and `mild play --log` write it, and `mild eval --actions`
 * one with further columns. */

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
