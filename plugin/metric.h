/* Private to the plugin: the inertia that the integrator divides forces by.
 *
 *     v+ = v + h N^-1 (f + J_c^T f_c)
 *
 * N is M for Euler, M + h D with joint damping or under the implicit integrators, and
 * M + h D + h^2 K under `discrete`. The derivative of Coriolis forces, which is not symmetric, is
 * part of it under `implicit`, and under implicitfast and `discrete` for a rigid body on a free
 * joint. Ground forces must be computed with the same N, because the step would otherwise differ
 * from what the ground expects: with M in the place of M + h D robots with strong velocity feedback
 * become unstable.
 *
 * Only the degrees of freedom of the trees that the feet belong to, and of the trees that active
 * constraints and tendons couple to them, are part of a Metric. */
#ifndef PLUGIN_METRIC_H
#define PLUGIN_METRIC_H

#include <stdint.h>

#include <mujoco/mujoco.h>

typedef struct {
    int dofs;        /* in use */
    int *dof;        /* [dofs] ascending */
    int *place;      /* [nv] index into dof, or -1 */
    int *tree;       /* [ntree] bool: in use */
    double *inertia; /* [dofs][dofs] N, symmetric */
    double *factor;  /* [dofs][dofs] its Cholesky factor, lower */
    double *mass;    /* [dofs][dofs] M of MuJoCo's constraint solver: N where it gives the step */
    double *stiff;   /* [dofs][dofs] factor of N + J_c^T D_c' J_c, see metric_stiffen */
    double *held;    /* [dofs][dofs] factor of M + J_c^T D_c J_c */
    int skew;        /* bool: the integrator's N has Coriolis terms, which `inertia` has not */
    double *full;    /* [dofs][dofs] LU factors of N with Coriolis terms, but under `discrete` */
    int *pivot;      /* [dofs] rows that were exchanged */
    double *column;  /* [dofs] a vector of metric_integrate_all */
    uint64_t active; /* hash of the constraints in `stiff`; 0: none yet */
} Metric;

/* Returns 0 when out of memory; free with metric_free. */
int metric_alloc(Metric *metric, const mjModel *m);
void metric_free(Metric *metric);

/* Bool: the integrator is `discrete`, which MuJoCo has since 3.13. */
int metric_is_discrete(const mjModel *m);
/* Bool: the acceleration of MuJoCo's solver is the one that the integrator applies. */
int metric_is_step(const mjModel *m, const mjData *d);
/* Builds N for the trees whose flag in metric->tree is set, and those coupled to them. Needs
 * everything up to the actuator forces. */
void metric_build(Metric *metric, const mjModel *m, mjData *d);
/* x = N^-1 x in place, with the N of the integrator; [dofs]. */
void metric_integrate(const Metric *metric, double *x);
/* The same for `count` vectors side by side, [dofs][count]. */
void metric_integrate_all(const Metric *metric, int count, double *x);
/* Factors N + J_c^T D_c' J_c: how the velocity after the step responds to a force while the
 * constraints that are active now stay active. Needs the constraint forces. Returns 0 when the
 * constraints are those of the last call.
 *
 * The exact response N^-1 M (M + J_c^T D_c J_c)^-1 is not symmetric where M is not N. That with
 * D_c' = D_c N/M, the ratio of the row's degrees of freedom, is; it is exact for one alone. */
int metric_stiffen(Metric *metric, const mjModel *m, const mjData *d);
/* The same with given stiffnesses of the rows, [nefc]; and factors `held`. */
void metric_hold(Metric *metric, const mjModel *m, const mjData *d, const double *stiffness);
/* Row i of the constraints times x, and vector += scale times the row; [dofs]. */
double metric_row_times(const Metric *metric, const mjModel *m, const mjData *d, int i,
                        const double *x);
void metric_row_add(const Metric *metric, const mjModel *m, const mjData *d, int i, double scale,
                    double *vector);
/* x = factor^-1 x in place. factor: metric->factor, stiff or held; x: [dofs]. */
void metric_solve(const Metric *metric, const double *factor, double *x);

/* The same for `count` vectors side by side, [dofs][count]. */
void metric_solve_all(const Metric *metric, const double *factor, int count, double *x);

#endif
