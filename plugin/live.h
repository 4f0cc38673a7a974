/* Private to the plugin: the ground of an mjData changes while it runs. */
#ifndef PLUGIN_LIVE_H
#define PLUGIN_LIVE_H

#include "plugin/soft.h"

/* Writes the material of a label of the pattern (0: of ground without one) as lines KEY=VALUE, keys
 * as in section [ground]. text: [size]. Returns its length, which may be size or more: then it was
 * cut off; -1 without such a material. */
int live_print(const Soft *soft, int label, char *text, int size);
/* Puts the material of such lines in its place, from the next step on, and re-expresses in it what
 * the ground remembers (mild_ground_change). Lines that are missing keep their numbers; name=PRESET
 * chooses the colour. One of `mild` or `mild_merged` is matched to ground.model; without that key
 * it keeps its law. On failure nothing has changed. ground: NULL: it remembers nothing. */
MildStatus live_change(Soft *soft, const mjModel *m, MildGround *ground, int label,
                       const char *text, MildError *error);

#endif
