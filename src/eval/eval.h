/* Trials and measures (docs/task.md section 12): one definition, used everywhere. */
#ifndef MILD_EVAL_H
#define MILD_EVAL_H

#include "base/pool.h"
#include "control/controller.h"
#include "eval/measure.h"
#include "eval/scene.h"

typedef struct {
    double speed;    /* [m/s] commanded, forward */
    double sideways; /* [m/s] commanded, to the left */
    int trials;
    double seconds; /* [s] per trial */
    double
        stop; /* [s] from here on the command is 0, and speeds are no longer measured; 0: never */
    uint64_t seed; /* trial k uses stream k */
} EvalDef;

/* Means over the trials, SI units. */
typedef struct {
    char ground[160];
    double speed;
    int trials, success; /* success: trials without termination */
    double velocity; /* [m/s] forward, over the part after the first 2 s; trials that lasted that
                        long */
    double velocity_low, velocity_high; /* [m/s] 95 % interval of the mean over trials */
    double sideways, velocity_sideways; /* [m/s] commanded and measured, to the left */
    double cot;                         /* [-] sum |tau qd| / (m g v) */
    double torque_max;                  /* [N m] largest over joints and time, mean over trials */
    double clearance;                   /* [m] swing apex of the lowest sole point above h0 */
    double penetration;                 /* [m] deepest element of each stance */
    double drift;            /* [m] horizontal travel of the sole between touchdown and lift-off */
    double energy;           /* [J] integral |tau . qd| dt */
    double base_oscillation; /* [m] peak to peak of the base height over the steady part */
    double seconds;          /* [s] mean time on its feet */
} EvalRow;

/* `def` gives control, gait and sensors; its randomisation should be nominal
 * (task_def_make_nominal). Trials run side by side over the pool; results depend on (def, scene,
 * seed) only. */
MildStatus eval_run(const TaskDef *def, const Robot *robot, Pool *pool, Controller *controller,
                    const Scene *scene, const EvalDef *eval, EvalRow *row, MildError *error);

/* The row of the trials' measures, which it finishes. measures, fallen (bool): [eval->trials];
 * weight [N] of the robot. */
void eval_summarise(EvalRow *row, const char *ground, const EvalDef *eval, Measure *measures,
                    const uint8_t *fallen, double weight);

/* Heading hold used by eval and play: turns back to world x. speed, sideways [m/s]: forward and to
 * the left; both 0: stand, without holding. Writes env->command and freezes it. */
void eval_command(TaskEnv *env, double speed, double sideways);

/* Text table. */
void eval_print_header(char *text, int size);
void eval_print_row(const EvalRow *row, char *text, int size);

#endif
