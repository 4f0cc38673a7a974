/* What the ground is made of, for dense.c: a material's law, of two that blend, and of a part of an
 * element. */
#ifndef DENSE_LAW_H
#define DENSE_LAW_H

#include <math.h>

#include "dense.h"
#include "ground/law/element_law.h"

/* A force that grows with a power of the depth, as the dense reference takes it: from docs/model.md
 * section 19, by libm and quadrature. */

#define DENSE_ROUND 1e-4 /* [m] within which it is straight */
#define DENSE_DEPTH 0.01 /* [m] at which it is given */

/* F z q^((n - 1)/2) with z = u/10 mm and q = (u^2 + e^2)/(10 mm)^2. */
static inline double power_at(double force, double n, double u) {
    double z = u / DENSE_DEPTH, e = DENSE_ROUND / DENSE_DEPTH;
    return force * z * pow(z * z + e * e, 0.5 * (n - 1.0));
}

/* Its derivative: F q^((n - 3)/2) (n z^2 + e^2), by the depth. */
static inline double power_rise(double force, double n, double u) {
    double z = u / DENSE_DEPTH, e = DENSE_ROUND / DENSE_DEPTH;
    return force / DENSE_DEPTH * pow(z * z + e * e, 0.5 * (n - 3.0)) * (n * z * z + e * e);
}

/* Its mean from the depth u over a way down: Gauss's rule of eight points on pieces that are short
 * beside the distance to the curve's poles at +-e i. */
static inline double power_mean(double force, double n, double u, double way) {
    static const double place[4] = {0.18343464249564980, 0.52553240991632899, 0.79666647741362674,
                                    0.96028985649753623};
    static const double weight[4] = {0.36268378337836198, 0.31370664587788729, 0.22238103445337447,
                                     0.10122853629037626};
    double sum = 0.0;
    if (force == 0.0) {
        return 0.0;
    }
    for (double done = 0.0, piece; done < 1.0; done += piece) {
        double at = u + done * way, short_way = 0.5 * hypot(at, DENSE_ROUND);
        piece = way > (1.0 - done) * 1e-9 ? fmin(1.0 - done, short_way / way) : 1.0 - done;
        for (int k = 0; k < 8; k++) {
            double x = k < 4 ? place[k] : -place[k - 4];
            double here = at + 0.5 * piece * way * (1.0 + x);
            sum += 0.5 * piece * weight[k % 4] * power_at(force, n, here);
        }
    }
    return sum;
}

static int is_resistive(const MildMaterial *m) {
    return m->model == MILD_MODEL_ECC_QUASI || m->model == MILD_MODEL_ECC_QUASI_3D;
}

/* A cone that is complete at once: yielding springs, resistive force theory, and ground that is
 * nothing but a bed below its other curve. */
static int is_straight(const MildMaterial *m) {
    return is_resistive(m) || m->model == MILD_MODEL_CON_SPRING ||
           m->model == MILD_MODEL_ECC_SPRING || m->model == MILD_MODEL_BEKKER ||
           m->model == MILD_MODEL_HUNT_CROSSLEY;
}

/* Bekker: (k_c/b + k_phi) z^n on the element's area. Hunt and Crossley: k_pen u at 10 mm, damped by
 * 3/2 d; it springs back whole. */
static void law_curve(const MildMaterial *m, double area, double k_pen, DenseLaw *law) {
    if (m->model == MILD_MODEL_BEKKER) {
        law->sinkage = (m->k_c / m->plate_width + m->k_phi) * pow(DENSE_DEPTH, m->exponent) * area;
        law->sinkage_power = m->exponent;
    } else if (m->model == MILD_MODEL_HUNT_CROSSLEY) {
        law->elastic = k_pen * DENSE_DEPTH;
        law->elastic_power = m->exponent;
        law->loss = 1.5 * m->dissipation;
        law->recovery = 1.0;
    }
}

/* Of an element of that pitch. Stiffness, drift and cone are those of the paper's element, by area;
 * of a concentric model those of the whole sole. heap: where the heap of the element begins
 * to close, and its width, by the radius of a disc of the paper's element. */
static DenseLaw law_material(const MildMaterial *m, double pitch, const double heap[2]) {
    double area = pitch * pitch, c_g = m->passive ? fmax(m->c_g, 0.0) : m->c_g,
           c_d = m->passive ? fmax(m->c_d, 0.5) : m->c_d;
    int whole = m->model == MILD_MODEL_CON_CONE || m->model == MILD_MODEL_CON_SPRING;
    double square = whole ? area : 0.0195 * 0.0195, k_pen = m->k_pen * (area / square);
    DenseLaw law = {.bed = m->bed_depth,
                    .bed_stiffness = LAW_BED_STRESS * area,
                    .recovery = is_resistive(m) ? 0.0 : m->recovery,
                    .mu = m->mu,
                    .k_drift = m->k_drift * (area / square),
                    .b_drift = m->b_drift * (area / square)};
    if (is_straight(m)) {
        int spring = m->model == MILD_MODEL_CON_SPRING || m->model == MILD_MODEL_ECC_SPRING;
        law.k_pen = law.kappa = is_resistive(m) ? m->zeta * LAW_RESIST_STRESS * area
                                : spring        ? k_pen
                                                : 0.0;
        law.full = LAW_LINE_DEPTH;
        law_curve(m, area, k_pen, &law);
        return law;
    }
    law.k_pen = k_pen;
    law.kappa = m->sigma_cone * area / cos(m->alpha);
    law.full = sqrt(square / acos(-1.0)) * tan(m->alpha) / m->nu;
    if (m->model == MILD_MODEL_MILD_MERGED) {
        law.begin = law.full * heap[0];
        law.full *= heap[1];
        law.projected = 1.0;
    }
    if (m->slip_length > 0.0) {
        law.slip = 1.0 / m->slip_length;
        law.grip = m->grip;
        law.weight = m->grip > 0.0 ? m->phi * m->rho * 9.81 : 0.0;
        law.k_drift = law.b_drift = 0.0;
    }
    law.mass_rate = c_g * m->phi * m->rho * m->nu * area;
    law.drag_rate = c_d * law.mass_rate;
    return law;
}

/* The power of a curve that only one of two laws has, and its damping, stay as they are. */
static void law_alone(double one, double other, double *a, double *b) {
    if (one == 0.0) {
        *a = *b;
    } else if (other == 0.0) {
        *b = *a;
    }
}

/* All numbers of one law change linearly into the other's. */
static DenseLaw law_blend(const DenseLaw *one, const DenseLaw *other, double share) {
    enum { NUMBERS = sizeof(DenseLaw) / sizeof(double) };
    double a[NUMBERS], b[NUMBERS];
    DenseLaw law, from = *one, to = *other;
    law_alone(one->sinkage, other->sinkage, &from.sinkage_power, &to.sinkage_power);
    law_alone(one->elastic, other->elastic, &from.elastic_power, &to.elastic_power);
    law_alone(one->elastic, other->elastic, &from.loss, &to.loss);
    memcpy(a, &from, sizeof a);
    memcpy(b, &to, sizeof b);
    for (int k = 0; k < NUMBERS; k++) {
        a[k] = (1.0 - share) * a[k] + share * b[k];
    }
    memcpy(&law, a, sizeof a);
    law.recovery = law.elastic > 0.0 ? 1.0 : law.recovery; /* part of it has no memory */
    return law;
}

/* All that makes force or mass, times a share. */
static void law_times(DenseLaw *law, double share) {
    double *const forces[] = {&law->k_pen,     &law->kappa,         &law->mass_rate,
                              &law->drag_rate, &law->bed_stiffness, &law->k_drift,
                              &law->b_drift,   &law->sinkage,       &law->elastic};
    for (size_t k = 0; k < sizeof forces / sizeof *forces; k++) {
        *forces[k] *= share;
    }
}

/* P(u) = u_f/3 (1 - (1 - t)^3), t = min(u/u_f, 1): the flat area's integral over the depth, by the
 * element's area. */
static double cone_share(const DenseLaw *law, double u) {
    double left = 1.0 - fmin(fmax(u - law->begin, 0.0) / law->full, 1.0);
    return fmin(u, law->begin) + law->full / 3.0 * (1.0 - left * left * left);
}

/* Share of the element's area that is still flat. */
static double cone_flat(const DenseLaw *law, double u) {
    double left = 1.0 - fmin(fmax(u - law->begin, 0.0) / law->full, 1.0);
    return left * left;
}

/* [-], [m] Growth by depth of what moves with an element, and all that moves at the depth u: with a
 * cone what is recruited, with a heap a part of the depth until that is the whole heap. */
static double moved_rate(const DenseLaw *law, double u) {
    if (law->begin == 0.0) {
        return cone_flat(law, u);
    }
    return u / LAW_MOVES < law->begin + law->full / 3.0 ? 1.0 / LAW_MOVES : LAW_TAIL;
}

static double moved(const DenseLaw *law, double u) {
    double all = cone_share(law, 1e3);
    return law->begin == 0.0 ? cone_share(law, u)
                             : fmin(u / LAW_MOVES, all) + LAW_TAIL * fmax(u - LAW_MOVES * all, 0.0);
}

#endif
