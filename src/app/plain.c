#define _GNU_SOURCE /* fopencookie */
#include "app/plain.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/text.h"

typedef struct {
    int file;
    const char *keep;
    char torn[4]; /* begin of a character whose rest has not been printed yet */
    size_t count; /* of its bytes */
} Plain;

static int write_all(int file, const char *bytes, size_t size) {
    while (size > 0) {
        const ssize_t written = write(file, bytes, size);
        if (written < 0 && errno != EINTR) {
            return 0;
        }
        bytes += written > 0 ? written : 0;
        size -= written > 0 ? (size_t)written : 0;
    }
    return 1;
}

static ssize_t write_plain(void *cookie, const char *bytes, size_t size) {
    Plain *plain = cookie;
    for (size_t done = 0; done < size;) {
        char block[4096];
        const size_t before = plain->count;
        const size_t room = sizeof block - before;
        const size_t taken = size - done < room ? size - done : room;
        memcpy(block, plain->torn, before);
        memcpy(block + before, bytes + done, taken);
        plain->count = text_plain(block, before + taken, plain->keep);
        const size_t whole = before + taken - plain->count;
        memcpy(plain->torn, block + whole, plain->count);
        if (!write_all(plain->file, block, whole)) {
            return 0;
        }
        done += taken;
    }
    return (ssize_t)size;
}

/* The stream itself when memory runs out. */
static FILE *guard(FILE *stream, Plain *plain, int buffered) {
    const cookie_io_functions_t calls = {.write = write_plain};
    FILE *guarded = fopencookie(plain, "w", calls);
    if (!guarded) {
        return stream;
    }
    setvbuf(guarded, NULL, buffered, BUFSIZ);
    return guarded;
}

void plain_streams(void) {
    /* the progress line returns to its begin; so do lines of files from other systems */
    static Plain out = {.file = STDOUT_FILENO, .keep = "\n\t"},
                 err = {.file = STDERR_FILENO, .keep = "\n\t\r"};
    const int terminal = isatty(STDOUT_FILENO);
    out.keep = terminal ? "\n\t" : "\n\t\r";
    stdout = guard(stdout, &out, terminal ? _IOLBF : _IOFBF);
    stderr = guard(stderr, &err, _IONBF);
}
