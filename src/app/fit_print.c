/* What `mild fit` prints and writes of its results. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "app/fit_work.h"
#include "app/report.h"
#include "base/text.h"
#include "identify/fit_law.h"

/* ---- the table ---- */

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

static MildModel model_of(const FitWork *work) {
    return (MildModel)work->material.model;
}

/* What the intervals of presses rest on. */
static void press_assumptions_print(const FitWork *work) {
    const FitSet *press = &work->set[FIT_PRESS];
    double deepest = 0, fastest = 0;
    for (int i = 0; i < press->count; i++) {
        deepest = fmax(deepest, press->points[i].depth);
        fastest = fmax(fastest, press->points[i].speed);
    }
    if (!work->bed) {
        printf("the intervals assume no firm bed down to %.4g m (--hold bed_depth=D if there is)\n",
               deepest);
    } else if (deepest > work->material.bed_depth) {
        printf("the intervals assume bed_depth = %.5g\n", work->material.bed_depth);
    }
    if (fastest == 0) {
        printf("the intervals assume a slow press, because the records have neither time_s nor "
               "speed_m_s\n");
    }
}

static void assumptions_print(const FitWork *work, FitKind kind) {
    static const char *const why[FIT_KINDS] = {("the law misses the curve (another --model?), or "
                                                "the noise is slow"),
                                               "ground springs back along no straight line",
                                               "the law misses the curve, or the noise is slow",
                                               "the law misses the curve, or the noise is slow"};
    const FitResult *result = &work->set[kind].result;
    if (names_print(result, bit(FIT_HELD), 1, "the intervals assume ")) {
        printf("\n");
    }
    if (names_print(result, bit(FIT_FILLED), 1, "the intervals assume ")) {
        printf(" of %s, because the data do not determine them\n", work->from);
    }
    if (kind == FIT_PRESS) {
        press_assumptions_print(work);
    }
    if (result->neighbours > 0) {
        printf("the residuals of neighbouring rows are alike (correlation %.2f): %s; the %d rows "
               "count as %.0f\n",
               result->neighbours, why[kind], result->points, result->rows);
    }
}

/* [-] Relative bias of the curve: the sum of its forces over that of the record's, less 1. *row:
 * the first one of a press, then that of the next file. */
static double press_bias(const FitWork *work, int file, const FitPoint **row) {
    const FitSet *press = &work->set[FIT_PRESS];
    const FitPoint *end = *row + work->file[file].count;
    double fitted = 0, measured = 0;
    for (; *row < end; ++*row) {
        double force;
        fit_forces(FIT_PRESS, press->def.plate, &press->result.curve, *row, 1, &force);
        fitted += force;
        measured += (*row)->force;
    }
    return fitted / measured - 1;
}

/* The bias in each of several presses: plates of several sizes tell whether the law knows them. */
static void files_print(const FitWork *work) {
    const FitPoint *row = work->set[FIT_PRESS].points;
    if (work->set[FIT_PRESS].files < 2) {
        return;
    }
    for (int f = 0, count = 0; f < work->files; f++) {
        if (work->file[f].kind == FIT_FILE_PRESS && work->file[f].count) {
            const double percent = 100 * press_bias(work, f, &row);
            printf("%s%s %+.1f %%", count++ ? ", " : "bias by file: ", work->file[f].path,
                   fabs(percent) < 0.05 ? 0.0 : percent);
        }
    }
    printf("\n");
}

/* Bool: all rows have about the same speed. */
static int is_one_speed(const FitSet *press) {
    double slowest = INFINITY, fastest = 0;
    for (int i = 0; i < press->count; i++) {
        slowest = fmin(slowest, press->points[i].speed);
        fastest = fmax(fastest, press->points[i].speed);
    }
    return fastest <= 1.3 * slowest;
}

/* Bool: a fit that was made has the parameter. */
static int is_asked(const FitWork *work, const char *name) {
    for (int k = 0; k < FIT_KINDS; k++) {
        const FitSet *set = &work->set[k];
        for (int i = 0; i < set->result.parameters && set->done; i++) {
            if (strcmp(set->result.parameter[i].name, name) == 0) {
                return 1;
            }
        }
    }
    return 0;
}

/* Parameters of the model that no record here determines, such as friction. */
static void never_print(const FitWork *work) {
    const MildModelInfo *info = mild_model_info(model_of(work));
    int count = 0;
    for (int i = 0; i < MILD_MODEL_FIELDS && info->fields[i]; i++) {
        if (!fit_is_geometry(model_of(work), info->fields[i]) &&
            strcmp(info->fields[i], "passive") != 0 && !is_asked(work, info->fields[i])) {
            printf("%s%s", count++ ? ", " : "no press straight down determines ", info->fields[i]);
        }
    }
    printf("%s", count ? "\n" : "");
}

/* Parameters that only rows at several speeds determine. */
static void rates_print(const FitWork *work, unsigned undetermined) {
    const FitSet *press = &work->set[FIT_PRESS];
    int rate = 0;
    for (int i = 0; i < press->result.parameters && is_one_speed(press); i++) {
        const FitValue *value = &press->result.parameter[i];
        if (undetermined >> value->state & 1 && fit_is_rate(model_of(work), value->field)) {
            printf("%s%s", rate++ ? ", " : "a press at another speed or a drop says more about ",
                   value->name);
        }
    }
    printf("%s", rate ? "\n" : "");
}

/* Bool: the parameter is in one of the states. */
static int is_undetermined(const FitResult *result, const char *name, unsigned states) {
    int found = 0;
    for (int i = 0; i < result->parameters; i++) {
        const FitValue *value = &result->parameter[i];
        found |= strcmp(value->name, name) == 0 && (states >> value->state & 1);
    }
    return found;
}

/* What the data do not determine, and the remedy. */
static void undetermined_print(const FitWork *work, FitKind kind) {
    const unsigned undetermined =
        bit(FIT_LIMIT) | bit(FIT_OPEN) | bit(FIT_TIED) | bit(FIT_NO_EFFECT);
    const FitResult *result = &work->set[kind].result;
    if (kind == FIT_UNLOAD ||
        !names_print(result, undetermined, 0, "not determined by these data: ")) {
        return;
    }
    printf("; hold what you know (--hold NAME=VALUE)%s%s%s\n",
           work->from || !has_presets(model_of(work)) ? ""
                                                      : ", or what is missing (--hold-from PRESET)",
           kind == FIT_SHEAR ? "; records at several pressures separate cohesion from mu" : "",
           kind == FIT_DRAG && is_undetermined(result, "regain_length", undetermined)
               ? "; a plate that sinks as it slides determines regain_length"
               : "");
}

/* "55", or "44, 77" of several plates. */
static const char *elements_text(const FitDef *def, char text[8 * FIT_PLATES_MAX]) {
    int length = 0;
    for (int i = 0; i < def->plates; i++) {
        length += sprintf(text + length, i ? ", %d" : "%d", def->plate[i].elements);
    }
    return text;
}

const char *fit_residual_text(const FitWork *work, FitKind kind, char *text, size_t size) {
    static const char *const rows[FIT_KINDS] = {"loading rows", "unloading rows", "rows of slip",
                                                "rows that slide"};
    const FitSet *set = &work->set[kind];
    const FitResult *result = &set->result;
    char elements[8 * FIT_PLATES_MAX] = "", tail[8 * FIT_PLATES_MAX + 20] = "";
    if (kind == FIT_PRESS) {
        const int one = set->def.plates == 1 && set->def.plate[0].elements == 1;
        snprintf(tail, sizeof tail, ", %s element%s", elements_text(&set->def, elements),
                 one ? "" : "s");
    }
    snprintf(text, size,
             "residual %.4g %s, %.2f %% of the %s (root mean square); %d %s of %d file%s%s",
             result->residual, kind == FIT_SHEAR ? "N/m^2" : "N", 100 * result->residual_share,
             kind == FIT_SHEAR ? "stress" : "force", result->points, rows[kind], set->files,
             set->files == 1 ? "" : "s", tail);
    return text;
}

void fit_print(const FitWork *work) {
    char text[400];
    printf("%-24s %12s %12s %12s  %s\n", "parameter", "value", "low 95 %", "high 95 %", "unit");
    for (int k = 0; k < FIT_KINDS; k++) {
        const FitResult *result = &work->set[k].result;
        for (int i = 0; i < result->parameters && work->set[k].done; i++) {
            value_print(&result->parameter[i]);
        }
        for (int i = 0; i < result->combinations && work->set[k].done; i++) {
            value_print(&result->combination[i]);
        }
    }
    for (int k = 0; k < FIT_KINDS; k++) {
        if (work->set[k].done) {
            printf("%s\n", fit_residual_text(work, (FitKind)k, text, sizeof text));
            if (k == FIT_PRESS) {
                files_print(work);
            }
            assumptions_print(work, (FitKind)k);
        }
    }
    for (int k = 0; k < FIT_KINDS; k++) {
        if (work->set[k].done) {
            undetermined_print(work, (FitKind)k);
        }
    }
    const FitSet *slides = &work->set[FIT_DRAG];
    if (slides->count && !slides->done) {
        printf("left out: %d rows of slip; %s\n", slides->count,
               fit_drag_is_modelled(model_of(work)) ? "all that they determine is held"
                                                    : "slip costs no support under this model");
    }
    if (work->set[FIT_PRESS].done) {
        rates_print(work, bit(FIT_LIMIT) | bit(FIT_OPEN) | bit(FIT_TIED) | bit(FIT_NO_EFFECT));
        never_print(work);
    }
}

/* ---- JSON ---- */

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

/* Residual and independent rows: of presses at the root, of others in an object. */
static int json_residual(cJSON *root, const FitSet *set, FitKind kind) {
    static const char *const names[FIT_KINDS] = {NULL, "unloading", "shear", "slides"};
    cJSON *object = names[kind] ? cJSON_AddObjectToObject(root, names[kind]) : root;
    return cJSON_AddNumberToObject(object, "residual", set->result.residual) &&
           cJSON_AddNumberToObject(object, "independent_rows", set->result.rows);
}

static int json_set(cJSON *root, const FitSet *set, FitKind kind) {
    const FitResult *result = &set->result;
    int whole = json_residual(root, set, kind);
    for (int i = 0; i < result->parameters && whole; i++) {
        whole = json_value(root, "parameters", &result->parameter[i]);
    }
    for (int i = 0; i < result->combinations && whole; i++) {
        whole = json_value(root, "combinations", &result->combination[i]);
    }
    return whole;
}

/* The bias in each of several presses, in the order of the files. */
static int json_bias(cJSON *root, const FitWork *work) {
    const FitPoint *row = work->set[FIT_PRESS].points;
    cJSON *list = cJSON_AddArrayToObject(root, "bias");
    int whole = list != NULL;
    for (int f = 0; f < work->files && whole; f++) {
        if (work->file[f].kind == FIT_FILE_PRESS && work->file[f].count) {
            cJSON *item = cJSON_CreateObject();
            whole = cJSON_AddItemToArray(list, item) &&
                    cJSON_AddStringToObject(item, "file", work->file[f].path) &&
                    cJSON_AddNumberToObject(item, "force", press_bias(work, f, &row));
        }
    }
    return whole;
}

MildStatus fit_json_save(const FitWork *work, const char *path, MildError *error) {
    cJSON *root = cJSON_CreateObject();
    int whole = root && cJSON_AddStringToObject(root, "model", mild_model_names[model_of(work)]) &&
                cJSON_AddObjectToObject(root, "parameters") &&
                cJSON_AddObjectToObject(root, "combinations") &&
                cJSON_AddObjectToObject(root, "held") && cJSON_AddObjectToObject(root, "limits") &&
                cJSON_AddArrayToObject(root, "undetermined");
    for (int k = 0; k < FIT_KINDS && whole; k++) {
        whole = !work->set[k].done || json_set(root, &work->set[k], (FitKind)k);
    }
    if (whole && work->set[FIT_PRESS].done && work->set[FIT_PRESS].files > 1) {
        whole = json_bias(root, work);
    }
    if (!whole) {
        cJSON_Delete(root);
        root = NULL;
    }
    return report_save(root, path, error);
}

/* ---- the numbers of the picture ---- */

MildStatus fit_numbers_save(const FitWork *work, const char *path, MildError *error) {
    const FitSet *press = &work->set[FIT_PRESS];
    const FitPoint *p = press->points;
    Sheet csv = {0};
    MildStatus status = sheet_open(&csv, error);
    if (status != MILD_OK) {
        return status;
    }
    fprintf(csv.file, "record,depth_m,force_n,speed_m_s,fit_n\n");
    for (int f = 0; f < work->files; f++) {
        const int rows = work->file[f].kind == FIT_FILE_PRESS ? work->file[f].count : 0;
        for (const FitPoint *end = p + rows; p < end; p++) {
            double force;
            fit_forces(FIT_PRESS, press->def.plate, &press->result.curve, p, 1, &force);
            fprintf(csv.file, "%d,%.9g,%.9g,%.9g,%.9g\n", f + 1, p->depth, p->force, p->speed,
                    force);
        }
    }
    return sheet_close(&csv, path, MILD_OK, error);
}
