/* Environments of SA01 that nobody steps, for what controllers make of them. ENVS: how many. */
#ifndef CONTROL_KIT_H
#define CONTROL_KIT_H

#include "env/task/task.h"
#include "robots.h"
#include "sa01.h"

static Robot *robot;
static TaskDef task;
static TaskEnv *made[ENVS];

static inline int setup(void **state) {
    (void)state;
    task = task_def_default();
    robot = kit_robot(SA01);
    for (int e = 0; e < ENVS; e++) {
        made[e] = aligned_alloc(64, task_env_bytes(&task, robot));
        assert_non_null(made[e]);
        task_env_init(made[e], &task, robot, 1, (uint32_t)e);
    }
    return 0;
}

static inline int teardown(void **state) {
    (void)state;
    for (int e = 0; e < ENVS; e++) {
        free(made[e]);
    }
    robot_destroy(robot);
    return 0;
}

#endif
