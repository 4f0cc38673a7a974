/* Element law, materials and static sinkage. */
#include "ground_kit.h"

#include "ground/law/begin.h"
#include "ground/law/impulse.h"
#include "ground/law/models.h"
#include "ground/law/remember.h"

/* S_flat and S_cone as the paper prints them, the flat one frozen at zero once the cone is
 * complete. */
static void areas(const MildMaterial *m, double u, double *flat, double *cone) {
    double pi = acos(-1.0), R = KIT_PITCH / sqrt(pi), r = fmax(R - m->nu * u / tan(m->alpha), 0.0);
    *flat = pi * r * r;
    *cone = (pi * R * R - *flat) / cos(m->alpha);
}

static void quadrature(const MildMaterial *m, double u, double *force, double *added_mass) {
    enum { PANELS = 4000 };
    double sum_flat = 0.0, sum_cone = 0.0, h = u / PANELS, area = KIT_PITCH * KIT_PITCH;
    for (int i = 0; i <= PANELS; i++) {
        double flat, cone, weight = (i == 0 || i == PANELS) ? 1.0 : (i % 2 ? 4.0 : 2.0);
        areas(m, i * h, &flat, &cone);
        sum_flat += weight * flat * h / 3.0;
        sum_cone += weight * cone * h / 3.0;
    }
    *force = m->k_pen / area * sum_flat + m->sigma_cone * sum_cone;
    *added_mass = m->c_g * m->phi * m->rho * m->nu * sum_flat;
}

TEST(test_quadrature) {
    uint64_t random = 1;
    double worst = 0.0, worst_slope = 0.0;
    for (int draw = 0; draw < 500; draw++) {
        MildMaterial m = kit_material(&random);
        m.passive = 0;
        double u = kit_uniform(&random, 0.0, 0.1), force, mass, h = 1e-6;
        quadrature(&m, u, &force, &mass);
        MildElementLaw law = mild_element_law(&m, KIT_PITCH, u),
                       up = mild_element_law(&m, KIT_PITCH, u + h);
        worst = fmax(worst, fabs(law.force - force) / (fabs(force) + 1e-6));
        worst = fmax(worst, fabs(law.added_mass - mass) / (fabs(mass) + 1e-6));
        if (u + h > m.bed_depth) {
            continue;
        }
        worst_slope =
            fmax(worst_slope, fabs((up.force - law.force) / h - law.stiffness) / law.stiffness);
        double rate = (up.added_mass - law.added_mass) / h;
        worst_slope = fmax(worst_slope, fabs(rate - law.added_mass_per_depth) /
                                            (fabs(m.c_g * m.rho * KIT_PITCH * KIT_PITCH) + 1e-9));
    }
    expect_below("law against quadrature", worst, 1e-6);
    expect_below("slopes", worst_slope, 2e-3);
}

TEST(test_vector) {
    MildMaterial m = mild_material_default();
    m.k_pen = 380.25;
    m.sigma_cone = 0.15e6;
    m.alpha = acos(-1.0) / 3.0;
    m.nu = 2.0;
    const double depth[4] = {0.005, 0.010, 0.020, 0.040}, force[4] = {1.325, 1.986, 3.127, 5.408};
    for (int i = 0; i < 4; i++) {
        expect_entry("force", i, mild_element_law(&m, KIT_PITCH, depth[i]).force, force[i], 6e-4);
    }
    expect_near("late", mild_element_law(&m, KIT_PITCH, 0.03).stiffness, 114.08, 6e-3);
    expect_near("at once", mild_element_law(&m, KIT_PITCH, 0.0).stiffness, 380.25, 1e-9);
    expect_near("tiny", mild_element_law(&m, KIT_PITCH, 1e-12).force, 380.25e-12, 1e-18);
    assert_true(mild_element_law(&m, KIT_PITCH, 0.0).force == 0.0);
}

TEST(test_firm_bed) {
    MildMaterial m = mild_material_default();
    const double above = mild_element_law(&m, KIT_PITCH, m.bed_depth).force;
    const double below = mild_element_law(&m, KIT_PITCH, m.bed_depth + 0.001).force;
    assert_true(below - above > 15.0);
}

/* The numbers of the presets as the specification and docs/model.md section 10 give them, and how
 * deep a robot of 40 kg sinks on two feet and on one; foams and rubber weigh grams and have no
 * added mass. */
TEST(test_presets) {
    static const struct {
        const char *name;
        double k_pen, sigma_cone, alpha, nu, c_g, c_d, phi, recovery;
        double two, one, tolerance; /* [mm] */
    } table[] = {{"rubber", 1400, 0.24e6, 1.310, 0.8, 0, 1, 0.57, 1, 1.9, 3.8, 0.1},
                 {"foam60", 850, 0.20e6, 1.20, 1.2, 0, 1, 0.57, 1, 3.3, 7.7, 0.1},
                 {"foam45", 480, 0.17e6, 1.10, 1.6, 0, 1, 0.57, 1, 8, 25, 0.5},
                 {"foam28", 190, 0.13e6, 1.047, 2.0, 0, 1, 0.57, 1, 23, 49, 0.6},
                 {"foam25", 150, 0.11e6, 1.047, 2.0, 0, 1, 0.57, 1, 28, 58, 0.6},
                 {"grass", 550, 0.24e6, 1.10, 1.6, 0.5, 1, 0.50, 0.5, 6, 17.5, 0.5},
                 {"sand_loose", 380, 0.15e6, 1.047, 2.0, 2.7, 17.2, 0.57, 0, 15, 37, 0.5},
                 {"sand_dense", 700, 0.24e6, 1.047, 1.6, 2.7, 17.2, 0.62, 0, 5, 17, 0.5}};
    const double weight = 40.0 * KIT_GRAVITY;
    MildSole *sole = kit_sole(0, 77);
    MildMaterial m;
    assert_true(mild_material_preset_count() > PAPER_PRESETS);
    for (int i = 0; i < PAPER_PRESETS; i++) {
        const MildMaterial of_paper = kit_preset(table[i].name);
        MildError error = {0};
        assert_string_equal(mild_material_preset_name(i), table[i].name);
        assert_true(mild_material_preset(table[i].name, &m));
        expect_good(mild_material_check(&m, &error) == MILD_OK, &error);
        assert_true(of_paper.k_pen == table[i].k_pen && of_paper.sigma_cone == table[i].sigma_cone);
        assert_true(m.model == (m.recovery > 0 ? MILD_MODEL_MILD : MILD_MODEL_MILD_MERGED));
        assert_true(m.recovery > 0
                        ? m.slip_length == 0
                        : m.slip_length == 1.4e-3 && m.slip_growth == 0.07 && m.grip == 0.123);
        assert_true(m.alpha == table[i].alpha && m.nu == table[i].nu);
        assert_true(m.c_g == table[i].c_g && m.c_d == table[i].c_d && m.phi == table[i].phi);
        assert_true(m.recovery == table[i].recovery && m.rho == 1000 && m.passive == 1);
        assert_true(m.mu >= 0.2 && m.mu <= 1.3); /* the paper's range */
        expect_near("on two feet", 1e3 * mild_sole_sinkage(sole, &of_paper, weight / 2),
                    table[i].two, table[i].tolerance);
        expect_near("on one foot", 1e3 * mild_sole_sinkage(sole, &of_paper, weight), table[i].one,
                    table[i].tolerance);
    }
    assert_false(mild_material_preset("rigid", &m));
    assert_null(mild_material_preset_name(mild_material_preset_count()));
    mild_sole_destroy(sole);
}

/* Functions of an element's step, one at a time: the slope of the impulse against differences, and
 * hand-worked numbers for constants and for what the step remembers. The forces themselves are held
 * to the dense reference of test_solver.c. */

/* A cone of 20 mm: at 10 mm a quarter of the flat area is left. */
static Law cone(void) {
    return (Law){.cone_depth = 0.02, .inverse_cone_depth = 50.0, .bed_depth = INFINITY};
}

/* ---- random elements ---- */

static const double steps[3] = {0.25e-3, 1e-3, 5e-3};

/* An element at the start of a step, of any model, that moved before. */
static Element random_element(uint64_t *random, int *curves, double *dt) {
    static const MildModel models[4] = {MILD_MODEL_MILD, MILD_MODEL_MILD, MILD_MODEL_BEKKER,
                                        MILD_MODEL_HUNT_CROSSLEY};
    MildMaterial m = kit_material(random);
    m.model = (int)models[kit_index(random, 4)];
    m.exponent = kit_uniform(random, 0.5, 2.0);
    m.bed_depth = kit_index(random, 5) ? 1.0 : 0.012;
    Element e = {.law = law_of(&m, KIT_PITCH, 0.1),
                 .recovery = m.recovery,
                 .mu = m.mu,
                 .k_drift = m.k_drift,
                 .b_drift = m.b_drift,
                 .depth = kit_uniform(random, -0.001, 0.02)};
    *curves = law_curves(&e.law);
    *dt = steps[kit_index(random, 3)];
    const double now = kit_uniform(random, -0.5, 0.7);
    const double middle = e.depth - *dt / 2 * now;
    ElementMemory memory = {.middle = kit_index(random, 2) ? fmax(middle, 0.0) : 0.0,
                            .drift = kit_uniform(random, 0.0, 0.1),
                            .held_x = kit_uniform(random, -0.2, 0.2),
                            .held_y = kit_uniform(random, -0.2, 0.2),
                            .held_stiffness = kit_uniform(random, 0.0, 3e4)};
    memory.depth_max = kit_index(random, 2) ? fmax(middle, 0.0) + kit_uniform(random, 0.0, 0.005)
                                            : fmax(middle, 0.0);
    memory.front_speed = kit_index(random, 2) ? fmax(now, 0.0) : 0.0;
    e.exit_drag = law_exit_drag(&e.law);
    e.entry_drag = law_entry_drag(&e.law);
    element_begin(&e, &memory, *curves, *dt, 1 / *dt, now);
    element_drag(&e, *curves, *dt, *dt * KIT_GRAVITY);
    return e;
}

/* Bool: the slope is that of the function, whose values at -h, 0, h these are. At a kink it lies
 * between those of both sides. worst: relative to `scale`, away from kinks. */
static int slope_fits(double slope, double before, double here, double after, double h,
                      double scale, double *worst) {
    const double left = (here - before) / h, right = (after - here) / h;
    const double miss = fabs(slope - (after - before) / (2 * h));
    if (fabs(left - right) > 1e-3 * scale) {
        return slope > fmin(left, right) - 1e-3 * scale && slope < fmax(left, right) + 1e-3 * scale;
    }
    *worst = fmax(*worst, miss / scale);
    return miss < 1e-3 * scale;
}

TEST(test_slope_of_the_impulse) {
    uint64_t random = 1;
    double worst = 0.0;
    int loaded = 0;
    for (int n = 0; n < 20000; n++) {
        int curves;
        double dt, value[3], slope = 0.0;
        const Element e = random_element(&random, &curves, &dt);
        const double w = kit_uniform(&random, -0.7, 0.7), h = 1e-7;
        for (int k = 0; k < 3; k++) {
            const Impulse i = element_impulse(&e, curves, 1, dt, w + (k - 1) * h);
            value[k] = i.value;
            slope = k == 1 ? i.slope : slope;
        }
        assert_true(value[0] >= 0.0 && value[1] >= value[0] * (1 - 1e-12) &&
                    value[2] >= value[1] * (1 - 1e-12));
        loaded += value[1] > 0.0;
        const double scale =
            1e-6 + slope + dt * dt / 2 * (e.unload_stiffness + law_slope(&e.law, curves, 0.0));
        if (!slope_fits(slope, value[0], value[1], value[2], h, scale, &worst)) {
            fail_msg("element %d at %.3f m/s: slope %g, differences %g and %g", n, w, slope,
                     (value[1] - value[0]) / h, (value[2] - value[1]) / h);
        }
    }
    assert_true(loaded > 8000);
}

/* ---- terms ---- */

/* dt T k = 1e-3 x 5e-3 x 4e4 = 0.2 kg, by the speed at which the ground is left. */
TEST(test_lag) {
    const Element e = {.unload_stiffness = 4e4, .entry_speed = 0.1};
    const double dt = 1e-3, mass = 0.2;
    assert_true(lag_impulse(&e, dt, -0.09).value == 0.0 && lag_impulse(&e, dt, 0.3).slope == 0.0);
    const Impulse far = lag_impulse(&e, dt, -0.2), near = lag_impulse(&e, dt, -0.1 - 1e-6);
    expect_near("far", far.value, mass * (-0.1 + 1e-6), 1e-15);
    expect_near("slope", far.slope, mass, 1e-15);
    expect_near("near", near.value, -mass * 1e-12 / (2 * 2e-6), 1e-15);
    expect_near("slope", near.slope, mass / 2, 1e-6);
}

/* ---- begin ---- */

/* Springs of 1000 N/m: 10 mm deep 10 N. recovery 0.5 springs back over 5 mm, so at 2000 N/m; 0 over
 * the least elastic travel of 0.1 mm; 1 along the law itself. */
TEST(test_unloading_line) {
    static const double recovery[3] = {0.5, 0.0, 1.0}, stiffness[3] = {2e3, 1e5, 1e3},
                        zero[3] = {0.005, 0.0099, 0.0};
    for (int i = 0; i < 3; i++) {
        Element e = {.recovery = recovery[i],
                     .yield_depth = 0.01,
                     .law = {.line_stiffness = 1e3, .bed_depth = INFINITY}};
        element_unloading_line(&e, LAW_LINE, 10.0);
        expect_near("stiffness", e.unload_stiffness, stiffness[i], 1e-6);
        expect_near("zero", e.zero_depth, zero[i], 1e-12);
    }
    /* 1 mm in a bed of 20000 N/m at 9 mm: 30 N, and never flatter than bed and springs */
    Element e = {.recovery = 1.0,
                 .yield_depth = 0.01,
                 .law = {.line_stiffness = 1e3, .bed_depth = 0.009, .bed_stiffness = 2e4}};
    element_unloading_line(&e, LAW_LINE, 30.0);
    expect_near("bed", e.unload_stiffness, 2.1e4, 1e-6);
    expect_near("zero", e.zero_depth, 0.01 - 30.0 / 2.1e4, 1e-12);
}

/* r = 0.01 N s, 0.02 kg of damping, nothing held: c = r 250 = 2.5 kg. At 2 mm/s along (0.6, 0.8)
 * 0.005 N s, half of the bound; at 40 mm/s it slides. */
TEST(test_friction) {
    const Element e = {.damping = 0.02};
    const Friction slow = friction_impulse(&e, 0.01, 0.5, 0.0012, 0.0016);
    expect_near("x", slow.x, -0.0012 * 2.52, 1e-15);
    expect_near("y", slow.y, -0.0016 * 2.52, 1e-15);
    const Friction fast = friction_impulse(&e, 0.01, 0.5, 0.024, 0.032);
    expect_near("x", fast.x, -0.006 - 0.024 * 0.02, 1e-15);
    expect_near("y", fast.y, -0.008 - 0.032 * 0.02, 1e-15);
    const Element held = {.hold_x = 0.004, .hold_stiffness = 1.0};
    const Friction rest = friction_impulse(&held, 0.01, 0.5, 0.0, 0.0);
    expect_near("x", rest.x, 0.004, 0.0);
    expect_near("y", rest.y, 0.0, 0.0);
    expect_near("stiffness", rest.fall_xx, 3.5, 1e-12);
}

/* The slopes of a first step: with nothing held those of a fixed share of t, so that the slope
 * along v times v is I; with more than half of the bound held against v those of sliding. */
TEST(test_friction_begins) {
    const double vx = 0.024, vy = 0.032;
    const Element e = {.damping = 0.02};
    const Friction first = friction_step(&e, 0.01, 0.5, 1, vx, vy);
    const Friction slides = friction_impulse(&e, 0.01, 0.5, vx, vy);
    expect_near("x", first.x, slides.x, 0.0);
    expect_near("along", first.fall_xx * vx + first.fall_xy * vy, -first.x, 1e-15);
    expect_near("along", first.fall_xy * vx + first.fall_yy * vy, -first.y, 1e-15);
    expect_near("sliding", slides.fall_xx * vx + slides.fall_xy * vy, 0.02 * vx, 1e-15);
    for (int more = 0; more < 2; more++) {
        const double f = more ? 0.0051 : 0.0049;
        const Element held = {.hold_x = -0.6 * f, .hold_y = -0.8 * f, .hold_stiffness = 1.0};
        const Friction begun = friction_step(&held, 0.01, 0.5, 1, vx, vy);
        const Friction plain = friction_impulse(&held, 0.01, 0.5, vx, vy);
        assert_true((begun.fall_xx == plain.fall_xx) == more);
        assert_true(begun.rise_x == plain.rise_x);
    }
}

/* Weak ground, drag alone: V goes to 0.3 h where the foot stops; F = 0.01 of the drag at h: to 0.4
 * h; much F: to 0.75 h, a uniform stop. V(w) is (h + w)/2 + (stop - 1/2) (h - w)^2/h. */
TEST(test_drag) {
    static const double force[3] = {0.0, 0.01, 5.0}, stop[3] = {0.3, 0.4, 0.75};
    for (int i = 0; i < 3; i++) {
        const double rate = 40.0, h = 0.5; /* (c_d - 1) m_a' 40 kg/m: 10 N at 0.5 m/s */
        Element e = {.law = cone(), .depth = 0.002, .middle = 0.0, .entry_speed = h};
        e.law.line_stiffness = 0.0;
        e.law.flat_stiffness = 2 * force[i] * rate * h * h / 0.002; /* F half way to u0 */
        e.entry_drag = rate / 2;
        element_drag(&e, LAW_CONE, 1e-3, 0.0);
        expect_near("stop", 0.5 + e.stop_drag * h / rate, stop[i], 1e-9);
        expect_near("speed", e.entry_speed, h, 1e-15);
        expect_near("growth", e.stop_growth, law_moved(&e.law, LAW_CONE, 0.002), 1e-18);
    }
    /* free fall over 3 mm of way to the front adds 2 g 3 mm to h^2 */
    Element e = {.law = cone(),
                 .depth = 0.005,
                 .middle = 0.001,
                 .yield_depth = 0.004,
                 .entry_speed = 0.6,
                 .entry_drag = 20.0};
    element_drag(&e, LAW_CONE, 1e-3, 1e-3 * KIT_GRAVITY);
    expect_near("faster", e.entry_speed, sqrt(0.36 + 2 * KIT_GRAVITY * 0.003), 1e-12);
    expect_near("growth", e.stop_growth,
                law_moved(&e.law, LAW_CONE, 0.005) - law_moved(&e.law, LAW_CONE, 0.004), 1e-18);
    e.entry_speed = 0.6, e.depth = 0.0037; /* 0.4 mm to the front; half a step leads 0.3 mm on */
    element_drag(&e, LAW_CONE, 1e-3, 1e-3 * KIT_GRAVITY);
    assert_true(e.entry_speed == 0.6 && e.stop_drag == 0.0 && e.stop_growth == 0.0);
}

/* Negative added mass and drag, half open cone at 10 mm, where 7/8 of 20/3 mm are recruited: what
 * joins at 0.3 m/s beyond the front, and drag at 0.2 m/s over the step. */
TEST(test_explicit) {
    Element e = {.law = cone(), .yield_depth = 0.01, .front_speed = 0.1, .entry_speed = 0.2};
    e.law.mass_rate = -60.0;
    expect_near("mass", element_explicit(&e, LAW_CONE, 1e-3, 0.4), -60.0 * 0.02 / 3.0 * 7 / 8 * 0.3,
                1e-15);
    e.law.mass_rate = 60.0;
    e.law.drag_rate = -80.0;
    expect_near("drag", element_explicit(&e, LAW_CONE, 1e-3, 0.4), -80.0 * 0.25 * 1e-3 * 0.04,
                1e-18);
    e.law.drag_rate = 80.0;
    assert_true(element_explicit(&e, LAW_CONE, 1e-3, 0.4) == 0.0);
}

/* ---- the end of a step ---- */

/* An element goes down at 0.4 m/s and up at 0.1 m/s after: the impulse 0.05 N s moves the mass 0.1
 * kg, 8 mJ at the entry. On 1000 N/m springs, 1 mm deep, the rest of the way x is that of 8 mJ =
 * 1 N x + 500 N/m x^2. */
TEST(test_peak) {
    Element e = {.law = {.line_stiffness = 1e3, .bed_depth = INFINITY},
                 .recovery = 1.0,
                 .middle = 0.001,
                 .yield_depth = 0.001,
                 .virgin_depth = 0.001,
                 .zero_depth = 0.001,
                 .unload_stiffness = 1e3,
                 .entry_speed = 0.4};
    const double way = (sqrt(1.0 + 2 * 1e3 * 8e-3) - 1.0) / 1e3, deepest = 0.001 + way;
    const double middle = 0.0005; /* already on its way up */
    expect_near("peak", element_peak(&e, LAW_LINE, 0.05, -0.1, middle), deepest, 1e-12);
    e.recovery = 0.0; /* half of the way beyond */
    expect_near("plastic", element_peak(&e, LAW_LINE, 0.05, -0.1, middle), (deepest + middle) / 2,
                1e-12);
    e.recovery = 1.0;
    assert_true(element_peak(&e, LAW_LINE, 0.05, 0.1, middle) == middle); /* does not turn */
    assert_true(element_peak(&e, LAW_LINE, 0.0, -0.1, middle) == middle); /* nothing turned it */
    /* it still has to go down the unloading line from 0.6 to 1 mm: (0.4^2 - 0) mm^2 500 N/m */
    e.middle = 0.0006, e.zero_depth = 0.0006;
    const double left = 8e-3 - 500.0 * 0.16e-6;
    expect_near("line", element_peak(&e, LAW_LINE, 0.05, -0.1, middle),
                0.001 + (sqrt(1.0 + 2 * 1e3 * left) - 1.0) / 1e3, 1e-12);
    /* the deeper end is the new one: the little energy at 0.1 m/s, 0.5 mJ, counts from there */
    e.middle = 0.001, e.zero_depth = 0.001;
    const double force = 2.0;
    expect_near("after", element_peak(&e, LAW_LINE, 0.05, -0.1, 0.002),
                0.002 + (sqrt(force * force + 2 * 1e3 * 0.5e-3) - force) / 1e3, 1e-12);
    /* the bed's stiffness counts: 1 N + 20 N beyond 1 mm */
    e.law.bed_depth = 0.0, e.law.bed_stiffness = 2e4;
    expect_near("bed", element_peak(&e, LAW_LINE, 0.05, -0.1, middle),
                0.001 + (sqrt(21.0 * 21.0 + 2 * 2.1e4 * 8e-3) - 21.0) / 2.1e4, 1e-12);
}

/* Nothing but drag, at its mean on the way, half of c v^2 with a quarter of the area still flat:
 * M v^2/2 = c/4 v^2/2 x, so x = 4 M/c = 4 x 0.1/80. */
TEST(test_peak_of_drag) {
    Element e = {.law = cone(),
                 .recovery = 1.0,
                 .middle = 0.01,
                 .yield_depth = 0.01,
                 .virgin_depth = 0.01,
                 .zero_depth = 0.01,
                 .entry_speed = 0.4};
    e.law.drag_rate = 80.0;
    expect_near("drag", element_peak(&e, LAW_CONE, 0.05, -0.1, 0.0), 0.01 + 0.005, 1e-12);
    /* elastic ground: F = 500 N/m u, exponent 1 */
    e.law = (Law){.elastic_force = 5.0, .elastic_exponent = 1.0, .bed_depth = INFINITY};
    expect_near("elastic", element_peak(&e, LAW_ELASTIC, 0.05, -0.1, 0.0),
                0.01 + (sqrt(25.0 + 2 * 500.0 * 8e-3) - 5.0) / 500.0, 1e-9);
}

static ElementMemory remembered(const Element *e, const ElementMemory *memory, double normal,
                                double vx, double speed, int stays) {
    return element_remember(e, memory, 1e-3, 1e3, normal, vx, 0.0, speed, stays);
}

TEST(test_remember) {
    Element e = {.depth = 0.01, .yield_depth = 0.0105, .virgin_depth = 0.0105, .yield_speed = 1.0};
    ElementMemory memory = {.depth_max = 0.0105, .drift = 0.02, .pending_x = 6e-6};
    ElementMemory after =
        remembered(&e, &memory, 0.0, 0.1, 0.4, 1); /* 0.2 mm on: not at the yield */
    expect_near("deepest", after.depth_max, 0.0105, 0.0);
    expect_near("middle", after.middle, 0.0102, 1e-17);
    expect_near("drift", after.drift, 0.02 + 106e-6, 1e-15);
    assert_true(after.pending_x == 0.0 && after.front_speed == 0.0);
    after = remembered(&e, &memory, 0.0, 0.003, 1.6, 1); /* 0.8 mm on */
    expect_near("deepest", after.depth_max, 0.0108, 1e-17);
    expect_near("middle", after.middle, 0.0108, 1e-17);
    expect_near("waits", after.drift, 0.02, 0.0); /* 9 um is jitter */
    expect_near("pending", after.pending_x, 9e-6, 1e-18);
    expect_near("joins", after.front_speed, 0.6, 1e-15); /* the front was led by nobody */
    e.front_speed = 1.1;
    expect_near("leads", remembered(&e, &memory, 0.0, 0.0, 1.6, 1).front_speed, 1.6, 0.0);
    memory.drift = 0.0999, e.front_speed = 1.0;
    expect_near("most", remembered(&e, &memory, 0.0, 0.5, 0.0, 1).drift, 0.1, 0.0);
    after = remembered(&e, &memory, 0.0, 0.5, 1.6, 0); /* lifted: all but the way is forgotten */
    assert_true(after.depth_max == 0.0 && after.drift == 0.0 && after.front_speed == 0.0 &&
                after.pending_x == 0.0 && after.held_x == 0.0 && after.held_stiffness == 0.0);
    expect_near("middle", after.middle, 0.0108, 1e-17);
}

/* 2 mN s held less 1 kg x 0.5 mm/s: 1.5 N, within 0.5 x 4 mN s; a bound of 1 mN s leaves 1 N. */
TEST(test_remember_friction) {
    const Element e = {.depth = 0.01, .mu = 0.5, .hold_x = 2e-3, .hold_stiffness = 1.0};
    const ElementMemory memory = {0};
    ElementMemory after = remembered(&e, &memory, 4e-3, 0.5e-3, 0.0, 1);
    expect_near("held", after.held_x, 1.5, 1e-12);
    expect_near("stiffness", after.held_stiffness, 1e6, 1e-6);
    after = remembered(&e, &memory, 2e-3, 0.5e-3, 0.0, 1);
    expect_near("bound", after.held_x, 1.0, 1e-12);
    assert_true(after.held_y == 0.0);
}

TEST_MAIN(NULL, NULL)
