/* What must not matter to the last bit: which ground a scratch served before, good or bad, and
 * where a ground's block lies. */
#include "ground_kit.h"

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
