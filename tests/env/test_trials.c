/* Trials on both backends: each has the ground, the command and the random numbers that the caller
 * chose, samples say what its physics steps did, and by MuJoCo one that fell stays as it is. */
#include "env/envs.h"
#include "env/task/task.h"
#include "episode.h"
#include "kit.h"
#include "mild/batch.h"
#include "sa01.h"

enum { TRIALS = 4, GROUNDS = 2, PHYSICS_STEPS = 4, STEPS = 400 };

static Robot *robot;
static Pool *pool;
static TaskDef def;
static MildTerrain terrain[GROUNDS];
static const EnvsTrial trial[TRIALS] = {{.stream = 0, .ground = 0},
                                        {.stream = 1, .ground = 0},
                                        {.stream = 0, .ground = 1},
                                        {.stream = 1, .ground = 1, .rigid = 1}};

/* What a policy step reads and writes. */
static struct {
    float history[TRIALS][SA01_HISTORY], action[TRIALS][SA01_JOINTS], reward[TRIALS];
    uint8_t done[TRIALS], timeout[TRIALS], valid[TRIALS];
    EnvsSample sample[TRIALS][PHYSICS_STEPS];
    double command[TRIALS][TASK_COMMANDS];
} at;

static Envs *start(int batch, EnvsDrive drive) {
    MildError error = {0};
    const EnvsDef of = {.task = &def,
                        .robot = robot,
                        .pool = pool,
                        .batch = batch,
                        .device = MILD_BATCH_HOST,
                        .count = TRIALS,
                        .seed = 7,
                        .trial = trial,
                        .terrain = terrain,
                        .terrains = GROUNDS,
                        .drive = drive};
    const EnvsView first = {.history = at.history[0]};
    memset(&at, 0, sizeof at);
    for (int i = 0; i < TRIALS; i++) {
        at.command[i][0] = 0.1 * i;
        at.command[i][TASK_TURN] = -0.2;
        at.command[i][TASK_RISE] = 0.02;
    }
    Envs *envs = envs_create(&of, &error);
    if (!envs || envs_set_commands(envs, at.command[0], &error) != MILD_OK ||
        envs_reset(envs, &first, NULL, &error) != MILD_OK) {
        fail_msg("%s", error.text);
    }
    envs_set_samples(envs, at.sample[0]);
    assert_int_equal(envs_physics_steps(envs), PHYSICS_STEPS);
    return envs;
}

static void step(Envs *envs) {
    MildError error = {0};
    const EnvsStep call = {.action = at.action[0],
                           .reward = at.reward,
                           .done = at.done,
                           .timeout = at.timeout,
                           .valid = at.valid,
                           .next = {.history = at.history[0]}};
    assert_int_equal(envs_step(envs, &call, NULL, &error), MILD_OK);
}

/* The last sample is the robot's state, and the frame in the history shows the command. */
TEST(mujoco_does_what_was_chosen) {
    Envs *envs = start(0, (EnvsDrive){0});
    const double stiffness[GROUNDS] = {terrain[0].materials[0].k_pen,
                                       terrain[1].materials[0].k_pen};
    for (int t = 0; t < 20; t++) {
        step(envs);
        for (int i = 0; i < TRIALS; i++) {
            const TaskEnv *env = envs_env(envs, i);
            const EnvsSample *last = &at.sample[i][PHYSICS_STEPS - 1];
            const MildMaterial *ground = &task_env_terrain(env)->materials[0];
            assert_true(env->index == trial[i].stream && env->variation.rigid == trial[i].rigid);
            assert_true(ground->k_pen == stiffness[trial[i].ground]);
            assert_memory_equal(env->command, at.command[i], sizeof at.command[i]);
            assert_true(at.sample[i][0].valid && last->valid && at.valid[i] && !at.done[i]);
            assert_true(last->joints == SA01_JOINTS && last->feet == SA01_FEET);
            assert_memory_equal(last->base, env->robot.qpos, sizeof last->base);
            assert_memory_equal(last->quaternion, env->robot.qpos + 3, sizeof last->quaternion);
            assert_memory_equal(last->speed, env->robot.qvel + 6, SA01_JOINTS * sizeof(double));
            assert_memory_equal(last->torque, env->torque, SA01_JOINTS * sizeof(double));
            assert_true(last->above == last->base[2]);
            assert_true((last->foot[0].depth > 0) == (!trial[i].rigid && last->foot[0].load > 0));
        }
    }
    /* the same random numbers on another ground */
    assert_true(envs_env(envs, 0)->phase == envs_env(envs, 2)->phase);
    assert_true(envs_env(envs, 0)->robot.qpos[0] != envs_env(envs, 2)->robot.qpos[0]);
    envs_destroy(envs);
}

/* The paper's gains do not balance: a policy of zeros falls. A robot that fell is reported once and
 * left as it is, the others go on. */
TEST(mujoco_leaves_the_fallen) {
    Envs *envs = start(0, (EnvsDrive){0});
    double fallen[TRIALS][7];
    int ended[TRIALS] = {0}, steps = 0;
    for (int t = 0; t < STEPS; t++) {
        step(envs);
        for (int i = 0; i < TRIALS; i++) {
            const TaskEnv *env = envs_env(envs, i);
            if (ended[i]) {
                assert_true(!at.done[i] && !at.timeout[i] && at.valid[i] && at.reward[i] == 0);
                assert_memory_equal(env->robot.qpos, fallen[i], sizeof fallen[i]);
            } else if (at.done[i]) {
                ended[i] = 1;
                memcpy(fallen[i], env->robot.qpos, sizeof fallen[i]);
            }
            steps += !ended[i];
        }
    }
    assert_true(ended[0] && ended[1] && ended[2] && ended[3]);
    assert_true(steps > 80 && steps < STEPS * TRIALS);
    const EnvsView first = {.history = at.history[0]};
    assert_int_equal(envs_reset(envs, &first, NULL, NULL), MILD_OK);
    step(envs);
    for (int i = 0; i < TRIALS; i++) { /* and stands up in a new trial */
        assert_true(!at.done[i] && at.reward[i] != 0 && envs_env(envs, i)->robot.qpos[2] > 0.5);
    }
    envs_destroy(envs);
}

/* Both begin alike, and move alike until rounding shows: the batch engine's samples are floats, and
 * it draws other latencies. */
TEST(samples_of_both_are_alike) {
    static EnvsSample mujoco[TRIALS][PHYSICS_STEPS];
    double worst = 0, load = 0;
    Envs *envs = start(0, (EnvsDrive){0});
    step(envs);
    memcpy(mujoco, at.sample, sizeof mujoco);
    envs_destroy(envs);
    envs = start(1, (EnvsDrive){0});
    step(envs);
    assert_null(envs_env(envs, 0));
    for (int i = 0; i < TRIALS; i++) {
        const EnvsSample *a = &mujoco[i][0], *b = &at.sample[i][0];
        assert_true(b->valid && b->joints == a->joints && b->feet == a->feet);
        assert_true(fabs(a->mass_center[0] - a->base[0]) < 0.1);
        for (int k = 0; k < 3; k++) {
            worst = fmax(worst, fabs(a->base[k] - b->base[k]));
        }
        for (int k = 0; k < 4; k++) {
            worst = fmax(worst, fabs(a->quaternion[k] - b->quaternion[k]));
        }
        worst = fmax(worst, fabs(a->above - b->above));
        for (int f = 0; f < SA01_FEET; f++) {
            const EnvsFoot *x = &a->foot[f], *y = &b->foot[f];
            worst = fmax(worst, fabs(x->center[0] - y->center[0]));
            worst = fmax(worst, fabs(x->center[1] - y->center[1]));
            worst = fmax(worst, fabs(x->height - y->height));
            worst = fmax(worst, fabs(x->depth - y->depth));
            load = fmax(load, fabs(x->load - y->load));
        }
    }
    printf("after a physics step %.1e m (bound 1e-5) and %.1e N (bound 0.5) apart\n", worst, load);
    assert_true(worst < 1e-5 && load < 0.5);
    envs_set_samples(envs, NULL);
    at.sample[0][0].valid = 7;
    step(envs);
    assert_int_equal(at.sample[0][0].valid, 7); /* no longer written */
    envs_destroy(envs);
}

static void check_episode(Envs *envs, int i, int t) {
    const Episode is = episode_of(envs, i);
    assert_true(is.index == trial[i].stream && is.ground[0] == trial[i].ground);
    assert_true(is.map[0] == 0 && is.map[1] == 0 && is.rigid == trial[i].rigid);
    expect_near("friction", is.friction, 0.8, 1e-7);
    for (int k = 0; k < 3; k++) {
        expect_near("command", is.command[k], at.command[i][k], 1e-7);
    }
    assert_true(t > 0 || (is.step == 0 && is.qpos[6] == 0));
}

/* In every episode, and above the middle of a map. One that is thrown diverges in the first physics
 * step of the next policy step. */
TEST(batch_does_what_was_chosen) {
    MildMapDef waves = mild_map_def_default();
    waves.kind = MILD_MAP_WAVES;
    MildMap *map = mild_map_create(&waves, NULL);
    MildTerrain above = terrain[0];
    assert_int_equal(mild_terrain_set_map(&above, map, NULL), MILD_OK);
    def.map = map;
    Envs *envs = start(1, (EnvsDrive){0});
    const Episode first = episode_of(envs, 0), third = episode_of(envs, 2);
    assert_memory_equal(first.qpos + 7, third.qpos + 7, SA01_JOINTS * sizeof *first.qpos);
    for (int t = 0; t <= 130; t++) { /* falls begin further episodes */
        for (int i = 0; i < TRIALS; i++) {
            check_episode(envs, i, t);
        }
        step(envs);
        for (int i = 0; i < TRIALS; i++) {
            for (int k = 0; k < PHYSICS_STEPS; k++) {
                const EnvsSample *sample = &at.sample[i][k];
                const double *base = sample->base;
                assert_true(sample->valid);
                expect_near("above the map", sample->above,
                            base[2] - mild_terrain_height_at(&above, base[0], base[1]), 1e-5);
            }
        }
    }
    episode_throw(envs, 2, 1e4);
    step(envs);
    for (int i = 0; i < TRIALS; i++) {
        assert_true(at.valid[i] == (i != 2) && at.sample[i][0].valid == (i != 2));
    }
    envs_destroy(envs);
    def.map = NULL;
    mild_map_destroy(map);
}

/* Torques of a controller: 3 + i N m on joint 2 of environment i. */
static void push_joint(void *self, int i, const TaskEnv *env, RobotSim *sim, double *torque) {
    (void)env;
    (void)sim;
    assert_ptr_equal(self, &def);
    memset(torque, 0, SA01_JOINTS * sizeof *torque);
    torque[2] = 3 + i;
}

TEST(mujoco_is_driven) {
    Envs *envs = start(0, (EnvsDrive){push_joint, &def});
    step(envs);
    for (int i = 0; i < TRIALS; i++) {
        for (int j = 0; j < SA01_JOINTS; j++) {
            assert_true(at.sample[i][0].torque[j] == (j == 2 ? 3 + i : 0));
        }
    }
    envs_destroy(envs);
}

/* The batch engine has one ground for a trial. */
TEST(courses_are_refused) {
    MildError error = {0};
    MildTerrain course = terrain[0];
    course.materials[course.material_count++] = terrain[1].materials[0];
    const EnvsDef of = {.task = &def,
                        .robot = robot,
                        .pool = pool,
                        .batch = 1,
                        .device = MILD_BATCH_HOST,
                        .count = 1,
                        .trial = trial,
                        .terrain = &course,
                        .terrains = 1};
    assert_null(envs_create(&of, &error));
    assert_error(&error, MILD_ERROR_ARGUMENT, "course grounds");
}

static int setup(void **state) {
    (void)state;
    MildError error = {0};
    robot = robot_create(SA01, &error);
    pool = pool_create(2);
    def = task_def_default();
    task_def_make_nominal(&def);
    for (int i = 0; i < GROUNDS; i++) {
        MildMaterial material = mild_material_default();
        material.k_pen = 300 + 200 * i;
        terrain[i] = mild_terrain_uniform(&material);
    }
    return !robot || !pool;
}

static int teardown(void **state) {
    (void)state;
    pool_destroy(pool);
    robot_destroy(robot);
    return 0;
}

TEST_MAIN(setup, teardown)
