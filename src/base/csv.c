#include "base/csv.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

MildStatus csv_begin(Csv *csv, FILE *file, const char *path, MildError *error) {
    *csv = (Csv){.path = path, .file = file, .line = malloc(CSV_LINE_MAX + 1)};
    return csv->line ? MILD_OK : mild_fail(error, MILD_ERROR_MEMORY, "%.200s: out of memory", path);
}

void csv_end(Csv *csv) {
    free(csv->line);
    csv->line = NULL;
}

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

char *csv_line(Csv *csv, MildStatus *status, MildError *error) {
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

int csv_split(char *line, char *cells[CSV_CELLS_MAX]) {
    int count = 0;
    for (char *cell = line, *next; cell; cell = next) {
        next = strchr(cell, ',');
        if (next) {
            *next++ = '\0';
        }
        if (count == CSV_CELLS_MAX) {
            return -1;
        }
        cells[count++] = trim(cell);
    }
    return count;
}
