#include "ground/mixture.h"

#include <string.h>

#include "ground/begin.h"
#include "ground/models.h"
#include "ground/terrain.h"

/* Bool: material m is part of a mixture, encoded as in Memory (state.h). */
static int mixture_has(int32_t mixture, int m) {
    return mixture >= 0 &&
           ((mixture & 0xff) == m || (mixture >> 16 > 0 && (mixture >> 8 & 0xff) == m));
}

/* Bool: one of the numbers that a step uses directly from the material is NaN. */
static int material_is_nan(const MildMaterial *m) {
    return isnan(m->mu + m->k_drift + m->b_drift + m->recovery + m->cohesion + m->shear_length);
}

void foot_laws(FootScratch *foot, const MildTerrain *terrain) {
    foot->nan = 0;
    foot->curves = LAW_LINE;
    for (int m = 0; m < terrain->material_count; m++) {
        DerivedLaw *derived = &foot->derived[m];
        const MildMaterial *wanted = &terrain->materials[m];
        // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): a difference costs time only
        if (!derived->known || memcmp(&derived->material, wanted, sizeof *wanted) != 0) {
            const Law law = law_of(wanted, foot->pitch, foot->width);
            *derived = (DerivedLaw){.material = *wanted,
                                    .law = law,
                                    .curves = law_curves(&law),
                                    .known = 1,
                                    .nan = law_is_nan(&law) || material_is_nan(wanted)};
            for (int i = 0; i < foot->padded; i++) {
                if (mixture_has(foot->slot_material[i], m)) {
                    foot->slot_material[i] = MATERIAL_NONE;
                }
            }
        }
        foot->nan |= derived->nan;
        foot->curves |= derived->curves;
    }
}

#define SLOT_LAW_STORE(name) s->name[i] = law->name;
/* Sets the law of slot i, and its friction and recovery. */
static void slot_set_law(const Slots *s, int i, const Law *law, const MildMaterial *material) {
    LAW_NUMBERS(SLOT_LAW_STORE)
    s->exit_drag[i] = law_exit_drag(law);
    s->entry_drag[i] = law_entry_drag(law);
    s->strength[i] = law->line_stiffness;
    s->recovery[i] = law_recovery(law, recovery_of(material));
    s->mu[i] = material->mu;
    s->k_drift[i] = material->k_drift;
    s->b_drift[i] = material->b_drift;
}

static double between(double a, double b, double share) {
    return a + share * (b - a);
}

/* Sets a slot to a mixture of two materials. Law, friction and recovery are interpolated
 * linearly. */
static void slot_set_mixture(const Slots *s, int i, const DerivedLaw *derived, int32_t mixture) {
    const DerivedLaw *a = &derived[mixture & 0xff];
    const DerivedLaw *b = &derived[mixture >> 8 & 0xff];
    const MildMaterial *m = &a->material;
    const MildMaterial *n = &b->material;
    const double t = (mixture >> 16) / 255.0;
    const Law law = law_between(&a->law, &b->law, t);
    const MildMaterial material = {
        .mu = between(m->mu, n->mu, t),
        .k_drift = between(m->k_drift, n->k_drift, t),
        .b_drift = between(m->b_drift, n->b_drift, t),
        .recovery = between(recovery_of(m), recovery_of(n), t),
    };
    slot_set_law(s, i, &law, &material);
}

void slots_pad(const FootScratch *foot) {
    static const Law none;
    static const MildMaterial nothing;
    for (int i = foot->active; i < foot_end(foot); i++) {
        foot->slot_material[i] = MATERIAL_NONE;
        slot_set_law(&foot->slot, i, &none, &nothing);
    }
}

/* Bool: no element remembers a material other than 0, and every slot already holds the law of
 * material 0. The loops have no branches. */
static int slots_are_uniform(const FootScratch *foot, const Memory *memory) {
    const int32_t *remembered = memory->material;
    const int32_t *set = foot->slot_material;
    int32_t differs = 0;
    for (int e = 0; e < foot->elements; e++) {
        differs |= remembered[e] > 0;
    }
    for (int i = 0; i < foot->active; i++) {
        differs |= set[i];
    }
    return !differs;
}

void slots_materials(const FootScratch *foot, const MildTerrain *terrain, const Memory *memory) {
    const int count = terrain->material_count;
    if (terrain_is_uniform(terrain) && slots_are_uniform(foot, memory)) {
        return;
    }
    for (int i = 0; i < foot->active; i++) {
        int e = foot->element[i], m = memory->material[e];
        if (m < 0 || (m & 0xff) >= count || (m >> 8 & 0xff) >= count) {
            m = terrain_mixture(terrain, foot->point_x[e], foot->point_y[e]);
        }
        if (foot->slot_material[i] == m) {
            continue;
        }
        foot->slot_material[i] = m;
        if (m <= 0xff) {
            slot_set_law(&foot->slot, i, &foot->derived[m].law, &terrain->materials[m]);
        } else {
            slot_set_mixture(&foot->slot, i, foot->derived, m);
        }
    }
}
