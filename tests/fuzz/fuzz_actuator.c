/* Any bytes as the file of an actuator network, with the checksum put right so that the fuzzer gets
 * past it. Refused with a message, or a network that gives torques. */
#include "env/actuator/actuator.h"
#include "fuzz.h"
#include "learn/safetensors.h"
#include "unnamed_file.h"

static Robot *robot;

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    MildError error = {0};
    if (!robot) {
        robot = robot_create(MILD_SOURCE_DIR "/robots/sa01", &error);
        fuzz_check(robot != NULL);
    }
    unsigned char *bytes = malloc(size + 1); /* + 1: never a NULL for an empty file */
    fuzz_check(bytes != NULL);
    memcpy(bytes, data, size);
    safetensors_seal(bytes, size);
    TaskDef task = task_def_default();
    strcpy(task.actuator, unnamed_file(bytes, size));
    free(bytes);
    Actuator *actuator;
    const MildStatus status = actuator_open(&task, robot, &actuator, &error);
    fuzz_check(status == MILD_OK || (error.status == status && error.text[0]));
    if (status == MILD_OK) {
        double error_of[ROBOT_JOINTS_MAX] = {0.1, -0.2, 0.3}, speed[ROBOT_JOINTS_MAX] = {1, 2, -3};
        double torque[ROBOT_JOINTS_MAX];
        void *memory = calloc(1, task.motors->bytes);
        fuzz_check(memory != NULL);
        task.motors->torque(task.motors->self, memory, error_of, speed, torque);
        free(memory);
    }
    actuator_destroy(actuator);
    return 0;
}
