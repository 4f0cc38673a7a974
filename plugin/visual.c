#include "plugin/visual.h"

#include <math.h>

#include "ground/state.h"

#define ABOVE 0.001  /* [m] height of a patch above the ground, so that a floor does not hide it */
#define DARKEST 0.03 /* [m] depth at which a patch is darkest */
#define BLOCK 2      /* cells along the edge of a patch */

static mjvGeom *next_geom(mjvScene *scene) {
    return scene->ngeom < scene->maxgeom ? &scene->geoms[scene->ngeom++] : NULL;
}

/* A square of the ground that is pressed down to `depth`. */
static void add_patch(mjvScene *scene, const MildTerrain *terrain, double x, double y, double edge,
                      double depth) {
    mjvGeom *geom = next_geom(scene);
    const float dark = (float)fmin(depth / DARKEST, 1);
    const float rgba[4] = {0.45f - 0.30f * dark, 0.36f - 0.25f * dark, 0.26f - 0.19f * dark,
                           0.35f + 0.55f * dark};
    const double size[3] = {edge / 2, edge / 2, ABOVE / 2};
    const double at[3] = {x, y, mild_terrain_height_at(terrain, x, y) + ABOVE};
    if (geom) {
        mjv_initGeom(geom, mjGEOM_BOX, size, at, NULL, rgba);
        geom->category = mjCAT_DECOR;
    }
}

/* Elements that the feet press down now. */
static void add_elements(const Soft *soft, const MildGround *ground, mjvScene *scene) {
    for (int f = 0; f < soft->feet; f++) {
        const MildSole *sole = soft->soles[f];
        const double *depth = mild_ground_depth_max(ground, f);
        const double *p = soft->input.position[f], *turn = soft->input.rotation[f];
        const double z = mild_sole_z(sole);
        for (int e = 0; e < mild_sole_elements(sole); e++) {
            const double a = mild_sole_x(sole)[e], b = mild_sole_y(sole)[e];
            if (depth[e] > 0) {
                add_patch(scene, &soft->terrain, p[0] + turn[0] * a + turn[1] * b + turn[2] * z,
                          p[1] + turn[3] * a + turn[4] * b + turn[5] * z, mild_sole_pitch(sole),
                          depth[e]);
            }
        }
    }
}

/* One tile of imprints: BLOCK x BLOCK cells in a patch. */
static void add_tile(const Soft *soft, const Imprints *imprints, int tile, mjvScene *scene) {
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
            add_tile(soft, &imprints, tile, scene);
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

void visual_add(const Soft *soft, const mjModel *m, const MildGround *ground,
                const mjvOption *option, mjvScene *scene) {
    if (option->flags[mjVIS_CONTACTFORCE]) {
        add_forces(soft, m, scene);
    }
    add_elements(soft, ground, scene);
    add_prints(soft, ground, scene);
}
