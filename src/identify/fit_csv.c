#include "identify/fit_csv.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/csv.h"
#include "base/file.h"
#include "base/text.h"

typedef enum { CSV_DEPTH, CSV_FORCE, CSV_TIME, CSV_SPEED, CSV_COLUMNS } CsvColumn;

static const char *const column_names[CSV_COLUMNS] = {"depth_m", "force_n", "time_s", "speed_m_s"};
/* Largest size of a number in each column; beyond it the unit is probably wrong. */
static const double column_limits[CSV_COLUMNS] = {2, 1e7, 1e9, 100};
static const char *const column_units[CSV_COLUMNS] = {"metres, positive down", "newtons", "seconds",
                                                      "metres per second, positive down"};

typedef struct {
    Csv text;
    int columns;             /* in the header */
    int column[CSV_COLUMNS]; /* place in the line, -1: absent */
    double time;             /* [s] of the previous row */
} Record;

static MildStatus csv_header(Record *record, MildError *error) {
    char *cells[CSV_CELLS_MAX];
    MildStatus status;
    char *line = csv_line(&record->text, &status, error);
    if (status != MILD_OK) {
        return status;
    }
    if (!line) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s: empty; a header line and rows are needed", record->text.path);
    }
    int count = record->columns = csv_split(line, cells);
    for (int c = 0; c < CSV_COLUMNS; c++) {
        record->column[c] = -1;
        for (int i = 0; i < count; i++) {
            if (strcmp(cells[i], column_names[c]) != 0) {
                continue;
            }
            if (record->column[c] >= 0) {
                return mild_fail(error, MILD_ERROR_FORMAT,
                                 "%.200s:%d: two columns are named %s; keep one", record->text.path,
                                 record->text.number, column_names[c]);
            }
            record->column[c] = i;
        }
        if (record->column[c] >= 0 || c == CSV_TIME || c == CSV_SPEED) {
            continue;
        }
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: no column %s; name the columns in the first line: "
                         "depth_m,force_n and, where "
                         "speed matters, time_s or speed_m_s",
                         record->text.path, record->text.number, column_names[c]);
    }
    return MILD_OK;
}

static MildStatus csv_cell(const Record *record, CsvColumn c, char **cells, int count,
                           double *value, MildError *error) {
    int place = record->column[c];
    *value = NAN;
    if (place < 0) {
        return MILD_OK;
    }
    if (place >= count || !*cells[place]) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: %s is missing; fill the gap or delete the row",
                         record->text.path, record->text.number, column_names[c]);
    }
    if (!text_double(cells[place], value)) {
        return mild_fail(
            error, MILD_ERROR_FORMAT,
            "%.200s:%d: %s '%.40s' is not a finite number; correct it or delete the row",
            record->text.path, record->text.number, column_names[c], cells[place]);
    }
    if (fabs(*value) <= column_limits[c]) {
        return MILD_OK;
    }
    return mild_fail(error, MILD_ERROR_RANGE, "%.200s:%d: %s %g is beyond %g; it must be in %s",
                     record->text.path, record->text.number, column_names[c], *value,
                     column_limits[c], column_units[c]);
}

static MildStatus csv_row(Record *record, char *line, FitPoint *point, MildError *error) {
    char *cells[CSV_CELLS_MAX];
    double *const values[CSV_COLUMNS] = {&point->depth, &point->force, &point->time, &point->speed};
    int count = csv_split(line, cells);
    MildStatus status = MILD_OK;
    *point = (FitPoint){.plate = 0}; /* until the caller says otherwise */
    if (count < 0) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: more than %d columns; keep those needed", record->text.path,
                         record->text.number, CSV_CELLS_MAX);
    }
    // NOLINTNEXTLINE(clang-analyzer-core.NullDereference): csv_split wrote `count` cells
    while (count > record->columns && !*cells[count - 1]) {
        count--; /* commas at the end */
    }
    if (count > record->columns) {
        return mild_fail(
            error, MILD_ERROR_FORMAT,
            "%.200s:%d: %d values under %d columns; a decimal point, not a comma, is needed",
            record->text.path, record->text.number, count, record->columns);
    }
    for (int c = 0; c < CSV_COLUMNS && status == MILD_OK; c++) {
        status = csv_cell(record, (CsvColumn)c, cells, count, values[c], error);
    }
    if (status == MILD_OK && point->time <= record->time) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: time_s %g does not come after %g of the row before; sort the "
                         "rows or split the "
                         "record into one file per press",
                         record->text.path, record->text.number, point->time, record->time);
    }
    record->time = point->time;
    return status;
}

static MildStatus csv_rows(Record *record, FitPoint **points, int *count, MildError *error) {
    MildStatus status;
    int room = *count;
    for (char *line = csv_line(&record->text, &status, error); line;
         line = csv_line(&record->text, &status, error)) {
        if (*count == room) {
            room = 2 * room + 256;
            FitPoint *more = realloc(*points, sizeof *more * (size_t)room);
            if (!more) {
                return mild_fail(error, MILD_ERROR_MEMORY, "%.200s: out of memory",
                                 record->text.path);
            }
            *points = more;
        }
        status = csv_row(record, line, *points + *count, error);
        if (status != MILD_OK) {
            return status;
        }
        if (++*count <= FIT_CSV_ROWS_MAX) {
            continue;
        }
        return mild_fail(error, MILD_ERROR_RANGE, "%.200s:%d: more than %d rows; take every tenth",
                         record->text.path, record->text.number, FIT_CSV_ROWS_MAX);
    }
    return status;
}

/* Checks that the loading rows are a press: enough rows, and a force that pushes back. */
static MildStatus csv_loading(const Record *record, FitPoint *points, int rows, int *kept,
                              MildError *error) {
    double push = 0;
    int loading = *kept = fit_loading(points, rows);
    if (loading < FIT_POINTS_MIN) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: depth_m: %d of %d rows go deeper than all before, at least %d "
                         "are needed; depth is "
                         "positive down from the surface",
                         record->text.path, record->text.number, loading, rows, FIT_POINTS_MIN);
    }
    // NOLINTNEXTLINE(clang-analyzer-core.NullDereference): fewer are refused above
    if (points[0].depth == points[loading - 1].depth) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: depth_m is %g in every row; a press to some depth is needed",
                         record->text.path, record->text.number, points[0].depth);
    }
    for (int i = 0; i < loading; i++) {
        push += points[i].force;
    }
    if (push <= 0) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: force_n does not push back on the way down; it is positive "
                         "up, on the plate",
                         record->text.path, record->text.number);
    }
    fit_speeds(points, loading);
    return MILD_OK;
}

MildStatus fit_csv_read_file(FILE *file, const char *name, FitPoint **points, int *count,
                             MildError *error) {
    Record record = {.time = -INFINITY};
    int first = *count, rows = 0;
    MildStatus status = csv_begin(&record.text, file, name, error);
    if (status == MILD_OK) {
        status = csv_header(&record, error);
    }
    if (status == MILD_OK) {
        status = csv_rows(&record, points, count, error);
    }
    if (status == MILD_OK) {
        status =
            csv_loading(&record, *points ? *points + first : NULL, *count - first, &rows, error);
    }
    *count = first + rows;
    csv_end(&record.text);
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
