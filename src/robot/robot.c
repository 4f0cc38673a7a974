#include "robot/robot.h"

#include <dirent.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/paths.h"
#include "base/text.h"
#include "robot/description.h"
#include "robot/engine.h"

#define LEVEL 0.02 /* [rad] largest tilt of a flat sole in the default pose */

RobotVariation robot_variation_nominal(void) {
    RobotVariation variation = {.armature_scale = 1.0, .rigid_friction = 0.8, .shells_stand = 1};
    for (int i = 0; i <= ROBOT_JOINTS_MAX; i++) {
        variation.link_mass_scale[i] = 1.0;
    }
    return variation;
}

int robot_find(const Robot *robot, const mjModel *model, int type, const char *kind,
               const char *name, const char *key, MildError *error) {
    int id = mj_name2id(model, type, name);
    if (id < 0) {
        mild_fail(error, MILD_ERROR_FORMAT, "%s: %s '%s' is missing; robot.ini names it in %s",
                  robot->path, kind, name, key);
    }
    return id;
}

int robot_geom_body(const Robot *robot, int geom, MildError *error) {
    const mjModel *m = robot->visual;
    const char *name = mj_id2name(m, mjOBJ_BODY, m->geom_bodyid[geom]);
    const int body = name ? mj_name2id(robot->model, mjOBJ_BODY, name) : -1;
    if (body < 0) {
        mild_fail(error, MILD_ERROR_FORMAT, "%s: the body of geom '%s' needs a name", robot->path,
                  mj_id2name(m, mjOBJ_GEOM, geom));
    }
    return body;
}

static MildStatus read_bodies(Robot *robot, MildError *error) {
    const mjModel *m = robot->model;
    const RobotDef *def = &robot->def;
    robot->floor_geom = mj_name2id(m, mjOBJ_GEOM, "floor");
    robot->base_body = robot_find(robot, m, mjOBJ_BODY, "body", def->base, "[robot] base", error);
    if (robot->base_body < 0) {
        return MILD_ERROR_FORMAT;
    }
    for (int f = 0; f < def->feet; f++) {
        const RobotFootDef *foot = &def->foot[f];
        RobotLimb *limb = &robot->limb[f];
        char key[ROBOT_NAME_SIZE + 16];
        snprintf(key, sizeof key, "[foot.%s]", foot->name);
        limb->round = foot->shape == ROBOT_SOLE_ROUND;
        limb->body = robot_find(robot, m, mjOBJ_BODY, "body", foot->body, key, error);
        limb->knee_body = robot_find(robot, m, mjOBJ_BODY, "body", foot->knee, key, error);
        if (limb->body < 0 || limb->knee_body < 0) {
            return MILD_ERROR_FORMAT;
        }
        for (int g = 0; g < def->feet; g++) {
            if (g < f && robot->limb[g].body == limb->body) {
                return mild_fail(error, MILD_ERROR_FORMAT,
                                 "%s: robot.ini: feet '%s' and '%s' are on the same body",
                                 robot->path, def->foot[g].name, foot->name);
            }
            limb->mirror = strcmp(def->foot[g].name, foot->mirror) == 0 ? g : limb->mirror;
        }
    }
    return MILD_OK;
}

static MildStatus read_joint(Robot *robot, int i, MildError *error) {
    const mjModel *m = robot->model;
    const char *name = robot->def.joint[i];
    int id = robot_find(robot, m, mjOBJ_JOINT, "joint", name, "[joints] names", error);
    if (id < 0) {
        return MILD_ERROR_FORMAT;
    }
    if (m->jnt_type[id] != mjJNT_HINGE) {
        return mild_fail(error, MILD_ERROR_FORMAT, "%s: joint '%s' must be a hinge", robot->path,
                         name);
    }
    double effort = robot->def.effort[i];
    if (!m->jnt_limited[id] || !(m->jnt_actfrclimited[id] || effort > 0.0)) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: joint '%s' needs a range, and actuatorfrcrange or [joints] effort in "
                         "robot.ini",
                         robot->path, name);
    }
    robot->dof[i] = m->jnt_dofadr[id];
    robot->low[i] = m->jnt_range[2 * id];
    robot->high[i] = m->jnt_range[2 * id + 1];
    robot->effort[i] = effort > 0.0 ? effort : m->jnt_actfrcrange[2 * id + 1];
    for (int j = 0; j < robot->def.joints; j++) {
        if (strcmp(robot->def.joint[j], robot->def.mirror[i]) == 0) {
            robot->mirror_joint[i] = j;
        }
    }
    return MILD_OK;
}

/* The step requires that the base's six degrees of freedom come first and that all others are
 * hinges with one coordinate each. */
static MildStatus read_joints(Robot *robot, MildError *error) {
    const mjModel *m = robot->model;
    int joints = robot->def.joints;
    if (m->njnt < 1 || m->jnt_type[0] != mjJNT_FREE || m->jnt_bodyid[0] != robot->base_body) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: body '%s' must have the free joint, the first in the file",
                         robot->path, robot->def.base);
    }
    for (int i = 0; i < joints; i++) {
        MildStatus status = read_joint(robot, i, error);
        if (status != MILD_OK) {
            return status;
        }
    }
    for (int id = 1; id < m->njnt; id++) {
        int i = joints - 1;
        while (i >= 0 && robot->dof[i] != m->jnt_dofadr[id]) {
            i--;
        }
        if (i < 0) {
            const char *name = mj_id2name(m, mjOBJ_JOINT, id);
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%s: joint '%s' is not in [joints] names of robot.ini", robot->path,
                             name ? name : "without a name");
        }
    }
    robot->nq = 7 + joints;
    robot->nv = 6 + joints;
    if (m->nq != robot->nq || m->nv != robot->nv) {
        return mild_fail(error, MILD_ERROR_FORMAT, "%s: %d degrees of freedom instead of %d",
                         robot->path, (int)m->nv, robot->nv);
    }
    return MILD_OK;
}

/* Degrees of freedom between the base and the body, ascending. */
static int read_chain(const mjModel *m, int body, int dof[ROBOT_FOOT_DOFS_MAX]) {
    int reversed[ROBOT_FOOT_DOFS_MAX], count = 0;
    while (body > 0 && m->body_dofnum[body] == 0) { /* welded to its parent */
        body = m->body_parentid[body];
    }
    int last = body > 0 ? m->body_dofadr[body] + m->body_dofnum[body] - 1 : -1;
    for (int d = last; d >= 0 && count < ROBOT_FOOT_DOFS_MAX; d = m->dof_parentid[d]) {
        reversed[count++] = d;
    }
    for (int k = 0; k < count; k++) {
        dof[k] = reversed[count - 1 - k];
    }
    return count;
}

void robot_read_limb(Robot *robot, int b) {
    RobotLimb *limb = &robot->limb[b];
    limb->dofs = read_chain(robot->model, limb->body, limb->dof);
    for (int c = 0; c <= b; c++) {
        RobotLimb *other = &robot->limb[c];
        const int least = limb->dofs < other->dofs ? limb->dofs : other->dofs;
        int same = 0;
        while (same < least && limb->dof[same] == other->dof[same]) {
            same++;
        }
        limb->shared[c] = other->shared[b] = same;
    }
}

static MildStatus read_limbs(Robot *robot, MildError *error) {
    const RobotDef *def = &robot->def;
    for (int f = 0; f < def->feet; f++) {
        RobotLimb *limb = &robot->limb[f];
        robot_read_limb(robot, f);
        if (limb->dofs <= 6 || limb->dof[5] != 5) {
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%s: no joint between the base and body '%s' of [foot.%s]",
                             robot->path, def->foot[f].body, def->foot[f].name);
        }
        limb->ankle = -1;
        for (int i = 0; i < def->joints; i++) {
            limb->ankle = strcmp(def->joint[i], def->foot[f].ankle) == 0 ? i : limb->ankle;
        }
    }
    for (int i = 0; i < def->joints; i++) {
        int moved = 0;
        robot->joint_foot[i] = -1;
        for (int f = 0; f < def->feet; f++) {
            for (int k = 6; k < robot->limb[f].dofs; k++) {
                if (robot->limb[f].dof[k] == robot->dof[i]) {
                    robot->joint_foot[i] = moved++ ? -1 : f;
                }
            }
        }
    }
    return MILD_OK;
}

/* A round foot stands on a disc of its own radius, which stays level under its lowest point. This
 * is a polygon of the same area. */
static int round_outline(double radius, double outline[2 * ROBOT_OUTLINE_MAX]) {
    enum { CORNERS = 32 };
    double reach = radius * sqrt(mjPI / (0.5 * CORNERS * sin(2.0 * mjPI / CORNERS)));
    for (int i = 0; i < CORNERS; i++) {
        double angle = 2.0 * mjPI * (i + 0.5) / CORNERS;
        outline[2 * i] = reach * cos(angle);
        outline[2 * i + 1] = reach * sin(angle);
    }
    return CORNERS;
}

static void outline_center(const RobotFootDef *foot, double center[3]) {
    double low[2] = {DBL_MAX, DBL_MAX}, high[2] = {-DBL_MAX, -DBL_MAX};
    for (int i = 0; i < 2 * foot->outline_points; i++) {
        low[i % 2] = fmin(low[i % 2], foot->outline[i]);
        high[i % 2] = fmax(high[i % 2], foot->outline[i]);
    }
    center[0] = 0.5 * (low[0] + high[0]);
    center[1] = 0.5 * (low[1] + high[1]);
    center[2] = foot->z;
}

static MildStatus read_soles(Robot *robot, MildError *error) {
    for (int f = 0; f < robot->def.feet; f++) {
        RobotFootDef *foot = &robot->def.foot[f];
        RobotLimb *limb = &robot->limb[f];
        if (limb->round) {
            foot->outline_points = round_outline(foot->radius, foot->outline);
        } else {
            outline_center(foot, limb->sole_center);
        }
        MildSoleDef def = {foot->outline, foot->outline_points, foot->pitch, foot->z,
                           foot->elements};
        MildError cause = {0};
        robot->soles[f] = robot->rasters[f] = mild_sole_create(&def, &cause);
        robot->concentric[f] =
            robot->rasters[f] ? mild_sole_concentric(robot->rasters[f], &cause) : NULL;
        if (!robot->concentric[f]) {
            return mild_fail(error, cause.status, "%s: robot.ini, [foot.%s]: %s", robot->path,
                             foot->name, cause.text);
        }
    }
    return MILD_OK;
}

/* [m] Height of the sole in the pose of `data`. */
static double sole_height(const Robot *robot, int f, const mjData *data) {
    const RobotFootDef *foot = &robot->def.foot[f];
    const double *turn = data->xmat + 9 * robot->limb[f].body;
    double z = data->xpos[3 * robot->limb[f].body + 2];
    if (!robot->limb[f].round) {
        return z + foot->z; /* level */
    }
    const double *c = foot->center;
    return z + turn[6] * c[0] + turn[7] * c[1] + turn[8] * c[2] - foot->radius;
}

/* A flat sole does not roll: refuses a hinge above it that turns all the way round about a
 * horizontal axis, such as a wheel's. */
static MildStatus check_wheels(const Robot *robot, const mjData *data, MildError *error) {
    for (int f = 0; f < robot->def.feet; f++) {
        const RobotLimb *limb = &robot->limb[f];
        for (int k = 6; k < limb->dofs && !limb->round; k++) {
            const int joint = robot->model->dof_jntid[limb->dof[k]];
            const double *range = robot->model->jnt_range + 2 * joint;
            if (range[1] - range[0] >= 2 * mjPI && fabs(data->xaxis[3 * joint + 2]) < 0.5) {
                return mild_fail(
                    error, MILD_ERROR_FORMAT,
                    "%s: joint '%s' turns the sole of [foot.%s] all the way round, but "
                    "a sole does not roll; give it a range of less than a turn, or the "
                    "foot shape = round",
                    robot->path, mj_id2name(robot->model, mjOBJ_JOINT, joint),
                    robot->def.foot[f].name);
            }
        }
    }
    return MILD_OK;
}

static MildStatus measure_stand(Robot *robot, const mjData *data, MildError *error) {
    double lowest = DBL_MAX, base = data->xpos[3 * robot->base_body + 2];
    for (int f = 0; f < robot->def.feet; f++) {
        if (!robot->limb[f].round && data->xmat[9 * robot->limb[f].body + 8] < cos(LEVEL)) {
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%s: the sole of [foot.%s] is not level in [joints] pose of robot.ini",
                             robot->path, robot->def.foot[f].name);
        }
        lowest = fmin(lowest, sole_height(robot, f, data));
    }
    robot->stand_height = base - lowest;
    robot->total_mass = robot->model->body_subtreemass[robot->base_body];
    robot->pairs = 0;
    for (int f = 0; f < robot->def.feet; f++) {
        int g = robot->limb[f].mirror;
        if (f < g) {
            int first_is_left = data->xpos[3 * robot->limb[f].knee_body + 1] >=
                                data->xpos[3 * robot->limb[g].knee_body + 1];
            int *pair = robot->pair[robot->pairs++];
            pair[0] = first_is_left ? f : g;
            pair[1] = first_is_left ? g : f;
        }
    }
    return MILD_OK;
}

static MildStatus read_stand(Robot *robot, MildError *error) {
    const mjModel *m = robot->model;
    mjData *data = mj_makeData(m);
    if (!data) {
        return mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", robot->path);
    }
    for (int i = 0; i < robot->def.joints; i++) {
        double pose = robot->def.pose[i];
        if (pose < robot->low[i] || pose > robot->high[i]) {
            mj_deleteData(data);
            return mild_fail(error, MILD_ERROR_RANGE,
                             "%s: robot.ini, [joints] pose: %g of '%s' is outside its range %g .. "
                             "%g",
                             robot->path, pose, robot->def.joint[i], robot->low[i], robot->high[i]);
        }
        data->qpos[robot->dof[i] + 1] = pose;
    }
    mj_kinematics(m, data);
    MildStatus status = check_wheels(robot, data, error);
    if (status == MILD_OK) {
        status = measure_stand(robot, data, error);
    }
    mj_deleteData(data);
    return status;
}

static MildStatus check_models(Robot *robot, MildError *error) {
    MildStatus status = robot_check_model(robot->visual, robot->path, error);
    return status == MILD_OK ? robot_check_model(robot->model, robot->path, error) : status;
}

typedef MildStatus (*PartReader)(Robot *robot, MildError *error);

/* The readers one after the other, until one fails. readers: ends with NULL. */
static MildStatus read_all(const PartReader *readers, Robot *robot, MildError *error) {
    MildStatus status = MILD_OK;
    for (; status == MILD_OK && *readers; readers++) {
        status = (*readers)(robot, error);
    }
    return status;
}

MildStatus robot_read_models(Robot *robot, MildError *error) {
    static const PartReader parts[] = {read_bodies,       read_joints,     read_limbs, read_soles,
                                       robot_read_shells, robot_read_legs, NULL};
    return read_all(parts, robot, error);
}

static MildStatus read_robot(Robot *robot, const char *folder, MildError *error) {
    MildStatus status = robot_def_read(folder, &robot->def, error);
    if (status != MILD_OK) {
        return status;
    }
    if (snprintf(robot->path, sizeof robot->path, "%s/%s", folder, robot->def.model) >=
        (int)sizeof robot->path) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "path too long: %.200s...", folder);
    }
    static const PartReader parts[] = {robot_load_models,      check_models, robot_read_models,
                                       robot_read_shell_soles, read_stand,   NULL};
    return read_all(parts, robot, error);
}

void robot_set_gait(Robot *robot, const double *offset) {
    for (int f = 0; f < robot->def.feet; f++) {
        robot->table.gait_offset[f] = offset ? offset[f % 4] : robot->def.foot[f].offset;
    }
}

/* Once the rest is known. */
static void fill_table(Robot *robot) {
    const RobotDef *def = &robot->def;
    RobotTable *table = &robot->table;
    table->joints = def->joints;
    table->actions = def->joints - def->driven;
    table->feet = def->feet;
    for (int i = 0; i < def->joints; i++) {
        table->joint_foot[i] = robot->joint_foot[i];
        table->default_pose[i] = def->pose[i];
        table->joint_low[i] = robot->low[i];
        table->joint_high[i] = robot->high[i];
        table->effort[i] = robot->effort[i];
        table->speed[i] = def->speed[i];
        table->full_speed[i] = def->full_speed[i];
        table->swing[i] = def->swing[i];
        table->still[i] = def->still[i];
    }
    robot_set_gait(robot, NULL);
    memcpy(table->feet_range, def->feet_range, sizeof table->feet_range);
    memcpy(table->knee_range, def->knee_range, sizeof table->knee_range);
    table->feet_least = def->feet_least;
    table->knee_least = def->knee_least;
    memcpy(table->assist, def->assist, sizeof table->assist);
    table->total_mass = robot->total_mass;
    table->stand_height = robot->stand_height;
    table->nominal_height = robot_nominal_height(robot);
    table->action_scale = def->action_scale;
    table->foot_force = def->foot_force;
}

typedef struct {
    Robot *robot;
    const char *folder;
} Reading;

static MildStatus read_guarded(void *context, MildError *error) {
    const Reading *reading = context;
    return read_robot(reading->robot, reading->folder, error);
}

Robot *robot_create(const char *folder, MildError *error) {
    Robot *robot = calloc(1, sizeof *robot);
    if (!robot) {
        mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", folder);
        return NULL;
    }
    Reading reading = {robot, folder};
    if (engine_call(read_guarded, &reading, folder, error) != MILD_OK) {
        robot_destroy(robot);
        return NULL;
    }
    fill_table(robot);
    return robot;
}

void robot_destroy(Robot *robot) {
    if (!robot) {
        return;
    }
    robot_take_rasters(robot);
    for (int b = 0; b < ROBOT_BODIES_MAX; b++) {
        mild_sole_destroy(robot->soles[b]);
    }
    for (int f = 0; f < ROBOT_FEET_MAX; f++) {
        mild_sole_destroy(robot->concentric[f]);
    }
    for (int s = 0; s < ROBOT_SHELLS_MAX; s++) {
        free(robot->shell[s].vertices);
    }
    mj_deleteModel(robot->model);
    mj_deleteModel(robot->visual);
    free(robot);
}

const char *robot_name(const Robot *robot) {
    return robot->def.name;
}

const char *robot_source(const Robot *robot) {
    return robot->def.source;
}

const char *robot_model_path(const Robot *robot) {
    return robot->path;
}

int robot_joints(const Robot *robot) {
    return robot->def.joints;
}

int robot_actions(const Robot *robot) {
    return robot->def.joints - robot->def.driven;
}

int robot_feet(const Robot *robot) {
    return robot->def.feet;
}

int robot_points(const Robot *robot) {
    int points = 1;
    for (int f = 0; f < robot->def.feet; f++) {
        points = points && robot->limb[f].round;
    }
    return points;
}

const char *robot_joint_name(const Robot *robot, int joint) {
    return robot->def.joint[joint];
}

const char *robot_foot_name(const Robot *robot, int foot) {
    return robot->def.foot[foot].name;
}

double robot_total_mass(const Robot *robot) {
    return robot->total_mass;
}

double robot_foot_load(const Robot *robot) {
    return -(1.0 / robot->def.feet) * robot->total_mass * robot->model->opt.gravity[2];
}

double robot_stand_height(const Robot *robot) {
    return robot->stand_height;
}

double robot_nominal_height(const Robot *robot) {
    return robot->def.height;
}

const double *robot_default_pose(const Robot *robot) {
    return robot->def.pose;
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

const double *robot_speed(const Robot *robot) {
    return robot->def.speed;
}

const double *robot_kp(const Robot *robot) {
    return robot->def.kp;
}

const double *robot_kd(const Robot *robot) {
    return robot->def.kd;
}

const double *robot_stand_kp(const Robot *robot) {
    return robot->def.stand_kp;
}

const double *robot_stand_kd(const Robot *robot) {
    return robot->def.stand_kd;
}

const double *robot_swing(const Robot *robot) {
    return robot->def.swing;
}

const int *robot_joint_foot(const Robot *robot) {
    return robot->joint_foot;
}

const int *robot_joint_dof(const Robot *robot) {
    return robot->dof;
}

int robot_foot_body(const Robot *robot, int foot) {
    return robot->limb[foot].body;
}

int robot_ankle(const Robot *robot, int foot) {
    return robot->limb[foot].ankle;
}

const int *robot_mirror_joint(const Robot *robot) {
    return robot->mirror_joint;
}

const double *robot_mirror_sign(const Robot *robot) {
    return robot->def.mirror_sign;
}

double robot_mirror_shift(const Robot *robot) {
    const double *offset = robot->table.gait_offset;
    double shift = -1;
    for (int f = 0; f < robot->def.feet; f++) {
        const double own = fabs(offset[f] - offset[robot->limb[f].mirror]);
        if ((own != 0 && own != 0.5) || (f > 0 && own != shift)) {
            return -1;
        }
        shift = own;
    }
    return shift;
}

const RobotTable *robot_table(const Robot *robot) {
    return &robot->table;
}

const MildSole *const *robot_soles(const Robot *robot) {
    return (const MildSole *const *)(robot->is_concentric ? robot->concentric : robot->soles);
}

int robot_bodies(const Robot *robot) {
    const int shells = robot->shells_stand && !robot->is_concentric;
    return robot->def.feet + (shells ? robot->shell_bodies : 0);
}

void robot_set_shells(Robot *robot, int stand) {
    robot->shells_stand = stand;
    robot->table.shells_stand = robot_bodies(robot) > robot->def.feet;
}

const MildSole *const *robot_rasters(const Robot *robot) {
    return (const MildSole *const *)robot->rasters;
}

void robot_set_model(Robot *robot, MildModel model) {
    robot->is_concentric = mild_model_is_concentric(model);
    robot->table.shells_stand = robot_bodies(robot) > robot->def.feet;
}

MildStatus robot_match_model(const Robot *robot, MildModel model, const MildMaterial *from,
                             MildMaterial *rival, MildError *error) {
    return mild_model_match(model, from, robot->rasters[0], robot_foot_load(robot), rival, error);
}

const mjModel *robot_visual_model(const Robot *robot) {
    return robot->visual;
}

void robot_engine_rates(const Robot *robot, const double *rates, double *engine) {
    memcpy(engine, rates, 6 * sizeof *engine);
    for (int i = 0; i < robot->def.joints; i++) {
        engine[robot->dof[i]] = rates[6 + i];
    }
}

void robot_engine_qpos(const Robot *robot, const double *qpos, double *engine) {
    memcpy(engine, qpos, 7 * sizeof *engine);
    for (int i = 0; i < robot->def.joints; i++) {
        engine[robot->dof[i] + 1] = qpos[7 + i];
    }
}

/* ---- robots by name: the folders under robots/ that ship with the program ---- */

static int compare_names(const void *a, const void *b) {
    return strcmp(a, b);
}

static int has_ini(const char *name) {
    char relative[ROBOT_LISTED_SIZE + 32], path[PATH_SIZE];
    snprintf(relative, sizeof relative, "robots/%s/robot.ini", name);
    return access(path_data(relative, path), R_OK) == 0;
}

int robot_list(char names[][ROBOT_LISTED_SIZE], int most) {
    char path[PATH_SIZE];
    int count = 0;
    DIR *folder = opendir(path_data("robots", path));
    for (struct dirent *entry = folder ? readdir(folder) : NULL; entry; entry = readdir(folder)) {
        size_t length = strlen(entry->d_name);
        if (entry->d_name[0] != '.' && length < ROBOT_LISTED_SIZE && count < most &&
            has_ini(entry->d_name)) {
            memcpy(names[count++], entry->d_name, length + 1);
        }
    }
    if (folder) {
        closedir(folder);
    }
    qsort(names, (size_t)count, sizeof *names, compare_names);
    return count;
}

const char *robot_policy(const char *name, char *path) {
    char relative[ROBOT_LISTED_SIZE + 32];
    if (name && !strchr(name, '/') && strlen(name) < ROBOT_LISTED_SIZE) {
        snprintf(relative, sizeof relative, "policies/%s.safetensors", name);
        if (access(path_data(relative, path), R_OK) == 0) {
            return path;
        }
    }
    return path_data("policies/mild.safetensors", path);
}

Robot *robot_open(const char *name, MildError *error) {
    char path[PATH_SIZE], names[ROBOT_LISTED_MAX][ROBOT_LISTED_SIZE];
    if (strchr(name, '/') || strcmp(name, ".") == 0) {
        return robot_create(name, error);
    }
    const char *known[ROBOT_LISTED_MAX];
    int count = robot_list(names, ROBOT_LISTED_MAX);
    for (int i = 0; i < count; i++) {
        known[i] = names[i];
        if (strcmp(names[i], name) == 0) {
            char relative[ROBOT_LISTED_SIZE + 8];
            snprintf(relative, sizeof relative, "robots/%s", name);
            return robot_create(path_data(relative, path), error);
        }
    }
    mild_fail(
        error, MILD_ERROR_ARGUMENT,
        "unknown robot '%.60s'; nearest is '%s' (mild info robots lists all; write a folder of "
        "your own with a slash, as ./%.60s)",
        name, count ? text_nearest(name, known, count) : "none", name);
    return NULL;
}
