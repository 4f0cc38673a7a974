#include "drive/packet.h"

#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/file.h"

#define REMEDY "make one with: (umask 077; head -c 32 /dev/urandom >%.200s)"

MildStatus key_read(const char *path, Key *key, MildError *error) {
    struct stat about;
    char *bytes = file_read(path, 1 << 16, &key->size, error);
    if (!bytes) {
        return error->status;
    }
    MildStatus status = MILD_OK;
    if (key->size < KEY_SIZE_MIN || key->size > KEY_SIZE_MAX) {
        status = mild_fail(error, MILD_ERROR_ARGUMENT,
                           "--key: %.200s has %zu bytes, a key has %d to %d; " REMEDY, path,
                           key->size, KEY_SIZE_MIN, KEY_SIZE_MAX, path);
    } else if (stat(path, &about) != 0 || (about.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
        status =
            mild_fail(error, MILD_ERROR_ARGUMENT,
                      "--key: others than its owner may open %.200s; chmod 600 %.200s", path, path);
    } else {
        memcpy(key->bytes, bytes, key->size);
    }
    sodium_memzero(bytes, key->size);
    free(bytes);
    return status;
}

void key_seal(const Key *key, const uint8_t *bytes, size_t size, uint8_t out[SEAL_SIZE]) {
    crypto_generichash(out, SEAL_SIZE, bytes, size, key->bytes, key->size);
}

int key_fits(const Key *key, const uint8_t *bytes, size_t size, const uint8_t given[SEAL_SIZE]) {
    uint8_t right[SEAL_SIZE];
    key_seal(key, bytes, size, right);
    return sodium_memcmp(right, given, SEAL_SIZE) == 0;
}

MildStatus key_draw_session(uint64_t *session, MildError *error) {
    if (sodium_init() < 0) {
        return mild_fail(error, MILD_ERROR_IO, "no random numbers from the system");
    }
    do {
        randombytes_buf(session, sizeof *session);
    } while (*session == 0);
    return MILD_OK;
}
