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

/* ---- smooth.c ---- */

/* Smooths the steps along the edges of a picture that was drawn with one sample per pixel. Four
 * samples a pixel cost a software renderer more than twice the time of the whole picture; this
 * costs a few milliseconds. */

/* from, to: [height][width][3], not the same. luma: [height + 1][width] for use inside. Pixels
 * without an edge beside them, and those of the border, are copied. */
void smooth_edges(const unsigned char *from, int width, int height, unsigned char *luma,
                  unsigned char *to);
/* Turns a picture upside down. */
void smooth_flip(const unsigned char *rgb, int width, int height, unsigned char *flipped);

/* ---- sight.c: how a camera follows ---- */

/* A camera follows what it looks at: smoothly, by the time that passed and not by the number of
 * frames, and without staying behind something that moves evenly. */

typedef struct {
    double once[3], twice[3]; /* [m] the target filtered once and twice */
    double target[3];         /* [m] at the last step */
} Follow;

/* The camera jumps to the target. */
void follow_jump(Follow *follow, const double target[3]);
/* elapsed: [s] since the last step; lag: [s] time constant. */
void follow_step(Follow *follow, const double target[3], double elapsed, double lag);
/* [m] Where the camera looks. */
void follow_position(const Follow *follow, double position[3]);

#endif
