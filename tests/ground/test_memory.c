/* Stepping allocates nothing, and a state block is bytes, which are taken back or refused. */
#include "surface_kit.h"

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
 * nothing comes back, and nothing leaks. */
TEST(test_failing_allocations) {
    if (!COUNTING) {
        skip();
    }
    double vertices[18];
    const double box[8] = {0, 0, 0.1, 0, 0.1, 0.1, 0, 0.1};
    const MildShape shapes[2] = {surface_wedge(0.1, 0.1, 0.1, vertices),
                                 surface_box(0.2, 0.05, 0.05)};
    const MildSoleDef plane = {box, 4, KIT_PITCH, KIT_SOLE_Z, 0};
    const MildSurfaceDef shell = {.shapes = shapes, .count = 2, .pitch = 0.01};
    static const int least[3] = {2, 6, 2}; /* refusals */
    MildSole *soles[2] = {NULL, NULL};
    MildScratch *scratch = NULL;
    for (int what = 0; what < 3; what++) {
        int refused = 0;
        for (const void *made = NULL; !made; refused += !made) {
            MildError error = {0};
            fail_at = refused + 1;
            if (what < 2) {
                made = soles[what] =
                    what ? mild_sole_surface(&shell, &error) : mild_sole_create(&plane, &error);
            } else {
                made = scratch = mild_scratch_create((const MildSole *const *)soles, 2, &error);
            }
            fail_at = 0;
            assert_int_equal(error.status, made ? MILD_OK : MILD_ERROR_MEMORY);
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

TEST_MAIN(NULL, NULL)
