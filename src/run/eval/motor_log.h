/* Logs the joints of a walking robot: what `mild actuator fit` is trained on. */
#ifndef EVAL_MOTOR_LOG_H
#define EVAL_MOTOR_LOG_H

#include <stdio.h>

#include "control/controller.h"

typedef struct {
    const TaskDef *task; /* episodes on presets, with their commands; its motors are `motors` */
    const Robot *robot;
    Controller *controller;
    const TaskActuator *motors;
    double seconds;
    double shake; /* [rad] greatest amplitude of sines that are added to the targets */
    uint64_t seed;
    FILE *csv; /* see actuator/record.h; a row per physics step */
} MotorLogDef;

/* falls: written. The time jumps by a second where a new episode begins. */
MildStatus motor_log(const MotorLogDef *def, int *falls, MildError *error);

#endif
