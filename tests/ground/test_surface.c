/* Making shells: areas, shadows and volumes against those of the shapes, parts that overlap,
 * refusals. */
#include "surface_kit.h"

/* [m^3] Enclosed volume, a third of the sum of p . n a. */
static double surface_volume(const MildSole *sole) {
    double sum = 0.0;
    for (int i = 0; i < mild_sole_elements(sole); i++) {
        const double at[3] = {mild_sole_x(sole)[i], mild_sole_y(sole)[i],
                              mild_sole_surface_z(sole)[i]};
        for (int k = 0; k < 3; k++) {
            sum += at[k] * mild_sole_surface_normal(sole, k)[i] * mild_sole_surface_area(sole)[i];
        }
    }
    return sum / 3.0;
}

typedef struct {
    const char *name;
    MildShape shape;
    double area, volume, down, side; /* [m^2], [m^3], [m^2] shadows along z and x */
} Solid;

/* A third of the shapes is turned about x + y + z, which exchanges the axes. */
TEST(shapes_have_their_area) {
    static double wedge[18];
    const double r = 0.05, h = 0.11, slant = hypot(0.2, 0.12);
    const Solid solids[] = {
        {"box", surface_box(0.1, 0.05, 0.03), 0.076, 0.0012, 0.02, 0.006},
        {"thin box", surface_box(0.1, 0.05, 0.001), 0.0412, 4e-5, 0.02, 0.0002},
        {"sphere", surface_sphere(r), 4 * pi * r * r, 4.0 / 3 * pi * r * r * r, pi * r * r,
         pi * r * r},
        {"capsule", surface_capsule(r, h), 4 * pi * r * (r + h), pi * r * r * (4.0 / 3 * r + 2 * h),
         pi * r * r, pi * r * r + 4 * r * h},
        {"wedge", surface_wedge(0.1, 0.07, 0.06, wedge), 0.2 * 0.12 + 0.14 * (0.2 + 0.12 + slant),
         0.5 * 0.2 * 0.14 * 0.12, 0.2 * 0.14, 0.14 * 0.12},
    };
    for (size_t i = 0; i < sizeof solids / sizeof *solids; i++) {
        for (int turned = 0; turned < 2; turned++) {
            const Solid *solid = &solids[i];
            MildShape shape = solid->shape;
            for (int k = 0; turned && k < 4; k++) {
                shape.quat[k] = 3.0; /* any length: x to y, y to z, z to x */
                shape.pos[k % 3] = 0.1 * k;
            }
            MildSole *sole = surface_make(&shape, 1, 0.012);
            const double down = surface_shadow(sole, -turned, 0, turned - 1);
            const double side = surface_shadow(sole, 1 - turned, turned, 0);
            expect_near(solid->name, surface_area(sole), solid->area, 1e-9);
            expect_near("volume", surface_volume(sole), solid->volume, 0.01 * solid->volume);
            expect_near("down", down, solid->down, 0.01 * solid->down);
            expect_near("side", side, solid->side, 0.01 * solid->side);
            const double fine = solid->area / (0.012 * 0.012);
            expect_near("elements", mild_sole_elements(sole), fine, 0.12 * fine + 60);
            mild_sole_destroy(sole);
        }
    }
}

/* Whatever its triangles: a box of twelve, and of twelve times 400. */
TEST(mesh_does_not_depend_on_its_triangles) {
    enum { CUT = 20, SIDE = (CUT + 1) * (CUT + 1) };
    static double vertices[6 * SIDE][3];
    static int triangles[12 * CUT * CUT][3];
    int vertex = 0, triangle = 0;
    const double half[3] = {0.1, 0.05, 0.04}; /* cells and triangles share their borders */
    for (int face = 0; face < 6; face++) {
        const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3, first = vertex;
        for (int i = 0; i <= CUT; i++) {
            for (int j = 0; j <= CUT; j++, vertex++) {
                vertices[vertex][axis] = face % 2 ? half[axis] : -half[axis];
                vertices[vertex][u] = half[u] * (2.0 * i / CUT - 1.0);
                vertices[vertex][v] = half[v] * (2.0 * j / CUT - 1.0);
            }
        }
        for (int i = 0; i < CUT * CUT; i++) {
            const int a = first + i / CUT * (CUT + 1) + i % CUT, b = a + CUT + 1;
            const int two[2][3] = {{a, b, b + 1}, {a, b + 1, a + 1}};
            for (int t = 0; t < 2; t++, triangle++) {
                triangles[triangle][0] = two[t][0];
                triangles[triangle][1] = two[t][face % 2 ? 1 : 2];
                triangles[triangle][2] = two[t][face % 2 ? 2 : 1];
            }
        }
    }
    const MildShape mesh = {.type = MILD_SHAPE_MESH,
                            .vertices = *vertices,
                            .vertex_count = vertex,
                            .triangles = *triangles,
                            .triangle_count = triangle};
    const MildShape box = surface_box(0.1, 0.05, 0.04);
    MildSole *fine = surface_make(&mesh, 1, 0.02), *plain = surface_make(&box, 1, 0.02);
    assert_int_equal(mild_sole_elements(fine), mild_sole_elements(plain));
    double worst = 0.0;
    for (int i = 0; i < mild_sole_elements(plain); i++) {
        double nearest = INFINITY;
        for (int j = 0; j < mild_sole_elements(fine); j++) {
            const double x = mild_sole_x(fine)[j] - mild_sole_x(plain)[i];
            const double y = mild_sole_y(fine)[j] - mild_sole_y(plain)[i];
            const double z = mild_sole_surface_z(fine)[j] - mild_sole_surface_z(plain)[i];
            nearest = fmin(nearest, sqrt(x * x + y * y + z * z));
        }
        worst = fmax(worst, nearest);
    }
    print_message("a box of %d triangles: elements within %.1e m of the box's\n", triangle, worst);
    assert_true(worst < 1e-9);
    mild_sole_destroy(fine);
    mild_sole_destroy(plain);
}

/* A triangle without area, or with less than has a square, makes no element. */
TEST(slivers_are_left_out) {
    static const double heights[] = {0.0, 1e-200, 1e-160, 1e-120};
    static const int triangles[6] = {0, 1, 2, 3, 4, 5};
    for (size_t i = 0; i < sizeof heights / sizeof *heights; i++) {
        const double vertices[18] = {0, 0, 0,   1, 0, 0,   0.5, heights[i], 0,
                                     0, 0, 0.5, 1, 0, 0.5, 0,   1,          0.5};
        const MildShape mesh = {.type = MILD_SHAPE_MESH,
                                .vertices = vertices,
                                .vertex_count = 6,
                                .triangles = triangles,
                                .triangle_count = 2};
        MildSole *sole = surface_make(&mesh, 1, 0.05);
        expect_near("area", surface_area(sole), 0.5, 1e-9);
        for (int e = 0; e < mild_sole_elements(sole); e++) {
            expect_near("height", mild_sole_surface_z(sole)[e], 0.5, 1e-12);
            expect_near("normal", mild_sole_surface_normal(sole, 2)[e], 1.0, 1e-12);
        }
        mild_sole_destroy(sole);
    }
}

/* Parts of a body hide what lies inside them. */
TEST(parts_that_overlap) {
    MildShape two[2] = {surface_box(0.1, 0.1, 0.1), surface_box(0.1, 0.1, 0.1)};
    two[1].pos[0] = 0.2; /* side by side: the common face goes */
    MildSole *sole = surface_make(two, 2, 0.02);
    expect_near("side by side", surface_area(sole), 10 * 0.04, 1e-9);
    mild_sole_destroy(sole);
    two[1].pos[0] = 0.0; /* twice the same: once */
    sole = surface_make(two, 2, 0.02);
    expect_near("twice", surface_area(sole), 6 * 0.04, 1e-9);
    mild_sole_destroy(sole);
    two[1] = surface_sphere(0.05);
    sole = surface_make(two, 2, 0.02);
    expect_near("inside", surface_area(sole), 6 * 0.04, 1e-9);
    mild_sole_destroy(sole);
    double vertices[18];
    const MildShape in_mesh[2] = {
        surface_wedge(0.1, 0.1, 0.1, vertices),
        {.type = MILD_SHAPE_SPHERE, .size = {0.02}, .pos = {-0.05, 0.0, -0.05}}};
    sole = surface_make(in_mesh, 2, 0.02);
    expect_near("in a mesh", surface_area(sole), 0.2 * 0.2 * (3 + sqrt(2.0)), 1e-9);
    mild_sole_destroy(sole);
    const MildShape ends[2] = {surface_capsule(0.03, 0.1),
                               {.type = MILD_SHAPE_SPHERE, .size = {0.05}, .pos = {0, 0, 0.1}}};
    const double r = 0.03, R = 0.05, joint = sqrt(R * R - r * r); /* where the cylinder goes in */
    sole = surface_make(ends, 2, 0.004);
    expect_near("joint", surface_area(sole),
                2 * pi * r * (0.2 - joint) + 2 * pi * r * r + 2 * pi * R * (R + joint), 1e-3);
    mild_sole_destroy(sole);
}

TEST(numbers_of_a_surface) {
    const MildShape box = surface_box(0.1, 0.05, 0.03);
    MildSole *sole = surface_make(&box, 1, 0.02), *plane = kit_plate(3, 2);
    expect_near("pitch", mild_sole_pitch(sole), 0.02, 0.0);
    expect_near("width", mild_sole_width(sole), 0.1, 1e-12);
    expect_near("z", mild_sole_z(sole), 0.0, 1e-15);
    for (int k = 0; k < 3; k++) {
        assert_null(mild_sole_surface_normal(plane, k));
    }
    assert_null(mild_sole_surface_z(plane));
    assert_null(mild_sole_surface_area(plane));
    MildError error = {0};
    assert_null(mild_sole_concentric(sole, &error));
    assert_error(&error, MILD_ERROR_ARGUMENT, "sole shell mild_sole_create");
    const MildMaterial sand = mild_material_default();
    MildMaterial rival = sand;
    assert_refused(mild_model_match(MILD_MODEL_ECC_SPRING, &sand, sole, 100.0, &rival, &error),
                   MILD_ERROR_ARGUMENT, &error, "sole shell mild_sole_create");
    mild_sole_destroy(sole);
    mild_sole_destroy(plane);
}

TEST(bad_numbers_are_refused) {
    double good[18], flat[18], far[18];
    const MildShape wedge = surface_wedge(0.1, 0.1, 0.1, good), box = surface_box(0.1, 0.1, 0.1);
    static const int inward[24] = {0, 2, 1, 3, 4, 5, 0, 1, 4, 0, 4, 3,
                                   1, 2, 5, 1, 5, 4, 2, 0, 3, 2, 3, 5};
    static const int outside[3] = {0, 1, 6};
    MildShape bad[15];
    for (int i = 0; i < 15; i++) {
        bad[i] = i < 7 ? box : wedge;
    }
    bad[0].type = 4;
    bad[1].size[2] = 0.0;
    bad[2].size[0] = NAN;
    bad[3].pos[1] = 11.0;
    bad[4].quat[3] = INFINITY;
    bad[5] = surface_capsule(0.1, -0.1);
    bad[6] = surface_sphere(-0.1);
    bad[7].vertices = NULL;
    bad[8].triangles = NULL;
    bad[9].triangle_count = 0;
    bad[10].triangles = outside;
    bad[10].triangle_count = 1;
    bad[11].vertices = far;
    bad[12].triangles = inward;
    bad[13].vertices = flat;
    bad[14].vertex_count = 2000000000;
    memcpy(far, good, sizeof far);
    far[4] = 1e9;
    memset(flat, 0, sizeof flat);
    static const struct {
        MildStatus status;
        const char *names;
    } wanted[15] = {{MILD_ERROR_RANGE, "surface.shapes[0].type 4"},
                    {MILD_ERROR_RANGE, "surface.shapes[0].size[2] 0"},
                    {MILD_ERROR_RANGE, "surface.shapes[0].size[0] nan"},
                    {MILD_ERROR_RANGE, "surface.shapes[0].pos[1] 11"},
                    {MILD_ERROR_RANGE, "surface.shapes[0].quat[3] inf"},
                    {MILD_ERROR_RANGE, "surface.shapes[0].size[1] -0.1"},
                    {MILD_ERROR_RANGE, "surface.shapes[0].size[0]"},
                    {MILD_ERROR_ARGUMENT, "surface.shapes[0] vertices 3"},
                    {MILD_ERROR_ARGUMENT, "surface.shapes[0] triangles 1"},
                    {MILD_ERROR_ARGUMENT, "surface.shapes[0] triangles 1"},
                    {MILD_ERROR_RANGE, "surface.shapes[0].triangles[0] 6"},
                    {MILD_ERROR_RANGE, "surface.shapes[0].vertices[1] 1e+09"},
                    {MILD_ERROR_ARGUMENT, "surface.shapes[0].triangles inward"},
                    {MILD_ERROR_RANGE, "surface.shapes outer"},
                    {MILD_ERROR_ARGUMENT, "surface.shapes[0] vertices"}};
    for (int i = 0; i < 15; i++) {
        const MildSurfaceDef def = {.shapes = &bad[i], .count = 1, .pitch = 0.02};
        MildError error = {0};
        assert_null(mild_sole_surface(&def, &error));
        assert_error(&error, wanted[i].status, wanted[i].names);
    }
    const MildShape large = surface_box(10, 10, 10);
    const struct {
        MildSurfaceDef def;
        MildStatus status;
        const char *names;
    } defs[] = {{{NULL, 1, 0.02, 0}, MILD_ERROR_ARGUMENT, "surface.count 1 256"},
                {{&box, 0, 0.02, 0}, MILD_ERROR_ARGUMENT, "surface.count 0 1 256"},
                {{&box, 257, 0.02, 0}, MILD_ERROR_ARGUMENT, "surface.count 257 1 256"},
                {{&box, 1, NAN, 0}, MILD_ERROR_RANGE, "surface.pitch nan 0.001 1"},
                {{&box, 1, 1e-4, 0}, MILD_ERROR_RANGE, "surface.pitch 0.0001 0.001 1"},
                {{&large, 1, 0.001, 0}, MILD_ERROR_RANGE, "surface.spacing 0.001 65536"},
                {{&box, 1, 0.02, 2}, MILD_ERROR_RANGE, "surface.spacing 2 0.001 1"},
                {{&box, 1, 0.02, NAN}, MILD_ERROR_RANGE, "surface.spacing nan 0.001 1"}};
    for (size_t i = 0; i < sizeof defs / sizeof *defs; i++) {
        MildError error = {0};
        assert_null(mild_sole_surface(&defs[i].def, &error));
        assert_error(&error, defs[i].status, defs[i].names);
    }
}

TEST_MAIN(NULL, NULL)
