#include "robot/engine/read.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <mujoco/mujoco.h>

#include "robot/description.h"
#include "robot/engine/model.h"

_Static_assert(sizeof(EngineNumbers) == ENGINE_NUMBERS * sizeof(double),
               "numbers and nothing else");
_Static_assert(ENGINE_CORNERS_MAX >= ROBOT_FEET_MAX * ROBOT_CORNERS_MAX,
               "all corners have a place");

/* A body's frame in the frame of the link that it moves with. */
typedef struct {
    int link;           /* -1: fixed to the world */
    double position[3]; /* [m] */
    double rotation[9]; /* [-] body -> link */
} Mount;

typedef struct {
    const Robot *robot;
    const mjModel *model;
    EngineTree *tree;
    EngineNumbers *number;
    Mount *mount; /* [nbody] */
    MildError *error;
} Reading;

static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

/* The frame at `position` and `quaternion` in `from`. */
static Mount mount_at(const Mount *from, const double *position, const double *quaternion) {
    Mount mount = {.link = from->link};
    double rotation[9];
    mju_mulMatVec3(mount.position, from->rotation, position);
    mju_addTo3(mount.position, from->position);
    mju_quat2Mat(rotation, quaternion);
    mju_mulMatMat(mount.rotation, from->rotation, rotation, 3, 3, 3);
    return mount;
}

/* ---- the tree ---- */

static void read_tree(Reading *r) {
    const mjModel *m = r->model;
    EngineTree *tree = r->tree;
    const int links = 1 + tree->joints;
    for (int i = 1; i < links; i++) {
        const int above = m->dof_parentid[5 + i];
        const int parent = above < 6 ? 0 : above - 5;
        tree->parent[i] = (EngineIndex)parent;
        tree->level[i] = (EngineIndex)(tree->level[parent] + 1);
        tree->levels = tree->level[i] >= tree->levels ? tree->level[i] + 1 : tree->levels;
        if (parent == 0) {
            tree->base_link[tree->base_links++] = (EngineIndex)i;
        }
    }
    for (int i = links - 1; i >= 0; i--) {
        const int parent = tree->parent[i];
        tree->end[i] = tree->end[i] > i ? tree->end[i] : (EngineIndex)(i + 1);
        tree->end[parent] = tree->end[parent] > tree->end[i] ? tree->end[parent] : tree->end[i];
        if (tree->end[i] == i + 1) {
            tree->leaf[tree->leaves++] = (EngineIndex)i;
        }
    }
    for (int j = 0; j < tree->joints; j++) { /* of a body with several hinges the last one counts */
        const int i = r->robot->dof[j] - 5;
        tree->joint[i] = (EngineIndex)j;
        for (int k = 1; k < links; k++) {
            if (m->dof_bodyid[5 + k] == m->dof_bodyid[5 + i]) {
                tree->scale[k] = (EngineIndex)(1 + j);
            }
        }
    }
}

/* The degrees of freedom down to each link, and what follows for each of them. */
static void read_rows(EngineTree *tree) {
    const int dofs = 6 + tree->joints;
    for (int i = 0; i <= tree->joints; i++) {
        const int level = tree->level[i];
        for (int place = 0; place < 6; place++) {
            tree->row_dof[i][place] = (EngineIndex)place;
        }
        if (i > 0) {
            memcpy(tree->row_dof[i], tree->row_dof[tree->parent[i]], 5 + (size_t)level);
            tree->row_dof[i][5 + level] = (EngineIndex)(5 + i);
        }
    }
    for (int d = 0; d < dofs; d++) {
        const int link = d < 6 ? 0 : d - 5;
        tree->above[d] = (EngineIndex)(d < 6 ? d : 5 + tree->level[link]);
        tree->behind[d] = (EngineIndex)(d < 6 ? dofs : 5 + tree->end[link]);
        for (int place = 0; place <= tree->above[d]; place++) {
            tree->path[d] |= 1ull << tree->row_dof[link][place];
        }
    }
    tree->chain = 5 + tree->levels;
}

static void add_row(EngineTree *tree, int dof) {
    for (int place = 0; place <= tree->above[dof]; place++) {
        tree->entry[tree->entries++] =
            (EngineEntry){(EngineIndex)dof, (EngineIndex)place, tree->behind[dof]};
    }
}

static void list_entries(EngineTree *tree) {
    for (int d = 0; d < 6; d++) {
        add_row(tree, d);
    }
    for (int level = 1; level < tree->levels; level++) {
        tree->level_entry[level] = (short)tree->entries;
        for (int i = 1; i <= tree->joints; i++) {
            if (tree->level[i] == level) {
                add_row(tree, 5 + i);
            }
        }
    }
    tree->level_entry[tree->levels] = (short)tree->entries;
}

/* ---- numbers of the links ---- */

/* MuJoCo's own limits on the numbers of a soft constraint. */
static EngineSoft read_soft(const Reading *r, const double *solref, const double *solimp) {
    EngineSoft soft = {.nearest = mju_clip(solimp[0], mjMINIMP, mjMAXIMP),
                       .farthest = mju_clip(solimp[1], mjMINIMP, mjMAXIMP),
                       .width = solimp[2] > mjMINVAL ? solimp[2] : 0,
                       .midpoint = mju_clip(solimp[3], mjMINIMP, mjMAXIMP),
                       .power = mju_max(1, solimp[4])};
    const double far = soft.farthest;
    if (solref[0] > 0) { /* time constant and damping ratio */
        const int safe = !(r->model->opt.disableflags & mjDSBL_REFSAFE);
        const double time = safe ? mju_max(solref[0], 2 * r->number->dt) : solref[0];
        soft.stiffness = 1 / mju_max(mjMINVAL, far * far * time * time * solref[1] * solref[1]);
        soft.damping = 2 / mju_max(mjMINVAL, far * time);
    } else { /* stiffness and damping, both negative */
        soft.stiffness = -solref[0] / (far * far);
        soft.damping = -solref[1] / far;
    }
    return soft;
}

/* rotation about an axis = outer + cos (1 - outer) + sin [axis]x, outer = axis axis^T */
static void read_turn(EngineLink *link, const double *rest, const double *axis) {
    double outer[9];
    double across[9];
    const double cross[9] = {0, -axis[2], axis[1], axis[2], 0, -axis[0], -axis[1], axis[0], 0};
    for (int e = 0; e < 9; e++) {
        outer[e] = axis[e / 3] * axis[e % 3];
        across[e] = identity[e] - outer[e];
    }
    const double *const part[3] = {outer, across, cross};
    for (int n = 0; n < 3; n++) {
        double turn[9];
        mju_mulMatMat(turn, rest, part[n], 3, 3, 3);
        for (int e = 0; e < 9; e++) {
            link->turn[n][e / 3 * 4 + e % 3] = turn[e];
        }
    }
}

/* Hinge `id`, whose body lies at *mount before it turns; moves *mount behind it. */
static MildStatus read_hinge(Reading *r, int id, Mount *mount) {
    const mjModel *m = r->model;
    const int dof = m->jnt_dofadr[id];
    EngineLink *link = &r->number->link[dof - 5];
    const double *range = m->jnt_range + 2 * id;
    double anchor[3];
    mju_mulMatVec3(anchor, mount->rotation, m->jnt_pos + 3 * id);
    for (int k = 0; k < 3; k++) {
        link->turn[0][4 * k + 3] = anchor[k] + mount->position[k];
    }
    mju_copy3(link->axis, m->jnt_axis + 3 * id);
    read_turn(link, mount->rotation, link->axis);
    link->reference = m->qpos0[m->jnt_qposadr[id]];
    link->armature = m->dof_armature[dof];
    link->damping = m->dof_damping[dof];
    link->effort = r->robot->effort[r->tree->joint[dof - 5]];
    link->low = range[0];
    link->high = range[1];
    link->margin = m->jnt_margin[id];
    link->inverse_inertia = m->dof_invweight0[dof];
    link->limit = read_soft(r, m->jnt_solref + mjNREF * id, m->jnt_solimp + mjNIMP * id);
    mount->link = dof - 5;
    mju_scl3(mount->position, m->jnt_pos + 3 * id, -1);
    mju_copy(mount->rotation, identity, 9);
    if (2 * link->margin > range[1] - range[0]) {
        const char *name = mj_id2name(m, mjOBJ_JOINT, id);
        return mild_fail(r->error, MILD_ERROR_RANGE,
                         "%.150s: joint '%.60s': margin %g is wider than half the range %g .. %g",
                         r->robot->path, name ? name : "", link->margin, range[0], range[1]);
    }
    return MILD_OK;
}

/* ---- inertia ---- */

/* R S R^T of a diagonal S: xx yy zz xy xz yz. */
static void turn_diagonal(const double *R, const double *diagonal, double *tensor) {
    static const int row[6] = {0, 1, 2, 0, 0, 1};
    static const int column[6] = {0, 1, 2, 1, 2, 2};
    for (int e = 0; e < 6; e++) {
        tensor[e] = 0;
        for (int k = 0; k < 3; k++) {
            tensor[e] += R[3 * row[e] + k] * diagonal[k] * R[3 * column[e] + k];
        }
    }
}

static void read_inertia(Reading *r, int body) {
    const mjModel *m = r->model;
    const Mount mount =
        mount_at(&r->mount[body], m->body_ipos + 3 * body, m->body_iquat + 4 * body);
    EngineNumbers *number = r->number;
    const double mass = m->body_mass[body];
    double tensor[6];
    if (mount.link < 0) {
        return;
    }
    turn_diagonal(mount.rotation, m->body_inertia + 3 * body, tensor);
    if (body == r->robot->base_body) {
        number->base_mass = mass;
        mju_copy3(number->base_center, mount.position);
        memcpy(number->base_inertia, tensor, sizeof tensor);
        return;
    }
    EngineLink *link = &number->link[mount.link];
    double *sum = m->body_jntnum[body] > 0 ? link->inertia : link->welded;
    const double *c = mount.position;
    const double square = mju_dot3(c, c);
    const double parallel[6] = {square - c[0] * c[0], square - c[1] * c[1], square - c[2] * c[2],
                                -c[0] * c[1],         -c[0] * c[2],         -c[1] * c[2]};
    sum[INERTIA_MASS] += mass;
    mju_addToScl3(sum + INERTIA_MOMENT, c, mass);
    for (int e = 0; e < 6; e++) {
        sum[INERTIA_TENSOR + e] += tensor[e] + mass * parallel[e];
    }
}

/* Bodies come after their parents. */
static MildStatus read_bodies(Reading *r) {
    const mjModel *m = r->model;
    r->mount[0].link = -1;
    for (int b = 1; b < m->nbody; b++) {
        Mount *mount = &r->mount[b];
        const Mount *parent = &r->mount[m->body_parentid[b]];
        *mount = (Mount){.link = -1};
        if (b == r->robot->base_body) {
            mount->link = 0;
            memcpy(mount->rotation, identity, sizeof identity);
        } else if (parent->link >= 0) {
            *mount = mount_at(parent, m->body_pos + 3 * b, m->body_quat + 4 * b);
            for (int k = 0; k < m->body_jntnum[b]; k++) {
                MildStatus status = read_hinge(r, m->body_jntadr[b] + k, mount);
                if (status != MILD_OK) {
                    return status;
                }
            }
        } else if (m->body_jntnum[b] > 0) {
            const char *name = mj_id2name(m, mjOBJ_JOINT, m->body_jntadr[b]);
            return mild_fail(
                r->error, MILD_ERROR_FORMAT,
                "%.150s: joint '%.60s' is not behind body '%.60s', which all joints of "
                "the batch engine must be",
                r->robot->path, name ? name : "", r->robot->def.base);
        }
        read_inertia(r, b);
    }
    return MILD_OK;
}

/* ---- feet ---- */

static void read_foot(Reading *r, int f) {
    const RobotFootDef *def = &r->robot->def.foot[f];
    const RobotLimb *limb = &r->robot->limb[f];
    const Mount *mount = &r->mount[limb->body];
    EngineTree *tree = r->tree;
    EngineFoot *foot = &r->number->foot[f];
    static const double upright[4] = {1, 0, 0, 0};
    const double origin[3] = {0, 0, 0};
    const Mount at = mount_at(mount, limb->round ? def->center : origin, upright);
    tree->foot_link[f] = (EngineIndex)mount->link;
    tree->foot_round[f] = limb->round != 0;
    mju_copy3(foot->reference, at.position);
    foot->radius = limb->round ? def->radius : 0;
    memcpy(foot->turn, at.rotation, sizeof foot->turn);
    foot->corner_radius = def->corner_radius;
    foot->inverse_inertia = r->model->body_invweight0[2 * limb->body];
    const Mount *knee = &r->mount[limb->knee_body];
    tree->knee_link[f] = (EngineIndex)knee->link;
    mju_copy3(foot->knee, knee->position);
    mju_copy3(foot->center, limb->sole_center);
    tree->outline_points[f] = (short)(limb->round ? 0 : def->outline_points);
    memcpy(foot->outline, def->outline, 2 * sizeof(double) * (size_t)tree->outline_points[f]);
    for (int g = 0; g < r->robot->def.feet; g++) {
        tree->shared[f][g] = (EngineIndex)(f == g ? limb->dofs : limb->shared[g]);
    }
    tree->corner_begin[f] = (EngineIndex)tree->corners;
    for (int c = 0; c < def->corner_count; c++) {
        const Mount corner = mount_at(mount, def->corners + 3 * c, upright);
        tree->corner_foot[tree->corners] = (EngineIndex)f;
        mju_copy3(r->number->corner[tree->corners++], corner.position);
    }
    tree->corner_begin[f + 1] = (EngineIndex)tree->corners;
}

static MildStatus read_shell(Reading *r, int s) {
    const RobotShell *shell = &r->robot->shell[s];
    const Mount *mount = &r->mount[shell->body];
    EngineShell *to = &r->number->shell[s];
    if (mount->link < 0) {
        return mild_fail(r->error, MILD_ERROR_FORMAT,
                         "%.150s: geom '%.60s' of [robot] shells does not move with the robot",
                         r->robot->path, r->robot->def.shell[s]);
    }
    r->tree->shell_link[s] = (EngineIndex)mount->link;
    mju_mulMatVec3(to->center, mount->rotation, shell->center);
    mju_addTo3(to->center, mount->position);
    mju_mulMatMat(to->rotation, mount->rotation, shell->rotation, 3, 3, 3);
    mju_copy3(to->half, shell->half);
    to->radius = shell->radius;
    return MILD_OK;
}

/* Bodies whose shells stand. */
static MildStatus read_bodies_of_shells(Reading *r) {
    const Robot *robot = r->robot;
    const int feet = robot->def.feet;
    const int bodies = robot_bodies(robot) - feet;
    if (bodies > ENGINE_BODIES_MAX) {
        return mild_fail(r->error, MILD_ERROR_RANGE,
                         "%.200s: the geoms of [robot] shells are on %d bodies; the batch engine "
                         "lets those of %d stand",
                         robot->path, bodies, ENGINE_BODIES_MAX);
    }
    r->tree->bodies = bodies;
    for (int s = 0; s < robot->shells; s++) {
        const int body = robot->shell[s].limb - feet;
        const int stands = body >= 0 && body < bodies;
        r->tree->shell_body[s] = (EngineIndex)(stands ? body : ENGINE_BODIES_MAX);
    }
    for (int b = 0; b < bodies; b++) {
        const RobotLimb *limb = &robot->limb[feet + b];
        const Mount *mount = &r->mount[limb->body];
        r->tree->body_link[b] = (EngineIndex)mount->link;
        mju_copy3(r->number->body[b].position, mount->position);
        memcpy(r->number->body[b].turn, mount->rotation, sizeof mount->rotation);
        r->number->body[b].inverse_inertia = r->model->body_invweight0[2 * limb->body];
        for (int other = 0; other <= feet + b; other++) {
            const int same = other == feet + b;
            const EngineIndex shared = (EngineIndex)(same ? limb->dofs : limb->shared[other]);
            r->tree->body_shared[b][other] = shared;
            if (other >= feet) {
                r->tree->body_shared[other - feet][feet + b] = shared;
            }
        }
    }
    return MILD_OK;
}

static void read_legs(Reading *r) {
    const Robot *robot = r->robot;
    for (int c = 0; c < robot->capsules; c++) {
        const RobotCapsule *from = &robot->capsule[c];
        const Mount *mount = &r->mount[from->body];
        LegCapsule *to = &r->number->capsule[c];
        r->tree->capsule_link[c] = (EngineIndex)mount->link;
        mju_mulMatVec3(to->center, mount->rotation, from->center);
        mju_addTo3(to->center, mount->position);
        mju_mulMatVec3(to->half, mount->rotation, from->half);
        to->radius = from->radius;
    }
    r->number->leg_softness = 1 / robot->total_mass;
    r->tree->leg_pairs = robot->leg_pairs;
    for (int n = 0; n < 2 * robot->leg_pairs; n++) {
        r->tree->leg_pair[n / 2][n % 2] = (EngineIndex)robot->leg_pair[n / 2][n % 2];
    }
}

static MildStatus read_robot(Reading *r) {
    EngineTree *tree = r->tree;
    tree->joints = r->robot->def.joints;
    tree->feet = r->robot->def.feet;
    tree->levels = 1;
    read_tree(r);
    read_rows(tree);
    list_entries(tree);
    mju_copy3(r->number->gravity, r->model->opt.gravity);
    r->number->contact = read_soft(r, r->model->pair_solref, r->model->pair_solimp);
    MildStatus status = read_bodies(r);
    for (int f = 0; status == MILD_OK && f < tree->feet; f++) {
        read_foot(r, f);
    }
    tree->shells = r->robot->shells;
    for (int s = 0; status == MILD_OK && s < tree->shells; s++) {
        status = read_shell(r, s);
    }
    status = status == MILD_OK ? read_bodies_of_shells(r) : status;
    read_legs(r);
    tree->pairs = r->robot->pairs;
    for (int n = 0; n < 2 * tree->pairs; n++) {
        tree->pair[n / 2][n % 2] = (EngineIndex)r->robot->pair[n / 2][n % 2];
    }
    return status;
}

MildStatus engine_model_read(const Robot *robot, double dt, EngineTree *tree, double *number,
                             MildError *error) {
    const mjModel *model = robot->model;
    EngineNumbers numbers = {.dt = dt};
    Mount *mount = calloc((size_t)model->nbody, sizeof *mount);
    if (!mount) {
        return mild_fail(error, MILD_ERROR_MEMORY, "%.200s: out of memory", robot->path);
    }
    memset(tree, 0, sizeof *tree);
    Reading reading = {robot, model, tree, &numbers, mount, error};
    MildStatus status = read_robot(&reading);
    memcpy(number, &numbers, sizeof numbers);
    free(mount);
    return status;
}

void engine_model_sizes(const EngineTree *tree, char *text, size_t size) {
    snprintf(text, size,
             "#define ENGINE_JOINTS %d\n#define ENGINE_FEET %d\n#define ENGINE_CORNERS %d\n"
             "#define ENGINE_ENTRIES %d\n#define ENGINE_CHAIN %d\n#define ENGINE_BODIES %d\n",
             tree->joints, tree->feet, tree->corners, tree->entries, tree->chain,
             tree->bodies ? tree->bodies : 1);
}
