/* The learner's networks on one CUDA device, with 32-bit floats (no TF32) and a fixed order of
 * every sum. The same seed on the same machine gives the same numbers. The gradient equals that
 * of the processor up to rounding (tests/gpu). */
#ifndef MILD_GPU_LEARNER_H
#define MILD_GPU_LEARNER_H

#include <stddef.h>

#include "learn/ppo.h"

/* From now on `ppo` computes on the first CUDA device, until ppo_destroy. Fails without a
 * device, and in a build without CUDA. */
MildStatus gpu_learner_attach(Ppo *ppo, MildError *error);

/* Writes the name of the device as one line, or the reason why there is none. Returns whether there
 * is a device. */
int gpu_device(char *text, size_t size);

#endif
