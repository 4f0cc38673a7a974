/* From the made-up motor to a log, and to the network that is fitted to it. */
#include <limits.h>

#include "eval_kit.h"

#include "env/actuator/fit.h"
#include "env/actuator/motor.h"
#include "run/eval/motor_log.h"
#include "unnamed_file.h"

enum { KINDS = 3, SECONDS = 20 };

static Pool *pool;
static Motor motor;
static Actuator *actuator;
static ActuatorScore score[KINDS];

static Controller policy(void) {
    MildError error = {0};
    Controller controller;
    assert_int_equal(controller_learned(POLICY, robot, pool, 1, &controller, &error), MILD_OK);
    return controller;
}

static char *log_text(uint64_t seed, int *falls) {
    static char *text; /* its address is the stream's */
    static size_t size;
    MildError error = {0};
    Controller controller = policy();
    MotorLogDef log = {.task = &def,
                       .robot = robot,
                       .controller = &controller,
                       .motors = &motor.motors,
                       .seconds = SECONDS,
                       .shake = 0.1,
                       .seed = seed,
                       .csv = open_memstream(&text, &size)};
    assert_non_null(log.csv);
    assert_int_equal(motor_log(&log, falls, &error), MILD_OK);
    fclose(log.csv);
    controller_destroy(&controller);
    return text;
}

/* A network fitted to 20 s of the motor, with a history of 0, 5 and 10 ms, among which is the
 * motor's delay of 5 ms. */
static int setup(void **state) {
    MildError error = {0};
    Record record = {0};
    ActuatorFitDef fit = actuator_fit_default();
    const MotorDef made_up = motor_def_default();
    int falls;
    pool = pool_create(2);
    if (kit_setup(state) || !pool) {
        return 1;
    }
    motor_init(&motor, &made_up, robot, def.physics_dt);
    char *text = log_text(1, &falls);
    record.robot = robot;
    fit.spacing = 0.005;
    fit.steps = 3000;
    if (record_read(&record, unnamed_file(text, strlen(text)), &error) != MILD_OK) {
        return 1;
    }
    actuator = actuator_fit(&fit, &record, pool, score, &error);
    free(text);
    record_free(&record);
    return actuator == NULL;
}

static int teardown(void **state) {
    actuator_destroy(actuator);
    pool_destroy(pool);
    return kit_teardown(state);
}

/* The log has a row per physics step, of the motor's torque; the same seed gives the same log. */
TEST(log_of_the_motor) {
    MildError error = {0};
    Record record = {.robot = robot};
    int falls;
    char *text = log_text(1, &falls), *again = log_text(1, &falls), *other = log_text(2, &falls);
    assert_int_equal(falls, 0);
    assert_string_equal(text, again);
    assert_string_not_equal(text, other);
    assert_int_equal(record_read(&record, unnamed_file(text, strlen(text)), &error), MILD_OK);
    assert_int_equal(record.rows, (int)(SECONDS / def.physics_dt + 0.5));
    assert_true(fabs(record.file[0].interval - def.physics_dt) < 1e-9);
    /* the PD of two rows before, less friction, within half of the effort */
    int slipping = 0;
    for (int row = 2; row < record.rows; row++) {
        const RecordJoint *now = &record.joint[row * SA01_JOINTS + 3],
                          *late = now - 2 * SA01_JOINTS;
        const double asked = 70 * (double)late->error - 7 * (double)late->speed;
        const double friction =
            140 * (0.02 * tanh((double)now->speed / 0.3) + 0.1 * (double)now->speed / 25);
        if (fabs(now->speed) < 12 && record.time[row] - record.time[row - 2] < 0.006) {
            const double wanted = fmin(fmax(asked, -70), 70) - friction;
            assert_true(fabs(wanted - (double)now->torque) < 2e-3);
            slipping += fabs(friction) > 2;
        }
    }
    assert_true(slipping > record.rows / 4);
    record_free(&record);
    free(text);
    free(again);
    free(other);
}

/* ---- a motor whose torque is the number of its joint, and which keeps what it was asked ---- */

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

/* Every number under the name of its joint and quantity, at its time. */
TEST(columns_are_what_they_name) {
    static const char *const quantities[3] = {"error_rad", "speed_rad_s", "torque_nm"};
    const TaskActuator numbered = {NULL, 0, torque_of_number};
    char *text = NULL, *line, *rest, name[128];
    size_t size = 0;
    int falls, columns = 0, of[1 + 3 * SA01_JOINTS], row = 0, jumps = 0;
    MildError error = {0};
    Controller controller = policy();
    const MotorLogDef log = {.task = &def,
                             .robot = robot,
                             .controller = &controller,
                             .motors = &numbered,
                             .seconds = 4,
                             .seed = 3,
                             .csv = open_memstream(&text, &size)};
    times_asked = 0;
    assert_int_equal(motor_log(&log, &falls, &error), MILD_OK);
    fclose(log.csv);
    controller_destroy(&controller);
    line = strtok_r(text, "\n", &rest);
    for (char *more, *word = strtok_r(line, ",", &more); word; word = strtok_r(NULL, ",", &more)) {
        of[columns] = -1;
        for (int n = 0; n < 3 * SA01_JOINTS; n++) {
            snprintf(name, sizeof name, "%s.%s", robot_joint_name(robot, n / 3), quantities[n % 3]);
            of[columns] = strcmp(name, word) == 0 ? n : of[columns];
        }
        assert_true(columns == 0 ? strcmp(word, "time_s") == 0 : of[columns] >= 0);
        columns++;
    }
    assert_int_equal(columns, 1 + 3 * SA01_JOINTS);
    double time = 0, before = 0;
    int began = 0, shortest = INT_MAX; /* rows of an episode */
    while ((line = strtok_r(NULL, "\n", &rest))) {
        for (int c = 0; c < columns; c++, line++) {
            const double number = strtod(line, &line);
            if (c == 0) {
                time = number;
                continue;
            }
            const int joint = of[c] / 3;
            const double wanted[3] = {asked[row].error[joint], asked[row].speed[joint],
                                      0.01 * (joint + 1)};
            assert_true(fabs(number - wanted[of[c] % 3]) <= 1e-5 * fabs(wanted[of[c] % 3]));
        }
        const int jumped = time - before > 0.5;
        shortest = jumped && row - began < shortest ? row - began : shortest;
        began = jumped ? row : began;
        assert_true(row == 0 || fabs(time - before - def.physics_dt - jumped) < 1e-6);
        jumps += jumped;
        before = time;
        row++;
    }
    print_message("%d rows, %d falls, %d jumps of a second, the first after %d rows or more\n", row,
                  falls, jumps, shortest);
    assert_true(shortest * def.physics_dt > 0.2); /* who fell stands up anew */
    assert_int_equal(row, times_asked);
    assert_int_equal(row, (int)(log.seconds / def.physics_dt + 0.5));
    assert_true(falls >= 2 && jumps >= falls - 1 && jumps <= falls);
    free(text);
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
    const TaskActuator numbered = {NULL, 0, torque_of_number};
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
    const MotorLogDef log = {.task = &slow, .robot = robot, .motors = &motor.motors};
    int falls;
    assert_int_equal(motor_log(&log, &falls, &error), MILD_ERROR_RANGE);
    assert_error(&error, MILD_ERROR_RANGE, "task.physics_dt 0.05 0.0005");
}

/* On held-out seconds the network is eight times better than the best PD, and more. */
TEST(network_beats_the_pd) {
    for (int k = 0; k < KINDS; k++) {
        printf("%s: std %.2f, PD %.2f, best PD %.2f, network %.3f N m, best PD / network %.1f\n",
               robot_joint_name(robot, score[k].joint), score[k].deviation, score[k].ideal,
               score[k].linear, score[k].network, score[k].linear / score[k].network);
        assert_true(score[k].network < score[k].linear / 5);
        assert_true(score[k].linear < score[k].ideal);
    }
}

TEST_MAIN(setup, teardown)
