/* Files of tests: written and read whole, or the test fails. */
#ifndef TEST_FILES_H
#define TEST_FILES_H

#include <unistd.h>

#include "kit.h"

static inline void kit_write(const char *path, const void *bytes, size_t size) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static inline void kit_write_text(const char *path, const char *text) {
    kit_write(path, text, strlen(text));
}

/* The bytes and a zero behind them, to be freed. size: NULL, or how many. */
static inline char *kit_read(const char *path, size_t *size) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    const size_t length = (size_t)ftell(file);
    rewind(file);
    char *bytes = calloc(1, length + 1);
    assert_non_null(bytes);
    assert_int_equal(fread(bytes, 1, length, file), length);
    fclose(file);
    if (size) {
        *size = length;
    }
    return bytes;
}

/* A copy of the text with every `from` as `to`, to be freed. (Inlined, gcc 12 takes what
 * open_memstream writes for a pointer to `copy`.) */
__attribute__((noinline, unused)) static char *kit_replaced(const char *text, const char *from,
                                                            const char *to) {
    char *copy = NULL;
    size_t size = 0;
    FILE *file = open_memstream(&copy, &size);
    const char *at = strstr(text, from);
    assert_true(file && at);
    for (; at; text = at + strlen(from), at = strstr(text, from)) {
        fprintf(file, "%.*s%s", (int)(at - text), text, to);
    }
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
    return copy;
}

#endif
