#include "run/train/log.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "base/file.h"

struct Log {
    FILE *csv, *events;
    const char *const *columns;
    int count;
    char csv_path[PATH_SIZE], events_path[PATH_SIZE];
};

static double wall_time(void) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static MildStatus io_fail(const char *path, MildError *error) {
    return mild_fail(error, MILD_ERROR_IO, "%s: cannot write the log: %s", path, strerror(errno));
}

MildStatus log_check(const char *path, MildError *error) {
    struct stat info;
    MildStatus status = file_check_own(path, error);
    if (status == MILD_OK && lstat(path, &info) == 0 && info.st_nlink > 1) {
        return mild_fail(error, MILD_ERROR_IO,
                         "%.200s: has a second name (a hard link), whose file would change, too; "
                         "put a copy in its place",
                         path);
    }
    return status;
}

static char *header_line(const char *const *columns, int count) {
    size_t size = sizeof "iteration\n";
    for (int i = 0; i < count; i++) {
        size += strlen(columns[i]) + 1;
    }
    char *line = malloc(size);
    if (!line) {
        return NULL;
    }
    char *end = stpcpy(line, "iteration");
    for (int i = 0; i < count; i++) {
        *end++ = ',';
        end = stpcpy(end, columns[i]);
    }
    strcpy(end, "\n");
    return line;
}

/* Cuts log.csv after the last complete row of an iteration up to `last`. The first line must be
 * `header`. */
static MildStatus csv_cut(FILE *csv, const char *path, const char *header, int64_t last,
                          MildError *error) {
    char *line = NULL;
    size_t capacity = 0;
    ssize_t length = getline(&line, &capacity, csv);
    int same = length > 0 && strcmp(line, header) == 0;
    long keep = ftell(csv);
    while (same && (length = getline(&line, &capacity, csv)) > 0) {
        if (line[length - 1] != '\n' || strtoll(line, NULL, 10) > last) {
            break;
        }
        keep = ftell(csv);
    }
    int failed = length < 0 && !feof(csv);
    free(line);
    if (failed) {
        return mild_fail(error, ferror(csv) ? MILD_ERROR_IO : MILD_ERROR_MEMORY,
                         "%s: cannot read the log: %s", path,
                         ferror(csv) ? "the disk fails" : "out of memory");
    }
    if (!same) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: its columns are not this version's; resume into a copy without it",
                         path);
    }
    if (fseek(csv, keep, SEEK_SET) != 0 || ftruncate(fileno(csv), keep) != 0) {
        return io_fail(path, error);
    }
    return MILD_OK;
}

static MildStatus csv_open(Log *log, int64_t resume_after, MildError *error) {
    char *header = header_line(log->columns, log->count);
    if (!header) {
        return mild_fail(error, MILD_ERROR_MEMORY, "log: out of memory");
    }
    MildStatus status = log_check(log->csv_path, error);
    if (status != MILD_OK) {
        free(header);
        return status;
    }
    log->csv = resume_after >= 0 ? fopen(log->csv_path, "r+") : NULL;
    if (log->csv) {
        status = csv_cut(log->csv, log->csv_path, header, resume_after, error);
    } else {
        log->csv = fopen(log->csv_path, "wx");
        if (!log->csv || fputs(header, log->csv) < 0 || fflush(log->csv) != 0) {
            status = io_fail(log->csv_path, error);
        }
    }
    free(header);
    return status;
}

static MildStatus events_open(Log *log, const char *folder, int64_t resume_after,
                              MildError *error) {
    char name[128], host[64] = "host";
    double now = wall_time();
    gethostname(host, sizeof host - 1);
    snprintf(name, sizeof name, "events.out.tfevents.%.6f.%s.%ld", now, host, (long)getpid());
    MildStatus status = path_join(folder, name, log->events_path, error);
    if (status != MILD_OK) {
        return status;
    }
    log->events = fopen(log->events_path, "wbx");
    if (!log->events || events_write_version(log->events, now) != 0 ||
        (resume_after >= 0 && events_write_start(log->events, now, resume_after + 1) != 0)) {
        return io_fail(log->events_path, error);
    }
    return MILD_OK;
}

Log *log_open(const char *folder, const char *const *columns, int count, int64_t resume_after,
              MildError *error) {
    Log *log = calloc(1, sizeof *log);
    if (!log) {
        mild_fail(error, MILD_ERROR_MEMORY, "log: out of memory");
        return NULL;
    }
    log->columns = columns;
    log->count = count;
    if (path_join(folder, "log.csv", log->csv_path, error) != MILD_OK ||
        csv_open(log, resume_after, error) != MILD_OK ||
        events_open(log, folder, resume_after, error) != MILD_OK) {
        log_close(log);
        return NULL;
    }
    return log;
}

/* Markdown of a text that is shown as it is: four blanks before each line. Returns NULL when memory
 * runs out. */
static char *indented(const char *text) {
    char *copy = NULL;
    size_t size;
    FILE *out = open_memstream(&copy, &size);
    for (; out && *text; text += strcspn(text, "\n"), text += *text == '\n') {
        fprintf(out, "    %.*s\n", (int)strcspn(text, "\n"), text);
    }
    if (!out || fclose(out) != 0) {
        free(copy);
        return NULL;
    }
    return copy;
}

MildStatus log_config(Log *log, const char *config, MildError *error) {
    Settings settings;
    MildStatus status = settings_read(config, "config.ini", &settings, error);
    if (status != MILD_OK) {
        return status;
    }
    char *text = indented(config);
    const double now = wall_time();
    if (!text) {
        status = mild_fail(error, MILD_ERROR_MEMORY, "log: out of memory");
    } else if (events_write_text(log->events, now, "config", text) != 0 ||
               events_write_settings(log->events, now, &settings) != 0 ||
               fflush(log->events) != 0) {
        status = io_fail(log->events_path, error);
    }
    free(text);
    settings_free(&settings);
    return status;
}

MildStatus log_row(Log *log, int64_t iteration, const double *values, MildError *error) {
    int failed = fprintf(log->csv, "%lld", (long long)iteration) < 0;
    for (int i = 0; i < log->count && !failed; i++) {
        failed = (isnan(values[i]) ? fputs(",nan", log->csv) /* whatever its sign */
                                   : fprintf(log->csv, ",%.9g", values[i])) < 0;
    }
    if (failed || fputc('\n', log->csv) == EOF || fflush(log->csv) != 0) {
        return io_fail(log->csv_path, error);
    }
    if (events_write_scalars(log->events, wall_time(), iteration, log->columns, values,
                             log->count) != 0 ||
        fflush(log->events) != 0) {
        return io_fail(log->events_path, error);
    }
    return MILD_OK;
}

void log_close(Log *log) {
    if (!log) {
        return;
    }
    if (log->csv) {
        fclose(log->csv);
    }
    if (log->events) {
        fclose(log->events);
    }
    free(log);
}
