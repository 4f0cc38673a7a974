/* The labels of a map. */
#ifndef MILD_GROUND_PATTERN_H
#define MILD_GROUND_PATTERN_H

#include "ground/grid.h"

/* Fills labels, label and label_count of the map as `def` says. Fails when an image is missing,
 * when a number does not fit the others, when there are too many cells, and when out of memory. */
MildStatus pattern_fill(MildMap *map, const MildMapDef *def, MildError *error);

#endif
