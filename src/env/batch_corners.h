/* Rigid ground under a robot of the batch engine, and how deep its feet's corners are in it. */
#ifndef ENVS_BATCH_CORNERS_H
#define ENVS_BATCH_CORNERS_H

#include "env/batch_env.h"
#include "robot/engine/constraint.h"

/* What is under a robot. */
MILD_HD EngineGround env_surface(const EnvsArrays *all, long robot) {
    const EngineGround ground = {all->task->has_map ? &all->task->map : NULL,
                                 all->map_origin + 2 * robot, 0};
    return ground;
}

/* [m] Mean depth of the corners of a foot that pushed in the last step. */
MILD_HD Real env_corner_depth(const EngineModel *model, const EnvWork *scratch, int foot) {
    const EngineTree *tree = &model->tree;
    const EngineContact *contact = &scratch->work.now.support.ground.contact;
    Real sum = 0;
    Real pushing = 0;
    LANE_ROLLED
    for (int c = tree->corner_begin[foot]; c < tree->corner_begin[foot + 1]; c++) {
        int pushes = 0;
        LANE_ROLLED
        for (int e = 4 * c; e < 4 * c + 4; e++) {
            pushes |= contact->weight[e] > 0 && contact->residual[e] < 0;
        }
        sum += pushes ? scratch->corner[c] : 0;
        pushing += (Real)pushes;
    }
    return pushing > 0 ? sum / pushing : 0;
}

MILD_HD EngineRigid env_contact(const TaskVariation *variation) {
    const EngineRigid rigid = {(Real)variation->rigid_friction, (Real)variation->rigid_time};
    return rigid;
}

/* Rigid ground, after engine_begin. */
WARP_FN void env_rigid(const EngineModel *model, EngineRigid rigid, const EngineGround *ground,
                       EnvWork *scratch) {
    EngineWork *work = &scratch->work;
    const MapSpot spot = engine_spot(ground, work);
    engine_collide_on(model, rigid, ground, work);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int c = LANE(l); c < engine_corners(&model->tree); c += LANES) {
            Real center[3];
            corner_center(model, work, c, center);
            const EngineSurface under = engine_surface(ground, work, &spot, center[0], center[1]);
            const Real square =
                1 + under.slope[0] * under.slope[0] + under.slope[1] * under.slope[1];
            scratch->corner[c] =
                (under.height - work->base[2] - center[2]) * REAL_INVERSE_SQRT(square) +
                model->number.foot[model->tree.corner_foot[c]].corner_radius;
        }
    }
    lanes_sync();
}

/* Copies as many lanes as there are. */
WARP_FN void env_copy(const Real *from, int count, Real *to) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = LANE(l); i < count; i += LANES) {
            to[i] = from[i];
        }
    }
}

#endif
