/* Bodies beside feet on soft ground: those of shells that stand. They have a part in the ground's
 * step only while they are near the ground, which few robots are at a time. So nothing of this is
 * in EngineWork: it takes what engine_save left, and puts the ground's wrenches there.
 *
 *     engine_begin, then for each body engine_body_pose and engine_body_twist: near the ground?
 *     engine_save and, of a robot with a body near the ground, engine_save_links
 *     engine_shells_begin    pose, twist, V_free and A of these bodies
 *     the ground             wrenches of feet and bodies
 *     engine_shells_end      those of the bodies, where engine_end finds them
 *     engine_restore, engine_end */
#ifndef MILD_ENGINE_SHELLS_H
#define MILD_ENGINE_SHELLS_H

#include "base/hd.h"
#include "robot/engine/feet.h"
#include "robot/engine/saved.h"

/* Poses of the links, of EngineWork. */
typedef struct {
    Real rotation[ENGINE_LINKS][9];
    Real position[ENGINE_LINKS][3];
    Real axis[ENGINE_LINKS][3];
} EngineSavedLinks;

/* Working data. */
typedef struct {
    int count;                                 /* bodies near the ground */
    int body[ENGINE_BODIES];                   /* [count] their numbers */
    Real half[ENGINE_BODIES][ENGINE_CHAIN][6]; /* J^T, then L^-T J^T */
    Real factor[ENGINE_DOFS][ENGINE_STRIDE];   /* as in EngineWork */
    Real inverse[ENGINE_DOFS];
    Real rate[ENGINE_DOFS];      /* [m/s, rad/s] */
    Real half_gain[ENGINE_DOFS]; /* y of engine_half_solve */
} EngineShells;

/* What engine_shells_begin gives of the bodies to the ground, one behind the other; the first of
 * inverse_inertia is that of the feet, [6 (feet + count)][6 (feet + count)]. */
typedef struct {
    Real (*position)[3];   /* [m] world */
    Real (*rotation)[9];   /* [-] body -> world */
    Real (*velocity)[6];   /* [m/s, rad/s] */
    Real *free_velocity;   /* [6 count] */
    Real *inverse_inertia; /* but for the entries of two feet */
} EngineShellsGround;

/* Number of EngineSaved.state at which a member of EngineWork begins. */
#define ENGINE_SAVED(member) ((int)(offsetof(EngineWork, member) / sizeof(Real)))

MILD_HD EngineLinks engine_links_of(const EngineWork *work) {
    const EngineLinks links = {work->rotation, work->position, work->axis};
    return links;
}

MILD_HD EngineLinks engine_links_saved(const EngineSavedLinks *saved) {
    const EngineLinks links = {saved->rotation, saved->position, saved->axis};
    return links;
}

/* Pose of a body. position: [m] from the base. */
MILD_HD void engine_body_pose(const EngineModel *model, const EngineLinks *links, int body,
                              Real *position, Real *rotation) {
    const EngineBody *of = &model->number.body[body];
    const int link = model->tree.body_link[body];
    const Real *R = links->rotation[link];
    turn3(R, of->position, position);
    for (int k = 0; k < 3; k++) {
        position[k] += links->position[link][k];
        for (int c = 0; c < 3; c++) {
            rotation[3 * k + c] = R[3 * k] * of->turn[c] + R[3 * k + 1] * of->turn[3 + c] +
                                  R[3 * k + 2] * of->turn[6 + c];
        }
    }
}

/* Its twist at `position` [m] from the base, under the rates of the degrees of freedom, of which a
 * lane has one. position: the same in all lanes, and so is the twist. */
WARP_FN void engine_body_twist(const EngineTree *tree, const EngineLinks *links, const Real *rate,
                               int body, const Real *position, Real *twist) {
    const int link = tree->body_link[body];
    Real part[6][LANE_COPIES];
    EACH_LANE(l) {
        for (int c = 0; c < 6; c++) {
            part[c][l] = 0;
        }
        LANE_ROLLED
        for (int place = LANE(l); place < engine_row_length(tree, link); place += LANES) {
            const Real speed = rate[tree->row_dof[link][place]];
            Real column[6];
            link_column(tree, links, link, position, place, column);
            for (int c = 0; c < 6; c++) {
                part[c][l] += column[c] * speed;
            }
        }
    }
    for (int c = 0; c < 6; c++) {
        twist[c] = lane_sum(part[c]);
    }
}

WARP_FN void links_copy(const Real *from, int count, Real *to) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < count; n += LANES) {
            to[n] = from[n];
        }
    }
}

WARP_FN void engine_save_links(const EngineTree *tree, const EngineWork *work,
                               EngineSavedLinks *saved) {
    const int links = engine_links(tree);
    links_copy(work->rotation[0], 9 * links, saved->rotation[0]);
    links_copy(work->position[0], 3 * links, saved->position[0]);
    links_copy(work->axis[0], 3 * links, saved->axis[0]);
    lanes_sync();
}

/* And back. */
WARP_FN void engine_restore_links(const EngineTree *tree, const EngineSavedLinks *saved,
                                  EngineWork *work) {
    const int links = engine_links(tree);
    links_copy(saved->rotation[0], 9 * links, work->rotation[0]);
    links_copy(saved->position[0], 3 * links, work->position[0]);
    links_copy(saved->axis[0], 3 * links, work->axis[0]);
    lanes_sync();
}

/* The factor from its list, rates and y. */
TEAM_FN void shells_factor(const EngineTree *tree, const EngineSaved *saved, EngineShells *shells) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int d = TEAM_LANE(l); d < engine_dofs(tree); d += TEAM) {
            shells->rate[d] = saved->state[ENGINE_SAVED(rate) + d];
            shells->half_gain[d] = saved->state[ENGINE_ACCELERATION + d];
        }
        LANE_ROLLED
        for (int e = TEAM_LANE(l); e < engine_entries(tree); e += TEAM) {
            const EngineEntry entry = tree->entry[e];
            if (entry.place == tree->above[entry.dof]) {
                shells->inverse[entry.dof] = saved->factor[e];
            } else {
                shells->factor[entry.dof][entry.place] = saved->factor[e];
            }
        }
    }
}

/* Poses and J. */
TEAM_FN void shells_pose(const EngineModel *model, const EngineSaved *saved,
                         const EngineLinks *links, EngineShells *shells,
                         const EngineShellsGround *ground) {
    const EngineTree *tree = &model->tree;
    const int chain = engine_chain(tree);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = TEAM_LANE(l); i < shells->count; i += TEAM) {
            engine_body_pose(model, links, shells->body[i], ground->position[i],
                             ground->rotation[i]);
        }
    }
    team_sync();
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = TEAM_LANE(l); n < chain * shells->count; n += TEAM) {
            const int i = n / chain;
            const int link = tree->body_link[shells->body[i]];
            if (n % chain < engine_row_length(tree, link)) {
                link_column(tree, links, link, ground->position[i], n % chain,
                            shells->half[i][n % chain]);
            }
        }
    }
    team_sync();
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = TEAM_LANE(l); n < 3 * shells->count; n += TEAM) {
            ground->position[n / 3][n % 3] += saved->state[ENGINE_SAVED(base) + n % 3];
        }
    }
    team_sync();
}

/* Twists, half <- L^-T J^T in place, and V_free: engine_half_solve. */
TEAM_FN void shells_half(const EngineModel *model, EngineShells *shells,
                         const EngineShellsGround *ground) {
    const EngineTree *tree = &model->tree;
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = TEAM_LANE(l); n < 6 * shells->count; n += TEAM) {
            const int i = n / 6;
            const int c = n % 6;
            const int link = tree->body_link[shells->body[i]];
            const EngineIndex *dof = tree->row_dof[link];
            Real *x = shells->half[i][0] + c;
            Real speed = 0;
            Real gain = 0;
            for (int k = engine_row_length(tree, link) - 1; k >= 0; k--) {
                speed += x[6 * k] * shells->rate[dof[k]];
            }
            LANE_ROLLED
            for (int k = engine_row_length(tree, link) - 1; k >= 0; k--) {
                const int d = dof[k];
                const Real solved = x[6 * k] * shells->inverse[d];
                x[6 * k] = solved;
                gain += solved * shells->half_gain[d];
                for (int place = 0; place < k; place++) {
                    x[6 * place] -= shells->factor[d][place] * solved;
                }
            }
            ground->velocity[i][c] = speed;
            ground->free_velocity[n] = speed + model->number.dt * gain;
        }
    }
    team_sync();
}

/* Rows and columns of A with a body. */
TEAM_FN void shells_inertia(const EngineTree *tree, const EngineSaved *saved,
                            const EngineShells *shells, const EngineShellsGround *ground) {
    const int feet = engine_feet(tree);
    const int rows = 6 * (feet + shells->count);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = TEAM_LANE(l); n < 6 * shells->count * rows; n += TEAM) {
            const int i = n / rows / 6;
            const int j = n % rows / 6;
            const int other = j < feet ? j : feet + shells->body[j - feet];
            const Real *left = shells->half[i][0] + n / rows % 6;
            const Real *right =
                j < feet ? saved->rows + 6 * ENGINE_CHAIN * j : shells->half[j - feet][0];
            Real sum = 0;
            right += n % rows % 6;
            for (int k = 0; k < tree->body_shared[shells->body[i]][other]; k++) {
                sum += left[6 * k] * right[6 * k];
            }
            ground->inverse_inertia[(6 * feet + n / rows) * rows + n % rows] = sum;
            if (j < feet) {
                ground->inverse_inertia[n % rows * rows + 6 * feet + n / rows] = sum;
            }
        }
    }
    team_sync();
}

/* What the ground asks of the bodies in shells->body. */
TEAM_FN void engine_shells_begin(const EngineModel *model, const EngineSaved *saved,
                                 const EngineSavedLinks *poses, EngineShells *shells,
                                 const EngineShellsGround *ground) {
    const EngineLinks links = engine_links_saved(poses);
    shells_factor(&model->tree, saved, shells);
    shells_pose(model, saved, &links, shells, ground);
    shells_half(model, shells, ground);
    shells_inertia(&model->tree, saved, shells, ground);
}

/* y += L^-T J^T wrench of the bodies. wrench: [6 count] [N, N m]. */
TEAM_FN void engine_shells_end(const EngineTree *tree, const EngineShells *shells,
                               const Real *wrench, EngineSaved *saved) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int d = TEAM_LANE(l); d < engine_dofs(tree); d += TEAM) {
            Real sum = 0;
            LANE_ROLLED
            for (int i = 0; i < shells->count; i++) {
                if (link_moves(tree, tree->body_link[shells->body[i]], d)) {
                    const Real *row = shells->half[i][tree->above[d]];
                    sum += dot3(row, wrench + 6 * i) + dot3(row + 3, wrench + 6 * i + 3);
                }
            }
            saved->state[ENGINE_ACCELERATION + d] += sum;
        }
    }
    team_sync();
}

#endif
