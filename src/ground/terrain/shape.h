/* The heights of a map. */
#ifndef MILD_GROUND_SHAPE_H
#define MILD_GROUND_SHAPE_H

#include "ground/terrain/grid.h"

/* Fills the map's heights, height and slope from `def`. Fails when an image is missing or contains
 * an unusable value, when there are too many points, or when out of memory. */
MildStatus shape_fill(MildMap *map, const MildMapDef *def, MildError *error);

#endif
