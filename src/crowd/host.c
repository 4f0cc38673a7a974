/* A crowd on the CPU: the text of the GPU, environment after environment. */
#define MILD_REAL_FLOAT

#include "crowd/crowd.inc"
#include "crowd/text.h"

CrowdBytes crowd_host_bytes(const TaskDef *def, const TaskShape *shape) {
    return (CrowdBytes){crowd_stride(def, shape), sizeof(CrowdRobot)};
}

void crowd_host_create(const CrowdArrays *all, long robot) {
    crowd_create_env(all, robot);
}

void crowd_host_begin(const CrowdArrays *all, long robot) {
    crowd_begin(all, robot);
}

void crowd_host_first(const CrowdArrays *all, const EnvsStep *call, long robot) {
    CrowdPlace place;
    crowd_pose(all, robot, &place);
    crowd_observe(all, call, robot);
}

void crowd_host_part(const CrowdArrays *all, const EnvsStep *call, int k, long robot) {
    CrowdPlace place;
    crowd_part(all, call, robot, k, all->sample != NULL, &place);
}

void crowd_host_tell(const CrowdArrays *all, long robot) {
    crowd_tell(all, robot);
}

void crowd_host_end(const CrowdArrays *all, const EnvsStep *call, long robot) {
    crowd_end(all, call, robot);
}

void crowd_host_keep(const CrowdArrays *all, int back) {
    for (long robot = 0; robot < all->envs; robot++) {
        crowd_keep_env(all, robot, back);
    }
}

void crowd_host_tally(const CrowdArrays *all) {
    for (int n = 0; n < TALLY_NUMBERS; n++) {
        all->tally[n] = 0;
        for (long robot = 0; robot < all->envs; robot++) {
            all->tally[n] += crowd_take(all, robot, n);
        }
    }
}

void crowd_model_fill(const EngineTree *tree, const double *number, EngineModel *model) {
    Real *to = (Real *)(void *)&model->number;
    model->tree = *tree;
    for (int i = 0; i < CROWD_MODEL_NUMBERS; i++) {
        to[i] = (Real)number[i];
    }
}
