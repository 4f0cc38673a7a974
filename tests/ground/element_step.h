/* One step of one element in the scalar type of src/ground/real.h, with doubles outside. Included by
 * two files: once with Real = double, once with Real = float. */
#ifndef ELEMENT_STEP_H
#define ELEMENT_STEP_H

#define ELEMENT_LAW 13    /* numbers of Law */
#define ELEMENT_MEMORY 9  /* of ElementMemory */
#define ELEMENT_RESULTS 7 /* normal, its slope, tangent x y, its derivatives xx xy yy */

/* What a step of one element depends on. */
typedef struct {
    double law[ELEMENT_LAW];
    int curves;                            /* LawCurve bits of the loop: those of the law or more */
    double recovery, mu, k_drift, b_drift; /* of the material */
    double memory[ELEMENT_MEMORY];         /* before the step */
    double dt;                             /* [s] */
    double depth;                          /* [m] */
    double now, gain;                      /* [m/s] downward speed, what the free motion adds */
    double after[3];                       /* [m/s] new velocity: x, y, down */
} ElementCase;

typedef struct {
    double value[ELEMENT_RESULTS];
    double memory[ELEMENT_MEMORY]; /* after the step */
    double yield_force;            /* [N] at the start */
} ElementResult;

void element_step_double(const ElementCase *in, ElementResult *out);
void element_step_float(const ElementCase *in, ElementResult *out);

#endif
