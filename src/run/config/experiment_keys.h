/* The keys of a training run: sections [train] [ppo] [policy] [task] [reward] [randomize]
 * [terrain]. */
#ifndef CONFIG_EXPERIMENT_KEYS_H
#define CONFIG_EXPERIMENT_KEYS_H

#include "mild/ground.h"
#include "run/config/config.h"
#include "run/train/experiment.h"

enum { EXPERIMENT_SECTIONS = 7 };

/* The config sections of `def`, bound to it. */
void experiment_sections(ExperimentDef *def, ConfigSection sections[EXPERIMENT_SECTIONS]);
/* Single sections: [terrain], and [ground] for one material. */
ConfigSection terrain_section(TerrainDef *def);
ConfigSection ground_section(MildMaterial *material);

/* Reads configs/default.ini, then the overlay file (NULL: none), then overrides
 * "section.key=value", and checks the result. */
MildStatus experiment_read(ExperimentDef *def, const char *overlay, const char *const *overrides,
                           int override_count, MildError *error);

/* Reads a complete config, such as config_text writes, and checks it. */
MildStatus experiment_read_text(ExperimentDef *def, const char *text, MildError *error);

/* The task for evaluation and play and the robot: from the defaults, then from the policy's
 * file, which names its robot and says how it walks, then from the config. policy: NULL: none; a
 * file that cannot be read is refused by who loads it. config: NULL: none. randomized: bool:
 * robots are drawn and pushed as in training, but grounds are not; otherwise they are nominal
 * and undisturbed. */
MildStatus experiment_task(TaskDef *task, int randomized, char robot[TRAIN_ROBOT_SIZE],
                           const char *config, const char *policy, MildError *error);

#endif
