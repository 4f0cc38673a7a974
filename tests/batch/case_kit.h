/* What the tests of the batch's texts share: a kit's memory, map and materials as a case has them,
 * and distances. */
#ifndef CASE_KIT_H
#define CASE_KIT_H

#include <string.h>

#include "batch_kit.h"
#include "contact_case.h"
#include "ground/law/begin.h"
#include "ground/law/models.h"
#include "ground/step/scratch.h"
#include "ground/step/state.h"
#include "ground/surface_kit.h"
#include "ground/terrain/grid.h"

/* The map of a kit. Its labels must live as long as the case. */
static inline void case_map(MapView *view, double origin[2], const MildTerrain *terrain) {
    static unsigned char labels[1 << 16];
    const MildMap *map = terrain->map;
    *view = map_view(map);
    for (int i = 0; map->label && i < map->labels.columns * map->labels.rows; i++) {
        labels[i] = map->label[i].first;
    }
    view->label = map->label ? labels : NULL;
    origin[0] = terrain->map_x;
    origin[1] = terrain->map_y;
}

/* What a ground remembers of a foot, in the order of a case. */
static inline void memory_arrays(const Memory *m, double *const all[CASE_MEMORY]) {
    double *const arrays[CASE_MEMORY] = {m->depth_max,      m->middle,    m->front_speed, m->drift,
                                         m->pending_x,      m->pending_y, m->held_x,      m->held_y,
                                         m->held_stiffness, m->worn};
    memcpy((void *)all, arrays, sizeof arrays);
}

/* By the size that each number has in a step. */
static const double memory_scale[CASE_MEMORY] = {1e-3, 1e-3, 0.1, 1e-3, 1e-5,
                                                 1e-5, 1.0,  1.0, 1e4,  1.0};

/* Ground where slip costs support, or would if it slipped. slips: bool. */
static inline void wears(MildMaterial *m, int slips, uint64_t *random) {
    m->slip_length = slips ? kit_uniform(random, 1e-3, 5e-3) : 0.0;
    m->regain_length = kit_uniform(random, 2e-3, 2e-2);
    m->grip = kit_index(random, 2) ? kit_uniform(random, 0.05, 0.5) : 0.0;
    uint64_t own = *random; /* the other draws stay */
    m->slip_growth = kit_index(&own, 2) ? kit_uniform(&own, 0.0, 0.1) : 0.0;
}

static inline MildMaterial matched(MildModel model, const MildSole *sole) {
    const MildMaterial sand = mild_material_default();
    MildMaterial m;
    assert_int_equal(mild_model_match(model, &sand, sole, 150.0, &m, NULL), MILD_OK);
    return m;
}

/* NaN where one is. */
static inline double worse(double a, double b) {
    return !(a > b) && a == a ? b : a;
}

static inline double apart(const double *a, const double *b, int count, double scale) {
    double difference = 0.0, size = 0.0;
    for (int i = 0; i < count; i++) {
        difference += (a[i] - b[i]) * (a[i] - b[i]);
        size += b[i] * b[i];
    }
    return sqrt(difference) / (sqrt(size) + scale);
}

/* Of errors, the one that a share of them does not exceed. */
static inline double quantile(double *errors, int count, double share) {
    qsort(errors, (size_t)count, sizeof *errors, ascending);
    return errors[(int)(share * (count - 1))];
}

/* ---- the law of a material under a sole, as a case of the batch's ground has it ---- */

static void case_law(CaseMaterial *c, const MildMaterial *m, const MildSole *sole) {
    const Law law = law_of(m, mild_sole_pitch(sole), mild_sole_width(sole));
    const Share share = share_of(m, mild_sole_pitch(sole), mild_sole_width(sole));
    memcpy(c->law, &law, sizeof c->law);
    c->curves = curves_of(m, &law) | model_row(m->model)->motion;
    c->recovery = law_recovery(&law, recovery_of(m));
    c->mu = m->mu;
    c->k_drift = share.slip_rate > 0.0 ? 0.0 : m->k_drift;
    c->b_drift = share.slip_rate > 0.0 ? 0.0 : m->b_drift;
    c->projects = share.projects;
    c->slip_rate = share.slip_rate;
    c->regain_rate = share.regain_rate;
    c->grip = share.grip;
    c->growth = share.growth;
    c->side = share.side;
    c->exit_drag = law_exit_drag(&law);
    c->entry_drag = law_entry_drag(&law);
    c->cohesion = m->cohesion;
    c->shear_length = m->shear_length;
}

#endif
