/* Writes what the page needs of a robot and its policy as one file (core.h), with the shipped
 * weights by which the robot knows its ground, if it has some.
 * Usage: web_pack ROBOT_FOLDER POLICY CONFIG OUTPUT */
#define MILD_REAL_FLOAT
#include "web/core.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "env/kernels.h"
#include "identify/belief/file.h"
#include "learn/network.h"
#include "learn/policy.h"
#include "robot/description.h"
#include "robot/engine/read.h"
#include "run/config/experiment_keys.h"

#define HIDDEN_GROUP 3 /* of geoms that are not drawn */

static int stop(const char *text) {
    fprintf(stderr, "web_pack: %s\n", text);
    return 2;
}

/* ---- the robot ---- */

/* The shells that stand, body by body. The page has no meshes. */
static MildStatus pack_shells(const Robot *robot, WebModel *file, MildError *error) {
    MildShape shapes[ROBOT_SHELLS_MAX];
    for (int b = 0; b < file->model.tree.bodies; b++) {
        const int count = robot_shell_shapes(robot, robot->def.feet + b, shapes);
        for (int s = 0; s < count; s++) {
            WebShell *shell = &file->shell[file->shells++];
            if (shapes[s].type == MILD_SHAPE_MESH) {
                return mild_fail(error, MILD_ERROR_FORMAT,
                                 "%s: a shell is a mesh, which the page "
                                 "does not have; name a box, a capsule or a sphere",
                                 robot->path);
            }
            shell->body = b;
            shell->type = shapes[s].type;
            memcpy(shell->size, shapes[s].size, sizeof shell->size);
            memcpy(shell->pos, shapes[s].pos, sizeof shell->pos);
            memcpy(shell->quat, shapes[s].quat, sizeof shell->quat);
        }
    }
    file->shell_spacing = robot->def.shell_spacing;
    return MILD_OK;
}

static MildStatus pack_model(const Robot *robot, const TaskDef *task, WebModel *file,
                             MildError *error) {
    static double number[ENGINE_NUMBERS];
    static EngineTree tree;
    MildStatus status = engine_model_read(robot, task->physics_dt, &tree, number, error);
    if (status == MILD_OK) {
        envs_model_fill(&tree, number, &file->model);
        file->robot = *robot_table(robot);
        file->shape = task_shape(task, robot);
        file->gravity = -robot->model->opt.gravity[2];
        memcpy(file->task, task, sizeof file->task);
        status = task_gains(task, robot, &file->gains, error);
    }
    for (int f = 0; status == MILD_OK && f < robot->def.feet; f++) {
        const RobotFootDef *foot = &robot->def.foot[f];
        WebSole *sole = &file->sole[f];
        *sole = (WebSole){foot->outline_points, foot->elements, foot->pitch, foot->z, {0}};
        memcpy(sole->outline, foot->outline, sizeof sole->outline);
    }
    if (status == MILD_OK) {
        status = pack_shells(robot, file, error);
    }
    return status;
}

/* The link that a body moves with, -1 for the world, and where the link is in the reference pose:
 * its origin is the anchor of its last hinge. */
static int link_of(const mjModel *m, const mjData *d, int body, double *origin, double *rotation) {
    while (body > 0 && m->body_jntnum[body] == 0) {
        body = m->body_parentid[body];
    }
    if (body == 0) {
        return -1;
    }
    const int joint = m->body_jntadr[body] + m->body_jntnum[body] - 1;
    const int hinge = m->jnt_type[joint] == mjJNT_HINGE;
    mju_copy(rotation, d->xmat + 9 * body, 9);
    mju_copy3(origin, hinge ? d->xanchor + 3 * joint : d->xpos + 3 * body);
    return hinge ? m->jnt_dofadr[joint] - 5 : 0;
}

static int shape_of(const mjModel *m, int geom) {
    switch (m->geom_type[geom]) {
    case mjGEOM_BOX: return WEB_BOX;
    case mjGEOM_CYLINDER: return WEB_CYLINDER;
    case mjGEOM_SPHERE:
    case mjGEOM_CAPSULE: return WEB_CAPSULE;
    case mjGEOM_ELLIPSOID: return WEB_ELLIPSOID;
    default: return -1;
    }
}

static void pack_geom(const mjModel *m, const mjData *d, int id, WebModel *file) {
    double origin[3], turn[9], way[3], position[3], rotation[9];
    WebGeom *geom = &file->geom[file->geoms];
    const int link = link_of(m, d, m->geom_bodyid[id], origin, turn);
    if (m->geom_group[id] == HIDDEN_GROUP || link < 0 || shape_of(m, id) < 0 ||
        file->geoms == WEB_GEOMS_MAX) {
        return;
    }
    const int material = m->geom_matid[id];
    const float *color = material >= 0 ? m->mat_rgba + 4 * material : m->geom_rgba + 4 * id;
    mju_sub3(way, d->geom_xpos + 3 * id, origin);
    mju_mulMatTVec3(position, turn, way);
    mju_mulMatTMat(rotation, turn, d->geom_xmat + 9 * id, 3, 3, 3);
    geom->shape = shape_of(m, id);
    geom->link = link;
    for (int k = 0; k < 9; k++) {
        geom->rotation[k] = (float)rotation[k];
    }
    for (int k = 0; k < 3; k++) {
        geom->size[k] = (float)m->geom_size[3 * id + k];
        geom->position[k] = (float)position[k];
        geom->color[k] = color[k];
    }
    geom->shine = material >= 0 ? m->mat_specular[material] : 0.2f;
    geom->glow = material >= 0 ? m->mat_emission[material] : 0;
    file->geoms++;
}

static MildStatus pack_picture(const Robot *robot, WebModel *file, MildError *error) {
    const mjModel *m = robot->visual;
    mjData *d = mj_makeData(m);
    if (!d) {
        return mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    }
    mj_kinematics(m, d);
    for (int id = 0; id < m->ngeom; id++) {
        pack_geom(m, d, id, file);
    }
    mj_deleteData(d);
    return file->geoms < WEB_GEOMS_MAX
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_RANGE, "the robot has %d parts to draw or more",
                           WEB_GEOMS_MAX);
}

/* ---- the policy ---- */

/* The nearest number of 16 bits (IEEE 754), ties to even; weights are far from its limits. */
static uint16_t pack_half(float x) {
    const float size = fminf(fabsf(x), 65504) * 0x1p-112f;
    uint32_t bits;
    memcpy(&bits, &size, sizeof bits);
    return (uint16_t)(((bits + 0xfff + (bits >> 13 & 1)) >> 13) | (x < 0 ? 0x8000 : 0));
}

static WebNetwork widths_of(const Mlp *mlp) {
    WebNetwork network = {.layers = mlp->layers, .width = {mlp->layer[0].in}};
    for (int l = 0; l < mlp->layers; l++) {
        network.width[l + 1] = mlp->layer[l].out;
    }
    return network;
}

static uint16_t *pack_mlp(const Mlp *mlp, const float *parameters, uint16_t *to) {
    for (int l = 0; l < mlp->layers; l++) {
        const MlpLayer *layer = &mlp->layer[l];
        for (int i = 0; i < layer->in; i++) {
            for (int j = 0; j < layer->out; j++) {
                *to++ = pack_half(parameters[layer->weight + j * layer->in + i]);
            }
        }
        for (int j = 0; j < layer->out; j++) {
            *to++ = pack_half(parameters[layer->bias + j]);
        }
    }
    return to;
}

static long mlp_numbers(const Mlp *mlp) {
    const MlpLayer *last = &mlp->layer[mlp->layers - 1];
    return (long)(last->bias + last->out - mlp->layer[0].weight);
}

/* The weights, to be freed; NULL when out of memory. */
static uint16_t *pack_policy(Policy *policy, WebModel *file) {
    Network network;
    const PolicyDef *def = policy_def(policy);
    network_layout(&network, def, NULL);
    file->policy = (WebPolicy){.encoder = widths_of(&network.encoder),
                               .modulation = widths_of(&network.modulation),
                               .actor = widths_of(&network.actor),
                               .estimates = def->estimates,
                               .latent = def->latent,
                               .feet_velocity = def->feet_velocity_offset,
                               .per_dimension = def->modulation_per_dimension};
    file->weights = (int32_t)(mlp_numbers(&network.encoder) + mlp_numbers(&network.modulation) +
                              mlp_numbers(&network.actor));
    uint16_t *weights = malloc((size_t)file->weights * sizeof *weights);
    if (weights) {
        const float *parameters = policy_parameters(policy);
        uint16_t *to = pack_mlp(&network.encoder, parameters, weights);
        to = pack_mlp(&network.modulation, parameters, to);
        pack_mlp(&network.actor, parameters, to);
    }
    return weights;
}

/* ---- the file ---- */

static MildStatus write_file(const char *path, const WebModel *file, const uint16_t *weights,
                             MildError *error) {
    const size_t count = (size_t)file->weights * sizeof *weights;
    char *whole = malloc(sizeof *file + count);
    if (!whole) {
        return mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    }
    memcpy(whole, file, sizeof *file);
    memcpy(whole + sizeof *file, weights, count);
    MildStatus status = file_write(path, whole, sizeof *file + count, error);
    free(whole);
    return status;
}

static MildStatus pack_belief(const Robot *robot, WebModel *file, MildError *error) {
    BeliefNet *net;
    MildStatus status = belief_open(robot_name(robot), &net, error);
    file->knows = net != NULL;
    if (net) {
        file->belief = *net;
        free(net);
    }
    return status;
}

static int pack(Robot *robot, Policy *policy, const TaskDef *task, const char *path,
                MildError *error) {
    static WebModel file;
    const TaskShape shape = task_shape(task, robot);
    memcpy(file.magic, WEB_MAGIC, sizeof file.magic);
    file.bytes = (int32_t)sizeof file;
    if (policy_def(policy)->observation != shape.observation ||
        policy_def(policy)->scan != shape.scan) {
        return stop("the policy is another robot's");
    }
    if (shape.scan > 0) {
        return stop("the policy sees the ground (task.scan), which the page does not show it");
    }
    /* as speed_hold_def */
    file.hold = (SpeedHoldDef){.gain = policy_def(policy)->estimates ? task->speed_hold : 0,
                               .scale = task->velocity_scale,
                               .most = task->speed_hold_most,
                               .clock = shape.observation - 2};
    robot_set_shells(robot, task->shells_stand);
    MildStatus status = pack_model(robot, task, &file, error);
    if (status == MILD_OK) {
        status = pack_belief(robot, &file, error);
    }
    status = status == MILD_OK ? pack_picture(robot, &file, error) : status;
    uint16_t *weights = status == MILD_OK ? pack_policy(policy, &file) : NULL;
    if (status == MILD_OK) {
        status = weights ? write_file(path, &file, weights, error)
                         : mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    }
    free(weights);
    return status == MILD_OK ? 0 : stop(error->text);
}

int main(int argc, char **argv) {
    char unused[TRAIN_ROBOT_SIZE];
    TaskDef task;
    MildError error = {0};
    if (argc != 5) {
        return stop("usage: web_pack ROBOT_FOLDER POLICY CONFIG OUTPUT");
    }
    Robot *robot = robot_create(argv[1], &error);
    Policy *policy = robot ? policy_load(argv[2], NULL, 0, &error) : NULL;
    const int ready =
        policy && experiment_task(&task, 0, unused, argv[3], argv[2], &error) == MILD_OK;
    const int code = ready ? pack(robot, policy, &task, argv[4], &error) : stop(error.text);
    policy_destroy(policy);
    robot_destroy(robot);
    return code;
}
