/* Any bytes as a policy file, with the checksum put right so that the fuzzer gets past it.
 * Refused with a message, or finite weights. */
#include "fuzz.h"
#include "learn/policy_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    unsigned char *bytes = malloc(size + 1); /* + 1: never a NULL for an empty file */
    fuzz_check(bytes != NULL);
    memcpy(bytes, data, size);
    safetensors_seal(bytes, size);
    MildError error = {0};
    Safetensors *file = safetensors_parse(bytes, size, "fuzz", &error);
    Policy *policy = file ? policy_file_policy(file, "fuzz", &error) : NULL;
    fuzz_check(policy || (error.status != MILD_OK && error.text[0]));
    policy_destroy(policy);
    safetensors_destroy(file);
    return 0;
}
