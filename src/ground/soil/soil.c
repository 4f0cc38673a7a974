#include "ground/soil/soil.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/text.h"

enum { KEYS_MAX = 48, LINE_MAX = 400, NAME_SHOWN = 120, PRESETS_MAX = 64 };

/* ---- names ---- */

/* Names of all presets. Returns their count. */
static int presets_list(const char *names[PRESETS_MAX]) {
    int count = 0;
    for (int i = 0; i < mild_material_preset_count() && count < PRESETS_MAX; i++) {
        names[count++] = mild_material_preset_name(i);
    }
    for (int m = 0; m < MILD_MODEL_RIGID; m++) {
        const MildModelInfo *info = mild_model_info((MildModel)m);
        for (int k = 0; k < MILD_MODEL_PRESETS && info->presets[k] && count < PRESETS_MAX; k++) {
            names[count++] = info->presets[k];
        }
    }
    return count;
}

MildStatus soil_preset(const char *name, MildMaterial *material, MildError *error) {
    const char *names[PRESETS_MAX + 1];
    if (mild_material_preset(name, material)) {
        return MILD_OK;
    }
    if (strcmp(name, "rigid") == 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "ground 'rigid' is the engine's own contact and has no soft-ground law");
    }
    int count = presets_list(names);
    names[count++] = "rigid"; /* which some callers know */
    char known[300] = "rigid";
    for (int i = 0; i + 1 < count; i++) {
        const size_t used = strlen(known);
        snprintf(known + used, sizeof known - used, ", %s", names[i]);
    }
    return mild_fail(error, MILD_ERROR_ARGUMENT,
                     "unknown ground '%.60s'; nearest is '%s'; known: %s, and files whose names "
                     "end in .ini",
                     name, text_nearest(name, names, count), known);
}

int soil_reads(const MildMaterial *material, const MildField *field) {
    const MildModelInfo *info = mild_model_info((MildModel)material->model);
    for (int i = 0; i < MILD_MODEL_FIELDS && info->fields[i]; i++) {
        if (strcmp(info->fields[i], field->name) == 0) {
            return 1;
        }
    }
    return strcmp(field->name, "model") == 0;
}

/* ---- reading ---- */

/* A value as it stands in the file. */
typedef struct {
    char text[LINE_MAX];
    int line; /* 0: not there */
} Value;

typedef struct {
    const char *name; /* of the file, for messages */
    int line;         /* from 1 */
    int inside;       /* bool: [ground] was read */
    Value preset;
    Value value[KEYS_MAX]; /* in the order of mild_material_fields */
} SoilReader;

_Static_assert(sizeof(SoilReader) < 1 << 16, "it lies on the stack");

static MildStatus line_fail(const SoilReader *r, int line, MildError *error, const char *what) {
    return mild_fail(error, MILD_ERROR_FORMAT, "%.*s:%d: %s", NAME_SHOWN, r->name, line, what);
}

static MildStatus section_read(SoilReader *r, const char *code, MildError *error) {
    char what[LINE_MAX + 80];
    if (strcmp(code, "[ground]") != 0) {
        snprintf(what, sizeof what, "'%.60s': a soil has the section [ground] alone", code);
        return line_fail(r, r->line, error, what);
    }
    r->inside = 1;
    return MILD_OK;
}

/* Where the value of a key goes; NULL and a message for a key that is none. */
static Value *key_find(SoilReader *r, const char *key, MildError *error) {
    char what[200];
    const char *nearest = NULL;
    if (strcmp(key, "preset") == 0) {
        return &r->preset;
    }
    const MildField *field =
        mild_field_find(mild_material_fields, mild_material_field_count, key, &nearest);
    if (field) {
        return &r->value[field - mild_material_fields];
    }
    snprintf(what, sizeof what, "unknown key '%.60s'; nearest is '%s' (mild info grounds)", key,
             nearest ? nearest : "preset");
    line_fail(r, r->line, error, what);
    return NULL;
}

static MildStatus key_read(SoilReader *r, char *code, MildError *error) {
    char what[200];
    char *equals = strpbrk(code, "=:");
    if (!equals) {
        return line_fail(r, r->line, error, "neither `key = value` nor [ground]");
    }
    if (!r->inside) {
        return line_fail(r, r->line, error, "a key before [ground]; that is a soil's first line");
    }
    char *text = equals + 1 + strspn(equals + 1, " \t");
    while (equals > code && strchr(" \t", equals[-1])) {
        equals--;
    }
    *equals = '\0';
    Value *value = key_find(r, code, error);
    if (!value) {
        return MILD_ERROR_FORMAT;
    }
    if (value->line) {
        snprintf(what, sizeof what, "%.60s was set on line %d already; keep one", code,
                 value->line);
        return line_fail(r, r->line, error, what);
    }
    snprintf(value->text, sizeof value->text, "%s", text);
    value->line = r->line;
    return MILD_OK;
}

static MildStatus line_read(SoilReader *r, const char *line, size_t length, MildError *error) {
    char code[LINE_MAX];
    if (length >= sizeof code) {
        return line_fail(r, r->line, error, "a line longer than 399 characters; shorten it");
    }
    memcpy(code, line, length);
    code[length] = '\0';
    if (length == 0) {
        return MILD_OK;
    }
    return code[0] == '[' ? section_read(r, code, error) : key_read(r, code, error);
}

/* A value into a material. */
static MildStatus value_apply(const SoilReader *r, const MildField *field, MildMaterial *material,
                              MildError *error) {
    const Value *value = &r->value[field - mild_material_fields];
    MildError cause = {0};
    const MildStatus status =
        value->line ? mild_field_parse(field, material, value->text, "ground", &cause) : MILD_OK;
    return status == MILD_OK ? MILD_OK
                             : mild_fail(error, status, "%.*s:%d: %s", NAME_SHOWN, r->name,
                                         value->line, cause.text);
}

/* What the file starts from: the preset, or the default of the library, and the model. */
static MildStatus base_find(const SoilReader *r, MildMaterial *material, MildError *error) {
    char what[400];
    const MildField *model =
        mild_field_find(mild_material_fields, mild_material_field_count, "model", NULL);
    *material = mild_material_default();
    MildError cause = {0};
    if (r->preset.line && soil_preset(r->preset.text, material, &cause) != MILD_OK) {
        snprintf(what, sizeof what, "preset: %.330s", cause.text);
        return line_fail(r, r->preset.line, error, what);
    }
    const int own = material->model;
    const MildStatus status = value_apply(r, model, material, error);
    if (status != MILD_OK || !r->preset.line || material->model == own) {
        return status;
    }
    snprintf(what, sizeof what,
             "model = %s, but the preset %.40s is of %s; leave one of the two out",
             mild_model_names[material->model], r->preset.text, mild_model_names[own]);
    return line_fail(r, r->value[model - mild_material_fields].line, error, what);
}

/* Bool: without a preset the file must say the number: of 0 nothing is missing. */
static int is_needed(const MildMaterial *material, const MildField *field) {
    const MildMaterial usual = mild_material_default();
    return soil_reads(material, field) && field->type == MILD_FIELD_DOUBLE &&
           *(const double *)((const char *)&usual + field->offset) != 0;
}

static MildStatus keys_apply(const SoilReader *r, MildMaterial *material, MildError *error) {
    char what[200];
    for (int i = 0; i < mild_material_field_count; i++) {
        const MildField *field = &mild_material_fields[i];
        const int line = r->value[i].line;
        if (line && !soil_reads(material, field)) {
            snprintf(what, sizeof what, "%s: the model %s does not read it; leave it out",
                     field->name, mild_model_names[material->model]);
            return line_fail(r, line, error, what);
        }
        if (!line && !r->preset.line && is_needed(material, field)) {
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%.*s: %s is missing, which the model %s reads: %.80s; add it, or "
                             "`preset = NAME` for all that the file does not say",
                             NAME_SHOWN, r->name, field->name, mild_model_names[material->model],
                             field->help);
        }
        const MildStatus status = value_apply(r, field, material, error);
        if (status != MILD_OK) {
            return status;
        }
    }
    return MILD_OK;
}

MildStatus soil_parse(const char *text, const char *name, MildMaterial *material,
                      MildError *error) {
    SoilReader reader = {.name = name};
    MildMaterial read;
    MildError cause = {0};
    MildStatus status = MILD_OK;
    const char *rest = strncmp(text, "\xef\xbb\xbf", 3) == 0 ? text + 3 : text;
    while (*rest && status == MILD_OK) {
        const char *line;
        rest += strspn(rest, " \t");
        const size_t length = text_line(&rest, &line);
        reader.line++;
        status = line_read(&reader, line, length, error);
    }
    if (status == MILD_OK && !reader.inside) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.*s: is no soil, because it has no section [ground]", NAME_SHOWN, name);
    }
    if (status == MILD_OK) {
        status = base_find(&reader, &read, error);
    }
    if (status == MILD_OK) {
        status = keys_apply(&reader, &read, error);
    }
    if (status == MILD_OK && mild_material_check(&read, &cause) != MILD_OK) {
        status = mild_fail(error, cause.status, "%.*s: %s", NAME_SHOWN, name, cause.text);
    }
    if (status == MILD_OK) {
        *material = read;
    }
    return status;
}

/* ---- writing ---- */

/* Lines of remarks: nothing in them can end the remark. */
static void remark_print(const char *text, FILE *file) {
    for (const char *line = text; *line;) {
        const size_t length = strcspn(line, "\n");
        char shown[LINE_MAX - 8];
        snprintf(shown, sizeof shown, "%.*s", (int)length, line);
        text_plain(shown, strlen(shown), "");
        fprintf(file, "# %s\n", shown);
        line += length + (line[length] == '\n');
    }
}

char *soil_text(const MildMaterial *material, const SoilNotes *notes) {
    char *text = NULL, value[64];
    size_t size = 0;
    FILE *file = open_memstream(&text, &size);
    if (!file) {
        return NULL;
    }
    if (notes && notes->head) {
        remark_print(notes->head, file);
    }
    fprintf(file, "[ground]\nmodel = %s\n", mild_model_names[material->model]);
    for (int i = 0; i < mild_material_field_count; i++) {
        const MildField *field = &mild_material_fields[i];
        if (field->type == MILD_FIELD_NAME || !soil_reads(material, field)) {
            continue;
        }
        if (notes && notes->note && notes->note[i]) {
            remark_print(notes->note[i], file);
        }
        mild_field_print(field, material, value, sizeof value);
        fprintf(file, "%s = %s\n", field->name, value);
    }
    if (fclose(file) != 0) {
        free(text);
        return NULL;
    }
    return text;
}
