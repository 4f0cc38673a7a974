/* Moments of the derivatives of a pass, in the frame of the foot. */
#ifndef MILD_GROUND_MOMENTS_H
#define MILD_GROUND_MOMENTS_H

#include "ground/step/slots.h"

/* sums[k]: of the lanes of lanes[k], in their order. */
void lanes_sum(const Lanes *lanes, int count, double *sums);

/* Sums over slots of each of a, b and c times 1, x, y, x^2, xy, y^2. The arrays are those of the
 * first block of slots. Three at a time are as many sums as the registers hold. end: slots, rounded
 * up to whole blocks. */
void moments(const Real *xs, const Real *ys, int end, const Real *a, const Real *b, const Real *c,
             double sums[3][6]);

#endif
