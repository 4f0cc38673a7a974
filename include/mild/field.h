/* One table per Def struct: it gives validation, config keys, help text and plugin attributes. */
#ifndef MILD_FIELD_H
#define MILD_FIELD_H

#include <stddef.h>

#include "mild/error.h"

MILD_API_BEGIN

typedef enum {
    MILD_FIELD_DOUBLE,
    MILD_FIELD_INT,
    MILD_FIELD_BOOL,
    MILD_FIELD_TEXT,
    MILD_FIELD_UINT64,
    MILD_FIELD_NAME
} MildFieldType;

/* BOOL is stored as int; TEXT as char[count]; NAME as int, the index of its name; the others as arrays of `count` values
 * (count 1 for a scalar). */
typedef struct {
    const char *name;
    MildFieldType type;
    size_t offset;
    int count;
    double min, max; /* inclusive; ignored for TEXT */
    const char *help; /* starts with the unit in brackets: "[N/m^3] ..." */
    const char *const *names; /* NAME: [max + 1]; otherwise NULL */
} MildField;

#define MILD_FIELD(Struct, member, type, count, min, max, help) \
    { #member, type, offsetof(Struct, member), count, min, max, help, NULL }
#define MILD_FIELD_CHOICE(Struct, member, names, count, help) \
    { #member, MILD_FIELD_NAME, offsetof(Struct, member), 1, 0, (count)-1, help, names }

/* Check every numeric field of `def` against its range and for NaN. `section` names the table in the message. */
MildStatus mild_fields_check(const MildField *fields, int count, const void *def, const char *section, MildError *error);

/* Parse `text` into the field of `def` (arrays: values separated by spaces or commas). Nothing is written on error. */
MildStatus mild_field_parse(const MildField *field, void *def, const char *text, const char *section, MildError *error);

/* Write the value of `field` as text that mild_field_parse reads back exactly. Returns snprintf's count. */
int mild_field_print(const MildField *field, const void *def, char *text, size_t size);

/* Field by name, or NULL; *nearest (may be NULL) receives the name with the smallest edit distance. */
const MildField *mild_field_find(const MildField *fields, int count, const char *name, const char **nearest);

MILD_API_END

#endif
