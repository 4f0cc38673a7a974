/* The key that a robot and its runner may share (--key), and the numbers that name their sessions.
 * A seal is BLAKE2b of 16 bytes under the key. */
#ifndef DRIVE_KEY_H
#define DRIVE_KEY_H

#include <stddef.h>
#include <stdint.h>

#include "mild/error.h"

enum { KEY_SIZE_MIN = 32, KEY_SIZE_MAX = 64, SEAL_SIZE = 16 };

typedef struct {
    size_t size;
    uint8_t bytes[KEY_SIZE_MAX];
} Key;

/* The bytes of a file of KEY_SIZE_MIN to KEY_SIZE_MAX bytes that only its owner can read. */
MildStatus key_read(const char *path, Key *key, MildError *error);
void key_seal(const Key *key, const uint8_t *bytes, size_t size, uint8_t out[SEAL_SIZE]);
/* Bool: this is the seal of the bytes. Takes the same time wherever they differ. */
int key_fits(const Key *key, const uint8_t *bytes, size_t size, const uint8_t given[SEAL_SIZE]);

/* A random number that nobody can guess, not 0. */
MildStatus key_draw_session(uint64_t *session, MildError *error);

#endif
