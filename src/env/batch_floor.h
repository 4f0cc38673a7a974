/* Rigid ground under a robot of the batch engine: how deep the corners of its feet are in it, and
 * the step of a robot with a shell in it (robot/engine/floor.h). A warp solves feet, shells and
 * joint limits at once, and leaves the acceleration for env_finish_step. */
#ifndef ENVS_BATCH_FLOOR_H
#define ENVS_BATCH_FLOOR_H

#include "env/batch_env.h"
#include "robot/engine/step.h"

/* ---- under the feet ---- */

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

/* ---- under feet and shells ---- */

/* In shared memory. */
typedef struct {
    EnvWork env;
    EngineFloor floor;
} EnvFloorWork;

/* The wrenches of the feet for env_import, the acceleration for engine_integrate; the measures. */
WARP_FN void env_floor_results(const EnvsArrays *all, long robot, const EnvFloorWork *work) {
    const EngineModel *model = all->model;
    const int feet = engine_feet(&model->tree);
    EngineSaved *saved = &env_robot_at(all, robot)->saved;
    env_copy(work->env.work.wrench[0], 6 * feet, all->contact.velocity + robot * 6 * feet);
    engine_save_acceleration(&model->tree, &work->env.work, saved);
    EACH_LANE(l) {
        if (LANE(l) < feet) {
            all->contact.foot[robot * feet + LANE(l)].depth_mean =
                env_corner_depth(model, &work->env, LANE(l));
        }
        if (LANE(l) == LANES - 1) {
            Real load = 0;
            for (int i = 0; i < work->floor.count; i++) {
                load += work->floor.wrench[i][2];
            }
            env_shells_at(all, robot)->load = load;
        }
    }
    lanes_sync();
}

/* The bodies of the bits in `near` are asked for points that touch. */
WARP_FN void env_floor_step(const EnvsArrays *all, long robot, EnvFloorWork *work) {
    const EngineModel *model = all->model;
    const EngineGround ground = env_surface(all, robot);
    const EngineRigid rigid = env_contact(&env_at(all, robot)->variation);
    EngineWork *of = &work->env.work;
    const EngineLinks links = engine_links_of(of);
    const FloorPose pose = {model, &links, of->base, &ground, all->shells.near[robot]};
    engine_restore(&model->tree, 1, &env_robot_at(all, robot)->saved, of);
    engine_restore_links(&model->tree, &env_shells_at(all, robot)->links, of);
    env_rigid(model, rigid, &ground, &work->env);
    engine_floor_collide(&pose, rigid, of, &work->floor);
    engine_floor_solve(model, &work->floor, of);
    env_floor_results(all, robot, work);
}

#endif
