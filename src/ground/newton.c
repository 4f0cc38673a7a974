/* Newton's method for a contact step. */
#include "ground/newton_hard.h"

#define NEWTON_TOLERANCE 1e-9 /* [-] of the residual, unless the caller sets one */
#define NEWTON_ITERATIONS 400 /* Newton steps in all, unless the caller sets a limit */
#define NEWTON_PLAIN 20       /* plain steps before the friction bounds are held fixed */

/* The equations of the n rows from `first` on. */
static void system_open(System *system, const MildScratch *scratch, const MildContactInput *input,
                        int first, int n) {
    int stride = 6 * scratch->feet;
    system->first = first;
    system->n = n;
    system->parts = n / NEWTON_VECTOR + 1;
    for (int i = 0; i < n; i++) {
        row_load(system, &system->A[i], input->inverse_inertia + (first + i) * stride + first);
    }
    row_load(system, &system->free, input->free_velocity + first);
    system->tolerance = input->tolerance > 0.0 ? input->tolerance : NEWTON_TOLERANCE;
    system->limit = input->max_iterations > 0 ? input->max_iterations : NEWTON_ITERATIONS;
    system->dt = input->dt;
}

/* Solves for the n rows from `first` on. */
static void system_solve(MildScratch *scratch, const MildContactInput *input, int first, int n,
                         MildContactResult *result) {
    System opened, *system = &opened;
    Point best = {.residual = INFINITY};
    system_open(system, scratch, input, first, n);
    row_load(system, &best.twist, input->velocity[first / 6]);
    contact_pass(scratch, system->dt, best.twist.at, system->first);
    const int limit = system->limit < NEWTON_PLAIN ? system->limit : NEWTON_PLAIN;
    int steps = newton_plain(system, scratch, &best, limit);
    result->converged = point_solves(system, &best);
    if (!result->converged) {
        steps += newton_patient(system, scratch, &best, system->limit - steps);
        contact_pass(scratch, system->dt, best.twist.at, system->first);
        result->converged = point_solves(system, &best);
    }
    double scale = system_norm(system, best.impulse.at);
    result->residual = scale > 0.0 ? best.residual / scale : best.residual;
    if (!result->converged) {
        steps += newton_unsolved(system, scratch, &best, result);
    }
    result->iterations = steps;
}

void newton_solve(MildScratch *scratch, const MildContactInput *input, MildContactResult *result) {
    int stride = 6 * scratch->feet, first = 0, end = scratch->feet;
    while (scratch->foot[first].active == 0) {
        first++;
    }
    while (scratch->foot[end - 1].active == 0) {
        end--;
    }
    memset(scratch->wrench, 0, sizeof scratch->wrench);
    for (int f = first; f < end; f++) { /* clear feet in the air between loaded ones */
        if (scratch->foot[f].active == 0) {
            memset(scratch->hessian[f], 0, sizeof scratch->hessian[f]);
        }
    }
    system_solve(scratch, input, 6 * first, 6 * (end - first), result);
    for (int i = 0; i < stride; i++) {
        double sum = input->free_velocity[i];
        for (int j = 6 * first; j < 6 * end; j++) {
            sum += input->inverse_inertia[i * stride + j] * scratch->wrench[j];
        }
        result->velocity[i] = sum;
    }
}
