#include "app/grounds.h"

#include <string.h>

#include "app/text.h"

enum { NAMES_MAX = 32 };

MildStatus grounds_find(const char *name, MildMaterial *material, int *rigid, MildError *error) {
    int is_rigid = strcmp(name, "rigid") == 0;
    if (rigid) *rigid = is_rigid;
    if (is_rigid && rigid) return MILD_OK;
    if (is_rigid) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "ground 'rigid' is the engine's own contact and has no soft-ground law");
    }
    if (mild_material_preset(name, material)) return MILD_OK;
    const char *names[NAMES_MAX];
    int count = 0;
    for (; count < mild_material_preset_count() && count < NAMES_MAX - 1; count++) {
        names[count] = mild_material_preset_name(count);
    }
    if (rigid) names[count++] = "rigid";
    return mild_fail(error, MILD_ERROR_ARGUMENT,
                     "unknown ground '%.60s'; nearest is '%s' (mild info grounds lists all)", name,
                     text_nearest(name, names, count));
}

ConfigSection grounds_section(MildMaterial *material) {
    return (ConfigSection){"ground", mild_material_fields, mild_material_field_count, material};
}

const char *grounds_names(char *text, size_t size) {
    size_t length = 0;
    text[0] = '\0';
    for (int i = 0; i < mild_material_preset_count(); i++) {
        int added = snprintf(text + length, size - length, "%s%s", i ? " " : "", mild_material_preset_name(i));
        if (added < 0 || (size_t)added >= size - length) break;
        length += (size_t)added;
    }
    return text;
}

double grounds_sinkage(const MildMaterial *material, double pitch, int elements, double load) {
    double low = 0, high = 2 * material->bed_depth + 1;
    for (int i = 0; i < 60; i++) { /* F_g grows with depth: halve the bracket */
        double middle = 0.5 * (low + high);
        if (elements * mild_element_law(material, pitch, middle).force < load) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return 0.5 * (low + high);
}
