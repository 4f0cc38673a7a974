/* mild_merged and slip-sinkage, held to closed forms and quadrature: the cones of one sole merge
 * (docs/model.md section 21), and slip takes the support away (section 22). */
#include "ground_kit.h"

#include "ground/law/models.h"
#include "ground/sole/sole.h"
#include "ground/step/state.h"

static const double pi = 3.14159265358979323846;

/* ---- soles ---- */

/* target: elements, 0: as the raster has them. */
static MildSole *disc_of(double radius, double pitch, int target) {
    enum { POINTS = 128 };
    double outline[2 * POINTS];
    for (int i = 0; i < POINTS; i++) {
        outline[2 * i] = radius * cos(2 * pi * i / POINTS);
        outline[2 * i + 1] = radius * sin(2 * pi * i / POINTS);
    }
    return kit_sole_of(outline, POINTS, pitch, target);
}

static MildSole *disc(double radius, double pitch) {
    return disc_of(radius, pitch, 0);
}

/* Numbers of grains: k0 = 1.895 MPa/m, kappa = 0.223 MPa/m; plastic, no bed, no mass. */
static MildMaterial grains(double shape) {
    MildMaterial m = mild_material_default();
    m.model = MILD_MODEL_MILD_MERGED;
    m.alpha = 1.047;
    m.nu = tan(m.alpha) / shape;
    m.k_pen = 1.895e6 * KIT_PITCH * KIT_PITCH;
    m.sigma_cone = 0.223e6 * cos(m.alpha);
    m.c_g = 0.0;
    m.k_drift = m.b_drift = 0.0;
    m.bed_depth = 1.0;
    return m;
}

/* [N] Force on a level sole at a depth in virgin ground. */
static double level_force(const MildSole *sole, const MildMaterial *m, double depth) {
    const Law law = law_of(m, mild_sole_pitch(sole), mild_sole_width(sole));
    double sum = 0.0;
    for (int i = 0; i < mild_sole_elements(sole); i++) {
        const SoleHeap heap = sole_heap(sole, i);
        const Law own = law_of_heap(law, heap.begin, heap.width);
        sum += law_force(&own, LAW_CONE | LAW_HEAP, depth);
    }
    return sum;
}

/* Equations 1 to 4 of the paper for a disc of that radius, integrated by the trapezoidal rule. */
static double paper_force(const MildMaterial *m, double radius, double area, double depth) {
    enum { PANELS = 20000 };
    const double k0 = m->k_pen / (KIT_PITCH * KIT_PITCH);
    double force = 0.0;
    for (int i = 0; i <= PANELS; i++) {
        const double u = depth * i / PANELS;
        const double left = fmax(radius - u * m->nu / tan(m->alpha), 0.0);
        const double flat = area * left * left / (radius * radius);
        const double cone = (area - flat) / cos(m->alpha);
        const double slope = k0 * flat + m->sigma_cone * cone;
        force += slope * (i % PANELS ? 1.0 : 0.5);
    }
    return force * depth / PANELS;
}

/* [-] Largest difference of the force on a disc from the paper's with its radius and an area. */
static double round_error(const MildSole *sole, double radius, double area) {
    const MildMaterial m = grains(0.312);
    double worst = 0.0;
    for (double depth = 0.0005; depth < 0.06; depth *= 1.25) {
        const double paper = paper_force(&m, radius, area, depth);
        worst = fmax(worst, fabs(level_force(sole, &m, depth) / paper - 1));
    }
    return worst;
}

/* [-] The largest error of discs whose pitch gives their elements the disc's area to the last
 * digit, held to the exact disc, its radius and its area. From `first` to `last` elements, each
 * time by 1/share more. */
static double area_error(int first, int last, int share) {
    const double radius = 0.06;
    double worst = 0.0;
    for (int n = first; n <= last; n += n / share) {
        MildSole *sole = disc_of(radius, radius * sqrt(pi / n), n);
        worst = fmax(worst, round_error(sole, radius, pi * radius * radius));
        mild_sole_destroy(sole);
    }
    return worst;
}

/* What is left below 193 elements is the edge of so coarse a raster. */
TEST(test_round_area) {
    expect_below("a disc of 30 elements", area_error(30, 30, 8), 0.025);
    expect_below("discs of 112 to 192 elements", area_error(112, 192, 8), 0.0135);
    expect_below("discs of 193 to 1000 elements", area_error(193, 1000, 8), 0.01);
}

/* The raster's error goes with the pitch; what is left of it is the law's own. */
TEST(test_round_fine) {
    const double pitch = 0.00125;
    MildSole *sole = disc(0.12, pitch);
    const double area = mild_sole_elements(sole) * pitch * pitch;
    expect_below("a disc of 29 000 elements", round_error(sole, 0.12, area), 0.0006);
    mild_sole_destroy(sole);
}

/* The heap on a rectangle a x b has the volume a^2 (3 b - a)/12 times the slope. */
TEST(test_heap) {
    static const double sides[][2] = {{0.039, 0.039}, {0.078, 0.0585}, {0.12, 0.06}, {0.2, 0.1}};
    for (int k = 0; k < 4; k++) {
        const double b = sides[k][0], a = sides[k][1], pitch = a / 3;
        MildSole *sole = kit_rectangle(b, a, pitch, 0);
        double sum = 0.0;
        for (int i = 0; i < mild_sole_elements(sole); i++) {
            sum += mild_sole_edge(sole)[i] * pitch * pitch;
        }
        const double volume = a * a * (3 * b - a) / 12;
        expect_near("heap", sum, volume, 0.02 * volume);
        mild_sole_destroy(sole);
    }
    MildSole *one = disc(0.01, 0.0195), *whole = mild_sole_concentric(one, NULL);
    assert_int_equal(mild_sole_elements(whole), mild_sole_elements(one));
    mild_sole_destroy(one);
    mild_sole_destroy(whole);
}

/* [kg] What moves with a sole at a depth: c_g phi rho nu times the sum over its elements of
 * s min(u/5, H), H = e tan(alpha)/nu with e the mean distance from the edge, and of tail s times
 * the depth beyond 5 H. */
static double moved_mass(const MildMaterial *m, const MildSole *sole, double depth, double tail) {
    const double area = mild_sole_pitch(sole) * mild_sole_pitch(sole);
    double sum = 0.0;
    for (int i = 0; i < mild_sole_elements(sole); i++) {
        const double heap = mild_sole_edge(sole)[i] * tan(m->alpha) / m->nu;
        sum += area * (fmin(depth / 5, heap) + tail * fmax(depth - 5 * heap, 0));
    }
    return m->c_g * m->phi * m->rho * m->nu * sum;
}

/* A plate strikes ground that has mass and no strength. With c_d = 1 the plate and what it has set
 * in motion, in the end all of its heap, have the momentum that it came with, until the heap over
 * its edge is whole. What that goes on with is lost where the plate is slowed by the rest, for soil
 * never pulls. */
TEST(test_momentum) {
    const double length = 0.12, width = 0.06, mass = 3.0, speed = 1.5;
    MildSole *sole = kit_rectangle(length, width, 0.005, 0);
    MildMaterial m = grains(0.3);
    m.k_pen = 1e-3;
    m.sigma_cone = 0.0;
    m.c_g = 20.0;
    m.c_d = 1.0;
    Kit kit;
    kit_open(&kit, 1, sole, NULL, &m, 1e-3);
    kit.input.velocity[0][2] = -speed;
    const double edge = 5 * 0.005 / 3 * tan(m.alpha) / m.nu; /* the corner element is p/3 from it */
    double kept = 0.0, before = 1.0, all = 0.0;
    for (int i = 0; i < 200; i++) {
        memset(kit.A, 0, sizeof kit.A);
        kit.A[14] = 1 / mass;
        memset(kit.input.free_velocity, 0, sizeof kit.input.free_velocity);
        kit.input.free_velocity[2] = kit.input.velocity[0][2];
        const double depth = -(kit.input.position[0][2] + KIT_SOLE_Z);
        kit_solve(&kit);
        const double w = -kit.result.velocity[2];
        const double middle = depth + kit.input.dt / 2 * w;
        const double momentum = (mass + moved_mass(&m, sole, middle, 0.02)) * w / (mass * speed);
        all = moved_mass(&m, sole, middle, 0);
        kept = middle < edge ? fmax(kept, fabs(momentum - 1)) : kept;
        assert_true(momentum < before + 1e-9);
        before = momentum;
        kit_advance(&kit);
    }
    kit_close(&kit);
    const double heap = width * width * (3 * length - width) / 12 * tan(m.alpha);
    expect_below("momentum until the heap over the edge is whole", kept, 1e-6);
    assert_true(before > 0.95);
    expect_near("mass of the heap", all / (m.c_g * m.phi * m.rho * heap), 1.0, 0.001);
    mild_sole_destroy(sole);
}

/* ---- steps led by hand: A = 0, so the foot has the twist that it is given ---- */

static void lead(Kit *kit, double forward, double down, double turn) {
    const double twist[6] = {forward, 0, -down, 0, turn, 0};
    memcpy(kit->input.free_velocity, twist, sizeof twist);
    memcpy(kit->input.velocity[0], twist, sizeof twist);
    kit_solve(kit);
}

/* Presses a foot to a depth in that many steps of its own. */
static void press_to(Kit *kit, double depth, int steps) {
    const double dt = kit->input.dt;
    const double now = -(kit->input.position[0][2] + KIT_SOLE_Z);
    for (int i = 0; i < steps; i++) {
        lead(kit, 0, (depth - now) / (steps * dt), 0);
        kit_advance(kit);
    }
}

enum { TILT_LENGTH = 120, TILT_WIDTH = 60 }; /* [mm] */

/* [rad] of the direction in which a sole of that tilt presses, from the vertical: 0.6 of the way
 * from the normal of the ground to that of the sole. */
static double presses(double tilt) {
    return atan2(0.6 * sin(tilt), 0.4 + 0.6 * cos(tilt));
}

/* [N], [N m] forward, up and about the middle of a tilted plate by the integral of cos(theta)
 * (kappa u + (k0 - kappa) min(u, T e)) over squares of 0.5 mm; e: distance to the nearest side.
 * depth: of the middle. */
static void tilted_plate(double tilt, double depth, double out[3]) {
    const double k0 = 1.895e6, kappa = 0.223e6, shape = 0.104, square = 0.5e-3;
    const double angle = presses(tilt);
    out[0] = out[1] = out[2] = 0.0;
    for (int i = 0; i < 2 * TILT_LENGTH; i++) {
        for (int j = 0; j < 2 * TILT_WIDTH; j++) {
            const double x = (i + 0.5) * square, y = (j + 0.5) * square;
            const double l = 1e-3 * TILT_LENGTH, w = 1e-3 * TILT_WIDTH;
            const double u = fmax(depth + (x - l / 2) * sin(tilt), 0.0);
            const double e = fmin(fmin(x, l - x), fmin(y, w - y));
            const double heap = (k0 - kappa) * fmin(u, shape * e);
            const double part = square * square * cos(tilt) * (kappa * u + heap);
            out[0] += sin(angle) * part;
            out[1] += cos(angle) * part;
            out[2] -= (x - l / 2) * cos(tilt - angle) * part;
        }
    }
}

/* A plate that is pressed straight down with a tilt [rad], until its middle is at a depth. */
static void press_tilted(double tilt, double depth, double out[3]) {
    MildSole *sole = kit_rectangle(1e-3 * TILT_LENGTH, 1e-3 * TILT_WIDTH, 0.005, 0);
    MildMaterial m = grains(0.104);
    m.regain_length = 1e-4; /* the share follows the depth */
    m.mu = 0.0;
    Kit kit;
    kit_open(&kit, 1, sole, NULL, &m, 1e-3);
    const double c = cos(tilt), s = sin(tilt);
    const double R[9] = {c, 0, s, 0, 1, 0, -s, 0, c};
    memcpy(kit.input.rotation[0], R, sizeof R);
    kit.input.position[0][2] = 0.5e-3 * TILT_LENGTH * fabs(s) - c * KIT_SOLE_Z;
    while (kit.input.position[0][2] + c * KIT_SOLE_Z > -depth) {
        lead(&kit, 0, 0.01, 0);
        kit_advance(&kit);
    }
    lead(&kit, 0, 0.0, 0);
    const double *f = kit.result.foot[0].force, arm[2] = {s * KIT_SOLE_Z, c * KIT_SOLE_Z};
    out[0] = f[0];
    out[1] = f[2];
    out[2] = kit.result.foot[0].torque[1] - (arm[1] * f[0] - arm[0] * f[2]); /* about its middle */
    const MildElements of = mild_scratch_elements(kit.scratch, 0);
    double sum[2] = {0, 0};
    for (int e = 0; e < mild_sole_elements(sole); e++) {
        sum[0] += of.tangent_x[e];
        sum[1] += of.normal[e];
    }
    assert_true(hypot(sum[0] - f[0], sum[1] - f[2]) < 1e-9 * f[2]);
    kit_close(&kit);
    mild_sole_destroy(sole);
}

/* A tilted plate presses with its projected area along a direction of its own. */
TEST(test_tilt) {
    static const double tilts[] = {0, 5, 8, 15, 30, -30, 30};
    static const double depths[] = {0.01, 0.01, 0.005, 0.008, 0.008, 0.015, 0.12};
    for (int t = 0; t < 7; t++) {
        const double tilt = tilts[t] * pi / 180;
        double got[3], wanted[3];
        press_tilted(tilt, depths[t], got);
        tilted_plate(tilt, depths[t], wanted);
        expect_near("up", got[1], wanted[1], 0.005 * wanted[1]);
        expect_near("forward", got[0] / got[1], tan(presses(tilt)), 1e-3);
        expect_near("moment", got[2], wanted[2], 0.015 * fabs(wanted[2]) + 1e-4 * got[1]);
    }
}

/* ---- slip ---- */

/* A plate dragged at constant depth: F/F0 = 1/(1 + s/j0), at any step, for both models. */
TEST(test_drag) {
    static const double steps[] = {0.25e-3, 1e-3, 2.5e-3, 5e-3};
    double worst = 0.0;
    for (int t = 0; t < 16; t++) {
        MildSole *sole = kit_rectangle(0.12, 0.06, 0.01, 0);
        MildMaterial m = grains(0.104);
        m.model = t / 4 % 2 ? MILD_MODEL_MILD : MILD_MODEL_MILD_MERGED;
        m.slip_length = 0.0019;
        m.slip_growth = t < 8 ? 0 : 0.08;
        Kit kit;
        kit_open(&kit, 1, sole, NULL, &m, steps[t % 4]);
        press_to(&kit, 0.02, 200);
        lead(&kit, 0, 0, 0);
        kit_advance(&kit);
        lead(&kit, 0, 0, 0);
        const double first = kit.result.foot[0].force[2];
        kit_advance(&kit);
        double slid = 0.0;
        while (slid < 0.05) {
            lead(&kit, 0.1, 0, 0);
            if (slid > 1e-4) {
                const double law = 1 / (1 + slid / (m.slip_length + 0.02 * m.slip_growth));
                worst = fmax(worst, fabs(kit.result.foot[0].force[2] / (first * law) - 1));
            }
            kit_advance(&kit);
            slid += 0.1 * kit.input.dt;
        }
        kit_close(&kit);
        mild_sole_destroy(sole);
    }
    expect_below("F/F0 against 1/(1 + s/(j0 + g u))", worst, 1e-9);
}

/* Fresh penetration gives the support back: 1 - lambda falls as exp(-da/u0), where u0 grows with
 * the depth as j0 does. Small steps: the share is held in each. */
TEST(test_regain) {
    for (int grows = 0; grows < 2; grows++) {
        MildSole *sole = kit_rectangle(0.12, 0.06, 0.01, 0);
        MildMaterial m = grains(0.104);
        m.slip_length = 0.0019;
        m.regain_length = 0.00068;
        m.slip_growth = grows ? 0.4 : 0;
        Kit kit;
        kit_open(&kit, 1, sole, NULL, &m, 1e-3);
        press_to(&kit, 0.02, 200);
        for (int i = 0; i < 40; i++) {
            lead(&kit, 0.1, 0, 0);
            kit_advance(&kit);
        }
        const double j0 = m.slip_length + 0.02 * m.slip_growth;
        const double lost = 1 - 1 / (1 + 0.004 / j0);
        double worst = 0.0, depth = 0.02, spent = 0.0;
        for (int i = 0; i < 2000; i++) {
            lead(&kit, 0, 0.001, 0);
            kit_advance(&kit);
            depth += 1e-6;
            spent += 1e-6 / (m.regain_length * (1 + depth * m.slip_growth / m.slip_length));
            const double wanted = (1 - lost * exp(-spent)) * level_force(sole, &m, depth);
            worst = i > 200 ? fmax(worst, fabs(kit.result.foot[0].force[2] / wanted - 1)) : worst;
        }
        expect_below("regained support", worst, 0.06); /* the elastic travel takes its part */
        kit_close(&kit);
        mild_sole_destroy(sole);
    }
}

/* ---- energy: closed motions with slip and tilt give nothing ---- */

static int closed_count = 300, closed_first, closed_plain;

/* The energy [J] that the ground gave over a motion from the air to the air through random heights,
 * places and tilts; and the work done on it, for a scale. */
static double closed_motion(int number, double *scale) {
    static const double steps[] = {0.25e-3, 1e-3, 2.5e-3, 5e-3};
    uint64_t random = (uint64_t)number * 7919u + 3;
    MildMaterial m = kit_material(&random);
    m.model = kit_index(&random, 4) ? MILD_MODEL_MILD_MERGED : MILD_MODEL_MILD;
    m.slip_length = kit_index(&random, 4) ? pow(10, kit_uniform(&random, -3.5, -1)) : 0.0;
    m.regain_length = pow(10, kit_uniform(&random, -4, -2));
    m.grip = kit_index(&random, 2) ? kit_uniform(&random, 0, 0.3) : 0.0;
    m.mu = kit_index(&random, 3) ? m.mu : 0.0;
    uint64_t own = random; /* the other draws stay */
    m.slip_growth = kit_index(&own, 2) ? kit_uniform(&own, 0, 1) : 0.0;
    if (closed_plain) {
        m.model = MILD_MODEL_MILD;
        m.slip_length = 0.0;
    }
    MildSole *sole = kit_plate(1 + kit_index(&random, 4), 1 + kit_index(&random, 3));
    enum { KNOTS = 9 };
    double knot[KNOTS][4]; /* z, x, pitch, roll */
    for (int k = 0; k < KNOTS; k++) {
        knot[k][0] = kit_uniform(&random, -0.003, 0.02);
        knot[k][1] = kit_uniform(&random, -0.01, 0.01) * kit_index(&random, 2);
        knot[k][2] = kit_uniform(&random, -0.2, 0.2) * kit_index(&random, 2);
        knot[k][3] = kit_uniform(&random, -0.2, 0.2) * kit_index(&random, 2);
    }
    knot[0][0] = -0.03; /* from the air to the air: nothing is stored at either end */
    knot[0][2] = knot[0][3] = 0.0;
    Kit kit;
    kit_open(&kit, 1, sole, NULL, &m, steps[kit_index(&random, 4)]);
    const int parts = 40 + kit_index(&random, 60); /* turns of 0.01 rad a step at most */
    const double given = kit_led_through(&kit, knot, KNOTS, parts, -KIT_SOLE_Z, scale);
    kit_close(&kit);
    mild_sole_destroy(sole);
    return given;
}

TEST(test_closed) {
    kit_closed(closed_first, closed_count, closed_motion);
}

/* Leads a foot by a way in one step; returns the work of the ground [J]. */
static double lead_way(Kit *kit, double forward, double down) {
    const double dt = kit->input.dt;
    const double twist[6] = {forward / dt, 0, -down / dt, 0, 0, 0};
    double before[6];
    memcpy(before, kit->input.velocity[0], sizeof before);
    memcpy(kit->input.free_velocity, twist, sizeof twist);
    kit_solve(kit);
    const double work = kit_work(kit, 0, before);
    kit_advance(kit);
    return work;
}

/* [J] Energy that the ground gives over a closed motion. A foot is pressed in; then, again and
 * again, it slips by 100 j0, is pressed on by three times u0 in a step, and is lifted. Worn ground
 * costs nothing to press, and the press restores it: the lift would give what nobody has paid for,
 * were the yield depth not put ahead of the element by what the share has grown. paid: [J] work of
 * the presses. The energy counts in the middles of the steps, and the way from one to the next is
 * the mean of two twists. */
static double pumped(int model, double *paid) {
    enum { CYCLES = 200, STEPS = 16 };
    /* The middles go by 0.4 mm down, ten times 0.01 mm up (in slow steps, because unloading ground
     * lags behind), 0.6 mm up and 0.6 mm down. */
    static const double down[STEPS] = {0.8e-3, -0.82e-3, 0.8e-3, -0.82e-3, 0.8e-3, -0.82e-3,
                                       0.8e-3, -0.82e-3, 0.8e-3, -0.82e-3, 0.8e-3, -1e-3,
                                       0,      0,        0.6e-3, 0};
    static const double forward[STEPS] = {[12] = 0.01, [13] = -0.01};
    MildMaterial m = grains(0.104);
    m.model = model;
    m.slip_length = 1e-4;
    m.regain_length = 1e-4;
    m.mu = 0.0;
    MildSole *sole = kit_rectangle(0.12, 0.06, 0.01, 0);
    Kit kit;
    kit_open(&kit, 1, sole, NULL, &m, 5e-3);
    double given = 0.0;
    *paid = 0.0;
    kit.input.position[0][2] += 0.001;
    for (int i = 0; i < 30; i++) {
        given += lead_way(&kit, 0, 0.0001);
    }
    for (int i = 0; i < CYCLES * STEPS; i++) {
        const double work = lead_way(&kit, forward[i % STEPS], down[i % STEPS]);
        given += work;
        *paid -= fmin(work, 0.0);
    }
    for (int i = 0; i < 30; i++) {
        given += lead_way(&kit, 0, -0.001);
    }
    kit_close(&kit);
    mild_sole_destroy(sole);
    return given;
}

TEST(test_pumped) {
    static const int models[] = {MILD_MODEL_MILD, MILD_MODEL_MILD_MERGED};
    for (int i = 0; i < 2; i++) {
        double work;
        const double given = pumped(models[i], &work);
        expect_below(mild_model_names[models[i]], given, 0.0);
    }
}

int main(int count, char **arguments) {
    if (count > 1) { /* ground_test_merged COUNT FIRST */
        closed_count = atoi(arguments[1]);
        closed_first = count > 2 ? atoi(arguments[2]) : 0;
        closed_plain = count > 3; /* of mild, for comparison */
        cmocka_set_test_filter("test_closed");
    }
    return run_cases(NULL, NULL);
}
