/* Ground whose material changes under a load (docs/model.md section 5). An element goes on with the
 * new law from what it remembers, unless it would then carry more than before, or hold more energy.
 * There the surface of the new ground lies lower under it, at the depth v below which it carries
 * and holds at most as much as before:
 *
 *     F_new(v) <= F_old(u),   E_new(v) <= E_old(u),   v <= u
 * so that a change creates no energy. It stays lower until the element has come out of the ground.
 * The speed of the added mass falls where the mass grows, which keeps its momentum. */
#ifndef MILD_GROUND_CHANGE_H
#define MILD_GROUND_CHANGE_H

#include "ground/law/begin.h"
#include "ground/law/plate.h"
#include "ground/law/share.h"

#define CHANGE_HALVINGS 40 /* of the depth; v is found to 1e-12 of it */

/* What an element stands on. */
typedef struct {
    Law law;
    Real recovery; /* [-] as in Element */
    int directed;  /* bool: resistive force theory, whose line is that of the peak (plate.h) */
    int wears;     /* bool: the element carries a share of its load (share.h) */
} ChangeGround;

/* What an element at rest has from the ground. */
typedef struct {
    Real force;  /* [N] */
    Real energy; /* [J] that it can give back */
    Real mass;   /* [kg] added mass */
} ChangeHold;

/* At a depth, of an element that has been at depth_max. worn: [-] its wear. */
MILD_HD ChangeHold change_hold(const ChangeGround *ground, Real depth, Real depth_max, Real worn) {
    const ElementMemory memory = {depth_max, depth, 0, 0, 0, 0, 0, 0, 0};
    Element e = {0};
    e.law = ground->law;
    e.law.line_stiffness *= ground->directed ? RESIST_PEAK : 1;
    e.recovery = ground->recovery;
    e.depth = depth;
    const Real yield = element_begin_still(&e, &memory, LAW_ANY, 1, 1, 0);
    const Real elastic = law_elastic_force(&e.law, LAW_ANY, depth);
    const Real k = e.unload_stiffness;
    const Real force = ground->wears ? share_force(&e, 1 - worn) : yield - elastic;
    const Real x = real_max(depth - e.yield_depth + real_over(force, k + ELEMENT_TINY), 0);
    const PowerWay way = power_way(e.law.elastic_force, e.law.elastic_exponent, 0, depth);
    const ChangeHold hold = {k * x + elastic, k / 2 * x * x + way.mean * depth, e.added_mass};
    return hold;
}

MILD_HD int change_fits(const ChangeHold *after, const ChangeHold *before) {
    return after->force <= before->force && after->energy <= before->energy;
}

/* [m] v, up to `depth`. */
MILD_HD Real change_depth(const ChangeGround *to, const ChangeHold *before, Real depth) {
    Real low = 0, high = depth;
    for (int i = 0; i < CHANGE_HALVINGS; i++) {
        const Real v = (low + high) / 2;
        const ChangeHold after = change_hold(to, v, v, 0);
        const int fits = change_fits(&after, before);
        low = fits ? v : low;
        high = fits ? high : v;
    }
    return low;
}

/* Changes what a loaded element remembers. Returns how much lower the surface lies under it, [m];
 * if that is its whole depth, it carries nothing. */
MILD_HD Real change_element(const ChangeGround *from, const ChangeGround *to, ElementMemory *memory,
                            Real *worn) {
    const Real depth = memory->middle;
    const ChangeHold before = change_hold(from, depth, memory->depth_max, *worn);
    ChangeHold after = change_hold(to, depth, memory->depth_max, *worn);
    const int fits = change_fits(&after, &before);
    if (!fits) {
        memory->middle = change_depth(to, &before, depth);
        memory->depth_max = memory->middle;
        after = change_hold(to, memory->middle, memory->middle, 0);
    }
    *worn = fits && to->wears ? *worn : 0;
    memory->front_speed *= after.mass > before.mass ? real_over(before.mass, after.mass) : 1;
    return depth - memory->middle;
}

#endif
