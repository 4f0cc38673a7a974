/* Rows of a record, and the part of them that a fit uses. */
#ifndef LAB_FIT_RECORD_H
#define LAB_FIT_RECORD_H

#include "mild/ground.h"

enum { FIT_POINTS_MIN = 8 };

/* A plate, in the elements of its model, or a ring. bekker asks for a pressure on an area, which
 * the elements of a raster have only about; the other models for the force of each element. */
typedef struct {
    int elements;
    double pitch;         /* [m] */
    double width;         /* [m] its shorter side, of a disc the radius: plate_width of bekker */
    const MildSole *sole; /* borrowed, for mild_merged; NULL: every element is a disc by itself */
    double area;          /* [m^2] 0: that of the elements */
    double outer, inner;  /* [m] radii of a ring that turns; 0: what slides does not turn */
} FitPlate;

/* What the rows of a fit are. */
typedef enum {
    FIT_PRESS,  /* a plate on its way down */
    FIT_UNLOAD, /* a plate on its way up */
    FIT_SHEAR,  /* a plate or ring that slides under load, as stresses */
    FIT_DRAG    /* a plate that slides where slip costs support, fit_law.h */
} FitKind;

/* One row of a record. time and speed may be NaN where unknown; fit_speeds fills speed and
 * acceleration. Of a FIT_SHEAR row, stresses are means over the plate or ring. */
typedef struct {
    double time;         /* [s] */
    double depth;        /* [m]; FIT_SHEAR: the slip, of a ring the angle [rad] */
    double force;        /* [N] up, on the plate; FIT_SHEAR: shear stress [N/m^2] */
    double speed;        /* [m/s] down */
    double acceleration; /* [m/s^2] down */
    int plate;           /* number of its plate among those of the fit */
    double area;         /* [m^2] that the force acts on; 0: the plate's */
    double load;         /* FIT_UNLOAD: greatest depth before [m]; FIT_SHEAR: pressure [N/m^2] */

    /* of a plate that slides; speed and acceleration are of no use there */
    double slip;   /* [m] way along; NaN where unknown */
    double along;  /* [N] along the way, on the plate; of what fit_sliding gives, against it */
    int holds;     /* bool, FIT_DRAG: the row's force is the one along, else the one up, times .. */
    double weight; /* [-] by which its error counts */
    double virgin; /* [N] what the plate would carry there without slip */
    double near;   /* [N] what it carries: mean of the rows around it */
} FitPoint;

/* Keeps the loading part, in place: rows below the surface that are at least as deep as all rows
 * before them. Returns their count. */
int fit_loading(FitPoint *points, int count);
/* Copies the unloading part of a record to `back` [count]: the deepest row and the rows behind it
 * that are above the bottom, below the surface and no deeper than all since. Returns their count;
 * 0 when they are fewer than FIT_POINTS_MIN, or fast. */
int fit_unloading(const FitPoint *points, int count, FitPoint *back);
/* Takes a slide out of a record: copies to `slide` [*count] the rows of growing slip up to the
 * longest, and before them, with the slip 0, those of the press from 80 % of its depth on; *count
 * becomes the number of rows before the slip. Returns how many rows slide; 0 where none goes 1 mm.
 * *slides: the number of rows copied. */
int fit_sliding(const FitPoint *points, int *count, FitPoint *slide, int *slides);
/* Fills unknown speeds and all accelerations from the times of one record's loading part. Each
 * comes from a polynomial through the nearest twentieth of the rows. Without times both are 0. */
void fit_speeds(FitPoint *points, int count);

/* ---- inverse of a small matrix, for normal equations ---- */

enum { INVERSE_MAX = 20 };

/* Inverse of the positive definite `a` (rows and columns 0 .. n - 1), which is destroyed. Returns
 * 0 when it is singular. */
int inverse_find(double a[INVERSE_MAX][INVERSE_MAX], int n,
                 double inverse[INVERSE_MAX][INVERSE_MAX]);

#endif
