/* Private to the robot layer: one thread's workspace. */
#ifndef ROBOT_SIM_H
#define ROBOT_SIM_H

#include "robot/description.h"
#include "robot/phases.h"

#define ROBOT_LANES 8      /* six twist components, padded to one vector register */
#define ROBOT_FOOT_DOFS 12 /* base six, then the leg's six: the only ones that move a foot */

/* The feet's Jacobian and its half-solved form, transposed: row = degree of freedom, column = twist
 * component. */
typedef struct {
    double jacobian[ROBOT_FEET][ROBOT_FOOT_DOFS][ROBOT_LANES]; /* J^T */
    double half[ROBOT_FEET][ROBOT_FOOT_DOFS][ROBOT_LANES];     /* L^-T J^T with M = L^T D L */
} FootMap;

struct RobotSim {
    const Robot *robot;
    mjModel *model; /* own copy, patched by the variation */
    mjData *data;
    double dt;
    RobotVariation variation; /* the one the model is patched with */
    FootMap map;
    MildContactInput input;
    MildScratch *scratch;
    MildContactResult contact;
    RobotFoot feet[ROBOT_FEET];
    RobotPhases *phases; /* NULL: no timing */
};

/* Patches the workspace's model; nothing when the variation is the one it has. */
void variation_apply(RobotSim *sim, const RobotVariation *variation);

/* J of both feet at the current pose. */
void foot_map_jacobian(RobotSim *sim);
/* Twist of foot f, J nu + dt J a; acceleration may be NULL. */
void foot_map_twist(const RobotSim *sim, int foot, const double *velocity,
                    const double *acceleration, double twist[6]);
/* A = J M^-1 J^T into the contact input; needs the factorised mass matrix. */
void foot_map_inverse_inertia(RobotSim *sim);
/* generalised force J^T w [NV] and its acceleration M^-1 J^T w [NV] of one wrench (force, torque)
 * per foot. */
void foot_map_wrench(const RobotSim *sim, double wrench[ROBOT_FEET][6], double *force,
                     double *acceleration);

/* The engine's own contact: finds the contacts of the sole corners with the ground. */
void rigid_collide(RobotSim *sim, const MildTerrain *terrain);
/* And, once they are solved, the wrench on each foot, mean over the step, into sim->contact. */
void rigid_contact_result(RobotSim *sim);

#endif
