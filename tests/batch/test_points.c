/* MildBatchDef.points: quadrupeds whose feet transmit no moment, by the version for such feet, on
 * the CPU and, where there is one, on a GPU. Against mild_ground_solve, against the version for all
 * feet, in the air, and with few Newton steps. */
#include "batch_kit.h"
#include "device/device.h"
#include "ground/map_kit.h"
#include "points_kit.h"

enum { ROBOTS = 64, STEPS = 25, LABELS = 2, FEET = MILD_FEET_MAX, ROWS = 6 * FEET, ELEMENTS = 8 };

typedef struct {
    const char *name;
    int feet;
    MildModel model; /* of label 1; label 0 is a cone */
    MildMapKind kind;
    int map;   /* bool */
    int limit; /* of Newton steps; 0: the default */
} Walk;

static const Walk walks[] = {
    {"four feet", 4, MILD_MODEL_MILD, MILD_MAP_FLAT, 0, 0},
    {"three feet", 3, MILD_MODEL_MILD, MILD_MAP_FLAT, 0, 0},
    {"four feet, 1 step", 4, MILD_MODEL_MILD, MILD_MAP_FLAT, 0, 1},
    {"four feet, 3 steps", 4, MILD_MODEL_MILD, MILD_MAP_FLAT, 0, 3},
    {"ecc_spring", 4, MILD_MODEL_ECC_SPRING, MILD_MAP_FLAT, 0, 0},
    {"ecc_quasi", 4, MILD_MODEL_ECC_QUASI, MILD_MAP_FLAT, 0, 0},
    {"ecc_quasi_3d", 4, MILD_MODEL_ECC_QUASI_3D, MILD_MAP_FLAT, 0, 0},
    {"bekker", 4, MILD_MODEL_BEKKER, MILD_MAP_FLAT, 0, 0},
    {"hunt_crossley, three feet", 3, MILD_MODEL_HUNT_CROSSLEY, MILD_MAP_FLAT, 0, 0},
    {"rough", 4, MILD_MODEL_MILD, MILD_MAP_ROUGH, 1, 0},
    {"waves, bekker", 3, MILD_MODEL_BEKKER, MILD_MAP_WAVES, 1, 0},
};
enum { WALKS = sizeof walks / sizeof *walks };

/* What goes to a batch and what comes back. */
typedef struct {
    float position[ROBOTS * 3 * FEET], rotation[ROBOTS * 9 * FEET];
    float velocity[ROBOTS * ROWS], inverse_inertia[ROBOTS * ROWS * ROWS];
    float free_velocity[ROBOTS * ROWS], height[ROBOTS];
    int32_t material[ROBOTS * LABELS];
    float wrench[ROBOTS * ROWS], after[ROBOTS * ROWS], residual[ROBOTS];
    int32_t iterations[ROBOTS];
    MildBatchFoot foot[ROBOTS * FEET];
    float elements[ROBOTS * 4 * FEET * ELEMENTS];
} Arrays;

typedef struct {
    MildBatch *batch;
    Arrays *arrays; /* on the device */
} Side;

typedef struct {
    int count;
    double error[ROBOTS * STEPS];
} Errors;

static Kit kits[ROBOTS];
static Arrays arrays, other;

/* ---- robots, by mild/ground.h ---- */

static int in_air(int robot) {
    return robot % 8 == 7;
}

static void materials_of(const Walk *walk, const MildSole *sole, MildMaterial materials[LABELS]) {
    const MildMaterial sand = mild_material_default();
    materials[0] = materials[1] = sand;
    if (walk->model != MILD_MODEL_MILD) {
        assert_int_equal(mild_model_match(walk->model, &sand, sole, 40.0, &materials[1], NULL),
                         MILD_OK);
    }
}

static void robots_open(const Walk *walk, MildSole *sole, const MildMaterial *materials,
                        const MildMap *map, uint64_t *random) {
    for (int r = 0; r < ROBOTS; r++) {
        Kit *kit = &kits[r];
        kit_open(kit, walk->feet, sole, sole, &materials[1], 5e-3);
        kit_random_state(kit, random);
        kit->terrain.map = map;
        kit->terrain.material_count = map ? LABELS : 1;
        for (int m = 0; m < LABELS && map; m++) {
            kit->terrain.materials[m] = materials[m];
        }
        for (int f = 0; f < kit->feet; f++) {
            double *at = kit->input.position[f];
            at[2] += mild_terrain_height_at(&kit->terrain, at[0], at[1]) - kit->terrain.height;
            at[2] += in_air(r) ? 5.0 : 0.01;
            kit->mass[f] = kit_uniform(random, 2.0, 10.0);
            kit->inertia[f] = 0.05 * kit->mass[f];
        }
    }
}

/* Solves the next step of all robots, and hands the problem over. */
static void robots_solve(Arrays *a, uint64_t *random) {
    for (int r = 0; r < ROBOTS; r++) {
        Kit *kit = &kits[r];
        const int feet = kit->feet, rows = 6 * feet;
        double force[FEET][3];
        for (int i = 0; i < 3 * feet; i++) {
            force[i / 3][i % 3] =
                kit->mass[i / 3] * kit_uniform(random, -4.0, i % 3 == 2 ? 6.0 : 4.0);
        }
        kit_inverse_inertia(kit);
        kit_free(kit, (const double(*)[3])force);
        kit_points(kit, random);
        kit_solve(kit);
        to_float(a->position + r * 3 * feet, kit->input.position[0], 3 * feet);
        to_float(a->rotation + r * 9 * feet, kit->input.rotation[0], 9 * feet);
        to_float(a->velocity + r * rows, kit->input.velocity[0], rows);
        to_float(a->inverse_inertia + r * rows * rows, kit->input.inverse_inertia, rows * rows);
        to_float(a->free_velocity + r * rows, kit->input.free_velocity, rows);
        a->height[r] = (float)kit->terrain.height;
        for (int label = 0; label < kit->terrain.material_count; label++) {
            a->material[r * kit->terrain.material_count + label] =
                kit->terrain.map ? label : LABELS - 1;
        }
    }
}

/* ---- a batch ---- */

static void side_open(Side *side, const Walk *walk, MildSole *sole, const MildMaterial *materials,
                      const MildMap *map, int device, int points) {
    MildError error = {0};
    const MildSole *const soles[FEET] = {sole, sole, sole, sole};
    const MildBatchDef def = {.robots = ROBOTS,
                              .feet = walk->feet,
                              .soles = soles,
                              .dt = 5e-3,
                              .max_iterations = walk->limit,
                              .device = device,
                              .points = points};
    side->batch = mild_batch_create(&def, &error);
    if (!side->batch || mild_batch_set_materials(side->batch, materials, LABELS, &error) ||
        mild_batch_set_map(side->batch, map, &error)) {
        fail_msg("%s", error.text);
    }
    assert_int_equal(mild_batch_stride(side->batch), ELEMENTS);
    side->arrays = device_alloc(device, sizeof(Arrays), &error);
    assert_non_null(side->arrays);
}

static void side_close(Side *side) {
    device_free(side->batch->device, side->arrays);
    mild_batch_destroy(side->batch);
}

static void side_copy(const Side *side, void *to, const void *from, size_t bytes) {
    MildError error = {0};
    assert_int_equal(device_copy(side->batch->device, to, from, bytes, &error), MILD_OK);
}

/* Poisons the results, steps, and fetches all. over: bool, wrenches and twists go over the input,
 * and nothing else is asked for. */
static void side_step(const Side *side, Arrays *a, int advance, int over) {
    MildError error = {0};
    Arrays *d = side->arrays;
    memset(a->wrench, 0xff, sizeof *a - offsetof(Arrays, wrench));
    side_copy(side, d, a, sizeof *a);
    const MildBatchInput input = {d->position,      d->rotation, d->velocity, d->inverse_inertia,
                                  d->free_velocity, d->material, d->height,   NULL};
    const MildBatchOutput all = {d->wrench,   d->after,    d->foot,
                                 d->elements, d->residual, d->iterations};
    const MildBatchOutput two = {d->velocity, d->free_velocity, NULL, NULL, NULL, NULL};
    assert_int_equal(
        mild_batch_step(side->batch, &input, over ? &two : &all, advance, NULL, &error), MILD_OK);
    side_copy(side, a, d, sizeof *a);
}

/* ---- errors ---- */

static double apart(const float *a, const float *b, int count, double scale) {
    double sum = 0.0, size = 0.0;
    for (int i = 0; i < count; i++) {
        sum += ((double)a[i] - b[i]) * ((double)a[i] - b[i]);
        size += (double)b[i] * b[i];
    }
    return sqrt(sum) / (sqrt(size) + scale);
}

/* Forces and moments against the kits'. */
static void against_ground(Errors *errors) {
    for (int r = 0; r < ROBOTS; r++) {
        const int feet = kits[r].feet;
        float wanted[ROWS];
        if (!kits[r].result.converged || kits[r].result.iterations > 15) {
            continue;
        }
        for (int f = 0; f < feet; f++) {
            to_float(wanted + 6 * f, kits[r].result.foot[f].force, 3);
            to_float(wanted + 6 * f + 3, kits[r].result.foot[f].torque, 3);
        }
        errors->error[errors->count++] = apart(arrays.wrench + 6 * feet * r, wanted, 6 * feet, 1.0);
    }
}

/* All results against those of the version for all feet. */
static void against_rows(Errors *errors) {
    for (int r = 0; r < ROBOTS; r++) {
        const int feet = kits[r].feet, rows = 6 * feet, elements = 4 * feet * ELEMENTS;
        const double each[4] = {
            apart(arrays.wrench + rows * r, other.wrench + rows * r, rows, 1.0),
            apart(arrays.after + rows * r, other.after + rows * r, rows, 0.1),
            apart((const float *)&arrays.foot[feet * r], (const float *)&other.foot[feet * r], rows,
                  0.1),
            apart(arrays.elements + elements * r, other.elements + elements * r, elements, 1.0)};
        double worst = 0.0;
        for (int i = 0; i < 4; i++) {
            worst = each[i] > worst || isnan(each[i]) ? each[i] : worst;
        }
        errors->error[errors->count++] = worst;
        assert_true(arrays.residual[r] >= 0.0f);
    }
}

static void check_errors(const char *name, const char *what, Errors *errors, double median,
                         double most) {
    qsort(errors->error, (size_t)errors->count, sizeof *errors->error, ascending);
    const double middle = errors->error[errors->count / 2];
    const double high = errors->error[errors->count * 99 / 100];
    print_message("%-28s %-10s %d: median %.1e, 99 %% %.1e, worst %.1e\n", name, what,
                  errors->count, middle, high, errors->error[errors->count - 1]);
    assert_true(middle < median && high < most); /* or not a number */
}

/* In the air nothing acts, and the feet move on. */
static void check_air(void) {
    for (int r = 0; r < ROBOTS; r++) {
        const int rows = 6 * kits[r].feet;
        for (int i = 0; i < rows && in_air(r); i++) {
            assert_true(arrays.wrench[rows * r + i] == 0.0f);
            assert_true(arrays.after[rows * r + i] == arrays.free_velocity[rows * r + i]);
            assert_true(arrays.iterations[r] == 0 && arrays.residual[r] == 0.0f);
        }
    }
}

/* The version for points does not read what A has for moments: it is not a number here. */
static void fill_moments(int rows) {
    for (int i = 0; i < ROBOTS * rows * rows; i++) {
        const int moment = i / rows % rows % 6 >= 3 || i % rows % 6 >= 3;
        arrays.inverse_inertia[i] = moment ? NAN : arrays.inverse_inertia[i];
    }
}

/* On a material that does not exist: the wrench of a robot that touches it is not a number. */
static void check_no_material(const Side *side) {
    int touch = 0;
    for (int i = 0; i < ROBOTS * LABELS; i++) {
        arrays.material[i] = LABELS;
    }
    side_step(side, &arrays, 0, 0);
    for (int r = 0; r < ROBOTS; r++) {
        const int rows = 6 * kits[r].feet;
        int number = 1;
        for (int i = 0; i < rows; i++) {
            number = number && isfinite(arrays.wrench[rows * r + i]);
        }
        assert_true(number == in_air(r) || kits[r].result.iterations == 0);
        touch += !number;
    }
    assert_true(touch > ROBOTS / 2);
}

/* ---- tests ---- */

/* A walk of all robots; both sides move on with the kits. */
static void walk_on(const Walk *walk, int device) {
    static Errors ground, rows;
    uint64_t random = 7;
    MildSole *sole = kit_plate(2, 4);
    MildMaterial materials[LABELS];
    MildMapDef def = shape(walk->kind, 0.02, 0.5);
    Side alone, all;
    int steps = 0, other_steps = 0;
    def.patches = MILD_PATTERN_CHECKER;
    def.patch_size = 0.11;
    def.patch_count = LABELS;
    MildMap *map = walk->map ? make_map(&def) : NULL;
    materials_of(walk, sole, materials);
    robots_open(walk, sole, materials, map, &random);
    side_open(&alone, walk, sole, materials, map, device, 1);
    side_open(&all, walk, sole, materials, map, device, 0);
    ground.count = rows.count = 0;
    for (int s = 0; s < STEPS; s++) {
        robots_solve(&arrays, &random);
        side_step(&all, &arrays, 1, 0);
        other = arrays;
        side_step(&alone, &arrays, 0, 1);
        static Arrays over;
        over = arrays;
        memcpy(arrays.velocity, other.velocity, sizeof arrays.velocity);
        memcpy(arrays.free_velocity, other.free_velocity, sizeof arrays.free_velocity);
        fill_moments(6 * walk->feet);
        side_step(&alone, &arrays, 1, 0);
        const size_t bytes = ROBOTS * 6 * (size_t)walk->feet * sizeof(float);
        assert_memory_equal(over.velocity, arrays.wrench, bytes);
        assert_memory_equal(over.free_velocity, arrays.after, bytes);
        against_ground(&ground);
        against_rows(&rows);
        check_air();
        for (int r = 0; r < ROBOTS; r++) {
            steps += arrays.iterations[r];
            other_steps += other.iterations[r];
            kit_advance(&kits[r]);
        }
    }
    if (!walk->limit) {
        check_errors(walk->name, "the ground", &ground, 2e-5, 3e-2);
    }
    check_errors(walk->name, "all rows", &rows, 5e-6, 1e-2);
    print_message("%d Newton steps in the place of %d\n", steps, other_steps);
    assert_true(steps > 0 && abs(steps - other_steps) <= 2 + other_steps / 100);
    check_no_material(&alone);
    side_close(&alone);
    side_close(&all);
    for (int r = 0; r < ROBOTS; r++) {
        kit_close(&kits[r]);
    }
    mild_map_destroy(map);
    mild_sole_destroy(sole);
}

TEST(results_are_the_same) {
    for (int device = MILD_BATCH_HOST; device <= 0; device++) {
        if (device >= 0 && !has_device()) {
            continue;
        }
        for (int i = 0; i < WALKS; i++) {
            walk_on(&walks[i], device);
        }
    }
}

TEST_MAIN(NULL, NULL)
