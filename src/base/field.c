#include "mild/field.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/text.h"

/* Longest array that a text can fill. All values are parsed before the first one is written. */
enum { FIELD_VALUES_MAX = 64 };

typedef union {
    double number;
    int integer;
    uint64_t unsigned64;
} Value;

static size_t field_value_size(MildFieldType type) {
    switch (type) {
    case MILD_FIELD_DOUBLE: return sizeof(double);
    case MILD_FIELD_UINT64: return sizeof(uint64_t);
    case MILD_FIELD_TEXT: return sizeof(char);
    case MILD_FIELD_INT:
    case MILD_FIELD_NAME:
    case MILD_FIELD_BOOL: break;
    }
    return sizeof(int);
}

static Value field_load(const MildField *field, const void *def, int index) {
    Value value = {0};
    size_t size = field_value_size(field->type);
    memcpy(&value, (const char *)def + field->offset + (size_t)index * size, size);
    return value;
}

static double value_as_double(MildFieldType type, Value value) {
    if (type == MILD_FIELD_DOUBLE) {
        return value.number;
    }
    if (type == MILD_FIELD_UINT64) {
        return (double)value.unsigned64;
    }
    return (double)value.integer;
}

static MildStatus value_check(const MildField *field, Value value, const char *section,
                              MildError *error) {
    double x = value_as_double(field->type, value);
    if (x >= field->min && x <= field->max) {
        return MILD_OK; /* false for NaN */
    }
    return mild_fail(error, MILD_ERROR_RANGE, "%s.%s = %.9g is outside %.9g .. %.9g: %s", section,
                     field->name, x, field->min, field->max, field->help);
}

MildStatus mild_fields_check(const MildField *fields, int count, const void *def,
                             const char *section, MildError *error) {
    for (int f = 0; f < count; f++) {
        const MildField *field = &fields[f];
        if (field->type == MILD_FIELD_TEXT) {
            if (!memchr((const char *)def + field->offset, 0, (size_t)field->count)) {
                return mild_fail(error, MILD_ERROR_RANGE,
                                 "%s.%s is not terminated within %d characters", section,
                                 field->name, field->count);
            }
            continue;
        }
        for (int i = 0; i < field->count; i++) {
            MildStatus status = value_check(field, field_load(field, def, i), section, error);
            if (status != MILD_OK) {
                return status;
            }
        }
    }
    return MILD_OK;
}

static int text_equal(const char *text, size_t length, const char *word) {
    if (strlen(word) != length) {
        return 0;
    }
    for (size_t i = 0; i < length; i++) {
        if (tolower((unsigned char)text[i]) != word[i]) {
            return 0;
        }
    }
    return 1;
}

static int parse_bool(const char *text, size_t length, Value *value) {
    static const char *const yes[] = {"1", "true", "yes", "on"}, *const no[] = {"0", "false", "no",
                                                                                "off"};
    for (int i = 0; i < 4; i++) {
        value->integer = text_equal(text, length, yes[i]);
        if (value->integer || text_equal(text, length, no[i])) {
            return 1;
        }
    }
    return 0;
}

/* Parses one value from `length` characters at `text`. Returns false unless they are exactly one
 * value of that type. */
static int parse_value(MildFieldType type, const char *text, size_t length, Value *value) {
    char word[64], *end = word;
    if (length == 0 || length >= sizeof word) {
        return 0;
    }
    memcpy(word, text, length);
    word[length] = 0;
    errno = 0;
    switch (type) {
    case MILD_FIELD_DOUBLE:
        value->number = strtod(word, &end);
        return *end == 0 && !isnan(value->number);
    case MILD_FIELD_INT: {
        long number = strtol(word, &end, 10);
        value->integer = (int)number;
        return *end == 0 && errno == 0 && (long)(int)number == number;
    }
    case MILD_FIELD_UINT64:
        value->unsigned64 = strtoull(word, &end, 0);
        return *end == 0 && errno == 0 && word[0] != '-';
    case MILD_FIELD_BOOL: return parse_bool(text, length, value);
    case MILD_FIELD_NAME:
    case MILD_FIELD_TEXT: break;
    }
    return 0;
}

static const char *type_name(MildFieldType type) {
    static const char *const names[] = {"a number", "an integer",          "true or false",
                                        "a text",   "an unsigned integer", "a name"};
    return names[type];
}

static MildStatus parse_text(const MildField *field, void *def, const char *text,
                             const char *section, MildError *error) {
    size_t length = strlen(text);
    if (length >= (size_t)field->count) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "%s.%s: the text has %zu characters, but at most %d fit", section,
                         field->name, length, field->count - 1);
    }
    memcpy((char *)def + field->offset, text, length + 1);
    return MILD_OK;
}

static MildStatus parse_name(const MildField *field, void *def, const char *text,
                             const char *section, MildError *error) {
    const int count = (int)field->max + 1, index = text_find(text, field->names, count);
    if (index < 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "%s.%s: unknown name '%.60s'; nearest is '%s'",
                         section, field->name, text, text_nearest(text, field->names, count));
    }
    memcpy((char *)def + field->offset, &index, sizeof index);
    return MILD_OK;
}

MildStatus mild_field_parse(const MildField *field, void *def, const char *text,
                            const char *section, MildError *error) {
    static const char separators[] = " \t\r\n,";
    if (field->type == MILD_FIELD_TEXT) {
        return parse_text(field, def, text, section, error);
    }
    if (field->type == MILD_FIELD_NAME) {
        return parse_name(field, def, text, section, error);
    }
    Value values[FIELD_VALUES_MAX];
    int count = 0;
    for (const char *at = text + strspn(text, separators); *at;
         at += strspn(at, separators), count++) {
        size_t length = strcspn(at, separators);
        if (count == field->count || count == FIELD_VALUES_MAX) {
            return mild_fail(error, MILD_ERROR_ARGUMENT, "%s.%s: more than %d values in '%s'",
                             section, field->name, field->count, text);
        }
        if (!parse_value(field->type, at, length, &values[count])) {
            return mild_fail(error, MILD_ERROR_ARGUMENT, "%s.%s: '%.*s' is not %s: %s", section,
                             field->name, (int)length, at, type_name(field->type), field->help);
        }
        MildStatus status = value_check(field, values[count], section, error);
        if (status != MILD_OK) {
            return status;
        }
        at += length;
    }
    if (count != field->count) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "%s.%s: %d of %d values in '%s'", section,
                         field->name, count, field->count, text);
    }
    size_t size = field_value_size(field->type);
    for (int i = 0; i < count; i++) {
        memcpy((char *)def + field->offset + (size_t)i * size, &values[i], size);
    }
    return MILD_OK;
}

static int print_value(MildFieldType type, Value value, char *text, size_t size) {
    switch (type) {
    case MILD_FIELD_DOUBLE:
        for (int digits = 6; digits < 17; digits++) { /* the shortest that reads back exactly */
            char shorter[40];
            snprintf(shorter, sizeof shorter, "%.*g", digits, value.number);
            if (strtod(shorter, NULL) == value.number) {
                return snprintf(text, size, "%s", shorter);
            }
        }
        return snprintf(text, size, "%.17g", value.number);
    case MILD_FIELD_UINT64: return snprintf(text, size, "%" PRIu64, value.unsigned64);
    case MILD_FIELD_BOOL: return snprintf(text, size, "%s", value.integer ? "true" : "false");
    case MILD_FIELD_INT:
    case MILD_FIELD_NAME:
    case MILD_FIELD_TEXT: break;
    }
    return snprintf(text, size, "%d", value.integer);
}

int mild_field_print(const MildField *field, const void *def, char *text, size_t size) {
    if (field->type == MILD_FIELD_TEXT) {
        return snprintf(text, size, "%s", (const char *)def + field->offset);
    }
    if (field->type == MILD_FIELD_NAME) {
        return snprintf(text, size, "%s", field->names[field_load(field, def, 0).integer]);
    }
    int total = 0;
    for (int i = 0; i < field->count; i++) {
        size_t used = (size_t)total < size ? (size_t)total : size;
        if (i > 0) {
            total += snprintf(text + used, size - used, " ");
            used = (size_t)total < size ? (size_t)total : size;
        }
        total += print_value(field->type, field_load(field, def, i), text + used, size - used);
    }
    return total;
}

const MildField *mild_field_find(const MildField *fields, int count, const char *name,
                                 const char **nearest) {
    const int i = text_nearest_of(name, &fields->name, sizeof *fields, count);
    if (nearest) {
        *nearest = i < 0 ? NULL : fields[i].name;
    }
    return i >= 0 && strcmp(fields[i].name, name) == 0 ? &fields[i] : NULL;
}
