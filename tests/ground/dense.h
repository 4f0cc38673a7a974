/* The contact step solved once more, slowly and by other means: what the solvers of src/ground are
 * held to.
 *
 * A = L L^T makes V = V^ + L y of every twist that impulses can reach, whatever the rank of A. With
 * the bounds r of friction held, the step is the minimum over y of a convex function, 1/2 |y|^2 +
 * sum over elements of  integral of -I_z dw  + (|t|^2 - max(|t| - r, 0)^2)/(2 k) + dt b_D |v|^2/2
 * with t = hold - k v, k = grip + r ELEMENT_LAG/FRICTION_ELASTIC, |y - y*| <= |gradient|: a minimum
 * found is the minimum. The bounds r = mu I_z + dt k_D d_D u then follow the normal impulses, again
 * and again, until nothing moves.
 *
 * Shared with the library: its constants and what it remembers between steps. */
#ifndef DENSE_H
#define DENSE_H

#include "ground_kit.h"

#define DENSE_ELEMENTS 192

/* What the ground under one element is made of; of two materials that blend, the mean. The forces
 * of the two curves are those at 10 mm; 0: the ground has no such curve. */
typedef struct {
    double k_pen, kappa, full;   /* [N/m], [N/m], [m]: F_g = (k_pen - kappa) P(u) + kappa u */
    double mass_rate, drag_rate; /* [kg/m] m_a = mass_rate P; drag_rate is c_d times that */
    double bed, bed_stiffness;   /* [m], [N/m] */
    double recovery, mu, k_drift, b_drift; /* of the material */
    double sinkage, sinkage_power;         /* [N], [-] pressure and sinkage under the element */
    double elastic, elastic_power, loss;   /* [N], [-], [s/m] without memory: F (1 + loss w) */
    double begin;                          /* [m] depth from which a heap closes; 0 under a cone */
    double projected, slip, grip;          /* [-], [1/m], [-] docs/model.md sections 21 and 22 */
    double weight;                         /* [N/m^3] of ground that is pushed away at the sides */
} DenseLaw;

/* One element: what it remembers, its unloading line, the drift's friction and how it moves with y.
 * Virgin ground begins at `front` with the force of the depth `deep`; only resistive force theory
 * tells them apart. */
typedef struct {
    DenseLaw law;
    double u0, m0, front, deep, w0, reach, w_a; /* [m], [m/s], as in docs/model.md section 6 */
    double seen;                                /* [m] greatest depth that its ground remembers */
    double line, slack;                         /* [N/m], [m] */
    double hit, still,
        stopped; /* [m/s], [-], [m] of the drag, see ground/law/begin.h; the last without m_a' */
    double mass,
        active; /* [kg] m_a(a); [N s] what parameters that create energy give, explicitly */
    double radius, damping; /* [N s], [kg] */
    double hold[2], grip;   /* [N s], [kg] friction that is held, see src/ground/law/friction.h */
    double before[2],
        turn[2];              /* [m/s] horizontal velocity before the step; where friction begins at
                                  minus it, that again, else 0 (docs/model.md section 17) */
    double free[4], C[4][12]; /* velocity and du/dt at y = 0, and their change by y */
} DenseElement;

typedef struct {
    int n, rank, elements;
    double dt, free[12], L[12][12];
    DenseElement element[DENSE_ELEMENTS];
    double bound[DENSE_ELEMENTS]; /* [N s] radius of friction */
    double y[12], twist[12];      /* the answer */
} Dense;

/* Reads the problem, not its solution, out of a kit on any ground. */
void dense_open(Dense *dense, const Kit *kit);
/* Goes on from `y` and `bound`, 0 when opened; false when the bounds never settle. Coulomb's law
 * can have several solutions. */
int dense_solve(Dense *dense);
/* Puts y and the bounds where these twists have them. */
void dense_start(Dense *dense, const double *twist);
/* Distance of two twists by what contact changed, V+ - V^ of the answer, all in the metric of
 * kinetic energy: the root of a quotient of energies, one number for metres and radians and for any
 * rank of A. */
double dense_distance(const Dense *dense, const double *one, const double *other);

#endif
