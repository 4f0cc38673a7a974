/* Newton's method of bodies.h on the twists of the bodies, see contact.inc: in P = W(V), V = V_free
 * + A P the unknown is P. Rows are dealt to the lanes. */
#ifndef MILD_BATCH_BODIES_NEWTON_H
#define MILD_BATCH_BODIES_NEWTON_H

/* The body at place i on the map. */
MILD_HD MapSpot bodies_spot(const BodiesSetup *setup, const BodiesWork *work, int i) {
    return setup->has_map ? map_spot(&setup->map, work->position[i], work->map_origin, work->height)
                          : bodies_no_spot();
}

/* Row r of A x. */
MILD_HD Real bodies_times(const BodiesWork *work, int rows, int r, const Real *x) {
    Real sum = 0;
    LANE_ROLLED
    for (int j = 0; j < rows; j++) {
        sum += work->inverse_inertia[j * rows + r] * x[j];
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

/* Wrench and hessian of one element at the twist V. I = friction + I_z g, see pass.c. */
MILD_HD void bodies_pass(const BodiesSetup *setup, const BodiesElement *own, const Real *V,
                         Real (*sums)[LANE_COPIES], int l) {
    const Element *e = &own->element;
    const ContactVelocity v = bodies_velocity(own, V);
    const Impulse normal = element_impulse(e, own->curves, 1, setup->dt, v.descent);
    const Friction f = friction_impulse(e, friction_bound(e, normal.value), e->mu, v.x, v.y);
    const Real g[2] = {-own->slope[0], -own->slope[1]};
    const Real I[3] = {f.x + g[0] * normal.value, f.y + g[1] * normal.value, normal.value};
    const Real xz = normal.slope * (f.rise_x + g[0]);
    const Real yz = normal.slope * (f.rise_y + g[1]);
    const Real h[3][3] = {{f.fall_xx + xz * g[0], f.fall_xy + xz * g[1], xz},
                          {f.fall_xy + yz * g[0], f.fall_yy + yz * g[1], yz},
                          {normal.slope * g[0], normal.slope * g[1], normal.slope}};
    bodies_add(own->p, I, h, sums, l);
}

/* W and H at the twist of a point. */
WARP_FN void bodies_evaluate(const BodiesSetup *setup, BodiesWork *work, BodiesPoint *point) {
    LANE_ROLLED
    for (int i = 0; i < work->count; i++) {
        const int elements = setup->sole[work->body[i]].elements;
        const MapSpot spot = bodies_spot(setup, work, i);
        Real part[BODIES_SUMS][LANE_COPIES], whole[BODIES_SUMS][LANE_COPIES];
        EACH_LANE(l) {
            LANE_UNROLL
            for (int n = 0; n < BODIES_SUMS; n++) {
                part[n][l] = 0;
            }
            LANE_ROLLED
            for (int s = LANE(l); s < elements; s += LANES) {
                BodiesElement own;
                bodies_element(setup, work, i, s, &spot, 0, &own);
                if (own.listed && own.share > 0) {
                    bodies_pass(setup, &own, point->twist + 6 * i, part, l);
                }
            }
        }
        group_sums(part, BODIES_SUMS, LANES, whole);
        EACH_LANE(l) {
            LANE_UNROLL
            for (int n = 0; n < BODIES_SUMS; n++) {
                if (LANE(l) == n % LANES) {
                    *(n < 6 ? &point->wrench[6 * i + n] : &work->hessian[i][n - 6]) = whole[n][l];
                }
            }
        }
    }
    lanes_sync();
}

/* |P - W| and |P| in the metric of kinetic energy. */
WARP_FN void bodies_residual(BodiesWork *work, int rows, const BodiesPoint *point, Real *residual,
                             Real *scale) {
    Real moved[LANE_COPIES], done[LANE_COPIES];
    EACH_LANE(l) {
        LANE_ROLLED
        for (int r = LANE(l); r < rows; r += LANES) {
            work->row[0][r] = point->impulse[r] - point->wrench[r];
        }
    }
    lanes_sync();
    EACH_LANE(l) {
        moved[l] = done[l] = 0;
        LANE_ROLLED
        for (int r = LANE(l); r < rows; r += LANES) {
            moved[l] += work->row[0][r] * bodies_times(work, rows, r, work->row[0]);
            done[l] += point->impulse[r] * (point->twist[r] - work->free_velocity[r]);
        }
    }
    lanes_sync();
    *residual = REAL_SQRT(real_max(lane_sum(moved), 0));
    *scale = REAL_SQRT(real_max(lane_sum(done), 0));
}

/* Gauss and Jordan; the last column becomes the solution. */
WARP_FN void bodies_eliminate(BodiesWork *work, int rows) {
    const int stride = rows + 1;
    LANE_ROLLED
    for (int k = 0; k < rows; k++) {
        const Real *pivot = work->matrix + k * stride;
        const Real inverse = 1 / pivot[k];
        EACH_LANE(l) {
            LANE_ROLLED
            for (int r = LANE(l); r < rows; r += LANES) {
                Real *row = work->matrix + r * stride;
                const Real factor = row[k] * inverse;
                LANE_ROLLED
                for (int j = k + 1; j < stride && r != k; j++) {
                    row[j] -= factor * pivot[j];
                }
            }
        }
        lanes_sync();
    }
    EACH_LANE(l) {
        LANE_ROLLED
        for (int r = LANE(l); r < rows; r += LANES) {
            work->matrix[r * stride + rows] /= work->matrix[r * stride + r];
        }
    }
    lanes_sync();
}

/* Newton's step from `at`, where H was taken: (1 + H A) P = W + H (V - V_free). */
WARP_FN void bodies_move(BodiesWork *work, int rows, const BodiesPoint *at, BodiesPoint *next) {
    const int stride = rows + 1;
    EACH_LANE(l) {
        LANE_ROLLED
        for (int r = LANE(l); r < rows; r += LANES) {
            const int first = r / 6 * 6;
            const Real *H = work->hessian[r / 6] + 6 * (r % 6);
            const Real *A = work->inverse_inertia + first * rows;
            Real *row = work->matrix + r * stride;
            row[rows] = at->wrench[r];
            for (int k = 0; k < 6; k++) {
                row[rows] += H[k] * (at->twist[first + k] - work->free_velocity[first + k]);
            }
            LANE_ROLLED
            for (int j = 0; j < rows; j++) {
                Real sum = r == j ? 1 : 0;
                for (int k = 0; k < 6; k++) {
                    sum += H[k] * A[k * rows + j];
                }
                row[j] = sum;
            }
        }
    }
    lanes_sync();
    bodies_eliminate(work, rows);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int r = LANE(l); r < rows; r += LANES) {
            next->impulse[r] = work->matrix[r * stride + rows];
        }
    }
    lanes_sync();
    EACH_LANE(l) {
        LANE_ROLLED
        for (int r = LANE(l); r < rows; r += LANES) {
            next->twist[r] = work->free_velocity[r] + bodies_times(work, rows, r, next->impulse);
        }
    }
    lanes_sync();
}

WARP_FN void bodies_copy(int rows, const BodiesPoint *from, BodiesPoint *to) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int r = LANE(l); r < rows; r += LANES) {
            to->impulse[r] = from->impulse[r];
            to->twist[r] = from->twist[r];
            to->wrench[r] = from->wrench[r];
        }
    }
    lanes_sync();
}

/* Where Newton's method begins: the motion now. A body that transmits no moment begins at rest
 * (contact.inc says why), and turns as it will. */
WARP_FN void bodies_start(BodiesWork *work, int rows, BodiesPoint *point) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int r = LANE(l); r < rows; r += LANES) {
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
    lanes_sync();
}

/* The point between `at` and `full`. */
WARP_FN void bodies_between(BodiesWork *work, int rows, Real way) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int r = LANE(l); r < rows; r += LANES) {
            const BodiesPoint *at = &work->at, *full = &work->full;
            work->next.impulse[r] = at->impulse[r] + way * (full->impulse[r] - at->impulse[r]);
            work->next.twist[r] = at->twist[r] + way * (full->twist[r] - at->twist[r]);
        }
    }
    lanes_sync();
}

/* As in contact.inc; the least residual's point is left in work->best. */
WARP_FN void bodies_newton(const BodiesSetup *setup, BodiesWork *work) {
    const int rows = 6 * work->count;
    Real least = -1, at_residual = 0, way = 1, relative = 0;
    int steps = 0, halved = 0;
    bodies_start(work, rows, &work->next);
    bodies_copy(rows, &work->next, &work->best);
    for (;;) {
        Real residual, scale;
        bodies_evaluate(setup, work, &work->next);
        bodies_residual(work, rows, &work->next, &residual, &scale);
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
        bodies_move(work, rows, &work->at, &work->next);
        steps++;
    }
    EACH_LANE(l) {
        if (LANE(l) == 0) {
            work->residual = relative;
            work->iterations = steps;
        }
    }
    lanes_sync();
}

#endif
