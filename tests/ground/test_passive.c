/* The ground creates no energy: random materials of the paper's ranges, random motions. Arguments:
 * number of draws (default 1000) and the first (default 0); `ground_test_passive 100000` is what
 * docs/model.md reports. */
#include "ground_kit.h"

static int draws = 1000, first = 0;

/* SplitMix64 counts in equal steps: each draw begins `numbers` numbers, all that it uses, after the
 * one before. */
static uint64_t draw_seed(uint64_t seed, int draw, int numbers) {
    return seed + (uint64_t)draw * (uint64_t)numbers * 0x9e3779b97f4a7c15u;
}

static void throw_foot(int draw, MildSole *sole, Shaken *all) {
    static const double steps[3] = {0.25e-3, 1e-3, 5e-3};
    uint64_t random = draw_seed(11, draw, 35);
    const MildMaterial m = kit_material(&random);
    Kit kit;
    kit_open(&kit, 1, sole, NULL, &m, steps[kit_index(&random, 3)]);
    kit_random_state(&kit, &random);
    kit.input.position[0][2] += 0.15;
    kit_shake(&kit, 0.6, &random, draw, all);
    kit_close(&kit);
}

TEST(test_passive) {
    Shaken all = {0};
    MildSole *sole = kit_sole(0, 77);
    for (int draw = first; draw < first + draws; draw++) {
        throw_foot(draw, sole, &all);
    }
    kit_shaken("thrown and shaken", &all, 0);
    mild_sole_destroy(sole);
}

/* Draws of the first 100 000 in which an earlier Newton left steps unsolved, which created up to 1
 * kJ: light bodies whose weight stands 0.4 m above the sole, slipping at mu around 1, 5 ms. Every
 * step must be solved. */
TEST(test_hard_draws) {
    static const int hard[] = {6808,  8426,  11042, 14138, 25711, 38501, 45813, 48178, 48274,
                               54556, 58123, 65792, 73707, 75306, 84820, 85364, 89614, 99430};
    Shaken all = {0};
    MildSole *sole = kit_sole(0, 77);
    for (size_t i = 0; i < sizeof hard / sizeof *hard; i++) {
        throw_foot(hard[i], sole, &all);
    }
    kit_shaken("hard draws", &all, 0);
    assert_int_equal(all.missed, 0);
    mild_sole_destroy(sole);
}

/* A foot moved up and down by hand (A = 0). Two accounts of the work: impulse times mean speed,
 * what the kinetic energy of a body changes by, which must never be a gain; and impulse times the
 * step's way, dt times the new speed, half a step later. */
TEST(test_passive_by_hand) {
    MildSole *sole = kit_plate(2, 1);
    static const double steps[3] = {0.25e-3, 1e-3, 5e-3};
    double worst = -INFINITY, worst_way = -INFINITY;
    int gains = 0; /* by the second account */
    for (int draw = first; draw < first + draws; draw++) {
        uint64_t random = draw_seed(13, draw, 16);
        MildMaterial m = kit_material(&random);
        Kit kit;
        double dt = steps[draw % 3], period = kit_uniform(&random, 0.2, 2.0),
               depth = kit_uniform(&random, 0.002, 0.08);
        double wobble = kit_uniform(&random, 0.0, 0.3) * depth, z = 0.01, work = 0.0, way = 0.0,
               taken = 0.0;
        kit_open(&kit, 1, sole, NULL, &m, dt);
        kit.input.position[0][2] = -KIT_SOLE_Z + z;
        for (double t = dt; t < period + 0.02; t += dt) {
            double next = 0.01 - (depth + 0.01) * pow(sin(3.14159 * fmin(t / period, 1.0)), 2.0) +
                          (t < period ? wobble * (1 - cos(50.0 * t)) : 0.0);
            kit.input.free_velocity[2] = (next - z) / dt;
            z = next;
            kit_solve(&kit);
            double w = kit.result.foot[0].force[2] * kit.result.velocity[2] * dt;
            work += kit_work(&kit, 0, kit.input.velocity[0]);
            kit_advance(&kit);
            way += w;
            taken += fabs(w);
        }
        kit_close(&kit);
        if (taken == 0.0) {
            continue;
        }
        worst = fmax(worst, work / taken);
        worst_way = fmax(worst_way, way / taken);
        gains += way > 0.0;
    }
    print_message("down and up by hand: %d of %d draws gain along the way\n", gains, draws);
    expect_below("excess given back at the mean speed, as a share", worst, 0.0);
    expect_below("along the way", worst_way, 0.0);
    mild_sole_destroy(sole);
}

/* One step along the loop: x, z and tilt about y; returns the ground's work on the foot, at the
 * mean twist. */
static double loop_step(Kit *kit, const double size[3], const double phase[3], double turn,
                        double at[3]) {
    double *V = kit->input.free_velocity;
    for (int k = 0; k < 3; k++) {
        double next = size[k] * (sin(phase[k] + 6.283185307179586 * turn) - sin(phase[k]));
        V[2 * k] = (next - at[k]) / kit->input.dt;
        at[k] = next;
    }
    kit_solve(kit);
    double work = kit_work(kit, 0, kit->input.velocity[0]);
    kit_advance(kit);
    return work;
}

/* A foot led by hand (A = 0) around a closed loop of height, place and tilt, over and over. The
 * first time the ground yields; from then on each round must cost work, or none. */
TEST(test_loops) {
    MildSole *sole = kit_sole(0, 77);
    static const double steps[3] = {0.25e-3, 1e-3, 5e-3};
    double worst = -INFINITY;
    int worst_draw = -1;
    for (int draw = first; draw < first + draws; draw++) {
        uint64_t random = draw_seed(17, draw, 24);
        MildMaterial m = kit_material(&random);
        Kit kit;
        double size[3], phase[3], at[3] = {0}, depth = kit_uniform(&random, 0.0, 0.04);
        kit_open(&kit, 1, sole, NULL, &m, steps[draw % 3]);
        kit.input.position[0][2] -= depth;
        for (int k = 0; k < 3; k++) {
            size[k] = kit_uniform(&random, 0.0, k == 2 ? 0.2 : 0.03) * kit_index(&random, 2);
            phase[k] = kit_uniform(&random, 0.0, 6.28);
        }
        int round = (int)(kit_uniform(&random, 0.05, 0.4) / kit.input.dt);
        for (int r = 0; r < 3; r++) {
            double work = 0.0, taken = 0.0;
            for (int s = 1; s <= round; s++) {
                double w = loop_step(&kit, size, phase, (double)s / round, at);
                work += w;
                taken += fabs(w);
            }
            if (r == 0 || taken == 0.0) {
                continue;
            }
            worst_draw = work > worst ? draw : worst_draw;
            worst = fmax(worst, work);
        }
        kit_close(&kit);
    }
    print_message("closed loops by hand: the worst is draw %d\n", worst_draw);
    expect_below("energy gained in a round [J]", worst, 1e-9);
    mild_sole_destroy(sole);
}

int main(int argc, char **argv) {
    draws = argc > 1 ? atoi(argv[1]) : kit_draws(draws);
    if (argc > 2) {
        first = atoi(argv[2]);
    }
    return run_cases(NULL, NULL);
}
