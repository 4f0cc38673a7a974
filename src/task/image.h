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

/* Any PNG: colours become their luminance, transparency is left out. Fails with the file's name and
 * what is wrong. */
MildStatus image_read(const char *path, Image *image, MildError *error);
/* The same from an open file, which `name` stands for in messages. */
MildStatus image_read_file(FILE *file, const char *name, Image *image, MildError *error);
void image_close(Image *image);

#endif
