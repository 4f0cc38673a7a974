/* What the elements of a foot did in the last solve. */
#include <string.h>

#include "ground/law/frame.h"
#include "ground/law/friction.h"
#include "ground/step/scratch.h"

/* Copies the slots back to the elements: forces in N, and what each element did in the step. */
static void foot_scatter(const MildScratch *scratch, int f) {
    const FootScratch *foot = &scratch->foot[f];
    const Motion motion = foot_motion(foot, scratch->velocity + 6 * f);
    const double dt = scratch->dt;
    const double rate = 1.0 / dt;
    const Real frame[3] = {(Real)foot->frame[0], (Real)foot->frame[1], (Real)foot->frame[2]};
    for (int slot = 0; slot < foot->active; slot++) {
        const Slots *s = slot_block(foot, slot);
        const int i = slot % SLOT_LANES;
        const int e = foot->element[slot];
        const Element element = slot_loaded(s, i, LAW_ANY);
        const SlotVelocity v = slot_velocity(s, i, &motion, SLOT_UNEVEN | SLOT_SHELL);
        const double beyond = element.depth + dt / 2 * v.descent - element.yield_depth;
        const int loaded = s->iz[i] > 0.0;
        const int deeper = beyond > 0.0;
        const Real impulse[3] = {s->ix[i], s->iy[i], s->iz[i]};
        Real world[3];
        frame_to_world(frame, impulse, world);
        foot->normal[e] = world[2] * rate;
        foot->tangent_x[e] = world[0] * rate;
        foot->tangent_y[e] = world[1] * rate;
        foot->flat[e] =
            law_flat_share(&element.law, LAW_ANY, element.virgin_depth + (deeper ? beyond : 0.0));
        foot->state[e] = (uint8_t)(!loaded  ? MILD_ELEMENT_FREE
                                   : deeper ? MILD_ELEMENT_VIRGIN
                                            : MILD_ELEMENT_UNLOADING);
        foot->slip[e] = loaded && friction_slides(&element, s->iz[i], v.x, v.y);
    }
}

MildElements mild_scratch_elements(const MildScratch *scratch, int f) {
    const FootScratch *foot = &scratch->foot[f];
    size_t bytes = (size_t)foot->padded * sizeof(double);
    memset(foot->normal, 0, bytes);
    memset(foot->tangent_x, 0, bytes);
    memset(foot->tangent_y, 0, bytes);
    memset(foot->state, 0, 2 * (size_t)foot->padded); /* clears slip too, which follows it */
    for (int e = 0; e < foot->padded; e++) {
        foot->flat[e] = 1.0;
    }
    for (int e = 0; foot->away && e < foot->elements; e++) {
        foot->depth[e] = foot->reach;
    }
    foot_points(&scratch->foot[f]);
    foot_scatter(scratch, f);
    return (MildElements){foot->depth,   foot->normal,  foot->tangent_x, foot->tangent_y,
                          foot->point_x, foot->point_y, foot->point_z,   foot->flat,
                          foot->state,   foot->slip};
}
