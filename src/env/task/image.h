/* Grey pictures from PNG files. */
#ifndef TASK_IMAGE_H
#define TASK_IMAGE_H

#include <stdio.h>

#include "mild/error.h"

typedef struct {
    int columns, rows;
    double *grey; /* [rows][columns] [-] 0 black .. 1 white, the file's own values (no gamma); first
                     row at the top */
} Image;

/* Reads any PNG. Colours become luminance and transparency is ignored. Fails with the name of the
 * file and the reason. */
MildStatus image_read(const char *path, Image *image, MildError *error);
/* The same from an open file. `name` is used for it in messages. */
MildStatus image_read_file(FILE *file, const char *name, Image *image, MildError *error);
void image_close(Image *image);

#endif
