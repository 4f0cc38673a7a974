/* One robot walking a course while it is watched: measured per ground, filmed, shown in a window.
 */
#ifndef MILD_PLAY_H
#define MILD_PLAY_H

#include "control/controller.h"
#include "eval/measure.h"
#include "eval/scene.h"
#include "view/pressure.h"
#include "view/video.h"
#include "view/view.h"

/* What happened on one ground of the course. */
typedef struct {
    Measure measure;
    int steps;             /* physics steps counted, after the start */
    double start_x, end_x; /* [m] */
    int fell;              /* bool: here */
} PlayLeg;

typedef struct {
    /* set by the caller */
    const TaskDef *task;
    const Robot *robot;
    const Scene *scene;
    Controller *controller;
    View *view;                  /* NULL: not watched */
    Video *video;                /* NULL: none, or a window */
    Pressure *pressure;          /* NULL: not measured */
    double seconds, speed, rate; /* [s], [m/s], [1/s] frames */
    uint64_t seed;
    int window; /* bool: real time, keys */
    /* filled */
    PlayLeg leg[MILD_MATERIALS_MAX];
    double time; /* [s] walked */
    int fell;    /* bool */
    int frames;
} Play;

/* Walks until the time is over, the robot fell, the window was closed or Ctrl-C. */
MildStatus play_run(Play *play, MildError *error);

#endif
