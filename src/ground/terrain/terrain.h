/* Queries that the contact step makes of a terrain. */
#ifndef MILD_GROUND_TERRAIN_H
#define MILD_GROUND_TERRAIN_H

#include "mild/ground.h"

/* Bool: the height is the same everywhere. */
int terrain_is_level(const MildTerrain *terrain);
/* Bool: material 0 everywhere. */
int terrain_is_uniform(const MildTerrain *terrain);
/* [-] Upper bound on the length of the gradient. */
double terrain_steepest(const MildTerrain *terrain);
/* Height [m] and gradient [-] of the ground under a point. */
double terrain_surface(const MildTerrain *terrain, double x, double y, double slope[2]);
/* The material under a point, encoded as in Memory (state.h). */
int32_t terrain_mixture(const MildTerrain *terrain, double x, double y);

#endif
