#define POWER_CALLED /* power.h: no vector loop here needs a power */
/* Models of resistive force theory (plate.h), ecc_quasi and ecc_quasi_3d, for a foot's slots. */
#include "ground/law/model.h"
#include "ground/law/plate.h"
#include "ground/step/scratch.h"

void mild_resist_plane(double beta, double gamma, double alpha[2]) {
    const Alpha plane = plane_alpha(cos(2.0 * beta), sin(2.0 * beta), cos(gamma), sin(gamma));
    alpha[0] = plane.x;
    alpha[1] = plane.z;
}

void mild_resist_space(const double normal[3], const double direction[3], double alpha[3]) {
    double x = -direction[2];
    double z = normal[0] * direction[0] + normal[1] * direction[1] + normal[2] * direction[2];
    double f[3];
    for (int k = 0; k < 3; k++) {
        Cubic a;
        cubic_at(space_coefficients(k), -normal[2], a);
        f[k] = cubic(a, x, z);
    }
    double scale = z < 0.0 ? 0.0 : 1.0 / RESIST_LEVEL; /* no force on a trailing face */
    for (int k = 0; k < 3; k++) {
        alpha[k] = scale * (f[0] * normal[k] + f[1] * direction[k] - (k == 2 ? f[2] : 0.0));
    }
}

/* Adapts the law of one slot to its motion at the start of the step. */
MILD_HD void slot_resist(Slots *s, int i, double dt, double rate, const Plate *plate,
                         const Motion *motion, int in_space) {
    const SlotVelocity v = slot_velocity(s, i, motion, SLOT_UNEVEN);
    const ElementMemory memory = slot_memory(s, i);
    Element element = slot_element(s, i);
    element_resist(&element, &memory, plate, in_space, LAW_LINE, dt, rate, s->strength[i], v.x, v.y,
                   v.descent);
    s->line_stiffness[i] = element.law.line_stiffness;
    slot_store(s, i, &element);
}

/* One text of both theories, in place of four inlined. */
static __attribute__((noinline)) Alpha some_alpha(const Plate *plate, int in_space, double forward,
                                                  double level, double down) {
    return plate_alpha(plate, in_space, forward, level, down);
}

/* The same of any slot. */
static void some_resist(Slots *s, int i, double dt, const Plate *plate, const Motion *motion,
                        int in_space, int curves) {
    const SlotVelocity v = slot_velocity(s, i, motion, SLOT_UNEVEN | SLOT_SHELL);
    const ElementMemory memory = slot_memory(s, i);
    const PlateMotion m = plate_motion(plate, v.x, v.y, v.descent);
    const Alpha sinking = some_alpha(plate, in_space, m.forward, m.level, m.down + RESIST_REST);
    const Alpha sliding = some_alpha(plate, in_space, m.forward, m.level + RESIST_REST, m.down);
    Element element = slot_element(s, i);
    element_yield(&element, &memory, curves, dt, 1.0 / dt, s->strength[i], sliding.x, sinking.z);
    s->line_stiffness[i] = element.law.line_stiffness;
    slot_store(s, i, &element);
}

/* slot_resist for all slots of a foot on this theory alone. */
MILD_HD void slots_resist(const FootScratch *foot, double dt, const Plate *sole, const Motion *now,
                          int in_space) {
    const Plate plate = *sole;
    const Motion motion = *now;
    const double rate = 1.0 / dt;
    for (Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
#pragma omp simd
        for (int i = 0; i < SLOT_LANES; i++) {
            slot_resist(s, i, dt, rate, &plate, &motion, in_space);
        }
    }
}

/* Bool: all materials of the terrain are of this model. */
static int terrain_only(const MildTerrain *terrain, int model) {
    int only = 1;
    for (int m = 0; m < terrain->material_count; m++) {
        only &= terrain->materials[m].model == model;
    }
    return only;
}

/* The face of an element of a shell. */
static Plate face_plate(const FootScratch *foot, int e) {
    Real normal[3];
    for (int k = 0; k < 3; k++) {
        normal[k] = foot->arm[1][k] * foot->face[0][e] + foot->arm[2][k] * foot->face[1][e] +
                    foot->arm[3][k] * foot->face[2][e];
    }
    return plate_facing(normal);
}

/* The foot's slots on `model`, among slots on others. in_space: bool. */
static void foot_resist_some(const FootScratch *foot, const MildTerrain *terrain, int model,
                             double dt, const Plate *sole, const Motion *now, int in_space) {
    for (int i = 0; i < foot->active; i++) {
        Slots *s = slot_block(foot, i);
        const int l = i % SLOT_LANES;
        if (terrain->materials[foot->slot_material[i] & 0xff].model != model) {
            continue; /* the nearer material decides */
        }
        if (!slot_directed(s, l) || foot->slot_material[i] & SLOT_BARRED) {
            continue; /* blended with another curve: stays a level plate */
        }
        const Plate own = foot->shell ? face_plate(foot, foot->element[i]) : *sole;
        some_resist(s, l, dt, &own, now, in_space, foot->curves);
    }
}

/* The foot's slots on `model`. in_space: bool. The padding has no strength. */
static __attribute__((noinline)) void foot_resist(const FootScratch *foot,
                                                  const MildTerrain *terrain, int model, double dt,
                                                  const double *rotation, const Motion *now,
                                                  int in_space) {
    const Real turn[9] = {
        [2] = (Real)rotation[2], [5] = (Real)rotation[5], [8] = (Real)rotation[8]};
    const Plate plate = plate_of(turn);
    if (!terrain_only(terrain, model) || foot->shell) {
        foot_resist_some(foot, terrain, model, dt, &plate, now, in_space);
    } else if (in_space) {
        slots_resist(foot, dt, &plate, now, 1);
    } else {
        slots_resist(foot, dt, &plate, now, 0);
    }
}

/* In the vertical plane of motion. */
static void resist_plane(const FootScratch *foot, const MildTerrain *terrain, int model, double dt,
                         const double *rotation, const Motion *now) {
    foot_resist(foot, terrain, model, dt, rotation, now, 0);
}

static void resist_space(const FootScratch *foot, const MildTerrain *terrain, int model, double dt,
                         const double *rotation, const Motion *now) {
    foot_resist(foot, terrain, model, dt, rotation, now, 1);
}

/* The law of a level plate moving straight down: F = zeta 1e6 N/m^3 u per area. */
static Law resist_law(const MildMaterial *material, double pitch) {
    const double area = pitch * pitch;
    return law_line(material->zeta * LAW_RESIST_STRESS * area, area, material->bed_depth);
}

/* Friction is 0, because the measured coefficients include the friction of the plate. */
static void resist_material(MildMaterial *material, double area) {
    (void)area;
    material->zeta = 1.0;
    material->recovery = 0.0;
    material->mu = material->k_drift = material->b_drift = 0.0;
}

const ModelRow model_ecc_quasi = {
    .info = {.summary = "resistive force theory under every element",
             .source = "Li et al. 2013, Xiong et al. 2017",
             .fields = {"zeta", "mu", "k_drift", "b_drift", "bed_depth", "refill"},
             .scaled = {"zeta"},
             .match_note = "recovery 0; mu, k_drift, b_drift 0: friction is part of zeta"},
    .law = resist_law,
    .reference = resist_material,
    .motion = LAW_PLANE,
    .direction = resist_plane,
};

const ModelRow model_ecc_quasi_3d = {
    .info = {.summary = "three-dimensional resistive force theory under every element",
             .source = "Agarwal et al. 2023",
             .fields = {"zeta", "mu", "k_drift", "b_drift", "bed_depth", "refill"},
             .scaled = {"zeta"},
             .match_note = "recovery 0; mu, k_drift, b_drift 0: friction is part of zeta"},
    .law = resist_law,
    .reference = resist_material,
    .motion = LAW_SPACE,
    .direction = resist_space,
};
