/* One robot walking a course: measured on each ground, filmed or shown in a window. */
#ifndef MILD_PLAY_H
#define MILD_PLAY_H

#include <stddef.h>
#include <stdio.h>

#include "app/others.h"
#include "control/controller.h"
#include "identify/belief/belief.h"
#include "mild/ground.h"
#include "run/eval/measure.h"
#include "run/eval/scene.h"
#include "view/pressure.h"
#include "view/sketch.h"
#include "view/video.h"
#include "view/view.h"
#include "view/window.h"

/* The ground of a walk that keys change while it goes on: another preset, friction, stiffness. */
typedef struct {
    MildTerrain terrain;                       /* as it is now; its map is borrowed */
    MildMaterial original[MILD_MATERIALS_MAX]; /* the materials as they were at first */
    int presets; /* the last so many materials of the terrain wait for the keys 1, 2, ... */
} Live;

/* presets: how many of the terrain's last materials no point has yet. */
Live live_begin(const MildTerrain *terrain, int presets);

/* Does what the keys ask for. material: that under the robot. A preset lies everywhere from then
 * on, with its own numbers; a loaded element keeps the material that it touched down on, so a
 * foot meets it at its next step. Friction and stiffness change at once, by a tenth a key, within
 * the range of a material. Stiffness is k_pen and sigma_cone, or what mild_model_match scales.
 * Returns whether another ground lies there. */
int live_take(Live *live, int material, const WindowInput *input);

/* Gives the ground to an episode's terrain, whose place on the map remains. */
void live_apply(const Live *live, MildTerrain *terrain);

/* "friction 0.60 (F V), k_pen 380 (K M)"; returns `text`. */
const char *live_describe(const Live *live, int material, char *text, size_t size);

/* What happened on one ground of the course. */
typedef struct {
    Measure measure;
    int steps;             /* physics steps that count, those after the start */
    double start_x, end_x; /* [m] */
    int fell;              /* bool: it fell on this ground */
} PlayLeg;

enum { PLAY_ALARMS = 16 };

typedef struct {
    /* set by the caller */
    const TaskDef *task;
    const Robot *robot;
    const Scene *scene;
    Controller *controller;
    View *view;                  /* NULL: not watched */
    Video *video;                /* NULL: none, or a window */
    Sketch *sketch;              /* NULL: not printed; otherwise the walk is, in real time */
    Pressure *pressure;          /* NULL: not measured */
    Others *others;              /* in the video; NULL: none */
    double seconds, speed, rate; /* [s], [m/s], [1/s] frames */
    double jump;                 /* [m] see EvalDef.jump */
    uint64_t seed;
    const BeliefNet *belief; /* what the robot knows of its ground; NULL: it has none */
    FILE *log;               /* of the frames that its policy sees (belief/file.h); NULL: none */
    int window;              /* bool: real time, keys */
    int presets; /* materials at the end of the scene's terrain that keys lay under the robot */
    /* filled */
    PlayLeg leg[MILD_MATERIALS_MAX];
    double time;               /* [s] walked */
    int fell;                  /* bool */
    Belief knows;              /* with `belief`: at the end */
    double alarm[PLAY_ALARMS]; /* [s] when the robot felt another ground; the first ones */
    int changed;               /* bool: keys changed the ground; the legs are measured until then */
    int frames;
} Play;

/* Walks until the time is over, the robot falls, the window is closed or Ctrl-C is pressed. */
MildStatus play_run(Play *play, MildError *error);

#endif
