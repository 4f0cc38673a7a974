/* What passes inside a policy, along a walk: the columns of the CSV against the policy's file and
 * the formulas of the paper, and the means of an ablation. */
#include "eval_kit.h"

#include "learn/policy.h"
#include "run/eval/actions.h"

enum { TRIALS = 2, STEPS = 150, LATENT = 16, TEXTS = 2, COLUMNS = 5 + 2 * LATENT + 2 + 11 };
enum { SPEED = 2, TIME, PHASE, Z, MODULATED = Z + LATENT, THETA = MODULATED + LATENT };
enum { ESTIMATES = THETA + 2 };

/* A walk over a border at x = 0.2, whose decisions are logged. */
static char *log_walk(InsideLog *log, Controller *controller) {
    MildError error = {0};
    const EvalCallback callback = inside_callback(log);
    const EvalDef eval = {
        .speed = 0.5, .trials = TRIALS, .seconds = STEPS * 0.01, .seed = 1, .callback = &callback};
    Scene scene;
    EvalRow row;
    static char *text; /* its address is the stream's */
    static size_t size;
    Pool *pool = pool_create(2);
    assert_int_equal(scene_make(&scene, "foam60+rigid", 0.2, &error), MILD_OK);
    log->feet = robot_feet(robot);
    assert_int_equal(learned_watch(controller, &log->inside, &error), MILD_OK);
    log->csv = open_memstream(&text, &size);
    assert_non_null(log->csv);
    inside_print_header(log);
    assert_int_equal(kit_run(&def, pool, controller, &scene, &eval, &row, &error), MILD_OK);
    assert_int_equal(row.success, TRIALS);
    fclose(log->csv);
    pool_destroy(pool);
    return text;
}

static Controller learned(void) {
    MildError error = {0};
    Controller controller;
    assert_int_equal(controller_learned(POLICY, robot, NULL, TRIALS, &controller, &error), MILD_OK);
    return controller;
}

typedef struct {
    int trial;
    char ground[32];
    double value[COLUMNS];
} Line;

/* The next line; its end in *text. */
static Line read_line(char **text) {
    Line line;
    char *at = *text;
    line.trial = (int)strtol(at, &at, 10);
    const size_t name = strcspn(++at, ",");
    snprintf(line.ground, sizeof line.ground, "%.*s", (int)name, at);
    at += name;
    for (int i = TEXTS; i < COLUMNS; i++) {
        assert_true(*at == ',');
        line.value[i] = strtod(at + 1, &at);
    }
    assert_true(*at == '\n');
    *text = at + 1;
    return line;
}

/* A row per trial and decision; theta, z and z~ belong together; the grounds are those under the
 * base; estimates are in SI units, near what the robot does. */
TEST(the_columns) {
    InsideLog log = {0};
    Controller controller = learned();
    const double slowing = def.gait_slowing;
    def.gait_slowing = 0; /* or the period follows the turning that holds the heading */
    char *text = log_walk(&log, &controller), *at = strchr(text, '\n') + 1;
    def.gait_slowing = slowing;
    int commas = 0, border[TRIALS] = {0};
    double forward = 0, before[TRIALS] = {0};
    for (const char *c = text; *c != '\n'; c++) {
        commas += *c == ',';
    }
    assert_int_equal(commas + 1, COLUMNS);
    assert_true(strncmp(text, "trial,ground,speed_m_s,time_s,phase,z0,", 39) == 0);
    assert_non_null(strstr(text, ",z15,modulated0,"));
    assert_non_null(strstr(text, ",modulated15,theta1,theta2,velocity_x_m_s,"));
    assert_non_null(strstr(text, ",foot1_velocity_z_m_s,foot0_height_m,foot1_height_m\n"));
    for (int k = 0; k < STEPS; k++) {
        for (int i = 0; i < TRIALS; i++) {
            const Line line = read_line(&at);
            const double *v = line.value;
            assert_true(line.trial == i && v[SPEED] == 0.5 && fabs(v[TIME] - 0.01 * k) < 1e-9);
            for (int j = 0; j < LATENT; j++) {
                const double wanted = v[THETA] * v[Z + j] + v[THETA + 1];
                assert_true(fabs(v[MODULATED + j] - wanted) < 1e-4);
            }
            if (k > 0) {
                const double turned = v[PHASE] - before[i] + (v[PHASE] < before[i]);
                assert_true(fabs(turned - 0.01 / def.gait_period) < 1e-5);
            }
            before[i] = v[PHASE];
            border[i] += strcmp(line.ground, "rigid") == 0;
            assert_true(border[i] > 0 || strcmp(line.ground, "foam60") == 0);
            forward += k >= STEPS / 2 ? v[ESTIMATES] / (TRIALS * (STEPS - STEPS / 2)) : 0;
        }
    }
    assert_true(*at == 0);
    print_message("forward, as estimated: %.3f m/s\n", forward);
    assert_true(border[0] > 0 && border[0] < STEPS && border[1] > 0);
    assert_true(fabs(forward - 0.5) < 0.1);
    free(text);
    controller_destroy(&controller);
}

/* The last row is what the policy's file says of the last history. */
typedef struct {
    Controller inner;
    float history[TRIALS][SA01_HISTORY];
} Keeping;

static void keeping_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    Keeping *keeping = self;
    for (int i = 0; i < rows; i++) {
        memcpy(keeping->history[i], task_env_history(envs[i]), sizeof keeping->history[i]);
    }
    keeping->inner.act(keeping->inner.self, rows, envs, actions);
}

TEST(the_numbers_are_the_policys) {
    MildError error = {0};
    Keeping keeping = {.inner = learned()};
    TaskDef scaled = def; /* as if it had been trained with other scales */
    scaled.velocity_scale = 2;
    scaled.height_scale = 5;
    InsideLog log = {.feet = SA01_FEET};
    const EvalCallback callback = inside_callback(&log);
    const EvalDef eval = {.speed = 0.5, .trials = TRIALS, .seconds = 0.2, .callback = &callback};
    Controller controller = {.self = &keeping, .name = "keeping", .act = keeping_act};
    double sum[LATENT + SA01_ESTIMATES + 2] = {0}; /* theta1, theta2 */
    Scene scene;
    EvalRow row;
    char *text = NULL, *at;
    size_t size;
    Pool *pool = pool_create(1);
    assert_int_equal(scene_make(&scene, "grass", 1, &error), MILD_OK);
    assert_int_equal(learned_watch(&keeping.inner, &log.inside, &error), MILD_OK);
    log.csv = open_memstream(&text, &size);
    log.sum = sum;
    assert_int_equal(kit_run(&scaled, pool, &controller, &scene, &eval, &row, &error), MILD_OK);
    fclose(log.csv);
    Policy *policy = policy_load(POLICY, NULL, 0, &error);
    assert_non_null(policy);
    float actions[TRIALS * SA01_JOINTS], estimates[TRIALS][SA01_ESTIMATES], latent[TRIALS][LATENT];
    policy_act(policy, NULL, TRIALS, keeping.history[0], actions, estimates[0], latent[0]);
    at = text;
    double z0 = 0, velocity = 0, theta[2] = {0};
    for (int k = 0; k < 20; k++) {
        for (int i = 0; i < TRIALS; i++) {
            const Line line = read_line(&at);
            z0 += line.value[Z] / (20 * TRIALS);
            velocity += 2 * line.value[ESTIMATES] / (20 * TRIALS);
            theta[0] += line.value[THETA] / (20 * TRIALS);
            theta[1] += line.value[THETA + 1] / (20 * TRIALS);
            for (int j = 0; k == 19 && j < SA01_ESTIMATES; j++) {
                const double scale = j < 3 ? 2 : j < 9 ? 1 : 5;
                assert_true(fabs(line.value[ESTIMATES + j] * scale - (double)estimates[i][j]) <
                            1e-4);
            }
            for (int j = 0; k == 19 && j < LATENT; j++) {
                assert_true(fabs(line.value[MODULATED + j] - (double)latent[i][j]) < 1e-4);
            }
        }
    }
    float means[LATENT + SA01_ESTIMATES + 2];
    inside_means(&log, means);
    assert_int_equal(log.decisions, 20 * TRIALS);
    assert_true(fabs((double)means[0] - z0) < 1e-4);
    assert_true(fabs((double)means[LATENT] - velocity) < 1e-4);
    for (int i = 0; i < 2; i++) {
        assert_true(fabs((double)means[LATENT + SA01_ESTIMATES + i] - theta[i]) < 1e-4);
    }
    policy_destroy(policy);
    free(text);
    pool_destroy(pool);
    controller_destroy(&keeping.inner);
}

TEST_MAIN(kit_setup, kit_teardown)
