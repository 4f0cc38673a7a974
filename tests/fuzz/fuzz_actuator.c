/* Any bytes as the file of an actuator network, with the checksum put right so that the fuzzer gets
 * past it. Refused with a message, or a network that gives torques. */
#include <stdio.h>
#include <unistd.h>

#include "env/actuator/actuator.h"
#include "fuzz.h"
#include "learn/safetensors.h"

static Robot *robot;
static char path[] = "/tmp/mild_fuzz_actuator_XXXXXX";

static void remove_file(void) {
    unlink(path);
}

static void open_robot(void) {
    robot = robot_create(MILD_SOURCE_DIR "/robots/sa01", NULL);
    const int made = mkstemp(path);
    fuzz_check(robot && made >= 0 && atexit(remove_file) == 0);
    close(made);
}

static void write_file(const unsigned char *bytes, size_t size) {
    FILE *file = fopen(path, "wb");
    fuzz_check(file && fwrite(bytes, 1, size, file) == size);
    fclose(file);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    MildError error = {0};
    if (!robot) {
        open_robot();
    }
    unsigned char *bytes = malloc(size + 1); /* + 1: never a NULL for an empty file */
    fuzz_check(bytes != NULL);
    memcpy(bytes, data, size);
    safetensors_seal(bytes, size);
    write_file(bytes, size);
    free(bytes);
    TaskDef task = task_def_default();
    strcpy(task.actuator, path);
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
