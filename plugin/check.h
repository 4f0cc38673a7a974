/* Private to the plugin: warnings about a model that compiles but will not do what is meant. */
#ifndef PLUGIN_CHECK_H
#define PLUGIN_CHECK_H

#include "plugin/soft.h"

/* Fails for a model that the plugin cannot serve: the integrator, flags, a second
 * instance. */
MildStatus check_model(const mjModel *m, int instance, MildError *error);
/* Writes one line about a foot that stands on MuJoCo's own contact as well, whose frame is not
 * upright in qpos0, or whose elements have another area than its sole. Returns 0 when there is
 * nothing to say. */
int check_feet(const mjModel *m, const Soft *soft, char *text, size_t size);
/* The same of a sensor of MuJoCo's on a foot, which feels nothing of this ground. */
int check_sensors(const mjModel *m, const Soft *soft, char *text, size_t size);
/* The same of a body of the robot that a rigid floor carried in the step just done. */
int check_rests(const mjModel *m, const mjData *d, const Soft *soft, char *text, size_t size);

#endif
