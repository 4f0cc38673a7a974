/* What device_engine.cu needs of the processor's side: a robot, random steps, and what the texts
 * say of them. */
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
enum { DEVICE_LABELS = 2 };
/* Rough ground in a checker of two materials; NULL with a line on stderr when that fails. */
MildMap *device_map(void);
/* Its materials: sand_loose, and grass. */
void device_materials(MildMaterial materials[DEVICE_LABELS]);
/* What MuJoCo and mild/ground.h, in double, make of `steps` steps on these materials, level or on
 * in->map: motors hold the pose in in->torque. qpos, qvel: as in RobotState. Returns 0 when that
 * fails. */
int device_soft_reference(const DeviceRobot *device, const EngineCase *in, int steps, double *qpos,
                          double *qvel);
/* [feet] soles of the robot. */
const MildSole *const *device_soles(void);
/* Random step number `draw`: thrown into the air, or near rigid ground at height 0, level or with a
 * map. */
EngineCase device_case(int rigid, const MildMap *map, uint32_t draw);
/* [m] Height of a map whose origin is the world's. */
double device_height(const MildMap *map, double x, double y);

#endif
