/* The normal impulse of one slot, for sweeps over the elements. */
#ifndef MILD_GROUND_SLOT_IMPULSE_H
#define MILD_GROUND_SLOT_IMPULSE_H

#include "ground/law/impulse.h"
#include "ground/step/slots.h"

/* At the downward speed w. curves: of the ground under the foot. */
Impulse slot_impulse(const Slots *s, int i, int curves, double dt, double w);

#endif
