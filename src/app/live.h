/* The ground of a walk that keys change while it goes on: another preset, friction, stiffness. */
#ifndef MILD_LIVE_H
#define MILD_LIVE_H

#include <stddef.h>

#include "mild/ground.h"
#include "view/window.h"

typedef struct {
    MildTerrain terrain;                       /* as it is now; its map is borrowed */
    MildMaterial original[MILD_MATERIALS_MAX]; /* the materials as they were at first */
    int presets; /* the last so many materials of the terrain wait for the keys 1, 2, ... */
} Live;

/* presets: how many of the terrain's last materials no point has yet. */
Live live_begin(const MildTerrain *terrain, int presets);

/* Does what the keys ask for. material: that under the robot. A preset lies everywhere from then
 * on, with its own numbers; a loaded element keeps the material that it touched down on, so a
 * foot meets it at its next step. Friction and stiffness change at once, by a tenth a key, within
 * the range of a material. Stiffness is k_pen and sigma_cone, or what mild_model_match scales.
 * Returns whether another ground lies there. */
int live_take(Live *live, int material, const WindowInput *input);

/* Gives the ground to an episode's terrain, whose place on the map remains. */
void live_apply(const Live *live, MildTerrain *terrain);

/* "friction 0.60 (F V), k_pen 380 (K M)"; returns `text`. */
const char *live_describe(const Live *live, int material, char *text, size_t size);

#endif
