/* The shells of a robot: parts of its bodies, from geoms of the MJCF, whose height above the ground
 * is measured, and which may stand as its soles do. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "robot/description.h"

#define SHELL_SKIN 1e-3 /* [m] a sole so near a shell is covered by it */

/* Number of the body among the limbs behind the feet; makes one for a body that has none there. A
 * foot's body has two, for its sole is a limb of its own. */
static int shell_limb(Robot *robot, int body, MildError *error) {
    const int limbs = robot->def.feet + robot->shell_bodies;
    for (int b = robot->def.feet; b < limbs; b++) {
        if (robot->limb[b].body == body) {
            return b;
        }
    }
    if (limbs == ROBOT_BODIES_MAX) {
        mild_fail(error, MILD_ERROR_RANGE,
                  "%s: the geoms of [robot] shells are on more than %d bodies", robot->path,
                  ROBOT_BODIES_MAX - robot->def.feet);
        return -1;
    }
    robot->shell_bodies++;
    robot->limb[limbs].body = body;
    robot_read_limb(robot, limbs);
    return limbs;
}

/* Bool: a point of the body lies in a shell, of a mesh in the box around it. */
static int shell_contains(const RobotShell *shell, const double point[3]) {
    double way[3], beyond[3];
    mju_sub3(way, point, shell->center);
    for (int k = 0; k < 3; k++) {
        const double *turn = shell->rotation + k;
        const double along = turn[0] * way[0] + turn[3] * way[1] + turn[6] * way[2];
        beyond[k] = fmax(fabs(along) - shell->half[k], 0.0);
    }
    return mju_norm3(beyond) <= shell->radius + SHELL_SKIN;
}

/* Of a capsule the part that does not reach into a ball; bool: there is one. The axis p(t) = center
 * + t axis, |t| <= half, keeps what is at least `far` from the ball's centre: with b = axis . way
 * the roots of |p(t) - ball|^2 = far^2 are b +- sqrt(far^2 - |way|^2 + b^2). */
static int trim_capsule(RobotShell *capsule, const double ball[3], double ball_radius) {
    const double axis[3] = {capsule->rotation[2], capsule->rotation[5], capsule->rotation[8]};
    const double far = ball_radius + capsule->radius;
    double way[3];
    mju_sub3(way, ball, capsule->center);
    const double b = mju_dot3(axis, way), square = far * far - mju_dot3(way, way) + b * b;
    if (square <= 0.0) {
        return 1;
    }
    const double root = sqrt(square);
    double low = -capsule->half[2], high = capsule->half[2];
    if (b + root <= low || b - root >= high) {
        return 1;
    }
    if (b - root - low > high - (b + root)) {
        high = b - root;
    } else {
        low = b + root;
    }
    mju_addToScl3(capsule->center, axis, 0.5 * (low + high));
    capsule->half[2] = 0.5 * (high - low);
    return high > low;
}

/* A shell on a foot's body: what its sole covers is the sole's. The end of a capsule in a round
 * foot is cut off; nothing else may reach over the sole. */
static MildStatus beside_sole(const Robot *robot, RobotShell *shell, const char *name,
                              MildError *error) {
    for (int f = 0; f < robot->def.feet; f++) {
        const RobotFootDef *foot = &robot->def.foot[f];
        const RobotLimb *limb = &robot->limb[f];
        if (limb->body != shell->body) {
            continue;
        }
        const int capsule = shell->radius > 0.0 && shell->half[2] > 0.0;
        const double *sole = limb->round ? foot->center : limb->sole_center;
        if (limb->round && capsule ? !trim_capsule(shell, sole, foot->radius)
                                   : shell_contains(shell, sole)) {
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%s: geom '%s' of [robot] shells covers the sole of foot '%s': leave "
                             "it out, the foot stands there",
                             robot->path, name, foot->name);
        }
    }
    return MILD_OK;
}

/* The shape of a mesh's geom, and the box around it. MuJoCo's vertices are those of the geom's
 * frame. */
static MildStatus read_mesh(const mjModel *m, int geom, RobotShell *shell, MildError *error) {
    const int mesh = m->geom_dataid[geom], count = m->mesh_vertnum[mesh];
    const float *vertex = m->mesh_vert + 3 * m->mesh_vertadr[mesh];
    const double *box = m->geom_aabb + 6 * geom;
    shell->vertices = malloc(3 * (size_t)count * sizeof *shell->vertices);
    if (!shell->vertices) {
        return mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    }
    for (int i = 0; i < 3 * count; i++) {
        shell->vertices[i] = (double)vertex[i];
    }
    shell->mesh = (MildShape){.type = MILD_SHAPE_MESH,
                              .vertices = shell->vertices,
                              .vertex_count = count,
                              .triangles = m->mesh_face + 3 * m->mesh_faceadr[mesh],
                              .triangle_count = m->mesh_facenum[mesh]};
    memcpy(shell->mesh.pos, m->geom_pos + 3 * geom, sizeof shell->mesh.pos);
    memcpy(shell->mesh.quat, m->geom_quat + 4 * geom, sizeof shell->mesh.quat);
    mju_rotVecQuat(shell->center, box, m->geom_quat + 4 * geom);
    mju_addTo3(shell->center, m->geom_pos + 3 * geom);
    memcpy(shell->half, box + 3, sizeof shell->half);
    return MILD_OK;
}

MildStatus robot_read_shells(Robot *robot, MildError *error) {
    const mjModel *m = robot->visual;
    for (int s = 0; s < robot->def.shells; s++) {
        const char *name = robot->def.shell[s];
        RobotShell *shell = &robot->shell[s];
        int id = robot_find(robot, m, mjOBJ_GEOM, "geom", name, "[robot] shells", error);
        if (id < 0) {
            return MILD_ERROR_FORMAT;
        }
        const double *size = m->geom_size + 3 * id;
        MildStatus status = MILD_OK;
        memcpy(shell->center, m->geom_pos + 3 * id, sizeof shell->center);
        switch (m->geom_type[id]) {
        case mjGEOM_BOX: memcpy(shell->half, size, sizeof shell->half); break;
        case mjGEOM_SPHERE: shell->radius = size[0]; break;
        case mjGEOM_CAPSULE:
            shell->radius = size[0];
            shell->half[2] = size[1];
            break;
        case mjGEOM_MESH: status = read_mesh(m, id, shell, error); break;
        default:
            return mild_fail(error, MILD_ERROR_FORMAT,
                             "%s: geom '%s' of [robot] shells must be a box, a sphere, a capsule "
                             "or a mesh",
                             robot->path, name);
        }
        if (status != MILD_OK) {
            return status;
        }
        shell->body = robot_geom_body(robot, id, error);
        if (shell->body < 0) {
            return MILD_ERROR_FORMAT;
        }
        mju_quat2Mat(shell->rotation, m->geom_quat + 4 * id);
        if (beside_sole(robot, shell, name, error) != MILD_OK) {
            return MILD_ERROR_FORMAT;
        }
        shell->limb = shell_limb(robot, shell->body, error);
        if (shell->limb < 0) {
            return MILD_ERROR_RANGE;
        }
        shell->floor_geom = robot->model->body_geomadr[shell->body];
        shell->on_base = robot->model->body_weldid[shell->body] == robot->base_body;
    }
    robot->shells = robot->def.shells;
    return MILD_OK;
}

int robot_shell_corner(const RobotShell *shell, int c, double center[3]) {
    memcpy(center, shell->center, 3 * sizeof *center);
    for (int k = 0; k < 3; k++) {
        const int other = c >> k & 1;
        if (other && !(shell->half[k] > 0)) {
            return 0;
        }
        for (int r = 0; r < 3; r++) {
            center[r] += (other ? -shell->half[k] : shell->half[k]) * shell->rotation[3 * r + k];
        }
    }
    return 1;
}

/* What mild_sole_surface takes of a shell. */
static MildShape shape_of(const RobotShell *shell) {
    MildShape shape = {.type = MILD_SHAPE_BOX};
    if (shell->vertices) {
        return shell->mesh;
    }
    memcpy(shape.pos, shell->center, sizeof shape.pos);
    mju_mat2Quat(shape.quat, shell->rotation);
    memcpy(shape.size, shell->half, sizeof shape.size);
    if (shell->radius > 0) {
        shape.type = shell->half[2] > 0 ? MILD_SHAPE_CAPSULE : MILD_SHAPE_SPHERE;
        shape.size[0] = shell->radius;
        shape.size[1] = shell->half[2];
    }
    return shape;
}

int robot_shell_shapes(const Robot *robot, int limb, MildShape shapes[ROBOT_SHELLS_MAX]) {
    int count = 0;
    for (int s = 0; s < robot->shells; s++) {
        if (robot->shell[s].limb == limb) {
            shapes[count++] = shape_of(&robot->shell[s]);
        }
    }
    return count;
}

MildStatus robot_read_shell_soles(Robot *robot, MildError *error) {
    for (int b = robot->def.feet; b < robot->def.feet + robot->shell_bodies; b++) {
        MildShape shapes[ROBOT_SHELLS_MAX];
        const int count = robot_shell_shapes(robot, b, shapes);
        const MildSurfaceDef def = {.shapes = shapes,
                                    .count = count,
                                    .pitch = robot->def.foot[0].pitch,
                                    .spacing = robot->def.shell_spacing};
        MildError cause = {0};
        robot->soles[b] = mild_sole_surface(&def, &cause);
        if (!robot->soles[b]) {
            return mild_fail(error, cause.status, "%s: robot.ini, [robot] shells of body '%s': %s",
                             robot->path, mj_id2name(robot->model, mjOBJ_BODY, robot->limb[b].body),
                             cause.text);
        }
    }
    return MILD_OK;
}
