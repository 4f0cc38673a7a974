/* Newton's method of bodies.h on the twists of the bodies, see contact.inc: in P = W(V), V = V_free
 * + A P the unknown is P. Rows are dealt to the lanes of a team. */
#ifndef MILD_BATCH_BODIES_NEWTON_H
#define MILD_BATCH_BODIES_NEWTON_H

/* The body at place i on the map. */
MILD_HD MapSpot bodies_spot(const BodiesSetup *setup, const BodiesWork *work, int i) {
    return setup->has_map ? map_spot(&setup->map, work->position[i], work->map_origin, work->height)
                          : bodies_no_spot();
}

/* Row r of A x, of an x that is 0 but in active rows. */
MILD_HD Real bodies_times(const BodiesWork *work, int rows, int r, const Real *x) {
    Real sum = 0;
    LANE_ROLLED
    for (int n = 0; n < work->active; n += 6) { /* a body, whose rows follow each other */
        const int first = work->active_row[n];
        LANE_UNROLL
        for (int j = first; j < first + 6; j++) {
            sum += work->inverse_inertia[j * rows + r] * x[j];
        }
    }
    return sum;
}

/* sums += the wrench of an element, and the 6 x 6 hessian B^T h B, with B = [1, -[p]x]. */
MILD_HD void bodies_add(const Real *p, const Real I[3], const Real h[3][3],
                        Real (*sums)[LANE_COPIES], int l) {
    Real row[3][6];
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            row[r][c] = h[r][c];
        }
        row[r][3] = p[1] * h[r][2] - p[2] * h[r][1];
        row[r][4] = p[2] * h[r][0] - p[0] * h[r][2];
        row[r][5] = p[0] * h[r][1] - p[1] * h[r][0];
        sums[r][l] += I[r];
    }
    sums[3][l] += p[1] * I[2] - p[2] * I[1];
    sums[4][l] += p[2] * I[0] - p[0] * I[2];
    sums[5][l] += p[0] * I[1] - p[1] * I[0];
    LANE_UNROLL
    for (int c = 0; c < 6; c++) {
        sums[6 + c][l] += row[0][c];
        sums[12 + c][l] += row[1][c];
        sums[18 + c][l] += row[2][c];
        sums[24 + c][l] += p[1] * row[2][c] - p[2] * row[1][c];
        sums[30 + c][l] += p[2] * row[0][c] - p[0] * row[2][c];
        sums[36 + c][l] += p[0] * row[1][c] - p[1] * row[0][c];
    }
}

/* Wrench and hessian of one element at the twist V. I = friction + I_z g, see pass.c. begins: bool,
 * see friction_step. */
MILD_HD void bodies_pass(const BodiesSetup *setup, const BodiesElement *own, const Real *V,
                         int begins, int curves, Real (*sums)[LANE_COPIES], int l) {
    const Element *e = &own->element;
    const ContactVelocity v = bodies_velocity(own, V);
    const Impulse normal =
        element_impulse(e, bodies_curves(own->curves, curves), 1, setup->dt, v.descent);
    const Real bound = friction_bound(e, normal.value);
    const Friction f = friction_step(e, bound, e->mu, begins, v.x, v.y);
    const Real g[2] = {-own->slope[0], -own->slope[1]};
    const Real I[3] = {f.x + g[0] * normal.value, f.y + g[1] * normal.value, normal.value};
    const Real xz = normal.slope * (f.rise_x + g[0]);
    const Real yz = normal.slope * (f.rise_y + g[1]);
    const Real h[3][3] = {{f.fall_xx + xz * g[0], f.fall_xy + xz * g[1], xz},
                          {f.fall_xy + yz * g[0], f.fall_yy + yz * g[1], yz},
                          {normal.slope * g[0], normal.slope * g[1], normal.slope}};
    Real world[3], turned[3][3], back[3][3];
    frame_to_world(own->frame, I, world);
    for (int r = 0; r < 3; r++) { /* h Q^T, and its columns by rows */
        Real row[3];
        frame_to_world(own->frame, h[r], row);
        for (int c = 0; c < 3; c++) {
            turned[c][r] = row[c];
        }
    }
    for (int c = 0; c < 3; c++) { /* Q h Q^T */
        Real column[3];
        frame_to_world(own->frame, turned[c], column);
        for (int r = 0; r < 3; r++) {
            back[r][c] = column[r];
        }
    }
    bodies_add(own->p, world, back, sums, l);
}

/* ---- which elements ---- */

/* Rounds of elements that a warp keeps behind its first. On a GPU the first is in registers, these
 * are in memory of the thread: nine rounds of three warps, where a robot that walks has four to
 * eight. */
#define BODIES_REST (LANE_COPIES == 1 ? 2 : 7)

/* The rim of the body at place i, from each lane's sums. */
WARP_FN void bodies_set_rim(BodiesWork *work, int i, Real (*sums)[RIM_SUMS]) {
    Real whole[RIM_SUMS];
    for (int k = 0; k < RIM_SUMS; k++) {
        Real part[LANE_COPIES];
        EACH_LANE(l) {
            part[l] = sums[l][k];
        }
        whole[k] = lane_sum(part);
    }
    EACH_LANE(l) {
        if (LANE(l) == 0) {
            work->rim[i] = rim_of(whole);
        }
    }
}

/* Lists those of the body at place i that may touch; by a warp. */
WARP_FN void bodies_list_body(const BodiesSetup *setup, BodiesWork *work, int i, int curves) {
    const BodiesSole *sole = &setup->sole[work->body[i]];
    const int elements = sole->elements;
    const int rounded = curves & LAW_HEAP && sole->face;
    Real sums[LANE_COPIES][RIM_SUMS] = {{0}};
    const MapSpot spot = bodies_spot(setup, work, i);
    uint16_t *list = work->list + work->begin[i];
    int count = 0;
    LANE_ROLLED
    for (int from = 0; from < elements; from += LANES) {
        int flag[LANE_COPIES], rank[LANE_COPIES];
        EACH_LANE(l) {
            flag[l] = 0;
            if (from + LANE(l) < elements) {
                BodiesElement own;
                bodies_locate(setup, work, i, from + LANE(l), &spot, &own);
                flag[l] = own.listed;
                if (rounded && own.listed) {
                    const int s = from + LANE(l);
                    rim_add(sums[l], own.p[0], own.p[1],
                            bodies_rim_depth(&work->memory[i], s, &own), own.down,
                            sole->face[4 * elements + s] * sole->square);
                }
            }
        }
        const int found = lanes_rank(flag, rank);
        EACH_LANE(l) {
            if (flag[l]) {
                list[count + rank[l]] = (uint16_t)(from + LANE(l));
            }
        }
        count += found;
    }
    if (rounded) {
        bodies_set_rim(work, i, sums);
    }
    EACH_LANE(l) {
        if (LANE(l) == 0) {
            work->listed[i] = count;
        }
    }
}

/* The list, and its rounds. */
TEAM_FN void bodies_list(const BodiesSetup *setup, BodiesWork *work, int curves) {
    EACH_LANE(l) {
        if (TEAM_LANE(l) == 0) {
            int begin = 0;
            for (int i = 0; i < work->count; i++) {
                work->begin[i] = begin;
                begin += setup->sole[work->body[i]].elements;
            }
        }
    }
    team_sync();
    LANE_ROLLED
    for (int i = TEAM_WARP; i < work->count; i += TEAM_WARPS) {
        bodies_list_body(setup, work, i, curves);
    }
    team_sync();
    EACH_LANE(l) {
        if (TEAM_LANE(l) == 0) {
            int round = 0;
            work->active = 0;
            for (int i = 0; i < work->count; i++) {
                for (int r = 6 * i; r < 6 * i + 6 && work->listed[i] > 0; r++) {
                    work->active_row[work->active++] = (uint8_t)r;
                }
                work->first[i] = round;
                for (int from = 0; from < work->listed[i]; from += LANES) {
                    work->place[round++] = (uint8_t)i;
                }
            }
            work->first[work->count] = round;
        }
    }
    team_sync();
}

/* The element of lane l in a round; its share is 0 where there is none. */
MILD_HD void bodies_of_round(const BodiesSetup *setup, const BodiesWork *work, int round, int l,
                             BodiesElement *own, int curves) {
    const int i = work->place[round];
    const int n = (round - work->first[i]) * LANES + l;
    if (n >= work->listed[i]) {
        own->area_share = 0;
        return;
    }
    const MapSpot spot = bodies_spot(setup, work, i);
    const int s = work->list[work->begin[i] + n];
    bodies_locate(setup, work, i, s, &spot, own);
    bodies_recall(setup, work, i, s, own, curves);
}

/* Those that a warp keeps: in `kept` of its first round. */
TEAM_FN void bodies_keep(const BodiesSetup *setup, const BodiesWork *work, BodiesElement *kept,
                         BodiesElement (*rest)[LANE_COPIES], int curves) {
    LANE_ROLLED
    for (int turn = BODIES_REST; turn >= 0; turn--) { /* the first round at last */
        const int round = TEAM_WARP + turn * TEAM_WARPS;
        const int is = round < work->first[work->count];
        EACH_LANE(l) {
            kept[l].area_share = 0;
            if (is) {
                bodies_of_round(setup, work, round, LANE(l), &kept[l], curves);
            }
            if (is && turn > 0) {
                rest[turn - 1][l] = kept[l];
            }
        }
    }
}

/* ---- an evaluation ---- */

/* Wrench and hessian of a round. */
TEAM_FN void bodies_round(const BodiesSetup *setup, BodiesWork *work, const BodiesPoint *point,
                          int begins, int turn, const BodiesElement *kept,
                          const BodiesElement (*rest)[LANE_COPIES], int curves) {
    const int round = TEAM_WARP + turn * TEAM_WARPS;
    const Real *twist = point->twist + 6 * work->place[round];
    Real part[BODIES_SUMS][LANE_COPIES];
    EACH_LANE(l) {
        LANE_UNROLL
        for (int n = 0; n < BODIES_SUMS; n++) {
            part[n][l] = 0;
        }
        if (turn == 0) {
            if (kept[l].area_share > 0) {
                bodies_pass(setup, &kept[l], twist, begins, curves, part, l);
            }
        } else {
            BodiesElement own;
            if (turn <= BODIES_REST) {
                own = rest[turn - 1][l];
            } else {
                bodies_of_round(setup, work, round, LANE(l), &own, curves);
            }
            if (own.area_share > 0) {
                bodies_pass(setup, &own, twist, begins, curves, part, l);
            }
        }
    }
    group_halve(part, BODIES_SUMS, LANES);
    EACH_LANE(l) {
        const int first = group_entry(LANE(l), LANES);
        LANE_UNROLL
        for (int n = 0; n < BODIES_SUMS; n += LANES) {
            if (n + first < BODIES_SUMS) {
                work->part[round][n + first] = part[n / LANES][l];
            }
        }
    }
}

/* W and H at the twist of a point. */
TEAM_FN void bodies_evaluate(const BodiesSetup *setup, BodiesWork *work, BodiesPoint *point,
                             int begins, const BodiesElement *kept,
                             const BodiesElement (*rest)[LANE_COPIES], int curves) {
    LANE_ROLLED
    for (int turn = 0; TEAM_WARP + turn * TEAM_WARPS < work->first[work->count]; turn++) {
        bodies_round(setup, work, point, begins, turn, kept, rest, curves);
    }
    team_sync();
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = TEAM_LANE(l); n < work->count * BODIES_SUMS; n += TEAM) {
            const int i = n / BODIES_SUMS;
            const int m = n % BODIES_SUMS;
            Real sum = 0;
            LANE_ROLLED
            for (int round = work->first[i]; round < work->first[i + 1]; round++) {
                sum += work->part[round][m];
            }
            *(m < 6 ? &point->wrench[6 * i + m] : &work->hessian[i][m - 6]) = sum;
        }
    }
    team_sync();
}

/* |P - W| and |P| in the metric of kinetic energy. */
TEAM_FN void bodies_residual(BodiesWork *work, int rows, const BodiesPoint *point, Real *residual,
                             Real *scale) {
    Real moved[LANE_COPIES], done[LANE_COPIES];
    EACH_LANE(l) {
        LANE_ROLLED
        for (int r = TEAM_LANE(l); r < rows; r += TEAM) {
            work->row[0][r] = point->impulse[r] - point->wrench[r];
        }
    }
    team_sync();
    EACH_LANE(l) {
        moved[l] = done[l] = 0;
        LANE_ROLLED
        for (int n = LANE(l); n < work->active; n += LANES) {
            const int r = work->active_row[n];
            moved[l] += work->row[0][r] * bodies_times(work, rows, r, work->row[0]);
            done[l] += point->impulse[r] * (point->twist[r] - work->free_velocity[r]);
        }
    }
    team_sync();
    const Real gap = lane_sum(moved);
    *residual = gap < 0 ? 0 : REAL_SQRT(gap); /* NaN stays NaN: nothing is solved then */
    *scale = REAL_SQRT(real_max(lane_sum(done), 0));
}

#include "ground/batch/bodies_equations.h"

/* Newton's step from `at`, where H was taken. corrects: bool, as in contact_newton.inc. */
TEAM_FN void bodies_move(BodiesWork *work, int rows, const BodiesPoint *at, int corrects,
                         BodiesPoint *next) {
    const int active = work->active;
    if (active <= BODIES_REGISTER_ROWS && active < BODIES_OWN_COLUMNS * TEAM_WARPS) {
        bodies_solve_rows(work, rows, at, corrects);
    } else {
        bodies_solve_shared(work, rows, at, corrects);
    }
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = TEAM_LANE(l); n < active; n += TEAM) {
            const int r = work->active_row[n];
            const Real from = corrects ? at->twist[r] : work->free_velocity[r];
            next->impulse[r] = at->impulse[r] + work->row[0][r];
            next->twist[r] = from + bodies_times(work, rows, r, work->row[0]);
        }
    }
    team_sync();
}

TEAM_FN void bodies_copy(int rows, const BodiesPoint *from, BodiesPoint *to) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int r = TEAM_LANE(l); r < rows; r += TEAM) {
            to->impulse[r] = from->impulse[r];
            to->twist[r] = from->twist[r];
            to->wrench[r] = from->wrench[r];
        }
    }
    team_sync();
}

/* Where Newton's method begins: the motion now. A body that transmits no moment begins at rest
 * (contact.inc says why), and turns as it will. */
TEAM_FN void bodies_start(BodiesWork *work, int rows, BodiesPoint *point) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int r = TEAM_LANE(l); r < rows; r += TEAM) {
            const int first = r / 6 * 6;
            Real turns = 0; /* trace of the inverse inertia of rotation */
            for (int k = first + 3; k < first + 6; k++) {
                turns += work->inverse_inertia[k * rows + k];
            }
            const Real still = r % 6 < 3 ? 0 : work->free_velocity[r];
            point->twist[r] = turns > 0 ? work->velocity[r / 6][r % 6] : still;
            point->impulse[r] = point->wrench[r] = 0;
        }
    }
    team_sync();
}

/* The point between `at` and `full`. */
TEAM_FN void bodies_between(BodiesWork *work, int rows, Real way) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int r = TEAM_LANE(l); r < rows; r += TEAM) {
            const BodiesPoint *at = &work->at, *full = &work->full;
            work->next.impulse[r] = at->impulse[r] + way * (full->impulse[r] - at->impulse[r]);
            work->next.twist[r] = at->twist[r] + way * (full->twist[r] - at->twist[r]);
        }
    }
    team_sync();
}

/* As in contact.inc; the least residual's point is left in work->best. */
TEAM_FN void bodies_newton(const BodiesSetup *setup, BodiesWork *work, int curves) {
    const int rows = 6 * work->count;
    Real least = -1, at_residual = 0, way = 1, relative = 0;
    int steps = 0, halved = 0;
    BodiesElement kept[LANE_COPIES], rest[BODIES_REST][LANE_COPIES];
    bodies_list(setup, work, curves);
    bodies_keep(setup, work, kept, rest, curves);
    bodies_start(work, rows, &work->next);
    bodies_copy(rows, &work->next, &work->best);
    for (;;) {
        Real residual = 0, scale = 0; /* of the start nobody asks */
        bodies_evaluate(setup, work, &work->next, contact_begins(steps, CONTACT_BEGINS), kept,
                        (const BodiesElement(*)[LANE_COPIES])rest, curves);
        if (steps > 0) {
            bodies_residual(work, rows, &work->next, &residual, &scale);
        }
        const Real wanted = halved ? (1 - way / 10) * at_residual : at_residual;
        if (steps > 1 && !(residual < wanted) && halved < CONTACT_HALVINGS) {
            way = halved ? way / 2 : REAL(0.5);
            if (!halved) {
                bodies_copy(rows, &work->next, &work->full);
            }
            bodies_between(work, rows, way);
            halved++;
            continue;
        }
        halved = 0;
        way = 1;
        at_residual = residual;
        const int solved = steps > 0 && residual <= setup->tolerance * scale;
        if (steps > 0 && (least < 0 || residual < least)) {
            least = residual;
            relative = scale > 0 ? residual / scale : residual;
            bodies_copy(rows, &work->next, &work->best);
        }
        if (solved || steps >= setup->limit) {
            break;
        }
        bodies_copy(rows, &work->next, &work->at);
        bodies_move(work, rows, &work->at, steps > 0, &work->next);
        steps++;
    }
    EACH_LANE(l) {
        if (TEAM_LANE(l) == 0) {
            work->residual = relative;
            work->iterations = steps;
        }
    }
    team_sync();
}

#endif
