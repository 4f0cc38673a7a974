#include "view/relief.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MASK_PER_PITCH 4
#define SOLE_MARGIN                                                                                \
    0.005 /* [m] width of the gap drawn around a sole, which keeps its edge visible */
#define UNDER_SOLE 0.0015  /* [m] gap drawn below a sole, which prevents flicker */
#define CHANGE_SEEN 0.0003 /* [m] smaller changes are not uploaded */
#define SKIRT_MAX 0.10     /* [m] widest slope around a sole */
#define SHADE_DEPTH 0.020  /* [m] depth at which pressed ground is almost as dark as it gets */
#define SHADE_MOST 0.55F   /* [-] share of the light that the deepest ground loses */
#define SHADE_SLOPE 0.012  /* [m] depth that shades as much as a wall of 45 degrees */
#define TILE_INNER (RELIEF_TILE_PIXELS - 2 * RELIEF_TILE_MARGIN)
#define NO_DEPTH (-1e9f)

/* The shape of a sole and its surroundings, on a raster finer than its elements. */
typedef struct {
    const MildSole *sole;
    double x_min, y_min, step, z;
    double half; /* [m] half the edge of the square drawn for an element */
    int columns, rows;
    double reach;            /* [m] ankle to the farthest point of the raster */
    unsigned short *nearest; /* [rows][columns] element nearest to the cell */
} SoleMask;

typedef struct {
    int i0, i1, j0, j1; /* half-open vertex range */
} Box;

typedef enum { GRAIN_FINE, GRAIN_GRID, GRAIN_BLADES, GRAIN_SPECKLE, GRAIN_CHECKER } Grain;

typedef struct {
    float rgb[3];
    Grain grain;
} Look;

struct Relief {
    int columns, rows; /* tiles */
    int nx, ny;        /* vertices */
    double x0, y0, cell;
    double low, high; /* [m] of the undisturbed surface drawn */
    int uneven, rigid;
    int soles; /* of a robot */
    int feet;  /* of all robots; foot f has sole f % soles */
    MildTerrain terrain;
    Look look[MILD_MATERIALS_MAX + 1]; /* last: rigid */
    SoleMask mask[MILD_FEET_MAX];
    Box *last;           /* [feet] */
    const Facet *facets; /* [facet_count] of other bodies, borrowed */
    int facet_count;
    Box facet_box;                         /* vertices that they may press */
    double (*position)[3], (*rotation)[9]; /* [feet] */
    float *peak, *shown;                   /* [ny][nx] deepest and present depth of the surface */
    float *base;                           /* [ny][nx] [m] undisturbed height */
    int *pressed; /* [tiles] vertices that are not at their undisturbed height */
    unsigned char *dirty;
    signed char *material; /* [tiles] */
};

/* ---- looks ---- */

static const struct {
    const char *name;
    Look look;
} looks[] = {
    {"rubber", {{0.27F, 0.31F, 0.38F}, GRAIN_SPECKLE}},
    {"foam60", {{0.44F, 0.56F, 0.70F}, GRAIN_GRID}},
    {"foam45", {{0.82F, 0.78F, 0.66F}, GRAIN_GRID}},
    {"foam28", {{0.82F, 0.58F, 0.52F}, GRAIN_GRID}},
    {"foam25", {{0.70F, 0.60F, 0.76F}, GRAIN_GRID}},
    {"grass", {{0.35F, 0.56F, 0.24F}, GRAIN_BLADES}},
    {"sand_loose", {{0.76F, 0.62F, 0.40F}, GRAIN_FINE}},
    {"sand_dense", {{0.69F, 0.53F, 0.35F}, GRAIN_FINE}},
};
static const Look rigid_look = {{0.66F, 0.67F, 0.68F}, GRAIN_CHECKER};

static Look look_of(const char *name, const MildMaterial *material) {
    for (size_t i = 0; name && i < sizeof looks / sizeof *looks; i++) {
        if (strcmp(name, looks[i].name) == 0) {
            return looks[i].look;
        }
    }
    /* The user's own materials: elastic ones look like foam, plastic ones like sand. */
    return material->recovery > 0.5 ? looks[2].look : looks[6].look;
}

static unsigned hash(unsigned x, unsigned y, unsigned z) {
    unsigned h = x * 0x9e3779b1u ^ y * 0x85ebca77u ^ z * 0xc2b2ae3du;
    h ^= h >> 15;
    h *= 0x2c1b3c6du;
    h ^= h >> 12;
    h *= 0x297a2d39u;
    return h ^ (h >> 15);
}

/* Noise in [-1, 1], one value per block of pixels. */
static float noise(int px, int py, int width, int height, unsigned layer) {
    unsigned h = hash((unsigned)(px / width), (unsigned)(py / height), layer);
    return (float)(h & 0xffffu) / 32767.5F - 1.0F;
}

/* Relative brightness of the undisturbed ground at a pixel; periodic in the tile so that tiles
 * join. */
static float grain_shade(Grain grain, int px, int py) {
    px = (px + TILE_INNER - RELIEF_TILE_MARGIN) % TILE_INNER;
    py = (py + TILE_INNER - RELIEF_TILE_MARGIN) % TILE_INNER;
    switch (grain) {
    case GRAIN_FINE: return 1.0F + 0.10F * noise(px, py, 1, 1, 1) + 0.05F * noise(px, py, 4, 4, 2);
    case GRAIN_GRID: /* lines every 8 cm: a dent bends them */
        return (px % 15 == 0 || py % 15 == 0 ? 0.80F : 1.0F) + 0.03F * noise(px, py, 2, 2, 3);
    case GRAIN_BLADES:
        return 1.0F + 0.22F * noise(px, py, 1, 4, 4) + 0.12F * noise(px, py, 4, 2, 5);
    case GRAIN_SPECKLE:
        return noise(px, py, 2, 2, 6) > 0.86F ? 1.7F : 1.0F + 0.05F * noise(px, py, 1, 1, 7);
    default: /* checker of half a tile */
        return ((px / (TILE_INNER / 2) + py / (TILE_INNER / 2)) % 2 ? 0.94F : 1.0F) +
               0.015F * noise(px, py, 1, 1, 8);
    }
}

static void paint(const Look *look, int px, int py, float dark, unsigned char *rgb) {
    float shade = grain_shade(look->grain, px, py) * (1.0F - dark);
    for (int c = 0; c < 3; c++) {
        float v = look->rgb[c] * shade * 255.0F;
        rgb[c] = (unsigned char)(v < 0.0F ? 0.0F : v > 255.0F ? 255.0F : v);
    }
}

/* ---- sole raster ---- */

static double outside(double value, double half) {
    return fmax(fabs(value) - half, 0.0);
}

/* The squares of neighbours overlap by the gap around a sole. Inside several the point belongs to
 * the nearest centre, so that it is well inside. */
static unsigned short nearest_element(const SoleMask *mask, double px, double py) {
    const double *x = mild_sole_x(mask->sole), *y = mild_sole_y(mask->sole);
    double least = INFINITY, least_center = INFINITY;
    int best = 0;
    for (int e = 0; e < mild_sole_elements(mask->sole); e++) {
        double dx = px - x[e], dy = py - y[e];
        double distance = hypot(outside(dx, mask->half), outside(dy, mask->half));
        double center = fmax(fabs(dx), fabs(dy));
        if (distance < least || (distance == least && center < least_center)) {
            least = distance;
            least_center = center;
            best = e;
        }
    }
    return (unsigned short)best;
}

static int mask_create(SoleMask *mask, const MildSole *sole) {
    double margin, x_max = -1e9, y_max = -1e9;
    const double *x = mild_sole_x(sole), *y = mild_sole_y(sole);
    mask->sole = sole;
    mask->z = mild_sole_z(sole);
    mask->half = 0.5 * mild_sole_pitch(sole) + SOLE_MARGIN;
    mask->x_min = mask->y_min = 1e9;
    mask->reach = 0;
    margin = mask->half + SKIRT_MAX;
    for (int e = 0; e < mild_sole_elements(sole); e++) {
        mask->x_min = fmin(mask->x_min, x[e] - margin);
        mask->y_min = fmin(mask->y_min, y[e] - margin);
        x_max = fmax(x_max, x[e] + margin), y_max = fmax(y_max, y[e] + margin);
        mask->reach = fmax(mask->reach, hypot(hypot(x[e], y[e]), mask->z) + 1.5 * margin);
    }
    mask->step = mild_sole_pitch(sole) / MASK_PER_PITCH;
    mask->columns = (int)ceil((x_max - mask->x_min) / mask->step);
    mask->rows = (int)ceil((y_max - mask->y_min) / mask->step);
    mask->nearest = malloc((size_t)mask->columns * (size_t)mask->rows * sizeof *mask->nearest);
    if (!mask->nearest) {
        return 0;
    }
    for (int r = 0; r < mask->rows; r++) {
        for (int c = 0; c < mask->columns; c++) {
            mask->nearest[r * mask->columns + c] = nearest_element(
                mask, mask->x_min + (c + 0.5) * mask->step, mask->y_min + (r + 0.5) * mask->step);
        }
    }
    return 1;
}

/* Depth [m] of the surface at a distance [m] from the edge of a sole that is `depth` deep:
 * depth (1 - 3 s^2 + 2 s^3), s = distance/run. Grains stand steeper than a sheet that is pulled
 * down with the sole, so the run grows with `recovery`. */
static double skirt(double depth, double distance, double recovery) {
    double run = fmin(0.012 + 0.018 * recovery + (0.40 + 0.80 * recovery) * depth, SKIRT_MAX);
    double s = fmin(distance / run, 1.0);
    return depth * (1.0 - s * s * (3.0 - 2.0 * s));
}

/* Depth to which a foot presses the surface under the vertical through (x, y): that of the sole
 * plane under the sole, a smooth slope beside it, NO_DEPTH farther away. The plane's points p have
 * n.(p - ankle) = z_sole, n the foot's z axis. */
static float sole_depth(const Relief *relief, int foot, double x, double y, double surface,
                        double recovery) {
    const SoleMask *mask = &relief->mask[foot % relief->soles];
    const double *p = relief->position[foot], *r = relief->rotation[foot];
    double dx = x - p[0], dy = y - p[1];
    if (r[8] < 0.2) { /* the foot lies on its side */
        return NO_DEPTH;
    }
    double dz = (mask->z - r[2] * dx - r[5] * dy) / r[8];
    double sx = r[0] * dx + r[3] * dy + r[6] * dz, sy = r[1] * dx + r[4] * dy + r[7] * dz;
    double fc = (sx - mask->x_min) / mask->step, fr = (sy - mask->y_min) / mask->step;
    if (fc < 0 || fr < 0 || fc >= mask->columns || fr >= mask->rows) {
        return NO_DEPTH;
    }
    int e = mask->nearest[(int)fr * mask->columns + (int)fc];
    double cx = mild_sole_x(mask->sole)[e], cy = mild_sole_y(mask->sole)[e], half = mask->half;
    double qx = fmin(fmax(sx, cx - half), cx + half), qy = fmin(fmax(sy, cy - half), cy + half);
    double z = p[2] + r[6] * qx + r[7] * qy + r[8] * mask->z; /* of the sole's nearest point */
    double depth = surface - z + UNDER_SOLE;
    if (depth <= UNDER_SOLE) {
        return NO_DEPTH;
    }
    return (float)skirt(depth, hypot(sx - qx, sy - qy), recovery);
}

/* The same of the facets. */
static float facets_depth(const Relief *relief, double x, double y, double surface,
                          double recovery) {
    float deepest = NO_DEPTH;
    for (int n = 0; n < relief->facet_count; n++) {
        const Facet *facet = &relief->facets[n];
        const double reach = facet->radius + SKIRT_MAX;
        double away;
        if (fabs(x - facet->at[0]) > reach || fabs(y - facet->at[1]) > reach) {
            continue;
        }
        const double depth = surface - facet_height(facet, x, y, &away) + UNDER_SOLE;
        if (depth > UNDER_SOLE) {
            deepest = fmaxf(deepest, (float)skirt(depth, away, recovery));
        }
    }
    return deepest;
}

/* ---- surface ---- */

static int box_has(const Box *box, int i, int j) {
    return i >= box->i0 && i < box->i1 && j >= box->j0 && j < box->j1;
}

static const MildMaterial *material_at(const Relief *relief, double x, double y) {
    return &relief->terrain.materials[mild_terrain_material_at(&relief->terrain, x, y)];
}

/* The tiles of a vertex, and those of its neighbours, whose normals it changes, must be drawn
 * again. pressed: 1 when the vertex was undisturbed before, -1 when it is again, else 0. */
static void mark(Relief *relief, int i, int j, int pressed) {
    int c0 = (i + RELIEF_TILE_CELLS - 2) / RELIEF_TILE_CELLS - 1, c1 = (i + 1) / RELIEF_TILE_CELLS;
    int r0 = (j + RELIEF_TILE_CELLS - 2) / RELIEF_TILE_CELLS - 1, r1 = (j + 1) / RELIEF_TILE_CELLS;
    for (int r = r0 > 0 ? r0 : 0; r <= r1 && r < relief->rows; r++) {
        for (int c = c0 > 0 ? c0 : 0; c <= c1 && c < relief->columns; c++) {
            relief->pressed[r * relief->columns + c] += pressed;
            relief->dirty[r * relief->columns + c] = 1;
        }
    }
}

static void update_vertex(Relief *relief, int i, int j) {
    double x = relief->x0 + i * relief->cell, y = relief->y0 + j * relief->cell;
    size_t at = (size_t)j * (size_t)relief->nx + (size_t)i;
    double recovery = material_at(relief, x, y)->recovery;
    float depth = 0;
    for (int f = 0; f < relief->feet; f++) {
        if (box_has(&relief->last[f], i, j)) {
            depth = fmaxf(depth, sole_depth(relief, f, x, y, (double)relief->base[at], recovery));
        }
    }
    if (box_has(&relief->facet_box, i, j)) {
        depth = fmaxf(depth, facets_depth(relief, x, y, (double)relief->base[at], recovery));
    }
    if (depth <= 0.0F && relief->peak[at] <= 0.0F) {
        return;
    }
    relief->peak[at] = fmaxf(relief->peak[at], depth);
    float left = (float)(1.0 - recovery) * relief->peak[at];
    float before = relief->shown[at], shown = fmaxf(left, depth);
    int pressed = (shown > 0.0F) - (before > 0.0F);
    if (pressed || fabsf(shown - before) > (float)CHANGE_SEEN) {
        relief->shown[at] = shown;
        mark(relief, i, j, pressed);
    }
}

/* The vertices between two places. */
static Box box_between(const Relief *relief, const double low[2], const double high[2]) {
    const double i0 = floor((low[0] - relief->x0) / relief->cell);
    const double i1 = ceil((high[0] - relief->x0) / relief->cell);
    const double j0 = floor((low[1] - relief->y0) / relief->cell);
    const double j1 = ceil((high[1] - relief->y0) / relief->cell);
    return (Box){.i0 = (int)fmin(fmax(i0, 0), relief->nx),
                 .i1 = (int)fmin(fmax(i1, 0), relief->nx),
                 .j0 = (int)fmin(fmax(j0, 0), relief->ny),
                 .j1 = (int)fmin(fmax(j1, 0), relief->ny)};
}

/* The vertices that a foot may press: none while it swings above the highest ground. */
static Box foot_box(const Relief *relief, int foot) {
    const SoleMask *mask = &relief->mask[foot % relief->soles];
    const double *p = relief->position[foot], *r = relief->rotation[foot];
    double reach = mask->reach, x = mask->x_min, y = mask->y_min;
    double x_end = x + mask->columns * mask->step, y_end = y + mask->rows * mask->step;
    double lowest =
        p[2] + r[8] * mask->z + fmin(r[6] * x, r[6] * x_end) + fmin(r[7] * y, r[7] * y_end);
    const double low[2] = {p[0] - reach, p[1] - reach}, high[2] = {p[0] + reach, p[1] + reach};
    return lowest > relief->high ? (Box){0, 0, 0, 0} : box_between(relief, low, high);
}

/* And those that the facets may press. */
static Box facets_box(const Relief *relief) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int n = 0; n < relief->facet_count; n++) {
        const Facet *facet = &relief->facets[n];
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], facet->at[k] - facet->radius - SKIRT_MAX);
            high[k] = fmax(high[k], facet->at[k] + facet->radius + SKIRT_MAX);
        }
    }
    return relief->facet_count == 0 ? (Box){0, 0, 0, 0} : box_between(relief, low, high);
}

static void update_box(Relief *relief, Box box) {
    for (int j = box.j0; j < box.j1; j++) {
        for (int i = box.i0; i < box.i1; i++) {
            update_vertex(relief, i, j);
        }
    }
}

void relief_press(Relief *relief, int robot, const double (*position)[3],
                  const double (*rotation)[9]) {
    const int first = robot * relief->soles, behind = first + relief->soles;
    if (relief->rigid) {
        return;
    }
    memcpy(relief->position[first], position, (size_t)relief->soles * sizeof *position);
    memcpy(relief->rotation[first], rotation, (size_t)relief->soles * sizeof *rotation);
    for (int f = first; f < behind; f++) {
        const Box before = relief->last[f];
        relief->last[f] = foot_box(relief, f);
        update_box(relief, before); /* the ground springs back where the foot was */
        update_box(relief, relief->last[f]);
    }
}

void relief_press_facets(Relief *relief, const Facet *facets, int count) {
    const Box last = relief->facet_box;
    if (relief->rigid) {
        return;
    }
    relief->facets = facets;
    relief->facet_count = count;
    relief->facet_box = facets_box(relief);
    update_box(relief, last); /* the ground springs back where they were */
    update_box(relief, relief->facet_box);
}

/* ---- creation ---- */

static void find_materials(Relief *relief) {
    double edge = relief_tile_edge(relief);
    for (int t = 0; t < relief->columns * relief->rows; t++) {
        double center[2];
        relief_tile_center(relief, t, center);
        int first = -2;
        for (int k = 0; k < 81; k++) { /* patches are larger than an eighth of a tile */
            double x = center[0] + edge * ((k % 9) / 8.0 - 0.5) * 0.998,
                   y = center[1] + edge * ((k / 9) / 8.0 - 0.5) * 0.998;
            int m = relief->rigid ? RELIEF_RIGID : mild_terrain_material_at(&relief->terrain, x, y);
            if (k == 0) {
                first = m;
            } else if (m != first) {
                first = -2, k = 81;
            }
        }
        relief->material[t] = (signed char)first;
    }
}

static int allocate(Relief *relief, const MildSole *const *soles) {
    size_t vertices = (size_t)relief->nx * (size_t)relief->ny,
           tiles = (size_t)relief->columns * (size_t)relief->rows;
    relief->peak = calloc(3 * vertices, sizeof *relief->peak);
    relief->pressed = calloc(tiles, sizeof *relief->pressed);
    relief->dirty = calloc(2 * tiles, 1);
    relief->last = calloc((size_t)relief->feet, sizeof *relief->last);
    relief->position = calloc((size_t)relief->feet, sizeof *relief->position);
    relief->rotation = calloc((size_t)relief->feet, sizeof *relief->rotation);
    if (!relief->peak || !relief->pressed || !relief->dirty || !relief->last || !relief->position ||
        !relief->rotation) {
        return 0;
    }
    relief->shown = relief->peak + vertices;
    relief->base = relief->shown + vertices;
    relief->material = (signed char *)(relief->dirty + tiles);
    for (int f = 0; f < relief->soles; f++) {
        if (!mask_create(&relief->mask[f], soles[f])) {
            return 0;
        }
    }
    return 1;
}

static void find_heights(Relief *relief) {
    relief->low = INFINITY, relief->high = -INFINITY;
    for (int j = 0; j < relief->ny; j++) {
        for (int i = 0; i < relief->nx; i++) {
            double z = mild_terrain_height_at(&relief->terrain, relief->x0 + i * relief->cell,
                                              relief->y0 + j * relief->cell);
            relief->base[(size_t)j * (size_t)relief->nx + (size_t)i] = (float)z;
            relief->low = fmin(relief->low, z), relief->high = fmax(relief->high, z);
        }
    }
}

Relief *relief_create(const ReliefDef *def, const MildTerrain *terrain,
                      const MildSole *const *soles, int feet, MildError *error) {
    double edge = RELIEF_TILE_CELLS * def->cell;
    double columns = ceil((def->x_max - def->x_min) / edge),
           rows = ceil((def->y_max - def->y_min) / edge);
    if (!(def->cell > 0) || !(columns >= 1 && columns * rows <= 20000 && rows >= 1)) {
        mild_fail(error, MILD_ERROR_RANGE,
                  "ground picture: %g x %g m at %g m is empty or too large: walk a shorter way",
                  def->x_max - def->x_min, def->y_max - def->y_min, def->cell);
        return NULL;
    }
    Relief *relief = calloc(1, sizeof *relief);
    if (!relief) {
        mild_fail(error, MILD_ERROR_MEMORY, "ground picture: out of memory");
        return NULL;
    }
    relief->columns = (int)columns, relief->rows = (int)rows;
    relief->nx = relief->columns * RELIEF_TILE_CELLS + 1,
    relief->ny = relief->rows * RELIEF_TILE_CELLS + 1;
    relief->x0 = def->x_min, relief->y0 = 0.5 * (def->y_min + def->y_max - rows * edge);
    relief->cell = def->cell, relief->rigid = def->rigid;
    relief->soles = feet, relief->feet = feet * def->robots;
    relief->terrain = *terrain;
    relief->uneven = terrain->map && !mild_map_is_level(terrain->map);
    for (int m = 0; m < terrain->material_count; m++) {
        relief->look[m] = look_of(def->names ? def->names[m] : NULL, &terrain->materials[m]);
    }
    relief->look[MILD_MATERIALS_MAX] = rigid_look;
    if (!allocate(relief, soles)) {
        mild_fail(error, MILD_ERROR_MEMORY, "ground picture: out of memory");
        relief_destroy(relief);
        return NULL;
    }
    find_heights(relief);
    find_materials(relief);
    return relief;
}

void relief_destroy(Relief *relief) {
    if (!relief) {
        return;
    }
    for (int f = 0; f < relief->soles; f++) {
        free(relief->mask[f].nearest);
    }
    free(relief->last);
    free(relief->position);
    free(relief->rotation);
    free(relief->peak);
    free(relief->pressed);
    free(relief->dirty);
    free(relief);
}

/* ---- tiles ---- */

int relief_tile_columns(const Relief *relief) {
    return relief->columns;
}

int relief_tile_rows(const Relief *relief) {
    return relief->rows;
}

double relief_tile_edge(const Relief *relief) {
    return RELIEF_TILE_CELLS * relief->cell;
}

int relief_is_uneven(const Relief *relief) {
    return relief->uneven;
}

double relief_low(const Relief *relief) {
    return relief->low;
}

double relief_height_at(const Relief *relief, double x, double y) {
    return mild_terrain_height_at(&relief->terrain, x, y);
}

void relief_tile_center(const Relief *relief, int tile, double center[2]) {
    double edge = relief_tile_edge(relief);
    center[0] = relief->x0 + (tile % relief->columns + 0.5) * edge;
    center[1] = relief->y0 + (tile / relief->columns + 0.5) * edge;
}

int relief_tile_material(const Relief *relief, int tile) {
    return relief->material[tile];
}

int relief_tile_pressed(const Relief *relief, int tile) {
    return relief->pressed[tile] > 0;
}

int relief_tile_take_dirty(Relief *relief, int tile) {
    int dirty = relief->dirty[tile];
    relief->dirty[tile] = 0;
    return dirty;
}

/* Of the vertex in the tile's lower left corner. */
static void tile_origin(const Relief *relief, int tile, int *i, int *j) {
    *i = tile % relief->columns * RELIEF_TILE_CELLS;
    *j = tile / relief->columns * RELIEF_TILE_CELLS;
}

/* Height [m] of a vertex. Indices outside the area drawn are those of its edge. */
static float height(const Relief *relief, int i, int j) {
    int column = i < 0 ? 0 : i >= relief->nx ? relief->nx - 1 : i;
    int row = j < 0 ? 0 : j >= relief->ny ? relief->ny - 1 : j;
    size_t at = (size_t)row * (size_t)relief->nx + (size_t)column;
    return relief->base[at] - relief->shown[at];
}

void relief_tile_surface(const Relief *relief, int tile, int step, float *position, float *normal) {
    int i0, j0;
    tile_origin(relief, tile, &i0, &j0);
    const float run = 2.0F * (float)step * (float)relief->cell;
    for (int j = j0; j <= j0 + RELIEF_TILE_CELLS; j += step) {
        for (int i = i0; i <= i0 + RELIEF_TILE_CELLS; i += step, position += 3, normal += 3) {
            position[0] = (float)(relief->x0 + i * relief->cell);
            position[1] = (float)(relief->y0 + j * relief->cell);
            position[2] = height(relief, i, j);
            /* of the plane through the four neighbours */
            float sx = (height(relief, i + step, j) - height(relief, i - step, j)) / run;
            float sy = (height(relief, i, j + step) - height(relief, i, j - step)) / run;
            float size = sqrtf(1.0F + sx * sx + sy * sy);
            normal[0] = -sx / size, normal[1] = -sy / size, normal[2] = 1.0F / size;
        }
    }
}

/* Depth [m] of the drawn surface and its slope [-], linear between the vertices. */
typedef struct {
    double depth, slope;
} Dent;

/* (fi, fj): place in vertices, inside the area. */
static Dent dent_at(const Relief *relief, double fi, double fj) {
    int i = (int)fmin(fi, relief->nx - 2), j = (int)fmin(fj, relief->ny - 2);
    const float *low = relief->shown + (size_t)j * (size_t)relief->nx + i, *high = low + relief->nx;
    double u = fi - i, v = fj - j;
    double left = (1 - v) * (double)low[0] + v * (double)high[0];
    double right = (1 - v) * (double)low[1] + v * (double)high[1];
    double bottom = (1 - u) * (double)low[0] + u * (double)low[1];
    double top = (1 - u) * (double)high[0] + u * (double)high[1];
    return (Dent){(1 - u) * left + u * right, hypot(right - left, top - bottom) / relief->cell};
}

double relief_depth_at(const Relief *relief, double x, double y) {
    double fi = (x - relief->x0) / relief->cell, fj = (y - relief->y0) / relief->cell;
    if (!(fi >= 0 && fi <= relief->nx - 1 && fj >= 0 && fj <= relief->ny - 1)) {
        return 0;
    }
    return dent_at(relief, fi, fj).depth;
}

static const Look *look_at(const Relief *relief, int material) {
    return &relief->look[material == RELIEF_RIGID ? MILD_MATERIALS_MAX : material];
}

/* Tile coordinate in [0, 1) of a pixel's centre. Pixels of the margin repeat the edge. */
static double inner(int pixel) {
    return fmin(fmax((pixel - RELIEF_TILE_MARGIN + 0.5) / TILE_INNER, 0.0), 1.0 - 1e-9);
}

/* Share of the light that a dent loses. It stands in for the shadows of its walls, because the
 * ground casts none, and makes imprints distinct. */
static float dent_shade(Dent dent) {
    if (!(dent.depth > 0)) {
        return 0.0F;
    }
    double shade = (dent.depth + SHADE_SLOPE * dent.slope) / SHADE_DEPTH;
    return SHADE_MOST * (1.0F - expf(-(float)shade));
}

void relief_tile_pixels(const Relief *relief, int tile, unsigned char *rgb) {
    int i0, j0;
    tile_origin(relief, tile, &i0, &j0);
    for (int py = 0; py < RELIEF_TILE_PIXELS; py++) {
        /* picture rows go down, y goes up */
        double fj = j0 + RELIEF_TILE_CELLS * inner(RELIEF_TILE_PIXELS - 1 - py);
        for (int px = 0; px < RELIEF_TILE_PIXELS; px++, rgb += 3) {
            double fi = i0 + RELIEF_TILE_CELLS * inner(px);
            double x = relief->x0 + fi * relief->cell, y = relief->y0 + fj * relief->cell;
            int material =
                relief->rigid ? RELIEF_RIGID : mild_terrain_material_at(&relief->terrain, x, y);
            paint(look_at(relief, material), px, py, dent_shade(dent_at(relief, fi, fj)), rgb);
        }
    }
}

void relief_flat_pixels(const Relief *relief, int material, unsigned char *rgb) {
    for (int py = 0; py < RELIEF_TILE_PIXELS; py++) {
        for (int px = 0; px < RELIEF_TILE_PIXELS; px++, rgb += 3) {
            paint(look_at(relief, material), px, py, 0.0F, rgb);
        }
    }
}
