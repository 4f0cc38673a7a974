/* The actuator network: its kinds of motors, its torque and gradient against formulas written out
 * here, its history in the task, its file; and the made-up motor. */
#include "actuator_kit.h"

#include <unistd.h>

#include "base/file.h"
#include "env/actuator/actuator.h"
#include "env/actuator/motor.h"
#include "learn/mlp.h"
#include "learn/safetensors.h"
#include "robots.h"

#define GO1 MILD_SOURCE_DIR "/robots/go1"
#define POLICY MILD_SOURCE_DIR "/policies/mild.safetensors"

enum { WIDTH = 32, INPUTS = 6, NUMBERS = (INPUTS + 1) * 32 + 33 * 32 + 33 };

static float weights[KINDS][NUMBERS];
static const ActuatorScale scales[KINDS] = {{0.1, 2, 30}, {0.2, 3, 40}, {0.3, 5, 6}};

static int setup(void **state) {
    Random r = random_at(5, 0, 0);
    for (int k = 0; k < KINDS; k++) {
        for (int i = 0; i < NUMBERS; i++) {
            weights[k][i] = (float)(0.6 * random_normal(&r));
        }
    }
    return kit_setup(state);
}

static void new_path(char *path) {
    strcpy(path, "/tmp/mild_actuator_XXXXXX");
    const int made = mkstemp(path);
    assert_true(made >= 0);
    close(made);
}

/* Writes the file of these weights as docs/actuator.md says. spacing: [s]. */
static void write_file(const char *path, const char *spacing) {
    static const int in[3] = {INPUTS, WIDTH, WIDTH}, out[3] = {WIDTH, WIDTH, 1};
    static const int64_t kind[SA01_JOINTS] = {0, 0, 1, 1, 2, 2, 0, 0, 1, 1, 2, 2};
    char name[KINDS][3][2][40], joints[512] = "";
    double scale[KINDS][3];
    Safetensor tensor[6 * KINDS + 2];
    MildError error = {0};
    int count = 0;
    for (int k = 0; k < KINDS; k++) {
        const float *at = weights[k];
        for (int l = 0; l < 3; l++) {
            snprintf(name[k][l][0], sizeof name[k][l][0], "motors.%d.%d.weight", k, 2 * l);
            tensor[count++] =
                (Safetensor){name[k][l][0], SAFETENSORS_F32, 2, {out[l], in[l]}, at, 0};
            at += out[l] * in[l];
            snprintf(name[k][l][1], sizeof name[k][l][1], "motors.%d.%d.bias", k, 2 * l);
            tensor[count++] = (Safetensor){name[k][l][1], SAFETENSORS_F32, 1, {out[l]}, at, 0};
            at += out[l];
        }
        scale[k][0] = scales[k].error, scale[k][1] = scales[k].speed,
        scale[k][2] = scales[k].torque;
    }
    tensor[count++] = (Safetensor){"scale", SAFETENSORS_F64, 2, {KINDS, 3}, scale, 0};
    tensor[count++] = (Safetensor){"kind", SAFETENSORS_I64, 1, {SA01_JOINTS}, kind, 0};
    for (int i = 0; i < SA01_JOINTS; i++) {
        strcat(strcat(joints, i ? " " : ""), robot_joint_name(robot, i));
    }
    const SafetensorsText texts[] = {{"kind", "mild actuator"},
                                     {"version", "1"},
                                     {"robot", "sa01"},
                                     {"joints", joints},
                                     {"spacing", spacing}};
    assert_int_equal(safetensors_write(path, tensor, count, texts, 5, &error), MILD_OK);
}

/* A task with the actuator of a file. */
typedef struct {
    TaskDef task;
    Actuator *actuator;
    void *memory; /* of an environment */
} Opened;

static Opened open_file(const char *path) {
    MildError error = {0};
    Opened o = {.task = task_def_default()};
    snprintf(o.task.actuator, sizeof o.task.actuator, "%s", path);
    assert_int_equal(actuator_open(&o.task, robot, &o.actuator, &error), MILD_OK);
    assert_true(o.actuator && o.task.motors && o.task.motors->bytes % 64 == 0);
    o.memory = aligned_alloc(64, o.task.motors->bytes + 64);
    assert_non_null(o.memory);
    memset(o.memory, 0, o.task.motors->bytes);
    memset((char *)o.memory + o.task.motors->bytes, 77, 64);
    return o;
}

static Opened open_weights(const char *spacing) {
    char path[40];
    new_path(path);
    write_file(path, spacing);
    const Opened o = open_file(path);
    unlink(path);
    return o;
}

static void close_actuator(Opened *o) {
    free(o->memory);
    actuator_destroy(o->actuator);
}

/* The torques of all joints after a physics step with these errors and speeds. */
static void step(Opened *o, const double *error, const double *speed, double *torque) {
    o->task.motors->torque(o->task.motors->self, o->memory, error, speed, torque);
}

/* Hip roll and yaw, hip pitch and knee, both ankles; of the quadruped, thighs and calves. */
TEST(kinds_of_motors) {
    int kind[ROBOT_JOINTS_MAX];
    Robot *go1 = kit_robot(GO1);
    assert_int_equal(actuator_kinds(robot, kind), KINDS);
    for (int i = 0; i < SA01_JOINTS; i++) {
        assert_int_equal(kind[i], i % 6 / 2);
    }
    assert_int_equal(actuator_kinds(go1, kind), 2);
    for (int i = 0; i < 12; i++) {
        assert_int_equal(kind[i], i % 3 == 2);
    }
    robot_destroy(go1);
}

/* W2 s(W1 s(W0 x + b0) + b1) + b2, s(x) = x/(1 + |x|), W [out][in]. */
static double formula(const float *w, const double *x) {
    double first[WIDTH], second[WIDTH];
    const float *b0 = w + INPUTS * WIDTH, *w1 = b0 + WIDTH, *b1 = w1 + WIDTH * WIDTH;
    const float *w2 = b1 + WIDTH;
    double sum = (double)w2[WIDTH];
    for (int o = 0; o < WIDTH; o++) {
        double y = (double)b0[o];
        for (int i = 0; i < INPUTS; i++) {
            y += (double)w[o * INPUTS + i] * x[i];
        }
        first[o] = y / (1 + fabs(y));
    }
    for (int o = 0; o < WIDTH; o++) {
        double y = (double)b1[o];
        for (int i = 0; i < WIDTH; i++) {
            y += (double)w1[o * WIDTH + i] * first[i];
        }
        second[o] = y / (1 + fabs(y));
        sum += (double)w2[o] * second[o];
    }
    return sum;
}

static double wanted_torque(int joint, const double *error, const double *speed) {
    const int k = joint % 6 / 2;
    double x[INPUTS];
    for (int t = 0; t < 3; t++) {
        x[t] = error[t] / scales[k].error;
        x[3 + t] = speed[t] / scales[k].speed;
    }
    return scales[k].torque * formula(weights[k], x);
}

/* The learner's own forward pass gives the formula, and its gradient the differences of the
 * formula. */
TEST(gradient_of_softsign) {
    enum { ROWS = 3 };
    static const int hidden[POLICY_LAYERS_MAX] = {WIDTH, WIDTH};
    Mlp mlp;
    float x[ROWS][INPUTS], y[3][ROWS * WIDTH], slope[ROWS], work[2][ROWS * WIDTH];
    float gradient[NUMBERS];
    double at[ROWS][INPUTS];
    Random r = random_at(7, 0, 0);
    const MlpOutputs outputs = {{y[0], y[1], y[2]}};
    const MlpInputGradient none = {NULL, 0, 0};
    float *const areas[2] = {work[0], work[1]};
    assert_int_equal(mlp_layout(&mlp, INPUTS, hidden, 1, 0), NUMBERS);
    mlp.activation = MLP_SOFTSIGN;
    for (int b = 0; b < ROWS; b++) {
        slope[b] = (float)(b + 1) / 2;
        for (int i = 0; i < INPUTS; i++) {
            x[b][i] = (float)random_normal(&r);
            at[b][i] = (double)x[b][i];
        }
    }
    const float *out = mlp_forward(&mlp, weights[0], ROWS, x[0], INPUTS, &outputs);
    for (int b = 0; b < ROWS; b++) {
        expect_near("forward", (double)out[b], formula(weights[0], at[b]), 1e-5);
    }
    mlp_backward(&mlp, weights[0], ROWS, x[0], INPUTS, &outputs, slope, areas, gradient, 0, none);
    for (int i = 0; i < NUMBERS; i++) {
        float copy[NUMBERS];
        double difference = 0;
        memcpy(copy, weights[0], sizeof copy);
        for (int side = -1; side <= 1; side += 2) {
            copy[i] = weights[0][i] + (float)side * 0x1p-7f;
            for (int b = 0; b < ROWS; b++) {
                difference += side * (double)slope[b] * formula(copy, at[b]);
            }
        }
        expect_entry("gradient", i, (double)gradient[i], difference * 0x1p6, 2e-3);
    }
}

/* Steps of 2.5 ms: the network sees t, t - 4 steps and t - 8 steps; what came before the first step
 * is taken to be as in it. */
TEST(history_in_the_task) {
    enum { STEPS = 40, LAG = 4 };
    Opened o = open_weights("0.01");
    double errors[STEPS][SA01_JOINTS], speeds[STEPS][SA01_JOINTS], torque[SA01_JOINTS];
    Random r = random_at(8, 0, 0);
    for (int k = 0; k < STEPS; k++) {
        for (int i = 0; i < SA01_JOINTS; i++) {
            errors[k][i] = random_uniform(&r, -0.5, 0.5);
            speeds[k][i] = random_uniform(&r, -8, 8);
        }
        step(&o, errors[k], speeds[k], torque);
        for (int i = 0; i < SA01_JOINTS; i++) {
            double e[3], v[3];
            for (int t = 0; t < 3; t++) {
                const int then = k - t * LAG > 0 ? k - t * LAG : 0;
                e[t] = errors[then][i];
                v[t] = speeds[then][i];
            }
            expect_near("torque", torque[i], wanted_torque(i, e, v), 2e-4);
        }
    }
    for (int i = 0; i < 64; i++) {
        assert_int_equal(((char *)o.memory)[o.task.motors->bytes + (size_t)i], 77);
    }
    close_actuator(&o);
}

static void check_bad(const TaskDef *task, const Robot *of, MildStatus status, const char *names) {
    MildError error = {0};
    TaskDef copy = *task;
    Actuator *actuator;
    assert_refused(actuator_open(&copy, of, &actuator, &error), status, &error, names);
    actuator_destroy(actuator);
}

static void check_bad_motors(const TaskDef *task, MildStatus status, const char *names) {
    check_bad(task, robot, status, names);
}

TEST(file_and_task) {
    char path[40];
    new_path(path);
    MildError error = {0};
    TaskDef task = task_def_default();
    Actuator *read;
    assert_int_equal(actuator_open(&task, robot, &read, &error), MILD_OK); /* no file: the PD */
    assert_null(read);
    assert_null(task.motors);
    Opened o = open_weights("0.01");
    assert_int_equal(actuator_save(o.actuator, path, "a note", &error), MILD_OK);
    Opened again = open_file(path);
    for (int k = 0; k < 9; k++) {
        double e[SA01_JOINTS], v[SA01_JOINTS], torque[SA01_JOINTS], same[SA01_JOINTS];
        for (int i = 0; i < SA01_JOINTS; i++) {
            e[i] = 0.05 * i - 0.1 * k;
            v[i] = 2 * sin(k + i);
        }
        step(&o, e, v, torque);
        step(&again, e, v, same);
        assert_memory_equal(torque, same, sizeof torque);
    }
    close_actuator(&o);
    close_actuator(&again);
    snprintf(task.actuator, sizeof task.actuator, "%s", path);
    /* what does not fit */
    TaskDef wrong = task;
    wrong.physics_dt = 0.004;
    check_bad_motors(&wrong, MILD_ERROR_ARGUMENT, "task.actuator task.physics_dt 0.004");
    wrong = task;
    strcpy(wrong.kd, "5");
    check_bad_motors(&wrong, MILD_ERROR_ARGUMENT, "task.actuator task.kp task.kd");
    wrong = task;
    snprintf(wrong.actuator, sizeof wrong.actuator, "%s", POLICY);
    check_bad_motors(&wrong, MILD_ERROR_FORMAT, "task.actuator " POLICY);
    strcpy(wrong.actuator, "/tmp/there/is/none");
    check_bad_motors(&wrong, MILD_ERROR_IO, "task.actuator /tmp/there/is/none");
    Robot *go1 = kit_robot(GO1);
    check_bad(&task, go1, MILD_ERROR_ARGUMENT, "sa01 go1");
    robot_destroy(go1);
    size_t size;
    char *bytes = file_read(path, 1 << 20, &size, &error);
    assert_non_null(bytes);
    bytes[size / 2] ^= 1;
    assert_int_equal(file_write(path, bytes, size, &error), MILD_OK);
    check_bad_motors(&task, MILD_ERROR_FORMAT, path);
    assert_int_equal(file_write(path, bytes, size / 2, &error), MILD_OK);
    check_bad_motors(&task, MILD_ERROR_FORMAT, path);
    free(bytes);
    unlink(path);
}

/* Numbers of the hip pitch: kp 70, kd 7, effort 140 N m, 25 rad/s. */
TEST(made_up_motor) {
    enum { JOINT = 2 };
    Motor motor;
    const MotorDef def = {.delay = 0.005, .coulomb = 0.02, .viscous = 0.1, .peak = 0.5};
    double error[SA01_JOINTS] = {0}, speed[SA01_JOINTS] = {0}, torque[SA01_JOINTS];
    motor_init(&motor, &def, robot, 0.0025);
    void *memory = aligned_alloc(64, motor.motors.bytes);
    assert_non_null(memory);
    memset(memory, 0, motor.motors.bytes);
    const struct {
        double error, speed, torque;
    } steps[] = {
        {0.5, 0, 35}, /* the first step stands for those before */
        {0.1, 0, 35},
        {0.2, 1, 35 - 140 * (0.02 * tanh(1 / 0.3) + 0.1 / 25)},
        {3.0, 0, 7},
        {3.0, 0, 7},                                        /* 70 0.2 - 7 1 */
        {3.0, 20, 70 * 0.4 - 140 * (0.02 + 0.1 * 20 / 25)}, /* 2 (1 - 20/25) of 70 N m */
        {3.0, -20, 70 + 140 * (0.02 + 0.1 * 20 / 25)},      /* brakes with all of it */
        {0, 0, 70},
    };
    for (size_t k = 0; k < sizeof steps / sizeof *steps; k++) {
        error[JOINT] = steps[k].error;
        speed[JOINT] = steps[k].speed;
        motor.motors.torque(motor.motors.self, memory, error, speed, torque);
        expect_near("motor", torque[JOINT], steps[k].torque, 1e-9);
        assert_true(torque[0] == 0);
    }
    free(memory);
}

TEST_MAIN(setup, kit_teardown)
