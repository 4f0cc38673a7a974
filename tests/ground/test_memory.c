/* Stepping allocates nothing, and a state block is bytes, which are taken back or refused. */
#include "surface_kit.h"

#include "ground_kit.h"

#if defined(__SANITIZE_ADDRESS__)
#define COUNTING 0 /* the sanitizer brings its own allocator */
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define COUNTING 0
#endif
#endif
#ifndef COUNTING
#define COUNTING 1
#endif

static int allocations, fail_at; /* fail_at: the allocation that fails, 0 = none */

#if COUNTING
extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t count, size_t size);
extern void *__libc_realloc(void *at, size_t size);
extern void *__libc_memalign(size_t alignment, size_t size);

static int allocation_fails(void) {
    allocations++;
    return fail_at > 0 && --fail_at == 0;
}

void *malloc(size_t size) {
    return allocation_fails() ? NULL : __libc_malloc(size);
}

void *calloc(size_t count, size_t size) {
    return allocation_fails() ? NULL : __libc_calloc(count, size);
}

void *realloc(void *at, size_t size) {
    return allocation_fails() ? NULL : __libc_realloc(at, size);
}

void *aligned_alloc(size_t alignment, size_t size) {
    return allocation_fails() ? NULL : __libc_memalign(alignment, size);
}
#endif

/* Of planes and of a shell. */
TEST(test_no_allocation) {
    uint64_t random = 31;
    const MildShape box = surface_box(0.1, 0.05, 0.04);
    MildSole *left = kit_sole(0, 77), *right = kit_sole(1, 77);
    MildSole *shell = surface_make(&box, 1, 0.02);
    const MildMaterial m = mild_material_default();
    Kit kit;
    kit_open(&kit, 2, left, right, &m, 1e-3);
    for (int t = 0; t < 200; t++) {
        if (t == 150) {
            const MildSole *const soles[2] = {left, shell};
            kit_soles(&kit, soles);
        }
        const int before = allocations;
        kit_random_state(&kit, &random);
        kit.terrain.materials[0] = kit_material(&random);
        kit.input.solver = t % 10 ? MILD_SOLVER_NEWTON : MILD_SOLVER_GAUSS_SEIDEL;
        kit.input.max_iterations = t % 10 ? 0 : 20;
        for (int s = 0; s < 20; s++) {
            kit_step(&kit, NULL);
        }
        mild_ground_reset(kit.ground);
        assert_int_equal(allocations, before);
    }
    kit_close(&kit);
    mild_sole_destroy(left);
    mild_sole_destroy(right);
    mild_sole_destroy(shell);
}

/* Soles, shells, whose lists grow, and scratches, with the n-th allocation failing until none does:
 * nothing comes back, nothing leaks, and a shell's sampling ends there. */
TEST(test_failing_allocations) {
    if (!COUNTING) {
        skip();
    }
    double vertices[18];
    const double box[8] = {0, 0, 0.1, 0, 0.1, 0.1, 0, 0.1};
    const MildShape shapes[2] = {surface_box(0.2, 0.05, 0.05),
                                 surface_wedge(0.1, 0.1, 0.1, vertices)};
    const MildSoleDef plane = {box, 4, KIT_PITCH, KIT_SOLE_Z, 0};
    const MildSurfaceDef shell = {.shapes = shapes, .count = 2, .pitch = 0.01};
    static const int least[3] = {2, 6, 2}; /* refusals */
    MildSole *soles[2] = {NULL, NULL};
    MildScratch *scratch = NULL;
    for (int what = 0; what < 3; what++) {
        int refused = 0;
        for (const void *made = NULL; !made; refused += !made) {
            MildError error = {0};
            const int before = allocations;
            fail_at = refused + 1;
            if (what < 2) {
                made = soles[what] =
                    what ? mild_sole_surface(&shell, &error) : mild_sole_create(&plane, &error);
            } else {
                made = scratch = mild_scratch_create((const MildSole *const *)soles, 2, &error);
            }
            fail_at = 0;
            assert_int_equal(error.status, made ? MILD_OK : MILD_ERROR_MEMORY);
            assert_true(made || what != 1 || allocations == before + refused + 1);
        }
        assert_true(refused >= least[what]);
    }
    mild_scratch_destroy(scratch);
    mild_sole_destroy(soles[0]);
    mild_sole_destroy(soles[1]);
}

/* A robot's ground is small enough for thousands of robots. */
TEST(test_state_bytes) {
    MildSole *left = kit_sole(0, 77), *right = kit_sole(1, 77);
    const MildSole *soles[2] = {left, right};
    size_t bytes = mild_ground_bytes(soles, 2);
    assert_true(bytes / 2 < 16384);
    mild_sole_destroy(left);
    mild_sole_destroy(right);
}

/* A foot that is taken away in the middle of an impact leaves a ground as it was before, byte for
 * byte. */
TEST(test_taken_away) {
    MildSole *sole = kit_plate(3, 3);
    MildMaterial m = kit_preset("sand_loose");
    Kit kit, fresh;
    kit_open(&kit, 1, sole, NULL, &m, 1e-3);
    kit_open(&fresh, 1, sole, NULL, &m, 1e-3);
    const double twist[6] = {0.3, 0.2, -1.0, 0.0, 0.0, 0.0};
    for (int s = 0; s < 8; s++) {
        memcpy(kit.input.velocity[0], twist, sizeof twist);
        memcpy(kit.input.free_velocity, twist, sizeof twist);
        kit_solve(&kit);
        kit_advance(&kit);
    }
    assert_memory_not_equal(kit.ground, fresh.ground, kit.bytes);
    kit.input.position[0][2] = 1.0;
    for (int s = 0; s < 2; s++) {
        kit_solve(&kit);
        mild_ground_advance(kit.ground, &kit.terrain, &kit.input, kit.scratch, &kit.result);
    }
    const double *deepest = mild_ground_depth_max(kit.ground, 0);
    for (int e = 0; e < 9; e++) {
        assert_true(deepest[e] == 0.0);
    }
    assert_memory_equal(kit.ground, fresh.ground, kit.bytes);
    kit_close(&kit);
    kit_close(&fresh);
    mild_sole_destroy(sole);
}

/* A saved block is taken back; one that no ground wrote is refused, and nothing changes. */
TEST(test_restore) {
    uint64_t random = 35;
    MildSole *left = kit_sole(0, 77), *right = kit_sole(1, 77);
    MildMaterial m = mild_material_default();
    Kit kit;
    kit_open(&kit, 2, left, right, &m, 1e-3);
    kit_random_state(&kit, &random);
    for (int s = 0; s < 50; s++) {
        kit_step(&kit, NULL);
    }
    char *saved = malloc(kit.bytes), *bent = malloc(kit.bytes);
    assert_true(saved && bent);
    memcpy(saved, kit.ground, kit.bytes);
    mild_ground_reset(kit.ground);
    MildError error = {0};
    assert_int_equal(mild_ground_restore(kit.ground, saved, kit.bytes, &error), MILD_OK);
    assert_memory_equal(kit.ground, saved, kit.bytes);
    /* feet, elements, padded, touched, tiles, cell; a number and a material of the first foot */
    const size_t number = 320 + 80 * sizeof(double), material = 320 + 80 * 13 * sizeof(double);
    const size_t places[] = {0, 4, 68, 132, 260, 272, number, material};
    char names[64];
    const uint64_t inf = 0x7ff0000000000000u, far = 77777;
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        memcpy(bent, saved, kit.bytes);
        memcpy(bent + places[i], places[i] == number ? &inf : &far, places[i] == number ? 8 : 4);
        assert_int_equal(mild_ground_restore(kit.ground, bent, kit.bytes, &error),
                         MILD_ERROR_FORMAT);
        assert_memory_equal(kit.ground, saved, kit.bytes);
    }
    const double wears[] = {-0.1, 0.0, 0.999, 1.0}; /* nothing carries nothing at all */
    for (int i = 0; i < 4; i++) {
        memcpy(bent, saved, kit.bytes);
        memcpy(bent + 320 + 80 * 9 * sizeof(double), &wears[i], sizeof wears[i]);
        assert_int_equal(mild_ground_restore(kit.ground, bent, kit.bytes, &error),
                         i % 3 ? MILD_OK : MILD_ERROR_FORMAT);
    }
    assert_int_equal(mild_ground_restore(kit.ground, saved, kit.bytes, &error), MILD_OK);
    assert_int_equal(mild_ground_restore(kit.ground, saved, kit.bytes - 1, &error),
                     MILD_ERROR_FORMAT);
    snprintf(names, sizeof names, "%zu %zu", kit.bytes - 1, kit.bytes);
    assert_error(&error, MILD_ERROR_FORMAT, names);
    free(saved);
    free(bent);
    kit_close(&kit);
    mild_sole_destroy(left);
    mild_sole_destroy(right);
}

/* What must not matter to the last bit: which ground a scratch served before, good or bad, and
 * where a ground's block lies. */

enum { ROBOTS = 6 };

static MildMaterial any_material(uint64_t *random) {
    static const MildModel models[8] = {
        MILD_MODEL_MILD,      MILD_MODEL_MILD,         MILD_MODEL_MILD,   MILD_MODEL_ECC_SPRING,
        MILD_MODEL_ECC_QUASI, MILD_MODEL_ECC_QUASI_3D, MILD_MODEL_BEKKER, MILD_MODEL_HUNT_CROSSLEY};
    MildMaterial m = kit_index(random, 5) ? kit_material(random) : mild_material_default();
    m.model = (int)models[kit_index(random, 8)];
    m.zeta = kit_uniform(random, 0.05, 1.5);
    m.passive = kit_index(random, 4) > 0;
    if (kit_index(random, 5) == 0) {
        m.bed_depth = kit_uniform(random, 0.001, 0.02);
    }
    return m;
}

static MildMap *any_map(uint64_t *random) {
    MildMapDef def = mild_map_def_default();
    def.kind = kit_index(random, 5);
    def.size = 1.0;
    def.amplitude = kit_uniform(random, 0.0, 0.03);
    def.slope = kit_uniform(random, -0.4, 0.4);
    def.patches = kit_index(random, 3);
    def.patch_size = 0.07;
    def.patch_count = 3;
    def.border = kit_index(random, 2) ? 0.05 : 0.0;
    MildError error = {0};
    MildMap *map = mild_map_create(&def, &error);
    expect_good(map != NULL, &error);
    return map;
}

/* A robot on some ground; *map to be destroyed after it, may be NULL. */
static void robot_open(Kit *kit, MildMap **map, int feet, MildSole *left, MildSole *right,
                       uint64_t *random) {
    static const double steps[3] = {1e-3, 2.5e-3, 5e-3};
    MildMaterial m = any_material(random);
    kit_open(kit, feet, left, right, &m, steps[kit_index(random, 3)]);
    if (kit_index(random, 3) == 0) {
        kit_prints(kit, 64);
    }
    *map = kit_index(random, 2) ? any_map(random) : NULL;
    while (kit->terrain.material_count < 3) {
        kit->terrain.materials[kit->terrain.material_count++] = any_material(random);
    }
    if (mild_terrain_set_map(&kit->terrain, *map, NULL) != MILD_OK) {
        fail_msg("%s", "labels");
    }
    kit_random_state(kit, random);
    for (int f = 0; f < feet; f++) {
        kit->input.position[f][2] += mild_terrain_height_at(
            &kit->terrain, kit->input.position[f][0], kit->input.position[f][1]);
    }
    if (kit_index(random, 5) == 0) {
        kit->input.solver = MILD_SOLVER_GAUSS_SEIDEL;
    }
    kit->input.max_iterations = kit->input.solver      ? 40
                                : kit_index(random, 3) ? 0
                                                       : 1 + kit_index(random, 30);
}

/* Solves the robot's step with one number that is none. */
static void solve_bad(Kit robot, uint64_t *random) {
    static const double bad[3] = {NAN, INFINITY, 1e300};
    kit_inverse_inertia(&robot);
    kit_free(&robot, NULL);
    MildContactInput *in = &robot.input;
    double *victims[6] = {&in->position[0][2],
                          &in->rotation[0][kit_index(random, 9)],
                          &in->velocity[0][kit_index(random, 6)],
                          &in->inverse_inertia[kit_index(random, 36)],
                          &in->free_velocity[kit_index(random, 6)],
                          &robot.terrain.materials[0].k_pen};
    *victims[kit_index(random, 6)] = bad[kit_index(random, 3)];
    kit_solve(&robot);
}

/* A copy of the robot's ground in a new block that starts 8 bytes after a multiple of 64, the old
 * one freed. */
static void robot_move(Kit *robot, char **block) {
    char *moved = aligned_alloc(64, robot->bytes + 64);
    memcpy(moved + 8, robot->ground, robot->bytes);
    free(*block);
    *block = moved;
    robot->ground = (MildGround *)(void *)(moved + 8);
}

static void assert_same_elements(const Kit *a, const Kit *b) {
    for (int f = 0; f < a->feet; f++) {
        MildElements p = mild_scratch_elements(a->scratch, f),
                     q = mild_scratch_elements(b->scratch, f);
        const double *const one[] = {p.depth,   p.normal,  p.tangent_x, p.tangent_y,
                                     p.point_x, p.point_y, p.point_z,   p.flat};
        const double *const other[] = {q.depth,   q.normal,  q.tangent_x, q.tangent_y,
                                       q.point_x, q.point_y, q.point_z,   q.flat};
        size_t count = (size_t)mild_sole_elements(a->soles[f]);
        for (int k = 0; k < 8; k++) {
            assert_memory_equal(one[k], other[k], count * sizeof(double));
        }
        assert_memory_equal(p.state, q.state, count);
        assert_memory_equal(p.slip, q.slip, count);
    }
}

/* One step of a robot with its own scratch, and of its twin with the common one, which others have
 * used. */
static void step_both(Kit *own, Kit *twin, char **block, const Kit *other, uint64_t *random) {
    double force[MILD_FEET_MAX][3];
    for (int i = 0; i < 3 * MILD_FEET_MAX; i++) {
        force[i / 3][i % 3] = kit_uniform(random, -100.0, 100.0);
    }
    kit_inverse_inertia(own);
    kit_free(own, (const double(*)[3])force);
    kit_solve(own);
    kit_copy_input(twin, own);
    twin->terrain = own->terrain;
    solve_bad(*other, random);
    for (int k = kit_index(random, 2); k >= 0; k--) {
        kit_solve(twin);
    }
    robot_move(twin, block);
    if (kit_index(random, 2)) {
        assert_same_elements(own, twin);
    }
    kit_advance(own);
    kit_advance(twin);
    assert_memory_equal(&own->result, &twin->result, sizeof own->result);
    assert_memory_equal(own->ground, twin->ground, own->bytes);
}

static int flies(const Kit *kit) {
    int wild = 0;
    for (int i = 0; i < 6 * kit->feet; i++) {
        wild |= !(fabs(kit->result.velocity[i]) < 100.0);
    }
    return wild;
}

/* Rounds of robots on all kinds of ground that take turns, with materials that change and feet that
 * are lifted. */
TEST(test_shared) {
    int patient = 0;
    for (int round = 0; round < 12; round++) {
        uint64_t random = 900u + (unsigned)round;
        int feet = 1 + kit_index(&random, 2), small = round % 3;
        MildSole *left =
            small ? kit_plate(small == 1 ? 1 : 7, small == 1 ? 1 : 5) : kit_sole(0, 77);
        MildSole *right = small ? kit_plate(5, 3) : kit_sole(1, 77);
        Kit own[ROBOTS], twin[ROBOTS];
        MildMap *maps[ROBOTS];
        char *blocks[ROBOTS] = {NULL};
        for (int r = 0; r < ROBOTS; r++) {
            robot_open(&own[r], &maps[r], feet, left, right, &random);
            twin[r] = own[r];
            twin[r].scratch = r ? twin[0].scratch : mild_scratch_create(own[r].soles, feet, NULL);
            robot_move(&twin[r], &blocks[r]);
        }
        for (int t = 0; t < 100; t++) {
            int r = kit_index(&random, ROBOTS);
            if (kit_index(&random, 20) == 0) {
                own[r].terrain.materials[0] = any_material(&random);
            }
            if (kit_index(&random, 20) == 0) {
                own[r].input.position[0][2] += kit_uniform(&random, -0.01, 0.3);
            }
            step_both(&own[r], &twin[r], &blocks[r], &twin[kit_index(&random, ROBOTS)], &random);
            patient += own[r].result.iterations > 20;
            if (!flies(&own[r])) {
                continue;
            }
            mild_ground_reset(own[r].ground);
            mild_ground_reset(twin[r].ground);
            kit_random_state(&own[r], &random);
        }
        mild_scratch_destroy(twin[0].scratch);
        for (int r = 0; r < ROBOTS; r++) {
            kit_close(&own[r]);
            free(blocks[r]);
            mild_map_destroy(maps[r]);
        }
        mild_sole_destroy(left);
        mild_sole_destroy(right);
    }
    assert_true(patient > 20);
}

TEST_MAIN(NULL, NULL)
