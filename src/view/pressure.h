/* Sole pressure of a walk: mean and peak per element and the path of the centre of pressure over a
 * stance, for each foot and each material walked on. Written as CSV; scripts/draw.py draws it.
 */
#ifndef VIEW_PRESSURE_H
#define VIEW_PRESSURE_H

#include "robot/robot.h"

#define PRESSURE_PATH 51 /* points of the path: 0, 2, .. 100 % of the stance */

typedef struct Pressure Pressure;

/* materials: how many the terrain has; dt: [s] between observations. */
Pressure *pressure_create(const Robot *robot, int materials, double dt, MildError *error);
void pressure_destroy(Pressure *pressure);
/* Call after every physics step; a few hundred additions. The material is that under the middle of
 * the sole. */
void pressure_observe(Pressure *pressure, const RobotSim *sim, const MildTerrain *terrain);
/* Stances that began and ended on the material, both feet. */
int pressure_stances(const Pressure *pressure, int material);
/* Columns ground,foot,what,index,x_m,y_m,mean_kpa,peak_kpa. what = element: index of the element,
 * position in the foot frame; what = path: index in percent of the stance, position of the centre
 * of pressure. Written under a temporary name, then renamed. names: [materials]. */
MildStatus pressure_write(const Pressure *pressure, const char *path, const char *const *names,
                          MildError *error);

#endif
