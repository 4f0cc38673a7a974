/* The log of a run folder: a row of named numbers for each iteration, in log.csv and in a
 * TensorBoard event file. */
#ifndef TRAIN_LOG_H
#define TRAIN_LOG_H

#include <stdint.h>

#include "mild/error.h"

typedef struct Log Log;

/* Fails when there is something at the path of log.csv that must not be written in place: a link,
 * also a hard one, as in the folder of another run that was copied by hard links. */
MildStatus log_check(const char *path, MildError *error);

/* columns: [count] names such as "reward/gait"; TensorBoard groups them by the part before the
 * slash. They are not copied and must outlive the log. The first column of the CSV is
 * "iteration". resume_after < 0: a new log. Otherwise the log is continued with the same
 * columns. Rows after that iteration come from a run that was killed after its last checkpoint.
 * They are dropped from log.csv, and TensorBoard drops its own, too. */
Log *log_open(const char *folder, const char *const *columns, int count, int64_t resume_after,
              MildError *error);

/* Writes the text of config.ini into the TensorBoard file, as a text and as hyperparameters. Call
 * it once, after log_open. */
MildStatus log_config(Log *log, const char *config, MildError *error);

/* values: [count]. Both files are complete up to here when the call returns. */
MildStatus log_row(Log *log, int64_t iteration, const double *values, MildError *error);

void log_close(Log *log);

#endif
