/* Rows of a record, and the part of them that a fit uses. */
#ifndef LAB_FIT_RECORD_H
#define LAB_FIT_RECORD_H

enum { FIT_POINTS_MIN = 8 };

/* What the rows of a fit are. */
typedef enum {
    FIT_PRESS,  /* a plate on its way down */
    FIT_UNLOAD, /* a plate on its way up */
    FIT_SHEAR   /* a plate or ring that slides under load */
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
} FitPoint;

/* Keeps the loading part, in place: rows below the surface that are at least as deep as all rows
 * before them. Returns their count. */
int fit_loading(FitPoint *points, int count);
/* Copies the unloading part of a record to `back` [count]: the deepest row and the rows behind it
 * that are above the bottom, below the surface and no deeper than all since. Returns their count;
 * 0 when they are fewer than FIT_POINTS_MIN, or fast. */
int fit_unloading(const FitPoint *points, int count, FitPoint *back);
/* Fills unknown speeds and all accelerations from the times of one record's loading part. Each
 * comes from a polynomial through the nearest twentieth of the rows. Without times both are 0. */
void fit_speeds(FitPoint *points, int count);

#endif
