/* The episode of an environment in the same numbers, whatever text the environment is of. */
#ifndef CROWD_EPISODE_H
#define CROWD_EPISODE_H

#include <stdint.h>

#include "robot/limits.h"

typedef struct {
    uint32_t index, step;           /* of TaskEnv, as all of these */
    int ground[MILD_MATERIALS_MAX]; /* by label */
    int rigid;                      /* bool */
    double friction;                /* [-] of rigid ground */
    double map[2];                  /* [m] */
    double command[3];              /* [m/s, m/s, rad/s] */
    double qpos[ROBOT_NQ_MAX];
    double kp_scale[ROBOT_JOINTS_MAX];
} CrowdEpisode;

#endif
