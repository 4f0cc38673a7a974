/* What a learned controller computes inside during the trials: as a CSV, and as means. */
#ifndef MILD_INSIDE_H
#define MILD_INSIDE_H

#include <stdio.h>

#include "control/learned.h"
#include "run/eval/eval.h"

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
