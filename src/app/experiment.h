/* Everything that defines a training run: sections [train] [ppo] [policy] [task] [reward]
 * [randomize] [terrain]. */
#ifndef MILD_EXPERIMENT_H
#define MILD_EXPERIMENT_H

#include "app/config.h"
#include "app/terrain.h"
#include "app/train_def.h"
#include "learn/ppo.h"
#include "task/task_def.h"

typedef struct {
    TrainDef train;
    PpoDef ppo;
    PolicyDef policy;
    TaskDef task;
    TerrainDef terrain;
} ExperimentDef;

enum { EXPERIMENT_SECTIONS = 7 };

/* The defaults of every layer; the policy's widths are the task's. */
ExperimentDef experiment_def_default(void);

/* The config sections of `def`, bound to it. */
void experiment_sections(ExperimentDef *def, ConfigSection sections[EXPERIMENT_SECTIONS]);

/* Every range, and what must fit together across keys. */
MildStatus experiment_check(const ExperimentDef *def, MildError *error);

/* configs/default.ini, then the overlay file (NULL: none), then overrides "section.key=value", then
 * the check. */
MildStatus experiment_read(ExperimentDef *def, const char *overlay, const char *const *overrides,
                           int override_count, MildError *error);

/* The task for evaluation and play: of the config the policy was trained with (NULL: the defaults),
 * made nominal. */
MildStatus experiment_nominal_task(TaskDef *task, const char *config, MildError *error);

#endif
