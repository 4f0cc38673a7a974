#include "ground/sole/sole_inside.h"

#include <math.h>

#define EDGE_SAMPLES 4 /* points of a cell along each side */

int outline_inside(const MildSoleDef *def, double x, double y) {
    int inside = 0;
    for (int i = 0; i < def->points; i++) {
        const double *p = &def->outline[2 * i], *q = &def->outline[2 * ((i + 1) % def->points)];
        if ((p[1] > y) != (q[1] > y) && x < p[0] + (y - p[1]) / (q[1] - p[1]) * (q[0] - p[0])) {
            inside = !inside;
        }
    }
    return inside;
}

/* Distance of a point from edge i of the outline. */
static double edge_distance(const MildSoleDef *def, int i, double x, double y) {
    const double *p = &def->outline[2 * i], *q = &def->outline[2 * ((i + 1) % def->points)];
    const double ex = q[0] - p[0], ey = q[1] - p[1];
    const double square = ex * ex + ey * ey;
    const double along = square > 0.0 ? ((x - p[0]) * ex + (y - p[1]) * ey) / square : 0.0;
    const double t = fmin(fmax(along, 0.0), 1.0);
    return hypot(x - p[0] - t * ex, y - p[1] - t * ey);
}

/* Lists the edges that may be nearest to a point of the cell about (x, y). Returns their count.
 * nearest: the distance of its centre. */
static int edges_near(const MildSoleDef *def, double x, double y, int *near, double *nearest) {
    int count = 0;
    *nearest = INFINITY;
    for (int i = 0; i < def->points; i++) {
        *nearest = fmin(*nearest, edge_distance(def, i, x, y));
    }
    for (int i = 0; i < def->points;
         i++) { /* no point is further from the centre than 0.71 edges */
        if (edge_distance(def, i, x, y) <= *nearest + 1.5 * def->pitch) {
            near[count++] = i;
        }
    }
    return count;
}

/* Mean and standard deviation over a cell, by points; 0 outside the outline. The distance changes
 * by the way itself, so the part of a cell that a point stands for has the variance of its own
 * edge. */
static void cell_edge(const MildSoleDef *def, double x, double y, int *near, double *mean,
                      double *spread) {
    const double part = def->pitch / EDGE_SAMPLES;
    double nearest, sum = 0.0, squares = 0.0;
    const int count = edges_near(def, x, y, near, &nearest);
    const int cut = nearest < 0.71 * def->pitch;
    for (int k = 0; k < EDGE_SAMPLES * EDGE_SAMPLES; k++) {
        const double sx = x + (k % EDGE_SAMPLES + 0.5) * part - 0.5 * def->pitch;
        const double sy = y + (k / EDGE_SAMPLES + 0.5) * part - 0.5 * def->pitch;
        if (!(cut ? outline_inside(def, sx, sy) : outline_inside(def, x, y))) {
            continue;
        }
        double distance = INFINITY;
        for (int n = 0; n < count; n++) {
            distance = fmin(distance, edge_distance(def, near[n], sx, sy));
        }
        sum += distance;
        squares += distance * distance + part * part / 12.0;
    }
    const int all = EDGE_SAMPLES * EDGE_SAMPLES;
    *mean = sum / all;
    *spread = sqrt(fmax(squares / all - *mean * *mean, 0.0));
}

/* [m] Mean over the outline, by cells of the sole's raster, in which the point (x, y) is a
 * centre. */
static double outline_mean(const MildSoleDef *def, const Outline *outline, double x, double y,
                           int *work) {
    const double pitch = def->pitch;
    double sum = 0.0, mean, spread;
    double cx = x - ceil((x - outline->low[0]) / pitch) * pitch;
    while (cx < outline->high[0] + pitch) {
        double cy = y - ceil((y - outline->low[1]) / pitch) * pitch;
        while (cy < outline->high[1] + pitch) {
            cell_edge(def, cx, cy, work, &mean, &spread);
            sum += mean * pitch * pitch;
            cy += pitch;
        }
        cx += pitch;
    }
    return sum / outline->area;
}

void sole_edges(const MildSoleDef *def, const Outline *outline, int n, const double *x,
                const double *y, double *edge, double *spread, int *work) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
        cell_edge(def, x[i], y[i], work, &edge[i], &spread[i]);
        sum += edge[i] / n;
    }
    const double scale = outline_mean(def, outline, x[0], y[0], work) / sum;
    for (int i = 0; i < n && isfinite(scale); i++) {
        edge[i] *= scale;
        spread[i] *= scale;
    }
}
