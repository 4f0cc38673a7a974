/* Parameters of a ground from measured forces: bounded least squares on the element law, with
 * confidence intervals, and a verdict on the parameters that the data cannot determine.
 *
 * A level plate of n elements that goes down at speed w meets (eqs 4 and 5)
 *     F(u, w) = n (F_g(u) + c_d m_a'(u) w^2 + m_a(u) dw/dt).
 * F is linear in k_pen and sigma_cone. alpha and nu act through u_f = R tan(alpha)/nu and
 * sigma_cone/cos(alpha) alone as long as the drag is small. So slow data determine three numbers
 * and never all four. At constant speed the force depends only on the product c_g c_d. To determine
 * c_g alone takes a record that brakes, such as a drop. Pure functions: thread safe, print nothing.
 */
#ifndef LAB_FIT_H
#define LAB_FIT_H

#include "mild/ground.h"

typedef enum {
    FIT_K_PEN,
    FIT_SIGMA_CONE,
    FIT_ALPHA,
    FIT_NU,
    FIT_C_G,
    FIT_C_D,
    FIT_PARAMETERS
} FitName;

enum { FIT_POINTS_MIN = 8 };

/* One row of a record. time and speed may be NaN where unknown; fit_speeds fills speed and
 * acceleration. */
typedef struct {
    double time;         /* [s] */
    double depth;        /* [m] */
    double force;        /* [N] up, on the plate */
    double speed;        /* [m/s] down */
    double acceleration; /* [m/s^2] down */
} FitPoint;

typedef struct {
    MildMaterial material; /* starting values of fitted parameters, values of held ones */
    int elements;
    double pitch;             /* [m] */
    int free[FIT_PARAMETERS]; /* bool: fit it, if the data can determine it */
} FitDef;

/* Why a parameter has its value. */
typedef enum {
    FIT_HELD,      /* the caller did not ask to fit it */
    FIT_FITTED,    /* determined by the data, with an interval */
    FIT_NO_SPEEDS, /* c_g, c_d: all rows have about the same speed */
    FIT_NO_MASS,   /* c_d: no effect, because the ground has no added mass */
    FIT_NO_EFFECT, /* the forces do not depend on it in these data */
    FIT_TIED,      /* has the same effect as `partner`, see `correlation` */
    FIT_WIDE,      /* its interval is wider than half its range */
} FitState;

typedef struct {
    double value, low, high; /* 95 %; low and high are NaN unless FIT_FITTED */
    FitState state;
    FitName partner;    /* FIT_TIED */
    double correlation; /* FIT_TIED: of the two estimates; +-1: exactly the same effect */
} FitParameter;

typedef struct {
    FitParameter parameter[FIT_PARAMETERS];
    MildMaterial material; /* the fitted ground */
    double residual;       /* [N] root mean square */
    double residual_share; /* of the root mean square force */
    int points;
} FitResult;

extern const char *const fit_names[FIT_PARAMETERS];
double *fit_value(MildMaterial *material, FitName name);
/* Bounds of a parameter: those of the material. A passive material has c_d >= 1/2 and c_g >= 0. */
void fit_range(const MildMaterial *material, FitName name, double *low, double *high);

/* [N] The force on the plate. */
double fit_force(const FitDef *def, const FitPoint *point);

/* Keeps the loading part, in place: rows below the surface that are at least as deep as all rows
 * before them. Returns their count. */
int fit_loading(FitPoint *points, int count);
/* Fills unknown speeds and all accelerations from the times of one record's loading part. Each
 * comes from a polynomial through the nearest twentieth of the rows. Without times both are 0. */
void fit_speeds(FitPoint *points, int count);

/* Fits the loading rows of all records together. Fails on fewer than FIT_POINTS_MIN points, on
 * nothing to fit, and on a material out of range. */
MildStatus fit_run(const FitDef *def, const FitPoint *points, int count, FitResult *result,
                   MildError *error);

#endif
