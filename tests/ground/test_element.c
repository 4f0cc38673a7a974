/* The element's step in float, as a GPU runs it, against the same code in double. */
#include "ground_kit.h"

#define ELEMENT_STEP element_step_double
#include "element_step.inc"
#include "ground/law/models.h"
#include "round.h"

#define ELEMENTS 500
#define STEPS 20
#define MEMORY(field)                                                                              \
    (offsetof(ElementMemory, field) / sizeof(double)) /* index in a case's memory */

/* A material and a motion of one element on it, in numbers that a float holds, so that both begin
 * with the same. Of five grounds one has its bed within reach, one
 * an element that has slid nearly as far as counts, one an impulse that creates energy, one an
 * element that is not deeper than the least elastic travel. */
static ElementCase random_case(int n, uint64_t *random) {
    static const double steps[3] = {1e-3, 2.5e-3, 5e-3};
    static const MildModel models[4] = {MILD_MODEL_MILD, MILD_MODEL_MILD, MILD_MODEL_BEKKER,
                                        MILD_MODEL_HUNT_CROSSLEY};
    MildMaterial m = kit_material(random);
    m.model = (int)models[kit_index(random, 4)];
    m.exponent = kit_uniform(random, 0.1, 2.0);
    Law law = law_of(&m, KIT_PITCH, 0.1);
    law.bed_depth = n % 5 == 0 ? 0.01 : law.bed_depth;
    ElementCase c = {.curves = kit_index(random, 2) ? law_curves(&law) : LAW_ALL,
                     .recovery = float_rounded(m.recovery),
                     .mu = float_rounded(m.mu),
                     .k_drift = float_rounded(m.k_drift),
                     .b_drift = float_rounded(m.b_drift),
                     .dt = float_rounded(steps[kit_index(random, 3)]),
                     .depth = float_rounded(n % 5 == 3 ? kit_uniform(random, 0.0, 1e-4)
                                                       : kit_uniform(random, -0.001, 0.02)),
                     .now = float_rounded(n % 5 == 3 ? kit_uniform(random, -0.02, 0.02)
                                                     : kit_uniform(random, -0.3, 0.7)),
                     .gain = float_rounded(0.01),
                     .explicit_impulse = n % 5 == 1 ? float_rounded(-1e-3) : 0.0};
    c.memory[MEMORY(drift)] = n % 5 == 2 ? float_rounded((double)REMEMBER_DRIFT - 1e-3) : 0.0;
    memcpy(c.law, &law, sizeof c.law);
    kit_round(c.law, ELEMENT_LAW);
    return c;
}

/* Steps a random motion: the new velocity is the old one, disturbed or turned round. */
static void case_push(ElementCase *c, uint64_t *random) {
    double turn = kit_index(random, 6) == 0 ? -0.5 : 1.0, fast = kit_index(random, 3) ? 0.01 : 0.3;
    for (int k = 0; k < 2; k++) {
        c->after[k] = float_rounded(fast * kit_uniform(random, -1.0, 1.0));
    }
    c->after[2] = float_rounded(turn * c->now + kit_uniform(random, -0.05, 0.05));
}

/* Goes on from the end of the step. Of eight steps one begins deeper or less deep than the step
 * before ended, as on uneven ground. */
static void case_move(ElementCase *c, const ElementResult *result, uint64_t *random) {
    const double shift = kit_index(random, 8) == 0 ? kit_uniform(random, -1e-4, 1e-4) : 0.0;
    memcpy(c->memory, result->memory, sizeof c->memory);
    kit_round(c->memory, ELEMENT_MEMORY);
    c->now = c->after[2];
    c->depth = float_rounded(c->depth + c->dt * c->now + shift);
}

/* Worst of |a - b| by |b| + scale. */
static void worst_of(double *worst, double a, double b, double scale) {
    *worst = fmax(*worst, fabs(a - b) / (fabs(b) + scale + 1e-12));
}

/* By the value itself and what the element carries at its yield; parts of a vector or a matrix by
 * the whole. worst[4]: of the normal impulse, the tangential one, their derivatives, the memory. */
static void worst_of_step(double *worst, const ElementCase *c, const ElementResult *one,
                          const ElementResult *two) {
    const double *v = one->value;
    const double load = c->dt * one->yield_force;                               /* [N s] */
    const double slope = c->dt * c->dt / 2 * one->unload_stiffness;             /* [kg] */
    const double tangent = load + hypot(v[2], v[3]);                            /* [N s] */
    const double fall = (double)FRICTION_LAG * c->mu * load + fmax(v[4], v[6]); /* [kg] */
    const double scale[ELEMENT_RESULTS] = {load, slope, tangent, tangent, fall, fall, fall, 1, 1};
    static const int kind[ELEMENT_RESULTS] = {0, 2, 1, 1, 2, 2, 2, 2, 2};
    for (int k = 0; k < ELEMENT_RESULTS; k++) {
        worst_of(&worst[kind[k]], two->value[k], v[k], scale[k]);
    }
    for (int k = 0; k < ELEMENT_MEMORY; k++) {
        /* [N]; the others are lengths, a speed, a stiffness. */
        const int held = k == MEMORY(held_x) || k == MEMORY(held_y);
        worst_of(&worst[3], two->memory[k], one->memory[k], held ? one->yield_force : 1e-3);
    }
}

TEST(test_float) {
    static const char *const names[4] = {"normal", "tangent", "derivatives", "memory"};
    double worst[4] = {0.0};
    int loaded = 0, total = 0;
    for (int n = 0; n < ELEMENTS; n++) {
        uint64_t random = 31u + (uint64_t)n * 1000003u;
        ElementCase c = random_case(n, &random);
        for (int s = 0; s < STEPS; s++, total++) {
            ElementResult one, two;
            case_push(&c, &random);
            element_step_double(&c, &one);
            element_step_float(&c, &two);
            worst_of_step(worst, &c, &one, &two);
            loaded += one.value[0] > 0.0;
            case_move(&c, &one, &random);
        }
    }
    print_message("%d steps, %d loaded: float against double, worst relative", total, loaded);
    for (int k = 0; k < 4; k++) {
        print_message(", %s %.1e", names[k], worst[k]);
    }
    print_message("\n");
    assert_int_equal(total, 10000);
    assert_true(loaded > 3000);
    for (int k = 0; k < 4; k++) {
        assert_true(worst[k] < 1e-4);
    }
}

TEST_MAIN(NULL, NULL)
