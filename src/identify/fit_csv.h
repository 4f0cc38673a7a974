/* Force-depth records as CSV: a header line, then numbers. */
#ifndef LAB_FIT_CSV_H
#define LAB_FIT_CSV_H

#include <stdio.h>

#include "identify/fit_record.h"
#include "mild/error.h"

enum { FIT_CSV_ROWS_MAX = 1000000 };

/* Appends the loading part of one record to *points [*count] and enlarges it. The caller frees it,
 * also after an error. Columns are found by name, in any order: depth_m, force_n, and speed_m_s or
 * time_s (without them the speed is 0). Other columns are ignored. The message names file, line,
 * column and remedy. */
MildStatus fit_csv_read(const char *path, FitPoint **points, int *count, MildError *error);
/* The same from an open file, which stays open;  `name` is used for it in messages. */
MildStatus fit_csv_read_file(FILE *file, const char *name, FitPoint **points, int *count,
                             MildError *error);

#endif
