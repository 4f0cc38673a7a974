/* The window of ground (core.h). */
#include "web/core.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "view/facet.h"

#define WINDOW_STRIDE 32    /* cells that the window moves at once */
#define WINDOW_LEAST 1e-4f  /* [m] a smaller change is not drawn */
#define OUTLINE_STEP 0.005  /* [m] */
#define OUTLINE_MARGIN 0.12 /* [m] ground around a sole that it may draw down */
#define UNDER_SOLE 0.0015   /* [m] gap below a sole, which prevents flicker */
#define SLOPE_SAND 0.45     /* [-] width of the slope around a print, over its depth */
#define SLOPE_FOAM 0.55     /* [-] the same of ground that springs back */
#define SLOPE_LEAST 0.006   /* [m] of that width */
#define SLOPE_MOST 0.108    /* [m] */
#define SOLE_LEVEL 0.3      /* [-] cosine of the tilt of a foot that lies on its side */
#define SOLE_JUMP 4         /* [cells] a foot that moves farther is not where it was */

/* Distances from the outline of a sole, negative inside [m]. */
typedef struct {
    double x, y; /* [m] the first node */
    int columns, rows;
    float *distance; /* [rows][columns] */
} Outline;

/* Cells of the world: the first, and behind the last. */
typedef struct {
    int i0, i1, j0, j1;
} Box;

static struct {
    Outline outline[ROBOT_FEET_MAX];
    int first[2]; /* first cell that is drawn */
    float *shown; /* [WEB_WINDOW][WEB_WINDOW] [m] depth of the surface */
    float *kept;  /* the same without what presses it now */
    Facet *facet; /* of the body that is pressed in */
    /* when it was last drawn: */
    Box sole[ROBOT_FEET_MAX]; /* around each foot */
    Box pressed;              /* by bodies with shells */
} window;

/* ---- cells ---- */

static double least(double a, double b) {
    return a < b ? a : b;
}

static double most(double a, double b) {
    return a > b ? a : b;
}

static size_t window_at(int i, int j) {
    return (size_t)(j & (WEB_WINDOW - 1)) * WEB_WINDOW + (size_t)(i & (WEB_WINDOW - 1));
}

static void mark(WebView *view, int x, int y, int width, int height) {
    if (view->dirty_count >= WEB_DIRTY_MAX || view->dirty_count < 0) {
        view->dirty_count = -1;
        return;
    }
    view->dirty[view->dirty_count++] = (WebDirty){x, y, width, height};
}

/* Marks cells of the world, which lie in up to four pieces. */
static void mark_box(const Box *box, WebView *view) {
    for (int j = box->j0; j < box->j1;) {
        const int y = j & (WEB_WINDOW - 1);
        const int height = box->j1 - j < WEB_WINDOW - y ? box->j1 - j : WEB_WINDOW - y;
        for (int i = box->i0; i < box->i1;) {
            const int x = i & (WEB_WINDOW - 1);
            const int width = box->i1 - i < WEB_WINDOW - x ? box->i1 - i : WEB_WINDOW - x;
            mark(view, x, y, width, height);
            i += width;
        }
        j += height;
    }
}

static double recovery_at(const WindowScene *scene, double x, double y) {
    const MildTerrain *terrain = scene->terrain;
    return terrain->materials[mild_terrain_material_at(terrain, x, y)].recovery;
}

/* What the ground remembers there. */
static void recall(const WindowScene *scene, Box box, WebView *view) {
    for (int j = box.j0; j < box.j1; j++) {
        for (int i = box.i0; i < box.i1; i++) {
            const size_t at = window_at(i, j);
            const double x = (i + 0.5) * scene->cell, y = (j + 0.5) * scene->cell;
            const double depth = mild_ground_imprint_at(scene->ground, x, y);
            const double stays = depth > 0 ? 1 - recovery_at(scene, x, y) : 0;
            window.kept[at] = window.shown[at] = (float)(depth * stays);
        }
    }
    mark_box(&box, view);
}

/* Moves the window so that a point is in its middle. */
static void follow(const WindowScene *scene, const double middle[2], WebView *view) {
    int first[2], again = 0;
    for (int k = 0; k < 2; k++) {
        const double cells = middle[k] / scene->cell;
        first[k] = WINDOW_STRIDE * (int)floor(cells / WINDOW_STRIDE) - WEB_WINDOW / 2;
        again |= abs(first[k] - window.first[k]) >= WEB_WINDOW / 2;
    }
    const int x = window.first[0], y = window.first[1];
    const int i0 = first[0], i1 = i0 + WEB_WINDOW, j0 = first[1], j1 = j0 + WEB_WINDOW;
    window.first[0] = i0;
    window.first[1] = j0;
    if (again) {
        recall(scene, (Box){i0, i1, j0, j1}, view);
        view->dirty_count = -1;
        return;
    }
    if (i0 != x) {
        recall(scene, (Box){i0 > x ? x + WEB_WINDOW : i0, i0 > x ? i1 : x, j0, j1}, view);
    }
    if (j0 != y) {
        recall(scene, (Box){i0, i1, j0 > y ? y + WEB_WINDOW : j0, j0 > y ? j1 : y}, view);
    }
}

/* ---- soles ---- */

/* [m] From the outline, at a point of the foot's frame. */
static double outline_distance(const Outline *outline, double x, double y) {
    const double u = (x - outline->x) / OUTLINE_STEP, v = (y - outline->y) / OUTLINE_STEP;
    if (!(u >= 0 && v >= 0 && u < outline->columns - 1 && v < outline->rows - 1)) {
        return OUTLINE_MARGIN;
    }
    const int i = (int)u, j = (int)v;
    const double s = u - i, t = v - j;
    const float *at = outline->distance + (size_t)j * (size_t)outline->columns + i;
    const float *above = at + outline->columns;
    return (1 - t) * ((1 - s) * (double)at[0] + s * (double)at[1]) +
           t * ((1 - s) * (double)above[0] + s * (double)above[1]);
}

/* [m] Depth of the deepest point of a sole. */
static double sole_deepest(const WindowScene *scene, int f) {
    const WebSole *sole = &scene->outline[f];
    const double *p = scene->input->position[f], *R = scene->input->rotation[f];
    double deepest = 0;
    for (int i = 0; i < sole->points; i++) {
        const double *at = sole->outline + 2 * i;
        const double x = p[0] + R[0] * at[0] + R[1] * at[1] + R[2] * sole->z;
        const double y = p[1] + R[3] * at[0] + R[4] * at[1] + R[5] * sole->z;
        const double z = p[2] + R[6] * at[0] + R[7] * at[1] + R[8] * sole->z;
        deepest = most(deepest, mild_terrain_height_at(scene->terrain, x, y) - z);
    }
    return deepest;
}

/* [m] Depth of the surface at a distance from what presses it to `depth`. */
static double beside(double depth, double away, double recovery) {
    const double slope = SLOPE_SAND + recovery * (SLOPE_FOAM - SLOPE_SAND);
    const double width = least(SLOPE_LEAST + depth * slope, SLOPE_MOST);
    const double share = least(most(1 - away / width, 0), 1);
    return share > 0 ? (depth + UNDER_SOLE) * share * share : 0;
}

/* The same under a sole, and on the slope around it, at a cell. deepest: of the sole, whose plane
 * goes on beyond it. */
static double sole_depth(const WindowScene *scene, int f, double deepest, double x, double y) {
    const double *p = scene->input->position[f], *R = scene->input->rotation[f];
    const double dx = x - p[0], dy = y - p[1];
    const double dz = (scene->outline[f].z - R[2] * dx - R[5] * dy) / R[8];
    const double away = outline_distance(&window.outline[f], R[0] * dx + R[3] * dy + R[6] * dz,
                                         R[1] * dx + R[4] * dy + R[7] * dz);
    if (away >= SLOPE_MOST) {
        return 0;
    }
    const double height = mild_terrain_height_at(scene->terrain, x, y);
    const double depth = least(height - p[2] - dz, deepest);
    return depth > 0 ? beside(depth, away, recovery_at(scene, x, y)) : 0;
}

/* Draws the soles in a box of cells. deepest: [feet] [m] their depths. */
static void press_soles(const WindowScene *scene, const Box *box, const double *deepest,
                        WebView *view) {
    for (int j = box->j0; j < box->j1; j++) {
        for (int i = box->i0; i < box->i1; i++) {
            const size_t at = window_at(i, j);
            const double x = (i + 0.5) * scene->cell, y = (j + 0.5) * scene->cell;
            double pressed = 0;
            for (int f = 0; f < scene->feet; f++) {
                const double depth = deepest[f] > 0 ? sole_depth(scene, f, deepest[f], x, y) : 0;
                pressed = most(pressed, depth);
            }
            if (pressed > 0) {
                const double left = pressed * (1 - recovery_at(scene, x, y));
                window.kept[at] = fmaxf(window.kept[at], (float)left);
            }
            const float depth = fmaxf(window.kept[at], (float)pressed);
            if (fabsf(depth - window.shown[at]) > WINDOW_LEAST || pressed == 0) {
                window.shown[at] = depth;
            }
        }
    }
    mark_box(box, view);
}

/* The cells around a foot. */
static Box sole_box(const WindowScene *scene, int f) {
    const double *p = scene->input->position[f], *R = scene->input->rotation[f];
    const Outline *outline = &window.outline[f];
    const double reach = 0.5 * OUTLINE_STEP * outline->columns, x = outline->x + reach;
    return (Box){(int)floor((p[0] + R[0] * x - reach) / scene->cell),
                 (int)ceil((p[0] + R[0] * x + reach) / scene->cell),
                 (int)floor((p[1] + R[3] * x - reach) / scene->cell),
                 (int)ceil((p[1] + R[3] * x + reach) / scene->cell)};
}

static void press_feet(const WindowScene *scene, WebView *view) {
    double deepest[ROBOT_FEET_MAX];
    for (int f = 0; f < scene->feet; f++) {
        const int on_side = scene->input->rotation[f][8] <= SOLE_LEVEL;
        deepest[f] = on_side ? 0 : sole_deepest(scene, f);
    }
    press_soles(scene, &window.pressed, deepest, view); /* it springs back where bodies were */
    for (int f = 0; f < scene->feet; f++) {
        const Box box = sole_box(scene, f), last = window.sole[f];
        if (abs(box.i0 - last.i0) > SOLE_JUMP || abs(box.j0 - last.j0) > SOLE_JUMP) {
            press_soles(scene, &last, deepest, view);
        }
        press_soles(scene, &box, deepest, view);
        window.sole[f] = box;
    }
}

/* ---- other bodies ---- */

/* Draws an element of a body. Returns the cells. */
static Box press_facet(const WindowScene *scene, const Facet *facet) {
    const double cell = scene->cell, x0 = facet->at[0], y0 = facet->at[1];
    const double under = mild_terrain_height_at(scene->terrain, x0, y0) - facet->at[2];
    const double recovery = recovery_at(scene, x0, y0);
    const double reach = facet->radius + least(SLOPE_LEAST + under, SLOPE_MOST);
    const Box box = {(int)floor((x0 - reach) / cell), (int)ceil((x0 + reach) / cell),
                     (int)floor((y0 - reach) / cell), (int)ceil((y0 + reach) / cell)};
    for (int j = box.j0; j < box.j1; j++) {
        for (int i = box.i0; i < box.i1; i++) {
            const size_t at = window_at(i, j);
            const double x = (i + 0.5) * cell, y = (j + 0.5) * cell;
            double away;
            const double z = facet_height(facet, x, y, &away);
            const double depth = mild_terrain_height_at(scene->terrain, x, y) - z;
            const double pressed = depth > 0 ? beside(depth, away, recovery) : 0;
            window.kept[at] = fmaxf(window.kept[at], (float)(pressed * (1 - recovery)));
            window.shown[at] = fmaxf(window.shown[at], (float)pressed);
        }
    }
    return box;
}

static void join(Box *box, const Box *more) {
    if (box->i0 == box->i1) {
        *box = *more;
        return;
    }
    box->i0 = more->i0 < box->i0 ? more->i0 : box->i0;
    box->i1 = more->i1 > box->i1 ? more->i1 : box->i1;
    box->j0 = more->j0 < box->j0 ? more->j0 : box->j0;
    box->j1 = more->j1 > box->j1 ? more->j1 : box->j1;
}

/* Draws the bodies with shells that are in the ground, after the soles. */
static void press_bodies(const WindowScene *scene, WebView *view) {
    window.pressed = (Box){0, 0, 0, 0};
    for (int b = scene->feet; b < scene->standing; b++) {
        if (!(scene->input->rows >> b & 1)) {
            continue;
        }
        const MildElements elements = mild_scratch_elements(scene->scratch, b);
        const int count =
            facets_of(scene->sole[b], scene->input->rotation[b], &elements, window.facet);
        for (int n = 0; n < count; n++) {
            const Box box = press_facet(scene, &window.facet[n]);
            join(&window.pressed, &box);
        }
    }
    mark_box(&window.pressed, view);
}

void window_show(const WindowScene *scene, double x, double y, int rigid, WebView *view) {
    const double middle[2] = {x, y};
    follow(scene, middle, view);
    if (rigid) {
        return;
    }
    press_feet(scene, view);
    press_bodies(scene, view);
}

/* ---- outlines ---- */

/* [m] From a point to the polygon, negative inside. */
static double polygon_distance(const WebSole *sole, double x, double y) {
    double nearest = OUTLINE_MARGIN * OUTLINE_MARGIN;
    int inside = 0;
    for (int i = 0; i < sole->points; i++) {
        const double *a = sole->outline + 2 * i;
        const double *b = sole->outline + 2 * ((i + 1) % sole->points);
        const double ex = b[0] - a[0], ey = b[1] - a[1];
        const double along = ((x - a[0]) * ex + (y - a[1]) * ey) / (ex * ex + ey * ey);
        const double share = least(most(along, 0), 1);
        const double dx = x - a[0] - share * ex, dy = y - a[1] - share * ey;
        nearest = least(nearest, dx * dx + dy * dy);
        if ((a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / ey * ex) {
            inside = !inside;
        }
    }
    return inside ? -sqrt(nearest) : sqrt(nearest);
}

static int open_outline(const WebSole *sole, Outline *outline) {
    double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
    for (int i = 0; i < 2 * sole->points; i++) {
        low[i % 2] = fmin(low[i % 2], sole->outline[i]);
        high[i % 2] = fmax(high[i % 2], sole->outline[i]);
    }
    outline->x = low[0] - OUTLINE_MARGIN;
    outline->y = low[1] - OUTLINE_MARGIN;
    outline->columns = (int)ceil((high[0] - low[0] + 2 * OUTLINE_MARGIN) / OUTLINE_STEP) + 1;
    outline->rows = (int)ceil((high[1] - low[1] + 2 * OUTLINE_MARGIN) / OUTLINE_STEP) + 1;
    const int nodes = outline->columns * outline->rows;
    outline->distance = malloc((size_t)nodes * sizeof *outline->distance);
    for (int n = 0; n < nodes && outline->distance; n++) {
        const double x = outline->x + OUTLINE_STEP * (n % outline->columns);
        const double y = outline->y + OUTLINE_STEP * (n / outline->columns);
        outline->distance[n] = (float)polygon_distance(sole, x, y);
    }
    return outline->distance != NULL;
}

int window_open(const WindowScene *scene) {
    int elements = 1;
    window_close();
    for (int f = 0; f < scene->feet; f++) {
        if (!open_outline(&scene->outline[f], &window.outline[f])) {
            return 0;
        }
    }
    for (int b = scene->feet; b < scene->standing; b++) {
        const int more = mild_sole_elements(scene->sole[b]);
        elements = more > elements ? more : elements;
    }
    window.facet = malloc((size_t)elements * sizeof *window.facet);
    window.shown = calloc(2 * (size_t)WEB_WINDOW * WEB_WINDOW, sizeof *window.shown);
    window.kept = window.shown ? window.shown + (size_t)WEB_WINDOW * WEB_WINDOW : NULL;
    return window.facet && window.shown;
}

void window_close(void) {
    for (int f = 0; f < ROBOT_FEET_MAX; f++) {
        free(window.outline[f].distance);
    }
    free(window.facet);
    free(window.shown);
    memset(&window, 0, sizeof window);
}

void window_clear(WebView *view) {
    memset(window.shown, 0, 2 * sizeof *window.shown * WEB_WINDOW * WEB_WINDOW);
    window.first[0] = window.first[1] = -WEB_WINDOW / 2;
    memset(window.sole, 0, sizeof window.sole);
    window.pressed = (Box){0, 0, 0, 0};
    view->dirty_count = -1;
}

const float *window_depths(void) {
    return window.shown;
}
