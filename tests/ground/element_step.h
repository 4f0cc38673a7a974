/* One step of one element in the scalar type of src/base/hd.h, with doubles outside. Included
 * by two files: once with Real = double, once with Real = float. */
#ifndef ELEMENT_STEP_H
#define ELEMENT_STEP_H

#define ELEMENT_LAW 13   /* numbers of Law */
#define ELEMENT_MEMORY 9 /* of ElementMemory */
/* Normal impulse, its slope; tangential impulse x y, its derivatives by the velocity xx xy yy, by
 * the normal impulse x y. */
#define ELEMENT_RESULTS 9

/* What a step of one element depends on. */
typedef struct {
    double law[ELEMENT_LAW];
    int curves;                    /* LawCurve bits of the loop: those of the law or more */
    double recovery;               /* [-] */
    double mu;                     /* [-] */
    double k_drift;                /* [N/m^2] */
    double b_drift;                /* [N s/m] */
    double explicit_impulse;       /* [N s] */
    double memory[ELEMENT_MEMORY]; /* before the step */
    double dt;                     /* [s] */
    double depth;                  /* [m] */
    double now;                    /* [m/s] downward speed */
    double gain;                   /* [m/s] what the free motion adds to it */
    double after[3];               /* [m/s] new velocity: x, y, down */
} ElementCase;

typedef struct {
    double value[ELEMENT_RESULTS];
    double memory[ELEMENT_MEMORY]; /* after the step */
    double yield_force;            /* [N] at the start */
    double unload_stiffness;       /* [N/m] at the start */
} ElementResult;

void element_step_double(const ElementCase *in, ElementResult *out);
void element_step_float(const ElementCase *in, ElementResult *out);

#endif
