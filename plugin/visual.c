#include "plugin/plugin.h"

#include <math.h>
#include <string.h>

#include "ground/step/state.h"

#define ABOVE 0.001  /* [m] height of a patch above the ground, so that a floor does not hide it */
#define DARKEST 0.03 /* [m] depth at which pressed ground is darkest */
#define BLOCK 2      /* cells along the edge of a patch */
#define SQUARES 3    /* of the surface */
#define TILES 32     /* along the edge of a square, a multiple of 4 */
#define TILE_EDGE 0.04           /* [m] in the smallest square */
#define TILE_DEPTH 0.01          /* [m] thickness of a tile */
#define PART 2                   /* cells along the edge of a plate that follows a dent */
#define CELLS 4                  /* of Dents, along the edge of the smallest tile */
#define NEAR (2 * TILES * CELLS) /* cells along the edge of Dents: the second square */
#define CHECKER 0.32             /* [m] edge of a check, a multiple of the largest tile's */
#define FAR 50.0                 /* [m] half the edge of level ground */

/* How deep the two smallest squares are pressed, in cells of TILE_EDGE / CELLS. */
typedef struct {
    double x0, y0;           /* [m] its corner */
    float depth[NEAR][NEAR]; /* [m] rows along y */
} Dents;

/* ---- colours ---- */

/* Of presets, by how their names begin; the first that does. */
static const struct {
    const char *name;
    float rgb[3];
} colours[] = {
    {"sandy_loam", {0.55F, 0.43F, 0.30F}}, {"sand", {0.70F, 0.58F, 0.40F}},
    {"dry_sand", {0.70F, 0.58F, 0.40F}},   {"grass", {0.36F, 0.52F, 0.26F}},
    {"rubber", {0.35F, 0.35F, 0.38F}},     {"foam", {0.55F, 0.62F, 0.72F}},
    {"clay", {0.55F, 0.38F, 0.30F}},       {"snow", {0.93F, 0.95F, 0.98F}},
    {"lunar", {0.5F, 0.5F, 0.5F}},
};

void visual_colour(const char *name, const MildMaterial *material, float rgb[3]) {
    const int elastic = material->recovery > 0.5;
    const float *found = elastic ? colours[5].rgb : colours[1].rgb; /* foam, sand */
    for (size_t i = 0; name && i < sizeof colours / sizeof *colours; i++) {
        if (strncmp(name, colours[i].name, strlen(colours[i].name)) == 0) {
            found = colours[i].rgb;
            break;
        }
    }
    memcpy(rgb, found, 3 * sizeof *rgb);
}

/* The colour of the ground at a place; the deeper it is pressed, the darker. */
static void colour_at(const Soft *soft, double x, double y, double depth, float shade,
                      float rgba[4]) {
    const int label = mild_terrain_material_at(&soft->terrain, x, y);
    const float *rgb = soft->colour[label >= 0 ? label : 0];
    const float dark = shade * (1 - 0.4f * (float)fmin(fmax(depth, 0) / DARKEST, 1));
    for (int k = 0; k < 3; k++) {
        rgba[k] = dark * rgb[k];
    }
    rgba[3] = 1;
}

/* ---- plates ---- */

static mjvGeom *next_geom(mjvScene *scene) {
    return scene->ngeom < scene->maxgeom ? &scene->geoms[scene->ngeom++] : NULL;
}

/* A square plate at (x, y), tilted as the ground is whose heights are [m] (-,-), (+,-), (-,+),
 * (+,+) at its corners. lift: [m] of its top above the ground, depth: [m] its thickness. */
static void add_plate(mjvScene *scene, int category, const double heights[4], double x, double y,
                      double edge, double lift, double depth, const float rgba[4]) {
    const double a = edge / 2;
    const double sx = (heights[1] + heights[3] - heights[0] - heights[2]) / (2 * edge);
    const double sy = (heights[2] + heights[3] - heights[0] - heights[1]) / (2 * edge);
    const double size[3] = {a * sqrt(1 + sx * sx), a * sqrt(1 + sy * sy), depth / 2};
    double u[3] = {1, 0, sx}, v[3], normal[3] = {-sx, -sy, 1};
    double at[3] = {x, y, (heights[0] + heights[1] + heights[2] + heights[3]) / 4};
    mjvGeom *geom = next_geom(scene);
    if (geom) {
        mju_normalize3(u);
        mju_normalize3(normal);
        mju_cross(v, normal, u);
        mju_addToScl3(at, normal, lift - depth / 2);
        const double turn[9] = {u[0],      v[0], normal[0], u[1],     v[1],
                                normal[1], u[2], v[2],      normal[2]};
        mjv_initGeom(geom, mjGEOM_BOX, size, at, turn, rgba);
        geom->category = category;
    }
}

/* The undisturbed ground at the corners of a square. */
static void corners_of(const MildTerrain *terrain, double x, double y, double edge,
                       double heights[4]) {
    for (int k = 0; k < 4; k++) {
        heights[k] =
            mild_terrain_height_at(terrain, x + edge * (k % 2 - 0.5), y + edge * (k / 2 - 0.5));
    }
}

/* ---- pressed ground ---- */

/* Where a square of the ground is pressed down to `depth`. */
typedef void (*Pressed)(void *self, const Soft *soft, double x, double y, double edge,
                        double depth);

/* On a floor that hides what lies below it: a flat dark patch. self: the scene. */
static void add_patch(void *self, const Soft *soft, double x, double y, double edge, double depth) {
    float rgba[4];
    double heights[4];
    colour_at(soft, x, y, depth, 0.7f, rgba);
    rgba[3] = 0.35f + 0.55f * (float)fmin(depth / DARKEST, 1);
    corners_of(&soft->terrain, x, y, edge, heights);
    add_plate(self, mjCAT_DECOR, heights, x, y, edge, 1.5 * ABOVE, ABOVE, rgba);
}

/* In Dents: the cells whose middles it covers, and a little more, so that none between two elements
 * is left out. */
static void add_dent(void *self, const Soft *soft, double x, double y, double edge, double depth) {
    Dents *dents = self;
    const double cell = TILE_EDGE / CELLS, half = 0.55 * edge + 0.5 * cell;
    const int i0 = (int)ceil((x - half - dents->x0) / cell - 0.5);
    const int j0 = (int)ceil((y - half - dents->y0) / cell - 0.5);
    (void)soft;
    for (int j = j0 > 0 ? j0 : 0; j < NEAR && dents->y0 + (j + 0.5) * cell <= y + half; j++) {
        for (int i = i0 > 0 ? i0 : 0; i < NEAR && dents->x0 + (i + 0.5) * cell <= x + half; i++) {
            dents->depth[j][i] = fmaxf(dents->depth[j][i], (float)depth);
        }
    }
}

/* Elements that a foot or body presses down now. */
static void add_elements(const Soft *soft, const MildGround *ground, int f, Pressed pressed,
                         void *self) {
    const MildSole *sole = soft->soles[f];
    const double *depth = mild_ground_depth_max(ground, f), *area = mild_sole_surface_area(sole);
    const double *p = soft->input.position[f], *turn = soft->input.rotation[f];
    for (int e = 0; e < mild_sole_elements(sole) && ground->touched[f] > 0; e++) {
        const double a = mild_sole_x(sole)[e], b = mild_sole_y(sole)[e];
        const double z = area ? mild_sole_surface_z(sole)[e] : mild_sole_z(sole);
        if (depth[e] > 0) {
            pressed(self, soft, p[0] + turn[0] * a + turn[1] * b + turn[2] * z,
                    p[1] + turn[3] * a + turn[4] * b + turn[5] * z,
                    area ? sqrt(area[e]) : mild_sole_pitch(sole), depth[e]);
        }
    }
}

/* One tile of imprints: BLOCK x BLOCK cells in a patch. */
static void add_print(const Soft *soft, const Imprints *imprints, int tile, Pressed pressed,
                      void *self) {
    const double cell = 1 / imprints->inverse_cell;
    const uint32_t place = imprints->keys[tile].place;
    const int column = (int16_t)(place & 0xffff), row = (int16_t)(place >> 16);
    const uint16_t *depths = imprints->depths + tile * IMPRINT_EDGE * IMPRINT_EDGE;
    for (int j = 0; j < IMPRINT_EDGE; j += BLOCK) {
        for (int i = 0; i < IMPRINT_EDGE; i += BLOCK) {
            int sum = 0;
            for (int k = 0; k < BLOCK * BLOCK; k++) {
                sum += depths[(j + k / BLOCK) * IMPRINT_EDGE + i + k % BLOCK];
            }
            if (sum > 0) {
                pressed(self, soft, (column * IMPRINT_EDGE + i + 0.5 * BLOCK) * cell,
                        (row * IMPRINT_EDGE + j + 0.5 * BLOCK) * cell, BLOCK * cell,
                        sum * IMPRINT_UNIT / (BLOCK * BLOCK));
            }
        }
    }
}

/* All ground that is pressed now or remembered to be. */
static void add_pressed(const Soft *soft, const MildGround *ground, Pressed pressed, void *self) {
    const Imprints imprints = ground_imprints(ground);
    for (int f = 0; f < soft->feet; f++) {
        add_elements(soft, ground, f, pressed, self);
    }
    for (int tile = 0; tile < imprints.tiles; tile++) {
        if (imprints.keys[tile].time != 0) {
            add_print(soft, &imprints, tile, pressed, self);
        }
    }
}

static void add_forces(const Soft *soft, const mjModel *m, mjvScene *scene) {
    for (int f = 0; f < soft->feet; f++) {
        const MildFootResult *foot = &soft->contact.foot[f];
        mjvGeom *geom = foot->contacts > 0 ? next_geom(scene) : NULL;
        double end[3];
        if (geom) {
            mju_addScl3(end, foot->pressure_center, foot->force,
                        (double)m->vis.map.force / (m->stat.meanmass > 0 ? m->stat.meanmass : 1));
            mjv_initGeom(geom, mjGEOM_ARROW, NULL, NULL, NULL, m->vis.rgba.contactforce);
            mjv_connector(geom, mjGEOM_ARROW, (double)m->vis.scale.forcewidth * m->stat.meansize,
                          foot->pressure_center, end);
            geom->category = mjCAT_DECOR;
        }
    }
}

/* ---- the surface ---- */

/* Bool: the ground is to be drawn: asked for, or uneven without a height field of the model that
 * stands for it. */
static int shows_surface(const Soft *soft, const mjModel *m, const mjvOption *option) {
    for (int g = 0; g < m->ngeom && !soft->def.surface; g++) {
        if (m->geom_type[g] == mjGEOM_HFIELD && m->body_weldid[m->geom_bodyid[g]] == 0) {
            return 0;
        }
    }
    return option->flags[mjVIS_STATIC] &&
           (soft->def.surface || (soft->map && !mild_map_is_level(soft->map)));
}

static float shade_at(double x, double y) {
    return fmod(floor(x / CHECKER) + floor(y / CHECKER), 2) == 0 ? 1 : 0.93f;
}

static void add_tile(const Soft *soft, mjvScene *scene, double x, double y, double edge) {
    double heights[4];
    float rgba[4];
    corners_of(&soft->terrain, x, y, edge, heights);
    colour_at(soft, x, y, 0, shade_at(x, y), rgba);
    add_plate(scene, mjCAT_STATIC, heights, x, y, edge, 0, TILE_DEPTH, rgba);
}

/* [m] Depth at a corner of cells: the mean of the four that meet there; at the edge of Dents none,
 * so that it meets the tiles around it. */
static double depth_at(const Dents *dents, int i, int j) {
    double sum = 0;
    for (int k = 0; k < 4 && 0 < i && i < NEAR && 0 < j && j < NEAR; k++) {
        sum += (double)dents->depth[j - k / 2][i - k % 2];
    }
    return sum / 4;
}

/* Bool: the tile of `cells` by `cells` from (i, j) on, or a cell beside it, is pressed. */
static int is_dented(const Dents *dents, int i, int j, int cells) {
    for (int b = j > 0 ? j - 1 : 0; b <= j + cells && b < NEAR; b++) {
        for (int a = i > 0 ? i - 1 : 0; a <= i + cells && a < NEAR; a++) {
            if (dents->depth[b][a] > 0) {
                return 1;
            }
        }
    }
    return 0;
}

/* PART by PART cells from (i, j) on, as a plate that follows the dent. */
static void add_part(const Soft *soft, mjvScene *scene, const Dents *dents, int i, int j) {
    const double cell = TILE_EDGE / CELLS, edge = PART * cell;
    const double x = dents->x0 + i * cell + edge / 2, y = dents->y0 + j * cell + edge / 2;
    double heights[4], mean = 0, least = 1e9, most = 0;
    float rgba[4];
    corners_of(&soft->terrain, x, y, edge, heights);
    for (int k = 0; k < 4; k++) {
        const double depth = depth_at(dents, i + k % 2 * PART, j + k / 2 * PART);
        heights[k] -= depth;
        mean += depth / 4;
        least = fmin(least, depth);
        most = fmax(most, depth);
    }
    colour_at(soft, x, y, mean, shade_at(x, y), rgba);
    add_plate(scene, mjCAT_STATIC, heights, x, y, edge, 0, TILE_DEPTH + (most - least) / 2,
              rgba); /* steep ones reach the next */
}

/* Level ground beyond the largest square, whose half edge is `half`: four plates around it. */
static void add_far(const Soft *soft, mjvScene *scene, double x0, double y0, double half) {
    for (int k = 0; k < 4; k++) {
        const int along = k % 2, sign = k / 2 ? 1 : -1; /* beside it along x, or y */
        const double middle = sign * (half + FAR) / 2, reach = (FAR - half) / 2;
        const double size[3] = {along ? half : reach, along ? reach : FAR, TILE_DEPTH / 2};
        const double at[3] = {x0 + (along ? 0 : middle), y0 + (along ? middle : 0),
                              soft->terrain.height - TILE_DEPTH / 2};
        mjvGeom *geom = next_geom(scene);
        if (geom) {
            float rgba[4];
            colour_at(soft, at[0], at[1], 0, 0.965f, rgba);
            mjv_initGeom(geom, mjGEOM_BOX, size, at, NULL, rgba);
            geom->category = mjCAT_STATIC;
        }
    }
}

/* A tile, or the plates of one that is dented. */
static void add_ground(const Soft *soft, mjvScene *scene, const Dents *dents, double x, double y,
                       double edge) {
    const double cell = TILE_EDGE / CELLS;
    const int cells = (int)lround(edge / cell);
    const int i = (int)lround((x - edge / 2 - dents->x0) / cell);
    const int j = (int)lround((y - edge / 2 - dents->y0) / cell);
    const int within = 0 <= i && i + cells <= NEAR && 0 <= j && j + cells <= NEAR;
    if (!within || !is_dented(dents, i, j, cells)) {
        add_tile(soft, scene, x, y, edge);
        return;
    }
    for (int b = j; b < j + cells; b += PART) {
        for (int a = i; a < i + cells; a += PART) {
            add_part(soft, scene, dents, a, b);
        }
    }
}

/* The ground around (x0, y0): squares of TILES x TILES tiles. Each leaves out the middle, where the
 * one of half its size lies. */
static void add_surface(const Soft *soft, mjvScene *scene, const Dents *dents, double x0,
                        double y0) {
    double edge = TILE_EDGE;
    for (int square = 0; square < SQUARES; square++, edge *= 2) {
        for (int j = -TILES / 2; j < TILES / 2; j++) {
            for (int i = -TILES / 2; i < TILES / 2; i++) {
                const int middle =
                    -TILES / 4 <= i && i < TILES / 4 && -TILES / 4 <= j && j < TILES / 4;
                if (square == 0 || !middle) {
                    add_ground(soft, scene, dents, x0 + (i + 0.5) * edge, y0 + (j + 0.5) * edge,
                               edge);
                }
            }
        }
    }
    if (!soft->map || mild_map_is_level(soft->map)) {
        add_far(soft, scene, x0, y0, TILES / 2 * edge / 2);
    }
}

/* The middle of the feet, where they are drawn, moves the surface in steps of its checks. */
static void add_surface_below(const Soft *soft, const mjData *d, const MildGround *ground,
                              mjvScene *scene) {
    double x = 0, y = 0;
    Dents dents = {0};
    for (int f = 0; f < soft->feet; f++) {
        x += d->xpos[3 * soft->foot[f].body] / soft->feet;
        y += d->xpos[3 * soft->foot[f].body + 1] / soft->feet;
    }
    x = CHECKER * round(x / CHECKER);
    y = CHECKER * round(y / CHECKER);
    dents.x0 = x - TILES * TILE_EDGE;
    dents.y0 = y - TILES * TILE_EDGE;
    add_pressed(soft, ground, add_dent, &dents);
    add_surface(soft, scene, &dents, x, y);
}

void visual_add(const Soft *soft, const mjModel *m, const mjData *d, const MildGround *ground,
                const mjvOption *option, mjvScene *scene) {
    if (option->flags[mjVIS_CONTACTFORCE]) {
        add_forces(soft, m, scene);
    }
    if (shows_surface(soft, m, option)) {
        add_surface_below(soft, d, ground, scene);
    } else {
        add_pressed(soft, ground, add_patch, scene);
    }
}
