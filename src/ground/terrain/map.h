/* A map: queries that a terrain makes of it, and what fills it. */
#ifndef MILD_GROUND_MAP_H
#define MILD_GROUND_MAP_H

#include "ground/terrain/grid.h"

/* Height [m] and gradient [-] at a point of the map. */
double map_surface(const MildMap *map, double x, double y, double slope[2]);
/* Label at a point of the map. */
Label map_label(const MildMap *map, double x, double y);

/* Fills the map's labels, label and label_count from `def`. Fails when an image is missing, when
 * numbers contradict each other, when there are too many cells, or when out of memory. */
MildStatus pattern_fill(MildMap *map, const MildMapDef *def, MildError *error);

/* Fills the map's heights, height and slope from `def`. Fails when an image is missing or contains
 * an unusable value, when there are too many points, or when out of memory. */
MildStatus shape_fill(MildMap *map, const MildMapDef *def, MildError *error);

#endif
