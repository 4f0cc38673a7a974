/* Joint limits and rigid ground as MuJoCo computes them (its manual, Computation, Constraint
 * model): soft constraints of a convex problem with one answer,
 *
 *     minimise over a   (a - a0)^T M (a - a0)/2 + sum over the rows of weight min(0, x)^2/2,
 *     x = J a - a_reference
 *
 * where a0 is the acceleration without them. A row is a joint beyond its limit, or one of the four
 * edges of the friction pyramid of a corner that touches. A row with x < 0 pushes. While the same
 * rows push the problem is quadratic, so Newton's method with an exact line search ends at the
 * answer after finitely many steps. Its matrix M + J^T weight J is as sparse as M, because all rows
 * of a foot go through the foot's twist. */
#ifndef MILD_ENGINE_CONSTRAINT_H
#define MILD_ENGINE_CONSTRAINT_H

#include "robot/engine/feet.h"
#include "robot/engine/floor.h"
#include "robot/engine/ground.h"
#include "robot/engine/rows.h"

#define CONSTRAINT_STEPS 30      /* of Newton's method; walks take 1 to 5 */
#define CONSTRAINT_LINE_STEPS 10 /* of the line search */

/* ---- the rows ---- */

/* The limit of link i, which is beyond it by `violation` < 0 on a side. */
MILD_HD void limit_row(const EngineLink *link, EngineWork *work, int i, Real side, Real violation) {
    const Real d = soft_impedance(&link->limit, violation);
    const Real regularizer = (1 - d) / d * link->inverse_inertia;
    work->limit_reference[i] =
        -link->limit.damping * side * work->rate[5 + i] - link->limit.stiffness * d * violation;
    work->limit_weight[i] = 1 / real_max(regularizer, REGULARIZER_LEAST);
}

/* Limits that are reached. Returns whether there are any. */
WARP_FN int engine_limits_make(const EngineModel *model, EngineWork *work) {
    Real any[LANE_COPIES];
    EACH_LANE(l) {
        any[l] = 0;
        LANE_ROLLED
        for (int i = 1 + LANE(l); i < engine_links(&model->tree); i += LANES) {
            const EngineLink *link = &model->number.link[i];
            const Real below = work->angle[i] - link->low - link->margin;
            const Real above = link->high - work->angle[i] - link->margin;
            const Real side = below < 0 ? REAL(1) : above < 0 ? REAL(-1) : 0;
            work->limit_side[i] = side;
            if (side != 0) {
                limit_row(link, work, i, side, real_min(below, above));
                any[l] = 1;
            }
        }
    }
    lanes_sync();
    return lane_max(any) > 0;
}

/* x of the limit of link i. */
MILD_HD Real limit_residual(const EngineWork *work, int i) {
    return work->limit_side[i] * work->acceleration[5 + i] - work->limit_reference[i];
}

MILD_HD int limit_pushes(const EngineWork *work, int i) {
    return work->limit_side[i] != 0 && limit_residual(work, i) < 0;
}

/* ---- limits that push while soft ground does ---- */

/* Limits that are taken to push through the step: those that do at the last step's acceleration,
 * which is exact while a limit bears a load. While a limit pushes its force is linear in the
 * acceleration, so
 *
 *     M a = f + J^T W + sum of s e_i (r - s a_i)/R   <=>   N a = f' + J^T W,
 *     N = M + sum of e_i e_i^T/R,   f' = f + sum of s r e_i/R,
 *
 * with the side s, reference r and weight 1/R of a row, and the ground that is solved with N and f'
 * agrees with the limits. none: bool, hold none. Before the forces. */
WARP_FN void engine_limits_predict(const EngineModel *model, EngineWork *work, int none) {
    const int links = engine_links(&model->tree);
    const int beyond = engine_limits_make(model, work);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n * ENGINE_HELD_BITS < links; n += LANES) {
            unsigned bits = n == 0 && beyond;
            LANE_ROLLED
            for (int b = n == 0; beyond && !none && b < ENGINE_HELD_BITS; b++) {
                const int i = n * ENGINE_HELD_BITS + b;
                bits |= (unsigned)(i < links && limit_pushes(work, i)) << b;
            }
            work->held[n] = (Real)bits;
        }
    }
    lanes_sync();
}

/* bool: the limit of link i is held; of link 0: some joint is beyond its limit. */
MILD_HD int limit_held(const EngineWork *work, int i) {
    return (int)((unsigned)work->held[i / ENGINE_HELD_BITS] >> i % ENGINE_HELD_BITS & 1);
}

/* M <- N and f <- f'. */
WARP_FN void engine_limits_hold(const EngineTree *tree, EngineWork *work) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = 1 + LANE(l); i < engine_links(tree); i += LANES) {
            const int d = 5 + i;
            if (limit_held(work, i)) {
                work->mass[d][tree->above[d]] += work->limit_weight[i];
                work->acceleration[d] +=
                    work->limit_side[i] * work->limit_weight[i] * work->limit_reference[i];
            }
        }
    }
    lanes_sync();
}

/* bool: the limits that push at the acceleration are those held. */
WARP_FN int engine_held_push(const EngineTree *tree, const EngineWork *work) {
    Real others[LANE_COPIES];
    EACH_LANE(l) {
        others[l] = 0;
        LANE_ROLLED
        for (int i = 1 + LANE(l); i < engine_links(tree); i += LANES) {
            others[l] = limit_pushes(work, i) == limit_held(work, i) ? others[l] : 1;
        }
    }
    return lane_max(others) == 0;
}

/* ---- rigid ground ---- */

/* [m] Centre of a corner from the base's origin, world axes. */
MILD_HD void corner_center(const EngineModel *model, const EngineWork *work, int corner,
                           Real *center) {
    const int link = model->tree.foot_link[model->tree.corner_foot[corner]];
    turn3(work->rotation[link], model->number.corner[corner], center);
    for (int k = 0; k < 3; k++) {
        center[k] += work->position[link][k];
    }
}

/* [m] Of a foot's reference point from the base's origin, world axes. */
MILD_HD void foot_point(const EngineModel *model, const EngineWork *work, int foot, Real *point) {
    const int link = model->tree.foot_link[foot];
    turn3(work->rotation[link], model->number.foot[foot].reference, point);
    for (int k = 0; k < 3; k++) {
        point[k] += work->position[link][k];
    }
    point[2] -= model->number.foot[foot].radius;
}

/* The four edges of a corner's pyramid. contact.twist is that of the foot's motion, all six
 * numbers. */
MILD_HD void corner_edges(const EngineModel *model, EngineRigid rigid, const EngineSurface *surface,
                          EngineWork *work, int corner) {
    EngineContact *contact = &work->now.support.ground.contact;
    const int f = model->tree.corner_foot[corner];
    const EngineFoot *foot = &model->number.foot[f];
    const EngineSoft soft = corner_soft(model, rigid);
    const EngineSphere sphere = {foot->corner_radius, foot->inverse_inertia};
    const EngineEdges edges = {contact->edge + 4 * corner, contact->reference + 4 * corner,
                               contact->weight + 4 * corner};
    Real center[3];
    Real point[3];
    corner_center(model, work, corner, center);
    foot_point(model, work, f, point);
    sphere_edges(&soft, rigid.friction, surface, work->base[2], &sphere, center, point,
                 contact->twist[f], &edges);
}

/* J x of all feet. */
WARP_FN void engine_twists(const EngineTree *tree, EngineSupport *support, const Real *x,
                           Real (*twist)[6]) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < 6 * engine_feet(tree); n += LANES) {
            twist[n / 6][n % 6] = foot_twist(tree, support, x, n / 6, n % 6);
        }
    }
    lanes_sync();
}

/* surface: [corners], or one for all of them when `level`. */
WARP_FN void engine_collide(const EngineModel *model, EngineRigid rigid,
                            const EngineSurface *surface, int level, EngineWork *work) {
    EngineSupport *support = &work->now.support;
    engine_twists(&model->tree, support, work->rate, support->ground.contact.twist);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int c = LANE(l); c < engine_corners(&model->tree); c += LANES) {
            corner_edges(model, rigid, surface + (level ? 0 : c), work, c);
        }
    }
    lanes_sync();
}

/* The same on any ground. A corner touches the tangent plane under its centre. */
WARP_FN void engine_collide_on(const EngineModel *model, EngineRigid rigid,
                               const EngineGround *ground, EngineWork *work) {
    engine_twists(&model->tree, &work->now.support, work->rate,
                  work->now.support.ground.contact.twist);
    EACH_LANE(l) {
        const MapSpot spot = engine_spot(ground, work);
        LANE_ROLLED
        for (int c = LANE(l); c < engine_corners(&model->tree); c += LANES) {
            Real center[3];
            corner_center(model, work, c, center);
            const EngineSurface surface = engine_surface(ground, work, &spot, center[0], center[1]);
            corner_edges(model, rigid, &surface, work, c);
        }
    }
    lanes_sync();
}

/* ---- one Newton step ---- */

/* x of all edges at the acceleration. floor: here and below, NULL without shells on the floor. */
WARP_FN void engine_residuals(const EngineTree *tree, EngineWork *work, EngineFloor *floor) {
    EngineContact *contact = &work->now.support.ground.contact;
    engine_twists(tree, &work->now.support, work->acceleration, contact->twist);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int row = LANE(l); row < 4 * engine_corners(tree); row += LANES) {
            const Real *twist = contact->twist[tree->corner_foot[row / 4]];
            contact->residual[row] =
                edge_along(contact->edge[row], twist) - contact->reference[row];
        }
    }
    lanes_sync();
    if (floor) {
        floor_residuals(tree, work->acceleration, floor);
    }
}

/* Number n of the sums over a foot's pushing edges: six of the wrench of their forces, also the
 * moment of a contact at the surface of a round foot, then 21 of the stiffness, which is symmetric
 * as the base's part of M. */
MILD_HD void engine_push_number(const EngineTree *tree, EngineWork *work, int f, int n) {
    EngineContact *contact = &work->now.support.ground.contact;
    const int begin = 4 * tree->corner_begin[f];
    const int end = 4 * tree->corner_begin[f + 1];
    const int r = n < 6 ? n : tree->entry[n - 6].dof;
    const int c = n < 6 ? 0 : tree->entry[n - 6].place;
    const Real *value = n < 6 ? contact->residual + begin : contact->edge[begin] + c;
    const int step = n < 6 ? 1 : 6;
    Real sum = 0;
    LANE_ROLLED
    for (int row = begin; row < end; row++) {
        if (contact->residual[row] < 0) {
            sum += contact->weight[row] * contact->edge[row][r] * *value;
        }
        value += step;
    }
    if (n < 6) {
        work->wrench[f][r] = -sum;
    } else {
        contact->stiffness[f][n - 6] = sum;
    }
}

/* For each foot, the wrench of its pushing edges, and their stiffness if that is wanted. */
WARP_FN void engine_push_of_edges(const EngineTree *tree, EngineWork *work, EngineFloor *floor,
                                  int stiffness) {
    const int feet = engine_feet(tree);
    const int count = feet * (stiffness ? 6 + ENGINE_BASE_ENTRIES : 6);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < count; n += LANES) {
            engine_push_number(tree, work, n % feet, n / feet);
        }
    }
    lanes_sync();
    if (floor) {
        floor_push(tree, stiffness, floor);
    }
}

/* half <- stiffness J^T of the feet. */
WARP_FN void engine_stiffen_rows(const EngineTree *tree, EngineSupport *support) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int f = 0; f < engine_feet(tree); f++) {
            LANE_ROLLED
            for (int n = LANE(l); n < 6 * tree->shared[f][f]; n += LANES) {
                support->half[f][n / 6][n % 6] = stiffness_times(
                    support->ground.contact.stiffness[f], n % 6, support->jacobian[f][n / 6]);
            }
        }
    }
    lanes_sync();
}

/* Entry of J^T stiffness J of the feet that move with degree of freedom d. */
MILD_HD Real stiffened_entry(const EngineTree *tree, const EngineSupport *support, int d,
                             int place) {
    Real sum = 0;
    LANE_ROLLED
    for (int f = 0; f < engine_feet(tree); f++) {
        if (foot_moves(tree, f, d)) {
            const Real *row = support->half[f][tree->above[d]];
            const Real *column = support->jacobian[f][place];
            sum += dot3(row, column) + dot3(row + 3, column + 3);
        }
    }
    return sum;
}

/* factor <- L of M + J^T weight J over the pushing rows; change <- the residue and what is left of
 * the rows, which is the descent of the cost. After engine_push_of_edges. */
WARP_FN void engine_newton_system(const EngineTree *tree, EngineWork *work, EngineFloor *floor,
                                  int edges) {
    EngineSupport *support = &work->now.support;
    if (edges) {
        engine_stiffen_rows(tree, support);
    }
    EACH_LANE(l) {
        LANE_ROLLED
        for (int e = LANE(l); e < engine_entries(tree); e += LANES) {
            const int d = tree->entry[e].dof;
            const int place = tree->entry[e].place;
            Real sum = work->mass[d][place];
            if (edges) {
                sum += stiffened_entry(tree, support, d, place);
            }
            if (floor) {
                sum += floor_entry(tree, floor, d, place);
            }
            if (d >= 6 && place == tree->above[d] && limit_pushes(work, d - 5)) {
                sum += work->limit_weight[d - 5];
            }
            work->factor[d][place] = sum;
        }
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            Real sum = support->residue[d];
            if (edges) {
                sum += wrench_along(tree, work, support->jacobian[0], d);
            }
            if (floor) {
                sum += floor_along(tree, floor, d);
            }
            if (d >= 6 && limit_pushes(work, d - 5)) {
                sum -= work->limit_side[d - 5] * work->limit_weight[d - 5] *
                       limit_residual(work, d - 5);
            }
            support->change[d] = sum;
        }
    }
    lanes_sync();
    engine_factorise(tree, work->factor[0], work->factor[0], work->inverse);
}

/* ---- the line search ---- */

/* The rows' part of a point of the line. */
WARP_FN LinePoint engine_line_rows(const EngineTree *tree, EngineWork *work,
                                   const EngineFloor *floor, int edges, Real t) {
    EngineSupport *support = &work->now.support;
    EngineContact *contact = &support->ground.contact;
    Real slope[LANE_COPIES];
    Real curvature[LANE_COPIES];
    Real changed[LANE_COPIES];
    EACH_LANE(l) {
        LinePoint sum = {0, 0, 0};
        LANE_ROLLED
        for (int i = 1 + LANE(l); i < engine_links(tree); i += LANES) {
            if (work->limit_side[i] != 0) {
                line_row(&sum, work->limit_weight[i], limit_residual(work, i),
                         work->limit_side[i] * support->change[5 + i], t);
            }
        }
        LANE_ROLLED
        for (int row = LANE(l); edges && row < 4 * engine_corners(tree); row += LANES) {
            if (contact->weight[row] > 0) {
                const Real *change = contact->twist_change[tree->corner_foot[row / 4]];
                line_row(&sum, contact->weight[row], contact->residual[row],
                         edge_along(contact->edge[row], change), t);
            }
        }
        if (floor) {
            floor_line(floor, LANE(l), t, &sum);
        }
        slope[l] = sum.slope;
        curvature[l] = sum.curvature;
        changed[l] = sum.changed;
    }
    const LinePoint point = {lane_sum(slope), lane_sum(curvature), lane_sum(changed)};
    return point;
}

/* The smooth part at t = 0: slope (a - a0)^T M change, and curvature change^T M change. product <-
 * M change. */
WARP_FN LinePoint engine_line_smooth(const EngineTree *tree, EngineWork *work) {
    EngineSupport *support = &work->now.support;
    Real slope[LANE_COPIES];
    Real curvature[LANE_COPIES];
    EACH_LANE(l) {
        slope[l] = curvature[l] = 0;
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            const Real product = mass_times(tree, work->mass[0], support->change, d);
            support->product[d] = product;
            slope[l] -= support->residue[d] * support->change[d];
            curvature[l] += support->change[d] * product;
        }
    }
    const LinePoint point = {lane_sum(slope), lane_sum(curvature), 0};
    return point;
}

/* Length of the step at which the cost is least: the zero of an increasing, piecewise linear slope,
 * by Newton's method between bounds. */
WARP_FN Real engine_line_search(const EngineTree *tree, EngineWork *work, const EngineFloor *floor,
                                int edges) {
    const LinePoint smooth = engine_line_smooth(tree, work);
    Real low = 0;
    Real high = REAL(1e30);
    Real t = 1;
    LANE_ROLLED
    for (int i = 0; i < CONSTRAINT_LINE_STEPS; i++) {
        const LinePoint rows = engine_line_rows(tree, work, floor, edges, t);
        const Real slope = smooth.slope + t * smooth.curvature + rows.slope;
        const Real next = t - slope / (smooth.curvature + rows.curvature + REAL_LEAST);
        if (REAL_ABS(next - t) <= REAL_ROUNDING * t) {
            return next;
        }
        low = slope < 0 ? t : low;
        high = slope > 0 ? t : high;
        t = next > low && next < high ? next : (low + real_min(high, 2 * t)) / 2;
    }
    return t;
}

/* acceleration <- acceleration + t change; the residue follows when the product is there. Returns
 * the largest change over the largest acceleration then. */
WARP_FN Real engine_move(const EngineTree *tree, EngineWork *work, Real t, int product) {
    Real moved[LANE_COPIES];
    Real size[LANE_COPIES];
    EACH_LANE(l) {
        moved[l] = size[l] = 0;
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            const Real change = t * work->now.support.change[d];
            work->acceleration[d] += change;
            if (product) {
                work->now.support.residue[d] -= t * work->now.support.product[d];
            }
            moved[l] = real_max(moved[l], REAL_ABS(change));
            size[l] = real_max(size[l], REAL_ABS(work->acceleration[d]));
        }
    }
    lanes_sync();
    const Real most = lane_max(moved);
    return most / (lane_max(size) + REAL_LEAST);
}

/* mass <- M of the factor of N, and what the held limits have done to the acceleration: its
 * residue. */
WARP_FN void engine_start(const EngineTree *tree, EngineWork *work) {
    engine_multiply_out(tree, work->factor[0], work->inverse, work->mass[0]);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            const int i = d - 5;
            work->now.support.residue[d] = 0;
            if (i > 0 && limit_held(work, i)) {
                work->mass[d][tree->above[d]] -= work->limit_weight[i];
                work->now.support.residue[d] =
                    work->limit_side[i] * work->limit_weight[i] * limit_residual(work, i);
            }
        }
    }
    lanes_sync();
}

/* From the acceleration with the held limits to that with all rows; `edges`: engine_collide was
 * called, and engine_floor_collide with a floor. The last step leaves the same rows pushing. It has
 * a rounding error in proportion to its length, so one that comes back a long way from where those
 * before it went is followed by another.
 *
 * Needs the factor of N, limits and J; overwrites it, mass, half and, with edges, the wrench.
 * Returns Newton steps. */
WARP_FN int engine_constrain(const EngineTree *tree, EngineWork *work, EngineFloor *floor,
                             int edges) {
    EngineSupport *support = &work->now.support;
    EngineContact *contact = &support->ground.contact;
    int step = 0;
    int going = 1;
    engine_start(tree, work);
    for (;;) {
        const int last = !going || step == CONSTRAINT_STEPS;
        if (edges) {
            engine_residuals(tree, work, floor);
            engine_push_of_edges(tree, work, floor, !last);
        }
        if (last) {
            return step;
        }
        step++;
        engine_newton_system(tree, work, floor, edges);
        engine_solve_transposed(tree, work->factor[0], work->inverse, support->change);
        engine_solve(tree, work->factor[0], work->inverse, support->change);
        if (edges) {
            engine_twists(tree, support, support->change, contact->twist_change);
        }
        if (floor) {
            floor_twists(tree, floor, support->change, floor->twist_change);
        }
        const int others =
            engine_line_rows(tree, work, floor, edges, 1).changed > 0; /* push then */
        const int again = others || step > 1;
        const Real length = again ? engine_line_search(tree, work, floor, edges) : 1;
        const Real moved = engine_move(tree, work, length, again);
        going = again && moved > (others ? REAL_ROUNDING : 1);
    }
}

#endif
