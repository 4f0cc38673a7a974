#include "plugin/rows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define HALVINGS 40 /* of the way to the trial */

int rows_are_simple(const mjData *d) {
    for (int i = 0; i < d->nefc; i++) {
        if (d->efc_type[i] == mjCNSTR_CONTACT_ELLIPTIC) {
            return 0;
        }
    }
    return d->nefc > 0;
}

static int has_friction(const mjData *d, int i) {
    return d->efc_type[i] == mjCNSTR_FRICTION_DOF || d->efc_type[i] == mjCNSTR_FRICTION_TENDON;
}

static int zone_of(const mjData *d, int i, double x) {
    const double linear = -d->efc_D[i] * x;
    if (d->efc_type[i] == mjCNSTR_EQUALITY) {
        return 1;
    }
    if (has_friction(d, i)) {
        return fabs(linear) < d->efc_frictionloss[i] ? 1 : linear > 0 ? 2 : 3;
    }
    return linear > 0;
}

static double force_in(const mjData *d, int i, int zone, double x) {
    switch (zone) {
    case 0: return 0;
    case 1: return -d->efc_D[i] * x;
    case 2: return d->efc_frictionloss[i];
    default: return -d->efc_frictionloss[i];
    }
}

int rows_alloc(Rows *rows, const mjModel *m) {
    const size_t nv = (size_t)m->nv + 1;
    rows->a = calloc(nv, sizeof *rows->a);
    rows->trial = calloc(nv, sizeof *rows->trial);
    rows->force = calloc(nv, sizeof *rows->force);
    rows->load = calloc(nv, sizeof *rows->load);
    rows->push = calloc(nv, sizeof *rows->push);
    return rows->a && rows->trial && rows->force && rows->load && rows->push;
}

static void free_rows(Rows *rows) {
    free(rows->zone);
    free(rows->stiffness);
    free(rows->x);
    free(rows->change);
}

void rows_free(Rows *rows) {
    free_rows(rows);
    free(rows->a);
    free(rows->trial);
    free(rows->force);
    free(rows->load);
    free(rows->push);
}

/* Room for `count` rows, whose contents are lost. */
static int reserve(Rows *rows, int count) {
    if (count <= rows->room) {
        return 1;
    }
    const size_t room = 2 * (size_t)count;
    free_rows(rows);
    rows->zone = calloc(room, sizeof *rows->zone);
    rows->stiffness = calloc(room, sizeof *rows->stiffness);
    rows->x = calloc(room, sizeof *rows->x);
    rows->change = calloc(room, sizeof *rows->change);
    const int good = rows->zone && rows->stiffness && rows->x && rows->change;
    rows->room = good ? (int)room : 0;
    return good;
}

int rows_start(Rows *rows, const Metric *metric, const mjModel *m, const mjData *d) {
    if (!reserve(rows, (int)d->nefc)) {
        return 0;
    }
    rows->count = (int)d->nefc;
    for (int i = 0; i < metric->dofs; i++) {
        rows->a[i] = d->qacc_warmstart[metric->dof[i]];
        rows->trial[i] = d->qacc_smooth[metric->dof[i]];
    }
    mju_mulMatVec(rows->force, metric->mass, rows->trial, metric->dofs, metric->dofs);
    for (int i = 0; i < rows->count; i++) {
        rows->x[i] = metric_row_times(metric, m, d, i, rows->a) - d->efc_aref[i];
        rows->zone[i] = 0;
    }
    return 1;
}

void rows_enter(Rows *rows, const Metric *metric, const mjModel *m, const mjData *d) {
    memcpy(rows->load, rows->force, (size_t)metric->dofs * sizeof *rows->load);
    for (int i = 0; i < rows->count; i++) {
        const int zone = zone_of(d, i, rows->x[i]);
        rows->zone[i] = zone;
        rows->stiffness[i] = zone == 1 ? d->efc_D[i] : 0;
        /* the force at a = 0: x = -aref */
        metric_row_add(metric, m, d, i, force_in(d, i, zone, -d->efc_aref[i]), rows->load);
    }
}

void rows_solve(Rows *rows, const Metric *metric) {
    for (int i = 0; i < metric->dofs; i++) {
        rows->trial[i] = rows->load[i] + rows->push[i];
    }
    metric_solve(metric, metric->held, rows->trial);
}

int rows_stay(const Rows *rows, const Metric *metric, const mjModel *m, const mjData *d) {
    for (int i = 0; i < rows->count; i++) {
        const double x = metric_row_times(metric, m, d, i, rows->trial) - d->efc_aref[i];
        if (zone_of(d, i, x) != rows->zone[i]) {
            return 0;
        }
    }
    return 1;
}

/* Slope of the energy at the share t of the way; `inertial` + t `growth` without constraints. */
static double slope(const Rows *rows, const mjData *d, double inertial, double growth, double t) {
    double sum = inertial + t * growth;
    for (int i = 0; i < rows->count; i++) {
        const double x = rows->x[i] + t * rows->change[i];
        sum -= rows->change[i] * force_in(d, i, zone_of(d, i, x), x);
    }
    return sum;
}

/* The ground's energy is convex, and its slope at the trial is that of the wrench there. So it lies
 * below a line of that slope through its value at the trial, and less of the sum is less of the
 * energy. */
void rows_move(Rows *rows, const Metric *metric, const mjModel *m, const mjData *d) {
    const int n = metric->dofs;
    double inertial = 0, growth = 0, low = 0, high = 1;
    for (int i = 0; i < n; i++) {
        rows->trial[i] -= rows->a[i]; /* now a step */
    }
    for (int i = 0; i < n; i++) {
        const double *row = metric->mass + (size_t)i * (size_t)n;
        inertial += rows->trial[i] * (mju_dot(row, rows->a, n) - rows->force[i] - rows->push[i]);
        growth += rows->trial[i] * mju_dot(row, rows->trial, n);
    }
    for (int i = 0; i < rows->count; i++) {
        rows->change[i] = metric_row_times(metric, m, d, i, rows->trial);
    }
    if (slope(rows, d, inertial, growth, 1) <= 0) {
        low = 1;
    }
    for (int k = 0; k < HALVINGS && low < 1; k++) {
        const double middle = 0.5 * (low + high);
        *(slope(rows, d, inertial, growth, middle) > 0 ? &high : &low) = middle;
    }
    mju_addToScl(rows->a, rows->trial, low, n);
    mju_addToScl(rows->x, rows->change, low, rows->count);
}
