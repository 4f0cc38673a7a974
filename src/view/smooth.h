/* Smooths the steps along the edges of a picture that was drawn with one sample per pixel. Four
 * samples a pixel cost a software renderer more than twice the time of the whole picture; this
 * costs a few milliseconds. */
#ifndef VIEW_SMOOTH_H
#define VIEW_SMOOTH_H

/* from, to: [height][width][3], not the same. luma: [height + 1][width] for use inside. Pixels
 * without an edge beside them, and those of the border, are copied. */
void smooth_edges(const unsigned char *from, int width, int height, unsigned char *luma,
                  unsigned char *to);
/* Turns a picture upside down. */
void smooth_flip(const unsigned char *rgb, int width, int height, unsigned char *flipped);

#endif
