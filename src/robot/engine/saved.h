/* What engine_end needs of engine_begin's work where something else is done between the two: a
 * quarter of EngineWork, in a GPU's global memory; on a CPU in any. The factor of M is a list of
 * its entries. */
#ifndef MILD_ENGINE_SAVED_H
#define MILD_ENGINE_SAVED_H

#include <stddef.h>

#include "robot/engine/data.h"

/* Numbers of EngineWork before the wrench, which either ground writes anew. */
#define ENGINE_STATE ((int)(offsetof(EngineWork, wrench) / sizeof(Real)))

typedef struct {
    Real factor[ENGINE_ENTRIES]; /* L in the order of EngineTree.entry, its diagonal inverted */
    Real state[offsetof(EngineWork, wrench) / sizeof(Real)];
    Real rows[6 * ENGINE_FEET * ENGINE_CHAIN]; /* soft ground: half, rigid ground: J^T */
    Real foot_link[12 * ENGINE_FEET];          /* rigid ground: pose of the links with soles */
} EngineSaved;

/* Place of number e of the pose of a link: nine of its rotation, three of its position. */
MILD_HD Real *link_pose_number(EngineWork *work, int link, int e) {
    return e < 9 ? work->rotation[link] + e : work->position[link] + (e - 9);
}

/* Number of the first of the acceleration in EngineSaved.state. */
#define ENGINE_ACCELERATION ((int)(offsetof(EngineWork, acceleration) / sizeof(Real)))

/* The acceleration alone, from one call of steps to the next. */
WARP_FN void engine_save_acceleration(const EngineTree *tree, const EngineWork *work,
                                      EngineSaved *saved) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            saved->state[ENGINE_ACCELERATION + d] = work->acceleration[d];
        }
    }
}

WARP_FN void engine_restore_acceleration(const EngineTree *tree, const EngineSaved *saved,
                                         EngineWork *work) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            work->acceleration[d] = saved->state[ENGINE_ACCELERATION + d];
        }
    }
    lanes_sync();
}

/* From work to saved. rigid: bool, on rigid ground. */
WARP_FN void engine_save(const EngineTree *tree, int rigid, EngineWork *work, EngineSaved *saved) {
    EngineSupport *support = &work->now.support;
    const Real *state = (const Real *)(const void *)work;
    const Real *rows = rigid ? support->jacobian[0][0] : support->half[0][0];
    EACH_LANE(l) {
        LANE_ROLLED
        for (int e = LANE(l); e < engine_entries(tree); e += LANES) {
            const EngineEntry entry = tree->entry[e];
            const int d = entry.dof;
            const int diagonal = entry.place == tree->above[d];
            saved->factor[e] = diagonal ? work->inverse[d] : work->factor[d][entry.place];
        }
        LANE_ROLLED
        for (int n = LANE(l); n < ENGINE_STATE; n += LANES) {
            saved->state[n] = state[n];
        }
        LANE_ROLLED
        for (int n = LANE(l); n < 6 * ENGINE_CHAIN * engine_feet(tree); n += LANES) {
            saved->rows[n] = rows[n];
        }
        LANE_ROLLED
        for (int n = LANE(l); rigid && n < 12 * engine_feet(tree); n += LANES) {
            saved->foot_link[n] = *link_pose_number(work, tree->foot_link[n / 12], n % 12);
        }
    }
}

/* And back. */
WARP_FN void engine_restore(const EngineTree *tree, int rigid, const EngineSaved *saved,
                            EngineWork *work) {
    EngineSupport *support = &work->now.support;
    Real *state = (Real *)(void *)work;
    Real *rows = rigid ? support->jacobian[0][0] : support->half[0][0];
    EACH_LANE(l) {
        LANE_ROLLED
        for (int e = LANE(l); e < engine_entries(tree); e += LANES) {
            const EngineEntry entry = tree->entry[e];
            const int d = entry.dof;
            const int diagonal = entry.place == tree->above[d];
            number_bring(saved->factor + e,
                         diagonal ? work->inverse + d : work->factor[d] + entry.place);
        }
        LANE_ROLLED
        for (int n = LANE(l); n < ENGINE_STATE; n += LANES) {
            number_bring(saved->state + n, state + n);
        }
        LANE_ROLLED
        for (int n = LANE(l); n < 6 * ENGINE_CHAIN * engine_feet(tree); n += LANES) {
            number_bring(saved->rows + n, rows + n);
        }
        LANE_ROLLED
        for (int n = LANE(l); rigid && n < 12 * engine_feet(tree); n += LANES) {
            number_bring(saved->foot_link + n,
                         link_pose_number(work, tree->foot_link[n / 12], n % 12));
        }
    }
    lanes_brought();
}

#endif
