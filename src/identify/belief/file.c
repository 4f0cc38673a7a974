#include "identify/belief/file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/csv.h"
#include "base/file.h"
#include "base/paths.h"
#include "base/text.h"
#include "learn/safetensors.h"

/* Tensor, its numbers, where they go. */
typedef struct {
    const char *name;
    float *to;
    size_t count;
} Part;

#define PART(member)                                                                               \
    { #member, (float *)(void *)&net->member, sizeof net->member / sizeof(float) }

static MildStatus take(const Safetensors *file, const Part *part, const char *path,
                       MildError *error) {
    const Safetensor *tensor = safetensors_find(file, part->name);
    if (!tensor || tensor->type != SAFETENSORS_F32 ||
        tensor->bytes != part->count * sizeof(float)) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: no weights of a belief: tensor '%s' of %zu numbers is missing; "
                         "lab/know/know.py makes the file",
                         path, part->name, part->count);
    }
    memcpy(part->to, tensor->data, tensor->bytes);
    for (size_t i = 0; i < part->count; i++) {
        if (!isfinite(part->to[i])) {
            return mild_fail(error, MILD_ERROR_FORMAT, "%s: a number of '%s' is not finite", path,
                             part->name);
        }
    }
    return MILD_OK;
}

/* A prior's values grow with their place. */
static MildStatus check_priors(const BeliefNet *net, const char *path, MildError *error) {
    for (int i = 0; i < BELIEF_PARAMETERS; i++) {
        for (int k = 1; k < BELIEF_KNOTS; k++) {
            if (!(net->prior[i][k] > net->prior[i][k - 1])) {
                return mild_fail(error, MILD_ERROR_FORMAT, "%s: the prior of %s does not grow",
                                 path, belief_names[i].name);
            }
        }
    }
    return MILD_OK;
}

static MildStatus fill(const Safetensors *file, const char *path, BeliefNet *net,
                       MildError *error) {
    const Part parts[] = {PART(embed),       PART(embed_bias),    PART(hidden),
                          PART(hidden_bias), PART(out),           PART(out_bias),
                          PART(prior),       PART(widen),         PART(odds),
                          PART(odds_bias),   PART(odds_second),   PART(odds_second_bias),
                          PART(odds_out),    PART(odds_out_bias), PART(alarm)};
    MildStatus status = MILD_OK;
    for (size_t i = 0; i < sizeof parts / sizeof *parts && status == MILD_OK; i++) {
        status = take(file, &parts[i], path, error);
    }
    return status == MILD_OK ? check_priors(net, path, error) : status;
}

BeliefNet *belief_read(const char *path, MildError *error) {
    Safetensors *file = safetensors_read(path, error);
    if (!file) {
        return NULL;
    }
    BeliefNet *net = calloc(1, sizeof *net);
    MildStatus status = net ? fill(file, path, net, error)
                            : mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", path);
    safetensors_destroy(file);
    if (status != MILD_OK) {
        free(net);
        return NULL;
    }
    return net;
}

int belief_has(const char *robot) {
    return strcmp(robot, "sa01") == 0;
}

MildStatus belief_open(const char *robot, BeliefNet **net, MildError *error) {
    char shipped[PATH_SIZE];
    *net = NULL;
    if (belief_has(robot)) {
        *net = belief_read(path_data(BELIEF_SHIPPED, shipped), error);
        return *net ? MILD_OK : error->status;
    }
    return MILD_OK;
}

enum { ROWS_MAX = 1000000 };
#define FRAME_LIMIT 1e3 /* no reading is larger */

typedef struct {
    Csv text;
    int frame[BELIEF_FRAME]; /* places of the columns */
    int time, trial;         /* -1: no such column */
    int wanted;              /* trial */
    double before;           /* [s] time of the row before */
} LogReader;

static MildStatus read_header(LogReader *reader, MildError *error) {
    char *cells[CSV_CELLS_MAX], name[32];
    const char *const *names = (const char *const *)cells;
    MildStatus status;
    char *line = csv_line(&reader->text, &status, error);
    const int count = line ? csv_split(line, cells) : 0;
    if (status != MILD_OK) {
        return status;
    }
    for (int i = 0; i < BELIEF_FRAME; i++) {
        snprintf(name, sizeof name, "observation%d", i);
        reader->frame[i] = text_find(name, names, count);
        if (reader->frame[i] < 0) {
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%.200s: no column %s; a log has time_s and observation0 to "
                             "observation%d, as mild drive --log writes it",
                             reader->text.path, name, BELIEF_FRAME - 1);
        }
    }
    reader->time = text_find("time_s", names, count);
    reader->trial = text_find("trial", names, count);
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
    if (status == MILD_OK && fabs(time - reader->before - BELIEF_PERIOD) > 0.5 * BELIEF_PERIOD &&
        isfinite(reader->before)) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.200s:%d: time_s %g does not come %g s after %g; a log has a row for "
                         "each policy step, 100 a second",
                         reader->text.path, reader->text.number, time, BELIEF_PERIOD,
                         reader->before);
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
