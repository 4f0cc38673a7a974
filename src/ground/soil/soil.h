/* Grounds by name: a preset, or a file that a hand or `mild fit --soil` wrote (docs/soil.md).
 *
 * A soil file is the section [ground] of a configuration: the keys are the fields of MildMaterial.
 * `preset = NAME` gives what the file does not say. Without it every number that the model reads
 * must be there, but for those whose default is 0, which are terms that are off. */
#ifndef MILD_SOIL_H
#define MILD_SOIL_H

#include "mild/ground.h"

enum { SOIL_BYTES_MAX = 1 << 16 }; /* of a file */

/* Bool: a ground's name is that of a file, because it ends in ".ini". */
int soil_is_file(const char *name);

/* The material of a preset. The message names the nearest one. */
MildStatus soil_preset(const char *name, MildMaterial *material, MildError *error);

/* The material of a preset or a file, checked. The message names the nearest preset, or file, line,
 * key and remedy. `rigid` is not a material. */
MildStatus soil_find(const char *name, MildMaterial *material, MildError *error);

/* Reads the text of a file. `name` is the file's in messages. On failure *material is left
 * alone. */
MildStatus soil_parse(const char *text, const char *name, MildMaterial *material, MildError *error);

/* What a written soil says beside its numbers. */
typedef struct {
    const char *head;  /* lines of remarks at the top; NULL: none */
    const char **note; /* [mild_material_field_count] a line above each number; NULL: none */
} SoilNotes;

/* The text of a soil file that reads back to the same numbers, bit for bit: all that the model
 * reads. notes: NULL: none. To be freed by the caller; NULL when out of memory. */
char *soil_text(const MildMaterial *material, const SoilNotes *notes);

/* Writes it, completely or not at all. Fails on a material that is out of range. */
MildStatus soil_write(const MildMaterial *material, const SoilNotes *notes, const char *path,
                      MildError *error);

/* Bool: the model of the material reads the field. */
int soil_reads(const MildMaterial *material, const MildField *field);

#endif
