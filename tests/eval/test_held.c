/* The commands of a trial under task.speed_hold: those that a speed hold makes of the frames that
 * the policy sees. */
#include "control/speed_hold.h"
#include "eval_kit.h"

enum { TRIALS = 4 };
#define SPEED 0.3
#define SIDEWAYS 0.2

static SpeedHoldLegs legs;
static SpeedHold hold[TRIALS];
static int decisions;
static double last[TRIALS]; /* [m/s] forward */

static void decided(void *context, const EvalDecision *decision) {
    const TaskEnv *env = decision->env;
    double command[3] = {SPEED, SIDEWAYS, 0};
    (void)context;
    if (decision->time > 0) { /* the first frame was there before the trial */
        speed_hold(&hold[decision->trial], &legs, task_env_frame(decision->env), command);
    }
    assert_true(env->command[0] == command[0] && env->command[1] == command[1]);
    last[decision->trial] = command[0];
    decisions++;
}

/* Walks on foam, where the policy alone is too fast. */
static void walk(double gain) {
    MildError error = {0};
    Controller controller;
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
    expect_good(speed_hold_legs(robot, gain, &legs, &error) == MILD_OK, &error);
    assert_int_equal(scene_make(&scene, "foam25", 2, &error), MILD_OK);
    expect_good(controller_learned(POLICY, robot, pool, TRIALS, &controller, &error) == MILD_OK,
                &error);
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
