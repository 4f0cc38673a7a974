/* Any bytes as a picture, with the checksums of its chunks put right so that the fuzzer gets past
 * them. Refused with a message, or grey values between 0 and 1. */
#include <stdio.h>
#include <zlib.h>

#include "env/task/image.h"
#include "fuzz.h"

enum { SIGNATURE = 8, FRAME = 12, PIXELS = 1 << 12, PIXELS_REFUSED = 1 << 27 };

static uint32_t number_at(const uint8_t *at) {
    return (uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3];
}

/* A chunk is length, type, data, CRC of type and data. */
static void seal(uint8_t *bytes, size_t size) {
    for (size_t at = SIGNATURE; at + FRAME <= size;) {
        size_t length = number_at(bytes + at);
        if (length > size - at - FRAME) {
            return;
        }
        uLong crc = crc32(0, bytes + at + 4, (uInt)length + 4);
        for (int i = 0; i < 4; i++) {
            bytes[at + 8 + length + (size_t)i] = (uint8_t)(crc >> (24 - 8 * i));
        }
        at += length + FRAME;
    }
}

/* A small file may state a large picture, which takes long to fill. */
static int takes_long(const uint8_t *bytes, size_t size) {
    if (size < 24) {
        return 0;
    }
    double pixels = (double)number_at(bytes + 16) * number_at(bytes + 20);
    return pixels > PIXELS && pixels < PIXELS_REFUSED;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const uint8_t signature[SIGNATURE] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    uint8_t *bytes = malloc(size + 1);
    fuzz_check(bytes != NULL);
    memcpy(bytes, data, size);
    if (size >= SIGNATURE && size % 16 != 0) {
        memcpy(bytes, signature, SIGNATURE);
    }
    seal(bytes, size);
    FILE *file = size && !takes_long(bytes, size) ? fmemopen(bytes, size, "r") : NULL;
    if (file) {
        Image image;
        MildError error = {0};
        if (image_read_file(file, "fuzz", &image, &error) == MILD_OK) {
            fuzz_check(image.columns > 0 && image.rows > 0);
            for (int i = 0; i < image.columns * image.rows; i++) {
                fuzz_check(image.grey[i] >= 0.0 && image.grey[i] <= 1.0);
            }
        } else {
            fuzz_check(error.status != MILD_OK && error.text[0] && !image.grey);
        }
        image_close(&image);
        fclose(file);
    }
    free(bytes);
    return 0;
}
