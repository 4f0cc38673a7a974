/* What a crowd keeps on its device. Include it after task.h. */
#ifndef CROWD_ARRAYS_H
#define CROWD_ARRAYS_H

#include "batch/batch.h"
#include "crowd/trial.h"
#include "engine/data.h"
#include "task/ground.h"
#include "task/task.h"

/* Sums over the episodes of an environment that ended since the last crowd_take_stats; see
 * VecStats. */
enum {
    TALLY_EPISODES,
    TALLY_FALLS,
    TALLY_DIVERGED,
    TALLY_STEPS,
    TALLY_PAID,
    TALLY_LENGTH,
    TALLY_REWARD,
    TALLY_SPEED_ERROR,
    TALLY_TERMS,
    TALLY_KEPT = TALLY_TERMS + TASK_REWARD_COUNT,
    TALLY_ASSIST = TALLY_KEPT, /* not kept: the level of assistance now */
    TALLY_NUMBERS
};

/* The same for all environments; the task comes first. task.grounds points to `grounds` of the same
 * block. */
typedef struct {
    TaskDef task;
    RobotTable robot;
    TaskGrounds grounds;
    MapView map;          /* its arrays are the ground's */
    double map_extent[2]; /* [m] */
    int has_map;          /* bool */
    int uneven;           /* bool: the map is */
    int labels;           /* of the map; 1 without */
    int striped;          /* bool: the labels are stripes of the share patch_share of episodes */
} CrowdTask;

/* Of one environment besides its TaskEnv. */
typedef struct {
    EngineVariation variation;
    double tally[TALLY_KEPT];
    double torque[ROBOT_JOINTS_MAX]; /* [N m] of the last physics step */
    int diverged;                    /* bool: in this policy step */
} CrowdRobot;

/* What passes between engine and ground; see MildBatchInput and MildBatchOutput. */
typedef struct {
    float *position, *rotation, *velocity, *inverse_inertia, *free_velocity, *height;
    float *wrench, *twist;
    MildBatchFoot *foot;
} CrowdContact;
#define CROWD_FAR 1000 /* [m] below a robot on rigid ground: the soft one does not touch it */

typedef struct {
    int envs;
    size_t stride;     /* [B] of a TaskEnv and its frames */
    char *env;         /* [envs][stride] */
    CrowdRobot *robot; /* [envs] */
    void *sim;         /* [envs] RobotSim of device_robot.h */
    void *reading;     /* [envs] TaskReading */
    int32_t *material; /* [envs][labels] of the ground's table */
    Real *map_origin;  /* [envs][2] [m] */
    uint8_t *fresh;    /* [envs] bool: an episode began */
    uint8_t *rigid;    /* [envs] bool: of the episode */
    int32_t *order;    /* [envs] in which a GPU steps them: those on rigid ground first */
    TaskKept *kept;    /* [envs] for crowd_keep */
    double *tally;     /* [TALLY_NUMBERS] sums over the environments */
    EngineWork *work;  /* [envs] between the parts of a step */
    CrowdContact contact;
    float *depth;            /* [envs][feet] [m] mean depth of the last step */
    const CrowdTrial *trial; /* [envs] or NULL */
    double *command;         /* [envs][3] of the trials */
    CrowdSample *sample;     /* [envs][physics steps] or NULL */
    const CrowdTask *task;
    const EngineModel *model;
} CrowdArrays;

/* Arguments of a policy step. */
typedef struct {
    const float *action;
    float *reward;
    uint8_t *done, *timeout, *valid;
    float *history, *critic, *estimate, *frame; /* of VecView */
} CrowdStep;

#endif
