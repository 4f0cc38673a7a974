/* What the elements of a batch remember beside mild/ground.h: how much of it, and how exactly. */
#include "batch_kit.h"
#include "ground/state.h"

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

TEST_MAIN(open_soles, close_soles)
