/* The task: determinism over thread counts, mirror, observation by hand, rewards alive, bad numbers
 * contained. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/random.h"
#include "task/vec.h"

enum { ENVS = 24, STEPS = 200 };

static Robot *robot;

static int setup(void **state) {
    (void)state;
    MildError error = {0};
    robot = robot_create(MILD_SOURCE_DIR "/models/sa01/sa01.xml", &error);
    if (!robot) {
        fprintf(stderr, "%s\n", error.text);
    }
    return robot == NULL;
}

static int teardown(void **state) {
    (void)state;
    robot_destroy(robot);
    return 0;
}

static void random_actions(float *action, int envs, int t, double size) {
    for (int e = 0; e < envs; e++) {
        Random r = random_at(99, (uint32_t)e, (uint32_t)t);
        for (int i = 0; i < TASK_ACTIONS; i++) {
            action[e * TASK_ACTIONS + i] = (float)(size * random_normal(&r));
        }
    }
}

static uint64_t rollout(int threads, int envs, int steps, MildModel model, VecStats *stats) {
    TaskDef def = task_def_default();
    def.randomize.model = (int)model;
    robot_set_model(robot, model);
    Pool *pool = pool_create(threads);
    MildError error = {0};
    Vec *vec = vec_create(&def, robot, pool, envs, 7, &error);
    assert_non_null(vec);
    float *history = calloc((size_t)envs * TASK_HISTORY, sizeof *history);
    float *critic = calloc((size_t)envs * TASK_CRITIC, sizeof *critic);
    float *action = calloc((size_t)envs * TASK_ACTIONS, sizeof *action),
          *reward = calloc((size_t)envs, sizeof *reward);
    uint8_t *flags = calloc((size_t)envs, 3);
    VecView view = {history, critic, NULL, NULL};
    vec_reset(vec, &view);
    for (int t = 0; t < steps; t++) {
        random_actions(action, envs, t, 0.6);
        vec_step(vec, action, reward, flags, flags + envs, flags + 2 * envs, &view);
    }
    uint64_t hash = vec_hash(vec);
    for (size_t i = 0; i < (size_t)envs * TASK_HISTORY; i++) {
        assert_true(isfinite(history[i]));
    }
    for (size_t i = 0; i < (size_t)envs * TASK_CRITIC; i++) {
        assert_true(isfinite(critic[i]) && fabsf(critic[i]) < 100);
    }
    *stats = vec_take_stats(vec);
    vec_destroy(vec);
    pool_destroy(pool);
    robot_set_model(robot, MILD_MODEL_MILD);
    free(history);
    free(critic);
    free(action);
    free(reward);
    free(flags);
    return hash;
}

static void same_numbers_whatever_the_thread_count(void **state) {
    (void)state;
    VecStats stats;
    uint64_t one = rollout(1, ENVS, STEPS, MILD_MODEL_MILD, &stats);
    printf("hash of %d robots x %d steps: %016llx; %d episodes, %d falls, %d diverged\n", ENVS,
           STEPS, (unsigned long long)one, stats.episodes, stats.falls, stats.diverged);
    assert_true(stats.falls > 0);
    assert_int_equal(stats.diverged, 0);
    for (int threads = 2; threads <= 3; threads++) {
        assert_true(one == rollout(threads, ENVS, STEPS, MILD_MODEL_MILD, &stats));
    }
    assert_true(one == rollout(1, ENVS, STEPS, MILD_MODEL_MILD, &stats));
}

static void every_ground_model_is_trained_on(void **state) {
    (void)state;
    for (int model = 0; model < MILD_MODELS; model++) {
        VecStats stats;
        rollout(2, 12, 100, (MildModel)model, &stats);
        printf("%-12s %3d episodes, mean %.2f s, %d diverged\n", mild_model_names[model],
               stats.episodes, stats.length, stats.diverged);
        assert_int_equal(stats.diverged, 0);
    }
}

static void mirror_is_an_involution(void **state) {
    (void)state;
    for (int i = 0; i < TASK_OBSERVATION; i++) {
        int j = task_mirror_observation_index[i];
        assert_int_equal(task_mirror_observation_index[j], i);
        assert_true(task_mirror_observation_sign[i] * task_mirror_observation_sign[j] == 1);
    }
    for (int i = 0; i < TASK_ACTIONS; i++) {
        int j = task_mirror_action_index[i];
        assert_int_equal(task_mirror_action_index[j], i);
        assert_true(task_mirror_action_sign[i] * task_mirror_action_sign[j] == 1);
    }
}

typedef struct {
    TaskDef def;
    TaskEnv *env;
    RobotSim *sim;
    float history[TASK_HISTORY], critic[TASK_CRITIC], estimate[TASK_ESTIMATES],
        frame[TASK_OBSERVATION];
    TaskView view;
} Bench;

static void bench_start(Bench *b, int rigid, double speed) {
    MildError error = {0};
    b->def = task_def_default();
    task_def_make_nominal(&b->def);
    b->def.observe_noise = 0;
    b->def.randomize.latency[0] = b->def.randomize.latency[1] = 0;
    b->def.randomize.initial_joint = b->def.randomize.initial_velocity = 0;
    b->env = aligned_alloc(64, task_env_bytes(&b->def, robot));
    b->sim = robot_sim_create(robot, b->def.physics_dt, &error);
    assert_non_null(b->sim);
    b->view = (TaskView){b->history, b->critic, b->estimate, b->frame};
    task_env_init(b->env, &b->def, robot, 3, 0);
    b->env->command_frozen = 1;
    b->env->command[0] = speed;
    MildMaterial sand = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&sand);
    task_env_reset_on(b->env, &b->def, robot, b->sim, &terrain, rigid, &b->view);
}

static void bench_end(Bench *b) {
    robot_sim_destroy(b->sim);
    free(b->env);
}

/* Mirrored start and mirrored actions give the mirrored observation: mirror table and robot agree.
 */
static void mirrored_motion_is_the_mirror_image(void **state) {
    (void)state;
    Bench a, b;
    bench_start(&a, 0, 0.5);
    bench_start(&b, 0, 0.5);
    a.env->phase = 0.1;
    b.env->phase = 0.6;
    double worst = 0;
    for (int t = 0; t < 12; t++) {
        float action[TASK_ACTIONS], mirrored[TASK_ACTIONS];
        random_actions(action, 1, t, 0.3);
        for (int i = 0; i < TASK_ACTIONS; i++) {
            mirrored[i] = task_mirror_action_sign[i] * action[task_mirror_action_index[i]];
        }
        task_env_step(a.env, &a.def, robot, a.sim, action, 0, &a.view, NULL);
        task_env_step(b.env, &b.def, robot, b.sim, mirrored, 0, &b.view, NULL);
        for (int i = 0; i < TASK_OBSERVATION; i++) {
            float image =
                task_mirror_observation_sign[i] * a.frame[task_mirror_observation_index[i]];
            worst = fmax(worst, (double)fabsf(image - b.frame[i]));
        }
    }
    printf("mirror image after 12 steps, worst difference %.2g\n", worst);
    assert_true(worst < 0.05); /* the vendor's left and right links differ by a few grams */
    bench_end(&a);
    bench_end(&b);
}

static void observation_by_hand(void **state) {
    (void)state;
    Bench b;
    bench_start(&b, 0, 0.5);
    float action[TASK_ACTIONS] = {0};
    action[3] = 0.25f;
    task_env_step(b.env, &b.def, robot, b.sim, action, 0, &b.view, NULL);
    const double *qpos = robot_sim_qpos(b.sim), *qvel = robot_sim_qvel(b.sim),
                 *pose = robot_default_pose(robot);
    double phase = b.env->phase;
    for (int i = 0; i < 3; i++) {
        assert_float_equal(b.frame[i], qvel[3 + i], 1e-6);
    }
    assert_float_equal(b.frame[3], 1.0, 1e-6);  /* 2 x 0.5 m/s */
    assert_float_equal(b.frame[8], -1.0, 0.01); /* gravity points down in the base frame */
    for (int i = 0; i < ROBOT_JOINTS; i++) {
        assert_float_equal(b.frame[9 + i], (qpos[7 + i] - pose[i]), 1e-6);
        assert_float_equal(b.frame[21 + i], (0.05 * qvel[6 + i]), 1e-6);
        assert_float_equal(b.frame[33 + i], action[i], 1e-7);
    }
    assert_float_equal(b.frame[45], sin(6.283185307179586 * phase), 1e-6);
    assert_float_equal(b.frame[46], cos(6.283185307179586 * phase), 1e-6);
    assert_memory_equal(b.history + TASK_HISTORY - TASK_OBSERVATION, b.frame, sizeof b.frame);
    assert_memory_equal(b.critic, b.frame,
                        sizeof b.frame); /* no noise: what the critic sees is what the actor sees */
    bench_end(&b);
}

static void every_reward_is_alive(void **state) {
    (void)state;
    TaskDef def = task_def_default();
    double largest[TASK_REWARD_COUNT] = {0};
    Bench b;
    for (int rigid = 0; rigid < 2; rigid++) {
        bench_start(&b, rigid, 0.5);
        b.env->step_limit = 100000;
        double before[TASK_REWARD_COUNT] = {0};
        for (int t = 0; t < 400; t++) {
            float action[TASK_ACTIONS];
            random_actions(action, 1, t / 10, 1.0);
            TaskStep step = task_env_step(b.env, &def, robot, b.sim, action, 1, &b.view, NULL);
            for (int i = 0; i < TASK_REWARD_COUNT && !step.done; i++) {
                largest[i] = fmax(largest[i], fabs(b.env->term_sum[i] - before[i]));
            }
            memcpy(before, b.env->term_sum, sizeof before);
        }
        bench_end(&b);
    }
    for (int i = 0; i < TASK_REWARD_COUNT; i++) {
        printf("  %-20s largest in one step %.3g\n", task_reward_names[i], largest[i]);
        assert_true(largest[i] > 0);
    }
}

static void bad_numbers_end_the_episode(void **state) {
    (void)state;
    Bench b;
    bench_start(&b, 0, 0.5);
    float action[TASK_ACTIONS] = {0};
    b.env->robot.qvel[8] = NAN;
    TaskStep step = task_env_step(b.env, &b.def, robot, b.sim, action, 1, &b.view, NULL);
    assert_true(step.done && !step.valid && !step.timeout && step.reward == 0);
    for (int i = 0; i < TASK_HISTORY; i++) {
        assert_true(isfinite(b.history[i]));
    }
    action[2] = NAN; /* a policy that breaks must not break the robot's numbers */
    step = task_env_step(b.env, &b.def, robot, b.sim, action, 1, &b.view, NULL);
    assert_true(step.valid && isfinite(step.reward));
    bench_end(&b);
}

static void ranges_are_checked(void **state) {
    (void)state;
    MildError error = {0};
    TaskDef def = task_def_default();
    assert_int_equal(task_def_check(&def, &error), MILD_OK);
    def.physics_dt = 0.003;
    assert_int_equal(task_def_check(&def, &error), MILD_ERROR_RANGE);
    assert_non_null(strstr(error.text, "physics_dt"));
    def = task_def_default();
    def.vx[0] = 2;
    assert_int_equal(task_def_check(&def, &error), MILD_ERROR_RANGE);
    assert_non_null(strstr(error.text, "task.vx"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mirror_is_an_involution),
        cmocka_unit_test(mirrored_motion_is_the_mirror_image),
        cmocka_unit_test(observation_by_hand),
        cmocka_unit_test(every_reward_is_alive),
        cmocka_unit_test(bad_numbers_end_the_episode),
        cmocka_unit_test(ranges_are_checked),
        cmocka_unit_test(same_numbers_whatever_the_thread_count),
        cmocka_unit_test(every_ground_model_is_trained_on),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
