#include "run/eval/scene.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "ground/soil/soil.h"

#define SCENE_FAR 1e4 /* [m] */
#define HARD "rigid"

/* `rigid` inside a course, because the engine's own floor is under both feet or under none: rubber
 * 70 times as hard, into which the edge of a sole sinks 5 mm, with the friction of rigid ground. */
static MildMaterial hard_ground(void) {
    MildMaterial hard = mild_material_default();
    mild_material_preset("rubber", &hard);
    hard.k_pen = 1e5;
    hard.k_drift = 1e4;
    hard.mu = 0.8;
    return hard;
}

static MildStatus find_ground(const char *name, MildMaterial *material, MildError *error) {
    if (strcmp(name, HARD) == 0) {
        *material = hard_ground();
        return MILD_OK;
    }
    return soil_find(name, material, error);
}

/* Ground number `count` of a course, from `start` to `end` [m] on the way. */
static MildStatus add_ground(Scene *scene, const char *name, int count, double start, double end,
                             int back, MildError *error) {
    MildTerrain *terrain = &scene->terrain;
    MildMaterial material;
    MildStatus status = find_ground(name, &material, error);
    if (status != MILD_OK) {
        return status;
    }
    if (count == 0) {
        *terrain = mild_terrain_uniform(&material);
        return MILD_OK;
    }
    if (count >= MILD_MATERIALS_MAX) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "a course has at most %d grounds: %s",
                         MILD_MATERIALS_MAX, scene->name);
    }
    const MildPatch patch = {back ? -end : start, back ? -start : end, -SCENE_FAR, SCENE_FAR,
                             count};
    terrain->materials[terrain->material_count++] = material;
    return mild_terrain_add_patch(terrain, &patch, error);
}

static MildStatus lay_course(Scene *scene, double patch_length, MildError *error) {
    char parts[sizeof scene->name];
    strcpy(parts, scene->name);
    double start = -SCENE_FAR, end = fabs(patch_length);
    int count = 0;
    for (char *part = parts, *next; part; part = next, count++) {
        next = strchr(part, '+');
        if (next) {
            *next++ = 0;
        }
        const double far = next ? end : SCENE_FAR;
        MildStatus status = add_ground(scene, part, count, start, far, patch_length < 0, error);
        if (status != MILD_OK) {
            return status;
        }
        start = end;
        end += fabs(patch_length);
    }
    return MILD_OK;
}

MildStatus scene_make(Scene *scene, const char *name, double patch_length, MildError *error) {
    memset(scene, 0, sizeof *scene);
    if (strlen(name) >= sizeof scene->name) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "ground name is too long: %.40s...", name);
    }
    strcpy(scene->name, name);
    if (strcmp(name, HARD) == 0) {
        MildMaterial any = mild_material_default();
        scene->terrain = mild_terrain_uniform(&any);
        scene->rigid = 1;
        return MILD_OK;
    }
    return lay_course(scene, patch_length, error);
}

/* The rest of a course's name from ground number `index` on; "" behind the last. */
static const char *part_of(const Scene *scene, int index) {
    const char *part = scene->name;
    for (int i = 0; i < index && part; i++) {
        part = strchr(part, '+');
        part = part ? part + 1 : NULL;
    }
    return part ? part : "";
}

const char *scene_ground_at(const Scene *scene, double x, double y, char *text, int size) {
    const char *part = part_of(scene, mild_terrain_material_at(&scene->terrain, x, y));
    snprintf(text, (size_t)size, "%.*s", (int)strcspn(part, "+"), part);
    return text;
}

int scene_is_hard(const Scene *scene, int index) {
    const char *part = part_of(scene, index);
    return strcspn(part, "+") == strlen(HARD) && strncmp(part, HARD, strlen(HARD)) == 0;
}
