#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "robot/description.h"
#include "robot/engine.h"

static const char *const limb_names[ROBOT_JOINTS] = {"leg_l1", "leg_l2", "leg_l3", "leg_l4",
                                                     "leg_l5", "leg_l6", "leg_r1", "leg_r2",
                                                     "leg_r3", "leg_r4", "leg_r5", "leg_r6"};
static const char *const foot_links[ROBOT_FEET] = {"leg_l6_link", "leg_r6_link"};
static const char *const knee_links[ROBOT_FEET] = {"leg_l4_link", "leg_r4_link"};
static const char *const shell_links[ROBOT_SHELLS] = {"base_link", "leg_l4_link", "leg_r4_link"};
static const char *const outline_names[ROBOT_FEET] = {"sole_outline_left", "sole_outline_right"};

const char *robot_limb_name(int i) {
    return limb_names[i];
}

RobotVariation robot_variation_nominal(void) {
    RobotVariation variation = {.armature_scale = 1.0, .rigid_friction = 0.8};
    for (int i = 0; i <= ROBOT_JOINTS; i++) {
        variation.link_mass_scale[i] = 1.0;
    }
    return variation;
}

/* Id of a named object, or -1 with a message that names it. */
static int find(const mjModel *model, int type, const char *kind, const char *name,
                const char *path, MildError *error) {
    int id = mj_name2id(model, type, name);
    if (id < 0) {
        mild_fail(error, MILD_ERROR_FORMAT, "%s: the robot's %s '%s' is missing", path, kind, name);
    }
    return id;
}

/* MuJoCo's messages have several lines; ours have one. */
static void one_line(char *text) {
    for (char *c = text; *c; c++) {
        if (*c == '\n' || *c == '\r') {
            *c = ' ';
        }
    }
}

/* A step pays for every geom whose pose it computes, so the working model keeps only the geoms that
 * collide. */
static void strip_for_physics(mjSpec *spec) {
    static const mjtObj dropped[] = {mjOBJ_CAMERA, mjOBJ_LIGHT, mjOBJ_ACTUATOR, mjOBJ_SITE};
    for (size_t k = 0; k < sizeof dropped / sizeof dropped[0]; k++) {
        mjsElement *following = NULL;
        for (mjsElement *e = mjs_firstElement(spec, dropped[k]); e; e = following) {
            following = mjs_nextElement(spec, e);
            mjs_delete(spec, e);
        }
    }
    mjsElement *next = NULL;
    for (mjsElement *e = mjs_firstElement(spec, mjOBJ_GEOM); e; e = next) {
        next = mjs_nextElement(spec, e);
        int group = mjs_asGeom(e)->group;
        if (group == 1 || group == 3) {
            mjs_delete(spec, e);
        }
    }
}

static MildStatus load_models(Robot *robot, const char *path, MildError *error) {
    char text[300] = "";
    mjSpec *spec = mj_parseXML(path, NULL, text, (int)sizeof text);
    if (!spec) {
        one_line(text);
        return mild_fail(error, MILD_ERROR_IO, "%s: %s", path, text);
    }
    robot->visual = mj_compile(spec, NULL);
    if (robot->visual) {
        strip_for_physics(spec);
        robot->model = mj_compile(spec, NULL);
    }
    if (!robot->model) {
        snprintf(text, sizeof text, "%s", mjs_getError(spec));
        one_line(text);
        mild_fail(error, MILD_ERROR_FORMAT, "%s: %s", path, text);
    }
    mj_deleteSpec(spec);
    return robot->model ? MILD_OK : MILD_ERROR_FORMAT;
}

static MildStatus read_bodies(Robot *robot, const char *path, MildError *error) {
    const mjModel *m = robot->model;
    robot->base_body = find(m, mjOBJ_BODY, "body", "base_link", path, error);
    robot->floor_geom = find(m, mjOBJ_GEOM, "geom", "floor", path, error);
    if (robot->base_body < 0 || robot->floor_geom < 0) {
        return MILD_ERROR_FORMAT;
    }
    for (int f = 0; f < ROBOT_FEET; f++) {
        robot->foot_body[f] = find(m, mjOBJ_BODY, "foot", foot_links[f], path, error);
        if (robot->foot_body[f] < 0) {
            return MILD_ERROR_FORMAT;
        }
        robot->knee_body[f] = find(m, mjOBJ_BODY, "body", knee_links[f], path, error);
        if (robot->knee_body[f] < 0) {
            return MILD_ERROR_FORMAT;
        }
    }
    return MILD_OK;
}

/* The step relies on this order of degrees of freedom: base, left leg, right leg; and on limbs
 * being chains. */
static MildStatus read_joints(Robot *robot, const char *path, MildError *error) {
    const mjModel *m = robot->model;
    for (int i = 0; i < ROBOT_JOINTS; i++) {
        char name[32];
        snprintf(name, sizeof name, "%s_joint", limb_names[i]);
        int id = find(m, mjOBJ_JOINT, "joint", name, path, error);
        if (id < 0) {
            return MILD_ERROR_FORMAT;
        }
        int parent = i % ROBOT_LEG == 0 ? robot->base_body : m->jnt_bodyid[id - 1];
        if (id != 1 + i || m->jnt_type[id] != mjJNT_HINGE || m->jnt_type[0] != mjJNT_FREE ||
            m->body_parentid[m->jnt_bodyid[id]] != parent) {
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%s: joint '%s' must be hinge %d of a free base with two chains of "
                             "six, left leg first",
                             path, name, i + 1);
        }
        if (!m->jnt_limited[id] || !m->jnt_actfrclimited[id]) {
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%s: joint '%s' needs range and actuatorfrcrange", path, name);
        }
        robot->low[i] = m->jnt_range[2 * id];
        robot->high[i] = m->jnt_range[2 * id + 1];
        robot->effort[i] = m->jnt_actfrcrange[2 * id + 1];
    }
    if (m->nq != ROBOT_NQ || m->nv != ROBOT_NV) {
        return mild_fail(error, MILD_ERROR_FORMAT, "%s: %d degrees of freedom instead of %d", path,
                         (int)m->nv, ROBOT_NV);
    }
    return MILD_OK;
}

static MildStatus read_shells(Robot *robot, const char *path, MildError *error) {
    const mjModel *m = robot->visual;
    for (int s = 0; s < ROBOT_SHELLS; s++) {
        char name[48];
        snprintf(name, sizeof name, "%s_box", shell_links[s]);
        int id = find(m, mjOBJ_GEOM, "box geom", name, path, error);
        if (id < 0) {
            return MILD_ERROR_FORMAT;
        }
        robot->shell_body[s] = mj_name2id(robot->model, mjOBJ_BODY, shell_links[s]);
        memcpy(robot->shell_center[s], m->geom_pos + 3 * id, sizeof robot->shell_center[s]);
        memcpy(robot->shell_half[s], m->geom_size + 3 * id, sizeof robot->shell_half[s]);
    }
    return MILD_OK;
}

/* Values of <custom><numeric name=...>, or NULL with a message. */
static const double *read_numeric(const mjModel *m, const char *name, int *count, const char *path,
                                  MildError *error) {
    int id = find(m, mjOBJ_NUMERIC, "custom numeric", name, path, error);
    if (id < 0) {
        return NULL;
    }
    *count = m->numeric_size[id];
    return m->numeric_data + m->numeric_adr[id];
}

static MildStatus read_outline(Robot *robot, int foot, const char *path, MildError *error) {
    int count = 0;
    const double *data = read_numeric(robot->model, outline_names[foot], &count, path, error);
    if (!data) {
        return MILD_ERROR_FORMAT;
    }
    if (count % 2 != 0 || count < 6 || count > 2 * ROBOT_OUTLINE_MAX) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: '%s' needs 3 to %d pairs x y, has %d numbers", path,
                         outline_names[foot], ROBOT_OUTLINE_MAX, count);
    }
    memcpy(robot->outline[foot], data, sizeof(double) * (size_t)count);
    robot->outline_points[foot] = count / 2;
    double low[2] = {DBL_MAX, DBL_MAX}, high[2] = {-DBL_MAX, -DBL_MAX};
    for (int i = 0; i < count; i++) {
        low[i % 2] = fmin(low[i % 2], data[i]);
        high[i % 2] = fmax(high[i % 2], data[i]);
    }
    robot->sole_center[foot][0] = 0.5 * (low[0] + high[0]);
    robot->sole_center[foot][1] = 0.5 * (low[1] + high[1]);
    robot->sole_center[foot][2] = robot->sole_z;
    return MILD_OK;
}

static MildStatus read_soles(Robot *robot, const char *path, MildError *error) {
    int one = 0;
    const double *z = read_numeric(robot->model, "sole_z", &one, path, error);
    const double *pitch = z ? read_numeric(robot->model, "sole_pitch", &one, path, error) : NULL;
    const double *elements =
        pitch ? read_numeric(robot->model, "sole_elements", &one, path, error) : NULL;
    if (!elements) {
        return MILD_ERROR_FORMAT;
    }
    if (!(*elements >= 0.0 && *elements <= ROBOT_ELEMENTS_MAX)) {
        return mild_fail(error, MILD_ERROR_RANGE, "%s: 'sole_elements' = %g is outside 0 .. %d",
                         path, *elements, ROBOT_ELEMENTS_MAX);
    }
    robot->sole_z = *z;
    for (int f = 0; f < ROBOT_FEET; f++) {
        MildStatus status = read_outline(robot, f, path, error);
        if (status != MILD_OK) {
            return status;
        }
        MildSoleDef def = {robot->outline[f], robot->outline_points[f], *pitch, *z, (int)*elements};
        robot->soles[f] = mild_sole_create(&def, error);
        robot->concentric[f] =
            robot->soles[f] ? mild_sole_concentric(robot->soles[f], error) : NULL;
        if (!robot->concentric[f]) {
            return MILD_ERROR_FORMAT;
        }
    }
    return MILD_OK;
}

static MildStatus read_stand(Robot *robot, const char *path, MildError *error) {
    const mjModel *m = robot->model;
    int key = find(m, mjOBJ_KEY, "key", "stand", path, error);
    if (key < 0) {
        return MILD_ERROR_FORMAT;
    }
    mjData *data = mj_makeData(m);
    if (!data) {
        return mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", path);
    }
    mj_resetDataKeyframe(m, data, key);
    mj_kinematics(m, data);
    memcpy(robot->pose, data->qpos + 7, sizeof robot->pose);
    /* the pose's soles are level, so the sole plane below the ankle is the lowest point */
    double ankle = data->xpos[3 * robot->foot_body[0] + 2];
    robot->stand_height = data->xpos[3 * robot->base_body + 2] - (ankle + robot->sole_z);
    robot->total_mass = m->body_subtreemass[robot->base_body];
    mj_deleteData(data);
    return stand_prepare(robot) ? mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", path)
                                : MILD_OK;
}

static MildStatus read_robot(Robot *robot, const char *path, MildError *error) {
    MildStatus status = file_check_regular(path, error);
    status = status == MILD_OK ? load_models(robot, path, error) : status;
    status = status == MILD_OK ? robot_check_model(robot, path, error) : status;
    status = status == MILD_OK ? read_bodies(robot, path, error) : status;
    status = status == MILD_OK ? read_joints(robot, path, error) : status;
    status = status == MILD_OK ? read_shells(robot, path, error) : status;
    status = status == MILD_OK ? read_soles(robot, path, error) : status;
    return status == MILD_OK ? read_stand(robot, path, error) : status;
}

typedef struct {
    Robot *robot;
    const char *path;
} Reading;

static MildStatus read_guarded(void *context, MildError *error) {
    const Reading *reading = context;
    return read_robot(reading->robot, reading->path, error);
}

Robot *robot_create(const char *xml_path, MildError *error) {
    Robot *robot = calloc(1, sizeof *robot);
    if (!robot) {
        mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", xml_path);
        return NULL;
    }
    Reading reading = {robot, xml_path};
    if (engine_call(read_guarded, &reading, xml_path, error) != MILD_OK) {
        robot_destroy(robot);
        return NULL;
    }
    return robot;
}

void robot_destroy(Robot *robot) {
    if (!robot) {
        return;
    }
    for (int f = 0; f < ROBOT_FEET; f++) {
        mild_sole_destroy(robot->soles[f]);
        mild_sole_destroy(robot->concentric[f]);
    }
    mj_deleteModel(robot->model);
    mj_deleteModel(robot->visual);
    free(robot);
}

const MildSole *const *robot_soles(const Robot *robot) {
    return (const MildSole *const *)(robot->is_concentric ? robot->concentric : robot->soles);
}

const MildSole *const *robot_rasters(const Robot *robot) {
    return (const MildSole *const *)robot->soles;
}

void robot_set_model(Robot *robot, MildModel model) {
    robot->is_concentric = mild_model_is_concentric(model);
}

MildStatus robot_match_model(const Robot *robot, MildModel model, const MildMaterial *mild,
                             MildMaterial *rival, MildError *error) {
    return mild_model_match(model, mild, robot->soles[0], robot_half_weight(robot), rival, error);
}

double robot_total_mass(const Robot *robot) {
    return robot->total_mass;
}

double robot_half_weight(const Robot *robot) {
    return -0.5 * robot->total_mass * robot->model->opt.gravity[2];
}

double robot_stand_height(const Robot *robot) {
    return robot->stand_height;
}

const double *robot_default_pose(const Robot *robot) {
    return robot->pose;
}

const double *robot_joint_low(const Robot *robot) {
    return robot->low;
}

const double *robot_joint_high(const Robot *robot) {
    return robot->high;
}

const double *robot_effort(const Robot *robot) {
    return robot->effort;
}

const void *robot_visual_model(const Robot *robot) {
    return robot->visual;
}
