/* Length and size of a training run: section [train] of a config. */
#ifndef TRAIN_TRAIN_DEF_H
#define TRAIN_TRAIN_DEF_H

#include <stdint.h>

#include "mild/field.h"

enum { TRAIN_ROBOT_SIZE = 128 };

typedef struct {
    char robot[TRAIN_ROBOT_SIZE]; /* folder of robots/ by its name, or any folder with a slash */
    int envs;                     /* robots simulated at the same time */
    int iterations;               /* of PPO; 0: no limit */
    double minutes;               /* [min] wall time of this run; 0: no limit */
    int checkpoint_every;         /* iterations */
    int keep_checkpoints;         /* how many to keep, the newest ones */
    uint64_t seed;
    int threads;    /* 0: one per core */
    char device[8]; /* where the networks run: cpu, cuda */
} TrainDef;

TrainDef train_def_default(void);
extern const MildField train_fields[];
extern const int train_field_count;

#endif
