/* libFuzzer target for the policy file reader: any bytes, with the checksum put right so that the fuzzer gets past it. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "learn/policy_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    unsigned char *bytes = malloc(size + 1); /* + 1: never a NULL for an empty file */
    if (!bytes) {
        return 0;
    }
    memcpy(bytes, data, size);
    safetensors_seal(bytes, size);
    MildError error = {0};
    Safetensors *file = safetensors_parse(bytes, size, "fuzz", &error);
    if (file) {
        policy_destroy(policy_file_policy(file, "fuzz", &error));
        safetensors_destroy(file);
    }
    return 0;
}
