#include "plugin/visual.h"

#include <math.h>

#include "ground/state.h"

#define ABOVE 0.001  /* [m] height of a patch above the ground, so that a floor does not hide it */
#define DARKEST 0.03 /* [m] depth at which a patch is darkest */
#define BLOCK 2      /* cells along the edge of a patch */
#define SQUARES 3    /* of uneven ground */
#define TILES 32     /* along the edge of a square, a multiple of 4 */
#define TILE_EDGE 0.04  /* [m] in the smallest square */
#define TILE_DEPTH 0.01 /* [m] thickness of a tile */
#define CHECKER 0.32    /* [m] edge of a check, a multiple of the largest tile's */

static mjvGeom *next_geom(mjvScene *scene) {
    return scene->ngeom < scene->maxgeom ? &scene->geoms[scene->ngeom++] : NULL;
}

/* A square plate on the ground, tilted as the ground is under its edges. lift: [m] of its top above
 * the ground, depth: [m] its thickness. */
static void add_plate(mjvScene *scene, int category, const MildTerrain *terrain, double x, double y,
                      double edge, double lift, double depth, const float rgba[4]) {
    const double a = edge / 2;
    const double h00 = mild_terrain_height_at(terrain, x - a, y - a);
    const double h10 = mild_terrain_height_at(terrain, x + a, y - a);
    const double h01 = mild_terrain_height_at(terrain, x - a, y + a);
    const double h11 = mild_terrain_height_at(terrain, x + a, y + a);
    const double sx = (h10 + h11 - h00 - h01) / (2 * edge);
    const double sy = (h01 + h11 - h00 - h10) / (2 * edge);
    const double size[3] = {a * sqrt(1 + sx * sx), a * sqrt(1 + sy * sy), depth / 2};
    double u[3] = {1, 0, sx}, v[3], normal[3] = {-sx, -sy, 1};
    double at[3] = {x, y, (h00 + h10 + h01 + h11) / 4};
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

/* A square of the ground that is pressed down to `depth`. */
static void add_patch(mjvScene *scene, const MildTerrain *terrain, double x, double y, double edge,
                      double depth) {
    const float dark = (float)fmin(depth / DARKEST, 1);
    const float rgba[4] = {0.45f - 0.30f * dark, 0.36f - 0.25f * dark, 0.26f - 0.19f * dark,
                           0.35f + 0.55f * dark};
    add_plate(scene, mjCAT_DECOR, terrain, x, y, edge, 1.5 * ABOVE, ABOVE, rgba);
}

/* Elements that a foot or body presses down now. */
static void add_elements(const Soft *soft, const MildGround *ground, int f, mjvScene *scene) {
    const MildSole *sole = soft->soles[f];
    const double *depth = mild_ground_depth_max(ground, f), *area = mild_sole_surface_area(sole);
    const double *p = soft->input.position[f], *turn = soft->input.rotation[f];
    for (int e = 0; e < mild_sole_elements(sole) && ground->touched[f] > 0; e++) {
        const double a = mild_sole_x(sole)[e], b = mild_sole_y(sole)[e];
        const double z = area ? mild_sole_surface_z(sole)[e] : mild_sole_z(sole);
        if (depth[e] > 0) {
            add_patch(scene, &soft->terrain, p[0] + turn[0] * a + turn[1] * b + turn[2] * z,
                      p[1] + turn[3] * a + turn[4] * b + turn[5] * z,
                      area ? sqrt(area[e]) : mild_sole_pitch(sole), depth[e]);
        }
    }
}

/* One tile of imprints: BLOCK x BLOCK cells in a patch. */
static void add_print(const Soft *soft, const Imprints *imprints, int tile, mjvScene *scene) {
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
                add_patch(scene, &soft->terrain, (column * IMPRINT_EDGE + i + 0.5 * BLOCK) * cell,
                          (row * IMPRINT_EDGE + j + 0.5 * BLOCK) * cell, BLOCK * cell,
                          sum * IMPRINT_UNIT / (BLOCK * BLOCK));
            }
        }
    }
}

static void add_prints(const Soft *soft, const MildGround *ground, mjvScene *scene) {
    const Imprints imprints = ground_imprints(ground);
    for (int tile = 0; tile < imprints.tiles; tile++) {
        if (imprints.keys[tile].time != 0) {
            add_print(soft, &imprints, tile, scene);
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

/* Bool: uneven ground is to be drawn, because no height field of the model stands for it. */
static int shows_surface(const Soft *soft, const mjModel *m, const mjvOption *option) {
    for (int g = 0; g < m->ngeom; g++) {
        if (m->geom_type[g] == mjGEOM_HFIELD && m->body_weldid[m->geom_bodyid[g]] == 0) {
            return 0;
        }
    }
    return option->flags[mjVIS_STATIC] && soft->map && !mild_map_is_level(soft->map);
}

static void add_tile(mjvScene *scene, const MildTerrain *terrain, double x, double y, double edge) {
    const double parity = fmod(floor(x / CHECKER) + floor(y / CHECKER), 2);
    const float shade = parity == 0 ? 1 : 0.93f;
    const float rgba[4] = {0.66f * shade, 0.57f * shade, 0.43f * shade, 1};
    add_plate(scene, mjCAT_STATIC, terrain, x, y, edge, 0, TILE_DEPTH, rgba);
}

/* The ground around (x0, y0): squares of TILES x TILES tiles. Each leaves out the middle, where the
 * one of half its size lies. */
static void add_surface(mjvScene *scene, const MildTerrain *terrain, double x0, double y0) {
    double edge = TILE_EDGE;
    for (int square = 0; square < SQUARES; square++, edge *= 2) {
        for (int j = -TILES / 2; j < TILES / 2; j++) {
            for (int i = -TILES / 2; i < TILES / 2; i++) {
                const int middle =
                    -TILES / 4 <= i && i < TILES / 4 && -TILES / 4 <= j && j < TILES / 4;
                if (square == 0 || !middle) {
                    add_tile(scene, terrain, x0 + (i + 0.5) * edge, y0 + (j + 0.5) * edge, edge);
                }
            }
        }
    }
}

/* The middle of the feet, where they are drawn, moves the surface in steps of its checks. */
static void add_surface_below(const Soft *soft, const mjData *d, mjvScene *scene) {
    double x = 0, y = 0;
    for (int f = 0; f < soft->feet; f++) {
        x += d->xpos[3 * soft->foot[f].body] / soft->feet;
        y += d->xpos[3 * soft->foot[f].body + 1] / soft->feet;
    }
    add_surface(scene, &soft->terrain, CHECKER * round(x / CHECKER), CHECKER * round(y / CHECKER));
}

void visual_add(const Soft *soft, const mjModel *m, const mjData *d, const MildGround *ground,
                const mjvOption *option, mjvScene *scene) {
    if (option->flags[mjVIS_CONTACTFORCE]) {
        add_forces(soft, m, scene);
    }
    for (int f = 0; f < soft->feet; f++) {
        add_elements(soft, ground, f, scene);
    }
    add_prints(soft, ground, scene);
    if (shows_surface(soft, m, option)) {
        add_surface_below(soft, d, scene);
    }
}
