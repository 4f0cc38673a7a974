/* Many environments at once: each does what it does alone, rows of the batch are theirs, statistics
 * add up what the episodes report. */
#include "task_kit.h"

#include "envs_kit.h"

/* A part of more environments: the number selects the random numbers. */
enum { ENVS = 6, FIRST = 70, SEED = 21 };

typedef struct {
    Pool *pool;
    Envs *envs;
    float history[ENVS][SA01_HISTORY];
    float critic[ENVS][SA01_CRITIC];
    float estimate[ENVS][SA01_ESTIMATES];
    float frame[ENVS][SA01_OBSERVATION];
    float action[ENVS][SA01_JOINTS];
    float reward[ENVS];
    uint8_t done[ENVS];
    uint8_t timeout[ENVS];
    uint8_t valid[ENVS];
} Many;

static Many many;

static EnvsView all_views(void) {
    return (EnvsView){many.history[0], many.critic[0], many.estimate[0], many.frame[0]};
}

static void open_many(const TaskDef *def, int threads) {
    MildError error = {0};
    memset(&many, 0, sizeof many);
    many.pool = pool_create(threads);
    const EnvsDef of = {.task = def,
                        .robot = robot,
                        .pool = many.pool,
                        .count = ENVS,
                        .first = FIRST,
                        .seed = SEED};
    many.envs = envs_create(&of, &error);
    assert_non_null(many.envs);
    const EnvsView view = all_views();
    envs_reset(many.envs, &view, NULL, &error);
}

static void close_many(void) {
    envs_destroy(many.envs);
    pool_destroy(many.pool);
}

/* Environment e of the block. */
static TaskEnv *env_of(int e) {
    size_t bytes;
    char *state = envs_state(many.envs, &bytes);
    return (TaskEnv *)(void *)(state + (size_t)e * (bytes / ENVS));
}

static void draw_actions(int step) {
    for (int e = 0; e < ENVS; e++) {
        Random r = random_at(99, (uint32_t)e, (uint32_t)step);
        for (int i = 0; i < SA01_JOINTS; i++) {
            many.action[e][i] = (float)random_normal(&r);
        }
    }
}

static void step_into(EnvsView next) {
    const EnvsStep step = {.action = many.action[0],
                           .reward = many.reward,
                           .done = many.done,
                           .timeout = many.timeout,
                           .valid = many.valid,
                           .next = next};
    assert_int_equal(envs_step(many.envs, &step, NULL, NULL), MILD_OK);
}

static void step_many(void) {
    step_into(all_views());
}

/* ---- each as alone ---- */

static void expect_row(int e, const Rig *alone) {
    if (memcmp(many.history[e], alone->history, sizeof many.history[e]) != 0 ||
        memcmp(many.critic[e], alone->critic, sizeof many.critic[e]) != 0 ||
        memcmp(many.estimate[e], alone->estimate, sizeof many.estimate[e]) != 0 ||
        memcmp(many.frame[e], alone->frame, sizeof many.frame[e]) != 0) {
        fail_msg("row %d is not environment %d's", e, e);
    }
}

/* Environment e with data of its own. */
static void open_alone(Rig *alone, const TaskDef *def, int e) {
    rig_open(alone, def, SEED, (uint32_t)(FIRST + e));
    task_env_reset(alone->env, def, robot, alone->sim, &alone->view);
}

static TaskStep step_alone(Rig *alone, const TaskDef *def, int e) {
    return task_env_step(alone->env, def, robot, alone->sim, many.action[e], 1, &alone->view, NULL);
}

TEST(each_is_as_alone) {
    static Rig alone[ENVS];
    TaskDef def = task_def_default();
    int ends = 0;
    def.episode = 0.1; /* ends while we look: the next episode begins by itself */
    open_many(&def, 2);
    for (int e = 0; e < ENVS; e++) {
        open_alone(&alone[e], &def, e);
        expect_row(e, &alone[e]);
    }
    for (int t = 0; t < 14; t++) {
        draw_actions(t);
        step_many();
        for (int e = 0; e < ENVS; e++) {
            const TaskStep step = step_alone(&alone[e], &def, e);
            assert_true(many.reward[e] == step.reward && many.done[e] == step.done);
            assert_true(many.timeout[e] == step.timeout && many.valid[e] == step.valid);
            expect_row(e, &alone[e]);
            ends += step.done;
        }
    }
    for (int e = 0; e < ENVS; e++) {
        rig_close(&alone[e]);
    }
    close_many();
    assert_true(ends >= ENVS);
}

/* Any pointer of the view may be missing. */
TEST(views_may_be_missing) {
    TaskDef def = task_def_default();
    for (int missing = 0; missing <= 4; missing++) {
        open_many(&def, 1);
        EnvsView view = all_views();
        float **member[4] = {&view.history, &view.critic, &view.estimate, &view.frame};
        float *kept[4];
        for (int i = 0; i < 4; i++) {
            kept[i] = *member[i];
            if (i == missing || missing == 4) {
                *member[i] = NULL;
                kept[i][0] = -77;
            }
        }
        draw_actions(0);
        step_into(view);
        for (int i = 0; i < 4; i++) {
            assert_int_equal(kept[i][0] == -77, i == missing || missing == 4);
        }
        close_many();
    }
}

/* ---- statistics ---- */

/* What one environment reported at the end of its episodes. */
typedef struct {
    int episodes, falls, diverged;
    double length, reward, error, terms[TASK_REWARD_COUNT];
} Account;

/* A fall in environment 1, bad numbers in 2, time-outs in all others: each at a step of its own. */
static void disturb(TaskEnv *env, int e, int step) {
    if (e == 1 && step == 3) {
        kit_turn(env->robot.qpos, 0, 1.5, 0);
    }
    if (e == 2 && step == 5) {
        env->robot.qvel[8] = NAN;
    }
}

static void account_alone(const TaskDef *def, int e, int steps, Account *sum) {
    Rig alone;
    open_alone(&alone, def, e);
    for (int t = 0; t < steps; t++) {
        draw_actions(t);
        disturb(alone.env, e, t);
        const TaskStep step = step_alone(&alone, def, e);
        sum->diverged += !step.valid;
        if (step.done) {
            sum->episodes++;
            sum->falls += !step.timeout;
            sum->length += 0.01 * step.length;
            sum->reward += (double)step.episode_reward;
            sum->error += (double)step.episode_speed_error;
            for (int i = 0; i < TASK_REWARD_COUNT; i++) {
                sum->terms[i] += (double)step.episode_terms[i];
            }
        }
    }
    rig_close(&alone);
}

TEST(statistics) {
    enum { STEPS = 25 };
    TaskDef def = task_def_default();
    def.episode = 0.1;
    Account sum = {0};
    for (int e = 0; e < ENVS; e++) {
        account_alone(&def, e, STEPS, &sum);
    }
    open_many(&def, 2);
    double level = 0;
    for (int t = 0; t < STEPS; t++) {
        draw_actions(t);
        for (int e = 0; e < ENVS; e++) {
            disturb(env_of(e), e, t);
        }
        step_many();
    }
    for (int e = 0; e < ENVS; e++) {
        TaskEnv *env = env_of(e);
        env->assist_level = 0.1 * (e + 1);
        level += env->assist_level * env->assist_draw / ENVS;
    }
    EnvsStats stats = kit_stats(many.envs, ENVS);
    assert_true(sum.falls >= 2 && sum.diverged >= 1 && sum.episodes > sum.falls);
    assert_int_equal(stats.episodes, sum.episodes);
    assert_int_equal(stats.falls, sum.falls);
    assert_int_equal(stats.diverged, sum.diverged);
    expect_near("steps", stats.steps, ENVS * STEPS, 0);
    expect_near("length", stats.length, sum.length / sum.episodes, 1e-12);
    expect_near("reward", stats.reward, sum.reward / sum.episodes, 1e-12);
    expect_near("speed error", stats.speed_error, sum.error / sum.episodes, 1e-12);
    expect_near("help", stats.assist, level, 1e-12);
    for (int i = 0; i < TASK_REWARD_COUNT; i++) {
        expect_near(task_reward_names[i], stats.terms[i], sum.terms[i] / sum.length, 1e-12);
    }
    stats = kit_stats(many.envs, ENVS); /* all taken; help is of now */
    assert_true(stats.episodes == 0 && stats.falls == 0 && stats.diverged == 0);
    assert_true(stats.steps == 0 && isnan(stats.length) && isnan(stats.reward));
    assert_true(isnan(stats.speed_error) &&
                isnan(stats.terms[0])); /* of nothing there is no mean */
    expect_near("help again", stats.assist, level, 1e-12);
    close_many();
}

TEST_MAIN(kit_setup, kit_teardown)
