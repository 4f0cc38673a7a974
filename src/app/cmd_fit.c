/* mild fit: finds parameters of a ground from recorded presses, or from the log of a walk; prints a
 * table, writes JSON, draws. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app/cli.h"
#include "app/commands.h"
#include "app/figure.h"
#include "app/fit_walk.h"
#include "app/grounds.h"
#include "app/report.h"
#include "base/file.h"
#include "base/text.h"
#include "identify/belief/log.h"
#include "identify/fit.h"
#include "identify/fit_csv.h"
#include "identify/press.h"

typedef struct {
    const char *model, *from, *json, *figure;
    CliNumbersEach plate;
    CliNames fit, hold; /* hold: NAME=VALUE */
    int trial;
} FitOptions;

typedef struct {
    FitDef def;
    MildMaterial preset; /* of --hold-from */
    const char *from;    /* its name; NULL: none */
    int bed;             /* bool: bed_depth is held */
    FitPoint *points;
    int count;
    int first[CLI_LIST_MAX + 1]; /* of each file, in points */
    FitResult result;
} FitWork;

/* grass.png is drawn from grass_fit.csv, because grass.csv may be the record. */
#define NUMBERS_END "_fit.csv"

static int options_read(int argc, char **argv, FitOptions *options, CliArgs *args) {
    char models[200] = "";
    for (int m = 0; m < MILD_MODEL_RIGID; m++) {
        strcat(strcat(models, " "), mild_model_names[m]);
    }
    char model_help[300];
    snprintf(model_help, sizeof model_help, "ground model (default mild): one of%s", models);
    const CliOption table[] = {
        {"plate", CLI_NUMBERS_EACH, &options->plate, 0.0195, 1, "L,W",
         "[m] length and width of the plate; once for all files, or once for each, in their order"},
        {"model", CLI_TEXT, &options->model, 0, 0, "NAME", model_help},
        {"hold", CLI_NAMES, &options->hold, 0, 0, "NAME=VALUE[,...]",
         "hold parameters at values that are known, e.g. alpha=1.05; also bed_depth, the depth of "
         "a firm bed (default: none within the record)"},
        {"hold-from", CLI_TEXT, &options->from, 0, 0, "PRESET",
         "where the data do not tell a parameter, hold it at this preset's value (`mild info "
         "grounds`)"},
        {"fit", CLI_NAMES, &options->fit, 0, 0, "NAME[,NAME]",
         "fit these only and hold all others at the preset of --hold-from"},
        {"trial", CLI_INT, &options->trial, 0, 1e6, "N",
         "of a log of several walks, as mild eval --actions writes it: which (default 0)"},
        {"json", CLI_OUTPUT, &options->json, 0, 0, "FILE",
         "write values and intervals to FILE; - for standard output"},
        {"figure", CLI_OUTPUT, &options->figure, 0, 0, "FILE.png",
         "draw data and fit; the numbers go to FILE_fit.csv beside it"},
    };
    const CliCommand command = {
        .name = "fit",
        .usage = "DATA.csv [DATA2.csv ...] --plate L,W [options] | WALK.csv [options]",
        .summary =
            "Finds the parameters of a ground from presses of a level plate: all those that "
            "the data determine, each with its 95 % interval by profile likelihood. Nothing "
            "is held unless --hold or --hold-from says so. A parameter that the data do not "
            "determine gets no value; where they tell a combination, such as "
            "sigma_cone/cos(alpha), that is printed. A CSV file has a header line with the "
            "columns depth_m and force_n, and time_s or speed_m_s where speed matters. "
            "Several files may differ in speed, which c_d and dissipation need; c_g also "
            "needs a record that brakes, such as a drop. They may differ in their plate, "
            "which k_c of bekker needs (--plate once for each file). Rows that are not deeper than "
            "all before them (unloading) are ignored. Of a walk's log (mild drive --log, mild play "
            "--log) it says what the robot's own sensors tell of the ground, each parameter with "
            "its 90 % interval (docs/identify.md).",
        .options = table,
        .option_count = sizeof table / sizeof *table,
        .examples = "  mild press --ground grass --depth 0.04 --csv grass.csv\n"
                    "  mild fit grass.csv --plate 0.2,0.1 --figure grass.png\n"
                    "  mild fit grass.csv --plate 0.2,0.1 --hold alpha=1.1\n"
                    "  mild fit slow.csv fast.csv --plate 0.2,0.1 --hold-from sand_loose\n"
                    "  mild fit small.csv large.csv --plate 0.15,0.1 --plate 0.3,0.2\n"
                    "  mild fit slow.csv --plate 0.2,0.1 --model bekker --json out.json\n"
                    "  mild fit walk.csv\n",
        .positional_max = CLI_LIST_MAX,
        .picture = "figure",
        .numbers = NUMBERS_END,
    };
    CliOutcome outcome = cli_parse(&command, argc, argv, args);
    if (outcome == CLI_BAD) {
        return CLI_EXIT_BAD_INPUT;
    }
    return outcome == CLI_DONE ? -1 : 0;
}

/* ---- what is fitted and what is held ---- */

/* Index of a parameter of the model; -1 and a message for any other name. */
static int parameter_find(const FitDef *def, const char *option, const char *name,
                          MildError *error) {
    const MildField *fields[FIT_PARAMETERS_MAX];
    const char *names[FIT_PARAMETERS_MAX];
    char list[300] = "";
    const MildModel model = (MildModel)def->material.model;
    const int count = fit_parameters(model, fields);
    for (int i = 0; i < count; i++) {
        names[i] = fields[i]->name;
        if (strcmp(names[i], name) == 0) {
            return i;
        }
        snprintf(list + strlen(list), sizeof list - strlen(list), i ? ", %s" : "%s", names[i]);
    }
    mild_fail(error, MILD_ERROR_ARGUMENT,
              "--%s: '%.40s' is no parameter that a press on %s tells; nearest is '%s' (%s)",
              option, name, mild_model_names[model], text_nearest(name, names, count), list);
    return -1;
}

static MildStatus hold_one(const char *text, FitWork *work, MildError *error) {
    char name[64];
    FitDef *def = &work->def;
    const char *equals = strchr(text, '=');
    double value, low, high;
    if (!equals || !text_double(equals + 1, &value)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--hold: '%s' is not NAME=VALUE, such as alpha=1.05", text);
    }
    snprintf(name, sizeof name, "%.*s", (int)(equals - text), text);
    if (strcmp(name, "plate_width") == 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--hold plate_width: it is the shorter side of --plate; leave it out");
    }
    const int geometry = fit_is_geometry((MildModel)def->material.model, name);
    const int index = geometry ? -1 : parameter_find(def, "hold", name, error);
    if (!geometry && index < 0) {
        return error->status;
    }
    const MildField *field =
        mild_field_find(mild_material_fields, mild_material_field_count, name, NULL);
    fit_range(field, &low, &high);
    if (!(value >= low && value <= high)) {
        return mild_fail(error, MILD_ERROR_RANGE, "--hold: %s = %g is outside %g .. %g: %s", name,
                         value, low, high, field->help);
    }
    *fit_number(&def->material, field) = value;
    work->bed |= strcmp(name, "bed_depth") == 0;
    if (index >= 0) {
        def->held[index] = 1;
    }
    return MILD_OK;
}

static MildStatus from_read(const FitOptions *options, FitWork *work, MildError *error) {
    FitDef *def = &work->def;
    const int model = def->material.model;
    MildStatus status = grounds_find(options->from, &work->preset, NULL, error);
    if (status != MILD_OK) {
        return status;
    }
    if (work->preset.model != model) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--hold-from %s: a ground of %s has no numbers for %s; use --hold "
                         "NAME=VALUE",
                         options->from, mild_model_names[work->preset.model],
                         mild_model_names[model]);
    }
    def->material = work->preset;
    def->fill = options->fit.count ? NULL : &work->preset;
    work->from = options->from;
    work->bed = 1;
    return MILD_OK;
}

/* --fit: everything else is held. */
static MildStatus fit_names_read(const CliNames *names, FitDef *def, MildError *error) {
    for (int i = 0; i < FIT_PARAMETERS_MAX; i++) {
        def->held[i] = 1;
    }
    for (int i = 0; i < names->count; i++) {
        const int index = parameter_find(def, "fit", names->name[i], error);
        if (index < 0) {
            return error->status;
        }
        def->held[index] = 0;
    }
    return MILD_OK;
}

/* A name is held once, and is not fitted. */
static MildStatus names_check(const FitOptions *options, MildError *error) {
    for (int i = 0; i < options->hold.count; i++) {
        const char *name = options->hold.name[i];
        const size_t length = strcspn(name, "=");
        for (int k = 0; k < options->fit.count; k++) {
            if (strncmp(name, options->fit.name[k], length) == 0 && !options->fit.name[k][length]) {
                return mild_fail(error, MILD_ERROR_ARGUMENT,
                                 "--hold %s and --fit %s contradict each other; leave out one",
                                 name, options->fit.name[k]);
            }
        }
        for (int k = 0; k < i; k++) {
            if (strncmp(name, options->hold.name[k], length + 1) == 0) {
                return mild_fail(error, MILD_ERROR_ARGUMENT,
                                 "--hold: %s and %s name the same parameter; leave out one",
                                 options->hold.name[k], name);
            }
        }
    }
    return MILD_OK;
}

static MildStatus held_read(const FitOptions *options, FitWork *work, MildError *error) {
    const MildField *fields[FIT_PARAMETERS_MAX];
    FitDef *def = &work->def;
    MildStatus status = names_check(options, error);
    if (status != MILD_OK) {
        return status;
    }
    if (options->fit.count && !options->from) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--fit needs --hold-from PRESET, which gives the values of all others; "
                         "without both, all that the data determine is fitted");
    }
    if (options->from) {
        status = from_read(options, work, error);
    }
    if (status == MILD_OK && options->fit.count) {
        status = fit_names_read(&options->fit, def, error);
    }
    for (int i = 0; i < options->hold.count && status == MILD_OK; i++) {
        status = hold_one(options->hold.name[i], work, error);
    }
    const int count = fit_parameters((MildModel)def->material.model, fields);
    int held = 0;
    for (int i = 0; i < count; i++) {
        held += def->held[i];
    }
    if (status == MILD_OK && held == count) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--hold: every parameter of %s is held, which leaves nothing to fit",
                         mild_model_names[def->material.model]);
    }
    return status;
}

/* A plate in the elements of the model, as press lays it out. */
static MildStatus plate_lay(const CliNumbers *size, int concentric, FitPlate *laid,
                            MildError *error) {
    MildSole *plate = press_plate_create(size->value[0], size->value[1], error);
    MildSole *sole = plate;
    if (plate && concentric) {
        sole = mild_sole_concentric(plate, error);
        mild_sole_destroy(plate);
    }
    if (!sole) {
        return error->status;
    }
    *laid =
        (FitPlate){mild_sole_elements(sole), mild_sole_pitch(sole), mild_sole_width(sole), sole};
    return MILD_OK;
}

static MildStatus plates_lay(const FitOptions *options, FitDef *def, MildError *error) {
    const int concentric = mild_model_is_concentric((MildModel)def->material.model);
    MildStatus status = MILD_OK;
    def->plates = options->plate.count;
    for (int i = 0; i < def->plates && status == MILD_OK; i++) {
        status = plate_lay(&options->plate.each[i], concentric, &def->plate[i], error);
    }
    return status;
}

static MildStatus def_make(const FitOptions *options, const CliArgs *args, FitWork *work,
                           MildError *error) {
    FitDef *def = &work->def;
    MildModel model;
    MildStatus status = grounds_model(options->model, args, &model, error);
    if (status != MILD_OK) {
        return status;
    }
    if (model == MILD_MODEL_RIGID) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--model rigid: the engine's own contact has no parameters that a press "
                         "could tell; choose another model");
    }
    const MildField *bed =
        mild_field_find(mild_material_fields, mild_material_field_count, "bed_depth", NULL);
    def->material = mild_material_default();
    def->material.model = (int)model;
    def->material.bed_depth = bed->max;
    status = plates_lay(options, def, error);
    return status == MILD_OK ? held_read(options, work, error) : status;
}

/* ---- the printed result ---- */

static void value_print(const FitValue *value) {
    char number[TEXT_CELL], low[TEXT_CELL], high[TEXT_CELL];
    const int held = value->state == FIT_HELD || value->state == FIT_FILLED;
    printf("%-24s %12s %12s %12s  %s\n", value->name, text_cell("%.5g", value->value, number),
           held ? "held" : text_cell("%.5g", value->low, low),
           held ? "" : text_cell("%.5g", value->high, high), value->unit);
}

/* Prints "name, name" of the parameters in a set of states, after `title`; nothing for none. With
 * `values` "name = value". Returns their number. */
static int names_print(const FitResult *result, unsigned states, int values, const char *title) {
    int count = 0;
    for (int i = 0; i < result->parameters; i++) {
        const FitValue *value = &result->parameter[i];
        if (states >> value->state & 1) {
            printf("%s%s", count++ ? ", " : title, value->name);
            if (values) {
                printf(" = %.5g", value->value);
            }
        }
    }
    return count;
}

/* Bool: some ground has numbers for --hold-from. */
static int has_presets(MildModel model) {
    return model == MILD_MODEL_MILD || mild_model_info(model)->presets[0];
}

static unsigned bit(FitState state) {
    return 1U << state;
}

/* What the intervals rest on. */
static void assumptions_print(const FitWork *work) {
    const FitResult *result = &work->result;
    double deepest = 0, fastest = 0;
    for (int i = 0; i < work->count; i++) {
        deepest = fmax(deepest, work->points[i].depth);
        fastest = fmax(fastest, work->points[i].speed);
    }
    if (names_print(result, bit(FIT_HELD), 1, "the intervals assume ")) {
        printf("\n");
    }
    if (names_print(result, bit(FIT_FILLED), 1, "the intervals assume ")) {
        printf(" of %s, because the data do not tell\n", work->from);
    }
    if (!work->bed) {
        printf("the intervals assume no firm bed down to %.4g m (--hold bed_depth=D if there is)\n",
               deepest);
    } else if (deepest > work->def.material.bed_depth) {
        printf("the intervals assume bed_depth = %.5g\n", work->def.material.bed_depth);
    }
    if (fastest == 0) {
        printf("the intervals assume a slow press, because the records have neither time_s nor "
               "speed_m_s\n");
    }
    if (result->neighbours > 0) {
        printf("the residuals of neighbouring rows are alike (correlation %.2f): the law misses "
               "the curve, or the noise is slow; the %d rows count as %.0f\n",
               result->neighbours, result->points, result->rows);
    }
}

/* Bool: all rows have about the same speed. */
static int is_one_speed(const FitWork *work) {
    double slowest = INFINITY, fastest = 0;
    for (int i = 0; i < work->count; i++) {
        slowest = fmin(slowest, work->points[i].speed);
        fastest = fmax(fastest, work->points[i].speed);
    }
    return fastest <= 1.3 * slowest;
}

/* Parameters of the model that no press straight down tells, such as friction. */
static void never_print(const FitWork *work) {
    const MildModel model = (MildModel)work->def.material.model;
    const MildModelInfo *info = mild_model_info(model);
    int count = 0;
    for (int i = 0; i < MILD_MODEL_FIELDS && info->fields[i]; i++) {
        int told =
            fit_is_geometry(model, info->fields[i]) || strcmp(info->fields[i], "passive") == 0;
        for (int k = 0; k < work->result.parameters; k++) {
            told |= strcmp(info->fields[i], work->result.parameter[k].name) == 0;
        }
        if (!told) {
            printf("%s%s", count++ ? ", " : "no press straight down tells ", info->fields[i]);
        }
    }
    printf("%s", count ? "\n" : "");
}

/* What the data do not tell, and the remedy. */
static void untold_print(const FitWork *work) {
    const FitResult *result = &work->result;
    const MildModel model = (MildModel)work->def.material.model;
    const unsigned untold = bit(FIT_LIMIT) | bit(FIT_OPEN) | bit(FIT_TIED) | bit(FIT_NO_EFFECT);
    if (names_print(result, untold, 0, "not determined by these data: ")) {
        printf("; hold what you know (--hold NAME=VALUE)%s\n",
               work->from || !has_presets(model) ? ""
                                                 : ", or what is missing (--hold-from PRESET)");
    }
    int rate = 0;
    for (int i = 0; i < result->parameters && is_one_speed(work); i++) {
        const FitValue *value = &result->parameter[i];
        if (untold >> value->state & 1 && fit_is_rate(model, value->field)) {
            printf("%s%s", rate++ ? ", " : "a press at another speed or a drop tells more of ",
                   value->name);
        }
    }
    printf("%s", rate ? "\n" : "");
    never_print(work);
}

/* "55", or "44, 77" of several plates. */
static const char *elements_text(const FitDef *def, char text[8 * FIT_PLATES_MAX]) {
    int length = 0;
    for (int i = 0; i < def->plates; i++) {
        length += sprintf(text + length, i ? ", %d" : "%d", def->plate[i].elements);
    }
    return text;
}

static void table_print(const FitWork *work, int files) {
    const FitResult *result = &work->result;
    char elements[8 * FIT_PLATES_MAX];
    printf("%-24s %12s %12s %12s  %s\n", "parameter", "value", "low 95 %", "high 95 %", "unit");
    for (int i = 0; i < result->parameters; i++) {
        value_print(&result->parameter[i]);
    }
    for (int i = 0; i < result->combinations; i++) {
        value_print(&result->combination[i]);
    }
    printf("residual %.4g N, %.2f %% of the force (root mean square); %d loading rows of %d "
           "file%s, %s element%s\n",
           result->residual, 100 * result->residual_share, result->points, files,
           files == 1 ? "" : "s", elements_text(&work->def, elements),
           work->def.plates == 1 && work->def.plate[0].elements == 1 ? "" : "s");
    assumptions_print(work);
    untold_print(work);
}

/* Adds a value to the list that its state belongs to. */
static int json_value(cJSON *root, const char *list, const FitValue *value) {
    const char *names[] = {"value", "low", "high"};
    const double numbers[] = {value->value, value->low, value->high};
    cJSON *item;
    switch (value->state) {
    case FIT_HELD:
    case FIT_FILLED:
        return cJSON_AddNumberToObject(cJSON_GetObjectItem(root, "held"), value->name,
                                       value->value) != NULL;
    case FIT_FITTED:
    case FIT_LIMIT:
        item = cJSON_AddObjectToObject(
            cJSON_GetObjectItem(root, value->state == FIT_FITTED ? list : "limits"), value->name);
        for (int i = 0; i < 3; i++) {
            if (isfinite(numbers[i]) && !cJSON_AddNumberToObject(item, names[i], numbers[i])) {
                return 0;
            }
        }
        return item != NULL;
    default:
        item = cJSON_CreateString(value->name);
        return cJSON_AddItemToArray(cJSON_GetObjectItem(root, "undetermined"), item);
    }
}

static MildStatus json_save(const FitWork *work, const char *path, MildError *error) {
    const FitResult *result = &work->result;
    cJSON *root = cJSON_CreateObject();
    int whole =
        root &&
        cJSON_AddStringToObject(root, "model", mild_model_names[work->def.material.model]) &&
        cJSON_AddObjectToObject(root, "parameters") &&
        cJSON_AddObjectToObject(root, "combinations") && cJSON_AddObjectToObject(root, "held") &&
        cJSON_AddObjectToObject(root, "limits") && cJSON_AddArrayToObject(root, "undetermined") &&
        cJSON_AddNumberToObject(root, "residual", result->residual) &&
        cJSON_AddNumberToObject(root, "independent_rows", result->rows);
    for (int i = 0; i < result->parameters && whole; i++) {
        whole = json_value(root, "parameters", &result->parameter[i]);
    }
    for (int i = 0; i < result->combinations && whole; i++) {
        whole = json_value(root, "combinations", &result->combination[i]);
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
    const FitResult *result = &work->result;
    fprintf(memory, "record,depth_m,force_n,speed_m_s,fit_n\n");
    for (int f = 0; f < args->positional_count; f++) {
        for (int i = work->first[f]; i < work->first[f + 1]; i++) {
            const FitPoint *p = &work->points[i];
            double force;
            fit_forces(work->def.plate, &result->curve, p, 1, &force);
            fprintf(memory, "%d,%.9g,%.9g,%.9g,%.9g\n", f + 1, p->depth, p->force, p->speed, force);
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
        status = figure_draw("scripts/fit.py", data, figure, NULL, error);
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
        for (int i = work->first[f]; i < work->count && work->def.plates > 1; i++) {
            work->points[i].plate = f;
        }
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
        status = json_save(work, options->json, error);
    }
    if (status == MILD_OK && options->figure) {
        status = figure_save(work, args, options->figure, error);
    }
    return status;
}

/* One plate for all files, or one for each. */
static int plates_check(const CliNumbersEach *plates, int files) {
    for (int i = 0; i < plates->count; i++) {
        if (plates->each[i].count != 2) {
            return cli_fail_text("fit", "--plate: %d number%s; it takes LENGTH,WIDTH in metres",
                                 plates->each[i].count, plates->each[i].count == 1 ? "" : "s");
        }
    }
    if (!plates->count) {
        return cli_fail_text("fit",
                             "--plate LENGTH,WIDTH is missing: the size of the plate in metres");
    }
    if (plates->count != 1 && plates->count != files) {
        return cli_fail_text("fit",
                             "--plate: %d plates for %d file%s; give one for all files, or one for "
                             "each in their order",
                             plates->count, files, files == 1 ? "" : "s");
    }
    return 0;
}

/* A walk's log alone, without options of a press. Returns the exit code. */
static int walk_fit(const FitOptions *options, const CliArgs *args) {
    MildError error = {0};
    if (args->positional_count > 1) {
        return cli_fail_text("fit", "%s is a walk's log; give it alone", args->positional[0]);
    }
    if (options->plate.count || options->fit.count || options->hold.count || options->from ||
        options->model || options->figure) {
        return cli_fail_text("fit",
                             "%s is a walk's log, which takes --trial and --json alone; leave the "
                             "options of a press out",
                             args->positional[0]);
    }
    return fit_walk(args->positional[0], options->trial, options->json, &error) == MILD_OK
               ? 0
               : cli_fail("fit", &error);
}

int cmd_fit(int argc, char **argv) {
    FitOptions options = {0};
    CliArgs args;
    int code = options_read(argc, argv, &options, &args);
    if (code) {
        return code < 0 ? 0 : code;
    }
    if (!args.positional_count) {
        return cli_fail_text(
            "fit", "no record given: mild fit DATA.csv --plate L,W (mild press --csv writes one)");
    }
    if (belief_log_is(args.positional[0])) {
        return walk_fit(&options, &args);
    }
    code = plates_check(&options.plate, args.positional_count);
    if (code) {
        return code;
    }
    MildError error;
    FitWork work = {0};
    MildStatus status = def_make(&options, &args, &work, &error);
    if (status == MILD_OK) {
        status = fit_report(&options, &args, &work, &error);
    }
    free(work.points);
    for (int i = 0; i < work.def.plates; i++) {
        mild_sole_destroy((MildSole *)(uintptr_t)work.def.plate[i].sole);
    }
    return status == MILD_OK ? 0 : cli_fail("fit", &error);
}
