/* Tables of fields. Each struct of parameters has one. Validation, configuration keys and help text
 * are all derived from it. Thread safety: tables are constant and may be shared. The functions
 * access only their arguments. */
#ifndef MILD_FIELD_H
#define MILD_FIELD_H

#include <stddef.h>

#include "mild/error.h"

MILD_API_BEGIN

/* How a field is stored. */
typedef enum {
    MILD_FIELD_DOUBLE, /* double[count] */
    MILD_FIELD_INT,    /* int[count] */
    MILD_FIELD_BOOL,   /* int[count]; text: true false yes no on off 1 0 */
    MILD_FIELD_TEXT,   /* char[count], with the terminating 0 */
    MILD_FIELD_UINT64, /* uint64_t[count] */
    MILD_FIELD_NAME    /* int, an index into `names` */
} MildFieldType;

/* One member of a struct. */
typedef struct {
    const char *name;         /* of the member, and its configuration key */
    MildFieldType type;       /* how it is stored */
    size_t offset;            /* [bytes] from the start of the struct */
    int count;                /* values, 1 for a scalar; TEXT: bytes, with the terminating 0 */
    double min, max;          /* [the field's unit] inclusive limits; ignored for TEXT */
    const char *help;         /* starts with the unit in brackets: "[N/m^3] ..." */
    const char *const *names; /* NAME: [max + 1]; otherwise NULL */
} MildField;

/* A row of the table, e.g. MILD_FIELD(MildMaterial, mu, MILD_FIELD_DOUBLE, 1, 0, 2, "[-] friction
 * coefficient"). */
#define MILD_FIELD(Struct, member, type, count, min, max, help)                                    \
    { #member, type, offsetof(Struct, member), count, min, max, help, NULL }
/* A row for an enum that has `count` names. */
#define MILD_FIELD_CHOICE(Struct, member, names, count, help)                                      \
    { #member, MILD_FIELD_NAME, offsetof(Struct, member), 1, 0, (count)-1, help, names }

/* Checks that every field of the struct `def` is in its range; NaN is not. fields: [count]. Fails
 * with MILD_ERROR_RANGE at the first bad field: "section.name = value is outside min .. max: help".
 * A TEXT field fails when it has no terminating 0. */
MildStatus mild_fields_check(const MildField *fields, int count, const void *def,
                             const char *section, MildError *error);

/* Parses `text` into the field of the struct `def`. Array values are separated by spaces or commas.
 * Fails with MILD_ERROR_ARGUMENT when the text does not consist of `count` values of the type, and
 * with MILD_ERROR_RANGE when a value is out of range or a text too long. On failure nothing is
 * written. */
MildStatus mild_field_parse(const MildField *field, void *def, const char *text,
                            const char *section, MildError *error);

/* Writes the value of the field as text that mild_field_parse reads back exactly. text: [size].
 * Returns the length of the whole text, as snprintf does; if that is `size` or more, the text was
 * truncated. */
int mild_field_print(const MildField *field, const void *def, char *text, size_t size);

/* Finds a field by name. Returns NULL when there is none. *nearest (may be NULL) receives the name
 * with the smallest edit distance. fields: [count]. */
const MildField *mild_field_find(const MildField *fields, int count, const char *name,
                                 const char **nearest);

MILD_API_END

#endif
