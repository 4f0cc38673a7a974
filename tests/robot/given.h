/* A ground that answers each step with given wrenches and keeps what the step asked of it: the
 * robot's own part of a step, seen from the ground. */
#ifndef TESTS_GIVEN_H
#define TESTS_GIVEN_H

#include <math.h>
#include <string.h>

#include "robot/robot.h"

typedef struct {
    double wrench[ROBOT_FEET_MAX][6]; /* force, torque */
    int feet;
    double inverse_inertia[36 * ROBOT_FEET_MAX * ROBOT_FEET_MAX]; /* A of the last step */
    double free_velocity[6 * ROBOT_FEET_MAX];                     /* V_free */
} Given;

static inline int given_solve(void *self, const MildTerrain *terrain, MildGround *ground,
                              const MildContactInput *in, MildContactResult *result) {
    (void)terrain;
    (void)ground;
    Given *given = self;
    const size_t rows = 6 * (size_t)in->feet;
    given->feet = in->feet;
    memcpy(given->inverse_inertia, in->inverse_inertia, rows * rows * sizeof(double));
    memcpy(given->free_velocity, in->free_velocity, rows * sizeof(double));
    for (int f = 0; f < in->feet; f++) {
        memcpy(result->foot[f].force, given->wrench[f], 3 * sizeof(double));
        memcpy(result->foot[f].torque, given->wrench[f] + 3, 3 * sizeof(double));
    }
    return 0;
}

/* A step without torques from a state, on this ground. Returns whether it diverged. */
static inline int given_step(Given *given, RobotSim *sim, const RobotState *state) {
    static const double limp[ROBOT_JOINTS_MAX];
    const RobotVariation nominal = robot_variation_nominal();
    const MildMaterial material = mild_material_default();
    const MildTerrain terrain = mild_terrain_uniform(&material);
    const RobotGround ground = {given_solve, given};
    robot_sim_load(sim, state, &nominal);
    robot_sim_set_ground(sim, &ground);
    const int bad = robot_sim_step(sim, limp, NULL, &terrain, NULL);
    robot_sim_set_ground(sim, NULL);
    return bad;
}

/* Some wrench in every row. */
static inline void given_some(Given *given, int feet) {
    for (int r = 0; r < 6 * feet; r++) {
        given->wrench[r / 6][r % 6] = sin(1.0 + r);
    }
}

#endif
