#include <stdio.h>
#include <string.h>

#include "ground/law/models.h"

/* The ranges are those in which the equations make sense. They are wider than the random draws of
 * the paper's Table III. */
#define FIELD(member, low, high, help)                                                             \
    MILD_FIELD(MildMaterial, member, MILD_FIELD_DOUBLE, 1, low, high, help)
const MildField mild_material_fields[] = {
    FIELD(k_pen, 1.0, 1e7, "[N/m] penetration stiffness of one element at the surface"),
    FIELD(sigma_cone, 0.0, 5e6, "[N/m^3] depth-dependent conical stress"),
    FIELD(alpha, 0.1, 1.5, "[rad] shear band angle"),
    FIELD(nu, 0.1, 10.0, "[-] recruitment rate"),
    FIELD(c_g, -1.4, 50.0, "[-] surrounding mass scale; below 0 only with passive = false"),
    FIELD(c_d, -6.0, 100.0, "[-] inertial drag scale; below 1/2 only with passive = false"),
    FIELD(phi, 0.05, 0.75, "[-] volume fraction"),
    FIELD(rho, 1.0, 5000.0, "[kg/m^3] grain density"),
    FIELD(mu, 0.0, 3.0, "[-] friction coefficient"),
    FIELD(k_drift, 0.0, 1e6, "[N/m^2] drift stiffness per element"),
    FIELD(b_drift, 0.0, 100.0, "[N s/m] drift damping per element"),
    FIELD(recovery, 0.0, 1.0, "[-] share of the depth that springs back: 1 elastic, 0 plastic"),
    FIELD(bed_depth, 0.001, 10.0, "[m] depth of the firm bed below the surface"),
    FIELD(
        zeta, 0.0, 100.0,
        "[-] ecc_quasi*: stress per depth under a level plate moving straight down, in 1e6 N/m^3"),
    MILD_FIELD(MildMaterial, passive, MILD_FIELD_BOOL, 1, 0, 1,
               "[-] clamp c_g >= 0 and c_d >= 1/2, so that the ground creates no energy"),
    MILD_FIELD_CHOICE(MildMaterial, model, mild_model_names, MILD_MODELS, "[-] ground model"),
    FIELD(exponent, 0.1, 2.0, "[-] bekker, hunt_crossley: exponent n of the depth"),
    FIELD(dissipation, 0.0, 50.0,
          "[s/m] hunt_crossley: damping; the coefficient of restitution is 1 - dissipation v"),
    FIELD(k_c, -1e10, 1e10, "[N/m^(n+1)] bekker: cohesive modulus, divided by plate_width"),
    FIELD(k_phi, 0.0, 1e12, "[N/m^(n+2)] bekker: frictional modulus"),
    FIELD(plate_width, 0.0, 1.0, "[m] bekker: b, shorter side of the loaded plate; 0: of the sole"),
    FIELD(cohesion, 0.0, 1e6, "[N/m^2] bekker: shear strength without load"),
    FIELD(shear_length, 0.001, 0.1, "[m] bekker: slip over which the shear strength builds up"),
    FIELD(slip_length, 0.0, 1.0,
          "[m] mild, mild_merged: path over which slip halves the support; 0: it does not"),
    FIELD(regain_length, 1e-4, 1.0,
          "[m] mild, mild_merged: fresh penetration over which the support comes back"),
    FIELD(grip, 0.0, 1.0,
          "[-] with slip_length: greatest friction of a sliding sole by its virgin load; 0: mu"),
    FIELD(slip_growth, 0.0, 1.0, "[-] growth of both lengths with the depth"),
    FIELD(refill, 0.0, 1.0, "[-] share of an imprint's depth that flows back as the foot leaves"),
};
const int mild_material_field_count =
    (int)(sizeof mild_material_fields / sizeof *mild_material_fields);

/* What the presets of mild and mild_merged differ in. */
typedef struct {
    const char *name;
    double k_pen;
    double sigma_cone;
    double alpha;
    double nu;
    double c_g;
    double c_d;
    double phi;
    double rho;
    double mu;
    double k_drift;
    double b_drift;
    double recovery;
    double bed_depth;
    int granular; /* bool: of mild_merged, and slip costs support as in simulated grains */
} Preset;

/* docs/model.md section 10 gives the sources. Foam and rubber are so light that they have no added
 * mass. Friction, drift and bed are our choice. k_pen and sigma_cone of granular ground carry the
 * SA01 as deep as the paper's numbers for mild, 380 and 0.15e6, 700 and 0.24e6. */
/* clang-format off */
static const Preset presets[] = {
    /* in the order of Preset; from rubber_tile on measured; their elastic ones are straight: u_f is
     * 0.4 m */
    {"rubber", 1400, 0.24e6, 1.31, 0.8, 0, 1, 0.57, 1000, 1, 100, 0.02, 1, 0.1, 0},
    {"foam60", 850, 0.20e6, 1.2, 1.2, 0, 1, 0.57, 1000, 0.9, 200, 0.05, 1, 0.1, 0},
    {"foam45", 480, 0.17e6, 1.1, 1.6, 0, 1, 0.57, 1000, 0.9, 200, 0.05, 1, 0.1, 0},
    {"foam28", 190, 0.13e6, 1.047, 2, 0, 1, 0.57, 1000, 0.8, 200, 0.05, 1, 0.12, 0},
    {"foam25", 150, 0.11e6, 1.047, 2, 0, 1, 0.57, 1000, 0.8, 200, 0.05, 1, 0.12, 0},
    {"grass", 550, 0.24e6, 1.1, 1.6, 0.5, 1, 0.5, 1000, 0.7, 300, 0.05, 0.5, 0.1, 0},
    {"sand_loose", 237.962, 93932.4, 1.047, 2, 2.7, 17.2, 0.57, 1000, 0.6, 400, 0.1, 0, 0.15, 1},
    {"sand_dense", 616.675, 211431.5, 1.047, 1.6, 2.7, 17.2, 0.62, 1000, 0.7, 800, 0.1, 0, 0.15, 1},
    {"rubber_tile", 38025, 0.24e6, 1.31, 0.1, 0, 1, 0.57, 1000, 0.9, 100, 0.02, 1, 0.1, 0},
    {"running_track", 114075, 0.24e6, 1.31, 0.1, 0, 1, 0.57, 1000, 0.9, 100, 0.02, 1, 0.1, 0},
    {"artificial_turf", 22815, 0.24e6, 1.31, 0.1, 0, 1, 0.57, 1000, 0.9, 100, 0.02, 1, 0.1, 0},
    {"gym_mat", 1521, 0.24e6, 1.31, 0.1, 0, 1, 0.57, 1000, 0.8, 100, 0.02, 1, 0.03, 0},
    {"carpet", 7605, 0.24e6, 1.31, 0.1, 0, 1, 0.57, 1000, 0.8, 100, 0.02, 1, 0.002, 0},
    {"dry_sand_loose", 96.5835, 242655, 0.3, 1, 29, 1, 0.58, 2500, 0.55, 400, 0.1, 0, 0.1, 1},
    {"dry_sand_close", 176.436, 443276, 0.3, 1, 29, 1, 0.63, 2500, 0.7, 400, 0.1, 0, 0.1, 1},
    {"moist_sand", 676.0845, 1698590, 0.3, 1, 29, 1, 0.63, 2500, 0.7, 400, 0.1, 0, 0.1, 1},
    {"fresh_snow", 14.4115, 36207.3, 0.3, 1, 0, 1, 0.2, 917, 0.36, 400, 0.1, 0, 0.05, 1},
    {"groomed_snow", 15210, 0.24e6, 1.31, 0.1, 0, 1, 0.5, 917, 0.36, 100, 0.02, 0, 0.1, 0},
};
/* clang-format on */
#define PRESETS ((int)(sizeof presets / sizeof *presets))

int mild_material_preset_count(void) {
    return PRESETS;
}

const char *mild_material_preset_name(int index) {
    return index >= 0 && index < PRESETS ? presets[index].name : NULL;
}

/* Preset of mild or mild_merged by name, or NULL. */
static const Preset *find_preset(const char *name) {
    for (int i = 0; i < PRESETS; i++) {
        if (strcmp(presets[i].name, name) == 0) {
            return &presets[i];
        }
    }
    return NULL;
}

/* The material of a preset. Only bekker and hunt_crossley read the numbers from exponent on. They
 * are those of the dry sand of Wong 2008, table 2.3, with some damping. Those of slip are measured
 * on simulated grains (docs/model.md section 22). */
static MildMaterial preset_material(const Preset *preset) {
    const int slips = preset->granular;
    return (MildMaterial){
        .k_pen = preset->k_pen,
        .sigma_cone = preset->sigma_cone,
        .alpha = preset->alpha,
        .nu = preset->nu,
        .c_g = preset->c_g,
        .c_d = preset->c_d,
        .phi = preset->phi,
        .rho = preset->rho,
        .mu = preset->mu,
        .k_drift = preset->k_drift,
        .b_drift = preset->b_drift,
        .recovery = preset->recovery,
        .bed_depth = preset->bed_depth,
        .zeta = 1.0,
        .passive = 1,
        .model = slips ? MILD_MODEL_MILD_MERGED : MILD_MODEL_MILD,
        .exponent = 1.1,
        .dissipation = 0.3,
        .k_c = 990.0,
        .k_phi = 1528430.0,
        .plate_width = 0.0,
        .cohesion = 1040.0,
        .shear_length = 0.01,
        .slip_length = slips ? 1.4e-3 : 0.0,
        .regain_length = 0.68e-3,
        .grip = slips ? 0.123 : 0.0,
        .slip_growth = slips ? 0.07 : 0.0,
    };
}

MildMaterial mild_material_default(void) {
    MildMaterial m = preset_material(find_preset("sand_loose"));
    m.model = MILD_MODEL_MILD;
    m.k_pen = 380.0;
    m.sigma_cone = 0.15e6;
    m.slip_length = m.grip = m.slip_growth = 0.0;
    return m;
}

int mild_material_preset(const char *name, MildMaterial *material) {
    const Preset *preset = find_preset(name);
    if (preset) {
        *material = preset_material(preset);
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

/* Writes the names of all models except rigid, separated by commas. */
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
                         "ground.model = rigid has no soft ground, because it is the engine's own "
                         "contact: choose one of %s",
                         soft_names(names, sizeof names));
    }
    const MildStatus status = mild_fields_check(mild_material_fields, mild_material_field_count,
                                                material, "ground", error);
    const double least = plate_width_least(material);
    if (status == MILD_OK && material->plate_width > 0.0 && material->plate_width < least) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "ground.plate_width = %g is below %g%s; 0 takes the shorter side of the "
                         "sole",
                         material->plate_width, least,
                         least > MATERIAL_PLATE_MIN ? " = -k_c/k_phi" : "");
    }
    return status;
}
