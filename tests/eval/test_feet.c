/* What --feet writes of trials whose samples are made up: their values, angles of a turned foot,
 * the pressure centre by its definition, and the order of the rows. */
#include <mujoco/mujoco.h>

#include "env/envs.h"
#include "eval_kit.h"
#include "run/eval/track.h"

enum { TRIALS = 2, PERIODS = 10, OF_PERIOD = 4, STEPS = PERIODS * OF_PERIOD, COLUMNS = 16 };

static int callocs; /* until one fails; 0: none does */

WRAPS(calloc);
void *__wrap_calloc(size_t count, size_t size) {
    return callocs > 0 && --callocs == 0 ? NULL : __real_calloc(count, size);
}

/* Yawed, then pitched, then rolled. */
static void turn(double roll, double pitch, double yaw, double rotation[9]) {
    const double angle[3] = {roll, pitch, yaw};
    double q[3][4], turned[4], all[4];
    for (int k = 0; k < 3; k++) {
        double axis[3] = {0};
        axis[k] = 1;
        mju_axisAngle2Quat(q[k], axis, angle[k]);
    }
    mju_mulQuat(turned, q[2], q[1]);
    mju_mulQuat(all, turned, q[0]);
    mju_quat2Mat(rotation, all);
}

/* What the feet of a trial do in a physics step: numbers of their own everywhere; foot 0 is in the
 * air with a last push of 0.99 N in the first step of a trial. */
static EnvsFoot made_foot(int trial, int i, int f) {
    EnvsFoot foot = {.depth = 0.01 * (f + 1) + 0.001 * i + 0.005 * trial,
                     .height = -0.02 * (f + 1) - 0.001 * i - 0.003 * trial};
    for (int k = 0; k < 3; k++) {
        foot.force[k] = 10.0 * (f + 1) * (k + 1) + 3.0 * i + 100.0 * trial;
        foot.torque[k] = (f - 2.0) * (k + 2) + i + trial;
        foot.position[k] = f + 0.1 * k + 0.01 * i + trial;
    }
    if (i == 0 && f == 0) {
        memset(foot.force, 0, sizeof foot.force);
        foot.force[2] = 0.99;
    }
    turn(0.2 * f - 0.1 + 0.01 * i, 0.15 - 0.2 * f - 0.01 * i, 2.5 * f - 1 + 0.005 * i,
         foot.rotation);
    return foot;
}

static int steps;          /* policy steps of all trials */
static EnvsSample *sample; /* [TRIALS][OF_PERIOD] where a policy step's go */

WRAPS(envs_set_samples);
void __wrap_envs_set_samples(Envs *envs, EnvsSample *to) {
    sample = to ? to : sample;
    __real_envs_set_samples(envs, to);
}

WRAPS(envs_step);
MildStatus __wrap_envs_step(Envs *envs, const EnvsStep *step, MildStream stream, MildError *error) {
    const MildStatus status = __real_envs_step(envs, step, stream, error);
    for (int n = 0; n < TRIALS * OF_PERIOD; n++) {
        for (int f = 0; f < SA01_FEET; f++) {
            const int i = steps * OF_PERIOD + n % OF_PERIOD;
            sample[n].foot[f] = made_foot(n / OF_PERIOD, i, f);
        }
    }
    steps++;
    return status;
}

/* The text that two trials write; NULL: they failed. */
static char *write_feet(MildError *error) {
    static const EvalDef start = {
        .speed = 0.3, .trials = TRIALS, .seconds = PERIODS * TASK_PERIOD, .seed = 1};
    EvalDef eval = start;
    Controller controller = {.name = "zero", .act = kit_zero_act};
    TaskDef task = def;
    Scene scene;
    EvalRow row;
    char *text = NULL;
    size_t size = 0;
    const int until = callocs;
    callocs = 0;
    Pool *pool = pool_create(1);
    task.physics_dt = TASK_PERIOD / OF_PERIOD;
    expect_good(scene_make(&scene, "foam45", 2, error) == MILD_OK, error);
    eval.feet = open_memstream(&text, &size);
    steps = 0;
    callocs = until;
    const MildStatus status = kit_run(&task, pool, &controller, &scene, &eval, &row, error);
    const int left = callocs;
    callocs = 0;
    fclose(eval.feet);
    pool_destroy(pool);
    callocs = left;
    if (status != MILD_OK) {
        assert_int_equal(status, error->status);
        free(text);
        return NULL;
    }
    return text;
}

/* The rows, [trial][step][foot], after ground, speed, trial, foot and time. */
static double feet_row[TRIALS][STEPS][SA01_FEET][COLUMNS];

/* Trial after trial, step after step, foot after foot. */
TEST(rows_are_printed) {
    MildError error = {0};
    char *text = write_feet(&error), *rest;
    expect_good(text != NULL, &error);
    char *line = strtok_r(text, "\n", &rest);
    for (int n = 0; n < TRIALS * STEPS * SA01_FEET; n++) {
        const int f = n % SA01_FEET, step = n / SA01_FEET % STEPS, trial = n / SA01_FEET / STEPS;
        char start[64];
        assert_non_null(line);
        snprintf(start, sizeof start, "foam45,0.3,%d,%d,%.5f", trial, f,
                 TASK_PERIOD / OF_PERIOD * (step + 1));
        assert_memory_equal(line, start, strlen(start));
        line += strlen(start);
        for (int k = 0; k < COLUMNS; k++) {
            assert_int_equal(*line, ',');
            feet_row[trial][step][f][k] = strtod(line + 1, &line);
        }
        assert_int_equal(*line, '\0');
        line = strtok_r(NULL, "\n", &rest);
    }
    assert_null(line);
    assert_int_equal(steps, PERIODS);
    free(text);

    char header[400] = "";
    FILE *csv = fmemopen(header, sizeof header, "w");
    feet_print_header(csv);
    fclose(csv);
    assert_string_equal(header,
                        "ground,speed_m_s,trial,foot,time_s,ankle_x_m,ankle_y_m,ankle_z_m,"
                        "roll_rad,pitch_rad,yaw_rad,force_x_n,force_y_n,force_z_n,torque_x_nm,"
                        "torque_y_nm,torque_z_nm,center_x_m,center_y_m,depth_m,height_m\n");
}

static void check_row(const double row[COLUMNS], const EnvsFoot *foot, int i, int f) {
    const double angle[3] = {0.2 * f - 0.1 + 0.01 * i, 0.15 - 0.2 * f - 0.01 * i,
                             2.5 * f - 1 + 0.005 * i};
    for (int k = 0; k < 3; k++) {
        expect_entry("ankle", k, row[k], foot->position[k], 1e-7);
        expect_entry("rotation", k, row[3 + k], angle[k], 1e-7);
        expect_entry("force", k, row[6 + k], foot->force[k], 1e-3);
        expect_entry("torque", k, row[9 + k], foot->torque[k], 1e-3);
    }
    expect_near("depth", row[14], foot->depth, 1e-6);
    expect_near("height", row[15], foot->height, 1e-6);
}

/* At the centre the force alone has the torque about the sole's two axes. */
TEST(steps_are_taken) {
    for (int n = 0; n < TRIALS * STEPS * SA01_FEET; n++) {
        const int f = n % SA01_FEET, i = n / SA01_FEET % STEPS, trial = n / SA01_FEET / STEPS;
        const double *row = feet_row[trial][i][f];
        const EnvsFoot foot = made_foot(trial, i, f);
        double force[3], torque[3], moment[3];
        const double at[3] = {row[12], row[13], mild_sole_z(robot_rasters(robot)[f])};
        check_row(row, &foot, i, f);
        mju_mulMatTVec3(force, foot.rotation, foot.force);
        mju_mulMatTVec3(torque, foot.rotation, foot.torque);
        mju_cross(moment, at, force);
        if (i > 0 || f > 0) { /* the centre is written to 0.1 mm */
            assert_true(force[2] > 1 && at[2] < 0);
            expect_near("moment about x", moment[0], torque[0], 1e-4 * force[2]);
            expect_near("moment about y", moment[1], torque[1], 1e-4 * force[2]);
        }
    }
}

/* A foot with less than a newton has none. */
TEST(a_centre_needs_a_force) {
    for (int trial = 0; trial < TRIALS; trial++) {
        assert_true(feet_row[trial][0][0][12] == 0 && feet_row[trial][0][0][13] == 0);
        assert_true(feet_row[trial][1][0][12] != 0 && feet_row[trial][1][0][13] != 0);
    }
}

/* Memory may run out at any array of the trials; two are those of the feet. */
TEST(missing_memory_is_reported) {
    int of_feet = 0, fail = 1;
    for (;; fail++) {
        MildError error = {0};
        callocs = fail;
        char *text = write_feet(&error);
        const int is_left = callocs > 0;
        callocs = 0;
        of_feet += kit_named(error.text, "feet 2 trials");
        free(text);
        if (is_left) {
            break; /* as many are not asked for */
        }
        assert_null(text);
        assert_int_equal(error.status, MILD_ERROR_MEMORY);
    }
    print_message("%d arrays, %d of the feet\n", fail - 1, of_feet);
    assert_int_equal(of_feet, 2);
}

TEST_MAIN(kit_setup, kit_teardown)
