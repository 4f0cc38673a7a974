/* Working data of one robot: in shared memory on a GPU. For SA01 in float 5.4 kB (a test prints
 * it). Poses are in world axes; positions of links and corners count from the base's origin, so
 * that float loses nothing far from the world's. */
#ifndef MILD_ENGINE_DATA_H
#define MILD_ENGINE_DATA_H

#include "engine/model.h"

#define ENGINE_EDGES (4 * ENGINE_CORNERS) /* of all corners' pyramids */

/* Needed until M and the bias are there. */
typedef struct {
    Real local[ENGINE_LINKS][9];                 /* [-] rotation link -> parent */
    Real wave[ENGINE_LINKS][2];                  /* [-] cosine and sine of the hinge's angle */
    Real inertia[ENGINE_LINKS][INERTIA_NUMBERS]; /* about the anchor; then of all behind it, too */
    Real spin[ENGINE_LINKS][3];                  /* [rad/s] */
    Real spin_rate[ENGINE_LINKS][3];             /* [rad/s^2] without qacc */
    Real acceleration[ENGINE_LINKS][3];          /* [m/s^2] of the anchor, without qacc, upward
                                                     9.81 at rest */
    Real force[ENGINE_LINKS][6];                 /* [N, N m] on the link, torque about the anchor */
    Real unit[ENGINE_DOFS][6]; /* force and torque that accelerate a degree of freedom by 1 */
} EngineDynamics;

/* The pyramids of the corners on rigid ground: four edges each. */
typedef struct {
    Real edge[ENGINE_EDGES][6];        /* [-, m] the row of an edge in terms of the foot's twist */
    Real reference[ENGINE_EDGES];      /* [m/s^2] reference acceleration */
    Real weight[ENGINE_EDGES];         /* [kg] 1/R; 0: does not touch */
    Real residual[ENGINE_EDGES];       /* [m/s^2] x; an edge with x < 0 pushes */
    Real stiffness[ENGINE_FEET][6][6]; /* sum of weights times edge edge^T, of the pushing edges */
    Real twist[ENGINE_FEET][6];        /* J qacc */
    Real twist_change[ENGINE_FEET][6]; /* J times the change of qacc */
} EngineContact;

/* Needed from then on. */
typedef struct {
    Real jacobian[ENGINE_FEET][ENGINE_CHAIN][6]; /* J^T: twist per degree of freedom, by place */
    Real half[ENGINE_FEET][ENGINE_CHAIN][6];     /* L^-T J^T with M = L^T L */
    Real free_velocity[ENGINE_FEET]
                      [6]; /* [m/s, rad/s] V_free: twists after a step without ground */
    union {
        Real inverse_inertia[6 * ENGINE_FEET * 6 * ENGINE_FEET]; /* A = J M^-1 J^T, row major with
                                                                    stride 6 feet: soft ground */
        EngineContact contact;                                   /* rigid ground */
    } ground;
    Real change[ENGINE_DOFS];  /* of the acceleration in a Newton step */
    Real residue[ENGINE_DOFS]; /* force less M qacc there */
} EngineSupport;

typedef struct {
    /* ---- state; hinges by link, degrees of freedom in the tree's order ---- */
    Real base[3];             /* [m] world position of the base's origin */
    Real quaternion[4];       /* [-] base -> world, w x y z */
    Real angle[ENGINE_LINKS]; /* [rad] of the hinges; [0] unused */
    Real rate[ENGINE_DOFS];   /* [m/s, rad/s] */
    /* ---- pose: engine_kinematics ---- */
    Real rotation[ENGINE_LINKS][9]; /* [-] link -> world, row major */
    Real position[ENGINE_LINKS][3]; /* [m] of the anchor, from the base */
    Real axis[ENGINE_LINKS][3];     /* [-] of the hinge, world */
    /* ---- feet: engine_feet_pose ---- */
    Real foot_position[ENGINE_FEET][3]; /* [m] reference point, world */
    Real foot_rotation[ENGINE_FEET][9]; /* [-] foot -> world, row major; round feet: identity */
    Real foot_velocity[ENGINE_FEET][6]; /* [m/s, rad/s] twist there */
    Real next_velocity[ENGINE_FEET][6]; /* [m/s, rad/s] twist after the step, by the ground */
    Real wrench[ENGINE_FEET][6]; /* [N, N m] of the ground on the foot, at the reference point */
    /* ---- dynamics ---- */
    Real mass[ENGINE_ENTRIES];      /* M, packed; see tree.h */
    Real factor[ENGINE_ENTRIES];    /* L with M = L^T L, each diagonal entry inverted */
    Real force[ENGINE_DOFS];        /* torques and pushes less the bias */
    Real acceleration[ENGINE_DOFS]; /* qacc [m/s^2, rad/s^2] */
    int newton;                     /* steps of the constraints' solver in the last step */
    /* ---- joint limits; by link, [0] unused ---- */
    Real limit_side[ENGINE_LINKS];      /* [-] 1 at the lower limit, -1 at the upper, 0 inside */
    Real limit_reference[ENGINE_LINKS]; /* [rad/s^2] reference acceleration, away from the limit */
    Real limit_weight[ENGINE_LINKS];    /* [kg m^2] 1/R */
    union {
        EngineDynamics dynamics;
        EngineSupport support;
    } now;
} EngineWork;

#endif
