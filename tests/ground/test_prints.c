/* Prints: what a second step finds, drags into them, energy with lifts and sideways shifts,
 * bounded memory; parameters changed under a standing foot. test_imprint.c has the cells. */
#include "ground_kit.h"

#define TILES 128

/* The kit with a ground that remembers prints. */
static void prints_open(Kit *kit, int feet, MildSole *left, MildSole *right,
                        const MildMaterial *material, double dt, int tiles) {
    kit_open(kit, feet, left, right, material, dt);
    kit_prints(kit, tiles);
    assert_int_equal(mild_ground_size(kit->ground), kit->bytes);
    assert_int_equal(kit->bytes % 64, 0);
}

/* Moves the immovable foot (A = 0) to depth u at the speed of one step; returns the force. */
static double move_to(Kit *kit, double u) {
    double z = -KIT_SOLE_Z - u;
    kit->input.velocity[0][2] = kit->input.free_velocity[2] =
        (z - kit->input.position[0][2]) / kit->input.dt;
    kit_solve(kit);
    kit_advance(kit);
    kit->input.position[0][2] = z;
    return kit->result.foot[0].force[2];
}

/* Pressed to 20 mm, lifted out, pressed again at the same place: nothing until the print is met,
 * then the unloading line up to the old depth less what flowed back, then virgin ground. Elsewhere,
 * and on elastic ground, the first curve again. */
TEST(test_second_step) {
    MildSole *sole = kit_plate(4, 4);
    static const double recovery[6] = {0.0, 0.3, 0.7, 1.0, 0.0, 0.3};
    static const double refill[6] = {0.0, 0.0, 0.0, 0.0, 0.4, 0.2};
    for (int r = 0; r < 6; r++) {
        MildMaterial m = kit_preset("grass");
        m.recovery = recovery[r];
        m.refill = refill[r];
        m.c_g = 0.0;
        Kit kit;
        prints_open(&kit, 1, sole, NULL, &m, 1e-3, TILES);
        double worst = 0.0, first_load = -1.0;
        for (int s = 0; s <= 200; s++) {
            move_to(&kit, 1e-4 * s);
        }
        for (int s = 200; s >= -50; s--) {
            move_to(&kit, 1e-4 * s);
        }
        double print = mild_ground_imprint_at(kit.ground, 0.0, kit.input.position[0][1]),
               foot = 16.0;
        double a = 0.02 * (1.0 - refill[r]), top = mild_element_law(&m, KIT_PITCH, a).force,
               travel = fmax(recovery[r] * a, 1e-4);
        for (int s = -50; s <= 300;
             s++) { /* the force of a step is the mean about the depth it starts from */
            double u = 1e-4 * (s - 1), force = move_to(&kit, u + 1e-4) / foot;
            double virgin = mild_element_law(&m, KIT_PITCH, fmax(u, 0.0)).force,
                   line = fmax(top * (1.0 - (a - u) / travel), 0.0);
            double expected = recovery[r] < 1.0 && u <= a - 1e-9 ? line : virgin;
            if (first_load < 0.0 && force > 0.0) {
                first_load = u;
            }
            if (u < a - 2e-4 || u > a + 2e-4) {
                worst = fmax(worst, fabs(force - expected) / top);
            }
        }
        expect_near("print", print, recovery[r] < 1.0 ? a : 0.0, 1e-5);
        expect_near("carried from", first_load, recovery[r] < 1.0 ? a - travel : 0.0, 2.1e-4);
        expect_below("the second step, by the load", worst, 0.01);
        kit_close(&kit);
    }
    mild_sole_destroy(sole);
}

/* A tilted plate that goes straight down slides in its frame, and leaves no print beside itself. */
TEST(test_straight_down) {
    MildSole *sole = kit_plate(4, 4);
    MildMaterial m = kit_preset("sand_loose");
    m.model = MILD_MODEL_MILD_MERGED;
    const double c = cos(0.3), s = sin(0.3), tilted[9] = {c, 0, s, 0, 1, 0, -s, 0, c};
    double most = 0.0, deepest = 0.0;
    for (int place = 0; place < 50; place++) {
        Kit kit;
        prints_open(&kit, 1, sole, NULL, &m, 1e-3, TILES);
        memcpy(kit.input.rotation[0], tilted, sizeof tilted);
        kit.input.position[0][0] = 3e-4 * place;
        for (int k = 0; k <= 40; k++) {
            move_to(&kit, 1e-3 * k);
        }
        for (int e = 0; e < mild_sole_elements(sole); e++) {
            const double at[2] = {kit.input.position[0][0] + c * mild_sole_x(sole)[e] +
                                      s * KIT_SOLE_Z,
                                  kit.input.position[0][1] + mild_sole_y(sole)[e]};
            most = fmax(most, mild_ground_imprint_at(kit.ground, at[0], at[1]));
        }
        deepest = fmax(deepest, kit.result.foot[0].depth_max);
        kit_close(&kit);
    }
    assert_true(deepest > 0.01);
    assert_true(most == 0.0);
    mild_sole_destroy(sole);
}

/* A tilted plate that goes forward and down passes through its own print, which takes nothing from
 * the ground under it and strikes none of it twice: it bears what it bears where no print stays. */
TEST(test_own_trail) {
    enum { WAY = 80 };
    MildSole *sole = kit_plate(8, 4);
    MildMaterial m = kit_preset("sand_loose");
    m.model = MILD_MODEL_MILD_MERGED;
    const double c = cos(0.15), s = sin(0.15), tilted[9] = {c, 0, s, 0, 1, 0, -s, 0, c};
    double mean[2] = {0.0};
    for (int print = 0; print < 2; print++) {
        Kit kit;
        prints_open(&kit, 1, sole, NULL, &m, 1e-3, print ? TILES : 0);
        memcpy(kit.input.rotation[0], tilted, sizeof tilted);
        kit.input.velocity[0][0] = kit.input.free_velocity[0] = 1.0;
        for (int k = 0; k < WAY; k++) {
            kit.input.position[0][0] = 1e-3 * k;
            mean[print] += move_to(&kit, 1e-3 * k - 0.01) / WAY;
        }
        kit_close(&kit);
    }
    assert_true(mean[0] > 100.0);
    expect_near("mean force with its print, by that without", mean[1] / mean[0], 1.0, 0.02);
    mild_sole_destroy(sole);
}

/* Dragged at 5 mm into its imprint of 20 mm, a foot is carried by what is not over the imprint yet,
 * along x as along y, forward and backward, step by step. */
TEST(test_into_a_print) {
    enum { DRAG = 240 };
    static double force[4][DRAG];
    MildSole *sole = kit_plate(2, 2);
    MildMaterial sand = mild_material_default();
    for (int axis = 0; axis < 4; axis++) {
        const double side = axis < 2 ? 1 : -1;
        Kit kit;
        prints_open(&kit, 1, sole, NULL, &sand, 1e-3, TILES);
        double *at = kit.input.position[0];
        at[0] = at[1] = 0.0;
        for (int s = 0; s <= 40; s++) {
            move_to(&kit, s <= 20 ? 1e-3 * s : 1e-3 * (40 - s));
        }
        move_to(&kit, -0.02);
        at[axis % 2] = -0.08 * side;
        for (int s = 0; s <= 50; s++) {
            move_to(&kit, 1e-4 * s);
        }
        kit.input.velocity[0][2] = kit.input.free_velocity[2] = 0.0;
        kit.input.velocity[0][axis % 2] = kit.input.free_velocity[axis % 2] = 0.5 * side;
        for (int s = 0; s < DRAG; s++) {
            kit_solve(&kit);
            force[axis][s] = kit.result.foot[0].force[2];
            expect_entry("force of the same drag along another axis", s, force[axis][s],
                         force[0][s], 1e-9);
            kit_advance(&kit);
            assert_true(s != 160 || force[axis][s] < 1e-9); /* wholly over the imprint */
        }
        assert_true(force[axis][0] > 3.0 && force[axis][120] > 1.0);
        kit_close(&kit);
    }
    mild_sole_destroy(sole);
}

/* Random feet on random, level and uneven, ground that remembers: pressed, lifted in their prints,
 * moved aside and turned there, pressed again. Whenever nothing is loaded, the ground has not given
 * energy since the last time. */
TEST(test_passive) {
    uint64_t random = 52;
    MildSole *sole = kit_sole(0, 77);
    static const double steps[3] = {0.25e-3, 1e-3, 5e-3};
    double worst = -INFINITY;
    int cycles = 0, inside = 0;
    for (int draw = 0; draw < kit_draws(400); draw++) {
        MildMaterial m = kit_material(&random);
        m.refill = 0.3 * (draw % 4);
        MildMapDef def = mild_map_def_default();
        def.kind = draw % 2 ? MILD_MAP_WAVES : MILD_MAP_FLAT;
        def.wavelength = kit_uniform(&random, 0.2, 1.0);
        MildError error;
        MildMap *map = mild_map_create(&def, &error);
        Kit kit;
        double dt = steps[kit_index(&random, 3)];
        prints_open(&kit, 1, sole, NULL, &m, dt, 32);
        kit.terrain.map = map;
        kit_random_state(&kit, &random);
        kit.input.position[0][2] += 0.08;
        double work = 0.0, taken = 0.0, force[1][3], spin = kit_uniform(&random, 3.0, 12.0),
               swing = kit_uniform(&random, 0.2, 1.5);
        double weight = kit.mass[0] * KIT_GRAVITY;
        for (int s = 0; s < (int)(1.2 / dt); s++) {
            double t = s * dt, before[6], lift = kit.input.position[0][2] + KIT_SOLE_Z + 0.01;
            /* carried by a weak spring that hangs near the surface and moves up and down, aside and
             * around */
            force[0][2] =
                weight * (1.0 - 12.0 * lift + 0.9 * sin(spin * t) - 0.3 * kit.input.velocity[0][2]);
            force[0][0] = weight * (swing * sin(5.0 * t) - 0.5 * kit.input.velocity[0][0]);
            force[0][1] = weight * (swing * cos(3.0 * t) - 0.5 * kit.input.velocity[0][1]);
            memcpy(before, kit.input.velocity[0], sizeof before);
            kit_step(&kit, (const double(*)[3])force);
            const double w = kit_work(&kit, 0, before);
            work += w;
            taken += fabs(w);
            if (!kit_lifted(&kit)) {
                continue;
            }
            int deep = 0;
            for (int e = 0; e < 77; e++) {
                deep += mild_scratch_elements(kit.scratch, 0).depth[e] > 0.0;
            }
            if (taken > 0.0) {
                cycles++;
                inside += deep > 0;
                worst = fmax(worst, work);
                work = taken = 0.0;
            }
        }
        kit_close(&kit);
        mild_map_destroy(map);
    }
    expect_below("energy gained in a cycle [J]", worst, 1e-9);
    assert_true(cycles > kit_draws(10000) && inside > kit_draws(300)); /* inside a print */
    mild_sole_destroy(sole);
}

/* When the tiles are used up the oldest prints go; the block keeps its size and nothing is
 * allocated. */
TEST(test_bounded) {
    MildSole *left = kit_sole(0, 77), *right = kit_sole(1, 77);
    MildMaterial sand = mild_material_default();
    const MildSole *soles[2] = {left, right};
    print_message("two feet with %d tiles: %zu bytes\n", TILES,
                  mild_ground_bytes_imprints(soles, 2, TILES));
    Kit kit;
    prints_open(&kit, 1, left, NULL, &sand, 1e-3, TILES);
    int kept = 0, newest = 0;
    enum { STEPS = 60 };
    for (int n = 0; n < STEPS; n++) {
        kit.input.position[0][0] = 0.31 * n;
        for (int s = 0; s <= 20; s++) {
            move_to(&kit, 1e-3 * s);
        }
        for (int s = 20; s >= -2; s--) {
            move_to(&kit, 1e-3 * s);
        }
    }
    for (int n = 0; n < STEPS; n++) {
        int found =
            mild_ground_imprint_at(kit.ground, 0.31 * n + 0.05, kit.input.position[0][1]) > 0.0;
        kept += found;
        newest += found && n >= STEPS - 6;
    }
    print_message("%d tiles keep %d of %d prints, the newest %d of 6 among them\n", TILES, kept,
                  STEPS, newest);
    assert_true(kept >= 8 && kept < 20 && newest == 6);
    kit_close(&kit);
    mild_sole_destroy(left);
    mild_sole_destroy(right);
}

/* ---- the material under a loaded foot becomes another one ---- */

/* One of CHANGED_STRIDE pairs. */

enum { CHANGED = 256, CHANGED_STEPS = 250, CHANGED_STRIDE = 151 };

/* Every preset in every model of these elements; sands of merged cones wear. */
static int changed_materials(MildMaterial *list, const MildSole *raster, int concentric) {
    int count = 0;
    for (int model = 0; model < MILD_MODEL_RIGID; model++) {
        const MildModelInfo *info = mild_model_info((MildModel)model);
        for (int p = 0; p < mild_material_preset_count() && info->concentric == concentric; p++) {
            const MildMaterial paper = kit_preset(mild_material_preset_name(p));
            MildMaterial *m = &list[count];
            *m = paper;
            const int matched = model == MILD_MODEL_MILD ||
                                !mild_model_match((MildModel)model, &paper, raster, 40.0, m, NULL);
            m->slip_length = model == MILD_MODEL_MILD_MERGED && m->recovery == 0.0 ? 2e-3 : 0.0;
            m->grip = m->slip_length > 0.0 ? 0.1 : 0.0;
            count += matched;
        }
        for (int p = 0; p < MILD_MODEL_PRESETS && info->presets[p] && !concentric; p++) {
            count += mild_material_preset(info->presets[p], &list[count]);
        }
    }
    assert_true(count <= CHANGED);
    return count;
}

static void changed_lead(Kit *kit, double last[6], const double twist[6]) {
    double turn[3];
    kit_led(kit, last, twist);
    for (int k = 0; k < 3; k++) {
        kit->input.position[0][k] += kit->input.dt * twist[k];
        turn[k] = kit->input.dt * twist[3 + k];
    }
    kit_rotate(kit->input.rotation[0], turn);
}

/* Presses, tilts and drags the foot, lifts it a little, and ends at rest. */
static void changed_press(Kit *kit, uint64_t *random) {
    const double depth = kit_spread(random, 2e-3, 0.15), back = kit_uniform(random, -1.0, 1.0);
    double twist[6], last[6] = {0};
    memset(kit->A, 0, sizeof kit->A);
    for (int k = 0; k < 6; k++) {
        twist[k] = kit_uniform(random, -1.0, 1.0) * (k < 3 ? 0.3 : 1.0);
    }
    twist[2] = -depth / (40 * kit->input.dt);
    for (int s = 0; s < 40; s++) {
        changed_lead(kit, last, twist);
    }
    memset(twist, 0, sizeof twist);
    twist[2] = back > 0.0 ? back * back * back * depth / (10 * kit->input.dt) : 0.0;
    for (int s = 0; s < 10; s++) {
        changed_lead(kit, last, twist);
    }
    memset(twist, 0, sizeof twist);
    changed_lead(kit, last, twist);
    changed_lead(kit, last, twist);
}

/* [J] What a copy of the ground gives back to a foot that is lifted out of it, so slowly that
 * nothing is damped. force: [N] at rest. */
static double changed_stored(const Kit *kit, double *force) {
    Kit own = *kit;
    double last[6] = {0}, twist[6] = {0}, stored = 0.0, way = 1e-9;
    own.ground = memcpy(aligned_alloc(64, kit->bytes), kit->ground, kit->bytes);
    own.input.inverse_inertia = own.A;
    memset(own.A, 0, sizeof own.A);
    own.input.dt = 100.0;
    for (int s = 0; s < 80; s++, way = fmin(1.25 * way, 0.02)) {
        twist[2] = way / own.input.dt;
        stored += kit_led(&own, last, twist);
        own.input.position[0][2] += way;
        *force = s == 0 ? own.result.foot[0].force[2] : *force;
    }
    while (!kit_lifted(&own)) {
        stored += kit_led(&own, last, twist);
        own.input.position[0][2] += way;
    }
    free(own.ground);
    return stored;
}

/* Leads the foot out of the ground, and another foot's ground that remembers nothing down with it:
 * both meet the same. */
static double changed_returns(Kit *kit, const MildGround *fresh) {
    double last[6] = {0}, twist[6] = {0}, worst = 0.0;
    MildGround *own = kit->ground;
    twist[2] = 1.0;
    memset(kit->A, 0, sizeof kit->A);
    while (!kit_lifted(kit) || kit->input.position[0][2] < 0.2) {
        changed_lead(kit, last, twist);
    }
    twist[2] = -1.0;
    for (double up = kit->input.position[0][2]; up > 0.02; up -= kit->input.dt) {
        Kit other = *kit;
        double forked[6];
        memcpy(forked, last, sizeof forked);
        other.ground = (MildGround *)(uintptr_t)fresh;
        other.input.inverse_inertia = other.A;
        kit_led(&other, forked, twist);
        changed_lead(kit, last, twist);
        const double wanted = other.result.foot[0].force[2];
        worst = fmax(worst, fabs(kit->result.foot[0].force[2] - wanted) / (1.0 + wanted));
    }
    kit->ground = own;
    return worst;
}

/* What the worst of all pairs does. */
typedef struct {
    double rise; /* [-] of the force at rest */
    double gain; /* [-] energy held, by what was held before */
    double work; /* [-] done on a free body beyond that, by the energy of the system */
    double deep; /* [m] where it is in the end */
    double back; /* [-] force after lift-off, against ground that remembers nothing */
} Changed;

static void changed_pair(const MildMaterial *from, const MildMaterial *to, MildSole *sole,
                         const MildMap *map, int tiles, uint64_t *random, Changed *worst) {
    Kit kit;
    double before, after;
    prints_open(&kit, 1, sole, NULL, from, 2e-3, tiles);
    kit.terrain.map = map;
    changed_press(&kit, random);
    const double held = changed_stored(&kit, &before);
    const MildTerrain old = kit.terrain;
    kit.terrain.materials[0] = *to;
    mild_ground_change(kit.ground, &old, &kit.terrain, kit.scratch);
    const double holds = changed_stored(&kit, &after);
    worst->rise = fmax(worst->rise, (after - before) / (1.0 + before));
    worst->gain = fmax(worst->gain, (holds - held) / (1e-3 + held));

    kit.mass[0] = (1.0 + before) * kit_uniform(random, 0.2, 1.5) / KIT_GRAVITY;
    kit.inertia[0] = 1e3 * kit.mass[0]; /* it does not topple */
    for (int k = 0; k < 6; k++) {
        kit.input.velocity[0][k] = k < 3 ? kit_uniform(random, -0.3, 0.3) : 0.0;
    }
    for (int k = 0; k < 3; k++) { /* it was at rest in the middle of the last step */
        kit.input.position[0][k] += 0.5 * kit.input.dt * kit.input.velocity[0][k];
    }
    double work = 0.0, most = 0.0, fell = kit.input.position[0][2];
    const double system = held + kit_kinetic(&kit, kit.input.velocity[0]);
    for (int s = 0; s < CHANGED_STEPS; s++) {
        double twist[6];
        memcpy(twist, kit.input.velocity[0], sizeof twist);
        kit_inverse_inertia(&kit);
        kit_free(&kit, NULL);
        kit_solve(&kit);
        work += kit_work(&kit, 0, twist);
        most = fmax(most, work);
        kit_advance(&kit);
    }
    fell = fmax(fell - kit.input.position[0][2], 0.0);
    worst->work =
        fmax(worst->work, (most - held) / (1e-3 + system + kit.mass[0] * KIT_GRAVITY * fell));
    worst->deep = fmax(worst->deep, -KIT_SOLE_Z - kit.input.position[0][2]);
    if (tiles == 0) {
        MildGround *fresh = mild_ground_init(aligned_alloc(64, kit.bytes), kit.soles, 1);
        worst->back = fmax(worst->back, changed_returns(&kit, fresh));
        free(fresh);
    }
    kit_close(&kit);
}

/* A load is nowhere pushed up by more than before, and no change gives it energy. The new ground
 * bears it, which a foot that has lifted off finds as if there had been no other. */
TEST(test_changed_material) {
    static MildMaterial list[CHANGED];
    MildSole *sole = kit_plate(3, 2), *concentric = mild_sole_concentric(sole, NULL);
    MildMapDef def = mild_map_def_default();
    def.kind = MILD_MAP_WAVES;
    def.amplitude = 0.02;
    MildMap *map = mild_map_create(&def, NULL);
    uint64_t random = 65;
    Changed worst = {0};
    int pairs = 0;
    for (int one = 0; one < 2; one++) {
        const int count = changed_materials(list, sole, one);
        for (int from = 0; from < count; from++) {
            for (int to = from % CHANGED_STRIDE; to < count; to += CHANGED_STRIDE, pairs++) {
                changed_pair(&list[from], &list[to], one ? concentric : sole,
                             pairs % 4 == 3 ? map : NULL, pairs % 2 ? TILES : 0, &random, &worst);
            }
        }
    }
    expect_below("rise of the force at rest", worst.rise, 1e-6);
    expect_below("rise of the energy held", worst.gain, 0.01);
    expect_below("work beyond it, by the system's energy", worst.work, 0.01);
    expect_below("at last [m]", worst.deep, 1.5); /* the deepest bed lies 1 m deep */
    expect_below("the next step", worst.back, 1e-9);
    mild_map_destroy(map);
    mild_sole_destroy(concentric);
    mild_sole_destroy(sole);
}

TEST_MAIN(NULL, NULL)
