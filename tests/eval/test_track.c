/* The track of two trials that turn: each row of the CSV against the state that the controller saw
 * after that step, the centre of mass from the engine's bodies, the angles from its rotation. */
#include <mujoco/mujoco.h>

#include "control/controller.h"
#include "eval_kit.h"

enum { TRIALS = 2, STEPS = 150, NUMBERS = 8 };

/* Asks the shipped policy, and notes where the robots are: mass centre, base, roll, pitch. */
typedef struct {
    Controller policy;
    RobotSim *sim;
    int calls;
    double seen[STEPS][TRIALS][NUMBERS];
    double turned; /* [rad] largest heading */
} Watcher;

static void see(Watcher *watcher, const TaskEnv *env, double seen[NUMBERS]) {
    const RobotState state = task_env_state(env);
    const RobotVariation nominal = robot_variation_nominal();
    robot_sim_load(watcher->sim, &state, &nominal);
    const mjModel *m = robot_sim_model(watcher->sim);
    const mjData *d = robot_sim_data(watcher->sim);
    double R[9];
    mju_quat2Mat(R, state.qpos + 3);
    for (int k = 0; k < 3; k++) {
        double sum = 0, mass = 0;
        for (int b = 1; b < m->nbody; b++) {
            sum += m->body_mass[b] * d->xipos[3 * b + k];
            mass += m->body_mass[b];
        }
        seen[k] = sum / mass;
        seen[3 + k] = state.qpos[k];
    }
    seen[6] = atan2(R[7], R[8]);
    seen[7] = asin(-R[6]);
    watcher->turned = fmax(watcher->turned, fabs(atan2(R[3], R[0])));
}

static void watch_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    Watcher *watcher = self;
    assert_int_equal(rows, TRIALS);
    for (int i = 0; i < rows && watcher->calls < STEPS; i++) {
        see(watcher, envs[i], watcher->seen[watcher->calls][i]);
    }
    watcher->calls++;
    watcher->policy.act(watcher->policy.self, rows, envs, actions);
}

static void watch_destroy(void *self) {
    (void)self;
}

/* Row number i of a trial is after policy step i, which the controller sees before the next. */
static void check_line(const char *line, const Watcher *watcher, int i, double *worst) {
    int trial;
    double time, at[NUMBERS];
    const int read = sscanf(line, "grass,0.4,%d,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf", &trial, &time,
                            &at[0], &at[1], &at[2], &at[3], &at[4], &at[5], &at[6], &at[7]);
    assert_int_equal(read, 2 + NUMBERS);
    assert_int_equal(trial, i / STEPS);
    const int step = i % STEPS;
    expect_near("time", time, (step + 1) * TASK_PERIOD, 1e-9);
    for (int k = 0; step + 1 < STEPS && k < NUMBERS; k++) {
        expect_entry("row", k, at[k], watcher->seen[step + 1][trial][k], 5.1e-6);
        worst[k] = fmax(worst[k], fabs(at[k]));
    }
}

TEST(a_point_of_a_turned_robot) {
    MildError error = {0};
    static Watcher watcher;
    double most[NUMBERS] = {0};
    Pool *pool = pool_create(1);
    char *text = NULL, *rest;
    size_t size = 0;
    Scene scene;
    EvalRow row;
    EvalDef eval = {.speed = 0.4, .turn = 0.5, .trials = TRIALS, .seed = 1};
    eval.seconds = STEPS * TASK_PERIOD;
    expect_good(controller_learned(POLICY, robot, pool, TRIALS, &watcher.policy, &error) == MILD_OK,
                &error);
    watcher.sim = robot_sim_create(robot, def.physics_dt, &error);
    expect_good(watcher.sim && scene_make(&scene, "grass", 2, &error) == MILD_OK, &error);
    Controller controller = {
        .self = &watcher, .name = "watcher", .act = watch_act, .destroy = watch_destroy};
    eval.track = open_memstream(&text, &size);
    expect_good(kit_run(&def, pool, &controller, &scene, &eval, &row, &error) == MILD_OK, &error);
    fclose(eval.track);

    int lines = 0;
    for (char *line = strtok_r(text, "\n", &rest); line; line = strtok_r(NULL, "\n", &rest)) {
        check_line(line, &watcher, lines++, most);
    }
    print_message("%d rows; heading to %.2f, roll to %.3f, pitch to %.3f rad\n", lines,
                  watcher.turned, most[6], most[7]);
    assert_int_equal(lines, TRIALS * STEPS);
    assert_true(watcher.turned > 0.3 && most[6] > 0.01 && most[7] > 0.01);
    free(text);
    controller_destroy(&watcher.policy);
    robot_sim_destroy(watcher.sim);
    pool_destroy(pool);
}

TEST_MAIN(kit_setup, kit_teardown)
