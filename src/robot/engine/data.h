/* Working data of one robot: in shared memory on a GPU. For SA01 in float 6 kB (a test prints it).
 * Poses are in world axes; positions of links and corners count from the base's origin, so that
 * float loses nothing far from the world's. */
#ifndef MILD_ENGINE_DATA_H
#define MILD_ENGINE_DATA_H

#include "robot/engine/model.h"

#define ENGINE_EDGES (4 * ENGINE_CORNERS) /* of all corners' pyramids */
#define ENGINE_HELD_BITS 24               /* of a whole number that a float holds exactly */

/* Inertia of a link about its anchor in world axes, then the force and the torque about the anchor
 * that its motion takes [N, N m]. */
enum { LINK_FORCE = INERTIA_NUMBERS, LINK_TORQUE = LINK_FORCE + 3, LINK_NUMBERS = LINK_TORQUE + 3 };

/* Needed until M and the bias are there. */
typedef struct {
    union {
        Real local[ENGINE_LINKS][12]; /* [-, m] link -> parent, rows as in EngineLink.turn */
        /* Sums over a link and all that hangs on it; then, about the base's anchor, over each link
         * that hangs on the base and all that hangs on that. */
        Real total[2 * ENGINE_LINKS - 1][LINK_NUMBERS];
    } of;
    Real link[ENGINE_LINKS][LINK_NUMBERS];
    Real arm[ENGINE_LINKS][3]; /* [m] from the parent's anchor, world */
} EngineDynamics;

/* The pyramids of the corners on rigid ground: four edges each. */
typedef struct {
    Real edge[ENGINE_EDGES][6];   /* [-, m] the row of an edge in terms of the foot's twist */
    Real reference[ENGINE_EDGES]; /* [m/s^2] reference acceleration */
    Real weight[ENGINE_EDGES];    /* [kg] 1/R; 0: does not touch */
    Real residual[ENGINE_EDGES];  /* [m/s^2] x; an edge with x < 0 pushes */
    /* Sum of weights times edge edge^T, of the pushing edges: the entries on and below the
     * diagonal, row by row. */
    Real stiffness[ENGINE_FEET][ENGINE_BASE_ENTRIES];
    Real twist[ENGINE_FEET][6];        /* J qacc */
    Real twist_change[ENGINE_FEET][6]; /* J times the change of qacc */
} EngineContact;

/* Needed from then on. */
typedef struct {
    Real jacobian[ENGINE_FEET][ENGINE_CHAIN][6]; /* J^T: twist per degree of freedom, by place */
    Real half[ENGINE_FEET][ENGINE_CHAIN][6];     /* L^-T J^T with M = L^T L */
    /* [m/s, rad/s] V_free: twists after a step without ground. */
    Real free_velocity[ENGINE_FEET][6];
    /* From here on it is not needed between engine_begin and engine_end. */
    alignas(16) union {
        Real inverse_inertia[6 * ENGINE_FEET * 6 * ENGINE_FEET]; /* A = J M^-1 J^T, row major with
                                                                    stride 6 feet: soft ground */
        EngineContact contact;                                   /* rigid ground */
    } ground;
    Real change[ENGINE_DOFS];  /* of the acceleration in a Newton step */
    Real product[ENGINE_DOFS]; /* M times that */
    Real residue[ENGINE_DOFS]; /* M times what qacc is away from that without rows */
} EngineSupport;

typedef struct {
    /* ---- state; hinges by link, degrees of freedom in the tree's order ---- */
    Real base[3];                   /* [m] world position of the base's origin */
    Real quaternion[4];             /* [-] base -> world, w x y z */
    Real angle[ENGINE_LINKS];       /* [rad] of the hinges; [0] unused */
    Real rate[ENGINE_DOFS];         /* [m/s, rad/s] */
    Real acceleration[ENGINE_DOFS]; /* qacc [m/s^2, rad/s^2], of the last step until engine_begin;
                                       L^-T force from there to engine_accelerate */
    /* Links whose limits are in `factor`, as the bits of whole numbers. Bit 0, the base's: some
     * joint is beyond its limit. */
    Real held[(ENGINE_LINKS + ENGINE_HELD_BITS - 1) / ENGINE_HELD_BITS];
    Real wrench[ENGINE_FEET][6]; /* [N, N m] of the ground on the foot, at the reference point */
    /* ---- pose: engine_kinematics ---- */
    Real rotation[ENGINE_LINKS][9]; /* [-] link -> world, row major */
    Real position[ENGINE_LINKS][3]; /* [m] of the anchor, from the base */
    Real axis[ENGINE_LINKS][3];     /* [-] of the hinge, world */
    /* ---- feet: engine_feet_pose ---- */
    Real foot_position[ENGINE_FEET][3]; /* [m] reference point, world */
    Real foot_rotation[ENGINE_FEET][9]; /* [-] foot -> world, row major; round feet: identity */
    Real foot_velocity[ENGINE_FEET][6]; /* [m/s, rad/s] twist there */
    /* ---- dynamics ---- */
    Real mass[ENGINE_DOFS][ENGINE_STRIDE];   /* M by rows, see tree.h; of the base all 6 x 6 */
    Real factor[ENGINE_DOFS][ENGINE_STRIDE]; /* L with N = L^T L, but for its diagonal */
    Real inverse[ENGINE_DOFS];               /* 1 / diagonal of L */
    int newton;                              /* steps of the constraints' solver in the last step */
    /* ---- joint limits; by link, [0] unused ---- */
    Real limit_side[ENGINE_LINKS];      /* [-] 1 at the lower limit, -1 at the upper, 0 inside */
    Real limit_reference[ENGINE_LINKS]; /* [rad/s^2] reference acceleration, away from the limit */
    Real limit_weight[ENGINE_LINKS];    /* [kg m^2] 1/R */
    alignas(16) union {
        EngineDynamics dynamics;
        EngineSupport support;
    } now;
} EngineWork;

#endif
