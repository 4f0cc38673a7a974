#include "plugin/def.h"

#include <stdio.h>
#include <string.h>

#include "ground/law/models.h"
#include "ground/soil/soil.h"

#define WORD 512 /* bytes of a name */

#define FIELD(member, type, count, low, high, help)                                                \
    MILD_FIELD(PluginDef, member, type, count, low, high, help)
const MildField plugin_fields[] = {
    FIELD(feet, MILD_FIELD_TEXT, PLUGIN_TEXT_SIZE, 0, 0,
          "[text] bodies or sites that are feet; z points up from the sole"),
    FIELD(body, MILD_FIELD_TEXT, PLUGIN_TEXT_SIZE, 0, 0,
          "[text] bodies whose shapes touch the ground with any side; with the feet at most 16"),
    FIELD(sole, MILD_FIELD_TEXT, PLUGIN_TEXT_SIZE, 0, 0,
          "[text] geoms that form the soles (default: the shapes of the foot's body); a single "
          "sphere is a round foot"),
    FIELD(outline, MILD_FIELD_TEXT, PLUGIN_OUTLINE_SIZE, 0, 0,
          "[m] polygon x y x y ... of the sole in the frame of the foot; one for all feet, or one "
          "for each, separated by ;"),
    FIELD(
        ground, MILD_FIELD_TEXT, PLUGIN_TEXT_SIZE, 0, 0,
        "[text] preset, or the file of a soil, which ends in .ini; several when terrain.patches is "
        "set (default sand_loose)"),
    FIELD(sole_z, MILD_FIELD_DOUBLE, 1, -10, 10, "[m] height of the outline's plane in that frame"),
    FIELD(pitch, MILD_FIELD_DOUBLE, 1, 1e-3, 1,
          "[m] edge of a ground element (default: near 0.0195, such that they have the sole's "
          "area; 0.0195 with elements)"),
    FIELD(body_pitch, MILD_FIELD_DOUBLE, 1, 1e-3, 1, "[m] between the elements of a body"),
    FIELD(elements, MILD_FIELD_INT, 1, 0, 65536, "[-] elements of a sole; 0: as many as fit"),
    FIELD(height, MILD_FIELD_DOUBLE, 1, -1e3, 1e3, "[m] of the surface above z = 0"),
    FIELD(prints, MILD_FIELD_INT, 1, 0, MILD_IMPRINT_TILES_MAX,
          "[-] tiles of imprints that stay, about ten a footprint; 0: the ground forgets"),
    FIELD(surface, MILD_FIELD_INT, 1, 0, 1,
          "[0 or 1] whether level ground is drawn too, dented, in place of a plane of the model"),
};
const int plugin_field_count = (int)(sizeof plugin_fields / sizeof *plugin_fields);

/* ---- names of the attributes ---- */

typedef struct {
    const char *name;   /* in messages */
    const char *prefix; /* of its attributes */
    const MildField *fields;
    const int *count;
} Section;

static const Section sections[] = {
    {"plugin", "", plugin_fields, &plugin_field_count},
    {"ground", "ground.", mild_material_fields, &mild_material_field_count},
    {"terrain", "terrain.", mild_map_fields, &mild_map_field_count}};
enum { SECTIONS = 3, PLUGIN_SECTION = 0, MATERIAL_SECTION, MAP_SECTION, ATTRIBUTES_MAX = 96 };

static void attribute_name(const Section *section, int field, char *name, size_t size) {
    snprintf(name, size, "%s%s", section->prefix, section->fields[field].name);
}

const char *const *plugin_attributes(int *count) {
    static char names[ATTRIBUTES_MAX][48];
    static const char *attributes[ATTRIBUTES_MAX];
    int filled = 0;
    for (int s = 0; s < SECTIONS; s++) {
        for (int i = 0; i < *sections[s].count && filled < ATTRIBUTES_MAX; i++, filled++) {
            attribute_name(&sections[s], i, names[filled], sizeof names[filled]);
            attributes[filled] = names[filled];
        }
    }
    *count = filled;
    return attributes;
}

const char *plugin_text(const mjModel *m, int instance, const char *attribute) {
    const char *text = mj_getPluginConfig(m, instance, attribute);
    return text && *text ? text : NULL;
}

/* Overwrites the fields of `def` that the instance gives. */
static MildStatus read_section(const mjModel *m, int instance, const Section *section, void *def,
                               MildError *error) {
    for (int i = 0; i < *section->count; i++) {
        char name[48];
        attribute_name(section, i, name, sizeof name);
        const char *text = plugin_text(m, instance, name);
        MildStatus status =
            text ? mild_field_parse(&section->fields[i], def, text, section->name, error) : MILD_OK;
        if (status != MILD_OK) {
            return status;
        }
    }
    return MILD_OK;
}

MildStatus plugin_def_read(const mjModel *m, int instance, PluginDef *def, MildError *error) {
    *def = (PluginDef){.ground = "sand_loose", .body_pitch = 0.03, .map = mild_map_def_default()};
    MildStatus status = read_section(m, instance, &sections[PLUGIN_SECTION], def, error);
    return status == MILD_OK ? read_section(m, instance, &sections[MAP_SECTION], &def->map, error)
                             : status;
}

int plugin_word(const char **text, char *word, size_t size) {
    static const char space[] = " \t\r\n,";
    const char *start = *text + strspn(*text, space);
    const size_t length = strcspn(start, space), kept = length < size ? length : size - 1;
    memcpy(word, start, kept);
    word[kept] = '\0';
    *text = start + length;
    return length > 0;
}

/* ---- materials ---- */

static MildStatus find_ground(const char *name, MildMaterial *material, MildError *error) {
    if (strcmp(name, "rigid") == 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "ground 'rigid' is MuJoCo's own contact; leave the plugin out");
    }
    return soil_find(name, material, error);
}

MildStatus plugin_def_model(const mjModel *m, int instance, const PluginDef *def, int *model,
                            MildModel *first, MildError *error) {
    const char *text = def->ground;
    char word[WORD] = "";
    MildMaterial material;
    if (!plugin_word(&text, word, sizeof word)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "plugin.ground names no ground");
    }
    MildStatus status = find_ground(word, &material, error);
    if (status != MILD_OK) {
        return status;
    }
    const int own = material.model;
    material.model = -1;
    status = read_section(m, instance, &sections[MATERIAL_SECTION], &material, error);
    if (status != MILD_OK) {
        return status;
    }
    *model = material.model;
    *first = (MildModel)(*model >= 0 ? *model : own);
    if (*first == MILD_MODEL_RIGID) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "ground.model 'rigid' is MuJoCo's own contact; leave the plugin out");
    }
    if (!model_is_cones(own) && (int)*first != own) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "ground '%.60s' is one of %s, which has no match in %s; leave out "
                         "ground.model",
                         word, mild_model_names[own], mild_model_names[*first]);
    }
    return MILD_OK;
}

/* A preset as a material of the model, with the keys ground.*. */
static MildStatus finish_material(const mjModel *m, int instance, int model, const MildSole *sole,
                                  double load, MildMaterial *material, MildError *error) {
    const MildMaterial from = *material;
    MildStatus status = MILD_OK;
    if (model >= 0 && model != from.model && model_is_cones(from.model)) {
        if (!sole) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "ground.model '%s' is matched to a preset under the sole of a foot; "
                             "name a foot in feet, or leave out ground.model",
                             mild_model_names[model]);
        }
        status = mild_model_match((MildModel)model, &from, sole, load, material, error);
    }
    if (status == MILD_OK) {
        status = read_section(m, instance, &sections[MATERIAL_SECTION], material, error);
    }
    return status == MILD_OK ? mild_material_check(material, error) : status;
}

MildStatus plugin_def_materials(const mjModel *m, int instance, const PluginDef *def,
                                const MildSole *sole, double load, MildTerrain *terrain,
                                MildError *error) {
    const char *text = def->ground;
    char word[WORD];
    int model = -1;
    MildModel first = MILD_MODEL_MILD;
    MildStatus status = plugin_def_model(m, instance, def, &model, &first, error);
    *terrain = (MildTerrain){.height = def->height};
    while (status == MILD_OK && plugin_word(&text, word, sizeof word)) {
        MildMaterial *material = &terrain->materials[terrain->material_count];
        if (terrain->material_count == MILD_MATERIALS_MAX) {
            return mild_fail(error, MILD_ERROR_RANGE, "plugin.ground names more than %d grounds",
                             MILD_MATERIALS_MAX);
        }
        status = find_ground(word, material, error);
        if (status == MILD_OK) {
            status = finish_material(m, instance, model, sole, load, material, error);
        }
        terrain->material_count++;
    }
    if (status == MILD_OK && terrain->material_count > 1 && def->map.patches == MILD_PATTERN_NONE) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "plugin.ground names %d grounds; set terrain.patches to stripes or "
                         "checker, or name one",
                         terrain->material_count);
    }
    return status;
}
