/* mild/batch.h on the CPU and, where there is one, on a GPU: against mild/ground.h, against each
 * other, and what it refuses. */
#include "batch_kit.h"
#include "device/device.h"
#include "ground/map_kit.h"
#include "ground/state.h"
#include "ground/surface_kit.h"

#ifdef MILD_CUDA
#include <cuda_runtime_api.h>
#endif

enum { ROBOTS = 96, STEPS = 30, MATERIALS = 12, LABELS = 3, ROWS = 6 * MILD_FEET_MAX };

static MildSole *left, *right, *center, *plate;

static int open_soles(void **state) {
    (void)state;
    left = kit_sole(0, 77);
    right = kit_sole(1, 77);
    center = mild_sole_concentric(left, NULL);
    plate = kit_plate(4, 5);
    return 0;
}

static int close_soles(void **state) {
    (void)state;
    MildSole *const all[] = {left, right, center, plate};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        mild_sole_destroy(all[i]);
    }
    return 0;
}

/* ---- robots that walk at random, by mild/ground.h ---- */

typedef struct {
    const char *name;
    int feet;
    MildModel model;
    MildMapKind kind; /* flat without a pattern: no map */
    MildPattern pattern;
} Shape;

static const Shape shapes[] = {
    {"two feet", 2, MILD_MODEL_MILD, MILD_MAP_FLAT, MILD_PATTERN_NONE},
    {"one foot", 1, MILD_MODEL_MILD, MILD_MAP_FLAT, MILD_PATTERN_NONE},
    {"four feet", 4, MILD_MODEL_MILD, MILD_MAP_FLAT, MILD_PATTERN_NONE},
    {"three feet", 3, MILD_MODEL_MILD, MILD_MAP_FLAT, MILD_PATTERN_NONE},
    {"con_cone", 2, MILD_MODEL_CON_CONE, MILD_MAP_FLAT, MILD_PATTERN_NONE},
    {"ecc_spring", 2, MILD_MODEL_ECC_SPRING, MILD_MAP_FLAT, MILD_PATTERN_NONE},
    {"ecc_quasi", 2, MILD_MODEL_ECC_QUASI, MILD_MAP_FLAT, MILD_PATTERN_NONE},
    {"ecc_quasi_3d", 2, MILD_MODEL_ECC_QUASI_3D, MILD_MAP_FLAT, MILD_PATTERN_NONE},
    {"bekker", 2, MILD_MODEL_BEKKER, MILD_MAP_FLAT, MILD_PATTERN_NONE},
    {"hunt_crossley", 2, MILD_MODEL_HUNT_CROSSLEY, MILD_MAP_FLAT, MILD_PATTERN_NONE},
    {"rough, checker", 2, MILD_MODEL_MILD, MILD_MAP_ROUGH, MILD_PATTERN_CHECKER},
    {"slope", 1, MILD_MODEL_MILD, MILD_MAP_SLOPE, MILD_PATTERN_NONE},
    {"four feet on steps", 4, MILD_MODEL_MILD, MILD_MAP_STEPS, MILD_PATTERN_NONE},
    {"stripes", 3, MILD_MODEL_MILD, MILD_MAP_FLAT, MILD_PATTERN_STRIPES},
    {"mixed, checker", 2, MILD_MODEL_MILD, MILD_MAP_MIXED, MILD_PATTERN_CHECKER},
    {"con_cone on waves", 2, MILD_MODEL_CON_CONE, MILD_MAP_WAVES, MILD_PATTERN_CHECKER},
    {"ecc_quasi on waves", 2, MILD_MODEL_ECC_QUASI, MILD_MAP_WAVES, MILD_PATTERN_CHECKER},
    {"ecc_quasi_3d, one foot, rough", 1, MILD_MODEL_ECC_QUASI_3D, MILD_MAP_ROUGH,
     MILD_PATTERN_NONE},
    {"bekker, four feet on waves", 4, MILD_MODEL_BEKKER, MILD_MAP_WAVES, MILD_PATTERN_CHECKER},
    {"hunt_crossley on waves", 2, MILD_MODEL_HUNT_CROSSLEY, MILD_MAP_WAVES, MILD_PATTERN_CHECKER},
    {"mild_merged", 2, MILD_MODEL_MILD_MERGED, MILD_MAP_FLAT, MILD_PATTERN_NONE},
    {"mild_merged, one foot on a slope", 1, MILD_MODEL_MILD_MERGED, MILD_MAP_SLOPE,
     MILD_PATTERN_NONE},
    {"mild_merged, rough, checker", 2, MILD_MODEL_MILD_MERGED, MILD_MAP_ROUGH,
     MILD_PATTERN_CHECKER},
    {"mild_merged, four feet", 4, MILD_MODEL_MILD_MERGED, MILD_MAP_FLAT, MILD_PATTERN_NONE},
};
/* Steps that are compared: all, or the first half, in which feet come down, where MILD_TEST_DRAWS
 * is set. */
static int some_steps(void) {
    const int some = kit_draws(STEPS);
    return some < STEPS / 2 ? STEPS / 2 : some;
}

/* Those that further tests take. */
static const Shape *const level = &shapes[0];
static const Shape *const uneven = &shapes[10];
static const Shape *const worn = &shapes[20];
enum { SHAPES = sizeof shapes / sizeof *shapes };

typedef struct {
    int feet;
    const MildSole *soles[MILD_FEET_MAX];
    MildMaterial material[MATERIALS];
    MildMap *map; /* or NULL */
    int labels;
    Kit kit[ROBOTS];
    uint64_t random;
} Herd;

/* What goes to a batch and what comes back, of all robots. */
typedef struct {
    float position[ROBOTS * 3 * MILD_FEET_MAX], rotation[ROBOTS * 9 * MILD_FEET_MAX];
    float velocity[ROBOTS * ROWS], inverse_inertia[ROBOTS * ROWS * ROWS];
    float free_velocity[ROBOTS * ROWS], height[ROBOTS], map_origin[2 * ROBOTS];
    int32_t material[ROBOTS * LABELS];
    float wrench[ROBOTS * ROWS], after[ROBOTS * ROWS], residual[ROBOTS];
    int32_t iterations[ROBOTS];
    MildBatchFoot foot[ROBOTS * MILD_FEET_MAX];
    float elements[ROBOTS * 4 * MILD_FEET_MAX * 256];
    uint8_t which[ROBOTS];
} Arrays;

/* The material of a label under a robot. */
static int material_of(int robot, int label) {
    return (robot + 5 * label) % MATERIALS;
}

static MildMap *herd_map(const Shape *of, int *labels) {
    MildMapDef def = shape(of->kind, 0.03, 0.5);
    def.size = of->kind == MILD_MAP_MIXED ? 10.0 : 4.0;
    def.slope = 0.2;
    def.patches = (int)of->pattern;
    def.patch_size = 0.11;
    def.patch_count = LABELS;
    *labels = of->pattern == MILD_PATTERN_NONE ? 1 : LABELS;
    return of->kind == MILD_MAP_FLAT && *labels == 1 ? NULL : make_map(&def);
}

/* Puts robot r somewhere on the map. */
static void herd_place(Herd *herd, int r) {
    Kit *kit = &herd->kit[r];
    kit->terrain.map = herd->map;
    kit->terrain.map_x = (double)(r % 16) / 8.0;
    kit->terrain.map_y = (double)(r % 7) / -4.0;
    kit->terrain.material_count = herd->labels;
    for (int label = 0; label < herd->labels; label++) {
        kit->terrain.materials[label] = herd->material[material_of(r, label)];
    }
    for (int f = 0; f < kit->feet; f++) {
        double *at = kit->input.position[f];
        at[2] += mild_terrain_height_at(&kit->terrain, at[0], at[1]) - kit->terrain.height;
    }
}

static void herd_open(Herd *herd, const Shape *shape) {
    static const double heights[3] = {0.0, 0.3, -0.2};
    const int concentric = mild_model_is_concentric(shape->model);
    herd->feet = shape->feet;
    herd->random = 5;
    herd->map = herd_map(shape, &herd->labels);
    for (int f = 0; f < shape->feet; f++) {
        herd->soles[f] = concentric ? center : shape->feet > 2 ? plate : f ? right : left;
    }
    for (int m = 0; m < MATERIALS; m++) {
        herd->material[m] = kit_material(&herd->random);
        if (shape->model != MILD_MODEL_MILD) {
            MildMaterial sand;
            mild_material_preset(mild_material_preset_name(m % mild_material_preset_count()),
                                 &sand);
            assert_int_equal(
                mild_model_match(shape->model, &sand, left, 150.0, &herd->material[m], NULL),
                MILD_OK);
        }
        if (shape->model == MILD_MODEL_MILD_MERGED && m % 2) { /* slip costs support */
            herd->material[m].slip_length = 1e-3 * (1 + m);
            herd->material[m].grip = m % 4 > 1 ? 0.2 : 0.0;
            herd->material[m].slip_growth = m % 8 > 3 ? 0.08 : 0.0;
        }
    }
    for (int r = 0; r < ROBOTS; r++) {
        Kit *kit = &herd->kit[r];
        kit_open(kit, shape->feet, (MildSole *)herd->soles[0],
                 (MildSole *)herd->soles[shape->feet > 1], &herd->material[r % MATERIALS], 5e-3);
        kit_random_state(kit, &herd->random);
        kit->terrain.height = heights[r % 3];
        for (int f = 0; f < kit->feet; f++) {
            kit->input.position[f][2] += heights[r % 3] + 0.01;
            kit->mass[f] = kit_uniform(&herd->random, 3.0, 40.0);
            kit->inertia[f] = kit->mass[f] * kit_uniform(&herd->random, 0.02, 0.1);
        }
        herd_place(herd, r);
    }
}

static void herd_close(Herd *herd) {
    for (int r = 0; r < ROBOTS; r++) {
        kit_close(&herd->kit[r]);
    }
    mild_map_destroy(herd->map);
}

/* Solves the next step of all robots by mild/ground.h, and hands the problem over. */
static void herd_solve(Herd *herd, Arrays *a) {
    const int feet = herd->feet, rows = 6 * feet;
    for (int r = 0; r < ROBOTS; r++) {
        Kit *kit = &herd->kit[r];
        double force[MILD_FEET_MAX][3];
        for (int f = 0; f < feet; f++) {
            for (int k = 0; k < 3; k++) {
                force[f][k] = kit->mass[f] * kit_uniform(&herd->random, -4, k == 2 ? 8 : 4);
            }
        }
        kit_inverse_inertia(kit);
        kit_free(kit, (const double(*)[3])force);
        kit_solve(kit);
        to_float(a->position + r * 3 * feet, kit->input.position[0], 3 * feet);
        to_float(a->rotation + r * 9 * feet, kit->input.rotation[0], 9 * feet);
        to_float(a->velocity + r * rows, kit->input.velocity[0], rows);
        to_float(a->inverse_inertia + r * rows * rows, kit->input.inverse_inertia, rows * rows);
        to_float(a->free_velocity + r * rows, kit->input.free_velocity, rows);
        a->height[r] = (float)kit->terrain.height;
        a->map_origin[2 * r] = (float)kit->terrain.map_x;
        a->map_origin[2 * r + 1] = (float)kit->terrain.map_y;
        for (int label = 0; label < herd->labels; label++) {
            a->material[r * herd->labels + label] = material_of(r, label);
        }
    }
}

static void herd_advance(Herd *herd) {
    for (int r = 0; r < ROBOTS; r++) {
        kit_advance(&herd->kit[r]);
    }
}

/* ---- a batch whose arrays lie on its device ---- */

typedef struct {
    MildBatch *batch;
    Arrays *arrays; /* on the device */
} Side;

static void side_open(Side *side, const Herd *herd, int device) {
    MildError error = {0};
    const MildBatchDef def = {
        .robots = ROBOTS, .feet = herd->feet, .soles = herd->soles, .dt = 5e-3, .device = device};
    side->batch = mild_batch_create(&def, &error);
    if (!side->batch || mild_batch_set_materials(side->batch, herd->material, MATERIALS, &error) ||
        mild_batch_set_map(side->batch, herd->map, &error)) {
        fail_msg("%s", error.text);
    }
    side->arrays = device == MILD_BATCH_HOST ? calloc(1, sizeof(Arrays))
                                             : device_alloc(device, sizeof(Arrays), &error);
    assert_non_null(side->arrays);
}

static void side_copy(const Side *side, void *to, const void *from, size_t bytes) {
    MildError error = {0};
    if (side->batch->device == MILD_BATCH_HOST) {
        memcpy(to, from, bytes);
    } else if (device_copy(side->batch->device, to, from, bytes, &error) != MILD_OK) {
        fail_msg("%s", error.text);
    }
}

static void side_close(Side *side) {
    if (side->batch->device == MILD_BATCH_HOST) {
        free(side->arrays);
    } else {
        device_free(side->batch->device, side->arrays);
    }
    mild_batch_destroy(side->batch);
}

static MildBatchInput input_of(const Arrays *d) {
    return (MildBatchInput){d->position,      d->rotation, d->velocity, d->inverse_inertia,
                            d->free_velocity, d->material, d->height,   d->map_origin};
}

/* Poisons the results, steps, and fetches all. */
static void side_step(Side *side, Arrays *a, int advance) {
    MildError error = {0};
    memset(a->wrench, 0xff, sizeof *a - offsetof(Arrays, wrench));
    side_copy(side, side->arrays, a, sizeof *a);
    Arrays *d = side->arrays;
    const MildBatchInput input = input_of(d);
    const MildBatchOutput output = {d->wrench,   d->after,    d->foot,
                                    d->elements, d->residual, d->iterations};
    expect_good(mild_batch_step(side->batch, &input, &output, advance, NULL, &error) == MILD_OK,
                &error);
    side_copy(side, a, side->arrays, sizeof *a);
}

/* ---- errors ---- */

typedef struct {
    int count;
    double error[ROBOTS * STEPS * SHAPES];
} Errors;

static void add_error(Errors *errors, const double *found, const double *wanted, int count) {
    double apart = 0.0, size = 0.0;
    for (int i = 0; i < count; i++) {
        apart += (found[i] - wanted[i]) * (found[i] - wanted[i]);
        size += wanted[i] * wanted[i];
    }
    errors->error[errors->count++] = sqrt(apart) / (sqrt(size) + 1.0);
}

static void check_errors(const char *name, Errors *errors, double median, double most) {
    qsort(errors->error, (size_t)errors->count, sizeof *errors->error, ascending);
    const double middle = errors->error[errors->count / 2];
    const double high = errors->error[errors->count * 99 / 100];
    print_message("%-36s %d steps: median %.1e, 99 %% %.1e, worst %.1e\n", name, errors->count,
                  middle, high, errors->error[errors->count - 1]);
    assert_true(middle < median && high < most); /* or not a number */
}

/* Forces of a step against the kits'. */
static void against_ground(Errors *errors, const Herd *herd, const Arrays *a) {
    for (int r = 0; r < ROBOTS; r++) {
        double found[3 * MILD_FEET_MAX], wanted[3 * MILD_FEET_MAX];
        if (!herd->kit[r].result.converged || herd->kit[r].result.iterations > 15) {
            continue;
        }
        for (int i = 0; i < 3 * herd->feet; i++) {
            found[i] = a->wrench[6 * herd->feet * r + i / 3 * 6 + i % 3];
            wanted[i] = herd->kit[r].result.foot[i / 3].force[i % 3];
        }
        add_error(errors, found, wanted, 3 * herd->feet);
    }
}

static void against_other(Errors *errors, int feet, const Arrays *a, const Arrays *b) {
    for (int r = 0; r < ROBOTS; r++) {
        double found[ROWS], wanted[ROWS];
        for (int i = 0; i < 6 * feet; i++) {
            found[i] = a->wrench[6 * feet * r + i];
            wanted[i] = b->wrench[6 * feet * r + i];
        }
        add_error(errors, found, wanted, 6 * feet);
        assert_true(a->iterations[r] >= 0 && a->iterations[r] <= 20);
        assert_true(a->residual[r] >= 0.0f);
    }
}

/* ---- tests ---- */

static Herd herd;
static Arrays arrays, other;

TEST(steps_are_those_of_the_ground) {
    for (int device = MILD_BATCH_HOST; device <= 0; device++) {
        if (device >= 0 && !has_device()) {
            continue;
        }
        for (int i = 0; i < SHAPES; i++) {
            static Errors errors;
            Side side;
            errors.count = 0;
            herd_open(&herd, &shapes[i]);
            side_open(&side, &herd, device);
            for (int s = 0; s < some_steps(); s++) {
                herd_solve(&herd, &arrays);
                side_step(&side, &arrays, 0);
                const float once = arrays.wrench[2];
                side_step(&side, &arrays, 1); /* a step without `advance` leaves no trace */
                assert_memory_equal(&once, &arrays.wrench[2], sizeof once);
                against_ground(&errors, &herd, &arrays);
                herd_advance(&herd);
            }
            check_errors(shapes[i].name, &errors, 2e-5, 3e-2);
            side_close(&side);
            herd_close(&herd);
        }
    }
}

TEST(device_and_host_agree) {
    if (!has_device()) {
        skip();
    }
    for (int i = 0; i < SHAPES; i++) {
        static Errors errors;
        Side host, device, again;
        errors.count = 0;
        herd_open(&herd, &shapes[i]);
        side_open(&host, &herd, MILD_BATCH_HOST);
        side_open(&device, &herd, 0);
        side_open(&again, &herd, 0);
        for (int s = 0; s < some_steps(); s++) {
            herd_solve(&herd, &arrays);
            side_step(&again, &arrays, 1);
            other = arrays;
            side_step(&device, &arrays, 1);
            assert_memory_equal(arrays.wrench, other.wrench, sizeof arrays.wrench);
            assert_memory_equal(arrays.after, other.after, sizeof arrays.after);
            side_step(&host, &other, 1);
            against_other(&errors, herd.feet, &arrays, &other);
            herd_advance(&herd);
        }
        check_errors(shapes[i].name, &errors, 1e-5, 3e-2);
        side_close(&host);
        side_close(&device);
        side_close(&again);
        herd_close(&herd);
    }
}

/* Twenty steps of all robots by the kits and by a batch, and the problem of the next. */
static void walk_together(Side *walked) {
    for (int s = 0; s < 20; s++) {
        herd_solve(&herd, &arrays);
        side_step(walked, &arrays, 1);
        herd_advance(&herd);
    }
    herd_solve(&herd, &arrays);
}

/* After a reset of some they step as on untouched ground, the others as without it. */
static void reset_on(const Shape *shape, int device) {
    MildError error = {0};
    Side walked, fresh;
    herd_open(&herd, shape);
    side_open(&walked, &herd, device);
    side_open(&fresh, &herd, device);
    walk_together(&walked);
    side_step(&walked, &arrays, 0);
    static Arrays before;
    before = arrays;
    side_step(&fresh, &arrays, 0);
    other = arrays;
    for (int r = 0; r < ROBOTS; r++) {
        arrays.which[r] = r % 3 == 0;
    }
    side_copy(&walked, walked.arrays->which, arrays.which, sizeof arrays.which);
    assert_int_equal(mild_batch_reset(walked.batch, walked.arrays->which, NULL, &error), MILD_OK);
    side_step(&walked, &arrays, 0);
    for (int r = 0; r < ROBOTS; r++) {
        const Arrays *wanted = r % 3 == 0 ? &other : &before;
        assert_memory_equal(arrays.wrench + 12 * r, wanted->wrench + 12 * r, 12 * sizeof(float));
    }
    /* and all forget when the map is set, the same or another */
    assert_int_equal(mild_batch_set_map(walked.batch, NULL, &error), MILD_OK);
    assert_int_equal(mild_batch_set_map(walked.batch, herd.map, &error), MILD_OK);
    side_step(&walked, &arrays, 0);
    assert_memory_equal(arrays.wrench, other.wrench, sizeof(float) * 12 * ROBOTS);
    side_close(&walked);
    side_close(&fresh);
    herd_close(&herd);
}

/* The memory of a ground is that of a batch that walked with it. */
static void load_on(const Shape *shape, int device) {
    MildError error = {0};
    Side walked, one, many;
    const MildGround *grounds[ROBOTS];
    static Errors errors;
    errors.count = 0;
    herd_open(&herd, shape);
    side_open(&walked, &herd, device);
    side_open(&one, &herd, device);
    side_open(&many, &herd, device);
    walk_together(&walked);
    for (int r = 0; r < ROBOTS; r++) {
        grounds[r] = herd.kit[r].ground;
        assert_int_equal(mild_batch_load(one.batch, r, grounds[r], &error), MILD_OK);
    }
    side_step(&one, &arrays, 0);
    other = arrays;
    against_ground(&errors, &herd, &arrays);
    check_errors("loaded", &errors, 2e-5, 3e-2);
    assert_int_equal(mild_batch_load_robots(many.batch, 1, ROBOTS - 1, grounds + 1, &error),
                     MILD_OK);
    assert_int_equal(mild_batch_load_robots(many.batch, 0, 1, grounds, &error), MILD_OK);
    side_step(&many, &arrays, 0);
    assert_memory_equal(arrays.wrench, other.wrench, sizeof(float) * 12 * ROBOTS);
    side_close(&walked);
    side_close(&one);
    side_close(&many);
    herd_close(&herd);
}

/* Memory of a foot's element e against another ground's, [m] and [-]. */
static double planes_apart(const MildGround *a, const MildGround *b, int f, int e) {
    const Memory m = ground_memory(a, f);
    const Memory n = ground_memory(b, f);
    assert_int_equal(a->uneven[f], b->uneven[f]);
    assert_int_equal(m.material[e] >= 0, m.depth_max[e] > 0.0);
    if (n.material[e] >= 0) {
        assert_int_equal(m.material[e], n.material[e]);
    }
    if (!a->uneven[f] || n.material[e] == MATERIAL_NONE) {
        return 0.0;
    }
    return fmax(fabs(m.plane[e] - n.plane[e]),
                fmax(fabs(m.slope_x[e] - n.slope_x[e]), fabs(m.slope_y[e] - n.slope_y[e])));
}

/* What a batch stores is what the grounds that walked with it remember, and they step on with it.
 * A float does not always determine the cell of a map, so some planes are those of the next one. */
static void store_on(const Shape *shape, int device) {
    MildError error = {0};
    Side walked, again;
    MildGround *grounds[ROBOTS];
    static Errors errors;
    int off = 0, planes = 0;
    errors.count = 0;
    herd_open(&herd, shape);
    side_open(&walked, &herd, device);
    side_open(&again, &herd, device);
    walk_together(&walked);
    for (int r = 0; r < ROBOTS; r++) {
        void *block = aligned_alloc(64, herd.kit[r].bytes);
        grounds[r] = mild_ground_init(block, herd.kit[r].soles, herd.feet);
    }
    assert_int_equal(mild_batch_store_robots(walked.batch, 0, ROBOTS - 1, grounds, &error),
                     MILD_OK);
    assert_int_equal(mild_batch_store(walked.batch, ROBOTS - 1, grounds[ROBOTS - 1], &error),
                     MILD_OK);
    side_step(&walked, &arrays, 0);
    other = arrays;
    for (int r = 0; r < ROBOTS; r++) {
        Kit *kit = &herd.kit[r];
        for (int n = 0; n < kit->feet * mild_sole_elements(kit->soles[0]); n++) {
            const double apart =
                planes_apart(grounds[r], kit->ground, n % kit->feet, n / kit->feet);
            off += apart > 1e-4;
            planes++;
        }
        mild_ground_solve(grounds[r], &kit->terrain, &kit->input, kit->scratch, &kit->result);
    }
    against_ground(&errors, &herd, &other);
    check_errors("stored", &errors, 2e-5, 3e-2);
    print_message("%d of %d planes off\n", off, planes);
    assert_true(off <= planes / 500);
    /* once more from there: the same bits on level ground, where nothing is counted from a place */
    assert_int_equal(
        mild_batch_load_robots(again.batch, 0, ROBOTS, (const MildGround *const *)grounds, &error),
        MILD_OK);
    side_step(&again, &arrays, 0);
    if (!herd.map) {
        assert_memory_equal(arrays.wrench, other.wrench, sizeof(float) * 12 * ROBOTS);
    }
    /* what they remember is forgotten in the air */
    for (int r = 0; r < ROBOTS; r++) {
        Kit *kit = &herd.kit[r];
        for (int f = 0; f < kit->feet; f++) {
            kit->input.position[f][2] += 1.0;
        }
        mild_ground_solve(grounds[r], &kit->terrain, &kit->input, kit->scratch, &kit->result);
        mild_ground_advance(grounds[r], &kit->terrain, &kit->input, kit->scratch, &kit->result);
        for (int n = 0; n < kit->feet * mild_sole_elements(kit->soles[0]); n++) {
            assert_true(mild_ground_depth_max(grounds[r], n % kit->feet)[n / kit->feet] == 0.0);
        }
        free(grounds[r]);
    }
    side_close(&walked);
    side_close(&again);
    herd_close(&herd);
}

TEST(reset_load_and_store) {
    for (int device = MILD_BATCH_HOST; device <= 0; device++) {
        if (device >= 0 && !has_device()) {
            continue;
        }
        const Shape *const some[] = {level, uneven, worn};
        for (int i = 0; i < 3; i++) {
            reset_on(some[i], device);
            load_on(some[i], device);
            store_on(some[i], device);
        }
    }
}

/* A robot whose materials are not in the table gets no numbers; the others are left alone. */
static void unknown_on(const Shape *shape, int device) {
    Side side;
    herd_open(&herd, shape);
    for (int r = 0; r < ROBOTS; r++) {
        herd.kit[r].input.position[0][2] -= 0.04; /* in the ground */
    }
    side_open(&side, &herd, device);
    herd_solve(&herd, &arrays);
    side_step(&side, &arrays, 0);
    other = arrays;
    for (int label = 0; label < herd.labels; label++) {
        arrays.material[3 * herd.labels + label] = MATERIALS;
        arrays.material[4 * herd.labels + label] = -1;
    }
    side_step(&side, &arrays, 0);
    for (int r = 0; r < ROBOTS; r++) {
        const float *wrench = arrays.wrench + 12 * r;
        if (r == 3 || r == 4) {
            assert_true(isnan(wrench[2]) && !isnan(other.wrench[12 * r + 2]));
        } else {
            assert_memory_equal(wrench, other.wrench + 12 * r, 12 * sizeof(float));
        }
    }
    side_close(&side);
    herd_close(&herd);
}

TEST(unknown_material) {
    for (int device = MILD_BATCH_HOST; device <= 0; device++) {
        if (device >= 0 && !has_device()) {
            continue;
        }
        unknown_on(level, device);
        unknown_on(uneven, device);
    }
}

#ifdef MILD_CUDA
/* A step neither allocates nor waits, so a graph captures it, and gives the same bits. */
TEST(step_is_captured) {
    if (!has_device()) {
        skip();
    }
    MildError error = {0};
    Side side;
    cudaStream_t stream;
    cudaGraph_t graph;
    cudaGraphExec_t ready;
    herd_open(&herd, uneven);
    side_open(&side, &herd, 0);
    herd_solve(&herd, &arrays);
    side_step(&side, &arrays, 0);
    other = arrays;
    memset(arrays.wrench, 0xff, sizeof arrays.wrench);
    side_copy(&side, side.arrays, &arrays, sizeof arrays);
    Arrays *d = side.arrays;
    const MildBatchInput input = input_of(d);
    const MildBatchOutput output = {d->wrench, d->after, NULL, NULL, NULL, NULL};
    assert_int_equal(cudaStreamCreate(&stream), cudaSuccess);
    assert_int_equal(cudaStreamBeginCapture(stream, cudaStreamCaptureModeGlobal), cudaSuccess);
    assert_int_equal(mild_batch_reset(side.batch, NULL, stream, &error), MILD_OK);
    assert_int_equal(mild_batch_step(side.batch, &input, &output, 1, stream, &error), MILD_OK);
    assert_int_equal(cudaStreamEndCapture(stream, &graph), cudaSuccess);
    assert_int_equal(cudaGraphInstantiate(&ready, graph, 0), cudaSuccess);
    for (int i = 0; i < 2; i++) { /* reset and step: the second is the first */
        assert_int_equal(cudaGraphLaunch(ready, stream), cudaSuccess);
    }
    assert_int_equal(cudaStreamSynchronize(stream), cudaSuccess);
    side_copy(&side, &arrays, side.arrays, sizeof arrays);
    assert_memory_equal(arrays.wrench, other.wrench, sizeof(float) * ROBOTS * 12);
    cudaGraphExecDestroy(ready);
    cudaGraphDestroy(graph);
    cudaStreamDestroy(stream);
    side_close(&side);
    herd_close(&herd);
}
#endif

static void refuse(const MildBatchDef *def, MildStatus status, const char *names) {
    MildError error = {0};
    assert_null(mild_batch_create(def, &error));
    assert_error(&error, status, names);
}

TEST(bad_input_is_refused) {
    const MildSole *soles[2] = {left, right};
    const MildBatchDef good = {
        .robots = 3, .feet = 2, .soles = soles, .dt = 5e-3, .device = MILD_BATCH_HOST};
    MildBatchDef def = good;
    def.robots = 0;
    refuse(&def, MILD_ERROR_RANGE, "robots 0");
    def = good;
    def.feet = 5;
    refuse(&def, MILD_ERROR_RANGE, "feet 5 1 4");
    def = good;
    def.dt = NAN;
    refuse(&def, MILD_ERROR_RANGE, "dt nan");
    def = good;
    def.tolerance = -1.0;
    refuse(&def, MILD_ERROR_RANGE, "tolerance -1");
    def = good;
    def.max_iterations = -1;
    refuse(&def, MILD_ERROR_RANGE, "max_iterations -1");
    def = good;
    def.device = -2;
    refuse(&def, MILD_ERROR_RANGE, "device -2");
    def.device = 1000;
    refuse(&def, MILD_ERROR_ARGUMENT, "device 1000");
    MildSole *large = kit_plate(13, 10);
    soles[1] = large;
    refuse(&good, MILD_ERROR_RANGE, "sole 130 128");
    mild_sole_destroy(large);
    const MildShape box = surface_box(0.1, 0.05, 0.03);
    MildSole *surface = surface_make(&box, 1, 0.05);
    soles[1] = surface;
    refuse(&good, MILD_ERROR_ARGUMENT, "sole 1 mild_sole_create");
    mild_sole_destroy(surface);
    soles[1] = right;

    MildError error = {0};
    MildBatch *batch = mild_batch_create(&good, &error);
    assert_non_null(batch);
    MildMaterial materials[2] = {mild_material_default(), mild_material_default()};
    materials[1].mu = -1.0;
    assert_int_equal(mild_batch_set_materials(batch, materials, 2, &error), MILD_ERROR_RANGE);
    assert_error(&error, MILD_ERROR_RANGE, "material 1 ground.mu -1");
    materials[1].model = MILD_MODEL_RIGID;
    assert_int_equal(mild_batch_set_materials(batch, materials, 2, &error), MILD_ERROR_RANGE);
    assert_error(&error, MILD_ERROR_RANGE, "material 1 ground.model rigid");
    materials[1] = mild_material_default();
    assert_true(mild_material_preset("snow", &materials[1]));
    assert_int_equal(mild_batch_set_materials(batch, materials, 2, &error), MILD_OK);
    assert_int_equal(mild_batch_set_materials(batch, materials, 0, &error), MILD_ERROR_RANGE);
    materials[1].k_c = -0.9 * mild_sole_width(right) * materials[1].k_phi;
    assert_int_equal(mild_batch_set_materials(batch, materials, 2, &error), MILD_OK);
    materials[1].k_c *= 1.2;
    assert_int_equal(mild_batch_set_materials(batch, materials, 2, &error), MILD_ERROR_RANGE);
    assert_error(&error, MILD_ERROR_RANGE, "material 1 ground.k_c ground.plate_width");
    materials[1].plate_width = 2 * mild_sole_width(right);
    assert_int_equal(mild_batch_set_materials(batch, materials, 2, &error), MILD_OK);

    assert_int_equal(mild_batch_robot_bytes(batch), 8 * 160 * sizeof(float));
    assert_int_equal(mild_batch_stride(batch), 80);
    mild_batch_destroy(batch);
    mild_batch_destroy(NULL);
}

/* Maps that a batch does not know, and what one adds to a robot's memory. */
static void check_maps(MildBatch *batch, const MildGround *good) {
    MildError e = {0};
    MildMapDef of = mild_map_def_default();
    of.patches = MILD_PATTERN_STRIPES;
    MildMap *sharp = make_map(&of);
    of.border = 0.2;
    MildMap *blended = make_map(&of);
    of.patches = MILD_PATTERN_NONE;
    MildMap *plain = make_map(&of);
    assert_refused(mild_batch_set_map(batch, blended, &e), MILD_ERROR_ARGUMENT, &e,
                   "terrain.border");
    assert_int_equal(mild_batch_robot_bytes(batch), 8 * 160 * sizeof(float));
    assert_int_equal(mild_batch_set_map(batch, sharp, &e), MILD_OK);
    assert_int_equal(mild_batch_robot_bytes(batch), (12 * 160 + 32) * sizeof(float));
    assert_int_equal(mild_batch_load(batch, 0, good, &e), MILD_OK);
    assert_int_equal(mild_batch_set_map(batch, plain, &e), MILD_OK);
    assert_int_equal(mild_batch_robot_bytes(batch), 8 * 160 * sizeof(float));
    mild_map_destroy(sharp);
    mild_map_destroy(blended);
    mild_map_destroy(plain);
}

/* What a ground remembers and a batch cannot, and maps that it does not know. */
TEST(strange_ground_is_refused) {
    const MildSole *soles[2] = {left, right};
    const MildMaterial sand = mild_material_default();
    const MildBatchDef def = {
        .robots = 3, .feet = 2, .soles = soles, .dt = 5e-3, .device = MILD_BATCH_HOST};
    MildError e = {0};
    MildBatch *batch = mild_batch_create(&def, &e);
    Kit one, prints, fits;
    kit_open(&one, 1, left, NULL, &sand, 5e-3);
    kit_open(&prints, 2, left, right, &sand, 5e-3);
    kit_open(&fits, 2, left, right, &sand, 5e-3);
    kit_prints(&prints, 8);
    fits.ground->faces = 1; /* as of surfaces with as many elements */
    assert_refused(mild_batch_load(batch, 0, fits.ground, &e), MILD_ERROR_ARGUMENT, &e, "robot 0");
    fits.ground->faces = 0;
    MildGround *good = fits.ground;
    assert_refused(mild_batch_load(batch, 0, one.ground, &e), MILD_ERROR_ARGUMENT, &e, "robot 0");
    assert_refused(mild_batch_load(batch, 1, prints.ground, &e), MILD_ERROR_ARGUMENT, &e,
                   "robot 1 mild_ground_init");
    assert_refused(mild_batch_load(batch, 3, good, &e), MILD_ERROR_RANGE, &e, "robot 3 0 2");
    assert_refused(mild_batch_store(batch, 0, one.ground, &e), MILD_ERROR_ARGUMENT, &e, "robot 0");
    assert_refused(mild_batch_store(batch, 1, prints.ground, &e), MILD_ERROR_ARGUMENT, &e,
                   "robot 1 mild_ground_init");
    assert_refused(mild_batch_store(batch, -1, good, &e), MILD_ERROR_RANGE, &e, "robot -1 0 2");
    MildGround *three[3] = {good, good, one.ground};
    const MildGround *const *const grounds = (const MildGround *const *)three;
    assert_refused(mild_batch_load_robots(batch, 1, 3, grounds, &e), MILD_ERROR_RANGE, &e,
                   "robots 3 1");
    assert_refused(mild_batch_store_robots(batch, 1, -1, three, &e), MILD_ERROR_RANGE, &e,
                   "robots -1 1 3");
    assert_refused(mild_batch_load_robots(batch, 0, 3, grounds, &e), MILD_ERROR_ARGUMENT, &e,
                   "robot 2");
    assert_int_equal(mild_batch_load_robots(batch, 1, 2, grounds, &e), MILD_OK);
    assert_int_equal(mild_batch_store_robots(batch, 3 - 1, 0, three, &e), MILD_OK);

    good->uneven[1] = 1;
    assert_refused(mild_batch_load(batch, 0, good, &e), MILD_ERROR_ARGUMENT, &e,
                   "robot 0 mild_batch_set_map");
    good->uneven[1] = 0;
    const Memory memory = ground_memory(good, 1);
    memory.material[4] = 1;
    assert_refused(mild_batch_load(batch, 0, good, &e), MILD_ERROR_ARGUMENT, &e,
                   "robot 0 material 1");
    memory.material[4] = 1 << 8 | 3 << 16;
    assert_refused(mild_batch_load(batch, 0, good, &e), MILD_ERROR_ARGUMENT, &e, "robot 0 mixture");
    memory.material[4] = 1;

    check_maps(batch, good);
    mild_batch_destroy(batch);
    kit_close(&one);
    kit_close(&prints);
    kit_close(&fits);
}

TEST_MAIN(open_soles, close_soles)
