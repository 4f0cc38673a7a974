#include <stdio.h>
#include <string.h>

#include "ground/models.h"

/* The ranges are what the equations bear, wider than the draws of the paper's Table III. */
#define FIELD(member, low, high, help)                                                             \
    MILD_FIELD(MildMaterial, member, MILD_FIELD_DOUBLE, 1, low, high, help)
const MildField mild_material_fields[] = {
    FIELD(k_pen, 1.0, 1e7, "[N/m] penetration stiffness of one element at the surface"),
    FIELD(sigma_cone, 0.0, 5e6, "[N/m^3] depth-dependent conical stress"),
    FIELD(alpha, 0.1, 1.5, "[rad] shear band angle"),
    FIELD(nu, 0.1, 10.0, "[-] recruitment rate"),
    FIELD(c_g, -1.4, 10.0, "[-] surrounding mass scale; negative only acts with passive = false"),
    FIELD(c_d, -6.0, 100.0, "[-] inertial drag scale; below 1/2 only acts with passive = false"),
    FIELD(phi, 0.05, 0.75, "[-] volume fraction"),
    FIELD(rho, 1.0, 5000.0, "[kg/m^3] grain density"),
    FIELD(mu, 0.0, 3.0, "[-] friction coefficient"),
    FIELD(k_drift, 0.0, 1e6, "[N/m^2] drift stiffness per element"),
    FIELD(b_drift, 0.0, 100.0, "[N s/m] drift damping per element"),
    FIELD(recovery, 0.0, 1.0, "[-] share of the depth that springs back: 1 elastic, 0 plastic"),
    FIELD(bed_depth, 0.001, 10.0, "[m] firm bottom below the surface"),
    FIELD(zeta, 0.0, 100.0,
          "[-] ecc_quasi*: stress in 1e6 N/m^3 of a level plate going straight down"),
    MILD_FIELD(MildMaterial, passive, MILD_FIELD_BOOL, 1, 0, 1,
               "[-] clamp c_g >= 0 and c_d >= 1/2: no energy is created"),
    MILD_FIELD_CHOICE(MildMaterial, model, mild_model_names, MILD_MODELS, "[-] ground model"),
    FIELD(exponent, 0.1, 2.0, "[-] bekker, hunt_crossley: power n of the depth"),
    FIELD(dissipation, 0.0, 50.0, "[s/m] hunt_crossley: damping; restitution is 1 - this times v"),
    FIELD(k_c, 0.0, 1e10, "[N/m^(n+1)] bekker: modulus by the plate's width"),
    FIELD(k_phi, 0.0, 1e12, "[N/m^(n+2)] bekker: modulus whatever the width"),
    FIELD(plate_width, 0.005, 1.0, "[m] bekker: smaller side of the loaded plate"),
    FIELD(cohesion, 0.0, 1e6, "[N/m^2] bekker: shear strength without load"),
    FIELD(shear_length, 0.001, 0.1, "[m] bekker: over which shear strength builds up"),
};
const int mild_material_field_count =
    (int)(sizeof mild_material_fields / sizeof *mild_material_fields);

/* docs/model.md section 10. Foams and rubber weigh grams: no added mass. Friction, drift and bed
 * are our choice. */
typedef struct {
    const char *name;
    MildMaterial material;
} Preset;
/* What only bekker and hunt_crossley read, the same in all: the dry sand of Wong 2008, table 2.3,
 * under a foot 0.1 m wide, and some damping: exponent dissipation k_c k_phi plate_width cohesion
 * shear_length. */
#define RIVALS 1.1, 0.3, 990.0, 1528430.0, 0.1, 1040.0, 0.01
/*              k_pen sigma_cone alpha  nu   c_g  c_d   phi   rho     mu   k_drift b_drift recovery
 * bed zeta passive model */
static const Preset presets[] = {
    {"rubber",
     {1400.0, 0.24e6, 1.310, 0.8, 0.0, 1.0, 0.57, 1000.0, 1.0, 100.0, 0.02, 1.0, 0.10, 1.0, 1, 0,
      RIVALS}},
    {"foam60",
     {850.0, 0.20e6, 1.20, 1.2, 0.0, 1.0, 0.57, 1000.0, 0.9, 200.0, 0.05, 1.0, 0.10, 1.0, 1, 0,
      RIVALS}},
    {"foam45",
     {480.0, 0.17e6, 1.10, 1.6, 0.0, 1.0, 0.57, 1000.0, 0.9, 200.0, 0.05, 1.0, 0.10, 1.0, 1, 0,
      RIVALS}},
    {"foam28",
     {190.0, 0.13e6, 1.047, 2.0, 0.0, 1.0, 0.57, 1000.0, 0.8, 200.0, 0.05, 1.0, 0.12, 1.0, 1, 0,
      RIVALS}},
    {"foam25",
     {150.0, 0.11e6, 1.047, 2.0, 0.0, 1.0, 0.57, 1000.0, 0.8, 200.0, 0.05, 1.0, 0.12, 1.0, 1, 0,
      RIVALS}},
    {"grass",
     {550.0, 0.24e6, 1.10, 1.6, 0.5, 1.0, 0.50, 1000.0, 0.7, 300.0, 0.05, 0.5, 0.10, 1.0, 1, 0,
      RIVALS}},
    {"sand_loose",
     {380.0, 0.15e6, 1.047, 2.0, 2.7, 17.2, 0.57, 1000.0, 0.6, 400.0, 0.10, 0.0, 0.15, 1.0, 1, 0,
      RIVALS}},
    {"sand_dense",
     {700.0, 0.24e6, 1.047, 1.6, 2.7, 17.2, 0.62, 1000.0, 0.7, 800.0, 0.10, 0.0, 0.15, 1.0, 1, 0,
      RIVALS}},
};
#define PRESETS ((int)(sizeof presets / sizeof *presets))

int mild_material_preset_count(void) {
    return PRESETS;
}

const char *mild_material_preset_name(int index) {
    return index >= 0 && index < PRESETS ? presets[index].name : NULL;
}

/* Preset of mild by name, or NULL. */
static const MildMaterial *find_preset(const char *name) {
    for (int i = 0; i < PRESETS; i++) {
        if (strcmp(presets[i].name, name) == 0) {
            return &presets[i].material;
        }
    }
    return NULL;
}

MildMaterial mild_material_default(void) {
    return *find_preset("sand_loose");
}

int mild_material_preset(const char *name, MildMaterial *material) {
    const MildMaterial *preset = find_preset(name);
    if (preset) {
        *material = *preset;
        return 1;
    }
    for (int m = 0; m < MILD_MODEL_RIGID; m++) {
        const ModelRow *row = model_row(m);
        MildMaterial found = mild_material_default();
        if (row->preset && row->preset(name, &found)) {
            *material = found;
            return 1;
        }
    }
    return 0;
}

/* Names of the models that a material can have, separated by commas. */
static const char *soft_names(char *text, size_t size) {
    size_t used = 0;
    text[0] = '\0';
    for (int m = 0; m < MILD_MODEL_RIGID && used < size; m++) {
        used += (size_t)snprintf(text + used, size - used, m ? ", %s" : "%s", mild_model_names[m]);
    }
    return text;
}

MildStatus mild_material_check(const MildMaterial *material, MildError *error) {
    if (material->model == MILD_MODEL_RIGID) {
        char names[160];
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "ground.model = rigid is the engine's own contact, which has no soft "
                         "ground: choose one of %s",
                         soft_names(names, sizeof names));
    }
    return mild_fields_check(mild_material_fields, mild_material_field_count, material, "ground",
                             error);
}
