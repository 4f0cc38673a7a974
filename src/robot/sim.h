/* Private to the robot layer: one thread's workspace. */
#ifndef ROBOT_SIM_H
#define ROBOT_SIM_H

#include "robot/description.h"
#include "robot/robot.h"

#define ROBOT_LANES 8 /* six twist components, padded to one vector register */

/* One foot's Jacobian, transposed, and its half-solved form: row = degree of freedom of the limb,
 * column = twist component. */
typedef struct {
    double jacobian[ROBOT_FOOT_DOFS_MAX][ROBOT_LANES]; /* J^T */
    double half[ROBOT_FOOT_DOFS_MAX][ROBOT_LANES];     /* L^-T J^T with M = L^T D L */
} FootMap;

/* What limits_hold replaced: M_ii and f_i of a degree of freedom. */
typedef struct {
    int dof;
    double inertia, force;
} Unheld;

struct RobotSim {
    const Robot *robot;
    mjModel *model; /* own copy, patched by the variation */
    mjData *data;
    double dt;
    RobotVariation variation;  /* the one the model is patched with */
    double qpos[ROBOT_NQ_MAX]; /* as in RobotState */
    double qvel[ROBOT_NV_MAX];
    FootMap map[ROBOT_BODIES_MAX];
    int rows;                  /* bodies that A has rows of: the feet, and shells near the ground;
                                  on rigid ground the shells that touch it */
    int row[ROBOT_BODIES_MAX]; /* [rows] their numbers, ascending */
    int shell_contact;         /* rigid ground: the first contact of a shell, after those of feet */
    Unheld without[ROBOT_JOINTS_MAX];
    MildContactInput input;
    double inverse_inertia[36 * ROBOT_BODIES_MAX * ROBOT_BODIES_MAX]; /* of the input */
    MildScratch *scratch;
    const RobotGround *other; /* computes the ground; NULL: libmild */
    MildContactResult contact;
    RobotFoot feet[ROBOT_FEET_MAX];
    RobotPhases *phases; /* NULL: no timing */
};

/* Patches the workspace's model. Does nothing when the model already has this variation. */
void variation_apply(RobotSim *sim, const RobotVariation *variation);

/* [m] World position of the point that a foot's twist and wrench refer to: the origin of a flat
 * foot's body, the lowest point of a round foot. */
void foot_map_reference(const RobotSim *sim, int foot, double point[3]);
/* J of all feet at the current pose. */
void foot_map_jacobian(RobotSim *sim);
/* The same of a body with shells. */
void foot_map_shell(RobotSim *sim, int body);
/* Twist of foot or body f, J nu + dt J a; acceleration may be NULL. */
void foot_map_twist(const RobotSim *sim, int foot, const double *velocity,
                    const double *acceleration, double twist[6]);
/* A = J M^-1 J^T of the rows into the contact input; needs the factorised mass matrix. */
void foot_map_inverse_inertia(RobotSim *sim);
/* Generalised force J^T w and its acceleration M^-1 J^T w, both [nv] in the engine's order, of one
 * wrench (force, torque) for each of the rows. */
void foot_map_wrench(const RobotSim *sim, double (*wrench)[6], double *force, double *acceleration);

/* Makes the engine's rows of joint limits and contacts. Returns 0 if there are none. */
int limits_make(RobotSim *sim);
/* M <- N and qfrc_smooth <- f' of the limits that are expected to push, see limit.c. Needs their
 * rows. Returns how many. */
int limits_hold(RobotSim *sim);
/* And back to M and f. */
void limits_release(RobotSim *sim, int held);

/* Adds the contact forces between the legs to qfrc_smooth and qacc_smooth. Needs the factorised
 * mass matrix and qacc_smooth; held: of limits_hold. */
void legs_push(RobotSim *sim, int held);

/* Bool: a shell's lowest point may be in the ground; exact where it is level. */
int robot_sim_shell_may_touch(const RobotSim *sim, const RobotShell *shell,
                              const MildTerrain *terrain);
/* The engine's own contact: finds the contacts of the feet's corners with the ground, and those of
 * shells that stand. */
void rigid_collide(RobotSim *sim, const MildTerrain *terrain);
/* Once they are solved: writes the mean wrench on each foot over the step to sim->contact. */
void rigid_contact_result(RobotSim *sim);

#endif
