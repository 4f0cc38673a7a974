#include "plugin/foot.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/text.h"
#include "ground/sole/sole.h"

#define WORD 128          /* bytes of a name */
#define SOLE_BAND 0.01    /* [m] what lies higher above the lowest point is not the sole */
#define CIRCLE_POINTS 32  /* corners of a round outline */
#define SINKS 0.05        /* [m] depth to which a foot is expected to sink */
#define OUTLINE_MAX 4096  /* corners of an outline, the limit of MildSoleDef */
#define BOUNDS_SLACK 1e-3 /* [-] of an element; vertices are rounded to floats, boxes are not */
#define PI 3.141592653589793

/* ---- names ---- */

static MildStatus unknown(const mjModel *m, int object, int count, const char *key,
                          const char *name, MildError *error) {
    const char *nearest = "";
    const char **names = malloc((size_t)(count + 1) * sizeof *names);
    int filled = 0;
    for (int i = 0; names && i < count; i++) {
        const char *known = mj_id2name(m, object, i);
        if (known) {
            names[filled++] = known;
        }
    }
    if (filled > 0) {
        nearest = text_nearest(name, names, filled);
    }
    const char *what = object == mjOBJ_GEOM       ? "geom"
                       : strcmp(key, "body") == 0 ? "body"
                                                  : "body or site";
    MildStatus status =
        mild_fail(error, MILD_ERROR_ARGUMENT, "%s: there is no %s '%.60s'; nearest is '%.60s'", key,
                  what, name, nearest);
    free(names);
    return status;
}

const char *foot_body_name(const mjModel *m, const Foot *foot) {
    const char *name = mj_id2name(m, mjOBJ_BODY, foot->body);
    return name ? name : "";
}

const char *foot_name(const mjModel *m, const Foot *foot) {
    return foot->site < 0 ? foot_body_name(m, foot) : mj_id2name(m, mjOBJ_SITE, foot->site);
}

/* Two feet on one body would each count the ground under it. */
static MildStatus add_foot(const mjModel *m, Foot *feet, int *count, int body, int site,
                           MildError *error) {
    const Foot added = {.body = body, .site = site};
    if (*count == MILD_FEET_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "more than %d feet and bodies: '%.60s' is one too many", MILD_FEET_MAX,
                         foot_name(m, &added));
    }
    for (int f = 0; f < *count; f++) {
        if (feet[f].body == body) {
            return mild_fail(
                error, MILD_ERROR_ARGUMENT,
                "feet: '%.60s' and '%.60s' are on one body, '%.60s', which would stand "
                "on the ground twice; name it once",
                foot_name(m, &feet[f]), foot_name(m, &added), foot_body_name(m, &added));
        }
    }
    feet[(*count)++] = added;
    return MILD_OK;
}

static MildStatus find_feet(const mjModel *m, const PluginDef *def, Foot *feet, int *count,
                            MildError *error) {
    const char *text = def->feet;
    char name[WORD];
    while (plugin_word(&text, name, sizeof name)) {
        int body = mj_name2id(m, mjOBJ_BODY, name);
        int site = body < 0 ? mj_name2id(m, mjOBJ_SITE, name) : -1;
        if (body < 0 && site < 0) {
            return unknown(m, mjOBJ_BODY, (int)m->nbody, "feet", name, error);
        }
        MildStatus status =
            add_foot(m, feet, count, site < 0 ? body : m->site_bodyid[site], site, error);
        if (status != MILD_OK) {
            return status;
        }
    }
    return MILD_OK;
}

/* The geoms of `sole`. Without `feet` their bodies are the feet; with it they belong to one. */
static MildStatus find_geoms(const mjModel *m, const PluginDef *def, Foot *feet, int *count,
                             MildError *error) {
    const char *text = def->sole;
    const int given = *count > 0;
    char name[WORD];
    while (plugin_word(&text, name, sizeof name)) {
        int geom = mj_name2id(m, mjOBJ_GEOM, name), known = 0;
        if (geom < 0) {
            return unknown(m, mjOBJ_GEOM, (int)m->ngeom, "sole", name, error);
        }
        for (int f = 0; f < *count; f++) {
            known |= feet[f].body == m->geom_bodyid[geom];
        }
        if (given && !known) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "sole: geom '%.60s' is on no body of feet; name its body there", name);
        }
        MildStatus status =
            known ? MILD_OK : add_foot(m, feet, count, m->geom_bodyid[geom], -1, error);
        if (status != MILD_OK) {
            return status;
        }
    }
    return MILD_OK;
}

/* Bodies with elements all over, behind the feet. */
static MildStatus find_bodies(const mjModel *m, const PluginDef *def, Foot *feet, int *count,
                              MildError *error) {
    const char *text = def->body;
    char name[WORD];
    while (plugin_word(&text, name, sizeof name)) {
        const int body = mj_name2id(m, mjOBJ_BODY, name);
        if (body < 0) {
            return unknown(m, mjOBJ_BODY, (int)m->nbody, "body", name, error);
        }
        for (int f = 0; f < *count; f++) {
            if (feet[f].body == body) {
                return mild_fail(error, MILD_ERROR_ARGUMENT, "body: '%.60s' is %s; name it once",
                                 name, feet[f].shell ? "named twice" : "a foot already");
            }
        }
        MildStatus status = add_foot(m, feet, count, body, -1, error);
        if (status != MILD_OK) {
            return status;
        }
        feet[*count - 1].shell = 1;
    }
    return MILD_OK;
}

static int is_named(const mjModel *m, const char *text, int geom) {
    const char *name = mj_id2name(m, mjOBJ_GEOM, geom);
    char word[WORD];
    while (name && plugin_word(&text, word, sizeof word)) {
        if (strcmp(word, name) == 0) {
            return 1;
        }
    }
    return 0;
}

int foot_has_primitive(const mjModel *m, const Foot *foot) {
    const int body = foot->body;
    for (int g = m->body_geomadr[body]; g < m->body_geomadr[body] + m->body_geomnum[body]; g++) {
        if (m->geom_type[g] != mjGEOM_MESH) {
            return 1;
        }
    }
    return 0;
}

int foot_has_geom(const mjModel *m, const PluginDef *def, const Foot *foot, int geom) {
    const char *text = def->sole;
    char word[WORD];
    if (m->geom_bodyid[geom] != foot->body) {
        return 0;
    }
    if (plugin_word(&text, word, sizeof word)) {
        return is_named(m, def->sole, geom);
    }
    return m->geom_type[geom] != mjGEOM_MESH || !foot_has_primitive(m, foot);
}

int foot_may_touch_floor(const mjModel *m, const Foot *foot, int geom) {
    double arm[3], local[3];
    if (m->geom_bodyid[geom] != foot->body) {
        return 0;
    }
    if (foot->shell) {
        return 1;
    }
    if (foot->round) {
        mju_sub3(arm, m->geom_pos + 3 * geom, foot->center);
        return mju_norm3(arm) - m->geom_rbound[geom] < foot->radius + SINKS;
    }
    mju_copy3(local, m->geom_pos + 3 * geom);
    if (foot->site >= 0) {
        double turn[9];
        mju_quat2Mat(turn, m->site_quat + 4 * foot->site);
        mju_sub3(arm, local, m->site_pos + 3 * foot->site);
        mju_mulMatTVec3(local, turn, arm);
    }
    return local[2] - m->geom_rbound[geom] < mild_sole_z(foot->raster) + SINKS;
}

/* ---- outlines from geoms ---- */

/* Points in the frame of the foot [m]. */
typedef struct {
    double (*at)[3];
    int count, room;
    double turn[9];   /* frame of the body -> frame of the foot */
    double origin[3]; /* [m] of the foot's frame in that of the body */
    int compiling;    /* bool: meshes have no vertices yet */
    int bounds;       /* bool: some points are those of a mesh's bounding box */
} Cloud;

static int cloud_add(Cloud *cloud, const double point[3]) {
    if (cloud->count == cloud->room) {
        int room = 2 * cloud->room + 256;
        void *grown = realloc(cloud->at, (size_t)room * sizeof *cloud->at);
        if (!grown) {
            return 0;
        }
        cloud->at = grown;
        cloud->room = room;
    }
    double arm[3];
    mju_sub3(arm, point, cloud->origin);
    mju_mulMatVec3(cloud->at[cloud->count++], cloud->turn, arm);
    return 1;
}

/* Adds a point that is given in the frame of the geom. */
static int cloud_add_local(Cloud *cloud, const mjModel *m, int geom, const double local[3]) {
    double turn[9], point[3];
    mju_quat2Mat(turn, m->geom_quat + 4 * geom);
    mju_mulMatVec3(point, turn, local);
    mju_addTo3(point, m->geom_pos + 3 * geom);
    return cloud_add(cloud, point);
}

/* A ball about a point of the geom's z axis: the circle in which it is widest, seen from above, at
 * the height of its lowest point. */
static int cloud_add_ball(Cloud *cloud, const mjModel *m, int geom, double along, double radius) {
    const double local[3] = {0, 0, along};
    int good = cloud_add_local(cloud, m, geom, local);
    double center[3];
    if (!good) {
        return 0;
    }
    mju_copy3(center, cloud->at[--cloud->count]);
    for (int i = 0; good && i < CIRCLE_POINTS; i++) {
        double angle = 2 * PI * (i + 0.5) / CIRCLE_POINTS;
        good = cloud_add(cloud, local);
        double *at = cloud->at[cloud->count - 1];
        at[0] = center[0] + radius * cos(angle);
        at[1] = center[1] + radius * sin(angle);
        at[2] = center[2] - radius;
    }
    return good;
}

/* Rims of a cylinder, or a grid on an ellipsoid. */
static int cloud_add_rings(Cloud *cloud, const mjModel *m, int geom) {
    const double *size = m->geom_size + 3 * geom;
    const int ellipsoid = m->geom_type[geom] == mjGEOM_ELLIPSOID;
    const int rings = ellipsoid ? CIRCLE_POINTS : 2;
    int good = 1;
    for (int r = 0; r < rings; r++) {
        double up = ellipsoid ? cos(PI * (r + 0.5) / rings) : 2.0 * r - 1.0;
        double wide = ellipsoid ? sqrt(1 - up * up) : 1.0;
        for (int i = 0; good && i < CIRCLE_POINTS; i++) {
            double angle = 2 * PI * (i + 0.5) / CIRCLE_POINTS;
            const double local[3] = {wide * cos(angle) * size[0],
                                     wide * sin(angle) * size[ellipsoid ? 1 : 0],
                                     up * size[ellipsoid ? 2 : 1]};
            good = cloud_add_local(cloud, m, geom, local);
        }
    }
    return good;
}

/* Corners of the bounding box, which the compiler knows before it has the vertices. */
static int cloud_add_bounds(Cloud *cloud, const mjModel *m, int geom) {
    const double *middle = m->geom_aabb + 6 * geom, *half = middle + 3;
    int good = 1;
    for (int corner = 0; good && corner < 8; corner++) {
        const double local[3] = {middle[0] + (corner & 1 ? half[0] : -half[0]),
                                 middle[1] + (corner & 2 ? half[1] : -half[1]),
                                 middle[2] + (corner & 4 ? half[2] : -half[2])};
        good = cloud_add_local(cloud, m, geom, local);
    }
    return good;
}

static int cloud_add_mesh(Cloud *cloud, const mjModel *m, int geom) {
    const int mesh = m->geom_dataid[geom];
    int good = 1;
    if (cloud->compiling) {
        cloud->bounds = 1;
        return cloud_add_bounds(cloud, m, geom);
    }
    for (int v = 0; good && mesh >= 0 && v < m->mesh_vertnum[mesh]; v++) {
        const float *vertex = m->mesh_vert + 3 * (m->mesh_vertadr[mesh] + v);
        const double local[3] = {vertex[0], vertex[1], vertex[2]};
        good = cloud_add_local(cloud, m, geom, local);
    }
    return good;
}

static int cloud_add_geom(Cloud *cloud, const mjModel *m, int geom) {
    const double *size = m->geom_size + 3 * geom;
    int good = 1;
    switch (m->geom_type[geom]) {
    case mjGEOM_SPHERE: return cloud_add_ball(cloud, m, geom, 0, size[0]);
    case mjGEOM_CAPSULE:
        return cloud_add_ball(cloud, m, geom, size[1], size[0]) &&
               cloud_add_ball(cloud, m, geom, -size[1], size[0]);
    case mjGEOM_CYLINDER:
    case mjGEOM_ELLIPSOID: return cloud_add_rings(cloud, m, geom);
    case mjGEOM_MESH: return cloud_add_mesh(cloud, m, geom);
    case mjGEOM_BOX:
        for (int corner = 0; good && corner < 8; corner++) {
            const double local[3] = {corner & 1 ? size[0] : -size[0],
                                     corner & 2 ? size[1] : -size[1],
                                     corner & 4 ? size[2] : -size[2]};
            good = cloud_add_local(cloud, m, geom, local);
        }
        return good;
    default: return 1; /* planes and the like have no outline */
    }
}

static int by_place(const void *a, const void *b) {
    const double *p = a, *q = b;
    int x = (p[0] > q[0]) - (p[0] < q[0]);
    return x ? x : (p[1] > q[1]) - (p[1] < q[1]);
}

/* Twice the area of the triangle a b c, positive when it turns left. */
static double turn_of(const double *a, const double *b, const double *c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* Convex hull of the points in the x-y plane (monotone chain). hull: [2 (count + 1)][2]. Returns
 * its corners. */
static int convex_hull(double (*points)[3], int count, double *hull) {
    int corners = 0;
    qsort(points, (size_t)count, sizeof *points, by_place);
    for (int pass = 0; pass < 2; pass++) {
        const int start = corners;
        for (int k = 0; k < count; k++) {
            const double *p = points[pass ? count - 1 - k : k];
            while (corners >= start + 2 &&
                   turn_of(hull + 2 * corners - 4, hull + 2 * corners - 2, p) <= 0) {
                corners--;
            }
            hull[2 * corners] = p[0];
            hull[2 * corners + 1] = p[1];
            corners++;
        }
        corners--; /* the last point of a pass is the first of the next */
    }
    return corners;
}

/* What is left of the cloud within SOLE_BAND of its lowest point. Returns that height. */
static double keep_lowest(Cloud *cloud) {
    double lowest = DBL_MAX;
    int kept = 0;
    for (int i = 0; i < cloud->count; i++) {
        lowest = fmin(lowest, cloud->at[i][2]);
    }
    for (int i = 0; i < cloud->count; i++) {
        if (cloud->at[i][2] <= lowest + SOLE_BAND) {
            memmove(cloud->at[kept++], cloud->at[i], sizeof *cloud->at);
        }
    }
    cloud->count = kept;
    return lowest;
}

static void cloud_frame(const mjModel *m, const Foot *foot, Cloud *cloud) {
    static const double same[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    memcpy(cloud->turn, same, sizeof same);
    if (foot->site >= 0) {
        double turn[9];
        mju_quat2Mat(turn, m->site_quat + 4 * foot->site);
        mju_transpose(cloud->turn, turn, 3, 3);
        mju_copy3(cloud->origin, m->site_pos + 3 * foot->site);
    }
}

static MildStatus make_raster(const PluginDef *def, double pitch, const double *outline, int points,
                              double z, Foot *foot, MildError *error) {
    const MildSoleDef sole = {outline, points, pitch, z, def->elements};
    double twice = 0;
    for (int i = 0, j = points - 1; i < points; j = i++) {
        twice += outline[2 * j] * outline[2 * i + 1] - outline[2 * i] * outline[2 * j + 1];
    }
    foot->area = def->elements ? 0 : fabs(twice) / 2;
    foot->raster = mild_sole_create(&sole, error);
    return foot->raster ? MILD_OK : MILD_ERROR_ARGUMENT;
}

static MildStatus no_shape(const mjModel *m, const Foot *foot, MildError *error) {
    return mild_fail(error, MILD_ERROR_ARGUMENT,
                     "feet: body '%.60s' has no geom with a flat outline; set outline and sole_z",
                     foot_body_name(m, foot));
}

/* A rectangle of whole elements, in which a sole of any shape within the cloud has no more: of the
 * element centres on a line of length L at most L/pitch + 1 are inside. */
static MildStatus sole_of_bounds(const PluginDef *def, const Cloud *cloud, Foot *foot,
                                 MildError *error) {
    const double pitch = def->pitch > 0 ? def->pitch : SOLE_PITCH_LEAST;
    double low[2] = {DBL_MAX, DBL_MAX}, high[2] = {-DBL_MAX, -DBL_MAX}, half[2], middle[2];
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < cloud->count; i++) {
            low[k] = fmin(low[k], cloud->at[i][k]);
            high[k] = fmax(high[k], cloud->at[i][k]);
        }
        half[k] = 0.5 * pitch * (floor((high[k] - low[k]) / pitch + BOUNDS_SLACK) + 1);
        middle[k] = 0.5 * (low[k] + high[k]);
    }
    const double outline[8] = {middle[0] - half[0], middle[1] - half[1], middle[0] + half[0],
                               middle[1] - half[1], middle[0] + half[0], middle[1] + half[1],
                               middle[0] - half[0], middle[1] + half[1]};
    return make_raster(def, pitch, outline, 4, 0, foot, error);
}

/* The convex hull of what lies lowest. */
static MildStatus sole_of_cloud(const mjModel *m, const PluginDef *def, Cloud *cloud, Foot *foot,
                                MildError *error) {
    const double z = keep_lowest(cloud);
    double *hull = malloc((size_t)(cloud->count + 1) * 4 * sizeof *hull);
    const int corners = hull && cloud->count ? convex_hull(cloud->at, cloud->count, hull) : 0;
    MildStatus status;
    if (!hull) {
        status = mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    } else if (corners < 3 || corners > OUTLINE_MAX) {
        status = no_shape(m, foot, error);
    } else {
        status = make_raster(def, def->pitch, hull, corners, z, foot, error);
    }
    free(hull);
    return status;
}

/* The sole under the geoms of the foot. */
static MildStatus sole_from_geoms(const mjModel *m, const PluginDef *def, int compiling, Foot *foot,
                                  MildError *error) {
    Cloud cloud = {.compiling = compiling};
    int good = 1;
    MildStatus status;
    cloud_frame(m, foot, &cloud);
    for (int g = 0; g < m->ngeom; g++) {
        if (foot_has_geom(m, def, foot, g)) {
            good = good && cloud_add_geom(&cloud, m, g);
        }
    }
    if (!good) {
        status = mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    } else if (cloud.bounds) {
        status = sole_of_bounds(def, &cloud, foot, error);
    } else {
        status = sole_of_cloud(m, def, &cloud, foot, error);
    }
    free(cloud.at);
    return status;
}
/* A round foot stands on a disc of its own radius: a polygon of the same area. */
static MildStatus sole_of_sphere(const mjModel *m, const PluginDef *def, int geom, Foot *foot,
                                 MildError *error) {
    double outline[2 * CIRCLE_POINTS];
    foot->round = 1;
    foot->radius = m->geom_size[3 * geom];
    mju_copy3(foot->center, m->geom_pos + 3 * geom);
    double reach = foot->radius * sqrt(PI / (0.5 * CIRCLE_POINTS * sin(2.0 * PI / CIRCLE_POINTS)));
    for (int i = 0; i < CIRCLE_POINTS; i++) {
        double angle = 2.0 * PI * (i + 0.5) / CIRCLE_POINTS;
        outline[2 * i] = reach * cos(angle);
        outline[2 * i + 1] = reach * sin(angle);
    }
    return make_raster(def, def->pitch, outline, CIRCLE_POINTS, 0, foot, error);
}

/* The only geom of the foot when it is a sphere, or -1. */
static int only_sphere(const mjModel *m, const PluginDef *def, const Foot *foot) {
    int found = -1, count = 0;
    for (int g = 0; g < m->ngeom; g++) {
        if (foot_has_geom(m, def, foot, g)) {
            found = g;
            count++;
        }
    }
    return count == 1 && m->geom_type[found] == mjGEOM_SPHERE && foot->site < 0 ? found : -1;
}

/* ---- outlines from the attribute ---- */

static MildStatus parse_outline(const char *text, double *outline, int *points, MildError *error) {
    char word[WORD];
    int numbers = 0;
    while (plugin_word(&text, word, sizeof word)) {
        if (numbers == 2 * OUTLINE_MAX || !text_double(word, &outline[numbers])) {
            return mild_fail(error, MILD_ERROR_ARGUMENT, "outline: '%.40s' is not a number", word);
        }
        numbers++;
    }
    if (numbers % 2 || numbers < 6) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "outline: %d numbers; a polygon needs x and y of at least 3 points",
                         numbers);
    }
    *points = numbers / 2;
    return MILD_OK;
}

/* The polygon of foot f: the f-th of those separated by ';', or the only one. */
static MildStatus sole_from_outline(const PluginDef *def, int f, Foot *foot, MildError *error) {
    double *outline = malloc(2 * OUTLINE_MAX * sizeof *outline);
    char *copy = malloc(sizeof def->outline);
    if (!outline || !copy) {
        free(outline);
        free(copy);
        return mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    }
    memcpy(copy, def->outline, sizeof def->outline);
    char *at = copy, *next = strchr(copy, ';');
    for (int k = 0; k < f && next; k++) {
        at = next + 1;
        next = strchr(at, ';');
    }
    if (next) {
        *next = '\0';
    }
    int points = 0;
    MildStatus status = parse_outline(at, outline, &points, error);
    if (status == MILD_OK) {
        status = make_raster(def, def->pitch, outline, points, def->sole_z, foot, error);
    }
    free(outline);
    free(copy);
    return status;
}

static MildStatus check_outlines(const PluginDef *def, int feet, MildError *error) {
    int polygons = 1;
    for (const char *c = def->outline; *c; c++) {
        polygons += *c == ';';
    }
    if (polygons != 1 && polygons != feet) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "outline: %d polygons for %d feet; give one, or one for each", polygons,
                         feet);
    }
    return MILD_OK;
}

/* ---- feet ---- */

static MildStatus make_sole(const mjModel *m, const PluginDef *def, MildModel model, int compiling,
                            int f, Foot *foot, MildError *error) {
    const int sphere = only_sphere(m, def, foot);
    MildStatus status;
    if (def->outline[0]) {
        status = sole_from_outline(def, f, foot, error);
    } else if (sphere >= 0) {
        status = sole_of_sphere(m, def, sphere, foot, error);
    } else {
        status = sole_from_geoms(m, def, compiling, foot, error);
    }
    if (status != MILD_OK) {
        return status;
    }
    foot->sole =
        mild_model_is_concentric(model) ? mild_sole_concentric(foot->raster, error) : foot->raster;
    return foot->sole ? MILD_OK : MILD_ERROR_MEMORY;
}

static MildStatus check_moves(const mjModel *m, const Foot *foot, MildError *error) {
    return m->body_weldid[foot->body] != 0
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_ARGUMENT,
                           "%s: body '%.60s' is fixed to the world; it must move",
                           foot->shell ? "body" : "feet", foot_body_name(m, foot));
}

/* All of them, once they are found. */
static MildStatus make_soles(const mjModel *m, const PluginDef *def, MildModel model, int compiling,
                             Foot *feet, int count, MildError *error) {
    MildStatus status = MILD_OK;
    for (int f = 0; status == MILD_OK && f < count; f++) {
        status = check_moves(m, &feet[f], error);
        if (status == MILD_OK && feet[f].shell) {
            const double own = def->pitch > 0 ? def->pitch : MATERIAL_PITCH;
            const double pitch = f > 0 ? mild_sole_pitch(feet[0].sole) : own;
            status = body_shell(m, def, pitch, compiling, &feet[f], error);
        } else if (status == MILD_OK) {
            status = make_sole(m, def, model, compiling, f, &feet[f], error);
            if (status == MILD_OK && !compiling) {
                status = wheel_check(m, def, &feet[f], error);
            }
        }
    }
    return status;
}

MildStatus feet_create(const mjModel *m, const PluginDef *def, MildModel model, int compiling,
                       Foot *feet, int *count, MildError *error) {
    *count = 0;
    MildStatus status = find_feet(m, def, feet, count, error);
    if (status == MILD_OK) {
        status = find_geoms(m, def, feet, count, error);
    }
    if (status == MILD_OK && def->outline[0]) {
        status = check_outlines(def, *count, error);
    }
    if (status == MILD_OK) {
        status = find_bodies(m, def, feet, count, error);
    }
    if (status == MILD_OK && *count == 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "no feet: set feet to the names of the bodies that stand on the ground, "
                         "or body to those that touch it with any side");
    }
    return status == MILD_OK ? make_soles(m, def, model, compiling, feet, *count, error) : status;
}

void feet_destroy(Foot *feet, int count) {
    for (int f = 0; f < count; f++) {
        if (feet[f].sole != feet[f].raster) {
            mild_sole_destroy(feet[f].sole);
        }
        mild_sole_destroy(feet[f].raster);
    }
}

void foot_pose(const mjData *d, const Foot *foot, double position[3], double rotation[9]) {
    static const double level[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    if (foot->site >= 0) {
        mju_copy3(position, d->site_xpos + 3 * foot->site);
        mju_copy(rotation, d->site_xmat + 9 * foot->site, 9);
        return;
    }
    mju_copy3(position, d->xpos + 3 * foot->body);
    mju_copy(rotation, d->xmat + 9 * foot->body, 9);
    if (foot->round) {
        double arm[3];
        mju_mulMatVec3(arm, rotation, foot->center);
        mju_addTo3(position, arm);
        position[2] -= foot->radius;
        mju_copy(rotation, level, 9);
    }
}
