/* The log of a walk with other motors: its columns, its seed, its shakes. */
#include "eval_kit.h"

#include "env/actuator/record.h"
#include "run/eval/motor_log.h"
#include "unnamed_file.h"

/* A motor whose torque is the number of its joint, and which keeps what it was asked. */
enum { ASKED_MAX = 20000 };
static struct { double error[SA01_JOINTS], speed[SA01_JOINTS]; } asked[ASKED_MAX];
static int times_asked;

static void torque_of_number(const void *self, void *state, const double *error,
                             const double *speed, double *torque) {
    (void)self;
    (void)state;
    assert_true(times_asked < ASKED_MAX);
    for (int i = 0; i < SA01_JOINTS; i++) {
        asked[times_asked].error[i] = error[i];
        asked[times_asked].speed[i] = speed[i];
        torque[i] = 0.01 * (i + 1);
    }
    times_asked++;
}

static const TaskActuator numbered = {NULL, 0, torque_of_number};

/* A walk of the shipped policy with that motor. */
static char *log_walk(double seconds, double shake, uint64_t seed, int *falls) {
    static char *text; /* its address is the stream's */
    static size_t size;
    MildError error = {0};
    Controller controller;
    expect_good(controller_learned(POLICY, robot, NULL, 1, &controller, &error) == MILD_OK, &error);
    const MotorLogDef log = {.task = &def,
                             .robot = robot,
                             .controller = &controller,
                             .motors = &numbered,
                             .seconds = seconds,
                             .shake = shake,
                             .seed = seed,
                             .csv = open_memstream(&text, &size)};
    times_asked = 0;
    expect_good(motor_log(&log, falls, &error) == MILD_OK, &error);
    fclose(log.csv);
    controller_destroy(&controller);
    return text;
}

/* A row per physics step with what the motor was asked and gave; who falls, because a motor of
 * these torques does not carry it, stands up a second later. */
TEST(rows_are_what_was_asked) {
    MildError error = {0};
    Record record = {.robot = robot};
    int falls, jumps = 0, began = 0;
    char *text = log_walk(4, 0, 3, &falls);
    expect_good(record_read(&record, unnamed_file(text, strlen(text)), &error) == MILD_OK, &error);
    assert_int_equal(record.rows, times_asked);
    assert_int_equal(record.rows, (int)(4 / def.physics_dt + 0.5));
    for (int row = 0; row < record.rows; row++) {
        for (int i = 0; i < SA01_JOINTS; i++) {
            const RecordJoint *joint = &record.joint[row * SA01_JOINTS + i];
            const double *wanted[2] = {&asked[row].error[i], &asked[row].speed[i]};
            expect_entry("error", i, (double)joint->error, *wanted[0], 1e-5 * fabs(*wanted[0]));
            expect_entry("speed", i, (double)joint->speed, *wanted[1], 1e-5 * fabs(*wanted[1]));
            expect_entry("torque", i, (double)joint->torque, 0.01 * (i + 1), 1e-7);
        }
        const double passed = row ? record.time[row] - record.time[row - 1] : def.physics_dt;
        const int jumped = passed > 0.5;
        assert_true(!jumped || (row - began) * def.physics_dt > 0.2);
        expect_near("time between rows", passed, def.physics_dt + jumped, 1e-6);
        began = jumped ? row : began;
        jumps += jumped;
    }
    print_message("%d rows, %d falls, %d jumps of a second\n", record.rows, falls, jumps);
    assert_true(falls >= 2 && jumps >= falls - 1 && jumps <= falls);
    record_free(&record);
    free(text);
}

TEST(the_seed_decides) {
    int falls;
    char *text = log_walk(1, 0.1, 1, &falls), *again = log_walk(1, 0.1, 1, &falls);
    char *other = log_walk(1, 0.1, 2, &falls);
    assert_string_equal(text, again);
    assert_string_not_equal(text, other);
    free(text);
    free(again);
    free(other);
}

/* ---- the shake ---- */

enum { SHAKES = 20, PERIOD = 200 }; /* draws; policy steps of each */

/* A controller that asks for nothing and keeps what was asked one step before: the shake alone. */
static struct {
    int calls;
    double height; /* [m] of the base at the first call */
    double action[SHAKES * PERIOD + 1][SA01_JOINTS];
} shaken;

static void nothing_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    (void)self;
    (void)rows;
    shaken.height = shaken.calls ? shaken.height : envs[0]->robot.qpos[2];
    for (int i = 0; i < SA01_JOINTS; i++) {
        shaken.action[shaken.calls][i] = (double)envs[0]->action[0][i];
        actions[i] = 0;
    }
    shaken.calls++;
}

static void log_shaken(uint64_t seed) {
    MildError error = {0};
    int falls;
    Controller controller = {.name = "nothing", .act = nothing_act};
    const MotorLogDef log = {.task = &def,
                             .robot = robot,
                             .controller = &controller,
                             .motors = &numbered,
                             .seconds = 2 * SHAKES,
                             .shake = 0.1,
                             .seed = seed,
                             .csv = fopen("/dev/null", "w")};
    assert_non_null(log.csv);
    times_asked = 0;
    shaken.calls = 0;
    assert_int_equal(motor_log(&log, &falls, &error), MILD_OK);
    fclose(log.csv);
    assert_int_equal(shaken.calls, SHAKES * PERIOD);
}

/* [Hz] Of the sine of a joint in a draw, from x(k+1) + x(k-1) = 2 cos(w dt) x(k); its largest
 * value. The step after a fall is left out, where the action is 0 again. */
static double frequency(int draw, int joint, double *largest) {
    double product = 0, square = 0;
    *largest = 0;
    for (int k = draw * PERIOD + 2; k < (draw + 1) * PERIOD; k++) {
        const double before = shaken.action[k - 1][joint], x = shaken.action[k][joint],
                     after = shaken.action[k + 1][joint];
        *largest = fmax(*largest, fabs(x));
        if (k < SHAKES * PERIOD - 1 && before != 0 && x != 0 && after != 0) {
            product += (before + after) * x;
            square += 2 * x * x;
        }
    }
    return acos(fmin(product / square, 1)) / (2 * 3.141592653589793 * 0.01);
}

/* A sine for each joint and two seconds, of 0.5 to 8 Hz, each octave as likely, and of up to
 * `shake` in radians; of a robot that stands at the start; of another seed others. */
TEST(shakes_are_sines) {
    const double scale = task_action_scale(&def, robot_table(robot));
    double low = 1e9, high = 0, octaves = 0, largest, most = 0, mean = 0, first[SA01_JOINTS];
    log_shaken(1);
    memcpy(first, shaken.action[PERIOD / 2], sizeof first);
    assert_true(shaken.height > 0.3);
    for (int draw = 0; draw < SHAKES; draw++) {
        for (int joint = 0; joint < SA01_JOINTS; joint++) {
            const double hz = frequency(draw, joint, &largest);
            low = fmin(low, hz);
            high = fmax(high, hz);
            octaves += log2(hz) / (SHAKES * SA01_JOINTS);
            most = fmax(most, largest * scale);
            mean += largest * scale / (SHAKES * SA01_JOINTS);
        }
    }
    print_message("%.3f to %.3f Hz, mean 2^%.2f; %.4f rad, mean %.4f\n", low, high, octaves, most,
                  mean);
    assert_true(low > 0.49 && low < 0.6 && high > 7 && high < 8.02);
    assert_true(fabs(octaves - 1) < 0.25); /* log2 of the middle of 0.5 and 8 Hz */
    assert_true(most > 0.09 && most <= 0.1 + 1e-6 && fabs(mean - 0.05) < 0.01);
    log_shaken(2);
    assert_memory_not_equal(first, shaken.action[PERIOD / 2], sizeof first);
}

/* What the simulation says is not taken for memory that ran out. */
TEST(failure_keeps_its_reason) {
    MildError error = {0};
    TaskDef slow = def;
    slow.physics_dt = 0.05;
    const MotorLogDef log = {.task = &slow, .robot = robot, .motors = &numbered};
    int falls;
    assert_refused(motor_log(&log, &falls, &error), MILD_ERROR_RANGE, &error,
                   "task.physics_dt 0.05 0.0005");
}

TEST_MAIN(kit_setup, kit_teardown)
