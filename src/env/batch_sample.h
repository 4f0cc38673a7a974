/* What an evaluation chooses and measures. */
#ifndef ENVS_BATCH_SAMPLE_H
#define ENVS_BATCH_SAMPLE_H

#include "env/batch_env.h"
#include "robot/engine/legs.h"

/* A trial in the place of what the episode drew. */
MILD_HD void env_set_trial(const EnvsArrays *all, long robot, TaskEnv *env) {
    const EnvsTrial *trial = &all->trial[robot];
    env->ground[0] = trial->ground;
    all->map_origin[2 * robot] = all->map_origin[2 * robot + 1] = 0;
    env->variation.rigid = trial->rigid;
    env->variation.rigid_friction = TASK_RIGID_FRICTION;
    env->variation.rigid_time = 0;
}

MILD_HD void env_set_command(const EnvsArrays *all, long robot) {
    TaskEnv *env = env_at(all, robot);
    for (int i = 0; i < TASK_COMMANDS; i++) {
        env->command[i] = all->command[TASK_COMMANDS * robot + i];
    }
    env->command_frozen = 1;
}

/* Torques of physics step k, which begins, and the state after step k - 1, which env_measure has
 * just seen. shells: bool, a constant: they stand. */
WARP_FN void env_record_sample(const EnvsArrays *all, long robot, int k, int shells,
                               const EnvWork *scratch) {
    const EngineTree *tree = &all->model->tree;
    const EngineWork *work = &scratch->work;
    const RobotReading *reading = env_reading(env_robot_at(all, robot));
    const int feet = engine_feet(tree), rigid = all->rigid[robot];
    const int steps = env_physics_steps(all->task);
    EnvsSample *begun = all->sample + robot * steps + k, *done = begun - 1;
    const Real legs = k > 0 ? engine_leg_distance(all->model, work) : 0;
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = 1 + LANE(l); i < engine_links(tree); i += LANES) {
            const int j = tree->joint[i];
            if (k < steps) {
                begun->torque[j] = (double)scratch->torque[j];
            }
            if (k > 0) {
                done->speed[j] = (double)work->rate[5 + i];
            }
        }
        LANE_ROLLED
        for (int f = LANE(l); k > 0 && f < feet; f += LANES) {
            done->foot[f].load = (double)reading->foot[f].force[2];
            done->foot[f].center[0] = (double)reading->foot[f].sole_center[0];
            done->foot[f].center[1] = (double)reading->foot[f].sole_center[1];
            done->foot[f].height = (double)reading->foot[f].sole_height;
            done->foot[f].depth = rigid ? 0 : (double)all->contact.foot[robot * feet + f].depth_max;
        }
        if (LANE(l) == LANES - 1 && k < steps) {
            begun->valid = 0;
            begun->joints = engine_links(tree) - 1;
            begun->feet = feet;
        }
        if (LANE(l) == LANES - 1 && k > 0) {
            for (int i = 0; i < 3; i++) {
                done->base[i] = (double)work->base[i];
                done->mass_center[i] = NAN;
                done->omega[i] = (double)work->rate[3 + i];
            }
            for (int i = 0; i < 4; i++) {
                done->quaternion[i] = (double)work->quaternion[i];
            }
            done->above = (double)reading->above;
            done->legs = (double)legs;
            done->shell_load = shells ? (double)env_shells_at(all, robot)->load : 0;
            done->valid = 1;
        }
    }
    lanes_sync();
}

#endif
