#include "lab/fit_csv.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "base/text.h"

enum { CSV_COLUMNS_MAX = 256, CSV_LINE_MAX = 65536 };
typedef enum { CSV_DEPTH, CSV_FORCE, CSV_TIME, CSV_SPEED, CSV_COLUMNS } CsvColumn;

static const char *const column_names[CSV_COLUMNS] = {"depth_m", "force_n", "time_s", "speed_m_s"};
/* Largest size of a number in each column; beyond it the unit is probably wrong. */
static const double column_limits[CSV_COLUMNS] = {2, 1e7, 1e9, 100};
static const char *const column_units[CSV_COLUMNS] = {"metres, positive down", "newtons", "seconds",
                                                      "metres per second, positive down"};

typedef struct {
    const char *path;
    FILE *file;
    char *line;              /* [CSV_LINE_MAX + 1] */
    int number;              /* of the line, from 1 */
    int columns;             /* in the header */
    int column[CSV_COLUMNS]; /* place in the line, -1: absent */
    double time;             /* [s] of the previous row */
} Csv;

/* Trims white space on both sides, in place. */
static char *trim(char *text) {
    text += strspn(text, " \t\r\n");
    size_t length = strlen(text);
    while (length > 0 && strchr(" \t\r\n", text[length - 1])) {
        length--;
    }
    text[length] = '\0';
    return text;
}

/* Reads a line of at most CSV_LINE_MAX characters into csv->line and ends it with '\0'. Returns
 * its length with the newline, 0 at the end of the file, -1 for a line that is longer or
 * contains '\0'. */
static int csv_read_line(Csv *csv) {
    int length = 0, c = 0;
    while (c != '\n' && (c = getc_unlocked(csv->file)) != EOF) {
        if (c == '\0' || length == CSV_LINE_MAX) {
            return -1;
        }
        csv->line[length++] = (char)c;
    }
    csv->line[length] = '\0';
    return length;
}

/* The next line that is neither empty nor a remark (#), trimmed. NULL at the end or after an error,
 * which *status tells. */
static char *csv_line(Csv *csv, MildStatus *status, MildError *error) {
    *status = MILD_OK;
    for (;;) {
        int length = csv_read_line(csv);
        if (ferror(csv->file)) {
            *status = mild_fail(error, MILD_ERROR_IO, "%.200s: cannot read: %s", csv->path,
                                strerror(errno));
            return NULL;
        }
        if (length == 0) {
            return NULL;
        }
        csv->number++;
        if (length < 0) {
            *status = mild_fail(error, MILD_ERROR_FORMAT,
                                "%.200s:%d: not a line of text of at most %d characters; a CSV "
                                "with a header line is needed",
                                csv->path, csv->number, CSV_LINE_MAX);
            return NULL;
        }
        char *text =
            csv->line + (csv->number == 1 && strncmp(csv->line, "\xef\xbb\xbf", 3) == 0 ? 3 : 0);
        text = trim(text);
        if (*text && *text != '#') {
            return text;
        }
    }
}

/* Splits at commas, in place; returns the count, or -1 when there are more than CSV_COLUMNS_MAX. */
static int csv_split(char *line, char *cells[CSV_COLUMNS_MAX]) {
    int count = 0;
    for (char *cell = line, *next; cell; cell = next) {
        next = strchr(cell, ',');
        if (next) {
            *next++ = '\0';
        }
        if (count == CSV_COLUMNS_MAX) {
            return -1;
        }
        cells[count++] = trim(cell);
    }
    return count;
}

static MildStatus csv_header(Csv *csv, MildError *error) {
    char *cells[CSV_COLUMNS_MAX];
    MildStatus status;
    char *line = csv_line(csv, &status, error);
    if (status != MILD_OK) {
        return status;
    }
    if (!line) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s: empty; a header line and rows are needed", csv->path);
    }
    int count = csv->columns = csv_split(line, cells);
    for (int c = 0; c < CSV_COLUMNS; c++) {
        csv->column[c] = -1;
        for (int i = 0; i < count; i++) {
            if (strcmp(cells[i], column_names[c]) != 0) {
                continue;
            }
            if (csv->column[c] >= 0) {
                return mild_fail(error, MILD_ERROR_FORMAT,
                                 "%.200s:%d: two columns are named %s; keep one", csv->path,
                                 csv->number, column_names[c]);
            }
            csv->column[c] = i;
        }
        if (csv->column[c] >= 0 || c == CSV_TIME || c == CSV_SPEED) {
            continue;
        }
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: no column %s; name the columns in the first line: "
                         "depth_m,force_n and, where "
                         "speed matters, time_s or speed_m_s",
                         csv->path, csv->number, column_names[c]);
    }
    return MILD_OK;
}

static MildStatus csv_cell(const Csv *csv, CsvColumn c, char **cells, int count, double *value,
                           MildError *error) {
    int place = csv->column[c];
    *value = NAN;
    if (place < 0) {
        return MILD_OK;
    }
    if (place >= count || !*cells[place]) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: %s is missing; fill the gap or delete the row", csv->path,
                         csv->number, column_names[c]);
    }
    if (!text_double(cells[place], value)) {
        return mild_fail(
            error, MILD_ERROR_FORMAT,
            "%.200s:%d: %s '%.40s' is not a finite number; correct it or delete the row", csv->path,
            csv->number, column_names[c], cells[place]);
    }
    if (fabs(*value) <= column_limits[c]) {
        return MILD_OK;
    }
    return mild_fail(error, MILD_ERROR_RANGE, "%.200s:%d: %s %g is beyond %g; it must be in %s",
                     csv->path, csv->number, column_names[c], *value, column_limits[c],
                     column_units[c]);
}

static MildStatus csv_row(Csv *csv, char *line, FitPoint *point, MildError *error) {
    char *cells[CSV_COLUMNS_MAX];
    double *const values[CSV_COLUMNS] = {&point->depth, &point->force, &point->time, &point->speed};
    int count = csv_split(line, cells);
    MildStatus status = MILD_OK;
    if (count < 0) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: more than %d columns; keep those needed", csv->path,
                         csv->number, CSV_COLUMNS_MAX);
    }
    // NOLINTNEXTLINE(clang-analyzer-core.NullDereference): csv_split wrote `count` cells
    while (count > csv->columns && !*cells[count - 1]) {
        count--; /* commas at the end */
    }
    if (count > csv->columns) {
        return mild_fail(
            error, MILD_ERROR_FORMAT,
            "%.200s:%d: %d values under %d columns; a decimal point, not a comma, is needed",
            csv->path, csv->number, count, csv->columns);
    }
    for (int c = 0; c < CSV_COLUMNS && status == MILD_OK; c++) {
        status = csv_cell(csv, (CsvColumn)c, cells, count, values[c], error);
    }
    if (status == MILD_OK && point->time <= csv->time) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: time_s %g does not come after %g of the row before; sort the "
                         "rows or split the "
                         "record into one file per press",
                         csv->path, csv->number, point->time, csv->time);
    }
    csv->time = point->time;
    return status;
}

static MildStatus csv_rows(Csv *csv, FitPoint **points, int *count, MildError *error) {
    MildStatus status;
    int room = *count;
    for (char *line = csv_line(csv, &status, error); line; line = csv_line(csv, &status, error)) {
        if (*count == room) {
            room = 2 * room + 256;
            FitPoint *more = realloc(*points, sizeof *more * (size_t)room);
            if (!more) {
                return mild_fail(error, MILD_ERROR_MEMORY, "%.200s: out of memory", csv->path);
            }
            *points = more;
        }
        status = csv_row(csv, line, *points + *count, error);
        if (status != MILD_OK) {
            return status;
        }
        if (++*count <= FIT_CSV_ROWS_MAX) {
            continue;
        }
        return mild_fail(error, MILD_ERROR_RANGE, "%.200s:%d: more than %d rows; take every tenth",
                         csv->path, csv->number, FIT_CSV_ROWS_MAX);
    }
    return status;
}

/* Checks that the loading rows are a press: enough rows, and a force that pushes back. */
static MildStatus csv_loading(const Csv *csv, FitPoint *points, int rows, int *kept,
                              MildError *error) {
    double push = 0;
    int loading = *kept = fit_loading(points, rows);
    if (loading < FIT_POINTS_MIN) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: depth_m: %d of %d rows go deeper than all before, at least %d "
                         "are needed; depth is "
                         "positive down from the surface",
                         csv->path, csv->number, loading, rows, FIT_POINTS_MIN);
    }
    // NOLINTNEXTLINE(clang-analyzer-core.NullDereference): fewer are refused above
    if (points[0].depth == points[loading - 1].depth) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: depth_m is %g in every row; a press to some depth is needed",
                         csv->path, csv->number, points[0].depth);
    }
    for (int i = 0; i < loading; i++) {
        push += points[i].force;
    }
    if (push <= 0) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: force_n does not push back on the way down; it is positive "
                         "up, on the plate",
                         csv->path, csv->number);
    }
    fit_speeds(points, loading);
    return MILD_OK;
}

MildStatus fit_csv_read_file(FILE *file, const char *name, FitPoint **points, int *count,
                             MildError *error) {
    Csv csv = {.path = name, .file = file, .line = malloc(CSV_LINE_MAX + 1), .time = -INFINITY};
    int first = *count, rows = 0;
    if (!csv.line) {
        return mild_fail(error, MILD_ERROR_MEMORY, "%.200s: out of memory", name);
    }
    MildStatus status = csv_header(&csv, error);
    if (status == MILD_OK) {
        status = csv_rows(&csv, points, count, error);
    }
    if (status == MILD_OK) {
        status = csv_loading(&csv, *points ? *points + first : NULL, *count - first, &rows, error);
    }
    *count = first + rows;
    free(csv.line);
    return status;
}

MildStatus fit_csv_read(const char *path, FitPoint **points, int *count, MildError *error) {
    MildError cause = {0};
    FILE *file = file_open(path, &cause);
    if (!file) {
        return mild_fail(error, cause.status, "%.300s%s", cause.text,
                         cause.status == MILD_ERROR_IO ? "; `mild press --csv FILE` writes a record"
                                                       : "");
    }
    MildStatus status = fit_csv_read_file(file, path, points, count, error);
    fclose(file);
    return status;
}
