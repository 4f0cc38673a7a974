/* A compute backend is the learner on a device other than the CPU: networks, optimiser and
 * counters. It computes the same functions as ppo.c, from the same random numbers and equal up to
 * rounding, so a resumed run may change its device. The rollout is in the arrays of the batch,
 * which may be on the device too (ppo_is_resident). */
#ifndef MILD_BACKEND_H
#define MILD_BACKEND_H

#include "learn/ppo_batch.h"
#include "mild/error.h"

/* `self` is the first argument of every function. A function that fails gives the reason. */
typedef struct PpoBackend {
    void *self;
    /* As ppo_act. With a resident rollout it only enqueues work, and errors show in update. */
    MildStatus (*act)(void *self, int t, MildError *error);
    /* As ppo_update, without the rows that the next rollout begins with if they are on the CPU.
     * Sets the learner's counters and learning rate. */
    MildStatus (*update)(void *self, PpoReport *report, MildError *error);
    /* Parameters, moments, running mean of the weights and ppo->start from the device to the
     * learner, and back, with the counters, seed and learning rate. */
    MildStatus (*pull)(void *self, MildError *error);
    MildStatus (*push)(void *self, MildError *error);
    void (*destroy)(void *self);
} PpoBackend;

#endif
