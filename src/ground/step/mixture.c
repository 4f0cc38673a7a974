/* Materials of the slots: of one or, near a smooth border, a mixture of two. */
#include <string.h>

#include "ground/law/begin.h"
#include "ground/law/models.h"
#include "ground/step/step.h"
#include "ground/terrain/terrain.h"

/* Bool: material m is part of a mixture, encoded as in Memory (state.h). */
static int mixture_has(int32_t mixture, int m) {
    return mixture >= 0 &&
           ((mixture & 0xff) == m || (mixture >> 16 > 0 && (mixture >> 8 & 0xff) == m));
}

/* Bool: one of the numbers that a step uses directly from the material is NaN. */
static int material_is_nan(const MildMaterial *m) {
    return isnan(m->mu + m->k_drift + m->b_drift + m->recovery + m->cohesion + m->shear_length);
}

static int share_is_nan(const Share *share) {
    return isnan(share->slip_rate + share->regain_rate + share->grip + share->growth + share->side);
}

SlotLaw material_law(const MildMaterial *material, double pitch, double width, double sides) {
    const Share share = share_of(material, pitch, sides);
    const MildMaterial own = material_at(material, pitch);
    const int slips = share.slip_rate > 0.0;
    return (SlotLaw){law_of(material, pitch, width), share, slips ? 0.0 : own.k_drift,
                     slips ? 0.0 : own.b_drift, recovery_of(material)};
}

static __attribute__((cold)) void law_derive(const FootScratch *foot, const MildMaterial *material,
                                             DerivedLaw *derived) {
    const SlotLaw slot =
        material_law(material, foot->pitch, foot->width, foot->shell ? 0.0 : foot->width);
    *derived = (DerivedLaw){.material = *material,
                            .slot = slot,
                            .curves = curves_of(material, &slot.law),
                            .known = 1,
                            .nan = law_is_nan(&slot.law) || material_is_nan(material) ||
                                   share_is_nan(&slot.share)};
}

void foot_laws(FootScratch *foot, const MildTerrain *terrain) {
    foot->nan = 0;
    foot->curves = LAW_LINE;
    for (int m = 0; m < terrain->material_count; m++) {
        DerivedLaw *derived = &foot->derived[m];
        const MildMaterial *wanted = &terrain->materials[m];
        // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): a difference costs time only
        if (!derived->known || memcmp(&derived->material, wanted, sizeof *wanted) != 0) {
            law_derive(foot, wanted, derived);
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

#define SLOT_LAW_STORE(name) s->name[i] = from->law.name;
/* Sets the law of lane i of a block, and its friction and recovery. */
static void slot_set_law(Slots *s, int i, const SlotLaw *from) {
    const Share *share = &from->share;
    LAW_NUMBERS(SLOT_LAW_STORE)
    s->cone_begin[i] = from->law.cone_begin;
    s->projects[i] = share->projects;
    s->slip_rate[i] = share->slip_rate;
    s->regain_rate[i] = share->regain_rate;
    s->grip[i] = share->grip;
    s->growth[i] = share->growth;
    s->side[i] = share->side;
    s->whole_mu[i] = share->mu;
    s->ahead[i] = 0.0;
    s->share[i] = 1.0;
    s->exit_drag[i] = law_exit_drag(&from->law);
    s->entry_drag[i] = law_entry_drag(&from->law);
    s->strength[i] = from->law.line_stiffness;
    s->recovery[i] = law_recovery(&from->law, from->recovery);
    s->mu[i] = share->mu;
    s->k_drift[i] = from->k_drift;
    s->b_drift[i] = from->b_drift;
}

static double between(double a, double b, double share) {
    return a + share * (b - a);
}

/* What a material gives a slot with element e. */
static SlotLaw slot_law(const FootScratch *foot, const DerivedLaw *derived, int e) {
    SlotLaw own = derived->slot;
    if (own.share.projects > 0.0) {
        own.law = law_of_heap(own.law, foot->heap[e].begin, foot->heap[e].width);
    }
    return own;
}

/* Changes what one material gives into that of a mixture with another. Law, friction and recovery
 * are interpolated linearly. */
static void slot_law_mix(SlotLaw *a, const SlotLaw *b, double t) {
    Share *share = &a->share;
    a->law = law_between(&a->law, &b->law, t);
    share->projects = between(share->projects, b->share.projects, t);
    share->slip_rate = between(share->slip_rate, b->share.slip_rate, t);
    share->regain_rate = between(share->regain_rate, b->share.regain_rate, t);
    share->grip = between(share->grip, b->share.grip, t);
    share->growth = between(share->growth, b->share.growth, t);
    share->side = between(share->side, b->share.side, t);
    share->mu = between(share->mu, b->share.mu, t);
    a->k_drift = between(a->k_drift, b->k_drift, t);
    a->b_drift = between(a->b_drift, b->b_drift, t);
    a->recovery = between(a->recovery, b->recovery, t);
}

SlotLaw mixture_law(const FootScratch *foot, const DerivedLaw *derived, int32_t mixture, int e) {
    SlotLaw own = slot_law(foot, &derived[mixture & 0xff], e);
    if (mixture > 0xff) {
        const SlotLaw other = slot_law(foot, &derived[mixture >> 8 & 0xff], e);
        slot_law_mix(&own, &other, (mixture >> 16) / 255.0);
    }
    return own;
}

/* Sets slot i, of element e, to a material or a mixture of two. */
static void slot_set_mixture(const FootScratch *foot, int i, int e, int32_t mixture) {
    const SlotLaw own = mixture_law(foot, foot->derived, mixture, e);
    slot_set_law(slot_block(foot, i), i % SLOT_LANES, &own);
}

void slots_pad(const FootScratch *foot) {
    static const SlotLaw none;
    for (int i = foot->active; i < foot_end(foot); i++) {
        foot->slot_material[i] = MATERIAL_NONE;
        foot->slot_holder[i] = -1;
        slot_set_law(slot_block(foot, i), i % SLOT_LANES, &none);
    }
}

/* Bool: no element remembers a material other than 0, and every slot already holds the law of
 * material 0. The loops have no branches. */
static int slots_are_uniform(const FootScratch *foot, const Memory *memory) {
    const int32_t *remembered = memory->material;
    const int32_t *set = foot->slot_material;
    const int elements = foot->padded & -VECTOR_LANES; /* the padding remembers no material */
    const int active = foot->active;
    int32_t differs = 0;
#pragma omp simd reduction(| : differs)
    for (int e = 0; e < elements; e++) {
        differs |= remembered[e] > 0;
    }
#pragma omp simd reduction(| : differs)
    for (int i = 0; i < active; i++) {
        differs |= set[i];
    }
    const size_t bytes = (size_t)active * sizeof *foot->element; /* by memcmp: 1.5 % of a step */
    return !differs &&
           (!(foot->curves & LAW_HEAP) || !memcmp(foot->slot_holder, foot->element, bytes));
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
        if (foot->slot_material[i] == m &&
            (!(foot->curves & LAW_HEAP) || foot->slot_holder[i] == e)) {
            continue;
        }
        foot->slot_material[i] = m;
        foot->slot_holder[i] = e;
        slot_set_mixture(foot, i, e, m);
    }
}
