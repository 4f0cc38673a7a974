/* Reads ini files and --section.key=value overrides into Def structs through their field tables.
 * Later sources win: struct defaults < default.ini < overlay file < overrides. Reading stops at the
 * first bad line. The message gives file, line, key and the nearest valid name. Values from earlier
 * lines remain set, so callers must give up after an error. */
#ifndef CONFIG_CONFIG_H
#define CONFIG_CONFIG_H

#include <stdio.h>

#include "mild/error.h"
#include "mild/field.h"

/* One section of a config: the keys are the fields of `def`. Names are unique. */
typedef struct {
    const char *name;
    const MildField *fields;
    int count;
    void *def;
} ConfigSection;

/* Reads a whole ini text. `name` is the file's name in messages. complete: every key of every
 * section must be present. */
MildStatus config_read_text(const ConfigSection *sections, int count, const char *text,
                            const char *name, int complete, MildError *error);
/* The same from a file of at most 1 MiB. */
MildStatus config_read(const ConfigSection *sections, int count, const char *path, int complete,
                       MildError *error);

/* Overrides: "section.key=value" (without the leading dashes). */
MildStatus config_overrides(const ConfigSection *sections, int count, const char *const *texts,
                            int text_count, MildError *error);

/* Prints a complete ini that reads back to the same values. comments: bool, print the help and
 * range of each key above it. */
void config_print(const ConfigSection *sections, int count, int comments, FILE *file);
/* The same as text, to be freed by the caller; NULL when out of memory. */
char *config_text(const ConfigSection *sections, int count, int comments);

#endif
