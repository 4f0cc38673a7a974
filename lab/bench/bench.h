/* Measurements of speed and memory on this machine, one function each. */
#ifndef BENCH_BENCH_H
#define BENCH_BENCH_H

#include "robot/robot.h"
#include "run/train/experiment.h"

/* A row that a bench measured; the command prints and saves them. */
typedef struct {
    const char *bench, *unit;
    char name[40]; /* the case */
    double value;
} BenchRow;

/* Zeroed: empty. */
typedef struct {
    BenchRow *rows; /* owned */
    int count, room;
    int is_short; /* bool: memory ran out, and a row is missing */
} BenchReport;

/* Memory can run out: the report is short then, and whoever reads its rows must ask. */
void bench_add(BenchReport *report, const char *bench, const char *name, double value,
               const char *unit);
void bench_report_free(BenchReport *report);

/* ---- a function for each bench ---- */

/* One physics step of the robot standing on sand, with our contact and with the engine's own.
 * The cases take turns; medians. */
MildStatus bench_step(const ExperimentDef *def, BenchReport *report, MildError *error);
/* The ground alone: solve and advance of two soles, 154 elements in contact. */
MildStatus bench_ground(const ExperimentDef *def, BenchReport *report, MildError *error);
/* Solve and advance of two plates, 20 to 2000 elements together, standing and slipping. */
MildStatus bench_elements(const ExperimentDef *def, BenchReport *report, MildError *error);
/* The physics steps of a walk of the shipped policy, with our contact and with the engine's own. */
MildStatus bench_walk(const ExperimentDef *def, BenchReport *report, MildError *error);
/* The ground in batches on train.device: steps per second along a walk, and how near in float. */
MildStatus bench_batch(const ExperimentDef *def, BenchReport *report, MildError *error);
/* The environments alone on train.device: batch engine, ground and task under no action but the
 * assistance. */
MildStatus bench_robots(const ExperimentDef *def, BenchReport *report, MildError *error);
/* The learner alone on train.device, from a rollout of random numbers. */
MildStatus bench_update(const ExperimentDef *def, BenchReport *report, MildError *error);
/* Training as a whole, and how its time is spent. */
MildStatus bench_train(const ExperimentDef *def, BenchReport *report, MildError *error);
/* Bytes held by a training run of train.envs robots. */
MildStatus bench_memory(const ExperimentDef *def, BenchReport *report, MildError *error);

/* ---- step.c: a physics step of the robot, compared with the engine's own contact ---- */

/* Medians over the repeats of one run in which the cases take turns [us per physics step]. The
 * robot stands balanced (stand.h); the engine's rows use mj_step on the same model and pose. */
typedef struct {
    double engine_free;        /* mj_step, hanging: no contact */
    double engine_rigid;       /* mj_step, eight sole corners on its floor */
    double rigid;              /* robot_sim_step, rigid variation */
    double newton;             /* robot_sim_step on the soft ground, Newton */
    double gauss_seidel;       /* robot_sim_step on the soft ground, the paper's sweeps */
    RobotPhases newton_phases; /* [us] of the Newton case: phases, with `steps` = 1 */
    double iterations;         /* mean Newton iterations per step */
} RobotBench;

/* preset: ground of the soft cases, e.g. "sand_loose"; repeats of `steps` steps per case. */
MildStatus robot_bench_step(const Robot *robot, const char *preset, double dt, int repeats,
                            int steps, RobotBench *result, MildError *error);

#endif
