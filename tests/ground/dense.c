#include "dense.h"

#include "ground/contact.h"
#include "ground/step.h" /* STEP_LAG */

#define DENSE_WIDE 0.1     /* [m/s] first stick region */
#define DENSE_NARROW 0.5   /* each is that much narrower */
#define DENSE_STEPS 60     /* of Newton's method in one region */
#define DENSE_ROUNDS 3000
#define DENSE_SMALL 1e-12  /* relative motion at which a method rests */
#define DENSE_JACOBI 60
#define DENSE_SINGULAR 1e-13 /* least eigenvalue by the largest */

/* ---- the element's law ---- */

/* P(u) = u_f/3 (1 - (1 - t)^3), t = min(u/u_f, 1): the flat area's integral over the depth, by the element's area. */
static double cone_share(const Dense *d, double u) {
    double left = 1.0 - fmin(u / d->full, 1.0);
    return d->full / 3.0 * (1.0 - left * left * left);
}

static double cone_force(const Dense *d, double u) {
    return (d->k_pen - d->kappa) * cone_share(d, u) + d->kappa * u;
}

static double cone_slope(const Dense *d, double u) {
    double left = 1.0 - fmin(u / d->full, 1.0);
    return (d->k_pen - d->kappa) * left * left + d->kappa;
}

/* Integral of the ground's force from m0 to m1: the unloading line up to a, virgin ground by Simpson's rule beyond, the bed
 * with its force at m1. */
static double law_work(const Dense *d, const DenseElement *e, double m1) {
    double from = fmax(e->m0 - e->slack, 0.0), to = fmax(fmin(m1, e->a) - e->slack, 0.0), way = m1 - e->a;
    double work = 0.5 * e->line * (to - from) * (to + from);
    if (way <= 0.0) return work;
    double simpson = (cone_force(d, e->a) + 4.0 * cone_force(d, e->a + 0.5 * way) + cone_force(d, m1)) / 6.0;
    return work + way * (simpson + d->bed_stiffness * fmax(m1 - d->bed, 0.0));
}

static double law_normal(const Dense *d, const DenseElement *e, double w) {
    double m1 = e->u0 + 0.5 * d->dt * w, way = m1 - e->m0, force = e->line * fmax(e->m0 - e->slack, 0.0);
    if (fabs(way) > 1e-16) force = law_work(d, e, m1) / way;
    if (fmin(m1, e->m0) > e->slack && m1 <= e->a) force = e->line * (0.5 * (e->m0 + m1) - e->slack); /* nothing cancels */
    double impulse = d->dt * force + e->mass * (fmax(w, e->reach) - e->w_a), down = fmax(w, 0.0);
    double before = d->drag < 1.0 ? fmin(down, e->w0) : e->w0;
    if (m1 > e->a)
        impulse += (d->mass_rate * cone_share(d, m1) - e->mass) * 0.5 * (d->drag * (before + down) + down - before);
    return fmax(impulse + d->dt * STEP_LAG * e->line * fmin(w + e->w0, 0.0), 0.0);
}

/* ---- the problem ---- */

static void rotate(double *x, double *z, double c, double s) {
    double turned = c * *x - s * *z;
    *z = s * *x + c * *z;
    *x = turned;
}

/* Eigenvectors of a symmetric matrix by Jacobi's rotations, scaled by the roots of the eigenvalues: A = L L^T. */
static void dense_factor(Dense *d, const double *A) {
    int n = d->n;
    double S[12][12], Q[12][12] = {{0}}, largest = 0.0;
    for (int i = 0; i < n; i++) {
        Q[i][i] = 1.0;
        for (int j = 0; j < n; j++) S[i][j] = 0.5 * (A[i * n + j] + A[j * n + i]);
    }
    for (int sweep = 0; sweep < DENSE_JACOBI; sweep++)
        for (int p = 0; p < n; p++)
            for (int q = p + 1; q < n; q++) {
                double angle = 0.5 * atan2(2.0 * S[p][q], S[q][q] - S[p][p]), c = cos(angle), s = sin(angle);
                if (S[p][q] == 0.0) continue;
                for (int k = 0; k < n; k++) rotate(&S[k][p], &S[k][q], c, s);
                for (int k = 0; k < n; k++) rotate(&S[p][k], &S[q][k], c, s);
                for (int k = 0; k < n; k++) rotate(&Q[k][p], &Q[k][q], c, s);
                S[p][q] = S[q][p] = 0.0;
            }
    for (int k = 0; k < n; k++) largest = fmax(largest, S[k][k]);
    for (int k = 0; k < n; k++) {
        if (S[k][k] <= DENSE_SINGULAR * largest) continue;
        for (int i = 0; i < n; i++) d->L[i][d->rank] = sqrt(S[k][k]) * Q[i][k];
        d->rank++;
    }
}

/* The line runs from (a, F(a)) to no force after recovery a, not within CONTACT_ELASTIC, and is never flatter than F at a;
 * in the bed the steepest slope is taken. */
static void element_line(const Dense *d, DenseElement *e) {
    double in_bed = fmax(e->a - d->bed, 0.0), force = cone_force(d, e->a) + d->bed_stiffness * in_bed;
    double travel = fmax(d->recovery * e->a, fmin(CONTACT_ELASTIC, e->a));
    double slope = in_bed > 0.0 ? fmax(d->k_pen, d->kappa) + d->bed_stiffness : cone_slope(d, e->a);
    e->line = travel > 0.0 ? fmax(force / travel, slope) : slope;
    e->slack = e->a - force / e->line;
}

static void dense_foot(Dense *d, const Kit *kit, int f) {
    const MildSole *sole = kit->soles[f];
    const MildMaterial *m = &kit->terrain.materials[0];
    const double *R = kit->input.rotation[f], *V = kit->input.velocity[f];
    Memory memory = ground_memory(kit->ground, f);
    for (int i = 0; i < mild_sole_elements(sole); i++) {
        DenseElement *e = &d->element[d->elements++];
        double x = mild_sole_x(sole)[i], y = mild_sole_y(sole)[i], z = mild_sole_z(sole), p[3], turn[3];
        for (int k = 0; k < 3; k++) p[k] = R[3 * k] * x + R[3 * k + 1] * y + R[3 * k + 2] * z;
        kit_cross(V + 3, p, turn);
        double w_now = -(V[2] + turn[2]);
        e->u0 = kit->terrain.height - kit->input.position[f][2] - p[2];
        e->w0 = fmax(w_now, 0.0);
        e->m0 = memory.middle[i] > 0.0 ? memory.middle[i] : e->u0 - 0.5 * d->dt * w_now;
        e->a = fmax(fmax(e->m0, memory.depth_max[i]), 0.0);
        e->reach = fmax(2.0 * (e->a - e->u0) / d->dt, 0.0);
        e->w_a = fmax(memory.front_speed[i], e->reach);
        e->mass = d->mass_rate * cone_share(d, e->a);
        e->radius = d->dt * m->k_drift * memory.drift[i] * fmax(e->u0, 0.0);
        e->damping = e->u0 > 0.0 ? d->dt * m->b_drift : 0.0;
        element_line(d, e);
        for (int c = -1; c < d->rank; c++) { /* -1: the free twist */
            double twist[6];
            for (int k = 0; k < 6; k++) twist[k] = c < 0 ? d->free[6 * f + k] : d->L[6 * f + k][c];
            kit_cross(twist + 3, p, turn);
            for (int k = 0; k < 3; k++) *(c < 0 ? &e->free[k] : &e->C[k][c]) = twist[k] + turn[k];
        }
    }
}

void dense_open(Dense *dense, const Kit *kit) {
    const MildMaterial *m = &kit->terrain.materials[0];
    double area = KIT_PITCH * KIT_PITCH;
    *dense = (Dense){.n = 6 * kit->feet, .dt = kit->input.dt};
    dense->k_pen = m->k_pen;
    dense->kappa = m->sigma_cone * area / cos(m->alpha);
    dense->full = sqrt(area / acos(-1.0)) * tan(m->alpha) / m->nu;
    dense->mass_rate = fmax(m->c_g, 0.0) * m->phi * m->rho * m->nu * area;
    dense->drag = fmax(m->c_d, 0.5);
    dense->bed = m->bed_depth;
    dense->bed_stiffness = LAW_BED_STRESS * area;
    dense->recovery = m->recovery;
    dense->mu = m->mu;
    memcpy(dense->free, kit->input.free_velocity, sizeof dense->free);
    dense_factor(dense, kit->input.inverse_inertia);
    for (int f = 0; f < kit->feet; f++) dense_foot(dense, kit, f);
}

/* ---- its minimum ---- */

static void element_velocity(const Dense *d, const DenseElement *e, const double *y, double *v) {
    for (int k = 0; k < 3; k++) {
        v[k] = e->free[k];
        for (int c = 0; c < d->rank; c++) v[k] += e->C[k][c] * y[c];
    }
}

/* Gradient y - sum C^T I and, if wanted, the Hessian 1 + sum C^T K C; the normal law's slope by difference. */
static void dense_gradient(const Dense *d, const double *y, double eps, double *g, double H[12][12]) {
    int n = d->rank;
    memcpy(g, y, 12 * sizeof *g);
    for (int r = 0; H && r < n; r++)
        for (int c = 0; c < n; c++) H[r][c] = r == c;
    for (int i = 0; i < d->elements; i++) {
        const DenseElement *e = &d->element[i];
        double v[3];
        element_velocity(d, e, y, v);
        double speed = hypot(v[0], v[1]), pull = d->bound[i] / fmax(speed, eps), drag = pull + e->damping;
        const double I[3] = {-drag * v[0], -drag * v[1], law_normal(d, e, -v[2])};
        for (int c = 0; c < n; c++) g[c] -= e->C[0][c] * I[0] + e->C[1][c] * I[1] + e->C[2][c] * I[2];
        if (!H) continue;
        double h = 1e-7, stiff = (law_normal(d, e, -v[2] + h) - law_normal(d, e, -v[2] - h)) / (2.0 * h);
        double nx = speed > eps ? v[0] / speed : 0.0, ny = speed > eps ? v[1] / speed : 0.0;
        double xx = drag - pull * nx * nx, xy = -pull * nx * ny, yy = drag - pull * ny * ny;
        if (drag == 0.0 && stiff == 0.0) continue;
        for (int r = 0; r < n; r++) {
            double X = xx * e->C[0][r] + xy * e->C[1][r], Y = xy * e->C[0][r] + yy * e->C[1][r], Z = stiff * e->C[2][r];
            for (int c = 0; c <= r; c++) H[r][c] += X * e->C[0][c] + Y * e->C[1][c] + Z * e->C[2][c];
        }
    }
}

/* x = -H^-1 g by Cholesky's method, in place of H's lower half. */
static void dense_direction(int n, double H[12][12], const double *g, double *x) {
    for (int j = 0; j < n; j++) {
        for (int k = 0; k < j; k++) H[j][j] -= H[j][k] * H[j][k];
        H[j][j] = sqrt(fmax(H[j][j], 0.5)); /* no eigenvalue is below 1 */
        for (int i = j + 1; i < n; i++) {
            for (int k = 0; k < j; k++) H[i][j] -= H[i][k] * H[j][k];
            H[i][j] /= H[j][j];
        }
    }
    for (int i = 0; i < n; i++) {
        x[i] = -g[i];
        for (int k = 0; k < i; k++) x[i] -= H[i][k] * x[k];
        x[i] /= H[i][i];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++) x[i] -= H[k][i] * x[k];
        x[i] /= H[i][i];
    }
}

static double dot(int n, const double *a, const double *b) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) sum += a[i] * b[i];
    return sum;
}

/* Slope of the function along the line, at y + t x. */
static double dense_along(const Dense *d, const double *y, const double *x, double eps, double t) {
    double at[12] = {0}, g[12];
    for (int i = 0; i < d->rank; i++) at[i] = y[i] + t * x[i];
    dense_gradient(d, at, eps, g, NULL);
    return dot(d->rank, g, x);
}

/* Where the slope along x vanishes: the lowest point of the line. A full step is kept that nearly reaches it. */
static double dense_line(const Dense *d, const double *y, const double *x, double eps, double slope) {
    double low = 0.0, high = 1.0, at = dense_along(d, y, x, eps, 1.0);
    if (fabs(at) <= 0.1 * fabs(slope)) return 1.0;
    for (int k = 0; k < 30 && at < 0.0; k++) {
        low = high;
        high *= 2.0;
        at = dense_along(d, y, x, eps, high);
    }
    for (int k = 0; k < 40; k++) {
        double middle = 0.5 * (low + high);
        *(dense_along(d, y, x, eps, middle) < 0.0 ? &low : &high) = middle;
    }
    return 0.5 * (low + high);
}

/* Newton's method with an exact line search at one width of the stick region; true when it rests. */
static int dense_region(Dense *d, double eps, double rest) {
    for (int k = 0; k < DENSE_STEPS; k++) {
        double g[12], H[12][12], x[12] = {0};
        dense_gradient(d, d->y, eps, g, H);
        dense_direction(d->rank, H, g, x);
        if (dot(d->rank, x, x) <= rest * rest * dot(d->rank, d->y, d->y)) return 1;
        double t = dense_line(d, d->y, x, eps, dot(d->rank, g, x));
        for (int i = 0; i < d->rank; i++) d->y[i] += t * x[i];
    }
    return 0;
}

/* The minimum at the present bounds. */
static int dense_minimum(Dense *d) {
    if (dense_region(d, CONTACT_SLIP_SPEED, DENSE_SMALL)) return 1;
    for (double eps = DENSE_WIDE; eps > CONTACT_SLIP_SPEED; eps *= DENSE_NARROW) dense_region(d, eps, 1e-6);
    return dense_region(d, CONTACT_SLIP_SPEED, DENSE_SMALL);
}

/* Moves every bound by a share of the way to what the normal impulses ask for. */
static void dense_bounds(Dense *d, double share) {
    for (int i = 0; i < d->elements; i++) {
        const DenseElement *e = &d->element[i];
        double v[3];
        element_velocity(d, e, d->y, v);
        d->bound[i] += share * (d->mu * law_normal(d, e, -v[2]) + e->radius - d->bound[i]);
    }
}

int dense_solve(Dense *d) {
    double share = 1.0, last = INFINITY;
    int settled = 0;
    for (int round = 0; round < DENSE_ROUNDS && !settled; round++) {
        double before[12], moved[12];
        memcpy(before, d->y, sizeof before);
        int found = dense_minimum(d);
        for (int i = 0; i < d->rank; i++) moved[i] = d->y[i] - before[i];
        double change = sqrt(dot(d->rank, moved, moved));
        settled = found && round > 1 && change <= share * DENSE_SMALL * sqrt(dot(d->rank, d->y, d->y));
        if (round % 16 == 15) { /* bounds that run to and fro come to rest by smaller moves */
            if (change > 0.5 * last) share = fmax(0.5 * share, 0.02);
            last = change;
        }
        dense_bounds(d, share);
    }
    for (int i = 0; i < d->n; i++) d->twist[i] = d->free[i] + dot(d->rank, d->L[i], d->y);
    return settled;
}

double dense_distance(const Dense *d, const double *one, const double *other) {
    double square = 0.0;
    for (int c = 0; c < d->rank; c++) { /* the columns of L are orthogonal */
        double along = 0.0, length = 0.0;
        for (int i = 0; i < d->n; i++) {
            along += d->L[i][c] * (one[i] - other[i]);
            length += d->L[i][c] * d->L[i][c];
        }
        square += along * along / (length * length);
    }
    return sqrt(square / dot(d->rank, d->y, d->y));
}
