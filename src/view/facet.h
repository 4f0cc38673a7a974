/* Elements of a body as a picture of the ground takes them: discs that press its surface down. The
 * pictures of the program and of the page (web/window.c) share it. */
#ifndef VIEW_FACET_H
#define VIEW_FACET_H

#include <math.h>

#include "mild/ground.h"

#define FACET_LEVEL 0.17364817766693034 /* [-] cosine of 80 degrees: steeper faces carry nothing */

typedef struct {
    double at[3];    /* [m] its centre, world */
    double slope[2]; /* [-] of its plane along world x and y */
    double radius;   /* [m] in its plane, to the corners of its square */
    double lowest;   /* [m] height: a steep disc does not reach below the body's edge */
} Facet;

/* Writes the elements of a body that face down and reach below the undisturbed ground. shell: of
 * the body, which had rows in the last step (MildContactInput); rotation: [9] body -> world;
 * elements: of that step. Returns how many, at most mild_sole_elements. */
static inline int facets_of(const MildSole *shell, const double *rotation,
                            const MildElements *elements, Facet *facets) {
    const double *area = mild_sole_surface_area(shell);
    int count = 0;
    for (int e = 0; e < mild_sole_elements(shell); e++) {
        double normal[3] = {0, 0, 0};
        for (int axis = 0; axis < 3; axis++) {
            const double along = mild_sole_surface_normal(shell, axis)[e];
            for (int k = 0; k < 3; k++) {
                normal[k] += rotation[3 * k + axis] * along;
            }
        }
        const double edge = sqrt(area[e]), tilt = hypot(normal[0], normal[1]);
        const double z = elements->point_z[e];
        if (elements->depth[e] > -edge && -normal[2] > FACET_LEVEL) {
            facets[count++] = (Facet){.at = {elements->point_x[e], elements->point_y[e], z},
                                      .slope = {-normal[0] / normal[2], -normal[1] / normal[2]},
                                      .radius = sqrt(0.5) * edge,
                                      .lowest = z - 0.5 * edge * tilt};
        }
    }
    return count;
}

/* [m] Height of the facet's point nearest to the vertical through (x, y). *away: [m] level distance
 * of the two. */
static inline double facet_height(const Facet *facet, double x, double y, double *away) {
    const double dx = x - facet->at[0], dy = y - facet->at[1];
    const double dz = facet->slope[0] * dx + facet->slope[1] * dy;
    const double level = dx * dx + dy * dy, length = sqrt(level + dz * dz);
    const double share = length > facet->radius ? facet->radius / length : 1;
    *away = (1 - share) * sqrt(level);
    return fmax(facet->at[2] + share * dz, facet->lowest);
}

#endif
