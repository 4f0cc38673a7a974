/* The law of a material under a sole, as a case of the batch's ground has it. */
#ifndef TEST_CASE_LAW_H
#define TEST_CASE_LAW_H

#include <string.h>

#include "contact_case.h"
#include "ground/law/begin.h"
#include "ground/law/models.h"

static void case_law(CaseMaterial *c, const MildMaterial *m, const MildSole *sole) {
    const Law law = law_of(m, mild_sole_pitch(sole), mild_sole_width(sole));
    const Share share = share_of(m, mild_sole_pitch(sole), mild_sole_width(sole));
    memcpy(c->law, &law, sizeof c->law);
    c->curves = curves_of(m, &law) | model_row(m->model)->motion;
    c->recovery = law_recovery(&law, recovery_of(m));
    c->mu = m->mu;
    c->k_drift = share.slip_rate > 0.0 ? 0.0 : m->k_drift;
    c->b_drift = share.slip_rate > 0.0 ? 0.0 : m->b_drift;
    c->projects = share.projects;
    c->slip_rate = share.slip_rate;
    c->regain_rate = share.regain_rate;
    c->grip = share.grip;
    c->growth = share.growth;
    c->side = share.side;
    c->exit_drag = law_exit_drag(&law);
    c->entry_drag = law_entry_drag(&law);
    c->cohesion = m->cohesion;
    c->shear_length = m->shear_length;
}

#endif
