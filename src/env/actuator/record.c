#include "env/actuator/record.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/csv.h"
#include "base/file.h"
#include "base/text.h"

enum { QUANTITIES = 3, PLACES = 1 + QUANTITIES * ROBOT_JOINTS_MAX };

static const char *const suffix[QUANTITIES] = {"error_rad", "speed_rad_s", "torque_nm"};
/* Largest size of a number; beyond it the unit is probably wrong. */
static const double limit[QUANTITIES] = {20, 200, 5000};

/* A file being read. Number 0 of a row is the time, then come QUANTITIES of each joint. */
typedef struct {
    Csv text;
    Record *record;
    RecordFile *file;
    int columns;       /* in the header */
    int place[PLACES]; /* of a number in the line, -1: absent */
    int room;          /* rows that there is memory for */
} RecordReader;

static int places(const RecordReader *reader) {
    return 1 + QUANTITIES * reader->record->joints;
}

/* Name of a number's column, for the header and for messages. */
static const char *column_name(const Robot *robot, int number, char *name, size_t size) {
    snprintf(name, size, number ? "%.80s.%s" : "time_s",
             number ? robot_joint_name(robot, (number - 1) / QUANTITIES) : "",
             suffix[number ? (number - 1) % QUANTITIES : 0]);
    return name;
}

/* ---- header ---- */

static MildStatus find_column(RecordReader *reader, int number, char **cells, MildError *error) {
    char name[128];
    column_name(reader->record->robot, number, name, sizeof name);
    reader->place[number] = -1;
    for (int c = 0; c < reader->columns; c++) {
        if (strcmp(cells[c], name) != 0) {
            continue;
        }
        if (reader->place[number] >= 0) {
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%.200s:%d: two columns are named %s; keep one", reader->text.path,
                             reader->text.number, name);
        }
        reader->place[number] = c;
    }
    return MILD_OK;
}

/* A joint is logged whole or not at all, and one at least is. */
static MildStatus check_joints(const RecordReader *reader, MildError *error) {
    int logged = 0;
    char name[128];
    for (int i = 0; i < reader->record->joints; i++) {
        const int *place = reader->place + 1 + QUANTITIES * i;
        int there = 0, absent = 0;
        for (int n = 0; n < QUANTITIES; n++) {
            there += place[n] >= 0;
            absent = place[n] < 0 ? n : absent;
        }
        if (there > 0 && there < QUANTITIES) {
            return mild_fail(
                error, MILD_ERROR_FORMAT,
                "%.200s:%d: no column %s; a joint needs error_rad, speed_rad_s and torque_nm",
                reader->text.path, reader->text.number,
                column_name(reader->record->robot, 1 + QUANTITIES * i + absent, name, sizeof name));
        }
        reader->file->logged[i] = there == QUANTITIES;
        logged += reader->file->logged[i];
    }
    if (logged) {
        return MILD_OK;
    }
    return mild_fail(error, MILD_ERROR_FORMAT,
                     "%.200s:%d: no column names a joint of robot %s; name them %s, and so on",
                     reader->text.path, reader->text.number, robot_name(reader->record->robot),
                     column_name(reader->record->robot, 1, name, sizeof name));
}

static MildStatus read_header(RecordReader *reader, MildError *error) {
    char *cells[CSV_CELLS_MAX];
    MildStatus status;
    char *line = csv_line(&reader->text, &status, error);
    if (status != MILD_OK) {
        return status;
    }
    reader->columns = line ? csv_split(line, cells) : 0;
    if (reader->columns <= 0) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s: a header line of at most %d columns and rows are needed",
                         reader->text.path, CSV_CELLS_MAX);
    }
    for (int n = 0; status == MILD_OK && n < places(reader); n++) {
        status = find_column(reader, n, cells, error);
    }
    if (status == MILD_OK && reader->place[0] < 0) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: no column time_s; the history of a joint needs the time",
                         reader->text.path, reader->text.number);
    }
    return status == MILD_OK ? check_joints(reader, error) : status;
}

/* ---- rows ---- */

static MildStatus grow(RecordReader *reader, MildError *error) {
    Record *record = reader->record;
    if (record->rows == RECORD_ROWS_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE, "%.200s:%d: more than %d rows in all",
                         reader->text.path, reader->text.number, RECORD_ROWS_MAX);
    }
    if (record->rows < reader->room) {
        return MILD_OK;
    }
    const size_t room = 2 * (size_t)record->rows + 1024, joints = (size_t)record->joints;
    double *time = realloc(record->time, room * sizeof *time);
    record->time = time ? time : record->time;
    RecordJoint *joint = time ? realloc(record->joint, room * joints * sizeof *joint) : NULL;
    record->joint = joint ? joint : record->joint;
    reader->room = (int)room;
    return joint ? MILD_OK
                 : mild_fail(error, MILD_ERROR_MEMORY, "%.200s: out of memory", reader->text.path);
}

static MildStatus read_number(const RecordReader *reader, int number, char **cells, int count,
                              double *value, MildError *error) {
    char name[128];
    const int place = reader->place[number];
    const double most = number ? limit[(number - 1) % QUANTITIES] : 1e9;
    *value = 0;
    if (place < 0) {
        return MILD_OK;
    }
    column_name(reader->record->robot, number, name, sizeof name);
    if (place >= count || !text_double(cells[place], value)) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: %s '%.40s' is not a finite number; correct it or delete the "
                         "row",
                         reader->text.path, reader->text.number, name,
                         place < count ? cells[place] : "");
    }
    return fabs(*value) <= most
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_RANGE,
                           "%.200s:%d: %s %g is beyond %g; look at its unit", reader->text.path,
                           reader->text.number, name, *value, most);
}

static MildStatus read_row(RecordReader *reader, char *line, MildError *error) {
    Record *record = reader->record;
    char *cells[CSV_CELLS_MAX];
    const int count = csv_split(line, cells), row = record->rows;
    double value[PLACES] = {0};
    MildStatus status = count < 0
                            ? mild_fail(error, MILD_ERROR_FORMAT, "%.200s:%d: more than %d columns",
                                        reader->text.path, reader->text.number, CSV_CELLS_MAX)
                            : MILD_OK;
    for (int n = 0; status == MILD_OK && n < places(reader); n++) {
        status = read_number(reader, n, cells, count, &value[n], error);
    }
    if (status != MILD_OK) {
        return status;
    }
    if (row > reader->file->first && value[0] <= record->time[row - 1]) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: time_s %g does not come after %g of the row before; sort the "
                         "rows, or split the log",
                         reader->text.path, reader->text.number, value[0], record->time[row - 1]);
    }
    record->time[row] = value[0];
    for (int i = 0; i < record->joints; i++) {
        const double *own = value + 1 + QUANTITIES * i;
        record->joint[(size_t)row * (size_t)record->joints + (size_t)i] =
            (RecordJoint){(float)own[0], (float)own[1], (float)own[2]};
    }
    record->rows++;
    return MILD_OK;
}

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The median of the times between rows. */
static MildStatus find_interval(const RecordReader *reader, MildError *error) {
    RecordFile *file = reader->file;
    file->rows = reader->record->rows - file->first;
    if (file->rows < 2) {
        return mild_fail(error, MILD_ERROR_FORMAT, "%.200s: at least two rows are needed",
                         reader->text.path);
    }
    double *between = malloc((size_t)file->rows * sizeof *between);
    if (!between) {
        return mild_fail(error, MILD_ERROR_MEMORY, "%.200s: out of memory", reader->text.path);
    }
    const double *time = reader->record->time + file->first;
    for (int i = 0; i + 1 < file->rows; i++) {
        between[i] = time[i + 1] - time[i];
    }
    qsort(between, (size_t)file->rows - 1, sizeof *between, compare);
    file->interval = between[(file->rows - 1) / 2];
    free(between);
    return MILD_OK;
}

static MildStatus read_file(Record *record, FILE *file, const char *name, MildError *error) {
    if (record->files == RECORD_FILES_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE, "%.200s: more than %d files", name,
                         RECORD_FILES_MAX);
    }
    record->joints = robot_joints(record->robot);
    RecordReader reader = {
        .record = record, .file = &record->file[record->files], .room = record->rows};
    *reader.file = (RecordFile){.first = record->rows};
    MildStatus status = csv_begin(&reader.text, file, name, error);
    if (status == MILD_OK) {
        status = read_header(&reader, error);
    }
    while (status == MILD_OK) {
        char *line = csv_line(&reader.text, &status, error);
        if (!line) {
            break;
        }
        status = grow(&reader, error);
        status = status == MILD_OK ? read_row(&reader, line, error) : status;
    }
    if (status == MILD_OK) {
        status = find_interval(&reader, error);
    }
    record->files += status == MILD_OK;
    csv_end(&reader.text);
    return status;
}

MildStatus record_read(Record *record, const char *path, MildError *error) {
    FILE *file = file_open(path, error);
    if (!file) {
        return error->status;
    }
    MildStatus status = read_file(record, file, path, error);
    fclose(file);
    return status;
}

void record_free(Record *record) {
    free(record->time);
    free(record->joint);
    record->time = NULL;
    record->joint = NULL;
}

/* ---- writing ---- */

void record_print_header(const Robot *robot, FILE *csv) {
    char name[128];
    for (int n = 0; n < 1 + QUANTITIES * robot_joints(robot); n++) {
        fprintf(csv, "%s%s", n ? "," : "", column_name(robot, n, name, sizeof name));
    }
    fputc('\n', csv);
}

void record_print_row(int joints, double time, const double *error, const double *speed,
                      const double *torque, FILE *csv) {
    fprintf(csv, "%.9g", time);
    for (int i = 0; i < joints; i++) {
        fprintf(csv, ",%.6g,%.6g,%.6g", error[i], speed[i], torque[i]);
    }
    fputc('\n', csv);
}
