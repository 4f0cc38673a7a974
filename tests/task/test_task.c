/* The task as a whole: determinism over thread counts, mirrored motion, ground models. */
#include "task_kit.h"

#include "envs_kit.h"
#include "sa01.h"

enum { ENVS = 12, STEPS = 100 };

static void random_actions(float *action, int envs, int t, double size) {
    for (int e = 0; e < envs; e++) {
        Random r = random_at(99, (uint32_t)e, (uint32_t)t);
        for (int i = 0; i < SA01_JOINTS; i++) {
            action[e * SA01_JOINTS + i] = (float)(size * random_normal(&r));
        }
    }
}

static uint64_t rollout(int threads, int envs, int steps, MildModel model, EnvsStats *stats) {
    TaskDef def = task_def_default();
    def.randomize.model = (int)model;
    def.episode = 0.5; /* every robot begins a second episode */
    robot_set_model(robot, model);
    Pool *pool = pool_create(threads);
    MildError error = {0};
    Envs *all = kit_mujoco(&def, robot, pool, envs, 7, &error);
    assert_non_null(all);
    float *history = calloc((size_t)envs * SA01_HISTORY, sizeof *history);
    float *critic = calloc((size_t)envs * SA01_CRITIC, sizeof *critic);
    float *action = calloc((size_t)envs * SA01_JOINTS, sizeof *action),
          *reward = calloc((size_t)envs, sizeof *reward);
    uint8_t *flags = calloc((size_t)envs, 3);
    const EnvsView view = {history, critic, NULL, NULL};
    const EnvsStep step = kit_step(action, reward, flags, envs, view);
    envs_reset(all, &view, NULL, &error);
    for (int t = 0; t < steps; t++) {
        random_actions(action, envs, t, 0.6);
        envs_step(all, &step, NULL, &error);
    }
    uint64_t hash = kit_hash(all, envs);
    for (size_t i = 0; i < (size_t)envs * SA01_HISTORY; i++) {
        assert_true(isfinite(history[i]));
    }
    for (size_t i = 0; i < (size_t)envs * SA01_CRITIC; i++) {
        assert_true(isfinite(critic[i]) && fabsf(critic[i]) < 100);
    }
    *stats = kit_stats(all, envs);
    envs_destroy(all);
    pool_destroy(pool);
    robot_set_model(robot, MILD_MODEL_MILD);
    free(history);
    free(critic);
    free(action);
    free(reward);
    free(flags);
    return hash;
}

/* What the numbers are is pinned by tests/pins. */
TEST(same_numbers_whatever_the_thread_count) {
    EnvsStats stats;
    uint64_t one = rollout(1, ENVS, STEPS, MILD_MODEL_MILD, &stats);
    printf("hash of %d robots x %d steps: %016llx; %d episodes, %d falls, %d diverged\n", ENVS,
           STEPS, (unsigned long long)one, stats.episodes, stats.falls, stats.diverged);
    assert_true(stats.episodes >= ENVS);
    assert_int_equal(stats.diverged, 0);
    for (int threads = 2; threads <= 3; threads++) {
        assert_true(one == rollout(threads, ENVS, STEPS, MILD_MODEL_MILD, &stats));
    }
    assert_true(one == rollout(1, ENVS, STEPS, MILD_MODEL_MILD, &stats));
}

/* Mirrored start and mirrored actions give the mirrored observation: mirror table and robot agree.
 * frame: [shape.observation] the last one. */
static void expect_mirrored(const TaskDef *def, float *frame) {
    const TaskMirror sides = task_mirror(def, robot);
    const int width = task_shape(def, robot).observation;
    Rig a, b;
    rig_open(&a, def, 3, 0);
    rig_open(&b, def, 3, 0);
    rig_start(&a, 0.5, 0, 0);
    rig_start(&b, 0.5, 0, 0);
    a.env->phase = 0.1;
    b.env->phase = 0.6;
    double worst = 0;
    for (int t = 0; t < 12; t++) {
        float action[SA01_JOINTS], mirrored[SA01_JOINTS];
        random_actions(action, 1, t, 0.3);
        for (int i = 0; i < SA01_JOINTS; i++) {
            mirrored[i] = sides.action_sign[i] * action[sides.action_index[i]];
        }
        rig_step(&a, action);
        rig_step(&b, mirrored);
        for (int i = 0; i < width; i++) {
            float image = sides.observation_sign[i] * a.frame[sides.observation_index[i]];
            worst = fmax(worst, (double)fabsf(image - b.frame[i]));
        }
    }
    printf("mirror image after 12 steps, worst difference %.2g\n", worst);
    assert_true(worst < 0.05); /* the vendor's left and right links differ by a few grams */
    memcpy(frame, a.frame, (size_t)width * sizeof *frame);
    rig_close(&a);
    rig_close(&b);
}

TEST(mirrored_motion_is_the_mirror_image) {
    const TaskDef def = kit_quiet_def();
    float frame[TASK_OBSERVATION_MAX];
    expect_mirrored(&def, frame);
}

TEST_MAIN(kit_setup, kit_teardown)
