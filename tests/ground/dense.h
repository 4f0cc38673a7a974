/* The contact step solved once more, slowly and by other means: what the solvers of src/ground are held to.
 *
 * A = L L^T makes V = V^ + L y of every twist that impulses can reach, whatever the rank of A. With the bounds r of friction
 * held, the step is the minimum over y of a convex function,
 *     1/2 |y|^2 + sum over elements of  integral of -I_z dw  + r huber(|v|) + dt b_D |v|^2/2,
 * and |y - y*| <= |gradient|: a minimum found is the minimum. The bounds r = mu I_z + dt k_D d_D u then follow the normal
 * impulses, again and again, until nothing moves.
 *
 * Shared with the library: its constants and what it remembers between steps. */
#ifndef DENSE_H
#define DENSE_H

#include "ground_kit.h"

#define DENSE_ELEMENTS 192

/* One element: what it remembers, its unloading line, the drift's friction and how it moves with y. */
typedef struct {
    double u0, m0, a, w0, reach, w_a; /* [m], [m/s], as in docs/model.md section 6 */
    double line, slack;               /* [N/m], [m] */
    double mass;                      /* [kg] m_a(a) */
    double radius, damping;           /* [N s], [kg] */
    double free[3], C[3][12];         /* velocity at y = 0, and its change by y */
} DenseElement;

typedef struct {
    int n, rank, elements;
    double dt, free[12], L[12][12];
    double k_pen, kappa, full, mass_rate, drag; /* F_g = (k_pen - kappa) P + kappa u up to u_f; m_a = mass_rate P; c_d */
    double bed, bed_stiffness, recovery, mu;
    DenseElement element[DENSE_ELEMENTS];
    double bound[DENSE_ELEMENTS]; /* [N s] radius of friction */
    double y[12], twist[12];      /* the answer */
} Dense;

/* Reads the problem, not its solution, out of a kit on level ground of one passive developing cone. */
void dense_open(Dense *dense, const Kit *kit);
/* False when the bounds never settle. */
int dense_solve(Dense *dense);
/* Distance of two twists by what contact changed, V+ - V^ of the answer, all in the metric of kinetic energy: the root of a
 * quotient of energies, one number for metres and radians and for any rank of A. */
double dense_distance(const Dense *dense, const double *one, const double *other);

#endif
