/* What is in an environment of the batch engine, whose layout is its own. */
#ifndef TEST_EPISODE_H
#define TEST_EPISODE_H

#include <stdint.h>

#include "env/envs.h"

/* Of TaskEnv. */
typedef struct {
    uint32_t index, step;
    int ground[MILD_MATERIALS_MAX]; /* by label */
    int rigid;                      /* bool */
    int shells_stand;               /* bool */
    double friction;                /* [-] of rigid ground */
    double rigid_time;              /* [s] */
    double map[2];                  /* [m] */
    double command[3];              /* [m/s, m/s, rad/s] */
    double qpos[ROBOT_NQ_MAX];
    double load; /* [N] on the feet in the last step */
    double kp_scale[ROBOT_JOINTS_MAX];
    float action[ROBOT_JOINTS_MAX]; /* newest, of driven joints too */
} Episode;

/* Of environment i of the batch engine on the CPU. */
Episode episode_of(const Envs *envs, int i);
/* Gives its base a speed [m/s] forward. */
void episode_throw(const Envs *envs, int i, double speed);
/* Gives its base a speed [m/s] up, and no other motion to anything. */
void episode_lift(const Envs *envs, int i, double speed);

#endif
