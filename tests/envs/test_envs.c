/* The environments for other learners: the numbers of Envs, and errors. */
#include "env/task/task.h"
#include "envs_kit.h"
#include "kit.h"
#include "run/config/experiment_keys.h"
#include "run/envs/envs.h"
#include "sa01.h"

enum { ENVS = 5, STEPS = 100 };

static const char *const keys[] = {
    "train.envs=5",       "train.threads=2",         "train.seed=7",
    "terrain.kind=waves", "task.shells_stand=false", "task.crossing_limit=0",
    "train.robots=mujoco"};
enum { KEYS = sizeof keys / sizeof *keys };

/* Rows of all arrays. */
typedef struct {
    float history[ENVS][SA01_HISTORY], critic[ENVS][SA01_CRITIC], estimate[ENVS][SA01_ESTIMATES],
        frame[ENVS][SA01_OBSERVATION], reward[ENVS];
    uint8_t done[ENVS], timeout[ENVS], valid[ENVS];
} Rows;

static EnvsView view_of(Rows *rows) {
    return (EnvsView){rows->history[0], rows->critic[0], rows->estimate[0], rows->frame[0]};
}

/* A step into the rows. */
static EnvsStep step_of(const float *action, Rows *rows) {
    return (EnvsStep){.action = action,
                      .reward = rows->reward,
                      .done = rows->done,
                      .timeout = rows->timeout,
                      .valid = rows->valid,
                      .next = view_of(rows)};
}

/* The same environments without the interface. */
typedef struct {
    ExperimentDef def;
    MildMap *map;
    Robot *robot;
    Pool *pool;
    Envs *envs;
} Plain;

static void open_plain(Plain *plain) {
    MildError error = {0};
    plain->def = experiment_def_default();
    assert_int_equal(experiment_read(&plain->def, NULL, keys, KEYS, &error), MILD_OK);
    plain->robot = robot_create(SA01, &error);
    plain->pool = pool_create(1);
    assert_int_equal(terrain_make(&plain->def.terrain, 3, &plain->map, &error), MILD_OK);
    assert_non_null(plain->map);
    plain->def.task.map = plain->map;
    plain->envs = kit_mujoco(&plain->def.task, plain->robot, plain->pool, ENVS, 7, &error);
    assert_non_null(plain->envs);
}

static void close_plain(Plain *plain) {
    envs_destroy(plain->envs);
    mild_map_destroy(plain->map);
    pool_destroy(plain->pool);
    robot_destroy(plain->robot);
}

static void draw_actions(int step, float action[ENVS][SA01_JOINTS]) {
    for (int i = 0; i < ENVS * SA01_JOINTS; i++) {
        action[i / SA01_JOINTS][i % SA01_JOINTS] = (float)(2.5 * sin(0.3 * step + i));
    }
}

static MildEnvs *open_envs(const char *const *overrides, int count) {
    MildError error = {0};
    MildEnvs *envs = mild_envs_open(NULL, overrides, count, &error);
    expect_good(envs != NULL, &error);
    return envs;
}

TEST(numbers_of_the_environments) {
    static Plain plain;
    static Rows a, b;
    MildEnvs *envs = open_envs(keys, KEYS);
    open_plain(&plain);
    const MildEnvsShape shape = mild_envs_shape(envs);
    assert_true(shape.envs == ENVS && shape.actions == SA01_JOINTS && shape.device == -1);
    assert_true(shape.observation == SA01_OBSERVATION && shape.frames == TASK_FRAMES);
    assert_true(shape.critic == SA01_CRITIC && shape.estimates == SA01_ESTIMATES);
    assert_true(shape.period == 0.01 && shape.rewards == TASK_REWARD_COUNT);
    const EnvsView view = view_of(&a);
    const EnvsView plain_view = view_of(&b);
    assert_int_equal(mild_envs_reset(envs, &view, NULL, NULL), MILD_OK);
    envs_reset(plain.envs, &plain_view, NULL, NULL);
    double paid = 0;
    int ended = 0;
    for (int t = 0; t < STEPS; t++) {
        float action[ENVS][SA01_JOINTS];
        draw_actions(t, action);
        const EnvsStep step = step_of(action[0], &a);
        assert_int_equal(mild_envs_step(envs, &step, NULL, NULL), MILD_OK);
        const EnvsStep plain_step = step_of(action[0], &b);
        envs_step(plain.envs, &plain_step, NULL, NULL);
        assert_memory_equal(&a, &b, sizeof a);
        for (int e = 0; e < ENVS; e++) {
            paid += (double)a.reward[e];
            ended += a.done[e];
        }
    }
    EnvsStats statistics;
    assert_int_equal(mild_envs_stats(envs, &statistics, NULL, NULL), MILD_OK);
    assert_true(ended > 0 && statistics.episodes == ended && statistics.steps == ENVS * STEPS);
    assert_true(fabs(statistics.paid - paid) < 1e-4 && statistics.length > 0);
    const EnvsStats wanted = kit_stats(plain.envs, ENVS);
    assert_true(statistics.falls == wanted.falls && statistics.reward == wanted.reward);
    for (int i = 0; i < TASK_REWARD_COUNT; i++) {
        assert_true(statistics.terms[i] == wanted.terms[i]);
        assert_string_equal(mild_envs_reward_name(i), task_reward_names[i]);
    }
    assert_int_equal(mild_envs_stats(envs, &statistics, NULL, NULL), MILD_OK);
    assert_true(statistics.episodes == 0 && statistics.steps == 0);
    close_plain(&plain);
    mild_envs_close(envs);
}

/* The batch engine on the CPU sees what MuJoCo sees, within the rounding of float. It does not
 * report the ends of episodes, and says so; what MuJoCo reports of them: python/test_envs. */
TEST(batch_engine) {
    static Rows a, b, last;
    const char *batch[KEYS];
    memcpy(batch, keys, sizeof batch);
    batch[KEYS - 1] = "train.robots=batch";
    MildEnvs *mujoco = open_envs(keys, KEYS), *engine = open_envs(batch, KEYS);
    const EnvsView first = view_of(&a), second = {b.history[0], NULL, NULL, b.frame[0]};
    MildError error = {0};
    assert_int_equal(mild_envs_reset(mujoco, &first, NULL, NULL), MILD_OK);
    assert_int_equal(mild_envs_reset(engine, &second, NULL, NULL), MILD_OK);
    for (int n = 0; n < ENVS * SA01_OBSERVATION; n++) {
        const int e = n / SA01_OBSERVATION, i = n % SA01_OBSERVATION;
        assert_true(fabsf(a.frame[e][i] - b.frame[e][i]) < 1e-4F);
    }
    const float action[ENVS][SA01_JOINTS] = {{0}};
    EnvsStep step = step_of(action[0], &b);
    step.last = view_of(&last);
    assert_refused(mild_envs_step(engine, &step, NULL, &error), MILD_ERROR_ARGUMENT, &error,
                   "train.robots mujoco");
    mild_envs_close(mujoco);
    mild_envs_close(engine);
}

TEST(mirror) {
    MildEnvs *envs = open_envs(keys, KEYS);
    MildError error = {0};
    Robot *robot = robot_create(SA01, &error);
    const TaskDef def = task_def_default();
    const TaskMirror wanted = task_mirror(&def, robot);
    int observation[SA01_OBSERVATION], action[SA01_JOINTS];
    float observation_sign[SA01_OBSERVATION], action_sign[SA01_JOINTS];
    mild_envs_mirror(envs, observation, observation_sign, action, action_sign);
    assert_memory_equal(observation, wanted.observation_index, sizeof observation);
    assert_memory_equal(observation_sign, wanted.observation_sign, sizeof observation_sign);
    assert_memory_equal(action, wanted.action_index, sizeof action);
    assert_memory_equal(action_sign, wanted.action_sign, sizeof action_sign);
    robot_destroy(robot);
    mild_envs_close(envs);
}

TEST(one_clear_line) {
    static const struct {
        const char *config, *key;
        MildStatus status;
        const char *names;
    } cases[] = {
        {NULL, "train.env=4", MILD_ERROR_FORMAT, "--train.env=4 train.env train.envs"},
        {NULL, "train.envs=0", MILD_ERROR_RANGE, "--train.envs=0 train.envs 0 1 524288"},
        {NULL, "train.robot=none", MILD_ERROR_ARGUMENT, "none"},
        {NULL, "train.device=gpu", MILD_ERROR_RANGE, "train.device gpu"},
        {NULL, "task.scan=5", MILD_ERROR_ARGUMENT, "task.scan 5"},
        {"no/such.ini", "train.envs=4", MILD_ERROR_IO, "no/such.ini"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        MildError error = {0};
        assert_null(mild_envs_open(cases[i].config, &cases[i].key, 1, &error));
        assert_null(mild_envs_open(cases[i].config, &cases[i].key, 1, NULL));
        assert_error(&error, cases[i].status, cases[i].names);
    }
    MildError error = {0};
    const char *const both[] = {"train.device=cuda", "train.robots=mujoco"};
    assert_null(mild_envs_open(NULL, both, 2, &error));
    assert_error(&error, MILD_ERROR_ARGUMENT, "train.device cuda train.robots mujoco cpu");
    mild_envs_close(NULL);
}

TEST_MAIN(NULL, NULL)
