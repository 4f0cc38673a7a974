#include <stdio.h>

#include "bench/bench.h"
#include "bench/record.h"

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
