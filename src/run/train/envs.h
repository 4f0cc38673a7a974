/* The environments of a run, as its config describes them. */
#ifndef TRAIN_ENVS_H
#define TRAIN_ENVS_H

#include "env/actuator/actuator.h"
#include "env/envs.h"
#include "env/task/ground.h"
#include "run/train/experiment.h"

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
