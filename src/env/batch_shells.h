/* The ground under the shells of a robot, where these stand: a step of their own for robots that
 * have one near the ground. All others are stepped as without shells. Rigid ground:
 * batch_floor.h. */
#ifndef ENVS_BATCH_SHELLS_H
#define ENVS_BATCH_SHELLS_H

#include "env/batch_floor.h"
#define BODIES_NEAR (ENGINE_FEET + ENGINE_BODIES)
#define BODIES_WARP_COLUMNS (ENGINE_FEET > 2 ? 9 : 7)
#include "ground/batch/bodies.h"
#include "robot/engine/ground.h"
#include "robot/engine/shells.h"

/* [m/s] A body that this speed would not bring to the ground in a step is not asked for its own. */
#define ENV_SHELLS_FAST REAL(8)

/* In shared memory. */
typedef struct {
    EngineShells engine;
    BodiesWork ground;
} EnvShellsWork;

/* No body is near the ground. up: bool: none was down on rigid ground, so that none carries. */
WARP_FN void env_shells_away(const EnvsArrays *all, long robot, int up) {
    EACH_LANE(l) {
        if (LANE(l) == 0) {
            all->shells.near[robot] = 0;
            if (up) {
                env_shells_at(all, robot)->load = 0;
            }
        }
    }
    lanes_sync();
}

/* ---- which bodies may touch ---- */

/* Where a body is, after engine_begin. */
typedef struct {
    Real from_base[3]; /* [m] world axes */
    Real position[3];  /* [m] world */
    Real rotation[9];  /* [-] body -> world */
} EnvBodyPose;

MILD_HD void env_body_pose(const EnvsArrays *all, const EngineWork *work, int body,
                           EnvBodyPose *pose) {
    const EngineLinks links = engine_links_of(work);
    engine_body_pose(all->model, &links, body, pose->from_base, pose->rotation);
    for (int k = 0; k < 3; k++) {
        pose->position[k] = work->base[k] + pose->from_base[k];
    }
}

/* [m] Upper bound on the depth of any element of a body. */
MILD_HD Real env_body_reach(const EnvsArrays *all, long robot, int body, const EnvBodyPose *pose) {
    return bodies_reach(all->shells.setup, all->shells.setup->feet + body, pose->position,
                        pose->rotation, all->map_origin + 2 * robot, all->contact.height[robot]);
}

/* Bool: a body has an element that may touch soft ground in this step. Before its elements the
 * bound of mild_ground_near is asked. */
WARP_FN int env_body_touches(const EnvsArrays *all, long robot, const EngineWork *work, int body) {
    const BodiesSetup *setup = all->shells.setup;
    const int at = setup->feet + body; /* feet are before it */
    const EngineLinks links = engine_links_of(work);
    EnvBodyPose pose; /* the same in all lanes */
    Real twist[6];
    env_body_pose(all, work, body, &pose);
    engine_body_twist(&all->model->tree, &links, work->rate, body, pose.from_base, twist);
    return env_body_reach(all, robot, body, &pose) >
               bodies_least(setup, setup->sole[at].radius, twist, twist) &&
           bodies_touch(setup, at, pose.position, pose.rotation, twist, all->map_origin + 2 * robot,
                        all->contact.height[robot]);
}

/* Bits of the bodies with an element that may touch soft ground in this step. A lane has a body,
 * and those that are not too far are asked one after the other. */
WARP_FN int env_shells_touch(const EnvsArrays *all, long robot, const EngineWork *work) {
    const int bodies = all->model->tree.bodies;
    const Real far = BODIES_MARGIN + all->shells.setup->dt * (ENV_SHELLS_FAST + BODIES_EXTRA_SPEED);
    Real bit[LANE_COPIES];
    int touch = 0;
    EACH_LANE(l) {
        bit[l] = 0;
        if (LANE(l) < bodies) {
            EnvBodyPose pose;
            env_body_pose(all, work, LANE(l), &pose);
            bit[l] = env_body_reach(all, robot, LANE(l), &pose) > -far ? (Real)(1 << LANE(l)) : 0;
        }
    }
    const int near = (int)lane_sum(bit);
    LANE_ROLLED
    for (int body = 0; near >> body; body++) {
        if (near >> body & 1) {
            touch |= env_body_touches(all, robot, work, body) ? 1 << body : 0;
        }
    }
    return touch;
}

/* Of a robot on rigid ground the bits of the bodies near it, if a point of one touches; else 0. */
WARP_FN int env_floor_touch(const EnvsArrays *all, const EngineGround *ground,
                            const EngineWork *work) {
    const int near = engine_floor_near(all->model, work, ground, all->shells.setup->steepest);
    const EngineLinks links = engine_links_of(work);
    const FloorPose pose = {all->model, &links, work->base, ground, near};
    return near && engine_floor_touches(&pose) ? near : 0;
}

/* Which bodies may touch the ground, after engine_begin. */
WARP_FN void env_shells_near(const EnvsArrays *all, long robot, const EngineGround *ground,
                             const EngineWork *work) {
    const int near =
        all->rigid[robot] ? env_floor_touch(all, ground, work) : env_shells_touch(all, robot, work);
    if (!near) {
        return;
    }
    EACH_LANE(l) {
        if (LANE(l) == 0) {
            all->shells.near[robot] = (uint16_t)near;
        }
    }
    engine_save_links(&all->model->tree, work, &env_shells_at(all, robot)->links);
}

/* ---- the step ---- */

/* Bool: there is something to do for a robot. */
MILD_HD int env_shells_wait(const EnvsArrays *all, long robot) {
    return all->shells.near[robot] || all->shells.held[robot];
}

/* Memory of foot f, in the layout of contact.h. */
MILD_HD BodiesMemory env_foot_memory(const EnvsShells *shells, long robot, int f) {
    const BatchShape *shape = &shells->shape;
    const int all = shape->groups * shape->stride;
    const BatchArrays *ground = &shells->ground;
    return bodies_foot_memory(ground->memory + robot * contact_memory_numbers(all, shape->map),
                              ground->worn ? ground->worn + robot * all : NULL, shape->groups,
                              shape->stride, f);
}

MILD_HD BodiesMemory env_body_memory(const EnvsArrays *all, long robot, int body) {
    const BodiesSole *sole = &all->shells.setup->sole[body];
    return bodies_memory(all->shells.memory + robot * (long)all->shells.numbers + sole->memory,
                         sole->elements, all->shells.ground.worn != NULL);
}

/* Bodies other than those of the bits in `near` forget. */
WARP_FN void env_shells_leave(const EnvsArrays *all, long robot, int near) {
    const BodiesSetup *setup = all->shells.setup;
    LANE_ROLLED
    for (int b = setup->feet; b < setup->bodies; b++) {
        if (!(near >> (b - setup->feet) & 1)) {
            const BodiesMemory memory = env_body_memory(all, robot, b);
            bodies_leave(&memory, bodies_memory_numbers(setup->sole[b].elements,
                                                        all->shells.ground.worn != NULL));
        }
    }
}

/* After part k of a policy step: bodies that cannot touch the ground forget, and in a new episode
 * all do; on rigid ground there is nothing to remember. Bool: env_shells_step is to follow, or
 * env_floor_step. */
WARP_FN int env_shells_follow(const EnvsArrays *all, long robot, int k) {
    const int near = all->shells.near[robot];
    const int rigid = all->rigid[robot];
    if (all->shells.held[robot]) {
        env_shells_leave(all, robot, rigid || (k == 0 && all->reset[robot]) ? 0 : near);
    }
    lanes_sync(); /* all have read what lane 0 writes */
    EACH_LANE(l) {
        if (LANE(l) == 0) {
            all->shells.held[robot] = near != 0 && !rigid;
            if (!near) {
                env_shells_at(all, robot)->load = 0;
            }
        }
    }
    lanes_sync();
    return near != 0;
}

/* Feet, then the bodies of the bits in `near`. */
TEAM_FN void env_shells_list(const EnvsArrays *all, long robot, int near, EnvShellsWork *work) {
    const BodiesSetup *setup = all->shells.setup;
    const int feet = setup->feet;
    EACH_LANE(l) {
        if (TEAM_LANE(l) == 0) {
            BodiesWork *to = &work->ground;
            int count = 0;
            for (int b = 0; b < setup->bodies; b++) {
                if (b < feet || near >> (b - feet) & 1) {
                    to->body[count] = b;
                    to->memory[count] = b < feet ? env_foot_memory(&all->shells, robot, b)
                                                 : env_body_memory(all, robot, b);
                    work->engine.body[count < feet ? 0 : count - feet] = b - feet;
                    count++;
                }
            }
            to->count = count;
            to->label_material = all->material + robot * all->task->labels;
            to->map_origin = all->map_origin + 2 * robot;
            to->height = all->contact.height[robot];
            work->engine.count = count - feet;
        }
    }
    team_sync();
}

/* n numbers of each lane. */
TEAM_FN void env_shells_copy(const Real *from, int count, Real *to) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = TEAM_LANE(l); i < count; i += TEAM) {
            to[i] = from[i];
        }
    }
}

/* What the ground asks of the feet, from env_export. */
TEAM_FN void env_shells_feet(const EnvsArrays *all, long robot, BodiesWork *to) {
    const int feet = all->shells.setup->feet;
    const EnvsContact *at = &all->contact;
    const Real *A = at->inverse_inertia + robot * contact_triangle(6 * feet, 0);
    const int rows = 6 * to->count;
    env_shells_copy(at->position + robot * 3 * feet, 3 * feet, to->position[0]);
    env_shells_copy(at->rotation + robot * 9 * feet, 9 * feet, to->rotation[0]);
    env_shells_copy(at->velocity + robot * 6 * feet, 6 * feet, to->velocity[0]);
    env_shells_copy(at->free_velocity + robot * 6 * feet, 6 * feet, to->free_velocity);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = TEAM_LANE(l); i < 36 * feet * feet; i += TEAM) {
            const int r = i / (6 * feet), c = i % (6 * feet);
            to->inverse_inertia[r * rows + c] =
                A[r > c ? contact_triangle(r, c) : contact_triangle(c, r)];
        }
    }
    team_sync();
}

/* Wrenches of the feet for env_import and of the bodies for engine_end; the measures. */
TEAM_FN void env_shells_results(const EnvsArrays *all, long robot, const EnvShellsWork *work) {
    const int feet = all->shells.setup->feet;
    const BodiesWork *from = &work->ground;
    env_shells_copy(from->wrench, 6 * feet, all->contact.velocity + robot * 6 * feet);
    EACH_LANE(l) {
        if (TEAM_LANE(l) < feet) {
            const ContactFoot *foot = &from->foot[TEAM_LANE(l)];
            MildBatchFoot *to = &all->contact.foot[robot * feet + TEAM_LANE(l)];
            for (int k = 0; k < 3; k++) {
                to->pressure_center[k] = foot->pressure_center[k];
            }
            to->depth_max = foot->depth_max;
            to->depth_mean = foot->depth_mean;
            to->area = foot->area;
        }
        if (TEAM_LANE(l) == TEAM - 1) {
            Real load = 0;
            for (int i = feet; i < from->count; i++) {
                load += from->wrench[6 * i + 2];
            }
            env_shells_at(all, robot)->load = load;
        }
    }
    engine_shells_end(&all->model->tree, &work->engine, from->wrench + 6 * feet,
                      &env_robot_at(all, robot)->saved);
}

/* The step of a robot with bodies near the ground. curves: of bodies_step. */
TEAM_FN void env_shells_step(const EnvsArrays *all, long robot, EnvShellsWork *work, int curves) {
    const int near = all->shells.near[robot];
    const int feet = all->shells.setup->feet;
    BodiesWork *ground = &work->ground;
    env_shells_list(all, robot, near, work);
    env_shells_feet(all, robot, ground);
    const EngineShellsGround bodies = {ground->position + feet, ground->rotation + feet,
                                       ground->velocity + feet, ground->free_velocity + 6 * feet,
                                       ground->inverse_inertia};
    engine_shells_begin(all->model, &env_robot_at(all, robot)->saved,
                        &env_shells_at(all, robot)->links, &work->engine, &bodies);
    bodies_step(all->shells.setup, ground, 1, curves);
    env_shells_results(all, robot, work);
}

#endif
