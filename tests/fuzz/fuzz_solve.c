/* A contact step under hostile numbers: poses, twists, inverse inertias, time steps that are NaN,
 * infinite, huge or simply wrong. It comes back within its bound of work, what it calls converged
 * is finite, and the memory stays usable: after all that an ordinary step converges. */
#include "fuzz.h"
#include "mild/ground.h"

enum { STEPS = 2, NEWTON_WORK = 16, SWEEPS = 6, PRINT_TILES = 8, FEET = 5 };

/* What a model stands on: the raster, or one element in its middle. */
typedef struct {
    MildSole *soles[FEET];
    MildScratch *scratch[FEET];  /* for one foot, for two, .. */
    MildGround *ground[2][FEET]; /* without prints, with */
} Feet;

static Feet raster, concentric;
static MildMap *maps[3]; /* none, rough ground of two materials, a slope */

static void feet_finish(Feet *feet) {
    const MildSole *const *all = (const MildSole *const *)feet->soles;
    for (int count = 1; count <= FEET; count++) {
        feet->scratch[count - 1] = mild_scratch_create(all, count, NULL);
        fuzz_check(feet->scratch[count - 1] != NULL);
        for (int prints = 0; prints < 2; prints++) {
            void *block = malloc(mild_ground_bytes_imprints(all, count, PRINT_TILES * prints));
            fuzz_check(block != NULL);
            feet->ground[prints][count - 1] =
                mild_ground_init_imprints(block, all, count, PRINT_TILES * prints);
        }
    }
}

static void make_feet(void) {
    static const double outline[2][8] = {{-0.02, -0.01, 0.02, -0.01, 0.02, 0.01, -0.02, 0.01},
                                         {-0.02, -0.02, 0.02, -0.02, 0.02, 0.02, -0.02, 0.02}};
    for (int f = 0; f < FEET; f++) {
        MildSoleDef def = {
            .outline = outline[f % 2], .points = 4, .pitch = 0.0195, .sole_z = -0.05};
        raster.soles[f] = mild_sole_create(&def, NULL);
        fuzz_check(raster.soles[f] != NULL);
        concentric.soles[f] = mild_sole_concentric(raster.soles[f], NULL);
        fuzz_check(concentric.soles[f] != NULL);
    }
    feet_finish(&raster);
    feet_finish(&concentric);
    MildMapDef rough = mild_map_def_default(), slope = rough;
    rough.kind = MILD_MAP_ROUGH;
    rough.cell = 0.05;
    rough.size = 1.6;
    rough.patches = MILD_PATTERN_CHECKER;
    rough.patch_size = 0.1;
    rough.border = 0.1;
    slope.kind = MILD_MAP_SLOPE;
    maps[1] = mild_map_create(&rough, NULL);
    maps[2] = mild_map_create(&slope, NULL);
    fuzz_check(maps[1] && maps[2]);
}

/* Feet just in the ground, level and at rest, 5 kg each. */
static MildContactInput quiet_input(int feet) {
    static double A[36 * FEET * FEET];
    MildContactInput input = {.feet = feet, .dt = 0.002, .inverse_inertia = A};
    memset(A, 0, sizeof A);
    for (int f = 0; f < feet; f++) {
        input.position[f][2] = 0.045;
        for (int k = 0; k < 3; k++) {
            input.rotation[f][4 * k] = 1.0;
        }
        input.free_velocity[6 * f + 2] = -0.02;
        for (int k = 0; k < 6; k++) {
            input.inverse_inertia[(6 * f + k) * (6 * feet + 1)] = k < 3 ? 0.2 : 20.0;
        }
    }
    return input;
}

/* Overwrites some numbers, each anywhere in the input. */
static void spoil(Bytes *bytes, MildContactInput *input) {
    double *const areas[] = {&input->position[0][0], &input->rotation[0][0], &input->velocity[0][0],
                             input->inverse_inertia, input->free_velocity,   &input->dt,
                             &input->tolerance};
    const int counts[] = {3 * input->feet,
                          9 * input->feet,
                          6 * input->feet,
                          36 * input->feet * input->feet,
                          6 * input->feet,
                          1,
                          1};
    static const double usual[] = {0.1, 1.0, 2.0, 10.0, 2.0, 0.01, 1e-3};
    input->solver = take_below(bytes, 2) ? MILD_SOLVER_GAUSS_SEIDEL : MILD_SOLVER_NEWTON;
    input->max_iterations =
        input->solver == MILD_SOLVER_NEWTON ? take_below(bytes, NEWTON_WORK) : SWEEPS;
    input->rows = take_below(bytes, 2) ? (uint32_t)take_below(bytes, 1 << FEET) : 0;
    for (int edits = take_below(bytes, 16); edits > 0; edits--) {
        int area = take_below(bytes, 7);
        areas[area][take_below(bytes, counts[area])] = take_number(bytes, usual[area]);
    }
}

static void check_finite(const double *values, int count) {
    for (int i = 0; i < count; i++) {
        fuzz_check(isfinite(values[i]));
    }
}

static void check_result(const MildContactInput *input, const MildContactResult *result,
                         const Feet *feet) {
    /* Solved up to three times, and what is left unsolved takes up to 40 more (mild/ground.h). */
    int most = 3 * ((input->max_iterations ? input->max_iterations : 400) + 40);
    fuzz_check(result->iterations >= 0 && result->iterations <= most);
    if (!result->converged) {
        return;
    }
    check_finite(result->velocity, 6 * input->feet);
    for (int f = 0; f < input->feet; f++) {
        const MildFootResult *foot = &result->foot[f];
        check_finite(foot->force, 3);
        check_finite(foot->torque, 3);
        check_finite(foot->zmp_axis, 3);
        check_finite(foot->zmp_sole, 2);
        check_finite(foot->pressure_center, 3);
        check_finite(mild_scratch_elements(feet->scratch[input->feet - 1], f).normal,
                     mild_sole_elements(feet->soles[f]));
        fuzz_check(foot->contacts >= 0 && foot->contacts <= mild_sole_elements(feet->soles[f]));
    }
}

static MildTerrain take_terrain(Bytes *bytes) {
    MildMaterial preset, material, other;
    mild_material_preset(mild_material_preset_name(take_below(bytes, mild_material_preset_count())),
                         &preset);
    MildModel model = (MildModel)take_below(bytes, MILD_MODEL_RIGID);
    fuzz_check(mild_model_match(model, &preset, raster.soles[0], 20.0, &material, NULL) == MILD_OK);
    MildTerrain terrain = mild_terrain_uniform(&material);
    if (take_below(bytes, 2) == 0) {
        return terrain;
    }
    other = material;
    double *value = (double *)((char *)&other + mild_material_fields[take_below(bytes, 13)].offset);
    *value = take_number(bytes, 1.0);
    if (mild_material_check(&other, NULL) == MILD_OK) {
        terrain.materials[terrain.material_count++] = other;
    }
    mild_terrain_set_map(&terrain, maps[take_below(bytes, 3)],
                         NULL); /* refused when there is one material only */
    MildPatch patch = {take_number(bytes, 0.1), take_number(bytes, 0.1), -1.0, 1.0,
                       terrain.material_count - 1};
    mild_terrain_add_patch(&terrain, &patch, NULL);
    return terrain;
}

/* Lifted, every element forgets; put down again on ordinary ground, the foot is carried. */
static void check_usable(const Feet *feet, int count, const MildMaterial *material) {
    MildGround *memory = feet->ground[0][count - 1];
    MildScratch *work = feet->scratch[count - 1];
    MildTerrain terrain = mild_terrain_uniform(material);
    MildContactInput away = quiet_input(count), quiet = away;
    MildContactResult result;
    for (int f = 0; f < count; f++) {
        away.position[f][2] = 10.0;
    }
    mild_ground_solve(memory, &terrain, &away, work, &result);
    fuzz_check(result.converged);
    mild_ground_advance(memory, &terrain, &away, work, &result);
    mild_ground_solve(memory, &terrain, &quiet, work, &result);
    check_result(&quiet, &result, feet);
    fuzz_check(result.converged && result.foot[0].force[2] > 0.0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (!raster.soles[0]) {
        make_feet();
    }
    Bytes bytes = {data, data + size};
    MildTerrain terrain = take_terrain(&bytes);
    const Feet *feet =
        mild_model_is_concentric((MildModel)terrain.materials[0].model) ? &concentric : &raster;
    int count = 1 + take_below(&bytes, FEET);
    int prints = take_below(&bytes, 2);
    MildGround *memory = feet->ground[prints][count - 1];
    mild_ground_reset(memory);
    for (int step = 0; step < STEPS && bytes.at < bytes.end; step++) {
        MildContactInput input = quiet_input(count);
        MildContactResult result;
        spoil(&bytes, &input);
        mild_ground_near(&terrain, &input, feet->scratch[count - 1]);
        mild_ground_solve(memory, &terrain, &input, feet->scratch[count - 1], &result);
        check_result(&input, &result, feet);
        mild_ground_advance(memory, &terrain, &input, feet->scratch[count - 1], &result);
    }
    if (!prints && fuzz_sample(data, size, 4)) {
        check_usable(feet, count, &terrain.materials[0]);
    }
    return 0;
}
