/* The vectorised environment: many environments on all cores, which write directly into the
 * learner's batch. */
#ifndef MILD_VEC_H
#define MILD_VEC_H

#include <stddef.h>

#include "base/pool.h"
#include "task/task.h"

typedef struct Vec Vec;

/* Rows of the batch at one time; each [envs][width]. Pointers may be NULL. */
typedef struct {
    float *history, *critic, *estimate, *frame;
} VecView;

/* Statistics of the episodes that ended since the last vec_take_stats. Their means are NaN where
 * none ended. */
typedef struct {
    int episodes, falls, diverged;
    double steps;                    /* policy steps */
    double paid;                     /* sum of the rewards of all these steps */
    double length;                   /* [s] mean */
    double reward;                   /* mean sum of an episode */
    double speed_error;              /* [m/s] mean */
    double assist;                   /* [-] mean level of help of all robots now */
    double terms[TASK_REWARD_COUNT]; /* mean per second lived */
} VecStats;

/* Borrows robot and pool; one RobotSim per thread. */
Vec *vec_create(const TaskDef *def, const Robot *robot, Pool *pool, int envs, uint64_t seed,
                MildError *error);
void vec_destroy(Vec *vec);
/* The environments have numbers `first` onward, which select their random numbers; 0 at first. Call
 * it before the reset. */
void vec_number_from(Vec *vec, int first);
void vec_reset(Vec *vec, const VecView *first);
/* One policy step of all. action [envs][robot_joints]; reward, done, timeout, valid [envs]; next:
 * the observation after. */
void vec_step(Vec *vec, const float *action, float *reward, uint8_t *done, uint8_t *timeout,
              uint8_t *valid, const VecView *next);
/* What the next vec_step also writes, of environments that end in it: their observation before the
 * new episode (zero where the simulation diverged) to the rows of `last`, whose history is not
 * NULL, and the sums of their reward terms to terms [envs][TASK_REWARD_COUNT]. Either may be NULL.
 */
void vec_watch_ends(Vec *vec, const VecView *last, float *terms);
VecStats vec_take_stats(Vec *vec);
/* The same in two steps, between which those of several Vecs may be added: sums over the episodes
 * (`assist` over the robots), and means from them. envs: environments of all. */
VecStats vec_take_sums(Vec *vec);
VecStats vec_stats_from(VecStats sums, int envs);
/* [s] Thread time spent in physics since the last call, and the part of it spent in the ground. */
void vec_take_times(Vec *vec, double *physics, double *ground);
/* Everything that persists, as one block without pointers, so that saving and loading are
 * copies. */
void *vec_state(Vec *vec, size_t *bytes);
/* What lasts beyond an episode, [envs], and back, before vec_reset. */
void vec_keep(const Vec *vec, TaskKept *kept);
void vec_restore(Vec *vec, const TaskKept *kept);
size_t vec_bytes(const Vec *vec);
/* FNV-1a of everything that moves: robots, histories, commands, reward sums, ground memory. */
uint64_t vec_hash(const Vec *vec);

#endif
