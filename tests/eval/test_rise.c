/* The Go1 on its back: policies/go1_rise.safetensors stands up on soft ground and on very hard
 * ground, the policy that walks does not, and the trial says which. Nothing keeps a leg out of the
 * trunk, so the test measures that the policy makes no use of it. */
#include <mujoco/mujoco.h>

#include "env/task/policy_keys.h"
#include "kit.h"
#include "learn/policy.h"
#include "mild/batch.h"
#include "run/eval/eval.h"

#define RISES MILD_SOURCE_DIR "/policies/go1_rise.safetensors"
#define WALKS MILD_SOURCE_DIR "/policies/go1.safetensors"

enum { TRIALS = 4 };

static Robot *robot;
static mjModel *model; /* the whole file */
static mjData *data;

static int setup(void **unused) {
    (void)unused;
    MildError error = {0};
    char text[256] = "";
    model = mj_loadXML(MILD_SOURCE_DIR "/robots/go1/go1.xml", NULL, text, sizeof text);
    if (!model) {
        fail_msg("%s", text);
    }
    data = mj_makeData(model);
    robot = robot_create(MILD_SOURCE_DIR "/robots/go1", &error);
    if (!robot) {
        fail_msg("%s", error.text);
    }
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

/* Of the decisions after the robot came to rest: least distance of a leg's capsule and the box of
 * the trunk [m], and how many times a leg was deeper than 2 mm in it. */
typedef struct {
    double least;
    int legs, inside;
} Trunk;

static void see_trunk(void *context, const EvalDecision *decision) {
    static const char *const part[] = {"FL_thigh_capsule", "FR_thigh_capsule", "RL_thigh_capsule",
                                       "RR_thigh_capsule", "FL_calf_capsule",  "FR_calf_capsule",
                                       "RL_calf_capsule",  "RR_calf_capsule"};
    Trunk *trunk = context;
    const int box = mj_name2id(model, mjOBJ_GEOM, "trunk_box");
    if (decision->time < 1) {
        return;
    }
    mju_copy(data->qpos, decision->env->robot.qpos, 7 + 12);
    mj_kinematics(model, data);
    for (int i = 0; i < 8; i++) {
        const int leg = mj_name2id(model, mjOBJ_GEOM, part[i]);
        const double gap = mj_geomDistance(model, data, box, leg, 0.5, NULL);
        trunk->least = fmin(trunk->least, gap);
        trunk->inside += gap < -0.002;
        trunk->legs++;
    }
}

/* Trials from the back, of the task that the policy's file says. */
static EvalRow lie(const char *file, const char *ground, Trunk *trunk, EvalTrial each[TRIALS]) {
    MildError error = {0};
    TaskDef def = task_def_default();
    const EvalCallback watch = {see_trunk, trunk};
    const EvalDef eval = {.trials = TRIALS, .seconds = 7, .seed = 5, .callback = &watch};
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
    scene_harden(&scene);
    assert_false(scene.rigid);
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
static void it_rights_itself(void **unused) {
    (void)unused;
    static const char *const grounds[] = {"rigid", "foam45", "sand_dense"};
    EvalTrial each[TRIALS];
    Trunk trunk = {.least = 1};
    for (int g = 0; g < 3; g++) {
        const EvalRow row = lie(RISES, grounds[g], &trunk, each);
        assert_int_equal(row.start, TASK_START_BACK);
        assert_true(row.righted >= TRIALS - 1);
        assert_true(row.success == TRIALS && row.up > 1 && row.up < 5);
        for (int i = 0; i < TRIALS; i++) {
            assert_true(isnan(each[i].up) ||
                        (each[i].up > 1 && each[i].up < 5 && each[i].shells < 0.5));
        }
    }
    print_message("a leg is up to %.1f mm in the trunk's box, in %.2f %% of the decisions by more "
                  "than 2 mm\n",
                  -1e3 * trunk.least, 100.0 * trunk.inside / trunk.legs);
    assert_true(trunk.legs == 3 * TRIALS * 600 * 8);
    assert_true(trunk.least > -0.012 && trunk.inside < 0.02 * trunk.legs);
}

/* It stays on the ground, where its shells carry it, and that ends no trial. */
static void the_walking_policy_does_not(void **unused) {
    (void)unused;
    EvalTrial each[TRIALS];
    Trunk trunk = {.least = 1};
    const EvalRow row = lie(WALKS, "foam45", &trunk, each);
    assert_true(row.righted == 0 && isnan(row.up) && row.success == TRIALS);
    for (int i = 0; i < TRIALS; i++) {
        assert_true(isnan(each[i].up) && each[i].end == TASK_END_time && each[i].shells > 0.5);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_rights_itself),
        cmocka_unit_test(the_walking_policy_does_not),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
