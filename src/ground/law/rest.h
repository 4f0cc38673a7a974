/* An element at rest on what it remembers: on its unloading line, or on virgin ground where that
 * begins. */
#ifndef MILD_GROUND_REST_H
#define MILD_GROUND_REST_H

#include "ground/law/begin.h"
#include "ground/law/share.h"

typedef struct {
    Real stiffness;  /* [N/m] of the line */
    Real travel;     /* [m] on it */
    Real elastic;    /* [N] of ground without memory */
    Real added_mass; /* [kg] */
} ElementRest;

/* [N] */
MILD_HD Real rest_force(const ElementRest *rest) {
    return rest->stiffness * rest->travel + rest->elastic;
}

/* At a depth, of an element that has been at depth_max. wears: bool, it carries a share of its load
 * (share.h), 1 - worn. */
MILD_HD ElementRest element_rest(const Law *law, Real recovery, int curves, Real depth,
                                 Real depth_max, int wears, Real worn) {
    const ElementMemory memory = {depth_max, depth, 0, 0, 0, 0, 0, 0, 0};
    Element e = {0};
    e.law = *law;
    e.recovery = recovery;
    e.depth = depth;
    const Real yield = element_begin_still(&e, &memory, curves, 1, 1, 0);
    const Real elastic = law_elastic_force(&e.law, curves, depth);
    const Real k = e.unload_stiffness;
    const Real force = wears ? share_force(&e, 1 - worn) : yield - elastic;
    const Real x = real_max(depth - e.yield_depth + real_over(force, k + ELEMENT_TINY), 0);
    const ElementRest rest = {k, x, elastic, e.added_mass};
    return rest;
}

#endif
