/* The learner on one CUDA device: networks, sampling of the actions, advantages, order of the
 * samples, Adam. Every sum has a fixed order, so the same seed on the same machine gives the same
 * numbers. An update equals that of the CPU up to rounding (tests/gpu). */
#ifndef MILD_GPU_LEARNER_H
#define MILD_GPU_LEARNER_H

#include <stddef.h>

#include "learn/ppo.h"

typedef struct {
    int device;   /* number of the CUDA device */
    int resident; /* bool: the rollout is on the device (ppo_is_resident), else on the CPU, from
                     where it is copied */
    int rows;     /* most rows that pass through the networks at once; 0: as many as fill a large
                     device */
} GpuLearnerDef;

/* From now on `ppo` computes on the device, until ppo_destroy. Fails without a device, and in a
 * build without CUDA; then only ppo_destroy may follow. Without memory it says how much is needed
 * and how many robots would fit. */
MildStatus gpu_learner_attach(Ppo *ppo, const GpuLearnerDef *def, MildError *error);
/* The cudaStream_t on which act and update are enqueued; NULL without a device. With a resident
 * rollout ppo_act only launches kernels, whose arguments depend on t alone. So it may be captured
 * in a CUDA graph on this stream, which stays right as the iterations go on. */
MildStream gpu_learner_stream(const Ppo *ppo);
size_t gpu_learner_bytes(const Ppo *ppo); /* memory held on the device; 0 without one */
/* Copies the device's whole rollout from a block on the CPU, or to it, whose arrays are those of
 * ppo_batch_like. For tests and benches, which need a device. */
MildStatus gpu_learner_write(Ppo *ppo, const void *block, MildError *error);
MildStatus gpu_learner_read(Ppo *ppo, void *block, MildError *error);

/* [bytes] Largest sum over several processes (ranks/ranks.h), of a learner on a GPU. */
size_t gpu_learner_sum_bytes(const Ppo *ppo);

/* Writes the name of the first device as one line, or the reason why there is none. Returns whether
 * there is a device. */
int gpu_device(char *text, size_t size);

#endif
