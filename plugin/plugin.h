/* Private to the plugin: its registration, and the way into it for tests. */
#ifndef PLUGIN_PLUGIN_H
#define PLUGIN_PLUGIN_H

#include "plugin/soft.h"

/* Registers the plugin with MuJoCo. The shared library does so when it is loaded (library.c). */
void plugin_register(void);
/* The ground of the model's instance in this mjData; NULL when the model has none. */
const Soft *plugin_soft(const mjModel *m, const mjData *d);

#endif
