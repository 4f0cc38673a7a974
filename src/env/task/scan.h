/* What a robot sees of the ground (docs/task.md section 5): a height scan, rows of points across
 * its heading, from behind it to ahead of it. A number is the height of the surface there, imprints
 * included, over that on which the base would be at its nominal height.
 *
 * What is seen is old: a scan is taken every scan_hold policy steps and shown scan_delay later. So
 * an environment remembers poses of its base, not scans, and the ground is read where the base was
 * then. Who steps the robot knows the ground:
 *
 *     task_scan_keep(env, reading)                  the present pose
 *     const TaskScan scan = task_scan_seen(...)     where and when the scan was taken
 *     for each number n                             by the lanes of a tile
 *         task_scan_point(def, &scan, n, xy)        where the ground is read
 *         task_scan_number(...)                     with noise, from the height there */
#ifndef TASK_SCAN_H
#define TASK_SCAN_H

#include "base/random.h"
#include "env/task/state.h"

#define TASK_RANDOM_SCAN 0x5343414eu

/* The pose from which a scan is taken. */
typedef struct {
    Real at[3];      /* [m] the base, world */
    Real heading[2]; /* [-] its x axis along world x and y, of unit length */
} TaskScanPose;

typedef struct {
    TaskScanPose pose;
    uint32_t tick; /* policy step of the environment in which it was taken */
    Real offset;   /* [m] error of all its heights */
    int noisy;     /* bool: as the policy sees it; else as it is */
} TaskScan;

/* Poses that an environment with a scan remembers: of the last policy steps, more than the longest
 * randomize.scan_delay (0.2 s) and scan_hold (10) together reach back. */
enum { TASK_SCAN_POSES = 32 };

/* [TASK_SCAN_POSES] Behind the frames of an environment, whose numbers take `frames` bytes. */
MILD_HD_FN size_t task_scan_place(size_t frames) {
    return (frames + sizeof(double) - 1) / sizeof(double) * sizeof(double);
}

MILD_HD_FN TaskScanPose *task_scan_poses(TaskEnv *env) {
    const size_t frames = env->held * (size_t)env->shape.observation * sizeof(TaskFrame);
    return (TaskScanPose *)(void *)((char *)(env + 1) + task_scan_place(frames));
}

MILD_HD_FN int task_scan_columns(const TaskDef *def) {
    return def->scan;
}

/* From the rearmost to the foremost. */
MILD_HD_FN int task_scan_rows(const TaskDef *def) {
    return (int)((def->scan_ahead[1] - def->scan_ahead[0]) / def->scan_pitch + 1.5);
}

/* Policy steps of this episode. */
MILD_HD_FN uint32_t task_scan_age(const TaskEnv *env) {
    return env->step - env->step_first;
}

MILD_HD_FN TaskScanPose task_scan_pose(const TaskEnv *env, const RobotReading *reading) {
    const Real *rotation = reading->rotation;
    const Real length = task_sqrt(rotation[0] * rotation[0] + rotation[3] * rotation[3]);
    TaskScanPose pose;
    for (int i = 0; i < 3; i++) {
        pose.at[i] = env->robot.qpos[i];
    }
    pose.heading[0] = length > 0 ? rotation[0] / length : 1;
    pose.heading[1] = length > 0 ? rotation[3] / length : 0;
    return pose;
}

/* Remembers the present pose. */
MILD_HD_FN void task_scan_keep(TaskEnv *env, const RobotReading *reading) {
    if (tile_lane() == 0) {
        task_scan_poses(env)[task_scan_age(env) % TASK_SCAN_POSES] = task_scan_pose(env, reading);
    }
    tile_sync();
}

/* What the policy sees now. */
MILD_HD_FN TaskScan task_scan_seen(TaskEnv *env, const TaskDef *def) {
    const uint32_t now = task_scan_age(env), late = (uint32_t)env->lag_scan;
    const uint32_t hold = (uint32_t)def->scan_hold;
    const uint32_t shown = now > late ? (now - late) / hold * hold : 0;
    TaskScan scan;
    scan.pose = task_scan_poses(env)[shown % TASK_SCAN_POSES];
    scan.tick = env->tick - (now - shown);
    scan.offset = env->scan_offset;
    scan.noisy = def->observe_noise;
    return scan;
}

/* What is there now, for the critic. */
MILD_HD_FN TaskScan task_scan_true(const TaskEnv *env, const RobotReading *reading) {
    TaskScan scan;
    scan.pose = task_scan_pose(env, reading);
    scan.tick = env->tick;
    scan.offset = 0;
    scan.noisy = 0;
    return scan;
}

/* [2] [m] World axes, from the base of the scan to its point n: row by row from behind, each from
 * the right to the left. */
MILD_HD_FN void task_scan_point(const TaskDef *def, const TaskScan *scan, int n, Real *way) {
    const int columns = task_scan_columns(def);
    const Real x = REAL(def->scan_ahead[0] + def->scan_pitch * (n / columns));
    const Real y = REAL(def->scan_pitch * (n % columns - 0.5 * (columns - 1)));
    const Real c = scan->pose.heading[0], s = scan->pose.heading[1];
    way[0] = c * x - s * y;
    way[1] = s * x + c * y;
}

/* Number n of a scan; height: [m] of the surface at its point, from the base up. */
MILD_HD_FN float task_scan_number(const TaskEnv *env, const TaskDef *def, const RobotTable *robot,
                                  const TaskScan *scan, int n, Real height) {
    const RandomizeDef *z = &def->randomize;
    Real over = height + REAL(task_nominal_height(def, robot));
    if (scan->noisy) {
        Random r = random_at(env->seed ^ TASK_RANDOM_SCAN, env->index, scan->tick);
        r.use = (uint32_t)n;
        const uint64_t bits = random_bits(&r);
        const double noise = 2 * ((double)(bits >> 32) * 0x1p-32) - 1;
        const int lost = (double)(bits & 0xffffffffu) * 0x1p-32 < z->scan_drop;
        over = lost ? 0 : over + scan->offset + REAL(z->scan_noise * noise);
    }
    return (float)(TASK_SCAN_SCALE * task_clamp(over, -TASK_SCAN_CLIP, TASK_SCAN_CLIP));
}

#endif
