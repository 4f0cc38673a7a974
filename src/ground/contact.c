#include <string.h>

#include "ground/contact.h"

/* Forces of the slots back to the elements, in N. */
static void foot_scatter(MildScratch *scratch, int f, double rate) {
    FootScratch *foot = &scratch->foot[f];
    const Slots *s = &scratch->slot;
    for (int k = 0; k < foot->active; k++) {
        int i = foot->start + k, e = foot->element[k];
        foot->normal[e] = s->iz[i] * rate;
        foot->tangent_x[e] = s->ix[i] * rate;
        foot->tangent_y[e] = s->iy[i] * rate;
    }
}

static void foot_loaded(const MildScratch *scratch, int f, MildFootResult *result) {
    const FootScratch *foot = &scratch->foot[f];
    const Slots *s = &scratch->slot;
    double sum = 0.0, deepest = 0.0, loaded = 0.0;
    for (int i = foot->start; i < foot->start + foot->active; i++) {
        double on = s->iz[i] > 0.0 ? 1.0 : 0.0, depth = on * s->depth[i];
        loaded += on;
        sum += depth;
        deepest = depth > deepest ? depth : deepest;
    }
    result->contacts = (int)loaded;
    result->area = loaded * foot->pitch * foot->pitch;
    result->depth_max = deepest;
    result->depth_mean = loaded > 0.0 ? sum / loaded : 0.0;
}

/* Wrench and zero moment point. Paper eq 15: r = [F]x^+ tau, which for the true torque tau = p x F is F x tau/|F|^2, the
 * point of the wrench's central axis nearest the ankle. On the sole: the point where the horizontal torque vanishes. */
static void foot_result(const MildScratch *scratch, const MildContactInput *input, int f, MildFootResult *result) {
    const FootScratch *foot = &scratch->foot[f];
    const double *R = input->rotation[f];
    double *F = result->force, *tau = result->torque;
    for (int k = 0; k < 3; k++) {
        F[k] = scratch->wrench[6 * f + k] / input->dt;
        tau[k] = scratch->wrench[6 * f + 3 + k] / input->dt;
    }
    double square = F[0] * F[0] + F[1] * F[1] + F[2] * F[2];
    if (square > 0.0)
        for (int k = 0; k < 3; k++) {
            int i = (k + 1) % 3, j = (k + 2) % 3;
            result->zmp_axis[k] = (F[i] * tau[j] - F[j] * tau[i]) / square;
        }
    double z = R[6] * foot->center_x + R[7] * foot->center_y + R[8] * foot->z;
    if (F[2] > 0.0) {
        result->zmp_sole[0] = (z * F[0] - tau[1]) / F[2];
        result->zmp_sole[1] = (tau[0] + z * F[1]) / F[2];
    }
    foot_loaded(scratch, f, result);
}

void mild_ground_solve(const MildGround *ground, const MildTerrain *terrain, const MildContactInput *input,
                       MildScratch *scratch, MildContactResult *result) {
    memset(result, 0, sizeof *result);
    if (contact_prepare(ground, terrain, input, scratch) == 0) {
        memcpy(result->velocity, input->free_velocity, 6 * (size_t)scratch->feet * sizeof(double));
        result->converged = 1;
        return;
    }
    if (input->solver == MILD_SOLVER_GAUSS_SEIDEL)
        sweep_solve(scratch, input, result);
    else
        newton_solve(scratch, input, result);
    for (int f = 0; f < scratch->feet; f++) {
        if (scratch->foot[f].active == 0) continue;
        foot_scatter(scratch, f, 1.0 / input->dt);
        foot_result(scratch, input, f, &result->foot[f]);
    }
}
