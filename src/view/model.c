#include "view/model.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "robot/files.h"

/* Letters of a path up to its last slash, which is one of them. */
static int folder_length(const char *file) {
    const char *slash = strrchr(file, '/');
    return slash ? (int)(slash - file) + 1 : 0;
}

const char *look_path(const char *xml, char path[PATH_SIZE]) {
    const int length = snprintf(path, PATH_SIZE, "%.*slook.xml", folder_length(xml), xml);
    return length < PATH_SIZE && access(path, F_OK) == 0 ? path : NULL;
}

/* MuJoCo looks for relative files beside the robot's own, so that these are named from the root. */
static MildStatus mesh_path(const mjSpec *look, const char *path, const char *file,
                            char whole[PATH_SIZE], MildError *error) {
    char root[PATH_SIZE] = "";
    const char *folder = mjs_getString(look->compiler.meshdir);
    if (path[0] != '/' && !getcwd(root, sizeof root)) {
        return mild_fail(error, MILD_ERROR_IO, "%.300s: the current folder has no path", path);
    }
    const int length = snprintf(whole, PATH_SIZE, "%s%s%.*s%s%s%s", root, root[0] ? "/" : "",
                                folder_length(path), path, folder, folder[0] ? "/" : "", file);
    return length < PATH_SIZE ? MILD_OK
                              : mild_fail(error, MILD_ERROR_RANGE,
                                          "%.300s: a path of more than %d "
                                          "letters",
                                          path, PATH_SIZE - 1);
}

static MildStatus add_mesh(mjSpec *spec, const mjSpec *look, const char *path, mjsElement *element,
                           MildError *error) {
    const mjsMesh *from = mjs_asMesh(element);
    char whole[PATH_SIZE];
    const MildStatus status = mesh_path(look, path, mjs_getString(from->file), whole, error);
    if (status != MILD_OK) {
        return status;
    }
    mjsMesh *mesh = mjs_addMesh(spec, NULL);
    mjs_setName(mesh->element, mjs_getString(mjs_getName(element)));
    mjs_setString(mesh->file, whole);
    memcpy(mesh->scale, from->scale, sizeof mesh->scale);
    mesh->inertia = mjMESH_INERTIA_SHELL; /* the makers' surfaces are not all closed */
    return MILD_OK;
}

static MildStatus add_geom(mjSpec *spec, const char *path, mjsElement *element, MildError *error) {
    const mjsGeom *from = mjs_asGeom(element);
    const char *name = mjs_getString(mjs_getName(mjs_getParent(element)->element));
    mjsBody *body = mjs_findBody(spec, name);
    if (!body) {
        return mild_fail(error, MILD_ERROR_FORMAT, "%.300s: the robot has no body '%.60s'", path,
                         name);
    }
    if (from->type != mjGEOM_MESH || from->alt.type != mjORIENTATION_QUAT) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%.300s: a geom of '%.60s' is no mesh, or is turned by another "
                         "attribute than quat",
                         path, name);
    }
    mjsGeom *geom = mjs_addGeom(body, NULL);
    geom->type = mjGEOM_MESH;
    geom->contype = geom->conaffinity = 0;
    geom->mass = 0;
    geom->group = 1;
    memcpy(geom->pos, from->pos, sizeof geom->pos);
    memcpy(geom->quat, from->quat, sizeof geom->quat);
    memcpy(geom->rgba, from->rgba, sizeof geom->rgba);
    mjs_setString(geom->meshname, mjs_getString(from->meshname));
    mjs_setString(geom->material, mjs_getString(from->material));
    return MILD_OK;
}

/* Shapes of a body that has meshes are drawn no longer. */
static void hide(mjSpec *spec, mjSpec *look) {
    for (mjsElement *e = mjs_firstElement(spec, mjOBJ_GEOM); e; e = mjs_nextElement(spec, e)) {
        const char *name = mjs_getString(mjs_getName(mjs_getParent(e)->element));
        mjsBody *body = mjs_findBody(look, name);
        if (body && mjs_firstChild(body, mjOBJ_GEOM, 0)) {
            mjs_asGeom(e)->group = LOOK_HIDDEN_GROUP;
        }
    }
}

/* Adds the meshes of `path` to the bodies of the same names and hides the other geoms of these. */
static MildStatus look_add(mjSpec *spec, const char *path, MildError *error) {
    RobotFiles files;
    mjSpec *look = robot_files_parse(&files, path, error);
    MildStatus status = look ? MILD_OK : error->status;
    if (look) {
        hide(spec, look);
        mjsElement *e = mjs_firstElement(look, mjOBJ_MESH);
        for (; e && status == MILD_OK; e = mjs_nextElement(look, e)) {
            status = add_mesh(spec, look, path, e, error);
        }
        e = mjs_firstElement(look, mjOBJ_GEOM);
        for (; e && status == MILD_OK; e = mjs_nextElement(look, e)) {
            status = add_geom(spec, path, e, error);
        }
    }
    mj_deleteSpec(look);
    robot_files_end(&files);
    return status;
}

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
