/* Walks of a policy, many at once, by MuJoCo, for what looks at the robot's sensors and knows the
 * ground. */
#ifndef KNOW_WALKS_H
#define KNOW_WALKS_H

#include "base/pool.h"
#include "control/controller.h"
#include "env/envs.h"

enum { WALK_COMMANDS = 4 };

/* What a robot walks on, and where to. */
typedef struct {
    MildTerrain terrain;
    int rigid; /* bool: on the engine's own contact */
    /* [m/s, m/s, rad/s] one after another, each as long; the heading is held where the third
     * is 0 */
    double command[WALK_COMMANDS][3];
    int commands;
} WalkRoute;

/* A policy step of a walk that has not fallen. */
typedef struct {
    int walk, step;
    const float *frame;           /* [TaskShape.observation] what the policy sees */
    const float *critic;          /* [TaskShape.critic] the same without noise, and the truth */
    const double *command;        /* [3] */
    int material[ROBOT_FEET_MAX]; /* of the terrain, under the foot; -1: the foot is free */
    double forward;               /* [m] of the base, world x */
    double work;                  /* [J] of the joints in the step before, by size */
} WalkStep;

/* What the robot allows itself. */
typedef struct {
    double speed;  /* [m/s] largest */
    double period; /* [s] of its gait clock; 0: that of its task */
} WalkCare;

typedef struct {
    const TaskDef *task;
    const Robot *robot;
    Pool *pool;
    Controller *controller;
    const WalkRoute *walk; /* [count] */
    int count;
    double seconds;
    uint64_t seed;
    uint32_t first; /* number of the first walk, which selects its random numbers */
    /* In the order of steps, then of walks. */
    void (*stepped)(void *context, const WalkStep *step);
    void *context;
    /* In this walk, from the next step on; NULL: it walks as commanded. */
    WalkCare (*care)(void *context, int walk);
} WalksDef;

/* lasted: [count] policy steps until a fall or the end. */
MildStatus walks_run(const WalksDef *def, int *lasted, MildError *error);

#endif
