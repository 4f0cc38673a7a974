/* Trials by the batch engine against those that MuJoCo steps: the same rows within the noise of a
 * few trials, whatever the number of threads and of other rows. */
#include "eval_kit.h"

#include "device/device.h"
#include "ground/batch/batch.h"

enum { ROWS = 4 };

static MildModel model; /* that grounds are matched to */

/* What the policy's place is asked and answers. */
typedef struct {
    int calls, rows;
    float command[3]; /* that row 0 sees at the last call, scaled as observations are */
    float turned;     /* largest |wz| that row 0 saw */
} Asked;

static void zero_act_on(void *self, int rows, const float *history, float *actions) {
    Asked *asked = self;
    const float *frame = history + SA01_HISTORY - SA01_OBSERVATION;
    asked->calls++;
    asked->rows = rows;
    memcpy(asked->command, frame + 3, sizeof asked->command);
    asked->turned = fmaxf(asked->turned, fabsf(asked->command[2]));
    memset(actions, 0, sizeof *actions * (size_t)rows * SA01_JOINTS);
}

static Controller zero_controller(Asked *asked) {
    *asked = (Asked){0};
    return (Controller){.self = asked, .name = "zero", .act = kit_zero_act, .act_on = zero_act_on};
}

static Controller walker(Pool *pool, int rows) {
    MildError error = {0};
    Controller controller;
    assert_int_equal(controller_learned(MILD_SOURCE_DIR "/policies/mild.safetensors", robot, pool,
                                        rows, &controller, &error),
                     MILD_OK);
    return controller;
}

static int scenes_of(const char *const *names, Scene *scene) {
    MildError error = {0};
    int count = 0;
    for (; names[count]; count++) {
        assert_int_equal(scene_make(&scene[count], names[count], 2, &error), MILD_OK);
        MildMaterial *material = &scene[count].terrain.materials[0];
        const MildMaterial mild = *material;
        if (model != MILD_MODEL_MILD && mild.model == MILD_MODEL_MILD) {
            assert_int_equal(robot_match_model(robot, model, &mild, material, &error), MILD_OK);
        }
    }
    return count;
}

static MildStatus run_on(int device, Controller *controller, Pool *pool, const char *const *names,
                         const double *speeds, int speed_count, EvalDef eval, EvalRow *rows,
                         MildError *error) {
    Scene scene[ROWS];
    const EvalRun run = {.task = &def,
                         .robot = robot,
                         .pool = pool,
                         .controller = controller,
                         .batch = 1,
                         .device = device,
                         .scenes = scene,
                         .scene_count = scenes_of(names, scene),
                         .speeds = speeds,
                         .speed_count = speed_count,
                         .eval = eval};
    memset(rows, 0xff, ROWS * sizeof *rows);
    return eval_run(&run, rows, error);
}

static MildStatus run_batch(Controller *controller, Pool *pool, const char *const *names,
                            const double *speeds, int speed_count, EvalDef eval, EvalRow *rows,
                            MildError *error) {
    return run_on(MILD_BATCH_HOST, controller, pool, names, speeds, speed_count, eval, rows, error);
}

static void near(const char *what, const EvalRow *row, double is, double wanted, double within) {
    const int neither = isnan(is) && isnan(wanted); /* nothing to measure */
    if (!neither && !(fabs(is - wanted) <= within)) {
        fail_msg("%s %.1f m/s: %s is %g by the batch engine, %g by MuJoCo", row->ground, row->speed,
                 what, is, wanted);
    }
}

/* All rows of a batch against MuJoCo's, each measure within what twelve trials scatter; two trials
 * are only begun where kit_short says so. */
static void compare_rows(const char *const *names, const double *speeds, int speed_count,
                         double turn, int device) {
    MildError error = {0};
    const int is_short = kit_short();
    EvalDef eval = {
        .turn = turn, .trials = is_short ? 2 : 12, .seconds = is_short ? 0.4 : 6, .seed = 1};
    Pool *pool = pool_create(2);
    Controller controller = walker(pool, ROWS * eval.trials);
    EvalRow rows[ROWS], own;
    Scene scene[ROWS];
    char line[256];
    const int count = scenes_of(names, scene) * speed_count;
    assert_int_equal(
        run_on(device, &controller, pool, names, speeds, speed_count, eval, rows, &error), MILD_OK);
    for (int i = 0; i < count; i++) {
        const EvalRow *row = &rows[i];
        eval.speed = speeds[i % speed_count];
        assert_int_equal(
            kit_run(&def, pool, &controller, &scene[i / speed_count], &eval, &own, &error),
            MILD_OK);
        eval_print_row(row, line, sizeof line);
        printf("%s\n", line);
        eval_print_row(&own, line, sizeof line);
        printf("%s\n", line);
        assert_string_equal(row->ground, own.ground);
        assert_true(row->speed == own.speed && row->trials == own.trials);
        if (is_short) {
            continue;
        }
        assert_true(row->success == own.success && row->success == 12);
        near("velocity", row, row->velocity, own.velocity, 0.02);
        near("cot", row, row->cot / own.cot, 1, 0.04);
        near("torque_max", row, row->torque_max / own.torque_max, 1, 0.06);
        near("clearance", row, row->clearance / own.clearance, 1, 0.04);
        near("penetration", row, row->penetration, own.penetration, 0.03 * own.penetration);
        near("drift", row, row->drift / own.drift, 1, 0.2);
        near("energy", row, row->energy / own.energy, 1, 0.04);
        near("base_oscillation", row, row->base_oscillation / own.base_oscillation, 1, 0.1);
        near("tilt_rate", row, row->smooth.tilt_rate / own.smooth.tilt_rate, 1, 0.1);
        near("yaw_rate", row, row->smooth.yaw_rate / own.smooth.yaw_rate, 1, 0.1);
        near("joint_speed", row, row->smooth.joint_speed / own.smooth.joint_speed, 1, 0.04);
        near("action_jerk", row, row->smooth.action_jerk / own.smooth.action_jerk, 1, 0.04);
        near("turning", row, row->velocity_turn, own.velocity_turn, 0.02);
        near("seconds", row, row->seconds, own.seconds, 1e-9);
    }
    controller_destroy(&controller);
    pool_destroy(pool);
}

TEST(rows_agree_with_mujoco) {
    static const char *const names[] = {"rigid", "foam45", "sand_loose", NULL};
    static const double speed = 0.6;
    compare_rows(names, &speed, 1, 0, MILD_BATCH_HOST);
}

/* The same rows at two speeds, on waves. */
TEST(rows_agree_on_a_map) {
    static const char *const names[] = {"rigid", "grass", NULL};
    static const double speeds[2] = {0.3, -0.4};
    MildMapDef waves = mild_map_def_default();
    waves.kind = MILD_MAP_WAVES;
    waves.amplitude = 0.005;
    MildMap *map = mild_map_create(&waves, NULL);
    assert_non_null(map);
    def.map = map;
    compare_rows(names, speeds, 2, 0, MILD_BATCH_HOST);
    def.map = NULL;
    mild_map_destroy(map);
}

TEST(turning_rows_agree) {
    static const char *const names[] = {"foam60", NULL};
    static const double speed = 0.4;
    compare_rows(names, &speed, 1, 0.5, MILD_BATCH_HOST);
}

/* By a GPU, where there is one. */
TEST(rows_of_a_device_agree) {
    static const char *const names[] = {"rigid", "foam45", "sand_loose", NULL};
    static const double speed = 0.6;
    MildError error = {0};
    if (device_open(0, &error) != MILD_OK) {
        skip();
    }
    compare_rows(names, &speed, 1, 0, 0);
    compare_rows(names, &speed, 1, 0.5, 0);
    model = MILD_MODEL_ECC_QUASI;
    compare_rows(names, &speed, 1, 0, 0);
    model = MILD_MODEL_MILD;
}

/* The bits of a row depend neither on threads nor on the rows beside it. */
TEST(rows_repeat) {
    static const char *const all[] = {"rigid", "sand_loose", NULL}, *const one[] = {"sand_loose",
                                                                                    NULL};
    static const double speeds[2] = {0.3, 0.6};
    const EvalDef eval = {.trials = 3, .seconds = kit_short() ? 0.3 : 2.7, .seed = 5};
    MildError error = {0};
    EvalRow rows[3][ROWS];
    for (int i = 0; i < 3; i++) {
        Pool *pool = pool_create(i == 1 ? 2 : 1);
        Controller controller = walker(pool, 12);
        assert_int_equal(run_batch(&controller, pool, i < 2 ? all : one,
                                   i < 2 ? speeds : speeds + 1, i < 2 ? 2 : 1, eval, rows[i],
                                   &error),
                         MILD_OK);
        controller_destroy(&controller);
        pool_destroy(pool);
    }
    assert_memory_equal(rows[0], rows[1], sizeof rows[0]);
    if (kit_short()) {
        return; /* nothing is measured in the first second */
    }
    assert_true(rows[0][3].velocity > 0.2 && rows[2][0].success == rows[0][3].success);
    assert_true(fabs(rows[2][0].velocity - rows[0][3].velocity) < 1e-4);
    assert_true(fabs(rows[2][0].energy / rows[0][3].energy - 1) < 1e-3);
}

/* A policy of zeros falls, is counted as fallen when MuJoCo's is, and its trials are over then. */
TEST(falls_are_counted) {
    static const char *const names[] = {"foam28", NULL};
    static const double speed = 0.3;
    const EvalDef eval = {.speed = 0.3, .trials = 8, .seconds = 4, .seed = 1};
    MildError error = {0};
    Asked asked;
    Controller controller = zero_controller(&asked);
    Pool *pool = pool_create(1);
    EvalRow rows[ROWS], own;
    Scene scene[ROWS];
    scenes_of(names, scene);
    assert_int_equal(run_batch(&controller, pool, names, &speed, 1, eval, rows, &error), MILD_OK);
    assert_true(asked.calls == 400 && asked.rows == 8);
    assert_int_equal(kit_run(&def, pool, &controller, scene, &eval, &own, &error), MILD_OK);
    assert_true(rows[0].success == own.success && rows[0].success == 0);
    assert_memory_equal(rows[0].ends, own.ends, sizeof own.ends);
    assert_int_equal(own.ends[TASK_END_time], 0);
    assert_true(own.seconds > 0.2 && fabs(rows[0].seconds / own.seconds - 1) < 0.1);
    assert_true(fabs(rows[0].energy / own.energy - 1) < 0.1);
    pool_destroy(pool);
}

/* What the policy sees: its own speed, sideways too, turned towards world x, until the stop. */
TEST(commands_arrive) {
    static const char *const names[] = {"rubber", NULL};
    static const double speeds[2] = {0.4, 0.1};
    EvalDef eval = {.sideways = 0.1, .trials = 1, .seconds = 0.3, .seed = 1};
    MildError error = {0};
    Asked asked;
    Controller controller = zero_controller(&asked);
    Pool *pool = pool_create(1);
    EvalRow rows[ROWS];
    assert_int_equal(run_batch(&controller, pool, names, speeds, 2, eval, rows, &error), MILD_OK);
    assert_true(asked.calls == 30 && asked.rows == 2);
    assert_true(fabsf(asked.command[0] - 0.8f) < 1e-6f && fabsf(asked.command[1] - 0.2f) < 1e-6f);
    assert_true(asked.turned > 0 && asked.turned <= 0.5f);
    eval.stop = 0.2;
    assert_int_equal(run_batch(&controller, pool, names, speeds, 2, eval, rows, &error), MILD_OK);
    assert_true(asked.command[0] == 0 && asked.command[1] == 0 && asked.command[2] == 0);
    pool_destroy(pool);
}

static void check_bad_trials(const char *ground, int trials, int histories, const char *named) {
    const char *const names[] = {ground, NULL};
    static const double speed = 0.3;
    const EvalDef eval = {.trials = trials, .seconds = 0.1, .seed = 1};
    MildError error = {0};
    Asked asked;
    Controller controller = zero_controller(&asked);
    controller.act_on = histories ? zero_act_on : NULL;
    Pool *pool = pool_create(1);
    EvalRow rows[ROWS];
    const MildStatus status = run_batch(&controller, pool, names, &speed, 1, eval, rows, &error);
    assert_refused(status, MILD_ERROR_ARGUMENT, &error, named);
    pool_destroy(pool);
}

TEST(what_is_not_there_is_refused) {
    check_bad_trials("rubber+grass", 1, 1, "--ground rubber+grass --train.robots");
    check_bad_trials("grass", EVAL_ROBOTS_MAX + 1, 1, "--trials 65537 --train.robots");
    check_bad_trials("grass", 1, 0, "--controller zero --train.robots");
    def.solver = MILD_SOLVER_GAUSS_SEIDEL;
    check_bad_trials("grass", 1, 1, "task.solver newton train.robots mujoco");
    def.solver = MILD_SOLVER_NEWTON;
    def.imprint_tiles = 8;
    check_bad_trials("grass", 1, 1, "terrain.memory train.robots mujoco");
    def.imprint_tiles = 0;
}

TEST_MAIN(kit_setup, kit_teardown)
