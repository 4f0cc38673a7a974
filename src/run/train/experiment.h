/* Everything that defines a training run. */
#ifndef TRAIN_EXPERIMENT_H
#define TRAIN_EXPERIMENT_H

#include <stdint.h>

#include "env/actuator/actuator.h"
#include "env/envs.h"
#include "env/task/ground.h"
#include "env/task/task_def.h"
#include "env/task/terrain.h"
#include "learn/ppo.h"
#include "mild/field.h"

/* ---- length and size of a training run: section [train] of a config ---- */

enum { TRAIN_ROBOT_SIZE = 128, TRAIN_START_SIZE = 256 };

typedef struct {
    char robot[TRAIN_ROBOT_SIZE]; /* folder of robots/ by its name, or any folder with a slash */
    int envs;                     /* robots simulated at the same time */
    int iterations;               /* of PPO; 0: no limit */
    double minutes;               /* [min] wall time of this run; 0: no limit */
    int checkpoint_every;         /* iterations */
    int keep_checkpoints;         /* how many to keep, the newest ones */
    uint64_t seed;
    int threads;                  /* 0: one per core */
    char device[8];               /* where the networks run: cpu, cuda, cuda:N */
    int robots;                   /* TrainRobots */
    int grounds;                  /* that the batch engine's episodes choose from */
    char start[TRAIN_START_SIZE]; /* policy whose networks a new run begins with; empty: random */
} TrainDef;

/* What steps the robots: MuJoCo with mild/ground.h on the CPU, or the batch engine with
 * mild/batch.h where the networks run. */
typedef enum {
    TRAIN_ROBOTS_AUTO,
    TRAIN_ROBOTS_MUJOCO,
    TRAIN_ROBOTS_BATCH,
    TRAIN_ROBOTS
} TrainRobots;

/* Number of the CUDA device, -1 for the CPU, -2 for neither. */
int train_device(const TrainDef *def);
/* Bool: the batch engine steps the robots; `auto` is batch on a GPU. */
int train_is_batch(const TrainDef *def);

TrainDef train_def_default(void);
extern const MildField train_fields[];
extern const int train_field_count;
/* Of these, device and robots, which evaluation has too. */
extern const MildField train_machine_fields[];
extern const int train_machine_field_count;

typedef struct {
    TrainDef train;
    PpoDef ppo;
    PolicyDef policy;
    TaskDef task;
    TerrainDef terrain;
} ExperimentDef;

/* The defaults of every layer. */
ExperimentDef experiment_def_default(void);
/* Makes the policy as wide as the robot's observations and actions. */
void experiment_fit_robot(ExperimentDef *def, const Robot *robot);

/* Checks every range, and keys that must fit together. */
MildStatus experiment_check(const ExperimentDef *def, MildError *error);

/* ---- the environments of a run, as its config describes them ---- */

typedef struct {
    Envs *envs;
    MildMap *map;       /* of the terrain; NULL: level ground */
    Actuator *actuator; /* NULL: the joints' PD */
    TaskSoils soils;    /* of randomize.presets */
} TrainEnvs;

/* count: environments of this process, with numbers from `first`. Sets the map, imprints, motors
 * and soils of def->task, which the environments borrow. Close it after a failure too. */
MildStatus train_envs_open(TrainEnvs *envs, ExperimentDef *def, const Robot *robot, Pool *pool,
                           int count, int first, MildError *error);
void train_envs_close(TrainEnvs *envs);

#endif
