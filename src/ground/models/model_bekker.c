/* Bekker's pressure-sinkage law and the shear law of Janosi and Hanamoto (J. Y. Wong, Theory of
 * Ground Vehicles, 4th edition, 2008, chapter 2):
 *
 *     p = (k_c/b + k_phi) z^n
 *     s = (c + p mu) (1 - exp(-j/K))
 * j is the distance that the element has slid since it touched down, which is its drift
 * (ElementMemory in element.h). */
#include "ground/law/friction.h"
#include "ground/law/model.h"
#include "ground/step/step.h"

/* Wong 2008, table 2.3, gives n, k_c, k_phi, c and the angle of the first four soils, in the rows
 * named below. It gives K by the kind of ground: 10 mm for firm sand, 25 mm for loose sand, 6 mm
 * for clay, 25 to 50 mm for fresh snow. Ding et al., J. Field Robotics 32 (2015), table I, give 10
 * to 25 mm for the dry sand and 6 mm for the clay. Of a range we use one end.
 *
 *     dry_sand     "Dry sand", Land Locomotion Laboratory; K of firm sand
 *     sandy_loam   "Sandy loam", 15 % moisture, Land Locomotion Laboratory; K of loose sand
 *     clay         "Clayey soil", 38 % moisture, Thailand
 *     snow         "Snow (U.S.)"; K the lower end
 *     lunar_soil   Carrier, Olhoeft, Mendell in Heiken, Vaniman, French, Lunar Sourcebook, 1991,
 *                  section 9.1. The same n, k_c, k_phi, c and angle in Li et al., NASA NTRS
 *                  20220010732 (2022); Ding's table I has 18 mm for K. */
typedef struct {
    const char *name;
    double exponent;     /* n [-] */
    double k_c;          /* [N/m^(n+1)] */
    double k_phi;        /* [N/m^(n+2)] */
    double cohesion;     /* c [N/m^2] */
    double angle;        /* [degrees] friction angle, mu = tan(angle) */
    double shear_length; /* K [m] */
} Soil;
static const Soil soils[] = {
    {"dry_sand", 1.1, 990.0, 1528430.0, 1040.0, 28.0, 0.010},
    {"sandy_loam", 0.7, 5270.0, 1515040.0, 1720.0, 29.0, 0.025},
    {"clay", 0.5, 13190.0, 692150.0, 4140.0, 13.0, 0.006},
    {"snow", 1.6, 4370.0, 196720.0, 1030.0, 19.7, 0.025},
    {"lunar_soil", 1.0, 1400.0, 820000.0, 170.0, 35.0, 0.0178},
};

static int bekker_preset(const char *name, MildMaterial *material) {
    for (size_t i = 0; i < sizeof soils / sizeof *soils; i++) {
        const Soil *soil = &soils[i];
        if (strcmp(soil->name, name) != 0) {
            continue;
        }
        material->model = MILD_MODEL_BEKKER;
        material->exponent = soil->exponent;
        material->k_c = soil->k_c;
        material->k_phi = soil->k_phi;
        material->cohesion = soil->cohesion;
        material->mu = tan(soil->angle * LAW_PI / 180.0);
        material->shear_length = soil->shear_length;
        material->k_drift = material->b_drift = 0.0;
        material->bed_depth = 1.0;
        return 1;
    }
    return 0;
}

static Law bekker_law(const MildMaterial *material, double pitch) {
    const double area = pitch * pitch;
    const double modulus = material->k_c / material->plate_width + material->k_phi;
    Law law = law_line(0.0, area, material->bed_depth);
    law.power_force = (modulus < 0.0 ? 0.0 : modulus) * pow(POWER_DEPTH, material->exponent) * area;
    law.power_exponent = material->exponent;
    return law;
}

/* Dry sand without cohesion, with the friction of the material of mild. */
static void bekker_material(MildMaterial *material, double area) {
    (void)area;
    material->exponent = soils[0].exponent;
    material->k_c = soils[0].k_c;
    material->k_phi = soils[0].k_phi;
    material->cohesion = 0.0;
}

/* mu [-] of a slot's material, or of its mixture of two. */
static double slot_mu(const MildTerrain *terrain, int32_t mixture) {
    const double near = terrain->materials[mixture & 0xff].mu;
    const double far = terrain->materials[mixture >> 8 & 0xff].mu;
    return mixture >> 16 ? near + (mixture >> 16) / 255.0 * (far - near) : near;
}

/* The shear of a block of slots. */
typedef struct {
    Lanes mu, cohesion, length, area; /* Shear */
    Lanes own;                        /* bool: the nearer material of the slot is of this model */
} ShearLanes;

/* What the materials of the slots from `first` on say. */
static __attribute__((noinline)) void shear_lanes(const FootScratch *foot,
                                                  const MildTerrain *terrain, int model, int first,
                                                  ShearLanes *to) {
    const double area = foot->pitch * foot->pitch;
    const Slots *s = slot_block(foot, first);
    *to = (ShearLanes){.own = {0.0}};
    for (int l = 0; l < SLOT_LANES && first + l < foot->active; l++) {
        const int32_t mixture = foot->slot_material[first + l];
        const MildMaterial *material = &terrain->materials[mixture & 0xff];
        to->own[l] = material->model == model && !(mixture & SLOT_BARRED);
        to->mu[l] = foot->curves & LAW_HEAP /* what slip has left, beside such ground */
                        ? s->mu[l]
                        : slot_mu(terrain, mixture);
        to->cohesion[l] = material->cohesion;
        to->length[l] = material->shear_length;
        to->area[l] = foot->shell ? s->area_share[l] * area : area;
    }
}

MILD_HD void slot_shear(Slots *s, int l, const ShearLanes *lanes, double dt, double rate) {
    const Shear shear = {lanes->mu[l], lanes->cohesion[l], lanes->length[l], lanes->area[l]};
    const int own = lanes->own[l] > 0.0;
    const ElementMemory memory = slot_memory(s, l);
    Element element = slot_loaded(s, l, LAW_ANY);
    const double force =
        law_force(&element.law, LAW_ANY, element.yield_depth) + s->fx[l]; /* slots_elastic */
    element_shear_of(&element, &memory, &shear, force, dt, rate);
    s->mu[l] = own ? element.mu : s->mu[l];
    s->drift_bound[l] = own ? element.drift_bound : s->drift_bound[l];
    s->hold_x[l] = own ? element.hold_x : s->hold_x[l];
    s->hold_y[l] = own ? element.hold_y : s->hold_y[l];
    s->hold_stiffness[l] = own ? element.hold_stiffness : s->hold_stiffness[l];
}

/* Sets friction by the shear law in the slots whose nearer material is of this model. */
static void bekker_shear(const FootScratch *foot, const MildTerrain *terrain, int model, double dt,
                         const double *rotation, const Motion *now) {
    (void)rotation;
    (void)now;
    const double rate = 1.0 / dt;
    slots_elastic(foot);
    for (int first = 0; first < foot->active; first += SLOT_LANES) {
        Slots *s = slot_block(foot, first);
        ShearLanes lanes;
        shear_lanes(foot, terrain, model, first, &lanes);
#pragma omp simd
        for (int l = 0; l < SLOT_LANES; l++) {
            slot_shear(s, l, &lanes, dt, rate);
        }
    }
}

const ModelRow model_bekker = {
    .info = {.summary = "pressure a power of the sinkage; shear strength grows with slip",
             .source = "Bekker 1969, Janosi and Hanamoto 1961",
             .fields = {"k_c", "k_phi", "exponent", "plate_width", "cohesion", "mu", "shear_length",
                        "k_drift", "b_drift", "recovery", "bed_depth", "refill"},
             .scaled = {"k_c", "k_phi"},
             .presets = {"dry_sand", "sandy_loam", "clay", "snow", "lunar_soil"},
             .match_note = "exponent 1.1, k_c : k_phi of dry sand, cohesion 0"},
    .law = bekker_law,
    .reference = bekker_material,
    .motion = LAW_SHEAR,
    .direction = bekker_shear,
    .preset = bekker_preset,
};
