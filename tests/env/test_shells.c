/* Environments of the batch engine whose robots' shells stand on soft ground, against those of the
 * CPU, which MuJoCo steps; and against themselves without, where no shell is near the ground. With
 * MILD_CUDA on the device too. */
#include "env/batch_arrays.h"
#include "env/kernels.h"
#include "follow.h"
#include "ground/batch/bodies.h"

#define G1 MILD_SOURCE_DIR "/robots/g1"

static int has_device(void) {
    MildError error;
    return device_open(0, &error) == MILD_OK;
}

/* Robots that fall: until the base is on the ground. */
static TaskDef shells_def(void) {
    TaskDef def = some_def();
    def.shells_stand = 1;
    def.tilt_limit = 2;
    def.randomize.rigid_share = 0.1;
    return def;
}

/* Of environments of the batch engine, in the last physics step: had shells near the ground. */
static void read_held(uint8_t held[ENVS]) {
    MildError error = {0};
    const EnvsArrays *all = envs_batch_arrays(pair.batch);
    assert_int_equal(device_copy(pair.device, held, all->shells.held, ENVS, &error), MILD_OK);
}

/* Largest difference of what the critic sees, but for the depths of corners, which jump. */
static double critics_apart(int e) {
    const TaskShape *shape = &pair.shape;
    const int depths = shape->observation + shape->estimates;
    double most = 0;
    for (int i = 0; i < shape->critic; i++) {
        const int depth = i >= depths && i < depths + 6 * shape->feet && (i - depths) % 6 == 5;
        const int at = e * shape->critic + i;
        const double gap = fabs((double)pair.a.critic[at] - (double)pair.b.critic[at]);
        most = depth ? most : gap > most || gap != gap ? gap : most;
    }
    return most;
}

/* The same in all steps of an environment, so that it falls. */
static void draw_falls(int t, double most) {
    draw_actions(t);
    for (int e = 0; e < ENVS; e++) {
        Random r = random_at(4, (uint32_t)e, 0);
        for (int i = 0; i < pair.shape.actions; i++) {
            pair.a.action[e * pair.shape.actions + i] += (float)(most * (2 * random_unit(&r) - 1));
        }
    }
}

/* Steps, and those in which the two agree; with shells near the ground, the same. */
typedef struct {
    int steps, together, near, near_together;
    int ends[TASK_END_COUNT];
    double first; /* largest growth of the critics' difference where shells have just come near */
} Falls;

/* Whether robots have fallen for long enough: until some have begun again and `check` sees enough
 * of them lie, earlier where MILD_TEST_SHORT is set. */
static int has_fallen(const Falls *falls, int t) {
    return t == STEPS || (t >= (kit_short() ? some_steps() : STEPS / 2) && falls->near > 300);
}

/* As follow, of robots that fall. An environment is left alone once it differs, until its next
 * episode: a fall doubles a difference within a few steps. */
static Falls fall(const char *robot, TaskDef def, int device, const MildMapDef *on, double most) {
    MildMap *map = on ? mild_map_create(on, NULL) : NULL;
    Falls falls = {0};
    int apart[ENVS] = {0};
    uint8_t held[ENVS], before[ENVS] = {0};
    double last[ENVS] = {0}; /* gap of the step before */
    def.map = map;
    pair_open(robot, &def, device);
    pair_reset();
    for (int t = 0; !has_fallen(&falls, t); t++) {
        draw_falls(t, most);
        pair_step();
        read_held(held);
        for (int e = 0; e < ENVS; e++) {
            const double gap = critics_apart(e);
            const int done = pair.a.done[e] != 0, same = done == (pair.b.done[e] != 0);
            apart[e] |= !same || !(gap < 1e-2);
            falls.steps++;
            falls.together += !apart[e];
            falls.near += held[e] != 0;
            if (device == MILD_BATCH_HOST && held[e] && !done) {
                assert_true(episode_of(pair.batch, e).shells_stand);
            }
            falls.near_together += held[e] && !apart[e];
            if (!apart[e]) {
                assert_int_equal(pair.a.cause[e], pair.b.cause[e]);
                falls.ends[pair.b.cause[e]] += done;
                const int near = held[e] && !before[e] && !done;
                falls.first = fmax(falls.first, near ? gap - last[e] : 0);
            }
            apart[e] = done && same ? 0 : apart[e];
            before[e] = done ? 0 : held[e];
            last[e] = done ? 0 : gap;
        }
    }
    printf(
        "%s, device %d%s: %d of %d steps together, with shells near the ground %d of %d; critics "
        "differ by %.1e at most where they come near;",
        robot_name(pair.robot), device, on ? ", on a map" : "", falls.together, falls.steps,
        falls.near_together, falls.near, falls.first);
    for (int end = 0; end < TASK_END_COUNT; end++) {
        printf(" %s %d%s", task_end_names[end], falls.ends[end],
               end < TASK_END_COUNT - 1 ? "," : "\n");
    }
    pair_close();
    mild_map_destroy(map);
    return falls;
}

static void check(Falls falls, double least) {
    assert_true(falls.near > 200 && falls.near_together > least * falls.near);
    assert_true(falls.together > least * falls.steps);
    assert_true(falls.first < 1e-3); /* 9e-3 with bodies that touch a physics step late */
}

TEST(falls_are_those_of_mujoco) {
    const MildMapDef map = some_map();
    const Falls level = fall(SA01, shells_def(), MILD_BATCH_HOST, NULL, 2);
    check(level, 0.5);
    assert_true(level.ends[TASK_END_base] > 0);
    if (!kit_short()) {
        check(fall(SA01, shells_def(), MILD_BATCH_HOST, &map, 2), 0.5);
        check(fall(G1, shells_def(), MILD_BATCH_HOST, NULL, 2), 0.5);
    }
    check(fall(GO1, shells_def(), MILD_BATCH_HOST, &map, 2), 0.5);
}

/* Robots of every fourth episode stand, the others are dropped and may lie. */
static TaskDef drop_def(TaskStart start) {
    TaskDef def = shells_def();
    def.start = (int)start;
    def.start_share = 0.75;
    def.settle = 0.3;
    def.may_lie = 1;
    return def;
}

/* From the first pose on: same_episode compares it. No tilt and no base ends one on soft ground. */
TEST(drops_are_those_of_mujoco) {
    const MildMapDef map = some_map();
    TaskDef def = drop_def(TASK_START_ANY);
    for (int on_map = 0; on_map < 2; on_map++) {
        MildMap *uneven = on_map ? mild_map_create(&map, NULL) : NULL;
        int dropped = 0;
        def.map = uneven;
        pair_open(GO1, &def, MILD_BATCH_HOST);
        pair_reset();
        for (int e = 0; e < ENVS; e++) {
            size_t bytes;
            const char *envs = envs_state(pair.mujoco, &bytes);
            const size_t stride = bytes / ENVS;
            dropped += ((const TaskEnv *)(const void *)(envs + (size_t)e * stride))->dropped;
            same_episode(e);
            compare(-1, e, 2e-5);
        }
        assert_true(dropped > ENVS / 2 && dropped < ENVS * 0.9);
        pair_close();
        mild_map_destroy(uneven);
    }
    def.map = NULL;
    const Falls level = fall(GO1, def, MILD_BATCH_HOST, NULL, 2);
    check(level, 0.5);
    const Falls waves = fall(GO1, drop_def(TASK_START_BACK), MILD_BATCH_HOST, &map, 2);
    check(waves, 0.5);
}

/* Robots that do not fall, with shells that stand and without. Steps up to the first one with a
 * shell near the ground, and those of them that have the same bits. */
static void stand_twice(int device, const MildMapDef *on, int *far, int *same) {
    static Rows without[STEPS];
    uint8_t held[ENVS], near[ENVS] = {0};
    MildMap *map = on ? mild_map_create(on, NULL) : NULL;
    *far = *same = 0;
    for (int stand = 0; stand < 2; stand++) {
        TaskDef def = shells_def();
        def.shells_stand = stand;
        def.map = map;
        pair_open(SA01, &def, device);
        pair_reset();
        for (int t = 0; t < some_steps(); t++) {
            draw_actions(t);
            pair_step();
            if (!stand) {
                without[t] = pair.b;
                continue;
            }
            read_held(held);
            for (int e = 0; e < ENVS; e++) {
                const size_t width = (size_t)pair.shape.critic, at = (size_t)e * width;
                near[e] |= held[e];
                *far += !near[e];
                *same +=
                    !near[e] && pair.b.reward[e] == without[t].reward[e] &&
                    memcmp(pair.b.critic + at, without[t].critic + at, width * sizeof(float)) == 0;
            }
        }
        pair_close();
    }
    mild_map_destroy(map);
    print_message(
        "device %d%s: %d of %d steps without a shell near the ground, %d with the same bits\n",
        device, on ? ", on a map" : "", *far, ENVS * some_steps(), *same);
}

/* Low steps, with edges as steep as they can be: the bound on the depth of a shell has the steepest
 * place of the map in it, its elements have not. */
static MildMapDef steep_map(void) {
    MildMapDef map = mild_map_def_default();
    map.kind = MILD_MAP_STEPS;
    map.amplitude = 0.02;
    map.cell = 0.002;
    return map;
}

/* In the air they change no bit. */
TEST(far_shells_change_no_bit) {
    const MildMapDef map = steep_map();
    int far, same;
    stand_twice(MILD_BATCH_HOST, NULL, &far, &same);
    assert_true(far > ENVS * some_steps() / 2 && same == far);
    /* `held` is of the last physics step: some had a shell near the ground in the first alone */
    stand_twice(MILD_BATCH_HOST, &map, &far, &same);
    assert_true(far > ENVS * some_steps() * 3 / 4);
}

/* ---- shells that do not stand in all episodes ---- */

/* The rows of the CPU and of the batch engine after each step of robots that fall, half of them on
 * rigid ground. */
typedef struct {
    Rows a[STEPS], b[STEPS];
} Fallen;

static void record_falls(int stand, double share, Fallen *record) {
    TaskDef def = shells_def();
    def.shells_stand = stand;
    def.randomize.shells_share = share;
    def.randomize.rigid_share = 0.5;
    pair_open(GO1, &def, MILD_BATCH_HOST);
    pair_reset();
    for (int t = 0; t < some_steps(); t++) {
        draw_falls(t, 2);
        pair_step();
        record->a[t] = pair.a;
        record->b[t] = pair.b;
    }
    pair_close();
}

static int same_rows(const Rows *x, const Rows *y, int e) {
    const size_t width = (size_t)pair.shape.critic, at = (size_t)e * width;
    return x->reward[e] == y->reward[e] && x->done[e] == y->done[e] && x->cause[e] == y->cause[e] &&
           memcmp(x->critic + at, y->critic + at, width * sizeof(float)) == 0;
}

/* With a share of 0 no bit differs from robots without shells, with 1 the steps after a touch. */
TEST(in_no_episode_is_without) {
    static Fallen without, none, all;
    int same[2] = {0, 0}, touched[2] = {0, 0}, shell_ends = 0;
    record_falls(0, 1, &without);
    record_falls(1, 0, &none);
    record_falls(1, 1, &all);
    for (int t = 0; t < some_steps(); t++) {
        for (int e = 0; e < ENVS; e++) {
            same[0] += same_rows(&none.a[t], &without.a[t], e);
            same[1] += same_rows(&none.b[t], &without.b[t], e);
            touched[0] += !same_rows(&all.a[t], &without.a[t], e);
            touched[1] += !same_rows(&all.b[t], &without.b[t], e);
            shell_ends += none.a[t].done[e] && none.a[t].cause[e] == TASK_END_shell;
        }
    }
    const int steps = ENVS * some_steps();
    print_message("%d and %d of %d steps as without shells; %d and %d differ from shells that "
                  "stand; %d ends by a shell\n",
                  same[0], same[1], steps, touched[0], touched[1], shell_ends);
    assert_true(same[0] == steps && same[1] == steps);
    assert_true(touched[0] > steps / 10 && touched[1] > steps / 10 && shell_ends > 0);
}

/* Half of the robots: those of MuJoCo, and the ground touches no shell of the others (fall). */
static TaskDef half_def(void) {
    TaskDef def = shells_def();
    def.randomize.shells_share = 0.5;
    return def;
}

TEST(in_half_of_the_episodes) {
    const TaskDef def = half_def();
    int stand = 0;
    pair_open(GO1, &def, MILD_BATCH_HOST);
    pair_reset();
    for (int e = 0; e < ENVS; e++) {
        same_episode(e);
        stand += episode_of(pair.batch, e).shells_stand;
    }
    pair_close();
    print_message("the shells of %d of %d robots stand\n", stand, ENVS);
    assert_true(stand > ENVS / 4 && stand < ENVS * 3 / 4);
    check(fall(GO1, def, MILD_BATCH_HOST, NULL, 2), 0.5);
}

/* Robots that stagger, whose shells may come near. */
TEST(standing_robots_follow_mujoco) {
    follow(SA01, shells_def(), MILD_BATCH_HOST, NULL, 0.85);
}

/* A model of one element has none for shells. */
TEST(models_of_one_element_have_no_shells) {
    TaskDef def = shells_def();
    def.randomize.model = MILD_MODEL_CON_CONE;
    pair_open(SA01, &def, MILD_BATCH_HOST);
    assert_null(envs_batch_arrays(pair.batch)->shells.setup);
    pair_close();
}

TEST(device_falls_are_those_of_mujoco) {
    if (!has_device()) {
        skip();
    }
    const MildMapDef map = some_map();
    check(fall(SA01, shells_def(), 0, NULL, 2), 0.5);
    check(fall(SA01, shells_def(), 0, &map, 2), 0.5);
    check(fall(G1, shells_def(), 0, NULL, 2), 0.5);
    check(fall(GO1, shells_def(), 0, &map, 2), 0.5);
    check(fall(GO1, drop_def(TASK_START_ANY), 0, NULL, 2), 0.5);
    check(fall(GO1, half_def(), 0, NULL, 2), 0.5);
    follow(SA01, shells_def(), 0, NULL, 0.85);
    int far, same;
    stand_twice(0, NULL, &far,
                &same); /* `part` is compiled once more, which may round in other places */
    assert_true(far > ENVS * some_steps() / 2);
}

TEST_MAIN(NULL, NULL)
