/* The ground against published curves: impact, kinetic energy over depth, scaling of impact depth,
 * pressure and sinkage, resistive force theory. Every drop and press runs through the contact
 * solver. docs/model.md, section 15.
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
        print_message("Katsuragi-Durian, c_d %5.1f: solver and closed form with added mass differ "
                      "by %.2f %% of K0, and "
                      "without (the published form) by %.2f %%\n",
                      drag[c], 100.0 * worst, 100.0 * apart);
        assert_true(worst < 0.002);
        assert_true(apart < (c ? 0.05 : 0.01));
    }
    mild_sole_destroy(sole);
}

/* Root mean square of E - (E0 - A) exp(-2z/d1) - A - B z over the trace, with the best A and B for
 * this d1; or, tied, the best k of the force law. Both are linear least squares. */
static double durian_miss(double d1, double mass, int tied, double *k) {
    double e0 = trace_energy[0], aa = 0, ab = 0, bb = 0, ay = 0, by = 0, yy = 0;
    for (int i = 0; i < trace_count; i++) {
        double z = trace_depth[i], fade = exp(-2.0 * z / d1), a = 1.0 - fade, b = z,
               y = trace_energy[i] - e0 * fade;
        if (tied) { /* A = g d1/2 + q, B = -2 q/d1 with q = k d1^2/(4 M) */
            y -= 0.5 * KIT_GRAVITY * d1 * a;
            a -= 2.0 * b / d1;
            b = 0.0;
        }
        aa += a * a;
        ab += a * b;
        bb += b * b;
        ay += a * y;
        by += b * y;
        yy += y * y;
    }
    double det = aa * bb - ab * ab, A = tied ? ay / aa : (ay * bb - by * ab) / det,
           B = tied ? 0.0 : (by * aa - ay * ab) / det;
    *k = tied ? 4.0 * mass * A / (d1 * d1) : -2.0 * mass * B / d1;
    double sum = yy - 2.0 * (A * ay + B * by) + A * A * aa + 2.0 * A * B * ab + B * B * bb;
    return sqrt(fmax(sum, 0.0) / trace_count);
}

static void durian_fit(const char *ground, double speed, double *free_share, double *tied_share) {
    MildMaterial m = kit_preset(ground);
    m.bed_depth = 10.0;
    MildSole *sole = kit_plate(11, 7);
    const double mass = 20.0;
    double stop = drop(&m, sole, mass, speed, 2e-5), best[2] = {INFINITY, INFINITY}, d1[2] = {0},
           k[2] = {0};
    for (double d = 2e-4; d < 2.0; d *= 1.01) {
        for (int tied = 0; tied < 2; tied++) {
            double stiffness, miss = durian_miss(d, mass, tied, &stiffness);
            if (miss >= best[tied]) {
                continue;
            }
            best[tied] = miss;
            d1[tied] = d;
            k[tied] = stiffness;
        }
    }
    *free_share = best[0] / trace_energy[0];
    *tied_share = best[1] / trace_energy[0];
    print_message("%s, 20 kg at %.1f m/s: stop %5.1f mm; form with A, B, d1 free: rms %.2f %% of "
                  "K0 (d1 %.1f mm); tied to "
                  "the force law: %.2f %% (d1 %.1f mm, k %.0f N/m)\n",
                  ground, speed, 1e3 * stop, 100 * *free_share, 1e3 * d1[0], 100 * *tied_share,
                  1e3 * d1[1], k[1]);
    mild_sole_destroy(sole);
}

TEST(test_durian_sand) {
    static const double speed[4] = {0.5, 1.0, 2.0, 4.0};
    static const char *const sand[2] = {"sand_loose", "sand_dense"};
    double worst[2] = {0};
    for (int g = 0; g < 2; g++) {
        for (int v = 0; v < 4; v++) {
            double found[2];
            durian_fit(sand[g], speed[v], &found[0], &found[1]);
            for (int i = 0; i < 2; i++) {
                worst[i] = fmax(worst[i], found[i]);
            }
        }
    }
    print_message(
        "Katsuragi-Durian on the sand presets: worst rms %.2f %% of K0 free, %.2f %% tied\n",
        100 * worst[0], 100 * worst[1]);
    assert_true(worst[0] < 0.10 && worst[1] < 0.12);
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
    print_message("Uehara, opening cone alone: depth %.2f mm (closed form %.2f), eight times the "
                  "drop %.4f times the depth\n",
                  1e3 * depth, 1e3 * law, twice);
    print_message("%-34s %8s %8s %8s\n%-34s %8.3f %8.3f %8.3f\n%-34s %8.3f %8.3f %8.3f\n",
                  "exponent of the depth in", "H", "density", "width", "published", 1.0 / 3, 0.5,
                  2.0 / 3, "opening cone alone", found[0], found[1], found[2]);
    assert_true(fabs(depth / law - 1) < 0.01 && fabs(twice / 2 - 1) < 0.01);
    assert_true(fabs(found[0] - 1.0 / 3) < 0.01 && fabs(found[1] - 1.0 / 3) < 0.01 &&
                fabs(found[2] - 2.0 / 3) < 0.02);
    static const char *const sand[2] = {"sand_loose", "sand_dense"};
    for (int g = 0; g < 2; g++) {
        for (int mass = 0; mass < 2; mass++) {
            MildMaterial m = kit_preset(sand[g]);
            m.bed_depth = 10.0;
            if (!mass) {
                m.c_g = 0.0;
            }
            char name[64];
            snprintf(name, sizeof name, "%s, 4 x 4 elements%s", sand[g], mass ? "" : ", no drag");
            exponents(&m, 4 * KIT_PITCH, 4, 2000.0, 0.1, found);
            print_message("%-34s %8.3f %8.3f %8.3f\n", name, found[0], found[1], found[2]);
            assert_true(found[0] > 1.0 / 3 &&
                        found[0] < 1.0); /* between the opening cone and a constant force */
        }
    }
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

/* Sinkage of a level foot that the solver holds the load with: pressed slowly until it pushes back
 * so hard. */
static double pressed_sinkage(const MildMaterial *m, MildSole *sole, double newton) {
    Kit kit;
    kit_open(&kit, 1, sole, NULL, m, 1e-3);
    double depth = 0.0, step = 1e-5, last = 0.0;
    kit.input.velocity[0][2] = kit.input.free_velocity[2] = -step / kit.input.dt;
    for (;; depth += step) {
        kit_solve(&kit);
        double force = kit.result.foot[0].force[2]; /* mean over the step */
        if (force >= newton) {
            kit_close(&kit);
            return depth + step * ((newton - last) / (force - last) - 0.5);
        }
        kit_advance(&kit);
        last = force;
    }
}

TEST(test_bekker) {
    MildSole *sole = kit_sole(0, 77);
    const double weight = 40.0 * KIT_GRAVITY, area = 77 * KIT_PITCH * KIT_PITCH, width = 0.1;
    double two[SOILS], one[SOILS], worst = 0.0;
    print_message("40 kg, sole %.4f m^2, b = 0.1 m; sinkage on two and one foot, n between them\n",
                  area);
    for (int s = 0; s < SOILS; s++) {
        two[s] = 1e3 * bekker_sinkage(&soils[s], 0.5 * weight, area, width);
        one[s] = 1e3 * bekker_sinkage(&soils[s], weight, area, width);
        print_message("  %-24s %6.1f %6.1f mm   n %.2f\n", soils[s].name, two[s], one[s],
                      soils[s].n);
    }
    for (int p = 0; p < PAPER_PRESETS; p++) {
        MildMaterial m = kit_preset(mild_material_preset_name(p));
        double a = 1e3 * pressed_sinkage(&m, sole, 0.5 * weight),
               b = 1e3 * pressed_sinkage(&m, sole, weight), apart = INFINITY;
        int nearest = 0;
        for (int s = 0; s < SOILS; s++) {
            double distance = hypot(log(a / two[s]), log(b / one[s]));
            if (distance >= apart) {
                continue;
            }
            apart = distance;
            nearest = s;
        }
        print_message("  %-24s %6.1f %6.1f mm   n %.2f   nearest %s, a factor %.2f\n",
                      mild_material_preset_name(p), a, b, log(2.0) / log(b / a),
                      soils[nearest].name, exp(apart / sqrt(2.0)));
        worst = fmax(worst, fabs(a / (1e3 * mild_sole_sinkage(sole, &m, 0.5 * weight)) - 1.0));
        worst = fmax(worst, fabs(b / (1e3 * mild_sole_sinkage(sole, &m, weight)) - 1.0));
        int dense = strcmp(mild_material_preset_name(p), "sand_dense") == 0,
            loose = strcmp(mild_material_preset_name(p), "sand_loose") == 0;
        if (dense || loose) { /* as far from the measured soil as soils are from each other */
            assert_int_equal(nearest, loose ? 1 : 0);
            assert_true(exp(apart / sqrt(2.0)) < 1.5);
        }
    }
    print_message("pressed through the solver against the law's own sinkage: %.2f %%\n",
                  100.0 * worst);
    assert_true(worst < 0.01);
    mild_sole_destroy(sole);
}

/* ---- resistive force theory ---- */

TEST(test_rft) {
    static const double poppy_loose = 0.254e6, poppy_close = 0.464e6; /* [N/m^3] */
    MildSole *sole = kit_plate(11, 7);
    double stress[2]; /* of a level plate that goes straight down: along x, and up */
    mild_resist_plane(0.0, 0.5 * acos(-1.0), stress);
    double generic = 1e6 * stress[1];
    print_message("stress per depth of a level plate [N/m^3]: generic coefficients %.3g, poppy "
                  "seeds loose %.3g, close %.3g\n",
                  generic, poppy_loose, poppy_close);
    for (int p = 0; p < PAPER_PRESETS; p++) {
        MildMaterial m = kit_preset(mild_material_preset_name(p));
        double full = KIT_PITCH / sqrt(acos(-1.0)) * tan(m.alpha) / m.nu, force[2];
        for (int i = 0; i < 2;
             i++) { /* complete cones, 10 mm deeper, held still until the added mass rests */
            Kit kit;
            kit_open(&kit, 1, sole, NULL, &m, 1.0);
            for (int s = 0; s < 3; s++) {
                kit.input.free_velocity[2] = kit.input.velocity[0][2] =
                    s ? 0.0 : -(full + 0.01 * (i + 1));
                kit_solve(&kit);
                kit_advance(&kit);
            }
            force[i] = kit.result.foot[0].force[2];
            kit_close(&kit);
        }
        double slope = (force[1] - force[0]) / 0.01 / (77 * KIT_PITCH * KIT_PITCH),
               law = m.sigma_cone / cos(m.alpha);
        print_message("  %-10s cone complete at %5.1f mm, slope %.4g (sigma_cone/cos(alpha) %.4g), "
                      "zeta %.2f, poppy loose x %.2f\n",
                      mild_material_preset_name(p), 1e3 * full, slope, law, slope / generic,
                      slope / poppy_loose);
        assert_true(fabs(slope / law - 1) < 1e-6);
        if (strcmp(mild_material_preset_name(p), "sand_loose") == 0) {
            assert_true(fabs(slope / poppy_loose - 1) < 0.25);
        }
        if (strcmp(mild_material_preset_name(p), "sand_dense") == 0) {
            assert_true(fabs(slope / poppy_close - 1) < 0.25);
        }
    }
    mild_sole_destroy(sole);
}

TEST_MAIN(NULL, NULL)
