/* Shear strength that builds up with slip (Janosi and Hanamoto 1961), of one element:
 *
 *     s = (c + p mu) (1 - exp(-j/K))
 * j is the distance that the element has slid since it touched down, which is its drift
 * (ElementMemory in element.h). */
#ifndef MILD_GROUND_SHEAR_H
#define MILD_GROUND_SHEAR_H

#include "ground/law/friction.h"

/* What the strength is made of. */
typedef struct {
    Real mu;       /* [-] of the whole strength */
    Real cohesion; /* c [N/m^2] */
    Real length;   /* K [m] */
    Real area;     /* [m^2] of the element */
} Shear;

/* Sets the friction of an element, after element_begin. force: [N] at the yield depth. rate:
 * 1/dt. */
MILD_HD void element_shear_of(Element *e, const ElementMemory *memory, const Shear *shear,
                              Real force, Real dt, Real rate) {
    const Real slid = memory->drift / shear->length;                       /* j/K [-] */
    const Real share = 1 - real_exp2(REAL(-1.4426950408889634074) * slid); /* 1/ln 2 */
    const Real cohesion = e->depth > 0 ? shear->cohesion : 0;
    e->mu = share * shear->mu;
    e->drift_bound += dt * share * cohesion * shear->area;
    friction_hold(e, memory, dt, rate, force);
}

MILD_HD void element_shear(Element *e, const ElementMemory *memory, const Shear *shear, int curves,
                           Real dt, Real rate) {
    const Real force =
        law_force(&e->law, curves, e->yield_depth) + law_elastic_force(&e->law, curves, e->middle);
    element_shear_of(e, memory, shear, force, dt, rate);
}

#endif
