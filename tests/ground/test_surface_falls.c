/* Bodies covered with elements fall out of the air with spin: boxes, capsules, wedges and bodies of
 * several parts, on every model and terrain, with and without imprints. The ground has stored
 * nothing, so its work on the body is never above 0. Left out is what test_falls.c leaves out:
 * falls with an unsolved step, and bodies that turn by more than 0.1 rad in a step. Arguments:
 * number of falls (default 300) and the first seed (default 1). */
#include "surface_kit.h"

#define TURN_MOST 0.1 /* [rad] in a step */

static int falls = 300;
static uint64_t first = 1;

typedef struct {
    Kit kit;
    MildSole *sole;
    MildMap *map;
    double center[3]; /* [m] of mass, world */
    const char *terrain;
} Body;

static MildMaterial draw_material(uint64_t *random) {
    static const MildModel models[] = {
        MILD_MODEL_MILD,          MILD_MODEL_MILD,         MILD_MODEL_ECC_SPRING,
        MILD_MODEL_ECC_QUASI,     MILD_MODEL_ECC_QUASI_3D, MILD_MODEL_BEKKER,
        MILD_MODEL_HUNT_CROSSLEY, MILD_MODEL_MILD_MERGED,  MILD_MODEL_MILD_MERGED};
    MildMaterial m = kit_material(random);
    m.model = (int)models[kit_index(random, 9)];
    if (m.model == MILD_MODEL_MILD_MERGED) {
        m.recovery = kit_index(random, 2) ? 0.0 : m.recovery;
        m.slip_length = kit_index(random, 2) ? pow(10.0, kit_uniform(random, -3.5, -1.0)) : 0.0;
        m.regain_length = pow(10.0, kit_uniform(random, -4.0, -2.0));
        m.grip = kit_index(random, 2) ? kit_uniform(random, 0.0, 0.3) : 0.0;
    }
    m.zeta = kit_uniform(random, 0.05, 1.5);
    if (m.model == MILD_MODEL_BEKKER || m.model == MILD_MODEL_HUNT_CROSSLEY) {
        m.exponent = kit_uniform(random, 0.4, 2.0);
        m.k_c = kit_uniform(random, 0.0, 50e3);
        m.k_phi = pow(10.0, kit_uniform(random, 4.5, 6.0));
        uint64_t own = *random;
        if (kit_index(&own, 3) == 0) { /* of a small body the modulus is below 0 then */
            m.k_c = kit_uniform(&own, -0.1, 0.0) * m.k_phi;
        }
        m.cohesion = kit_uniform(random, 0.0, 10e3);
        m.shear_length = kit_uniform(random, 0.001, 0.05);
        m.dissipation = kit_uniform(random, 0.0, 5.0);
    }
    if (kit_index(random, 3) == 0) {
        m.mu = m.k_drift = m.b_drift = 0.0; /* nothing but the normal force takes energy */
    }
    m.passive = 1;
    return m;
}

static MildSole *draw_sole(uint64_t *random) {
    static double vertices[18];
    MildShape shapes[3];
    const int count = 1 + kit_index(random, 3);
    for (int i = 0; i < count; i++) {
        double size[3];
        for (int k = 0; k < 3; k++) {
            size[k] = kit_spread(random, 0.02, 0.15);
        }
        switch (kit_index(random, 4)) {
        case 0: shapes[i] = surface_box(size[0], size[1], size[2]); break;
        case 1: shapes[i] = surface_capsule(0.5 * size[0], size[1]); break;
        case 2: shapes[i] = surface_sphere(size[0]); break;
        default: shapes[i] = surface_wedge(size[0], size[1], size[2], vertices); break;
        }
        kit_vector(random, 0.1, shapes[i].pos);
        kit_vector(random, 1.0, shapes[i].quat + 1);
        shapes[i].quat[0] = kit_uniform(random, -1.0, 1.0);
    }
    return surface_make(shapes, count, kit_spread(random, 0.015, 0.05));
}

/* Level, uneven, in patches, or both. */
static void draw_terrain(Body *b, uint64_t *random) {
    static const char *const names[4] = {"level", "uneven", "mixed", "uneven and mixed"};
    static const MildMapKind shapes[4] = {MILD_MAP_SLOPE, MILD_MAP_STEPS, MILD_MAP_WAVES,
                                          MILD_MAP_ROUGH};
    const int kind = kit_index(random, 4);
    b->terrain = names[kind];
    b->kit.terrain.height = kit_uniform(random, -1, 1);
    if (kind == 0) {
        return;
    }
    MildMapDef def = mild_map_def_default();
    def.kind = kind & 1 ? (int)shapes[kit_index(random, 4)] : MILD_MAP_FLAT;
    def.cell = kit_uniform(random, 0.01, 0.03);
    def.size = 1.0;
    def.amplitude = kit_uniform(random, 0.0, 0.03);
    def.wavelength = kit_uniform(random, 0.1, 0.8);
    def.slope = kit_uniform(random, -0.4, 0.4);
    def.seed = (uint64_t)kit_index(random, 1000);
    if (kind & 2) {
        while (b->kit.terrain.material_count < 4) {
            b->kit.terrain.materials[b->kit.terrain.material_count++] = draw_material(random);
        }
        def.patches = MILD_PATTERN_STRIPES + kit_index(random, 2);
        def.patch_size = kit_uniform(random, 0.03, 0.2);
        def.patch_count = 3;
        def.border = kit_index(random, 4) ? kit_uniform(random, 0.01, def.patch_size) : 0.0;
    }
    MildError error = {0};
    b->map = mild_map_create(&def, &error);
    if (!b->map || mild_terrain_set_map(&b->kit.terrain, b->map, &error) != MILD_OK) {
        fail_msg("%s", error.text);
    }
}

/* Lowest point of the body over the ground under it. */
static double clearance(const Body *b) {
    const double *R = b->kit.input.rotation[0], *p = b->kit.input.position[0];
    double least = INFINITY;
    for (int e = 0; e < mild_sole_elements(b->sole); e++) {
        const double in[3] = {mild_sole_x(b->sole)[e], mild_sole_y(b->sole)[e],
                              mild_sole_surface_z(b->sole)[e]};
        double at[3];
        for (int k = 0; k < 3; k++) {
            at[k] = p[k] + R[3 * k] * in[0] + R[3 * k + 1] * in[1] + R[3 * k + 2] * in[2];
        }
        least = fmin(least, at[2] - mild_terrain_height_at(&b->kit.terrain, at[0], at[1]));
    }
    return least;
}

static void body_draw(Body *b, uint64_t *random) {
    memset(b, 0, sizeof *b);
    b->sole = draw_sole(random);
    const MildMaterial m = draw_material(random);
    kit_open(&b->kit, 1, b->sole, NULL, &m, kit_spread(random, 5e-4, 2e-3));
    kit_prints(&b->kit, kit_index(random, 2) ? 0 : 8 * (1 + kit_index(random, 8)));
    draw_terrain(b, random);
    Kit *kit = &b->kit;
    kit->mass[0] = kit_spread(random, 0.3, 40.0);
    kit->inertia[0] = kit->mass[0] * kit_spread(random, 1e-3, 0.02);
    kit_vector(random, 0.05, kit->center[0]);
    double turn[3];
    kit_vector(random, 3.0, turn);
    kit_rotate(kit->input.rotation[0], turn);
    kit_vector(random, 1.0, kit->input.position[0]);
    kit->input.position[0][2] += kit_spread(random, 1e-4, 0.2) - clearance(b);
    kit_vector(random, 1.5, kit->input.velocity[0]);
    kit->input.velocity[0][2] -= 1.5;
    kit_vector(random, 8.0, kit->input.velocity[0] + 3);
}

static void body_close(Body *b) {
    kit_close(&b->kit);
    mild_sole_destroy(b->sole);
    mild_map_destroy(b->map);
}

typedef struct {
    int falls, steps, unsolved, spun, touched;
    double worst; /* [-] work of the ground so far, over the most energy that the body had */
    uint64_t seed;
    const char *terrain;
    int model;
} Falls;

static void fall_once(uint64_t seed, Falls *all) {
    Body body;
    uint64_t random = seed;
    body_draw(&body, &random);
    Kit *kit = &body.kit;
    const int steps = 100 + kit_index(&random, 200);
    double work = 0.0, energy = kit_kinetic(kit, kit->input.velocity[0]), gain = 0.0, most = 0.0;
    int unsolved = 0, touched = 0;
    for (int s = 0; s < steps; s++) {
        kit_inverse_inertia(kit);
        kit_free(kit, NULL);
        kit_solve(kit);
        unsolved += !kit->result.converged;
        touched |= kit->result.foot[0].contacts > 0;
        work += kit_work(kit, 0, kit->input.free_velocity);
        kit_advance(kit);
        const double *V = kit->input.velocity[0];
        most = fmax(most, kit->input.dt * sqrt(V[3] * V[3] + V[4] * V[4] + V[5] * V[5]));
        energy = fmax(energy, kit_kinetic(kit, V));
        gain = fmax(gain, work / energy);
    }
    all->falls++;
    all->steps += steps;
    all->touched += touched;
    all->unsolved += unsolved > 0;
    all->spun += !unsolved && most > TURN_MOST;
    if (!unsolved && most <= TURN_MOST && gain > all->worst) {
        all->worst = gain;
        all->seed = seed;
        all->terrain = body.terrain;
        all->model = kit->terrain.materials[0].model;
    }
    body_close(&body);
}

TEST(falls_gain_nothing) {
    Falls all = {.terrain = ""};
    for (int i = 0; i < falls; i++) {
        fall_once((first + (uint64_t)i) * 1000003u + 7919u, &all);
    }
    print_message("%d falls, %d touch, %d steps, %d falls with an unsolved step, %d turn by over "
                  "%.1f rad in a step; most energy gained %.1e of the body's (seed %llu, %s, %s)\n",
                  all.falls, all.touched, all.steps, all.unsolved, all.spun, TURN_MOST, all.worst,
                  (unsigned long long)all.seed, all.terrain, mild_model_names[all.model]);
    assert_true(all.touched > falls / 2);
    assert_true(all.unsolved <= 1 + all.falls / 100);
    assert_true(all.worst < 1e-9);
}

int main(int argc, char **argv) {
    falls = argc > 1 ? atoi(argv[1]) : kit_draws(falls);
    if (argc > 2) {
        first = strtoull(argv[2], NULL, 10);
    }
    return run_cases(NULL, NULL);
}
