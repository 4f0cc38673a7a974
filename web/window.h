/* The ground around the robot as the page draws it: the depth of each cell of a window that moves
 * with the robot. Soles, and the elements of other bodies that are in the ground, press it down;
 * what they leave is what the ground remembers. */
#ifndef WEB_WINDOW_H
#define WEB_WINDOW_H

#include "mild/ground.h"
#include "web/core.h"

/* The last step on soft ground. */
typedef struct {
    int feet;
    int standing;           /* feet, and behind them bodies with shells */
    const WebSole *outline; /* [feet] */
    MildSole *const *sole;  /* [standing] */
    const MildTerrain *terrain;
    const MildGround *ground;
    const MildContactInput *input;
    const MildScratch *scratch;
    double cell; /* [m] */
} WindowScene;

/* Bool: there was memory for it. */
int window_open(const WindowScene *scene);
void window_close(void);
/* A ground that nothing has pressed. */
void window_clear(WebView *view);
/* Moves the window so that (x, y) [m] is in its middle, and presses the bodies into it. Marks what
 * is dirty. rigid: bool, nothing yields. */
void window_show(const WindowScene *scene, double x, double y, int rigid, WebView *view);
/* [WEB_WINDOW][WEB_WINDOW] as web_window. */
const float *window_depths(void);

#endif
