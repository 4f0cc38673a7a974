/* What device_engine.cu needs of the processor's side: a robot, random steps, and what the texts say
 * of them. */
#ifndef TESTS_ENGINE_DEVICE_CASES_H
#define TESTS_ENGINE_DEVICE_CASES_H

#include "engine_text.h"

typedef struct {
    EngineTree tree;
    double number[ENGINE_NUMBERS];
    const double *kp; /* [joints] [N m/rad] */
    const double *kd; /* [joints] [N m s/rad] */
    EngineCase stand; /* at rest on the ground, its target pose in `torque` [rad] */
} DeviceRobot;

/* folder: of the robot. Returns 0 with a line on stderr when it fails. */
int device_robot_open(const char *folder, double dt, DeviceRobot *device);
/* What MuJoCo and mild/ground.h, in double, make of `steps` steps on sand_loose: motors hold the
 * pose in in->torque. qpos, qvel: as in RobotState. Returns 0 when that fails. */
int device_soft_reference(const DeviceRobot *device, const EngineCase *in, int steps, double *qpos,
                          double *qvel);
/* [feet] soles of the robot. */
const MildSole *const *device_soles(void);
/* Random step number `draw`: thrown into the air, or near level rigid ground at height 0. */
EngineCase device_case(int rigid, uint32_t draw);

#endif
