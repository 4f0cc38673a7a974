/* mild fit: finds parameters of a ground from recorded presses, or from the log of a walk; prints a
 * table, writes JSON, draws. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app/cli.h"
#include "app/commands.h"
#include "app/fit_work.h"
#include "app/grounds.h"
#include "app/report.h"
#include "base/paths.h"
#include "base/text.h"
#include "ground/law/models.h"
#include "ground/soil/soil.h"
#include "identify/belief/file.h"
#include "identify/fit_law.h"
#include "identify/press.h"

typedef struct {
    const char *model, *from, *json, *figure, *soil;
    CliNumbersEach plate, ring;
    CliNames fit, hold; /* hold: NAME=VALUE */
    int trial;
} FitOptions;

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
         "[m] length and width of the plate, or D, the diameter of a round one; once for all "
         "presses, or once for each, in their order"},
        {"ring", CLI_NUMBERS_EACH, &options->ring, 0, 2, "D,d",
         "[m] outer and inner diameter of a ring that turns; once for all, or once for each"},
        {"model", CLI_TEXT, &options->model, 0, 0, "NAME", model_help},
        {"hold", CLI_NAMES, &options->hold, 0, 0, "NAME=VALUE[,...]",
         "hold parameters at values that are known, e.g. alpha=1.05; also bed_depth, the depth of "
         "a firm bed (default: none within the record)"},
        {"hold-from", CLI_TEXT, &options->from, 0, 0, "PRESET",
         "where the data do not determine a parameter, hold it at this preset's value (`mild info "
         "grounds`)"},
        {"fit", CLI_NAMES, &options->fit, 0, 0, "NAME[,NAME]",
         "fit these only and hold all others at the preset of --hold-from"},
        {"trial", CLI_INT, &options->trial, 0, 1e6, "N",
         "of a log of several walks, as mild eval --actions writes it: which (default 0)"},
        {"soil", CLI_OUTPUT, &options->soil, 0, 0, "FILE.ini",
         "write the ground to FILE.ini, which --ground FILE.ini, the plugin and Python read; all "
         "that the model reads must be fitted, held, or the preset's of --hold-from"},
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
            "determine gets no value; where they determine a combination, such as "
            "sigma_cone/cos(alpha), that is printed. A CSV file has a header line with the "
            "columns depth_m and force_n, and time_s or speed_m_s where speed matters. "
            "Several files may differ in speed, which c_d and dissipation need; c_g also "
            "needs a record that brakes, such as a drop. They may differ in their plate, "
            "which k_c of bekker needs (--plate once for each file). The way up from the greatest "
            "depth determines recovery. Where the plate then slides, slip_m and force_x_n (x_m and "
            "force_x_n of mild press --drag) determine slip_length, grip and mu of mild and "
            "mild_merged, and where it sinks under its load meanwhile, regain_length. A file with "
            "the columns slip_m, shear_pa and pressure_pa, or of a ring angle_rad, torque_nm and "
            "force_n (--ring), determines cohesion, mu and shear_length of bekker. --soil writes "
            "what was found as a ground (docs/soil.md). Of a walk's log (mild drive --log, mild "
            "play --log) it estimates the ground from the robot's own sensors, each parameter with "
            "its 90 % interval (docs/identify.md).",
        .options = table,
        .option_count = sizeof table / sizeof *table,
        .examples =
            "  mild press --ground grass --depth 0.04 --csv grass.csv\n"
            "  mild fit grass.csv --plate 0.2,0.1 --figure grass.png\n"
            "  mild fit grass.csv --plate 0.2,0.1 --hold alpha=1.1\n"
            "  mild fit slow.csv fast.csv --plate 0.2,0.1 --hold-from sand_loose\n"
            "  mild fit small.csv large.csv --plate 0.15,0.1 --plate 0.3,0.2\n"
            "  mild fit slow.csv --plate 0.2,0.1 --model bekker --json out.json\n"
            "  mild fit p5.csv p10.csv ring.csv --model bekker --plate 0.05 --plate 0.1 \\\n"
            "      --ring 0.2,0.12 --hold-from dry_sand --soil mars.ini\n"
            "  mild fit disc.csv square.csv drag.csv --model mild_merged --plate 0.12 \\\n"
            "      --plate 0.1,0.1 --plate 0.1,0.1 --hold alpha=0.3,phi=0.59,rho=2500\n"
            "  mild fit walk.csv\n",
        .positional_max = CLI_LIST_MAX,
        .picture = "figure",
        .numbers = NUMBERS_END,
    };
    return cli_parse(&command, argc, argv, args);
}

/* ---- what is fitted and what is held ---- */

/* Parameters of the model that some kind of rows determines, of slides where there are some:
 * fields[FIT_FIELDS_MAX]. */
static int parameters_of(const FitWork *work, const MildField **fields) {
    const MildModel model = (MildModel)work->material.model;
    int slides = 0, count = 0;
    for (int f = 0; f < work->files; f++) {
        slides += work->file[f].slide_count > 0;
    }
    for (int k = 0; k < FIT_KINDS; k++) {
        count += k == FIT_DRAG && !slides ? 0 : fit_parameters(model, (FitKind)k, fields + count);
    }
    return count;
}

/* A parameter of the model, or with `any` any number that it reads; NULL and a message for any
 * other name. */
static const MildField *parameter_find(const FitWork *work, int any, const char *option,
                                       const char *name, MildError *error) {
    const MildField *fields[FIT_FIELDS_MAX];
    const char *names[FIT_FIELDS_MAX];
    char list[300] = "";
    const MildModel model = (MildModel)work->material.model;
    const int count = parameters_of(work, fields);
    for (int i = 0; i < count; i++) {
        names[i] = fields[i]->name;
        if (strcmp(names[i], name) == 0) {
            return fields[i];
        }
        snprintf(list + strlen(list), sizeof list - strlen(list), i ? ", %s" : "%s", names[i]);
    }
    const MildField *field =
        mild_field_find(mild_material_fields, mild_material_field_count, name, NULL);
    if (any && field && field->type == MILD_FIELD_DOUBLE && soil_reads(&work->material, field)) {
        return field;
    }
    mild_fail(error, MILD_ERROR_ARGUMENT,
              "--%s: '%.40s' is no parameter that a press on %s determines; nearest is '%s' (%s%s)",
              option, name, mild_model_names[model], text_nearest(name, names, count), list,
              field && soil_reads(&work->material, field) ? "; with --soil any that it reads" : "");
    return NULL;
}

static MildStatus hold_one(const char *text, int any, FitWork *work, MildError *error) {
    char name[64];
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
    const int geometry = fit_is_geometry((MildModel)work->material.model, name);
    const MildField *field =
        geometry ? mild_field_find(mild_material_fields, mild_material_field_count, name, NULL)
                 : parameter_find(work, any, "hold", name, error);
    if (!field) {
        return error->status;
    }
    fit_range(field, &low, &high);
    if (!(value >= low && value <= high)) {
        return mild_fail(error, MILD_ERROR_RANGE, "--hold: %s = %g is outside %g .. %g: %s", name,
                         value, low, high, field->help);
    }
    *fit_number(&work->material, field) = value;
    work->bed |= strcmp(name, "bed_depth") == 0;
    work->held[field - mild_material_fields] = 1;
    return MILD_OK;
}

static MildStatus from_read(const FitOptions *options, FitWork *work, MildError *error) {
    const int model = work->material.model;
    MildStatus status = grounds_find(options->from, &work->preset, NULL, error);
    if (status != MILD_OK) {
        return status;
    }
    if (work->preset.model != model &&
        !(model_is_cones(work->preset.model) && model_is_cones(model))) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--hold-from %s: a ground of %s has no numbers for %s; use --hold "
                         "NAME=VALUE",
                         options->from, mild_model_names[work->preset.model],
                         mild_model_names[model]);
    }
    if (work->preset.model != model) { /* as in mild_model_match: slip is mild_merged's */
        work->preset.slip_length = work->preset.grip = work->preset.slip_growth = 0;
    }
    work->preset.model = model;
    work->material = work->preset;
    work->from = options->from;
    work->bed = 1;
    return MILD_OK;
}

/* --fit: everything else is held. */
static MildStatus fit_names_read(const CliNames *names, FitWork *work, MildError *error) {
    const MildField *fields[FIT_FIELDS_MAX];
    const int count = parameters_of(work, fields);
    for (int i = 0; i < count; i++) {
        work->held[fields[i] - mild_material_fields] = 1;
    }
    for (int i = 0; i < names->count; i++) {
        const MildField *field = parameter_find(work, 0, "fit", names->name[i], error);
        if (!field) {
            return error->status;
        }
        work->held[field - mild_material_fields] = 0;
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
        status = fit_names_read(&options->fit, work, error);
    }
    for (int i = 0; i < options->hold.count && status == MILD_OK; i++) {
        status = hold_one(options->hold.name[i], options->soil != NULL, work, error);
    }
    return status;
}

/* ---- plates and rings ---- */

/* A plate in the elements of the model, as press lays it out. */
static MildStatus plate_lay(const CliNumbers *size, int concentric, FitPlate *laid,
                            MildError *error) {
    const double *side = size->value;
    const int round = size->count == 1;
    MildSole *plate =
        round ? press_disc_create(side[0], error) : press_plate_create(side[0], side[1], error);
    MildSole *sole = plate;
    if (plate && concentric) {
        sole = mild_sole_concentric(plate, error);
        mild_sole_destroy(plate);
    }
    if (!sole) {
        return error->status;
    }
    *laid = (FitPlate){.elements = mild_sole_elements(sole),
                       .pitch = mild_sole_pitch(sole),
                       .width = round ? 0.5 * side[0] : fmin(side[0], side[1]),
                       .sole = sole,
                       .area = round ? press_disc_area(side[0]) : side[0] * side[1]};
    return MILD_OK;
}

/* A plate for each press, or one for all. */
static MildStatus plates_lay(const FitOptions *options, FitWork *work, MildError *error) {
    const int concentric = mild_model_is_concentric((MildModel)work->material.model);
    FitDef *def = &work->set[FIT_PRESS].def;
    MildStatus status = MILD_OK;
    for (int i = 0; i < options->plate.count && status == MILD_OK; i++) {
        status = plate_lay(&options->plate.each[i], concentric, &def->plate[i], error);
        def->plates += status == MILD_OK;
    }
    return status;
}

static FitPlate ring_of(const CliNumbers *size) {
    return (FitPlate){.elements = 1,
                      .pitch = 1,
                      .width = 1,
                      .outer = 0.5 * size->value[0],
                      .inner = size->count > 1 ? 0.5 * size->value[1] : 0};
}

static int files_of(const FitWork *work, FitFileKind kind) {
    int count = 0;
    for (int f = 0; f < work->files; f++) {
        count += work->file[f].kind == kind;
    }
    return count;
}

/* One for all files, or one for each. */
static MildStatus sizes_check(const char *option, const CliNumbersEach *sizes, int files,
                              const char *what, MildError *error) {
    if (sizes->count && sizes->count != 1 && sizes->count != files) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--%s: %d %ss for %d file%s; give one for all files, or one for each in "
                         "their order",
                         option, sizes->count, what, files, files == 1 ? "" : "s");
    }
    return MILD_OK;
}

static MildStatus plates_check(const FitOptions *options, const FitWork *work, MildError *error) {
    const int presses = files_of(work, FIT_FILE_PRESS), rings = files_of(work, FIT_FILE_RING);
    for (int i = 0; i < options->plate.count; i++) {
        if (options->plate.each[i].count > 2) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "--plate: %d numbers; it takes LENGTH,WIDTH in metres, or the "
                             "DIAMETER of a round plate",
                             options->plate.each[i].count);
        }
    }
    for (int i = 0; i < options->ring.count; i++) {
        const CliNumbers *size = &options->ring.each[i];
        if (size->count > 2 || !(size->value[0] > (size->count > 1 ? size->value[1] : 0))) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "--ring: it takes the OUTER,INNER diameters of a ring in metres, or "
                             "the one of a full disc");
        }
    }
    if (presses && !options->plate.count) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--plate LENGTH,WIDTH is missing: the size of the plate in metres; a "
                         "round one is --plate DIAMETER");
    }
    if (rings && !options->ring.count) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--ring OUTER,INNER is missing: the diameters of the ring in metres, to "
                         "which angle_rad and torque_nm belong");
    }
    MildStatus status = sizes_check("plate", &options->plate, presses, "plate", error);
    return status == MILD_OK ? sizes_check("ring", &options->ring, rings, "ring", error) : status;
}

/* ---- the rows ---- */

/* Appends rows to a set, all of one plate. */
static int rows_add(FitSet *set, const FitPoint *rows, int count, int plate) {
    FitPoint *more = realloc(set->points, sizeof *more * (size_t)(set->count + count + 1));
    if (!more) {
        return 0;
    }
    set->points = more;
    for (int i = 0; i < count; i++) {
        more[set->count] = rows[i];
        more[set->count++].plate = plate;
    }
    set->files += count > 0;
    return 1;
}

/* Sorts the rows of the files into the sets. What slides without turning is plate 0 of the shear
 * set, the rings follow it. */
static MildStatus rows_sort(const FitOptions *options, FitWork *work, MildError *error) {
    FitDef *shear = &work->set[FIT_SHEAR].def;
    int presses = 0, rings = 0, whole = 1;
    shear->plate[0] = (FitPlate){.elements = 1, .pitch = 1, .width = 1};
    shear->plates = 1;
    for (int i = 0; i < options->ring.count && shear->plates < FIT_PLATES_MAX; i++) {
        shear->plate[shear->plates++] = ring_of(&options->ring.each[i]);
    }
    for (int f = 0; f < work->files && whole; f++) {
        FitFile *file = &work->file[f];
        if (file->kind == FIT_FILE_PRESS) {
            const int plate = options->plate.count > 1 ? presses : 0;
            whole = rows_add(&work->set[FIT_PRESS], file->points, file->count, plate) &&
                    rows_add(&work->set[FIT_UNLOAD], file->back, file->back_count, plate) &&
                    rows_add(&work->set[FIT_DRAG], file->slide, file->slide_count, plate);
            presses++;
        } else {
            const int turns = file->kind == FIT_FILE_RING;
            const int plate = turns ? 1 + (options->ring.count > 1 ? rings : 0) : 0;
            if (turns) {
                fit_file_ring(file, shear->plate[plate].outer, shear->plate[plate].inner);
            }
            whole = rows_add(&work->set[FIT_SHEAR], file->points, file->count, plate);
            rings += turns;
        }
    }
    for (int k = 0; k < FIT_KINDS; k++) {
        FitDef *def = &work->set[k].def;
        if (k == FIT_UNLOAD || k == FIT_DRAG) {
            memcpy(def->plate, work->set[FIT_PRESS].def.plate, sizeof def->plate);
            def->plates = work->set[FIT_PRESS].def.plates;
        }
    }
    return whole ? MILD_OK : mild_fail(error, MILD_ERROR_MEMORY, "fit: out of memory");
}

static MildStatus files_read(const CliArgs *args, FitWork *work, MildError *error) {
    MildStatus status = MILD_OK;
    for (; work->files < args->positional_count && status == MILD_OK; work->files++) {
        status = fit_csv_read(args->positional[work->files], &work->file[work->files], error);
    }
    return status;
}

/* ---- the model, and what is held ---- */

static MildStatus model_choose(const FitOptions *options, const CliArgs *args, FitWork *work,
                               MildError *error) {
    int model;
    MildStatus status = grounds_model(options->model, args, &model, error);
    if (status != MILD_OK) {
        return status;
    }
    if (model == MILD_MODEL_RIGID) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--model rigid: the engine's own contact has no parameters that a press "
                         "could determine; choose another model");
    }
    const MildField *bed =
        mild_field_find(mild_material_fields, mild_material_field_count, "bed_depth", NULL);
    work->material = mild_material_default();
    work->material.model = model == TASK_MODEL_OWN ? MILD_MODEL_MILD : model;
    work->material.bed_depth = bed->max;
    return held_read(options, work, error);
}

/* Prepares the fit of a kind of rows. Returns how many of its parameters are free. */
static int set_prepare(const FitOptions *options, FitWork *work, FitKind kind) {
    const MildField *fields[FIT_PARAMETERS_MAX];
    FitDef *def = &work->set[kind].def;
    const int count = fit_parameters((MildModel)work->material.model, kind, fields);
    int left = 0;
    def->kind = kind;
    def->material = work->material;
    def->fill = work->from && !options->fit.count ? &work->preset : NULL;
    for (int i = 0; i < count; i++) {
        def->held[i] = work->held[fields[i] - mild_material_fields];
        left += !def->held[i];
    }
    return left;
}

/* Makes the rows that slide those of a fit, by what their press met. Returns false when out of
 * memory. */
static int slides_prepare(FitWork *work) {
    const FitSet *press = &work->set[FIT_PRESS], *back = &work->set[FIT_UNLOAD];
    FitSet *set = &work->set[FIT_DRAG];
    MildMaterial known = work->material;
    known.recovery = back->done ? back->result.curve.recovery : known.recovery;
    known = fit_slide_base(&known, press->done ? &press->result.curve : NULL);
    FitPoint *rows = malloc(sizeof *rows * (size_t)(2 * set->count + 1));
    if (!rows) {
        return 0;
    }
    int kept = 0;
    for (int first = 0, end; first < set->count; first = end) {
        const FitPoint *slide = set->points + first;
        for (end = first + 1; end < set->count && fit_drag_is_next(&set->points[end]); end++) {
            continue;
        }
        kept +=
            fit_slide_rows(&set->def.plate[slide->plate], &known, slide, end - first, rows + kept);
    }
    free(set->points);
    set->points = rows;
    set->count = kept;
    set->def.material = known;
    return 1;
}

/* Checks that the slides can be fitted, and prepares them. Of a model without slip-sinkage they are
 * left out. */
static MildStatus slides_fit(const FitOptions *options, FitWork *work, MildError *error) {
    FitSet *set = &work->set[FIT_DRAG];
    const FitSet *press = &work->set[FIT_PRESS];
    if (!set->count || set_prepare(options, work, FIT_DRAG) == 0) {
        return MILD_OK;
    }
    if (!press->count && !options->hold.count && !options->from) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "no press: what a plate carries without slip is unknown; leave the rows "
                         "before the slip in the record, or give a press too");
    }
    if (!slides_prepare(work)) {
        return mild_fail(error, MILD_ERROR_MEMORY, "fit: out of memory");
    }
    set->done = 1;
    return fit_run(&set->def, set->points, set->count, &set->result, error);
}

/* Fits each kind of rows by itself, because no two of them determine the same parameter. */
static MildStatus sets_fit(const FitOptions *options, FitWork *work, MildError *error) {
    const char *model = mild_model_names[work->material.model];
    const MildField *fields[FIT_PARAMETERS_MAX];
    MildStatus status = MILD_OK;
    int made = 0;
    if (work->set[FIT_SHEAR].count &&
        !fit_parameters((MildModel)work->material.model, FIT_SHEAR, fields)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--model %s has no law of shear, to which slip_m or angle_rad belong; "
                         "choose bekker, or leave these files out",
                         model);
    }
    for (int k = 0; k < FIT_DRAG && status == MILD_OK; k++) {
        FitSet *set = &work->set[k];
        set->done = set->count > 0 && set_prepare(options, work, (FitKind)k) > 0;
        if (set->done) {
            status = fit_run(&set->def, set->points, set->count, &set->result, error);
        }
        made += set->done && k != FIT_UNLOAD;
    }
    status = status == MILD_OK ? slides_fit(options, work, error) : status;
    made += work->set[FIT_DRAG].done;
    if (status == MILD_OK && !made) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--hold: every parameter of %s is held, which leaves nothing to fit",
                         model);
    }
    return status;
}

/* ---- the picture ---- */

static MildStatus figure_save(const FitWork *work, const char *figure, MildError *error) {
    char data[PATH_SIZE];
    if (!work->set[FIT_PRESS].done) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--figure draws presses, and none was fitted; leave it out");
    }
    MildStatus status = path_beside(figure, NUMBERS_END, data, error);
    if (status == MILD_OK) {
        status = fit_numbers_save(work, data, error);
    }
    if (status == MILD_OK) {
        status = figure_draw("fit", data, figure, NULL, error);
    }
    return status;
}

/* ---- the command ---- */

/* The command line, as the soil's file shows it. */
static void command_text(int argc, char **argv, char *text, size_t size) {
    snprintf(text, size, "mild fit");
    for (int i = 1; i < argc; i++) {
        const size_t used = strlen(text);
        snprintf(text + used, size - used, " %s", argv[i]);
    }
}

static MildStatus fit_report(const FitOptions *options, const char *command, const CliArgs *args,
                             FitWork *work, MildError *error) {
    MildStatus status = files_read(args, work, error);
    if (status == MILD_OK) {
        status = model_choose(options, args, work, error);
    }
    if (status == MILD_OK) {
        status = plates_check(options, work, error);
    }
    if (status == MILD_OK) {
        status = plates_lay(options, work, error);
    }
    if (status == MILD_OK) {
        status = rows_sort(options, work, error);
    }
    if (status == MILD_OK) {
        status = sets_fit(options, work, error);
    }
    if (status != MILD_OK) {
        return status;
    }
    if (!options->json || strcmp(options->json, "-") != 0) {
        fit_print(work);
    }
    if (options->soil) {
        status = fit_soil_save(work, command, options->soil, error);
    }
    if (status == MILD_OK && options->json) {
        status = fit_json_save(work, options->json, error);
    }
    if (status == MILD_OK && options->figure) {
        status = figure_save(work, options->figure, error);
    }
    return status;
}

static void work_close(FitWork *work) {
    for (int f = 0; f < CLI_LIST_MAX; f++) {
        fit_file_close(&work->file[f]);
    }
    for (int k = 0; k < FIT_KINDS; k++) {
        free(work->set[k].points);
    }
    for (int i = 0; i < work->set[FIT_PRESS].def.plates; i++) {
        mild_sole_destroy((MildSole *)(uintptr_t)work->set[FIT_PRESS].def.plate[i].sole);
    }
}

/* A walk's log alone, without options of a press. Returns the exit code. */
static int walk_fit(const FitOptions *options, const CliArgs *args) {
    MildError error = {0};
    if (args->positional_count > 1) {
        return cli_fail_text("fit", "%s is a walk's log; give it alone", args->positional[0]);
    }
    if (options->plate.count || options->ring.count || options->fit.count || options->hold.count ||
        options->from || options->model || options->figure || options->soil) {
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
    const int parsed = options_read(argc, argv, &options, &args);
    if (parsed != CLI_RUN) {
        return parsed;
    }
    if (!args.positional_count) {
        return cli_fail_text(
            "fit", "no record given: mild fit DATA.csv --plate L,W (mild press --csv writes one)");
    }
    if (belief_log_is(args.positional[0])) {
        return walk_fit(&options, &args);
    }
    if (options.soil && !soil_is_file(options.soil)) {
        return cli_fail_text("fit",
                             "--soil %s: the name of a soil ends in .ini, by which it is known",
                             options.soil);
    }
    char command[1024];
    MildError error;
    FitWork *work = calloc(1, sizeof *work);
    if (!work) {
        return cli_fail_text("fit", "out of memory");
    }
    command_text(argc, argv, command, sizeof command);
    MildStatus status = fit_report(&options, command, &args, work, &error);
    work_close(work);
    free(work);
    return status == MILD_OK ? 0 : cli_fail("fit", &error);
}
