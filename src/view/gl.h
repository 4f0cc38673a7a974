/* An OpenGL context without a display, from EGL (GPU or Mesa software) or else from OSMesa. Both
 * are loaded at run time, so the program also starts on machines that have neither, and fails only
 * when a picture is requested. */
#ifndef VIEW_GL_H
#define VIEW_GL_H

#include "mild/error.h"

typedef struct GlContext GlContext;

/* Makes the context current on the calling thread. */
GlContext *gl_create(MildError *error);
void gl_destroy(GlContext *context);

#endif
