/* Newton's method for a contact step. */
#include "ground/step/newton_step.h"

#define NEWTON_TOLERANCE 1e-9 /* [-] of the residual, unless the caller sets one */
#define NEWTON_ITERATIONS 400 /* Newton steps in all, unless the caller sets a limit */
#define NEWTON_PLAIN 20       /* plain steps before the friction bounds are held fixed */

/* The equations of the listed feet. */
static void system_open(System *system, const MildScratch *scratch, const MildContactInput *input) {
    const int n = 6 * scratch->listed, stride = 6 * scratch->given;
    system->n = n;
    system->parts = n / NEWTON_VECTOR + 1;
    system->A = (Vector *)scratch->rows;
    system->M = system->A + n * system->parts;
    row_clear(system, &system->free);
    for (int i = 0; i < n; i++) {
        const int row = 6 * scratch->place[scratch->list[i / 6]] + i % 6;
        double *to = (double *)(system->A + i * system->parts);
        memset(to, 0, (size_t)system->parts * sizeof(Vector));
        for (int k = 0; k < scratch->listed; k++) {
            memcpy(to + 6 * k,
                   input->inverse_inertia + row * stride + 6 * scratch->place[scratch->list[k]],
                   6 * sizeof(double));
        }
        system->free.at[i] = input->free_velocity[listed_row(scratch, i)];
    }
    system->tolerance = input->tolerance > 0.0 ? input->tolerance : NEWTON_TOLERANCE;
    system->limit = input->max_iterations > 0 ? input->max_iterations : NEWTON_ITERATIONS;
    system->dt = input->dt;
}

void newton_solve(MildScratch *scratch, const MildContactInput *input, MildContactResult *result) {
    System opened, *system = &opened;
    Point best;
    system_open(system, scratch, input);
    row_clear(system, &best.impulse);
    row_clear(system, &best.twist);
    best.residual = INFINITY;
    best.rests = 0;
    memset(scratch->wrench, 0, 6 * (size_t)scratch->feet * sizeof(double));
    for (int i = 0; i < system->n; i++) {
        best.twist.at[i] = input->velocity[scratch->list[i / 6]][i % 6];
    }
    contact_pass(scratch, system->dt, best.twist.at);
    const int limit = system->limit < NEWTON_PLAIN ? system->limit : NEWTON_PLAIN;
    int steps = newton_plain(system, scratch, &best, limit);
    result->converged = point_solves(system, &best);
    if (!result->converged) {
        steps += newton_patient(system, scratch, &best, system->limit - steps);
        contact_pass(scratch, system->dt, best.twist.at);
        result->converged = point_solves(system, &best);
    }
    double scale = system_norm(system, best.impulse.at);
    result->residual = scale > 0.0 ? best.residual / scale : best.residual;
    if (!result->converged) {
        steps += newton_unsolved(system, scratch, &best, result);
    }
    result->iterations = steps;
}
