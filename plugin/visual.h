/* Private to the plugin: prints, soles, forces and uneven ground in the viewer. */
#ifndef PLUGIN_VISUAL_H
#define PLUGIN_VISUAL_H

#include "plugin/soft.h"

/* Adds flat patches where the ground is pressed down, darker where it is deeper, while the scene
 * has room; with the viewer's contact forces, an arrow for each foot; and uneven ground up to 2.5 m
 * from the feet, unless the model has a height field or static geoms are hidden. */
void visual_add(const Soft *soft, const mjModel *m, const mjData *d, const MildGround *ground,
                const mjvOption *option, mjvScene *scene);

#endif
