#include "plugin/plugin.h"

#include <math.h>
#include <stdio.h>

#define AREA_OFF 0.1 /* [-] by which a foot's elements may cover more or less than its sole */
#define CARRIES 0.2  /* [-] of a robot's weight, that a rigid floor carries beside the ground */
#define UPRIGHT 0.9  /* [-] cosine of the tilt of a foot in qpos0 that is still a foot's */

MildStatus check_model(const mjModel *m, int instance, MildError *error) {
    if (m->opt.integrator == mjINT_RK4) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "integrator RK4 is not supported, for it evaluates a step four times; set "
                         "<option integrator=\"implicitfast\"/>, discrete or Euler");
    }
    if (soft_without_actuation(m) && soft_without_passive(m)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "without actuation, and with the flags spring and damper disabled, MuJoCo "
                         "calls no plugin; enable one of the two flags");
    }
    for (int i = 0; i < m->nplugin; i++) {
        if (i != instance && m->plugin[i] == m->plugin[instance]) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "a model has one instance; name all feet in its feet, and grounds in "
                             "its ground and terrain.patches");
        }
    }
    return MILD_OK;
}

static int pair_exists(const mjModel *m, int a, int b) {
    for (int p = 0; p < m->npair; p++) {
        const int g = m->pair_geom1[p], h = m->pair_geom2[p];
        if ((g == a && h == b) || (g == b && h == a)) {
            return 1;
        }
    }
    return 0;
}

static int bodies_excluded(const mjModel *m, int a, int b) {
    const int low = a < b ? a : b, high = a < b ? b : a;
    for (int e = 0; e < m->nexclude; e++) {
        if (m->exclude_signature[e] == (low << 16) + high) {
            return 1;
        }
    }
    return 0;
}

/* Bool: MuJoCo lets the two geoms touch. */
static int may_touch(const mjModel *m, int a, int b) {
    if (pair_exists(m, a, b)) {
        return 1;
    }
    if (bodies_excluded(m, m->geom_bodyid[a], m->geom_bodyid[b])) {
        return 0;
    }
    return (m->geom_contype[a] & m->geom_conaffinity[b]) != 0 ||
           (m->geom_contype[b] & m->geom_conaffinity[a]) != 0;
}

static const char *geom_name(const mjModel *m, int geom, char *text, size_t size) {
    const char *name = mj_id2name(m, mjOBJ_GEOM, geom);
    snprintf(text, size, name ? "geom '%.60s'" : "geom %.0s%d", name ? name : "", geom);
    return text;
}

/* Bool: the geom is a plane or height field of the world. */
static int is_floor(const mjModel *m, int geom) {
    return (m->geom_type[geom] == mjGEOM_PLANE || m->geom_type[geom] == mjGEOM_HFIELD) &&
           m->body_weldid[m->geom_bodyid[geom]] == 0;
}

/* A plane or height field of the world that touches a geom of the foot. */
static int standing_on(const mjModel *m, const Foot *foot, char *text, size_t size) {
    char a[80], b[80];
    for (int g = 0; g < m->ngeom; g++) {
        for (int w = 0; w < m->ngeom && foot_may_touch_floor(m, foot, g); w++) {
            if (!is_floor(m, w) || !may_touch(m, g, w)) {
                continue;
            }
            snprintf(text, size,
                     "%s of %s '%.60s' still touches %s, which is rigid; set its contype and "
                     "conaffinity to 0, or exclude the two bodies",
                     geom_name(m, g, a, sizeof a), foot->shell ? "body" : "foot body",
                     foot_body_name(m, foot), geom_name(m, w, b, sizeof b));
            return 1;
        }
    }
    return 0;
}

/* [-] Vertical component of the foot's z axis in qpos0. */
static double upright(const mjModel *m, const Foot *foot) {
    double turn[4] = {1, 0, 0, 0}, product[4], matrix[9];
    if (foot->site >= 0) {
        mju_copy4(turn, m->site_quat + 4 * foot->site);
    }
    for (int b = foot->body; b > 0; b = m->body_parentid[b]) {
        mju_mulQuat(product, m->body_quat + 4 * b, turn);
        mju_copy4(turn, product);
    }
    mju_quat2Mat(matrix, turn);
    return matrix[8];
}

/* [-] Area of the foot's elements over that of its sole. */
static double covered(const Foot *foot) {
    const double pitch = mild_sole_pitch(foot->raster);
    return mild_sole_elements(foot->raster) * pitch * pitch / foot->area;
}

int check_feet(const mjModel *m, const Soft *soft, char *text, size_t size) {
    for (int f = 0; f < soft->feet; f++) {
        const Foot *foot = &soft->foot[f];
        if (standing_on(m, foot, text, size)) {
            return 1;
        }
        if (!foot->round && !foot->shell && fabs(upright(m, foot)) < UPRIGHT) {
            snprintf(text, size,
                     "the z axis of foot '%.60s' is not vertical in the pose of the file; its sole "
                     "lies across z: name a site whose z axis points up from the sole",
                     foot_name(m, foot));
            return 1;
        }
        if (foot->area > 0 && fabs(covered(foot) - 1) > AREA_OFF) {
            snprintf(text, size,
                     "the %d elements of foot '%.60s' cover %.3g of its sole, which has %.3g cm2; "
                     "set a smaller pitch (now %g m)",
                     mild_sole_elements(foot->raster), foot_name(m, foot), covered(foot),
                     1e4 * foot->area, mild_sole_pitch(foot->raster));
            return 1;
        }
    }
    return 0;
}

/* ---- sensors ---- */

/* Bool: `body` is `below` or carries it. */
static int carries(const mjModel *m, int body, int below) {
    while (below > body) { /* parents have smaller numbers */
        below = m->body_parentid[below];
    }
    return below == body;
}

/* The body of one end of a contact sensor; -1: anything. */
static int end_body(const mjModel *m, int type, int id) {
    switch (id < 0 ? mjOBJ_UNKNOWN : type) {
    case mjOBJ_GEOM: return m->geom_bodyid[id];
    case mjOBJ_BODY:
    case mjOBJ_XBODY: return id;
    default: return -1;
    }
}

/* Bool: a sensor of MuJoCo's contacts, or of the forces between bodies, that is meant for what
 * carries this body. */
static int is_deaf(const mjModel *m, int sensor, int body) {
    const int id = m->sensor_objid[sensor];
    const int one = end_body(m, m->sensor_objtype[sensor], id);
    const int other = end_body(m, m->sensor_reftype[sensor], m->sensor_refid[sensor]);
    switch (m->sensor_type[sensor]) {
    case mjSENS_TOUCH: return m->site_bodyid[id] == body;
    case mjSENS_FORCE:
    case mjSENS_TORQUE: return m->site_bodyid[id] > 0 && carries(m, m->site_bodyid[id], body);
    case mjSENS_CONTACT: return (one == body && other <= 0) || (other == body && one <= 0);
    default: return 0;
    }
}

int check_sensors(const mjModel *m, const Soft *soft, char *text, size_t size) {
    for (int s = 0; s < m->nsensor; s++) {
        for (int f = 0; f < soft->feet; f++) {
            if (is_deaf(m, s, soft->foot[f].body)) {
                const char *name = mj_id2name(m, mjOBJ_SENSOR, s);
                snprintf(text, size,
                         "sensor '%.60s' does not feel this ground under '%.60s', only MuJoCo's "
                         "contacts; read a sensor of " PLUGIN_NAME " in its place",
                         name ? name : "", foot_name(m, &soft->foot[f]));
                return 1;
            }
        }
    }
    return 0;
}

/* ---- in a step ---- */

/* Body of a robot that stands on this ground, one of neither `feet` nor `body`; or -1. */
static int bare_body(const mjModel *m, const Soft *soft, int geom) {
    const int body = m->geom_bodyid[geom];
    int found = -1;
    for (int f = 0; f < soft->feet; f++) {
        if (soft->foot[f].body == body) {
            return -1;
        }
        found = m->body_rootid[soft->foot[f].body] == m->body_rootid[body] ? body : found;
    }
    return found;
}

int check_rests(const mjModel *m, const mjData *d, const Soft *soft, char *text, size_t size) {
    double sum = 0, most = 0, weight = 0;
    int rests = -1, floor = -1;
    for (int c = 0; c < d->ncon; c++) {
        const int *pair = d->contact[c].geom; /* less than 0: not geoms */
        const int geoms = pair[0] >= 0 && pair[1] >= 0, first = geoms && is_floor(m, pair[0]);
        const int body = geoms && is_floor(m, pair[!first]) ? bare_body(m, soft, pair[first]) : -1;
        double force[6] = {0};
        if (body < 0) {
            continue;
        }
        mj_contactForce(m, d, c, force);
        sum += force[0];
        if (force[0] > most) {
            most = force[0];
            rests = body;
            floor = pair[!first];
            weight = m->body_subtreemass[m->body_rootid[body]] * mju_norm3(m->opt.gravity);
        }
    }
    if (rests < 0 || !(sum > CARRIES * weight)) {
        return 0;
    }
    char name[80];
    const char *own = mj_id2name(m, mjOBJ_BODY, rests);
    snprintf(text, size,
             "'%.60s' rests on %s, which is rigid and pushes back with %.0f N (the robot weighs "
             "%.0f N); name it in body, so that it sinks too",
             own ? own : "", geom_name(m, floor, name, sizeof name), sum, weight);
    return 1;
}
