#include "app/grounds.h"

#include <string.h>

#include "base/text.h"
#include "ground/law/models.h"
#include "ground/law/width.h"
#include "ground/soil/soil.h"

int grounds_of(MildModel model, const char *names[GROUNDS_MAX]) {
    const MildModelInfo *info = mild_model_info(model);
    int count = 0;
    for (int i = 0; model == MILD_MODEL_MILD && i < mild_material_preset_count(); i++) {
        names[count++] = mild_material_preset_name(i);
    }
    for (int i = 0; i < MILD_MODEL_PRESETS && info->presets[i]; i++) {
        names[count++] = info->presets[i];
    }
    return count;
}

int grounds_all(const char *names[GROUNDS_MAX]) {
    int count = 0;
    for (int m = 0; m < MILD_MODELS; m++) {
        const char *some[GROUNDS_MAX];
        const int more = grounds_of((MildModel)m, some);
        for (int i = 0; i < more && count < GROUNDS_MAX; i++) {
            names[count++] = some[i];
        }
    }
    return count;
}

MildStatus grounds_find(const char *name, MildMaterial *material, int *rigid, MildError *error) {
    int is_rigid = strcmp(name, "rigid") == 0;
    if (rigid) {
        *rigid = is_rigid;
    }
    if (is_rigid && rigid) {
        return MILD_OK;
    }
    return soil_find(name, material, error);
}

MildStatus grounds_model(const char *option, const CliArgs *args, int *model, MildError *error) {
    static const char key[] = "ground.model=";
    const char *name = option;
    for (int i = 0; i < args->override_count; i++) {
        if (strncmp(args->overrides[i], key, sizeof key - 1) != 0) {
            continue;
        }
        const char *other = args->overrides[i] + sizeof key - 1;
        if (option && strcmp(option, other) != 0) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "--model %.40s and --%.60s contradict each other; leave out one",
                             option, args->overrides[i]);
        }
        name = other;
    }
    MildModel found;
    *model = TASK_MODEL_OWN;
    if (!name) {
        return MILD_OK;
    }
    if (mild_model_find(name, &found)) {
        *model = (int)found;
        return MILD_OK;
    }
    return mild_fail(error, MILD_ERROR_ARGUMENT,
                     "unknown ground model '%.60s'; nearest is '%s' (mild info models lists all)",
                     name, text_nearest(name, (const char **)mild_model_names, MILD_MODELS));
}

const char *grounds_model_name(int model) {
    return model == TASK_MODEL_OWN ? "own" : mild_model_names[model];
}

GroundsDef grounds_for_robot(int model, Robot *robot, TaskDef *task, TerrainDef *terrain,
                             const CliArgs *args) {
    robot_set_model(robot, task_model_soles(model));
    return (GroundsDef){.model = model,
                        .sole = robot_rasters(robot)[0],
                        .load = robot_foot_load(robot),
                        .args = args,
                        .task = task,
                        .terrain = terrain};
}

static MildStatus overlay(const GroundsDef *def, MildMaterial *material, MildError *error) {
    ConfigSection sections[4] = {ground_section(material)};
    int count = 1;
    if (def->task) {
        sections[count++] = (ConfigSection){"task", task_fields, task_field_count, def->task};
    }
    if (def->terrain) {
        sections[count++] = terrain_section(def->terrain);
    }
    if (def->train) {
        sections[count++] =
            (ConfigSection){"train", train_machine_fields, train_machine_field_count, def->train};
    }
    return config_overrides(sections, count, def->args->overrides, def->args->override_count,
                            error);
}

MildStatus grounds_finish(const GroundsDef *def, MildMaterial *material, MildError *error) {
    const MildMaterial from = *material;
    const int matched = def->model != TASK_MODEL_OWN && def->model != from.model;
    if (matched && !model_is_cones(from.model)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "this ground is one of %s, which has no match in %s: leave out --model",
                         mild_model_names[from.model], mild_model_names[def->model]);
    }
    material->model = def->model == MILD_MODEL_RIGID ? def->model : from.model;
    MildStatus status = mild_material_check(material, error);
    if (status == MILD_OK && matched) {
        status =
            mild_model_match((MildModel)def->model, &from, def->sole, def->load, material, error);
    }
    if (status == MILD_OK) {
        status = overlay(def, material, error);
    }
    if (status == MILD_OK) {
        status = mild_material_check(material, error);
    }
    return status == MILD_OK ? width_check(material, mild_sole_width(def->sole), error) : status;
}

/* `rigid` in a course: firm whatever --ground.KEY says of the soft grounds beside it. The other
 * overrides are taken. */
static MildStatus finish_hard(const GroundsDef *def, MildMaterial *material, MildError *error) {
    static const CliArgs none;
    MildMaterial unused = *material;
    GroundsDef hard = *def;
    hard.args = &none;
    MildStatus status = grounds_finish(&hard, material, error);
    return status == MILD_OK ? overlay(def, &unused, error) : status;
}

MildStatus grounds_finish_scene(const GroundsDef *def, Scene *scene, MildError *error) {
    MildStatus status = MILD_OK;
    if (def->model == MILD_MODEL_RIGID) {
        MildMaterial unused = mild_material_default();
        scene->rigid = 1;
        return overlay(def, &unused, error);
    }
    for (int i = 0; status == MILD_OK && i < scene->terrain.material_count; i++) {
        MildMaterial *material = &scene->terrain.materials[i];
        status = (scene_is_hard(scene, i) ? finish_hard : grounds_finish)(def, material, error);
    }
    return status;
}

MildStatus grounds_lay_map(const GroundsDef *def, Scene *scene, MildMap **map, MildError *error) {
    MildTerrain *terrain = &scene->terrain;
    MildMap *made = NULL;
    *map = NULL;
    if (scene->rigid && def->terrain->map.patches != MILD_PATTERN_NONE) {
        return mild_fail(
            error, MILD_ERROR_ARGUMENT,
            "rigid is the engine's own contact and has no materials: leave out --terrain.patches");
    }
    MildStatus status = terrain_make(def->terrain, terrain->material_count, &made, error);
    if (status == MILD_OK) {
        status = mild_terrain_set_map(terrain, made, error);
    }
    if (status != MILD_OK) {
        mild_map_destroy(made);
        return status;
    }
    if (def->terrain->map.patches != MILD_PATTERN_NONE) {
        terrain->patch_count = 0;
    }
    *map = made;
    if (def->task) {
        def->task->map = made;
        def->task->imprint_tiles = terrain_imprint_tiles(def->terrain);
    }
    return MILD_OK;
}

static const char *list_names(int count, const char *const *names, char *text, size_t size) {
    size_t length = 0;
    text[0] = '\0';
    for (int i = 0; i < count; i++) {
        int added = snprintf(text + length, size - length, "%s%s", i ? " " : "", names[i]);
        if (added < 0 || (size_t)added >= size - length) {
            break;
        }
        length += (size_t)added;
    }
    return text;
}

const char *grounds_names(char *text, size_t size) {
    const char *names[GROUNDS_MAX];
    return list_names(grounds_all(names), names, text, size);
}

const char *grounds_model_help(char *text, size_t size) {
    char names[240];
    list_names(MILD_MODELS, mild_model_names, names, sizeof names);
    snprintf(text, size,
             "ground model, matched to the sinkage of each ground (default: its own): %s", names);
    return text;
}
