/* What of the other robots is drawn: who is in the picture, with as many parts as can be seen. */
#ifndef MILD_SIGHT_H
#define MILD_SIGHT_H

#include <mujoco/mujoco.h>

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
