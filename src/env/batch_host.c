/* The batch engine on the CPU: the functions of the GPU, environment after environment. */
#define MILD_REAL_FLOAT

#include "env/batch_fork.h"
#include "env/kernels.h"

EnvsBytes envs_host_bytes(const TaskDef *def, const TaskShape *shape) {
    return (EnvsBytes){env_stride(def, shape), sizeof(EnvRobot), sizeof(EnvShells)};
}

void envs_host_create(const EnvsArrays *all, long robot) {
    env_create(all, robot);
}

void envs_host_begin(const EnvsArrays *all, long robot) {
    env_begin(all, robot);
}

void envs_host_first(const EnvsArrays *all, const EnvsStep *call, long robot) {
    EnvWork scratch;
    env_pose(all, robot, &scratch);
    env_observe(all, call, robot);
}

void envs_host_part(const EnvsArrays *all, const EnvsStep *call, int k, long robot) {
    EnvWork scratch;
    env_part(all, call, robot, k, all->sample != NULL, all->shells.setup != NULL, &scratch);
}

void envs_host_shells(const EnvsArrays *all, int k, long robot) {
    EnvShellsWork work;
    EnvFloorWork floor;
    work.engine.count = work.ground.count = 0; /* gcc does not see that a lane sets them */
    floor.floor.count = floor.floor.points = 0;
    if (!env_shells_wait(all, robot) || !env_shells_follow(all, robot, k)) {
        return;
    }
    if (all->rigid[robot]) {
        env_floor_step(all, robot, &floor);
    } else {
        env_shells_step(all, robot, &work, LAW_ANY);
    }
}

void envs_host_set_command(const EnvsArrays *all, long robot) {
    env_set_command(all, robot);
}

void envs_host_end(const EnvsArrays *all, const EnvsStep *call, long robot) {
    env_end(all, call, robot);
}

void envs_host_move_progress(const EnvsArrays *all, int back) {
    for (long robot = 0; robot < all->envs; robot++) {
        env_move_progress(all, robot, back);
    }
}

void envs_host_tally(const EnvsArrays *all) {
    for (int n = 0; n < TALLY_NUMBERS; n++) {
        all->tally[n] = 0;
        for (long robot = 0; robot < all->envs; robot++) {
            all->tally[n] += env_tally(all, robot, n);
        }
    }
}

void envs_host_save(const EnvsArrays *all, const EnvsFork *fork, long robot) {
    env_weigh(all, fork, robot);
    env_move_rows(fork, robot, 1, 0, 1);
}

void envs_host_fork(const EnvsArrays *all, const EnvsFork *fork, long robot) {
    const EnvKept kept = env_keep(all, robot);
    env_move_rows(fork, robot, 0, 0, 1);
    env_take_back(all, fork, robot, &kept);
}

void envs_host_read(const EnvsArrays *all, const EnvsMotion *motion, long robot) {
    env_read_motion(all, motion, robot);
}

void envs_model_fill(const EngineTree *tree, const double *number, EngineModel *model) {
    Real *to = (Real *)(void *)&model->number;
    model->tree = *tree;
    for (int i = 0; i < ENVS_MODEL_NUMBERS; i++) {
        to[i] = (Real)number[i];
    }
}
