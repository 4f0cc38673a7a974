/* A rigid body falls out of the air, on one or two feet or covered with elements. The ground has
 * stored nothing, so its work on the body is never above 0, but for bodies of some grams that
 * bounce within one step. Bodies and materials are those of robots, or anything that a file may
 * say: 1 g to 100 t, numbers at the ends of their ranges. Covered are boxes, capsules, wedges and
 * bodies of several parts, on every model and terrain, with and without imprints. Arguments: number
 * of falls of each kind (default 300) and the first seed (default 1); docs/testing.md says how many
 * ran. */
#include "surface_kit.h"

#define TURN_MOST 0.1 /* [rad] in a step; beyond it the way of a foot is not its twist */

static int falls = 300;
static uint64_t first = 1;

/* Seeds of bodies of 8 to 170 g that gain 2 to 9 % of their energy where energy.c lets friction
 * give 8 % of what a step's impulses would give to a body at rest: they bounce within one step. */
static const uint64_t gained[] = {5600196899747356623u, 11946568640844011236u,
                                  11528350181609327934u, 17625946322630040638u};

enum { ROBOT, ANY, COVERED, KINDS };

typedef struct {
    Kit kit;
    MildSole *sole;
    int feet;
    double mass;        /* [kg] */
    double inertia;     /* [kg m^2] of a ball */
    double lever[2][3]; /* [m] centre of mass to foot, in the frame of the body */
    double center[3];   /* [m] world */
    double rotation[9];
    double velocity[3]; /* [m/s] of the centre of mass */
    double spin[3];     /* [rad/s] world */
} Body;

static int choose(uint64_t *random, int count) {
    uint64_t x = *random += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return (int)((x ^ (x >> 31)) % (uint64_t)count);
}

/* A third of the numbers: an end of the range or anything in it. */
static void draw_fields(uint64_t *random, MildMaterial *m) {
    for (int i = 0; i < mild_material_field_count - 5; i++) {
        const MildField *field = &mild_material_fields[i];
        if (field->type != MILD_FIELD_DOUBLE || choose(random, 3)) {
            continue;
        }
        const int how = choose(random, 4);
        double value = how == 0 ? field->min : field->max;
        if (how == 2 || (how == 3 && field->min < 0)) {
            value = kit_uniform(random, field->min, field->max);
        } else if (how == 3) {
            value = kit_spread(random, fmax(field->min, field->max * 1e-9), field->max);
        }
        *(double *)(void *)((char *)m + field->offset) = value;
    }
}

static MildMaterial draw_material(uint64_t *random, int kind) {
    MildMaterial m;
    mild_material_preset(mild_material_preset_name(choose(random, mild_material_preset_count())),
                         &m);
    m.k_pen = kit_spread(random, 8, 1400);
    m.sigma_cone = kit_spread(random, 1e4, 2.4e5);
    m.alpha = kit_uniform(random, 0.698, 1.31);
    m.nu = kit_uniform(random, 0.8, 2.4);
    m.c_g = kit_uniform(random, -1.4, 4.6);
    m.c_d = kit_uniform(random, -6, 28);
    m.phi = kit_uniform(random, 0.5, 0.64);
    m.mu = kit_uniform(random, 0.2, 1.3);
    m.recovery = choose(random, 3) ? kit_uniform(random, 0, 1) : choose(random, 2);
    m.bed_depth = kit_uniform(random, 0.1, 0.15);
    if (kind == ANY) {
        draw_fields(random, &m);
    }
    uint64_t own = *random; /* of slip: the seeds in `gained` keep their bodies */
    m.slip_length = kind == ANY && choose(&own, 2) ? kit_spread(&own, 1e-4, 1) : 0;
    m.regain_length = kit_spread(&own, 1e-4, 1);
    m.grip = choose(&own, 2) ? kit_uniform(&own, 0, 1) : 0;
    m.refill = choose(&own, 2) ? kit_uniform(&own, 0, 1) : 0;
    m.slip_growth = choose(&own, 2) ? kit_uniform(&own, 0, 1) : 0;
    m.passive = 1;
    return m;
}

static MildSole *draw_sole(uint64_t *random) {
    const double length = kit_spread(random, 0.02, 0.3), width = kit_spread(random, 0.02, 0.15);
    const double x = length / 2, y = width / 2;
    double pitch = choose(random, 4) ? KIT_PITCH : kit_spread(random, 0.004, 0.06);
    pitch = fmax(pitch, sqrt(length * width / 3000));
    const double outline[8] = {-x, -y, x, -y, x, y, -x, y};
    const MildSoleDef def = {
        .outline = outline, .points = 4, .pitch = pitch, .sole_z = choose(random, 2) ? -0.05 : 0};
    MildError error = {0};
    return mild_sole_create(&def, &error);
}

/* Bool: material and sole of a fall. Refused numbers and soles without an element are no falls. */
static int draw_ground(uint64_t *random, int kind, MildMaterial *m, MildSole **sole) {
    MildError error = {0};
    *m = draw_material(random, kind);
    if (mild_material_check(m, &error) != MILD_OK || !(*sole = draw_sole(random))) {
        return 0;
    }
    const MildModel model = (MildModel)(choose(random, 3) ? 0 : choose(random, 6));
    MildMaterial rival = *m;
    int good = !model || mild_model_match(model, m, *sole, kit_uniform(random, 5, 300), &rival,
                                          &error) == MILD_OK;
    rival.passive = 1;
    good = good && mild_material_check(&rival, &error) == MILD_OK;
    *m = rival;
    MildSole *raster = *sole;
    if (good && mild_model_is_concentric(model)) {
        *sole = mild_sole_concentric(raster, &error);
        mild_sole_destroy(raster);
    } else if (!good) {
        mild_sole_destroy(raster);
    }
    return good;
}

/* World vector from the centre of mass to a point of the body. */
static void body_turn(const Body *b, const double *point, double *out) {
    for (int k = 0; k < 3; k++) {
        const double *row = b->rotation + 3 * k;
        out[k] = row[0] * point[0] + row[1] * point[1] + row[2] * point[2];
    }
}

static double lowest(const Body *b) {
    double low = INFINITY;
    for (int f = 0; f < b->feet; f++) {
        for (int e = 0; e < mild_sole_elements(b->sole); e++) {
            const double point[3] = {b->lever[f][0] + mild_sole_x(b->sole)[e],
                                     b->lever[f][1] + mild_sole_y(b->sole)[e],
                                     b->lever[f][2] + mild_sole_z(b->sole)};
            double at[3];
            body_turn(b, point, at);
            low = fmin(low, at[2]);
        }
    }
    return low;
}

static void draw_levers(Body *b, uint64_t *random) {
    for (int f = 0; f < 2; f++) {
        for (int k = 0; k < 3; k++) {
            b->lever[f][k] = k == 2 ? kit_uniform(random, -0.8, 0) : kit_uniform(random, -0.4, 0.4);
        }
    }
    if (!choose(random, 4)) {
        memcpy(b->lever[1], b->lever[0], sizeof b->lever[0]);
    }
    if (!choose(random, 3)) {
        memset(b->lever, 0, sizeof b->lever);
    }
}

/* Steep, fast, or both. */
static void draw_motion(Body *b, uint64_t *random) {
    for (int k = 0; k < 3; k++) {
        b->velocity[k] = kit_uniform(random, k == 2 ? -3 : -2, k == 2 ? 0 : 2);
    }
    kit_vector(random, 1, b->spin);
    if (!choose(random, 5)) {
        double turn[3];
        kit_vector(random, 3, turn);
        kit_rotate(b->rotation, turn);
    }
    if (!choose(random, 8)) {
        b->velocity[0] *= 50;
        b->velocity[2] *= 7;
    }
}

/* Bool: there is a body. */
static int body_draw(Body *b, uint64_t *random, int kind) {
    MildMaterial m;
    memset(b, 0, sizeof *b);
    if (!draw_ground(random, kind, &m, &b->sole)) {
        return 0;
    }
    b->feet = 1 + choose(random, 2);
    const int tiles = choose(random, 2) ? 0 : 8 * (1 + choose(random, 4));
    const double height = kit_uniform(random, -1, 1);
    b->mass = kit_spread(random, 0.3, 60);
    b->inertia = b->mass * kit_spread(random, 4e-4, 0.04);
    const double dt = kit_spread(random, 5e-4, 5e-3);
    if (kind == ANY) {
        b->mass = kit_spread(random, 1e-3, 1e5);
        b->inertia = b->mass * kit_spread(random, 1e-6, 1);
    }
    kit_open(&b->kit, b->feet, b->sole, b->sole, &m, dt);
    kit_prints(&b->kit, tiles);
    b->kit.terrain.height = height;
    for (int k = 0; k < 3; k++) {
        b->rotation[4 * k] = 1;
    }
    draw_levers(b, random);
    kit_uniform(random, 0, 0.3); /* keeps the numbers of the seeds above */
    draw_motion(b, random);
    b->center[2] = height - lowest(b) + kit_spread(random, 1e-4, 0.5);
    return 1;
}

static void body_close(Body *b) {
    kit_close(&b->kit);
    mild_sole_destroy(b->sole);
}

/* Column j of the Jacobian of a foot: its twist when the body moves along (j < 3) or turns about an
 * axis. */
static void body_column(const double *lever, int j, double *twist) {
    memset(twist, 0, 6 * sizeof *twist);
    twist[j] = 1;
    if (j >= 3) {
        kit_cross(twist + 3, lever, twist);
    }
}

/* Pose, twists and inverse inertia of the feet. lever: world. */
static void body_input(Body *b, double lever[2][3]) {
    MildContactInput *in = &b->kit.input;
    const int n = 6 * b->feet;
    memset(b->kit.A, 0, sizeof b->kit.A);
    for (int f = 0; f < b->feet; f++) {
        double swing[3];
        body_turn(b, b->lever[f], lever[f]);
        kit_cross(b->spin, lever[f], swing);
        memcpy(in->rotation[f], b->rotation, sizeof b->rotation);
        for (int k = 0; k < 3; k++) {
            in->position[f][k] = b->center[k] + lever[f][k];
            in->velocity[f][k] = b->velocity[k] + swing[k];
            in->velocity[f][3 + k] = b->spin[k];
        }
        memcpy(in->free_velocity + 6 * f, in->velocity[f], 6 * sizeof(double));
        in->free_velocity[6 * f + 2] -= KIT_GRAVITY * in->dt;
    }
    for (int j = 0; j < 6; j++) {
        double column[12];
        for (int f = 0; f < b->feet; f++) {
            body_column(lever[f], j, column + 6 * f);
        }
        for (int i = 0; i < n * n; i++) {
            in->inverse_inertia[i] +=
                column[i / n] * column[i % n] / (j < 3 ? b->mass : b->inertia);
        }
    }
}

/* Semi-implicit; returns the angle of the step [rad]. */
static double body_move(Body *b, double lever[2][3]) {
    const double dt = b->kit.input.dt;
    double turn[3];
    b->velocity[2] -= KIT_GRAVITY * dt;
    for (int f = 0; f < b->feet; f++) {
        const MildFootResult *foot = &b->kit.result.foot[f];
        double moment[3];
        kit_cross(lever[f], foot->force, moment);
        for (int k = 0; k < 3; k++) {
            b->velocity[k] += dt / b->mass * foot->force[k];
            b->spin[k] += dt / b->inertia * (foot->torque[k] + moment[k]);
        }
    }
    for (int k = 0; k < 3; k++) {
        b->center[k] += dt * b->velocity[k];
        turn[k] = dt * b->spin[k];
    }
    kit_rotate(b->rotation, turn);
    return sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
}

static double body_energy(const Body *b) {
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        sum += b->mass * b->velocity[k] * b->velocity[k] + b->inertia * b->spin[k] * b->spin[k];
    }
    return sum / 2;
}

typedef struct {
    int unsolved; /* steps */
    double turn;  /* [rad] most in a step */
    double gain;  /* [-] most work of the ground so far, as a share of the most kinetic energy */
} Fall;

static Fall body_fall(Body *b, int steps) {
    Fall fall = {0};
    double work = 0, energy = body_energy(b), lever[2][3];
    for (int s = 0; s < steps; s++) {
        body_input(b, lever);
        kit_solve(&b->kit);
        fall.unsolved += !b->kit.result.converged;
        for (int f = 0; f < b->feet; f++) {
            work += kit_work(&b->kit, f, b->kit.input.free_velocity + 6 * f);
        }
        mild_ground_advance(b->kit.ground, &b->kit.terrain, &b->kit.input, b->kit.scratch,
                            &b->kit.result);
        fall.turn = fmax(fall.turn, body_move(b, lever));
        energy = fmax(energy, body_energy(b));
        fall.gain = fmax(fall.gain, work / energy);
    }
    return fall;
}

typedef struct {
    int falls, refused, steps, unsolved; /* unsolved: falls with such a step, not judged */
    int touched;                         /* covered bodies that came down */
    int spun, spun_gained;               /* falls that turn by more than TURN_MOST in a step */
    double spun_worst, spun_least;       /* [-], [rad] smallest such turn that gained */
    double worst;                        /* [-] of the others */
    uint64_t seed;                       /* of the worst */
} Falls;

static void judge(Falls *all, const Fall *fall, int steps, uint64_t seed) {
    all->falls++;
    all->steps += steps;
    if (fall->unsolved) {
        all->unsolved++;
    } else if (fall->turn > TURN_MOST) {
        all->spun++;
        all->spun_worst = fmax(all->spun_worst, fall->gain);
        if (fall->gain > 1e-9) {
            all->spun_gained++;
            all->spun_least = fmin(all->spun_least, fall->turn);
        }
    } else if (fall->gain > all->worst) {
        all->worst = fall->gain;
        all->seed = seed;
    }
}

static void fall_once(uint64_t seed, int kind, Falls *all) {
    Body body;
    uint64_t random = seed;
    if (!body_draw(&body, &random, kind)) {
        all->refused++;
        return;
    }
    const int steps = 60 + choose(&random, 60);
    const Fall fall = body_fall(&body, steps);
    judge(all, &fall, steps, seed);
    body_close(&body);
}

/* ---- bodies covered with elements ---- */

typedef struct {
    Kit kit;
    MildSole *sole;
    MildMap *map;
} Covered;

static MildMaterial covered_material(uint64_t *random) {
    static const MildModel models[] = {
        MILD_MODEL_MILD,          MILD_MODEL_MILD,         MILD_MODEL_ECC_SPRING,
        MILD_MODEL_ECC_QUASI,     MILD_MODEL_ECC_QUASI_3D, MILD_MODEL_BEKKER,
        MILD_MODEL_HUNT_CROSSLEY, MILD_MODEL_MILD_MERGED,  MILD_MODEL_MILD_MERGED};
    MildMaterial m = kit_material(random);
    m.model = (int)models[kit_index(random, 9)];
    if (m.model == MILD_MODEL_MILD_MERGED) {
        m.recovery = kit_index(random, 2) ? 0.0 : m.recovery;
        m.slip_length = kit_index(random, 2) ? pow(10.0, kit_uniform(random, -3.5, -1.0)) : 0.0;
        m.regain_length = pow(10.0, kit_uniform(random, -4.0, -2.0));
        m.grip = kit_index(random, 2) ? kit_uniform(random, 0.0, 0.3) : 0.0;
    }
    m.zeta = kit_uniform(random, 0.05, 1.5);
    if (m.model == MILD_MODEL_BEKKER || m.model == MILD_MODEL_HUNT_CROSSLEY) {
        m.exponent = kit_uniform(random, 0.4, 2.0);
        m.k_c = kit_uniform(random, 0.0, 50e3);
        m.k_phi = pow(10.0, kit_uniform(random, 4.5, 6.0));
        uint64_t own = *random;
        if (kit_index(&own, 3) == 0) { /* of a small body the modulus is below 0 then */
            m.k_c = kit_uniform(&own, -0.1, 0.0) * m.k_phi;
        }
        m.cohesion = kit_uniform(random, 0.0, 10e3);
        m.shear_length = kit_uniform(random, 0.001, 0.05);
        m.dissipation = kit_uniform(random, 0.0, 5.0);
    }
    if (kit_index(random, 3) == 0) {
        m.mu = m.k_drift = m.b_drift = 0.0; /* nothing but the normal force takes energy */
    }
    m.passive = 1;
    return m;
}

static MildSole *covered_sole(uint64_t *random) {
    static double vertices[18];
    MildShape shapes[3];
    const int count = 1 + kit_index(random, 3);
    for (int i = 0; i < count; i++) {
        double size[3];
        for (int k = 0; k < 3; k++) {
            size[k] = kit_spread(random, 0.02, 0.15);
        }
        switch (kit_index(random, 4)) {
        case 0: shapes[i] = surface_box(size[0], size[1], size[2]); break;
        case 1: shapes[i] = surface_capsule(0.5 * size[0], size[1]); break;
        case 2: shapes[i] = surface_sphere(size[0]); break;
        default: shapes[i] = surface_wedge(size[0], size[1], size[2], vertices); break;
        }
        kit_vector(random, 0.1, shapes[i].pos);
        kit_vector(random, 1.0, shapes[i].quat + 1);
        shapes[i].quat[0] = kit_uniform(random, -1.0, 1.0);
    }
    return surface_make(shapes, count, kit_spread(random, 0.015, 0.05));
}

/* Level, uneven, in patches, or both. */
static void covered_terrain(Covered *b, uint64_t *random) {
    static const MildMapKind shapes[4] = {MILD_MAP_SLOPE, MILD_MAP_STEPS, MILD_MAP_WAVES,
                                          MILD_MAP_ROUGH};
    const int kind = kit_index(random, 4);
    b->kit.terrain.height = kit_uniform(random, -1, 1);
    if (kind == 0) {
        return;
    }
    MildMapDef def = mild_map_def_default();
    def.kind = kind & 1 ? (int)shapes[kit_index(random, 4)] : MILD_MAP_FLAT;
    def.cell = kit_uniform(random, 0.01, 0.03);
    def.size = 1.0;
    def.amplitude = kit_uniform(random, 0.0, 0.03);
    def.wavelength = kit_uniform(random, 0.1, 0.8);
    def.slope = kit_uniform(random, -0.4, 0.4);
    def.seed = (uint64_t)kit_index(random, 1000);
    if (kind & 2) {
        while (b->kit.terrain.material_count < 4) {
            b->kit.terrain.materials[b->kit.terrain.material_count++] = covered_material(random);
        }
        def.patches = MILD_PATTERN_STRIPES + kit_index(random, 2);
        def.patch_size = kit_uniform(random, 0.03, 0.2);
        def.patch_count = 3;
        def.border = kit_index(random, 4) ? kit_uniform(random, 0.01, def.patch_size) : 0.0;
    }
    MildError error = {0};
    b->map = mild_map_create(&def, &error);
    if (!b->map || mild_terrain_set_map(&b->kit.terrain, b->map, &error) != MILD_OK) {
        fail_msg("%s", error.text);
    }
}

/* Lowest point of the body over the ground under it. */
static double clearance(const Covered *b) {
    const double *R = b->kit.input.rotation[0], *p = b->kit.input.position[0];
    double least = INFINITY;
    for (int e = 0; e < mild_sole_elements(b->sole); e++) {
        const double in[3] = {mild_sole_x(b->sole)[e], mild_sole_y(b->sole)[e],
                              mild_sole_surface_z(b->sole)[e]};
        double at[3];
        for (int k = 0; k < 3; k++) {
            at[k] = p[k] + R[3 * k] * in[0] + R[3 * k + 1] * in[1] + R[3 * k + 2] * in[2];
        }
        least = fmin(least, at[2] - mild_terrain_height_at(&b->kit.terrain, at[0], at[1]));
    }
    return least;
}

static void covered_draw(Covered *b, uint64_t *random) {
    memset(b, 0, sizeof *b);
    b->sole = covered_sole(random);
    const MildMaterial m = covered_material(random);
    kit_open(&b->kit, 1, b->sole, NULL, &m, kit_spread(random, 5e-4, 2e-3));
    kit_prints(&b->kit, kit_index(random, 2) ? 0 : 8 * (1 + kit_index(random, 8)));
    covered_terrain(b, random);
    Kit *kit = &b->kit;
    kit->mass[0] = kit_spread(random, 0.3, 40.0);
    kit->inertia[0] = kit->mass[0] * kit_spread(random, 1e-3, 0.02);
    kit_vector(random, 0.05, kit->center[0]);
    double turn[3];
    kit_vector(random, 3.0, turn);
    kit_rotate(kit->input.rotation[0], turn);
    kit_vector(random, 1.0, kit->input.position[0]);
    kit->input.position[0][2] += kit_spread(random, 1e-4, 0.2) - clearance(b);
    kit_vector(random, 1.5, kit->input.velocity[0]);
    kit->input.velocity[0][2] -= 1.5;
    kit_vector(random, 8.0, kit->input.velocity[0] + 3);
}

static void covered_close(Covered *b) {
    kit_close(&b->kit);
    mild_sole_destroy(b->sole);
    mild_map_destroy(b->map);
}

static void covered_fall(uint64_t seed, Falls *all) {
    Covered body;
    uint64_t random = seed;
    covered_draw(&body, &random);
    Kit *kit = &body.kit;
    const int steps = 100 + kit_index(&random, 200);
    double work = 0.0, energy = kit_kinetic(kit, kit->input.velocity[0]);
    Fall fall = {0};
    int touched = 0;
    for (int s = 0; s < steps; s++) {
        kit_inverse_inertia(kit);
        kit_free(kit, NULL);
        kit_solve(kit);
        fall.unsolved += !kit->result.converged;
        touched |= kit->result.foot[0].contacts > 0;
        work += kit_work(kit, 0, kit->input.free_velocity);
        kit_advance(kit);
        const double *V = kit->input.velocity[0];
        fall.turn = fmax(fall.turn, kit->input.dt * sqrt(V[3] * V[3] + V[4] * V[4] + V[5] * V[5]));
        energy = fmax(energy, kit_kinetic(kit, V));
        fall.gain = fmax(fall.gain, work / energy);
    }
    all->touched += touched;
    judge(all, &fall, steps, seed);
    covered_close(&body);
}

static void falls_print(const char *name, const Falls *all) {
    print_message(
        "%s: %d falls, %d steps, %d falls with an unsolved step, %d refused; most energy "
        "gained %.1e of the body's (seed %llu); %d turn by over %.1f rad in a step, %d of "
        "them gain, at most %.2g, from %.2g rad on\n",
        name, all->falls, all->steps, all->unsolved, all->refused, all->worst,
        (unsigned long long)all->seed, all->spun, TURN_MOST, all->spun_gained, all->spun_worst,
        all->spun_least);
}

TEST(falls_gain_nothing) {
    static const char *const names[KINDS] = {"robots", "anything", "covered bodies"};
    for (int kind = 0; kind < KINDS; kind++) {
        Falls all = {.spun_least = INFINITY};
        for (int i = 0; i < falls; i++) {
            const uint64_t seed = (first + (uint64_t)i) * 1000003u + 7919u;
            if (kind == COVERED) {
                covered_fall(seed, &all);
            } else {
                fall_once(seed, kind, &all);
            }
        }
        falls_print(names[kind], &all);
        assert_true((kind == COVERED ? all.touched : all.falls) > falls / 2);
        assert_true(all.unsolved <= 1 + all.falls / (kind == COVERED ? 100 : 200));
        assert_true(all.worst < 1e-9);
    }
}

/* They bounce within one step. docs/model.md section 17 derives that friction gives at most 32 % of
 * the kinetic energy there. */
TEST(a_bounce_within_a_step_gains_little) {
    Falls all = {.spun_least = INFINITY};
    for (size_t i = 0; i < sizeof gained / sizeof *gained; i++) {
        fall_once(gained[i], ANY, &all);
    }
    falls_print("light bodies", &all);
    assert_int_equal(all.falls, sizeof gained / sizeof *gained);
    assert_int_equal(all.unsolved + all.spun, 0);
    assert_true(all.worst < 0.1); /* 9.3 %; at most 32 % by the derivation */
}

int main(int argc, char **argv) {
    falls = argc > 1 ? atoi(argv[1]) : kit_draws(falls);
    if (argc > 2) {
        first = strtoull(argv[2], NULL, 10);
    }
    return run_cases(NULL, NULL);
}
