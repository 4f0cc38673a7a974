#include "view/look.h"

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

MildStatus look_add(mjSpec *spec, const char *path, MildError *error) {
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
