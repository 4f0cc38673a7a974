#define MILD_REAL_FLOAT
#include "env/batch_env.h"

#include <string.h>

#include "env/kernels.h"
#include "episode.h"

Episode episode_of(const Envs *envs, int i) {
    const EnvsArrays *all = envs_batch_arrays(envs);
    const TaskEnv *from = env_at(all, i);
    const Real *map = all->map_origin + 2 * i;
    Episode episode = {.index = from->index,
                       .step = from->step,
                       .rigid = from->variation.rigid,
                       .shells_stand = from->variation.shells_stand,
                       .friction = from->variation.rigid_friction,
                       .rigid_time = from->variation.rigid_time,
                       .map = {map[0], map[1]}};
    for (int f = 0; f < from->shape.feet; f++) {
        episode.load +=
            all->contact.velocity[6 * (i * from->shape.feet + f) + 2]; /* now wrenches */
    }
    memcpy(episode.ground, from->ground, sizeof episode.ground);
    for (int k = 0; k < 3; k++) {
        episode.command[k] = from->command[k];
    }
    for (int k = 0; k < 7 + from->shape.joints; k++) {
        episode.qpos[k] = from->robot.qpos[k];
    }
    for (int k = 0; k < from->shape.joints; k++) {
        episode.kp_scale[k] = from->kp_scale[k];
        episode.action[k] = from->action[0][k];
    }
    return episode;
}

void episode_throw(const Envs *envs, int i, double speed) {
    env_at(envs_batch_arrays(envs), i)->robot.qvel[0] = (float)speed;
}

void episode_lift(const Envs *envs, int i, double speed) {
    TaskEnv *env = env_at(envs_batch_arrays(envs), i);
    memset(env->robot.qvel, 0, sizeof env->robot.qvel);
    env->robot.qvel[2] = (float)speed;
}
