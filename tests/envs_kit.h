/* Environments that MuJoCo steps, for tests of what stands above them. */
#ifndef TEST_ENVS_KIT_H
#define TEST_ENVS_KIT_H

#include "env/envs.h"
#include "env/task/task.h"

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

static inline uint64_t kit_fnv(uint64_t hash, const void *data, size_t size) {
    for (size_t i = 0; i < size; i++) {
        hash = (hash ^ ((const uint8_t *)data)[i]) * 0x100000001b3u;
    }
    return hash;
}

/* FNV-1a of everything that moves: robots, histories, commands, reward sums, ground memory.
 * Member by member, because padding and entries beyond the robot's joints are no state. */
static inline uint64_t kit_hash(Envs *envs, int count) {
    uint64_t sum = 0xcbf29ce484222325u;
    for (int i = 0; i < count; i++) {
        TaskEnv *env = envs_env(envs, i);
        const size_t speeds = (6 + (size_t)env->shape.joints) * sizeof(double);
        sum = kit_fnv(sum, env->robot.qpos, speeds + sizeof(double));
        sum = kit_fnv(sum, env->robot.qvel, speeds);
        sum = kit_fnv(sum, task_env_rest(env)->qacc, speeds);
        sum = kit_fnv(sum, task_env_history(env), (size_t)env->shape.history * sizeof(float));
        sum = kit_fnv(sum, env->command, sizeof env->command);
        sum = kit_fnv(sum, &env->reward_sum, sizeof env->reward_sum);
        sum = kit_fnv(sum, task_env_ground(env), mild_ground_size(task_env_ground(env)));
    }
    return sum;
}

#endif
