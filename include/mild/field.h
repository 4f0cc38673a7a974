/* One table per Def struct: it gives validation, config keys, help text and plugin attributes.
 * Thread safety: tables are constant and may be shared; the functions touch nothing but their
 * arguments. */
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
    MILD_FIELD_TEXT,   /* char[count] with its end */
    MILD_FIELD_UINT64, /* uint64_t[count] */
    MILD_FIELD_NAME    /* int, the index of its name */
} MildFieldType;

/* One member of a Def struct. */
typedef struct {
    const char *name;         /* the member's, and the config's key */
    MildFieldType type;       /* how it is stored */
    size_t offset;            /* [bytes] from the start of the struct */
    int count;                /* values, 1 for a scalar; TEXT: characters that fit, with the end */
    double min, max;          /* [the field's unit] inclusive; ignored for TEXT */
    const char *help;         /* starts with the unit in brackets: "[N/m^3] ..." */
    const char *const *names; /* NAME: [max + 1]; otherwise NULL */
} MildField;

/* A row of the table, e.g. MILD_FIELD(MildMaterial, mu, MILD_FIELD_DOUBLE, 1, 0, 2, "[-] friction
 * coefficient"). */
#define MILD_FIELD(Struct, member, type, count, min, max, help)                                    \
    { #member, type, offsetof(Struct, member), count, min, max, help, NULL }
/* A row for an enum with the `count` names. */
#define MILD_FIELD_CHOICE(Struct, member, names, count, help)                                      \
    { #member, MILD_FIELD_NAME, offsetof(Struct, member), 1, 0, (count)-1, help, names }

/* Check every numeric field of `def` against its range and for NaN, in the table's order. `section`
 * names the table in the message. Fails with MILD_ERROR_RANGE at the first that is outside:
 * "section.name = value is outside min .. max: help". */
MildStatus mild_fields_check(const MildField *fields, int count, const void *def,
                             const char *section, MildError *error);

/* Parse `text` into the field of `def` (arrays: values separated by spaces or commas). Fails, with
 * nothing written, with MILD_ERROR_ARGUMENT when it is not `count` values of the type, with
 * MILD_ERROR_RANGE when one is outside its range. */
MildStatus mild_field_parse(const MildField *field, void *def, const char *text,
                            const char *section, MildError *error);

/* Write the value of `field` as text that mild_field_parse reads back exactly. text: [size].
 * Returns snprintf's count: from `size` on it was cut. */
int mild_field_print(const MildField *field, const void *def, char *text, size_t size);

/* Field by name, or NULL; *nearest (may be NULL) receives the name with the smallest edit distance.
 * fields: [count]. */
const MildField *mild_field_find(const MildField *fields, int count, const char *name,
                                 const char **nearest);

MILD_API_END

#endif
