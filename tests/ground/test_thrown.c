/* Bodies thrown at and into the ground, far from any robot: free bodies of 1 to 60 kg with any
 * inertia and lever, some deep in the firm bed, and point masses on sticks. `ground_test_thrown
 * COUNT [FIRST]` runs other draws than `make test`; docs/model.md section 7 reports 3000. */
#include "ground_kit.h"

#include "ground/law/friction.h"
#include "ground/step/scratch.h"

#define SOLES 4

enum { DRAWS = 600 };

static int draws = DRAWS, first = 0;
static MildSole *soles[SOLES];

static int open_soles(void **state) {
    (void)state;
    soles[0] = kit_sole(0, 77);
    soles[1] = kit_plate(1, 1);
    soles[2] = kit_plate(2, 1);
    soles[3] = kit_plate(5, 3);
    return 0;
}

static int close_soles(void **state) {
    (void)state;
    for (int i = 0; i < SOLES; i++) {
        mild_sole_destroy(soles[i]);
    }
    return 0;
}

static void draw_open(Kit *kit, uint64_t *random) {
    static const double steps[4] = {0.25e-3, 1e-3, 2.5e-3, 5e-3};
    MildMaterial m = kit_material(random);
    const double dt = steps[kit_index(random, 4)];
    kit_open(kit, 1, soles[kit_index(random, SOLES)], NULL, &m, dt);
    kit_random_state(kit, random);
}

/* Half of them begin up to 0.3 m deep, the bed being at 0.1 to 0.15 m. */
static void draw_body(Kit *kit, uint64_t *random) {
    draw_open(kit, random);
    kit->mass[0] = kit_spread(random, 1.0, 60.0);
    kit->inertia[0] = kit->mass[0] * kit_spread(random, 1e-4, 0.3);
    kit_vector(random, 0.5, kit->center[0]);
    const double deep = kit_uniform(random, -0.05, 0.3), shallow = kit_uniform(random, -0.05, 0.01);
    kit->input.position[0][2] = -KIT_SOLE_Z - (kit_index(random, 2) ? deep : shallow);
    kit_vector(random, 3.0, kit->input.velocity[0]);
    kit_vector(random, 10.0, kit->input.velocity[0] + 3);
}

/* Gyration radius 3 to 100 mm, up to 1 m from the ankle. */
static void draw_stick(Kit *kit, uint64_t *random) {
    draw_open(kit, random);
    kit->mass[0] = kit_spread(random, 0.02, 5.0);
    kit->inertia[0] = kit->mass[0] * kit_spread(random, 1e-5, 1e-2);
    kit_vector(random, 0.3, kit->center[0]);
    kit->center[0][2] = kit_uniform(random, 0.0, 1.0);
    kit->input.position[0][2] = -KIT_SOLE_Z + kit_uniform(random, 0.1, 0.2);
    kit_vector(random, 2.0, kit->input.velocity[0]);
    kit_vector(random, 5.0, kit->input.velocity[0] + 3);
}

/* Bool: the foot goes on into the firm bed, deeper than ever, and feels no normal force. */
static int sinks_freely(const Kit *kit) {
    const MildElements elements = mild_scratch_elements(kit->scratch, 0);
    const double *deepest = mild_ground_depth_max(kit->ground, 0), *V = kit->result.velocity;
    const double bed = kit->terrain.materials[0].bed_depth;
    int count = 0;
    for (int e = 0; e < mild_sole_elements(kit->soles[0]); e++) {
        const double x = elements.point_x[e] - kit->input.position[0][0];
        const double y = elements.point_y[e] - kit->input.position[0][1];
        const double down = -(V[2] + V[3] * y - V[4] * x);
        const double middle = elements.depth[e] + 0.5 * kit->input.dt * down;
        count += down > 0.0 && middle > fmax(deepest[e], bed);
    }
    return count > 0 && !(kit->result.foot[0].force[2] > 0.0);
}

#define HARD 10

typedef struct {
    int steps, unsolved, falling, most; /* most iterations of a solved step */
    int hard, effort;                   /* steps of more than HARD iterations, and their sum */
    int cycles, draw;                   /* draw: of the worst */
    double worst; /* [-] energy gained from touch to lift-off, as a share of the body's before */
} Thrown;

static void throw_body(Kit *kit, Thrown *thrown, int draw, double seconds) {
    double work = 0.0, energy = 0.0;
    int missed = 0, touched = 0;
    for (int s = 0; s < (int)(seconds / kit->input.dt); s++) {
        double before[6];
        memcpy(before, kit->input.velocity[0], sizeof before);
        if (!touched) {
            energy = kit_kinetic(kit, before);
        }
        kit_inverse_inertia(kit);
        kit_free(kit, NULL);
        kit_solve(kit);
        thrown->falling += sinks_freely(kit);
        const int solved = kit->result.converged;
        thrown->steps++;
        thrown->unsolved += !solved;
        thrown->most =
            solved && kit->result.iterations > thrown->most ? kit->result.iterations : thrown->most;
        thrown->hard += kit->result.iterations > HARD;
        thrown->effort += kit->result.iterations > HARD ? kit->result.iterations : 0;
        missed += !solved;
        work += kit_work(kit, 0, before);
        kit_advance(kit);
        touched |= work != 0.0;
        if (!touched || !kit_lifted(kit)) {
            continue;
        }
        thrown->cycles++; /* closed */
        if (missed == 0 && work / energy > thrown->worst) {
            thrown->worst = work / energy;
            thrown->draw = draw;
        }
        work = 0.0;
        missed = touched = 0;
    }
}

static Thrown throw_all(const char *name, void (*open)(Kit *, uint64_t *), double seconds,
                        int count) {
    Thrown thrown = {.worst = -INFINITY};
    for (int draw = first; draw < first + count; draw++) {
        uint64_t random = (uint64_t)draw * 1000003u + 77;
        Kit kit;
        open(&kit, &random);
        throw_body(&kit, &thrown, draw, seconds);
        kit_close(&kit);
    }
    print_message(
        "%s: %d draws, %d steps: %d unsolved, at most %d iterations; %d without a force in "
        "the bed; %d steps of more than %d iterations, %d together\n",
        name, count, thrown.steps, thrown.unsolved, thrown.most, thrown.falling, thrown.hard, HARD,
        thrown.effort);
    return thrown;
}

/* What the hard steps took when the search was last right, and a twentieth: one whose bounds follow
 * badly finds the same answer later. */
static void assert_effort(const Thrown *thrown, int effort) {
    if (first == 0 && draws == DRAWS) {
        assert_true(thrown->effort < 1.05 * effort);
    }
}

TEST(test_bodies) {
    const Thrown thrown = throw_all("bodies of 1 to 60 kg", draw_body, 0.2, draws);
    assert_true(thrown.unsolved <= thrown.steps / 50000);
    assert_int_equal(thrown.falling, 0);
    assert_effort(&thrown, 48936);
}

TEST(test_sticks) {
    const Thrown thrown = throw_all("point masses on sticks", draw_stick, 1.0, draws / 2);
    assert_true(thrown.unsolved <= thrown.steps / 20000);
    assert_int_equal(thrown.falling, 0);
    assert_effort(&thrown, 516774);
    print_message("%d cycles from touch to lift-off, the worst is draw %d\n", thrown.cycles,
                  thrown.draw);
    assert_true(thrown.cycles > 0);
    expect_below("energy gained, by the body's", thrown.worst, 1e-9);
}

/* A step that is given too little work still feels the ground. */
TEST(test_little_work) {
    static const int limits[] = {1, 2, 5, 20};
    for (int l = 0; l < 4; l++) {
        int missing = 0;
        for (int draw = 0; draw < 60; draw++) {
            uint64_t random = (uint64_t)draw * 1000003u + 77;
            Kit kit;
            draw_body(&kit, &random);
            kit.input.max_iterations = limits[l];
            for (int s = 0; s < 20; s++) {
                kit_inverse_inertia(&kit);
                kit_free(&kit, NULL);
                kit_solve(&kit);
                missing += sinks_freely(&kit);
                kit_advance(&kit);
            }
            kit_close(&kit);
        }
        assert_int_equal(missing, 0);
    }
}

/* A level sole whose depth is exactly 0, with a twist that is next to nothing: the impulses are
 * below the rounding of anything that acts. */
TEST(test_surface) {
    uint64_t random = 5;
    int most = 0, unsolved = 0;
    for (int draw = 0; draw < 6000; draw++) {
        MildMaterial m = kit_preset(mild_material_preset_name(kit_index(&random, 8)));
        static const double steps[3] = {1e-3, 2.5e-3, 5e-3};
        Kit kit;
        kit_open(&kit, 1, soles[kit_index(&random, SOLES)], NULL, &m, steps[kit_index(&random, 3)]);
        kit.center[0][0] = kit_index(&random, 2) ? 0.0 : 0.06;
        kit.center[0][2] = kit_index(&random, 2) ? 0.0 : 0.3;
        kit_inverse_inertia(&kit);
        double *V = kit.input.free_velocity;
        V[kit_index(&random, 6)] =
            pow(10.0, kit_uniform(&random, -20.0, -14.0)) * (kit_index(&random, 2) ? 1.0 : -1.0);
        if (kit_index(&random, 2)) {
            memcpy(kit.input.velocity[0], V, 6 * sizeof *V);
        }
        for (int s = 0; s < 3; s++) {
            kit_solve(&kit);
            kit_advance(&kit);
            memcpy(V, kit.input.velocity[0], 6 * sizeof *V);
            most = kit.result.iterations > most ? kit.result.iterations : most;
            unsolved += !kit.result.converged;
        }
        kit_close(&kit);
    }
    assert_int_equal(unsolved, 0);
    assert_true(most <= 40);
}

/* What friction opposes instead of v takes energy at v and at the mean of it and the velocity
 * before, and friction_turned's derivatives are those of its impulse. */
TEST(test_turned) {
    uint64_t random = 9;
    double least = INFINITY, worst = 0.0;
    for (int draw = 0; draw < 20000; draw++) {
        const double ux = kit_uniform(&random, -1.0, 1.0), uy = kit_uniform(&random, -1.0, 1.0);
        const double vx = kit_uniform(&random, -1.5, 1.5), vy = kit_uniform(&random, -1.5, 1.5);
        const double r = kit_uniform(&random, 0.1, 1.0), h = 1e-6;
        const Element e = {.turn_x = ux, .turn_y = uy, .damping = 0.1};
        const Friction at = friction_turned(&e, r, 0.0, vx, vy);
        const double work = at.x * vx + at.y * vy, mean = at.x * (ux + vx) + at.y * (uy + vy);
        least = fmin(least, fmin(-work, -mean));
        const Friction x0 = friction_turned(&e, r, 0.0, vx - h, vy);
        const Friction x1 = friction_turned(&e, r, 0.0, vx + h, vy);
        const Friction y0 = friction_turned(&e, r, 0.0, vx, vy - h);
        const Friction y1 = friction_turned(&e, r, 0.0, vx, vy + h);
        const double size = fabs(at.fall_xx) + fabs(at.fall_xy) + fabs(at.fall_yy) + 1.0;
        const double error = fmax(fmax(fabs((x0.x - x1.x) / (2.0 * h) - at.fall_xx),
                                       fabs((y0.x - y1.x) / (2.0 * h) - at.fall_xy)),
                                  fabs((y0.y - y1.y) / (2.0 * h) - at.fall_yy));
        const double length = sqrt(at.x * at.x + at.y * at.y);
        if (length < 0.9 * r || length > 1.02 * r) {
            worst = fmax(worst, error / size); /* away from kinks, where slopes jump */
        }
    }
    expect_below("given by friction that turned [J]", -least, 1e-12);
    expect_below("its derivatives", worst, 1e-5);
}

int main(int argc, char **argv) {
    if (argc > 1) {
        draws = atoi(argv[1]);
    }
    if (argc > 2) {
        first = atoi(argv[2]);
    }
    return run_cases(open_soles, close_soles);
}
