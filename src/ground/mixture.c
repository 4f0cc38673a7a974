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

static int share_is_nan(const Share *share) {
    return isnan(share->slip_rate + share->regain_rate + share->grip);
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
            const Share share = share_of(wanted);
            *derived = (DerivedLaw){.material = *wanted,
                                    .law = law,
                                    .share = share,
                                    .curves = curves_of(wanted, &law),
                                    .known = 1,
                                    .nan = law_is_nan(&law) || material_is_nan(wanted) ||
                                           share_is_nan(&share)};
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
static void slot_set_law(const Slots *s, int i, const Law *law, const Share *share,
                         const MildMaterial *material) {
    LAW_NUMBERS(SLOT_LAW_STORE)
    s->cone_begin[i] = law->cone_begin;
    s->projects[i] = share->projects;
    s->slip_rate[i] = share->slip_rate;
    s->regain_rate[i] = share->regain_rate;
    s->grip[i] = share->grip;
    s->whole_mu[i] = share->mu;
    s->carry[i] = 1.0;
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

static Share share_between(const Share *a, const Share *b, double share) {
    return (Share){.projects = between(a->projects, b->projects, share),
                   .slip_rate = between(a->slip_rate, b->slip_rate, share),
                   .regain_rate = between(a->regain_rate, b->regain_rate, share),
                   .grip = between(a->grip, b->grip, share),
                   .mu = between(a->mu, b->mu, share)};
}

/* The law of a material under element e. */
static Law element_law(const FootScratch *foot, const DerivedLaw *derived, int e) {
    const SoleHeap *heap = &foot->heap[e];
    return derived->share.projects > 0.0 ? law_merged(derived->law, heap->begin, heap->width)
                                         : derived->law;
}

/* A number of drift resistance: where path costs support it adds none. */
static double drift_of(const DerivedLaw *derived, double number) {
    return derived->share.slip_rate > 0.0 ? 0.0 : number;
}

/* Surfaces are projected when they touch down (faces.c). */
static Share foot_share(const FootScratch *foot, Share share) {
    share.projects = foot->faces ? 0.0 : share.projects;
    return share;
}

/* Sets slot i, of element e, to a mixture of two materials. Law, friction and recovery are
 * interpolated linearly. */
static void slot_set_mixture(const FootScratch *foot, int i, int e, int32_t mixture) {
    const DerivedLaw *a = &foot->derived[mixture & 0xff];
    const DerivedLaw *b = &foot->derived[mixture >> 8 & 0xff];
    const MildMaterial *m = &a->material;
    const MildMaterial *n = &b->material;
    const double t = (mixture >> 16) / 255.0;
    const Law near = element_law(foot, a, e);
    const Law far = element_law(foot, b, e);
    const Law law = law_between(&near, &far, t);
    const Share share = foot_share(foot, share_between(&a->share, &b->share, t));
    const MildMaterial material = {
        .mu = between(m->mu, n->mu, t),
        .k_drift = between(drift_of(a, m->k_drift), drift_of(b, n->k_drift), t),
        .b_drift = between(drift_of(a, m->b_drift), drift_of(b, n->b_drift), t),
        .recovery = between(recovery_of(m), recovery_of(n), t),
    };
    slot_set_law(&foot->slot, i, &law, &share, &material);
}

/* Sets slot i, of element e, to one material. */
static void slot_set_material(const FootScratch *foot, int i, int e, int m,
                              const MildMaterial *material) {
    const Law law = element_law(foot, &foot->derived[m], e);
    const Share share = foot_share(foot, foot->derived[m].share);
    MildMaterial own = *material;
    own.k_drift = drift_of(&foot->derived[m], own.k_drift);
    own.b_drift = drift_of(&foot->derived[m], own.b_drift);
    slot_set_law(&foot->slot, i, &law, &share, &own);
}

void slots_pad(const FootScratch *foot) {
    static const Law none;
    static const Share whole;
    static const MildMaterial nothing;
    for (int i = foot->active; i < foot_end(foot); i++) {
        foot->slot_material[i] = MATERIAL_NONE;
        foot->slot_holder[i] = -1;
        slot_set_law(&foot->slot, i, &none, &whole, &nothing);
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
    for (int i = 0; foot->curves & LAW_HEAP && i < foot->active; i++) {
        differs |= foot->slot_holder[i] - foot->element[i];
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
        if (foot->slot_material[i] == m &&
            (!(foot->curves & LAW_HEAP) || foot->slot_holder[i] == e)) {
            continue;
        }
        foot->slot_material[i] = m;
        foot->slot_holder[i] = e;
        if (m <= 0xff) {
            slot_set_material(foot, i, e, m, &terrain->materials[m]);
        } else {
            slot_set_mixture(foot, i, e, m);
        }
    }
}
