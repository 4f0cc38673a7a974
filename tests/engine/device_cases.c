#include "device_cases.h"

#include <stdio.h>

#include "cases.h"

static Robot *robot;
static RobotSim *sim;

int device_robot_open(const char *folder, double dt, DeviceRobot *device) {
    MildError error = {0};
    robot = robot_create(folder, &error);
    sim = robot ? robot_sim_create(robot, dt, &error) : NULL;
    if (!sim || engine_model_read(robot, dt, &device->tree, device->number, &error) != MILD_OK) {
        fprintf(stderr, "%s\n", error.text);
        return 0;
    }
    device->kp = robot->def.kp;
    device->kd = robot->def.kd;
    device->stand = (EngineCase){.variation = robot_variation_nominal()};
    device->stand.qpos[2] = robot->stand_height;
    device->stand.qpos[3] = 1;
    memcpy(device->stand.qpos + 7, robot->def.pose, sizeof robot->def.pose);
    memcpy(device->stand.torque, robot->def.pose, sizeof robot->def.pose);
    return 1;
}

EngineCase device_case(int rigid, uint32_t draw) {
    EngineCase in;
    if (!rigid) {
        in = random_case(robot, draw);
        memset(in.wrench, 0, sizeof in.wrench);
        return in;
    }
    in = rigid_case(sim, draw % 4 < 2 ? draw : draw - 2); /* others are on a slope */
    in.qpos[2] -= in.height;
    in.height = 0;
    round_case(&in);
    return in;
}
