/* The task of a policy. A file of its own, because environments alone have no networks. */
#include <stdio.h>
#include <string.h>

#include "env/task/policy_keys.h"
#include "learn/policy.h"
#include "robot/robot.h"
#include "run/config/experiment_keys.h"

/* The robot of a policy, when its name is one of robots/. */
static void take_robot(TrainDef *train, const char *robot) {
    char names[ROBOT_LISTED_MAX][ROBOT_LISTED_SIZE];
    const int count = robot_list(names, ROBOT_LISTED_MAX);
    for (int i = 0; i < count; i++) {
        if (strcmp(names[i], robot) == 0) {
            snprintf(train->robot, sizeof train->robot, "%s", robot);
        }
    }
}

static MildStatus take_policy(ExperimentDef *def, const char *file, MildError *error) {
    MildError inner = {0};
    Policy *policy = policy_load(file, NULL, 0, &inner);
    MildStatus status = MILD_OK;
    if (policy) {
        take_robot(&def->train, policy_def(policy)->robot);
        if (task_policy_keys_read(&def->task, policy_def(policy)->task, &inner) != MILD_OK) {
            status = mild_fail(error, MILD_ERROR_FORMAT, "%s: its metadata key 'task': %.200s",
                               file, inner.text);
        }
    }
    policy_destroy(policy);
    return status;
}

/* configs/default.ini, what the policy's file says, the config. policy: NULL: none. */
static MildStatus read_config(ExperimentDef *def, const char *policy, const char *config,
                              MildError *error) {
    ConfigSection sections[EXPERIMENT_SECTIONS];
    experiment_sections(def, sections);
    MildStatus status = experiment_read(def, NULL, NULL, 0, error);
    if (status == MILD_OK && policy) {
        status = take_policy(def, policy, error);
    }
    if (status == MILD_OK) {
        status = config_read(sections, EXPERIMENT_SECTIONS, config, 0, error);
    }
    return status == MILD_OK ? experiment_check(def, error) : status;
}

MildStatus experiment_task(TaskDef *task, int randomized, char robot[TRAIN_ROBOT_SIZE],
                           const char *config, const char *policy, MildError *error) {
    ExperimentDef def = experiment_def_default();
    MildStatus status = config   ? read_config(&def, policy, config, error)
                        : policy ? take_policy(&def, policy, error)
                                 : MILD_OK;
    *task = def.task;
    memcpy(robot, def.train.robot, sizeof def.train.robot);
    if (randomized) {
        task_def_choose_ground(task);
    } else {
        task_def_make_nominal(task);
    }
    return status;
}
