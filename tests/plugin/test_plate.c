/* Plates on soft ground in MuJoCo, against the law of the ground and against a body that is stepped
 * by hand with the library alone: free, on a joint limit, beside other contacts, by every
 * integrator. */
#include <math.h>

#include "plugin_kit.h"

#define HALF_X 0.10 /* [m] of the plate */
#define HALF_Y 0.05
#define HALF_Z 0.01
#define GRAVITY 9.81
#define PLATE "<geom type='box' size='0.1 0.05 0.01' mass='%g' contype='0' conaffinity='0'/>"

static const char *const integrators[] = {"Euler", "implicitfast", "implicit", "discrete"};

static mjModel *free_plate(double dt, const char *integrator, const char *ground, double mass,
                           const char *more) {
    char head[1000], text[2000];
    kit_head(head, sizeof head, dt, integrator, "plate", ground, "");
    snprintf(text, sizeof text,
             "%s<worldbody><body name='plate' pos='0 0 0.012'><freejoint/>" PLATE
             "</body></worldbody>%s</mujoco>",
             head, mass, more);
    return kit_model(text);
}

static MildSole *plate_sole(void) {
    static const double outline[] = {-HALF_X, -HALF_Y, HALF_X,  -HALF_Y,
                                     HALF_X,  HALF_Y,  -HALF_X, HALF_Y};
    const MildSoleDef def = {outline, 4, 0, -HALF_Z, 0};
    MildError error = {0};
    MildSole *sole = mild_sole_create(&def, &error);
    assert_non_null(sole);
    return sole;
}

static double sinkage(const char *ground, double mass) {
    MildMaterial material;
    MildSole *sole = plate_sole();
    assert_true(mild_material_preset(ground, &material));
    double depth = mild_sole_sinkage(sole, &material, mass * GRAVITY);
    mild_sole_destroy(sole);
    return depth;
}

/* ---- a free plate ---- */

/* A plate of 8 kg on loose sand that the library alone steps. way: [steps] [m] how high it is after
 * each. */
static void step_by_hand(double dt, int steps, double *way) {
    const double mass = 8;
    MildMaterial sand;
    MildError error = {0};
    assert_true(mild_material_preset("sand_loose", &sand));
    MildSole *sole = plate_sole();
    const MildSole *soles[] = {sole};
    MildTerrain terrain = mild_terrain_uniform(&sand);
    void *block = calloc(1, mild_ground_bytes(soles, 1));
    MildGround *memory = mild_ground_init(block, soles, 1);
    MildScratch *scratch = mild_scratch_create(soles, 1, &error);
    double A[36] = {0};
    MildContactInput input = {
        .feet = 1, .dt = dt, .inverse_inertia = A, .rotation = {{1, 0, 0, 0, 1, 0, 0, 0, 1}}};
    const double inertia[3] = {mass / 3 * (HALF_Y * HALF_Y + HALF_Z * HALF_Z),
                               mass / 3 * (HALF_X * HALF_X + HALF_Z * HALF_Z),
                               mass / 3 * (HALF_X * HALF_X + HALF_Y * HALF_Y)};
    double height = 0.012, up = 0;
    for (int k = 0; k < 3; k++) {
        A[7 * k] = 1 / mass;
        A[7 * (3 + k)] = 1 / inertia[k];
    }
    for (int i = 0; i < steps; i++) {
        MildContactResult result;
        input.position[0][2] = height;
        input.velocity[0][2] = up;
        input.free_velocity[2] = up - dt * GRAVITY;
        mild_ground_solve(memory, &terrain, &input, scratch, &result);
        mild_ground_advance(memory, &terrain, &input, scratch, &result);
        up += dt * (result.foot[0].force[2] / mass - GRAVITY);
        height += dt * up;
        way[i] = height;
    }
    mild_scratch_destroy(scratch);
    mild_sole_destroy(sole);
    free(block);
}

TEST(plate_falls_as_by_hand) {
    enum { STEPS = 600 };
    static double way[STEPS];
    step_by_hand(0.002, STEPS, way);
    for (int k = 0; k < 4; k++) {
        double worst = 0;
        mjModel *m = free_plate(0.002, integrators[k], "sand_loose", 8, "");
        mjData *d = mj_makeData(m);
        for (int i = 0; i < STEPS; i++) {
            mj_step(m, d);
            worst = fmax(worst, fabs(d->qpos[2] - way[i]));
        }
        print_message("%-12s plate of 8 kg: %.2f mm deep, by hand %.2f, apart by %.1e mm\n",
                      integrators[k], 1e3 * (HALF_Z - d->qpos[2]), 1e3 * (HALF_Z - way[STEPS - 1]),
                      1e3 * worst);
        assert_true(way[STEPS - 1] < HALF_Z - 0.01);
        assert_true(worst < 1e-7);
        mj_deleteData(d);
        mj_deleteModel(m);
    }
}

/* ---- a plate on a joint limit ---- */

/* A load on a rail stands on the plate through the upper limit of the joint between them. */
static mjModel *limited_plate(double dt, const char *integrator, const char *ground, double load,
                              double plate, const char *joint, const char *more) {
    char head[1000], text[3000];
    kit_head(head, sizeof head, dt, integrator, "plate", ground, "");
    snprintf(text, sizeof text,
             "%s<worldbody><body pos='0 0 0.3'><joint name='rail' type='slide' axis='0 0 1'/><geom "
             "type='box' size='.05 .05 .05' mass='%g' contype='0' conaffinity='0'/><body "
             "name='plate' pos='0 0 -0.289'><joint name='leg' type='slide' axis='0 0 1' "
             "limited='true' range='-0.05 0' ref='0' %s/>" PLATE
             "</body></body></worldbody>%s</mujoco>",
             head, load, joint, plate, more);
    return kit_model(text);
}

static double settled_depth(mjModel *m) {
    mjData *d = mj_makeData(m);
    d->qpos[1] = 0.001; /* at the limit from the start */
    kit_run(m, d, 4);
    const double depth = HALF_Z - d->xpos[3 * mj_name2id(m, mjOBJ_BODY, "plate") + 2];
    assert_true(fabs(d->qvel[0]) < 1e-3);
    mj_deleteData(d);
    mj_deleteModel(m);
    return depth;
}

/* Alike at all steps; and on elastic ground, which lags a little behind where the plate has swung
 * back, as the law says. */
static void check_limit(const char *ground, const char *integrator, const char *joint,
                        const char *solver) {
    static const double steps[] = {0.005, 0.002, 0.001};
    const int count = kit_short() ? 2 : 3; /* the finest takes longest */
    const double law = sinkage(ground, 8);
    double depth[3] = {0, 0, 0};
    for (int s = 0; s < count; s++) {
        depth[s] = settled_depth(limited_plate(steps[s], integrator, ground, 7, 1, joint, solver));
    }
    print_message("%-10s %-12s %-12s %-8.30s %.2f %.2f %.2f mm at 5, 2 and 1 ms, law %.2f\n",
                  ground, integrator, joint, solver, 1e3 * depth[0], 1e3 * depth[1], 1e3 * depth[2],
                  1e3 * law);
    for (int s = 0; s < count; s++) {
        assert_true(fabs(depth[s] - depth[count - 1]) < 0.02 * depth[count - 1]);
        assert_true(strcmp(ground, "rubber") != 0 || fabs(depth[s] - law) < 0.05 * law);
    }
}

TEST(plate_on_a_limit_sinks_as_deep) {
    static const char *const joints[] = {"", "damping='40'"};
    static const char *const solvers[] = {"", "<option solver='PGS' iterations='300'/>",
                                          "<option solver='CG' iterations='300'/>"};
    for (int j = 0; j < 6; j++) {
        for (int k = 0; k < 4; k++) {
            check_limit("rubber", integrators[k], joints[j % 2], solvers[j / 2]);
            check_limit("sand_loose", integrators[k], joints[j % 2], solvers[j / 2]);
        }
    }
}

/* A load that is a hundred times the plate: taken in turn, ground and limit would need hundreds of
 * rounds. */
TEST(light_plate_under_a_load) {
    for (int k = 0; k < 4; k++) {
        mjModel *m = limited_plate(0.005, integrators[k], "sand_loose", 8, 0.08, "", "");
        mjData *d = mj_makeData(m);
        int most = 0;
        d->qpos[1] = 0.001;
        for (int i = 0; i < 400; i++) {
            mj_step(m, d);
            most = plugin_soft(m, d)->rounds > most ? plugin_soft(m, d)->rounds : most;
        }
        print_message("%-12s 100 to 1: %d rounds at most, limit at %.2f mm\n", integrators[k], most,
                      1e3 * d->qpos[1]);
        assert_in_range(most, 1, 12);
        mj_deleteData(d);
        mj_deleteModel(m);
    }
}

/* ---- other contacts ---- */

/* A ball lies on the plate by MuJoCo's own contact: together they sink as their weight does. */
TEST(ball_on_a_plate) {
    static const char *const cones[] = {"pyramidal", "elliptic"};
    for (int c = 0; c < 2; c++) {
        for (int k = 0; k < 4; k++) {
            char head[1000], text[3000];
            kit_head(head, sizeof head, 0.002, integrators[k], "plate", "rubber", "");
            snprintf(text, sizeof text,
                     "%s<option cone='%s'/><worldbody><body name='plate' pos='0 0 0.012'>"
                     "<freejoint/><geom type='box' size='0.1 0.05 0.01' mass='1'/></body><body "
                     "pos='0 0 0.05'><freejoint/><geom type='box' size='.03 .03 .03' "
                     "mass='7'/></body></worldbody></mujoco>",
                     head, cones[c]);
            mjModel *m = kit_model(text);
            mjData *d = mj_makeData(m);
            kit_run(m, d, 2);
            const double depth = HALF_Z - d->qpos[2], law = sinkage("rubber", 8);
            print_message("%-12s %-10s block of 7 kg on a plate of 1 kg: %.2f mm, law %.2f, %d "
                          "contacts, %d rounds\n",
                          integrators[k], cones[c], 1e3 * depth, 1e3 * law, d->ncon,
                          plugin_soft(m, d)->rounds);
            assert_true(d->ncon > 0);
            assert_true(fabs(depth - law) < 0.05 * law);
            mj_deleteData(d);
            mj_deleteModel(m);
        }
    }
}

TEST_MAIN(kit_setup, NULL)
