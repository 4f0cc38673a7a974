#define POWER_CALLED /* power.h: no vector loop here needs a power */
#include <string.h>

#include "ground/law/friction.h"
#include "ground/law/impulse.h"
#include "ground/step/step.h"

#define SWEEP_TOLERANCE 1e-10 /* [-] of the wrench's change, unless the caller sets one */
#define SWEEP_LIMIT 1000      /* sweeps, unless the caller sets a limit */
/* [-] Sweeps go on until the elements' impulses change by less than this share. The wrench alone
 * may settle earlier: where a joint holds the feet, friction can change without moving them. */
#define SWEEP_REST 1e-6
/* [1/kg] Lower bound of G. A foot that cannot move sideways has G = 0, and beta would be
 * infinite. */
#define SWEEP_LEAST_G 1e-9

/* Algorithm 1 of the paper. The foot twists are kept up to date, so predicting a velocity costs
 * O(1) and a sweep costs O(N). The mean over the preceding elements in delta_rb is a running
 * mean. */
typedef struct {
    int n;                   /* rows: 6 for each foot that has rows in the input */
    double dt;               /* [s] */
    const int *place;        /* of each foot among these */
    const double *A;         /* [n][n] inverse inertia */
    int literal;             /* bool: MILD_SOLVER_EXPLICIT */
    double twist[TWIST_MAX]; /* [n] [m/s, rad/s] V^ + A W for the present impulses */
    /* Elements that this sweep has visited, foot by foot: */
    int preceding[MILD_FEET_MAX];    /* number of them */
    double before[MILD_FEET_MAX][2]; /* [m/s] sum of v_j - omega x p_j, horizontal */
    /* Elements that this sweep has visited, over all feet: */
    double changed; /* [N s] sum of the absolute changes of the impulses: e of Algorithm 1 */
    double total;   /* [N s] sum of the absolute impulses */
} Sweep;

/* Two rows of a foot, which has six. */
typedef double Two __attribute__((vector_size(2 * sizeof(double)), aligned(8), may_alias));

/* V += A B^T dI */
static void sweep_apply(Sweep *sweep, int f, const double *p, const double *change) {
    const double wrench[6] = {change[0],
                              change[1],
                              change[2],
                              p[1] * change[2] - p[2] * change[1],
                              p[2] * change[0] - p[0] * change[2],
                              p[0] * change[1] - p[1] * change[0]};
    const int n = sweep->n;
    const double *rows = sweep->A + 6 * sweep->place[f] * n; /* A is symmetric */
    for (int j = 0; j < n; j += 2) {
        Two *twist = (Two *)(sweep->twist + j);
        Two sum = *twist;
        for (int k = 0; k < 6; k++) {
            sum += *(const Two *)(rows + k * n + j) * wrench[k];
        }
        *twist = sum;
    }
}

/* Diagonal of G = B A B^T at one element: along x, along y, and along (-slope, 1), the normal
 * impulse's direction. */
static void element_inverse_mass(const Sweep *sweep, int f, const double *p, double a, double b,
                                 double *G) {
    const double J[3][6] = {{1, 0, 0, 0, p[2], -p[1]},
                            {0, 1, 0, -p[2], 0, p[0]},
                            {-a, -b, 1, p[1] + b * p[2], -p[0] - a * p[2], a * p[1] - b * p[0]}};
    const double *A = sweep->A + 6 * sweep->place[f] * (sweep->n + 1);
    for (int axis = 0; axis < 3; axis++) {
        G[axis] = 0.0;
        for (int i = 0; i < 6; i++) {
            for (int j = 0; j < 6; j++) {
                G[axis] += J[axis][i] * A[i * sweep->n + j] * J[axis][j];
            }
        }
    }
}

/* The normal impulse of a slot at the downward speed w. curves: of the ground under the foot. */
static Impulse slot_impulse(const Slots *s, int i, int curves, double dt, double w) {
    curves |= LAW_CONE | LAW_HEAP; /* no branches for these; a power is long */
    const Element element = slot_loaded(s, i, curves);
    return element_impulse(&element, curves, 1, dt, w);
}

/* Implicit normal impulse: one Newton step on I - I(w). An impulse dI slows the element by G_zz
 * dI. */
static double element_normal(const Slots *s, int i, int curves, double dt, double w, double G) {
    const Impulse target = slot_impulse(s, i, curves, dt, w);
    return fmax(s->iz[i] + (target.value - s->iz[i]) / (1.0 + G * target.slope), 0.0);
}

/* Paper eq 13: predict, correct by the continuity error, project onto the friction disc. Within the
 * disc the law is I = t of friction.h, so v = (dt f - I)/(dt^2 k + c), which is a compliance in
 * series with G. On the rim I has the direction of t, which any scale of t gives. */
static void element_friction(Slots *s, int i, const Real *v, const double *delta, double G) {
    double radius = s->mu[i] * s->iz[i] + s->drift_bound[i];     /* r [N s] */
    double stiff = s->hold_stiffness[i] + FRICTION_LAG * radius; /* dt^2 k + c [kg] */
    double compliance = stiff > 0.0 ? 1.0 / stiff : 0.0;         /* [1/kg] */
    double beta = 0.5 / (G + compliance);                        /* [kg] eq 13 */
    double gamma = 0.1 * beta;                                   /* [kg] eq 13 */
    double x = s->fx[i] - gamma * delta[0] - beta * (v[0] + compliance * (s->fx[i] - s->hold_x[i]));
    double y = s->fy[i] - gamma * delta[1] - beta * (v[1] + compliance * (s->fy[i] - s->hold_y[i]));
    double length = sqrt(x * x + y * y);
    double scale = length > radius ? radius / length : 1.0;
    s->fx[i] = x * scale;
    s->fy[i] = y * scale;
}

/* Normal impulse, friction and drift damping of one element at its velocities v and w. */
static void element_implicit(const Sweep *sweep, const FootScratch *foot, Slots *s, int i,
                             const double *v, double w, const double *delta, const double *G,
                             double G_xy) {
    const double old[3] = {s->ix[i], s->iy[i], s->iz[i]};
    const double fx = s->fx[i];
    const double fy = s->fy[i];
    s->iz[i] = element_normal(s, i, foot->curves, sweep->dt, w, G[2]);
    Real d[2] = {(Real)v[0], (Real)v[1]}; /* what friction opposes */
    if (foot->turned) {
        const Element element = slot_element(s, i);
        friction_turn(&element, &d[0], &d[1]);
    }
    element_friction(s, i, d, delta, G_xy);
    /* Drift damping is implicit, like the normal impulse. */
    double b = s->damping[i];
    double relax = 1.0 / (1.0 + b * G_xy);

    /* On a slope the normal impulse has a horizontal part, downhill. */
    double nx = s->slope_x[i] * s->iz[i];
    double ny = s->slope_y[i] * s->iz[i];

    /* Damping part of the horizontal impulse before this sweep. */
    double bx = old[0] + s->slope_x[i] * old[2] - fx;
    double by = old[1] + s->slope_y[i] * old[2] - fy;
    s->ix[i] = s->fx[i] + bx - relax * (b * d[0] + bx) - nx;
    s->iy[i] = s->fy[i] + by - relax * (b * d[1] + by) - ny;
}

/* ---- MILD_SOLVER_EXPLICIT: Algorithm 1 to the letter instead of the implicit sweep ---- */

/* Eqs 3 to 5: dt F_GM [N s] of the depth and the downward speed w before the step, on the way up
 * too. */
static double literal_normal(const Slots *s, int i, int curves, double dt, double w) {
    curves |= LAW_CONE | LAW_HEAP;
    const Element element = slot_loaded(s, i, curves);
    const double u = element.depth;
    double force = law_force(&element.law, curves, u) + law_elastic_force(&element.law, curves, u);
    force += element.law.drag_rate * law_moved_share(&element.law, curves, u) * w * w;
    return u > 0.0 ? dt * fmax(force, 0.0) : 0.0;
}

/* Eq 13 of a cone without anything else, at the velocity v. delta: [m/s] continuity error. G:
 * [1/kg] entry of B A B^T. */
static void literal_friction(Slots *s, int i, const double *v, const double *delta, double G) {
    const double beta = 0.5 / G; /* [kg] */
    const double gamma = 0.1 * beta;
    const double x = s->fx[i] - gamma * delta[0] - beta * v[0];
    const double y = s->fy[i] - gamma * delta[1] - beta * v[1];
    const double radius = s->mu[i] * s->iz[i];
    const double length = sqrt(x * x + y * y);
    const double scale = length > radius ? radius / length : 1.0;
    s->fx[i] = x * scale;
    s->fy[i] = y * scale;
    s->ix[i] = s->fx[i] - s->slope_x[i] * s->iz[i];
    s->iy[i] = s->fy[i] - s->slope_y[i] * s->iz[i];
}

/* Eq 14: drift resistance against the velocity before the step. */
static void literal_drift(const MildScratch *scratch, const MildContactInput *input) {
    for (int k = 0; k < scratch->listed; k++) {
        const int f = scratch->list[k];
        const FootScratch *foot = &scratch->foot[f];
        const Motion motion = foot_motion(foot, input->velocity[f]);
        for (int slot = 0; slot < foot->active; slot++) {
            Slots *s = slot_block(foot, slot);
            const int i = slot % SLOT_LANES;
            const SlotVelocity v = slot_velocity(s, i, &motion, SLOT_UNEVEN | SLOT_SHELL);
            const double speed = sqrt(v.x * v.x + v.y * v.y);
            const double drag = s->drift_bound[i] + s->damping[i] * speed;
            s->ix[i] -= speed > 0.0 ? drag * v.x / speed : 0.0;
            s->iy[i] -= speed > 0.0 ? drag * v.y / speed : 0.0;
        }
    }
}

/* ---- sweeps ---- */

/* One iteration of the inner loop of Algorithm 1. The change of impulse moves the feet at once. */
static void sweep_element(Sweep *sweep, const FootScratch *foot, int f, Slots *s, int i) {
    const double *V = sweep->twist + 6 * sweep->place[f];
    double p[3];
    slot_arm(foot, s, i, p);
    double turn[2] = {V[4] * p[2] - V[5] * p[1], V[5] * p[0] - V[3] * p[2]}; /* omega x p */
    double v[2] = {V[0] + turn[0], V[1] + turn[1]};                          /* [m/s] */
    double w = s->slope_x[i] * v[0] + s->slope_y[i] * v[1] - (V[2] + V[3] * p[1] - V[4] * p[0]);
    double delta[2] = {0.0, 0.0}; /* [m/s] continuity error */
    double G[3];                  /* [1/kg] diagonal of B A B^T */

    /* Paper eqs 11 and 12, with v_i - v_j - omega x (p_i - p_j) as a vector. */
    for (int k = 0; k < 2; k++) {
        if (sweep->preceding[f] > 0) {
            delta[k] = v[k] - turn[k] - sweep->before[f][k] / sweep->preceding[f];
        }
        sweep->before[f][k] += v[k] - turn[k];
    }
    sweep->preceding[f]++;
    element_inverse_mass(sweep, f, p, s->slope_x[i], s->slope_y[i], G);
    double G_xy = fmax(fmax(G[0], G[1]), SWEEP_LEAST_G);
    const double old[3] = {s->ix[i], s->iy[i], s->iz[i]};
    if (sweep->literal) {
        literal_friction(s, i, v, delta, G_xy);
    } else {
        element_implicit(sweep, foot, s, i, v, w, delta, G, G_xy);
    }
    const double change[3] = {s->ix[i] - old[0], s->iy[i] - old[1], s->iz[i] - old[2]};
    sweep->changed += fabs(change[0]) + fabs(change[1]) + fabs(change[2]);
    sweep->total += fabs(s->ix[i]) + fabs(s->iy[i]) + fabs(s->iz[i]);
    sweep_apply(sweep, f, p, change);
}

/* Start: I_xy = 0, I_z = dt F_GM at the present velocity. */
static void sweep_start(Sweep *sweep, MildScratch *scratch, const MildContactInput *input) {
    for (int f = 0; f < scratch->feet; f++) {
        if (scratch->place[f] >= 0) {
            memcpy(sweep->twist + 6 * scratch->place[f], input->free_velocity + 6 * f,
                   6 * sizeof(double));
        }
    }
    for (int k = 0; k < scratch->listed; k++) {
        const int f = scratch->list[k];
        const FootScratch *foot = &scratch->foot[f];
        const Motion motion = foot_motion(foot, input->velocity[f]);
        for (int slot = 0; slot < foot_end(foot); slot++) { /* clears the padding too */
            Slots *s = slot_block(foot, slot);
            const int i = slot % SLOT_LANES;
            double p[3];
            const SlotVelocity v = slot_velocity(s, i, &motion, SLOT_UNEVEN | SLOT_SHELL);
            slot_arm(foot, s, i, p);
            s->fx[i] = s->fy[i] = 0.0;
            s->iz[i] = sweep->literal
                           ? literal_normal(s, i, foot->curves, input->dt, v.descent)
                           : slot_impulse(s, i, foot->curves, input->dt, v.descent).value;
            s->ix[i] = -s->slope_x[i] * s->iz[i];
            s->iy[i] = -s->slope_y[i] * s->iz[i];
            sweep_apply(sweep, f, p, (const double[3]){s->ix[i], s->iy[i], s->iz[i]});
        }
    }
}

/* Sum of B^T I over the slots as they stand. wrench: [n] */
static void sweep_wrench(const MildScratch *scratch, double *wrench) {
    memset(wrench, 0, TWIST_MAX * sizeof *wrench);
    for (int k = 0; k < scratch->listed; k++) {
        const int f = scratch->list[k];
        double *W = wrench + 6 * scratch->place[f];
        for (int slot = 0; slot < scratch->foot[f].active; slot++) {
            const Slots *s = slot_block(&scratch->foot[f], slot);
            const int i = slot % SLOT_LANES;
            double p[3];
            slot_arm(&scratch->foot[f], s, i, p);
            W[0] += s->ix[i];
            W[1] += s->iy[i];
            W[2] += s->iz[i];
            W[3] += p[1] * s->iz[i] - p[2] * s->iy[i];
            W[4] += p[2] * s->ix[i] - p[0] * s->iz[i];
            W[5] += p[0] * s->iy[i] - p[1] * s->ix[i];
        }
    }
}

/* sqrt(x^T A x) with x = a - b, the distance in the metric of kinetic energy. */
static double sweep_distance(const Sweep *sweep, const double *a, const double *b) {
    double sum = 0.0;
    for (int i = 0; i < sweep->n; i++) {
        double row = 0.0;
        for (int j = 0; j < sweep->n; j++) {
            row += sweep->A[i * sweep->n + j] * (a[j] - b[j]);
        }
        sum += (a[i] - b[i]) * row;
    }
    return sqrt(fmax(sum, 0.0));
}

void sweep_solve(MildScratch *scratch, const MildContactInput *input, MildContactResult *result) {
    Sweep sweep = {.n = 6 * scratch->given,
                   .dt = input->dt,
                   .place = scratch->place,
                   .A = input->inverse_inertia,
                   .literal = input->solver == MILD_SOLVER_EXPLICIT};
    int limit = input->max_iterations > 0 ? input->max_iterations : SWEEP_LIMIT;
    int iterations = 0;
    double tolerance = input->tolerance > 0.0 ? input->tolerance : SWEEP_TOLERANCE;
    double change = INFINITY;                    /* of the wrench in the last sweep */
    double scale = 0.0;                          /* size of the wrench */
    double wrench[TWIST_MAX], before[TWIST_MAX]; /* after the sweep, and before it */
    const double zero[TWIST_MAX] = {0.0};
    sweep_start(&sweep, scratch, input);
    sweep_wrench(scratch, wrench);
    int rests = 0;
    while (iterations < limit && !(rests && change <= tolerance * scale)) {
        iterations++;
        sweep.changed = sweep.total = 0.0;
        memcpy(before, wrench, sizeof before);
        memset(sweep.before, 0, sizeof sweep.before);
        memset(sweep.preceding, 0, sizeof sweep.preceding);
        for (int k = 0; k < scratch->listed; k++) {
            const int f = scratch->list[k];
            const FootScratch *foot = &scratch->foot[f];
            for (int i = 0; i < foot->active; i++) {
                sweep_element(&sweep, foot, f, slot_block(foot, i), i % SLOT_LANES);
            }
        }
        sweep_wrench(scratch, wrench);
        change = sweep_distance(&sweep, wrench, before);
        scale = sweep_distance(&sweep, wrench, zero);
        rests = sweep.changed <= SWEEP_REST * sweep.total;
        if (isnan(change)) {
            break;
        }
    }
    if (sweep.literal) {
        literal_drift(scratch, input);
        sweep_wrench(scratch, wrench);
    }
    result->iterations = iterations;
    result->residual = scale > 0.0 ? change / scale : change;
    result->converged = rests && change <= tolerance * scale;
    memset(scratch->wrench, 0, sizeof scratch->wrench);
    for (int k = 0; k < scratch->listed; k++) {
        const int f = scratch->list[k];
        memcpy(scratch->wrench + 6 * f, wrench + 6 * scratch->place[f], 6 * sizeof *wrench);
    }
}
