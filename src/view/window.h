/* A window with an OpenGL context, where there are a display and GLFW, and the program was built
 * with its header. */
#ifndef VIEW_WINDOW_H
#define VIEW_WINDOW_H

#include "mild/error.h"

typedef struct Window Window;

typedef struct {
    int quit;                /* bool: Esc or the window was closed */
    int paused;              /* bool: toggled by space */
    int reset;               /* bool: R was pressed since the last call */
    int halt;                /* bool: S was pressed since the last call */
    int ground;              /* 1 .. 9: that digit was pressed since the last call; 0: none */
    int friction, stiffness; /* presses of F less those of V, of K less those of M, since then */
    double time_scale;       /* [-] 1 is real time; - and = change it */
    double command[3]; /* [m/s, m/s, rad/s] change wished since the last call: arrows and Q/E */
    double turn, lift, zoom; /* camera: mouse drag [rad], wheel [-], since the last call */
} WindowInput;

/* Whether there can be windows. */
int window_available(void);
/* Makes the window's context current on the calling thread (which must be the main one). */
Window *window_create(int width, int height, const char *title, MildError *error);
void window_destroy(Window *window);
void window_size(Window *window, int *width, int *height); /* [pixels] of the framebuffer */
/* Shows what was drawn and collects the keys. */
void window_show(Window *window, WindowInput *input);

#endif
