/* mild_batch_step where bodies have shells: its parts for one robot. Few robots have a shell
 * near the ground at a time, so
 *
 *     bodies_find   a warp: which shells may touch the ground in this step
 *     contact.inc   where none does: the feet, as without shells; it leaves the others alone
 *     bodies_rest   a warp, then: the twists of the shells
 *     bodies_solve  a team, where one does: feet and these shells at once */
#ifndef MILD_BATCH_BODIES_ROBOT_H
#define MILD_BATCH_BODIES_ROBOT_H

#include "ground/batch/batch.h"
#define BODIES_NEAR MILD_BATCH_FEET_MAX
#include "ground/batch/bodies.h"

/* A step of all robots. Arrays on the device. */
typedef struct BodiesCall {
    BatchShape shape;
    BatchArrays arrays;
    BatchBodies bodies;
    MildBatchInput input;
    MildBatchOutput output;
    int advance; /* bool, of mild_batch_step */
    int curves;  /* of bodies_step */
} BodiesCall;

/* Memory of sole b. */
MILD_HD BodiesMemory bodies_memory_at(const BodiesCall *call, long robot, int b) {
    const BatchShape *shape = &call->shape;
    const BodiesSole *sole = &call->bodies.setup->sole[b];
    if (sole->face) {
        return bodies_memory(call->bodies.memory + robot * (long)call->bodies.numbers +
                                 sole->memory,
                             sole->elements, 1);
    }
    const int all = shape->groups * shape->stride;
    return bodies_foot_memory(call->arrays.memory + robot * contact_memory_numbers(all, shape->map),
                              call->arrays.worn ? call->arrays.worn + robot * all : NULL,
                              shape->groups, shape->stride, b);
}

/* Where the map begins under a robot; NULL: at 0. */
MILD_HD const Real *bodies_map_origin(const BodiesCall *call, long robot) {
    return call->input.map_origin ? call->input.map_origin + 2 * robot : NULL;
}

/* Bool: shell b may touch the ground in this step, or its pose and motion are no numbers, which
 * bodies_step reports. An element is asked for at the twist now and at that without ground. */
WARP_FN int bodies_is_near(const BodiesCall *call, long robot, int b) {
    const BodiesSetup *setup = call->bodies.setup;
    const MildBatchInput *in = &call->input;
    const long at = robot * setup->bodies + b;
    const Real *position = in->position + 3 * at;
    const Real *R = in->rotation + 9 * at;
    const Real *V = in->velocity + 6 * at;
    const Real *free = in->free_velocity + 6 * at;
    const Real *origin = bodies_map_origin(call, robot);
    const Real height = in->height ? in->height[robot] : 0;
    const Real least = bodies_least(setup, setup->sole[b].radius, V, free);
    Real blank = 0;
    for (int k = 0; k < 9; k++) {
        blank += contact_blank(position, R, V, free, k);
    }
    if (!(blank == 0)) {
        return 1;
    }
    return bodies_reach(setup, b, position, R, origin, height) > least &&
           (bodies_touch(setup, b, position, R, V, origin, height) ||
            bodies_touch(setup, b, position, R, free, origin, height));
}

/* Shells that are not near forget. */
WARP_FN void bodies_find(const BodiesCall *call, long robot) {
    const BodiesSetup *setup = call->bodies.setup;
    int near = 0;
    LANE_ROLLED
    for (int b = setup->feet; b < setup->bodies; b++) {
        if (bodies_is_near(call, robot, b)) {
            near |= 1 << (b - setup->feet);
        } else if (call->advance) {
            const BodiesMemory memory = bodies_memory_at(call, robot, b);
            bodies_leave(&memory, bodies_memory_numbers(setup->sole[b].elements, 1));
        }
    }
    EACH_LANE(l) {
        if (LANE(l) == 0) {
            call->bodies.near[robot] = (uint16_t)near;
        }
    }
}

MILD_HD void bodies_no_foot(MildBatchFoot *foot) {
    const MildBatchFoot none = {{0, 0, 0}, 0, 0, 0};
    *foot = none;
}

/* What contact.inc has not written of a robot without a shell near the ground. */
WARP_FN void bodies_rest(const BodiesCall *call, long robot) {
    const int feet = call->shape.feet;
    const int soles = call->shape.soles;
    const MildBatchOutput *out = &call->output;
    const Real *A = call->input.inverse_inertia + robot * 36 * soles * soles;
    const Real *free = call->input.free_velocity + robot * 6 * soles;
    Real *wrench = out->wrench + robot * 6 * soles;
    Real *velocity = out->velocity + robot * 6 * soles;
    EACH_LANE(l) {
        LANE_ROLLED
        for (int r = 6 * feet + LANE(l); r < 6 * soles; r += LANES) {
            Real moved = 0;
            for (int c = 0; c < 6 * feet; c++) {
                moved += A[r * 6 * soles + c] * wrench[c];
            }
            velocity[r] = free[r] + call->shape.dt * moved;
            wrench[r] = 0;
        }
        if (out->foot && LANE(l) >= feet && LANE(l) < soles) {
            bodies_no_foot(&out->foot[robot * soles + LANE(l)]);
        }
        if (LANE(l) == 0 && feet == 0 && out->residual) {
            out->residual[robot] = 0;
        }
        if (LANE(l) == 0 && feet == 0 && out->iterations) {
            out->iterations[robot] = 0;
        }
    }
}

/* Feet, then the shells near the ground. */
TEAM_FN void bodies_gather(const BodiesCall *call, long robot, BodiesWork *work) {
    const BodiesSetup *setup = call->bodies.setup;
    const MildBatchInput *in = &call->input;
    const int near = call->bodies.near[robot];
    EACH_LANE(l) {
        if (TEAM_LANE(l) == 0) {
            int count = 0;
            for (int b = 0; b < setup->bodies; b++) {
                if (b < setup->feet || near >> (b - setup->feet) & 1) {
                    work->body[count] = b;
                    work->memory[count++] = bodies_memory_at(call, robot, b);
                }
            }
            const int labels = setup->has_map ? setup->map.labels : 1;
            work->count = count;
            work->label_material = in->material ? in->material + robot * labels : NULL;
            work->map_origin = bodies_map_origin(call, robot);
            work->height = in->height ? in->height[robot] : 0;
        }
    }
    team_sync();
    const int soles = setup->bodies;
    const int rows = 6 * work->count;
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = TEAM_LANE(l); i < 9 * work->count; i += TEAM) {
            const long at = robot * soles + work->body[i / 9];
            work->rotation[i / 9][i % 9] = in->rotation[9 * at + i % 9];
            if (i % 9 < 3) {
                work->position[i / 9][i % 9] = in->position[3 * at + i % 9];
            }
            if (i % 9 < 6) {
                work->velocity[i / 9][i % 9] = in->velocity[6 * at + i % 9];
                work->free_velocity[6 * (i / 9) + i % 9] = in->free_velocity[6 * at + i % 9];
            }
        }
        LANE_ROLLED
        for (int i = TEAM_LANE(l); i < rows * rows; i += TEAM) {
            const int r = i / rows, c = i % rows;
            const int from = (6 * work->body[r / 6] + r % 6) * 6 * soles;
            work->inverse_inertia[i] = in->inverse_inertia[robot * 36 * soles * soles + from +
                                                           6 * work->body[c / 6] + c % 6];
        }
    }
    team_sync();
}

/* The place of sole b in the work; -1: none. */
MILD_HD int bodies_place(const BodiesWork *work, int b) {
    for (int i = 0; i < work->count; i++) {
        if (work->body[i] == b) {
            return i;
        }
    }
    return -1;
}

/* What component r of a twist gains by the impulses on the soles in the work. A: row r. */
MILD_HD Real bodies_gain(const BodiesWork *work, const Real *A) {
    Real sum = 0;
    for (int i = 0; i < work->count; i++) {
        for (int k = 0; k < 6; k++) {
            sum += A[6 * work->body[i] + k] * work->best.wrench[6 * i + k];
        }
    }
    return sum;
}

TEAM_FN void bodies_results(const BodiesCall *call, long robot, const BodiesWork *work) {
    const int soles = call->shape.soles;
    const MildBatchOutput *out = &call->output;
    const Real *A = call->input.inverse_inertia + robot * 36 * soles * soles;
    EACH_LANE(l) {
        LANE_ROLLED
        for (int r = TEAM_LANE(l); r < 6 * soles; r += TEAM) {
            const long at = robot * 6 * soles + r;
            const int i = bodies_place(work, r / 6);
            out->velocity[at] =
                i < 0 ? call->input.free_velocity[at] + bodies_gain(work, A + r * 6 * soles)
                      : work->next.twist[6 * i + r % 6];
            out->wrench[at] = i < 0 ? 0 : work->wrench[6 * i + r % 6];
        }
        if (out->foot && TEAM_LANE(l) < soles) {
            MildBatchFoot *to = &out->foot[robot * soles + TEAM_LANE(l)];
            const int i = bodies_place(work, TEAM_LANE(l));
            bodies_no_foot(to);
            if (i >= 0) {
                const ContactFoot *foot = &work->foot[i];
                for (int k = 0; k < 3; k++) {
                    to->pressure_center[k] = foot->pressure_center[k];
                }
                to->depth_max = foot->depth_max;
                to->depth_mean = foot->depth_mean;
                to->area = foot->area;
            }
        }
        if (TEAM_LANE(l) == 0 && out->residual) {
            out->residual[robot] = work->residual;
        }
        if (TEAM_LANE(l) == 0 && out->iterations) {
            out->iterations[robot] = work->iterations;
        }
    }
}

/* curves: of bodies_step; a constant. */
TEAM_FN void bodies_solve(const BodiesCall *call, long robot, BodiesWork *work, int curves) {
    bodies_gather(call, robot, work);
    bodies_step(call->bodies.setup, work, call->advance, curves);
    bodies_results(call, robot, work);
}

#endif
