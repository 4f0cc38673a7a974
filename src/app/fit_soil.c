/* The soil that `mild fit --soil` writes: its numbers, and where each comes from. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "app/fit_work.h"
#include "ground/soil/soil.h"

enum { NOTE_SIZE = 160, HEAD_SIZE = 2000 };

typedef struct {
    const FitWork *work;
    MildMaterial soil;
    char text[FIT_FIELDS_MAX][NOTE_SIZE];
    const char *note[FIT_FIELDS_MAX];
    char missing[200]; /* names, with commas */
} Soil;

/* The value of a field among what was fitted, and its kind; NULL: none has it. */
static const FitValue *value_find(const FitWork *work, const MildField *field, FitKind *kind) {
    for (int k = 0; k < FIT_KINDS; k++) {
        const FitSet *set = &work->set[k];
        for (int i = 0; i < set->result.parameters && set->done; i++) {
            if (set->result.parameter[i].field == field) {
                *kind = (FitKind)k;
                return &set->result.parameter[i];
            }
        }
    }
    return NULL;
}

/* Takes what a fit found of the field. recovery has its limit's best value too, because beyond its
 * range there is nothing. Returns false when the fit leaves it unknown. */
static int take_fitted(Soil *s, const MildField *field, char *note) {
    FitKind kind = FIT_PRESS;
    const FitValue *value = value_find(s->work, field, &kind);
    if (!value) {
        return 0;
    }
    MildMaterial curve = s->work->set[kind].result.curve;
    const double number = *fit_number(&curve, field);
    const int bare = strcmp(value->unit, "-") == 0;
    if (value->state == FIT_FITTED) {
        snprintf(note, NOTE_SIZE, "95 %%: %.5g .. %.5g%s%s", value->low, value->high,
                 bare ? "" : " ", bare ? "" : value->unit);
    } else if (value->state == FIT_LIMIT && kind == FIT_UNLOAD) {
        const int most = isfinite(value->high);
        snprintf(note, NOTE_SIZE, "95 %%: at %s %.5g", most ? "most" : "least",
                 most ? value->high : value->low);
    } else {
        return 0;
    }
    *fit_number(&s->soil, field) = number;
    return 1;
}

/* Bool: the fit asked for the field, has no number of it, and contradicts that of the preset. */
static int is_contradicted(const FitWork *work, const MildField *field) {
    FitKind kind;
    const FitValue *value = value_find(work, field, &kind);
    MildMaterial preset = work->preset;
    const double number = fit_counted(field, *fit_number(&preset, field));
    return value && value->state == FIT_LIMIT && (number < value->low || number > value->high);
}

/* Where the number of a field comes from; 0: nobody knows it. */
static int take(Soil *s, const MildField *field, int held, char *note) {
    const FitWork *work = s->work;
    MildMaterial known = work->material;
    const double number = *fit_number(&known, field), usual = *fit_number(&s->soil, field);
    if (take_fitted(s, field, note)) {
        return 1;
    }
    if (strcmp(field->name, "bed_depth") == 0 && !work->bed) {
        *fit_number(&s->soil, field) = number;
        snprintf(note, NOTE_SIZE, "no bed was met");
        return 1;
    }
    MildMaterial preset = work->preset;
    if (held && !(work->from && number == *fit_number(&preset, field))) {
        *fit_number(&s->soil, field) = number;
        snprintf(note, NOTE_SIZE, "held");
        return 1;
    }
    if (work->from && !is_contradicted(work, field)) {
        snprintf(note, NOTE_SIZE, "of %.120s", work->from);
        return 1;
    }
    FitKind kind;
    if (strcmp(field->name, "plate_width") == 0) {
        snprintf(note, NOTE_SIZE, "0: the shorter side of the sole");
        return 1;
    }
    if (usual == 0 && !value_find(work, field, &kind)) {
        snprintf(note, NOTE_SIZE, "not measured");
        return 1;
    }
    return 0;
}

/* Names a number that nobody knows, with the bound that the records set. */
static void missing_add(Soil *s, const MildField *field) {
    const size_t used = strlen(s->missing);
    char bound[60] = "";
    FitKind kind;
    const FitValue *value = value_find(s->work, field, &kind);
    if (value && value->state == FIT_LIMIT) {
        const int most = isfinite(value->high);
        snprintf(bound, sizeof bound, " (at %s %.5g)", most ? "most" : "least",
                 most ? value->high : value->low);
    }
    snprintf(s->missing + used, sizeof s->missing - used, "%s%s%s", used ? ", " : "", field->name,
             bound);
}

static void fields_take(Soil *s) {
    for (int i = 0; i < mild_material_field_count; i++) {
        const MildField *field = &mild_material_fields[i];
        s->note[i] = NULL;
        if (field->type != MILD_FIELD_DOUBLE || !soil_reads(&s->soil, field)) {
            continue;
        }
        if (take(s, field, s->work->held[i], s->text[i])) {
            s->note[i] = s->text[i];
            continue;
        }
        missing_add(s, field);
    }
}

MildStatus fit_soil_save(const FitWork *work, const char *command, const char *path,
                         MildError *error) {
    static const char *const kinds[FIT_KINDS] = {"presses", "unloading", "shear", "slides"};
    Soil s = {.work = work, .soil = work->from ? work->preset : mild_material_default()};
    char head[HEAD_SIZE], residual[400];
    s.soil.model = work->material.model;
    s.soil.plate_width = 0;
    fields_take(&s);
    if (s.missing[0]) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--soil: the records do not determine %s; say what you know (--hold "
                         "NAME=VALUE), or take what is missing from a preset (--hold-from PRESET)",
                         s.missing);
    }
    snprintf(head, sizeof head, "%.1000s", command);
    for (int k = 0; k < FIT_KINDS; k++) {
        const size_t used = strlen(head);
        if (work->set[k].done) {
            snprintf(head + used, sizeof head - used, "\n%s: %s", kinds[k],
                     fit_residual_text(work, (FitKind)k, residual, sizeof residual));
        }
    }
    const SoilNotes notes = {head, s.note};
    return soil_write(&s.soil, &notes, path, error);
}
