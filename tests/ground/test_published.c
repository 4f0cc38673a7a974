/* The ground against published curves: impact, kinetic energy over depth, scaling of impact depth,
 * pressure and sinkage, resistive force theory. Every drop runs through the contact solver.
 * docs/model.md, section 15.
 *
 * Katsuragi and Durian 2007, Nature Physics 3, 420: "Unified force law for granular impact
 * cratering". Uehara, Ambroso, Ojha and Durian 2003, Physical Review Letters 90, 194301: "Low-speed
 * impact craters in loose granular media".  Wong 2008, Theory of Ground Vehicles, 4th ed.,
 * table 2.3 (Bekker's parameters).  Li, Zhang and Goldman 2013, Science 339, 1408: "A terradynamics
 * of legged locomotion on granular media".  Choi et al. 2023, Science Robotics 8, eade2256:
 * "Learning quadrupedal locomotion on deformable terrain". */
#include "ground_kit.h"

static double square(double x) {
    return x * x;
}

/* ---- a body that falls straight down ---- */

enum { TRACE_MAX = 200000 };
static double trace_depth[TRACE_MAX], trace_energy[TRACE_MAX]; /* [m], [J/kg]: w^2/2 */
static int trace_count;

/* Meets the ground at `speed`; returns the depth of its first stop and leaves the trace. */
static double drop(const MildMaterial *m, MildSole *sole, double mass, double speed, double dt) {
    Kit kit;
    kit_open(&kit, 1, sole, NULL, m, dt);
    kit.mass[0] = mass;
    kit.inertia[0] = mass;
    kit.input.velocity[0][2] = -speed;
    trace_count = 0;
    double depth = 0.0, start = kit.input.position[0][2];
    while (kit.input.velocity[0][2] < 0.0 && trace_count < TRACE_MAX) {
        double before = depth;
        kit_step(&kit, NULL);
        depth = start - kit.input.position[0][2];
        trace_depth[trace_count] =
            0.5 * (before + depth); /* the new speed is that of the step's way */
        trace_energy[trace_count++] = 0.5 * square(kit.input.velocity[0][2]);
        depth = fmax(depth, before);
    }
    kit_close(&kit);
    return depth;
}

/* ---- Katsuragi and Durian ---- */

typedef struct {
    double d1, k, mass; /* [m], [N/m], [kg] */
} Durian;

/* Of M dv/dt = M g - k z - (M/d1) v^2, per kilogram: E = (E0 - A) exp(-2 z/d1) + A + B z. */
static double durian_energy(const Durian *p, double energy, double z) {
    double B = -0.5 * p->k * p->d1 / p->mass,
           A = 0.5 * KIT_GRAVITY * p->d1 + 0.25 * p->k * p->d1 * p->d1 / p->mass;
    return (energy - A) * exp(-2.0 * z / p->d1) + A + B * z;
}

/* The same with the added mass m_a = m' z that carries the drag c_d m' v^2: with x = M + m' z and n
 * = 2 c_d d(E x^n)/dz = (M g - k z) x^(n-1) integrates in closed form; the limit c_d -> infinity at
 * constant c_d m' = M/d1 is the line above. */
static double added_mass_energy(const Durian *p, double c_d, double energy, double z) {
    double rate = p->mass / (p->d1 * c_d), n = 2.0 * c_d, x = 1.0 + rate * z / p->mass,
           power = pow(x, -n);
    double a = p->mass * (KIT_GRAVITY + p->k / rate) / (rate * n),
           b = p->mass * p->k / (rate * rate * (n + 1.0));
    return energy * power + a * (1.0 - power) - b * (x - power);
}

/* kappa = k_pen makes F_g = k_pen z; a flat cone (nu/tan(alpha) small) keeps m_a' = c_g phi rho nu
 * s constant. */
static MildMaterial durian_material(const Durian *p, double edge, double c_d) {
    MildMaterial m = kit_preset("sand_loose");
    m.model = MILD_MODEL_CON_CONE; /* one cone under the whole body */
    m.alpha = 1.5;
    m.nu = 0.1;
    m.k_pen = p->k;
    m.sigma_cone = p->k * cos(m.alpha) / (edge * edge);
    m.c_d = c_d;
    m.c_g = 1.0;
    m.phi = 0.5;
    m.rho = p->mass / (p->d1 * c_d) / (m.c_g * m.phi * m.nu * edge * edge);
    m.bed_depth = 10.0;
    return m;
}

TEST(test_durian) {
    static const double drag[2] = {100.0, 17.2}, speed[3] = {0.7, 2.0, 4.0};
    const double edge = 1.0; /* u_f is 80 m: the flat area stays */
    Durian p = {.d1 = 0.1, .k = 4000.0, .mass = 20.0};
    MildSole *sole = kit_rectangle(edge, edge, edge, 1);
    MildError error = {0};
    for (int c = 0; c < 2; c++) {
        double worst = 0.0, apart = 0.0;
        MildMaterial m = durian_material(&p, edge, drag[c]);
        assert_int_equal(mild_material_check(&m, &error), MILD_OK);
        for (int v = 0; v < 3; v++) {
            double start = 0.5 * square(speed[v]);
            drop(&m, sole, p.mass, speed[v], 2e-5);
            for (int i = 0; i < trace_count; i++) {
                double z = trace_depth[i], closed = added_mass_energy(&p, drag[c], start, z);
                worst = fmax(worst, fabs(trace_energy[i] - closed) / start);
                apart = fmax(apart, fabs(trace_energy[i] - durian_energy(&p, start, z)) / start);
            }
        }
        expect_below("energy against the closed form with added mass, by K0", worst, 0.002);
        expect_below("against the published one, without", apart, c ? 0.05 : 0.01);
    }
    mild_sole_destroy(sole);
}

/* ---- Uehara ---- */

/* Depth of a cube of edge D and density rho that falls from rest, H from there to where it stops.
 */
typedef struct {
    double edge, density, height; /* [m], [kg/m^3], [m] above the ground */
} Cube;

static double cube_stop(const MildMaterial *m, const Cube *cube, int side, double *total) {
    MildSole *sole =
        side ? kit_plate(side, side) : kit_rectangle(cube->edge, cube->edge, cube->edge, 1);
    double mass = cube->density * cube->edge * cube->edge * cube->edge;
    double depth = drop(m, sole, mass, sqrt(2.0 * KIT_GRAVITY * cube->height), 2e-5);
    mild_sole_destroy(sole);
    *total = cube->height + depth;
    return depth;
}

/* Exponents of depth in the total drop H, the density and the edge, the other two held. H is the
 * sum of the height and the depth itself, so a change of density or edge is divided by the change
 * of H that it brings. */
static void exponents(const MildMaterial *m, double edge, int side, double density, double height,
                      double found[3]) {
    Cube cube = {edge, density, height}, change[3] = {{edge, density, 8 * height},
                                                      {edge, 2 * density, height},
                                                      {2 * edge, density, height}};
    double H, H1, depth = cube_stop(m, &cube, side, &H);
    for (int i = 0; i < 3; i++) {
        double changed = cube_stop(m, &change[i], i == 2 ? 2 * side : side, &H1),
               rate = log(changed / depth), far = log(H1 / H);
        found[i] = i == 0 ? rate / far : (rate - found[0] * far) / log(2.0);
    }
}

/* Force of the cone alone while it opens, u << u_f: F = kappa u^2/u_f, work kappa u^3/(3 u_f) = M g
 * H. With M ~ rho D^3, kappa ~ D^2 and u_f ~ D (one cone under the body) the depth goes as
 * rho^(1/3) D^(2/3) H^(1/3). */
TEST(test_uehara) {
    MildMaterial cone = kit_preset("sand_loose");
    cone.model = MILD_MODEL_CON_CONE;
    cone.c_g = 0.0;
    cone.alpha = 1.5;
    cone.nu = 0.1;
    cone.sigma_cone = 1e6;
    cone.k_pen = 1.0;
    cone.bed_depth = 10.0;
    double found[3], H, H8, edge = 0.05, kappa = cone.sigma_cone * edge * edge / cos(cone.alpha),
                            full = edge / sqrt(acos(-1.0)) * tan(cone.alpha) / cone.nu;
    Cube cube = {edge, 2000.0, 0.1};
    double depth = cube_stop(&cone, &cube, 0, &H),
           law = cbrt(3.0 * full * cube.density * edge * edge * edge * KIT_GRAVITY * H / kappa);
    for (int i = 0; i < 20; i++) { /* eight times the total drop */
        double deeper = cube_stop(&cone, &(Cube){edge, 2000.0, cube.height}, 0, &H8);
        if (fabs(H8 / (8 * H) - 1) < 1e-6) {
            break;
        }
        cube.height = 8 * H - deeper;
    }
    double twice = cube_stop(&cone, &cube, 0, &H8) / depth;
    exponents(&cone, edge, 0, 2000.0, 0.1, found);
    expect_near("depth", depth, law, 0.01 * law);
    expect_near("at eight times the drop", twice, 2.0, 0.02);
    expect_near("exponent of the drop", found[0], 1.0 / 3, 0.01);
    expect_near("exponent of the density", found[1], 1.0 / 3, 0.01);
    expect_near("exponent of the width", found[2], 2.0 / 3, 0.02);
    MildMaterial loose = kit_preset("sand_loose");
    loose.bed_depth = 10.0;
    exponents(&loose, 4 * KIT_PITCH, 4, 2000.0, 0.1, found);
    print_message("depth on sand_loose as density^%.2f width^%.2f drop^%.2f\n", found[1], found[2],
                  found[0]);
    assert_true(found[0] > 1.0 / 3 && found[0] < 1.0); /* to that of a constant force */
}

/* ---- Bekker ---- */

typedef struct {
    const char *name;
    double n, k_c, k_phi; /* [-], [kN/m^(n+1)], [kN/m^(n+2)] */
} Soil;

static const Soil soils[] = {
    {"dry sand (Wong)", 1.1, 0.99, 1528.43},     {"Mars simulant (DLR)", 0.8, 5.79, 180.0},
    {"snow, U.S. (Wong)", 1.6, 4.37, 196.72},    {"snow, U.S. (Harrison)", 1.6, 2.49, 245.90},
    {"snow, Sweden (Wong)", 1.44, 10.55, 66.08},
};
enum { SOILS = sizeof soils / sizeof *soils };

/* z of p = (k_c/b + k_phi) z^n; b is the sole's width. */
static double bekker_sinkage(const Soil *soil, double newton, double area, double width) {
    return pow(1e-3 * newton / area / (soil->k_c / width + soil->k_phi), 1.0 / soil->n);
}

/* The sands are as far from the measured soil nearest to them as soils are from each other: 40 kg
 * on two feet and on one. test_models.c has the sinkage through the solver. */
TEST(test_bekker) {
    static const struct {
        const char *preset;
        int nearest;
    } sands[2] = {{"sand_loose", 1}, {"sand_dense", 0}};
    MildSole *sole = kit_sole(0, 77);
    const double weight = 40.0 * KIT_GRAVITY, area = 77 * KIT_PITCH * KIT_PITCH, width = 0.1;
    for (int p = 0; p < 2; p++) {
        const MildMaterial m = kit_preset(sands[p].preset);
        double apart = INFINITY;
        int nearest = 0;
        for (int s = 0; s < SOILS; s++) {
            double square = 0.0;
            for (int feet = 1; feet <= 2; feet++) {
                const double load = weight / feet;
                const double soil = bekker_sinkage(&soils[s], load, area, width);
                const double off = log(mild_sole_sinkage(sole, &m, load) / soil);
                square += off * off / 2;
            }
            if (square < apart) {
                apart = square;
                nearest = s;
            }
        }
        print_message("%s is nearest to %s\n", sands[p].preset, soils[nearest].name);
        assert_int_equal(nearest, sands[p].nearest);
        expect_below("by a factor of", exp(sqrt(apart)), 1.5);
    }
    mild_sole_destroy(sole);
}

/* ---- resistive force theory ---- */

/* Where its cones are complete sand stiffens by depth as poppy seeds do. */
TEST(test_rft) {
    static const struct {
        const char *preset;
        double seeds; /* [N/m^3] loose, close */
    } sands[2] = {{"sand_loose", 0.254e6}, {"sand_dense", 0.464e6}};
    for (int p = 0; p < 2; p++) {
        const MildMaterial m = kit_preset(sands[p].preset);
        const double full = KIT_PITCH / sqrt(acos(-1.0)) * tan(m.alpha) / m.nu;
        const double slope = mild_element_law(&m, KIT_PITCH, full + 0.01).stiffness;
        expect_near(sands[p].preset, slope / (KIT_PITCH * KIT_PITCH), sands[p].seeds,
                    0.25 * sands[p].seeds);
    }
}

TEST_MAIN(NULL, NULL)
