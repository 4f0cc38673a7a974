/* Bounded least squares in a few coordinates of a material, and the interval of each by the profile
 * of the sum of squares. */
#ifndef LAB_FIT_SOLVE_H
#define LAB_FIT_SOLVE_H

#include "identify/fit_law.h"

/* [-] A column whose own part is below this share of it is a combination of the others. */
#define FIT_DEPENDENT 1e-5

/* A number that is fitted: a parameter, or a combination in its place. */
typedef struct {
    const MildField *field;
    const FitCombination *combination; /* NULL: the parameter itself */
    double low, high;                  /* range of the search */
} FitCoordinate;

typedef struct {
    FitKind kind; /* of the points */
    const FitPlate *plates;
    const FitPoint *points;
    int count;
    MildMaterial base; /* all that is not a coordinate */
    FitCoordinate coordinate[FIT_PARAMETERS_MAX];
    int coordinates;
    double value[FIT_PARAMETERS_MAX]; /* present estimate */
    int fixed;                        /* coordinate that does not move; -1: none */
    double *miss;                     /* [count] [N] measured minus computed force */
    double *column;                   /* [coordinates][count] dF/dcoordinate */
    double *own;      /* [count] part of a column that is orthogonal to the other columns */
    double *basis;    /* [coordinates][count] for orthogonalisation */
    double *leverage; /* [count] influence of a row on its own fitted value, 0 .. 1 */

    /* of the minimum */
    double least;      /* [N^2] sum of squares */
    double *residual;  /* [count] [N] */
    double neighbours; /* correlation of neighbouring residuals; 0 if it may be chance */
    double rows;       /* independent rows that the rows count as */
} Fit;

typedef struct {
    double low, high;        /* 95 %; an end of the range where it is open */
    int open_low, open_high; /* bool: the data do not bound it within its range */
} FitInterval;

/* Allocates the arrays for `count` rows and up to `parameters` coordinates; 0: out of memory. */
int fit_open(Fit *fit, int parameters);
void fit_close(Fit *fit);

/* The material of the present estimate. */
MildMaterial fit_material(const Fit *fit);
/* Sets the present estimate to the numbers of a material. */
void fit_start(Fit *fit, const MildMaterial *material);
/* dF/dcoordinate of all coordinates at the present estimate. */
void fit_columns(Fit *fit);
/* Fills own and leverage for a coordinate; returns |own|/|column|, 0 without any effect. */
double fit_own(Fit *fit, int coordinate);

/* Minimises the sum of squares from several starts, and fills what belongs to the minimum. */
void fit_minimise(Fit *fit);
/* The interval of a coordinate; call it at the minimum, which it leaves as it is. Returns 0 when it
 * met a lower sum of squares, which is the present estimate then. */
int fit_interval(Fit *fit, int coordinate, FitInterval *interval);

#endif
