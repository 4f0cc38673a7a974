/* Derivatives of a solved contact step (docs/gradients.md). The solution has, with P the impulses
 * on the feet, V the twists after the step, V^ those of the free motion and x anything else,
 *
 *     V = V^ + A P,   P = P(V, V^, x)
 *
 * where P(V, V^, x) is the law: a sum over elements for each foot alone. With its derivatives
 *
 *     H = -dP/dV     that of Newton's method, from the last pass
 *     F = dP/dV^     at fixed V: drag starts at a speed that the free motion raises, and ground
 *                    that creates energy (passive = false) is explicit (derivative_free.c)
 *     G = dP/dx      at fixed V: differences of passes
 *
 * all of them blocks of a foot, the implicit function theorem says
 *
 *     (1 + A H) dV = (1 + A F) dV^ + A G dx,   dP = F dV^ + G dx - H dV
 *
 * Nothing else is fixed during a solve: its bounds of friction are those of its own P when it
 * converges. Which elements have a reversal velocity (energy.c) is a branch, as sliding is; that
 * velocity is the element's before the step and follows pose and present twist. */
#define POWER_CALLED /* power.h: no vector loop here needs a power */
#include <stddef.h>
#include <string.h>

#include "ground/step/newton_step.h"

/* Steps of the differences, at fixed twists. Lengths: above the rounding of a depth, 1e-17 m beside
 * the origin, and short, because the law has kinks. Speeds: above the same rounding over dt, and
 * short for the speed at which friction and the lag of elastic ground set in. */
#define STEP_LENGTH 2e-9 /* [m] and as many times the distance from the origin */
#define STEP_ANGLE 3e-8  /* [rad] */
#define STEP_SPEED 3e-7  /* [m/s] */
#define STEP_SPIN 3e-6   /* [rad/s] */
#define STEP_FIELD 1e-6  /* [-] of a field's value ... */
#define STEP_RANGE 1e-3  /* [-] ... or, where that is small, of this share of its range */
#define STEP_WIDEST 1e6  /* range of a field that has no end, in its unit */

#define STEP_GROWTH 8.0 /* [-] a larger elimination factor calls for a row exchange */

/* Six rows of six numbers for each listed foot, in their order, and what a vector reads beyond. */
typedef double Blocks[36 * MILD_FEET_MAX + NEWTON_VECTOR];

/* A step whose derivatives are wanted. Impulses and twists are those of all feet, in the world. */
typedef struct {
    const MildGround *ground;
    const MildTerrain *terrain;
    const MildContactInput *input;
    MildScratch *scratch;
    MildScratch *work;   /* may be NULL */
    const double *twist; /* V [6 feet] */
    Blocks H;
    /* Equations of the listed feet, (1 + A H) U = R: n rows, each of `left` vectors of 1 + A H,
     * later of the impulses that U makes, and as many of R, later U. */
    int n, left;
    Vector *rows;
} Step;

/* ---- blocks of a foot ---- */

/* Rows of six numbers: three of the force or the linear part, three of the other. */
enum { HALF = 3, WHOLE = 6 };

/* to = Q B, of the columns of a block. */
static void rows_turn(const double Q[HALF][HALF], const double *B, double *to) {
    for (int i = 0; i < WHOLE; i++) {
        const double *q = Q[i % HALF], *from = B + i / HALF * HALF * WHOLE;
        for (int j = 0; j < WHOLE; j++) {
            to[WHOLE * i + j] =
                q[0] * from[j] + q[1] * from[WHOLE + j] + q[2] * from[2 * WHOLE + j];
        }
    }
}

/* Q B Q^T: a block in the frame of a foot, in the world. */
static void block_to_world(const FootScratch *foot, double *B) {
    if (!foot->framed) {
        return;
    }
    double Q[HALF][HALF], turned[36], across[36];
    for (int k = 0; k < HALF; k++) {
        double axis[WHOLE] = {0.0};
        axis[k] = 1.0;
        twist_to_world(foot, axis, axis);
        for (int i = 0; i < HALF; i++) {
            Q[i][k] = axis[i];
        }
    }
    rows_turn(Q, B, turned);
    for (int i = 0; i < 36; i++) {
        across[i] = turned[i % WHOLE * WHOLE + i / WHOLE];
    }
    rows_turn(Q, across, turned);
    for (int i = 0; i < 36; i++) {
        B[i] = turned[i % WHOLE * WHOLE + i / WHOLE];
    }
}

/* ---- the law at the twists of the solution ---- */

/* The elements that have a reversal velocity in the scratch get that of the work's pose and present
 * twist. */
static void foot_turns(const FootScratch *solved, FootScratch *foot, const double *twist) {
    if (!solved->turned) {
        return;
    }
    double before[6];
    twist_of_world(foot, twist, before);
    const Motion motion = foot_motion(foot, before);
    foot->turned = 1;
    for (int slot = 0, from = 0; slot < foot->active; slot++) {
        while (from < solved->active && solved->element[from] < foot->element[slot]) {
            from++;
        }
        if (from == solved->active || solved->element[from] != foot->element[slot]) {
            continue;
        }
        const Slots *old = slot_block(solved, from);
        Slots *s = slot_block(foot, slot);
        const int i = slot % SLOT_LANES, was = from % SLOT_LANES;
        if (old->turn_x[was] != 0 || old->turn_y[was] != 0) {
            const SlotVelocity u = slot_velocity(s, i, &motion, SLOT_SHELL);
            s->turn_x[i] = u.x;
            s->turn_y[i] = u.y;
        }
        if (old->hold_stiffness[was] == 0) {
            s->hold_x[i] = s->hold_y[i] = s->hold_stiffness[i] = 0;
        }
    }
}

/* P(V) of another problem at the twists of the solution, into the work. impulse: [6 feet] */
static __attribute__((cold)) void law_at(const Step *step, const MildTerrain *terrain,
                                         const MildContactInput *input, double *impulse) {
    MildScratch *work = step->work;
    double own[TWIST_MAX];
    energy_begin(work);
    work->dt = input->dt;
    contact_prepare(step->ground, terrain, input, work);
    for (int k = 0; k < work->listed; k++) {
        const int f = work->list[k];
        foot_turns(&step->scratch->foot[f], &work->foot[f], input->velocity[f]);
        twist_of_world(&work->foot[f], step->twist + 6 * f, own + 6 * k);
    }
    contact_pass(work, input->dt, own);
    memset(impulse, 0, 6 * (size_t)work->feet * sizeof *impulse);
    for (int k = 0; k < work->listed; k++) {
        const int f = work->list[k];
        twist_to_world(&work->foot[f], work->wrench + 6 * f, impulse + 6 * f);
    }
}

/* ---- the equations of all feet ---- */

/* A vector of numbers anywhere. */
typedef double Loose __attribute__((vector_size(sizeof(Vector)), aligned(8), may_alias));
typedef double Pair __attribute__((vector_size(2 * sizeof(double)), aligned(8), may_alias));
enum { SIX = (6 + NEWTON_VECTOR - 1) / NEWTON_VECTOR }; /* vectors of six numbers */

/* Row i of 1 + A H or of the impulses, and of R or U. */
static inline double *row_left(const Step *step, int i) {
    return (double *)(step->rows + 2 * i * step->left);
}

static inline double *row_right(const Step *step, int i) {
    return (double *)(step->rows + (2 * i + 1) * step->left);
}

/* x_0 row_0 + ... + x_5 row_5 of rows `width` numbers apart. Written out, as in newton_step.c. */
static inline Vector six_times(const double *rows, int width, const double *x) {
#define ROW(k) (*(const Loose *)(rows + (k)*width))
    return x[0] * ROW(0) + x[1] * ROW(1) + x[2] * ROW(2) + x[3] * ROW(3) + x[4] * ROW(4) +
           x[5] * ROW(5);
#undef ROW
}

/* Rows of a foot, `parts` vectors apart: rows -= factor pivot. */
static inline void six_less(Vector *rows, int parts, const double *factor, Vector pivot) {
    rows[0] -= factor[0] * pivot;
    rows[parts] -= factor[1] * pivot;
    rows[2 * parts] -= factor[2] * pivot;
    rows[3 * parts] -= factor[3] * pivot;
    rows[4 * parts] -= factor[4] * pivot;
    rows[5 * parts] -= factor[5] * pivot;
}

/* Row i of A of foot f, of the columns of listed foot m. */
static inline const double *inertia_row(const Step *step, int f, int i, int m) {
    const MildScratch *scratch = step->scratch;
    return step->input->inverse_inertia + (6 * scratch->place[f] + i) * 6 * scratch->given +
           6 * scratch->place[scratch->list[m]];
}

/* Row i of `one` + A B. Beyond its n numbers it writes two more. B: blocks; NULL: 0. */
static void row_set(const Step *step, int i, const double *B, double one, double *row) {
    ((Vector *)row)[step->left - 1] = (Vector){0.0};
    for (int m = 0; 6 * m < step->n; m++) {
        const double *A = inertia_row(step, step->scratch->list[i / 6], i % 6, m);
        for (int p = 0; p < SIX * NEWTON_VECTOR; p += NEWTON_VECTOR) {
            Vector sum = {0.0};
            if (B) {
                sum = six_times(B + 36 * m + p, 6, A);
            }
            *(Loose *)(row + 6 * m + p) = sum;
        }
    }
    row[i] += one;
}

/* Swaps row k with the one below it that has the largest number in column k. */
static __attribute__((cold, noinline)) void rows_choose(const Step *step, int k) {
    int best = k;
    for (int i = k + 1; i < step->n; i++) {
        best = fabs(row_left(step, i)[k]) > fabs(row_left(step, best)[k]) ? i : best;
    }
    for (int p = 0; best != k && p < 2 * step->left; p++) {
        Vector *const from = step->rows + p, swapped = from[2 * k * step->left];
        from[2 * k * step->left] = from[2 * best * step->left];
        from[2 * best * step->left] = swapped;
    }
}

/* Column k of the rows. Returns whether one below row k has too large a number there. */
static inline int column_take(const Step *step, int k, double *column) {
    const int stride = 2 * step->left * NEWTON_VECTOR;
    const double *from = (const double *)step->rows + k;
    int grown = 0;
    for (int i = 0; i < step->n; i++) {
        column[i] = from[i * stride];
    }
    const double most = STEP_GROWTH * fabs(column[k]);
    for (int i = k + 1; i < step->n; i++) {
        grown += fabs(column[i]) <= most ? 0 : 1;
    }
    return grown;
}

/* Solves the equations by Gauss-Jordan elimination. unit: bool, R is 1. Returns false when they are
 * singular. */
static int equations_solve(const Step *step, int unit) {
    const int n = step->n, parts = 2 * step->left;
    for (int k = 0; k < n; k++) {
        double factor[TWIST_MAX];
        if (column_take(step, k, factor)) {
            rows_choose(step, k);
            column_take(step, k, factor);
            unit = 0;
        }
        if (!(fabs(factor[k]) > 0.0)) {
            return 0;
        }
        const double inverse = 1.0 / factor[k];
        /* R, if 1 at first, is still 0 in the columns beyond k */
        const int first = k / NEWTON_VECTOR, end = unit ? step->left + first + 1 : parts;
        for (int p = first; p < end; p++) {
            const Vector scaled = inverse * step->rows[k * parts + p];
            for (int i = 0; i < n; i += 6) {
                six_less(step->rows + i * parts + p, parts, factor + i, scaled);
            }
            step->rows[k * parts + p] = scaled;
        }
    }
    return 1;
}

/* U of R = `one` + A B, and P = B - H U. B: blocks; NULL: 0. Returns false when there is none. */
static int blocks_solve(Step *step, const double *B, double one) {
    for (int i = 0; i < step->n; i++) { /* in this order, because of what is beyond a row */
        row_set(step, i, step->H, 1.0, row_left(step, i));
        row_set(step, i, B, one, row_right(step, i));
    }
    const int solved = equations_solve(step, !B);
    for (int i = 0; i < step->n; i++) {
        const int foot = i / 6 * 6;
        double *row = row_left(step, i);
        for (int p = 0; p < step->left * NEWTON_VECTOR; p += NEWTON_VECTOR) {
            *(Vector *)(row + p) = -six_times(row_right(step, foot) + p,
                                              2 * step->left * NEWTON_VECTOR, step->H + 6 * i);
        }
        for (int j = 0; B && j < 6; j++) {
            row[foot + j] += B[6 * i + j];
        }
    }
    return solved;
}

/* Row i of the listed feet among those of all feet. */
static inline int row_of(const Step *step, int i) {
    return 6 * step->scratch->list[i / 6] + i % 6;
}

/* A row of numbers of the listed feet times `times`, to one of a matrix [6 feet][6 feet]. */
static inline void row_give(const Step *step, double times, const double *from, double *row) {
    for (int m = 0; 6 * m < step->n; m++) {
        Pair *const to = (Pair *)(row + 6 * step->scratch->list[m]);
        const Pair *const numbers = (const Pair *)(from + 6 * m);
        to[0] = times * numbers[0];
        to[1] = times * numbers[1];
        to[2] = times * numbers[2];
    }
}

/* P/dt of blocks_solve, to a matrix [6 feet][6 feet]. */
static void wrenches_give(const Step *step, double *to) {
    const int all = 6 * step->scratch->feet;
    for (int i = 0; to && i < step->n; i++) {
        row_give(step, 1.0 / step->input->dt, row_left(step, i), to + row_of(step, i) * all);
    }
}

/* A P, to the rows of the feet that touch nothing. */
static __attribute__((cold, noinline)) void others_give(const Step *step, double *to) {
    const MildScratch *scratch = step->scratch;
    const int all = 6 * scratch->feet;
    for (int i = 0; i < all * step->n; i++) {
        const int row = i / step->n, column = i % step->n;
        double sum = 0.0;
        if (scratch->place[row / 6] < 0 || scratch->foot[row / 6].active > 0) {
            continue;
        }
        for (int j = 0; j < step->n; j++) {
            sum += inertia_row(step, row / 6, row % 6, j / 6)[j % 6] * row_left(step, j)[column];
        }
        to[row * all + row_of(step, column)] = sum;
    }
}

/* dV/dV^ of blocks_solve, to a matrix [6 feet][6 feet]. */
static void twists_give(const Step *step, double *to) {
    const int all = 6 * step->scratch->feet;
    for (int i = 0; to && i < step->n; i++) {
        row_give(step, 1.0, row_right(step, i), to + row_of(step, i) * all);
    }
    if (to && step->n < all) {
        others_give(step, to);
    }
}

/* ---- differences ---- */

/* Turns R about axis k of the world. */
static void rotation_turn(double *R, int k, double angle) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const double c = cos(angle), s = sin(angle);
    for (int l = 0; l < 3; l++) {
        const double x = R[3 * i + l], y = R[3 * j + l];
        R[3 * i + l] = c * x - s * y;
        R[3 * j + l] = s * x + c * y;
    }
}

/* Moves every foot along degree of freedom k of its pose, to one side by a step. at: [feet] where
 * each is then. */
static __attribute__((cold)) void pose_move(MildContactInput *input, int k, double side,
                                            double *at) {
    for (int f = 0; f < input->feet; f++) {
        if (k < 3) {
            const double *p = input->position[f];
            const double far = fmax(fmax(fabs(p[0]), fabs(p[1])), fabs(p[2]));
            input->position[f][k] += side * STEP_LENGTH * (1.0 + far);
            at[f] = input->position[f][k];
        } else {
            rotation_turn(input->rotation[f], k - 3, side * STEP_ANGLE);
            at[f] = side * STEP_ANGLE;
        }
    }
}

/* The same of its present twist. */
static void twist_move(MildContactInput *input, int k, double side, double *at) {
    for (int f = 0; f < input->feet; f++) {
        input->velocity[f][k] += side * (k < 3 ? STEP_SPEED : STEP_SPIN);
        at[f] = input->velocity[f][k];
    }
}

typedef void Move(MildContactInput *input, int k, double side, double *at);

/* G, column k, of all feet: a foot's impulses at fixed twists depend on its own motion alone, so
 * all are moved at once. */
static void column_difference(const Step *step, Move *move, int k, double *G) {
    double low[TWIST_MAX], high[TWIST_MAX], from[MILD_FEET_MAX] = {0}, at[MILD_FEET_MAX] = {0};
    MildContactInput moved = *step->input;
    move(&moved, k, -1.0, from);
    law_at(step, step->terrain, &moved, low);
    moved = *step->input;
    move(&moved, k, 1.0, at);
    law_at(step, step->terrain, &moved, high);
    for (int i = 0; i < step->n; i++) {
        const int row = row_of(step, i);
        G[6 * i + k] = (high[row] - low[row]) / (at[row / 6] - from[row / 6]);
    }
}

/* dW by what `move` moves: [6 feet][6 feet]. */
static __attribute__((cold)) int by_motion(Step *step, Move *move, double *to) {
    Blocks G = {0.0};
    for (int k = 0; k < 6; k++) {
        column_difference(step, move, k, G);
    }
    const int solved = blocks_solve(step, G, 0.0);
    wrenches_give(step, to);
    return solved;
}

/* Bool: the number switches a rule off. */
static int switches_off(const MildField *field, double value) {
    return value == 0.0 && (field->offset == offsetof(MildMaterial, slip_length) ||
                            field->offset == offsetof(MildMaterial, grip) ||
                            field->offset == offsetof(MildMaterial, plate_width));
}

/* G of a field of a material, column k of the blocks: a central difference, or at an end of the
 * field's range one of three points to the inside, of the same order. */
static void field_difference(const Step *step, int material, const MildField *field, int k,
                             double *G) {
    static const double weights[2][3] = {{-0.5, 0.0, 0.5}, {-1.5, 2.0, -0.5}};
    MildTerrain terrain = *step->terrain;
    char *const at = (char *)&terrain.materials[material] + field->offset;
    double value, own[TWIST_MAX];
    memcpy(&value, at, sizeof value);
    for (int i = 0; i < step->n; i++) {
        G[6 * i + k] = 0.0;
    }
    if (!isfinite(value) || switches_off(field, value)) {
        return;
    }
    const double range = fmin(field->max - field->min, STEP_WIDEST);
    const double size = STEP_FIELD * fmax(fabs(value), STEP_RANGE * range);
    const int low = value - size<field->min, high = value + size> field->max;
    const double h = high ? -size : size;
    for (int j = 0; j < 3; j++) {
        const double weight = weights[low | high][j] / h;
        const double moved = value + (low | high ? j : j - 1) * h;
        memcpy(at, &moved, sizeof moved);
        law_at(step, &terrain, step->input, own);
        for (int i = 0; i < step->n; i++) {
            G[6 * i + k] += weight * own[row_of(step, i)];
        }
    }
}

/* dW by fields of a material, six at a time: each foot has a column of its own for a field. */
static __attribute__((cold)) int by_material(Step *step, const MildContactDerivative *derivative) {
    const int columns = derivative->field_count;
    int solved = 1;
    for (int c = 0; c < columns; c += 6) {
        Blocks G = {0.0};
        for (int k = 0; k < 6 && c + k < columns; k++) {
            field_difference(step, derivative->material,
                             &mild_material_fields[derivative->field[c + k]], k, G);
        }
        solved &= blocks_solve(step, G, 0.0);
        for (int i = 0; i < 6 * step->n; i++) {
            double sum = 0.0;
            for (int column = i % 6; column < step->n; column += 6) {
                sum += row_left(step, i / 6)[column];
            }
            if (c + i % 6 < columns) {
                derivative->wrench_by_material[row_of(step, i / 6) * columns + c + i % 6] =
                    sum / step->input->dt;
            }
        }
    }
    return solved;
}

/* All that is differenced. Returns false when the equations are singular. */
static __attribute__((cold, noinline)) int differenced(Step *step,
                                                       const MildContactDerivative *derivative) {
    int solved = 1;
    if (derivative->wrench_by_pose) {
        solved &= by_motion(step, pose_move, derivative->wrench_by_pose);
    }
    if (derivative->wrench_by_velocity) {
        solved &= by_motion(step, twist_move, derivative->wrench_by_velocity);
    }
    if (derivative->wrench_by_material) {
        solved &= by_material(step, derivative);
    }
    return solved;
}

/* ---- the function ---- */

static int is_differenced(const MildContactDerivative *derivative) {
    return derivative->wrench_by_pose || derivative->wrench_by_velocity ||
           derivative->wrench_by_material;
}

/* Bool: a field of a material that a derivative is wanted of is a number. */
static int field_is_number(int index) {
    return index >= 0 && index < mild_material_field_count &&
           mild_material_fields[index].type == MILD_FIELD_DOUBLE;
}

static __attribute__((noinline)) MildStatus
derivative_check(const MildGround *ground, const MildTerrain *terrain,
                 const MildContactInput *input, const MildScratch *scratch,
                 const MildContactResult *result, const MildContactDerivative *derivative,
                 MildError *error) {
    if (input->solver == MILD_SOLVER_EXPLICIT) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "derivative: the explicit solver solves no equations; take newton");
    }
    if (!result->converged) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "derivative: the step has not converged");
    }
    if (input->feet != scratch->feet) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "derivative: input.feet = %d, but the scratch has %d", input->feet,
                         scratch->feet);
    }
    const int needs = input->solver != MILD_SOLVER_NEWTON || is_differenced(derivative);
    const MildScratch *work = derivative->work;
    if (needs && (!work || work == scratch || !scratch_fits(work, ground))) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "derivative: this needs `work`, another scratch of the same soles");
    }
    if (derivative->wrench_by_material &&
        (derivative->material < 0 || derivative->material >= terrain->material_count)) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "derivative: material = %d, but the terrain has %d", derivative->material,
                         terrain->material_count);
    }
    if (derivative->wrench_by_material && (derivative->field_count < 0 || !derivative->field)) {
        return mild_fail(error, MILD_ERROR_RANGE, "derivative: field_count = %d, without a field",
                         derivative->field_count);
    }
    for (int c = 0; derivative->wrench_by_material && c < derivative->field_count; c++) {
        if (!field_is_number(derivative->field[c])) {
            return mild_fail(error, MILD_ERROR_RANGE,
                             "derivative: field[%d] = %d is no number of mild_material_fields", c,
                             derivative->field[c]);
        }
    }
    return MILD_OK;
}

/* Clears what is wanted, and writes the identity to dV/dV^. */
static void derivative_clear(const MildContactDerivative *derivative, int feet) {
    const size_t all = 6 * (size_t)feet;
    const struct {
        double *at;
        size_t count;
    } matrices[] = {{derivative->law, 6 * all},
                    {derivative->wrench_by_free, all * all},
                    {derivative->velocity_by_free, all * all},
                    {derivative->wrench_by_pose, all * all},
                    {derivative->wrench_by_velocity, all * all},
                    {derivative->wrench_by_material, all * (size_t)derivative->field_count}};
    for (size_t m = 0; m < sizeof matrices / sizeof *matrices; m++) {
        if (matrices[m].at) {
            memset(matrices[m].at, 0, matrices[m].count * sizeof(double));
        }
    }
    for (size_t i = 0; derivative->velocity_by_free && i < all; i++) {
        derivative->velocity_by_free[i * all + i] = 1.0;
    }
}

/* H and F of every listed foot, world. at: the scratch that holds the passes. Returns whether an F
 * may not be 0. */
static int blocks_of(Step *step, MildScratch *at, double *F) {
    int stops = 0;
    contact_hessian(at);
    /* what vectors read beyond */
    memset(step->H + 6 * step->n, 0, sizeof(Vector));
    memset(F + 6 * step->n, 0, sizeof(Vector));
    for (int k = 0; k < at->listed; k++, F += 36) {
        const int f = at->list[k];
        const FootScratch *foot = &at->foot[f];
        double *const H = step->H + 36 * k;
        memcpy(H, at->hessian[f], sizeof at->hessian[f]);
        block_to_world(foot, H);
        memset(F, 0, sizeof at->hessian[f]);
        if (foot->stops) {
            stops = 1;
            foot_free(foot, step->input, f, step->twist + 6 * f, F);
            block_to_world(foot, F);
        }
    }
    return stops;
}

/* dW/dV of each foot. */
static void law_slopes(const Step *step, double *to) {
    for (int i = 0; to && i < 6 * step->n; i++) {
        to[6 * row_of(step, i / 6) + i % 6] = -step->H[i] / step->input->dt;
    }
}

MildStatus mild_ground_derivative(const MildGround *ground, const MildTerrain *terrain,
                                  const MildContactInput *input, MildScratch *scratch,
                                  const MildContactResult *result,
                                  const MildContactDerivative *derivative, MildError *error) {
    const MildStatus status =
        derivative_check(ground, terrain, input, scratch, result, derivative, error);
    if (status != MILD_OK) {
        return status;
    }
    Blocks F;
    Step step;
    step.ground = ground;
    step.terrain = terrain;
    step.input = input;
    step.scratch = scratch;
    step.work = derivative->work;
    step.twist = result->velocity;
    step.n = 6 * scratch->listed;
    step.left = (step.n + NEWTON_VECTOR - 1) / NEWTON_VECTOR;
    step.rows = (Vector *)scratch->rows;
    if (scratch->listed < scratch->feet) { /* else all is written */
        derivative_clear(derivative, scratch->feet);
    }
    if (scratch->listed == 0) {
        return MILD_OK;
    }
    MildScratch *at = scratch;
    if (input->solver != MILD_SOLVER_NEWTON) { /* sweeps leave no derivatives */
        double impulse[TWIST_MAX];
        law_at(&step, terrain, input, impulse);
        at = step.work;
    }
    const int direct = blocks_of(&step, at, F);
    law_slopes(&step, derivative->law);
    int solved = 1;
    if (derivative->wrench_by_free || derivative->velocity_by_free) {
        solved &= blocks_solve(&step, direct ? F : NULL, 1.0);
        wrenches_give(&step, derivative->wrench_by_free);
        twists_give(&step, derivative->velocity_by_free);
    }
    if (is_differenced(derivative)) {
        solved &= differenced(&step, derivative);
    }
    return solved
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_RANGE,
                           "derivative: the equations are singular: is A positive semidefinite?");
}
