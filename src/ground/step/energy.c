/* Why friction can create energy, and how a step is corrected.
 *
 * A step changes the kinetic energy by the impulse times the mean of the speeds before and after
 * it. The normal impulse is chosen so that its energy balances at this mean speed. Friction opposes
 * the speed after the step, because otherwise it could not stop a foot. While an element keeps its
 * direction, friction takes energy at the mean speed as well. But the normal impulse of a foot on a
 * long lever can reverse a sliding element within the step. Friction then opposes the new motion
 * with the impulse of a whole step, and so does positive work on the old motion.
 *
 * A step where this matters is solved again. For the elements concerned, friction now starts only
 * once the element is as fast backward as it was forward. With u and v the horizontal velocities
 * before and after the step, friction opposes
 *
 *     d = v - p,   p the point nearest to v on the segment from 0 to -u
 *
 * instead of v. By the nearest-point property, d . (q - p) <= 0 for every q of the segment. For q =
 * 0 this gives d . v >= |d|^2, and for q = -u it gives d . (u + v) >= |d|^2. An impulse along -d
 * therefore takes energy both at the new speed and at the mean speed. It is still minus the
 * gradient of a convex function of v, so the solvers need no change. The elastic friction force
 * that such an element held is dropped. */
#include "ground/step/step.h"

#include <string.h>

#include "ground/law/friction.h"

/* [-] Share of the impulses' energy above which a step is solved again. Steps in walking stay below
 * it. The impulses' energy is up to four times the kinetic energy of the feet, because a passive
 * step changes their velocity by at most twice itself: so friction gives at most 32 % of it, to a
 * body that bounces within a step; test_falls.c has the worst found, 9.3 %. */
#define ENERGY_SHARE 0.08

void energy_begin(MildScratch *scratch) {
    for (int f = 0; f < scratch->feet; f++) {
        FootScratch *foot = &scratch->foot[f];
        if (foot->turned) {
            for (Slots *s = foot->slot; s < slots_all(foot); s++) {
                memset(s->turn_x, 0, sizeof s->turn_x);
                memset(s->turn_y, 0, sizeof s->turn_y);
            }
            foot->turned = 0;
        }
    }
}

/* [J] W A W/2, the energy that the impulses alone would give to feet at rest. */
static double impulse_energy(const MildScratch *scratch, const MildContactInput *input,
                             const MildContactResult *result) {
    double sum = 0.0;
    for (int k = 0; k < 6 * scratch->feet; k++) {
        sum += scratch->wrench[k] * (result->velocity[k] - input->free_velocity[k]);
    }
    return 0.5 * sum;
}

/* [J] Work of a foot's friction at the mean speed less its work at the new speed: -I . dv/2, where
 * dv = A W is the velocity change that the ground causes. change: dv. */
static double foot_caused(const FootScratch *foot, const Motion *change) {
    const Motion v = *change;
    Lanes lanes = {0.0};
    double sum;
    for (const Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
#pragma omp simd
        for (int i = 0; i < SLOT_LANES; i++) {
            const double iz = s->iz[i];
            const double ix = s->ix[i] + s->slope_x[i] * iz;
            const double iy = s->iy[i] + s->slope_y[i] * iz;
            const SlotVelocity at = slot_velocity(s, i, &v, SLOT_SHELL);
            lanes[i] += ix * at.x + iy * at.y;
        }
    }
    lanes_sum((const Lanes *)&lanes, 1, &sum);
    return -0.5 * sum;
}

/* The same on level ground, from the sums of the last pass. */
static double level_caused(const double sums[9], const Motion *change) {
    double sum = 0.0;
    for (int k = 0; k < 3; k++) {
        sum += sums[3 * k] * change->x[k] + sums[3 * k + 1] * change->y[k];
    }
    return -0.5 * sum;
}

/* The same, summed over all feet. */
static double friction_caused(const MildScratch *scratch, const MildContactInput *input,
                              const MildContactResult *result) {
    double sum = 0.0;
    for (int k = 0; k < scratch->listed; k++) {
        const int f = scratch->list[k];
        const FootScratch *foot = &scratch->foot[f];
        double twist[6];
        for (int i = 0; i < 6; i++) {
            twist[i] = result->velocity[6 * f + i] - input->free_velocity[6 * f + i];
        }
        const Motion change = foot_motion(foot, twist);
        const int sums = !foot->uneven && !foot->shell && input->solver == MILD_SOLVER_NEWTON;
        sum += sums ? level_caused(scratch->sums[f], &change) : foot_caused(foot, &change);
    }
    return sum;
}

/* [J] Work of a slot's friction at the mean speed, less the elastic energy that it released. */
static __attribute__((cold, noinline)) double
slot_gift(const Slots *s, int i, const SlotVelocity *u, const SlotVelocity *v) {
    const Element e = slot_element(s, i);
    const double ix = s->ix[i] + s->slope_x[i] * s->iz[i];
    const double iy = s->iy[i] + s->slope_y[i] * s->iz[i];
    const double work = 0.5 * (ix * (u->x + v->x) + iy * (u->y + v->y));
    if (!(e.hold_stiffness > 0.0)) {
        return work;
    }
    const double hx = e.hold_x - e.hold_stiffness * v->x;
    const double hy = e.hold_y - e.hold_stiffness * v->y;
    const double bound = friction_bound(&e, s->iz[i]);
    const double left = fmin(hx * hx + hy * hy, bound * bound);
    const double held = e.hold_x * e.hold_x + e.hold_y * e.hold_y;
    return work - 0.5 * fmax(held - left, 0.0) / e.hold_stiffness;
}

/* [J] Sum over the slots whose friction gave energy. Slots that took energy do not count. */
static __attribute__((cold)) double foot_gift(const FootScratch *foot, const Motion *before,
                                              const Motion *after) {
    double sum = 0.0;
    for (int i = 0; i < foot->active; i++) {
        const Slots *s = slot_block(foot, i);
        const int l = i % SLOT_LANES;
        const SlotVelocity u = slot_velocity(s, l, before, SLOT_SHELL);
        const SlotVelocity v = slot_velocity(s, l, after, SLOT_SHELL);
        sum += fmax(slot_gift(s, l, &u, &v), 0.0);
    }
    return sum;
}

static __attribute__((cold)) void foot_turn(FootScratch *foot, const Motion *before,
                                            const Motion *after, int all) {
    foot->turned = 1;
    for (int i = 0; i < foot->active; i++) {
        Slots *s = slot_block(foot, i);
        const int l = i % SLOT_LANES;
        const SlotVelocity u = slot_velocity(s, l, before, SLOT_SHELL);
        const SlotVelocity v = slot_velocity(s, l, after, SLOT_SHELL);
        if (!all && !(slot_gift(s, l, &u, &v) > 0.0)) {
            continue;
        }
        s->turn_x[l] = u.x;
        s->turn_y[l] = u.y;
        s->hold_x[l] = 0.0;
        s->hold_y[l] = 0.0;
        s->hold_stiffness[l] = 0.0;
    }
}

int energy_created(MildScratch *scratch, const MildContactInput *input,
                   const MildContactResult *result, int all) {
    const double least = ENERGY_SHARE * impulse_energy(scratch, input, result);
    if (!(friction_caused(scratch, input, result) > least)) {
        return 0;
    }
    Motion before[MILD_FEET_MAX], after[MILD_FEET_MAX];
    double gift = 0.0;
    for (int k = 0; k < scratch->listed; k++) {
        const int f = scratch->list[k];
        const FootScratch *foot = &scratch->foot[f];
        before[f] = foot_motion(foot, input->velocity[f]);
        after[f] = foot_motion(foot, result->velocity + 6 * f);
        gift += foot_gift(foot, &before[f], &after[f]);
    }
    if (!(gift > least)) {
        return 0;
    }
    for (int k = 0; k < scratch->listed; k++) {
        const int f = scratch->list[k];
        foot_turn(&scratch->foot[f], &before[f], &after[f], all);
    }
    return 1;
}
