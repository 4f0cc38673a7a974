#include <float.h>
#include <math.h>
#include <string.h>

#include "ground/law/frame.h"
#include "ground/law/friction.h"
#include "ground/step/step.h"

const char *const mild_solver_names[MILD_SOLVERS] = {"newton", "gauss_seidel", "explicit"};

/* Sums over the loaded elements: contact count, area, depths. Centre of pressure by the vertical
 * forces of all elements, loaded or not. */
static void foot_loaded(const MildScratch *scratch, const double *position, int f,
                        MildFootResult *result) {
    const FootScratch *foot = &scratch->foot[f];
    const Real frame[3] = {(Real)foot->frame[0], (Real)foot->frame[1], (Real)foot->frame[2]};
    const Real vertical[3] = {0, 0, 1};
    Real up[3]; /* the vertical in the frame of the foot */
    frame_of_world(frame, vertical, up);
    Lanes lanes[5] = {{0.0}};
    Lanes deep = {0.0};
    for (const Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
#pragma omp simd
        for (int i = 0; i < SLOT_LANES; i++) {
            const double on = s->iz[i] > 0.0 ? 1.0 : 0.0;
            const double depth = on * s->depth[i];
            const double lift = up[0] * s->ix[i] + up[1] * s->iy[i] + up[2] * s->iz[i];
            deep[i] = depth > deep[i] ? depth : deep[i];
            lanes[0][i] += depth;
            lanes[1][i] += on;
            lanes[2][i] += lift;
            lanes[3][i] += s->x[i] * lift;
            lanes[4][i] += s->y[i] * lift;
        }
    }
    double sums[5];
    lanes_sum(lanes, 5, sums);
    double deepest = 0.0; /* [m] */
    for (int i = 0; i < SLOT_LANES; i++) {
        deepest = fmax(deepest, deep[i]);
    }
    const double loaded = sums[1]; /* number of loaded elements */
    const double force = sums[2];  /* [N s] of the vertical impulses */
    result->contacts = (int)loaded;
    result->area = loaded * foot->pitch * foot->pitch;
    result->depth_max = deepest;
    if (!(loaded > 0.0)) {
        return;
    }
    result->depth_mean = sums[0] / loaded;
    const double z = foot->shell ? shell_loaded(foot, &result->area) : 0.0;
    for (int k = 0; k < 3 && force > 0.0; k++) {
        result->pressure_center[k] =
            position[k] + foot->arm[0][k] +
            (sums[3] * foot->arm[1][k] + sums[4] * foot->arm[2][k] + z * foot->arm[3][k]) / force;
    }
}

/* Paper eq 15: r = [F]x^+ tau. For the true torque tau = p x F this is F x tau/|F|^2, the point of
 * the wrench's central axis nearest to the ankle. F is first divided by its largest component,
 * because the square of a small force may underflow and that of a large one overflow. When almost
 * no force is left beside a torque, the axis lies out of range; the point is then 0, as without a
 * force. */
static void foot_axis(const double *F, const double *tau, double *point) {
    const double most = fmax(fmax(fabs(F[0]), fabs(F[1])), fabs(F[2]));
    if (!(most > 0.0)) {
        return;
    }
    const double n[3] = {F[0] / most, F[1] / most, F[2] / most};
    const double square = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) * most;
    double finite = 0.0;
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        point[k] = (n[i] * tau[j] - n[j] * tau[i]) / square;
        finite += 0.0 * point[k];
    }
    if (finite != 0.0) {
        memset(point, 0, 3 * sizeof *point);
    }
}

/* Wrench and zero moment points. zmp_sole is the point of the sole plane where the horizontal
 * torque vanishes. */
static void foot_result(const MildScratch *scratch, const MildContactInput *input, int f,
                        MildFootResult *result) {
    const FootScratch *foot = &scratch->foot[f];
    const double *R = input->rotation[f];
    double *F = result->force, *tau = result->torque, wrench[6];
    twist_to_world(foot, scratch->wrench + 6 * f, wrench);
    for (int k = 0; k < 3; k++) {
        F[k] = wrench[k] / input->dt;
        tau[k] = wrench[3 + k] / input->dt;
    }
    foot_axis(F, tau, result->zmp_axis);
    double z = R[6] * foot->center_x + R[7] * foot->center_y + R[8] * foot->z;
    if (F[2] > 0.0) {
        const double x = (z * F[0] - tau[1]) / F[2];
        const double y = (tau[0] + z * F[1]) / F[2];
        result->zmp_sole[0] = isfinite(x + y) ? x : 0.0;
        result->zmp_sole[1] = isfinite(x + y) ? y : 0.0;
    }
    foot_loaded(scratch, input->position[f], f, result);
}

/* Bool: all values are finite. Each is tested on its own, without a branch or a sum, so that the
 * tests do not wait for each other. */
static int finite(const double *values, int count) {
    int bad = 0;
    for (int i = 0; i < count; i++) {
        bad |= !(fabs(values[i]) <= DBL_MAX);
    }
    return !bad;
}

/* Bool: pose, motion and result are finite, and dt is positive. The pose must be checked on its
 * own, because a foot at NaN touches nothing and no equation fails. */
static int all_finite(const MildContactInput *input, const MildContactResult *result, int feet) {
    const double rate = 1.0 / input->dt;
    int all = finite(result->velocity, 6 * feet) & (rate > 0.0) & finite(&rate, 1);
    for (int f = 0; f < feet; f++) {
        const MildFootResult *foot = &result->foot[f];
        all &= finite(input->position[f], 3) & finite(input->rotation[f], 9) &
               finite(input->velocity[f], 6) & finite(foot->force, 3) & finite(foot->torque, 3) &
               finite(foot->zmp_axis, 3) & finite(foot->zmp_sole, 2) &
               finite(foot->pressure_center, 3);
    }
    return all;
}

/* V = V_free + A W of the feet that have rows. */
static void step_twists(const MildScratch *scratch, const MildContactInput *input,
                        MildContactResult *result) {
    const int stride = 6 * scratch->given;
    memcpy(result->velocity, input->free_velocity, 6 * (size_t)scratch->feet * sizeof(double));
    for (int f = 0; f < scratch->feet; f++) {
        if (scratch->place[f] < 0) {
            continue;
        }
        const double *row = input->inverse_inertia + 6 * scratch->place[f] * stride;
        for (int i = 0; i < 6; i++, row += stride) {
            double sum = result->velocity[6 * f + i];
            for (int k = 0; k < scratch->listed; k++) {
                const double *A = row + 6 * scratch->place[scratch->list[k]];
                const double *wrench = scratch->wrench + 6 * scratch->list[k];
                for (int j = 0; j < 6; j++) {
                    sum += A[j] * wrench[j];
                }
            }
            result->velocity[6 * f + i] = sum;
        }
    }
}

static void step_solve(MildScratch *scratch, const MildContactInput *input,
                       MildContactResult *result) {
    if (input->solver == MILD_SOLVER_NEWTON) {
        newton_solve(scratch, input, result);
    } else {
        sweep_solve(scratch, input, result);
    }
    step_twists(scratch, input, result);
}

void mild_ground_solve(const MildGround *ground, const MildTerrain *terrain,
                       const MildContactInput *input, MildScratch *scratch,
                       MildContactResult *result) {
    size_t bytes = 6 * (size_t)scratch->feet * sizeof(double);
    memset(result->foot, 0, (size_t)scratch->feet * sizeof *result->foot);
    result->residual = 0.0;
    result->iterations = result->converged = 0;
    scratch->is_number = 0;
    scratch->dt = input->dt;
    if (!scratch_fits(scratch, ground) || !input->inverse_inertia) {
        memcpy(result->velocity, input->free_velocity, bytes);
        return;
    }
    const MildContactInput *own = input;
    if (contact_prepare(ground, terrain, input, scratch) == 0) {
        memcpy(result->velocity, input->free_velocity, bytes);
        result->converged = 1;
    } else {
        own = input_of_world(scratch, input);
        energy_begin(scratch);
        step_solve(scratch, own, result);
        int iterations = result->iterations;
        const int rounds = input->solver == MILD_SOLVER_EXPLICIT ? 0 : ENERGY_ROUNDS;
        for (int round = 1; round <= rounds; round++) {
            if (!energy_created(scratch, own, result, round == rounds)) {
                break;
            }
            step_solve(scratch, own, result);
            iterations += result->iterations;
        }
        result->iterations = iterations;
    }
    memcpy(scratch->velocity, result->velocity, bytes);
    int nan = 0;
    for (int k = 0; k < scratch->listed; k++) {
        const int f = scratch->list[k];
        twist_to_world(&scratch->foot[f], result->velocity + 6 * f, result->velocity + 6 * f);
        foot_result(scratch, input, f, &result->foot[f]);
        nan |= scratch->foot[f].nan;
    }
    scratch->is_number = !nan && all_finite(input, result, scratch->feet);
    result->converged = result->converged && scratch->is_number;
}
