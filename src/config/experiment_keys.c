#include "config/experiment_keys.h"

#include <stdio.h>
#include <string.h>

#include "base/paths.h"
#include "learn/policy.h"
#include "task/policy_keys.h"

ConfigSection terrain_section(TerrainDef *def) {
    int count;
    const MildField *fields = terrain_fields(&count);
    return (ConfigSection){"terrain", fields, count, def};
}

ConfigSection ground_section(MildMaterial *material) {
    return (ConfigSection){"ground", mild_material_fields, mild_material_field_count, material};
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

/* configs/default.ini, what the policy's file says, the overlay, the overrides. policy, overlay:
 * NULL: none. */
static MildStatus read_layers(ExperimentDef *def, const char *policy, const char *overlay,
                              const char *const *overrides, int override_count, MildError *error) {
    char path[PATH_SIZE];
    ConfigSection sections[EXPERIMENT_SECTIONS];
    experiment_sections(def, sections);
    MildStatus status = config_read(sections, EXPERIMENT_SECTIONS,
                                    path_data("configs/default.ini", path), 1, error);
    if (status == MILD_OK && policy) {
        status = take_policy(def, policy, error);
    }
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

MildStatus experiment_read(ExperimentDef *def, const char *overlay, const char *const *overrides,
                           int override_count, MildError *error) {
    return read_layers(def, NULL, overlay, overrides, override_count, error);
}

MildStatus experiment_read_text(ExperimentDef *def, const char *text, MildError *error) {
    ConfigSection sections[EXPERIMENT_SECTIONS];
    experiment_sections(def, sections);
    MildStatus status =
        config_read_text(sections, EXPERIMENT_SECTIONS, text, "config.ini", 1, error);
    return status == MILD_OK ? experiment_check(def, error) : status;
}

MildStatus experiment_task(TaskDef *task, int randomized, char robot[TRAIN_ROBOT_SIZE],
                           const char *config, const char *policy, MildError *error) {
    ExperimentDef def = experiment_def_default();
    MildStatus status = config   ? read_layers(&def, policy, config, NULL, 0, error)
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
