#include "plugin/foot.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SIDES 32     /* of what stands for a circle */
#define PROFILE 17   /* points from pole to pole of an ellipsoid, at most */
#define SHAPES 256   /* of a body, the limit of MildSurfaceDef */
#define ROOM_FINER 2 /* elements of a bounding box are so much closer together than a mesh's */
#define PI 3.141592653589793

/* The shapes of a body, with the vertices and triangles of those that are meshes. */
typedef struct {
    MildShape shape[SHAPES];
    void *memory[2 * SHAPES];
    int count, held;
} Shapes;

static void shapes_free(Shapes *shapes) {
    for (int i = 0; shapes && i < shapes->held; i++) {
        free(shapes->memory[i]);
    }
    free(shapes);
}

/* Room of the shape that is being added; NULL when out of memory. */
static void *hold(Shapes *shapes, size_t bytes) {
    void *memory = malloc(bytes > 0 ? bytes : 1);
    shapes->memory[shapes->held++] = memory;
    return memory;
}

/* ---- meshes ---- */

/* Points of half a cross section, from pole to pole. */
typedef struct {
    double wide[PROFILE], high[PROFILE]; /* [-] of the geom's size */
    int points;
} Profile;

static void add_triangle(MildShape *mesh, int *triangles, int a, int b, int c) {
    int *corner = triangles + 3 * (ptrdiff_t)mesh->triangle_count++;
    corner[0] = a;
    corner[1] = b;
    corner[2] = c;
}

/* Turns a profile about z. Its circles are polygons of the same area. */
static int lathe(Shapes *shapes, MildShape *mesh, const Profile *profile, const double size[3]) {
    const double reach = sqrt(2 * PI / (SIDES * sin(2 * PI / SIDES)));
    double *at = hold(shapes, (size_t)profile->points * SIDES * 3 * sizeof *at);
    int *triangles = hold(shapes, (size_t)profile->points * SIDES * 6 * sizeof *triangles);
    if (!at || !triangles) {
        return 0;
    }
    mesh->vertices = at;
    mesh->triangles = triangles;
    mesh->vertex_count = profile->points * SIDES;
    for (int p = 0; p < profile->points; p++) {
        for (int i = 0; i < SIDES; i++, at += 3) {
            const double angle = 2 * PI * (i + 0.5) / SIDES, wide = reach * profile->wide[p];
            at[0] = wide * size[0] * cos(angle);
            at[1] = wide * size[1] * sin(angle);
            at[2] = profile->high[p] * size[2];
        }
    }
    for (int p = 0; p + 1 < profile->points; p++) {
        for (int i = 0; i < SIDES; i++) {
            const int a = p * SIDES + i, b = p * SIDES + (i + 1) % SIDES;
            if (profile->wide[p] > 0) {
                add_triangle(mesh, triangles, a, b, b + SIDES);
            }
            if (profile->wide[p + 1] > 0) {
                add_triangle(mesh, triangles, a, b + SIDES, a + SIDES);
            }
        }
    }
    return 1;
}

static int add_cylinder(Shapes *shapes, MildShape *mesh, const double *size) {
    static const Profile profile = {{0, 1, 1, 0}, {-1, -1, 1, 1}, 4};
    const double scale[3] = {size[0], size[0], size[1]};
    return lathe(shapes, mesh, &profile, scale);
}

static int add_ellipsoid(Shapes *shapes, MildShape *mesh, const double *size) {
    Profile profile = {.points = PROFILE};
    for (int p = 1; p + 1 < PROFILE; p++) {
        profile.wide[p] = sin(PI * p / (PROFILE - 1));
    }
    for (int p = 0; p < PROFILE; p++) {
        profile.high[p] = -cos(PI * p / (PROFILE - 1));
    }
    return lathe(shapes, mesh, &profile, size);
}

/* Of a convex mesh: triangles whose corners run clockwise seen from outside are turned round. */
static void face_outward(const MildShape *mesh, int *triangles) {
    double middle[3] = {0, 0, 0};
    for (int i = 0; i < 3 * mesh->triangle_count; i++) {
        mju_addToScl3(middle, mesh->vertices + 3 * (ptrdiff_t)triangles[i],
                      1.0 / (3 * mesh->triangle_count));
    }
    for (int t = 0; t < mesh->triangle_count; t++) {
        int *corner = triangles + 3 * (ptrdiff_t)t;
        double a[3], b[3], out[3], normal[3];
        const double *origin = mesh->vertices + 3 * (ptrdiff_t)corner[0];
        mju_sub3(a, mesh->vertices + 3 * (ptrdiff_t)corner[1], origin);
        mju_sub3(b, mesh->vertices + 3 * (ptrdiff_t)corner[2], origin);
        mju_sub3(out, origin, middle);
        mju_cross(normal, a, b);
        if (mju_dot3(normal, out) < 0) {
            const int second = corner[1];
            corner[1] = corner[2];
            corner[2] = second;
        }
    }
}

/* The convex hull that MuJoCo collides with, where it has one, or the triangles. A hull is, for
 * each mesh: numbers of its vertices v and faces f, 2 v + (v + 3 f) numbers of its graph, and the
 * vertices of each face. */
static int add_mesh(Shapes *shapes, MildShape *mesh, const mjModel *m, int id) {
    const int *graph = m->mesh_graphadr[id] >= 0 ? m->mesh_graph + m->mesh_graphadr[id] : NULL;
    const int faces = graph ? graph[1] : m->mesh_facenum[id];
    const int *face = graph ? graph + 2 + 3 * (ptrdiff_t)graph[0] + 3 * (ptrdiff_t)faces
                            : m->mesh_face + 3 * (ptrdiff_t)m->mesh_faceadr[id];
    const float *vertex = m->mesh_vert + 3 * (ptrdiff_t)m->mesh_vertadr[id];
    const size_t numbers = 3 * (size_t)m->mesh_vertnum[id], corners = 3 * (size_t)faces;
    double *at = hold(shapes, numbers * sizeof *at);
    int *triangles = hold(shapes, corners * sizeof *triangles);
    if (!at || !triangles) {
        return 0;
    }
    for (size_t i = 0; i < numbers; i++) {
        at[i] = (double)vertex[i];
    }
    memcpy(triangles, face, corners * sizeof *triangles);
    mesh->vertices = at;
    mesh->vertex_count = m->mesh_vertnum[id];
    mesh->triangles = triangles;
    mesh->triangle_count = faces;
    if (graph) {
        face_outward(mesh, triangles);
    }
    return 1;
}

/* ---- shapes ---- */

static int is_shape(const mjModel *m, const Foot *foot, int geom) {
    switch (m->geom_bodyid[geom] == foot->body ? m->geom_type[geom] : mjGEOM_NONE) {
    case mjGEOM_SPHERE:
    case mjGEOM_CAPSULE:
    case mjGEOM_CYLINDER:
    case mjGEOM_ELLIPSOID:
    case mjGEOM_BOX: return 1;
    case mjGEOM_MESH: return !foot_has_primitive(m, foot);
    default: return 0;
    }
}

/* A mesh's bounding box, which the compiler knows before it has the vertices. */
static void add_bounds(MildShape *box, const mjModel *m, int geom) {
    const double *middle = m->geom_aabb + 6 * (ptrdiff_t)geom;
    double offset[3];
    box->type = MILD_SHAPE_BOX;
    mju_rotVecQuat(offset, middle, box->quat);
    mju_addTo3(box->pos, offset);
    for (int k = 0; k < 3; k++) {
        box->size[k] = fmax(middle[3 + k], 1e-6);
    }
}

/* Returns 0 when out of memory. bounds: bool, the bounding box of a mesh in its place. */
static int add_shape(Shapes *shapes, const mjModel *m, int geom, int bounds) {
    MildShape *shape = &shapes->shape[shapes->count++];
    const double *size = m->geom_size + 3 * (ptrdiff_t)geom;
    *shape = (MildShape){.type = MILD_SHAPE_MESH};
    mju_copy3(shape->size, size);
    mju_copy3(shape->pos, m->geom_pos + 3 * (ptrdiff_t)geom);
    mju_copy4(shape->quat, m->geom_quat + 4 * (ptrdiff_t)geom);
    switch (m->geom_type[geom]) {
    case mjGEOM_SPHERE: shape->type = MILD_SHAPE_SPHERE; return 1;
    case mjGEOM_CAPSULE: shape->type = MILD_SHAPE_CAPSULE; return 1;
    case mjGEOM_BOX: shape->type = MILD_SHAPE_BOX; return 1;
    case mjGEOM_CYLINDER: return add_cylinder(shapes, shape, size);
    case mjGEOM_ELLIPSOID: return add_ellipsoid(shapes, shape, size);
    default: break;
    }
    if (bounds) {
        add_bounds(shape, m, geom);
        return 1;
    }
    return add_mesh(shapes, shape, m, m->geom_dataid[geom]);
}

/* NULL with *error. */
static Shapes *shapes_of(const mjModel *m, const Foot *foot, int bounds, MildError *error) {
    Shapes *shapes = calloc(1, sizeof *shapes);
    int good = shapes != NULL, many = 0;
    for (int g = 0; g < m->ngeom && good; g++) {
        if (is_shape(m, foot, g)) {
            many = shapes->count == SHAPES;
            good = !many && add_shape(shapes, m, g, bounds);
        }
    }
    if (good && shapes->count > 0) {
        return shapes;
    }
    if (good) {
        mild_fail(error, MILD_ERROR_ARGUMENT,
                  "body: '%.60s' has no box, sphere, capsule, cylinder, ellipsoid or mesh",
                  foot_body_name(m, foot));
    } else if (many) {
        mild_fail(error, MILD_ERROR_RANGE, "body: '%.60s' has more than %d shapes",
                  foot_body_name(m, foot), SHAPES);
    } else {
        mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    }
    shapes_free(shapes);
    return NULL;
}

/* ---- shells ---- */

/* Elements of each shape alone, whose sum is that of the body without regard to what lies inside
 * another shape; 0 when a shape is refused. */
static int count_elements(const Shapes *shapes, double pitch) {
    int sum = 0;
    for (int i = 0; i < shapes->count; i++) {
        const MildSurfaceDef alone = {.shapes = &shapes->shape[i], .count = 1, .pitch = pitch};
        MildSole *sole = mild_sole_surface(&alone, NULL);
        if (!sole) {
            return 0;
        }
        sum += mild_sole_elements(sole);
        mild_sole_destroy(sole);
    }
    return sum;
}

/* A shell of at least `elements` elements: four sides of a long box. */
static MildSole *shell_of(int elements, MildError *error) {
    const double edge = 1e-3;
    const MildShape box = {.type = MILD_SHAPE_BOX,
                           .size = {0.5 * edge * (0.25 * elements + 1), edge / 2, edge / 2}};
    const MildSurfaceDef def = {.shapes = &box, .count = 1, .pitch = edge};
    return mild_sole_surface(&def, error);
}

/* [-] Elements that a body of meshes has room for, which are counted before they have vertices. */
static int room_of(const mjModel *m, const PluginDef *def, const Foot *foot, MildError *error) {
    Shapes *shapes = shapes_of(m, foot, 1, error);
    const int room = shapes ? count_elements(shapes, def->body_pitch / ROOM_FINER) : 0;
    shapes_free(shapes);
    return room;
}

static MildStatus check_room(const mjModel *m, const PluginDef *def, const Foot *foot,
                             MildError *error) {
    const int used = mild_sole_elements(foot->raster);
    const int room = foot_has_primitive(m, foot) ? used : room_of(m, def, foot, error);
    if (used <= room) {
        return MILD_OK;
    }
    return mild_fail(error, MILD_ERROR_RANGE,
                     "body: the meshes of '%.60s' make %d elements, but their bounding boxes have "
                     "room for %d; give the body a box or capsule in their place",
                     foot_body_name(m, foot), used, room);
}

MildStatus body_shell(const mjModel *m, const PluginDef *def, double pitch, int compiling,
                      Foot *foot, MildError *error) {
    if (compiling && !foot_has_primitive(m, foot)) {
        const int room = room_of(m, def, foot, error);
        foot->sole = foot->raster = room > 0 ? shell_of(room, error) : NULL;
        return foot->sole ? MILD_OK : MILD_ERROR_ARGUMENT;
    }
    Shapes *shapes = shapes_of(m, foot, 0, error);
    if (!shapes) {
        return MILD_ERROR_ARGUMENT;
    }
    MildError why = {0};
    const MildSurfaceDef shell = {.shapes = shapes->shape,
                                  .count = shapes->count,
                                  .pitch = pitch,
                                  .spacing = def->body_pitch};
    foot->sole = foot->raster = mild_sole_surface(&shell, &why);
    shapes_free(shapes);
    if (!foot->sole) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "body: '%.60s': %s", foot_body_name(m, foot),
                         why.text);
    }
    return compiling ? MILD_OK : check_room(m, def, foot, error);
}
