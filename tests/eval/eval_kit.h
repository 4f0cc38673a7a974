/* What the tests of trials share: the robot, the nominal task, the shipped policy's path. */
#ifndef EVAL_KIT_H
#define EVAL_KIT_H

#include "env/task/policy_keys.h"
#include "kit.h"
#include "learn/policy.h"
#include "mild/batch.h"
#include "run/eval/eval.h"
#include "sa01.h"

#define POLICY MILD_SOURCE_DIR "/policies/mild.safetensors"

static Robot *robot;
static TaskDef def; /* nominal, of the policy's file; what a test changes it puts back */

static inline int kit_setup(void **state) {
    (void)state;
    MildError error = {0};
    robot = robot_create(SA01, &error);
    Policy *policy = policy_load(POLICY, NULL, 0, &error);
    def = task_def_default();
    task_def_make_nominal(&def);
    const int ready =
        robot && policy && task_policy_keys_read(&def, policy_def(policy)->task, &error) == MILD_OK;
    policy_destroy(policy);
    if (!ready) {
        fprintf(stderr, "%s\n", error.text);
    }
    return !ready;
}

/* No action, for every row. */
static inline void kit_zero_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    (void)self;
    (void)envs;
    memset(actions, 0, (size_t)rows * SA01_JOINTS * sizeof *actions);
}

/* One row by MuJoCo; *eval must outlive it. */
static inline EvalRun kit_row(const TaskDef *task, Pool *pool, Controller *controller,
                              const Scene *scene, const EvalDef *eval) {
    return (EvalRun){.task = task,
                     .robot = robot,
                     .pool = pool,
                     .controller = controller,
                     .device = MILD_BATCH_HOST,
                     .scenes = scene,
                     .scene_count = 1,
                     .speeds = &eval->speed,
                     .speed_count = 1,
                     .eval = *eval};
}

static inline MildStatus kit_run(const TaskDef *task, Pool *pool, Controller *controller,
                                 const Scene *scene, const EvalDef *eval, EvalRow *row,
                                 MildError *error) {
    const EvalRun run = kit_row(task, pool, controller, scene, eval);
    return eval_run(&run, row, error);
}

static inline int kit_teardown(void **state) {
    (void)state;
    robot_destroy(robot);
    return 0;
}

#endif
