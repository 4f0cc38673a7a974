/* Jacobians of the feet and A = J M^-1 J^T. A foot moves only with the base's six degrees of
 * freedom and the hinges between base and foot. The engine's factor M = L^T D L has the same
 * sparsity: a row contains a degree of freedom and its ancestors. So A = (L^-T J^T)^T D^-1 (L^-T
 * J^T) needs one backward substitution per foot. It runs on six right-hand sides at once, which is
 * one vector register per row. */
#include <string.h>

#include "robot/sim.h"

void foot_map_reference(const RobotSim *sim, int foot, double point[3]) {
    const RobotLimb *limb = &sim->robot->limb[foot];
    const double *body = sim->data->xpos + 3 * limb->body;
    memcpy(point, body, 3 * sizeof *point);
    if (limb->round) {
        const RobotFootDef *def = &sim->robot->def.foot[foot];
        const double *turn = sim->data->xmat + 9 * limb->body, *c = def->center;
        for (int k = 0; k < 3; k++) {
            point[k] += turn[3 * k] * c[0] + turn[3 * k + 1] * c[1] + turn[3 * k + 2] * c[2];
        }
        point[2] -= def->radius;
    }
}

/* One column of J: rotation about a unit axis through an anchor. arm: vector between the anchor and
 * the ankle. */
static void hinge_row(double *row, const double axis[3], const double arm[3]) {
    row[0] = axis[1] * arm[2] - axis[2] * arm[1];
    row[1] = axis[2] * arm[0] - axis[0] * arm[2];
    row[2] = axis[0] * arm[1] - axis[1] * arm[0];
    row[3] = axis[0];
    row[4] = axis[1];
    row[5] = axis[2];
}

static void foot_jacobian(RobotSim *sim, int foot) {
    const mjData *d = sim->data;
    const RobotLimb *limb = &sim->robot->limb[foot];
    const double *base = d->xpos + 3 * sim->robot->base_body;
    const double *turn = d->xmat + 9 * sim->robot->base_body;
    double(*rows)[ROBOT_LANES] = sim->map[foot].jacobian;
    double point[3];
    foot_map_reference(sim, foot, point);
    double arm[3] = {point[0] - base[0], point[1] - base[1], point[2] - base[2]};
    for (int k = 0; k < 3; k++) {
        memset(rows[k], 0, sizeof rows[k]);
        rows[k][k] = 1.0;                                     /* linear velocity: world axes */
        double axis[3] = {turn[k], turn[3 + k], turn[6 + k]}; /* angular velocity: base axes */
        hinge_row(rows[3 + k], axis, arm);
    }
    for (int k = 6; k < limb->dofs; k++) {
        int joint = limb->dof[k] - 5; /* one free joint, then hinges */
        const double *anchor = d->xanchor + 3 * joint;
        double reach[3] = {point[0] - anchor[0], point[1] - anchor[1], point[2] - anchor[2]};
        hinge_row(rows[k], d->xaxis + 3 * joint, reach);
    }
    for (int k = 0; k < limb->dofs && limb->round; k++) { /* a sphere transmits no moment */
        memset(rows[k] + 3, 0, 3 * sizeof(double));
    }
}

void foot_map_jacobian(RobotSim *sim) {
    for (int f = 0; f < sim->robot->def.feet; f++) {
        foot_jacobian(sim, f);
    }
}

void foot_map_shell(RobotSim *sim, int body) {
    foot_jacobian(sim, body);
}

void foot_map_twist(const RobotSim *sim, int foot, const double *velocity,
                    const double *acceleration, double twist[6]) {
    const RobotLimb *limb = &sim->robot->limb[foot];
    double sum[ROBOT_LANES] = {0};
    for (int k = 0; k < limb->dofs; k++) {
        int dof = limb->dof[k];
        double rate = velocity[dof] + (acceleration ? sim->dt * acceleration[dof] : 0.0);
        const double *row = sim->map[foot].jacobian[k];
        for (int c = 0; c < ROBOT_LANES; c++) {
            sum[c] += rate * row[c];
        }
    }
    memcpy(twist, sum, 6 * sizeof *twist);
}

/* rows <- L^-T rows, leaves first: subtracts L_ij times row i from row j of every ancestor j of
 * i. */
static void backward_substitute(const mjModel *m, const mjData *d, const RobotLimb *limb,
                                double rows[][ROBOT_LANES]) {
    for (int k = limb->dofs - 1; k > 0; k--) {
        const double *restrict factor = d->qLD + m->M_rowadr[limb->dof[k]];
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
    double sum[6][ROBOT_LANES] = {{0}}; /* kept in registers */
    for (int k = 0; k < rows; k++) {
        for (int r = 0; r < 6; r++) {
            // NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult): all are filled
            double scaled = inverse_d[k] * left[k][r];
#pragma omp simd
            for (int c = 0; c < ROBOT_LANES; c++) {
                sum[r][c] += scaled * right[k][c];
            }
        }
    }
    memcpy(block, sum, sizeof sum);
}

/* Block (f, g) of A and its mirror image. */
static void store_block(RobotSim *sim, int f, int g, double block[6][ROBOT_LANES]) {
    double *a = sim->input.inverse_inertia;
    int stride = 6 * sim->rows;
    for (int r = 0; r < 6; r++) {
        memcpy(a + (6 * f + r) * stride + 6 * g, block[r], 6 * sizeof *a);
        for (int c = 0; c < 6 && g < f; c++) {
            a[(6 * g + c) * stride + 6 * f + r] = block[r][c];
        }
    }
}

void foot_map_inverse_inertia(RobotSim *sim) {
    for (int i = 0; i < sim->rows; i++) {
        FootMap *map = &sim->map[sim->row[i]];
        const RobotLimb *limb = &sim->robot->limb[sim->row[i]];
        double inverse_d[ROBOT_FOOT_DOFS_MAX], block[6][ROBOT_LANES];
        for (int k = 0; k < limb->dofs; k++) {
            inverse_d[k] = sim->data->qLDiagInv[limb->dof[k]];
        }
        memcpy(map->half, map->jacobian, (size_t)limb->dofs * sizeof *map->half);
        backward_substitute(sim->model, sim->data, limb, map->half);
        for (int j = 0; j <= i; j++) { /* two bodies share only the leading rows */
            const int other = sim->row[j];
            inner_product(inverse_d, map->half, sim->map[other].half, limb->shared[other], block);
            store_block(sim, i, j, block);
        }
    }
}

/* x <- L^-1 x, root first. */
static void forward_substitute(const mjModel *m, const mjData *d, double *x) {
    for (int i = 1; i < m->nv; i++) {
        const double *factor = d->qLD + m->M_rowadr[i];
        const int *column = m->M_colind + m->M_rowadr[i];
        double sum = x[i];
        for (int j = 0; j < m->M_rownnz[i] - 1; j++) {
            sum -= factor[j] * x[column[j]];
        }
        x[i] = sum;
    }
}

void foot_map_wrench(const RobotSim *sim, double (*wrench)[6], double *force,
                     double *acceleration) {
    int nv = sim->robot->nv;
    memset(force, 0, (size_t)nv * sizeof *force);
    memset(acceleration, 0, (size_t)nv * sizeof *acceleration);
    for (int i = 0; i < sim->rows; i++) {
        const int b = sim->row[i];
        const RobotLimb *limb = &sim->robot->limb[b];
        for (int k = 0; k < limb->dofs; k++) {
            const double *row = sim->map[b].jacobian[k], *half = sim->map[b].half[k];
            double direct = 0.0, solved = 0.0;
            for (int c = 0; c < 6; c++) {
                direct += row[c] * wrench[i][c];
                solved += half[c] * wrench[i][c];
            }
            force[limb->dof[k]] += direct;
            acceleration[limb->dof[k]] += solved;
        }
    }
    for (int i = 0; i < nv; i++) {
        acceleration[i] *= sim->data->qLDiagInv[i];
    }
    forward_substitute(sim->model, sim->data, acceleration);
}
