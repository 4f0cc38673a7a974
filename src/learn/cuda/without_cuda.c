/* Replaces the layer in a build without CUDA. */
#include "learn/cuda/learner.h"

#include <stdio.h>

#include "device/gpu.h"

static const char reason[] = GPU_MISSING;

MildStatus gpu_learner_attach(Ppo *ppo, const GpuLearnerDef *def, MildError *error) {
    (void)ppo;
    (void)def;
    return mild_fail(error, MILD_ERROR_ARGUMENT, "%s", reason);
}

MildStream gpu_learner_stream(const Ppo *ppo) {
    (void)ppo;
    return NULL;
}

size_t gpu_learner_bytes(const Ppo *ppo) {
    (void)ppo;
    return 0;
}

size_t gpu_learner_sum_bytes(const Ppo *ppo) {
    (void)ppo;
    return 0;
}

MildStatus gpu_learner_write(Ppo *ppo, const void *block, MildError *error) {
    (void)ppo;
    (void)block;
    return mild_fail(error, MILD_ERROR_ARGUMENT, "%s", reason);
}

MildStatus gpu_learner_read(Ppo *ppo, void *block, MildError *error) {
    (void)ppo;
    (void)block;
    return mild_fail(error, MILD_ERROR_ARGUMENT, "%s", reason);
}

int gpu_device(char *text, size_t size) {
    snprintf(text, size, "%s", reason);
    return 0;
}
