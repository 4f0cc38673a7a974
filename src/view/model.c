#include "view/model.h"

#include <stdio.h>
#include <string.h>

#include "robot/files.h"
#include "view/look.h"

#define VIEW_SHADOW 768       /* [pixels] edge of the shadow map */
#define VIEW_SHADOW_CLIP 1.3F /* [-] half of what it covers, in extents of the robot */
#define VIEW_SLICES 14        /* sides of a drawn cylinder */

static void add_material(mjSpec *spec, const char *name, double repeat, int uniform) {
    mjsTexture *texture = mjs_addTexture(spec, NULL);
    mjs_setName(texture->element, name);
    texture->type = mjTEXTURE_2D;
    texture->builtin = mjBUILTIN_FLAT;
    texture->width = texture->height = RELIEF_TILE_PIXELS;
    mjsMaterial *material = mjs_addMaterial(spec, NULL);
    mjs_setName(material->element, name);
    mjs_setInStringVec(material->textures, mjTEXROLE_RGB, name);
    material->texrepeat[0] = material->texrepeat[1] = (float)repeat;
    material->texuniform = (mjtByte)uniform;
}

/* The vertices of a tile are moved in every frame; here only their number, faces and texture count.
 */
static void add_skin(mjSpec *spec, const char *name, int step) {
    enum { MOST = RELIEF_TILE_VERTICES * RELIEF_TILE_VERTICES };
    static float zero[3 * MOST], texture[2 * MOST], weight[MOST];
    static int face[6 * RELIEF_TILE_CELLS * RELIEF_TILE_CELLS], all[MOST];
    const int n = RELIEF_TILE_CELLS / step + 1;
    const float unit[4] = {1, 0, 0, 0};
    const float margin = (float)RELIEF_TILE_MARGIN / RELIEF_TILE_PIXELS;
    int faces = 0;
    for (int v = 0; v < n * n; v++) {
        float x = (float)(v % n) / (float)(n - 1), y = (float)(v / n) / (float)(n - 1);
        texture[2 * v] = margin + (1 - 2 * margin) * x;
        texture[2 * v + 1] = margin + (1 - 2 * margin) * (1 - y);
        weight[v] = 1;
        all[v] = v;
        if (v % n < n - 1 && v / n < n - 1) {
            const int two[6] = {v, v + 1, v + n + 1, v, v + n + 1, v + n};
            memcpy(face + faces, two, sizeof two);
            faces += 6;
        }
    }
    mjsSkin *skin = mjs_addSkin(spec);
    mjs_setName(skin->element, name);
    mjs_setFloat(skin->vert, zero, 3 * n * n);
    mjs_setFloat(skin->texcoord, texture, 2 * n * n);
    mjs_setInt(skin->face, face, faces);
    mjs_appendString(skin->bodyname, "world");
    mjs_setFloat(skin->bindpos, zero, 3);
    mjs_setFloat(skin->bindquat, unit, 4);
    mjs_appendIntVec(skin->vertid, all, n * n);
    mjs_appendFloatVec(skin->vertweight, weight, n * n);
}

static void add_ground(mjSpec *spec, const Relief *relief, const Surfaces *surfaces) {
    double edge = relief_tile_edge(relief);
    const double share =
        1.0 - 2.0 * RELIEF_TILE_MARGIN / RELIEF_TILE_PIXELS; /* of the picture that a tile shows */
    char name[32];
    for (int i = 0; i < surfaces->all; i++) {
        snprintf(name, sizeof name, "view_tile_%d", i);
        add_material(spec, name, share, 0);
        add_skin(spec, name, i < surfaces->plain ? VIEW_COARSE : 1);
    }
    for (int m = 0; m <= MILD_MATERIALS_MAX; m++) {
        snprintf(name, sizeof name, "view_flat_%d", m);
        add_material(spec, name, share, 0);
    }
    add_material(spec, "view_floor", share / edge, 1);
}

/* A sky like that of robots/, for a file that has none. */
static void add_sky(mjSpec *spec) {
    static const double above[3] = {0.62, 0.74, 0.86}, below[3] = {0.92, 0.94, 0.96};
    for (mjsElement *e = mjs_firstElement(spec, mjOBJ_TEXTURE); e; e = mjs_nextElement(spec, e)) {
        if (mjs_asTexture(e)->type == mjTEXTURE_SKYBOX) {
            return;
        }
    }
    mjsTexture *sky = mjs_addTexture(spec, NULL);
    sky->type = mjTEXTURE_SKYBOX;
    sky->builtin = mjBUILTIN_GRADIENT;
    sky->width = 256;
    sky->height = 6 * sky->width;
    memcpy(sky->rgb1, above, sizeof above);
    memcpy(sky->rgb2, below, sizeof below);
}

mjModel *view_model(const char *xml, const char *look, const int size[2], const Relief *relief,
                    const Surfaces *surfaces, MildError *error) {
    RobotFiles files;
    mjSpec *spec = robot_files_parse(&files, xml, error);
    if (!spec) {
        robot_files_end(&files);
        return NULL;
    }
    spec->visual.global.offwidth = size[0];
    spec->visual.global.offheight = size[1];
    spec->visual.quality.offsamples = 0; /* smooth_picture instead: four samples cost a
                                              * software renderer half of its time */
    spec->visual.quality.shadowsize = VIEW_SHADOW;
    spec->visual.map.shadowclip = VIEW_SHADOW_CLIP;
    spec->visual.quality.numslices = VIEW_SLICES;
    spec->visual.quality.numstacks = VIEW_SLICES / 2;
    spec->visual.quality.numquads = 1;
    add_sky(spec);
    add_ground(spec, relief, surfaces);
    const int good = !look || look_add(spec, look, error) == MILD_OK;
    mjModel *model = good ? robot_files_compile(&files, spec, xml, error) : NULL;
    mj_deleteSpec(spec);
    robot_files_end(&files);
    return model;
}
