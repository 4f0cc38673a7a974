/* What a controller saw and did along the trials, as a CSV: for those who run a policy elsewhere
 * (docs/policy.md). */
#ifndef MILD_ACTIONS_H
#define MILD_ACTIONS_H

#include <stdio.h>

#include "control/learned.h"
#include "run/eval/eval.h"

/* The names of the columns: trial, ground, speed, time; command, phase, quaternion (w x y z) and
 * angular velocity of the base, angle and speed of each joint, all true; the observation, with
 * noise and delay; the action within its clip. SI units, but for phase, observation and action. */
void actions_print_header(FILE *csv, const TaskDef *task, const Robot *robot);
void actions_print_row(FILE *csv, const EvalDecision *decision);

/* ---- what a learned controller computes inside during the trials: as a CSV, and as means ---- */

typedef struct {
    const LearnedInside *inside;
    int feet;
    FILE *csv;   /* a row per decision; NULL: none */
    double *sum; /* [latent] of z, [estimates], [theta] over the decisions; NULL: none */
    long decisions;
} InsideLog;

/* Adds each decision to the log. */
EvalCallback inside_callback(InsideLog *log);
/* The names of the columns. SI units, but for the phase and for what the networks alone know. */
void inside_print_header(const InsideLog *log);
/* [latent + estimates + theta] */
void inside_means(const InsideLog *log, float *means);

#endif
