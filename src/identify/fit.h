/* Parameters of a ground from measured forces: those that the data determine, each with an
 * interval, and the names of the others.
 *
 * Nothing is held but what the caller holds. All other parameters that such rows can sense are
 * fitted together by bounded least squares. Where the data determine a combination of several and
 * none of them by itself, the combination is the result. An interval (95 %) is where the sum of
 * squares, minimised over all others, stays below a bound that allows rows of unequal noise. A
 * parameter without a bound on both sides within its range has no value. Pure functions: thread
 * safe, print nothing. */
#ifndef LAB_FIT_H
#define LAB_FIT_H

#include "identify/fit_law.h"

enum { FIT_COMBINATIONS_MAX = 4, FIT_PLATES_MAX = 16 };

typedef struct {
    FitKind kind; /* of the rows */
    FitPlate plate[FIT_PLATES_MAX];
    int plates;                   /* at least 1; each row names one of them */
    MildMaterial material;        /* the model, the numbers that are held, and bed_depth */
    int held[FIT_PARAMETERS_MAX]; /* bool, in the order of fit_parameters */
    const MildMaterial *fill;     /* where the data neither determine a parameter nor contradict
                                 this material's number, hold it there; NULL: do not */
} FitDef;

typedef enum {
    FIT_HELD,      /* by the caller; value */
    FIT_FILLED,    /* held at the number of `fill`, because the data leave it open; value */
    FIT_FITTED,    /* value, low, high */
    FIT_LIMIT,     /* the data bound it on one side: low or high is that bound, the other is NaN */
    FIT_OPEN,      /* the data do not bound it within its range */
    FIT_TIED,      /* the data determine it only together with others */
    FIT_NO_EFFECT, /* the forces in these rows do not depend on it */
} FitState;

typedef struct {
    const char *name;
    const MildField *field; /* NULL: a combination */
    char unit[24];
    FitState state;
    double value, low, high; /* NaN where the state names none; 95 % */
} FitValue;

typedef struct {
    FitValue parameter[FIT_PARAMETERS_MAX];
    int parameters;
    FitValue combination[FIT_COMBINATIONS_MAX]; /* of tied parameters */
    int combinations;
    MildMaterial curve;    /* gives the fitted forces; numbers of tied parameters mean nothing;
                              plate_width is 0 where the plates' widths differ */
    double residual;       /* [N], of FIT_SHEAR [N/m^2]: root mean square */
    double residual_share; /* of the root mean square force */
    double neighbours;     /* correlation of the residuals of neighbouring rows; 0 if by chance */
    double rows;           /* number of independent rows that they count as */
    int points;
} FitResult;

/* Fits the rows of all records together; of more than 20 000 the means of neighbours, which
 * is what `residual` is of then. Fails on fewer than FIT_POINTS_MIN points or not
 * more than parameters, on a model without soft ground, and on a material out of range. */
MildStatus fit_run(const FitDef *def, const FitPoint *points, int count, FitResult *result,
                   MildError *error);

#endif
