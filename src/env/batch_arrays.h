/* What the batch engine keeps on its device. */
#ifndef ENVS_ARRAYS_H
#define ENVS_ARRAYS_H

#include "env/envs_step.h"
#include "env/task/ground.h"
#include "env/task/state.h"
#include "env/trial.h"
#include "ground/batch/batch.h"
#include "robot/engine/model.h"

/* Sums over the episodes of an environment that ended since the last envs_sums; see
 * EnvsStats. */
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

/* A ground to draw. */
typedef struct {
    double depth; /* [m] that the robot stands in it */
    float numbers[TASK_GROUND_NUMBERS];
} EnvsGround;

/* The same for all environments. */
typedef struct {
    TaskDef task;
    RobotTable robot;
    const EnvsGround *ground; /* [grounds] to draw from */
    int grounds;
    MapView map;          /* its arrays are the ground's */
    double map_extent[2]; /* [m] */
    int has_map;          /* bool */
    int uneven;           /* bool: the map is */
    int labels;           /* of the map; 1 without */
    int striped;          /* bool: the labels are stripes of the share patch_share of episodes */
    /* what environments are made from, see task_env_init_head and task_motor */
    TaskShape shape;
    TaskGains gains;
    uint64_t seed;
    uint32_t first; /* number of the first environment */
} EnvsTask;

/* What passes between engine and ground; see MildBatchInput and MildBatchOutput. The ground writes
 * over what it has read: the wrenches over velocity, the twists after the step over free_velocity.
 */
typedef struct {
    float *position, *rotation, *velocity, *free_velocity, *height;
    float *inverse_inertia; /* BatchShape.triangle */
    MildBatchFoot *foot;    /* of which depth_mean is the engine's on rigid ground */
} EnvsContact;
/* Bodies with shells that stand: on soft ground by ground/batch/bodies.h, on rigid ground by
 * robot/engine/floor.h. */
struct BodiesSetup;
typedef struct {
    const struct BodiesSetup *setup; /* NULL: there are none */
    int curves;                      /* of bodies_step */
    char *robot;                     /* [envs] EnvShells of batch_env.h */
    float *memory;                   /* [envs][numbers] of the ground */
    size_t numbers;
    uint16_t *near;     /* [envs] a bit for each body that is near the ground in this step */
    uint8_t *held;      /* [envs] bool: the memory is not all 0 */
    int32_t *list;      /* [envs] of a GPU: those with such a body */
    int *waiting;       /* [2][2] of a GPU: numbers in the list, and of these taken; of a part k at
                           [k % 2], where the part before has put 0 */
    BatchShape shape;   /* of the feet's ground */
    BatchArrays ground; /* the feet's */
} EnvsShells;
#define ENVS_FAR 1000 /* [m] below a robot on rigid ground: the soft one does not touch it */

typedef struct {
    int envs;
    int device;             /* MILD_BATCH_HOST or number of the GPU */
    size_t stride;          /* [B] of a TaskEnv and its frames */
    char *env;              /* [envs][stride] */
    char *robot;            /* [envs] EnvRobot of batch_env.h */
    int32_t *material;      /* [envs][labels] of the ground's table */
    Real *map_origin;       /* [envs][2] [m] */
    uint8_t *reset;         /* [envs] bool: an episode began */
    uint8_t *rigid;         /* [envs] bool: of the episode */
    int32_t *order;         /* [envs] in which a GPU steps them: those on rigid ground first */
    TaskProgress *progress; /* [envs] or NULL, in envs_save_progress and envs_load_progress */
    double *tally;          /* [TALLY_NUMBERS] sums over the environments */
    EnvsContact contact;
    EnvsShells shells;
    const EnvsTrial *trial; /* [envs] or NULL */
    double *command;        /* [envs][TASK_COMMANDS] of the trials */
    EnvsSample *sample;     /* [envs][physics steps] or NULL */
    const EnvsTask *task;
    const EngineModel *model;
} EnvsArrays;

#endif
