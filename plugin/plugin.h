/* Private to the plugin: its registration, and the way into it for tests. */
#ifndef PLUGIN_PLUGIN_H
#define PLUGIN_PLUGIN_H

#include "plugin/soft.h"

/* Registers the plugin with MuJoCo. The shared library does so when it is loaded (library.c). */
void plugin_register(void);
/* The ground of the model's instance in this mjData; NULL when the model has none. */
const Soft *plugin_soft(const mjModel *m, const mjData *d);

/* As live.h, of the instance of this name, or of the only one (NULL). d: one of this model, between
 * two steps. What is wrong is a line in error[size], and the result then negative. Python's
 * mild.ground calls them. */
int plugin_ground_print(const mjModel *m, const mjData *d, const char *name, int label, char *text,
                        int size);
int plugin_ground_change(const mjModel *m, mjData *d, const char *name, int label, const char *text,
                         char *error, int size);

#endif
