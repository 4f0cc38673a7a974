/* The heights of a map. */
#ifndef MILD_GROUND_SHAPE_H
#define MILD_GROUND_SHAPE_H

#include "ground/grid.h"

/* Fills heights, height and slope of the map as `def` says. Fails when an image is missing or has a
 * value that is not usable, when there are too many points, and when out of memory. */
MildStatus shape_fill(MildMap *map, const MildMapDef *def, MildError *error);

#endif
