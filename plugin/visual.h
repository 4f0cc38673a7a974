/* Private to the plugin: prints, soles and forces in the viewer. */
#ifndef PLUGIN_VISUAL_H
#define PLUGIN_VISUAL_H

#include "plugin/soft.h"

/* Adds flat patches where the ground is pressed down, darker where it is deeper, while the scene
 * has room; and, with the viewer's contact forces, an arrow for each foot. */
void visual_add(const Soft *soft, const mjModel *m, const MildGround *ground,
                const mjvOption *option, mjvScene *scene);

#endif
