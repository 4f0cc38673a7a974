#include "run/config/experiment_keys.h"

#include "base/paths.h"

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

MildStatus experiment_read_text(ExperimentDef *def, const char *text, MildError *error) {
    ConfigSection sections[EXPERIMENT_SECTIONS];
    experiment_sections(def, sections);
    MildStatus status =
        config_read_text(sections, EXPERIMENT_SECTIONS, text, "config.ini", 1, error);
    return status == MILD_OK ? experiment_check(def, error) : status;
}
