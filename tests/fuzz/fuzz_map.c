/* Any numbers and any pixels as a map: refused with a message, or a map whose every query, NaN and
 * infinities included, gives a label that it says it has and, at a finite point, a height within
 * its range. */
#include "fuzz.h"
#include "mild/ground.h"

enum { EDGE = 6, POINTS = 8, WORK = 4096 };

static MildMapDef take_def(Bytes *bytes, double heights[EDGE * EDGE],
                           unsigned char labels[EDGE * EDGE]) {
    MildMapDef def = mild_map_def_default();
    double *const numbers[] = {&def.cell,  &def.size,       &def.amplitude, &def.wavelength,
                               &def.slope, &def.patch_size, &def.border};
    def.kind = take_below(bytes, 8);
    def.patches = take_below(bytes, 5);
    def.seed = take_byte(bytes);
    def.patch_count = take_below(bytes, 16);
    def.cell = 0.1;
    for (int edits = take_below(bytes, 8); edits > 0; edits--) {
        *numbers[take_below(bytes, 7)] = take_number(bytes, 1.0);
    }
    def.height_columns = take_below(bytes, EDGE + 1);
    def.height_rows = take_below(bytes, EDGE + 1);
    def.label_columns = take_below(bytes, EDGE + 1);
    def.label_rows = take_below(bytes, EDGE + 1);
    for (int i = 0; i < def.height_columns * def.height_rows; i++) {
        heights[i] = take_number(bytes, 1.0);
    }
    for (int i = 0; i < def.label_columns * def.label_rows; i++) {
        labels[i] = (unsigned char)(take_byte(bytes) % (def.seed % 2 ? 256 : 3));
    }
    def.heights = def.seed % 16 == 0 ? NULL : heights;
    def.labels = def.seed % 16 == 1 ? NULL : labels;
    return def;
}

/* A map may be large and is then slow to fill: only small ones, and those that must be refused, are
 * tried. */
static int takes_long(const MildMapDef *def) {
    double shape = fmax(def->size, def->wavelength) / def->cell;
    double field = def->patch_size / def->cell * fmax(def->patch_count, EDGE),
           reach = 2.0 + def->border / def->cell;
    double work = fmax(shape * shape, field * field * reach * reach);
    return work > WORK && work < 1e22; /* stripes: the root of it */
}

static void check_queries(Bytes *bytes, const MildTerrain *terrain, const MildMap *map) {
    double low, high;
    mild_map_range(map, &low, &high);
    for (int i = 0; i < POINTS; i++) {
        double x = take_number(bytes, 1.0), y = take_number(bytes, 1.0), slope[2];
        int material = mild_terrain_material_at(terrain, x, y);
        MildBlend blend = mild_terrain_blend_at(terrain, x, y);
        double height = mild_terrain_height_at(terrain, x, y);
        mild_terrain_slope_at(terrain, x, y, slope);
        fuzz_check(material >= 0 && material < mild_map_label_count(map) &&
                   blend.first == material);
        fuzz_check(blend.second >= 0 && blend.second < mild_map_label_count(map));
        fuzz_check(blend.share >= 0.0 && blend.share < 0.51);
        if (!isfinite(x) || !isfinite(y)) {
            continue;
        }
        fuzz_check(height >= low - 1e-6 && height <= high + 1e-6);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    Bytes bytes = {data, data + size};
    double heights[EDGE * EDGE];
    unsigned char labels[EDGE * EDGE];
    MildMapDef def = take_def(&bytes, heights, labels);
    if (takes_long(&def)) {
        return 0;
    }
    MildError error = {0};
    MildMap *map = mild_map_create(&def, &error);
    if (!map) {
        fuzz_check(error.status != MILD_OK && error.text[0]);
        return 0;
    }
    MildMaterial material = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&material);
    while (terrain.material_count < MILD_MATERIALS_MAX) {
        terrain.materials[terrain.material_count++] = material;
    }
    MildStatus status = mild_terrain_set_map(&terrain, map, &error);
    fuzz_check((status == MILD_OK) == (mild_map_label_count(map) <= MILD_MATERIALS_MAX));
    if (status == MILD_OK) {
        check_queries(&bytes, &terrain, map);
    }
    mild_map_destroy(map);
    return 0;
}
