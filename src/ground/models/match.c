/* Public functions on the law of a model: one element, a level sole, and the material of another
 * model that sinks equally deep. */
#define POWER_CALLED /* power.h: no vector loop here needs a power */
#include "ground/law/models.h"
#include "ground/sole/sole.h"

#include <math.h>

/* A curve that the law does not have adds 0. */
static MildElementLaw law_at(const Law *law, double depth) {
    enum { curves = LAW_ANY };
    const double elastic = law_elastic_force(law, curves, depth);
    return (MildElementLaw){
        .force = law_force(law, curves, depth) + elastic,
        .stiffness = law_slope(law, curves, depth) + law_elastic_slope(law, curves, depth),
        .damping = law->elastic_damping * elastic,
        .added_mass = law->mass_rate * law_moved(law, curves, depth),
        .added_mass_per_depth = law->mass_rate * law_moved_share(law, curves, depth),
    };
}

static MildElementLaw element_law(const MildMaterial *material, double pitch, double width,
                                  double depth) {
    const Law law = law_of(material, pitch, width);
    return law_at(&law, depth);
}

MildElementLaw mild_element_law(const MildMaterial *material, double pitch, double depth) {
    return element_law(material, pitch, pitch, depth);
}

/* Adds `count` elements to a sum. */
static void law_add(MildElementLaw *sum, double count, const MildElementLaw *one) {
    sum->force += count * one->force;
    sum->stiffness += count * one->stiffness;
    sum->damping += count * one->damping;
    sum->added_mass += count * one->added_mass;
    sum->added_mass_per_depth += count * one->added_mass_per_depth;
}

MildElementLaw mild_sole_law(const MildMaterial *material, const MildSole *sole, double depth) {
    const Law law = law_of(material, mild_sole_pitch(sole), mild_sole_width(sole));
    const int merged = model_row(material->model)->merged;
    const int elements = mild_sole_elements(sole);
    MildElementLaw sum = {0};
    for (int i = 0; i < (merged ? elements : 1); i++) {
        const SoleHeap heap = merged ? sole_heap(sole, i) : (SoleHeap){0.0, 1.0};
        const Law own = merged ? law_of_heap(law, heap.begin, heap.width) : law;
        const MildElementLaw one = law_at(&own, depth);
        law_add(&sum, merged ? 1.0 : elements, &one);
    }
    return sum;
}

static double sole_force(const MildSole *sole, const MildMaterial *material, double depth) {
    return mild_sole_law(material, sole, depth).force;
}

double mild_sole_sinkage(const MildSole *sole, const MildMaterial *material, double load) {
    enum { HALVINGS = 60 };
    double low = 0.0, high = fmax(material->bed_depth, 1e-3);
    for (int i = 0; i < HALVINGS && sole_force(sole, material, high) < load; i++) {
        high *= 2.0;
    }
    for (int i = 0; i < HALVINGS; i++) { /* bisection, because the force increases with depth */
        double middle = 0.5 * (low + high);
        *(sole_force(sole, material, middle) < load ? &low : &high) = middle;
    }
    return 0.5 * (low + high);
}

/* Gives a single element the drift numbers of all `cells` of the raster together. */
static void material_concentrate(MildMaterial *m, double cells) {
    m->k_drift *= cells;
    m->b_drift *= cells;
}

/* The number of a material that has this key. */
static double *material_number(MildMaterial *m, const char *key) {
    const MildField *field =
        mild_field_find(mild_material_fields, mild_material_field_count, key, NULL);
    return (double *)((uintptr_t)m + field->offset);
}

/* Above the bed, a law is proportional to its `scaled` fields, so a single factor matches it.
 * pressure: [N/m^2] that the ground above the bed carries. area: [m^2] of one element of the
 * rival. */
static void rival_scale(MildMaterial *m, const ModelRow *row, double pressure, double area,
                        const MildSole *sole, double depth) {
    MildMaterial bottomless = *m;
    bottomless.bed_depth = INFINITY;
    const double force =
        row->merged ? sole_force(sole, &bottomless, depth) / mild_sole_elements(sole)
                    : element_law(&bottomless, sqrt(area), mild_sole_width(sole), depth).force;
    const double scale = pressure * area / force;
    for (int k = 0; k < MILD_MODEL_SCALED && row->info.scaled[k]; k++) {
        *material_number(m, row->info.scaled[k]) *= scale;
    }
}

static MildStatus match_check(int model, const MildMaterial *from, double load, MildError *error) {
    if (model < 0 || model >= MILD_MODELS) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "model: there is no model %d", model);
    }
    if (model == MILD_MODEL_RIGID) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "model: rigid is the engine's own contact and has no material");
    }
    const MildStatus status = mild_material_check(from, error);
    if (status == MILD_OK && !model_is_cones(from->model)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "model: only a material of mild or mild_merged can be matched, and this "
                         "is one of %s",
                         mild_model_names[from->model]);
    }
    if (status == MILD_OK && !(load > 0.0 && load < INFINITY)) {
        return mild_fail(error, MILD_ERROR_RANGE, "model: load = %g N must be positive", load);
    }
    return status;
}

MildStatus mild_model_match(MildModel model, const MildMaterial *from, const MildSole *sole,
                            double load, MildMaterial *rival, MildError *error) {
    MildStatus status = match_check((int)model, from, load, error);
    if (status != MILD_OK) {
        return status;
    }
    if (from->model == (int)model) {
        *rival = *from;
        return MILD_OK;
    }
    if (mild_sole_surface_z(sole)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "sole: a model is matched under a sole of mild_sole_create, not a shell");
    }
    const ModelRow *row = model_row((int)model);
    const double cells = mild_sole_elements(sole);
    const double cell = mild_sole_pitch(sole) * mild_sole_pitch(sole);
    const double area = row->info.concentric ? cells * cell : cell;
    const double depth = mild_sole_sinkage(sole, from, load);
    const double pressure =
        load / (cells * cell) - LAW_BED_STRESS * fmax(depth - from->bed_depth, 0.0);

    MildMaterial matched = *from;
    matched.model = (int)model;
    if (from->model == MILD_MODEL_MILD_MERGED) {
        matched.slip_length = matched.grip = matched.slip_growth = 0.0;
    }
    if (row->info.concentric) {
        material_concentrate(&matched, cells);
    }
    if (row->reference) {
        row->reference(&matched, area);
    }
    if (row->info.scaled[0]) {
        rival_scale(&matched, row, pressure, area, sole, depth);
    }
    MildError why;
    status = mild_material_check(&matched, &why);
    if (status != MILD_OK) {
        return mild_fail(error, status, "model: %s cannot match this material under %g N: %s",
                         mild_model_names[model], load, why.text);
    }
    *rival = matched;
    return MILD_OK;
}
