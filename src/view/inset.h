/* The sole-pressure picture in the corner of a frame: both soles seen from above, toes up, one
 * square per element, coloured by normal pressure, with centre of pressure. Draws into memory. */
#ifndef VIEW_INSET_H
#define VIEW_INSET_H

#include "mild/ground.h"

typedef struct {
    int width, height; /* [pixels] of the whole inset */
    int cell;          /* [pixels] edge of one element */
    int bar_left, bar_right, bar_bottom,
        bar_top;                    /* [pixels] where the colour bar is, for the labels */
    int title_bottom, title_height; /* [pixels] room for a title */
} InsetLayout;

/* rows grow upward as OpenGL's pictures do */
InsetLayout inset_layout(const MildSole *const *soles, int feet, int cell);
/* normal: [feet][elements] N. rgb: [height][width][3], bottom row first. pressure_max: [Pa] top of
 * the colour bar. */
void inset_draw(const InsetLayout *layout, const MildSole *const *soles, int feet,
                const double *const *normal, double pressure_max, unsigned char *rgb);

#endif
