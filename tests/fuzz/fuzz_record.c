/* Any bytes as a log of joints. Refused with a message, or rows in order and finite, and a fit that
 * refuses so few of them or gives finite errors. */
#include "env/actuator/fit.h"
#include "fuzz.h"
#include "unnamed_file.h"

static Robot *robot;
static Pool *pool;

static void open_once(void) {
    MildError error = {0};
    if (!robot) {
        robot = robot_create(MILD_SOURCE_DIR "/robots/sa01", &error);
        pool = pool_create(1);
        fuzz_check(robot && pool);
    }
}

static void check_rows(const Record *record) {
    const RecordFile *file = &record->file[0];
    fuzz_check(record->files == 1 && file->first == 0 && file->rows == record->rows);
    fuzz_check(record->rows >= 2 && file->interval > 0 && file->interval < 3e9);
    for (int row = 0; row < record->rows; row++) {
        fuzz_check(isfinite(record->time[row]));
        fuzz_check(row == 0 || record->time[row] > record->time[row - 1]);
        for (int i = 0; i < record->joints; i++) {
            const RecordJoint *joint = &record->joint[row * record->joints + i];
            fuzz_check(isfinite(joint->error) && isfinite(joint->speed) && isfinite(joint->torque));
            fuzz_check(file->logged[i] || (joint->error == 0 && joint->torque == 0));
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    MildError error = {0};
    open_once();
    Record record = {.robot = robot};
    const MildStatus status = record_read(&record, unnamed_file(data, size), &error);
    if (status == MILD_OK) {
        ActuatorScore score[ROBOT_JOINTS_MAX];
        const ActuatorFitDef def = {.spacing = 0.01, .steps = 1, .seed = data[0]};
        check_rows(&record);
        Actuator *actuator = actuator_fit(&def, &record, pool, score, &error);
        fuzz_check(actuator ? isfinite(score[0].network) : error.text[0] != 0);
        actuator_destroy(actuator);
    } else {
        fuzz_check(error.status == status && error.text[0]);
    }
    record_free(&record);
    return 0;
}
