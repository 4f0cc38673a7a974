/* Private to the plugin: the ground, what presses it, and forces in the viewer. */
#ifndef PLUGIN_VISUAL_H
#define PLUGIN_VISUAL_H

#include "plugin/soft.h"

/* Draws the ground, dented where it is pressed, up to 2.5 m from the feet and, where it is level,
 * as plain plates beyond: if the instance asks for it by `surface`, or it is uneven and no height
 * field of the model stands for it; not while static geoms are hidden. Otherwise flat patches show
 * on the model's own floor where the ground is pressed. Pressed ground is darker, and has the
 * colour of its material. With the viewer's contact forces, an arrow for each foot. All this while
 * the scene has room. */
void visual_add(const Soft *soft, const mjModel *m, const mjData *d, const MildGround *ground,
                const mjvOption *option, mjvScene *scene);

/* The colour of a preset by its name, of other materials (name: NULL) by how they spring back. */
void visual_colour(const char *name, const MildMaterial *material, float rgb[3]);

#endif
