/* What --feet writes: the values of made-up samples, angles of a turned foot, the
 * pressure centre by its definition, and the order of the rows. */
#include <mujoco/mujoco.h>

#include "kit.h"
#include "run/eval/feet.h"
#include "sa01.h"

enum { TRIALS = 2, STEPS = 3 };

static Robot *robot;
static int callocs; /* until one fails; 0: none does */

void *__real_calloc(size_t count, size_t size);
void *__wrap_calloc(size_t count, size_t size);
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

/* Numbers of their own everywhere. */
static void make_samples(EnvsSample sample[STEPS]) {
    for (int i = 0; i < STEPS; i++) {
        sample[i] = (EnvsSample){.feet = SA01_FEET};
        for (int f = 0; f < SA01_FEET; f++) {
            EnvsFoot *foot = &sample[i].foot[f];
            for (int k = 0; k < 3; k++) {
                foot->force[k] = 10.0 * (f + 1) * (k + 1) + 3.0 * i * i;
                foot->torque[k] = (f - 2.0) * (k + 2) + i;
                foot->position[k] = f + 0.1 * k + 0.01 * i;
            }
            foot->depth = 0.01 * (f + 1) + 0.001 * (i == 1);
            foot->height = -0.02 * (f + 1) - 0.001 * i;
            turn(0.2 * f - 0.1 + 0.3 * i, 0.15 - 0.2 * f - 0.1 * i, 2.5 * f - 1 + 0.2 * i,
                 foot->rotation);
        }
    }
}

static Feet made(void) {
    Feet feet;
    MildError error = {0};
    assert_int_equal(feet_make(&feet, robot, TRIALS, STEPS, &error), MILD_OK);
    return feet;
}

static void steps_are_taken(void **state) {
    (void)state;
    EnvsSample sample[STEPS];
    Feet feet = made();
    make_samples(sample);
    for (int i = 0; i < STEPS; i++) {
        feet_take(&feet, 1, &sample[i]);
    }
    assert_true(feet.count[0] == 0 && feet.count[1] == STEPS);
    for (int n = 0; n < STEPS * SA01_FEET; n++) {
        const FeetRow *row = &feet.row[STEPS * SA01_FEET + n];
        const int i = n / SA01_FEET, f = n % SA01_FEET;
        const double angle[3] = {0.2 * f - 0.1 + 0.3 * i, 0.15 - 0.2 * f - 0.1 * i,
                                 2.5 * f - 1 + 0.2 * i};
        for (int k = 0; k < 3; k++) {
            expect_entry("ankle", k, row->ankle[k], f + 0.1 * k + 0.01 * i, 1e-12);
            expect_entry("rotation", k, row->rotation[k], angle[k], 1e-12);
            expect_entry("force", k, row->force[k], 10 * (f + 1) * (k + 1) + 3 * i * i, 1e-12);
            expect_entry("torque", k, row->torque[k], (f - 2) * (k + 2) + i, 1e-12);
        }
        expect_near("depth", row->depth, 0.01 * (f + 1) + 0.001 * (i == 1), 1e-15);
        expect_near("height", row->height, -0.02 * (f + 1) - 0.001 * i, 1e-15);
        /* at the centre the force alone has the torque about the sole's two axes */
        double force[3], torque[3], moment[3];
        const double at[3] = {row->center[0], row->center[1], mild_sole_z(robot_rasters(robot)[f])};
        mju_mulMatTVec3(force, sample[i].foot[f].rotation, row->force);
        mju_mulMatTVec3(torque, sample[i].foot[f].rotation, row->torque);
        mju_cross(moment, at, force);
        assert_true(force[2] > 1 && at[2] < 0);
        expect_near("moment about x", moment[0], torque[0], 1e-12);
        expect_near("moment about y", moment[1], torque[1], 1e-12);
    }
    feet_free(&feet);
}

/* A foot in the air has none; with a newton there is one. */
static void a_centre_needs_a_force(void **state) {
    (void)state;
    Feet feet = made();
    EnvsSample sample = {.feet = SA01_FEET};
    static const double force[] = {0.99, 1.01};
    for (int f = 0; f < SA01_FEET; f++) {
        turn(0, 0, 0, sample.foot[f].rotation);
        sample.foot[f].force[2] = force[f];
        sample.foot[f].torque[0] = 0.3;
        sample.foot[f].torque[1] = -0.2;
    }
    feet_take(&feet, 0, &sample);
    assert_true(feet.row[0].center[0] == 0 && feet.row[0].center[1] == 0);
    expect_near("x", feet.row[1].center[0], 0.2 / 1.01, 1e-12);
    expect_near("y", feet.row[1].center[1], 0.3 / 1.01, 1e-12);
    feet_free(&feet);
}

/* Trial after trial, step after step, foot after foot, as far as each trial went. */
static void rows_are_printed(void **state) {
    (void)state;
    static const int order[][3] = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0},
                                   {1, 0, 1}, {1, 1, 0}, {1, 1, 1}};
    Feet feet = made();
    EnvsSample sample = {.feet = SA01_FEET};
    for (int i = 0; i < 3; i++) {
        feet_take(&feet, i > 0, &sample);
    }
    for (int i = 0; i < TRIALS * STEPS * SA01_FEET; i++) {
        double *number = (double *)(void *)&feet.row[i];
        for (size_t k = 0; k < sizeof(FeetRow) / sizeof(double); k++) {
            number[k] = i + 0.01 * (double)k;
        }
    }
    char *text = NULL;
    size_t size = 0;
    FILE *csv = open_memstream(&text, &size);
    feet_print_header(csv);
    feet_print(&feet, "foam45", 0.6, 0.0025, csv);
    fclose(csv);
    char *rest, *line = strtok_r(text, "\n", &rest);
    assert_string_equal(line,
                        "ground,speed_m_s,trial,foot,time_s,ankle_x_m,ankle_y_m,ankle_z_m,"
                        "roll_rad,pitch_rad,yaw_rad,force_x_n,force_y_n,force_z_n,torque_x_nm,"
                        "torque_y_nm,torque_z_nm,center_x_m,center_y_m,depth_m,height_m");
    for (size_t i = 0; i < sizeof order / sizeof *order; i++) {
        const int trial = order[i][0], step = order[i][1], f = order[i][2];
        char start[64];
        snprintf(start, sizeof start, "foam45,0.6,%d,%d,%.5f", trial, f, 0.0025 * (step + 1));
        line = strtok_r(NULL, "\n", &rest);
        assert_non_null(line);
        assert_memory_equal(line, start, strlen(start));
        line += strlen(start);
        for (int k = 0; k < 16; k++) { /* in the order of FeetRow */
            assert_int_equal(*line, ',');
            const double got = strtod(line + 1, &line);
            expect_entry("column", k, got, (trial * STEPS + step) * SA01_FEET + f + 0.01 * k, 1e-9);
        }
        assert_int_equal(*line, '\0');
    }
    assert_null(strtok_r(NULL, "\n", &rest));
    free(text);
    feet_free(&feet);
}

static void memory_that_is_missing_is_told(void **state) {
    (void)state;
    for (int fail = 1; fail <= 2; fail++) {
        Feet feet;
        MildError error = {0};
        callocs = fail;
        assert_int_equal(feet_make(&feet, robot, 7, STEPS, &error), MILD_ERROR_MEMORY);
        assert_error(&error, MILD_ERROR_MEMORY, "7 trials");
        feet_free(&feet);
    }
}

static int setup(void **state) {
    (void)state;
    MildError error = {0};
    robot = robot_create(SA01, &error);
    return !robot;
}

static int teardown(void **state) {
    (void)state;
    robot_destroy(robot);
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(steps_are_taken),
        cmocka_unit_test(a_centre_needs_a_force),
        cmocka_unit_test(rows_are_printed),
        cmocka_unit_test(memory_that_is_missing_is_told),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
