/* An OpenGL context that needs no display: EGL (GPU or Mesa software), else OSMesa. Both are found
 * at run time, so the program starts on machines that have neither and says so only when a picture
 * is wanted. */
#ifndef VIEW_GL_H
#define VIEW_GL_H

#include "mild/error.h"

typedef struct GlContext GlContext;

/* Makes the context current on the calling thread. */
GlContext *gl_create(MildError *error);
void gl_destroy(GlContext *context);
const char *gl_name(const GlContext *context); /* "EGL" or "OSMesa" */

#endif
