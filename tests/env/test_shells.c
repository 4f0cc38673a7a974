/* Environments of the batch engine whose robots fall with shells that stand, on soft and on rigid
 * ground, against those of the CPU, which MuJoCo steps: the same robots, the same load on the
 * shells, the same ends; and against themselves without, where no shell is near the ground. With
 * MILD_CUDA on the device too. */
#include "env/batch_arrays.h"
#include "env/kernels.h"
#include "follow.h"
#include "ground/batch/bodies.h"

#define G1 MILD_SOURCE_DIR "/robots/g1"

enum { PHYSICS_STEPS = 2 };

static EnvsSample sample[2][ENVS][PHYSICS_STEPS]; /* of MuJoCo, of the batch engine */

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

/* The same on rigid ground alone. */
static TaskDef floor_def(void) {
    TaskDef def = shells_def();
    def.tilt_limit = 3.1;
    def.randomize.rigid_share = 1;
    return def;
}

static void open_pair(const char *robot, const TaskDef *def, int device) {
    pair_open(robot, def, device);
    envs_set_samples(pair.mujoco, sample[0][0]);
    envs_set_samples(pair.batch, sample[1][0]);
    assert_int_equal(envs_physics_steps(pair.batch), PHYSICS_STEPS);
    pair_reset();
}

/* Of environments of the batch engine, in the last physics step: had shells near the ground. */
static void read_held(uint8_t held[ENVS]) {
    MildError error = {0};
    const EnvsArrays *all = envs_batch_arrays(pair.batch);
    assert_int_equal(device_copy(pair.device, held, all->shells.held, ENVS, &error), MILD_OK);
}

/* Largest difference of what the critic sees, but for the depths of corners, which jump; on rigid
 * ground of its first part alone, the frame without noise, because forces jump there. */
static double critics_apart(int e, int rigid) {
    const TaskShape *shape = &pair.shape;
    const int depths = shape->observation + shape->estimates;
    double most = 0;
    for (int i = 0; i < (rigid ? shape->observation : shape->critic); i++) {
        const int depth = i >= depths && i < depths + 6 * shape->feet && (i - depths) % 6 == 5;
        const int at = e * shape->critic + i;
        const double gap = fabs((double)pair.a.critic[at] - (double)pair.b.critic[at]);
        most = depth ? most : gap > most || gap != gap ? gap : most;
    }
    return most;
}

/* The same in all steps of an environment, so that it falls. */
static void draw_falls(int t) {
    draw_actions(t);
    for (int e = 0; e < ENVS; e++) {
        Random r = random_at(4, (uint32_t)e, 0);
        for (int i = 0; i < pair.shape.actions; i++) {
            pair.a.action[e * pair.shape.actions + i] += (float)(4 * random_unit(&r) - 2);
        }
    }
}

/* [-] Largest difference of the load on the shells, of the weight; the least load in *load. */
static double loads_apart(int e, double *load) {
    const double weight = 9.81 * robot_total_mass(pair.robot);
    double most = 0;
    *load = INFINITY;
    for (int k = 0; k < PHYSICS_STEPS; k++) {
        const EnvsSample *a = &sample[0][e][k], *b = &sample[1][e][k];
        most = fmax(most, fabs(a->shell_load - b->shell_load) / weight);
        *load = fmin(*load, a->shell_load / weight);
    }
    return most;
}

/* Bool: MuJoCo's shells carry nothing and the batch engine's something. */
static int load_stayed(int e) {
    double load[2] = {0, 0};
    for (int k = 0; k < PHYSICS_STEPS; k++) {
        for (int n = 0; n < 2; n++) {
            load[n] = fmax(load[n], fabs(sample[n][e][k].shell_load));
        }
    }
    return load[0] == 0 && load[1] > 0;
}

/* Steps, and those in which the two agree. */
typedef struct {
    int steps, together;
    int near, near_together;     /* with shells near the ground */
    int loaded, loaded_together; /* with load on the shells, and the same load */
    int stayed;                  /* in which no shell is down and one carries */
    int ends[TASK_END_COUNT];
    double first; /* largest growth of the critics' difference where shells have just come near */
    double load;  /* mean where it is more than 0 */
} Falls;

/* Whether robots have fallen for long enough: until some have begun again and `check` sees enough
 * of them lie, earlier where MILD_TEST_SHORT is set. */
static int has_fallen(const Falls *falls, int t) {
    return t == STEPS || (t >= (kit_short() ? some_steps() : STEPS / 2) && falls->near > 300);
}

/* As follow, of robots that fall. An environment is left alone once it differs, until its next
 * episode: a fall doubles a difference within a few steps. */
static Falls fall(const char *robot, TaskDef def, int device, const MildMapDef *on) {
    const int rigid = def.randomize.rigid_share == 1;
    MildMap *map = on ? mild_map_create(on, NULL) : NULL;
    Falls falls = {0};
    int apart[ENVS] = {0};
    uint8_t held[ENVS], before[ENVS] = {0};
    double last[ENVS] = {0}; /* gap of the step before */
    def.map = map;
    open_pair(robot, &def, device);
    for (int t = 0; !has_fallen(&falls, t); t++) {
        draw_falls(t);
        pair_step();
        read_held(held);
        for (int e = 0; e < ENVS; e++) {
            const int done = pair.a.done[e] != 0, same = done == (pair.b.done[e] != 0);
            double load, gap = critics_apart(e, rigid), loads = loads_apart(e, &load);
            apart[e] |= !same || !(gap < 1e-2);
            falls.steps++;
            falls.together += !apart[e];
            falls.near += held[e] != 0;
            falls.near_together += held[e] && !apart[e];
            falls.loaded += load > 0;
            falls.loaded_together += load > 0 && !apart[e] && loads < 0.05;
            falls.load += load > 0 ? load : 0;
            falls.stayed += !apart[e] && load_stayed(e);
            if (device == MILD_BATCH_HOST && held[e] && !done) {
                assert_true(episode_of(pair.batch, e).shells_stand);
            }
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
    falls.load /= falls.loaded;
    printf("%s, device %d%s%s: %d of %d steps together, with shells near the ground %d of %d, with "
           "load (%.2f of the weight) %d of %d, in %d steps without MuJoCo's; critics differ by "
           "%.1e at most where they come near;",
           robot_name(pair.robot), device, rigid ? ", rigid" : "", on ? ", on a map" : "",
           falls.together, falls.steps, falls.near_together, falls.near, falls.load,
           falls.loaded_together, falls.loaded, falls.stayed, falls.first);
    for (int end = 0; end < TASK_END_COUNT; end++) {
        printf(" %s %d%s", task_end_names[end], falls.ends[end],
               end < TASK_END_COUNT - 1 ? "," : "\n");
    }
    pair_close();
    mild_map_destroy(map);
    return falls;
}

static void check(Falls falls) {
    assert_true(falls.near > 200 && falls.near_together > 0.5 * falls.near);
    assert_true(falls.together > 0.5 * falls.steps);
    assert_true(falls.first < 1e-3); /* 9e-3 with bodies that touch a physics step late */
}

/* No shell ends an episode. */
static void check_rigid(Falls falls) {
    assert_true(falls.loaded > 200 && falls.loaded_together > 0.9 * falls.loaded);
    assert_true(falls.together > 0.95 * falls.steps && falls.load > 0.1 && falls.load < 3);
    assert_true(falls.ends[TASK_END_shell] == 0);
    assert_true(falls.stayed <= 3); /* touchdowns within a rounding */
}

TEST(falls_are_those_of_mujoco) {
    const MildMapDef map = some_map();
    const Falls level = fall(SA01, shells_def(), MILD_BATCH_HOST, NULL);
    check(level);
    assert_true(level.ends[TASK_END_base] > 0);
    if (!kit_short()) {
        check(fall(SA01, shells_def(), MILD_BATCH_HOST, &map));
        check(fall(G1, shells_def(), MILD_BATCH_HOST, NULL));
    }
    check(fall(GO1, shells_def(), MILD_BATCH_HOST, &map));
}

TEST(falls_on_rigid_ground_are_those_of_mujoco) {
    const MildMapDef map = some_map();
    check_rigid(fall(SA01, floor_def(), MILD_BATCH_HOST, NULL));
    check_rigid(fall(GO1, floor_def(), MILD_BATCH_HOST, NULL));
    check_rigid(fall(GO1, floor_def(), MILD_BATCH_HOST, &map));
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
    check(fall(GO1, def, MILD_BATCH_HOST, NULL));
    check(fall(GO1, drop_def(TASK_START_BACK), MILD_BATCH_HOST, &map));
}

/* ---- without shells ---- */

/* The rows of the CPU and of the batch engine after each step of robots that fall, half of them on
 * rigid ground. */
typedef struct {
    Rows a[STEPS], b[STEPS];
    uint8_t near[STEPS][ENVS]; /* bool: a shell is, or has been, near soft ground or on rigid */
} Fallen;

static void record_falls(int stand, double share, Fallen *record) {
    TaskDef def = shells_def();
    uint8_t near[ENVS] = {0};
    def.shells_stand = stand;
    def.randomize.shells_share = share;
    def.randomize.rigid_share = 0.5;
    open_pair(GO1, &def, MILD_BATCH_HOST);
    for (int t = 0; t < some_steps(); t++) {
        draw_falls(t);
        pair_step();
        record->a[t] = pair.a;
        record->b[t] = pair.b;
        for (int e = 0; e < ENVS; e++) {
            near[e] |= sample[1][e][0].shell_load > 0 || sample[1][e][1].shell_load > 0;
        }
        if (stand) {
            uint8_t held[ENVS];
            read_held(held);
            for (int e = 0; e < ENVS; e++) {
                near[e] |= held[e];
            }
        }
        memcpy(record->near[t], near, sizeof near);
    }
    pair_close();
}

static int same_rows(const Rows *x, const Rows *y, int e) {
    const size_t width = (size_t)pair.shape.critic, at = (size_t)e * width;
    return x->reward[e] == y->reward[e] && x->done[e] == y->done[e] && x->cause[e] == y->cause[e] &&
           memcmp(x->critic + at, y->critic + at, width * sizeof(float)) == 0;
}

/* With a share of 0 no bit differs from robots without shells; with 1 none before a shell is near
 * the ground, where robots without end their episode or go on into it. */
TEST(far_shells_change_no_bit) {
    static Fallen without, none, all;
    const int steps = ENVS * some_steps();
    int same[2] = {0, 0}, touched[2] = {0, 0}, far = 0, same_far = 0, shell_ends = 0;
    int ended[ENVS] = {0};
    record_falls(0, 1, &without);
    record_falls(1, 0, &none);
    record_falls(1, 1, &all);
    for (int t = 0; t < some_steps(); t++) {
        for (int e = 0; e < ENVS; e++) {
            const int as_without = same_rows(&all.b[t], &without.b[t], e);
            same[0] += same_rows(&none.a[t], &without.a[t], e);
            same[1] += same_rows(&none.b[t], &without.b[t], e);
            touched[0] += !same_rows(&all.a[t], &without.a[t], e);
            touched[1] += !as_without;
            shell_ends += none.a[t].done[e] && none.a[t].cause[e] == TASK_END_shell;
            ended[e] |= without.b[t].done[e] && without.b[t].cause[e] == TASK_END_shell;
            far += !all.near[t][e] && !ended[e];
            same_far += !all.near[t][e] && !ended[e] && as_without;
        }
    }
    print_message("%d and %d of %d steps as without shells; %d and %d differ from shells that "
                  "stand, %d of %d before a shell is near; %d ends by a shell\n",
                  same[0], same[1], steps, touched[0], touched[1], far - same_far, far, shell_ends);
    assert_true(same[0] == steps && same[1] == steps);
    assert_true(touched[0] > steps / 10 && touched[1] > steps / 10 && shell_ends > 0);
    assert_true(far > steps / 4 && same_far == far);
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
    check(fall(GO1, def, MILD_BATCH_HOST, NULL));
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
    check(fall(SA01, shells_def(), 0, NULL));
    check(fall(SA01, shells_def(), 0, &map));
    check(fall(G1, shells_def(), 0, NULL));
    check(fall(GO1, shells_def(), 0, &map));
    check(fall(GO1, drop_def(TASK_START_ANY), 0, NULL));
    check(fall(GO1, half_def(), 0, NULL));
    check_rigid(fall(SA01, floor_def(), 0, NULL));
    check_rigid(fall(GO1, floor_def(), 0, NULL));
    follow(SA01, shells_def(), 0, NULL, 0.85);
}

TEST_MAIN(NULL, NULL)
