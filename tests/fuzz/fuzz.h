/* What the fuzz targets share. A target is a libFuzzer function; with clang and -DMILD_FUZZ=ON it
 * is built as fuzz_NAME, otherwise with replay.c, a test that runs every file of NAME/ in
 * corpus.tar.xz through it. */
#ifndef MILD_FUZZ_H
#define MILD_FUZZ_H

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static inline void fuzz_check(int right) {
    if (!right) {
        abort();
    }
}

/* One input in `share`, chosen by its bytes: for what takes too long to do with each. FNV-1a. */
static inline int fuzz_sample(const uint8_t *data, size_t size, uint32_t share) {
    uint32_t hash = 2166136261u;
    for (size_t i = 0; i < size; i++) {
        hash = (hash ^ data[i]) * 16777619u;
    }
    return hash % share == 0;
}

/* The input as a row of numbers; zeros once it is used up. */
typedef struct {
    const uint8_t *at, *end;
} Bytes;

static inline unsigned take_byte(Bytes *bytes) {
    return bytes->at < bytes->end ? *bytes->at++ : 0u;
}

static inline int take_below(Bytes *bytes, int count) {
    return (int)(take_byte(bytes) % (unsigned)count);
}

/* Mostly a number within +-usual, some on a grid so that equal ones are common; one in four is
 * hostile or has any bits. */
static inline double take_number(Bytes *bytes, double usual) {
    static const double hostile[] = {NAN,    INFINITY, -INFINITY, 0.0,   -0.0,  1e308,
                                     -1e308, 1e-320,   -1e-320,   1e30,  -1e30, 1e9,
                                     -1e9,   0x1p31,   -0x1p31,   0x1p63};
    unsigned kind = take_byte(bytes);
    if (kind < 128) {
        return usual * ((int)kind - 64) / 64.0;
    }
    if (kind < 192) {
        return usual * ((int)kind - 160 + take_byte(bytes) / 256.0) / 32.0;
    }
    if (kind < 224) {
        return hostile[kind % 16];
    }
    uint64_t bits = 0;
    double number;
    for (int i = 0; i < 8; i++) {
        bits = bits << 8 | take_byte(bytes);
    }
    memcpy(&number, &bits, sizeof number);
    return number;
}

#endif
