/* Bytes as a file for readers that take a path: a temporary file without a name. */
#ifndef TESTS_UNNAMED_FILE_H
#define TESTS_UNNAMED_FILE_H

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

/* The path of a file that holds these bytes, until the next call. Nobody needs to remove it. */
static inline const char *unnamed_file(const void *bytes, size_t size) {
    static char path[32];
    static int file = -1;
    if (file < 0) {
        char name[] = "/tmp/mild_unnamed_XXXXXX";
        file = mkstemp(name);
        unlink(name);
        snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    }
    if (file < 0 || ftruncate(file, 0) != 0 || pwrite(file, bytes, size, 0) != (ssize_t)size) {
        abort();
    }
    return path;
}

#endif
