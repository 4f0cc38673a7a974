/* Parts of view.c. */
#ifndef MILD_VIEW_VIEW_PARTS_H
#define MILD_VIEW_VIEW_PARTS_H

#include <mujoco/mujoco.h>

#include "mild/error.h"
#include "mild/ground.h"

/* ---- gl.c ---- */

/* An OpenGL context without a display, from EGL (GPU or Mesa software) or else from OSMesa. Both
 * are loaded at run time, so the program also starts on machines that have neither, and fails only
 * when a picture is requested. */
typedef struct GlContext GlContext;

/* Makes the context current on the calling thread. */
GlContext *gl_create(MildError *error);
void gl_destroy(GlContext *context);

/* ---- inset.c ---- */

/* The sole-pressure picture in the corner of a frame: both soles seen from above, toes up, one
 * square per element, coloured by normal pressure, with centre of pressure. Draws into memory. */

typedef struct {
    int width, height; /* [pixels] of the whole inset */
    int cell;          /* [pixels] edge of one element */
    int bar_left, bar_right, bar_bottom,
        bar_top;                    /* [pixels] where the colour bar is, for the labels */
    int title_bottom, title_height; /* [pixels] room for a title */
} InsetLayout;

/* rows grow upward as OpenGL's pictures do */
InsetLayout inset_layout(const MildSole *const *soles, int feet, int cell);
/* normal: [feet][elements] N. rgb: [height][width][3], bottom row first. pressure_max: [Pa] top of
 * the colour bar. */
void inset_draw(const InsetLayout *layout, const MildSole *const *soles, int feet,
                const double *const *normal, double pressure_max, unsigned char *rgb);

/* ---- sight.c: which other robots are in the picture, with as many parts as can be seen ---- */

#define SIGHT_FAR 400.0   /* [m] the camera sees that far */
#define SIGHT_SHADOW 25.0 /* [m] the shadow map reaches from the robot in the middle */

/* What a robot's file says of camera and shadows is meant for one robot: sets both to these. */
void sight_widen(mjModel *model);

/* Where the camera is, and how many pixels a metre has at a metre from it. */
typedef struct {
    double eye[3], ahead[3];
    double pixels;
    double wide; /* [-] tangent of half the angle between opposite corners of the picture */
} Sight;

/* width, height: [pixels] of the picture. */
Sight sight_of(const mjvScene *scene, int width, int height);
/* [m] From the camera; negative: a robot there is not in the picture. */
double sight_distance(const Sight *sight, const double place[3]);
/* Of the geoms from `first` on, `far` [m] away, keeps those that are large enough to be seen; far
 * ones become boxes. shaded: bool, the shadow map covers them. */
void sight_thin_out(mjvScene *scene, int first, double far, double pixels, int shaded);
/* A shadow where the shadow map does not reach. height: [m] of the ground there. */
void sight_draw_spot(mjvScene *scene, const double place[3], double height);

#endif
