/* Time spent in each phase of a physics step. */
#ifndef ROBOT_PHASES_H
#define ROBOT_PHASES_H

#include "robot/robot.h"

/* Seconds and steps, summed while attached to a workspace. */
typedef struct {
    double smooth; /* [s] mass matrix, factor, bias, smooth acceleration */
    double map;    /* [s] A = J M^-1 J^T and the free twist */
    double ground; /* [s] mild_ground_solve and mild_ground_advance, or the engine's collision when
                      rigid */
    double finish; /* [s] wrench, joint limits or engine contact solver, integration, next pose */
    long steps;
} RobotPhases;

/* phases: NULL stops the timing. */
void robot_sim_time_phases(RobotSim *sim, RobotPhases *phases);

#endif
