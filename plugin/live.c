#include "plugin/plugin.h"

#include <stdio.h>
#include <string.h>

#include "ground/law/models.h"

#define NAME 64 /* bytes */

static MildStatus check_label(const Soft *soft, int label, MildError *error) {
    if (label < 0 || label >= soft->terrain.material_count) {
        return mild_fail(error, MILD_ERROR_RANGE, "label %d, but the ground has %d materials",
                         label, soft->terrain.material_count);
    }
    return MILD_OK;
}

int live_print(const Soft *soft, int label, char *text, int size) {
    int length = 0;
    if (check_label(soft, label, NULL) != MILD_OK) {
        return -1;
    }
    for (int i = 0; i < mild_material_field_count; i++) {
        const MildField *field = &mild_material_fields[i];
        char value[64];
        mild_field_print(field, &soft->terrain.materials[label], value, sizeof value);
        length +=
            snprintf(length < size ? text + length : NULL,
                     length < size ? (size_t)(size - length) : 0, "%s=%s\n", field->name, value);
    }
    return length;
}

/* Reads one line into the material, or into name[NAME], and moves *text behind it. */
static MildStatus read_line(const char **text, MildMaterial *material, char *name,
                            MildError *error) {
    char line[128];
    const size_t length = strcspn(*text, "\n");
    char *value;
    if (length >= sizeof line) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "a line of more than %zu bytes",
                         sizeof line - 1);
    }
    memcpy(line, *text, length);
    line[length] = '\0';
    *text += length + ((*text)[length] == '\n');
    value = strchr(line, '=');
    if (!value) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "'%s', but a line must be KEY=VALUE", line);
    }
    *value++ = '\0';
    if (strcmp(line, "name") == 0) {
        snprintf(name, NAME, "%s", value);
        return MILD_OK;
    }
    const MildField *field =
        mild_field_find(mild_material_fields, mild_material_field_count, line, NULL);
    return field ? mild_field_parse(field, material, value, "ground", error)
                 : mild_fail(error, MILD_ERROR_ARGUMENT, "ground has no number '%s'", line);
}

/* Puts a material in the place of another. */
static void exchange(Soft *soft, MildGround *ground, int label, const MildMaterial *material) {
    const MildTerrain before = soft->terrain;
    soft->terrain.materials[label] = *material;
    if (ground) {
        mild_ground_change(ground, &before, &soft->terrain, soft->scratch);
        soft->solved = 0;
    }
}

MildStatus live_change(Soft *soft, const mjModel *m, MildGround *ground, int label,
                       const char *text, MildError *error) {
    MildStatus status = check_label(soft, label, error);
    if (status != MILD_OK) {
        return status;
    }
    char name[NAME] = "";
    MildMaterial material = soft->terrain.materials[label], matched;
    const MildModel model = (MildModel)material.model;
    while (status == MILD_OK && *text) {
        status = read_line(&text, &material, name, error);
    }
    if (status == MILD_OK && soft->model >= 0 && model_is_cones(material.model) &&
        !soft->foot[0].shell) {
        status = mild_model_match((MildModel)soft->model, &material, soft->foot[0].raster,
                                  soft_load(soft, m), &matched, error);
        material = status == MILD_OK ? matched : material;
    }
    const int stays = soft->model < 0 && model_is_cones((int)model) ? model_is_cones(material.model)
                                                                    : material.model == (int)model;
    if (status == MILD_OK && !stays) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "ground.model %s, but the model's ground is one of %s, which stays",
                         mild_model_names[material.model], mild_model_names[model]);
    }
    if (status == MILD_OK) {
        status = mild_material_check(&material, error);
    }
    if (status == MILD_OK) {
        status = soft_meet(soft, &material, error);
    }
    if (status == MILD_OK) {
        exchange(soft, ground, label, &material);
        if (name[0]) {
            visual_colour(name, &material, soft->colour[label]);
        }
    }
    return status;
}
