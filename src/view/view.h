/* Pictures of a robot on its ground: offscreen (for videos) or in a window. The soft surface is
 * drawn as a height map that soles and shells press in; sole pressure in the lower right corner,
 * text in the upper left. One per process is enough; create, use and destroy it on one thread. */
#ifndef VIEW_VIEW_H
#define VIEW_VIEW_H

#include "robot/robot.h"
#include "view/window.h"

typedef struct {
    int width, height;                 /* [pixels] */
    double rate;                       /* [1/s] frames */
    int window;                        /* bool: show in a window; otherwise view_pixels */
    int rigid;                         /* bool: the ground never yields */
    double x_min, x_max, y_min, y_max; /* [m] ground drawn as such; a plain floor beyond */
    double cell;                       /* [m] its vertices are so far apart */
    const char *const *names; /* [materials of the terrain] for colours and text; NULL: unnamed */
    double pressure_max;      /* [Pa] top of the pressure scale */
    double force_arrow;       /* [m/N] length of the ground reaction arrows; 0: none */
    int closeup;              /* bool: the feet from near the ground, in the upper right corner */
    double azimuth, elevation, distance; /* [deg], [deg], [m] of the camera about the robot */
    /* Where ViewInfo.away takes the camera; `aside` is added to what it looks at. */
    double away_elevation, away_distance, away_aside[2]; /* [deg], [m], [m] */
    int others;                                          /* robots beside it, see ViewOther */
} ViewDef;
ViewDef view_def_default(void);

/* Another robot of the kind, which is drawn, and whose feet press the ground if it is one of the
 * first. */
typedef struct {
    double place[2];                    /* [m] added to its x and y, in all that follows */
    double qpos[ROBOT_NQ_MAX];          /* as RobotState */
    double position[ROBOT_FEET_MAX][3]; /* [m] of its feet, see RobotFoot */
    double rotation[ROBOT_FEET_MAX][9]; /* [-] */
} ViewOther;
#define VIEW_NOWHERE 1e3 /* [m] position[f][2] of a foot that nobody has looked at yet */

/* What the text says. */
typedef struct {
    double time;             /* [s] */
    double command[3];       /* [m/s, m/s, rad/s] */
    double speed;            /* [m/s] measured, forward */
    int fell;                /* bool */
    const char *note;        /* in the lower left corner, below each other; NULL: nothing */
    double away;             /* [-] 0: the camera is where ViewDef says, 1: where `away_` says */
    const ViewOther *others; /* [ViewDef.others] */
} ViewInfo;

typedef struct View View;
View *view_create(const ViewDef *def, const Robot *robot, const MildTerrain *terrain,
                  MildError *error);
void view_destroy(View *view);

/* Presses the feet, and the shells that stand on it, into the visible ground. Call it about once
 * per policy step, so that imprints made between two frames appear. */
void view_observe(View *view, const RobotSim *sim);
/* Draws one frame. */
void view_frame(View *view, const RobotSim *sim, const ViewInfo *info);
/* [height][width][3], top row first; valid until the next frame. NULL in a window. */
const unsigned char *view_pixels(const View *view);
/* Window only: shows the frame and returns keys. */
void view_show(View *view, WindowInput *input);
/* A new episode on the same course: the ground is smooth again and the camera jumps to the robot.
 */
MildStatus view_reset(View *view, const MildTerrain *terrain, MildError *error);

#endif
