/* The labels of a map. */
#ifndef MILD_GROUND_PATTERN_H
#define MILD_GROUND_PATTERN_H

#include "ground/terrain/grid.h"

/* Fills the map's labels, label and label_count from `def`. Fails when an image is missing, when
 * numbers contradict each other, when there are too many cells, or when out of memory. */
MildStatus pattern_fill(MildMap *map, const MildMapDef *def, MildError *error);

#endif
