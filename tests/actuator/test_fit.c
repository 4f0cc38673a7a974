/* Logs as CSV, and fits to logs whose law is known. */
#include "actuator_kit.h"

#include "env/actuator/fit.h"
#include "files.h"
#include "unnamed_file.h"

#define INTERVAL 0.005 /* [s] between rows */
#define TEXT_SIZE 400

enum { LAG = 2, SECONDS = 40, ROWS = SECONDS * 200 };

/* ---- logs ---- */

static MildStatus read_text(Record *record, const char *text, MildError *error) {
    return record_read(record, unnamed_file(text, strlen(text)), error);
}

TEST(log_is_read) {
    MildError error = {0};
    Record record = {.robot = robot};
    assert_int_equal(read_text(&record,
                               "\xef\xbb\xbf# by hand\n"
                               "leg_r1_joint.torque_nm, time_s ,other,leg_r1_joint.error_rad,"
                               "leg_r1_joint.speed_rad_s\r\n"
                               "3,0.5,x,0.1,-2\r\n\r\n4,0.51,,0.2,-3\r\n5,0.53,7,0.3,-4\r\n"
                               "6,0.54,7,0.4,-5\n",
                               &error),
                     MILD_OK);
    assert_int_equal(read_text(&record,
                               "time_s,leg_l1_joint.error_rad,leg_l1_joint.speed_rad_s,"
                               "leg_l1_joint.torque_nm\n0,1,2,3\n0.002,4,5,6\n",
                               &error),
                     MILD_OK);
    assert_int_equal(record.files, 2);
    assert_int_equal(record.rows, 6);
    expect_near("interval", record.file[0].interval, 0.01, 1e-12); /* of 10, 20 and 10 ms */
    expect_near("interval", record.file[1].interval, 0.002, 1e-12);
    assert_int_equal(record.file[1].first, 4);
    assert_int_equal(record.file[1].rows, 2);
    for (int i = 0; i < SA01_JOINTS; i++) {
        assert_int_equal(record.file[0].logged[i], i == 6);
        assert_int_equal(record.file[1].logged[i], i == 0);
    }
    const RecordJoint *joint = &record.joint[2 * SA01_JOINTS + 6];
    assert_true(record.time[2] == 0.53 && joint->error == 0.3f && joint->speed == -4 &&
                joint->torque == 5);
    joint = &record.joint[5 * SA01_JOINTS];
    assert_true(joint->error == 4 && joint->speed == 5 && joint->torque == 6);
    record_free(&record);
}

TEST(wrong_logs) {
    static const char header[] = "time_s,leg_l1_joint.error_rad,leg_l1_joint.speed_rad_s,"
                                 "leg_l1_joint.torque_nm\n";
    const struct {
        int with_header;
        const char *text;
        MildStatus status;
        const char *names;
    } wrong[] = {
        {0, "#\n", MILD_ERROR_FORMAT, "log"},
        {0, "a,b\n1,2\n", MILD_ERROR_FORMAT, "log:1 time_s"},
        {0, "time_s,b\n1,2\n", MILD_ERROR_FORMAT, "log:1 sa01 leg_l1_joint.error_rad"},
        {0, "time_s,time_s\n", MILD_ERROR_FORMAT, "log:1 time_s"},
        {0, "time_s,leg_l1_joint.error_rad,leg_l1_joint.torque_nm\n", MILD_ERROR_FORMAT,
         "log:1 leg_l1_joint.speed_rad_s"},
        {1, "", MILD_ERROR_FORMAT, "log"},
        {1, "0,1,2,3\n", MILD_ERROR_FORMAT, "log"},
        {1, "0,1,2,3\n0,1,2,3\n", MILD_ERROR_FORMAT, "log:3 time_s 0"},
        {1, "0,1,2\n", MILD_ERROR_FORMAT, "log:2 leg_l1_joint.torque_nm"},
        {1, "0,nan,2,3\n", MILD_ERROR_FORMAT, "log:2 leg_l1_joint.error_rad nan"},
        {1, "0,1,2,3;4\n", MILD_ERROR_FORMAT, "log:2 leg_l1_joint.torque_nm 3;4"},
        {1, "0,57,2,3\n", MILD_ERROR_RANGE, "log:2 leg_l1_joint.error_rad 57 20"},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        char text[TEXT_SIZE], names[TEXT_SIZE];
        MildError error = {0};
        Record record = {.robot = robot};
        snprintf(text, sizeof text, "%s%s", wrong[i].with_header ? header : "", wrong[i].text);
        assert_int_equal(read_text(&record, text, &error), wrong[i].status);
        snprintf(names, sizeof names, "%s%s", unnamed_file("", 0), wrong[i].names + strlen("log"));
        assert_error(&error, wrong[i].status, names);
        record_free(&record);
    }
}

/* What is written is read back, to six digits. */
TEST(log_is_written) {
    double error[SA01_JOINTS], speed[SA01_JOINTS], torque[SA01_JOINTS];
    char *text = NULL;
    size_t size;
    MildError failure = {0};
    Record record = {.robot = robot};
    FILE *csv = open_memstream(&text, &size);
    assert_non_null(csv);
    record_print_header(robot, csv);
    for (int row = 0; row < 2; row++) {
        for (int i = 0; i < SA01_JOINTS; i++) {
            error[i] = 0.01 * i, speed[i] = -i, torque[i] = 10 + row;
        }
        record_print_row(SA01_JOINTS, 1000 + 0.0025 * row, error, speed, torque, csv);
    }
    fclose(csv);
    assert_int_equal(read_text(&record, text, &failure), MILD_OK);
    expect_near("interval", record.file[0].interval, 0.0025, 1e-9);
    for (int i = 0; i < SA01_JOINTS; i++) {
        const RecordJoint *joint = &record.joint[SA01_JOINTS + i];
        assert_true(record.file[0].logged[i] && joint->error == (float)(0.01 * i));
        assert_true(joint->speed == (float)-i && joint->torque == 11);
    }
    record_free(&record);
    free(text);
}

/* ---- fits ---- */

/* Sines of each joint. law(joint, now, late) gives the torque from the row and the one LAG
 * before. */
typedef double Law(int joint, const RecordJoint *now, const RecordJoint *late);

static Record made_record(Law *law) {
    Record record = {.robot = robot, .joints = SA01_JOINTS, .files = 1, .rows = ROWS};
    record.file[0] = (RecordFile){.rows = ROWS, .interval = INTERVAL};
    record.time = malloc(ROWS * sizeof *record.time);
    record.joint = calloc((size_t)ROWS * SA01_JOINTS, sizeof *record.joint);
    assert_non_null(record.time);
    assert_non_null(record.joint);
    for (int row = 0; row < ROWS; row++) {
        record.time[row] = row * INTERVAL;
        for (int i = 0; i < SA01_JOINTS; i++) {
            const double t = record.time[row], w = 6 + i;
            const RecordJoint *late =
                &record.joint[(size_t)(row < LAG ? 0 : row - LAG) * SA01_JOINTS + (size_t)i];
            RecordJoint *now = &record.joint[(size_t)row * SA01_JOINTS + (size_t)i];
            now->error = (float)(0.3 * sin(w * t) + 0.1 * sin(2.3 * w * t + i));
            now->speed = (float)(4 * cos(1.4 * w * t) + 2 * sin(0.3 * w * t));
            now->torque = (float)law(i, now, late);
        }
    }
    for (int i = 0; i < SA01_JOINTS; i++) {
        record.file[0].logged[i] = 1;
    }
    return record;
}

/* kp error - kd speed with the gains of robot.ini, and others for the ankles. */
static double pd(int joint, const RecordJoint *now, const RecordJoint *late) {
    (void)late;
    const int ankle = joint % 6 >= 4;
    const double kp = ankle ? 11 : robot_kp(robot)[joint];
    const double kd = ankle ? 0.7 : robot_kd(robot)[joint];
    return kp * (double)now->error - kd * (double)now->speed;
}

/* The PD of 10 ms ago, limited to 20 N m, with friction. */
static double motor(int joint, const RecordJoint *now, const RecordJoint *late) {
    const double asked =
        robot_kp(robot)[joint] * (double)late->error - robot_kd(robot)[joint] * (double)late->speed;
    return fmin(fmax(asked, -20), 20) - 2 * tanh((double)now->speed / 0.3);
}

static ActuatorFitDef short_fit(int steps) {
    ActuatorFitDef def = actuator_fit_default();
    def.steps = steps;
    return def;
}

static Actuator *fit(const ActuatorFitDef *def, const Record *record, int threads,
                     ActuatorScore *score) {
    MildError error = {0};
    Pool *pool = pool_create(threads);
    Actuator *actuator = actuator_fit(def, record, pool, score, &error);
    pool_destroy(pool);
    expect_good(actuator != NULL, &error);
    return actuator;
}

/* A log of a PD: the fitted one is found again, and the ideal one has no error where it is that of
 * robot.ini. The deviation is that of the same rows by a sum of its own. */
TEST(log_of_a_pd) {
    const ActuatorFitDef def = short_fit(10);
    Record record = made_record(pd);
    ActuatorScore score[KINDS];
    actuator_destroy(fit(&def, &record, 1, score));
    for (int k = 0; k < KINDS; k++) {
        assert_int_equal(score[k].joint, 2 * k);
        expect_near("kp", score[k].kp, k == 2 ? 11 : robot_kp(robot)[2 * k], 1e-4);
        expect_near("kd", score[k].kd, k == 2 ? 0.7 : robot_kd(robot)[2 * k], 1e-5);
        expect_near("linear", score[k].linear, 0, 1e-5);
        if (k < 2) {
            expect_near("ideal", score[k].ideal, 0, 1e-5);
        } else {
            assert_true(score[k].ideal > 1);
        }
        assert_true(score[k].deviation > score[k].network);
        /* all samples but the first 2 LAG rows of each second, four joints a kind */
        assert_int_equal(score[k].held, SECONDS / 5 * (200 - 2 * LAG) * 4);
        assert_int_equal(score[k].trained, 4 * score[k].held);
    }
    record_free(&record);
}

/* A late motor with friction and saturation: the PD fitted to it is left with 5 N m of 17, the
 * network with a tenth of that. */
TEST(log_of_a_motor) {
    const ActuatorFitDef def = short_fit(2000);
    Record record = made_record(motor);
    ActuatorScore score[KINDS];
    actuator_destroy(fit(&def, &record, 2, score));
    for (int k = 0; k < KINDS; k++) {
        printf("motor %d: std %.3f, best PD %.3f, network %.3f N m: %.0f times better\n", k,
               score[k].deviation, score[k].linear, score[k].network,
               score[k].linear / score[k].network);
        assert_true(score[k].network < score[k].linear / 8);
        assert_true(score[k].linear <= score[k].ideal);
        assert_true(score[k].linear < score[k].deviation);
    }
    record_free(&record);
}

/* All of a network as one number: FNV-1a of its file. */
static uint64_t answer(const Actuator *actuator) {
    char path[64];
    size_t size;
    MildError error = {0};
    uint64_t hash = 0xcbf29ce484222325u;
    snprintf(path, sizeof path, "/tmp/mild_fit_%d", getpid());
    assert_int_equal(actuator_save(actuator, path, NULL, &error), MILD_OK);
    char *bytes = kit_read(path, &size);
    for (size_t i = 0; i < size; i++) {
        hash = (hash ^ (unsigned char)bytes[i]) * 0x100000001b3u;
    }
    free(bytes);
    unlink(path);
    return hash;
}

/* The rows that the CSV names as held out are one second in five; torques changed there change the
 * scores and leave the network as it is. Nor do threads change it, but the seed does. */
TEST(held_out_is_not_seen) {
    ActuatorFitDef def = short_fit(50);
    Record record = made_record(motor);
    ActuatorScore score[KINDS], other[KINDS];
    char *text = NULL, line[200];
    size_t size;
    int held[SECONDS] = {0}, count = 0;
    def.held_out = open_memstream(&text, &size);
    assert_non_null(def.held_out);
    Actuator *first = fit(&def, &record, 1, score);
    fclose(def.held_out);
    def.held_out = NULL;
    FILE *csv = fmemopen(text, size, "r");
    assert_non_null(csv);
    while (fgets(line, sizeof line, csv)) {
        double time, measured, predicted[3];
        if (sscanf(line, "leg_l1_joint,%lf,%lf,%lf,%lf,%lf", &time, &measured, &predicted[0],
                   &predicted[1], &predicted[2]) == 5) {
            const int row = (int)lround(time / INTERVAL);
            expect_near("measured", measured, (double)record.joint[row * SA01_JOINTS].torque, 1e-4);
            held[row / 200] = 1;
        }
    }
    fclose(csv);
    free(text);
    for (int s = 0; s < SECONDS; s++) {
        count += held[s];
        for (int row = 200 * s; held[s] && row < 200 * (s + 1); row++) {
            for (int i = 0; i < SA01_JOINTS; i++) {
                record.joint[row * SA01_JOINTS + i].torque += 50;
            }
        }
        if (s % 5 == 4) {
            assert_int_equal(count, s / 5 + 1);
        }
    }
    Actuator *second = fit(&def, &record, 2, other);
    assert_true(answer(first) == answer(second));
    for (int k = 0; k < KINDS; k++) {
        assert_true(score[k].kp == other[k].kp && score[k].kd == other[k].kd);
        assert_true(other[k].network > score[k].network + 20);
    }
    def.seed = 2;
    Actuator *third = fit(&def, &record, 2, other);
    assert_true(answer(third) != answer(second));
    actuator_destroy(first);
    actuator_destroy(second);
    actuator_destroy(third);
    record_free(&record);
}

static void check_bad_record(const ActuatorFitDef *def, const Record *record, const char *names) {
    MildError error = {0};
    ActuatorScore score[KINDS];
    Pool *pool = pool_create(1);
    assert_null(actuator_fit(def, record, pool, score, &error));
    pool_destroy(pool);
    assert_error(&error, MILD_ERROR_ARGUMENT, names);
}

/* A kind that is not logged, a history between rows, gaps everywhere, a log that is too short. */
TEST(logs_that_do_not_do) {
    ActuatorFitDef def = short_fit(5);
    Record record = made_record(pd);
    for (int i = 0; i < SA01_JOINTS; i++) {
        record.file[0].logged[i] = i % 6 < 4;
    }
    check_bad_record(&def, &record, "0 leg_l5_joint 100");
    for (int i = 0; i < SA01_JOINTS; i++) {
        record.file[0].logged[i] = 1;
    }
    def.spacing = 0.012;
    check_bad_record(&def, &record, "0.005 0.012 --spacing");
    def.spacing = 0.01;
    record.file[0].rows = 150;
    check_bad_record(&def, &record, "0 584 leg_l1_joint 100");
    record.file[0].rows = ROWS;
    for (int row = 0; row < ROWS; row++) { /* after three rows each a gap of 20 ms */
        record.time[row] += 0.02 * (row / 3);
    }
    check_bad_record(&def, &record, "0 leg_l1_joint 100");
    record_free(&record);
}

TEST_MAIN(kit_setup, kit_teardown)
