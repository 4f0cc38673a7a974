#include "plugin/metric.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Exported by libmujoco, but not declared in its headers:
 * qDeriv = d (passive + actuator forces) / d qvel, the D of the implicit integrators. */
void mjd_smooth_vel(const mjModel *m, mjData *d, int flg_bias);

#define PIVOT 1e-14 /* smallest pivot of a factorisation */

int metric_alloc(Metric *metric, const mjModel *m) {
    const size_t nv = (size_t)m->nv, square = nv * nv;
    metric->dof = calloc(nv + 1, sizeof *metric->dof);
    metric->place = calloc(nv + 1, sizeof *metric->place);
    metric->tree = calloc((size_t)m->ntree + 1, sizeof *metric->tree);
    metric->inertia = calloc(square + 1, sizeof *metric->inertia);
    metric->factor = calloc(square + 1, sizeof *metric->factor);
    metric->stiff = calloc(square + 1, sizeof *metric->stiff);
    return metric->dof && metric->place && metric->tree && metric->inertia && metric->factor &&
           metric->stiff;
}

void metric_free(Metric *metric) {
    free(metric->dof);
    free(metric->place);
    free(metric->tree);
    free(metric->inertia);
    free(metric->factor);
    free(metric->stiff);
}

static int is_disabled(const mjModel *m, int flag) {
    return (m->opt.disableflags & flag) != 0;
}

/* Bool: Euler's method treats joint damping implicitly. */
static int euler_damps(const mjModel *m) {
    int damped = 0;
    for (int i = 0; i < m->nv; i++) {
        damped |= m->dof_damping[i] > 0;
    }
    return damped && !is_disabled(m, mjDSBL_EULERDAMP) && !is_disabled(m, mjDSBL_DAMPER);
}

int metric_is_step(const mjModel *m) {
    return m->opt.integrator == mjINT_DISCRETE ||
           (m->opt.integrator == mjINT_EULER && !euler_damps(m));
}

/* ---- rows: constraints, tendons, actuators ---- */

/* A sparse row vector over all degrees of freedom. */
typedef struct {
    const double *value;
    const int *column; /* NULL: value is dense */
    int count;
} Row;

static Row constraint_row(const mjModel *m, const mjData *d, int i) {
    if (!mj_isSparse(m)) {
        return (Row){d->efc_J + (size_t)i * (size_t)m->nv, NULL, (int)m->nv};
    }
    const int start = d->efc_J_rowadr[i];
    return (Row){d->efc_J + start, d->efc_J_colind + start, d->efc_J_rownnz[i]};
}

static int row_dof(const Row *row, int k) {
    return row->column ? row->column[k] : k;
}

/* Adds the trees that the row couples to one in use. Returns whether there was one. */
static int row_couple(Metric *metric, const mjModel *m, const Row *row) {
    int touches = 0, added = 0;
    for (int k = 0; k < row->count; k++) {
        touches |= row->value[k] != 0 && metric->tree[m->dof_treeid[row_dof(row, k)]];
    }
    for (int k = 0; k < row->count && touches; k++) {
        int *tree = &metric->tree[m->dof_treeid[row_dof(row, k)]];
        added |= row->value[k] != 0 && !*tree;
        *tree |= row->value[k] != 0;
    }
    return added;
}

/* matrix += scale row^T row. */
static void row_add(const Metric *metric, double *matrix, const Row *row, double scale) {
    for (int a = 0; a < row->count; a++) {
        const int i = metric->place[row_dof(row, a)];
        if (i < 0 || row->value[a] == 0) {
            continue;
        }
        double *line = matrix + (size_t)i * (size_t)metric->dofs;
        for (int b = 0; b < row->count; b++) {
            const int j = metric->place[row_dof(row, b)];
            if (j >= 0) {
                line[j] += scale * row->value[a] * row->value[b];
            }
        }
    }
}

/* Tendons and actuators with terms in the metric of `discrete`. Returns 0 after the last one. */
static int next_term(const mjModel *m, const mjData *d, int *at, int *output, Row *row,
                     double *scale) {
    if (!d->efm_active) {
        return 0;
    }
    if (*at < d->nefmT) {
        const int t = d->efm_tid[*at], start = m->ten_J_rowadr[t];
        *row = (Row){d->ten_J + start, m->ten_J_colind + start, m->ten_J_rownnz[t]};
        *scale = d->efm_ts[(*at)++];
        return 1;
    }
    while (*at < d->nefmT + d->nefmA) {
        const int k = *at - d->nefmT, a = d->efm_aid[k];
        if (*output == m->actuator_outnum[a]) {
            *output = 0;
            (*at)++;
            continue;
        }
        const int r = m->actuator_outadr[a] + (*output)++, start = d->moment_rowadr[r];
        *row = (Row){d->actuator_moment + start, d->moment_colind + start, d->moment_rownnz[r]};
        *scale = d->efm_as[k];
        return 1;
    }
    return 0;
}

/* ---- which degrees of freedom ---- */

static void couple_trees(Metric *metric, const mjModel *m, const mjData *d) {
    for (int added = 1; added;) {
        added = 0;
        for (int i = 0; i < d->nefc; i++) {
            const Row row = constraint_row(m, d, i);
            added |= row_couple(metric, m, &row);
        }
        Row row;
        double scale;
        for (int at = 0, output = 0; next_term(m, d, &at, &output, &row, &scale);) {
            added |= row_couple(metric, m, &row);
        }
    }
    metric->dofs = 0;
    for (int i = 0; i < m->nv; i++) {
        const int used = metric->tree[m->dof_treeid[i]];
        metric->place[i] = used ? metric->dofs : -1;
        if (used) {
            metric->dof[metric->dofs++] = i;
        }
    }
}

/* ---- the terms of N ---- */

/* Adds scale times a symmetric matrix in the sparsity of M, of which `value` has the lower
 * triangle. */
static void add_sparse(Metric *metric, const mjModel *m, const double *value, double scale) {
    const int n = metric->dofs;
    for (int i = 0; i < n; i++) {
        const int row = metric->dof[i], start = m->M_rowadr[row];
        for (int k = start; k < start + m->M_rownnz[row]; k++) {
            const int j = metric->place[m->M_colind[k]];
            metric->inertia[i * n + j] += scale * value[k];
            metric->inertia[j * n + i] += i == j ? 0 : scale * value[k];
        }
    }
}

static void add_diagonal(Metric *metric, const double *value, double scale) {
    for (int i = 0; i < metric->dofs; i++) {
        metric->inertia[i * metric->dofs + i] += scale * value[metric->dof[i]];
    }
}

/* - h qDeriv, symmetrised, in the sparsity of M: implicitfast. The derivatives of the Coriolis
 * forces that `implicit` adds are left out, for they are not symmetric. */
static void add_implicit(Metric *metric, const mjModel *m, mjData *d) {
    const int n = metric->dofs;
    mjd_smooth_vel(m, d, 0);
    for (int i = 0; i < n; i++) {
        const int row = metric->dof[i], start = m->M_rowadr[row];
        for (int k = start; k < start + m->M_rownnz[row]; k++) {
            const int j = metric->place[m->M_colind[k]];
            const double value = -m->opt.timestep * d->qDeriv[m->mapD2M[k]];
            metric->inertia[i * n + j] += value;
            metric->inertia[j * n + i] += i == j ? 0 : value;
        }
    }
}

/* h D + h^2 K of `discrete`: its own arrays. */
static void add_discrete(Metric *metric, const mjModel *m, const mjData *d) {
    Row row;
    double scale;
    if (!d->efm_active) {
        return;
    }
    if (d->efm_diag) {
        add_diagonal(metric, d->efm_diag, 1);
    }
    if (d->efm_fluid) {
        add_sparse(metric, m, d->efm_fluid, 1);
    }
    for (int at = 0, output = 0; next_term(m, d, &at, &output, &row, &scale);) {
        row_add(metric, metric->inertia, &row, scale);
    }
}

void metric_build(Metric *metric, const mjModel *m, mjData *d) {
    couple_trees(metric, m, d);
    const size_t square = (size_t)metric->dofs * (size_t)metric->dofs;
    memset(metric->inertia, 0, square * sizeof *metric->inertia);
    add_sparse(metric, m, d->M, 1);
    switch (m->opt.integrator) {
    case mjINT_IMPLICIT:
    case mjINT_IMPLICITFAST: add_implicit(metric, m, d); break;
    case mjINT_DISCRETE: add_discrete(metric, m, d); break;
    default:
        if (euler_damps(m)) {
            add_diagonal(metric, m->dof_damping, m->opt.timestep);
        }
    }
    memcpy(metric->factor, metric->inertia, square * sizeof *metric->factor);
    mju_cholFactor(metric->factor, metric->dofs, PIVOT);
}

/* ---- active constraints ---- */

/* D of a row while its state stays: that of the row where its force is linear in the acceleration,
 * 0 where it is constant. */
static double row_stiffness(const mjData *d, int i) {
    const double force = d->efc_force[i];
    switch (d->efc_type[i]) {
    case mjCNSTR_EQUALITY: return d->efc_D[i];
    case mjCNSTR_FRICTION_DOF:
    case mjCNSTR_FRICTION_TENDON: return fabs(force) < d->efc_frictionloss[i] ? d->efc_D[i] : 0;
    default: return force > 0 ? d->efc_D[i] : 0;
    }
}

/* An elliptic contact holds its tangential rows as well while it sticks. */
static int contact_sticks(const mjData *d, int first) {
    const mjContact *contact = d->contact + d->efc_id[first];
    const double *force = d->efc_force + first;
    double sum = 0;
    for (int k = 1; k < contact->dim; k++) {
        sum += force[k] * force[k] / (contact->friction[k - 1] * contact->friction[k - 1]);
    }
    return force[0] > 0 && sqrt(sum) < 0.999 * force[0];
}

int metric_stiffen(Metric *metric, const mjModel *m, const mjData *d) {
    const size_t square = (size_t)metric->dofs * (size_t)metric->dofs;
    int active = 0;
    memcpy(metric->stiff, metric->inertia, square * sizeof *metric->stiff);
    for (int i = 0; i < d->nefc; i++) {
        const int elliptic = d->efc_type[i] == mjCNSTR_CONTACT_ELLIPTIC;
        const int first = elliptic ? d->contact[d->efc_id[i]].efc_address : i;
        const double D = !elliptic || i == first    ? row_stiffness(d, i)
                         : contact_sticks(d, first) ? d->efc_D[i]
                                                    : 0;
        const Row row = constraint_row(m, d, i);
        if (D > 0) {
            row_add(metric, metric->stiff, &row, D);
            active = 1;
        }
    }
    mju_cholFactor(metric->stiff, metric->dofs, PIVOT);
    return active;
}

void metric_solve(const Metric *metric, const double *factor, double *x) {
    mju_cholSolve(x, factor, x, metric->dofs);
}
