#include "run/train/experiment.h"

#include <stdio.h>
#include <string.h>

#include "env/task/policy_keys.h"
#include "env/task/task.h"

ExperimentDef experiment_def_default(void) {
    ExperimentDef def = {
        .train = train_def_default(),
        .ppo = ppo_def_default(),
        .policy = policy_def_default(),
        .task = task_def_default(),
        .terrain = terrain_def_default(),
    };
    return def;
}

void experiment_fit_robot(ExperimentDef *def, const Robot *robot) {
    TaskShape shape = task_shape(&def->task, robot);
    snprintf(def->policy.robot, sizeof def->policy.robot, "%s", robot_name(robot));
    task_policy_keys_print(&def->task, def->policy.task, sizeof def->policy.task);
    def->policy.observation = shape.observation;
    def->policy.frames = TASK_FRAMES;
    def->policy.scan = shape.scan;
    def->policy.critic_input = shape.critic;
    def->policy.actions = shape.actions;
    def->policy.estimates = shape.estimates;
    def->policy.feet_velocity_offset = 3; /* behind the base's velocity */
    def->policy.feet_velocity_count = 3 * shape.feet;
    ppo_set_decoder(&def->ppo, task_critic_ground(&shape), TASK_GROUND_NUMBERS + 1, &def->policy);
}

MildStatus experiment_check(const ExperimentDef *def, MildError *error) {
    MildStatus status =
        mild_fields_check(train_fields, train_field_count, &def->train, "train", error);
    if (status == MILD_OK) {
        status = mild_fields_check(ppo_fields, ppo_field_count, &def->ppo, "ppo", error);
    }
    if (status == MILD_OK) {
        status =
            mild_fields_check(policy_fields, policy_field_count, &def->policy, "policy", error);
    }
    if (status == MILD_OK) {
        status = task_def_check(&def->task, error);
    }
    if (status == MILD_OK) {
        int count;
        const MildField *fields = terrain_fields(&count);
        status = mild_fields_check(fields, count, &def->terrain, "terrain", error);
    }
    if (status != MILD_OK) {
        return status;
    }
    if (def->ppo.learning_rate_min > def->ppo.learning_rate_max) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "ppo.learning_rate_min %g is above ppo.learning_rate_max %g",
                         def->ppo.learning_rate_min, def->ppo.learning_rate_max);
    }
    if (def->policy.modulation_input == POLICY_INPUT_FEET_PHASE && !def->task.clock) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "policy.modulation_input = feet_phase reads the gait clock of the "
                         "observation; give task.clock = true");
    }
    if (train_device(&def->train) < -1) {
        return mild_fail(error, MILD_ERROR_RANGE, "train.device = %s: neither cpu, cuda nor cuda:N",
                         def->train.device);
    }
    if ((int64_t)def->train.envs * def->ppo.steps < def->ppo.minibatches) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "ppo.minibatches %d: train.envs %d x ppo.steps %d gives fewer samples",
                         def->ppo.minibatches, def->train.envs, def->ppo.steps);
    }
    return MILD_OK;
}
