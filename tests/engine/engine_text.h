/* The batch engine's text behind an interface without its scalar type: engine_text.inc compiled in
 * double and in float. */
#ifndef TESTS_ENGINE_TEXT_H
#define TESTS_ENGINE_TEXT_H

#include "robot/engine/read.h"

/* State and everything that acts on it in one step. Joints in the order of robot.ini. */
typedef struct {
    double qpos[ROBOT_NQ_MAX];
    double qvel[ROBOT_NV_MAX];
    double qacc[ROBOT_NV_MAX]; /* of the step before */
    double torque[ROBOT_JOINTS_MAX];
    double push[6];
    double wrench[ROBOT_FEET_MAX][6];
    RobotVariation variation; /* rigid: on rigid ground instead of under the wrenches */
    double height;            /* [m] of rigid ground at the origin */
    double slope[2];          /* [-] of it */
    const MildMap *map;       /* or NULL; then slope is 0 */
    double map_origin[2];     /* [m] */
} EngineCase;

/* Degrees of freedom in the engine's order. */
typedef struct {
    double mass[ENGINE_ENTRIES_MAX]; /* N, packed */
    double force[ROBOT_NV_MAX];      /* f' */
    double smooth[ROBOT_NV_MAX];     /* qacc without ground, with the held limits */
    double position[ROBOT_FEET_MAX][3];
    double rotation[ROBOT_FEET_MAX][9];
    double velocity[ROBOT_FEET_MAX][6];
    double free_velocity[ROBOT_FEET_MAX][6];
    double inverse_inertia[36 * ROBOT_FEET_MAX * ROBOT_FEET_MAX];
    double wrenched[ROBOT_NV_MAX];     /* and with the wrenches */
    double acceleration[ROBOT_NV_MAX]; /* with the limits that push, or rigid ground */
    double wrench[ROBOT_FEET_MAX][6];  /* of rigid ground */
    double qpos[ROBOT_NQ_MAX];         /* after the step */
    double qvel[ROBOT_NV_MAX];
    double body_clearance;                   /* [m] above the height of the case */
    double knee_distance;                    /* [m] */
    double foot_distance;                    /* [m] */
    double leg_distance;                     /* [m] */
    double sole_height[ROBOT_FEET_MAX];      /* [m] */
    double sole_center[ROBOT_FEET_MAX][3];   /* [m] */
    double sole_velocity[ROBOT_FEET_MAX][3]; /* [m/s] */
    double next_velocity[ROBOT_FEET_MAX][6]; /* twists after a step on rigid ground */
    double next_position[ROBOT_FEET_MAX][3]; /* [m] of the feet after the step */
    int newton;                              /* steps of the constraints' solver */
    int bad;
    int overrun; /* bool: engine_save wrote behind EngineSaved */
} EngineResult;

typedef void EngineText(const EngineTree *tree, const double *number, const EngineCase *in,
                        EngineResult *out);
EngineText engine_text_double, engine_text_float;
/* In double, with the lanes of each block in the opposite order. */
EngineText engine_text_reverse;

#endif
