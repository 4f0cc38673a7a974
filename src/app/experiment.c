#include "app/experiment.h"

#include <string.h>

#include "app/paths.h"
#include "task/task.h"

ExperimentDef experiment_def_default(void) {
    ExperimentDef def = {
        .train = train_def_default(),
        .ppo = ppo_def_default(),
        .policy = policy_def_default(),
        .task = task_def_default(),
        .terrain = terrain_def_default(),
    };
    def.policy.observation = TASK_OBSERVATION;
    def.policy.frames = TASK_FRAMES;
    def.policy.critic_input = TASK_CRITIC;
    def.policy.actions = TASK_ACTIONS;
    def.policy.estimates = TASK_ESTIMATES;
    return def;
}

void experiment_sections(ExperimentDef *def, ConfigSection sections[EXPERIMENT_SECTIONS]) {
    sections[0] = (ConfigSection){"train", train_fields, train_field_count, &def->train};
    sections[1] = (ConfigSection){"ppo", ppo_fields, ppo_field_count, &def->ppo};
    sections[2] = (ConfigSection){"policy", policy_fields, policy_field_count, &def->policy};
    sections[3] = (ConfigSection){"task", task_fields, task_field_count, &def->task};
    sections[4] = (ConfigSection){"reward", reward_fields, reward_field_count, &def->task.reward};
    sections[5] =
        (ConfigSection){"randomize", randomize_fields, randomize_field_count, &def->task.randomize};
    sections[6] = terrain_section(&def->terrain);
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
        ConfigSection terrain = terrain_section((TerrainDef[]){def->terrain});
        status = mild_fields_check(terrain.fields, terrain.count, terrain.def, terrain.name, error);
    }
    if (status != MILD_OK) {
        return status;
    }
    if (def->ppo.learning_rate_min > def->ppo.learning_rate_max) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "ppo.learning_rate_min %g is above ppo.learning_rate_max %g",
                         def->ppo.learning_rate_min, def->ppo.learning_rate_max);
    }
    if (strcmp(def->train.device, "cpu") != 0 && strcmp(def->train.device, "cuda") != 0) {
        return mild_fail(error, MILD_ERROR_RANGE, "train.device = %s: neither cpu nor cuda",
                         def->train.device);
    }
    if ((int64_t)def->train.envs * def->ppo.steps < def->ppo.minibatches) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "ppo.minibatches %d: train.envs %d x ppo.steps %d gives fewer samples",
                         def->ppo.minibatches, def->train.envs, def->ppo.steps);
    }
    return MILD_OK;
}

MildStatus experiment_read(ExperimentDef *def, const char *overlay, const char *const *overrides,
                           int override_count, MildError *error) {
    char path[PATH_SIZE];
    ConfigSection sections[EXPERIMENT_SECTIONS];
    experiment_sections(def, sections);
    MildStatus status = config_read(sections, EXPERIMENT_SECTIONS,
                                    path_data("configs/default.ini", path), 1, error);
    if (status == MILD_OK && overlay) {
        status = config_read(sections, EXPERIMENT_SECTIONS, overlay, 0, error);
    }
    if (status == MILD_OK) {
        status = config_overrides(sections, EXPERIMENT_SECTIONS, overrides, override_count, error);
    }
    if (status == MILD_OK) {
        status = experiment_check(def, error);
    }
    return status;
}

MildStatus experiment_nominal_task(TaskDef *task, const char *config, MildError *error) {
    ExperimentDef def = experiment_def_default();
    MildStatus status = config ? experiment_read(&def, config, NULL, 0, error) : MILD_OK;
    *task = def.task;
    task_def_make_nominal(task);
    return status;
}
