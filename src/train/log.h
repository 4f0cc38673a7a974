/* The log of a run folder: one row of named numbers per iteration, as log.csv and as a TensorBoard
 * event file. */
#ifndef TRAIN_LOG_H
#define TRAIN_LOG_H

#include <stdint.h>

#include "mild/error.h"

typedef struct Log Log;

/* columns: [count] names such as "reward/gait"; the part before a slash groups them in TensorBoard.
 * They are not copied and must outlive the log. The CSV has "iteration" in front. resume_after < 0:
 * a new log. Otherwise rows of log.csv after that iteration, written by a run that was killed later
 * than its last checkpoint, are dropped, and TensorBoard is told to drop its own; the columns must
 * be the same. */
Log *log_open(const char *folder, const char *const *columns, int count, int64_t resume_after,
              MildError *error);

/* values: [count]. Both files are complete up to here when the call returns. */
MildStatus log_row(Log *log, int64_t iteration, const double *values, MildError *error);

void log_close(Log *log);

#endif
