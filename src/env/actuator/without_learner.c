/* In a build without the learner's networks, such as a wheel's: no network of a motor. */
#include "env/actuator/actuator.h"

MildStatus actuator_open(TaskDef *task, const Robot *robot, Actuator **actuator, MildError *error) {
    (void)robot;
    *actuator = NULL;
    return task->actuator[0]
               ? mild_fail(error, MILD_ERROR_ARGUMENT,
                           "task.actuator: this build has no networks; leave it empty")
               : MILD_OK;
}

void actuator_destroy(Actuator *actuator) {
    (void)actuator;
}
