/* Everything that defines a training run. */
#ifndef TRAIN_EXPERIMENT_H
#define TRAIN_EXPERIMENT_H

#include "env/task/task_def.h"
#include "env/task/terrain.h"
#include "learn/ppo.h"
#include "run/train/train_def.h"

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

#endif
