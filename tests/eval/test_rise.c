/* The Go1 on its back: policies/go1_rise.safetensors stands up on soft ground and on rigid
 * ground. No contact keeps a leg out of the trunk, because the joints' ranges do. */
#include "base/random.h"

#include <mujoco/mujoco.h>

#include "env/task/policy_keys.h"
#include "kit.h"
#include "learn/policy.h"
#include "mild/batch.h"
#include "robots.h"
#include "run/eval/eval.h"

#define RISES MILD_SOURCE_DIR "/policies/go1_rise.safetensors"

enum { TRIALS = 4 };

/* [m] Half of the trunk's length, width and height in Unitree's go1_description (const.xacro:
 * 0.3762, 0.0935, 0.114). The box of go1.xml, which is mjlab's and the one that lies on the ground,
 * is shorter and wider; a leg at the limit of its hip is 9 mm inside of its sharp edge. */
static const double makers[3] = {0.1881, 0.04675, 0.057};

static Robot *robot;
static mjModel *model; /* the whole file, with the maker's trunk */
static mjData *data;

static int setup(void **unused) {
    (void)unused;
    char text[256] = "";
    model = mj_loadXML(MILD_SOURCE_DIR "/robots/go1/go1.xml", NULL, text, sizeof text);
    if (!model) {
        fail_msg("%s", text);
    }
    const int box = mj_name2id(model, mjOBJ_GEOM, "trunk_box");
    mju_copy3(model->geom_size + 3 * box, makers);
    model->geom_rbound[box] = mju_norm3(makers);
    data = mj_makeData(model);
    robot = kit_robot(MILD_SOURCE_DIR "/robots/go1");
    robot_set_shells(robot, 1);
    return 0;
}

static int teardown(void **unused) {
    (void)unused;
    robot_destroy(robot);
    mj_deleteData(data);
    mj_deleteModel(model);
    return 0;
}

/* [m] Least distance of a leg's capsules and the trunk in the pose of `data`. */
static double trunk_gap(void) {
    static const char *const part[] = {"FL_thigh_capsule", "FR_thigh_capsule", "RL_thigh_capsule",
                                       "RR_thigh_capsule", "FL_calf_capsule",  "FR_calf_capsule",
                                       "RL_calf_capsule",  "RR_calf_capsule"};
    const int box = mj_name2id(model, mjOBJ_GEOM, "trunk_box");
    double least = 1;
    mj_kinematics(model, data);
    for (int i = 0; i < 8; i++) {
        const int leg = mj_name2id(model, mjOBJ_GEOM, part[i]);
        least = fmin(least, mj_geomDistance(model, data, box, leg, 0.5, NULL));
    }
    return least;
}

/* Anywhere within the ranges of its joints, and at their ends, a leg is clear of the trunk. */
TEST(legs_cannot_reach_the_trunk) {
    double least = 1;
    for (int n = 0; n < 4000; n++) {
        Random random = random_at(17, (uint32_t)n, 0);
        mju_copy(data->qpos, model->qpos0, 7 + 12);
        for (int j = 1; j <= 12; j++) {
            const double *range = model->jnt_range + 2 * j;
            const double any = random_uniform(&random, range[0], range[1]);
            const double end = range[random_unit(&random) < 0.5];
            data->qpos[model->jnt_qposadr[j]] = n % 2 ? any : end;
        }
        least = fmin(least, trunk_gap());
    }
    print_message("a leg comes within %.1f mm of the trunk\n", 1e3 * least);
    assert_true(least > 0.004);
}

/* Trials from the back, of the task that the policy's file says. */
static EvalRow lie(const char *file, const char *ground, EvalTrial each[TRIALS]) {
    MildError error = {0};
    TaskDef def = task_def_default();
    const EvalDef eval = {.trials = TRIALS, .seconds = 7, .seed = 5};
    Scene scene;
    EvalRow row;
    Controller controller;
    Pool *pool = pool_create(2);
    Policy *policy = policy_load(file, NULL, 0, &error);
    assert_non_null(policy);
    assert_int_equal(task_policy_keys_read(&def, policy_def(policy)->task, &error), MILD_OK);
    policy_destroy(policy);
    task_def_make_nominal(&def);
    def.physics_dt = 0.005;
    def.start = TASK_START_BACK;
    def.may_lie = 1;
    assert_int_equal(scene_make(&scene, ground, 1, &error), MILD_OK);
    assert_int_equal(controller_learned(file, robot, pool, TRIALS, &controller, &error), MILD_OK);
    const EvalRun run = {.task = &def,
                         .robot = robot,
                         .pool = pool,
                         .controller = &controller,
                         .device = MILD_BATCH_HOST,
                         .scenes = &scene,
                         .scene_count = 1,
                         .speeds = &eval.speed,
                         .speed_count = 1,
                         .eval = eval,
                         .each = each};
    assert_int_equal(eval_run(&run, &row, &error), MILD_OK);
    controller_destroy(&controller);
    pool_destroy(pool);
    char line[384];
    eval_print_row(&row, line, sizeof line);
    print_message("%s\n", line);
    return row;
}

/* It needs a second to come to rest, and comes up after that. Standing it carries itself on its
 * feet, so that its shells had little to do. */
TEST(it_rights_itself) {
    static const char *const grounds[] = {"rigid", "foam45", "sand_dense"};
    EvalTrial each[TRIALS];
    for (int g = 0; g < 3; g++) {
        const EvalRow row = lie(RISES, grounds[g], each);
        assert_int_equal(row.start, TASK_START_BACK);
        assert_true(row.righted >= TRIALS - 1);
        assert_true(row.success == TRIALS && row.up > 1 && row.up < 5);
        for (int i = 0; i < TRIALS; i++) {
            assert_true(isnan(each[i].up) ||
                        (each[i].up > 1 && each[i].up < 5 && each[i].shells < 0.5));
        }
    }
}

/* ---- when a robot is up again, by a script of heights and tilts, and how a row counts it ---- */

enum { FEET = 4 };

/* A power of two: sums of it are exact. */
#define DT (1.0 / 1024)
#define STEPS(seconds) ((int)((seconds)*1024))

/* Nominal height 0.8 m, soles 0.1 m deep. It lies on its side for 2 s, then stands at 0.58 m over
 * its soles (72 %) for `up` s, in one step of which, at `dip` s, it is at 0.54 m (68 %) or tilts by
 * 0.31 rad, if dip is not 0. */
static Measure script_rise(double up, double dip, int tilts) {
    EnvsSample sample = {.feet = FEET, .quaternion = {1}};
    Measure m;
    measure_start(&m, DT);
    m.nominal_height = 0.8;
    for (int f = 0; f < FEET; f++) {
        sample.foot[f].height = -0.1;
    }
    for (int k = 1; k <= STEPS(2 + up); k++) {
        const int lies = k <= STEPS(2), dips = dip > 0 && k == STEPS(dip);
        const double roll = lies ? 1.5 : dips && tilts ? 0.31 : 0.29;
        sample.quaternion[0] = cos(0.5 * roll);
        sample.quaternion[1] = sin(0.5 * roll);
        sample.above = dips && !tilts ? 0.44 : 0.48;
        measure_sample(&m, &sample);
    }
    return m;
}

/* It stands all the time. */
static Measure script_standing(double seconds) {
    EnvsSample sample = {.feet = FEET, .quaternion = {1}, .above = 0.8};
    Measure m;
    measure_start(&m, DT);
    m.nominal_height = 0.8;
    for (int k = 0; k < STEPS(seconds); k++) {
        measure_sample(&m, &sample);
    }
    return m;
}

/* Up is who stands for the last two seconds; when it came up is the start of the unbroken time. */
TEST(up_at_the_end_and_for_two_seconds) {
    Measure m = script_rise(2.5, 0, 0);
    assert_true(fabs(measure_up(&m) - (2 + DT)) < 1e-9);
    m = script_rise(1.9, 0, 0);
    assert_true(isnan(measure_up(&m)));
    m = script_standing(2.5); /* from its first step on */
    assert_true(fabs(measure_up(&m) - DT) < 1e-9);
    m = script_standing(0);
    assert_true(isnan(measure_up(&m)));
    m = script_rise(5, 4, 0);
    assert_true(fabs(measure_up(&m) - (4 + DT)) < 1e-9);
    m = script_rise(5, 4, 1);
    assert_true(fabs(measure_up(&m) - (4 + DT)) < 1e-9);
    m = script_rise(5, 6, 1);
    assert_true(isnan(measure_up(&m)));
    m = script_rise(5, 6.99, 0); /* not at the end */
    assert_true(isnan(measure_up(&m)));
}

/* Three of four were up; one of them ended by a joint, so that two were righted, after 2.01 and
 * 4.01 s. */
TEST(a_row_counts_who_was_righted) {
    Measure m[4] = {script_rise(3, 0, 0), script_rise(5, 4, 0), script_rise(1, 0, 0),
                    script_rise(3, 0, 0)};
    const uint8_t ends[4] = {TASK_END_time, TASK_END_time, TASK_END_time, TASK_END_joint};
    const EvalDef eval = {.trials = 4, .seconds = 5, .start = TASK_START_BACK};
    MildError error = {0};
    EvalRow row;
    char line[384];
    assert_int_equal(eval_summarise(&row, "foam45", &eval, m, ends, 100, &error), MILD_OK);
    assert_int_equal(row.righted, 2);
    assert_int_equal(row.success, 3);
    assert_true(fabs(row.up - (3 + DT)) < 1e-9);
    eval_print_row(&row, line, sizeof line);
    assert_non_null(strstr(line, "  2/4 "));
    assert_non_null(strstr(line, "  up after 3.0 s"));
    assert_non_null(strstr(line, "1 joint"));
    row.start = TASK_START_STAND;
    eval_print_row(&row, line, sizeof line);
    assert_non_null(strstr(line, "  3/4 "));
    assert_null(strstr(line, "up after"));
}

TEST_MAIN(setup, teardown)
