/* A robot as the batch engine knows it: the tree, and numbers in the scalar type of the code.
 *
 * The frame of a link has its origin at the hinge's anchor and the axes of the link's body. */
#ifndef MILD_ENGINE_MODEL_H
#define MILD_ENGINE_MODEL_H

#include <stdalign.h>

#include "base/hd.h"
#include "robot/engine/tree.h"
#include "robot/legs.h"

/* Vectors of three. */

MILD_HD Real dot3(const Real *a, const Real *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

MILD_HD void cross3(const Real *a, const Real *b, Real *out) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

MILD_HD void add_cross3(const Real *a, const Real *b, Real *out) {
    out[0] = out[0] + a[1] * b[2] - a[2] * b[1];
    out[1] = out[1] + a[2] * b[0] - a[0] * b[2];
    out[2] = out[2] + a[0] * b[1] - a[1] * b[0];
}

/* out = R v, R row major. */
MILD_HD void turn3(const Real *R, const Real *v, Real *out) {
    out[0] = R[0] * v[0] + R[1] * v[1] + R[2] * v[2];
    out[1] = R[3] * v[0] + R[4] * v[1] + R[5] * v[2];
    out[2] = R[6] * v[0] + R[7] * v[1] + R[8] * v[2];
}

/* out = S v, S symmetric: xx yy zz xy xz yz. */
MILD_HD void symmetric3(const Real *S, const Real *v, Real *out) {
    out[0] = S[0] * v[0] + S[3] * v[1] + S[4] * v[2];
    out[1] = S[3] * v[0] + S[1] * v[1] + S[5] * v[2];
    out[2] = S[4] * v[0] + S[5] * v[1] + S[2] * v[2];
}

/* MuJoCo's soft constraint (its manual, Computation, Parameters): with the violation r < 0 and the
 * impedance d(r) the reference acceleration is -damping v - stiffness d(r) r, and the regularizer
 * (1 - d(r))/d(r) times the constraint's inverse inertia. */
typedef struct {
    Real stiffness; /* [1/s^2] k / d(r) of solref */
    Real damping;   /* [1/s] b of solref */
    Real nearest;   /* [-] d(0) */
    Real farthest;  /* [-] d beyond the width */
    Real width;     /* [m, rad] 0: d is midway at any r */
    Real midpoint;  /* [-] of the width */
    Real power;     /* [-] at least 1 */
} EngineSoft;

/* Mass [kg], first moment [kg m] and moments of inertia [kg m^2] xx yy zz xy xz yz about the
 * origin of a frame, in its axes. Rigid bodies in one frame add up number by number. */
enum { INERTIA_MASS, INERTIA_MOMENT = 1, INERTIA_TENSOR = 4, INERTIA_NUMBERS = 10 };

typedef struct {
    Real turn[3][12];              /* [-, m] link -> parent at the angle q from the reference:
                                      turn[0] + cos q turn[1] + sin q turn[2], three rows of four
                                      numbers, the last of them of the anchor, parent's frame */
    Real axis[3];                  /* [-] of the hinge, link's frame */
    Real inertia[INERTIA_NUMBERS]; /* of the body that the hinge moves, which variations scale */
    Real welded[INERTIA_NUMBERS];  /* of bodies without a joint behind it */
    Real reference;                /* [rad] qpos0 */
    Real armature;                 /* [kg m^2] */
    Real damping;                  /* [N m s/rad] */
    Real effort;                   /* [N m] largest torque */
    Real low;                      /* [rad] */
    Real high;                     /* [rad] */
    Real margin;                   /* [rad] the limit acts so much before it */
    Real inverse_inertia;          /* [1/(kg m^2)] of the limit: dof_invweight0 */
    EngineSoft limit;
    Real spare[2]; /* a link has a multiple of four numbers */
} EngineLink;

typedef struct {
    Real reference[3];    /* [m] flat: origin of the foot's body, round: centre of the sphere; in
                             the link's frame */
    Real radius;          /* [m] round: the reference point lies so much below; flat: 0 */
    Real turn[9];         /* [-] foot's body -> link */
    Real corner_radius;   /* [m] */
    Real inverse_inertia; /* [1/kg] of a contact: body_invweight0 */
    Real knee[3];         /* [m] origin of the knee's body, in its link's frame */
    Real center[3];       /* [m] of the sole, foot's body frame; round: 0 */
    Real outline[2 * ROBOT_OUTLINE_MAX]; /* [points][2] [m] of a flat sole, foot's body frame */
} EngineFoot;

/* See RobotShell. */
typedef struct {
    Real center[3];   /* [m] link's frame */
    Real rotation[9]; /* [-] box -> link */
    Real half[3];     /* [m] */
    Real radius;      /* [m] */
} EngineShell;

/* A body with shells that stand. */
typedef struct {
    Real position[3];     /* [m] of its frame, in the link's */
    Real turn[9];         /* [-] body -> link */
    Real inverse_inertia; /* [1/kg] of a contact with rigid ground: body_invweight0 */
} EngineBody;

/* Real numbers only, so that it may be filled from doubles number by number. */
typedef struct {
    EngineLink link[ENGINE_LINKS_MAX]; /* of link 0 `welded` only */
    Real gravity[3];                   /* [m/s^2] */
    Real dt;                           /* [s] */
    Real base_mass;                    /* [kg] of the base's own body, as what follows */
    Real base_center[3];               /* [m] centre of mass, base frame */
    Real base_inertia[6];              /* [kg m^2] about the centre of mass, base axes */
    EngineSoft contact;                /* of the corners with rigid ground */
    EngineFoot foot[ROBOT_FEET_MAX];
    Real corner[ENGINE_CORNERS_MAX][3]; /* [m] centres, frame of the foot's link */
    EngineShell shell[ROBOT_SHELLS_MAX];
    EngineBody body[ENGINE_BODIES_MAX];
    LegCapsule capsule[ROBOT_CAPSULES_MAX]; /* link's frame */
    Real leg_softness;                      /* [1/kg] 1/m of robot/legs.h */
} EngineNumbers;

typedef struct {
    EngineTree tree;
    alignas(16) EngineNumbers number;
} EngineModel;

/* What a robot's rigid ground has of its own. */
typedef struct {
    Real friction; /* [-] */
    Real time;     /* [s] time constant of the contact, critically damped; 0: the model's contact */
} EngineRigid;

/* What differs from robot to robot; see RobotVariation. */
typedef struct {
    Real base_mass_add;                     /* [kg] */
    Real center_offset[3];                  /* [m] of the base's centre of mass */
    Real link_mass_scale[ENGINE_LINKS_MAX]; /* [-] base, joints' bodies in robot.ini's order */
    Real armature_scale;                    /* [-] */
    EngineRigid rigid;
} EngineVariation;

/* ---- sizes: of the working data, and of loops where the robot is known to the compiler ---- */

/* Define these six before the first inclusion, as engine_model_sizes says, to compile the code for
 * one robot: its working data then has no gaps and its loops have known lengths. */
#ifdef ENGINE_JOINTS
#define ENGINE_FIXED 1
#else
#define ENGINE_FIXED 0
#define ENGINE_JOINTS ROBOT_JOINTS_MAX
#define ENGINE_FEET ROBOT_FEET_MAX
#define ENGINE_CORNERS ENGINE_CORNERS_MAX
#define ENGINE_ENTRIES ENGINE_ENTRIES_MAX
#define ENGINE_CHAIN ENGINE_DOFS_MAX
#define ENGINE_BODIES ENGINE_BODIES_MAX
#endif
/* For a short loop of that many rounds. */
#if ENGINE_FIXED
#define ENGINE_LOOP LANE_UNROLL
#else
#define ENGINE_LOOP LANE_ROLLED
#endif
#define ENGINE_LINKS (1 + ENGINE_JOINTS)
#define ENGINE_DOFS (6 + ENGINE_JOINTS)
/* From a row of M to the next: odd, so that lanes that read one column use different banks of the
 * memory. */
#define ENGINE_STRIDE (ENGINE_CHAIN | 1)

MILD_HD int engine_links(const EngineTree *tree) {
    return ENGINE_FIXED ? ENGINE_LINKS : 1 + tree->joints;
}

MILD_HD int engine_dofs(const EngineTree *tree) {
    return ENGINE_FIXED ? ENGINE_DOFS : 6 + tree->joints;
}

MILD_HD int engine_feet(const EngineTree *tree) {
    return ENGINE_FIXED ? ENGINE_FEET : tree->feet;
}

MILD_HD int engine_corners(const EngineTree *tree) {
    return ENGINE_FIXED ? ENGINE_CORNERS : tree->corners;
}

MILD_HD int engine_entries(const EngineTree *tree) {
    return ENGINE_FIXED ? ENGINE_ENTRIES : tree->entries;
}

MILD_HD int engine_chain(const EngineTree *tree) {
    return ENGINE_FIXED ? ENGINE_CHAIN : tree->chain;
}

/* Entries of the row of link i > 0: the base's six, and the hinges down to it. */
MILD_HD int engine_row_length(const EngineTree *tree, int link) {
    return 6 + tree->level[link];
}

/* The link whose hinge is degree of freedom d; the base for its six. */
MILD_HD int engine_dof_link(int d) {
    return d < 6 ? 0 : d - 5;
}

#endif
