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
