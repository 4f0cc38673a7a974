/* Where observations go: a plain struct, which other programs (run/envs/envs.h) share. */
#ifndef TASK_VIEW_H
#define TASK_VIEW_H

/* One row for each environment, or the rows of one. Pointers may be NULL, but the batch engine
 * needs the history. Widths: TaskShape. */
typedef struct {
    float *history;  /* [envs][history] with sensor noise: frames, the newest last, and a scan */
    float *critic;   /* [envs][critic] without noise */
    float *estimate; /* [envs][estimates] true velocities and heights: the regression targets */
    float *frame;    /* [envs][observation] the newest frame of the history: the decoder's target */
} EnvsView;

#endif
