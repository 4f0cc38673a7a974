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
 *     (1 + H A) dP = (F - H) dV^ + G dx,   dV = dV^ + A dP
 *
 * Nothing else is fixed during a solve: its bounds of friction are those of its own P when it
 * converges. Which elements have a reversal velocity (energy.c) is a branch, as sliding is; that
 * velocity is the element's before the step and follows pose and present twist. */
#define POWER_CALLED /* power.h: no vector loop here needs a power */
#include <stddef.h>
#include <string.h>

#include "ground/step/derivative_free.h"
#include "ground/step/newton_step.h"

/* Steps of the differences, at fixed twists. Lengths: above the rounding of a depth, 1e-17 m beside
 * the origin, and short, because the law has kinks. Speeds: above the same rounding over dt, and
 * short for the speed at which friction and the lag of elastic ground set in. */
#define STEP_LENGTH 5e-9 /* [m] and as many times the distance from the origin */
#define STEP_ANGLE 3e-8  /* [rad] */
#define STEP_SPEED 3e-7  /* [m/s] */
#define STEP_SPIN 3e-6   /* [rad/s] */
#define STEP_FIELD 1e-6  /* [-] of a field's value ... */
#define STEP_RANGE 1e-3  /* [-] ... or, where that is small, of this share of its range */
#define STEP_WIDEST 1e6  /* range of a field that has no end, in its unit */

#define STEP_GROWTH 8.0 /* [-] a larger elimination factor calls for a row exchange */

/* A block for each foot. */
typedef double Blocks[MILD_FEET_MAX][36];

/* A step whose derivatives are wanted. Impulses and twists are those of all feet, in the world. */
typedef struct {
    const MildGround *ground;
    const MildTerrain *terrain;
    const MildContactInput *input;
    MildScratch *scratch;
    MildScratch *work;   /* may be NULL */
    const double *twist; /* V [6 feet] */
    Blocks H;            /* of the listed feet */
    /* Equations of the listed feet, (1 + H A) X = R: n rows of `parts` vectors each, 1 + H A in the
     * first `left` of them and R, later X, behind. */
    int n, left, parts;
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

/* X of row i. */
static inline double *solution(const Step *step, int i) {
    return (double *)(step->rows + i * step->parts + step->left);
}

/* Row i of A for foot f, of the columns of the listed feet. */
static inline void inertia_row(const Step *step, int f, int i, Row *row) {
    const MildScratch *scratch = step->scratch;
    const double *A =
        step->input->inverse_inertia + (6 * scratch->place[f] + i) * 6 * scratch->given;
    row->part[step->left - 1] = (Vector){0.0};
    for (int m = 0; m < scratch->listed; m++) {
        memcpy(row->at + 6 * m, A + 6 * scratch->place[scratch->list[m]], 6 * sizeof *A);
    }
}

/* Rows of a foot, `parts` vectors apart: rows -= factor pivot. Written out, as in newton_step.c. */
static inline void six_less(Vector *rows, int parts, const double *factor, Vector pivot) {
    rows[0] -= factor[0] * pivot;
    rows[parts] -= factor[1] * pivot;
    rows[2 * parts] -= factor[2] * pivot;
    rows[3 * parts] -= factor[3] * pivot;
    rows[4 * parts] -= factor[4] * pivot;
    rows[5 * parts] -= factor[5] * pivot;
}

/* x_0 rows_0 + ... + x_5 rows_5 */
static inline Vector six_times(const Vector *rows, int parts, const double *x) {
    return x[0] * rows[0] + x[1] * rows[parts] + x[2] * rows[2 * parts] + x[3] * rows[3 * parts] +
           x[4] * rows[4 * parts] + x[5] * rows[5 * parts];
}

/* Begins the equations for so many columns, at most n: 1 + H A, and R = 0. */
static void equations_begin(Step *step, int columns) {
    step->left = (step->n + NEWTON_VECTOR - 1) / NEWTON_VECTOR;
    step->parts = step->left + (columns + NEWTON_VECTOR - 1) / NEWTON_VECTOR;
    memset(step->rows, 0, (size_t)(step->n * step->parts) * sizeof *step->rows);
    for (int k = 0; k < step->scratch->listed; k++) {
        const int f = step->scratch->list[k];
        Row A[6];
        for (int l = 0; l < 6; l++) {
            inertia_row(step, f, l, &A[l]);
        }
        for (int i = 0; i < 6; i++) {
            const double *h = step->H[f] + 6 * i;
            Vector *row = step->rows + (6 * k + i) * step->parts;
            for (int p = 0; p < step->left; p++) {
                row[p] = six_times(A[0].part + p, NEWTON_VECTORS, h);
            }
            ((double *)row)[6 * k + i] += 1.0;
        }
    }
}

/* Swaps row k with the one below it that has the largest number in column k. */
static __attribute__((cold, noinline)) void rows_choose(const Step *step, int k) {
    const int parts = step->parts;
    const double *column = (const double *)step->rows + k;
    const int stride = parts * NEWTON_VECTOR;
    int best = k;
    for (int i = k + 1; i < step->n; i++) {
        best = fabs(column[i * stride]) > fabs(column[best * stride]) ? i : best;
    }
    for (int p = 0; best != k && p < parts; p++) {
        const Vector swapped = step->rows[k * parts + p];
        step->rows[k * parts + p] = step->rows[best * parts + p];
        step->rows[best * parts + p] = swapped;
    }
}

/* Column k of the rows. Returns whether one below row k has too large a number there. */
static inline int column_take(const Step *step, int k, double *column) {
    const int stride = step->parts * NEWTON_VECTOR;
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

/* Solves the equations by Gauss-Jordan elimination. Returns false when they are singular. */
static int equations_solve(const Step *step) {
    const int n = step->n, parts = step->parts;
    for (int k = 0; k < n; k++) {
        double factor[TWIST_MAX];
        if (column_take(step, k, factor)) {
            rows_choose(step, k);
            column_take(step, k, factor);
        }
        if (!(fabs(factor[k]) > 0.0)) {
            return 0;
        }
        const double inverse = 1.0 / factor[k];
        for (int p = k / NEWTON_VECTOR; p < parts; p++) {
            const Vector scaled = inverse * step->rows[k * parts + p];
            for (int i = 0; i < n; i += 6) {
                six_less(step->rows + i * parts + p, parts, factor + i, scaled);
            }
            step->rows[k * parts + p] = scaled;
        }
    }
    return 1;
}

/* X of the equations whose R are blocks of the feet. */
static int blocks_solve(Step *step, Blocks blocks) {
    equations_begin(step, step->n);
    for (int i = 0; i < step->n; i++) {
        memcpy(solution(step, i) + i / 6 * 6, blocks[step->scratch->list[i / 6]] + 6 * (i % 6),
               6 * sizeof(double));
    }
    return equations_solve(step);
}

/* Adds a multiple of a row of X to that of a matrix [6 feet][6 feet]. */
static inline void row_add(const Step *step, double times, const double *X, double *row) {
    for (int m = 0; m < step->scratch->listed; m++) {
        double *to = row + 6 * step->scratch->list[m];
        for (int j = 0; j < 6; j++) {
            to[j] += times * X[6 * m + j];
        }
    }
}

/* Adds X/dt of blocks_solve to a matrix [6 feet][6 feet]. */
static void wrenches_add(const Step *step, double *to) {
    const int all = 6 * step->scratch->feet;
    for (int i = 0; to && i < step->n; i++) {
        const int row = 6 * step->scratch->list[i / 6] + i % 6;
        row_add(step, 1.0 / step->input->dt, solution(step, i), to + row * all);
    }
}

/* The same of A X. */
static void twists_add(const Step *step, double *to) {
    const int all = 6 * step->scratch->feet, parts = step->parts - step->left;
    for (int i = 0; to && i < all; i++) {
        if (step->scratch->place[i / 6] < 0) {
            continue;
        }
        Row A, sum;
        inertia_row(step, i / 6, i % 6, &A);
        for (int p = 0; p < parts; p++) {
            const Vector *X = step->rows + step->left + p;
            sum.part[p] = (Vector){0.0};
            for (int k = 0; k < step->n; k += 6) {
                sum.part[p] += six_times(X + k * step->parts, step->parts, A.at + k);
            }
        }
        row_add(step, 1.0, sum.at, to + i * all);
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
static void column_difference(const Step *step, Move *move, int k, Blocks G) {
    double low[TWIST_MAX], high[TWIST_MAX], from[MILD_FEET_MAX] = {0}, at[MILD_FEET_MAX] = {0};
    MildContactInput moved = *step->input;
    move(&moved, k, -1.0, from);
    law_at(step, step->terrain, &moved, low);
    moved = *step->input;
    move(&moved, k, 1.0, at);
    law_at(step, step->terrain, &moved, high);
    for (int i = 0; i < 6 * moved.feet; i++) {
        const int f = i / 6;
        G[f][i % 6 * 6 + k] = (high[i] - low[i]) / (at[f] - from[f]);
    }
}

/* Adds dW by what `move` moves: [6 feet][6 feet]. */
static __attribute__((cold)) int by_motion(Step *step, Move *move, double *to) {
    Blocks G;
    for (int k = 0; k < 6; k++) {
        column_difference(step, move, k, G);
    }
    const int solved = blocks_solve(step, G);
    wrenches_add(step, to);
    return solved;
}

/* Bool: the number switches a rule off. */
static int switches_off(const MildField *field, double value) {
    return value == 0.0 && (field->offset == offsetof(MildMaterial, slip_length) ||
                            field->offset == offsetof(MildMaterial, grip) ||
                            field->offset == offsetof(MildMaterial, plate_width));
}

/* G of a field of a material, [6 feet]: a central difference, or at an end of the field's range one
 * of three points to the inside, of the same order. */
static void field_difference(const Step *step, int material, const MildField *field,
                             double *impulse) {
    static const double weights[2][3] = {{-0.5, 0.0, 0.5}, {-1.5, 2.0, -0.5}};
    const int rows = 6 * step->input->feet;
    MildTerrain terrain = *step->terrain;
    char *const at = (char *)&terrain.materials[material] + field->offset;
    double value, own[TWIST_MAX];
    memcpy(&value, at, sizeof value);
    memset(impulse, 0, (size_t)rows * sizeof *impulse);
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
        for (int i = 0; i < rows; i++) {
            impulse[i] += weight * own[i];
        }
    }
}

static __attribute__((cold)) int by_material(Step *step, const MildContactDerivative *derivative) {
    const int columns = derivative->field_count;
    int solved = 1;
    for (int c = 0; c < columns; c++) {
        double impulse[TWIST_MAX];
        field_difference(step, derivative->material, &mild_material_fields[derivative->field[c]],
                         impulse);
        equations_begin(step, 1);
        for (int i = 0; i < step->n; i++) {
            *solution(step, i) = impulse[6 * step->scratch->list[i / 6] + i % 6];
        }
        solved &= equations_solve(step);
        for (int i = 0; i < step->n; i++) {
            const int row = 6 * step->scratch->list[i / 6] + i % 6;
            derivative->wrench_by_material[row * columns + c] =
                *solution(step, i) / step->input->dt;
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

/* H and F - H of every listed foot, world. at: the scratch that holds the passes. */
static void blocks_of(Step *step, MildScratch *at, Blocks moves) {
    int creates = 0;
    for (int m = 0; m < step->terrain->material_count; m++) {
        creates |= !step->terrain->materials[m].passive;
    }
    contact_hessian(at);
    for (int k = 0; k < at->listed; k++) {
        const int f = at->list[k];
        const FootScratch *foot = &at->foot[f];
        double *const H = step->H[f], *const move = moves[f], direct[36];
        memcpy(H, at->hessian[f], sizeof step->H[f]);
        block_to_world(foot, H);
        for (int i = 0; i < 36; i++) {
            move[i] = -H[i];
        }
        if (!foot->stops) {
            continue;
        }
        foot_free(foot, step->input, f, step->twist + 6 * f, creates, direct);
        block_to_world(foot, direct);
        for (int i = 0; i < 36; i++) {
            move[i] -= direct[i];
        }
    }
}

/* dW/dV of each foot. */
static void law_slopes(const Step *step, double *to) {
    for (int i = 0; to && i < 6 * step->n; i++) {
        const int f = step->scratch->list[i / 36];
        to[36 * f + i % 36] = -step->H[f][i % 36] / step->input->dt;
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
    Blocks moves;
    Step step;
    step.ground = ground;
    step.terrain = terrain;
    step.input = input;
    step.scratch = scratch;
    step.work = derivative->work;
    step.twist = result->velocity;
    step.n = 6 * scratch->listed;
    step.rows = (Vector *)scratch->rows;
    derivative_clear(derivative, scratch->feet);
    if (scratch->listed == 0) {
        return MILD_OK;
    }
    MildScratch *at = scratch;
    if (input->solver != MILD_SOLVER_NEWTON) { /* sweeps leave no derivatives */
        double impulse[TWIST_MAX];
        law_at(&step, terrain, input, impulse);
        at = step.work;
    }
    blocks_of(&step, at, moves);
    law_slopes(&step, derivative->law);
    int solved = 1;
    if (derivative->wrench_by_free || derivative->velocity_by_free) {
        solved &= blocks_solve(&step, moves);
        wrenches_add(&step, derivative->wrench_by_free);
        twists_add(&step, derivative->velocity_by_free);
    }
    if (is_differenced(derivative)) {
        solved &= differenced(&step, derivative);
    }
    return solved
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_RANGE,
                           "derivative: the equations are singular: is A positive semidefinite?");
}
