/* Private to the plugin: the feet of a model and their soles, and the other bodies that meet the
 * ground, which count as feet with elements all over. */
#ifndef PLUGIN_FOOT_H
#define PLUGIN_FOOT_H

#include "plugin/def.h"

/* A foot. Its frame is that of its body or site; the frame of a round foot is level and has its
 * origin in the lowest point of the sphere. */
typedef struct {
    int body;         /* that carries the sole */
    int site;         /* whose frame is the foot's; -1: the body's frame */
    int shell;        /* bool: of `body`, elements all over its shapes (body.c) */
    int round;        /* bool: a sphere that transmits no moment */
    double center[3]; /* [m] round: centre of the sphere, body frame */
    double radius;    /* [m] round */
    double area;      /* [m^2] of the sole; 0: its elements are not to have the same */
    MildSole *raster;
    MildSole *sole; /* the raster, or one element in its middle (mild_sole_concentric) */
} Foot;

/* Finds the feet of an instance, then its bodies, and makes their soles. feet: [MILD_FEET_MAX],
 * zeroed. Writes their number, also on failure, when those made so far must be destroyed.
 *
 * compiling: bool, the compiler asks for the size of the state. Meshes have no vertices yet. A sole
 * of meshes is then a rectangle under their bounding boxes, with at least as many elements. */
MildStatus feet_create(const mjModel *m, const PluginDef *def, MildModel model, int compiling,
                       Foot *feet, int *count, MildError *error);
void feet_destroy(Foot *feet, int count);

/* Name of the foot's site or body. */
const char *foot_name(const mjModel *m, const Foot *foot);
/* Name of the foot's body; empty when it has none. */
const char *foot_body_name(const mjModel *m, const Foot *foot);

/* Bool: the body has a shape that is not a mesh; its meshes are then for pictures. */
int foot_has_primitive(const mjModel *m, const Foot *foot);
/* Bool: the geom is part of the foot's sole. */
int foot_has_geom(const mjModel *m, const PluginDef *def, const Foot *foot, int geom);
/* Bool: the geom is on the foot's body and would meet a floor that the foot sinks into. */
int foot_may_touch_floor(const mjModel *m, const Foot *foot, int geom);

/* Present place of the foot's frame. */
void foot_pose(const mjData *d, const Foot *foot, double position[3], double rotation[9]);

/* ---- body.c: bodies that touch the ground with any side, such as shins, trunk or wheels ---- */

/* Covers the shapes of a body with elements. pitch: [m] of the ground's law, that of the feet.
 * compiling: as for feet_create; a body with meshes then gets elements enough for the room that
 * their bounding boxes may need. */
MildStatus body_shell(const mjModel *m, const PluginDef *def, double pitch, int compiling,
                      Foot *foot, MildError *error);

/* ---- wheel.c: feet that turn, such as wheels and rollers ---- */

/* A sole is cut once, in the pose of the file, and turns with its body; that of a wheel would soon
 * be on top. Fails for a foot whose shapes are as high over the ground after a turn about a
 * horizontal axis as before, when a joint allows the turn: the axis is that of a hinge above the
 * foot that turns by more than 30 degrees, or of one of the shapes when their body moves freely.
 * Round feet may. */
MildStatus wheel_check(const mjModel *m, const PluginDef *def, const Foot *foot, MildError *error);

#endif
