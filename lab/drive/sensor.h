/* What a robot's sensors say: whether it can be true, and what the policy is shown of it. */
#ifndef DRIVE_SENSOR_H
#define DRIVE_SENSOR_H

#include "drive/packet.h"
#include "env/task/task.h"

typedef struct {
    double turn;  /* [rad/s] of the base; 0: none */
    double speed; /* [rad/s] of a joint; 0: none */
    double angle; /* [rad] of a joint beyond its range; negative: none */
} SensorLimits;

/* Bool: a number is beyond its limit, or has changed since the state `before` (NULL: there is
 * none) by more than the speeds of the two allow in that time. `why` names the number. */
int sensor_is_impossible(const Robot *robot, const SensorLimits *limits, const StatePacket *before,
                         const StatePacket *state, char *why, size_t size);

TaskSensors sensor_read(const StatePacket *state, int joints);
/* Brings the reading into the range that the training of the shipped policies sees
 * (lab/drive/README.md, section 2). */
void sensor_clip(const Robot *robot, TaskSensors *reading);

#endif
