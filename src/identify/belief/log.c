#include "identify/belief/log.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/csv.h"
#include "base/file.h"
#include "base/text.h"

enum { ROWS_MAX = 1000000 };
#define PERIOD 0.01     /* [s] of the policy */
#define FRAME_LIMIT 1e3 /* no reading is larger */

typedef struct {
    Csv text;
    int frame[BELIEF_FRAME]; /* places of the columns */
    int time, trial;         /* -1: no such column */
    int wanted;              /* trial */
    double before;           /* [s] time of the row before */
} LogReader;

static int find_column(char *const *cells, int count, const char *name) {
    for (int i = 0; i < count; i++) {
        if (strcmp(cells[i], name) == 0) {
            return i;
        }
    }
    return -1;
}

static MildStatus read_header(LogReader *reader, MildError *error) {
    char *cells[CSV_CELLS_MAX], name[32];
    MildStatus status;
    char *line = csv_line(&reader->text, &status, error);
    const int count = line ? csv_split(line, cells) : 0;
    if (status != MILD_OK) {
        return status;
    }
    for (int i = 0; i < BELIEF_FRAME; i++) {
        snprintf(name, sizeof name, "observation%d", i);
        reader->frame[i] = find_column(cells, count, name);
        if (reader->frame[i] < 0) {
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%.200s: no column %s; a log has time_s and observation0 to "
                             "observation%d, as mild drive --log writes it",
                             reader->text.path, name, BELIEF_FRAME - 1);
        }
    }
    reader->time = find_column(cells, count, "time_s");
    reader->trial = find_column(cells, count, "trial");
    return reader->time >= 0
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_FORMAT, "%.200s: no column time_s", reader->text.path);
}

static MildStatus read_number(const LogReader *reader, char *const *cells, int count, int place,
                              double *value, MildError *error) {
    if (place < count && text_double(cells[place], value)) {
        return MILD_OK;
    }
    return mild_fail(error, MILD_ERROR_FORMAT,
                     "%.200s:%d: column %d is no finite number; correct it or cut the log before",
                     reader->text.path, reader->text.number, place + 1);
}

/* Bool in *taken: the row is of the trial. */
static MildStatus read_row(LogReader *reader, char *line, float *frame, int *taken,
                           MildError *error) {
    char *cells[CSV_CELLS_MAX];
    double time = 0.0, value = 0.0, trial = reader->wanted;
    const int count = csv_split(line, cells);
    MildStatus status = MILD_OK;
    if (reader->trial >= 0) {
        status = read_number(reader, cells, count, reader->trial, &trial, error);
    }
    *taken = status == MILD_OK && trial == reader->wanted;
    if (!*taken) {
        return status;
    }
    status = read_number(reader, cells, count, reader->time, &time, error);
    if (status == MILD_OK && fabs(time - reader->before - PERIOD) > 0.5 * PERIOD &&
        isfinite(reader->before)) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: time_s %g does not come %g s after %g; a log has a row for "
                         "each policy step, 100 a second",
                         reader->text.path, reader->text.number, time, PERIOD, reader->before);
    }
    for (int i = 0; i < BELIEF_FRAME && status == MILD_OK; i++) {
        status = read_number(reader, cells, count, reader->frame[i], &value, error);
        if (status == MILD_OK && fabs(value) > FRAME_LIMIT) {
            status = mild_fail(error, MILD_ERROR_RANGE,
                               "%.200s:%d: observation%d is %g; docs/policy.md, section 3, has "
                               "its unit",
                               reader->text.path, reader->text.number, i, value);
        }
        frame[i] = status == MILD_OK ? (float)value : 0;
    }
    reader->before = time;
    return status;
}

static MildStatus read_rows(LogReader *reader, BeliefLog *log, MildError *error) {
    MildStatus status;
    int room = 0, taken;
    for (char *line = csv_line(&reader->text, &status, error); line && status == MILD_OK;
         line = csv_line(&reader->text, &status, error)) {
        if (log->count == ROWS_MAX) {
            return mild_fail(error, MILD_ERROR_RANGE, "%.200s:%d: more than %d rows; cut the log",
                             reader->text.path, reader->text.number, ROWS_MAX);
        }
        if (log->count == room) {
            room = room < ROWS_MAX / 2 - 1024 ? 2 * room + 1024 : ROWS_MAX;
            void *more = realloc(log->frame, sizeof *log->frame * (size_t)room);
            if (!more) {
                return mild_fail(error, MILD_ERROR_MEMORY, "%.200s: no memory for %d rows",
                                 reader->text.path, room);
            }
            log->frame = more;
        }
        status = read_row(reader, line, log->frame[log->count], &taken, error);
        if (status != MILD_OK) {
            return status;
        }
        log->count += taken;
    }
    return status == MILD_OK && log->count == 0
               ? mild_fail(error, MILD_ERROR_FORMAT, "%.200s: no row of trial %d",
                           reader->text.path, reader->wanted)
               : status;
}

MildStatus belief_log_read(const char *path, int trial, BeliefLog *log, MildError *error) {
    LogReader reader = {.wanted = trial, .before = INFINITY};
    *log = (BeliefLog){.count = 0};
    FILE *file = file_open(path, error);
    if (!file) {
        return error->status;
    }
    MildStatus status = csv_begin(&reader.text, file, path, error);
    status = status == MILD_OK ? read_header(&reader, error) : status;
    status = status == MILD_OK ? read_rows(&reader, log, error) : status;
    csv_end(&reader.text);
    fclose(file);
    if (status != MILD_OK) {
        free(log->frame);
        *log = (BeliefLog){.count = 0};
    }
    return status;
}

int belief_log_is(const char *path) {
    MildError unused;
    Csv text;
    MildStatus status;
    FILE *file = file_open(path, &unused);
    if (!file) {
        return 0;
    }
    int is = 0;
    if (csv_begin(&text, file, path, &unused) == MILD_OK) {
        const char *line = csv_line(&text, &status, &unused);
        is = line && strstr(line, "observation0") != NULL;
    }
    csv_end(&text);
    fclose(file);
    return is;
}

void belief_log_print_header(FILE *csv) {
    fprintf(csv, "time_s");
    for (int i = 0; i < BELIEF_FRAME; i++) {
        fprintf(csv, ",observation%d", i);
    }
    fprintf(csv, "\n");
}

void belief_log_print(FILE *csv, double time, const float *frame) {
    fprintf(csv, "%.2f", time);
    for (int i = 0; i < BELIEF_FRAME; i++) {
        fprintf(csv, ",%.9g", (double)frame[i]);
    }
    fprintf(csv, "\n");
}
