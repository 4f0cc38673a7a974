#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "bench/bench.h"
#include "bench/record.h"
#include "control/stand.h"

#define REPEATS_MAX 1000
#define WARM_STEPS 500
/* The paper's sweeps are slower by orders of magnitude, so they run fewer steps, after the other
 * cases. */
#define SWEEP_REPEATS 3
#define SWEEP_STEPS 2
#define PHASE_WINDOWS 10
#define HANG_HEIGHT 1000.0 /* [m] above the floor, too high to reach it in a round */

enum { ENGINE_FREE, ENGINE_RIGID, RIGID, NEWTON, GAUSS_SEIDEL, CASES };

typedef struct {
    const Robot *robot;
    Stand *stand;
    RobotSim *sims[CASES];
    mjData *engine[2]; /* of ENGINE_FREE and ENGINE_RIGID */
    MildGround *grounds[CASES];
    MildTerrain terrain;
    double iterations;
    long newton_steps;
} Bench;

/* Torque of the stand for the pose in the engine's own data. */
static void stand_engine_torque(const Bench *bench, mjData *d) {
    const int *dof = robot_joint_dof(bench->robot);
    double q[ROBOT_JOINTS_MAX], qd[ROBOT_JOINTS_MAX], torque[ROBOT_JOINTS_MAX];
    int joints = robot_joints(bench->robot);
    for (int i = 0; i < joints; i++) {
        q[i] = d->qpos[dof[i] + 1];
        qd[i] = d->qvel[dof[i]];
    }
    stand_pd(bench->stand, 1, q, qd, torque);
    for (int i = 0; i < joints; i++) {
        d->qfrc_applied[dof[i]] = torque[i];
    }
}

/* mj_step under the stand torque. */
static void engine_steps(Bench *bench, int which, int steps) {
    mjModel *m = robot_sim_model(bench->sims[which]);
    mjData *d = bench->engine[which];
    for (int i = 0; i < steps; i++) {
        stand_engine_torque(bench, d);
        mj_step(m, d);
    }
}

static int our_steps(Bench *bench, int which, int steps) {
    RobotSim *sim = bench->sims[which];
    int bad = 0;
    for (int i = 0; i < steps && !bad; i++) {
        double torque[ROBOT_JOINTS_MAX];
        stand_torque(bench->stand, sim, 1, torque);
        bad = robot_sim_step(sim, torque, NULL, &bench->terrain, bench->grounds[which]);
        if (which == NEWTON) {
            bench->iterations += robot_sim_contact(sim)->iterations;
            bench->newton_steps++;
        }
    }
    return bad;
}

/* Free is the fall of one round: that of all rounds would end on the floor. */
static void hang(mjData *d) {
    d->qpos[2] = HANG_HEIGHT;
    d->qvel[2] = 0;
}

/* Seconds per step of one case. Negative when the simulation diverged. */
static double time_case(Bench *bench, int which, int steps) {
    if (which == ENGINE_FREE) {
        hang(bench->engine[0]);
    }
    double start = clock_thread_seconds();
    int bad = 0;
    if (which == ENGINE_FREE || which == ENGINE_RIGID) {
        engine_steps(bench, which, steps);
    } else {
        bad = our_steps(bench, which, steps);
    }
    return bad ? -1.0 : (clock_thread_seconds() - start) / steps;
}

static MildStatus open_case(Bench *bench, int which, double dt, MildError *error) {
    const MildSole *const *soles = robot_soles(bench->robot);
    bench->sims[which] = robot_sim_create(bench->robot, dt, error);
    void *block = calloc(1, mild_ground_bytes(soles, robot_feet(bench->robot)));
    if (!bench->sims[which] || !block) {
        free(block);
        return mild_fail(error, MILD_ERROR_MEMORY, "bench: out of memory");
    }
    bench->grounds[which] = mild_ground_init(block, soles, robot_feet(bench->robot));
    RobotVariation variation = robot_variation_nominal();
    variation.rigid = which == ENGINE_RIGID || which == RIGID;
    int soft = which == NEWTON || which == GAUSS_SEIDEL;
    double depth =
        mild_sole_sinkage(soles[0], &bench->terrain.materials[0], robot_foot_load(bench->robot));
    RobotState state = stand_state(bench->stand, 1, soft ? depth : 0.0);
    robot_sim_set_solver(bench->sims[which],
                         which == GAUSS_SEIDEL ? MILD_SOLVER_GAUSS_SEIDEL : MILD_SOLVER_NEWTON, 0,
                         0);
    robot_sim_load(bench->sims[which], &state, &variation);
    if (which == ENGINE_FREE || which == ENGINE_RIGID) {
        bench->engine[which] = mj_makeData(robot_sim_model(bench->sims[which]));
        if (!bench->engine[which]) {
            return mild_fail(error, MILD_ERROR_MEMORY, "bench: out of memory");
        }
        robot_engine_qpos(bench->robot, state.qpos, bench->engine[which]->qpos);
    }
    return MILD_OK;
}

static void close_bench(Bench *bench) {
    stand_destroy(bench->stand);
    for (int c = 0; c < CASES; c++) {
        robot_sim_destroy(bench->sims[c]);
        free(bench->grounds[c]);
    }
    for (int c = 0; c < 2; c++) {
        mj_deleteData(bench->engine[c]);
    }
}

static int compare(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, int count) {
    qsort(values, (size_t)count, sizeof *values, compare);
    return values[count / 2];
}

/* [us] Median time per step of the cases first .. last. They take turns, so that a slow moment of
 * the machine affects all of them. */
static MildStatus measure(Bench *bench, int first, int last, int repeats, int steps,
                          double medians[CASES], MildError *error) {
    static const char *const names[CASES] = {"engine free", "engine rigid", "rigid", "newton",
                                             "gauss_seidel"};
    double times[CASES][REPEATS_MAX];
    for (int r = -1; r < repeats; r++) { /* the first round warms up */
        for (int c = first; c <= last; c++) {
            double seconds = time_case(bench, c, r < 0 && c != GAUSS_SEIDEL ? WARM_STEPS : steps);
            if (seconds < 0.0) {
                // NOLINTNEXTLINE(clang-analyzer-core.CallAndMessage): last < CASES
                return mild_fail(error, MILD_ERROR_RANGE, "bench: the case '%s' diverged",
                                 names[c]);
            }
            times[c][r < 0 ? 0 : r] = 1e6 * seconds;
        }
    }
    for (int c = first; c <= last; c++) {
        medians[c] = median(times[c], repeats);
    }
    return MILD_OK;
}

/* [us] Time of each phase of a step. Measured in separate runs, because reading the clock in every
 * phase costs time. The fastest run counts. */
static void measure_phases(Bench *bench, int steps, RobotPhases *phases) {
    double least = 1e300;
    for (int w = 0; w < PHASE_WINDOWS; w++) {
        RobotPhases sum = {0};
        robot_sim_time_phases(bench->sims[NEWTON], &sum);
        our_steps(bench, NEWTON, steps);
        robot_sim_time_phases(bench->sims[NEWTON], NULL);
        double scale = 1e6 / (double)sum.steps,
               total = scale * (sum.smooth + sum.map + sum.ground + sum.finish);
        if (total < least) {
            least = total;
            *phases = (RobotPhases){scale * sum.smooth, scale * sum.map, scale * sum.ground,
                                    scale * sum.finish, 1};
        }
    }
}

MildStatus robot_bench_step(const Robot *robot, const char *preset, double dt, int repeats,
                            int steps, RobotBench *result, MildError *error) {
    Bench bench = {.robot = robot};
    MildMaterial material;
    if (repeats < 1 || repeats > REPEATS_MAX || steps < 1) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "bench: repeats must be 1 .. %d and steps positive", REPEATS_MAX);
    }
    if (!mild_material_preset(preset, &material)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "bench: unknown ground '%s'", preset);
    }
    bench.terrain = mild_terrain_uniform(&material);
    bench.stand = stand_create(robot, error);
    MildStatus status = bench.stand ? MILD_OK : MILD_ERROR_MEMORY;
    for (int c = 0; c < CASES && status == MILD_OK; c++) {
        status = open_case(&bench, c, dt, error);
    }
    double medians[CASES] = {0};
    if (status == MILD_OK) {
        status = measure(&bench, ENGINE_FREE, NEWTON, repeats, steps, medians, error);
    }
    if (status == MILD_OK) {
        status =
            measure(&bench, GAUSS_SEIDEL, GAUSS_SEIDEL, SWEEP_REPEATS, SWEEP_STEPS, medians, error);
    }
    if (status == MILD_OK) {
        *result = (RobotBench){.engine_free = medians[ENGINE_FREE],
                               .engine_rigid = medians[ENGINE_RIGID],
                               .rigid = medians[RIGID],
                               .newton = medians[NEWTON],
                               .gauss_seidel = medians[GAUSS_SEIDEL]};
        result->iterations = bench.iterations / (double)bench.newton_steps;
        measure_phases(&bench, steps, &result->newton_phases);
    }
    close_bench(&bench);
    return status;
}

MildStatus bench_step(const ExperimentDef *def, BenchReport *report, MildError *error) {
    enum { REPEATS = 15, STEPS = 1000 };
    Robot *robot = bench_robot(def, error);
    if (!robot) {
        return MILD_ERROR_IO;
    }
    RobotBench result;
    MildStatus status =
        robot_bench_step(robot, "sand_loose", def->task.physics_dt, REPEATS, STEPS, &result, error);
    robot_destroy(robot);
    if (status != MILD_OK) {
        return status;
    }
    const RobotPhases *phases = &result.newton_phases;
    bench_add(report, "step", "ratio_to_rigid", result.newton / result.engine_rigid, "-");
    bench_add(report, "step", "newton", result.newton, "us");
    bench_add(report, "step", "gauss_seidel", result.gauss_seidel, "us");
    bench_add(report, "step", "engine_rigid", result.engine_rigid, "us");
    bench_add(report, "step", "engine_free", result.engine_free, "us");
    bench_add(report, "step", "rigid", result.rigid, "us");
    bench_add(report, "step", "newton_smooth", phases->smooth, "us");
    bench_add(report, "step", "newton_map", phases->map, "us");
    bench_add(report, "step", "newton_ground", phases->ground, "us");
    bench_add(report, "step", "newton_finish", phases->finish, "us");
    bench_add(report, "step", "newton_iterations", result.iterations, "-");
    return MILD_OK;
}

static void walk_row(BenchReport *report, const char *ground, const char *what, double value,
                     const char *unit) {
    char name[40];
    snprintf(name, sizeof name, "%s_%s", ground, what);
    bench_add(report, "walk", name, value, unit);
}

static void walk_rows(BenchReport *report, const char *ground, const ReplayTimes *times) {
    walk_row(report, ground, "ratio_to_rigid", times->loose / times->engine, "-");
    walk_row(report, ground, "ratio_tight", times->tight / times->engine, "-");
    walk_row(report, ground, "newton", times->loose, "us");
    walk_row(report, ground, "newton_tight", times->tight, "us");
    walk_row(report, ground, "engine_rigid", times->engine, "us");
    walk_row(report, ground, "iterations", times->loose_iterations, "-");
    walk_row(report, ground, "iterations_tight", times->tight_iterations, "-");
    walk_row(report, ground, "unconverged", times->loose_unconverged, "-");
}

/* On the rigid floor the engine is timed on a walk of its own. */
MildStatus bench_walk(const ExperimentDef *def, BenchReport *report, MildError *error) {
    enum { PERIODS = 300, REPEATS = 15 };
    static const char *const grounds[] = {"sand_loose", "foam45", "grass", "rigid"};
    const ReplayStop loose = {def->task.contact_tolerance, def->task.contact_iterations,
                              def->task.contact_float};
    Robot *robot = bench_robot(def, error);
    MildStatus status = robot ? MILD_OK : MILD_ERROR_IO;
    for (size_t g = 0; g < sizeof grounds / sizeof *grounds && status == MILD_OK; g++) {
        ReplayTimes times;
        Replay *replay = bench_record_walk(def, robot, grounds[g], TASK_MODEL_OWN, PERIODS, error);
        status = replay ? replay_time(replay, robot, loose, REPEATS, &times, error) : error->status;
        // NOLINTNEXTLINE(clang-analyzer-core.NullDereference): error->status is no success
        if (status == MILD_OK && !replay->variation.rigid) {
            walk_rows(report, grounds[g], &times);
        }
        if (status == MILD_OK && replay->variation.rigid) {
            walk_row(report, grounds[g], "engine_rigid", times.engine, "us");
        }
        replay_destroy(replay);
    }
    robot_destroy(robot);
    return status;
}
