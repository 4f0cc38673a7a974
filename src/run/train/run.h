/* A training run on disk: its folder holds config.ini, version.txt, log.csv and a TensorBoard file,
 * checkpoints, and policy.safetensors. */
#ifndef TRAIN_RUN_H
#define TRAIN_RUN_H

#include "run/train/trainer.h"

typedef struct {
    Ranks *ranks; /* NULL: alone. Rank 0 has the folder; the others need none of the texts */
    const char *folder;
    int resume; /* bool: continue from the newest checkpoint that loads */
    const ExperimentDef *def;
    const char *config;  /* text of config.ini, which reads back to `def` */
    const char *version; /* of the program */
    const char *note;    /* one line on how the policy was made, saved with it */
} TrainRunDef;

/* Observer of a run. Any function may be NULL. With several processes the others than rank 0 call
 * only `stop`, and one that stops ends the run of all. */
typedef struct {
    void *self;
    void (*resumed)(void *self, const char *checkpoint);
    void (*passed_over)(void *self, const char *why); /* a checkpoint that does not load */
    int (*stop)(void *self); /* called before every iteration; nonzero saves and ends the run */
    /* after every iteration. share: how much of the run is done, 0 .. 1; negative: no end */
    void (*iterated)(void *self, int64_t iteration, const TrainReport *report, double share);
} TrainCallbacks;

typedef struct TrainRun TrainRun;

/* Fails unless a new run finds neither checkpoints nor any other file that it would write in the
 * folder, and a resumed run finds checkpoints, and no links in the place of its files. */
MildStatus train_run_check_folder(const char *folder, int resume, MildError *error);

/* Claims (file_claim) the run's files, so that nothing can be read that the run would overwrite. */
MildStatus train_run_claim(const char *folder, int resume, MildError *error);

/* Makes the folder or continues in it. Borrows what `def` and `callbacks` point to. Returns NULL on
 * failure, with the reason in *error. */
TrainRun *train_run_open(const TrainRunDef *def, const TrainCallbacks *callbacks, MildError *error);
void train_run_close(TrainRun *run); /* may be NULL */
int64_t train_run_iteration(const TrainRun *run);

/* Iterates until train.minutes or train.iterations are over or `stop` says so, then saves. */
MildStatus train_run_loop(TrainRun *run, MildError *error);

#endif
