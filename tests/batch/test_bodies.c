/* The step of a robot whose shells are near the ground (bodies.h) against mild_ground_solve and
 * mild_ground_advance: the same code in double and in float, of soles and shells, on level ground
 * and on maps. */
#include "case_kit.h"
#include "contact_case.h"
#include "ground/sole/sole.h"
#include "ground/surface_kit.h"

enum { FEET = 2, WALK = 60, FORCES = 20000 };

static MildSole *soles[BODIES];

static int open_soles(void **state) {
    (void)state;
    const MildShape capsule = surface_capsule(0.04, 0.09), sphere = surface_sphere(0.07);
    MildShape box = surface_box(0.05, 0.04, 0.1);
    box.pos[0] = 0.03;
    box.pos[2] = -0.06;
    soles[0] = kit_sole(0, 77);
    soles[1] = kit_sole(1, 77);
    soles[2] = surface_make(&box, 1, KIT_PITCH);
    soles[3] = surface_make(&capsule, 1, KIT_PITCH);
    soles[4] = surface_make(&sphere, 1, KIT_PITCH);
    return 0;
}

static int close_soles(void **state) {
    (void)state;
    for (int b = 0; b < BODIES; b++) {
        mild_sole_destroy(soles[b]);
    }
    return 0;
}

/* ---- a kit's problem as a case ---- */

static void case_sole(BodiesCase *c, const Kit *kit, int b) {
    const MildSole *sole = kit->soles[b];
    const FootScratch *foot = &kit->scratch->foot[b];
    const double square = mild_sole_pitch(sole) * mild_sole_pitch(sole);
    const double *z = mild_sole_surface_z(sole);
    c->elements[b] = mild_sole_elements(sole);
    c->shell[b] = z != NULL;
    c->z[b] = mild_sole_z(sole);
    c->square[b] = square;
    c->radius[b] = foot->radius;
    memcpy(c->middle[b], foot->middle, sizeof c->middle[b]);
    memcpy(c->half[b], foot->half, sizeof c->half[b]);
    for (int i = 0; i < c->elements[b]; i++) {
        c->place[0][b][i] = mild_sole_x(sole)[i];
        c->place[1][b][i] = mild_sole_y(sole)[i];
        c->place[2][b][i] = z ? z[i] : 0;
        for (int k = 0; z && k < 3; k++) {
            c->place[3 + k][b][i] = mild_sole_surface_normal(sole, k)[i];
        }
        const SoleHeap heap = sole_heap(sole, i);
        c->begin[b][i] = heap.begin;
        c->width[b][i] = heap.width;
        c->place[6][b][i] = z ? mild_sole_surface_area(sole)[i] / square : 0;
    }
    for (int m = 0; m < kit->terrain.material_count; m++) {
        case_law(&c->material[m][b], &kit->terrain.materials[m], sole);
    }
}

/* Numbers of BodiesCase.memory behind those of an element on level ground. */
enum { PLANE = CASE_MEMORY, SLOPE_X, SLOPE_Y, STATE, AREA_SHARE };

/* The state of bodies.h for a material of ground/step/state.h, and back. */
static int state_of(int32_t material) {
    return material >= 0               ? material + 1
           : material == MATERIAL_FREE ? -1
           : material == MATERIAL_NONE ? 0
                                       : -2;
}

/* What a ground remembers of a body. Planes count from the world's origin: the body was there. */
static void case_remember(BodiesCase *c, const Kit *kit, int b) {
    const Memory memory = ground_memory(kit->ground, b);
    double *all[CASE_MEMORY];
    memory_arrays(&memory, all);
    c->own[4][b] = kit->ground->uneven[b];
    c->own[5][b] = c->shell[b];
    for (int e = 0; e < c->elements[b]; e++) {
        const int32_t material = memory.material[e];
        for (int n = 0; n < CASE_MEMORY; n++) {
            c->memory[n][b][e] = all[n][e];
        }
        const int there = kit->ground->uneven[b] && material != MATERIAL_NONE;
        c->memory[PLANE][b][e] = there ? memory.plane[e] : 1e6;
        c->memory[SLOPE_X][b][e] = there ? memory.slope_x[e] : 0;
        c->memory[SLOPE_Y][b][e] = there ? memory.slope_y[e] : 0;
        c->memory[STATE][b][e] = c->shell[b] ? state_of(material) : material > 0 ? material : 0;
        c->memory[AREA_SHARE][b][e] = c->shell[b] ? memory.area_share[e] : 0;
    }
}

static void case_of(BodiesCase *c, const Kit *kit, double tolerance) {
    const int rows = 6 * kit->feet;
    memset(c, 0, sizeof *c);
    if (kit->terrain.map) {
        c->has_map = 1;
        c->steepest = kit->terrain.map->steepest;
        case_map(&c->map, c->map_origin, &kit->terrain);
    }
    c->feet = FEET;
    c->bodies = kit->feet;
    c->dt = kit->input.dt;
    c->tolerance = tolerance;
    c->limit = 60;
    c->height = kit->terrain.height;
    for (int b = 0; b < kit->feet; b++) {
        case_sole(c, kit, b);
        case_remember(c, kit, b);
        memcpy(c->position[b], kit->input.position[b], sizeof c->position[b]);
        memcpy(c->rotation[b], kit->input.rotation[b], sizeof c->rotation[b]);
        memcpy(c->velocity[b], kit->input.velocity[b], sizeof c->velocity[b]);
    }
    memcpy(c->inverse_inertia, kit->A, (size_t)(rows * rows) * sizeof(double));
    memcpy(c->free_velocity, kit->input.free_velocity, (size_t)rows * sizeof(double));
}

/* ---- comparison ---- */

typedef struct {
    double wrench, twist, foot, memory;
    int steps, unsolved, loaded, buried, means, iterations, iterations_ground;
    double force[FORCES];
} Worst;

static void compare(Worst *worst, const BodiesCase *c, const Kit *kit) {
    double force[3 * BODIES], wanted[3 * BODIES];
    for (int b = 0; b < c->bodies; b++) {
        const MildFootResult *foot = &kit->result.foot[b];
        memcpy(force + 3 * b, c->wrench + 6 * b, 3 * sizeof(double));
        memcpy(wanted + 3 * b, foot->force, 3 * sizeof(double));
        worst->wrench = worse(worst->wrench, apart(c->wrench + 6 * b + 3, foot->torque, 3, 1.0));
        if (foot->contacts > 0 && foot->force[2] > 1.0) {
            worst->loaded += c->shell[b];
            worst->foot = worse(worst->foot, apart(c->foot[b], foot->pressure_center, 3, 0.1));
            worst->foot = worse(worst->foot, apart(c->foot[b] + 3, &foot->depth_max, 1, 1e-3));
            /* an element within rounding of the surface is loaded in one of the two */
            worst->means += apart(c->foot[b] + 4, &foot->depth_mean, 1, 1e-3) > 1e-9;
        }
    }
    const double gap = apart(force, wanted, 3 * c->bodies, 1.0);
    assert_true(worst->steps < FORCES);
    worst->wrench = worse(worst->wrench, gap);
    worst->force[worst->steps++] = gap;
    worst->twist = worse(worst->twist, apart(c->after, kit->result.velocity, 6 * c->bodies, 0.01));
    worst->iterations += c->iterations;
    worst->iterations_ground += kit->result.iterations;
}

static void compare_element(Worst *worst, const BodiesCase *c, const Kit *kit, const Memory *memory,
                            int b, int e) {
    const int32_t material = memory->material[e];
    double *all[CASE_MEMORY];
    memory_arrays(memory, all);
    for (int n = 0; n < CASE_MEMORY; n++) {
        const double a = c->memory[n][b][e];
        const double wanted = n == 1 && material < 0 ? a : all[n][e];
        worst->memory = worse(worst->memory, fabs(a - wanted) / (fabs(wanted) + memory_scale[n]));
    }
    if (c->shell[b]) {
        worst->buried += material == MATERIAL_BURIED;
        assert_int_equal((int)c->memory[STATE][b][e], state_of(material));
        worst->memory =
            worse(worst->memory, fabs(c->memory[AREA_SHARE][b][e] - memory->area_share[e]));
    }
    if (kit->ground->uneven[b] && (material >= 0 || material == MATERIAL_FREE)) {
        const double x = c->memory[SLOPE_X][b][e], y = c->memory[SLOPE_Y][b][e];
        const double plane = c->memory[PLANE][b][e] - x * c->own[0][b] - y * c->own[1][b] +
                             c->own[2][b] - c->own[3][b];
        const double found[3] = {plane, x, y};
        const double wanted[3] = {memory->plane[e], memory->slope_x[e], memory->slope_y[e]};
        worst->memory = worse(worst->memory, apart(found, wanted, 3, 0.1));
    }
}

/* Bodies that are pushed, turn and roll. exact: bool, the memory must agree too. */
static void walk(Kit *kit, uint64_t *random, double tolerance, void (*run)(BodiesCase *), int exact,
                 Worst *worst) {
    static BodiesCase c;
    for (int s = 0; s < WALK; s++) {
        double force[BODIES][3];
        for (int b = 0; b < kit->feet; b++) {
            for (int k = 0; k < 3; k++) {
                force[b][k] = kit->mass[b] * kit_uniform(random, -6.0, k == 2 ? 8.0 : 6.0);
            }
        }
        kit_inverse_inertia(kit);
        kit_free(kit, (const double(*)[3])force);
        const int rows = 6 * kit->feet;
        static double tie[6 * BODIES];
        for (int i = 0; i < rows; i++) { /* the bodies hang together */
            tie[i] = kit_uniform(random, -0.1, 0.1);
        }
        for (int i = 0; i < rows * rows; i++) {
            kit->A[i] += tie[i / rows] * tie[i % rows];
        }
        case_of(&c, kit, tolerance);
        kit_solve(kit);
        run(&c);
        const int solved = kit->result.converged && kit->result.iterations <= 15;
        worst->unsolved += !solved; /* mild/ground.h needed more than plain steps */
        if (solved) {
            compare(worst, &c, kit);
        }
        kit_advance(kit);
        for (int b = 0; solved && exact && b < kit->feet; b++) {
            const Memory memory = ground_memory(kit->ground, b);
            for (int e = 0; e < c.elements[b]; e++) {
                compare_element(worst, &c, kit, &memory, b, e);
            }
        }
    }
}

/* ---- grounds ---- */

typedef struct {
    const char *name;
    int model, other; /* of the first material, and of the second on a map of labels */
    int on_map;
    MildMapKind kind;
    MildPattern pattern;
} Place;

static const Place places[] = {
    {"level", MILD_MODEL_MILD, 0, 0, 0, 0},
    {"level, ecc_spring", MILD_MODEL_ECC_SPRING, 0, 0, 0, 0},
    {"level, ecc_quasi", MILD_MODEL_ECC_QUASI, 0, 0, 0, 0},
    {"level, ecc_quasi_3d", MILD_MODEL_ECC_QUASI_3D, 0, 0, 0, 0},
    {"level, bekker", MILD_MODEL_BEKKER, 0, 0, 0, 0},
    {"level, hunt_crossley", MILD_MODEL_HUNT_CROSSLEY, 0, 0, 0, 0},
    {"slope", MILD_MODEL_MILD, 0, 1, MILD_MAP_SLOPE, MILD_PATTERN_NONE},
    {"steps", MILD_MODEL_MILD, 0, 1, MILD_MAP_STEPS, MILD_PATTERN_NONE},
    {"rough", MILD_MODEL_MILD, 0, 1, MILD_MAP_ROUGH, MILD_PATTERN_NONE},
    {"level, stripes", MILD_MODEL_MILD, MILD_MODEL_MILD, 1, MILD_MAP_FLAT, MILD_PATTERN_STRIPES},
    {"waves, springs too", MILD_MODEL_MILD, MILD_MODEL_ECC_SPRING, 1, MILD_MAP_WAVES,
     MILD_PATTERN_CHECKER},
    {"rough, ecc_quasi_3d too", MILD_MODEL_MILD, MILD_MODEL_ECC_QUASI_3D, 1, MILD_MAP_ROUGH,
     MILD_PATTERN_CHECKER},
    {"waves, bekker too", MILD_MODEL_MILD, MILD_MODEL_BEKKER, 1, MILD_MAP_WAVES,
     MILD_PATTERN_CHECKER},
    {"level, mild_merged", MILD_MODEL_MILD_MERGED, 0, 0, 0, 0},
    {"rough, mild_merged too", MILD_MODEL_MILD, MILD_MODEL_MILD_MERGED, 1, MILD_MAP_ROUGH,
     MILD_PATTERN_CHECKER},
};
enum { PLACES = sizeof places / sizeof *places };

static MildMaterial draw_material(int model, uint64_t *random) {
    MildMaterial m = kit_material(random);
    if (model == MILD_MODEL_MILD_MERGED) {
        m.model = model;
        wears(&m, 1, random);
    } else if (model != MILD_MODEL_MILD) {
        m = matched((MildModel)model, soles[0]);
    }
    return m;
}

static MildMap *map_of_place(const Place *place, uint64_t *random) {
    if (!place->on_map) {
        return NULL;
    }
    MildMapDef def = shape(place->kind, 0.03, 0.5);
    def.size = 4.0;
    def.slope = 0.3;
    def.seed = (uint64_t)kit_index(random, 1000);
    def.patches = (int)place->pattern;
    def.patch_size = 0.07;
    def.patch_count = CASE_LABELS;
    return make_map(&def);
}

/* Any way up, a little above the ground or in it. */
static void throw_bodies(Kit *kit, uint64_t *random) {
    kit_random_state(kit, random);
    kit->terrain.height = kit_uniform(random, -0.5, 0.5);
    kit->terrain.map_x = kit_uniform(random, -0.4, 0.4);
    for (int b = 0; b < kit->feet; b++) {
        double *at = kit->input.position[b], turn[3];
        const FootScratch *foot = &kit->scratch->foot[b];
        kit->mass[b] = kit_uniform(random, 3.0, 40.0);
        kit->inertia[b] = kit->mass[b] * kit_uniform(random, 0.02, 0.1);
        at[0] = 0.3 * b;
        for (int k = 0; k < 3; k++) {
            turn[k] = kit_uniform(random, -3, 3);
        }
        if (b >= FEET) {
            double R[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
            kit_rotate(R, turn);
            memcpy(kit->input.rotation[b], R, sizeof R);
            for (int k = 3; k < 6; k++) {
                kit->input.velocity[b][k] = kit_uniform(random, -6, 6);
            }
            at[2] = kit_uniform(random, -0.03, 0.03) + 0.8 * foot->radius;
        }
        at[2] += 0.01 + mild_terrain_height_at(&kit->terrain, at[0], at[1]);
    }
}

/* A kit of all bodies, thrown onto a place. Returns its map, or NULL. */
static MildMap *open_place(Kit *kit, const Place *place, uint64_t *random) {
    static const double steps[3] = {1e-3, 2.5e-3, 5e-3};
    const MildMaterial first = draw_material(place->model, random);
    MildMap *map = map_of_place(place, random);
    kit_open(kit, BODIES, soles[0], soles[1], &first, steps[kit_index(random, 3)]);
    kit_soles(kit, (const MildSole *const *)soles);
    kit->terrain.map = map;
    for (int m = 1; map && m < CASE_LABELS; m++) {
        kit->terrain.materials[m] = draw_material(m == 1 ? place->other : 0, random);
        kit->terrain.material_count = m + 1;
    }
    kit->input.tolerance = 1e-12;
    throw_bodies(kit, random);
    return map;
}

static void run_place(const Place *place, int walks, double tolerance, void (*run)(BodiesCase *),
                      int exact, Worst *worst) {
    uint64_t random = 21;
    for (int w = 0; w < walks; w++) {
        static Kit kit;
        MildMap *map = open_place(&kit, place, &random);
        walk(&kit, &random, tolerance, run, exact, worst);
        kit_close(&kit);
        mild_map_destroy(map);
    }
}

static void worst_print(const char *name, Worst *w) {
    print_message(
        "%-24s %4d steps, %3d left out, %4d loaded shells, %6d buried elements: force "
        "median %.1e, 95 %% %.1e; worst: wrench %.1e, twist %.1e, foot %.1e, memory %.1e; "
        "Newton steps %.2f (%.2f)\n",
        name, w->steps, w->unsolved, w->loaded, w->buried, quantile(w->force, w->steps, 0.5),
        quantile(w->force, w->steps, 0.95), w->wrench, w->twist, w->foot, w->memory,
        (double)w->iterations / w->steps, (double)w->iterations_ground / w->steps);
}

TEST(double_text_is_the_ground) {
    for (int i = 0; i < PLACES; i++) {
        static Worst worst;
        memset(&worst, 0, sizeof worst);
        run_place(&places[i], kit_draws(6), 1e-12, bodies_double, 1, &worst);
        worst_print(places[i].name, &worst);
        assert_true(worst.wrench < 1e-10 && worst.twist < 1e-10 && worst.foot < 1e-10);
        assert_true(worst.memory < 1e-7 && worst.loaded > worst.steps / 4);
        assert_true(worst.unsolved < (worst.steps + worst.unsolved) / 8 && worst.means < 3);
    }
}

TEST(float_text_is_near_it) {
    for (int i = 0; i < PLACES; i++) {
        static Worst worst;
        memset(&worst, 0, sizeof worst);
        run_place(&places[i], kit_draws(6), 1e-4, bodies_float, 0, &worst);
        worst_print(places[i].name, &worst);
        assert_true(quantile(worst.force, worst.steps, 0.5) < 1e-5 &&
                    quantile(worst.force, worst.steps, 0.95) < 1e-2);
    }
}

/* ---- pivots ---- */

enum { LYING = 2, ROW = 6 * LYING };

/* A box that comes down on springs. Its mass is between its origin, above it, and its lowest face,
 * so that friction there turns the origin against itself. The others are in the air. */
static void open_lying(Kit *kit, BodiesCase *c, double inertia) {
    uint64_t random = 5;
    open_place(kit, &places[1], &random);
    kit->input.dt = 5e-3;
    kit->terrain.materials[0].mu = 1.2;
    for (int b = 0; b < BODIES; b++) {
        const double R[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
        memset(kit->input.velocity[b], 0, sizeof kit->input.velocity[b]);
        memcpy(kit->input.rotation[b], R, sizeof R);
        kit->input.position[b][2] = kit->terrain.height + (b == LYING ? 0.161 : 2);
    }
    kit->input.velocity[LYING][2] = -1;
    kit->center[LYING][2] = -0.08;
    kit->mass[LYING] = 10;
    kit->inertia[LYING] = inertia;
    kit_inverse_inertia(kit);
    kit_free(kit, NULL);
    case_of(c, kit, 1e-5);
}

/* The first number on the diagonal of 1 + H A where Newton's method begins, the twist now. H is
 * taken from a body that nothing moves, by differences. */
static double first_pivot(const BodiesCase *c) {
    static BodiesCase held;
    const double step = 1e-6;
    double sum = 1;
    for (int k = 0; k < 6; k++) {
        double force[2];
        for (int side = 0; side < 2; side++) {
            held = *c;
            held.tolerance = 1e-11;
            memset(held.inverse_inertia, 0, sizeof held.inverse_inertia);
            memcpy(held.free_velocity + ROW, c->velocity[LYING], 6 * sizeof(double));
            held.free_velocity[ROW + k] += side ? step : -step;
            bodies_double(&held);
            force[side] = held.dt * held.wrench[ROW];
        }
        sum +=
            (force[0] - force[1]) / (2 * step) * c->inverse_inertia[(ROW + k) * 6 * BODIES + ROW];
    }
    return sum;
}

/* A pivot that is 0 in float left numbers that are none, one in some 1e5 steps of a Go1 that lies
 * in loose sand. Here float meets it: the inertia at which it is 0 is found in double, and those
 * beside it are tried. */
TEST(vanishing_pivots_do_no_harm) {
    static Kit kit;
    static BodiesCase c, exact, shared;
    double low = 1e-3, high = 1;
    for (int n = 0; n < 40; n++) {
        const double middle = sqrt(low * high);
        open_lying(&kit, &c, middle);
        *(first_pivot(&c) < 0 ? &low : &high) = middle;
        kit_close(&kit);
    }
    print_message("the first pivot is 0 with an inertia of %.6f kg m^2\n", low);
    assert_true(low > 2e-3 && high < 0.5);
    double worst = 0;
    for (int n = -2000; n < 2000; n++) {
        open_lying(&kit, &c, low * (1 + 1e-8 * n));
        exact = shared = c;
        exact.tolerance = 1e-11;
        bodies_double(&exact);
        bodies_float(&c);
        bodies_float_shared(&shared);
        worst = worse(worst, apart(c.wrench + ROW, exact.wrench + ROW, 6, 1.0));
        worst = worse(worst, apart(shared.wrench + ROW, exact.wrench + ROW, 6, 1.0));
        assert_true(exact.wrench[ROW + 2] > 0.5);
        kit_close(&kit);
    }
    print_message("%.0f N, the wrench apart by %.1e at most\n", exact.wrench[ROW + 2], worst);
    assert_true(worst < 1e-3);
}

TEST_MAIN(open_soles, close_soles)
