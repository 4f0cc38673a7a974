/* Contact on uneven ground: which elements are found and how deep, friction on a slope, energy,
 * both solvers. */
#include "map_kit.h"

/* 6 mm above the ground an element that gets there within the step is found, however it does: by
 * falling, by sliding uphill along either axis, by tilting, by turning uphill. 16 m/s are 8 mm in
 * half a step of 1 ms. */
TEST(test_fast_elements_are_found) {
    enum { EDGE = 5 };
    const double fast = 16.0, x = 2.0 * KIT_PITCH;
    const double motion[5][6] = {
        {0, 0, -fast}, {fast}, {0, fast}, {0, 0, 0, 0, fast / x}, {0, 0, 0, 0, 0, fast / x}};
    static const int uphill[5] = {-1, 0, 1, -1, 1}; /* axis, along which the ground rises by 1 */
    MildSole *plate = kit_plate(5, 1);
    for (int k = 0; k < 5; k++) {
        double heights[EDGE * EDGE];
        for (int i = 0; i < EDGE * EDGE; i++) { /* the first row is that of the greatest y */
            heights[i] = uphill[k] == 0 ? i % EDGE - 2 : uphill[k] == 1 ? 2 - i / EDGE : 0;
        }
        MildMapDef def = shape(MILD_MAP_IMAGE, 0.1, 1.0);
        def.heights = heights, def.height_columns = def.height_rows = EDGE, def.cell = 0.1;
        MildMap *map = make_map(&def);
        const MildMaterial m = mild_material_default();
        for (int moving = 0; moving < 2; moving++) {
            Kit kit;
            kit_open(&kit, 1, plate, NULL, &m, 1e-3);
            kit.terrain = terrain_on(map, 0.0);
            /* uphill along x the element in front is the lowest */
            kit.input.position[0][1] = 0.0;
            kit.input.position[0][2] += 0.006 + (uphill[k] == 0 ? x : 0.0);
            for (int i = 0; i < 6 && moving; i++) {
                kit.input.velocity[0][i] = kit.input.free_velocity[i] = motion[k][i];
            }
            kit_solve(&kit);
            assert_true((kit.result.foot[0].force[2] > 0.0) == moving);
            kit_close(&kit);
        }
        mild_map_destroy(map);
    }
    mild_sole_destroy(plate);
}

/* Depths of the elements are those below the terrain's surface, whatever the elements remember: a
 * foot that slides over waves, whole and in part in the ground. */
TEST(test_depths) {
    MildMapDef def = shape(MILD_MAP_WAVES, 0.03, 0.5);
    MildMap *map = make_map(&def);
    MildSole *sole = kit_sole(0, 77);
    const MildMaterial m = mild_material_default();
    double worst = 0.0;
    int whole = 0, part = 0;
    for (int deep = 0; deep < 2; deep++) {
        Kit kit;
        kit_open(&kit, 1, sole, NULL, &m, 5e-3);
        kit.terrain = terrain_on(map, 0.0);
        kit.input.position[0][2] += deep ? -0.03 : 0.015;
        kit.input.velocity[0][0] = kit.input.free_velocity[0] = 0.6;
        for (int s = 0; s < 300; s++) {
            kit_solve(&kit);
            const MildElements elements = mild_scratch_elements(kit.scratch, 0);
            int under = 0;
            for (int e = 0; e < 77; e++) {
                const double surface =
                    mild_terrain_height_at(&kit.terrain, elements.point_x[e], elements.point_y[e]);
                const double z = kit.input.position[0][2] + KIT_SOLE_Z;
                worst = fmax(worst, fabs(elements.depth[e] - (surface - z)));
                under += surface > z;
            }
            whole += under == 77;
            part += under > 0 && under < 77;
            kit_advance(&kit);
        }
        kit_close(&kit);
    }
    print_message("depths on waves: off by %.1e m; %d steps with all elements, %d with some\n",
                  worst, whole, part);
    assert_true(worst < 1e-12 && whole > 50 && part > 50);
    mild_sole_destroy(sole);
    mild_map_destroy(map);
}

/* ---- contact ---- */

/* A plate on a slope. It slides exactly when slope > mu; then, forced to follow z = slope x and
 * with F_x = (mu - slope) F_z, it accelerates with a_x = (mu - slope) g/(1 - slope (mu - slope)).
 */
TEST(test_slope_friction) {
    MildSole *sole = kit_plate(6, 6);
    MildMaterial m = kit_preset("rubber");
    m.k_drift = m.b_drift = 0.0;
    double worst = 0.0, creep = 0.0;
    for (int t = 0; t < 8; t++) {
        double slope = 0.1 + 0.1 * (t / 2), mu = slope + (t % 2 ? 0.05 : -0.07);
        MildMapDef def = shape(MILD_MAP_SLOPE, 0.0, 1.0);
        def.slope = slope;
        MildMap *map = make_map(&def);
        Kit kit;
        m.mu = mu;
        kit_open(&kit, 1, sole, NULL, &m, 1e-3);
        kit.terrain.map = map;
        kit.inertia[0] = 1e9; /* it stays level and only slides */
        kit.input.position[0][0] = kit.input.position[0][1] = 0.0;
        for (int s = 0; s < 500; s++) { /* brought to rest on the slope by hand */
            kit_step(&kit, NULL);
            for (int k = 0; k < 6; k++) {
                kit.input.velocity[0][k] *= 0.9;
            }
        }
        double from = kit.input.position[0][0], speed = kit.input.velocity[0][0];
        for (int s = 0; s < 300; s++) {
            kit_step(&kit, NULL);
        }
        double a = (kit.input.velocity[0][0] - speed) / 0.3,
               exact = mu < slope ? (mu - slope) * KIT_GRAVITY / (1.0 - slope * (mu - slope)) : 0.0;
        if (mu < slope) {
            worst = fmax(worst, fabs(a / exact - 1.0));
        } else {
            creep = fmax(creep, fabs(kit.input.position[0][0] - from));
        }
        kit_close(&kit);
        mild_map_destroy(map);
    }
    print_message("on slopes of 0.1 to 0.4: sliding acceleration off by %.2f %%, at rest %.1e m of "
                  "creep in 0.3 s\n",
                  100 * worst, creep);
    assert_true(worst < 0.02 && creep < 1e-5);
    mild_sole_destroy(sole);
}

/* What a shape is called, for messages. */
static const char *kind_name(int kind) {
    const MildField *field = mild_field_find(mild_map_fields, mild_map_field_count, "kind", NULL);
    return field->names[kind];
}

/* *kind: of the map. */
static MildMap *random_map(uint64_t *random, double steepest, int *kind) {
    static const MildMapKind kinds[5] = {MILD_MAP_WAVES, MILD_MAP_ROUGH, MILD_MAP_STEPS,
                                         MILD_MAP_SLOPE, MILD_MAP_MIXED};
    MildMapDef def = shape(kinds[kit_index(random, 5)], 0.0, kit_uniform(random, 0.15, 1.0));
    def.seed = (uint64_t)kit_index(random, 1000);
    def.size = def.kind == MILD_MAP_MIXED ? 10.0 : 4.0;
    def.amplitude = kit_uniform(random, 0.0, 0.05) * fmin(1.0, steepest * def.wavelength / 0.2);
    def.slope = kit_uniform(random, -0.5, 0.5);
    *kind = def.kind;
    return make_map(&def);
}

/* [m] Moves the origin from the edge of a tile, where mixed ground is level, to the middle. */
static double off_edge(int kind) {
    return kind == MILD_MAP_MIXED ? 1.0 : 0.0;
}

/* [N] On a foot that is shaken. */
static void shaking_force(const Kit *kit, const double shake[3], double spring, double t,
                          double force[3]) {
    for (int k = 0; k < 3; k++) {
        force[k] =
            kit->mass[0] * KIT_GRAVITY *
            (k == 2 ? 1.5 * sin(spring * t * 6.28) + 0.8 * shake[2] * t : shake[k] * sin(20 * t));
    }
}

/* Feet thrown and shaken at random over uneven ground until they leave it: the ground has taken
 * energy. */
TEST(test_passive) {
    uint64_t random = 44;
    MildSole *sole = kit_sole(0, 77);
    static const double steps[3] = {0.25e-3, 1e-3, 5e-3};
    double worst = -INFINITY, worst_share = -INFINITY;
    int cycles = 0;
    int worst_draw = -1;
    int worst_kind = MILD_MAP_FLAT;
    for (int draw = 0; draw < kit_draws(600); draw++) {
        MildMaterial m = kit_material(&random);
        int kind;
        MildMap *map = random_map(&random, 1.0, &kind);
        Kit kit;
        double dt = steps[kit_index(&random, 3)];
        kit_open(&kit, 1, sole, NULL, &m, dt);
        kit.terrain.map = map;
        kit.terrain.map_x = kit_uniform(&random, -5.0, 5.0);
        kit.terrain.map_y = off_edge(kind);
        kit_random_state(&kit, &random);
        kit.input.position[0][2] +=
            0.25 + mild_terrain_height_at(&kit.terrain, kit.input.position[0][0],
                                          kit.input.position[0][1]);
        double work = 0.0, taken = 0.0, shake[3], spring = kit_uniform(&random, 2.0, 8.0),
               force[1][3];
        for (int k = 0; k < 3; k++) {
            shake[k] = kit_uniform(&random, 0.0, 1.0);
        }
        for (int s = 0; s < (int)(0.7 / dt); s++) {
            double before[6];
            memcpy(before, kit.input.velocity[0], sizeof before);
            shaking_force(&kit, shake, spring, s * dt, force[0]);
            kit_step(&kit, (const double(*)[3])force);
            const double w = kit_work(&kit, 0, before);
            work += w;
            taken += fabs(w);
            if (kit_lifted(&kit) && taken > 0.0) { /* a closed cycle */
                cycles++;
                if (work > worst) {
                    worst = work;
                    worst_draw = draw;
                    worst_kind = kind;
                }
                if (taken > 1e-6) {
                    worst_share = fmax(worst_share, work / taken);
                }
                work = taken = 0.0;
            }
        }
        kit_close(&kit);
        mild_map_destroy(map);
    }
    print_message(
        "passivity on uneven ground: %d closed cycles, most energy gained %.2e J (draw %d, %s), "
        "share %.2e\n",
        cycles, worst, worst_draw, kind_name(worst_kind), worst_share);
    mild_sole_destroy(sole);
    assert_true(cycles > kit_draws(300));
    assert_true(worst < 1e-9);
}

/* One element led by hand (A = 0) round after round through waves, deep in the troughs and lightly
 * over the crests: where the ground rises faster than its tangent the element must not be loaded
 * for nothing. */
TEST(test_passive_by_hand) {
    uint64_t random = 47;
    MildSole *sole = kit_plate(1, 1);
    double worst = -INFINITY;
    int worst_draw = -1;
    for (int draw = 0; draw < kit_draws(400); draw++) {
        MildMaterial m = kit_material(&random);
        m.c_g = 0.0, m.recovery = draw % 2 ? 1.0 : m.recovery, m.mu = 0.0,
        m.k_drift = m.b_drift = 0.0;
        MildMapDef def =
            shape(MILD_MAP_WAVES, kit_uniform(&random, 0.0, 0.05), kit_uniform(&random, 0.2, 1.0));
        def.cell = 0.005;
        MildMap *map = make_map(&def);
        Kit kit;
        double dt = draw % 3 ? 1e-3 : 5e-3, speed = kit_uniform(&random, 0.1, 1.0),
               deep = kit_uniform(&random, 0.002, 0.04);
        double k = 2.0 * acos(-1.0) / def.wavelength, work = 0.0, taken = 0.0,
               share = kit_uniform(&random, 0.1, 0.9);
        kit_open(&kit, 1, sole, NULL, &m, dt);
        kit.terrain.map = map;
        kit.input.position[0][0] = kit.input.position[0][1] = 0.0;
        for (double t = 0.0; t < 4.0 * def.wavelength / speed; t += dt) {
            double x = kit.input.position[0][0] + speed * dt,
                   u = deep * fmin(1.0, 20.0 * t) * (1.0 - share * sin(k * x));
            double z = mild_terrain_height_at(&kit.terrain, x, 0.0) - u - KIT_SOLE_Z;
            if (t + dt >= 4.0 * def.wavelength / speed) {
                z += 0.2;
            }
            kit.input.velocity[0][0] = kit.input.free_velocity[0] = speed;
            kit.input.velocity[0][2] = kit.input.free_velocity[2] =
                (z - kit.input.position[0][2]) / dt;
            kit_solve(&kit);
            kit_advance(&kit);
            double w = dt * (kit.result.foot[0].force[0] * speed +
                             kit.result.foot[0].force[2] * kit.input.velocity[0][2]);
            work += w;
            taken += fabs(w);
        }
        worst_draw = work / taken > worst ? draw : worst_draw;
        worst = fmax(worst, work / taken);
        kit_close(&kit);
        mild_map_destroy(map);
    }
    print_message(
        "led through waves by hand: largest share of the work given back in excess %.2e (%d)\n",
        worst, worst_draw);
    assert_true(worst < 0.0);
    mild_sole_destroy(sole);
}

/* Newton converges on uneven ground as on level ground, and both solvers find the same twist. */
TEST(test_solvers) {
    uint64_t random = 45;
    MildSole *left = kit_sole(0, 77), *right = kit_sole(1, 77);
    int problems = 0, failed = 0, compared = 0, most = 0;
    double worst = 0.0, iterations = 0.0;
    int worst_draw = -1;
    int worst_kind = MILD_MAP_FLAT;
    for (int t = 0; t < kit_draws(600); t++) {
        MildMaterial m = kit_material(&random);
        int kind;
        MildMap *map = random_map(&random, 1.0, &kind);
        Kit kit;
        kit_open(&kit, 1 + t % 2, left, right, &m, t % 3 ? 1e-3 : 5e-3);
        kit.terrain.map = map;
        kit.terrain.map_x = kit.terrain.map_y = off_edge(kind);
        kit_random_state(&kit, &random);
        for (int f = 0; f < kit.feet; f++) {
            kit.input.position[f][2] += mild_terrain_height_at(
                &kit.terrain, kit.input.position[f][0], kit.input.position[f][1]);
        }
        for (int s = 0; s < t % 7; s++) {
            kit_step(&kit, NULL);
        }
        kit_random_inertia(&kit, &random, 6 * kit.feet);
        kit_free(&kit, NULL);
        kit_solve(&kit);
        if (kit.result.foot[0].contacts + kit.result.foot[1].contacts > 0) {
            problems++;
            failed += !kit.result.converged;
            iterations += kit.result.iterations;
            most = kit.result.iterations > most ? kit.result.iterations : most;
        }
        if (t % 4 == 0 && kit.result.converged) {
            MildContactResult newton = kit.result;
            kit.input.solver = MILD_SOLVER_GAUSS_SEIDEL;
            kit.input.max_iterations = 3000;
            kit.input.tolerance = 1e-12;
            kit_solve(&kit);
            double size = 1e-3, difference = 0.0;
            for (int i = 0; i < 6 * kit.feet; i++) {
                size = fmax(size, fabs(newton.velocity[i]));
                difference = fmax(difference, fabs(newton.velocity[i] - kit.result.velocity[i]));
            }
            compared += kit.result.converged;
            if (kit.result.converged && difference / size > worst) {
                worst = difference / size;
                worst_draw = t;
                worst_kind = kind;
            }
        }
        kit_close(&kit);
        mild_map_destroy(map);
    }
    print_message("uneven ground: %d problems, %d not converged, %.1f iterations in the mean, %d "
                  "at most; sweeps differ by %.1e in %d (draw %d, %s)\n",
                  problems, failed, iterations / problems, most, worst, compared, worst_draw,
                  kind_name(worst_kind));
    assert_true(problems > kit_draws(300) && failed * 100 < problems);
    assert_true(compared > kit_draws(60) && worst < 1e-6);
    mild_sole_destroy(left);
    mild_sole_destroy(right);
}

/* The same foot a whole period of the map farther, or with the map moved along: the same step. */
TEST(test_translation) {
    uint64_t random = 46;
    MildSole *sole = kit_sole(0, 77);
    MildMapDef def = shape(MILD_MAP_ROUGH, 0.03, 0.25);
    def.size = 2.0, def.cell = 0.03125;
    def.patches = MILD_PATTERN_CHECKER;
    def.patch_size = 0.25, def.border = 0.125;
    MildMap *map = make_map(&def);
    double worst = 0.0;
    for (int t = 0; t < 40; t++) {
        MildMaterial m = kit_material(&random);
        Kit a, b;
        kit_open(&a, 1, sole, NULL, &m, 1e-3);
        a.terrain.materials[1] = kit_material(&random);
        a.terrain.material_count = 2;
        a.terrain.map = map;
        kit_random_state(&a, &random);
        kit_open(&b, 1, sole, NULL, &m, 1e-3);
        b.terrain = a.terrain;
        kit_copy_input(&b, &a);
        memcpy(b.center, a.center, sizeof a.center);
        b.mass[0] = a.mass[0], b.inertia[0] = a.inertia[0];
        double shift = t % 2 ? 2.0 * (1 + t / 8) : 0.09375 * t;
        b.input.position[0][0] += shift;
        if (t % 2 == 0) {
            b.terrain.map_x += shift;
        }
        for (int s = 0; s < 50; s++) {
            kit_step(&a, NULL);
            kit_step(&b, NULL);
        }
        for (int k = 0; k < 6; k++) {
            worst = fmax(worst, fabs(a.input.velocity[0][k] - b.input.velocity[0][k]));
        }
        kit_close(&a);
        kit_close(&b);
    }
    print_message(
        "moved by whole periods, or map and foot together: twists differ by %.1e after 50 steps\n",
        worst);
    assert_true(worst < 1e-7);
    mild_map_destroy(map);
    mild_sole_destroy(sole);
}

/* The force half way across a border lies between those of its two materials, by the law's linear
 * mixture. */
TEST(test_smooth_border) {
    MildMaterial foam, rubber;
    mild_material_preset("foam28", &foam);
    mild_material_preset("rubber", &rubber);
    MildSole *sole = kit_plate(1, 1);
    MildMapDef def = mild_map_def_default();
    def.patches = MILD_PATTERN_STRIPES;
    def.border = 0.2, def.cell = 0.002;
    MildMap *map = make_map(&def);
    double last = 0.0, jump = 0.0, ends[2] = {0.0, 0.0}, middle = 0.0;
    for (int i = 0; i <= 200;
         i++) { /* pressed 3 mm into the ground at 0.35 .. 0.65 m; the border is at 0.5 */
        Kit kit;
        kit_open(&kit, 1, sole, NULL, &foam, 1e-3);
        kit.terrain.materials[1] = rubber;
        kit.terrain.material_count = 2;
        kit.terrain.map = map;
        kit.input.position[0][0] = 0.35 + 0.3 * i / 200.0, kit.input.position[0][1] = 0.0;
        kit.input.velocity[0][2] = kit.input.free_velocity[2] = -0.01;
        for (int s = 0; s < 300; s++) {
            kit_solve(&kit);
            kit_advance(&kit);
        }
        double force = kit.result.foot[0].force[2];
        if (i > 0) {
            jump = fmax(jump, fabs(force - last));
        }
        if (i == 0) {
            ends[0] = force;
        }
        if (i == 100) {
            middle = force;
        }
        if (i == 200) {
            ends[1] = force;
        }
        last = force;
        kit_close(&kit);
    }
    print_message("across a border of 0.2 m: %.3f, %.3f, %.3f N; largest jump between points 1.5 "
                  "mm apart %.4f N\n",
                  ends[0], middle, ends[1], jump);
    assert_true(ends[0] < middle && middle < ends[1] && jump < 0.02 * (ends[1] - ends[0]));
    assert_true(fabs(ends[0] / mild_element_law(&foam, KIT_PITCH, 3e-3).force - 1.0) < 0.01);
    assert_true(fabs(ends[1] / mild_element_law(&rubber, KIT_PITCH, 3e-3).force - 1.0) < 0.01);
    mild_map_destroy(map);
    mild_sole_destroy(sole);
}

TEST_MAIN(NULL, NULL)
