/* The shells of a robot: parts of its bodies, from geoms of the MJCF, whose height above the ground
 * is measured, and which may stand as its soles do. */
#include <stdlib.h>
#include <string.h>

#include "robot/description.h"

/* Number of the body among the limbs; makes one behind the feet for a body that has none. */
static int shell_limb(Robot *robot, int body, MildError *error) {
    const int limbs = robot->def.feet + robot->shell_bodies;
    for (int b = 0; b < limbs; b++) {
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
        shell->limb = shell_limb(robot, shell->body, error);
        if (shell->limb < 0) {
            return MILD_ERROR_RANGE;
        }
        shell->floor_geom = robot->model->body_geomadr[shell->body];
        shell->on_base = robot->model->body_weldid[shell->body] == robot->base_body;
        mju_quat2Mat(shell->rotation, m->geom_quat + 4 * id);
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

MildStatus robot_read_surfaces(Robot *robot, MildError *error) {
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
