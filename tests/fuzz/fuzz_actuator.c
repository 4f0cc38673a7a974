/* Any bytes as the file of an actuator network, with the checksum put right so that the fuzzer gets
 * past it. Refused with a message, or a network that gives torques. */
#include "env/actuator/file.h"
#include "fuzz.h"

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
    Safetensors *file = safetensors_parse(bytes, size, "fuzz", &error);
    Actuator *actuator = file ? actuator_file_read(file, "fuzz", robot, &error) : NULL;
    fuzz_check(actuator || (error.status != MILD_OK && error.text[0]));
    for (int i = 0; actuator && i < robot_joints(robot); i++) {
        const double error_of[3] = {0.1, -0.2, 0.3}, speed[3] = {1, 2, -3};
        (void)actuator_torque(actuator, i, error_of, speed);
    }
    actuator_destroy(actuator);
    safetensors_destroy(file);
    return 0;
}
