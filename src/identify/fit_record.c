#include "identify/fit_record.h"

#include <float.h>
#include <math.h>

enum { LOCAL_ROWS = 200, TERMS = 5, TURN_ROWS = 3 };

/* [1/s] A way up faster than this by its depth, such as the rebound of a dropped body, is not the
 * unloading line: ground follows 5 ms late (docs/model.md section 6). */
#define UNLOAD_RATE 2.0

#define TURN_FORCE 0.95 /* [-] of the force before: what is less is no loading */

int fit_loading(FitPoint *points, int count) {
    int kept = 0, last = 0;
    double deepest = DBL_MIN; /* at depth 0 the law gives no information */
    for (int i = 0; i < count; i++) {
        if (!(points[i].depth >= deepest)) {
            continue;
        }
        deepest = points[i].depth;
        points[kept++] = points[i];
        last = i;
    }
    /* Where the way turns between two rows, the deepest may be one of the way back already. */
    for (int k = 0; k < TURN_ROWS && last < count - 1 && kept > FIT_POINTS_MIN; k++) {
        kept -= points[kept - 1].force < TURN_FORCE * points[kept - 2].force;
    }
    return kept;
}

int fit_unloading(const FitPoint *points, int count, FitPoint *back) {
    int top = 0, kept = 0;
    for (int i = 1; i < count; i++) {
        top = points[i].depth > points[top].depth ? i : top;
    }
    for (int i = top; i < count; i++) {
        const double depth = points[i].depth;
        if (depth > 0 && (!kept || depth < back[kept - 1].depth)) {
            back[kept] = points[i];
            back[kept++].load = points[top].depth;
        }
    }
    if (kept < FIT_POINTS_MIN) {
        return 0;
    }
    const FitPoint *middle = &back[kept / 2];
    const double rate = (back->depth - middle->depth) / (middle->time - back->time); /* NaN: slow */
    return rate > UNLOAD_RATE * back->depth ? 0 : kept;
}

#define SLIDE_LEAST 1e-3  /* [m] a shorter way along is none */
#define SLIDE_BEGIN 1e-6  /* [m] */
#define SLIDE_PRESSED 0.8 /* [-] of the depth, from where the press belongs to the slide */

int fit_sliding(const FitPoint *points, int *count, FitPoint *slide, int *slides) {
    int far = 0, begin = 0;
    *slides = 0;
    for (int i = 1; i < *count; i++) {
        const double way = fabs(points[i].slip - points[0].slip); /* NaN: none */
        far = way > fabs(points[far].slip - points[0].slip) ? i : far;
    }
    const double length = points[far].slip - points[0].slip;
    if (!(fabs(length) >= SLIDE_LEAST)) {
        return 0;
    }
    for (int i = 0; i < far; i++) {
        begin = fabs(points[i].slip - points[0].slip) <= SLIDE_BEGIN ? i : begin;
    }
    int first = begin;
    while (first > 0 && points[first - 1].depth >= SLIDE_PRESSED * points[begin].depth) {
        first--;
    }
    for (int i = first; i <= far; i++) {
        const double slip = i > begin ? fabs(points[i].slip - points[0].slip) : 0;
        if (i > begin && slip <= slide[*slides - 1].slip) {
            continue;
        }
        FitPoint *row = &slide[(*slides)++];
        *row = points[i];
        row->slip = slip;
        row->along = length > 0 ? -points[i].along : points[i].along;
    }
    *count = begin + 1;
    return *slides - (begin - first + 1);
}

/* Gauss-Jordan elimination without pivoting. */
int inverse_find(double a[INVERSE_MAX][INVERSE_MAX], int n,
                 double inverse[INVERSE_MAX][INVERSE_MAX]) {
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            inverse[i][j] = i == j;
        }
    }
    for (int k = 0; k < n; k++) {
        if (!(a[k][k] > 1e-14)) {
            return 0;
        }
        double pivot = 1 / a[k][k];
        for (int j = 0; j < n; j++) {
            a[k][j] *= pivot;
            inverse[k][j] *= pivot;
        }
        for (int i = 0; i < n; i++) {
            double factor = a[i][k];
            for (int j = 0; j < n && i != k; j++) {
                a[i][j] -= factor * a[k][j];
                inverse[i][j] -= factor * inverse[k][j];
            }
        }
    }
    return 1;
}

/* Speed and acceleration of row `i` from a least-squares polynomial through the depths around it.
 * It is a quartic through a twentieth of the rows, because a decelerating plate needs its small
 * bias, or a parabola when there are few rows. Both are 0 when the times are missing. At most
 * LOCAL_ROWS rows of the window are used, so that the cost grows only with the length of the
 * record. */
static void local_motion(const FitPoint *points, int count, int i, double *speed,
                         double *acceleration) {
    int half = count / 40 > 4 ? count / 40 : 4, rows = 2 * half + 1 < count ? 2 * half + 1 : count;
    int first = i - half > 0 ? (i + half < count ? i - half : count - rows) : 0,
        stride = 1 + rows / LOCAL_ROWS;
    int terms = rows >= 15 ? TERMS : 3;
    double now = points[i].time,
           reach = fmax(now - points[first].time, points[first + rows - 1].time - now);
    double moment[2 * TERMS] = {0}, depth[TERMS] = {0};
    double normal[INVERSE_MAX][INVERSE_MAX], inverse[INVERSE_MAX][INVERSE_MAX];
    for (int k = first; k < first + rows; k += stride) {
        double t = (points[k].time - now) / reach, power = 1;
        for (int n = 0; n < 2 * terms - 1; n++, power *= t) {
            moment[n] += power / rows;
            if (n < terms) {
                depth[n] += power * (points[k].depth - points[i].depth) / rows;
            }
        }
    }
    *speed = *acceleration = 0;
    for (int a = 0; a < terms; a++) {
        for (int b = 0; b < terms; b++) {
            normal[a][b] = moment[a + b];
        }
    }
    if (!(reach > 0) || !inverse_find(normal, terms, inverse)) {
        return;
    }
    for (int a = 0; a < terms; a++) {
        *speed += inverse[1][a] * depth[a] / reach;
        *acceleration += 2 * inverse[2][a] * depth[a] / (reach * reach);
    }
    *speed = fmax(*speed, 0);
}

void fit_speeds(FitPoint *points, int count) {
    for (int i = 0; i < count; i++) {
        double speed;
        local_motion(points, count, i, &speed, &points[i].acceleration);
        if (!isfinite(points[i].speed)) {
            points[i].speed = speed;
        }
    }
}
