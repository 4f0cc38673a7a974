/* Lines and cells of a CSV file: what its readers have in common. */
#ifndef BASE_CSV_H
#define BASE_CSV_H

#include <stdio.h>

#include "mild/error.h"

enum { CSV_CELLS_MAX = 256, CSV_LINE_MAX = 65536 };

typedef struct {
    const char *path; /* for messages */
    FILE *file;
    char *line; /* [CSV_LINE_MAX + 1] */
    int number; /* of the line, from 1 */
} Csv;

/* An open file, which stays open. csv_end frees the line, also after a failure. */
MildStatus csv_begin(Csv *csv, FILE *file, const char *path, MildError *error);
void csv_end(Csv *csv);

/* The next line that is neither empty nor a remark (#), trimmed. NULL at the end or after an error,
 * which is in *status. */
char *csv_line(Csv *csv, MildStatus *status, MildError *error);

/* Splits at commas, in place, into trimmed cells; returns the count, or -1 when there are more than
 * CSV_CELLS_MAX. */
int csv_split(char *line, char *cells[CSV_CELLS_MAX]);

#endif
