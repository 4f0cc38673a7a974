/* Rows of a recorded press, and the part of them that a fit uses. */
#ifndef LAB_FIT_RECORD_H
#define LAB_FIT_RECORD_H

enum { FIT_POINTS_MIN = 8 };

/* One row of a record. time and speed may be NaN where unknown; fit_speeds fills speed and
 * acceleration. */
typedef struct {
    double time;         /* [s] */
    double depth;        /* [m] */
    double force;        /* [N] up, on the plate */
    double speed;        /* [m/s] down */
    double acceleration; /* [m/s^2] down */
    int plate;           /* number of its plate among those of the fit */
} FitPoint;

/* Keeps the loading part, in place: rows below the surface that are at least as deep as all rows
 * before them. Returns their count. */
int fit_loading(FitPoint *points, int count);
/* Fills unknown speeds and all accelerations from the times of one record's loading part. Each
 * comes from a polynomial through the nearest twentieth of the rows. Without times both are 0. */
void fit_speeds(FitPoint *points, int count);

#endif
