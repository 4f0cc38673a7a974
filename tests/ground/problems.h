/* Random contact problems of test_solver.c, each by its number: cones on level ground, and what
 * lies beyond them. A problem is a kit that has been solved. Open the soles first. */
#ifndef PROBLEMS_H
#define PROBLEMS_H

#include "surface_kit.h"

#define SOLES 8

static MildSole *soles[SOLES];   /* left 77, right 77, one element, plates of six and more */
static MildSole *centers[SOLES]; /* of each, for the concentric models */
static MildSole *covered[SOLES]; /* bodies about as large as a foot, of up to 90 elements */

/* A box with a round end, one with a wedge, and simple ones. */
static void open_covered(void) {
    static double vertices[18];
    MildShape two[2] = {surface_box(0.07, 0.04, 0.04), surface_capsule(0.04, 0.04)};
    two[1].pos[0] = 0.07;
    two[1].quat[0] = two[1].quat[1] = 1.0;
    covered[0] = surface_make(two, 2, 0.04);
    two[1] = surface_wedge(0.05, 0.04, 0.03, vertices);
    two[1].pos[2] = 0.05;
    covered[1] = surface_make(two, 2, 0.045);
    for (int i = 2; i < SOLES; i++) {
        const MildShape one[3] = {surface_box(0.03 + 0.005 * i, 0.03, 0.05),
                                  surface_capsule(0.04, 0.01 * i), surface_sphere(0.05)};
        covered[i] = surface_make(&one[i % 3], 1, 0.035);
    }
}

static int open_soles(void **state) {
    (void)state;
    soles[0] = kit_sole(0, 77);
    soles[1] = kit_sole(1, 77);
    soles[2] = kit_plate(1, 1);
    soles[3] = kit_plate(3, 2);
    soles[4] = kit_plate(2, 1);
    soles[5] = kit_plate(5, 3);
    soles[6] = kit_plate(7, 5);
    soles[7] = kit_plate(11, 6);
    for (int i = 0; i < SOLES; i++) {
        centers[i] = mild_sole_concentric(soles[i], NULL);
    }
    open_covered();
    return 0;
}

static int close_soles(void **state) {
    (void)state;
    for (int i = 0; i < SOLES; i++) {
        mild_sole_destroy(soles[i]);
        mild_sole_destroy(centers[i]);
        mild_sole_destroy(covered[i]);
    }
    return 0;
}

/* Feet in a random state on a ground: on robot's soles or on one of the first so many small ones.
 */
static void problem_open(Kit *kit, uint64_t *random, MildSole *const *from, int small,
                         const MildMaterial *m, double dt) {
    int feet = 1 + kit_index(random, 2);
    MildSole *left = from[small ? 2 + kit_index(random, small) : 0],
             *right = from[small ? 2 + kit_index(random, small) : 1];
    kit_open(kit, feet, left, right, m, dt);
    kit_random_state(kit, random);
}

/* Gives the feet a history, then a random inertia, and solves; false when nothing touches. */
static int problem_solve(Kit *kit, uint64_t *random) {
    int history = kit_index(random, 10), n = 6 * kit->feet;
    for (int s = 0; s < history; s++) {
        kit_step(kit, NULL);
    }
    int rank = kit_uniform(random, 0.0, 1.0) < 0.3 ? 1 + kit_index(random, n - 1) : n;
    kit_random_inertia(kit, random, rank);
    kit_free(kit, NULL);
    if (rank < n) { /* a guided foot moves freely only where its guide lets it */
        for (int i = 0; i < n; i++) {
            kit->input.free_velocity[i] = kit->input.velocity[i / 6][i % 6];
            for (int j = 0; j < n; j++) {
                kit->input.free_velocity[i] += kit->input.inverse_inertia[i * n + j] * 100.0 *
                                               kit->input.dt * sin(i + 3.0 * j);
            }
        }
    }
    kit_solve(kit);
    return kit->result.foot[0].contacts + kit->result.foot[1].contacts > 0;
}

static int problem_on(Kit *kit, uint64_t *random, int small, const MildMaterial *m, double dt) {
    problem_open(kit, random, soles, small, m, dt);
    return problem_solve(kit, random);
}

/* The problem of that number: a third on sand with its drag and added mass, a third on small soles;
 * a fifth of all on a firm bed that a foot can reach. */
static inline int numbered_problem(Kit *kit, int number) {
    static const double steps[3] = {1e-3, 2.5e-3, 5e-3};
    uint64_t random = (uint64_t)number * 1000003u + 28;
    MildMaterial m = kit_material(&random), sand = mild_material_default();
    if (number % 3 == 1) {
        sand.mu = m.mu;
        sand.recovery = m.recovery;
        m = sand;
    }
    if (number % 5 == 4) {
        m.bed_depth = kit_uniform(&random, 0.001, 0.02);
    }
    return problem_on(kit, &random, number % 3 == 2 ? SOLES - 2 : 0, &m,
                      steps[kit_index(&random, 3)]);
}

/* ---- problems beyond cones on level ground ---- */

typedef enum {
    SPRING,
    CONCENTRIC,
    QUASI,
    QUASI_3D,
    UNEVEN,
    BLEND,
    PRINTS,
    ACTIVE,
    BEKKER,
    HUNT_CROSSLEY,
    MERGED,
    EVERYTHING,
    SHELLS,
    KINDS
} Kind;
static const char *const kind_names[KINDS] = {"springs",
                                              "con_cone and con_spring",
                                              "ecc_quasi",
                                              "ecc_quasi_3d",
                                              "uneven ground",
                                              "materials that blend",
                                              "prints",
                                              "passive = false",
                                              "bekker",
                                              "hunt_crossley",
                                              "mild_merged and slip",
                                              "everything at once",
                                              "everything under shells"};

/* One of the models of the raster, with numbers for it. */
static MildMaterial material_of(uint64_t *random, MildModel model) {
    MildMaterial m = kit_material(random);
    m.model = (int)model;
    if (model == MILD_MODEL_MILD_MERGED) {
        m.slip_length = kit_index(random, 2) ? kit_uniform(random, 0.0005, 0.01) : 0.0;
        m.regain_length = kit_uniform(random, 0.0001, 0.005);
        m.grip = kit_index(random, 2) ? kit_uniform(random, 0.05, 0.3) : 0.0;
        uint64_t own = *random;
        m.slip_growth = kit_index(&own, 2) ? kit_uniform(&own, 0.0, 0.2) : 0.0;
    }
    if (model == MILD_MODEL_MILD || model == MILD_MODEL_ECC_SPRING ||
        model == MILD_MODEL_MILD_MERGED) {
        return m;
    }
    m.zeta = kit_uniform(random, 0.05, 1.5);
    if (model == MILD_MODEL_BEKKER || model == MILD_MODEL_HUNT_CROSSLEY) {
        m.exponent = kit_uniform(random, 0.4, 2.0);
        m.k_c = kit_uniform(random, 0.0, 50e3);
        m.k_phi = pow(10.0, kit_uniform(random, 4.5, 6.0));
        m.plate_width = kit_uniform(random, 0.05, 0.2);
        uint64_t own = *random;
        if (kit_index(&own, 3) == 0) { /* pressure that grows with the plate */
            m.k_c = kit_uniform(&own, -1.0, 0.0) * m.k_phi * m.plate_width;
        }
        m.cohesion = kit_uniform(random, 0.0, 10e3);
        m.shear_length = kit_uniform(random, 0.001, 0.05);
        m.dissipation = kit_uniform(random, 0.0, 5.0);
    }
    if (kit_index(random, 2)) {
        m.mu = 0.0; /* as matched, and with friction on top */
    }
    if (kit_index(random, 2)) {
        m.k_drift = m.b_drift = 0.0;
    }
    return m;
}

static MildMaterial kind_material(Kind kind, uint64_t *random) {
    static const MildModel models[7] = {
        MILD_MODEL_MILD,   MILD_MODEL_ECC_SPRING,    MILD_MODEL_ECC_QUASI,  MILD_MODEL_ECC_QUASI_3D,
        MILD_MODEL_BEKKER, MILD_MODEL_HUNT_CROSSLEY, MILD_MODEL_MILD_MERGED};
    static const MildModel blended[2] = {MILD_MODEL_MILD, MILD_MODEL_BEKKER};
    static const MildModel own[KINDS] = {
        [SPRING] = MILD_MODEL_ECC_SPRING,           [QUASI] = MILD_MODEL_ECC_QUASI,
        [QUASI_3D] = MILD_MODEL_ECC_QUASI_3D,       [BEKKER] = MILD_MODEL_BEKKER,
        [HUNT_CROSSLEY] = MILD_MODEL_HUNT_CROSSLEY, [MERGED] = MILD_MODEL_MILD_MERGED};
    MildModel model = kind >= EVERYTHING ? models[kit_index(random, 7)]
                      : kind == BLEND    ? blended[kit_index(random, 2)]
                                         : own[kind];
    MildMaterial m = material_of(random, model);
    if (kind == BLEND && kit_index(random, 2)) { /* sand's drag */
        m.c_g = 2.7;
        m.c_d = 17.2;
    }
    if (kit_index(random, 5) == 0) {
        m.bed_depth = kit_uniform(random, 0.001, 0.02);
    }
    m.passive = kind == ACTIVE ? 0 : kind >= EVERYTHING ? kit_index(random, 3) > 0 : 1;
    return m;
}

/* A concentric rival of a cone on the sole that the problem's feet stand on, matched at some load.
 */
static void problem_match(Kit *kit, uint64_t *random) {
    MildMaterial *m = &kit->terrain.materials[0], mild = *m;
    double load = kit_uniform(random, 5.0, 20.0) * mild_sole_elements(soles[0]);
    MildError error;
    MildModel model = kit_index(random, 2) ? MILD_MODEL_CON_CONE : MILD_MODEL_CON_SPRING;
    expect_good(mild_model_match(model, &mild, soles[0], load, m, &error) == MILD_OK, &error);
    m->recovery = mild.recovery;
}

/* Random heights, a random pattern or both; the surface is where the feet were put. */
static MildMap *problem_map(Kit *kit, uint64_t *random, int uneven, int pattern) {
    static const MildMapKind shapes[4] = {MILD_MAP_SLOPE, MILD_MAP_STEPS, MILD_MAP_WAVES,
                                          MILD_MAP_ROUGH};
    MildMapDef def = mild_map_def_default();
    def.kind = uneven ? (int)shapes[kit_index(random, 4)] : MILD_MAP_FLAT;
    def.cell = kit_uniform(random, 0.01, 0.03);
    def.size = 1.0;
    def.amplitude = kit_uniform(random, 0.0, 0.03);
    def.wavelength = kit_uniform(random, 0.1, 0.8);
    def.slope = kit_uniform(random, -0.4, 0.4);
    def.seed = (uint64_t)kit_index(random, 1000);
    def.patches = pattern ? MILD_PATTERN_STRIPES + kit_index(random, 2) : MILD_PATTERN_NONE;
    def.patch_size = kit_uniform(random, 0.03, 0.2);
    def.patch_count = kit->terrain.material_count - 1;
    def.border = kit_index(random, 4) ? kit_uniform(random, 0.01, def.patch_size) : 0.0;
    MildError error;
    MildMap *map = mild_map_create(&def, &error);
    if (!map || mild_terrain_set_map(&kit->terrain, map, &error) != MILD_OK) {
        fail_msg("%s", error.text);
    }
    kit->terrain.height = kit_uniform(random, -0.1, 0.1);
    kit->terrain.map_x = kit_uniform(random, -1.0, 1.0);
    kit->terrain.map_y = kit_uniform(random, -1.0, 1.0);
    for (int f = 0; f < kit->feet; f++) {
        double *p = kit->input.position[f];
        for (int k = 0; k < 2; k++) {
            p[k] += kit_uniform(random, -0.5, 0.5);
        }
        p[2] += mild_terrain_height_at(&kit->terrain, p[0], p[1]);
    }
    return map;
}

/* Up to four materials in the map's pattern and one more in a rectangle near a foot. */
static void problem_materials(Kit *kit, Kind kind, uint64_t *random) {
    int count = 3 + kit_index(random, 3);
    double x = kit_uniform(random, -0.5, 0.5), y = kit_uniform(random, -0.5, 0.5);
    MildPatch patch = {x, x + kit_uniform(random, 0.01, 0.5), y, y + kit_uniform(random, 0.01, 0.5),
                       count - 1};
    while (kit->terrain.material_count < count) {
        kit->terrain.materials[kit->terrain.material_count++] = kind_material(kind, random);
    }
    mild_terrain_add_patch(&kit->terrain, &patch, NULL);
}

/* The feet have been here before: they leave their prints and come back nearby. */
static void problem_visit(Kit *kit, uint64_t *random) {
    MildContactInput first = kit->input;
    kit_prints(kit, 64);
    int visit = 1 + kit_index(random, 20);
    for (int s = 0; s < visit; s++) {
        kit_step(kit, NULL);
    }
    for (int f = 0; f < kit->feet; f++) {
        kit->input.position[f][2] += 1.0;
        memset(kit->input.velocity[f], 0, sizeof kit->input.velocity[f]);
    }
    kit_step(kit, NULL);
    kit->input = first;
    for (int f = 0; f < kit->feet; f++) {
        double turn[3] = {0.0, 0.0, kit_uniform(random, -0.3, 0.3)};
        kit_rotate(kit->input.rotation[f], turn);
        for (int k = 0; k < 3; k++) {
            kit->input.position[f][k] += kit_uniform(random, -0.005, 0.005);
        }
    }
}

/* The bodies are turned in the ground by hand: loaded elements face up, and elements below it face
 * down. */
static void problem_turn(Kit *kit, uint64_t *random) {
    enum { STEPS = 30 };
    memset(kit->input.free_velocity, 0, sizeof kit->input.free_velocity);
    for (int i = 0; i < 6 * kit->feet; i++) {
        const double most = i % 6 < 3 ? 0.01 : 1.0; /* [m], [rad] in all */
        kit->input.free_velocity[i] = kit_uniform(random, -most, most) / STEPS / kit->input.dt;
    }
    memset(kit->A, 0, sizeof kit->A);
    kit->input.inverse_inertia = kit->A;
    for (int s = 0; s < STEPS; s++) {
        kit_solve(kit);
        kit_advance(kit);
    }
}

/* *map: to be destroyed after the kit, may be NULL. */
static int kind_problem(Kit *kit, MildMap **map, Kind kind, int number) {
    static const double steps[3] = {1e-3, 2.5e-3, 5e-3};
    uint64_t random = (uint64_t)number * 1000003u + 29 + (uint64_t)kind * 7919u;
    MildMaterial m = kind_material(kind, &random);
    double dt = steps[kit_index(&random, 3)];
    int all = kind >= EVERYTHING;
    MildSole *const *from = kind == CONCENTRIC ? centers : kind == SHELLS ? covered : soles;
    problem_open(kit, &random, from, number % 2 ? SOLES - 2 : 0, &m, dt);
    *map = NULL;
    for (int f = 0; kind == SHELLS && f < kit->feet; f++) {
        double turn[3];
        for (int k = 0; k < 3; k++) {
            turn[k] = kit_uniform(&random, -3.0, 3.0);
        }
        kit_rotate(kit->input.rotation[f], turn);
    }
    if (kind == CONCENTRIC) {
        problem_match(kit, &random);
    }
    if (kind == BLEND || all) {
        problem_materials(kit, kind, &random);
    }
    if (kind == UNEVEN || kind == BLEND || all) {
        *map = problem_map(kit, &random, kind != BLEND, kind != UNEVEN);
    }
    if (kind == PRINTS || all) {
        problem_visit(kit, &random);
    }
    if (kind == SHELLS) {
        problem_turn(kit, &random);
    }
    return problem_solve(kit, &random);
}

#endif
