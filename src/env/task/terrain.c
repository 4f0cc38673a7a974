#include "env/task/terrain.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/random.h"
#include "env/task/image.h"
#include "mild/ground.h"

#define RANDOM_USE_STRIPES 0x53545250u
#define STRIPE_PIXEL 0.1       /* [m] */
enum { STRIPE_PIXELS = 2048 }; /* several times the way of an episode */

static const MildField own_fields[] = {
    MILD_FIELD(
        TerrainDef, image, MILD_FIELD_TEXT, sizeof((TerrainDef *)0)->image, 0, 0,
        "[-] PNG file for kind = image: black is 0, white is amplitude; a pixel is `cell` wide"),
    MILD_FIELD(TerrainDef, labels, MILD_FIELD_TEXT, sizeof((TerrainDef *)0)->labels, 0, 0,
               "[-] PNG file for patches = image: black is the first material, white the last"),
    MILD_FIELD(TerrainDef, memory, MILD_FIELD_BOOL, 1, 0, 1,
               "[bool] the ground keeps imprints, which later steps run into"),
    MILD_FIELD(
        TerrainDef, tiles, MILD_FIELD_INT, 1, 8, MILD_IMPRINT_TILES_MAX,
        "[-] memory for imprints: tiles of 136 bytes, about ten per imprint of a foot; when all "
        "are in use the oldest are forgotten"),
};
enum { OWN_FIELDS = sizeof own_fields / sizeof *own_fields, FIELDS_MAX = 32 };

TerrainDef terrain_def_default(void) {
    return (TerrainDef){.map = mild_map_def_default(), .tiles = 128};
}

/* The library's table and ours as one; `map` is the first member, so that offsets are the same in
 * both structs. */
const MildField *terrain_fields(int *count) {
    static MildField fields[FIELDS_MAX];
    static_assert(offsetof(TerrainDef, map) == 0,
                  "the map's fields are at the same offsets in TerrainDef");
    assert(mild_map_field_count + OWN_FIELDS <= FIELDS_MAX);
    memcpy(fields, mild_map_fields, (size_t)mild_map_field_count * sizeof *fields);
    memcpy(fields + mild_map_field_count, own_fields, sizeof own_fields);
    *count = mild_map_field_count + OWN_FIELDS;
    return fields;
}

/* Bool: the terrain needs a map, because it is not level or has a pattern. */
static int terrain_has_map(const TerrainDef *def) {
    return def->map.kind != MILD_MAP_FLAT || def->map.patches != MILD_PATTERN_NONE;
}

int terrain_imprint_tiles(const TerrainDef *def) {
    return def->memory ? def->tiles : 0;
}

static MildStatus read_image(const char *key, const char *path, Image *image, MildError *error) {
    MildError cause = {0};
    if (!*path) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "terrain.%s is empty: name a PNG file", key);
    }
    MildStatus status = image_read(path, image, &cause);
    return status == MILD_OK ? MILD_OK
                             : mild_fail(error, status, "terrain.%s = %s", key, cause.text);
}

static unsigned char *make_labels(const Image *image, int materials) {
    size_t pixels = (size_t)image->columns * (size_t)image->rows;
    unsigned char *labels = malloc(pixels);
    for (size_t i = 0; labels && i < pixels; i++) {
        labels[i] = (unsigned char)lround(image->grey[i] * (materials - 1));
    }
    return labels;
}

/* Refuses an image that would not be used. */
static MildStatus check_used(const char *key, const char *path, int used, const char *switched,
                             MildError *error) {
    if (!*path || used) {
        return MILD_OK;
    }
    return mild_fail(error, MILD_ERROR_ARGUMENT,
                     "terrain.%s = %s is not used: set terrain.%s = image", key, path, switched);
}

/* Makes the map. label: NULL, or labels [columns] of one row. */
static MildStatus make(const TerrainDef *def, int materials, unsigned char *label, int columns,
                       MildMap **map, MildError *error) {
    MildMapDef want = def->map;
    Image heights = {0}, labels = {.columns = columns, .rows = 1};
    unsigned char *own = NULL;
    MildStatus status = MILD_OK;
    want.patch_count = materials;
    if (want.kind == MILD_MAP_IMAGE) {
        status = read_image("image", def->image, &heights, error);
    }
    if (label) {
        want.patches = MILD_PATTERN_IMAGE;
        want.patch_size = STRIPE_PIXEL;
        want.border = 0;
    } else if (status == MILD_OK && want.patches == MILD_PATTERN_IMAGE) {
        status = read_image("labels", def->labels, &labels, error);
        own = status == MILD_OK ? make_labels(&labels, materials) : NULL;
        if (status == MILD_OK && !own) {
            status = mild_fail(error, MILD_ERROR_MEMORY, "terrain.labels: out of memory");
        }
    }
    want.heights = heights.grey, want.height_columns = heights.columns,
    want.height_rows = heights.rows;
    want.labels = label ? label : own;
    want.label_columns = labels.columns, want.label_rows = labels.rows;
    if (status == MILD_OK && !(*map = mild_map_create(&want, error))) {
        status = error->status;
    }
    image_close(&heights);
    if (!label) {
        image_close(&labels);
    }
    free(own);
    return status;
}

MildStatus terrain_make(const TerrainDef *def, int materials, MildMap **map, MildError *error) {
    *map = NULL;
    MildStatus status =
        check_used("image", def->image, def->map.kind == MILD_MAP_IMAGE, "kind", error);
    if (status == MILD_OK) {
        status = check_used("labels", def->labels, def->map.patches == MILD_PATTERN_IMAGE,
                            "patches", error);
    }
    if (status != MILD_OK || !terrain_has_map(def)) {
        return status;
    }
    return make(def, materials, NULL, 0, map, error);
}

MildStatus terrain_make_striped(const TerrainDef *def, int materials, const double length[2],
                                uint64_t seed, MildMap **map, MildError *error) {
    unsigned char label[STRIPE_PIXELS];
    Random random = random_at(seed ^ RANDOM_USE_STRIPES, 0, 0);
    double end = 0;
    unsigned char now = 0;
    for (int i = 0; i < STRIPE_PIXELS; i++) {
        if (i * STRIPE_PIXEL >= end) {
            end += random_uniform(&random, length[0], length[1]);
            now = (unsigned char)random_index(&random, (uint32_t)materials);
        }
        label[i] = now;
    }
    *map = NULL;
    return make(def, materials, label, STRIPE_PIXELS, map, error);
}
