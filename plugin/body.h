/* Private to the plugin: bodies that touch the ground with any side, such as shins, trunk or wheels
 * (docs/model.md section 20). */
#ifndef PLUGIN_BODY_H
#define PLUGIN_BODY_H

#include "plugin/foot.h"

/* Covers the shapes of a body with elements. pitch: [m] of the ground's law, that of the feet.
 * compiling: as for feet_create; a body with meshes then gets elements enough for the room that
 * their bounding boxes may need. */
MildStatus body_shell(const mjModel *m, const PluginDef *def, double pitch, int compiling,
                      Foot *foot, MildError *error);

#endif
