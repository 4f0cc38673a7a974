/* What a trial writes down at each decision and each policy step, of three robots of which the
 * second falls: the CSV of EvalDef.actions against the environments that the watch was shown, and
 * the points of EvalDef.track. */
#include <mujoco/mujoco.h>

#include "eval_kit.h"

#include "run/eval/actions.h"

enum { TRIALS = 3, FALLS = 1, STEPS = 200, COLUMNS_MAX = 160 };
enum { BEFORE = 15, QUATERNION = 5 }; /* columns before the joints'; its place in `shown` */

static double shown[TRIALS][STEPS][COLUMNS_MAX]; /* from the column `time_s` on */
static float given[TRIALS * ROBOT_JOINTS_MAX];   /* actions of the last call of falling_act */
static int decisions[TRIALS], joints, frame;

static void put(double **at, const double *numbers, int count) {
    for (int i = 0; i < count; i++) {
        *(*at)++ = numbers[i];
    }
}

static void decided(void *context, const EvalDecision *decision) {
    const TaskEnv *env = decision->env;
    double *at = shown[decision->trial][decisions[decision->trial]++];
    const float *newest =
        task_env_history(decision->env) + env->shape.history - env->shape.observation;
    (void)context;
    assert_memory_equal(decision->action, given + decision->trial * joints,
                        (size_t)joints * sizeof *given);
    put(&at, &decision->time, 1);
    put(&at, env->command_seen, 3);
    put(&at, &env->phase, 1);
    put(&at, env->robot.qpos + 3, 4);
    put(&at, env->robot.qvel + 3, 3);
    put(&at, env->robot.qpos + 7, joints);
    put(&at, env->robot.qvel + 6, joints);
    for (int i = 0; i < frame; i++) {
        *at++ = (double)newest[i];
    }
    for (int i = 0; i < joints; i++) {
        *at++ = fmin(fmax((double)decision->action[i], -def.action_clip), def.action_clip);
    }
}

/* The shipped policy, but the second robot kicks out with all joints. */
static void falling_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    const Controller *walks = self;
    walks->act(walks->self, rows, envs, actions);
    for (int i = 0; i < joints; i++) {
        actions[FALLS * joints + i] = 20;
    }
    memcpy(given, actions, (size_t)(rows * joints) * sizeof *given);
}

static void header_names_every_column(char *line) {
    static const char *const of_joint[3] = {"angle_%s_rad", "speed_%s_rad_s", "action_%s"};
    int columns = 0;
    for (char *more, *word = strtok_r(line, ",", &more); word; word = strtok_r(NULL, ",", &more)) {
        const int at = columns++ - BEFORE, kind = at < 2 * joints ? at / joints : 2;
        char name[64] = "";
        if (at >= 2 * joints && at < 2 * joints + frame) {
            snprintf(name, sizeof name, "observation%d", at - 2 * joints);
        } else if (at >= 0) {
            const int joint = kind < 2 ? at % joints : at - 2 * joints - frame;
            snprintf(name, sizeof name, of_joint[kind], robot_joint_name(robot, joint));
        }
        assert_true(at < 0 || strcmp(word, name) == 0);
    }
    assert_int_equal(columns, BEFORE + 3 * joints + frame);
}

/* Trial by trial until each is over, every number that the watch was shown. */
static void check_actions(char *text) {
    char *more, *line = strtok_r(text, "\n", &more);
    int rows[TRIALS] = {0};
    header_names_every_column(line);
    while ((line = strtok_r(NULL, "\n", &more))) {
        char *at = line;
        const int trial = (int)strtol(at, &at, 10);
        assert_true(trial >= 0 && trial < TRIALS && rows[trial] < decisions[trial]);
        assert_true(strncmp(at, ",foam60,0.5,", 12) == 0);
        at += 11;
        for (int c = 0; c < BEFORE - 3 + 3 * joints + frame; c++) {
            const double wanted = shown[trial][rows[trial]][c], is = strtod(at + 1, &at);
            assert_true(fabs(is - wanted) <= 1e-8 * fabs(wanted));
        }
        assert_true(*at == 0);
        rows[trial]++;
    }
    for (int i = 0; i < TRIALS; i++) {
        assert_int_equal(rows[i], decisions[i]);
    }
}

/* A point after each step but that of the fall, with the angles of the next decision's
 * quaternion. */
static void check_track(char *text) {
    double first[TRIALS], last[TRIALS];
    int points[TRIALS] = {0};
    char *more, *line = strtok_r(text, "\n", &more);
    for (; line; line = strtok_r(NULL, "\n", &more)) {
        int trial;
        double time, x, roll, pitch, R[9];
        assert_int_equal(sscanf(line, "foam60,0.5,%d,%lf,%lf,%*f,%*f,%*f,%*f,%*f,%lf,%lf", &trial,
                                &time, &x, &roll, &pitch),
                         5);
        assert_true(trial >= 0 && trial < TRIALS);
        if (points[trial] + 1 < decisions[trial]) {
            mju_quat2Mat(R, shown[trial][points[trial] + 1] + QUATERNION);
            expect_near("roll", roll, atan2(R[7], R[8]), 5.1e-6);
            expect_near("pitch", pitch, asin(-R[6]), 5.1e-6);
        }
        first[trial] = points[trial] == 0 ? x : first[trial];
        last[trial] = x;
        assert_true(fabs(time - 0.01 * ++points[trial]) < 1e-6);
    }
    for (int i = 0; i < TRIALS; i++) {
        assert_int_equal(points[i], decisions[i] - (i == FALLS));
        assert_true(i == FALLS || last[i] - first[i] > 0.4);
    }
}

TEST(a_fall_ends_one_trial) {
    char *actions = NULL, *track = NULL;
    size_t size[2];
    MildError error = {0};
    Controller walks, falls = {.self = &walks, .name = "falls", .act = falling_act};
    const EvalCallback callback = {decided, NULL};
    const EvalDef eval = {.speed = 0.5,
                          .trials = TRIALS,
                          .seconds = STEPS * 0.01,
                          .seed = 1,
                          .callback = &callback,
                          .actions = open_memstream(&actions, &size[0]),
                          .track = open_memstream(&track, &size[1])};
    Scene scene;
    EvalRow row;
    Pool *pool = pool_create(2);
    joints = robot_joints(robot);
    frame = task_shape(&def, robot).observation;
    assert_true(BEFORE - 3 + 3 * joints + frame <= COLUMNS_MAX);
    assert_int_equal(scene_make(&scene, "foam60", 2, &error), MILD_OK);
    assert_int_equal(controller_learned(POLICY, robot, pool, TRIALS, &walks, &error), MILD_OK);
    actions_print_header(eval.actions, &def, robot);
    assert_int_equal(kit_run(&def, pool, &falls, &scene, &eval, &row, &error), MILD_OK);
    fclose(eval.actions);
    fclose(eval.track);
    print_message("decisions %d, %d, %d\n", decisions[0], decisions[1], decisions[2]);
    assert_int_equal(row.success, TRIALS - 1);
    for (int i = 0; i < TRIALS; i++) {
        assert_true(i == FALLS ? decisions[i] < STEPS - 20 : decisions[i] == STEPS);
    }
    check_actions(actions);
    check_track(track);
    free(actions);
    free(track);
    controller_destroy(&walks);
    pool_destroy(pool);
}

TEST_MAIN(kit_setup, kit_teardown)
