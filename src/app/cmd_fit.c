/* mild fit: finds parameters of a ground from recorded presses; prints a table, writes JSON,
 * draws. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app/cli.h"
#include "app/commands.h"
#include "app/figure.h"
#include "app/grounds.h"
#include "app/report.h"
#include "base/file.h"
#include "base/text.h"
#include "lab/fit_csv.h"
#include "lab/press.h"

typedef struct {
    const char *ground, *json, *figure;
    CliNumbers plate;
    CliNames fit;
    double alpha, nu; /* NaN: as the ground's */
} FitOptions;

typedef struct {
    FitDef def;
    FitPoint *points;
    int count;
    int first[CLI_LIST_MAX + 1]; /* of each file, in points */
    FitResult result;
} FitWork;

/* grass.png is drawn from grass_fit.csv, because grass.csv may be the record. */
#define NUMBERS_END "_fit.csv"

static const char *const units[FIT_PARAMETERS] = {"N/m", "N/m^3", "rad", "-", "-", "-"};

static int options_read(int argc, char **argv, FitOptions *options, CliArgs *args) {
    char grounds[200], ground_help[400];
    snprintf(ground_help, sizeof ground_help,
             "preset that gives the parameters that are not fitted (default sand_loose); one of %s",
             grounds_names(grounds, sizeof grounds));
    const CliOption table[] = {
        {"plate", CLI_NUMBERS, &options->plate, 0.0195, 1, "L,W",
         "[m] length and width of the plate"},
        {"fit", CLI_NAMES, &options->fit, 0, 0, "NAME[,NAME]",
         "parameters to fit, of k_pen, sigma_cone, alpha, nu, c_g, c_d (default k_pen,sigma_cone)"},
        {"ground", CLI_TEXT, &options->ground, 0, 0, "NAME", ground_help},
        {"alpha", CLI_NUMBER, &options->alpha, 0.1, 1.5, "A",
         "[rad] shear band angle: its value, or the start of its fit"},
        {"nu", CLI_NUMBER, &options->nu, 0.1, 10, "N",
         "[-] recruitment rate: its value, or the start of its fit"},
        {"json", CLI_OUTPUT, &options->json, 0, 0, "FILE",
         "write values and intervals to FILE; - for standard output"},
        {"figure", CLI_OUTPUT, &options->figure, 0, 0, "FILE.png",
         "draw data and fit; the numbers go to FILE_fit.csv beside it"},
    };
    const CliCommand command = {
        .name = "fit",
        .usage = "DATA.csv [DATA2.csv ...] --plate L,W [options]",
        .summary = "Finds the parameters of a ground from presses of a level plate. It prints "
                   "each value with its 95 % interval and says which parameters the data cannot "
                   "determine. A CSV file has a header line with the columns depth_m and "
                   "force_n, and time_s or speed_m_s where speed matters. Several files may "
                   "differ in speed, which c_d needs; c_g also needs a record that brakes, such "
                   "as a drop. Rows that are not deeper than all before them (unloading) are "
                   "ignored. The intervals assume that the errors of the rows are independent.",
        .options = table,
        .option_count = sizeof table / sizeof *table,
        .overrides = "any parameter of the ground, e.g. --ground.bed_depth=0.05; `mild info "
                     "grounds` lists them",
        .examples = "  mild press --ground grass --depth 0.04 --csv grass.csv\n"
                    "  mild fit grass.csv --plate 0.2,0.1 --ground grass --figure grass.png\n"
                    "  mild fit slow.csv fast.csv --plate 0.2,0.1 --fit k_pen,sigma_cone,alpha,c_d "
                    "--json out.json\n",
        .positional_max = CLI_LIST_MAX,
        .positional_input = 1,
        .picture = "figure",
        .numbers = NUMBERS_END,
    };
    CliOutcome outcome = cli_parse(&command, argc, argv, args);
    if (outcome == CLI_BAD) {
        return CLI_EXIT_BAD_INPUT;
    }
    return outcome == CLI_DONE ? -1 : 0;
}

static MildStatus names_read(const CliNames *names, FitDef *def, MildError *error) {
    for (int i = 0; i < names->count; i++) {
        int found = 0;
        for (int p = 0; p < FIT_PARAMETERS; p++) {
            if (strcmp(names->name[i], fit_names[p]) == 0) {
                def->free[p] = found = 1;
            }
        }
        if (found) {
            continue;
        }
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--fit: unknown parameter '%s'; nearest is '%s' (k_pen, sigma_cone, "
                         "alpha, nu, c_g, c_d)",
                         names->name[i], text_nearest(names->name[i], fit_names, FIT_PARAMETERS));
    }
    return MILD_OK;
}

static MildStatus def_make(const FitOptions *options, const CliArgs *args, FitDef *def,
                           MildError *error) {
    MildStatus status = grounds_find(options->ground, &def->material, NULL, error);
    if (status != MILD_OK) {
        return status;
    }
    ConfigSection section = ground_section(&def->material);
    status = config_overrides(&section, 1, args->overrides, args->override_count, error);
    if (status == MILD_OK) {
        status = names_read(&options->fit, def, error);
    }
    if (status != MILD_OK) {
        return status;
    }
    if (isfinite(options->alpha)) {
        def->material.alpha = options->alpha;
    }
    if (isfinite(options->nu)) {
        def->material.nu = options->nu;
    }
    MildSole *plate = press_plate_create(options->plate.value[0], options->plate.value[1], error);
    if (!plate) {
        return error->status;
    }
    def->elements = mild_sole_elements(plate); /* as press lays it out */
    def->pitch = mild_sole_pitch(plate);
    mild_sole_destroy(plate);
    return MILD_OK;
}

/* ---- the printed result ---- */

static void say_held(const FitResult *result, FitName name) {
    const FitParameter *p = &result->parameter[name];
    char held[64];
    snprintf(held, sizeof held, "it is held at %.4g", p->value);
    switch (p->state) {
    case FIT_HELD:
    case FIT_FITTED: break;
    case FIT_NO_SPEEDS:
        printf(
            "%s: the data cannot determine it, because all rows have about the same speed; %s (add "
            "a press at another speed)\n",
            fit_names[name], held);
        break;
    case FIT_NO_MASS:
        printf("c_d: has no effect, because this ground has no added mass (c_g = 0); %s\n", held);
        break;
    case FIT_NO_EFFECT:
        printf("%s: has no effect on these forces; %s\n", fit_names[name], held);
        break;
    case FIT_TIED:
        printf(
            "%s and %s: the data cannot tell them apart (correlation %.3f); %s is held at %.4g\n",
            fit_names[name], fit_names[p->partner], p->correlation, fit_names[name], p->value);
        break;
    case FIT_WIDE: printf("%s: the data cannot determine it; %s\n", fit_names[name], held); break;
    }
}

static void table_print(const FitWork *work, int files) {
    const FitResult *result = &work->result;
    printf("%-12s %12s %12s %12s  %s\n", "parameter", "value", "low 95 %", "high 95 %", "unit");
    for (int i = 0; i < FIT_PARAMETERS; i++) {
        const FitParameter *p = &result->parameter[i];
        if (p->state == FIT_FITTED) {
            printf("%-12s %12.5g %12.5g %12.5g  %s\n", fit_names[i], p->value, p->low, p->high,
                   units[i]);
        } else {
            printf("%-12s %12.5g %12s %12s  %s\n", fit_names[i], p->value, "held", "", units[i]);
        }
    }
    printf("residual %.4g N, %.2f %% of the force (root mean square); %d loading rows of %d "
           "file%s, %d elements\n",
           result->residual, 100 * result->residual_share, result->points, files,
           files == 1 ? "" : "s", work->def.elements);
    for (int i = 0; i < FIT_PARAMETERS; i++) {
        say_held(result, (FitName)i);
    }
}

static MildStatus json_save(const FitResult *result, const char *path, MildError *error) {
    cJSON *root = cJSON_CreateObject(), *fitted = cJSON_AddObjectToObject(root, "parameters");
    cJSON *held = cJSON_AddObjectToObject(root, "held");
    int whole =
        root && fitted && held && cJSON_AddNumberToObject(root, "residual", result->residual);
    for (int i = 0; i < FIT_PARAMETERS && whole; i++) {
        const FitParameter *p = &result->parameter[i];
        if (p->state != FIT_FITTED) {
            whole = cJSON_AddNumberToObject(held, fit_names[i], p->value) != NULL;
            continue;
        }
        cJSON *item = cJSON_AddObjectToObject(fitted, fit_names[i]);
        whole = item && cJSON_AddNumberToObject(item, "value", p->value) &&
                cJSON_AddNumberToObject(item, "low", p->low) &&
                cJSON_AddNumberToObject(item, "high", p->high);
    }
    if (!whole) {
        cJSON_Delete(root);
        root = NULL;
    }
    return report_save(root, path, error);
}

/* ---- the picture ---- */

static MildStatus data_write(const FitWork *work, const CliArgs *args, const char *path,
                             MildError *error) {
    char *text = NULL;
    size_t size = 0;
    FILE *memory = open_memstream(&text, &size);
    if (!memory) {
        return mild_fail(error, MILD_ERROR_MEMORY, "fit: out of memory");
    }
    FitDef def = work->def;
    def.material = work->result.material;
    fprintf(memory, "record,depth_m,force_n,speed_m_s,fit_n\n");
    for (int f = 0; f < args->positional_count; f++) {
        for (int i = work->first[f]; i < work->first[f + 1]; i++) {
            const FitPoint *p = &work->points[i];
            fprintf(memory, "%d,%.9g,%.9g,%.9g,%.9g\n", f + 1, p->depth, p->force, p->speed,
                    fit_force(&def, p));
        }
    }
    MildStatus status = MILD_OK;
    if (fclose(memory) != 0) {
        status = mild_fail(error, MILD_ERROR_MEMORY, "fit: out of memory");
    } else {
        status = file_write(path, text, size, error);
    }
    free(text);
    return status;
}

static MildStatus figure_save(const FitWork *work, const CliArgs *args, const char *figure,
                              MildError *error) {
    char data[PATH_SIZE];
    MildStatus status = path_beside(figure, NUMBERS_END, data, error);
    if (status == MILD_OK) {
        status = data_write(work, args, data, error);
    }
    if (status == MILD_OK) {
        status = figure_draw("scripts/fit.py", data, figure, error);
    }
    return status;
}

/* ---- the command ---- */

static MildStatus fit_report(const FitOptions *options, const CliArgs *args, FitWork *work,
                             MildError *error) {
    MildStatus status = MILD_OK;
    for (int f = 0; f < args->positional_count && status == MILD_OK; f++) {
        status = fit_csv_read(args->positional[f], &work->points, &work->count, error);
        work->first[f + 1] = work->count;
    }
    if (status == MILD_OK) {
        status = fit_run(&work->def, work->points, work->count, &work->result, error);
    }
    if (status != MILD_OK) {
        return status;
    }
    if (!options->json || strcmp(options->json, "-") != 0) {
        table_print(work, args->positional_count);
    }
    if (options->json) {
        status = json_save(&work->result, options->json, error);
    }
    if (status == MILD_OK && options->figure) {
        status = figure_save(work, args, options->figure, error);
    }
    return status;
}

int cmd_fit(int argc, char **argv) {
    FitOptions options = {.ground = "sand_loose",
                          .fit = {.count = 2, .name = {"k_pen", "sigma_cone"}},
                          .alpha = NAN,
                          .nu = NAN};
    CliArgs args;
    int code = options_read(argc, argv, &options, &args);
    if (code) {
        return code < 0 ? 0 : code;
    }
    if (!args.positional_count) {
        return cli_fail_text(
            "fit", "no record given: mild fit DATA.csv --plate L,W (mild press --csv writes one)");
    }
    if (options.plate.count != 2) {
        return cli_fail_text("fit",
                             "--plate LENGTH,WIDTH is missing: the size of the plate in metres");
    }
    MildError error;
    FitWork work = {0};
    MildStatus status = def_make(&options, &args, &work.def, &error);
    if (status == MILD_OK) {
        status = fit_report(&options, &args, &work, &error);
    }
    free(work.points);
    return status == MILD_OK ? 0 : cli_fail("fit", &error);
}
