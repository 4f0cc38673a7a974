/* Contact steps of shells: against plane soles, closed forms, differences. */
#include "surface_kit.h"

#include "ground/step/scratch.h"
#include "ground/step/step.h"

/* A random material of each model in turn. */
static MildMaterial any_material(uint64_t *random, int index) {
    static const MildModel models[] = {MILD_MODEL_MILD,      MILD_MODEL_ECC_SPRING,
                                       MILD_MODEL_ECC_QUASI, MILD_MODEL_ECC_QUASI_3D,
                                       MILD_MODEL_BEKKER,    MILD_MODEL_HUNT_CROSSLEY};
    MildMaterial m = kit_material(random);
    m.model = (int)models[index % 6];
    m.zeta = kit_uniform(random, 0.05, 1.5);
    m.exponent = kit_uniform(random, 0.4, 2.0);
    m.k_c = kit_uniform(random, 0.0, 50e3);
    m.k_phi = pow(10.0, kit_uniform(random, 4.5, 6.0));
    m.plate_width = 0.08;
    m.cohesion = kit_uniform(random, 0.0, 10e3);
    m.shear_length = kit_uniform(random, 0.001, 0.05);
    m.dissipation = kit_uniform(random, 0.0, 5.0);
    return m;
}

static double difference(const double *a, const double *b, int count) {
    double most = 0.0, size = 1e-9;
    for (int i = 0; i < count; i++) {
        most = fmax(most, fabs(a[i] - b[i]));
        size = fmax(size, fabs(a[i]) + fabs(b[i]));
    }
    return most / size;
}

/* Throws a plate at the ground, as a face and as a sole. */
static void throw_both(Kit *one, Kit *two, int imprints, uint64_t *random) {
    if (imprints) {
        kit_prints(one, 32);
        kit_prints(two, 32);
    }
    one->input.position[0][0] = 0.0123; /* off the borders of imprints' cells */
    one->input.position[0][1] = 0.0045;
    one->input.position[0][2] -= 0.01;
    one->mass[0] = 3.0;
    one->inertia[0] = 0.02;
    one->center[0][2] = kit_uniform(random, 0.0, 0.3);
    for (int k = 0; k < 6; k++) {
        one->input.velocity[0][k] = kit_uniform(random, -0.2, 0.2);
    }
    if (imprints) { /* imprints take the elements of a shell for level squares: no tilt */
        memset(one->center[0], 0, sizeof one->center[0]);
        memset(one->input.velocity[0] + 3, 0, 3 * sizeof(double));
        one->inertia[0] = 1e9;
    }
    one->input.velocity[0][2] -= 0.3;
    kit_copy_input(two, one);
    memcpy(two->center, one->center, sizeof two->center);
    memcpy(two->mass, one->mass, sizeof two->mass);
    memcpy(two->inertia, one->inertia, sizeof two->inertia);
}

/* A face that looks down, against a plane sole of the same raster: level when it touches down, so
 * that every share is 1, and tilting afterwards. */
TEST(a_face_is_a_sole) {
    double worst = 0.0;
    Plate36 plate;
    const MildShape shape = surface_plate(5, 3, KIT_SOLE_Z, &plate);
    MildSole *face = surface_make(&shape, 1, KIT_PITCH), *sole = kit_plate(5, 3);
    uint64_t random = 3;
    int steps = 0, loaded = 0, alike = 0;
    for (int draw = 0; draw < 120; draw++) {
        const MildMaterial m = any_material(&random, draw);
        Kit one, two;
        kit_open(&one, 1, face, NULL, &m, 1e-3);
        kit_open(&two, 1, sole, NULL, &m, 1e-3);
        throw_both(&one, &two, draw % 2, &random);
        for (int s = 0; s < 20; s++, steps++) {
            kit_step(&one, NULL);
            kit_step(&two, NULL);
            loaded += one.result.foot[0].contacts;
            const MildFootResult *a = &one.result.foot[0], *b = &two.result.foot[0];
            worst = fmax(worst, difference(one.result.velocity, two.result.velocity, 6));
            worst = fmax(worst, difference(a->force, b->force, 6));
            worst = fmax(worst, difference(a->pressure_center, b->pressure_center, 3));
            if (a->contacts == b->contacts) { /* else rounding loads an element with next to 0 */
                worst = fmax(worst, difference(&a->area, &b->area, 3));
                alike++;
            }
            for (int e = 0; e < 15; e++) {
                if (mild_ground_depth_max(two.ground, 0)[e] == 0.0) {
                    s = 20; /* it lifted off: its next share is not 1 */
                }
            }
        }
        kit_close(&one);
        kit_close(&two);
    }
    expect_below("a face against a sole", worst, 1e-9);
    assert_true(alike > 0.99 * steps);
    assert_true(loaded > 15 * 1000);
    mild_sole_destroy(face);
    mild_sole_destroy(sole);
}

/* [N] Force on a body that does not move. */
static double held_force(const MildSole *sole, const MildMaterial *m, const double *turn,
                         double height) {
    Kit kit;
    kit_open(&kit, 1, (MildSole *)(uintptr_t)sole, NULL, m, 1e-3);
    kit_rotate(kit.input.rotation[0], turn);
    kit.input.position[0][2] = height;
    kit_solve(&kit); /* its inverse inertia is 0 */
    assert_int_equal(kit.result.converged, 1);
    const double force = kit.result.foot[0].force[2];
    kit_close(&kit);
    return force;
}

/* [N/m^2] Force of one element on virgin ground over its area. */
static double pressure(const MildMaterial *m, double pitch, double depth) {
    return depth > 0.0 ? mild_element_law(m, pitch, depth).force / (pitch * pitch) : 0.0;
}

/* Integrals over what is below the surface, projected: rings of a sphere, strips of a cylinder. */
static double sphere_force(const MildMaterial *m, double pitch, double radius, double sunk) {
    enum { RINGS = 4000 };
    double sum = 0.0;
    for (int i = 0; i < RINGS; i++) {
        const double rho = radius * (i + 0.5) / RINGS;
        const double depth = sunk - radius + sqrt(radius * radius - rho * rho);
        sum += 2 * pi * rho * radius / RINGS * pressure(m, pitch, depth);
    }
    return sum;
}

static double cylinder_force(const MildMaterial *m, double pitch, double radius, double length,
                             double sunk) {
    enum { STRIPS = 4000 };
    double sum = 0.0;
    for (int i = 0; i < STRIPS; i++) {
        const double y = radius * (2 * (i + 0.5) / STRIPS - 1);
        const double depth = sunk - radius + sqrt(radius * radius - y * y);
        sum += 2 * radius / STRIPS * length * pressure(m, pitch, depth);
    }
    return sum;
}

TEST(pressed_shapes_agree_with_closed_forms) {
    const double radius = 0.1, half = 0.15, pitch = 0.006;
    const MildShape ball = surface_sphere(radius), rod = surface_capsule(radius, half);
    MildSole *sphere = surface_make(&ball, 1, pitch), *capsule = surface_make(&rod, 1, pitch);
    const double still[3] = {0, 0, 0}, side[3] = {0.0, 0.5 * pi, 0.0};
    MildMaterial spring = mild_material_default();
    spring.model = MILD_MODEL_ECC_SPRING;
    spring.k_pen = 2.0;
    MildMaterial foam = mild_material_default();
    mild_material_preset("foam45", &foam);
    const MildMaterial grounds[3] = {spring, mild_material_default(), foam};
    for (int g = 0; g < 3; g++) {
        const MildMaterial *m = &grounds[g];
        for (int s = 1; s < 4; s++) {
            const double sunk = 0.02 * s;
            const double got = held_force(sphere, m, still, radius - sunk);
            const double want = sphere_force(m, pitch, radius, sunk);
            const double lies = held_force(capsule, m, side, radius - sunk);
            const double flat = cylinder_force(m, pitch, radius, 2 * half, sunk) + want;
            expect_near("sphere", got, want, 0.015 * want);
            expect_near("capsule", lies, flat, 0.015 * flat);
        }
        /* springs: stiffness per area times the volume of the cap below the surface */
        if (g == 0) {
            const double cap = pi * 0.04 * 0.04 * (3 * radius - 0.04) / 3;
            expect_near("cap", sphere_force(m, pitch, radius, 0.04),
                        spring.k_pen / KIT_PITCH / KIT_PITCH * cap,
                        1e-3 * spring.k_pen / KIT_PITCH / KIT_PITCH * cap);
        }
    }
    mild_sole_destroy(sphere);
    mild_sole_destroy(capsule);
}

static MildSole *block(void) {
    static MildShape parts[2];
    parts[0] = surface_box(0.09, 0.05, 0.04);
    parts[1] = surface_capsule(0.03, 0.06);
    parts[1].pos[0] = 0.08;
    parts[1].quat[0] = parts[1].quat[1] = 1.0;
    return surface_make(parts, 2, 0.022);
}

static void random_pose(Kit *kit, uint64_t *random) {
    for (int f = 0; f < kit->feet; f++) {
        double turn[3];
        for (int k = 0; k < 3; k++) {
            turn[k] = kit_uniform(random, -3.0, 3.0);
            kit->input.velocity[f][k] = kit_uniform(random, -0.5, 0.5);
            kit->input.velocity[f][3 + k] = kit_uniform(random, -3.0, 3.0);
        }
        kit_rotate(kit->input.rotation[f], turn);
        kit->input.position[f][2] = kit_uniform(random, -0.02, 0.06);
        kit->mass[f] = kit_uniform(random, 0.5, 10.0);
        kit->inertia[f] = kit->mass[f] * 0.01;
    }
}

/* The derivatives of the wrench, away from kinks: those where two differences agree. */
TEST(hessian_is_the_derivative) {
    MildSole *body = block();
    uint64_t random = 8;
    double worst = 0.0;
    int compared = 0;
    for (int draw = 0; draw < 60; draw++) {
        const MildMaterial m = any_material(&random, draw);
        Kit kit;
        kit_open(&kit, 2, body, body, &m, 2e-3);
        random_pose(&kit, &random);
        for (int s = 0; s < 3; s++) {
            kit_step(&kit, NULL);
        }
        kit_inverse_inertia(&kit);
        kit_free(&kit, NULL);
        kit_solve(&kit);
        if (kit.scratch->listed < 2) {
            kit_close(&kit);
            continue;
        }
        double twist[12], H[2][36], size = 1e-12;
        memcpy(twist, kit.result.velocity, sizeof twist);
        contact_pass(kit.scratch, kit.input.dt, twist);
        contact_hessian(kit.scratch);
        memcpy(H, kit.scratch->hessian, sizeof H);
        for (int i = 0; i < 72; i++) {
            size = fmax(size, fabs(H[i / 36][i % 36]));
        }
        for (int c = 0; c < 12; c++) {
            double slope[2][6];
            for (int t = 0; t < 2; t++) {
                const double h = t ? 1e-7 : 3e-7;
                for (int way = -1; way < 2; way += 2) {
                    twist[c] = kit.result.velocity[c] + way * h;
                    contact_pass(kit.scratch, kit.input.dt, twist);
                    for (int r = 0; r < 6; r++) {
                        const double w = kit.scratch->wrench[c / 6 * 6 + r];
                        slope[t][r] = way < 0 ? w : -(w - slope[t][r]) / (2.0 * h);
                    }
                }
                twist[c] = kit.result.velocity[c];
            }
            for (int r = 0; r < 6; r++) {
                if (fabs(slope[0][r] - slope[1][r]) <= 1e-6 * size) {
                    compared++;
                    worst = fmax(worst, fabs(H[c / 6][6 * r + c % 6] - slope[0][r]) / size);
                }
            }
        }
        kit_close(&kit);
    }
    expect_below("entries of the Hessian against differences", worst, 1e-5);
    assert_true(compared > 1500);
    mild_sole_destroy(body);
}

/* A box lies on elastic or plastic ground, turns over without being moved, and turns back: what
 * comes to face down under the surface carries nothing. */
TEST(a_buried_face_begins_without_force) {
    const MildShape shape = surface_box(0.1, 0.1, 0.02);
    MildSole *box = surface_make(&shape, 1, 0.02);
    const double turn[3] = {pi, 0.0, 0.0};
    for (int elastic = 0; elastic < 2; elastic++) {
        MildMaterial m = mild_material_default();
        m.recovery = elastic;
        Kit kit;
        kit_open(&kit, 1, box, NULL, &m, 1e-3);
        kit.input.position[0][2] = -0.03;
        kit_solve(&kit);
        const double first = kit.result.foot[0].force[2];
        kit_advance(&kit);
        kit_rotate(kit.input.rotation[0], turn);
        kit_solve(&kit);
        const double turned = kit.result.foot[0].force[2];
        kit_advance(&kit);
        kit.input.free_velocity[2] = -0.1;
        for (int s = 0; s < 10; s++) {
            kit_solve(&kit);
            kit_advance(&kit);
        }
        const double deeper = kit.result.foot[0].force[2];
        kit.input.free_velocity[2] = 1.0;
        for (int s = 0; s < 100; s++) {
            kit_solve(&kit);
            kit_advance(&kit);
        }
        kit.input.free_velocity[2] = -1.0;
        for (int s = 0; s < 100; s++) {
            kit_solve(&kit);
            kit_advance(&kit);
        }
        const double again = kit.result.foot[0].force[2];
        assert_true(first > 10.0);
        assert_true(fabs(turned) < 1e-6 * first);
        assert_true(elastic ? deeper == 0.0 : deeper > first);
        assert_true(again > 0.99 * first);
        kit_close(&kit);
    }
    mild_sole_destroy(box);
}

/* It lifts off in its imprint in plastic ground and is moved, still below the surface, to where the
 * ground is elastic: that has not been pressed down, so it carries nothing. */
static void beside_an_imprint(MildSole *box) {
    const double below = mild_sole_surface_z(box) ? 0.05 : -mild_sole_z(box); /* [m] its face */
    MildMaterial sand = mild_material_default(), foam;
    sand.recovery = 0.0;
    mild_material_preset("foam45", &foam);
    foam.recovery = 1.0;
    Kit kit;
    kit_open(&kit, 1, box, NULL, &sand, 1e-3);
    kit_prints(&kit, 64);
    kit.terrain.materials[kit.terrain.material_count++] = foam;
    const MildPatch patch = {0.0, INFINITY, -INFINITY, INFINITY, 1};
    mild_terrain_add_patch(&kit.terrain, &patch, NULL);
    kit.input.position[0][0] = -0.5;
    kit.input.position[0][2] = 0.001 + below;
    double pressed = 0.0;
    for (int s = 0; s < 45; s++) {
        kit.input.free_velocity[2] = s < 40 ? -1.0 : 0.4;
        kit_solve(&kit);
        pressed = fmax(pressed, kit.result.foot[0].force[2]);
        kit_advance(&kit);
    }
    kit_solve(&kit);
    const double lifted = kit.result.foot[0].force[2];
    kit.input.position[0][0] = 0.5;
    kit.input.free_velocity[2] = 0.0;
    kit_solve(&kit);
    const double beside = kit.result.foot[0].force[2];
    kit_advance(&kit);
    kit_solve(&kit);
    assert_true(pressed > 100.0 && lifted == 0.0 && beside == 0.0);
    assert_true(kit.result.foot[0].force[2] == 0.0);
    /* It presses again once it has come out. */
    kit.input.position[0][2] = 0.001 + below;
    for (int s = 0; s < 10; s++) {
        kit.input.free_velocity[2] = -1.0;
        kit_solve(&kit);
        kit_advance(&kit);
    }
    assert_true(kit.result.foot[0].force[2] > 1.0);
    kit_close(&kit);
    mild_sole_destroy(box);
}

TEST(elastic_ground_beside_an_imprint_carries_nothing) {
    const MildShape shape = surface_box(0.1, 0.1, 0.05);
    beside_an_imprint(surface_make(&shape, 1, 0.02));
    beside_an_imprint(kit_plate(10, 10)); /* a plane sole */
}

/* A face that turns over on elastic ground leaves no print there, on plastic ground it does;
 * whichever scratch the step is solved with, one that has seen this ground or none. */
TEST(elastic_ground_keeps_no_print_of_a_face) {
    const double vertices[12] = {-0.05, -0.05, 0, 0.05, -0.05, 0, 0.05, 0.05, 0, -0.05, 0.05, 0};
    const int triangles[6] = {0, 2, 1, 0, 3, 2}; /* faces down */
    const MildShape shape = {.type = MILD_SHAPE_MESH,
                             .vertices = vertices,
                             .vertex_count = 4,
                             .triangles = triangles,
                             .triangle_count = 2};
    MildSole *face = surface_make(&shape, 1, 0.02);
    for (int t = 0; t < 4; t++) {
        const int is_elastic = t / 2, is_fresh = t % 2;
        MildMaterial m = mild_material_default();
        m.recovery = is_elastic ? 1.0 : 0.0;
        Kit kit;
        kit_open(&kit, 1, face, NULL, &m, 2e-3);
        kit_prints(&kit, 64);
        kit.input.position[0][1] = 0.0;
        kit.input.position[0][2] = -0.002;
        kit.input.velocity[0][2] = kit.input.free_velocity[2] = -0.05;
        kit_inverse_inertia(&kit);
        kit_solve(&kit);
        mild_ground_advance(kit.ground, &kit.terrain, &kit.input, kit.scratch, &kit.result);
        assert_true(kit.result.foot[0].contacts > 0);
        const MildSole *soles[1] = {face};
        MildScratch *other = mild_scratch_create(soles, 1, NULL);
        MildScratch *scratch = is_fresh ? other : kit.scratch;
        kit.input.rotation[0][4] = kit.input.rotation[0][8] = -1;
        mild_ground_solve(kit.ground, &kit.terrain, &kit.input, scratch, &kit.result);
        mild_ground_advance(kit.ground, &kit.terrain, &kit.input, scratch, &kit.result);
        const double print = mild_ground_imprint_at(kit.ground, 0.01, 0.01);
        assert_true(is_elastic ? print == 0 : print > 0.001);
        mild_scratch_destroy(other);
        kit_close(&kit);
    }
    mild_sole_destroy(face);
}

/* A level face sinks as deep as a sole of its area, whatever the distance of its elements. */
TEST(spacing_is_not_in_the_law) {
    MildSole *plate = kit_plate(12, 12);
    const double half = 6 * KIT_PITCH;
    const MildShape box = surface_box(half, half, 0.05);
    const MildMaterial m = mild_material_default();
    double force[4];
    for (int k = 0; k < 4; k++) {
        const double spacing[] = {0, 0.5 * KIT_PITCH, 3 * KIT_PITCH};
        const MildSurfaceDef def = {&box, 1, KIT_PITCH, k ? spacing[k - 1] : 0};
        MildSole *sole = k ? mild_sole_surface(&def, NULL) : NULL;
        Kit kit;
        kit_open(&kit, 1, k ? sole : plate, NULL, &m, 1e-3);
        kit.input.position[0][2] = k ? 0.05 : -mild_sole_z(plate);
        for (int s = 0; s < 40; s++) {
            kit.input.free_velocity[2] = kit.input.velocity[0][2] = -0.5;
            kit_solve(&kit);
            kit_advance(&kit);
        }
        force[k] = kit.result.foot[0].force[2];
        kit_close(&kit);
        mild_sole_destroy(sole);
        assert_true(fabs(force[k] - force[0]) < 1e-9 * force[0] && force[0] > 100.0);
    }
    mild_sole_destroy(plate);
}

/* A face that leans after touchdown: the share stays that of the touchdown, and another touchdown
 * finds another. */
TEST(a_share_is_kept) {
    Plate36 plate;
    const MildShape shape = surface_plate(4, 4, 0.0, &plate);
    MildSole *face = surface_make(&shape, 1, KIT_PITCH);
    MildMaterial m = mild_material_default();
    m.model = MILD_MODEL_HUNT_CROSSLEY;
    m.exponent = 1.0;
    m.dissipation = 0.0;
    m.mu = m.k_drift = m.b_drift = 0.0;
    const double tilt[3] = {0.0, pi / 3, 0.0}, back[3] = {0.0, -pi / 3, 0.0};
    Kit kit;
    kit_open(&kit, 1, face, NULL, &m, 1e-3);
    kit_rotate(kit.input.rotation[0], tilt);
    kit.input.position[0][2] = -0.04;
    kit_solve(&kit);
    kit_advance(&kit);
    kit_rotate(kit.input.rotation[0], back);
    kit_solve(&kit);
    const double kept = kit.result.foot[0].force[2];
    mild_ground_reset(kit.ground);
    kit_solve(&kit);
    const double level = kit.result.foot[0].force[2];
    expect_near("kept", kept / level, 0.5, 1e-9);
    kit_close(&kit);
    mild_sole_destroy(face);
}

/* A copy of the state continues alike; a state of other soles, or with numbers that no step leaves,
 * is refused. */
TEST(states_are_copied) {
    MildSole *body = block(), *plate = kit_plate(3, 2);
    uint64_t random = 5;
    const MildMaterial m = mild_material_default();
    Kit one, two;
    kit_open(&one, 2, body, plate, &m, 1e-3);
    random_pose(&one, &random);
    for (int s = 0; s < 60; s++) {
        kit_step(&one, NULL);
    }
    kit_open(&two, 2, body, plate, &m, 1e-3);
    assert_true(mild_ground_size(one.ground) == mild_ground_size(two.ground));
    MildError error = {0};
    assert_int_equal(mild_ground_restore(two.ground, one.ground, one.bytes, &error), MILD_OK);
    kit_copy_input(&two, &one);
    memcpy(two.mass, one.mass, sizeof two.mass);
    memcpy(two.inertia, one.inertia, sizeof two.inertia);
    for (int s = 0; s < 60; s++) {
        kit_step(&one, NULL);
        kit_step(&two, NULL);
        assert_memory_equal(&one.result, &two.result, sizeof one.result);
    }
    assert_memory_equal(one.ground, two.ground, one.bytes);
    Memory memory = ground_memory(one.ground, 0);
    assert_non_null(memory.area_share);
    memory.area_share[3] = -1.0;
    assert_int_not_equal(mild_ground_restore(two.ground, one.ground, one.bytes, &error), MILD_OK);
    memory.area_share[3] = 0.0;
    memory.material[3] = -4;
    assert_int_not_equal(mild_ground_restore(two.ground, one.ground, one.bytes, &error), MILD_OK);
    memory.material[3] = MATERIAL_BURIED;
    assert_int_equal(mild_ground_restore(two.ground, one.ground, one.bytes, &error), MILD_OK);
    memory = ground_memory(one.ground, 1);
    assert_null(memory.area_share);
    memory.material[3] = MATERIAL_BURIED; /* not of a plane sole */
    assert_int_not_equal(mild_ground_restore(two.ground, one.ground, one.bytes, &error), MILD_OK);
    kit_close(&one);
    kit_close(&two);
    mild_sole_destroy(body);
    mild_sole_destroy(plate);
}

/* Far above the ground nothing is listed, and the elements say so. */
TEST(in_the_air) {
    MildSole *body = block();
    const MildMaterial m = mild_material_default();
    Kit kit;
    kit_open(&kit, 1, body, NULL, &m, 1e-3);
    kit.input.position[0][2] = 0.0;
    kit_step(&kit, NULL);
    assert_true(kit.result.foot[0].contacts > 0);
    kit.input.position[0][2] = 0.5;
    kit_step(&kit, NULL);
    const MildElements elements = mild_scratch_elements(kit.scratch, 0);
    for (int e = 0; e < mild_sole_elements(body); e++) {
        assert_int_equal(elements.state[e], MILD_ELEMENT_FREE);
        assert_true(elements.depth[e] < -0.3 && elements.normal[e] == 0.0);
        assert_true(mild_ground_depth_max(kit.ground, 0)[e] == 0.0);
    }
    assert_int_equal(kit.ground->touched[0], 0);
    kit.input.position[0][2] = NAN;
    kit_solve(&kit);
    assert_int_equal(kit.result.converged, 0);
    kit_close(&kit);
    mild_sole_destroy(body);
}

TEST_MAIN(NULL, NULL)
