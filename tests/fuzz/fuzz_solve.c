/* A contact step under hostile numbers: poses, twists, inverse inertias, time steps that are NaN, infinite, huge or simply
 * wrong. It comes back within its bound of work, what it calls converged is finite, and the memory stays usable: after all
 * that an ordinary step converges. */
#include "fuzz.h"
#include "mild/ground.h"

enum { STEPS = 2, NEWTON_WORK = 16, SWEEPS = 6 };

static MildSole *soles[MILD_FEET_MAX];
static MildScratch *scratch[MILD_FEET_MAX]; /* for one foot, for two */
static MildGround *ground[MILD_FEET_MAX];

static void make_feet(void) {
    static const double outline[2][8] = {{-0.03, -0.02, 0.03, -0.02, 0.03, 0.02, -0.03, 0.02},
                                         {-0.05, -0.02, 0.05, -0.02, 0.05, 0.02, -0.05, 0.02}};
    for (int f = 0; f < MILD_FEET_MAX; f++) {
        MildSoleDef def = {.outline = outline[f], .points = 4, .pitch = 0.0195, .sole_z = -0.05};
        soles[f] = mild_sole_create(&def, NULL);
        fuzz_check(soles[f] != NULL);
    }
    for (int feet = 1; feet <= MILD_FEET_MAX; feet++) {
        const MildSole *const *all = (const MildSole *const *)soles;
        scratch[feet - 1] = mild_scratch_create(all, feet, NULL);
        void *block = malloc(mild_ground_bytes(all, feet));
        fuzz_check(scratch[feet - 1] && block);
        ground[feet - 1] = mild_ground_init(block, all, feet);
    }
}

/* Feet just in the ground, level and at rest, 5 kg each. */
static MildContactInput quiet_input(int feet) {
    MildContactInput input = {.feet = feet, .dt = 0.002};
    for (int f = 0; f < feet; f++) {
        input.position[f][2] = 0.045;
        for (int k = 0; k < 3; k++) input.rotation[f][4 * k] = 1.0;
        input.free_velocity[6 * f + 2] = -0.02;
        for (int k = 0; k < 6; k++) input.inverse_inertia[(6 * f + k) * (6 * feet + 1)] = k < 3 ? 0.2 : 20.0;
    }
    return input;
}

/* Overwrites some numbers, each anywhere in the input. */
static void spoil(Bytes *bytes, MildContactInput *input) {
    double *const areas[] = {&input->position[0][0], &input->rotation[0][0], &input->velocity[0][0],
                             input->inverse_inertia, input->free_velocity,   &input->dt,
                             &input->tolerance};
    const int counts[] = {
        3 * input->feet, 9 * input->feet, 6 * input->feet, 36 * input->feet * input->feet, 6 * input->feet, 1, 1};
    static const double usual[] = {0.1, 1.0, 2.0, 10.0, 2.0, 0.01, 1e-3};
    input->solver = take_below(bytes, 2) ? MILD_SOLVER_GAUSS_SEIDEL : MILD_SOLVER_NEWTON;
    input->max_iterations = input->solver == MILD_SOLVER_NEWTON ? take_below(bytes, NEWTON_WORK) : SWEEPS;
    for (int edits = take_below(bytes, 16); edits > 0; edits--) {
        int area = take_below(bytes, 7);
        areas[area][take_below(bytes, counts[area])] = take_number(bytes, usual[area]);
    }
}

static void check_finite(const double *values, int count) {
    for (int i = 0; i < count; i++) fuzz_check(isfinite(values[i]));
}

static void check_result(const MildContactInput *input, const MildContactResult *result, const MildScratch *used) {
    fuzz_check(result->iterations >= 0 && result->iterations <= (input->max_iterations ? input->max_iterations : 60));
    if (!result->converged) return;
    check_finite(result->velocity, 6 * input->feet);
    for (int f = 0; f < input->feet; f++) {
        const MildFootResult *foot = &result->foot[f];
        check_finite(foot->force, 3);
        check_finite(foot->torque, 3);
        check_finite(mild_scratch_elements(used, f).normal, mild_sole_elements(soles[f]));
        fuzz_check(foot->contacts >= 0 && foot->contacts <= mild_sole_elements(soles[f]));
    }
}

static MildTerrain take_terrain(Bytes *bytes) {
    MildMaterial material, other;
    mild_material_preset(mild_material_preset_name(take_below(bytes, mild_material_preset_count())), &material);
    MildTerrain terrain = mild_terrain_uniform(&material);
    if (take_below(bytes, 2) == 0) return terrain;
    other = material;
    double *value = (double *)((char *)&other + mild_material_fields[take_below(bytes, 13)].offset);
    *value = take_number(bytes, 1.0);
    if (mild_material_check(&other, NULL) == MILD_OK) terrain.materials[terrain.material_count++] = other;
    MildPatch patch = {take_number(bytes, 0.1), take_number(bytes, 0.1), -1.0, 1.0, terrain.material_count - 1};
    mild_terrain_add_patch(&terrain, &patch, NULL);
    return terrain;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (!soles[0]) make_feet();
    Bytes bytes = {data, data + size};
    MildTerrain terrain = take_terrain(&bytes);
    int feet = 1 + take_below(&bytes, MILD_FEET_MAX);
    MildGround *memory = ground[feet - 1];
    MildScratch *work = scratch[feet - 1];
    MildContactResult result;
    mild_ground_reset(memory);
    for (int step = 0; step < STEPS && bytes.at < bytes.end; step++) {
        MildContactInput input = quiet_input(feet);
        spoil(&bytes, &input);
        mild_ground_solve(memory, &terrain, &input, work, &result);
        check_result(&input, &result, work);
        mild_ground_advance(memory, &terrain, &input, work, &result);
    }
    if (!fuzz_sample(data, size, 4)) return 0;
    MildContactInput away = quiet_input(feet), quiet = away;
    for (int f = 0; f < feet; f++) away.position[f][2] = 10.0; /* lifted, every element forgets */
    mild_ground_solve(memory, &terrain, &away, work, &result);
    fuzz_check(result.converged);
    mild_ground_advance(memory, &terrain, &away, work, &result);
    terrain = mild_terrain_uniform(&terrain.materials[0]);
    mild_ground_solve(memory, &terrain, &quiet, work, &result);
    check_result(&quiet, &result, work);
    fuzz_check(result.converged && result.foot[0].force[2] > 0.0);
    return 0;
}
