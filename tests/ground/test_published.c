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

#include "ground/law/models.h"

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

/* The same ground on finer grids: pitch 39, 19.5, 9.75 and 4.875 mm. A material's numbers
 * belong to an element of the paper's pitch, so it is the same per area and per depth at any. What
 * converges is the footprint: the sum over elements is the midpoint rule of an integral over the
 * sole. docs/model.md, section 16. */

enum { LEVELS = 4 };
static const double pitches[LEVELS] = {0.039, 0.0195, 0.00975, 0.004875};

static const double length = 0.234, width = 0.156; /* [m] whole elements at every pitch */

static void tilt(Kit *kit, double angle) {
    double turn[3] = {0.0, angle, 0.0};
    kit_rotate(kit->input.rotation[0],
               turn); /* about the plate's centre: the ankle moves on a circle */
    kit->input.position[0][0] = -kit->input.rotation[0][2] * KIT_SOLE_Z;
    kit->input.position[0][2] = -kit->input.rotation[0][8] * KIT_SOLE_Z;
}

/* Force and moment about the plate's centre after it has gone down to `depth` at a walking foot's
 * speed and stopped. */
static void press(const MildMaterial *m, double pitch, double angle, double depth, double *force,
                  double *moment) {
    MildSole *sole = kit_rectangle(length, width, pitch, 0);
    Kit kit;
    kit_open(&kit, 1, sole, NULL, m, 1e-3);
    tilt(&kit, angle);
    double above = 0.5 * length * sin(fabs(angle)), step = 1e-4;
    kit.input.position[0][2] += above;
    int steps = (int)((above + depth) / step + 0.5);
    for (int s = 0; s < steps + 2; s++) { /* the added mass comes to rest in the last two */
        kit.input.velocity[0][2] = kit.input.free_velocity[2] =
            s < steps ? -(above + depth) / steps / kit.input.dt : 0.0;
        kit_solve(&kit);
        kit_advance(&kit);
    }
    const MildFootResult *foot = &kit.result.foot[0];
    double x = kit.input.rotation[0][2] * KIT_SOLE_Z, z = kit.input.rotation[0][8] * KIT_SOLE_Z;
    *force = foot->force[2];
    *moment = foot->torque[1] - (z * foot->force[0] - x * foot->force[2]);
    kit_close(&kit);
    mild_sole_destroy(sole);
}

/* The limit of small elements: integral of stress over the part of the plate that is in the ground.
 */
static void limit(const MildMaterial *m, double angle, double depth, double *force,
                  double *moment) {
    enum { PANELS = 200000 };
    double dx = length / PANELS;
    *force = *moment = 0.0;
    for (int i = 0; i < PANELS; i++) {
        double x = -0.5 * length + (i + 0.5) * dx, u = depth + x * sin(angle);
        if (u <= 0.0) {
            continue;
        }
        double f = mild_element_law(m, KIT_PITCH, u).force / (KIT_PITCH * KIT_PITCH) * width * dx;
        *force += f;
        *moment -= x * cos(angle) * f;
    }
}

/* Every model but the concentric ones: the plate carries and moves the same at any pitch, and drift
 * costs as much. The heap of a merged sole is a mean over cells. */
TEST(test_models) {
    const double load = 300.0, depth = 0.012;
    MildMaterial sand = kit_preset("sand_loose");
    for (int model = 0; model < MILD_MODELS; model++) {
        if (mild_model_is_concentric((MildModel)model) || model == MILD_MODEL_RIGID) {
            continue;
        }
        double force[LEVELS], drift[LEVELS], worst = 0.0;
        for (int k = 0; k < LEVELS; k++) {
            MildSole *sole = kit_rectangle(length, width, pitches[k], 0),
                     *usual = kit_rectangle(length, width, KIT_PITCH, 0);
            MildMaterial own;
            MildError error = {0};
            assert_int_equal(mild_model_match((MildModel)model, &sand, usual, load, &own, &error),
                             MILD_OK);
            const MildElementLaw law = mild_sole_law(&own, sole, depth);
            const MildMaterial each = material_at(&own, pitches[k]);
            force[k] = law.force + 1e3 * law.added_mass;
            drift[k] = mild_sole_elements(sole) * (each.k_drift + 1e3 * each.b_drift);
            mild_sole_destroy(sole);
            mild_sole_destroy(usual);
            worst = fmax(worst, fabs(force[k] / force[0] - 1.0));
            worst = fmax(worst, fabs(drift[k] - drift[0]) / (drift[0] + 1e-9));
        }
        expect_below(mild_model_names[model], worst, model == MILD_MODEL_MILD_MERGED ? 0.02 : 1e-9);
    }
}

TEST(test_tilted) {
    static const char *const grounds[3] = {"sand_loose", "foam45", "rubber"};
    static const double angle = 5.0 * 3.14159265358979 / 180.0, depths[3] = {-0.004, 0.002, 0.010};
    double worst[LEVELS] = {0};
    for (int g = 0; g < 3; g++) {
        for (int d = 0; d < 3; d++) {
            MildMaterial base = kit_preset(grounds[g]);
            double wanted, turn;
            limit(&base, angle, depths[d], &wanted, &turn);
            for (int k = 0; k < LEVELS; k++) {
                double force, moment;
                press(&base, pitches[k], angle, depths[d], &force, &moment);
                worst[k] = fmax(worst[k], 100.0 * fabs(force / wanted - 1.0));
                worst[k] = fmax(worst[k], 100.0 * fabs(moment / turn - 1.0));
            }
        }
    }
    print_message("tilted by 5 degrees, off by %.2f %.2f %.2f %.2f %%\n", worst[0], worst[1],
                  worst[2], worst[3]);
    for (int k = 1; k < LEVELS; k++) {
        assert_true(worst[k] < 0.5 * worst[k - 1]);
    }
    assert_true(worst[3] < 0.1);
}

/* A sole of this outline that chooses its pitch has the outline's area, and about its levers. */
static void own_pitch(const char *name, const double *outline, int points) {
    double area = 0, first[2] = {0, 0}, second[2] = {0, 0}, mean[2] = {0, 0}, square[2] = {0, 0};
    const MildSoleDef def = {outline, points, 0, 0, 0};
    MildSole *sole = mild_sole_create(&def, NULL);
    assert_non_null(sole);
    const int count = mild_sole_elements(sole);
    const double pitch = mild_sole_pitch(sole);
    for (int i = 0; i < points; i++) { /* triangles from the origin */
        const double *a = &outline[2 * i], *b = &outline[2 * ((i + 1) % points)];
        const double part = 0.5 * (a[0] * b[1] - b[0] * a[1]);
        area += part;
        for (int k = 0; k < 2; k++) {
            first[k] += part * (a[k] + b[k]) / 3;
            second[k] += part * (a[k] * a[k] + a[k] * b[k] + b[k] * b[k]) / 6;
        }
    }
    for (int e = 0; e < count; e++) {
        const double at[2] = {mild_sole_x(sole)[e], mild_sole_y(sole)[e]};
        for (int k = 0; k < 2; k++) {
            mean[k] += at[k] / count;
            square[k] += (at[k] * at[k] + pitch * pitch / 12) / count;
        }
    }
    expect_near(name, count * pitch * pitch, fabs(area), 1e-9 * fabs(area));
    assert_true(pitch > 0.0195 / 2 && pitch < 0.0195 * 1.2);
    for (int k = 0; k < 2; k++) {
        const double lever = sqrt(second[k] / area - first[k] / area * (first[k] / area));
        const double own = sqrt(square[k] - mean[k] * mean[k]);
        assert_true(fabs(own / lever - 1) < 0.09 && fabs(mean[k] - first[k] / area) < pitch / 2);
    }
    mild_sole_destroy(sole);
}

/* A foot of two half discs, its length between their centres [m]; 0: a round foot. */
static void own_pitch_round(const char *name, double length_between, double radius) {
    double outline[2 * 32];
    for (int i = 0; i < 32; i++) {
        const double angle = 2 * 3.14159265358979 * (i + 0.5) / 32;
        outline[2 * i] = radius * cos(angle) + (cos(angle) > 0 ? length_between : 0);
        outline[2 * i + 1] = radius * sin(angle);
    }
    own_pitch(name, outline, 32);
}

/* Feet of public robots, and boxes of no kind. */
TEST(test_own_pitch) {
    static const double boxes[][2] = {{0.08, 0.05},  {0.1, 0.1},     {0.25, 0.125}, {0.287, 0.1},
                                      {0.2, 0.012},  {0.03, 0.03},   {0.011, 0.01}, {0.181, 0.067},
                                      {0.31, 0.021}, {0.555, 0.333}, {0.066, 0.19}, {0.04, 0.017}};
    static const double corner[] = {0, 0, 0.2, 0, 0.2, 0.05, 0.05, 0.05, 0.05, 0.15, 0, 0.15};
    for (size_t i = 0; i < sizeof boxes / sizeof *boxes; i++) {
        const double x = boxes[i][0] / 2, y = boxes[i][1] / 2;
        const double outline[] = {-x, -y, x, -y, x, y, -x, y};
        char name[32];
        snprintf(name, sizeof name, "box %g x %g", 2e3 * x, 2e3 * y);
        own_pitch(name, outline, 4);
    }
    own_pitch("corner", corner, 6);
    own_pitch_round("H1", 0.21, 0.03);
    own_pitch_round("G1", 0.17, 0.03);
    own_pitch_round("Go1", 0, 0.023);
    own_pitch_round("Spot", 0, 0.036);
}

TEST_MAIN(NULL, NULL)
