/* Shells on rigid ground: points of bodies beside the feet, as rows of the constraints that
 * constraint.h solves. A box touches with its corners, a capsule with the spheres at its ends, a
 * sphere with itself. Few robots have a shell down at a time, so nothing of this is in EngineWork:
 * it takes what engine_save left, and leaves qacc there.
 *
 *     engine_begin, engine_save and, of a robot with a shell near the ground, engine_save_links
 *     engine_restore, engine_collide_on     as without shells
 *     engine_floor_collide                  the points that touch
 *     engine_floor_solve                    qacc, and the wrenches of feet and bodies
 *     engine_integrate */
#ifndef MILD_ENGINE_FLOOR_H
#define MILD_ENGINE_FLOOR_H

#include "base/hd.h"
#include "robot/engine/measure.h"
#include "robot/engine/rows.h"
#include "robot/engine/shells.h"

/* Working data. */
typedef struct EngineFloor {
    int count;                                     /* bodies near the ground */
    int body[ENGINE_BODIES];                       /* [count] their numbers */
    Real position[ENGINE_BODIES][3];               /* [m] from the base */
    Real jacobian[ENGINE_BODIES][ENGINE_CHAIN][6]; /* J^T by place */
    Real half[ENGINE_BODIES][ENGINE_CHAIN][6];     /* stiffness J^T */
    Real stiffness[ENGINE_BODIES][ENGINE_BASE_ENTRIES];
    Real twist[ENGINE_BODIES][6];        /* J qvel, then J qacc */
    Real twist_change[ENGINE_BODIES][6]; /* J times the change of qacc */
    Real wrench[ENGINE_BODIES][6];       /* [N, N m] of the ground, about the body's origin */
    int points;                          /* that touch */
    EngineIndex of[ROBOT_FLOOR_POINTS];  /* number of a point's body in `body` */
    /* Four edges of each point, as in EngineContact. */
    Real edge[4 * ROBOT_FLOOR_POINTS][6];
    Real reference[4 * ROBOT_FLOOR_POINTS];
    Real weight[4 * ROBOT_FLOOR_POINTS];
    Real residual[4 * ROBOT_FLOOR_POINTS];
} EngineFloor;

MILD_HD int floor_link(const EngineTree *tree, const EngineFloor *floor, int i) {
    return tree->body_link[floor->body[i]];
}

/* J x of the bodies. */
WARP_FN void floor_twists(const EngineTree *tree, const EngineFloor *floor, const Real *x,
                          Real (*twist)[6]) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < 6 * floor->count; n += LANES) {
            const int link = floor_link(tree, floor, n / 6);
            Real sum = 0;
            LANE_ROLLED
            for (int place = 0; place < engine_row_length(tree, link); place++) {
                sum += floor->jacobian[n / 6][place][n % 6] * x[tree->row_dof[link][place]];
            }
            twist[n / 6][n % 6] = sum;
        }
    }
    lanes_sync();
}

/* ---- which points touch ---- */

/* Centre of point c of a shell, [m] from the base. Bool: it has such a point. */
MILD_HD int floor_point(const EngineModel *model, const EngineLinks *links, int s, int c,
                        Real *center) {
    const EngineShell *shell = &model->number.shell[s];
    const int link = model->tree.shell_link[s];
    Real at[3] = {shell->center[0], shell->center[1], shell->center[2]};
    for (int k = 0; k < 3; k++) {
        const int other = c >> k & 1;
        if (other && !(shell->half[k] > 0)) {
            return 0;
        }
        for (int r = 0; r < 3; r++) {
            at[r] += (other ? -shell->half[k] : shell->half[k]) * shell->rotation[3 * r + k];
        }
    }
    turn3(links->rotation[link], at, center);
    for (int k = 0; k < 3; k++) {
        center[k] += links->position[link][k];
    }
    return 1;
}

/* Where a robot is: poses of its links, its base [m], and the ground. */
typedef struct {
    const EngineModel *model;
    const EngineLinks *links;
    const Real *base;
    const EngineGround *ground;
    int near; /* bits of the bodies that are asked */
} FloorPose;

/* Bool: point n of all shells touches; then its centre [m] from the base, and the ground there. */
MILD_HD int floor_touches(const FloorPose *at, int n, Real *center, EngineSurface *surface) {
    const EngineTree *tree = &at->model->tree;
    const int s = n / ROBOT_SHELL_CORNERS;
    if (s >= tree->shells || !(at->near >> tree->shell_body[s] & 1) ||
        !floor_point(at->model, at->links, s, n % ROBOT_SHELL_CORNERS, center)) {
        return 0;
    }
    const MapSpot spot = base_spot(at->ground, at->base);
    *surface = surface_under(at->ground, at->base, &spot, center[0], center[1]);
    const Real *slope = surface->slope;
    const Real scale = REAL_INVERSE_SQRT(1 + slope[0] * slope[0] + slope[1] * slope[1]);
    return (center[2] + at->base[2] - surface->height) * scale < at->model->number.shell[s].radius;
}

/* Bool: a point touches. */
WARP_FN int engine_floor_touches(const FloorPose *at) {
    Real touching[LANE_COPIES];
    EACH_LANE(l) {
        touching[l] = 0;
        LANE_ROLLED
        for (int n = LANE(l); n < ROBOT_SHELL_CORNERS * at->model->tree.shells; n += LANES) {
            Real center[3];
            EngineSurface surface;
            touching[l] += (Real)floor_touches(at, n, center, &surface);
        }
    }
    return lane_sum(touching) > 0;
}

/* Bool: the lowest point of a shell may be in the ground. Exact where it is level; steepest: [-] of
 * a map. */
MILD_HD int floor_shell_near(const EngineModel *model, const EngineWork *work,
                             const EngineGround *ground, Real steepest, int s) {
    const EngineShell *shell = &model->number.shell[s];
    const MapSpot spot = engine_spot(ground, work);
    Real under[2];
    const Real low = shell_lowest(model, work, s, under);
    const Real height = engine_surface(ground, work, &spot, under[0], under[1]).height;
    const Real reach = shell->half[0] + shell->half[1] + shell->half[2] + shell->radius;
    return low < height + (ground->map ? steepest * reach : 0);
}

/* Bits of the bodies with such a shell, after engine_kinematics. */
WARP_FN int engine_floor_near(const EngineModel *model, const EngineWork *work,
                              const EngineGround *ground, Real steepest) {
    Real bit[LANE_COPIES];
    EACH_LANE(l) {
        int near = 0;
        LANE_ROLLED
        for (int s = 0; s < model->tree.shells && LANE(l) < model->tree.bodies; s++) {
            near |= model->tree.shell_body[s] == LANE(l) &&
                    floor_shell_near(model, work, ground, steepest, s);
        }
        bit[l] = near ? (Real)(1 << LANE(l)) : 0;
    }
    return (int)lane_sum(bit);
}

/* ---- their rows ---- */

/* Bodies, their J and twists. */
WARP_FN void floor_bodies(const FloorPose *at, const EngineWork *work, EngineFloor *floor) {
    const EngineTree *tree = &at->model->tree;
    const int chain = engine_chain(tree);
    EACH_LANE(l) {
        if (LANE(l) == 0) {
            floor->points = floor->count = 0;
            for (int b = 0; b < tree->bodies; b++) {
                if (at->near >> b & 1) {
                    floor->body[floor->count++] = b;
                }
            }
        }
    }
    lanes_sync();
    EACH_LANE(l) {
        Real rotation[9];
        if (LANE(l) < floor->count) {
            engine_body_pose(at->model, at->links, floor->body[LANE(l)], floor->position[LANE(l)],
                             rotation);
        }
    }
    lanes_sync();
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < chain * floor->count; n += LANES) {
            const int i = n / chain;
            const int link = floor_link(tree, floor, i);
            if (n % chain < engine_row_length(tree, link)) {
                link_column(tree, at->links, link, floor->position[i], n % chain,
                            floor->jacobian[i][n % chain]);
            }
        }
    }
    lanes_sync();
    floor_twists(tree, floor, work->rate, floor->twist);
}

/* The rows of a point that touches, number p of them. */
MILD_HD void floor_edges(const FloorPose *at, EngineRigid rigid, int n, int p, const Real *center,
                         const EngineSurface *surface, EngineFloor *floor) {
    const EngineSoft soft = corner_soft(at->model, rigid);
    const int s = n / ROBOT_SHELL_CORNERS;
    const int body = at->model->tree.shell_body[s];
    const EngineSphere sphere = {at->model->number.shell[s].radius,
                                 at->model->number.body[body].inverse_inertia};
    const EngineEdges edges = {floor->edge + 4 * p, floor->reference + 4 * p,
                               floor->weight + 4 * p};
    int i = 0;
    while (floor->body[i] != body) {
        i++;
    }
    floor->of[p] = (EngineIndex)i;
    sphere_edges(&soft, rigid.friction, surface, at->base[2], &sphere, center, floor->position[i],
                 floor->twist[i], &edges);
}

/* The bodies of the bits in `near`, and their points that touch: the first ROBOT_FLOOR_POINTS.
 * After engine_restore, with the poses of the links. */
WARP_FN void engine_floor_collide(const FloorPose *at, EngineRigid rigid, const EngineWork *work,
                                  EngineFloor *floor) {
    const int all = ROBOT_SHELL_CORNERS * at->model->tree.shells;
    int points = 0;
    floor_bodies(at, work, floor);
    LANE_ROLLED
    for (int first = 0; first < all; first += LANES) {
        int flag[LANE_COPIES];
        int rank[LANE_COPIES];
        Real center[LANE_COPIES][3];
        EngineSurface surface[LANE_COPIES];
        EACH_LANE(l) {
            flag[l] = floor_touches(at, first + LANE(l), center[l], &surface[l]);
        }
        const int count = lanes_rank(flag, rank);
        EACH_LANE(l) {
            if (flag[l] && points + rank[l] < ROBOT_FLOOR_POINTS) {
                floor_edges(at, rigid, first + LANE(l), points + rank[l], center[l], &surface[l],
                            floor);
            }
        }
        points = points + count < ROBOT_FLOOR_POINTS ? points + count : ROBOT_FLOOR_POINTS;
    }
    EACH_LANE(l) {
        if (LANE(l) == 0) {
            floor->points = points;
        }
    }
    lanes_sync();
}

/* ---- in Newton's steps of constraint.h ---- */

/* x of the edges at the acceleration. */
WARP_FN void floor_residuals(const EngineTree *tree, const Real *acceleration, EngineFloor *floor) {
    floor_twists(tree, floor, acceleration, floor->twist);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int row = LANE(l); row < 4 * floor->points; row += LANES) {
            floor->residual[row] = edge_along(floor->edge[row], floor->twist[floor->of[row / 4]]) -
                                   floor->reference[row];
        }
    }
    lanes_sync();
}

/* Number n of the sums over a body's pushing edges: see engine_push_number. */
MILD_HD void floor_push_number(const EngineTree *tree, EngineFloor *floor, int i, int n) {
    const int r = n < 6 ? n : tree->entry[n - 6].dof;
    const int c = n < 6 ? 0 : tree->entry[n - 6].place;
    Real sum = 0;
    LANE_ROLLED
    for (int row = 0; row < 4 * floor->points; row++) {
        if (floor->of[row / 4] == i && floor->residual[row] < 0) {
            const Real value = n < 6 ? floor->residual[row] : floor->edge[row][c];
            sum += floor->weight[row] * floor->edge[row][r] * value;
        }
    }
    if (n < 6) {
        floor->wrench[i][r] = -sum;
    } else {
        floor->stiffness[i][n - 6] = sum;
    }
}

/* Wrenches of the bodies and, if it is wanted, their stiffness and `half`. */
WARP_FN void floor_push(const EngineTree *tree, int stiffness, EngineFloor *floor) {
    const int numbers = stiffness ? 6 + ENGINE_BASE_ENTRIES : 6;
    const int chain = engine_chain(tree);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < floor->count * numbers; n += LANES) {
            floor_push_number(tree, floor, n / numbers, n % numbers);
        }
    }
    lanes_sync();
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); stiffness && n < 6 * chain * floor->count; n += LANES) {
            const int i = n / 6 / chain;
            const int place = n / 6 % chain;
            if (place < engine_row_length(tree, floor_link(tree, floor, i))) {
                floor->half[i][place][n % 6] =
                    stiffness_times(floor->stiffness[i], n % 6, floor->jacobian[i][place]);
            }
        }
    }
    lanes_sync();
}

/* Entry of J^T stiffness J of the bodies that move with degree of freedom d. */
MILD_HD Real floor_entry(const EngineTree *tree, const EngineFloor *floor, int d, int place) {
    Real sum = 0;
    LANE_ROLLED
    for (int i = 0; i < floor->count; i++) {
        if (link_moves(tree, floor_link(tree, floor, i), d)) {
            const Real *row = floor->half[i][tree->above[d]];
            const Real *column = floor->jacobian[i][place];
            sum += dot3(row, column) + dot3(row + 3, column + 3);
        }
    }
    return sum;
}

/* Degree of freedom d of J^T wrench. */
MILD_HD Real floor_along(const EngineTree *tree, const EngineFloor *floor, int d) {
    Real sum = 0;
    LANE_ROLLED
    for (int i = 0; i < floor->count; i++) {
        if (link_moves(tree, floor_link(tree, floor, i), d)) {
            const Real *row = floor->jacobian[i][tree->above[d]];
            sum += dot3(row, floor->wrench[i]) + dot3(row + 3, floor->wrench[i] + 3);
        }
    }
    return sum;
}

/* A lane's part of a point of the line. */
MILD_HD void floor_line(const EngineFloor *floor, int lane, Real t, LinePoint *sum) {
    LANE_ROLLED
    for (int row = lane; row < 4 * floor->points; row += LANES) {
        const Real *change = floor->twist_change[floor->of[row / 4]];
        line_row(sum, floor->weight[row], floor->residual[row],
                 edge_along(floor->edge[row], change), t);
    }
}

#endif
