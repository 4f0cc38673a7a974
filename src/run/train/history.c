#include "run/train/history.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"

enum { LOG_MAX = 1 << 30 }; /* bytes */
#define ITERATION_MAX 1e15

static int count_of(const char *text, char what) {
    int count = 0;
    for (; *text; text++) {
        count += *text == what;
    }
    return count;
}

/* Splits the header in place. Returns the text behind it, or NULL when memory runs out. */
static char *read_names(History *history) {
    char *end = strchr(history->text, '\n'), *name = history->text;
    *end = '\0';
    if (end[-1] == '\r') {
        end[-1] = '\0';
    }
    history->columns = count_of(history->text, ',') + 1;
    history->name = calloc((size_t)history->columns, sizeof *history->name);
    for (int i = 0; history->name && i < history->columns; i++) {
        history->name[i] = name;
        name += strcspn(name, ",");
        *name++ = '\0';
    }
    return history->name ? end + 1 : NULL;
}

/* Reads the numbers of one line, which ends at `end`. Returns how many there are; -1: a field is
 * no number. */
static int read_row(const char *text, const char *end, int columns, double *row) {
    for (int count = 0;; text++) {
        char *stop;
        double value = strtod(text, &stop);
        if (stop == text || stop > end || (*stop != ',' && *stop != '\r' && stop != end)) {
            return -1;
        }
        if (count < columns) {
            row[count] = value;
        }
        count++;
        text = stop;
        if (*stop != ',') {
            return count;
        }
    }
}

/* The rows up to the last line end. */
static MildStatus read_rows(History *history, const char *text, const char *path,
                            MildError *error) {
    const char *end;
    int line = 2;
    for (; (end = strchr(text, '\n')); text = end + 1, line++) {
        double *row = history->value + (size_t)history->rows * (size_t)history->columns;
        int count = read_row(text, end, history->columns, row);
        if (count < 0) {
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%s:%d: '%.*s' is not a row of numbers; remove the line", path, line,
                             end - text < 40 ? (int)(end - text) : 40, text);
        }
        if (count != history->columns) {
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%s:%d: %d numbers under %d columns; remove the line", path, line,
                             count, history->columns);
        }
        if (!(row[0] >= 0 && row[0] <= ITERATION_MAX)) {
            return mild_fail(error, MILD_ERROR_FORMAT, "%s:%d: %g is no iteration; remove the line",
                             path, line, row[0]);
        }
        if (history->rows && !(row[0] > row[-history->columns])) {
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%s:%d: iteration %g after %g; remove the lines of one of the two "
                             "runs that wrote here",
                             path, line, row[0], row[-history->columns]);
        }
        history->rows++;
    }
    if (!history->rows) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: no row yet; wait for the training's first iteration", path);
    }
    return MILD_OK;
}

static MildStatus read_text(History *history, const char *path, MildError *error) {
    static const char first[] = "iteration";
    size_t length = strcspn(history->text, ",\n");
    if (length != strlen(first) || strncmp(history->text, first, length) != 0 ||
        history->text[length] != ',' || !strchr(history->text, '\n')) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: its first line does not begin with 'iteration,'; name a run folder "
                         "of mild train",
                         path);
    }
    size_t lines = (size_t)count_of(history->text, '\n');
    char *rows = read_names(history);
    if (rows) {
        history->value = malloc(lines * (size_t)history->columns * sizeof *history->value);
    }
    return rows && history->value
               ? read_rows(history, rows, path, error)
               : mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory for the log", path);
}

/* text: from malloc, of `size` bytes and a '\0'; the history's from now on. */
static MildStatus parse(char *text, size_t size, const char *path, History *history,
                        MildError *error) {
    const size_t length = strlen(text);
    *history = (History){.text = text};
    MildStatus status =
        memchr(text + length, '\n', size - length)
            ? mild_fail(error, MILD_ERROR_FORMAT,
                        "%s: damaged, there is a zero byte in it; name a whole log.csv", path)
            : read_text(history, path, error);
    if (status != MILD_OK) {
        history_free(history);
    }
    return status;
}

MildStatus history_read(const char *path, History *history, MildError *error) {
    size_t size;
    char *text = file_read(path, LOG_MAX, &size, error);
    *history = (History){0};
    return text ? parse(text, size, path, history, error) : error->status;
}

void history_free(History *history) {
    free(history->name);
    free(history->value);
    free(history->text);
    *history = (History){0};
}

int history_column(const History *history, const char *name) {
    for (int i = 0; i < history->columns; i++) {
        if (strcmp(history->name[i], name) == 0) {
            return i;
        }
    }
    return -1;
}

void history_means(const History *history, int column, double first, double last, int points,
                   double *mean) {
    const double places = last > first ? (points - 1) / (last - first) : 0;
    int place = 0, count = 0;
    double sum = 0;
    for (int i = 0; i < points; i++) {
        mean[i] = NAN;
    }
    for (int i = 0; i < history->rows; i++) {
        const double *row = history->value + (size_t)i * (size_t)history->columns;
        const int here = (int)((row[0] - first) * places + 0.5);
        if (!isfinite(row[column]) || here < 0 || here >= points) {
            continue;
        }
        if (here != place) {
            sum = count = 0;
            place = here;
        }
        sum += row[column];
        mean[place] = sum / ++count;
    }
}
