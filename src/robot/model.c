/* Turns the MJCF of a robot folder into the engine's models. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "robot/description.h"
#include "robot/files.h"

/* Largest hinge range [rad] that is usual in radians. A robot whose hinges all turn less than this
 * many degrees is not plausible. */
#define FULL_TURN 6.3

#define NEVER 1e9 /* [m] a geom so far in the floor touches it */

#define COPIES_MAX 2e6 /* elements that mjs_delete may copy in all: one or two seconds */

/* Refuses features that our step does not compute. Ignoring them silently would simulate a
 * different robot. */
static MildStatus check_supported(const mjModel *m, const char *path, MildError *error) {
    if (m->neq > 0 || m->ntendon > 0) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: has %s, which the step does not compute; remove them", path,
                         m->neq > 0 ? "equality constraints" : "tendons");
    }
    for (int d = 0; d < m->nv; d++) {
        const char *joint = mj_id2name(m, mjOBJ_JOINT, m->dof_jntid[d]);
        double friction = m->dof_frictionloss[d], damping = m->dof_damping[d];
        double stiffness = m->jnt_stiffness[m->dof_jntid[d]];
        if (friction != 0.0 || damping != 0.0 || stiffness != 0.0) {
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%s: joint '%s' has %s, which the step does not compute; remove it",
                             path, joint ? joint : "",
                             friction != 0.0  ? "frictionloss"
                             : damping != 0.0 ? "damping"
                                              : "stiffness");
        }
    }
    return MILD_OK;
}

/* MuJoCo reads angles as degrees unless the file says angle="radian". Refuses a file whose hinge
 * ranges all look like numbers in the other unit, because its legs would be stiff, or free. */
static MildStatus check_angles(const mjSpec *spec, const mjModel *m, const char *path,
                               MildError *error) {
    const double unit = spec->compiler.degree ? 180.0 / mjPI : 1.0; /* per radian */
    double least = INFINITY; /* smallest of the hinges' larger limits, as written */
    double most = 0.0;
    int named = -1;
    for (int j = 0; j < m->njnt; j++) {
        const double *range = m->jnt_range + 2 * j;
        const double limit = unit * fmax(fabs(range[0]), fabs(range[1]));
        if (m->jnt_type[j] != mjJNT_HINGE || !m->jnt_limited[j]) {
            continue;
        }
        least = fmin(least, limit);
        named = limit > most ? j : named;
        most = fmax(most, limit);
    }
    const char *joint = named >= 0 ? mj_id2name(m, mjOBJ_JOINT, named) : NULL;
    if (named >= 0 && spec->compiler.degree && most <= FULL_TURN) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "%.150s: angles are in degrees, and no hinge turns further than '%.60s' "
                         "(%.3g degrees); if they are radians, write <compiler angle=\"radian\"/>",
                         path, joint ? joint : "", most);
    }
    if (named >= 0 && !spec->compiler.degree && least > 2 * FULL_TURN) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "%.150s: angles are in radians, and every hinge turns by more than two "
                         "turns ('%.60s': %.3g rad); if they are degrees, write <compiler "
                         "angle=\"degree\"/>",
                         path, joint ? joint : "", most);
    }
    return MILD_OK;
}

/* Gives the bodies the inertia that the compiler derived from their geoms, because the geoms are
 * about to be removed. */
static void fix_inertia(mjSpec *spec, const mjModel *m) {
    for (mjsElement *e = mjs_firstElement(spec, mjOBJ_BODY); e; e = mjs_nextElement(spec, e)) {
        mjsBody *body = mjs_asBody(e);
        int id = mjs_getId(e);
        if (body->explicitinertial || id <= 0) {
            continue;
        }
        body->explicitinertial = 1;
        body->mass = m->body_mass[id];
        memcpy(body->ipos, m->body_ipos + 3 * id, sizeof body->ipos);
        memcpy(body->iquat, m->body_iquat + 4 * id, sizeof body->iquat);
        memcpy(body->inertia, m->body_inertia + 3 * id, sizeof body->inertia);
    }
}

/* Whether mjs_delete must remove it. Other geoms are left to the compiler (drop_geoms), which keeps
 * height fields. */
static int is_deleted(mjsElement *element) {
    return element->elemtype != mjOBJ_GEOM || mjs_asGeom(element)->type == mjGEOM_HFIELD;
}

static const mjtObj stripped[] = {mjOBJ_SENSOR,  mjOBJ_ACTUATOR, mjOBJ_KEY,    mjOBJ_PAIR,
                                  mjOBJ_EXCLUDE, mjOBJ_SITE,     mjOBJ_CAMERA, mjOBJ_LIGHT,
                                  mjOBJ_SKIN,    mjOBJ_GEOM,     mjOBJ_HFIELD};
enum { STRIPPED = sizeof stripped / sizeof stripped[0] };

/* mjs_delete copies the whole description each time: minutes for 20 000 sites. */
static MildStatus check_size(mjSpec *spec, const char *path, MildError *error) {
    double elements = 0, deleted = 0;
    for (int k = 0; k < STRIPPED; k++) {
        mjsElement *e = mjs_firstElement(spec, stripped[k]);
        for (; e; e = mjs_nextElement(spec, e)) {
            elements++;
            deleted += is_deleted(e);
        }
    }
    return deleted * elements <= COPIES_MAX
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_RANGE,
                           "%.200s: %g sites, sensors, actuators, keyframes, pairs, cameras and "
                           "lights besides %g geoms are too many; remove what the robot does not "
                           "need (the product of the first number and their sum may be %g)",
                           path, deleted, elements - deleted, COPIES_MAX);
}

/* Marks every geom as one that is only seen, which the compiler drops with its mesh and material,
 * and frees its name. */
static void drop_geoms(mjSpec *spec) {
    for (mjsElement *e = mjs_firstElement(spec, mjOBJ_GEOM); e; e = mjs_nextElement(spec, e)) {
        mjsGeom *geom = mjs_asGeom(e);
        geom->contype = geom->conaffinity = 0;
        mjs_setName(e, "");
    }
    spec->compiler.discardvisual = 1;
}

/* Removes everything but bodies and joints. A step computes the pose of every geom, and every
 * workspace copies the model. */
static MildStatus strip(mjSpec *spec, const char *path, MildError *error) {
    if (check_size(spec, path, error) != MILD_OK) {
        return error->status;
    }
    for (int k = 0; k < STRIPPED; k++) {
        mjsElement *next = NULL;
        for (mjsElement *e = mjs_firstElement(spec, stripped[k]); e; e = next) {
            next = mjs_nextElement(spec, e);
            if (is_deleted(e)) {
                mjs_delete(spec, e);
            }
        }
    }
    drop_geoms(spec);
    return MILD_OK;
}

static mjsGeom *add_geom(mjsBody *body, const char *name, mjtGeom type) {
    mjsGeom *geom = mjs_addGeom(body, NULL);
    mjs_setName(geom->element, name);
    geom->type = type;
    geom->contype = geom->conaffinity = 0; /* only the pairs touch */
    geom->mass = 0.0;
    return geom;
}

/* A pair of the floor and a geom. */
static mjsPair *add_pair(mjSpec *spec, const char *geom) {
    static const double friction[5] = {0.8, 0.8, 0.005, 0.0001, 0.0001};
    mjsPair *pair = mjs_addPair(spec, NULL);
    mjs_setString(pair->geomname1, "floor");
    mjs_setString(pair->geomname2, geom);
    pair->condim = 3;
    memcpy(pair->friction, friction, sizeof friction);
    return pair;
}

/* Gives each body with shells a geom, which MuJoCo never finds in contact: rigid_collide adds the
 * contacts of shells that stand, and each needs a geom of its body. */
static void add_shells(const RobotDef *def, const mjModel *visual, mjSpec *spec) {
    for (int s = 0; s < def->shells; s++) {
        const int geom = mj_name2id(visual, mjOBJ_GEOM, def->shell[s]);
        const char *of =
            geom < 0 ? NULL : mj_id2name(visual, mjOBJ_BODY, visual->geom_bodyid[geom]);
        mjsBody *body = of ? mjs_findBody(spec, of) : NULL;
        char name[32];
        snprintf(name, sizeof name, "shell_%d", body ? visual->geom_bodyid[geom] : 0);
        if (!body || mjs_findElement(spec, mjOBJ_GEOM, name)) {
            continue; /* robot_read_shells has the message; or the body has one already */
        }
        add_geom(body, name, mjGEOM_SPHERE)->size[0] = 1e-3;
        add_pair(spec, name)->margin = -NEVER;
    }
}

/* Adds the engine's rigid ground: a floor, and the spheres that each foot stands on. */
static MildStatus add_rigid_ground(const RobotDef *def, const char *path, mjSpec *spec,
                                   MildError *error) {
    mjsGeom *floor = add_geom(mjs_findBody(spec, "world"), "floor", mjGEOM_PLANE);
    floor->size[2] = 0.05; /* [m] distance of the grid's lines, for pictures only */
    for (int f = 0; f < def->feet; f++) {
        const RobotFootDef *foot = &def->foot[f];
        mjsBody *body = mjs_findBody(spec, foot->body);
        if (!body) {
            return mild_fail(error, MILD_ERROR_FORMAT, "%s: body '%s' of [foot.%s] is missing",
                             path, foot->body, foot->name);
        }
        for (int c = 0; c < foot->corner_count; c++) {
            char name[32];
            snprintf(name, sizeof name, "corner_%d_%d", f, c);
            mjsGeom *corner = add_geom(body, name, mjGEOM_SPHERE);
            corner->size[0] = foot->corner_radius;
            memcpy(corner->pos, foot->corners + 3 * c, sizeof corner->pos);
            add_pair(spec, name);
        }
    }
    return MILD_OK;
}

static MildStatus compile(Robot *robot, RobotFiles *files, mjSpec *spec, MildError *error) {
    robot->visual = robot_files_compile(files, spec, robot->path, error);
    if (!robot->visual) {
        return error->status;
    }
    MildStatus status = check_supported(robot->visual, robot->path, error);
    if (status == MILD_OK) {
        status = check_angles(spec, robot->visual, robot->path, error);
    }
    if (status != MILD_OK) {
        return status;
    }
    fix_inertia(spec, robot->visual);
    status = strip(spec, robot->path, error);
    if (status == MILD_OK) {
        status = add_rigid_ground(&robot->def, robot->path, spec, error);
        add_shells(&robot->def, robot->visual, spec);
    }
    if (status != MILD_OK) {
        return status;
    }
    robot->model = robot_files_compile(files, spec, robot->path, error);
    return robot->model ? MILD_OK : error->status;
}

MildStatus robot_load_models(Robot *robot, MildError *error) {
    RobotFiles files;
    mjSpec *spec = robot_files_parse(&files, robot->path, error);
    MildStatus status = spec ? compile(robot, &files, spec, error) : error->status;
    mj_deleteSpec(spec);
    robot_files_end(&files);
    return status;
}
