#include "identify/fit_csv.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/csv.h"
#include "base/file.h"
#include "base/text.h"

typedef enum {
    CSV_DEPTH,
    CSV_FORCE,
    CSV_TIME,
    CSV_SPEED,
    CSV_AREA,
    CSV_SLIP,
    CSV_SHEAR,
    CSV_PRESSURE,
    CSV_ANGLE,
    CSV_TORQUE,
    CSV_X,
    CSV_ALONG,
    CSV_COLUMNS
} CsvColumn;

static const char *const column_names[CSV_COLUMNS] = {
    "depth_m",  "force_n",     "time_s",    "speed_m_s", "area_m2", "slip_m",
    "shear_pa", "pressure_pa", "angle_rad", "torque_nm", "x_m",     "force_x_n"};
/* Largest size of a number in each column; beyond it the unit is probably wrong. */
static const double column_limits[CSV_COLUMNS] = {2,   1e7, 1e9, 100, 10,  2,
                                                  1e7, 1e8, 100, 1e5, 1e3, 1e7};
static const char *const column_units[CSV_COLUMNS] = {"metres, positive down",
                                                      "newtons",
                                                      "seconds",
                                                      "metres per second, positive down",
                                                      "square metres",
                                                      "metres",
                                                      "pascals",
                                                      "pascals",
                                                      "radians",
                                                      "newton metres",
                                                      "metres",
                                                      "newtons"};

static unsigned bit(CsvColumn c) {
    return 1U << c;
}

/* The columns of each kind of file, as bits: those that it must have and those that it may. */
static unsigned needed(FitFileKind kind) {
    return kind == FIT_FILE_SHEAR  ? bit(CSV_SLIP) | bit(CSV_SHEAR) | bit(CSV_PRESSURE)
           : kind == FIT_FILE_RING ? bit(CSV_ANGLE) | bit(CSV_TORQUE) | bit(CSV_FORCE)
                                   : bit(CSV_DEPTH) | bit(CSV_FORCE);
}

static unsigned read_of(FitFileKind kind) {
    const unsigned slides = bit(CSV_SLIP) | bit(CSV_X) | bit(CSV_ALONG);
    return kind == FIT_FILE_PRESS
               ? needed(kind) | bit(CSV_TIME) | bit(CSV_SPEED) | bit(CSV_AREA) | slides
               : needed(kind);
}

typedef struct {
    Csv text;
    FitFileKind kind;
    int columns;             /* in the header */
    int column[CSV_COLUMNS]; /* place in the line, -1: absent or not read */
    double time;             /* [s] of the previous row */
} FitReader;

/* The places of the columns in the header. */
static MildStatus columns_find(FitReader *reader, char **cells, MildError *error) {
    for (int c = 0; c < CSV_COLUMNS; c++) {
        reader->column[c] = -1;
        for (int i = 0; i < reader->columns; i++) {
            if (strcmp(cells[i], column_names[c]) != 0) {
                continue;
            }
            if (reader->column[c] >= 0) {
                return mild_fail(error, MILD_ERROR_FORMAT,
                                 "%.200s:%d: two columns are named %s; keep one", reader->text.path,
                                 reader->text.number, column_names[c]);
            }
            reader->column[c] = i;
        }
    }
    return MILD_OK;
}

/* What the file is: a press, unless it has a column that only another kind has. */
static MildStatus kind_find(FitReader *reader, MildError *error) {
    const int *column = reader->column;
    reader->kind = column[CSV_SLIP] >= 0 || column[CSV_SHEAR] >= 0     ? FIT_FILE_SHEAR
                   : column[CSV_ANGLE] >= 0 || column[CSV_TORQUE] >= 0 ? FIT_FILE_RING
                                                                       : FIT_FILE_PRESS;
    if (column[CSV_DEPTH] >= 0) {
        reader->kind = FIT_FILE_PRESS;
    }
    for (int c = 0; c < CSV_COLUMNS; c++) {
        if (column[c] < 0 && needed(reader->kind) & bit((CsvColumn)c)) {
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%.200s:%d: no column %s; name the columns in the first line: "
                             "depth_m,force_n and, where speed matters, time_s or speed_m_s; of a "
                             "plate that is dragged also slip_m,force_x_n; of a shear test "
                             "slip_m,shear_pa,pressure_pa, or of a ring angle_rad,torque_nm,"
                             "force_n",
                             reader->text.path, reader->text.number, column_names[c]);
        }
        if (!(read_of(reader->kind) & bit((CsvColumn)c))) {
            reader->column[c] = -1;
        }
    }
    return MILD_OK;
}

static MildStatus csv_header(FitReader *reader, MildError *error) {
    char *cells[CSV_CELLS_MAX];
    MildStatus status;
    char *line = csv_line(&reader->text, &status, error);
    if (status != MILD_OK) {
        return status;
    }
    if (!line) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s: empty; a header line and rows are needed", reader->text.path);
    }
    reader->columns = csv_split(line, cells);
    status = columns_find(reader, cells, error);
    return status == MILD_OK ? kind_find(reader, error) : status;
}

/* Checks that a number of line `row` is within the limit of its column. */
static MildStatus limit_check(const char *where, int row, CsvColumn c, double value,
                              MildError *error) {
    if (!(fabs(value) > column_limits[c])) {
        return MILD_OK;
    }
    return mild_fail(error, MILD_ERROR_RANGE, "%.200s:%d: %s %g is beyond %g; it must be in %s",
                     where, row, column_names[c], value, column_limits[c], column_units[c]);
}

static MildStatus csv_cell(const FitReader *reader, CsvColumn c, char **cells, int count,
                           double *value, MildError *error) {
    int place = reader->column[c];
    *value = NAN;
    if (place < 0) {
        return MILD_OK;
    }
    if (place >= count || !*cells[place]) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: %s is missing; fill the gap or delete the row",
                         reader->text.path, reader->text.number, column_names[c]);
    }
    if (!text_double(cells[place], value)) {
        return mild_fail(
            error, MILD_ERROR_FORMAT,
            "%.200s:%d: %s '%.40s' is not a finite number; correct it or delete the row",
            reader->text.path, reader->text.number, column_names[c], cells[place]);
    }
    return limit_check(reader->text.path, reader->text.number, c, *value, error);
}

/* A row of the numbers that the file has, NaN for the others. It is of plate 0 until the caller
 * says otherwise. */
static FitPoint point_of(const FitReader *reader, const double number[CSV_COLUMNS]) {
    switch (reader->kind) {
    case FIT_FILE_SHEAR:
        return (FitPoint){.time = NAN,
                          .depth = number[CSV_SLIP],
                          .force = number[CSV_SHEAR],
                          .load = number[CSV_PRESSURE]};
    case FIT_FILE_RING:
        return (FitPoint){.time = NAN,
                          .depth = number[CSV_ANGLE],
                          .force = number[CSV_TORQUE],
                          .load = number[CSV_FORCE]};
    default:
        return (FitPoint){.time = number[CSV_TIME],
                          .depth = number[CSV_DEPTH],
                          .force = number[CSV_FORCE],
                          .speed = number[CSV_SPEED],
                          .slip = number[reader->column[CSV_SLIP] >= 0 ? CSV_SLIP : CSV_X],
                          .along = number[CSV_ALONG],
                          .area = reader->column[CSV_AREA] >= 0 ? number[CSV_AREA] : 0};
    }
}

static MildStatus csv_row(FitReader *reader, char *line, FitPoint *point, MildError *error) {
    char *cells[CSV_CELLS_MAX];
    double number[CSV_COLUMNS];
    int count = csv_split(line, cells);
    MildStatus status = MILD_OK;
    if (count < 0) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: more than %d columns; keep those needed", reader->text.path,
                         reader->text.number, CSV_CELLS_MAX);
    }
    // NOLINTNEXTLINE(clang-analyzer-core.NullDereference): csv_split wrote `count` cells
    while (count > reader->columns && !*cells[count - 1]) {
        count--; /* commas at the end */
    }
    if (count > reader->columns) {
        return mild_fail(
            error, MILD_ERROR_FORMAT,
            "%.200s:%d: %d values under %d columns; a decimal point, not a comma, is needed",
            reader->text.path, reader->text.number, count, reader->columns);
    }
    for (int c = 0; c < CSV_COLUMNS && status == MILD_OK; c++) {
        status = csv_cell(reader, (CsvColumn)c, cells, count, &number[c], error);
    }
    if (status == MILD_OK) {
        *point = point_of(reader, number);
    }
    if (status == MILD_OK && point->time <= reader->time) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: time_s %g does not come after %g of the row before; sort the "
                         "rows or split the "
                         "record into one file per press",
                         reader->text.path, reader->text.number, point->time, reader->time);
    }
    reader->time = point->time;
    return status;
}

static MildStatus csv_rows(FitReader *reader, FitFile *file, MildError *error) {
    MildStatus status;
    int room = 0;
    for (char *line = csv_line(&reader->text, &status, error); line;
         line = csv_line(&reader->text, &status, error)) {
        if (file->count == room) {
            room = 2 * room + 256;
            FitPoint *more = realloc(file->points, sizeof *more * (size_t)room);
            if (!more) {
                return mild_fail(error, MILD_ERROR_MEMORY, "%.200s: out of memory",
                                 reader->text.path);
            }
            file->points = more;
        }
        status = csv_row(reader, line, file->points + file->count, error);
        if (status != MILD_OK) {
            return status;
        }
        if (++file->count <= FIT_CSV_ROWS_MAX) {
            continue;
        }
        return mild_fail(error, MILD_ERROR_RANGE, "%.200s:%d: more than %d rows; take every tenth",
                         reader->text.path, reader->text.number, FIT_CSV_ROWS_MAX);
    }
    return status;
}

const char *fit_slide_wrong(const FitPoint *slide, int count, int slid, int along) {
    double up = 0, against = 0, top = 0;
    for (int i = 0; i < count; i++) {
        const FitPoint *row = &slide[i];
        up += row->force;
        top = fmax(top, row->depth);
        against += row->slip > 0 && isfinite(row->along) ? row->along : 0;
    }
    return !count                    ? NULL
           : slid < FIT_POINTS_MIN   ? "too few rows slide, at least 8 are needed"
           : !(up > 0 && top > 0)    ? "the plate slides, and force_n carries nothing"
           : along && !(against > 0) ? "force_x_n does not resist the slip; it is the force on the "
                                       "plate, negative where it moves to +x"
                                     : NULL;
}

/* Takes the slide out of a press, and checks that it is of use. */
static MildStatus csv_slide(const FitReader *reader, FitFile *file, MildError *error) {
    if (file->kind != FIT_FILE_PRESS || !file->count) {
        return MILD_OK;
    }
    file->slide = malloc(sizeof *file->slide * (size_t)file->count);
    if (!file->slide) {
        return mild_fail(error, MILD_ERROR_MEMORY, "%.200s: out of memory", reader->text.path);
    }
    const int slid = fit_sliding(file->points, &file->count, file->slide, &file->slide_count);
    const char *wrong =
        fit_slide_wrong(file->slide, file->slide_count, slid, reader->column[CSV_ALONG] >= 0);
    return wrong ? mild_fail(error, MILD_ERROR_FORMAT, "%.200s:%d: %s", reader->text.path,
                             reader->text.number, wrong)
                 : MILD_OK;
}

/* What the rows of each kind lack when their mean is not above 0. */
static const char *const no_push[FIT_FILES] = {
    "force_n does not push back on the way down; it is positive up, on the plate",
    "shear_pa does not resist the slip; it is positive where it does",
    "torque_nm does not resist the turn; it is positive where it does"};

/* Checks that forces resist. row: where the message points. */
static MildStatus push_check(const char *where, int row, FitFileKind kind, const FitPoint *points,
                             int count, MildError *error) {
    double push = 0;
    for (int i = 0; i < count; i++) {
        push += points[i].force;
    }
    return push <= 0
               ? mild_fail(error, MILD_ERROR_FORMAT, "%.200s:%d: %s", where, row, no_push[kind])
               : MILD_OK;
}

MildStatus fit_rows_check(const char *where, const FitPoint *points, int count, MildError *error) {
    static const CsvColumn columns[] = {CSV_TIME,  CSV_DEPTH, CSV_FORCE,
                                        CSV_SPEED, CSV_SLIP,  CSV_ALONG};
    for (int i = 0; i < count; i++) {
        const FitPoint *p = &points[i];
        const double number[] = {p->time, p->depth, p->force, p->speed, p->slip, p->along};
        for (size_t k = 0; k < sizeof columns / sizeof *columns; k++) {
            MildStatus status = limit_check(where, i + 1, columns[k], number[k], error);
            if (status != MILD_OK) {
                return status;
            }
        }
    }
    return count ? push_check(where, count, FIT_FILE_PRESS, points, count, error) : MILD_OK;
}

/* Checks that the rows are a press or a slip: enough that go on, and a force that resists. */
static MildStatus csv_loading(const FitReader *reader, FitFile *file, MildError *error) {
    const CsvColumn way = file->kind == FIT_FILE_SHEAR  ? CSV_SLIP
                          : file->kind == FIT_FILE_RING ? CSV_ANGLE
                                                        : CSV_DEPTH;
    const int rows = file->count;
    file->count = fit_loading(file->points, rows);
    if (file->count < FIT_POINTS_MIN && file->slide_count) {
        file->count = 0; /* the record begins with the slide */
        return MILD_OK;
    }
    if (file->count < FIT_POINTS_MIN) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: %s: %d of %d rows go %s than all before, at least %d "
                         "are needed; %s",
                         reader->text.path, reader->text.number, column_names[way], file->count,
                         rows, way == CSV_DEPTH ? "deeper" : "further", FIT_POINTS_MIN,
                         way == CSV_DEPTH ? "depth is positive down from the surface"
                                          : "it is positive from where the stress begins");
    }
    // NOLINTNEXTLINE(clang-analyzer-core.NullDereference): fewer are refused above
    if (file->points[0].depth == file->points[file->count - 1].depth) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: %s is %g in every row; a %s is needed", reader->text.path,
                         reader->text.number, column_names[way], file->points[0].depth,
                         way == CSV_DEPTH ? "press to some depth" : "slip over some way");
    }
    MildStatus status = push_check(reader->text.path, reader->text.number, file->kind, file->points,
                                   file->count, error);
    if (status == MILD_OK && file->kind == FIT_FILE_PRESS) {
        fit_speeds(file->points, file->count);
    }
    return status;
}

/* The way up of a press, before its rows make room for the way down. */
static MildStatus csv_unloading(const FitReader *reader, FitFile *file, MildError *error) {
    if (file->kind != FIT_FILE_PRESS || file->slide_count || !file->count) {
        return MILD_OK;
    }
    file->back = malloc(sizeof *file->back * (size_t)file->count);
    if (!file->back) {
        return mild_fail(error, MILD_ERROR_MEMORY, "%.200s: out of memory", reader->text.path);
    }
    file->back_count = fit_unloading(file->points, file->count, file->back);
    for (int i = 0; i < file->back_count; i++) {
        file->back[i].speed = file->back[i].acceleration = 0;
    }
    return MILD_OK;
}

static MildStatus read_file(FILE *stream, const char *name, FitFile *file, MildError *error) {
    FitReader reader = {.time = -INFINITY};
    *file = (FitFile){.path = name};
    MildStatus status = csv_begin(&reader.text, stream, name, error);
    if (status == MILD_OK) {
        status = csv_header(&reader, error);
    }
    if (status == MILD_OK) {
        file->kind = reader.kind;
        status = csv_rows(&reader, file, error);
    }
    if (status == MILD_OK) {
        status = csv_slide(&reader, file, error);
    }
    if (status == MILD_OK) {
        status = csv_unloading(&reader, file, error);
    }
    if (status == MILD_OK) {
        status = csv_loading(&reader, file, error);
    }
    csv_end(&reader.text);
    return status;
}

MildStatus fit_csv_read(const char *path, FitFile *file, MildError *error) {
    MildError cause = {0};
    *file = (FitFile){.points = NULL};
    FILE *stream = file_open(path, &cause);
    if (!stream) {
        return mild_fail(error, cause.status, "%.300s%s", cause.text,
                         cause.status == MILD_ERROR_IO ? "; `mild press --csv FILE` writes a record"
                                                       : "");
    }
    MildStatus status = read_file(stream, path, file, error);
    fclose(stream);
    return status;
}

void fit_file_close(FitFile *file) {
    free(file->points);
    free(file->back);
    free(file->slide);
    *file = (FitFile){.points = NULL};
}

/* A stress s gives the torque s 2 pi int r^2 dr, a pressure p the load p pi (R^2 - r^2). */
void fit_file_ring(FitFile *file, double outer, double inner) {
    const double pi = 3.141592653589793;
    const double moment = 2.0 / 3.0 * pi * (pow(outer, 3) - pow(inner, 3));
    const double area = pi * (outer * outer - inner * inner);
    for (int i = 0; i < file->count; i++) {
        file->points[i].force /= moment;
        file->points[i].load /= area;
    }
}
