/* Element law, materials and static sinkage. */
#include "ground_kit.h"

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

TEST_MAIN(NULL, NULL)
