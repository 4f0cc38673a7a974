/* What libmild_batch calls of the ground beside its public headers. libmild exports these functions
 * but they are no part of its interface: both libraries are of one version. */
#ifndef MILD_GROUND_INSIDE_H
#define MILD_GROUND_INSIDE_H

#include "ground/law/share.h"
#include "ground/sole/sole.h"
#include "ground/step/state.h"
#include "ground/terrain/map_view.h"

/* The law of a material under one element. */
typedef struct {
    Law law;
    Share share;     /* the material's numbers of it */
    double recovery; /* [-] */
    double k_drift;  /* [N/m^2] */
    double b_drift;  /* [N s/m] */
    int curves;      /* LawCurve and LawMotion bits */
} InsideLaw;

MILD_API_BEGIN

/* pitch: [m] edge of the element. width: [m] shorter side of the sole. */
InsideLaw mild_inside_law(const MildMaterial *material, double pitch, double width);
/* See sole_heap. */
SoleHeap mild_inside_heap(const MildSole *sole, int element);
/* See ground_memory. */
Memory mild_inside_memory(const MildGround *ground, int foot);
/* See map_view. */
MapView mild_inside_map(const MildMap *map);

MILD_API_END

#endif
