#include "base/text.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NAME_MAX_LENGTH = 63 };

static int smaller(int a, int b) {
    return a < b ? a : b;
}

/* Half edits from a to b, where words may be missing: text_nearest. */
static int half_edits(const char *a, const char *b) {
    uint8_t edits[NAME_MAX_LENGTH + 1][NAME_MAX_LENGTH + 1]; /* of the beginnings of both */
    const int length = (int)strnlen(a, NAME_MAX_LENGTH);
    int distance = INT_MAX;
    for (int j = 0;; j++) {
        const int more = j < NAME_MAX_LENGTH && b[j]; /* bool: b goes on */
        for (int i = 0; i <= length; i++) {
            int least = 2 * j;
            if (i > 0) {
                least = j == 0 && a[i - 1] == '_' ? i : edits[i - 1][j] + 2;
            }
            if (i > 0 && j > 0) {
                least = smaller(least, smaller(edits[i - 1][j - 1] + 2 * (a[i - 1] != b[j - 1]),
                                               edits[i][j - 1] + 2));
            }
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
                least = smaller(least, edits[i - 2][j - 2] + 2);
            }
            edits[i][j] = (uint8_t)least;
            const int all = i == length; /* bool: no last word of a is missing */
            if ((all || a[i] == '_') && (!more || b[j] == '_' || (all && least == 0))) {
                distance = smaller(distance, least + length - i + more);
            }
        }
        if (!more) {
            return distance;
        }
    }
}

int text_nearest_of(const char *name, const void *names, size_t stride, int count) {
    int best = -1, least = INT_MAX;
    for (int i = 0; i < count; i++) {
        const char *known = *(const char *const *)((const char *)names + (size_t)i * stride);
        const int distance = half_edits(name, known);
        if (distance < least) {
            least = distance;
            best = i;
        }
    }
    return best;
}

int text_find(const char *name, const char *const *names, int count) {
    for (int i = 0; i < count; i++) {
        if (strcmp(name, names[i]) == 0) {
            return i;
        }
    }
    return -1;
}

const char *text_nearest(const char *name, const char *const *names, int count) {
    const int i = text_nearest_of(name, names, sizeof *names, count);
    return i < 0 ? NULL : names[i];
}

size_t text_line(const char **rest, const char **line) {
    const char *text = *line = *rest;
    const size_t whole = strcspn(text, "\r\n");
    size_t length = 0;
    *rest = text + whole + (strncmp(text + whole, "\r\n", 2) == 0 ? 2 : text[whole] != '\0');
    while (length < whole && !((text[length] == ';' || text[length] == '#') &&
                               (length == 0 || strchr(" \t", text[length - 1])))) {
        length++;
    }
    while (length > 0 && strchr(" \t", text[length - 1])) {
        length--;
    }
    return length;
}

int text_double(const char *text, double *value) {
    char *end;
    errno = 0;
    double number = strtod(text, &end);
    if (end == text || *end || errno || !isfinite(number)) {
        return 0;
    }
    *value = number;
    return 1;
}

int text_int(const char *text, int *value) {
    char *end;
    errno = 0;
    long number = strtol(text, &end, 10);
    if (end == text || *end || errno || number < INT_MIN || number > INT_MAX) {
        return 0;
    }
    *value = (int)number;
    return 1;
}

int text_uint64(const char *text, uint64_t *value) {
    char *end;
    errno = 0;
    if (text[0] < '0' || text[0] > '9') {
        return 0; /* strtoull would accept a minus sign */
    }
    unsigned long long number = strtoull(text, &end, 10);
    if (*end || errno) {
        return 0;
    }
    *value = number;
    return 1;
}

/* Bytes of the character at `text`: 0: none begins here, -1: it ends behind `size`. */
static int character(const unsigned char *text, size_t size) {
    static const unsigned least[5] = {0, 0, 0x80, 0x800, 0x10000};
    const int length = text[0] < 0x80             ? 1
                       : (text[0] & 0xe0) == 0xc0 ? 2
                       : (text[0] & 0xf0) == 0xe0 ? 3
                       : (text[0] & 0xf8) == 0xf0 ? 4
                                                  : 0;
    unsigned code = length > 1 ? text[0] & (0xffU >> (length + 1)) : text[0];
    for (int i = 1; i < length; i++) {
        if ((size_t)i == size) {
            return -1;
        }
        if ((text[i] & 0xc0) != 0x80) {
            return 0;
        }
        code = code << 6 | (text[i] & 0x3fU);
    }
    const int control = code < 0x20 || (code >= 0x7f && code < 0xa0) || code == 0x2028 ||
                        code == 0x2029 || (code >= 0x202a && code <= 0x202e) ||
                        (code >= 0x2066 && code <= 0x2069); /* the last: order of writing */
    return control || (length > 0 && code < least[length]) || code > 0x10ffff ? 0 : length;
}

size_t text_plain(char *text, size_t size, const char *keep) {
    size_t i = 0;
    while (i < size) {
        const int length = character((const unsigned char *)text + i, size - i);
        if (length < 0) {
            return size - i;
        }
        if (length == 0 && (!text[i] || !strchr(keep, text[i]))) {
            text[i] = '?';
        }
        i += length > 0 ? (size_t)length : 1;
    }
    return 0;
}

const char *text_bytes(double bytes, char *text, size_t size) {
    static const char *const units[] = {"B", "KiB", "MiB", "GiB", "TiB"};
    int unit = 0;
    while (bytes >= 1024 && unit < 4) {
        bytes /= 1024;
        unit++;
    }
    snprintf(text, size, unit ? "%.2f %s" : "%.0f %s", bytes, units[unit]);
    return text;
}

const char *text_duration(double seconds, char *text, size_t size) {
    long whole = seconds > 0 && seconds < 1e9 ? (long)(seconds + 0.5) : 0;
    if (whole >= 3600) {
        snprintf(text, size, "%ld h %02ld min", whole / 3600, whole / 60 % 60);
    } else if (whole >= 60) {
        snprintf(text, size, "%ld min %02ld s", whole / 60, whole % 60);
    } else {
        snprintf(text, size, "%ld s", whole);
    }
    return text;
}

const char *text_cell(const char *format, double value, char text[TEXT_CELL]) {
    snprintf(text, TEXT_CELL, isfinite(value) ? format : "-", value);
    return text;
}
