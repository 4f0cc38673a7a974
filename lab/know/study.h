/* A study of walks: each robot, its ground and its command, drawn from a seed. */
#ifndef KNOW_STUDY_H
#define KNOW_STUDY_H

#include "know/prior.h"
#include "know/walks.h"

/* Walks that share a robot's noise and randomisation. */
enum { STUDY_BATCH = 48 };

typedef struct {
    const TaskDef *nominal; /* of experiment_task */
    const TaskDef *drawn;   /* the same, randomized */
    Robot *robot;
    Pool *pool;
    Controller *controller; /* of STUDY_BATCH rows */
    Prior prior;
    MildModel model;     /* another than mild: the material is matched to what was drawn */
    double change_share; /* [-] of the walks, from one ground onto another; these go straight */
    double speed[2];     /* [m/s] of straight walks alone; 0 0: any command */
    double slick[2];     /* [-] friction of the last ground of each walk, evenly in its logarithm;
                            0 0: as drawn */
    double grip;         /* [-] of grounds where slip costs support */
    double robots;       /* [-] share of the batches with randomised robots */
    double quiet;        /* [-] share of the batches with less noise than in training */
    int rigid;           /* bool: on the engine's own contact */
    const MildMaterial *preset; /* instead of the prior; NULL: none */
    double seconds;
    uint64_t seed;
} StudyDef;

typedef struct {
    PriorGround ground[2]; /* of the terrain's materials */
    int grounds;
    int drawn;      /* bool: the robot is randomised */
    double noise;   /* [-] of that of training */
    int lasted;     /* [policy steps] until a fall or the end */
    double seconds; /* [s] that were asked for */
    WalkRoute walk;
} StudyWalk;

/* Who looks at the walks; as WalksDef has it, with the number of the walk in the study. */
typedef struct {
    void (*stepped)(void *context, const WalkStep *step);
    WalkCare (*care)(void *context, int walk); /* NULL: none */
    void *context;
} StudyWatcher;

/* walk: [count] */
MildStatus study_run(const StudyDef *def, StudyWalk *walk, int count, const StudyWatcher *watcher,
                     MildError *error);

#endif
