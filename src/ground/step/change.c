/* Ground whose material changes under a load (docs/model.md section 5). An element goes on with the
 * new law from what it remembers, unless it would then carry more than before, or hold more energy.
 * There the surface of the new ground lies lower under it, at the depth v below which it carries
 * and holds at most as much as before:
 *
 *     F_new(v) <= F_old(u),   E_new(v) <= E_old(u),   v <= u
 * so that a change creates no energy. It stays lower until the element has come out of the ground.
 * The speed of the added mass falls where the mass grows, which keeps its momentum. */
#define POWER_CALLED /* power.h: no vector loop here needs a power */
#include <string.h>

#include "ground/law/models.h"
#include "ground/law/plate.h"
#include "ground/law/rest.h"
#include "ground/step/step.h"

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
static ChangeHold change_hold(const ChangeGround *ground, Real depth, Real depth_max, Real worn) {
    Law law = ground->law;
    law.line_stiffness *= ground->directed ? RESIST_PEAK : 1;
    const ElementRest rest =
        element_rest(&law, ground->recovery, LAW_ANY, depth, depth_max, ground->wears, worn);
    const Real k = rest.stiffness, x = rest.travel;
    const PowerWay way = power_way(law.elastic_force, law.elastic_exponent, 0, depth);
    const ChangeHold hold = {rest_force(&rest), k / 2 * x * x + way.mean * depth, rest.added_mass};
    return hold;
}

static int change_fits(const ChangeHold *after, const ChangeHold *before) {
    return after->force <= before->force && after->energy <= before->energy;
}

/* [m] v, up to `depth`. */
static Real change_depth(const ChangeGround *to, const ChangeHold *before, Real depth) {
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
static Real change_element(const ChangeGround *from, const ChangeGround *to, ElementMemory *memory,
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

/* ---- the elements of a foot ---- */

/* Materials of a foot, before and after. */
typedef struct {
    DerivedLaw from[MILD_MATERIALS_MAX];
    DerivedLaw to[MILD_MATERIALS_MAX];
    int count; /* that both terrains have */
} Change;

/* [-] By what the law of an element is scaled: see shell_laws. */
static double law_scale(const FootScratch *foot, const Memory *memory, int e, int directed) {
    if (!foot->shell) {
        return 1.0;
    }
    return directed ? foot->area[e] : memory->area_share[e];
}

static int is_directed(const DerivedLaw *derived, int32_t mixture) {
    return (model_row(derived[mixture & 0xff].material.model)->motion & LAW_RESIST) != 0;
}

/* What element e of a foot has under itself. */
static ChangeGround ground_under(const FootScratch *foot, const DerivedLaw *derived,
                                 const Memory *memory, int e) {
    const SlotLaw own = mixture_law(foot, derived, memory->material[e], e);
    Law law = own.law;
    const int line = law.flat_stiffness == 0.0 && law.power_force == 0.0;
    const int directed = line && is_directed(derived, memory->material[e]);
    const double scale = law_scale(foot, memory, e, directed);
    law.flat_stiffness *= scale;
    law.line_stiffness *= scale;
    law.mass_rate *= scale;
    law.bed_stiffness *= scale;
    law.power_force *= scale;
    law.elastic_force *= scale;
    return (ChangeGround){.law = law,
                          .recovery = law_recovery(&law, own.recovery),
                          .directed = directed,
                          .wears = own.share.projects + own.share.slip_rate > 0.0};
}

/* Changes element e. Returns how much lower the surface lies under it [m]. */
static double memory_change(const FootScratch *foot, const Change *change, const Memory *memory,
                            int e) {
    const ChangeGround from = ground_under(foot, change->from, memory, e);
    const ChangeGround to = ground_under(foot, change->to, memory, e);
    ElementMemory own = {.depth_max = memory->depth_max[e],
                         .middle = memory->middle[e],
                         .front_speed = memory->front_speed[e]};
    Real worn = (Real)memory->worn[e];
    const double lower = change_element(&from, &to, &own, &worn);
    memory->worn[e] = worn;
    memory->depth_max[e] = own.depth_max;
    memory->middle[e] = own.middle;
    memory->front_speed[e] = own.front_speed;
    if (!(own.depth_max > 0.0)) {
        memory_forget(memory, e, MATERIAL_FREE);
    }
    return lower;
}

/* Bool: a loaded element, on materials that both terrains have. */
static int is_loaded(const Memory *memory, int e, int count) {
    const int32_t m = memory->material[e];
    return m >= 0 && (m & 0xff) < count && (m >> 8 & 0xff) < count && memory->depth_max[e] > 0.0;
}

/* Elastic ground would bear an element that has lifted off in an imprint only once it has come out
 * (slots_imprints). Returns how much lower the surface lies under such an element [m]. */
static double memory_free(const Memory *memory, int e) {
    const double lower =
        memory->material[e] == MATERIAL_FREE ? real_max(memory->middle[e], 0.0) : 0.0;
    memory->middle[e] -= lower;
    return lower;
}

static int is_elastic(const Change *change) {
    int elastic = 0;
    for (int m = 0; m < change->count; m++) {
        const SlotLaw *slot = &change->to[m].slot;
        elastic |= !(law_recovery(&slot->law, slot->recovery) < 1.0);
    }
    return elastic;
}

static void foot_change(MildGround *ground, int f, const FootScratch *foot, const Change *change) {
    const Memory memory = ground_memory(ground, f);
    const int elastic = is_elastic(change);
    double lowest = 0.0;
    for (int e = 0; e < foot->elements; e++) {
        if (!ground->uneven[f]) { /* on level ground nobody has written the planes */
            memory.plane[e] = memory.slope_x[e] = memory.slope_y[e] = 0.0;
        }
        const double lower = is_loaded(&memory, e, change->count)
                                 ? memory_change(foot, change, &memory, e)
                                 : (elastic ? memory_free(&memory, e) : 0.0);
        memory.plane[e] -= lower;
        lowest = real_max(lowest, lower);
    }
    ground->uneven[f] = lowest > 0.0 ? GROUND_LOWERED : ground->uneven[f];
}

void mild_ground_change(MildGround *ground, const MildTerrain *from, const MildTerrain *to,
                        MildScratch *scratch) {
    const int count =
        from->material_count < to->material_count ? from->material_count : to->material_count;
    // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): a difference costs time only
    if (!memcmp(from->materials, to->materials, (size_t)count * sizeof *to->materials) ||
        !scratch_fits(scratch, ground)) {
        return;
    }
    Change change = {.count = count};
    for (int f = 0; f < ground->feet; f++) {
        FootScratch *foot = &scratch->foot[f];
        if (ground->touched[f] == 0) {
            continue;
        }
        foot_laws(foot, from);
        memcpy(change.from, foot->derived, sizeof change.from);
        foot_laws(foot, to);
        memcpy(change.to, foot->derived, sizeof change.to);
        foot_change(ground, f, foot, &change);
    }
}
