/* The commands of a trial under task.speed_hold: those that a speed hold makes of the frames that
 * the policy sees, and of what it takes its velocity for. */
#include <unistd.h>

#include "control/speed_hold.h"
#include "eval_kit.h"

enum { TRIALS = 4 };
#define SPEED 0.3
#define SIDEWAYS 0.2
#define SEEING "build_test_held.safetensors"

static SpeedHoldDef held;
static Controller controller;
static SpeedHold hold[TRIALS];
static float estimate[TRIALS][3]; /* of the decision before */
static int decisions;
static double last[TRIALS]; /* [m/s] forward */

static void decided(void *context, const EvalDecision *decision) {
    const TaskEnv *env = decision->env;
    double command[3] = {SPEED, SIDEWAYS, 0};
    (void)context;
    if (decision->time > 0) { /* the first frame was there before the trial */
        speed_hold(&hold[decision->trial], &held, task_env_frame(decision->env),
                   estimate[decision->trial], command);
    }
    assert_true(env->command[0] == command[0] && env->command[1] == command[1]);
    last[decision->trial] = command[0];
    memcpy(estimate[decision->trial], controller_estimates(&controller, decision->trial),
           sizeof estimate[0]);
    decisions++;
}

/* The shipped policy, or with a scan in its task one that sees it and acts as if it did not. */
static const char *policy_of(const TaskDef *task) {
    const TaskShape shape = task_shape(task, robot);
    if (shape.scan == 0) {
        return POLICY;
    }
    Policy *blind = policy_load(POLICY, NULL, 0, NULL);
    PolicyDef wide = *policy_def(blind);
    wide.scan = shape.scan;
    wide.critic_input += shape.scan;
    Policy *seeing = policy_create(&wide, 1, NULL);
    assert_true(policy_take_networks(seeing, blind));
    assert_int_equal(policy_save(seeing, SEEING, "", NULL), MILD_OK);
    policy_destroy(seeing);
    policy_destroy(blind);
    return SEEING;
}

/* Walks on foam, where the policy alone is too fast. */
static void walk(double gain, int scan, double seconds) {
    MildError error = {0};
    TaskDef task = def;
    Scene scene;
    EvalRow row;
    Pool *pool = pool_create(2);
    const EvalCallback callback = {decided, NULL};
    const EvalDef eval = {.speed = SPEED,
                          .sideways = SIDEWAYS,
                          .trials = TRIALS,
                          .seconds = seconds,
                          .seed = 1,
                          .callback = &callback};
    task.speed_hold = gain;
    task.scan = scan;
    decisions = 0;
    memset(hold, 0, sizeof hold);
    assert_int_equal(scene_make(&scene, "foam25", 2, &error), MILD_OK);
    const ControllerDef learned = {policy_of(&task), &task, robot, pool, TRIALS};
    expect_good(controller_make_learned(&learned, &controller, &error) == MILD_OK, &error);
    held = speed_hold_def(&task, robot, &controller);
    expect_good(kit_run(&task, pool, &controller, &scene, &eval, &row, &error) == MILD_OK, &error);
    assert_int_equal(row.success, TRIALS);
    assert_int_equal(decisions, TRIALS * (int)(100 * seconds));
    controller_destroy(&controller);
    pool_destroy(pool);
}

TEST(commands_are_those_of_a_speed_hold) {
    walk(0.1, 0, 14);
    for (int i = 0; i < TRIALS; i++) {
        assert_true(hold[i].cycles[SPEED_HOLD_LINEAR] > 5);
        assert_true(last[i] != SPEED && fabs(last[i] / SPEED - 1) < 0.15);
    }
}

/* The scan stands behind the frame. */
TEST(also_of_a_policy_that_sees) {
    walk(0.1, 3, 6);
    for (int i = 0; i < TRIALS; i++) {
        assert_true(hold[i].cycles[SPEED_HOLD_LINEAR] > 1 && last[i] != SPEED);
    }
    unlink(SEEING);
}

TEST(without_they_are_as_given) {
    walk(0, 0, 14);
    for (int i = 0; i < TRIALS; i++) {
        assert_true(last[i] == SPEED);
    }
}

TEST_MAIN(kit_setup, kit_teardown)
