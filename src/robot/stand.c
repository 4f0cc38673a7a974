#include "robot/stand.h"

#include <math.h>
#include <string.h>

#include "robot/description.h"

#define TILT_GAIN 4.0  /* [-] */
#define TILT_RATE 0.4  /* [s] */

static const double stand_kp[ROBOT_LEG] = {240, 240, 240, 240, 200, 200}; /* [N m/rad] */
static const double stand_kd[ROBOT_LEG] = {6, 6, 6, 6, 1, 1};             /* [N m s/rad] */

static void tilt_offsets(const RobotSim *sim, double offset[ROBOT_JOINTS]) {
    const double *turn = robot_sim_base_rotation(sim), *rate = robot_sim_qvel(sim) + 3;
    double pitch = atan2(-turn[6], turn[8]), roll = atan2(turn[7], turn[8]);
    double p = TILT_GAIN * pitch + TILT_RATE * rate[1];
    double r = TILT_GAIN * roll + TILT_RATE * rate[0];
    offset[4] = offset[10] = p;
    (void)r;
}

void robot_stand_torque(const Robot *robot, const RobotSim *sim, int balance, double *torque) {
    const double *q = robot_sim_qpos(sim) + 7, *qd = robot_sim_qvel(sim) + 6;
    double offset[ROBOT_JOINTS] = {0};
    if (balance) {
        tilt_offsets(sim, offset);
    }
    for (int i = 0; i < ROBOT_JOINTS; i++) {
        double wanted = stand_kp[i % ROBOT_LEG] * (robot->pose[i] + offset[i] - q[i]) - stand_kd[i % ROBOT_LEG] * qd[i];
        torque[i] = fmax(-robot->effort[i], fmin(robot->effort[i], wanted));
    }
}

RobotState robot_stand_state(const Robot *robot, double sinkage) {
    RobotState state = {.qpos = {0, 0, robot->stand_height - sinkage, 1, 0, 0, 0}};
    memcpy(state.qpos + 7, robot->pose, sizeof robot->pose);
    return state;
}

double robot_static_sinkage(const MildMaterial *material, double pitch, int elements, double weight) {
    double low = 0.0, high = 2.0 * material->bed_depth;
    for (int i = 0; i < 60; i++) {
        double middle = 0.5 * (low + high);
        *(mild_element_law(material, pitch, middle).force * elements < weight ? &low : &high) = middle;
    }
    return 0.5 * (low + high);
}
