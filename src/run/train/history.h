/* Reads a log.csv back. */
#ifndef TRAIN_HISTORY_H
#define TRAIN_HISTORY_H

#include <stddef.h>

#include "mild/error.h"

typedef struct {
    int columns, rows;
    char **name;   /* [columns]; the first is "iteration" */
    double *value; /* [rows][columns]; NaN where the log says nan */
    char *text;    /* storage of the names */
} History;

/* Reads all complete rows. A last line without an end is left out, because a training may be
 * writing it. The columns may be those of any version, but the first must be "iteration", whose
 * numbers are from 0 to 1e15 and rise. Fails with "PATH:LINE: reason"; there is then nothing to
 * free. */
MildStatus history_read(const char *path, History *history, MildError *error);
void history_free(History *history);

/* Index of the column, or -1. */
int history_column(const History *history, const char *name);

/* Means of a column over the rows whose iteration is nearest to each of `points` even places
 * between first and last. mean: [points], NaN where there is no number. */
void history_means(const History *history, int column, double first, double last, int points,
                   double *mean);

#endif
