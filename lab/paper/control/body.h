/* Whole-body control of a biped with six joints a leg, after Henze, Roa and Ott (2016) and Mesesan
 * et al. (2019). Impedances at the centre of mass, the base's orientation and the swing foot, and
 * the dynamics of the planned motion, give a generalised force u. Its rows of the floating base are
 * a wrench that only the ground can exert; it is shared among the feet that stand (wrench.h). The
 * motors owe the rest:
 *
 *     u   = M a + h + J_c^T f + J_b^T t + J_s^T w
 *     tau = u - sum of J_f^T F_f           (rows of the joints) */
#ifndef CONTROL_BODY_H
#define CONTROL_BODY_H

#include "paper/control/walk.h"
#include "paper/control/wrench.h"
#include "robot/robot.h"

/* Gains and limits. */
typedef struct {
    double dcm_gain;            /* [1/s] k: errors of the DCM decay with exp(-k t) */
    double turn_stiffness;      /* [N m/rad] of the base's orientation */
    double turn_damping;        /* [N m s/rad] */
    double still_turn_damping;  /* [N m s/rad] before the first step: see README.md */
    double swing_stiffness;     /* [N/m] of the swing foot's support point */
    double swing_damping;       /* [N s/m] */
    double sole_stiffness;      /* [N m/rad] of the swing foot's orientation */
    double sole_damping;        /* [N m s/rad] */
    double stance_damping;      /* [N s/m] of a foot that stands, against the leg */
    double stance_turn_damping; /* [N m s/rad] */
    double pitch;               /* [rad] of the base, forward */
    double friction;            /* [-] that the feet count on */
    double ahead;               /* [m] support point before the ankle */
    double margin[2];           /* [m] of the sole, along and across, that the centre of pressure
                                  avoids */
} BodyDef;

/* What a torque is computed from, and its scratch. */
typedef struct Body Body;

BodyDef body_def_default(void);
/* limit: [joints] [N m] torque limits. Refuses robots other than bipeds with six joints a leg.
 * Borrows the robot. */
Body *body_create(const Robot *robot, const BodyDef *def, const double *limit, MildError *error);
void body_destroy(Body *body); /* may be NULL */

/* Computes what depends on the state of `sim` alone. Overwrites the mass matrix and the bias force
 * of its engine, which every step computes anew. b: [s] of the DCM. */
void body_measure(Body *body, RobotSim *sim, double b, WalkState *state);
/* Torques [robot_joints] towards the target in the state measured last. b: [s]. Returns 0, or 1
 * when the wrench has no solution: the torques are then those without ground. */
int body_torque(Body *body, const WalkTarget *target, double b, double *torque);

/* For tests: the wrench wanted about the centre of mass in the last body_torque, and its shares on
 * the feet about their support points. */
void body_wrenches(const Body *body, double wanted[WRENCH_SIZE],
                   double share[WALK_FEET][WRENCH_SIZE]);

#endif
