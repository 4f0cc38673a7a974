/* What the elements of a batch remember beside mild/ground.h: how much of it, and how exactly. */
#include "batch_kit.h"
#include "ground/batch/batch.h"
#include "ground/law/law.h"
#include "ground/step/state.h"

static MildSole *left, *right;

static int open_soles(void **state) {
    (void)state;
    left = kit_sole(0, 77);
    right = kit_sole(1, 77);
    return 0;
}

static int close_soles(void **state) {
    (void)state;
    mild_sole_destroy(left);
    mild_sole_destroy(right);
    return 0;
}

enum { PLACES = 160, ELEMENT = 76 }; /* of a robot with these soles; one that is looked at */

static MildBatch *open_batch(int robots, MildError *error) {
    const MildSole *soles[2] = {left, right};
    const MildBatchDef def = {
        .robots = robots, .feet = 2, .soles = soles, .dt = 5e-3, .device = MILD_BATCH_HOST};
    return mild_batch_create(&def, error);
}

/* There is wear from the first material that wears on. All else that is remembered stays. */
TEST(wear_begins_with_a_material_that_wears) {
    MildError e = {0};
    MildMaterial sand = mild_material_default();
    MildBatch *batch = open_batch(3, &e);
    Kit kit;
    kit_open(&kit, 2, left, right, &sand, 5e-3);
    MildGround *ground = kit.ground;
    const Memory memory = ground_memory(ground, 1);
    assert_int_equal(mild_batch_robot_bytes(batch), 8 * PLACES * sizeof(float));
    memory.depth_max[ELEMENT] = 0.01;
    assert_int_equal(mild_batch_load(batch, 2, ground, &e), MILD_OK);
    memory.worn[ELEMENT] = 0.25;
    assert_refused(mild_batch_load(batch, 0, ground, &e), MILD_ERROR_ARGUMENT, &e,
                   "robot 0 wears mild_batch_set_materials");
    sand.slip_length = 1e-3;
    assert_int_equal(mild_batch_set_materials(batch, &sand, 1, &e), MILD_OK);
    assert_int_equal(mild_batch_robot_bytes(batch), 9 * PLACES * sizeof(float));
    assert_int_equal(mild_batch_load(batch, 0, ground, &e), MILD_OK);
    for (int robot = 2; robot >= 0; robot -= 2) {
        assert_int_equal(mild_batch_store(batch, robot, ground, &e), MILD_OK);
        assert_true(memory.depth_max[ELEMENT] == (double)0.01f);
        assert_true(memory.worn[ELEMENT] == (robot > 0 ? 0.0 : 0.25));
        assert_true(memory.worn[ELEMENT - 1] == 0.0);
    }
    const uint8_t first[3] = {1, 0, 0};
    assert_int_equal(mild_batch_load(batch, 1, ground, &e), MILD_OK);
    assert_int_equal(mild_batch_reset(batch, first, NULL, &e), MILD_OK);
    for (int robot = 0; robot < 2; robot++) {
        assert_int_equal(mild_batch_store(batch, robot, ground, &e), MILD_OK);
        assert_true(memory.worn[ELEMENT] == (robot > 0 ? 0.25 : 0.0));
    }
    assert_int_equal(mild_batch_set_map(batch, NULL, &e), MILD_OK);
    assert_int_equal(mild_batch_store(batch, 1, ground, &e), MILD_OK);
    assert_true(memory.depth_max[ELEMENT] == 0.0 && memory.worn[ELEMENT] == 0.0);
    mild_batch_destroy(batch);
    kit_close(&kit);
}

enum { CREEPS = 4000 }; /* steps: 20 s */

/* A step of the batch at the problem of a kit. */
static void step_as(MildBatch *batch, const Kit *kit, float wrench[12]) {
    static float position[6], rotation[18], velocity[12], inverse_inertia[144], free_velocity[12];
    static float after[12];
    MildError e = {0};
    to_float(position, kit->input.position[0], 6);
    to_float(rotation, kit->input.rotation[0], 18);
    to_float(velocity, kit->input.velocity[0], 12);
    to_float(inverse_inertia, kit->A, 144);
    to_float(free_velocity, kit->input.free_velocity, 12);
    const MildBatchInput input = {.position = position,
                                  .rotation = rotation,
                                  .velocity = velocity,
                                  .inverse_inertia = inverse_inertia,
                                  .free_velocity = free_velocity};
    const MildBatchOutput output = {.wrench = wrench, .velocity = after};
    expect_good(mild_batch_step(batch, &input, &output, 1, NULL, &e) == MILD_OK, &e);
}

/* [m] The way that an element has made in the ground, counted or not. */
static double way(const MildGround *ground, int foot, int element) {
    const Memory memory = ground_memory(ground, foot);
    return memory.drift[element] + hypot(memory.pending_x[element], memory.pending_y[element]);
}

/* Feet that creep at 32 and 0.5 um/s count their ways as mild/ground.h does, within what a step may
 * round off the motion that is not yet counted. */
TEST(creep_is_counted) {
    const double speed[2][2] = {{3e-5, 1e-5}, {4e-7, -3e-7}};
    const double rounded = CREEPS * 1e-5 / 65534 * sqrt(2.0) + 1e-8; /* and the sums of floats */
    const MildMaterial sand = mild_material_default();
    MildError e = {0};
    MildBatch *batch = open_batch(1, &e);
    Kit kit, found;
    float wrench[12];
    kit_open(&kit, 2, left, right, &sand, 5e-3);
    kit_open(&found, 2, left, right, &sand, 5e-3);
    for (int f = 0; f < 2; f++) {
        kit.input.position[f][2] -= 0.01;
        for (int k = 0; k < 2; k++) {
            kit.input.velocity[f][k] = kit.input.free_velocity[6 * f + k] = speed[f][k];
        }
    }
    for (int s = 0; s < CREEPS; s++) { /* without an inverse inertia feet move as they are led */
        kit_solve(&kit);
        mild_ground_advance(kit.ground, &kit.terrain, &kit.input, kit.scratch, &kit.result);
        step_as(batch, &kit, wrench);
    }
    assert_int_equal(mild_batch_store(batch, 0, found.ground, &e), MILD_OK);
    for (int f = 0; f < 2; f++) {
        double worst = 0.0;
        for (int i = 0; i < 77; i++) {
            worst = fmax(worst, fabs(way(found.ground, f, i) - way(kit.ground, f, i)));
        }
        assert_true(way(kit.ground, f, 0) > 0.99 * CREEPS * 5e-3 * hypot(speed[f][0], speed[f][1]));
        expect_below("way of a creeping foot [m]", worst, rounded);
    }
    mild_batch_destroy(batch);
    kit_close(&kit);
    kit_close(&found);
}

/* A GPU's kernels for cones leave out the impulse of materials that create energy: a batch knows
 * when it has one. */
TEST(a_batch_knows_what_creates_energy) {
    MildError e = {0};
    MildBatch *batch = open_batch(1, &e);
    for (int which = 0; which < 6; which++) {
        MildMaterial sand[2] = {mild_material_default(), mild_material_default()};
        sand[1].model = which % 2 ? MILD_MODEL_MILD_MERGED : MILD_MODEL_MILD;
        sand[1].c_g = which / 2 == 1 ? -1.0 : sand[1].c_g;
        sand[1].c_d = which / 2 == 2 ? -1.0 : sand[1].c_d;
        for (int passive = 0; passive < 2; passive++) {
            sand[1].passive = passive;
            assert_int_equal(mild_batch_set_materials(batch, sand, 2, &e), MILD_OK);
            assert_int_equal((batch->curves & LAW_CREATES) != 0, !passive && which / 2 > 0);
        }
    }
    mild_batch_destroy(batch);
}

/* [N] Greatest difference of the feet's load of a step of a kit and of a batch at its input. */
static double step_beside(Kit *kit, MildBatch *batch) {
    float wrench[12];
    double worst = 0.0;
    kit_inverse_inertia(kit);
    kit_free(kit, NULL);
    kit_solve(kit);
    step_as(batch, kit, wrench);
    for (int f = 0; f < 2; f++) {
        worst = fmax(worst, fabs((double)wrench[6 * f + 2] - kit->result.foot[f].force[2]));
    }
    kit_advance(kit);
    return worst;
}

/* Materials that change under a robot change it as mild_ground_change does, and throw nothing. */
TEST(materials_change_under_a_robot) {
    static const char *const pairs[][2] = {{"sand_loose", "grass"},  {"sand_loose", "rubber"},
                                           {"foam60", "sand_dense"}, {"snow", "foam45"},
                                           {"rubber", "foam25"},     {"sand_dense", "sand_loose"}};
    for (size_t p = 0; p < sizeof pairs / sizeof *pairs; p++) {
        MildError e = {0};
        const MildMaterial from = kit_preset(pairs[p][0]), to = kit_preset(pairs[p][1]);
        MildBatch *batch = open_batch(1, &e);
        Kit kit;
        kit_open(&kit, 2, left, right, &from, 5e-3);
        kit.inertia[0] = kit.inertia[1] = 1e3; /* the feet do not topple */
        kit.input.position[0][2] = kit.input.position[1][2] = -KIT_SOLE_Z - 0.08;
        for (int s = 0; s < 200; s++) {
            kit_step(&kit, NULL);
            for (int k = 0; k < 12; k++) { /* it comes to rest */
                kit.input.velocity[k / 6][k % 6] *= 0.8;
            }
        }
        assert_int_equal(mild_batch_set_materials(batch, &from, 1, &e), MILD_OK);
        assert_int_equal(mild_batch_load(batch, 0, kit.ground, &e), MILD_OK);
        assert_true(step_beside(&kit, batch) < 2.0);
        const double stood = kit.input.position[0][2];
        const MildTerrain old = kit.terrain;
        kit.terrain.materials[0] = to;
        mild_ground_change(kit.ground, &old, &kit.terrain, kit.scratch);
        assert_int_equal(mild_batch_change_materials(batch, &to, 1, NULL, &e), MILD_OK);
        double worst = 0.0, highest = -1.0;
        for (int s = 0; s < 300; s++) {
            worst = fmax(worst, step_beside(&kit, batch));
            highest = fmax(highest, kit.input.position[0][2] - stood);
            if (s == 100) { /* the batch stores what is lower */
                assert_int_equal(mild_batch_store(batch, 0, kit.ground, &e), MILD_OK);
            }
        }
        expect_below("load after the change [N]", worst, 4.0);
        expect_below("rise after the change [m]", highest, 1e-4);
        kit_close(&kit);
        mild_batch_destroy(batch);
    }
}

/* A ground has MILD_MATERIALS_MAX materials. On a map of more labels than that nothing changes. */
TEST(a_map_of_many_labels_is_refused) {
    enum { LABELS = 2 * MILD_MATERIALS_MAX };
    MildError e = {0};
    const MildMaterial sand = mild_material_default(), grass = kit_preset("grass");
    MildMapDef def = mild_map_def_default();
    def.patches = MILD_PATTERN_STRIPES;
    const int32_t none[LABELS] = {0};
    for (def.patch_count = MILD_MATERIALS_MAX; def.patch_count <= LABELS;
         def.patch_count += MILD_MATERIALS_MAX) {
        MildMap *map = mild_map_create(&def, &e);
        MildBatch *batch = open_batch(1, &e);
        assert_int_equal(mild_batch_set_materials(batch, &sand, 1, &e), MILD_OK);
        assert_int_equal(mild_batch_set_map(batch, map, &e), MILD_OK);
        const MildStatus status = mild_batch_change_materials(batch, &grass, 1, none, &e);
        if (def.patch_count == LABELS) {
            assert_refused(status, MILD_ERROR_RANGE, &e, "24 12 mild_batch_set_materials");
        } else {
            expect_good(status == MILD_OK, &e);
        }
        mild_batch_destroy(batch);
        mild_map_destroy(map);
    }
}

TEST_MAIN(open_soles, close_soles)
