/* In which order a GPU steps the robots of a batch (order.h): pairs are robots, and each robot is
 * stepped once however many there are. */
#include "herd_kit.h"

static const Shape shapes[] = {
    {"mild", 2, MILD_MODEL_MILD, MILD_MAP_FLAT, MILD_PATTERN_NONE, 0},
    {"mild_merged", 2, MILD_MODEL_MILD_MERGED, MILD_MAP_FLAT, MILD_PATTERN_NONE, 0},
    {"ecc_quasi_3d", 2, MILD_MODEL_ECC_QUASI_3D, MILD_MAP_FLAT, MILD_PATTERN_NONE, 0},
    {"bekker", 2, MILD_MODEL_BEKKER, MILD_MAP_FLAT, MILD_PATTERN_NONE, 0},
};
enum { SHAPES = sizeof shapes / sizeof *shapes };

static Herd herd;
static Arrays arrays, other;

/* Throws a foot of two robots in three up now and then, some fast. */
static void herd_throw_up(int step) {
    for (int r = 0; r < ROBOTS && step % 8 == 0; r++) {
        const int f = (r + step / 8) % 2;
        const double up = (r % 3 == 2 ? 0.8 : 0.2) * (1 + r % 4);
        herd.kit[r].input.velocity[f][2] += r % 3 ? up : 0.0;
    }
}

/* A step later these are clear of the ground, and here come from above: as if they had been so at
 * the middle of the last step, which their memory denies. */
static void herd_mislead(int step) {
    for (int r = 2; r < ROBOTS && step % 8 == 1; r += 3) {
        const int f = (r + step / 8) % 2;
        arrays.velocity[12 * r + 6 * f + 2] = -3;
    }
}

/* Robots of the last step that were in pairs, and that were taken for one and were none
 * (order.h). */
static void count_pairs(const Side *side, int *paired, int *left) {
    static int32_t order[ROBOTS * BATCH_ORDER];
    side_copy(side, order, side->batch->arrays.order, sizeof order);
    if (order[0] == order[1]) {
        return; /* as it was made */
    }
    for (int i = 0; i < ROBOTS; i++) {
        *paired += order[i] % 4 != 3;
    }
    *paired -= order[2 * ROBOTS];
    *left += order[2 * ROBOTS];
}

/* Two robots of a warp that have a foot in the air are as one alone is, and the same bits in every
 * run. */
TEST(device_pairs_are_robots) {
    if (!has_device()) {
        skip();
    }
    int left_of_all = 0;
    for (int i = 0; i < SHAPES; i++) {
        static Errors errors;
        Side alone, pairs, again;
        int paired = 0, left = 0;
        errors.count = 0;
        herd_open(&herd, &shapes[i]);
        side_open(&alone, &herd, 0);
        side_open(&pairs, &herd, 0);
        side_open(&again, &herd, 0);
        pairs.batch->pairs_from = again.batch->pairs_from = 1;
        for (int s = 0; s < some_steps(); s++) {
            herd_throw_up(s);
            herd_solve(&herd, &arrays);
            herd_mislead(s);
            side_step(&again, &arrays, 1);
            other = arrays;
            side_step(&pairs, &arrays, 1);
            assert_memory_equal(arrays.wrench, other.wrench, sizeof arrays.wrench);
            assert_memory_equal(arrays.after, other.after, sizeof arrays.after);
            count_pairs(&pairs, &paired, &left);
            side_step(&alone, &other, 1);
            against_other(&errors, herd.feet, &arrays, &other);
            herd_advance(&herd);
            side_follow(&alone, &herd);
            side_follow(&pairs, &herd);
            side_follow(&again, &herd);
        }
        check_errors(shapes[i].name, &errors, 1e-5, 1e-3);
        print_message("    %d of %d robots were in pairs, %d were left\n", paired,
                      some_steps() * ROBOTS, left);
        const MildModel model = shapes[i].model;
        const int makes = model == MILD_MODEL_MILD || model == MILD_MODEL_MILD_MERGED;
        assert_true(!makes || paired > some_steps() * ROBOTS / 5);
        left_of_all += left;
        side_close(&alone);
        side_close(&pairs);
        side_close(&again);
        herd_close(&herd);
    }
    assert_true(left_of_all > 0);
}

/* ---- more robots than a chunk has ---- */

enum { MANY = 1027 };

/* As Arrays, of robots with two feet. */
typedef struct {
    float position[MANY * 6], rotation[MANY * 18], velocity[MANY * 12];
    float inverse_inertia[MANY * 144], free_velocity[MANY * 12], height[MANY];
    int32_t material[MANY];
    float wrench[MANY * 12], after[MANY * 12];
} Many;

static Many many;

/* Robot r has the problem of robot r % ROBOTS of `from`, and no results. */
static void many_take(const Arrays *from) {
    memset(&many, 0xff, sizeof many);
    for (int r = 0; r < MANY; r++) {
        const int of = r % ROBOTS;
        memcpy(many.position + 6 * r, from->position + 6 * of, 6 * sizeof(float));
        memcpy(many.rotation + 18 * r, from->rotation + 18 * of, 18 * sizeof(float));
        memcpy(many.velocity + 12 * r, from->velocity + 12 * of, 12 * sizeof(float));
        memcpy(many.free_velocity + 12 * r, from->free_velocity + 12 * of, 12 * sizeof(float));
        memcpy(many.inverse_inertia + 144 * r, from->inverse_inertia + 144 * of,
               144 * sizeof(float));
        many.height[r] = from->height[of];
        many.material[r] = from->material[of];
    }
}

/* Steps the robots of a batch with the problems of `many` and fetches all; d: there. */
static void many_step(MildBatch *batch, Many *d) {
    MildError error = {0};
    const MildBatchInput input = {d->position,      d->rotation, d->velocity, d->inverse_inertia,
                                  d->free_velocity, d->material, d->height,   NULL};
    const MildBatchOutput output = {.wrench = d->wrench, .velocity = d->after};
    expect_good(device_copy(0, d, &many, sizeof many, &error) == MILD_OK, &error);
    expect_good(mild_batch_step(batch, &input, &output, 1, NULL, &error) == MILD_OK, &error);
    expect_good(device_copy(0, &many, d, sizeof many, &error) == MILD_OK, &error);
}

/* So many robots step as the few do whose problems they have, to the bit. */
static void many_on(const Shape *shape, int count) {
    MildError error = {0};
    Side few;
    herd_open(&herd, shape);
    side_open(&few, &herd, 0);
    few.batch->pairs_from = 1;
    const MildBatchDef def = {
        .robots = count, .feet = 2, .soles = herd.soles, .dt = 5e-3, .device = 0};
    MildBatch *batch = mild_batch_create(&def, &error);
    Many *device = device_alloc(0, sizeof many, &error);
    if (!batch || !device ||
        mild_batch_set_materials(batch, herd.material, MATERIALS, &error) != MILD_OK) {
        fail_msg("%s", error.text);
    }
    batch->pairs_from = 1;
    for (int s = 0; s < 12; s++) {
        herd_throw_up(s);
        herd_solve(&herd, &arrays);
        herd_mislead(s);
        many_take(&arrays);
        many_step(batch, device);
        side_step(&few, &arrays, 1);
        for (int r = 0; r < count; r++) {
            const int of = 12 * (r % ROBOTS);
            const size_t bytes = 12 * sizeof(float);
            if (memcmp(many.wrench + 12 * r, arrays.wrench + of, bytes) != 0 ||
                memcmp(many.after + 12 * r, arrays.after + of, bytes) != 0) {
                fail_msg("%s, %d robots, step %d: robot %d is another", shape->name, count, s, r);
            }
        }
        herd_advance(&herd);
    }
    device_free(0, device);
    mild_batch_destroy(batch);
    side_close(&few);
    herd_close(&herd);
}

/* Chunks of as many robots, of one more or less, of odd and even numbers. */
TEST(device_steps_each_robot_of_many) {
    const int counts[] = {257, 300, 513, 1000, 1025, MANY};
    if (!has_device()) {
        skip();
    }
    for (int i = 0; i < SHAPES; i++) {
        for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
            many_on(&shapes[i], counts[k]);
        }
    }
}

TEST_MAIN(open_soles, close_soles)
