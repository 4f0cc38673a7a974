/* The environments of a device against those of the CPU, which MuJoCo steps: the same episodes, the
 * same observations and rewards. By the same text on the CPU; with MILD_CUDA on the device too. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "batch/batch.h"
#include "crowd/crowd.h"
#include "episode.h"
#include "mild/batch.h"
#include "sa01.h"
#include "task/ground.h"

enum { ENVS = 48, GROUNDS = 64, STEPS = 110 };

/* Rows of one time. */
typedef struct {
    float history[ENVS][SA01_HISTORY];
    float critic[ENVS][SA01_CRITIC];
    float estimate[ENVS][SA01_ESTIMATES];
    float frame[ENVS][SA01_OBSERVATION];
    float action[ENVS][SA01_JOINTS];
    float reward[ENVS];
    uint8_t done[ENVS], timeout[ENVS], valid[ENVS];
} Rows;

typedef struct {
    Robot *robot;
    Pool *pool;
    TaskDef def;
    TaskGrounds *grounds;
    Vec *vec;
    Crowd *crowd;
    int device;
    Rows a, b;     /* of vec, of crowd */
    Rows *on_side; /* of crowd, in the memory of its device */
} Pair;

static Pair pair;

static TaskDef some_def(void) {
    TaskDef def = task_def_default();
    def.physics_dt = 0.005;
    def.randomize.patch_share = 0;
    def.randomize.rigid_share = 0.3;
    def.episode = 1.2;
    return def;
}

static void pair_open(const TaskDef *def, int device) {
    MildError error = {0};
    memset(&pair, 0, sizeof pair);
    pair.device = device;
    pair.def = *def;
    pair.robot = robot_create(SA01, &error);
    assert_non_null(pair.robot);
    robot_set_model(pair.robot, (MildModel)def->randomize.model);
    pair.pool = pool_create(2);
    pair.grounds = task_grounds_create(def, pair.robot, GROUNDS, 7, pair.pool, &error);
    assert_non_null(pair.grounds);
    TaskDef with = *def;
    with.grounds = pair.grounds;
    pair.vec = vec_create(&with, pair.robot, pair.pool, ENVS, 7, &error);
    assert_non_null(pair.vec);
    const CrowdDef crowd = {.task = def,
                            .robot = pair.robot,
                            .pool = pair.pool,
                            .device = device,
                            .envs = ENVS,
                            .grounds = GROUNDS,
                            .seed = 7};
    pair.crowd = crowd_create(&crowd, &error);
    pair.on_side = pair.crowd ? batch_alloc(device, sizeof(Rows), &error) : NULL;
    if (!pair.on_side) {
        fail_msg("%s", error.text);
    }
}

static void pair_close(void) {
    batch_free(pair.device, pair.on_side);
    crowd_destroy(pair.crowd);
    vec_destroy(pair.vec);
    task_grounds_destroy(pair.grounds);
    pool_destroy(pair.pool);
    robot_destroy(pair.robot);
}

static int has_device(void) {
    MildError error;
    return device_open(0, &error) == MILD_OK;
}

static VecView view_of(Rows *rows) {
    return (VecView){rows->history[0], rows->critic[0], rows->estimate[0], rows->frame[0]};
}

/* The crowd's rows to b, once the device has them. */
static void fetch(void) {
    MildError error = {0};
    assert_true(pair.device == MILD_BATCH_HOST || device_wait(pair.device, &error) == MILD_OK);
    assert_int_equal(batch_copy(pair.device, &pair.b, pair.on_side, sizeof pair.b, &error),
                     MILD_OK);
}

static void pair_reset(void) {
    MildError error = {0};
    VecView a = view_of(&pair.a), b = view_of(pair.on_side);
    vec_reset(pair.vec, &a);
    if (crowd_reset(pair.crowd, &b, NULL, &error) != MILD_OK) {
        fail_msg("%s", error.text);
    }
    fetch();
}

static void pair_step(void) {
    MildError error = {0};
    VecView a = view_of(&pair.a), b = view_of(pair.on_side);
    Rows *s = pair.on_side;
    vec_step(pair.vec, pair.a.action[0], pair.a.reward, pair.a.done, pair.a.timeout, pair.a.valid,
             &a);
    assert_int_equal(
        batch_copy(pair.device, s->action, pair.a.action, sizeof pair.a.action, &error), MILD_OK);
    if (crowd_step(pair.crowd, s->action[0], s->reward, s->done, s->timeout, s->valid, &b, NULL,
                   &error) != MILD_OK) {
        fail_msg("%s", error.text);
    }
    fetch();
}

/* Fails where two rows differ by more than the tolerance. */
static void compare_rows(const char *what, int when, int env, const float *a, const float *b,
                         int width, double tolerance) {
    for (int i = 0; i < width; i++) {
        if (!(fabs((double)a[i] - (double)b[i]) <= tolerance)) {
            fail_msg("step %d, environment %d: %s[%d] is %g instead of %g", when, env, what, i,
                     (double)b[i], (double)a[i]);
        }
    }
}

static void compare(int when, int env, double tolerance) {
    const Rows *a = &pair.a, *b = &pair.b;
    const int older = SA01_HISTORY - SA01_OBSERVATION;
    compare_rows("newest", when, env, a->history[env] + older, b->history[env] + older,
                 SA01_OBSERVATION, tolerance);
    for (int i = 0; i < older; i++) { /* of frames in 16 bits */
        const double rounding = fabs((double)a->history[env][i]) * 0x1p-11 + 6e-5;
        compare_rows("older", when, env, a->history[env] + i, b->history[env] + i, 1,
                     tolerance + rounding);
    }
    float critic[SA01_CRITIC];
    memcpy(critic, b->critic[env], sizeof critic);
    for (int f = 0; f < SA01_FEET; f++) { /* of the corners that push: it jumps with them */
        const int depth = SA01_OBSERVATION + SA01_ESTIMATES + 6 * f + 5;
        if (fabs((double)a->critic[env][depth - 3]) > tolerance) { /* it pushes */
            compare_rows("depth", when, env, a->critic[env] + depth, critic + depth, 1,
                         20 * tolerance);
        }
        critic[depth] = a->critic[env][depth];
    }
    compare_rows("critic", when, env, a->critic[env], critic, SA01_CRITIC, tolerance);
    compare_rows("estimate", when, env, a->estimate[env], b->estimate[env], SA01_ESTIMATES,
                 tolerance);
    compare_rows("frame", when, env, a->frame[env], b->frame[env], SA01_OBSERVATION, tolerance);
}

static void draw_actions(int t) {
    for (int e = 0; e < ENVS; e++) {
        Random r = random_at(3, (uint32_t)e, (uint32_t)t);
        for (int i = 0; i < SA01_JOINTS; i++) {
            pair.a.action[e][i] = (float)(0.5 * (2 * random_unit(&r) - 1));
        }
    }
}

static void assert_near(double a, double b, double tolerance) {
    assert_true(fabs(a - b) <= tolerance);
}

/* The episode of an environment is that of the CPU, rounded. */
static void same_episode(int e) {
    size_t bytes;
    const char *envs = vec_state(pair.vec, &bytes);
    const TaskEnv *a = (const TaskEnv *)(const void *)(envs + (size_t)e * (bytes / ENVS));
    const Episode b = episode_of(crowd_env(pair.crowd, e));
    assert_true(a->index == b.index && a->step == b.step);
    assert_true(a->ground[0] == b.ground[0] && a->variation.rigid == b.rigid);
    assert_near(a->variation.rigid_friction, b.friction, 1e-7);
    assert_near(a->terrain.map_x, b.map[0], 1e-6);
    assert_near(a->terrain.map_y, b.map[1], 1e-6);
    for (int i = 0; i < 3; i++) {
        assert_near(a->command[i], b.command[i], 1e-7);
    }
    for (int i = 0; i < 7 + SA01_JOINTS; i++) {
        assert_near(a->robot.qpos[i], b.qpos[i], i == 2 ? 1e-6 : 3e-7);
    }
    for (int i = 0; i < SA01_JOINTS; i++) {
        assert_near(a->kp_scale[i], b.kp_scale[i], 1e-7);
    }
}

/* [300 N] Largest difference of the feet's forces, as the critic has them. */
static double forces_apart(int e) {
    double most = 0;
    for (int i = 0; i < 3 * SA01_FEET; i++) {
        const int at = SA01_OBSERVATION + SA01_ESTIMATES + 6 * (i / 3) + i % 3;
        most = fmax(most, fabs((double)pair.a.critic[e][at] - (double)pair.b.critic[e][at]));
    }
    return most;
}

/* Robots that stagger under random actions, fall and begin again. Within float's rounding as long
 * as a robot has not been thrown: legs that swing freely against their limits double a difference
 * within a few steps, so that an environment is left alone once it differs, until its next
 * episode; most must never. In resistive force theory the force jumps where a sole begins to move
 * at 4 mm/s, in three dimensions also where it comes to face its motion (plate.h), and rounding
 * decides in which step. */
static void follow(MildModel model, int device, const MildMapDef *on) {
    const int jumps = model == MILD_MODEL_ECC_QUASI || model == MILD_MODEL_ECC_QUASI_3D;
    TaskDef def = some_def();
    MildMap *map = on ? mild_map_create(on, NULL) : NULL;
    def.map = map;
    def.randomize.model = model;
    int apart[ENVS] = {0}, steps = 0, together = 0, done = 0, timeouts = 0;
    double worst = 0;
    pair_open(&def, device);
    pair_reset();
    for (int e = 0; e < ENVS; e++) {
        compare(-1, e, 2e-5);
        if (device == MILD_BATCH_HOST) {
            same_episode(e);
        }
    }
    for (int t = 0; t < STEPS; t++) {
        draw_actions(t);
        pair_step();
        for (int e = 0; e < ENVS; e++) {
            const double gap = fabs((double)(pair.a.reward[e] - pair.b.reward[e]));
            const int same = pair.a.done[e] == pair.b.done[e];
            apart[e] |= !(gap < 1e-5) || !same || (jumps && forces_apart(e) > 1e-2);
            steps++;
            together += !apart[e];
            done += pair.b.done[e];
            timeouts += pair.b.timeout[e];
            if (apart[e]) {
                continue;
            }
            worst = fmax(worst, t < 10 ? gap : 0);
            assert_int_equal(pair.a.timeout[e], pair.b.timeout[e]);
            assert_int_equal(pair.a.valid[e], pair.b.valid[e]);
            compare(t, e, 1e-2);
            if (device == MILD_BATCH_HOST && pair.b.done[e]) {
                same_episode(e);
            }
        }
    }
    printf(
        "%s, device %d: %d of %d steps together, %d episodes ended, %d by time; rewards of the first "
        "ten steps differ by %.1e\n",
        mild_model_names[model], device, together, steps, done, timeouts, worst);
    const double most = model == MILD_MODEL_ECC_QUASI_3D ? 0.6 : 0.85;
    assert_true(together > most * steps && done > 20 && timeouts > 5);
    pair_close();
    mild_map_destroy(map);
}

static void follows_mujoco(void **unused) {
    (void)unused;
    follow(MILD_MODEL_MILD, MILD_BATCH_HOST, NULL);
}

/* Waves, and three materials in squares. */
static MildMapDef some_map(void) {
    MildMapDef map = mild_map_def_default();
    map.kind = MILD_MAP_WAVES;
    map.patches = MILD_PATTERN_CHECKER;
    map.patch_size = 0.4;
    map.patch_count = 3;
    return map;
}

static void follows_mujoco_on_a_map(void **unused) {
    (void)unused;
    const MildMapDef map = some_map();
    follow(MILD_MODEL_MILD, MILD_BATCH_HOST, &map);
}

static void follows_mujoco_on_other_models(void **unused) {
    (void)unused;
    const MildMapDef map = some_map();
    follow(MILD_MODEL_ECC_QUASI, MILD_BATCH_HOST, NULL);
    follow(MILD_MODEL_ECC_QUASI_3D, MILD_BATCH_HOST, NULL);
    follow(MILD_MODEL_BEKKER, MILD_BATCH_HOST, &map);
    follow(MILD_MODEL_RIGID, MILD_BATCH_HOST, NULL);
}

/* A robot that is thrown diverges, and alone begins a new episode. */
static void one_diverges(void **unused) {
    (void)unused;
    const TaskDef def = some_def();
    pair_open(&def, MILD_BATCH_HOST);
    pair_reset();
    episode_throw(crowd_env(pair.crowd, 5), 1e4);
    pair_step();
    for (int e = 0; e < ENVS; e++) {
        assert_int_equal(pair.b.valid[e], e != 5);
        assert_true(e != 5 || (pair.b.done[e] && !pair.b.timeout[e] && pair.b.reward[e] == 0));
    }
    const Episode next = episode_of(crowd_env(pair.crowd, 5));
    assert_true(next.step == 0 && next.qpos[0] == 0);
    pair_close();
}

static void device_follows_mujoco(void **unused) {
    (void)unused;
    if (!has_device()) {
        skip();
    }
    const MildMapDef map = some_map();
    follow(MILD_MODEL_MILD, 0, NULL);
    follow(MILD_MODEL_MILD, 0, &map);
    follow(MILD_MODEL_ECC_QUASI, 0, NULL);
    follow(MILD_MODEL_ECC_QUASI_3D, 0, &map);
    follow(MILD_MODEL_BEKKER, 0, NULL);
}

/* The sample of a physics step above the map. */
static void check_sample(const CrowdSample *sample, const MildTerrain *terrain) {
    const double x = (double)sample->base[0], y = (double)sample->base[1];
    const double above = (double)sample->base[2] - mild_terrain_height_at(terrain, x, y);
    assert_true(sample->valid && fabs((double)sample->above - above) < 1e-5);
}

/* Trials have what was chosen for them in every episode, and no more: ground, the map's origin,
 * random numbers by their stream, a command that stays, a start along x. */
static void trials_are_chosen(void **unused) {
    (void)unused;
    MildError error = {0};
    enum { TRIALS = 6 };
    MildMapDef waves = mild_map_def_default();
    waves.kind = MILD_MAP_WAVES;
    TaskDef def = some_def();
    MildMap *map = mild_map_create(&waves, &error);
    TaskGround ground[3];
    const TaskGrounds chosen = {3, ground};
    CrowdTrial trial[TRIALS];
    double command[TRIALS][3];
    static float history[TRIALS][SA01_HISTORY], action[TRIALS][SA01_JOINTS], reward[TRIALS];
    static CrowdSample sample[TRIALS][2];
    uint8_t flags[3][TRIALS];
    const VecView view = {.history = history[0]};
    if (!map) {
        fail_msg("%s", error.text);
    }
    def.map = map;
    const MildMaterial any = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&any);
    assert_int_equal(mild_terrain_set_map(&terrain, map, &error), MILD_OK);
    Robot *robot = robot_create(SA01, &error);
    Pool *pool = pool_create(2);
    for (int i = 0; i < 3; i++) {
        ground[i].material = mild_material_default();
        ground[i].material.k_pen = 300 + 100 * i;
        ground[i].depth = 0.01 * i;
    }
    for (int i = 0; i < TRIALS; i++) {
        trial[i] = (CrowdTrial){.stream = (uint32_t)(i % 2), .ground = i / 2, .rigid = i == 3};
        command[i][0] = 0.1 * i;
        command[i][1] = -0.2;
        command[i][2] = 0.3;
    }
    const CrowdDef of = {.task = &def,
                         .robot = robot,
                         .pool = pool,
                         .device = MILD_BATCH_HOST,
                         .envs = TRIALS,
                         .seed = 7,
                         .chosen = &chosen,
                         .trial = trial};
    Crowd *crowd = crowd_create(&of, &error);
    if (!crowd) {
        fail_msg("%s", error.text);
    }
    assert_int_equal(crowd_samples(crowd), 2);
    crowd_watch(crowd, sample[0]);
    assert_int_equal(crowd_command(crowd, command[0], &error), MILD_OK);
    assert_int_equal(crowd_reset(crowd, &view, NULL, &error), MILD_OK);
    for (int t = 0; t <= 130; t++) { /* falls and time limits begin further episodes */
        for (int i = 0; i < TRIALS; i++) {
            const Episode is = episode_of(crowd_env(crowd, i));
            assert_true(is.index == (uint32_t)(i % 2) && is.ground[0] == i / 2);
            assert_true(is.map[0] == 0 && is.map[1] == 0);
            assert_true(is.rigid == (i == 3));
            assert_near(is.friction, 0.8, 1e-7);
            for (int k = 0; k < 3; k++) {
                assert_near(is.command[k], command[i][k], 1e-7);
            }
            assert_true(t > 0 || (is.step == 0 && is.qpos[6] == 0));
        }
        const Episode first = episode_of(crowd_env(crowd, 0));
        const Episode fourth = episode_of(crowd_env(crowd, 4));
        assert_true(t > 0 || memcmp(first.kp_scale, fourth.kp_scale, sizeof first.kp_scale) == 0);
        assert_int_equal(
            crowd_step(crowd, action[0], reward, flags[0], flags[1], flags[2], &view, NULL, &error),
            MILD_OK);
        for (int i = 0; i < TRIALS; i++) {
            check_sample(&sample[i][0], &terrain);
            check_sample(&sample[i][1], &terrain);
        }
    }
    /* one that is thrown diverges in the first physics step of the next policy step */
    episode_throw(crowd_env(crowd, 2), 1e4);
    assert_int_equal(
        crowd_step(crowd, action[0], reward, flags[0], flags[1], flags[2], &view, NULL, &error),
        MILD_OK);
    for (int i = 0; i < TRIALS; i++) {
        assert_true(flags[2][i] == (i != 2) && sample[i][0].valid == (i != 2));
    }
    crowd_destroy(crowd);
    pool_destroy(pool);
    robot_destroy(robot);
    mild_map_destroy(map);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(follows_mujoco),
        cmocka_unit_test(follows_mujoco_on_a_map),
        cmocka_unit_test(follows_mujoco_on_other_models),
        cmocka_unit_test(trials_are_chosen),
        cmocka_unit_test(one_diverges),
        cmocka_unit_test(device_follows_mujoco),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
