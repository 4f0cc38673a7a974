/* Environments that MuJoCo steps, for tests of what stands above them. */
#ifndef TEST_ENVS_KIT_H
#define TEST_ENVS_KIT_H

#include "env/envs.h"

static inline Envs *kit_mujoco(const TaskDef *task, const Robot *robot, Pool *pool, int count,
                               uint64_t seed, MildError *error) {
    const EnvsDef def = {.task = task, .robot = robot, .pool = pool, .count = count, .seed = seed};
    return envs_create(&def, error);
}

/* flags: [3][count] done, timeout, valid. */
static inline EnvsStep kit_step(const float *action, float *reward, uint8_t *flags, int count,
                                EnvsView next) {
    return (EnvsStep){.action = action,
                      .reward = reward,
                      .done = flags,
                      .timeout = flags + count,
                      .valid = flags + 2 * count,
                      .next = next};
}

/* Means since the last call. */
static inline EnvsStats kit_stats(Envs *envs, int count) {
    EnvsStats sums = {0};
    envs_sums(envs, &sums, NULL, NULL);
    return envs_means(sums, count);
}

#endif
