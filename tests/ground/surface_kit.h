/* Shells for tests: shapes, and what does not come from the library about them. */
#ifndef SURFACE_KIT_H
#define SURFACE_KIT_H

#include "ground_kit.h"

static const double pi = 3.14159265358979323846;

static inline MildSole *surface_make(const MildShape *shapes, int count, double pitch) {
    const MildSurfaceDef def = {.shapes = shapes, .count = count, .pitch = pitch};
    MildError error = {0};
    MildSole *sole = mild_sole_surface(&def, &error);
    expect_good(sole != NULL, &error);
    return sole;
}

static inline MildShape surface_box(double x, double y, double z) {
    return (MildShape){.type = MILD_SHAPE_BOX, .size = {x, y, z}};
}

static inline MildShape surface_capsule(double radius, double half) {
    return (MildShape){.type = MILD_SHAPE_CAPSULE, .size = {radius, half}};
}

static inline MildShape surface_sphere(double radius) {
    return (MildShape){.type = MILD_SHAPE_SPHERE, .size = {radius}};
}

/* A wedge: half of a box of these edges, cut along its diagonal; the mesh is closed. */
static inline MildShape surface_wedge(double a, double b, double c, double vertices[18]) {
    static const int triangles[24] = {0, 1, 2, 3, 5, 4, 0, 4, 1, 0, 3, 4,
                                      1, 5, 2, 1, 4, 5, 2, 3, 0, 2, 5, 3};
    const double corner[18] = {-a, -b, -c, a, -b, -c, -a, -b, c, -a, b, -c, a, b, -c, -a, b, c};
    memcpy(vertices, corner, sizeof corner);
    return (MildShape){.type = MILD_SHAPE_MESH,
                       .vertices = vertices,
                       .vertex_count = 6,
                       .triangles = triangles,
                       .triangle_count = 8};
}

/* One face of columns x rows elements that looks down at the height z: an open mesh of two
 * triangles for each. */
typedef struct {
    double vertices[49][3];
    int triangles[72][3];
} Plate36;

static inline MildShape surface_plate(int columns, int rows, double z, Plate36 *plate) {
    int count = 0;
    for (int i = 0; i <= columns; i++) {
        for (int j = 0; j <= rows; j++) {
            double *at = plate->vertices[i * (rows + 1) + j];
            at[0] = KIT_PITCH * (i - 0.5 * columns);
            at[1] = KIT_PITCH * (j - 0.5 * rows);
            at[2] = z;
            if (i < columns && j < rows) {
                const int a = i * (rows + 1) + j, b = a + rows + 1;
                const int two[2][3] = {{a, a + 1, b + 1}, {a, b + 1, b}};
                memcpy(plate->triangles[count], two, sizeof two);
                count += 2;
            }
        }
    }
    return (MildShape){.type = MILD_SHAPE_MESH,
                       .vertices = *plate->vertices,
                       .vertex_count = (columns + 1) * (rows + 1),
                       .triangles = *plate->triangles,
                       .triangle_count = count};
}

/* [m^2] */
static inline double surface_area(const MildSole *sole) {
    double sum = 0.0;
    for (int i = 0; i < mild_sole_elements(sole); i++) {
        sum += mild_sole_surface_area(sole)[i];
    }
    return sum;
}

/* [m^2] Shadow of the surface along a direction: what faces it, projected. */
static inline double surface_shadow(const MildSole *sole, double x, double y, double z) {
    double sum = 0.0;
    for (int i = 0; i < mild_sole_elements(sole); i++) {
        const double along = x * mild_sole_surface_normal(sole, 0)[i] +
                             y * mild_sole_surface_normal(sole, 1)[i] +
                             z * mild_sole_surface_normal(sole, 2)[i];
        sum += fmax(along, 0.0) * mild_sole_surface_area(sole)[i];
    }
    return sum;
}

/* What the tests of maps and of contact on them share. */

static inline MildMap *make_map(const MildMapDef *def) {
    MildError error = {0};
    MildMap *map = mild_map_create(def, &error);
    expect_good(map != NULL, &error);
    return map;
}

static inline MildMapDef shape(MildMapKind kind, double amplitude, double wavelength) {
    MildMapDef def = mild_map_def_default();
    def.kind = (int)kind;
    def.amplitude = amplitude;
    def.wavelength = wavelength;
    return def;
}

static inline MildTerrain terrain_on(const MildMap *map, double height) {
    MildMaterial m = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&m);
    terrain.height = height;
    for (; terrain.material_count < MILD_MATERIALS_MAX; terrain.material_count++) {
        terrain.materials[terrain.material_count] = m;
    }
    MildError error = {0};
    expect_good(mild_terrain_set_map(&terrain, map, &error) == MILD_OK, &error);
    return terrain;
}

#endif
