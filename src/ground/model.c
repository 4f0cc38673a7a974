#include <math.h>

#include "ground/material.h"

/* Choi et al. 2023, the set for a foot of area A: k = 1e6 N/m^3 A, the cone's numbers below. */
#define CHOI_STRESS 1e6   /* [N/m^3] k/A */
#define CHOI_SIGMA 0.15e6 /* [N/m^3] */
#define CHOI_ALPHA (LAW_PI / 3.0)

int mild_model_is_concentric(MildModel model) {
    return model == MILD_MODEL_CON_CONE || model == MILD_MODEL_CON_SPRING;
}

static double sole_force(const MildSole *sole, const MildMaterial *material, double depth) {
    return mild_sole_elements(sole) *
           mild_element_law(material, mild_sole_pitch(sole), depth).force;
}

double mild_sole_sinkage(const MildSole *sole, const MildMaterial *material, double load) {
    double low = 0.0, high = material->bed_depth;
    while (sole_force(sole, material, high) < load) {
        high *= 2.0;
    }
    for (int i = 0; i < 60; i++) { /* the law rises with depth: bisection */
        double middle = 0.5 * (low + high);
        *(sole_force(sole, material, middle) < load ? &low : &high) = middle;
    }
    return 0.5 * (low + high);
}

/* Per-element numbers of the raster's `cells`, gathered in one element. */
static void material_concentrate(MildMaterial *m, double cells) {
    m->k_drift *= cells;
    m->b_drift *= cells;
}

/* A rival's law is proportional to its strength, so one division matches it. pressure: what the
 * ground above the bed carries per area [N/m^2]; area: of one element of the rival [m^2]. */
static void rival_cone(MildMaterial *m, double pressure, double area, double depth) {
    m->alpha = CHOI_ALPHA;
    m->nu = 2.0;
    m->c_g = 2.7;
    m->c_d = 17.2;
    m->phi = 0.57;
    m->rho = 1000.0;
    m->k_pen = CHOI_STRESS * area;
    m->sigma_cone = CHOI_SIGMA;
    MildMaterial bottomless = *m;
    bottomless.bed_depth = INFINITY;
    double scale = pressure * area / mild_element_law(&bottomless, sqrt(area), depth).force;
    m->k_pen *= scale;
    m->sigma_cone *= scale;
}

static void rival_spring(MildMaterial *m, double pressure, double area, double depth) {
    m->k_pen = pressure * area / depth;
    m->recovery = 0.0;
}

/* The plate's friction is part of the measured coefficients. */
static void rival_quasi(MildMaterial *m, double pressure, double depth) {
    m->zeta = pressure / (LAW_RESIST_STRESS * depth);
    m->recovery = 0.0;
    m->mu = m->k_drift = m->b_drift = 0.0;
}

MildStatus mild_model_match(MildModel model, const MildMaterial *mild, const MildSole *sole,
                            double load, MildMaterial *rival, MildError *error) {
    if (model == MILD_MODEL_RIGID) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "model: rigid is the engine's own contact and has no material");
    }
    if (mild->model != MILD_MODEL_MILD) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "model: only a material of mild can be matched, this one is of %s",
                         mild_model_names[mild->model]);
    }
    if (!(load > 0.0 && load < INFINITY)) {
        return mild_fail(error, MILD_ERROR_RANGE, "model: load = %g N must be positive", load);
    }
    double cells = mild_sole_elements(sole), cell = mild_sole_pitch(sole) * mild_sole_pitch(sole);
    double depth = mild_sole_sinkage(sole, mild, load),
           area = mild_model_is_concentric(model) ? cells * cell : cell;
    double pressure = load / (cells * cell) - LAW_BED_STRESS * fmax(depth - mild->bed_depth, 0.0);
    *rival = *mild;
    rival->model = (int)model;
    if (mild_model_is_concentric(model)) {
        material_concentrate(rival, cells);
    }
    if (model == MILD_MODEL_CON_CONE) {
        rival_cone(rival, pressure, area, depth);
    }
    if (model == MILD_MODEL_CON_SPRING || model == MILD_MODEL_ECC_SPRING) {
        rival_spring(rival, pressure, area, depth);
    }
    if (model == MILD_MODEL_ECC_QUASI || model == MILD_MODEL_ECC_QUASI_3D) {
        rival_quasi(rival, pressure, depth);
    }
    return MILD_OK;
}
