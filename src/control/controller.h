/* Who moves the robots. A controller is one file that fills this contract; evaluation and play know
 * nothing else. */
#ifndef MILD_CONTROLLER_H
#define MILD_CONTROLLER_H

#include "base/pool.h"
#include "task/task.h"

typedef struct {
    void *self;
    const char *name;
    /* Actions [rows][robot_joints] for the environments as they are now. One caller at a time. */
    void (*act)(void *self, int rows, TaskEnv *const *envs, float *actions);
    void (*destroy)(void *self);
} Controller;

/* The paper's controller: a trained policy file, deterministic (z = mu, mean action). pool may be
 * NULL. Fails when the file does not hold a policy of this task's shape. */
MildStatus controller_learned(const char *path, const Robot *robot, Pool *pool, int rows_max,
                              Controller *controller, MildError *error);
void controller_destroy(Controller *controller);

#endif
