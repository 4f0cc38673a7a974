#include <math.h>
#include <stdio.h>

#include "robot/description.h"

/* One array of the compiled model: `count` rows of `width` numbers. */
typedef struct {
    const char *what;    /* as the MJCF calls it */
    const double *value; /* [count][width] */
    int count;
    int width;
    double least; /* smallest allowed number; -INFINITY: any finite number */
    int object;   /* mjtObj whose names the rows have; mjOBJ_UNKNOWN: a joint's coordinate */
    int first;    /* index of the first row's object */
    int dof;      /* bool: a row is a degree of freedom, named after its joint */
} Numbers;

static const char *row_name(const mjModel *m, const Numbers *numbers, int row, char *text,
                            size_t size) {
    int id = numbers->dof ? m->dof_jntid[row] : numbers->first + row;
    const char *name = mj_id2name(m, numbers->object, id);
    const char *kind =
        numbers->object == mjOBJ_UNKNOWN ? "joint coordinate" : mju_type2Str(numbers->object);
    if (name) {
        snprintf(text, size, "%s '%.60s'", kind, name);
    } else {
        snprintf(text, size, "%s %d", kind, id);
    }
    return text;
}

static MildStatus check_numbers(const mjModel *m, const Numbers *numbers, const char *path,
                                MildError *error) {
    for (int i = 0; i < numbers->count * numbers->width; i++) {
        double value = numbers->value[i];
        char name[80];
        if (isfinite(value) && value >= numbers->least) {
            continue;
        }
        row_name(m, numbers, i / numbers->width, name, sizeof name);
        if (!isfinite(value)) {
            return mild_fail(error, MILD_ERROR_RANGE, "%.150s: %s: %s is %g; it must be finite",
                             path, name, numbers->what, value);
        }
        return mild_fail(error, MILD_ERROR_RANGE, "%.150s: %s: %s is %g; it must not be below %g",
                         path, name, numbers->what, value, numbers->least);
    }
    return MILD_OK;
}

/* A moving body needs mass and inertia, because the step divides by them. */
static MildStatus check_masses(const mjModel *m, const char *path, MildError *error) {
    for (int b = 1; b < m->nbody; b++) {
        const char *name = mj_id2name(m, mjOBJ_BODY, b);
        const double *inertia = m->body_inertia + 3 * b;
        if (m->body_weldid[b] == 0 || m->body_jntnum[b] == 0) {
            continue; /* fixed to the world, or to its parent, which then has the mass of both */
        }
        if (!(m->body_mass[b] > 0) || !(inertia[0] > 0 && inertia[1] > 0 && inertia[2] > 0)) {
            return mild_fail(error, MILD_ERROR_RANGE,
                             "%.150s: body '%.60s' moves, so its mass (%g kg) and inertia (%g %g "
                             "%g kg m^2) must be above 0",
                             path, name ? name : "", m->body_mass[b], inertia[0], inertia[1],
                             inertia[2]);
        }
    }
    return MILD_OK;
}

static MildStatus check_limits(const mjModel *m, const char *path, MildError *error) {
    const struct {
        const char *what;
        const double *range;    /* [njnt][2] */
        const mjtBool *limited; /* [njnt] */
    } limits[] = {{"range", m->jnt_range, m->jnt_limited},
                  {"actuatorfrcrange", m->jnt_actfrcrange, m->jnt_actfrclimited}};
    for (int k = 0; k < 2; k++) {
        for (int j = 0; j < m->njnt; j++) {
            const double *range = limits[k].range + 2 * j;
            const char *name = mj_id2name(m, mjOBJ_JOINT, j);
            if (limits[k].limited[j] && !(range[0] < range[1])) {
                return mild_fail(error, MILD_ERROR_RANGE,
                                 "%.150s: joint '%.60s': %s is %g %g; the first must be the "
                                 "smaller one",
                                 path, name ? name : "", limits[k].what, range[0], range[1]);
            }
        }
    }
    return MILD_OK;
}

MildStatus robot_check_model(const mjModel *m, const char *path, MildError *error) {
    const int bodies = (int)m->nbody, joints = (int)m->njnt, dofs = (int)m->nv;
    const int keys = (int)m->nkey, geoms = (int)m->ngeom;
    const Numbers checks[] = {
        {"pos", m->body_pos, bodies, 3, -INFINITY, mjOBJ_BODY, 0, 0},
        {"quat", m->body_quat, bodies, 4, -INFINITY, mjOBJ_BODY, 0, 0},
        {"mass", m->body_mass, bodies, 1, 0, mjOBJ_BODY, 0, 0},
        {"inertia", m->body_inertia, bodies, 3, 0, mjOBJ_BODY, 0, 0},
        {"inertial pos", m->body_ipos, bodies, 3, -INFINITY, mjOBJ_BODY, 0, 0},
        {"inertial quat", m->body_iquat, bodies, 4, -INFINITY, mjOBJ_BODY, 0, 0},
        {"pos", m->jnt_pos, joints, 3, -INFINITY, mjOBJ_JOINT, 0, 0},
        {"axis", m->jnt_axis, joints, 3, -INFINITY, mjOBJ_JOINT, 0, 0},
        {"range", m->jnt_range, joints, 2, -INFINITY, mjOBJ_JOINT, 0, 0},
        {"actuatorfrcrange", m->jnt_actfrcrange, joints, 2, -INFINITY, mjOBJ_JOINT, 0, 0},
        {"stiffness", m->jnt_stiffness, joints, 1, 0, mjOBJ_JOINT, 0, 0},
        {"springref", m->qpos_spring, (int)m->nq, 1, -INFINITY, mjOBJ_UNKNOWN, 0, 0},
        {"armature", m->dof_armature, dofs, 1, 0, mjOBJ_JOINT, 0, 1},
        {"damping", m->dof_damping, dofs, 1, 0, mjOBJ_JOINT, 0, 1},
        {"frictionloss", m->dof_frictionloss, dofs, 1, 0, mjOBJ_JOINT, 0, 1},
        {"pos", m->geom_pos, geoms, 3, -INFINITY, mjOBJ_GEOM, 0, 0},
        {"quat", m->geom_quat, geoms, 4, -INFINITY, mjOBJ_GEOM, 0, 0},
        {"size", m->geom_size, geoms, 3, 0, mjOBJ_GEOM, 0, 0},
        {"friction", m->geom_friction, geoms, 3, 0, mjOBJ_GEOM, 0, 0},
        {"qpos", m->key_qpos, keys, (int)m->nq, -INFINITY, mjOBJ_KEY, 0, 0},
    };
    MildStatus status = MILD_OK;
    for (size_t i = 0; status == MILD_OK && i < sizeof checks / sizeof *checks; i++) {
        status = check_numbers(m, &checks[i], path, error);
    }
    for (int n = 0; status == MILD_OK && n < m->nnumeric; n++) {
        const Numbers custom = {"data",    m->numeric_data + m->numeric_adr[n],
                                1,         m->numeric_size[n],
                                -INFINITY, mjOBJ_NUMERIC,
                                n,         0};
        status = check_numbers(m, &custom, path, error);
    }
    if (status == MILD_OK) {
        status = check_masses(m, path, error);
    }
    return status == MILD_OK ? check_limits(m, path, error) : status;
}
