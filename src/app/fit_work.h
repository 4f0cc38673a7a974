/* What the files of `mild fit` share: the records, and a fit for each kind of rows. */
#ifndef APP_FIT_WORK_H
#define APP_FIT_WORK_H

#include "app/cli.h"
#include "identify/fit.h"
#include "identify/fit_csv.h"
#include "mild/error.h"

enum { FIT_KINDS = 4, FIT_FIELDS_MAX = 64 };

/* The rows of a kind, and what they determine. */
typedef struct {
    FitDef def;
    FitPoint *points; /* [count] */
    int count;
    int files;        /* that have such rows */
    FitResult result; /* of a fit that was made */
    int done;         /* bool: it was made */
} FitSet;

typedef struct {
    FitFile file[CLI_LIST_MAX];
    int files;
    FitSet set[FIT_KINDS];    /* by FitKind */
    MildMaterial material;    /* the model, and what is held */
    MildMaterial preset;      /* of --hold-from */
    const char *from;         /* its name; NULL: none */
    int held[FIT_FIELDS_MAX]; /* bool, in the order of mild_material_fields: by --hold or --fit */
    int bed;                  /* bool: bed_depth is held */
} FitWork;

/* ---- fit_print.c ---- */

/* The table, and what it rests on, to standard output. */
void fit_print(const FitWork *work);
MildStatus fit_json_save(const FitWork *work, const char *path, MildError *error);
/* The numbers of the picture of presses. */
MildStatus fit_numbers_save(const FitWork *work, const char *path, MildError *error);
/* "residual 3.1 N, 0.6 % of the force ...", a line for each kind that was fitted. */
const char *fit_residual_text(const FitWork *work, FitKind kind, char *text, size_t size);

/* ---- fit_soil.c ---- */

/* Writes the ground as a soil's file. Fails, naming them, when the records, --hold and --hold-from
 * leave numbers of the model unknown. command: the command line, for its head. */
MildStatus fit_soil_save(const FitWork *work, const char *command, const char *path,
                         MildError *error);

/* ---- fit_walk.c: of a robot's log, what its ground was ---- */

/* Prints the posterior, and each change of ground on the way. json: NULL: none. */
MildStatus fit_walk(const char *path, int trial, const char *json, MildError *error);

#endif
