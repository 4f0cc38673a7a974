/* Shells on rigid ground (robot/engine/floor.h): the step of a robot with one in the ground. A warp
 * solves feet, shells and joint limits at once, and leaves the acceleration for env_finish_step. */
#ifndef ENVS_BATCH_FLOOR_H
#define ENVS_BATCH_FLOOR_H

#include "env/batch_corners.h"
#include "robot/engine/step.h"

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
