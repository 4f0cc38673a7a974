/* The learner's networks on a CUDA device: one GPU, 32-bit floats throughout (no TF32), fixed order
 * of every sum. Same seed and same machine: same numbers; against the processor the gradient agrees
 * to rounding (tests/gpu). */
#ifndef MILD_GPU_LEARNER_H
#define MILD_GPU_LEARNER_H

#include <stddef.h>

#include "learn/ppo.h"

/* From now on `ppo` computes on the first CUDA device; ppo_destroy lets go of it. Fails without a
 * device, and in a build without CUDA. */
MildStatus gpu_learner_attach(Ppo *ppo, MildError *error);

/* The device's name, or why there is none, in one line. Returns bool: there is one. */
int gpu_device(char *text, size_t size);

#endif
