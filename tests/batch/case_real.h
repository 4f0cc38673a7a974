/* Numbers of a case in Real, and back. Included once Real is chosen. */
#ifndef TEST_CASE_REAL_H
#define TEST_CASE_REAL_H

#include "contact_case.h"
#include "ground/batch/contact.h"

static void to_real(Real *to, const double *from, int count) {
    for (int i = 0; i < count; i++) {
        to[i] = (Real)from[i];
    }
}

static void to_double(double *to, const Real *from, int count) {
    for (int i = 0; i < count; i++) {
        to[i] = (double)from[i];
    }
}

/* The numbers of a foot's elements, `next` apart in memory and `apart` in a case, or back. Those of
 * `pending` share one. */
static void case_elements(Real *memory, int next, double *numbers, size_t apart, int count,
                          int back) {
    const Real band = (Real)1e-5;
    double *x = numbers + 4 * apart, *y = x + apart;
    for (int n = 0; n < CASE_WORN; n++) {
        Real *at = memory + (n < 5 ? n : n - 1) * next;
        double *of = numbers + (size_t)n * apart;
        if (of != x && of != y && back) {
            to_double(of, at, count);
        } else if (of != x && of != y) {
            to_real(at, of, count);
        }
    }
    for (int s = 0; s < count; s++) {
        Real *at = memory + 4 * next + s, pending[2];
        if (back) {
            pair_unpack(*at, &pending[0], &pending[1]);
            x[s] = (double)(pending[0] * band);
            y[s] = (double)(pending[1] * band);
        } else {
            *at = pair_pack((Real)x[s] / band, (Real)y[s] / band);
        }
    }
}

static ContactMaterial case_material(const CaseMaterial *from) {
    ContactMaterial m;
    int n = 0;
#define CASE_LAW_LOAD(name) m.law.name = (Real)from->law[n++];
    LAW_NUMBERS(CASE_LAW_LOAD)
    m.law.cone_begin = (Real)from->law[n];
    m.recovery = (Real)from->recovery;
    m.mu = (Real)from->mu;
    m.k_drift = (Real)from->k_drift;
    m.b_drift = (Real)from->b_drift;
    m.exit_drag = (Real)from->exit_drag;
    m.entry_drag = (Real)from->entry_drag;
    m.cohesion = (Real)from->cohesion;
    m.shear_length = (Real)from->shear_length;
    m.projects = (Real)from->projects;
    m.slip_rate = (Real)from->slip_rate;
    m.regain_rate = (Real)from->regain_rate;
    m.grip = (Real)from->grip;
    m.growth = (Real)from->growth;
    m.side = (Real)from->side;
    m.curves = from->curves;
    return m;
}

#endif
