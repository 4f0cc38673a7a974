/* The batch engine against MuJoCo: every phase of a step on random states of four robots of
 * different shape, in double and in float.
 *
 * Errors are relative to what a component could be at the same energy: with the inertia M an
 * acceleration a has |a_i| <= sqrt((M^-1)_ii a^T M a), and so on for velocities, forces f with
 * sqrt(M_ii f^T M^-1 f) and twists with sqrt(A_rr v^T M v); entries of M and A relate to the
 * diagonal, M_ij to sqrt(M_ii M_jj). So a light ankle is not hidden behind a heavy trunk. */
#include <math.h>
#include <string.h>

#include <mujoco/mujoco.h>

#include "engine_text.h"

#include "base/random.h"
#include "draws.h"
#include "oracle.h"
#include "robot/sim.h"
#include "robots.h"

#include "ground/terrain/grid.h"

#include "../sa01.h"
#include "../widest.h"

#define DT 0.0025
#define LIMIT_DOUBLE 1e-9
#define LIMIT_FLOAT 1e-4
#define LIMIT_MAP 6e-5    /* of maps: 8e-5 where constraints leave out the step that comes back */
#define LIMIT_HELD 1e-3   /* of N in float: 1/R of a limit that is exceeded by a ten thousandth */
#define LIMIT_WRENCH 1e-3 /* of rigid ground in float: small differences of stiff rows */

/* [m] Random poses put legs into each other, which no motion does. Where axes nearly meet, float
 * does not have their normal. */
#define LEGS_DEEP 0.01

/* ---- random steps ---- */

/* Float takes these numbers as they are, so that its error is that of its arithmetic. */
static void round_case(EngineCase *in) {
    kit_round((double *)in, offsetof(EngineCase, variation) / sizeof(double));
    kit_round(&in->height, 1);
    kit_round(in->slope, 2);
    kit_round(in->map_origin, 2);
}

static void spread(Random *random, double *x, int count, double size) {
    for (int i = 0; i < count; i++) {
        x[i] = random_uniform(random, -size, size);
    }
}

static RobotVariation random_variation(const Robot *robot, Random *random) {
    RobotVariation variation = robot_variation_nominal();
    variation.base_mass_add = random_uniform(random, -0.15, 0.3) * robot->total_mass / 2;
    spread(random, variation.com_offset, 3, 0.05);
    for (int i = 0; i <= robot->def.joints; i++) {
        variation.link_mass_scale[i] = random_uniform(random, 0.7, 1.3);
    }
    variation.armature_scale = random_uniform(random, 0.7, 1.3);
    variation.rigid_friction = random_uniform(random, 0.2, 1.2);
    if (variation.armature_scale < 1) {
        variation.rigid_time = 0.02 + (1 - variation.armature_scale);
    }
    return variation;
}

/* Any pose, in violent motion; in every third case some joints are beyond a limit. */
static EngineCase random_case(const Robot *robot, uint32_t draw) {
    EngineCase in = {.variation = {.rigid = 0}};
    Random random = random_at(41, draw, 0);
    double norm = 0;
    in.variation = random_variation(robot, &random);
    spread(&random, in.qpos, 3, 3);
    for (int k = 3; k < 7; k++) {
        in.qpos[k] = random_normal(&random);
        norm += in.qpos[k] * in.qpos[k];
    }
    for (int k = 3; k < 7; k++) {
        in.qpos[k] /= sqrt(norm);
    }
    for (int j = 0; j < robot->def.joints; j++) {
        double low = robot->low[j], high = robot->high[j];
        double margin = 0.03 * (high - low);
        in.qpos[7 + j] = random_uniform(&random, low + margin, high - margin);
        if (draw % 3 == 0 && random_unit(&random) < 0.25) {
            double beyond = random_uniform(&random, 1e-4, 0.1);
            in.qpos[7 + j] = random_unit(&random) < 0.5 ? low - beyond : high + beyond;
        }
        in.torque[j] = random_uniform(&random, -1, 1) * robot->effort[j];
    }
    spread(&random, in.qvel, 6, 4);
    spread(&random, in.qvel + 6, robot->def.joints, 8);
    spread(&random, in.qacc, robot->nv, 500);
    spread(&random, in.push, 3, 150);
    spread(&random, in.push + 3, 3, 30);
    for (int f = 0; f < robot->def.feet; f++) {
        spread(&random, in.wrench[f], 3, 500);
        spread(&random, in.wrench[f] + 3, 3, 40);
    }
    round_case(&in);
    return in;
}

/* [m] Height of rigid ground at a point, and gradient [-]. */
static double case_height(const EngineCase *in, double x, double y, double slope[2]) {
    MildTerrain terrain = {.map = in->map, .map_x = in->map_origin[0], .map_y = in->map_origin[1]};
    memcpy(slope, in->slope, sizeof in->slope);
    if (in->map) {
        mild_terrain_slope_at(&terrain, x, y, slope);
        return in->height + mild_terrain_height_at(&terrain, x, y);
    }
    return in->height + slope[0] * x + slope[1] * y;
}

/* [m] By how much the robot of the case may sink before a corner touches the ground. */
static double clearance(RobotSim *sim, const EngineCase *in) {
    const mjModel *m = sim->model;
    RobotState state = {.qpos = {0}};
    double least = 1e9;
    memcpy(state.qpos, in->qpos, sizeof state.qpos);
    robot_sim_load(sim, &state, &in->variation);
    for (int g = 0; g < m->ngeom; g++) {
        const double *c = sim->data->geom_xpos + 3 * g;
        double slope[2];
        double height = case_height(in, c[0], c[1], slope);
        double steep = sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
        if (g != sim->robot->floor_geom) {
            least = fmin(least, c[2] - height - steep * m->geom_size[3 * g]);
        }
    }
    return least;
}

/* Near the default pose, the lowest corner of the feet up to 4 mm in the ground, or above it. Half
 * of the cases move as a stand does, half as a walk, some with joints beyond their limits. map: or
 * NULL for planes. */
static EngineCase rigid_case(RobotSim *sim, const MildMap *map, uint32_t draw) {
    const Robot *robot = sim->robot;
    EngineCase in = {.qpos = {0}, .map = map};
    Random random = random_at(43, draw, 0);
    double motion = draw % 2 ? 1 : 0.05;
    in.variation = random_variation(robot, &random);
    in.variation.rigid = 1;
    spread(&random, in.qpos, 2, 3);
    in.qpos[3] = 1;
    spread(&random, in.qpos + 4, 2, 0.02 + 0.1 * motion);
    in.qpos[6] = random_uniform(&random, -1, 1);
    mju_normalize4(in.qpos + 3);
    for (int j = 0; j < robot->def.joints; j++) {
        double off = random_uniform(&random, -0.05, 0.05) * (1 + 5 * motion);
        in.qpos[7 + j] =
            fmin(fmax(robot->def.pose[j] + off, robot->low[j] + 0.03), robot->high[j] - 0.03);
        if (draw % 5 == 0 && random_unit(&random) < 0.15) {
            in.qpos[7 + j] = robot->high[j] + random_uniform(&random, 1e-4, 0.02);
        }
        in.torque[j] = random_uniform(&random, -0.5, 0.5) * robot->effort[j];
    }
    spread(&random, in.qvel, 3, 1.5 * motion);
    spread(&random, in.qvel + 3, 3, 2 * motion);
    spread(&random, in.qvel + 6, robot->def.joints, 4 * motion);
    spread(&random, in.push, 3, 50);
    in.height = random_uniform(&random, -0.2, 0.2);
    if (map) {
        spread(&random, in.map_origin, 2, 3);
    } else if (draw % 4 >= 2) {
        spread(&random, in.slope, 2, draw % 8 == 7 ? 1 : 0.2);
    }
    in.qpos[2] -= clearance(sim, &in) + random_uniform(&random, -0.001, 0.004);
    round_case(&in);
    return in;
}

/* ---- robots ---- */

typedef struct {
    Robot *robot;
    RobotSim *sim;
    EngineTree tree;
    double number[ENGINE_NUMBERS];
} Kit;

enum { SA01_KIT, GO1_KIT, G1_KIT, ASYMMETRIC_KIT, WIDEST_KIT, KITS };
static const char *const kit_name[KITS] = {"sa01", "go1", "g1", "asymmetric", "widest"};
static Kit kits[KITS];
static Oracle oracle;
static EngineResult result;

static Robot *open_robot(int k, MildError *error) {
    switch (k) {
    case SA01_KIT: return robot_create(MILD_SOURCE_DIR "/robots/sa01", error);
    case GO1_KIT: return robot_create(MILD_SOURCE_DIR "/robots/go1", error);
    case G1_KIT: return robot_create(MILD_SOURCE_DIR "/robots/g1", error);
    case ASYMMETRIC_KIT: return robot_create(MILD_SOURCE_DIR "/tests/engine/asymmetric", error);
    default: return widest_open(error);
    }
}

static int setup(void **unused) {
    (void)unused;
    for (int k = 0; k < KITS; k++) {
        MildError error = {0};
        Kit *kit = &kits[k];
        kit->robot = open_robot(k, &error);
        print_message("%s", error.text);
        assert_non_null(kit->robot);
        if (k == ASYMMETRIC_KIT) { /* robot files may not have it; the engine knows what it is */
            for (int d = 6; d < kit->robot->nv; d++) {
                kit->robot->model->dof_damping[d] = 0.2 * (d % 4);
            }
        }
        kit->sim = robot_sim_create(kit->robot, DT, &error);
        assert_non_null(kit->sim);
        assert_int_equal(engine_model_read(kit->robot, DT, &kit->tree, kit->number, &error),
                         MILD_OK);
    }
    return 0;
}

static int teardown(void **unused) {
    (void)unused;
    for (int k = 0; k < KITS; k++) {
        robot_sim_destroy(kits[k].sim);
        if (k != WIDEST_KIT) {
            robot_destroy(kits[k].robot);
        }
    }
    return widest_close(kits[WIDEST_KIT].robot);
}

/* ---- errors ---- */

enum {
    MASS,
    MASS_HELD,
    FORCE,
    SMOOTH,
    FOOT_POSE,
    FOOT_TWIST,
    FOOT_INERTIA,
    FREE_VELOCITY,
    WRENCHED,
    LIMITED,
    GROUND_WRENCH,
    NEXT_POSE,
    NEXT_RATE,
    NEXT_FEET,
    MEASURES,
    ERRORS
};
static const char *const error_name[ERRORS] = {"M",
                                               "N with limits held",
                                               "torque and push less bias",
                                               "qacc without ground",
                                               "pose of feet [m, -]",
                                               "J qvel",
                                               "A",
                                               "V_free",
                                               "qacc with wrenches",
                                               "with rows",
                                               "wrench of the ground",
                                               "qpos after [m, rad]",
                                               "qvel after",
                                               "feet after [m]",
                                               "measures [m, m/s]"};

typedef double Worst[ERRORS];

static void note(Worst worst, int kind, double error) {
    worst[kind] = error <= worst[kind] ? worst[kind] : error; /* NaN included */
}

/* Quadratic form x^T S x. */
static double energy(const double *S, const double *x, int n) {
    double sum = 0;
    for (int i = 0; i < n; i++) {
        sum += x[i] * oracle_dot(S + i * n, x, n);
    }
    return sum;
}

/* Components of `got` against those of `want` at the same energy x^T S x, where `natural` has on
 * its diagonal the square of a component at energy 1. */
static void note_vector(Worst worst, int kind, const double *got, const double *want, int count,
                        const double *natural, double energy_of) {
    for (int i = 0; i < count; i++) {
        double scale = sqrt(natural[i * count + i] * energy_of);
        if (scale > 0 || got[i] != want[i]) {
            note(worst, kind, fabs(got[i] - want[i]) / scale);
        }
    }
}

static void note_matrices(const Kit *kit, Worst worst) {
    const EngineTree *tree = &kit->tree;
    const int nv = kit->robot->nv;
    const int rows = 6 * tree->feet;
    const double *M = oracle.mass;
    for (int e = 0; e < tree->entries; e++) {
        const int d = tree->entry[e].dof;
        const int place = tree->entry[e].place;
        const int j = tree->row_dof[d < 6 ? 0 : d - 5][place];
        note(worst, oracle.held ? MASS_HELD : MASS,
             fabs(result.mass[e] - M[d * nv + j]) / sqrt(M[d * nv + d] * M[j * nv + j]));
    }
    const double *A = oracle.inverse_inertia;
    const double *got = result.inverse_inertia;
    for (int r = 0; r < rows; r++) {
        for (int c = 0; c < rows; c++) {
            double scale = sqrt(A[r * rows + r] * A[c * rows + c]);
            if (scale > 0 || got[r * rows + c] != 0) {
                note(worst, FOOT_INERTIA, fabs(got[r * rows + c] - A[r * rows + c]) / scale);
            }
        }
    }
}

static void note_feet(const Kit *kit, const double *free, Worst worst) {
    const int nv = kit->robot->nv;
    const int rows = 6 * kit->tree.feet;
    for (int f = 0; f < kit->tree.feet; f++) {
        for (int k = 0; k < 9; k++) {
            note(worst, FOOT_POSE, fabs(result.rotation[f][k] - oracle.rotation[f][k]));
        }
        for (int k = 0; k < 3; k++) {
            note(worst, FOOT_POSE, fabs(result.position[f][k] - oracle.position[f][k]));
        }
    }
    note_vector(worst, FOOT_TWIST, result.velocity[0], oracle.velocity, rows,
                oracle.inverse_inertia, energy(oracle.mass, kit->sim->data->qvel, nv));
    note_vector(worst, FREE_VELOCITY, result.free_velocity[0], oracle.free_velocity, rows,
                oracle.inverse_inertia, energy(oracle.mass, free, nv));
}

/* Against the largest force, but at least the robot's weight, and that at 0.1 m. */
static void note_wrench(const Kit *kit, Worst worst) {
    double most = 9.81 * kit->robot->total_mass;
    for (int f = 0; f < kit->tree.feet; f++) {
        most = fmax(most, mju_norm3(oracle.wrench[f]));
    }
    for (int n = 0; n < 6 * kit->tree.feet; n++) {
        double arm = n % 6 < 3 ? 1 : 0.1; /* [m] */
        double error = fabs(result.wrench[n / 6][n % 6] - oracle.wrench[n / 6][n % 6]);
        note(worst, GROUND_WRENCH, error / (most * arm));
    }
}

static void note_step(const Kit *kit, Worst worst) {
    const int nv = kit->robot->nv;
    double engine[ROBOT_NV_MAX]; /* in the engine's order */
    double want[ROBOT_NV_MAX];
    memcpy(engine, result.qvel, sizeof engine);
    memcpy(want, oracle.qvel, sizeof want);
    for (int j = 0; j < kit->tree.joints; j++) {
        engine[kit->robot->dof[j]] = result.qvel[6 + j];
        want[kit->robot->dof[j]] = oracle.qvel[6 + j];
    }
    note_vector(worst, NEXT_RATE, engine, want, nv, oracle.inverse, energy(oracle.mass, want, nv));
    double sign = oracle_dot(result.qpos + 3, oracle.qpos + 3, 4) < 0 ? -1 : 1;
    for (int i = 0; i < kit->robot->nq; i++) {
        double got = i >= 3 && i < 7 ? sign * result.qpos[i] : result.qpos[i];
        note(worst, NEXT_POSE, fabs(got - oracle.qpos[i]));
    }
    assert_int_equal(result.bad, 0);
    assert_int_equal(result.overrun, 0);
    for (int n = 0; n < 3 * kit->tree.feet; n++) {
        note(worst, NEXT_FEET,
             fabs(result.next_position[n / 3][n % 3] - oracle.next_position[n / 3][n % 3]));
    }
}

static void note_measures(const Kit *kit, Worst worst) {
    note(worst, MEASURES, fabs(result.body_clearance - oracle.body_clearance));
    note(worst, MEASURES, fabs(result.knee_distance - oracle.knee_distance));
    note(worst, MEASURES, fabs(result.foot_distance - oracle.foot_distance));
    note(worst, MEASURES, fabs(result.leg_distance - oracle.leg_distance));
    for (int f = 0; f < kit->tree.feet; f++) {
        note(worst, MEASURES, fabs(result.sole_height[f] - oracle.sole_height[f]));
        for (int k = 0; k < 3; k++) {
            note(worst, MEASURES, fabs(result.sole_center[f][k] - oracle.sole_center[f][k]));
            note(worst, MEASURES, fabs(result.sole_velocity[f][k] - oracle.sole_velocity[f][k]));
        }
    }
}

/* Of the case that oracle and result are of. before: the velocities before the step. */
static void note_case(const Kit *kit, const EngineCase *in, const double *before, Worst worst) {
    const int nv = kit->robot->nv;
    const double *M = oracle.mass;
    const double *inverse = oracle.inverse;
    double free[ROBOT_NV_MAX];
    for (int i = 0; i < nv; i++) {
        free[i] = before[i] + DT * oracle.smooth[i];
    }
    memcpy(kit->sim->data->qvel, before, (size_t)nv * sizeof(double));
    note_vector(worst, FORCE, result.force, oracle.force, nv, M, energy(inverse, oracle.force, nv));
    note_vector(worst, SMOOTH, result.smooth, oracle.smooth, nv, inverse,
                energy(M, oracle.smooth, nv));
    if (in->variation.rigid) {
        note_wrench(kit, worst);
    } else {
        note_matrices(kit, worst);
        note_feet(kit, free, worst);
        note_vector(worst, WRENCHED, result.wrenched, oracle.wrenched, nv, inverse,
                    energy(M, oracle.wrenched, nv));
    }
    note_vector(worst, LIMITED, result.acceleration, oracle.acceleration, nv, inverse,
                energy(M, oracle.acceleration, nv));
    if (in->variation.rigid) {
        note_vector(worst, FOOT_TWIST, result.next_velocity[0], oracle.next_velocity,
                    6 * kit->tree.feet, oracle.inverse_inertia,
                    energy(M, kit->sim->data->qvel, nv));
    }
    note_step(kit, worst);
    note_measures(kit, worst);
}

/* ---- cases ---- */

/* All cases, or a fifth of them: for a sanitizer, or for another width of vectors. */
static int some(int cases) {
    return kit_short() ? cases / 5 : cases;
}

static void print_worst(const char *name, int cases, const Worst at_double, const Worst at_float) {
    print_message("%s, %d cases                    double    float\n", name, cases);
    for (int k = 0; k < ERRORS; k++) {
        if (at_float[k] > 0) { /* a phase that these cases have */
            print_message("    %-28s %8.1e %8.1e\n", error_name[k], at_double[k], at_float[k]);
        }
    }
}

/* limit: of the numbers in float. */
static void check_worst(const Worst at_double, const Worst at_float, double limit) {
    for (int k = 0; k < ERRORS; k++) {
        assert_true(at_double[k] < LIMIT_DOUBLE);
        assert_true(at_float[k] < (k == GROUND_WRENCH ? LIMIT_WRENCH
                                   : k == MASS_HELD   ? LIMIT_HELD
                                                      : limit));
    }
}

/* A case by MuJoCo and by both texts. at_float: NULL where float says something else. */
static void run_case(const Kit *kit, const EngineCase *in, Worst at_double, double *at_float,
                     int *newton) {
    double before[ROBOT_NV_MAX];
    memcpy(before, in->qvel, sizeof before);
    for (int j = 0; j < kit->tree.joints; j++) {
        before[kit->robot->dof[j]] = in->qvel[6 + j];
    }
    oracle_step(kit->sim, in, &oracle);
    engine_text_double(&kit->tree, kit->number, in, &result);
    note_case(kit, in, before, at_double);
    *newton = result.newton > *newton ? result.newton : *newton;
    if (!at_float || oracle.leg_distance < -LEGS_DEEP) {
        return;
    }
    engine_text_float(&kit->tree, kit->number, in, &result);
    note_case(kit, in, before, at_float);
    *newton = result.newton > *newton ? result.newton : *newton;
}

TEST(test_random_states) {
    static const int all[KITS] = {10000, 10000, 3000, 10000, 600};
    for (int k = 0; k < KITS; k++) {
        const int cases = some(all[k]);
        Worst at_double = {0}, at_float = {0};
        int limited = 0, held = 0, newton = 0, legs = 0;
        for (uint32_t draw = 0; draw < (uint32_t)cases; draw++) {
            EngineCase in = random_case(kits[k].robot, draw);
            run_case(&kits[k], &in, at_double, at_float, &newton);
            legs += oracle.legs > 0;
            limited += oracle.rows > 0;
            held += oracle.held > 0;
        }
        print_worst(kit_name[k], cases, at_double, at_float);
        print_message("    beyond limits: %d, held %d, legs meet: %d; at most %d Newton steps\n",
                      limited, held, legs, newton);
        check_worst(at_double, at_float, LIMIT_FLOAT);
        assert_true(legs > cases / 60 || k > G1_KIT);
        assert_true(limited > cases / 5 && held > limited / 3);
    }
}

/* ---- rigid ground ---- */

TEST(test_rigid_ground) {
    static const int all[KITS] = {10000, 10000, 3000, 10000, 600};
    for (int k = 0; k < KITS; k++) {
        const int cases = some(all[k]);
        Worst at_double = {0}, at_float = {0};
        int touching = 0, newton = 0;
        for (uint32_t draw = 0; draw < (uint32_t)cases; draw++) {
            EngineCase in = rigid_case(kits[k].sim, NULL, draw);
            run_case(&kits[k], &in, at_double, at_float, &newton);
            touching += oracle.rows > 0;
        }
        print_worst(kit_name[k], cases, at_double, at_float);
        print_message("    with rows: %d; at most %d Newton steps\n", touching, newton);
        check_worst(at_double, at_float, LIMIT_FLOAT);
        assert_true(touching > cases / 2);
    }
}

/* A time constant below two steps is two steps. Rows so stiff are rough in float. */
TEST(test_shortest_time) {
    Worst at_double = {0};
    int touching = 0, newton = 0;
    for (uint32_t draw = 0; draw < 100; draw++) {
        EngineCase in = rigid_case(kits[0].sim, NULL, draw);
        in.variation.rigid_time = DT / 2;
        run_case(&kits[0], &in, at_double, NULL, &newton);
        touching += oracle.rows > 0;
    }
    for (int k = 0; k < ERRORS; k++) {
        assert_true(at_double[k] < LIMIT_DOUBLE);
    }
    assert_true(touching > 50);
}

/* ---- maps ---- */

typedef struct {
    const char *name;
    MildMapKind kind;
    double far; /* [m] of the robot from the origin */
} Relief;

static const Relief reliefs[] = {{"slope", MILD_MAP_SLOPE, 0},
                                 {"steps", MILD_MAP_STEPS, 0},
                                 {"waves", MILD_MAP_WAVES, 0},
                                 {"rough", MILD_MAP_ROUGH, 0},
                                 {"image", MILD_MAP_IMAGE, 0},
                                 {"mixed", MILD_MAP_MIXED, 0},
                                 {"rough, 50 m away", MILD_MAP_ROUGH, 50}};
enum { RELIEFS = sizeof reliefs / sizeof *reliefs, IMAGE = 30 };

static MildMap *relief_map(const Relief *relief) {
    static double heights[IMAGE * (IMAGE + 2)];
    MildError error = {0};
    MildMapDef def = mild_map_def_default();
    Random random = random_at(47, 0, 0);
    for (int i = 0; i < IMAGE * (IMAGE + 2); i++) {
        heights[i] = random_unit(&random);
    }
    def.kind = (int)relief->kind;
    def.slope = 0.2;
    def.heights = heights;
    def.height_columns = IMAGE;
    def.height_rows = IMAGE + 2;
    if (relief->kind == MILD_MAP_IMAGE) {
        def.cell = 0.15; /* 4.35 m wide: some robots stand beside it */
    }
    if (relief->kind == MILD_MAP_MIXED) {
        def.size = 10.0; /* tiles of 2 m, robots within 3 m */
    }
    MildMap *map = mild_map_create(&def, &error);
    print_message("%s", error.text);
    assert_non_null(map);
    return map;
}

/* [cells] How near a coordinate is to the border of a cell. */
static double border(double at, double cell) {
    return fabs(at / cell - round(at / cell));
}

/* Bool: a corner is so near to the border of a cell that a float may see the gradient of the next
 * one. The robot is as the last oracle_step loaded it. */
static int on_border(RobotSim *sim, const EngineCase *in, double near) {
    const Grid *grid = &in->map->heights;
    RobotState state = {.qpos = {0}};
    memcpy(state.qpos, in->qpos, sizeof state.qpos);
    robot_sim_load(sim, &state, &in->variation);
    for (int g = 0; in->map->height && g < sim->model->ngeom; g++) {
        const double *c = sim->data->geom_xpos + 3 * g;
        const double x = border(c[0] - in->map_origin[0] - grid->x0, grid->cell_x);
        const double y = border(c[1] - in->map_origin[1] - grid->y0, grid->cell_y);
        if (g != sim->robot->floor_geom && fmin(x, y) * grid->cell_x < near) {
            return 1;
        }
    }
    return 0;
}

static void run_relief(const Relief *relief, int k, const MildMap *map) {
    Worst at_double = {0}, at_float = {0};
    int touching = 0, newton = 0, left_out = 0;
    const int cases = some(k == WIDEST_KIT ? 100 : 1000);
    for (uint32_t draw = 0; draw < (uint32_t)cases; draw++) {
        EngineCase in = rigid_case(kits[k].sim, map, draw);
        in.qpos[0] += relief->far;
        in.map_origin[0] += relief->far / 2;
        in.qpos[2] -= clearance(kits[k].sim, &in) + 1e-3 * (draw % 6 - 0.5);
        round_case(&in);
        const int out = on_border(kits[k].sim, &in, 1e-6);
        run_case(&kits[k], &in, at_double, out ? NULL : at_float, &newton);
        left_out += out;
        touching += oracle.rows > 0;
    }
    print_message("%s: ", relief->name);
    print_worst(kit_name[k], cases, at_double, at_float);
    print_message("    with rows: %d; at most %d Newton steps; %d left out of float\n", touching,
                  newton, left_out);
    check_worst(at_double, at_float, LIMIT_MAP);
    assert_true(touching > cases / 2 && left_out < cases / 20);
}

/* Rigid ground of a map, and what is measured above it, as RobotSim has them. */
TEST(test_maps) {
    for (int r = 0; r < RELIEFS; r++) {
        MildMap *map = relief_map(&reliefs[r]);
        for (int k = 0; k < KITS; k++) {
            run_relief(&reliefs[r], k, map);
        }
        mild_map_destroy(map);
    }
}

/* No lane of a block needs what another one does there: on a GPU they run at once. */
TEST(test_order_of_lanes) {
    static EngineResult reverse;
    for (int k = 0; k < KITS; k++) {
        for (uint32_t draw = 0; draw < 200; draw++) {
            EngineCase in =
                draw % 2 ? rigid_case(kits[k].sim, NULL, draw) : random_case(kits[k].robot, draw);
            engine_text_double(&kits[k].tree, kits[k].number, &in, &result);
            engine_text_reverse(&kits[k].tree, kits[k].number, &in, &reverse);
            assert_memory_equal(result.qpos, reverse.qpos, sizeof result.qpos);
            assert_memory_equal(result.qvel, reverse.qvel, sizeof result.qvel);
        }
    }
}

/* ---- the model ---- */

TEST(test_sizes) {
    char text[200];
    Robot *robot = kits[SA01_KIT].robot;
    EngineTree tree;
    double number[ENGINE_NUMBERS];
    robot_set_shells(robot, 1);
    assert_int_equal(engine_model_read(robot, DT, &tree, number, NULL), MILD_OK);
    robot_set_shells(robot, 0);
    engine_model_sizes(&tree, text, sizeof text);
    print_message("sa01: %s\n", text);
    assert_string_equal(text, "#define ENGINE_JOINTS 12\n#define ENGINE_FEET 2\n"
                              "#define ENGINE_CORNERS 8\n#define ENGINE_ENTRIES 135\n"
                              "#define ENGINE_CHAIN 12\n#define ENGINE_BODIES 3\n");
}

/* What the engine does not compute is refused by name. */
TEST(test_refusals) {
    Kit *kit = &kits[GO1_KIT];
    mjModel *m = kit->robot->model;
    EngineTree tree;
    MildError error = {0};
    double number[ENGINE_NUMBERS];
    const double margin = m->jnt_margin[3];
    m->jnt_margin[3] = 3;
    assert_int_equal(engine_model_read(kit->robot, DT, &tree, number, &error), MILD_ERROR_RANGE);
    print_message("%s\n", error.text);
    assert_error(&error, MILD_ERROR_RANGE, "FL_calf_joint margin 3");
    m->jnt_margin[3] = margin;
    const int parent = m->body_parentid[kit->robot->limb[0].body];
    m->body_parentid[kit->robot->limb[0].body] = 0;
    assert_int_equal(engine_model_read(kit->robot, DT, &tree, number, &error), MILD_ERROR_FORMAT);
    print_message("%s\n", error.text);
    m->body_parentid[kit->robot->limb[0].body] = parent;
    assert_int_equal(engine_model_read(kit->robot, DT, &tree, number, &error), MILD_OK);
}

/* A velocity that is not a number, or beyond any robot's, is said. */
TEST(test_bad_numbers) {
    const Kit *kit = &kits[SA01_KIT];
    EngineCase in = random_case(kit->robot, 1);
    static const double torques[] = {NAN, 1e9, 1};
    for (int n = 0; n < 6; n++) {
        in.variation.rigid = n >= 3;
        in.torque[4] = torques[n % 3];
        engine_text_double(&kit->tree, kit->number, &in, &result);
        assert_int_equal(result.bad, n % 3 < 2);
        engine_text_float(&kit->tree, kit->number, &in, &result);
        assert_int_equal(result.bad, n % 3 < 2);
    }
}

TEST_MAIN(setup, teardown)
