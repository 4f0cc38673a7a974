/* Private to the plugin: what the ground does to feet and bodies, as MuJoCo's sensor data. */
#ifndef PLUGIN_SENSOR_H
#define PLUGIN_SENSOR_H

#include "plugin/soft.h"

/* Numbers of a foot: force on it 3 [N], torque about the origin of its frame 3 [N m], centre of
 * pressure 3 [m], loaded area [m^2], largest and mean depth of the loaded elements [m]; means over
 * the step, world axes. All 0 in the air. */
#define SENSOR_NUMBERS 12

/* Writes them, foot after foot, then for each body, to every sensor of the instance. */
void sensor_write(const Soft *soft, const mjModel *m, mjData *d, int instance);

#endif
