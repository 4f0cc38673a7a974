/* Robots that walk at random by mild/ground.h, and a batch whose arrays lie on its device. */
#ifndef HERD_KIT_H
#define HERD_KIT_H

#include "batch_kit.h"
#include "ground/surface_kit.h"

enum { ROBOTS = 48, STEPS = 30, MATERIALS = 12, LABELS = 3, ROWS = 6 * MILD_FEET_MAX };

enum { SHELLS = 5 };

static MildSole *left, *right, *center, *plate, *small_plate, *shell[SHELLS];

/* A wheel that turns about y: a closed mesh of its rim and its two sides. */
static inline MildSole *make_wheel(double radius, double breadth) {
    enum { CORNERS = 24 };
    double vertices[2 * CORNERS + 2][3];
    int triangles[4 * CORNERS][3];
    for (int i = 0; i < CORNERS; i++) {
        const double turn = 2 * pi * i / CORNERS;
        const int next = (i + 1) % CORNERS;
        for (int side = 0; side < 2; side++) {
            double *at = vertices[2 * i + side];
            at[0] = radius * sin(turn);
            at[1] = (side - 0.5) * breadth;
            at[2] = radius * cos(turn);
        }
        const int all[4][3] = {{2 * i, 2 * next, 2 * i + 1},
                               {2 * i + 1, 2 * next, 2 * next + 1},
                               {2 * i, 2 * CORNERS, 2 * next},
                               {2 * i + 1, 2 * next + 1, 2 * CORNERS + 1}};
        memcpy(triangles[4 * i], all, sizeof all);
    }
    for (int side = 0; side < 2; side++) {
        double *at = vertices[2 * CORNERS + side];
        at[0] = at[2] = 0;
        at[1] = (side - 0.5) * breadth;
    }
    const MildShape wheel = {.type = MILD_SHAPE_MESH,
                             .vertices = *vertices,
                             .vertex_count = 2 * CORNERS + 2,
                             .triangles = *triangles,
                             .triangle_count = 4 * CORNERS};
    return surface_make(&wheel, 1, KIT_PITCH);
}

static inline int open_soles(void **state) {
    (void)state;
    left = kit_sole(0, 77);
    right = kit_sole(1, 77);
    center = mild_sole_concentric(left, NULL);
    plate = kit_plate(4, 5);
    small_plate = kit_plate(2, 4);
    const MildShape capsule = surface_capsule(0.04, 0.09), sphere = surface_sphere(0.07);
    MildShape shin = surface_box(0.05, 0.04, 0.1), base = surface_box(0.12, 0.08, 0.04);
    shin.pos[0] = 0.03; /* the frame's origin is not its middle */
    shin.pos[2] = -0.06;
    shell[0] = surface_make(&shin, 1, KIT_PITCH);
    shell[1] = surface_make(&capsule, 1, KIT_PITCH);
    shell[2] = make_wheel(0.08, 0.05);
    shell[3] = surface_make(&sphere, 1, KIT_PITCH);
    shell[4] = surface_make(&base, 1, KIT_PITCH);
    return 0;
}

static inline int close_soles(void **state) {
    (void)state;
    MildSole *const all[] = {left, right, center, plate, small_plate};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        mild_sole_destroy(all[i]);
    }
    for (int s = 0; s < SHELLS; s++) {
        mild_sole_destroy(shell[s]);
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
    int shells; /* of the feet: the last ones */
} Shape;

/* Steps that are compared: all, or the first half, in which feet come down, where MILD_TEST_DRAWS
 * is set. */
static inline int some_steps(void) {
    const int some = kit_draws(STEPS);
    return some < STEPS / 2 ? STEPS / 2 : some;
}

typedef struct {
    int feet, shells; /* of the feet */
    const MildSole *soles[MILD_FEET_MAX];
    MildMaterial material[MATERIALS];
    MildMap *map; /* or NULL */
    int labels;
    Kit kit[ROBOTS];
    int pushed; /* bool: by random forces, and shells hang together */
    int points; /* bool: small plates that transmit no moment; every eighth robot is in the air */
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
static inline int material_of(int robot, int label) {
    return (robot + 5 * label) % MATERIALS;
}

static inline MildMap *herd_map(const Shape *of, int *labels) {
    MildMapDef def = shape(of->kind, 0.03, 0.5);
    def.size = of->kind == MILD_MAP_MIXED ? 10.0 : 4.0;
    def.slope = 0.2;
    def.patches = (int)of->pattern;
    def.patch_size = 0.11;
    def.patch_count = LABELS;
    *labels = of->pattern == MILD_PATTERN_NONE ? 1 : LABELS;
    return of->kind == MILD_MAP_FLAT && *labels == 1 ? NULL : make_map(&def);
}

/* [m] From the origin of a shell to its farthest element. */
static inline double shell_radius(const MildSole *sole) {
    double most = 0;
    for (int e = 0; e < mild_sole_elements(sole); e++) {
        const double x = mild_sole_x(sole)[e], y = mild_sole_y(sole)[e];
        const double z = mild_sole_surface_z(sole)[e];
        most = fmax(most, sqrt(x * x + y * y + z * z));
    }
    return most;
}

/* Shells any way up, turning, a little above the ground or in it. Those of every fourth robot are
 * far away, and every second one of every other fourth. */
static inline void herd_throw(Herd *herd, int r) {
    Kit *kit = &herd->kit[r];
    for (int f = herd->feet - herd->shells; f < herd->feet; f++) {
        double R[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, turn[3];
        double *at = kit->input.position[f];
        const int away = r % 4 == 0 || (r % 4 == 1 && f % 2);
        kit_vector(&herd->random, 3, turn);
        kit_rotate(R, turn);
        memcpy(kit->input.rotation[f], R, sizeof R);
        kit_vector(&herd->random, 6, kit->input.velocity[f] + 3);
        at[0] = 0.3 * f;
        at[2] = kit_uniform(&herd->random, -0.03, 0.03) + 0.7 * shell_radius(kit->soles[f]) +
                (away ? 2 : 0);
    }
}

/* Bodies that hang together: a force on one moves all. */
static inline void herd_tie(Herd *herd, Kit *kit) {
    const int rows = 6 * kit->feet;
    double tie[6 * MILD_FEET_MAX];
    for (int i = 0; i < rows; i++) {
        tie[i] = kit_uniform(&herd->random, -0.1, 0.1);
    }
    for (int i = 0; i < rows * rows; i++) {
        kit->A[i] += tie[i / rows] * tie[i % rows];
    }
}

/* Puts robot r somewhere on the map. */
static inline void herd_place(Herd *herd, int r) {
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

/* Bool: a robot of points whose feet are in the air. */
static inline int in_air(int robot) {
    return robot % 8 == 7;
}

static inline void herd_open_as(Herd *herd, const Shape *shape, int points) {
    static const double heights[3] = {0.0, 0.3, -0.2};
    const int concentric = mild_model_is_concentric(shape->model);
    herd->feet = shape->feet;
    herd->shells = shape->shells;
    herd->random = 5;
    herd->pushed = 1;
    herd->points = points;
    herd->map = herd_map(shape, &herd->labels);
    for (int f = 0; f < shape->feet; f++) {
        const int planes = shape->feet - shape->shells;
        herd->soles[f] = f >= planes  ? shell[(f - planes) % SHELLS]
                         : points     ? small_plate
                         : concentric ? center
                         : planes > 2 ? plate
                         : f          ? right
                                      : left;
    }
    for (int m = 0; m < MATERIALS; m++) {
        herd->material[m] = kit_material(&herd->random);
        if (shape->model != MILD_MODEL_MILD) {
            MildMaterial sand;
            mild_material_preset(mild_material_preset_name(m % PAPER_PRESETS), &sand);
            assert_int_equal(
                mild_model_match(shape->model, &sand, left, 150.0, &herd->material[m], NULL),
                MILD_OK);
        }
        if (shape->model == MILD_MODEL_CON_SPRING) { /* not of a whole sole but of an element */
            herd->material[m].k_pen /= mild_sole_elements(left);
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
        if (shape->shells > 0) {
            kit_soles(kit, herd->soles);
        }
        kit_random_state(kit, &herd->random);
        kit->terrain.height = heights[r % 3];
        for (int f = 0; f < kit->feet; f++) {
            kit->input.position[f][2] += heights[r % 3] + (points && in_air(r) ? 5.0 : 0.01);
            kit->mass[f] = kit_uniform(&herd->random, 3.0, 40.0);
            kit->inertia[f] = kit->mass[f] * kit_uniform(&herd->random, 0.02, 0.1);
        }
        herd_throw(herd, r);
        herd_place(herd, r);
    }
}

static inline void herd_open(Herd *herd, const Shape *shape) {
    herd_open_as(herd, shape, 0);
}

static inline void herd_close(Herd *herd) {
    for (int r = 0; r < ROBOTS; r++) {
        kit_close(&herd->kit[r]);
    }
    mild_map_destroy(herd->map);
}

/* Solves the next step of all robots by mild/ground.h, and hands the problem over. */
static inline void herd_solve(Herd *herd, Arrays *a) {
    const int feet = herd->feet, rows = 6 * feet;
    for (int r = 0; r < ROBOTS; r++) {
        Kit *kit = &herd->kit[r];
        double force[MILD_FEET_MAX][3];
        for (int f = 0; f < feet; f++) {
            for (int k = 0; k < 3; k++) {
                const double push = kit_uniform(&herd->random, -4, k == 2 ? 8 : 4);
                force[f][k] = herd->pushed ? kit->mass[f] * push : 0;
            }
        }
        kit_inverse_inertia(kit);
        if (herd->pushed && herd->shells > 0) {
            herd_tie(herd, kit);
        }
        kit_free(kit, (const double(*)[3])force);
        if (herd->points) {
            kit_points(kit, &herd->random);
        }
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

static inline void herd_advance(Herd *herd) {
    for (int r = 0; r < ROBOTS; r++) {
        kit_advance(&herd->kit[r]);
    }
}

/* ---- the batch ---- */

typedef struct {
    MildBatch *batch;
    Arrays *arrays; /* on the device */
    int elements;   /* bool: they are asked for */
} Side;

/* def: dt and device, and what else is not the default. */
static inline void side_open_as(Side *side, const Herd *herd, MildBatchDef def) {
    MildError error = {0};
    def.robots = ROBOTS;
    def.feet = herd->feet;
    def.soles = herd->soles;
    side->batch = mild_batch_create(&def, &error);
    if (!side->batch || mild_batch_set_materials(side->batch, herd->material, MATERIALS, &error) ||
        mild_batch_set_map(side->batch, herd->map, &error)) {
        fail_msg("%s", error.text);
    }
    side->arrays = def.device == MILD_BATCH_HOST ? calloc(1, sizeof(Arrays))
                                                 : device_alloc(def.device, sizeof(Arrays), &error);
    assert_non_null(side->arrays);
    side->elements = herd->shells == 0;
}

static inline void side_open(Side *side, const Herd *herd, int device) {
    side_open_as(side, herd, (MildBatchDef){.dt = 5e-3, .device = device});
}

static inline void side_copy(const Side *side, void *to, const void *from, size_t bytes) {
    MildError error = {0};
    if (side->batch->device == MILD_BATCH_HOST) {
        memcpy(to, from, bytes);
    } else if (device_copy(side->batch->device, to, from, bytes, &error) != MILD_OK) {
        fail_msg("%s", error.text);
    }
}

static inline void side_close(Side *side) {
    if (side->batch->device == MILD_BATCH_HOST) {
        free(side->arrays);
    } else {
        device_free(side->batch->device, side->arrays);
    }
    mild_batch_destroy(side->batch);
}

static inline MildBatchInput input_of(const Arrays *d) {
    return (MildBatchInput){d->position,      d->rotation, d->velocity, d->inverse_inertia,
                            d->free_velocity, d->material, d->height,   d->map_origin};
}

/* Poisons the results, steps, and fetches all. */
static inline void side_step(Side *side, Arrays *a, int advance) {
    MildError error = {0};
    memset(a->wrench, 0xff, sizeof *a - offsetof(Arrays, wrench));
    side_copy(side, side->arrays, a, sizeof *a);
    Arrays *d = side->arrays;
    const MildBatchInput input = input_of(d);
    const MildBatchOutput output = {d->wrench,   d->after,
                                    d->foot,     side->elements ? d->elements : NULL,
                                    d->residual, d->iterations};
    expect_good(mild_batch_step(side->batch, &input, &output, advance, NULL, &error) == MILD_OK,
                &error);
    side_copy(side, a, side->arrays, sizeof *a);
}

/* ---- errors ---- */

typedef struct {
    int count;
    double error[ROBOTS * STEPS];
} Errors;

static inline void add_error(Errors *errors, const double *found, const double *wanted, int count) {
    double apart = 0.0, size = 0.0;
    for (int i = 0; i < count; i++) {
        apart += (found[i] - wanted[i]) * (found[i] - wanted[i]);
        size += wanted[i] * wanted[i];
    }
    errors->error[errors->count++] = sqrt(apart) / (sqrt(size) + 1.0);
}

static inline void check_errors(const char *name, Errors *errors, double median, double most) {
    qsort(errors->error, (size_t)errors->count, sizeof *errors->error, ascending);
    const double middle = errors->error[errors->count / 2];
    const double high = errors->error[errors->count * 99 / 100];
    print_message("%-36s %d steps: median %.1e, 99 %% %.1e, worst %.1e\n", name, errors->count,
                  middle, high, errors->error[errors->count - 1]);
    assert_true(middle < median && high < most); /* or not a number */
}

/* Bool: mild/ground.h needed no more than plain steps. */
static inline int is_plain(const Kit *kit) {
    return kit->result.converged && kit->result.iterations <= 15;
}

/* After herd_advance: where the ground needed more than plain steps it remembers another step. */
static inline void side_follow(Side *side, const Herd *herd) {
    MildError error = {0};
    for (int r = 0; r < ROBOTS; r++) {
        const Kit *kit = &herd->kit[r];
        if (!is_plain(kit) && mild_batch_load(side->batch, r, kit->ground, &error) != MILD_OK) {
            fail_msg("%s", error.text);
        }
    }
}

/* The other results of a step. */
static inline void all_against_ground(Errors *twists, Errors *moments, Errors *reports,
                                      const Herd *herd, const Arrays *a) {
    const int feet = herd->feet, rows = 6 * feet;
    for (int r = 0; r < ROBOTS; r++) {
        const MildContactResult *result = &herd->kit[r].result;
        double twist[ROWS], torque[2][3 * MILD_FEET_MAX], report[2][5 * MILD_FEET_MAX];
        if (!is_plain(&herd->kit[r])) {
            continue;
        }
        for (int i = 0; i < rows; i++) {
            twist[i] = a->after[rows * r + i];
        }
        for (int f = 0; f < feet; f++) {
            const MildBatchFoot *foot = &a->foot[feet * r + f];
            const MildFootResult *wanted = &result->foot[f];
            for (int k = 0; k < 3; k++) {
                torque[0][3 * f + k] = a->wrench[rows * r + 6 * f + 3 + k];
                torque[1][3 * f + k] = wanted->torque[k];
                report[0][5 * f + k] = foot->pressure_center[k];
                report[1][5 * f + k] = wanted->pressure_center[k];
            }
            report[0][5 * f + 3] = foot->depth_max;
            report[1][5 * f + 3] = wanted->depth_max;
            report[0][5 * f + 4] = foot->area;
            report[1][5 * f + 4] = wanted->area;
        }
        add_error(twists, twist, result->velocity, rows);
        add_error(moments, torque[0], torque[1], 3 * feet);
        add_error(reports, report[0], report[1], 5 * feet);
    }
}

/* Robots whose step ended above the tolerance. */
static inline int herd_unsolved(const Arrays *a) {
    int count = 0;
    for (int r = 0; r < ROBOTS; r++) {
        count += !(a->residual[r] <= 1e-4F);
    }
    return count;
}

/* Forces of a step against the kits'. */
static inline void against_ground(Errors *errors, const Herd *herd, const Arrays *a) {
    for (int r = 0; r < ROBOTS; r++) {
        double found[3 * MILD_FEET_MAX], wanted[3 * MILD_FEET_MAX];
        int loaded = 0;
        if (!is_plain(&herd->kit[r])) {
            continue;
        }
        for (int i = 0; i < 3 * herd->feet; i++) {
            found[i] = a->wrench[6 * herd->feet * r + i / 3 * 6 + i % 3];
            wanted[i] = herd->kit[r].result.foot[i / 3].force[i % 3];
            loaded |= found[i] != 0 || wanted[i] != 0;
        }
        if (!loaded && herd->shells > 0) { /* many are in the air */
            continue;
        }
        add_error(errors, found, wanted, 3 * herd->feet);
    }
}

/* Of the steps that both have solved; another ends wherever rounding has led it. Returns the number
 * of those. */
static inline int against_other(Errors *errors, int feet, const Arrays *a, const Arrays *b) {
    int unsolved = 0;
    for (int r = 0; r < ROBOTS; r++) {
        double found[ROWS], wanted[ROWS];
        for (int i = 0; i < 6 * feet; i++) {
            found[i] = a->wrench[6 * feet * r + i];
            wanted[i] = b->wrench[6 * feet * r + i];
        }
        assert_true(a->iterations[r] >= 0 && a->iterations[r] <= 20);
        assert_true(a->residual[r] >= 0.0f);
        if (a->residual[r] <= 1e-4F && b->residual[r] <= 1e-4F) {
            add_error(errors, found, wanted, 6 * feet);
        } else {
            unsolved++;
        }
    }
    return unsolved;
}

#endif
