/* Surfaces for tests: shapes, and what does not come from the library about them. */
#ifndef SURFACE_KIT_H
#define SURFACE_KIT_H

#include "ground_kit.h"

static const double pi = 3.14159265358979323846;

static inline MildSole *surface_make(const MildShape *shapes, int count, double pitch) {
    const MildSurfaceDef def = {.shapes = shapes, .count = count, .pitch = pitch};
    MildError error = {0};
    MildSole *sole = mild_sole_surface(&def, &error);
    if (!sole) {
        fail_msg("%s", error.text);
    }
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

/* One face of columns x rows elements that looks down at the height z: an open mesh. */
static inline MildShape surface_plate(int columns, int rows, double z, double vertices[12]) {
    static const int triangles[6] = {0, 2, 1, 0, 3, 2};
    const double x = 0.5 * columns * KIT_PITCH, y = 0.5 * rows * KIT_PITCH;
    const double corner[12] = {-x, -y, z, x, -y, z, x, y, z, -x, y, z};
    memcpy(vertices, corner, sizeof corner);
    return (MildShape){.type = MILD_SHAPE_MESH,
                       .vertices = vertices,
                       .vertex_count = 4,
                       .triangles = triangles,
                       .triangle_count = 2};
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

#endif
