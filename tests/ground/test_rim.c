/* The rim of a rounded body under mild_merged (docs/model.md section 23), held to closed forms and
 * to quadrature over the body itself. */
#include "surface_kit.h"

#include "ground/law/rim.h"
#include "ground/sole/sole.h"

/* Numbers of grains of 2.5 mm: k0 = 1.2 MPa/m, kappa = 0.2 MPa/m; plastic, no bed, no mass. */
static MildMaterial grains(void) {
    MildMaterial m = mild_material_default();
    m.model = MILD_MODEL_MILD_MERGED;
    m.alpha = 0.3;
    m.nu = tan(m.alpha) / 0.12;
    m.k_pen = 1.2e6 * KIT_PITCH * KIT_PITCH;
    m.sigma_cone = 0.2e6 * cos(m.alpha);
    m.c_g = 0.0;
    m.k_drift = m.b_drift = m.mu = 0.0;
    m.recovery = 0.0;
    m.bed_depth = 1.0;
    return m;
}

/* Elements of a paraboloid that is h deep within the radius a, on a plane through the depth d whose
 * slope is g along (3, 4)/5: all that rim_of is to find. */
TEST(test_moments) {
    const double a = 0.03, h = 0.012, d = 0.007, g = 0.2, step = 1e-4;
    double sums[RIM_SUMS] = {0.0};
    for (double x = -a; x <= a; x += step) {
        for (double y = -a; y <= a; y += step) {
            const double u = d + g * (0.6 * x + 0.8 * y) + h * (1 - (x * x + y * y) / (a * a));
            if (x * x + y * y < a * a) {
                rim_add(sums, 0.4 + x, y - 0.3, u, 0.9, step * step);
                rim_add(sums, 5.0, 5.0, u, 0.49, step * step); /* a wall */
                rim_add(sums, 5.0, 5.0, -u, 0.9, step * step); /* in the air */
            }
        }
    }
    const Rim rim = rim_of(sums);
    assert_true(fabs(rim.x - 0.4) + fabs(rim.y + 0.3) < 1e-4);
    assert_true(fabs(rim.depth - d) < 2e-5 && fabs(rim.height / h - 1) < 0.003);
    assert_true(fabs(rim.slope[0] - 0.6 * g) + fabs(rim.slope[1] - 0.8 * g) < 1e-3);
    assert_true(fabs(rim.breadth / a - 1) < 0.003);
}

/* One element is half as broad as the disc of its area; so is nothing, without a division by 0. */
TEST(test_one) {
    double sums[RIM_SUMS] = {0.0};
    const Rim none = rim_of(sums);
    assert_true(none.breadth == 0 && none.height == 0 && none.depth == 0);
    rim_add(sums, 0.1, 0.2, 0.01, 1.0, 4e-4);
    const Rim one = rim_of(sums);
    assert_true(fabs(one.breadth / sqrt(4e-4 / pi) - 1) < 1e-6);
    assert_true(fabs(RIM_RADIUS - MATERIAL_PITCH / sqrt(pi)) < 1e-9);
    assert_true(fabs(one.depth - 0.01) < 1e-7 && one.height < 1e-7);
}

/* Presses a shell straight down by small steps, its lowest point to a depth; returns the force up
 * [N]. bottom: [m] that point below the frame. */
static double press(MildSole *sole, const MildMaterial *m, const double *R, double bottom,
                    double depth) {
    Kit kit;
    kit_open(&kit, 1, sole, NULL, m, 1e-3);
    if (R) {
        memcpy(kit.input.rotation[0], R, 9 * sizeof *R);
    }
    const double speed = 0.02, dt = kit.input.dt;
    kit.input.position[0][2] = bottom + 1e-4;
    const double twist[6] = {0, 0, -speed, 0, 0, 0}, still[6] = {0};
    memcpy(kit.input.velocity[0], twist, sizeof twist);
    for (double at = -1e-4; at < depth - 0.5 * speed * dt; at += speed * dt) {
        memcpy(kit.input.free_velocity, twist, sizeof twist);
        kit_solve(&kit);
        kit_advance(&kit);
    }
    memcpy(kit.input.velocity[0], still, sizeof still);
    memcpy(kit.input.free_velocity, still, sizeof still);
    kit_solve(&kit);
    const double force = kit.result.foot[0].force[2];
    kit_close(&kit);
    return force;
}

/* The law over a sphere itself, by rings; walls carry 0.02 of what a plate would at their depth. */
static double sphere_force(const MildMaterial *m, double radius, double depth) {
    enum { RINGS = 20000 };
    const double k0 = m->k_pen / (KIT_PITCH * KIT_PITCH), kappa = m->sigma_cone / cos(m->alpha);
    const double slope = tan(m->alpha) / m->nu, low = fmax(1 - depth / radius, 0.0);
    const double from = fmax(low, 0.5);
    double w = 0, wu = 0, wuu = 0, wrr = 0;
    for (int i = 0; i < RINGS; i++) {
        const double n = from + (1 - from) * (i + 0.5) / RINGS;
        const double u = radius * (n - 1) + depth;
        w += n;
        wu += n * u;
        wuu += n * u * u;
        wrr += n * radius * radius * (1 - n * n) / 2;
    }
    const double mean = wu / w, height = sqrt(12 * fmax(wuu / w - mean * mean, 0.0));
    const double rim = mean - height / 2, breadth = 2 * sqrt(wrr / w);
    double force = 0.0;
    for (int i = 0; i < RINGS; i++) {
        const double n = low + (1 - low) * (i + 0.5) / RINGS;
        const double u = radius * (n - 1) + depth;
        const double v = fmin(fmax((u - rim) / height, 0.0), 1.0);
        const double heap = slope * breadth * (1 - sqrt(1 - v));
        const double t = fmin(u / (slope * radius), 1.0);
        const double whole =
            kappa * u + (k0 - kappa) * slope * radius * (t - t * t + t * t * t / 3);
        const double bears = kappa * fmax(rim, heap) + (k0 - kappa) * heap;
        const double pressure = n < 0.5 ? 0.02 * whole : fmin(bears, whole);
        force += pressure * n;
    }
    return force * 2 * pi * radius * radius * (1 - low) / RINGS;
}

/* Elements are rings of 80 degrees at most, and few; the finer they are, the nearer. */
TEST(test_sphere) {
    const MildMaterial m = grains();
    const double radius = 0.03;
    MildShape ball = surface_sphere(radius);
    for (int k = 1; k <= 5; k++) {
        const double depth = 0.006 * k;
        const MildSurfaceDef def = {
            .shapes = &ball, .count = 1, .pitch = KIT_PITCH, .spacing = 0.002};
        MildError error = {0};
        MildSole *sole = mild_sole_surface(&def, &error);
        expect_good(sole != NULL, &error);
        const double force = press(sole, &m, NULL, radius, depth);
        const double wanted = sphere_force(&m, radius, depth);
        expect_near("force on a ball", force, wanted, 0.04 * wanted);
        mild_sole_destroy(sole);
    }
}

/* A flat face carries what a plate does, level and tilted: the plane through its depths is the
 * face, and b/3, with b = 2 a/sqrt(12) under one of the width a, stands for the mean distance from
 * its edge (a (3 l - a)/(12 l), 8 % more with l = 2 a). */
TEST(test_flat) {
    static const double tilts[] = {0.0, 0.1, 0.3};
    const MildMaterial m = grains();
    const double k0 = 1.2e6, kappa = 0.2e6, half = 0.06, other = 0.03, depth = 0.02;
    const double wide = 0.12 * 0.05; /* a cone of the box's breadth */
    const double heap = 0.12 * 2 * (2 * other) / sqrt(12.0) / 3;
    MildShape box = surface_box(half, other, 0.05);
    MildSole *sole = surface_make(&box, 1, 0.01);
    for (int t = 0; t < 3; t++) {
        const double c = cos(tilts[t]), s = sin(tilts[t]);
        const double R[9] = {c, 0, s, 0, 1, 0, -s, 0, c};
        const double force = press(sole, &m, R, 0.05 * c + half * s, depth);
        double wanted = 0.0; /* the bottom alone: sides are walls */
        for (int i = 0; i < mild_sole_elements(sole); i++) {
            if (mild_sole_surface_normal(sole, 2)[i] < -0.5) {
                const double x = mild_sole_x(sole)[i];
                const double u = depth - half * s - s * x;
                const double t = fmin(fmax(u, 0.0) / wide, 1.0);
                const double cone = fmin(heap, wide * (t - t * t + t * t * t / 3));
                const double pressure = kappa * u + (k0 - kappa) * cone;
                wanted += c * mild_sole_surface_area(sole)[i] * fmax(pressure, 0.0);
            }
        }
        expect_near("its bottom as a plate", force, wanted, 0.02 * wanted);
    }
    mild_sole_destroy(sole);
}

/* Ground that springs back is no grains: its share does not fall. */
TEST(test_springs) {
    MildMaterial m = grains();
    const double radius = 0.03, depth = 0.02;
    MildShape ball = surface_sphere(radius);
    MildSole *sole = surface_make(&ball, 1, 0.01);
    const double grainy = press(sole, &m, NULL, radius, depth);
    m.recovery = 1.0;
    const double springy = press(sole, &m, NULL, radius, depth);
    assert_true(springy > 1.3 * grainy);
    mild_sole_destroy(sole);
}

/* A body that turns in the ground, and comes out, gives no energy: what a rim does to an element
 * changes in each step. */
static double rolled(int number, double *scale) {
    enum { KNOTS = 7, PARTS = 60 };
    uint64_t random = (uint64_t)number * 7919u + 5;
    MildMaterial m = kit_material(&random);
    m.model = MILD_MODEL_MILD_MERGED;
    m.slip_length = kit_index(&random, 2) ? pow(10, kit_uniform(&random, -3.5, -1)) : 0.0;
    m.regain_length = pow(10, kit_uniform(&random, -4, -2));
    m.mu = kit_index(&random, 2) ? m.mu : 0.0;
    m.recovery = kit_index(&random, 3) ? 0.0 : m.recovery;
    MildShape shape = kit_index(&random, 2)
                          ? surface_sphere(kit_uniform(&random, 0.015, 0.05))
                          : surface_capsule(kit_uniform(&random, 0.01, 0.03), 0.04);
    MildSole *sole = surface_make(&shape, 1, kit_uniform(&random, 0.006, 0.02));
    double knot[KNOTS][4]; /* depth, x, pitch, roll */
    const double far = shape.size[0] + (shape.type == MILD_SHAPE_CAPSULE ? shape.size[1] : 0.0);
    for (int k = 0; k < KNOTS; k++) {
        knot[k][0] = kit_uniform(&random, -0.3, 1.0) * shape.size[0];
        knot[k][1] = kit_uniform(&random, -0.03, 0.03);
        knot[k][2] = kit_uniform(&random, -0.3, 0.3);
        knot[k][3] = 0.0;
    }
    knot[0][0] = -far - 0.01;
    Kit kit;
    kit_open(&kit, 1, sole, NULL, &m, 1e-3);
    const double given = kit_led_through(&kit, knot, KNOTS, PARTS, shape.size[0], scale);
    kit_close(&kit);
    mild_sole_destroy(sole);
    return given;
}

/* [-] What resists over what carries a face that leans by 0.3 along x, 8 mm deep, and slides with
 * that speed [m/s]. */
static double resists(const MildMaterial *m, MildSole *face, double speed) {
    Kit kit;
    kit_open(&kit, 1, face, NULL, m, 1e-3);
    const double c = cos(0.3), s = sin(0.3), down[6] = {0, 0, -0.02, 0, 0, 0};
    const double R[9] = {c, 0, s, 0, 1, 0, -s, 0, c}, along[6] = {speed, 0, 0, 0, 0, 0};
    double last[6] = {0, 0, -0.02, 0, 0, 0};
    memcpy(kit.input.rotation[0], R, sizeof R);
    kit.input.position[0][2] = -KIT_SOLE_Z * c;
    for (int i = 0; i < 800; i++) {
        kit_led(&kit, last, i < 400 ? down : along);
        kit.input.position[0][0] += i < 400 ? 0.0 : 1e-3 * speed;
        kit.input.position[0][2] -= i < 400 ? 2e-5 : 0.0;
    }
    const double *force = kit.result.foot[0].force;
    const double share = -force[0] / force[2] * (speed > 0 ? 1 : -1);
    kit_close(&kit);
    return share;
}

/* A face that moves into the ground is resisted by the tangent of its lean besides friction, one
 * that moves out of it is not (share.h). At 1 mm/s half of that is left. */
TEST(test_ploughs) {
    MildMaterial m = grains();
    Plate36 plate;
    const MildShape shape = surface_plate(5, 3, KIT_SOLE_Z, &plate);
    MildSole *face = surface_make(&shape, 1, KIT_PITCH);
    for (int merged = 0; merged < 2; merged++) {
        m.model = merged ? MILD_MODEL_MILD_MERGED : MILD_MODEL_MILD;
        m.mu = 0.2;
        m.slip_length = 0.0;
        const double without = resists(&m, face, -0.1);
        m.slip_length = 0.05;
        const double into = resists(&m, face, -0.1), out = resists(&m, face, 0.1);
        const double slow = resists(&m, face, -1e-3);
        expect_near("out of the ground", out, 0.2, 1e-6);
        expect_near("without slip", without, 0.2, 1e-6);
        expect_near("into the ground", into, 0.2 + tan(0.3) * 0.1 / 0.101, 1e-3 * into);
        expect_near("slowly", slow, 0.2 + tan(0.3) / 2, 1e-3 * slow);
    }
    mild_sole_destroy(face);
}

static int rolled_count = 200, rolled_first;

TEST(test_rolled) {
    kit_closed(rolled_first, rolled_count, rolled);
}

int main(int count, char **arguments) {
    if (count > 1) { /* ground_test_rim COUNT FIRST */
        rolled_count = atoi(arguments[1]);
        rolled_first = count > 2 ? atoi(arguments[2]) : 0;
        cmocka_set_test_filter("test_rolled");
    }
    return run_cases(NULL, NULL);
}
