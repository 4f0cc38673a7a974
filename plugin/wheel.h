/* Private to the plugin: feet that turn, such as wheels and rollers. A sole is cut once, in the
 * pose of the file, and turns with its body; that of a wheel would soon be on top. */
#ifndef PLUGIN_WHEEL_H
#define PLUGIN_WHEEL_H

#include "plugin/foot.h"

/* Fails for a foot whose shapes are as high over the ground after a turn about a horizontal axis as
 * before, when a joint allows the turn: the axis is that of a hinge above the foot that turns by
 * more than 30 degrees, or of one of the shapes when their body moves freely. Round feet may. */
MildStatus wheel_check(const mjModel *m, const PluginDef *def, const Foot *foot, MildError *error);

#endif
