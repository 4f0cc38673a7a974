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
#include "learn/cuda/learner.h"
#include "run/config/experiment_keys.h"

/* Sources of the presets' numbers; docs/ has the details. */
static const struct {
    const char *ground, *what, *source;
} sources[] = {
    {"rubber", "sports-hall rubber mat", "stiff end of the paper's ranges; elastic"},
    {"foam60", "foam of 60 kg/m^3",
     "k_pen from a Gibson-Ashby foam on a 50 mm slab; weighs grams: no added mass"},
    {"foam45", "foam of 45 kg/m^3", "as foam60"},
    {"foam28", "foam of 28 kg/m^3", "as foam60"},
    {"foam25", "foam of 25 kg/m^3", "as foam60"},
    {"grass", "lawn", "inside the paper's ranges; half of the depth springs back"},
    {"sand_loose", "loose dry sand",
     "inside the paper's ranges; inertia (c_g, c_d, phi) after Choi et al. 2023"},
    {"sand_dense", "packed dry sand", "as sand_loose, denser"},
    {"dry_sand", "dry sand", "Wong 2008, table 2.3, Land Locomotion Laboratory"},
    {"sandy_loam", "sandy loam, 15 % moisture", "as dry_sand"},
    {"clay", "clayey soil, 38 % moisture", "Wong 2008, table 2.3, Thailand"},
    {"snow", "snow (U.S.)", "Wong 2008, table 2.3"},
    {"lunar_soil", "lunar soil", "Carrier, Olhoeft, Mendell 1991, section 9.1"},
};
enum { SOURCES = sizeof sources / sizeof *sources };

static void print_cells(const char *title, const char *const *cells, int count) {
    printf("  %-12s", title);
    for (int i = 0; i < count; i++) {
        printf(" %10s", cells[i]);
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

static void print_sinkage(const MildSole *sole, const char *const *grounds, int count) {
    printf("\nsinkage of 40 kg at rest [mm]\n");
    for (int feet = 2; feet >= 1; feet--) {
        char value[GROUNDS_MAX][64];
        const char *cells[GROUNDS_MAX];
        for (int p = 0; p < count; p++) {
            MildMaterial material;
            mild_material_preset(grounds[p], &material);
            snprintf(value[p], sizeof value[p], "%.1f",
                     1e3 * mild_sole_sinkage(sole, &material, paper_weight / feet));
            cells[p] = value[p];
        }
        print_cells(feet == 2 ? "two feet" : "one foot", cells, count);
    }
}

/* The grounds of every model that has some. */
static void print_grounds(const MildSole *sole) {
    for (int m = 0; m < MILD_MODELS; m++) {
        const char *grounds[GROUNDS_MAX];
        const int count = grounds_of((MildModel)m, grounds);
        if (count > 0) {
            printf("%sgrounds of %s (--ground NAME)\n\n", m ? "\n" : "", mild_model_names[m]);
            print_preset_table((MildModel)m, grounds, count);
            print_sinkage(sole, grounds, count);
        }
    }
}

/* Prints a number by which the model is matched, for every preset. */
static void print_matched(const MildSole *sole, MildModel model, const char *key) {
    const MildField *field =
        mild_field_find(mild_material_fields, mild_material_field_count, key, NULL);
    printf("  %-13s %-10s", mild_model_names[model], key);
    for (int p = 0; p < mild_material_preset_count(); p++) {
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
        "\nParameters of the other models. Each is matched to sink as deep as mild under 20 kg on "
        "one foot. The numbers\n"
        "are for one element, or for the whole sole with con_*. All other parameters are the "
        "preset's.\n");
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
    printf("presets, SI units; any value can be replaced on the command line, e.g. "
           "--ground.k_pen=500\n\n");
    print_grounds(sole);
    printf("\n");
    print_models();
    print_rivals(sole);
    mild_sole_destroy(sole);
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
    printf("\nsources\n");
    for (int i = 0; i < SOURCES; i++) {
        printf("  %-10s  %s; %s\n", sources[i].ground, sources[i].what, sources[i].source);
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
    {"man", manual_print, "the man page, of all commands, in roff: mild info man | man -l -"},
    {"completion", completion_print, "completion for bash and zsh: source <(mild info completion)"},
};
enum { TOPICS = sizeof topics / sizeof *topics };

int cmd_info(int argc, char **argv) {
    CliWord words[TOPICS];
    for (int i = 0; i < TOPICS; i++) {
        words[i] = (CliWord){topics[i].name, topics[i].help};
    }
    const CliCommand command = {
        .name = "info",
        .usage = "grounds | models | robots | config | build | devices | man | completion",
        .summary = "Prints what the program offers and what it runs on.",
        .words_title = "topics",
        .words = words,
        .word_count = TOPICS,
        .examples = "  mild info grounds\n  mild info config > my.ini\n",
        .positional_max = 1,
    };
    CliArgs args;
    CliOutcome outcome = cli_parse(&command, argc, argv, &args);
    if (outcome != CLI_RUN) {
        return outcome == CLI_DONE ? 0 : CLI_EXIT_BAD_INPUT;
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
