/* Environments of the batch engine that are saved and forked: from then on all of a group do what
 * the saved one does, to the last bit. */
#include <limits.h>

#include "base/random.h"
#include "env/backend.h"
#include "env/task/ground.h"
#include "env/task/state.h"
#include "episode.h"
#include "ground/batch/batch.h"
#include "robots.h"
#include "sa01.h"

#define GO1 MILD_SOURCE_DIR "/robots/go1"

enum { FEW = 4, MANY = 6, SAVED = 2, FORK_STEPS = 40 };

typedef struct {
    Envs *envs;
    int count;
    float history[MANY * TASK_HISTORY_MAX];
    float critic[MANY * TASK_CRITIC_MAX];
    float action[MANY * ROBOT_JOINTS_MAX];
    float reward[MANY];
    uint8_t done[MANY], timeout[MANY], valid[MANY];
} Side;

static struct {
    Robot *robot;
    Pool *pool;
    TaskShape shape;
    Side a, b;
} both;

/* Nothing is drawn but how an episode begins, and on what. */
static TaskDef quiet_def(void) {
    TaskDef def = task_def_default();
    def.physics_dt = 0.005;
    def.randomize.patch_share = 0;
    def.randomize.rigid_share = 0.3;
    def.randomize.preset_share = 0.6; /* grounds that wear, too */
    def.randomize.push_interval = 0;
    def.observe_noise = 0;
    def.episode = 100;
    return def;
}

static Envs *open_side(const TaskDef *def, int count, uint32_t first, int batch) {
    MildError error = {0};
    const EnvsDef of = {.task = def,
                        .robot = both.robot,
                        .pool = both.pool,
                        .batch = batch,
                        .device = MILD_BATCH_HOST,
                        .count = count,
                        .grounds = 8,
                        .first = first,
                        .seed = 7};
    Envs *envs = envs_create(&of, &error);
    expect_good(envs != NULL, &error);
    return envs;
}

static EnvsView view_on(Side *side) {
    return (EnvsView){.history = side->history, .critic = side->critic};
}

static void step_side(Side *side) {
    MildError error = {0};
    const EnvsStep step = {.action = side->action,
                           .reward = side->reward,
                           .done = side->done,
                           .timeout = side->timeout,
                           .valid = side->valid,
                           .next = view_on(side)};
    expect_good(envs_step(side->envs, &step, NULL, &error) == MILD_OK, &error);
}

/* Actions of step t; one: bool, of one in the place of each. */
static void draw_side(Side *side, int t, int group) {
    const int actions = both.shape.actions;
    for (int e = 0; e < side->count; e++) {
        Random r = random_at(5, (uint32_t)(e / group), (uint32_t)t);
        for (int i = 0; i < actions; i++) {
            side->action[e * actions + i] = (float)(0.5 * (2 * random_unit(&r) - 1));
        }
    }
}

/* Both after a few steps of their own. */
static void open_both(const char *robot, const TaskDef *a, const TaskDef *b) {
    MildError error = {0};
    both.robot = kit_robot(robot);
    both.pool = pool_create(2);
    robot_set_shells(both.robot, a->shells_stand);
    assert_int_equal(task_set_robot(a, both.robot, &error), MILD_OK);
    both.shape = task_shape(a, both.robot);
    both.a.count = FEW;
    both.b.count = MANY;
    both.a.envs = open_side(a, FEW, 0, 1);
    both.b.envs = open_side(b, MANY, 100, 1);
    for (int side = 0; side < 2; side++) {
        Side *of = side ? &both.b : &both.a;
        const EnvsView view = view_on(of);
        assert_int_equal(envs_reset(of->envs, &view, NULL, &error), MILD_OK);
        for (int t = 0; t < 12; t++) {
            draw_side(of, t, 1);
            step_side(of);
        }
    }
}

static void close_both(void) {
    envs_destroy(both.a.envs);
    envs_destroy(both.b.envs);
    pool_destroy(both.pool);
    robot_destroy(both.robot);
}

/* Blocks of the SAVED environments of a from 1 on into b. Returns the blocks. */
static char *fork_both(int own_ground) {
    MildError error = {0};
    const size_t bytes = envs_block_bytes(both.a.envs, 0);
    char *blocks = aligned_alloc(64, (SAVED * bytes + 63) / 64 * 64);
    assert_non_null(blocks);
    expect_good(envs_save(both.a.envs, 1, SAVED, blocks, NULL, &error) == MILD_OK, &error);
    expect_good(envs_fork(both.b.envs, blocks, SAVED, bytes, own_ground, NULL, &error) == MILD_OK,
                &error);
    return blocks;
}

static const float *row(const float *rows, int width, int e) {
    return rows + (size_t)width * (size_t)e;
}

/* Until the saved ones have fallen: the next episode is each one's own. */
static void step_alike(const char *robot) {
    const TaskShape *shape = &both.shape;
    const size_t history = (size_t)shape->history * sizeof(float);
    const size_t critic = (size_t)shape->critic * sizeof(float);
    int over[SAVED] = {0}, steps = 0;
    for (int t = 0; t < FORK_STEPS; t++) {
        draw_side(&both.b, 100 + t, MANY / SAVED);
        for (int k = 0; k < SAVED; k++) {
            memcpy(both.a.action + (1 + k) * shape->actions,
                   row(both.b.action, shape->actions, k * MANY / SAVED),
                   (size_t)shape->actions * sizeof(float));
        }
        step_side(&both.a);
        step_side(&both.b);
        for (int e = 0; e < MANY; e++) {
            const int k = e / (MANY / SAVED), from = 1 + k;
            steps += !over[k];
            if (over[k]) {
                continue;
            }
            assert_int_equal(both.a.done[from], both.b.done[e]);
            assert_memory_equal(&both.a.reward[from], &both.b.reward[e], sizeof(float));
            if (both.a.done[from]) {
                continue;
            }
            assert_memory_equal(row(both.a.history, shape->history, from),
                                row(both.b.history, shape->history, e), history);
            assert_memory_equal(row(both.a.critic, shape->critic, from),
                                row(both.b.critic, shape->critic, e), critic);
        }
        for (int k = 0; k < SAVED; k++) {
            over[k] |= both.a.done[1 + k];
        }
    }
    printf("%s: %d steps alike\n", robot, steps);
    assert_true(steps > MANY * FORK_STEPS / 4);
}

static void check_steps(const char *robot, double rigid_share) {
    TaskDef def = quiet_def();
    def.randomize.rigid_share = rigid_share;
    def.randomize.preset_share = rigid_share > 0.5 ? 0 : 0.6;
    open_both(robot, &def, &def);
    free(fork_both(0));
    step_alike(robot);
    close_both();
}

TEST(forks_step_alike) {
    check_steps(SA01, 0);
    check_steps(SA01, 1);
    check_steps(GO1, 0);
}

/* What is each environment's own stays: its number, and in the sums the steps it made. */
TEST(forks_keep_their_number) {
    const TaskDef def = quiet_def();
    MildError error = {0};
    EnvsStats sums = {0};
    open_both(SA01, &def, &def);
    free(fork_both(0));
    for (int e = 0; e < MANY; e++) {
        assert_int_equal(episode_of(both.b.envs, e).index, 100 + e);
    }
    assert_int_equal(envs_sums(both.b.envs, &sums, NULL, &error), MILD_OK);
    expect_near("steps", sums.steps, 12 * MANY, 0);
    close_both();
}

/* From rigid ground onto soft: there it has its feet as deep as it stands, and goes on. */
TEST(forks_keep_their_ground) {
    TaskDef rigid = quiet_def(), soft = quiet_def();
    rigid.randomize.preset_share = soft.randomize.rigid_share = 0;
    rigid.randomize.rigid_share = 1;
    open_both(SA01, &rigid, &soft);
    const double before = episode_of(both.a.envs, 1).qpos[2];
    free(fork_both(1));
    for (int e = 0; e < MANY; e++) {
        const Episode is = episode_of(both.b.envs, e);
        assert_true(!is.rigid && is.index == (uint32_t)(100 + e));
        assert_true(is.qpos[2] < before + 0.01 && is.qpos[2] > before - 0.12);
    }
    memset(both.b.action, 0, sizeof both.b.action);
    for (int t = 0; t < 15; t++) {
        step_side(&both.b);
        for (int e = 0; e < MANY; e++) {
            assert_true(both.b.valid[e]);
        }
    }
    close_both();
}

/* Of one soil alone. */
static TaskDef soil_def(const char *soil, TaskSoils *soils) {
    TaskDef def = quiet_def();
    def.randomize.rigid_share = def.randomize.preset_jitter = def.randomize.slip_share = 0;
    def.randomize.preset_share = 1;
    for (int i = 0; i < 2; i++) {
        def.randomize.mu[i] = 0.6;
    }
    soils->count = 1;
    assert_true(mild_material_preset(soil, &soils->soil[0]));
    def.soils = soils;
    return def;
}

/* A ground of their own that is the block's: as if it were copied. */
TEST(forks_go_on_where_their_ground_is_the_same) {
    TaskSoils soils;
    const TaskDef def = soil_def("sand_loose", &soils);
    open_both(SA01, &def, &def);
    free(fork_both(1));
    step_alike("their own sand");
    close_both();
}

/* [m] By how much lower environment e is than what was saved. */
static double deeper_by(int e) {
    return episode_of(both.a.envs, 1 + e / (MANY / SAVED)).qpos[2] -
           episode_of(both.b.envs, e).qpos[2];
}

/* From standing in dense sand onto another ground. lift: [m/s] see episode_lift, before `steps`. */
static void open_standing(const TaskDef *sand, const TaskDef *other, double lift, int steps) {
    open_both(SA01, sand, other);
    memset(both.a.action, 0, sizeof both.a.action);
    memset(both.b.action, 0, sizeof both.b.action);
    for (int t = 0; t < 20; t++) {
        step_side(&both.a);
    }
    for (int e = 0; e < FEW; e++) {
        episode_lift(both.a.envs, e, lift);
    }
    for (int t = 0; t < steps; t++) {
        step_side(&both.a);
    }
    free(fork_both(1));
}

/* They stand `least` to `most` [m] deeper, with their prints, and bear what they bore, but for the
 * drag of speed and the added mass. */
static void check_stands(double least, double most) {
    for (int e = 0; e < MANY; e++) {
        printf("%.1f mm deeper\n", 1e3 * deeper_by(e));
        assert_true(deeper_by(e) > least && deeper_by(e) < most);
    }
    step_side(&both.a);
    step_side(&both.b);
    for (int e = 0; e < MANY; e++) {
        const double bore = episode_of(both.a.envs, 1 + e / (MANY / SAVED)).load;
        expect_near("load", episode_of(both.b.envs, e).load, bore, 0.12 * bore);
    }
}

static void check_load(const char *soil, double least, double most) {
    TaskSoils soils[2];
    const TaskDef sand = soil_def("sand_dense", &soils[0]), other = soil_def(soil, &soils[1]);
    open_standing(&sand, &other, 0, 0);
    check_stands(least, most);
    close_both();
}

/* From a map onto level ground of the same sand: its memory has more numbers. */
TEST(forks_come_from_a_map) {
    TaskSoils soils[2];
    TaskDef sand = soil_def("sand_dense", &soils[0]);
    const TaskDef level = soil_def("sand_dense", &soils[1]);
    MildError error = {0};
    MildMapDef waves = mild_map_def_default();
    waves.kind = MILD_MAP_WAVES;
    waves.amplitude = 1e-4; /* [m] */
    MildMap *map = mild_map_create(&waves, NULL);
    sand.map = map;
    open_standing(&sand, &level, 0, 0);
    check_stands(-1e-3, 1e-3);
    char *blocks = fork_both(1); /* of a */
    assert_refused(
        envs_fork(both.a.envs, blocks, SAVED, envs_block_bytes(both.a.envs, 0), 1, NULL, &error),
        MILD_ERROR_ARGUMENT, &error, "own_ground level");
    free(blocks);
    close_both();
    mild_map_destroy(map);
}

/* Feet in the air in their prints stay there, without load. */
TEST(forks_in_the_air_are_not_moved) {
    TaskSoils soils[2];
    const TaskDef sand = soil_def("sand_dense", &soils[0]), foam = soil_def("foam25", &soils[1]);
    open_standing(&sand, &foam, 1, 1);
    for (int e = 0; e < MANY; e++) {
        const int from = 1 + e / (MANY / SAVED);
        expect_near("load", episode_of(both.a.envs, from).load, 0, 1);
        expect_near("deeper", deeper_by(e), 0, 1e-6);
    }
    step_side(&both.b);
    for (int e = 0; e < MANY; e++) {
        expect_near("load", episode_of(both.b.envs, e).load, 0, 20);
    }
    close_both();
}

/* An episode that has just begun has no prints, and stands in the other ground as deep as one
 * begins there. */
TEST(forks_begin_on_their_ground) {
    TaskSoils soils[2];
    const TaskDef sand = soil_def("sand_dense", &soils[0]), foam = soil_def("foam25", &soils[1]);
    MildError error = {0};
    open_both(SA01, &sand, &foam);
    const EnvsView view = view_on(&both.a);
    assert_int_equal(envs_reset(both.a.envs, &view, NULL, &error), MILD_OK);
    free(fork_both(1));
    for (int e = 0; e < MANY; e++) {
        assert_true(deeper_by(e) > 0.005 && deeper_by(e) < 0.03);
    }
    close_both();
}

TEST(forks_bear_what_they_bore) {
    check_load("dry_sand_close", 0.01, 0.02);
    check_load("foam25", 0.005, 0.02);
    check_load("rubber", -0.02, -0.01);
}

/* The pose that is read is that of the environment. */
TEST(reads_the_motion) {
    const TaskDef def = quiet_def();
    MildError error = {0};
    static float qpos[FEW * ROBOT_NQ_MAX];
    open_both(SA01, &def, &def);
    const EnvsMotion motion = {.qpos = qpos};
    assert_int_equal(envs_read(both.a.envs, &motion, NULL, &error), MILD_OK);
    for (int e = 0; e < FEW; e++) {
        const Episode is = episode_of(both.a.envs, e);
        for (int i = 0; i < 7 + both.shape.joints; i++) {
            expect_near("qpos", (double)qpos[e * (7 + both.shape.joints) + i], is.qpos[i], 0);
        }
    }
    close_both();
}

TEST(refuses_what_does_not_fit) {
    const TaskDef def = quiet_def();
    MildError error = {0};
    open_both(SA01, &def, &def);
    char *blocks = fork_both(0);
    const size_t bytes = envs_block_bytes(both.a.envs, 0);
    assert_refused(envs_fork(both.b.envs, blocks, 4, bytes, 0, NULL, &error), MILD_ERROR_ARGUMENT,
                   &error, "6 4");
    assert_refused(envs_fork(both.b.envs, blocks, 2, bytes - 16, 0, NULL, &error),
                   MILD_ERROR_ARGUMENT, &error, "block");
    assert_refused(envs_fork(both.b.envs, blocks + 4, 1, bytes, 0, NULL, &error),
                   MILD_ERROR_ARGUMENT, &error, "multiples 16");
    assert_refused(envs_save(both.a.envs, 0, 1, blocks + 4, NULL, &error), MILD_ERROR_ARGUMENT,
                   &error, "multiple 16");
    assert_refused(envs_save(both.a.envs, 1, INT_MAX, blocks, NULL, &error), MILD_ERROR_ARGUMENT,
                   &error, "environments");
    memset(blocks, 0x5a, SAVED * bytes); /* never saved: its numbers are wild, its places are not */
    expect_good(envs_fork(both.b.envs, blocks, SAVED, bytes, 0, NULL, &error) == MILD_OK, &error);
    draw_side(&both.b, 1, MANY / SAVED);
    step_side(&both.b);
    envs_destroy(both.b.envs);
    both.b.envs = open_side(&def, 1, 0, 0);
    assert_true(envs_block_bytes(both.b.envs, 0) == 0);
    assert_refused(envs_save(both.b.envs, 0, 1, blocks, NULL, &error), MILD_ERROR_ARGUMENT, &error,
                   "train.robots");
    assert_refused(envs_fork(both.b.envs, blocks, 1, bytes, 0, NULL, &error), MILD_ERROR_ARGUMENT,
                   &error, "train.robots");
    free(blocks);
    close_both();
}

TEST_MAIN(NULL, NULL)
