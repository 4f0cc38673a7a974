/* The feet seen from the robot's 18 degrees of freedom. A foot moves with the base's six and its
 * own leg's six only, and the engine's factor M = L^T D L has the same sparsity (a leg's rows hold
 * that leg and the base). So A = J M^-1 J^T = (L^-T J^T)^T D^-1 (L^-T J^T) needs one backward
 * substitution per foot on six right-hand sides at once, which is one vector register per row. */
#include <string.h>

#include "robot/sim.h"

/* Degree of freedom of row k of foot f. */
static int foot_dof(int foot, int k) {
    return k < ROBOT_LEG ? k : ROBOT_LEG * (1 + foot) + k - ROBOT_LEG;
}

/* One column of J: rotation about the unit axis through an anchor `arm` away from the ankle. */
static void hinge_row(double *row, const double axis[3], const double arm[3]) {
    row[0] = axis[1] * arm[2] - axis[2] * arm[1];
    row[1] = axis[2] * arm[0] - axis[0] * arm[2];
    row[2] = axis[0] * arm[1] - axis[1] * arm[0];
    row[3] = axis[0];
    row[4] = axis[1];
    row[5] = axis[2];
}

void foot_map_jacobian(RobotSim *sim) {
    const mjData *d = sim->data;
    const double *base = d->xpos + 3 * sim->robot->base_body;
    const double *turn = d->xmat + 9 * sim->robot->base_body;
    for (int f = 0; f < ROBOT_FEET; f++) {
        const double *ankle = d->xpos + 3 * sim->robot->foot_body[f];
        double(*rows)[ROBOT_LANES] = sim->map.jacobian[f];
        double arm[3] = {ankle[0] - base[0], ankle[1] - base[1], ankle[2] - base[2]};
        for (int k = 0; k < 3; k++) {
            memset(rows[k], 0, sizeof rows[k]);
            rows[k][k] = 1.0;                                     /* linear velocity: world axes */
            double axis[3] = {turn[k], turn[3 + k], turn[6 + k]}; /* angular velocity: base axes */
            hinge_row(rows[3 + k], axis, arm);
        }
        for (int k = 0; k < ROBOT_LEG; k++) {
            int joint = 1 + ROBOT_LEG * f + k;
            const double *anchor = d->xanchor + 3 * joint;
            double reach[3] = {ankle[0] - anchor[0], ankle[1] - anchor[1], ankle[2] - anchor[2]};
            hinge_row(rows[ROBOT_LEG + k], d->xaxis + 3 * joint, reach);
        }
    }
}

void foot_map_twist(const RobotSim *sim, int foot, const double *velocity,
                    const double *acceleration, double twist[6]) {
    double sum[ROBOT_LANES] = {0};
    for (int k = 0; k < ROBOT_FOOT_DOFS; k++) {
        int dof = foot_dof(foot, k);
        double rate = velocity[dof] + (acceleration ? sim->dt * acceleration[dof] : 0.0);
        const double *row = sim->map.jacobian[foot][k];
        for (int c = 0; c < ROBOT_LANES; c++) {
            sum[c] += rate * row[c];
        }
    }
    memcpy(twist, sum, 6 * sizeof *twist);
}

/* rows <- L^-T rows, leaves first: row j of every ancestor j of i loses L_ij times row i. */
static void backward_substitute(const mjModel *m, const mjData *d, int foot,
                                double rows[ROBOT_FOOT_DOFS][ROBOT_LANES]) {
    for (int k = ROBOT_FOOT_DOFS - 1; k > 0; k--) {
        const double *restrict factor = d->qLD + m->M_rowadr[foot_dof(foot, k)];
        const double *restrict mine = rows[k];
        for (int j = 0; j < k; j++) {
            double *restrict ancestor = rows[j];
#pragma omp simd
            for (int c = 0; c < ROBOT_LANES; c++) {
                ancestor[c] -= factor[j] * mine[c];
            }
        }
    }
}

/* block = sum over rows k of outer(left_k, right_k) / D_k. */
static void inner_product(const double *inverse_d, const double left[][ROBOT_LANES],
                          const double right[][ROBOT_LANES], int rows,
                          double block[6][ROBOT_LANES]) {
    double sum[6][ROBOT_LANES] = {{0}}; /* stays in registers */
    for (int k = 0; k < rows; k++) {
        for (int r = 0; r < 6; r++) {
            double scaled = inverse_d[k] * left[k][r];
#pragma omp simd
            for (int c = 0; c < ROBOT_LANES; c++) {
                sum[r][c] += scaled * right[k][c];
            }
        }
    }
    memcpy(block, sum, sizeof sum);
}

void foot_map_inverse_inertia(RobotSim *sim) {
    FootMap *map = &sim->map;
    double *a = sim->input.inverse_inertia;
    memcpy(map->half, map->jacobian, sizeof map->half);
    for (int f = 0; f < ROBOT_FEET; f++) {
        double inverse_d[ROBOT_FOOT_DOFS], block[6][ROBOT_LANES];
        for (int k = 0; k < ROBOT_FOOT_DOFS; k++) {
            inverse_d[k] = sim->data->qLDiagInv[foot_dof(f, k)];
        }
        backward_substitute(sim->model, sim->data, f, map->half[f]);
        for (int g = 0; g <= f; g++) { /* feet share the base's rows only */
            inner_product(inverse_d, map->half[f], map->half[g],
                          f == g ? ROBOT_FOOT_DOFS : ROBOT_LEG, block);
            for (int r = 0; r < 6; r++) {
                memcpy(a + (6 * f + r) * 12 + 6 * g, block[r], 6 * sizeof *a);
                for (int c = 0; c < 6 && g < f; c++) {
                    a[(6 * g + c) * 12 + 6 * f + r] = block[r][c];
                }
            }
        }
    }
}

/* x <- L^-1 x, root first. */
static void forward_substitute(const mjModel *m, const mjData *d, double *x) {
    for (int i = 1; i < ROBOT_NV; i++) {
        const double *factor = d->qLD + m->M_rowadr[i];
        const int *column = m->M_colind + m->M_rowadr[i];
        double sum = x[i];
        for (int j = 0; j < m->M_rownnz[i] - 1; j++) {
            sum -= factor[j] * x[column[j]];
        }
        x[i] = sum;
    }
}

void foot_map_wrench(const RobotSim *sim, double wrench[ROBOT_FEET][6], double *force,
                     double *acceleration) {
    memset(force, 0, ROBOT_NV * sizeof *force);
    memset(acceleration, 0, ROBOT_NV * sizeof *acceleration);
    for (int f = 0; f < ROBOT_FEET; f++) {
        for (int k = 0; k < ROBOT_FOOT_DOFS; k++) {
            const double *row = sim->map.jacobian[f][k], *half = sim->map.half[f][k];
            double direct = 0.0, solved = 0.0;
            for (int c = 0; c < 6; c++) {
                direct += row[c] * wrench[f][c];
                solved += half[c] * wrench[f][c];
            }
            force[foot_dof(f, k)] += direct;
            acceleration[foot_dof(f, k)] += solved;
        }
    }
    for (int i = 0; i < ROBOT_NV; i++) {
        acceleration[i] *= sim->data->qLDiagInv[i];
    }
    forward_substitute(sim->model, sim->data, acceleration);
}
