/* Surfaces (docs/model.md, "Surfaces"): elements with a height, a normal and an area each. */
#ifndef MILD_GROUND_FACES_H
#define MILD_GROUND_FACES_H

#include "ground/scratch.h"

/* After foot_locate: lists the elements that face down and may touch in this step. steepest, f: as
 * in foot_list. */
void faces_list(FootScratch *foot, const MildTerrain *terrain, const MildContactInput *input,
                double steepest, int f);
/* After slots_gather: the height of the slots, and their share, which a loaded element keeps from
 * its touchdown. */
void faces_gather(const FootScratch *foot, const Memory *memory);
/* In place of slots_materials: gives each slot the law of its material times its share. A buried
 * element on elastic ground gets none. now: motion at the start of the step. */
void faces_laws(const FootScratch *foot, const MildTerrain *terrain, const Memory *memory,
                const Motion *now, double dt);
/* After slots_imprints: a buried element begins without force, at the end of the unloading line of
 * some greater depth. */
void faces_unload(const FootScratch *foot, const Memory *memory, const Motion *now, double dt);

/* The rotation that imprints take for that of a surface. */
extern const double faces_level[9];

/* Outward normal of an element, world. */
static inline void face_normal(const FootScratch *foot, int e, double normal[3]) {
    for (int k = 0; k < 3; k++) {
        normal[k] = foot->arm[1][k] * foot->face[0][e] + foot->arm[2][k] * foot->face[1][e] +
                    foot->arm[3][k] * foot->face[2][e];
    }
}

/* Bool: the resistance of a slot depends on its direction, by resistive force theory: no other
 * curve is blended with it. */
static inline int slot_directed(const Slots *s, int i) {
    return s->flat_stiffness[i] == 0.0 && s->power_force[i] == 0.0;
}

#endif
