/* A free body whose mass is spread evenly over a sole. */
#ifndef LAB_PRESS_BODY_H
#define LAB_PRESS_BODY_H

#include "mild/ground.h"

typedef struct {
    double mass;
    double center[3];  /* [m] centre of mass in the foot frame, from the ankle */
    double inertia[9]; /* [kg m^2] about it, foot frame */
    double inverse[9]; /* [1/(kg m^2)] */
} PressBody;

PressBody press_body(const MildSole *sole, double mass);

/* Fills A = J M^-1 J^T and the free twist at the ankle under gravity for foot 0 of `input`, from
 * its pose and twist. */
void press_body_free(const PressBody *body, double gravity, MildContactInput *input);

/* Moves foot 0 by dt at its new twist. */
void press_body_move(MildContactInput *input, const double *velocity);

#endif
