/* Replaces the layer in a build without CUDA. */
#include "gpu/learner.h"

#include <stdio.h>

static const char reason[] = "built without CUDA; configure with -DMILD_CUDA=ON";

MildStatus gpu_learner_attach(Ppo *ppo, MildError *error) {
    (void)ppo;
    return mild_fail(error, MILD_ERROR_ARGUMENT, "%s", reason);
}

int gpu_device(char *text, size_t size) {
    snprintf(text, size, "%s", reason);
    return 0;
}
