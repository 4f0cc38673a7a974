/* The shape of the ground under a robot, for measures and for rigid ground. Points count from the
 * base's origin, so that float loses nothing far from the world's. */
#ifndef MILD_ENGINE_GROUND_H
#define MILD_ENGINE_GROUND_H

#include "ground/terrain/map_view.h"
#include "robot/engine/data.h"

typedef struct {
    const MapView *map;     /* NULL: level */
    const Real *map_origin; /* [2] [m] world position of the map's origin; NULL: 0 */
    Real height;            /* [m] added to the map's */
} EngineGround;

/* The surface at a point. */
typedef struct {
    Real height;   /* [m] world */
    Real slope[2]; /* [-] along world x and y */
} EngineSurface;

/* A base [m] on the map, to be handed to surface_under. */
MILD_HD MapSpot base_spot(const EngineGround *ground, const Real *base) {
    MapSpot none = {{0, 0}, {0, 0}, {0, 0}, {0, 0}, 0};
    return ground->map ? map_spot(ground->map, base, ground->map_origin, ground->height) : none;
}

/* x, y: [m] from the base, world axes. */
MILD_HD EngineSurface surface_under(const EngineGround *ground, const Real *base,
                                    const MapSpot *spot, Real x, Real y) {
    EngineSurface surface = {ground->height, {0, 0}};
    if (ground->map) {
        surface.height = base[2] + map_surface_near(ground->map, spot, x, y, surface.slope);
    }
    return surface;
}

/* The same of the base's origin. */
MILD_HD MapSpot engine_spot(const EngineGround *ground, const EngineWork *work) {
    return base_spot(ground, work->base);
}

MILD_HD EngineSurface engine_surface(const EngineGround *ground, const EngineWork *work,
                                     const MapSpot *spot, Real x, Real y) {
    return surface_under(ground, work->base, spot, x, y);
}

#endif
