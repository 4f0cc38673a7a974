#include "plugin/foot.h"

#include <float.h>
#include <math.h>
#include <stdio.h>

#define DEGREE (3.141592653589793 / 180)
#define TURN (60 * DEGREE)   /* tried, to both sides */
#define TRIED (5 * DEGREE)   /* from one angle to the next */
#define LITTLE (30 * DEGREE) /* of turn are an ankle's */
#define EVEN 0.05            /* [-] of its radius by which a wheel's height may change */
#define HORIZONTAL 0.5       /* [-] sine of an axis' slope */

/* A line that the foot may turn about, in the frame of its body. */
typedef struct {
    double through[3], axis[3];
    double low, high; /* [rad] angles within reach */
} Axis;

/* [m] How far a geom reaches from its own centre in the direction u, in its own frame. */
static double support(const mjModel *m, int geom, const double u[3]) {
    const double *s = m->geom_size + 3 * geom;
    double most = 0;
    switch (m->geom_type[geom]) {
    case mjGEOM_SPHERE: return s[0];
    case mjGEOM_CAPSULE: return s[0] + fabs(u[2]) * s[1];
    case mjGEOM_CYLINDER: return hypot(u[0], u[1]) * s[0] + fabs(u[2]) * s[1];
    case mjGEOM_ELLIPSOID:
        return sqrt(pow(s[0] * u[0], 2) + pow(s[1] * u[1], 2) + pow(s[2] * u[2], 2));
    case mjGEOM_BOX: return fabs(u[0]) * s[0] + fabs(u[1]) * s[1] + fabs(u[2]) * s[2];
    case mjGEOM_MESH: break;
    default: return 0;
    }
    const int mesh = m->geom_dataid[geom];
    most = -DBL_MAX;
    for (int v = 0; v < m->mesh_vertnum[mesh]; v++) {
        const float *at = m->mesh_vert + 3 * (m->mesh_vertadr[mesh] + v);
        most = fmax(most, u[0] * (double)at[0] + u[1] * (double)at[1] + u[2] * (double)at[2]);
    }
    return most;
}

/* [m] How far the shapes of the foot reach from a point in the direction u, in the body's frame. */
static double reach(const mjModel *m, const PluginDef *def, const Foot *foot,
                    const double through[3], const double u[3]) {
    double most = -DBL_MAX;
    for (int g = 0; g < m->ngeom; g++) {
        double arm[3], local[3], turn[9];
        if (foot_has_geom(m, def, foot, g)) {
            mju_sub3(arm, m->geom_pos + 3 * g, through);
            mju_quat2Mat(turn, m->geom_quat + 4 * g);
            mju_mulMatTVec3(local, turn, u);
            most = fmax(most, mju_dot3(arm, u) + support(m, g, local));
        }
    }
    return most;
}

/* Bool: the foot may turn about the axis, which is horizontal, and stays as high. */
static int is_wheel(const mjModel *m, const PluginDef *def, const Foot *foot, const double down[3],
                    const Axis *axis) {
    const double radius = reach(m, def, foot, axis->through, down);
    if (fabs(mju_dot3(axis->axis, down)) > HORIZONTAL || !(radius > 0) ||
        fmax(axis->high, -axis->low) < LITTLE) {
        return 0;
    }
    for (double angle = -TURN; angle < TURN + 0.5 * TRIED; angle += TRIED) {
        double turn[4], u[3];
        if (angle < axis->low || angle > axis->high) {
            continue;
        }
        mju_axisAngle2Quat(turn, axis->axis, -angle);
        mju_rotVecQuat(u, down, turn);
        if (fabs(reach(m, def, foot, axis->through, u) - radius) > EVEN * radius) {
            return 0;
        }
    }
    return 1;
}

static const char *or_none(const char *name) {
    return name ? name : "";
}

static MildStatus refuse(const mjModel *m, const Foot *foot, const char *how, const char *name,
                         MildError *error) {
    return mild_fail(error, MILD_ERROR_ARGUMENT,
                     "feet: '%.60s' is a wheel, %s '%.60s', but a sole does not roll; name it in "
                     "body in place of feet, or take a single sphere, a round foot",
                     foot_name(m, foot), how, name);
}

/* A hinge of the body `at`, seen from the foot, whose place in that body's frame is given. */
static Axis hinge_axis(const mjModel *m, int joint, const double position[3],
                       const double turn[4]) {
    double arm[3], back[4], start = m->qpos0[m->jnt_qposadr[joint]];
    Axis axis = {.low = -TURN, .high = TURN};
    mju_negQuat(back, turn);
    mju_sub3(arm, m->jnt_pos + 3 * joint, position);
    mju_rotVecQuat(axis.through, arm, back);
    mju_rotVecQuat(axis.axis, m->jnt_axis + 3 * joint, back);
    if (m->jnt_limited[joint]) {
        axis.low = fmin(m->jnt_range[2 * joint] - start, 0);
        axis.high = fmax(m->jnt_range[2 * joint + 1] - start, 0);
    }
    return axis;
}

/* Hinges from the foot to the root. */
static MildStatus check_hinges(const mjModel *m, const PluginDef *def, const Foot *foot,
                               const double down[3], MildError *error) {
    double position[3] = {0, 0, 0}, turn[4] = {1, 0, 0, 0}; /* of the foot in the body `at` */
    for (int at = foot->body; at > 0; at = m->body_parentid[at]) {
        for (int j = m->body_jntadr[at]; j < m->body_jntadr[at] + m->body_jntnum[at]; j++) {
            const Axis axis = hinge_axis(m, j, position, turn);
            if (m->jnt_type[j] == mjJNT_HINGE && is_wheel(m, def, foot, down, &axis)) {
                return refuse(m, foot, "which turns about joint",
                              or_none(mj_id2name(m, mjOBJ_JOINT, j)), error);
            }
        }
        double product[4], moved[3];
        mju_mulQuat(product, m->body_quat + 4 * at, turn);
        mju_copy4(turn, product);
        mju_rotVecQuat(moved, position, m->body_quat + 4 * at);
        mju_add3(position, moved, m->body_pos + 3 * at);
    }
    return MILD_OK;
}

/* Bool: the foot's body, or one that it is fixed to, turns about any axis. */
static int turns_freely(const mjModel *m, const Foot *foot) {
    const int body = m->body_weldid[foot->body], joint = m->body_jntadr[body];
    return m->body_jntnum[body] > 0 &&
           (m->jnt_type[joint] == mjJNT_FREE || m->jnt_type[joint] == mjJNT_BALL);
}

static MildStatus check_shapes(const mjModel *m, const PluginDef *def, const Foot *foot,
                               const double down[3], MildError *error) {
    for (int g = 0; g < m->ngeom && turns_freely(m, foot); g++) {
        double turn[9];
        mju_quat2Mat(turn, m->geom_quat + 4 * g);
        for (int k = 0; k < 3 && foot_has_geom(m, def, foot, g); k++) {
            Axis axis = {.axis = {turn[k], turn[3 + k], turn[6 + k]}, .low = -TURN, .high = TURN};
            mju_copy3(axis.through, m->geom_pos + 3 * g);
            if (is_wheel(m, def, foot, down, &axis)) {
                return refuse(m, foot, "which rolls on geom", or_none(mj_id2name(m, mjOBJ_GEOM, g)),
                              error);
            }
        }
    }
    return MILD_OK;
}

MildStatus wheel_check(const mjModel *m, const PluginDef *def, const Foot *foot, MildError *error) {
    double down[3] = {0, 0, -1}, along[3];
    if (foot->round) {
        return MILD_OK;
    }
    if (foot->site >= 0) {
        mju_rotVecQuat(along, down, m->site_quat + 4 * foot->site);
        mju_copy3(down, along);
    }
    MildStatus status = check_hinges(m, def, foot, down, error);
    return status == MILD_OK ? check_shapes(m, def, foot, down, error) : status;
}
