/* Writes a result completely or not at all. */
#ifndef MILD_REPORT_H
#define MILD_REPORT_H

#include <cjson/cJSON.h>
#include <stdio.h>

#include "mild/error.h"

/* A text of `size` bytes. path "-": stdout. */
MildStatus report_text(const char *text, size_t size, const char *path, MildError *error);

/* A text that is printed to memory first. Zero: not opened. */
typedef struct {
    FILE *file;
    char *text;
    size_t size; /* of the text, once closed */
} Sheet;

MildStatus sheet_open(Sheet *sheet, MildError *error);
/* Writes it, as report_text does, if all went well so far (status). One that was not opened is
 * left. */
MildStatus sheet_close(Sheet *sheet, const char *path, MildStatus status, MildError *error);

/* JSON. Takes ownership of `root`; NULL means that memory ran out while it was built. path "-":
 * stdout. */
MildStatus report_save(cJSON *root, const char *path, MildError *error);

/* ---- a Python script draws the figures from CSV files that the program writes ---- */

/* Runs scripts/draw.py by package_python, with the arguments `kind` ("fit"), `data`, `picture` and,
 * unless it is NULL, `title`. */
MildStatus figure_draw(const char *kind, const char *data, const char *picture, const char *title,
                       MildError *error);

#endif
