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

/* Matched to one draw, every model carries the robot at about the same depth: after 0.3 s of
 * standing with stiff joints the feet bear the weight. */
TEST(every_ground_model_carries) {
    for (int model = 0; model < MILD_MODELS; model++) {
        int rigid = model == MILD_MODEL_RIGID;
        TaskDef def = kit_quiet_def();
        strcpy(def.kp, "240 240 240 240 200 200");
        strcpy(def.kd, "6 6 6 6 1 1");
        strcpy(def.torque_share, "1");
        def.randomize.model = model;
        robot_set_model(robot, (MildModel)model);
        Rig rig;
        rig_open(&rig, &def, 5, 2);
        rig.env->command_frozen = 1;
        task_env_reset(rig.env, &rig.def, robot, rig.sim, &rig.view);
        const MildMaterial *m = &task_env_rest(rig.env)->terrain.materials[0];
        assert_true(rig.env->variation.rigid == rigid);
        assert_true(rigid || m->model == model);
        double load = 0, depth = 0;
        for (int t = 0; t < 30; t++) {
            TaskStep step = rig_step(&rig, NULL);
            assert_true(step.valid && !step.done);
            for (int f = 0; f < SA01_FEET && t >= 20; f++) {
                load += robot_sim_foot(rig.sim, f)->force[2] / 10;
                depth -= robot_sim_foot(rig.sim, f)->sole_center[2] / (10 * SA01_FEET);
            }
        }
        double rest =
            rigid ? 0 : mild_sole_sinkage(robot_soles(robot)[0], m, robot_foot_load(robot));
        printf("%-12s load %.2f of the weight, soles %.1f mm deep, at rest %.1f mm\n",
               mild_model_names[model], load / (2 * robot_foot_load(robot)), 1e3 * depth,
               1e3 * rest);
        expect_near("load", load / (2 * robot_foot_load(robot)), 1, 0.2);
        expect_near("depth", depth, rest, 0.010); /* landing leaves the plastic ones deeper */
        rig_close(&rig);
    }
    robot_set_model(robot, MILD_MODEL_MILD);
}

TEST(mirror_is_an_involution) {
    for (int i = 0; i < SA01_OBSERVATION; i++) {
        int j = mirror.observation_index[i];
        assert_int_equal(mirror.observation_index[j], i);
        assert_true(mirror.observation_sign[i] * mirror.observation_sign[j] == 1);
    }
    for (int i = 0; i < SA01_JOINTS; i++) {
        int j = mirror.action_index[i];
        assert_int_equal(mirror.action_index[j], i);
        assert_true(mirror.action_sign[i] * mirror.action_sign[j] == 1);
    }
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
