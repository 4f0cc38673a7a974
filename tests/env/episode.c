#include "episode.h"

#include <string.h>

#define TASK_ON_DEVICE
#include "env/task/lanes.h"
#undef TASK_FN
#define TASK_FN /* the functions are not here */
#include "env/task/task.h"

Episode episode_of(const void *env) {
    const TaskEnv *from = env;
    Episode episode = {.index = from->index,
                       .step = from->step,
                       .rigid = from->variation.rigid,
                       .friction = from->variation.rigid_friction,
                       .rigid_time = from->variation.rigid_time,
                       .map = {from->terrain.map_x, from->terrain.map_y}};
    memcpy(episode.ground, from->ground, sizeof episode.ground);
    for (int i = 0; i < 3; i++) {
        episode.command[i] = from->command[i];
    }
    for (int i = 0; i < 7 + from->shape.joints; i++) {
        episode.qpos[i] = from->robot.qpos[i];
    }
    for (int i = 0; i < from->shape.joints; i++) {
        episode.kp_scale[i] = from->kp_scale[i];
    }
    return episode;
}

void episode_throw(void *env, double speed) {
    ((TaskEnv *)env)->robot.qvel[0] = (float)speed;
}
