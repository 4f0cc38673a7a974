#include <cjson/cJSON.h>
#include <mujoco/mujoco.h>
#include <oneapi/dnnl/dnnl.h>
#include <stdio.h>
#include <string.h>

#include "app/build.h"
#include "app/cli.h"
#include "app/commands.h"
#include "app/grounds.h"
#include "app/robots.h"
#include "base/text.h"
#include "identify/athlete.h"
#include "learn/cuda/learner.h"
#include "run/config/experiment_keys.h"

/* What each preset is, and where its numbers are from; "[choice]" is ours. docs/model.md section 10
 * has the details. */
static const struct {
    const char *ground, *source;
} sources[] = {
    {"rubber", "the paper's: stiff end of its ranges; a tile is 7 to 70 times stiffer"},
    {"foam60", "the paper's: foam of 60 kg/m^3, k_pen of a Gibson-Ashby foam on a 50 mm slab"},
    {"foam45", "the paper's: foam of 45 kg/m^3, as foam60"},
    {"foam28", "the paper's: foam of 28 kg/m^3, as foam60"},
    {"foam25", "the paper's: foam of 25 kg/m^3, as foam60"},
    {"grass", "the paper's: inside its ranges [choice]; half of the depth springs back"},
    {"sand_loose", "the paper's: inside its ranges [choice]; inertia after Choi et al. 2023"},
    {"sand_dense", "the paper's: as sand_loose, denser"},
    {"rubber_tile", "tile of 20 to 40 mm [choice], inside EN 14904: 25 to 75 %, up to 5 mm"},
    {"running_track",
     "EN 14877: 35 to 50 %, 0.6 to 2.5 mm; Colino 2020 measured 37 %, returned 63"},
    {"artificial_turf", "FIFA Quality: 55 to 70 %, 4 to 11 mm"},
    {"gym_mat", "40 mm of polyethylene foam LD33 (Zotefoams): 40 kPa at a quarter of it"},
    {"carpet", "2 mm of pile on a firm floor [choice]"},
    {"dry_sand_loose", "Li et al. 2013: 0.254 MPa/m, loosely packed poppy seeds; slip of grains"},
    {"dry_sand_close", "Li et al. 2013: 0.464 MPa/m, closely packed; slip of grains"},
    {"moist_sand", "7 times dry_sand_loose: Thiel et al. 2020, wet beach by dry; slip of grains"},
    {"fresh_snow", "50 mm [choice] of Wong's snow (U.S.), its pressure there; slip of grains"},
    {"groomed_snow", "Moessner et al. 2013: 0.04 N/mm^3, the softest piste"},
    {"dry_sand", "Wong 2008, table 2.3, Land Locomotion Laboratory"},
    {"sandy_loam", "15 % moisture; as dry_sand"},
    {"clay", "38 % moisture; Wong 2008, table 2.3, Thailand"},
    {"snow", "Wong 2008, table 2.3, snow (U.S.)"},
    {"lunar_soil", "Carrier, Olhoeft, Mendell 1991, section 9.1"},
};
enum { SOURCES = sizeof sources / sizeof *sources, BLOCK = 8 /* grounds of the paper */ };

static void print_cells(const char *title, const char *const *cells, int count) {
    printf("  %-12s", title);
    for (int i = 0; i < count; i++) {
        printf(" %15s", cells[i]);
    }
    printf("\n");
}

/* The grounds of a model, with the parameters that it reads. */
static void print_preset_table(MildModel model, const char *const *grounds, int count) {
    const MildModelInfo *info = mild_model_info(model);
    print_cells("", grounds, count);
    for (int f = 0; f < MILD_MODEL_FIELDS && info->fields[f]; f++) {
        const MildField *field =
            mild_field_find(mild_material_fields, mild_material_field_count, info->fields[f], NULL);
        char value[GROUNDS_MAX][64];
        const char *cells[GROUNDS_MAX];
        for (int p = 0; p < count; p++) {
            MildMaterial material;
            mild_material_preset(grounds[p], &material);
            if (field->type == MILD_FIELD_DOUBLE) {
                snprintf(value[p], sizeof value[p], "%.5g",
                         *(const double *)(const void *)((const char *)&material + field->offset));
            } else {
                mild_field_print(field, &material, value[p], sizeof value[p]);
            }
            cells[p] = value[p];
        }
        print_cells(field->name, cells, count);
    }
}

/* The paper's robot: 40 kg, 77 elements of 19.5 mm under each foot. */
static MildSole *paper_sole(void) {
    const double pitch = 0.0195, x = 5.5 * pitch, y = 3.5 * pitch;
    const double outline[] = {-x, -y, x, -y, x, y, -x, y};
    const MildSoleDef def = {
        .outline = outline, .points = 4, .pitch = pitch, .target_elements = 77};
    return mild_sole_create(&def, NULL);
}
static const double paper_weight = 40 * 9.81; /* [N] */

static const char *source_of(const char *ground) {
    for (int i = 0; i < SOURCES; i++) {
        if (strcmp(sources[i].ground, ground) == 0) {
            return sources[i].source;
        }
    }
    return "";
}

/* An athlete has no numbers on ground that stays dented, nor where it strikes the firm bed. */
static MildStatus print_measures(const MildSole *sole, const char *ground, MildError *error) {
    MildMaterial m;
    Athlete athlete;
    mild_material_preset(ground, &m);
    const MildStatus status = athlete_drop(&m, &athlete, error);
    if (status != MILD_OK) {
        return status;
    }
    const double area =
        mild_sole_elements(sole) * mild_sole_pitch(sole) * mild_sole_pitch(sole); /* [m^2] */
    const double depth = mild_sole_sinkage(sole, &m, paper_weight / 2);
    char reduction[16] = "-", deformation[16] = "-";
    if (m.recovery == 1.0 && athlete.deformation < m.bed_depth) {
        snprintf(reduction, sizeof reduction, "%.0f", 100.0 * athlete.reduction);
        snprintf(deformation, sizeof deformation, "%.1f", 1e3 * athlete.deformation);
    }
    printf("  %-15s %-11s %7.3g %7.3g %8.0f %5.2f %9s %11s  %s\n", ground,
           mild_model_names[m.model], 1e-6 * paper_weight / 2 / area / depth, 1e3 * depth,
           100.0 * athlete.returned, m.mu, reduction, deformation, source_of(ground));
    return MILD_OK;
}

static MildStatus print_table(const MildSole *sole, MildError *error) {
    const char *grounds[GROUNDS_MAX];
    const int count = grounds_all(grounds);
    MildStatus status = MILD_OK;
    printf("grounds (--ground NAME), stiffness and sinkage under half of the SA01's weight on one "
           "sole; energy returned\nand force reduction of EN 14808's artificial athlete, vertical "
           "deformation of EN 14809's\n\n");
    printf("  %-15s %-11s %7s %7s %8s %5s %9s %11s\n", "", "law", "MPa/m", "mm", "returned", "mu",
           "reduction", "deformation");
    printf("  %-15s %-11s %7s %7s %8s %5s %9s %11s  %s\n", "", "", "", "", "%", "", "%", "mm",
           "source");
    for (int i = 0; i < count && status == MILD_OK; i++) {
        status = print_measures(sole, grounds[i], error);
    }
    return status;
}

/* The numbers of the grounds of every model that has some. */
static void print_grounds(void) {
    for (int m = 0; m < MILD_MODELS; m++) {
        const char *grounds[GROUNDS_MAX];
        const int count = grounds_of((MildModel)m, grounds);
        for (int first = 0; first < count; first += BLOCK) {
            printf("\nof %s\n",
                   m == MILD_MODEL_MILD ? "mild and mild_merged" : mild_model_names[m]);
            print_preset_table((MildModel)m, grounds + first,
                               count - first < BLOCK ? count - first : BLOCK);
        }
    }
}

/* Prints a number by which the model is matched, for every preset of the paper. */
static void print_matched(const MildSole *sole, MildModel model, const char *key) {
    const MildField *field =
        mild_field_find(mild_material_fields, mild_material_field_count, key, NULL);
    printf("  %-13s %-10s", mild_model_names[model], key);
    for (int p = 0; p < BLOCK; p++) {
        MildMaterial mild, rival;
        mild_material_preset(mild_material_preset_name(p), &mild);
        if (mild_model_match(model, &mild, sole, paper_weight / 2, &rival, NULL) != MILD_OK) {
            continue;
        }
        printf(" %10.4g", *(const double *)(const void *)((const char *)&rival + field->offset));
    }
    printf("\n");
}

static void print_models(void) {
    printf("ground models (--model NAME) and their sources\n");
    for (int m = 0; m < MILD_MODELS; m++) {
        const MildModelInfo *info = mild_model_info((MildModel)m);
        printf("  %-13s  %s; %s\n", mild_model_names[m], info->summary, info->source);
    }
}

static void print_rivals(const MildSole *sole) {
    printf(
        "\nParameters of the other models on the paper's grounds. Each is matched to sink as deep "
        "under 20 kg on one foot.\nThe numbers are for one element, or for the whole sole with "
        "con_*. All other parameters are the preset's.\n");
    for (int m = 0; m < MILD_MODELS; m++) {
        const MildModelInfo *info = mild_model_info((MildModel)m);
        for (int k = 0; k < MILD_MODEL_SCALED && info->scaled[k]; k++) {
            print_matched(sole, (MildModel)m, info->scaled[k]);
        }
    }
    for (int m = 0; m < MILD_MODELS; m++) {
        const char *note = mild_model_info((MildModel)m)->match_note;
        if (note) {
            printf("  %-13s %s\n", mild_model_names[m], note);
        }
    }
}

static int info_grounds(void) {
    MildSole *sole = paper_sole();
    if (!sole) {
        return cli_fail_text("info", "out of memory");
    }
    MildError error = {0};
    const MildStatus status = print_table(sole, &error);
    if (status == MILD_OK) {
        printf("\nnumbers, SI units; any can be replaced on the command line, e.g. "
               "--ground.k_pen=500\n");
        print_grounds();
        printf("\n");
        print_models();
        print_rivals(sole);
    }
    mild_sole_destroy(sole);
    if (status != MILD_OK) {
        return cli_fail("info", &error);
    }
    printf("\nparameters\n");
    for (int f = 0; f < mild_material_field_count; f++) {
        const MildField *field = &mild_material_fields[f];
        char range[48] = "true or false";
        if (field->type == MILD_FIELD_NAME) {
            snprintf(range, sizeof range, "see models");
        }
        if (field->type == MILD_FIELD_DOUBLE) {
            snprintf(range, sizeof range, "%g .. %g", field->min, field->max);
        }
        printf("  %-12s  %-16s %s\n", field->name, range, field->help);
    }
    return 0;
}

static int info_models(void) {
    print_models();
    printf(
        "\nparameters of the ground that each model reads (`mild info grounds` explains them)\n");
    for (int m = 0; m < MILD_MODELS; m++) {
        const MildModelInfo *info = mild_model_info((MildModel)m);
        printf("  %-13s ", mild_model_names[m]);
        for (int k = 0; k < MILD_MODEL_FIELDS && info->fields[k]; k++) {
            printf(" %s", info->fields[k]);
        }
        printf("\n");
    }
    printf(
        "\ncontact solvers of the soft models (--task.solver)\n"
        "  newton        solves the step as one small convex problem (default)\n"
        "  gauss_seidel  sweeps over the elements as in the paper; same answer, for comparison\n"
        "  explicit      the paper's Algorithm 1 to the letter; creates energy, for comparison\n");
    return 0;
}

static int info_config(void) {
    ExperimentDef def = experiment_def_default();
    ConfigSection sections[EXPERIMENT_SECTIONS];
    experiment_sections(&def, sections);
    printf(
        "# Every key with its default. A config file needs only the keys that differ.\n"
        "# --section.key=value changes a key for one run. Lines show: [unit] meaning (range).\n");
    config_print(sections, EXPERIMENT_SECTIONS, 1, stdout);
    return 0;
}

static int info_build(void) {
    const dnnl_version_t *dnnl = dnnl_version();
    printf("mild      %s\n", build_version());
    printf("compiler  %s, %s\n", build_compiler(), build_type());
    printf("flags     %s\n", build_flags());
    printf("MuJoCo    %s (headers %d.%d.%d)\n", mj_versionString(), mjVERSION_HEADER / 1000000,
           mjVERSION_HEADER / 1000 % 1000, mjVERSION_HEADER % 1000);
    printf("oneDNN    %d.%d.%d\n", dnnl->major, dnnl->minor, dnnl->patch);
    printf("cJSON     %s\n", cJSON_Version());
    printf("inih      system library\n");
    return 0;
}

static const char *instruction_set(void) {
    switch (dnnl_get_effective_cpu_isa()) {
    case dnnl_cpu_isa_avx: return "AVX";
    case dnnl_cpu_isa_avx2: return "AVX2";
    case dnnl_cpu_isa_avx512_core: return "AVX-512";
    case dnnl_cpu_isa_avx512_core_vnni: return "AVX-512 with VNNI";
    case dnnl_cpu_isa_avx512_core_bf16: return "AVX-512 with BF16";
    default: return "instruction set chosen by oneDNN";
    }
}

static int info_devices(void) {
    char machine[256], memory[32], gpu[512];
    gpu_device(gpu, sizeof gpu);
    printf("processor  %s\n", build_machine(machine, sizeof machine));
    printf("memory     %s\n", text_bytes(build_memory_bytes(), memory, sizeof memory));
    printf("networks   oneDNN on the processor, %s\n", instruction_set());
    printf("GPU        %s\n", gpu);
    return 0;
}

static const struct {
    const char *name;
    int (*print)(void);
    const char *help;
} topics[] = {
    {"grounds", info_grounds, "ground presets; every parameter with its unit, range and source"},
    {"models", info_models, "ground models with their sources and parameters, contact solvers"},
    {"robots", robots_print, "joints, feet, mass, height and source of each robot"},
    {"config", info_config,
     "every config key with its meaning, range and default, as a complete config file"},
    {"build", info_build, "version, compiler and libraries"},
    {"devices", info_devices, "processor, memory and GPU of this machine"},
};
enum { TOPICS = sizeof topics / sizeof *topics };

int cmd_info(int argc, char **argv) {
    CliWord words[TOPICS];
    for (int i = 0; i < TOPICS; i++) {
        words[i] = (CliWord){topics[i].name, topics[i].help};
    }
    const CliCommand command = {
        .name = "info",
        .usage = "grounds | models | robots | config | build | devices",
        .summary = "Prints what the program offers and what it runs on.",
        .words_title = "topics",
        .words = words,
        .word_count = TOPICS,
        .examples = "  mild info grounds\n  mild info config > my.ini\n",
        .positional_max = 1,
    };
    CliArgs args;
    const int parsed = cli_parse(&command, argc, argv, &args);
    if (parsed != CLI_RUN) {
        return parsed;
    }
    if (!args.positional_count) {
        return cli_fail_text("info", "no topic given; use mild info %s", command.usage);
    }
    const char *names[TOPICS];
    for (int i = 0; i < TOPICS; i++) {
        if (strcmp(args.positional[0], topics[i].name) == 0) {
            return topics[i].print();
        }
        names[i] = topics[i].name;
    }
    return cli_fail_text("info", "unknown topic '%s'; nearest is '%s'", args.positional[0],
                         text_nearest(args.positional[0], names, TOPICS));
}
