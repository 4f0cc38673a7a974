#include "plugin/metric.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Exported by libmujoco, but not declared in its headers:
 * qDeriv = d (passive + actuator forces) / d qvel, the D of the implicit integrators. */
void mjd_smooth_vel(const mjModel *m, mjData *d, int flg_bias);
#ifdef mjNPOLY
/* Damping of the actuator of a joint: returns the linear part, adds the others to poly. */
mjtNum mj_actuatorDamping(const mjModel *m, mjtObj type, int id, mjtNum poly[mjNPOLY]);
#endif

#define PIVOT 1e-14                                   /* smallest pivot of a factorisation */
#define HAS_LONE_BODIES (mjVERSION_HEADER >= 3011000) /* bool: see is_lone_body */
#define HAS_DISCRETE (mjVERSION_HEADER >= 3013000) /* bool: the integrator, and its arrays efm_ */

int metric_alloc(Metric *metric, const mjModel *m) {
    const size_t nv = (size_t)m->nv, square = nv * nv;
    metric->dof = calloc(nv + 1, sizeof *metric->dof);
    metric->place = calloc(nv + 1, sizeof *metric->place);
    metric->tree = calloc((size_t)m->ntree + 1, sizeof *metric->tree);
    metric->inertia = calloc(square + 1, sizeof *metric->inertia);
    metric->factor = calloc(square + 1, sizeof *metric->factor);
    metric->mass = calloc(square + 1, sizeof *metric->mass);
    metric->stiff = calloc(square + 1, sizeof *metric->stiff);
    metric->held = calloc(square + 1, sizeof *metric->held);
    metric->full = calloc(square + 1, sizeof *metric->full);
    metric->pivot = calloc(nv + 1, sizeof *metric->pivot);
    metric->column = calloc(nv + 1, sizeof *metric->column);
    return metric->dof && metric->place && metric->tree && metric->inertia && metric->factor &&
           metric->mass && metric->stiff && metric->held && metric->full && metric->pivot &&
           metric->column;
}

void metric_free(Metric *metric) {
    free(metric->dof);
    free(metric->place);
    free(metric->tree);
    free(metric->inertia);
    free(metric->factor);
    free(metric->mass);
    free(metric->stiff);
    free(metric->held);
    free(metric->full);
    free(metric->pivot);
    free(metric->column);
}

static int is_disabled(const mjModel *m, int flag) {
    return (m->opt.disableflags & flag) != 0;
}

/* [N m s/rad] Slope of the damping force a v + b v |v| + c v^3 of a degree of freedom. Before
 * MuJoCo 3.7 there is a alone, and no damping of actuators. */
static double damping_slope(const mjModel *m, const mjData *d, int dof) {
#ifdef mjNPOLY
    const double speed = fabs(d->qvel[dof]);
    double poly[mjNPOLY], power = 1;
    mju_copy(poly, m->dof_dampingpoly + (size_t)mjNPOLY * (size_t)dof, mjNPOLY);
    double slope =
        m->dof_damping[dof] + mj_actuatorDamping(m, mjOBJ_JOINT, m->dof_jntid[dof], poly);
    for (int k = 0; k < mjNPOLY; k++) {
        power *= speed;
        slope += (k + 2) * poly[k] * power;
    }
    return slope;
#else
    (void)d;
    return m->dof_damping[dof];
#endif
}

/* Bool: Euler's method treats joint damping implicitly. */
static int euler_damps(const mjModel *m, const mjData *d) {
    int damped = 0;
    for (int i = 0; i < m->nv; i++) {
        damped |= damping_slope(m, d, i) != 0;
    }
    return damped && !is_disabled(m, mjDSBL_EULERDAMP) && !is_disabled(m, mjDSBL_DAMPER);
}

int metric_is_discrete(const mjModel *m) {
#if HAS_DISCRETE
    return m->opt.integrator == mjINT_DISCRETE;
#else
    (void)m;
    return 0;
#endif
}

int metric_is_step(const mjModel *m, const mjData *d) {
    return metric_is_discrete(m) || (m->opt.integrator == mjINT_EULER && !euler_damps(m, d));
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
#if HAS_DISCRETE
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
#else
    (void)m, (void)d, (void)at, (void)output, (void)row, (void)scale;
#endif
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

static void add_euler(Metric *metric, const mjModel *m, const mjData *d) {
    for (int i = 0; i < metric->dofs && euler_damps(m, d); i++) {
        metric->inertia[i * metric->dofs + i] +=
            m->opt.timestep * damping_slope(m, d, metric->dof[i]);
    }
}

/* - h qDeriv in the sparsity of M: implicitfast. */
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

/* ---- N with the derivatives of Coriolis forces, which are not symmetric ---- */

/* Bool: a rigid body on a free joint, whose Coriolis forces implicitfast and `discrete` treat as
 * `implicit` does: since 3.11, and since 3.14 with other bodies fixed to it. */
static int is_lone_body(const mjModel *m, int tree) {
#if HAS_LONE_BODIES
    const int body = m->dof_bodyid[m->tree_dofadr[tree]];
    const int free = m->tree_dofnum[tree] == 6 && m->body_jntnum[body] == 1;
    return free && (mjVERSION_HEADER >= 3014000 || m->body_subtreemass[body] == m->body_mass[body]);
#else
    (void)m, (void)tree;
    return 0;
#endif
}

static int is_skew(const Metric *metric, const mjModel *m) {
    int lone = 0;
    for (int t = 0; t < m->ntree; t++) {
        lone |= metric->tree[t] && is_lone_body(m, t);
    }
    return m->opt.integrator == mjINT_IMPLICIT || (lone && m->opt.integrator != mjINT_EULER);
}

/* LU factors in place, with exchange of rows. */
static void factor_full(Metric *metric) {
    const int n = metric->dofs;
    double *a = metric->full;
    for (int p = 0; p < n; p++) {
        int best = p;
        for (int i = p + 1; i < n; i++) {
            best = fabs(a[i * n + p]) > fabs(a[best * n + p]) ? i : best;
        }
        metric->pivot[p] = best;
        for (int j = 0; j < n && best != p; j++) {
            const double other = a[p * n + j];
            a[p * n + j] = a[best * n + j];
            a[best * n + j] = other;
        }
        for (int i = p + 1; i < n; i++) {
            const double factor = a[i * n + p] /= a[p * n + p];
            for (int j = p + 1; j < n; j++) {
                a[i * n + j] -= factor * a[p * n + j];
            }
        }
    }
}

static void solve_full(const Metric *metric, double *x) {
    const int n = metric->dofs;
    const double *a = metric->full;
    for (int p = 0; p < n; p++) {
        const double other = x[metric->pivot[p]];
        x[metric->pivot[p]] = x[p];
        x[p] = other;
    }
    for (int i = 0; i < n; i++) {
        x[i] -= mju_dot(a + i * n, x, i);
    }
    for (int i = n - 1; i >= 0; i--) {
        x[i] = (x[i] - mju_dot(a + i * n + i + 1, x + i + 1, n - 1 - i)) / a[i * n + i];
    }
}

static void build_full(Metric *metric, const mjModel *m, mjData *d) {
    const int n = metric->dofs;
    memcpy(metric->full, metric->inertia, (size_t)n * (size_t)n * sizeof *metric->full);
    mjd_smooth_vel(m, d, 1);
    for (int i = 0; i < n; i++) {
        const int dof = metric->dof[i], start = m->D_rowadr[dof];
        double *row = metric->full + (size_t)i * (size_t)n;
        if (m->opt.integrator != mjINT_IMPLICIT && !is_lone_body(m, m->dof_treeid[dof])) {
            continue;
        }
        memcpy(row, metric->mass + (size_t)i * (size_t)n, (size_t)n * sizeof *row);
        for (int k = start; k < start + m->D_rownnz[dof]; k++) {
            row[metric->place[m->D_colind[k]]] -= m->opt.timestep * d->qDeriv[k];
        }
    }
    factor_full(metric);
}

/* h D + h^2 K of `discrete`: its own arrays. */
static void add_discrete(Metric *metric, const mjModel *m, const mjData *d) {
    Row row;
    double scale;
#if HAS_DISCRETE
    if (!d->efm_active) {
        return;
    }
    for (int i = 0; i < metric->dofs && d->efm_diag; i++) {
        metric->inertia[i * metric->dofs + i] += d->efm_diag[metric->dof[i]];
    }
    if (d->efm_fluid) {
        add_sparse(metric, m, d->efm_fluid, 1);
    }
#endif
    for (int at = 0, output = 0; next_term(m, d, &at, &output, &row, &scale);) {
        row_add(metric, metric->inertia, &row, scale);
    }
}

void metric_build(Metric *metric, const mjModel *m, mjData *d) {
    couple_trees(metric, m, d);
    const size_t square = (size_t)metric->dofs * (size_t)metric->dofs;
    memset(metric->inertia, 0, square * sizeof *metric->inertia);
    add_sparse(metric, m, d->M, 1);
    if (metric_is_discrete(m)) {
        add_discrete(metric, m, d);
    }
    memcpy(metric->mass, metric->inertia, square * sizeof *metric->mass);
    if (metric_is_discrete(m)) {
        /* its solver divides by N, too */
    } else if (m->opt.integrator == mjINT_EULER) {
        add_euler(metric, m, d);
    } else {
        add_implicit(metric, m, d);
    }
    memcpy(metric->factor, metric->inertia, square * sizeof *metric->factor);
    mju_cholFactor(metric->factor, metric->dofs, PIVOT);
    metric->active = 0;
    metric->skew = is_skew(metric, m);
    if (metric->skew && !metric_is_discrete(m)) {
        build_full(metric, m, d);
    }
}

void metric_integrate(const Metric *metric, double *x) {
    if (metric->skew) {
        solve_full(metric, x);
    } else {
        metric_solve(metric, metric->factor, x);
    }
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

/* D of row i in the present state, 0 when it does not respond. */
static double active_stiffness(const mjData *d, int i) {
    if (d->efc_type[i] != mjCNSTR_CONTACT_ELLIPTIC) {
        return row_stiffness(d, i);
    }
    const int first = d->contact[d->efc_id[i]].efc_address;
    if (i == first) {
        return row_stiffness(d, i);
    }
    return contact_sticks(d, first) ? d->efc_D[i] : 0;
}

/* Hash of the set of constraints that respond; above 0. */
static uint64_t active_set(const mjData *d) {
    uint64_t hash = 0xcbf29ce484222325u;
    for (int i = 0; i < d->nefc; i++) {
        hash = (hash ^ (uint64_t)(active_stiffness(d, i) > 0)) * 0x100000001b3u;
    }
    return hash | 1;
}

/* N/M of the degrees of freedom of a row. */
static double inertia_ratio(const Metric *metric, const Row *row) {
    double integrator = 0, solver = 0;
    for (int k = 0; k < row->count; k++) {
        const int i = metric->place[row_dof(row, k)];
        if (i >= 0) {
            const double square = row->value[k] * row->value[k];
            integrator += square * metric->inertia[i * metric->dofs + i];
            solver += square * metric->mass[i * metric->dofs + i];
        }
    }
    return solver > 0 ? integrator / solver : 1;
}

static void stiffen_row(Metric *metric, const mjModel *m, const mjData *d, int i, double D) {
    const Row row = constraint_row(m, d, i);
    if (D > 0) {
        row_add(metric, metric->stiff, &row, D * inertia_ratio(metric, &row));
    }
}

void metric_hold(Metric *metric, const mjModel *m, const mjData *d, const double *stiffness) {
    const size_t square = (size_t)metric->dofs * (size_t)metric->dofs;
    memcpy(metric->stiff, metric->inertia, square * sizeof *metric->stiff);
    memcpy(metric->held, metric->mass, square * sizeof *metric->held);
    for (int i = 0; i < d->nefc; i++) {
        const Row row = constraint_row(m, d, i);
        stiffen_row(metric, m, d, i, stiffness[i]);
        if (stiffness[i] > 0) {
            row_add(metric, metric->held, &row, stiffness[i]);
        }
    }
    mju_cholFactor(metric->stiff, metric->dofs, PIVOT);
    mju_cholFactor(metric->held, metric->dofs, PIVOT);
}

double metric_row_times(const Metric *metric, const mjModel *m, const mjData *d, int i,
                        const double *x) {
    const Row row = constraint_row(m, d, i);
    double sum = 0;
    for (int k = 0; k < row.count; k++) {
        const int at = metric->place[row_dof(&row, k)];
        sum += at >= 0 ? row.value[k] * x[at] : 0;
    }
    return sum;
}

void metric_row_add(const Metric *metric, const mjModel *m, const mjData *d, int i, double scale,
                    double *vector) {
    const Row row = constraint_row(m, d, i);
    for (int k = 0; k < row.count && scale != 0; k++) {
        const int at = metric->place[row_dof(&row, k)];
        if (at >= 0) {
            vector[at] += scale * row.value[k];
        }
    }
}

int metric_stiffen(Metric *metric, const mjModel *m, const mjData *d) {
    const size_t square = (size_t)metric->dofs * (size_t)metric->dofs;
    const uint64_t active = active_set(d);
    if (active == metric->active) {
        return 0;
    }
    metric->active = active;
    memcpy(metric->stiff, metric->inertia, square * sizeof *metric->stiff);
    for (int i = 0; i < d->nefc; i++) {
        stiffen_row(metric, m, d, i, active_stiffness(d, i));
    }
    mju_cholFactor(metric->stiff, metric->dofs, PIVOT);
    return 1;
}

void metric_solve(const Metric *metric, const double *factor, double *x) {
    mju_cholSolve(x, factor, x, metric->dofs);
}

/* x[i] -= scale x[j]; [count] */
static void row_subtract(double *restrict row, const double *restrict other, double scale,
                         int count) {
    for (int k = 0; k < count; k++) {
        row[k] -= scale * other[k];
    }
}

void metric_solve_all(const Metric *metric, const double *factor, int count, double *x) {
    const int n = metric->dofs;
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < i; j++) {
            row_subtract(x + i * count, x + j * count, factor[i * n + j], count);
        }
        mju_scl(x + i * count, x + i * count, 1 / factor[i * n + i], count);
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int j = i + 1; j < n; j++) {
            row_subtract(x + i * count, x + j * count, factor[j * n + i], count);
        }
        mju_scl(x + i * count, x + i * count, 1 / factor[i * n + i], count);
    }
}

void metric_integrate_all(const Metric *metric, int count, double *x) {
    const int n = metric->dofs;
    if (!metric->skew) {
        metric_solve_all(metric, metric->factor, count, x);
        return;
    }
    for (int k = 0; k < count; k++) {
        for (int i = 0; i < n; i++) {
            metric->column[i] = x[i * count + k];
        }
        solve_full(metric, metric->column);
        for (int i = 0; i < n; i++) {
            x[i * count + k] = metric->column[i];
        }
    }
}
