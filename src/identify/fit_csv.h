/* Records of a plate or a ring as CSV: a header line, then numbers. */
#ifndef LAB_FIT_CSV_H
#define LAB_FIT_CSV_H

#include <stdio.h>

#include "identify/fit_record.h"
#include "mild/error.h"

enum { FIT_CSV_ROWS_MAX = 1000000 };

/* What a file is, by its columns. */
typedef enum {
    FIT_FILE_PRESS, /* depth_m, force_n; also time_s or speed_m_s, area_m2; where the plate slides
                       after it slip_m (or x_m, of `mild press`) and force_x_n */
    FIT_FILE_SHEAR, /* slip_m, shear_pa, pressure_pa */
    FIT_FILE_RING,  /* angle_rad, torque_nm, force_n: of a ring, as torque and load */
    FIT_FILES
} FitFileKind;

/* A file's rows. */
typedef struct {
    const char *path; /* as it was given */
    FitFileKind kind;
    FitPoint *points; /* [count] the loading part of a press, or rows of growing slip */
    int count;
    FitPoint *back; /* [back_count] the unloading part of a press, see fit_unloading */
    int back_count;
    FitPoint *slide; /* [slide_count] where the plate slides, see fit_sliding */
    int slide_count;
} FitFile;

/* Reads one record. Columns are found by name, in any order; others are ignored. Without times and
 * speeds the speed is 0. A ring's torque and load are its rows' `force` and `load` until
 * fit_file_ring. The message names file, line, column and remedy. Close the file, also after an
 * error. */
MildStatus fit_csv_read(const char *path, FitFile *file, MildError *error);
void fit_file_close(FitFile *file);

/* What is wrong with a plate's rows, as fit_csv_read says of a file's: a number beyond its column's
 * limit, forces that do not push back. The message names row `where:N`. */
MildStatus fit_rows_check(const char *where, const FitPoint *points, int count, MildError *error);
/* The same of the slide of fit_sliding, whose `slid` rows slide; NULL: nothing. along: bool, the
 * force along was measured. */
const char *fit_slide_wrong(const FitPoint *slide, int count, int slid, int along);

/* Torques and loads of a ring of these radii [m] become stresses. */
void fit_file_ring(FitFile *file, double outer, double inner);

#endif
