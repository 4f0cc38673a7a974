/* The commands of a trial under task.speed_hold: those that a speed hold makes of the frames that
 * the policy sees, and of what it takes its velocity for. */
#include "control/speed_hold.h"
#include "eval_kit.h"

enum { TRIALS = 4 };
#define SPEED 0.3
#define SIDEWAYS 0.2

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

/* Walks on foam, where the policy alone is too fast. */
static void walk(double gain) {
    MildError error = {0};
    TaskDef task = def;
    Scene scene;
    EvalRow row;
    Pool *pool = pool_create(2);
    const EvalCallback callback = {decided, NULL};
    const EvalDef eval = {.speed = SPEED,
                          .sideways = SIDEWAYS,
                          .trials = TRIALS,
                          .seconds = 14,
                          .seed = 1,
                          .callback = &callback};
    task.speed_hold = gain;
    decisions = 0;
    memset(hold, 0, sizeof hold);
    assert_int_equal(scene_make(&scene, "foam25", 2, &error), MILD_OK);
    expect_good(controller_learned(POLICY, robot, pool, TRIALS, &controller, &error) == MILD_OK,
                &error);
    held = speed_hold_def(&task, robot, &controller);
    expect_good(kit_run(&task, pool, &controller, &scene, &eval, &row, &error) == MILD_OK, &error);
    assert_int_equal(row.success, TRIALS);
    assert_int_equal(decisions, TRIALS * 1400);
    controller_destroy(&controller);
    pool_destroy(pool);
}

TEST(commands_are_those_of_a_speed_hold) {
    walk(0.1);
    for (int i = 0; i < TRIALS; i++) {
        assert_true(hold[i].cycles > 5);
        assert_true(last[i] != SPEED && fabs(last[i] / SPEED - 1) < 0.15);
    }
}

TEST(without_they_are_as_given) {
    walk(0);
    for (int i = 0; i < TRIALS; i++) {
        assert_true(last[i] == SPEED);
    }
}

TEST_MAIN(kit_setup, kit_teardown)
