/* Queries that a terrain makes of its map. */
#ifndef MILD_GROUND_MAP_H
#define MILD_GROUND_MAP_H

#include "ground/terrain/grid.h"

/* Height [m] and gradient [-] at a point of the map. */
double map_surface(const MildMap *map, double x, double y, double slope[2]);
/* Label at a point of the map. */
Label map_label(const MildMap *map, double x, double y);

#endif
