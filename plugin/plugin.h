/* Private to the plugin: its registration, the way into it for tests, and what it calls at each of
 * MuJoCo's stages. */
#ifndef PLUGIN_PLUGIN_H
#define PLUGIN_PLUGIN_H

#include "plugin/soft.h"

/* Registers the plugin with MuJoCo. The shared library does so when it is loaded (library.c). */
void plugin_register(void);
/* The ground of the model's instance in this mjData; NULL when the model has none. */
const Soft *plugin_soft(const mjModel *m, const mjData *d);

/* As live_print and live_change, of the instance of this name, or of the only one (NULL). d: one of
 * this model, between two steps. What is wrong is a line in error[size], and the result then
 * negative. Python's mild.ground calls them. */
int plugin_ground_print(const mjModel *m, const mjData *d, const char *name, int label, char *text,
                        int size);
int plugin_ground_change(const mjModel *m, mjData *d, const char *name, int label, const char *text,
                         char *error, int size);

/* ---- check.c: warnings about a model that compiles but will not do what is meant ---- */

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

/* ---- live.c: the ground of an mjData changes while it runs ---- */

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

/* ---- what the ground does to feet and bodies, as MuJoCo's sensor data ---- */

/* Numbers of a foot: force on it 3 [N], torque about the origin of its frame 3 [N m], centre of
 * pressure 3 [m], loaded area [m^2], largest and mean depth of the loaded elements [m]; means over
 * the step, world axes. All 0 in the air. */
#define SENSOR_NUMBERS 12

/* Writes them, foot after foot, then for each body, to every sensor of the instance. */
void sensor_write(const Soft *soft, const mjModel *m, mjData *d, int instance);

/* ---- visual.c: the ground, what presses it, and forces in the viewer ---- */

/* Draws the ground, dented where it is pressed, up to 2.5 m from the feet and, where it is level,
 * as plain plates beyond: if the instance asks for it by `surface`, or it is uneven and no height
 * field of the model stands for it; not while static geoms are hidden. Otherwise flat patches show
 * on the model's own floor where the ground is pressed. Pressed ground is darker, and has the
 * colour of its material. With the viewer's contact forces, an arrow for each foot. All this while
 * the scene has room. */
void visual_add(const Soft *soft, const mjModel *m, const mjData *d, const MildGround *ground,
                const mjvOption *option, mjvScene *scene);

/* The colour of a preset by its name, of other materials (name: NULL) by how they spring back. */
void visual_colour(const char *name, const MildMaterial *material, float rgb[3]);

#endif
