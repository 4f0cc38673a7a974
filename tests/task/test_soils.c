/* Grounds of randomize.presets: what is read, what is refused, and what is drawn of them. */
#include <unistd.h>

#include "env/task/ground.h"
#include "ground/soil/soil.h"
#include "task_kit.h"

enum { DRAWS = 4000 };

static char folder[] = "/tmp/mild_soils_XXXXXX", path[64]; /* of a file for a soil */

static int setup(void **state) {
    if (!mkdtemp(folder)) {
        return 1;
    }
    snprintf(path, sizeof path, "%s/a.ini", folder);
    return kit_setup(state);
}

static int teardown(void **state) {
    unlink(path);
    rmdir(folder);
    return kit_teardown(state);
}

static void write_soil(const MildMaterial *soil) {
    MildError error = {0};
    expect_good(soil_write(soil, NULL, path, &error) == MILD_OK, &error);
}

static TaskDef def_of(const char *presets, int model) {
    TaskDef def = task_def_default();
    snprintf(def.randomize.presets, sizeof def.randomize.presets, "%s", presets);
    def.randomize.model = model;
    def.randomize.rigid_share = def.randomize.patch_share = 0;
    def.randomize.preset_share = 1;
    def.randomize.preset_jitter = 0.1;
    return def;
}

static void check_bad_soils(const char *presets, int model, MildStatus status, const char *names) {
    TaskDef def = def_of(presets, model);
    TaskSoils soils;
    MildError error = {0};
    assert_refused(task_soils_open(&def, robot, &soils, &error), status, &error, names);
}

TEST(what_is_read) {
    TaskDef def = def_of("", MILD_MODEL_MILD);
    TaskSoils soils;
    MildError error = {0};
    assert_int_equal(task_soils_open(&def, robot, &soils, &error), MILD_OK);
    assert_null(def.soils);
    def = def_of("clay, snow,foam45", MILD_MODEL_BEKKER);
    assert_int_not_equal(task_def_check_robot(&def, robot, &error), MILD_OK); /* not read yet */
    assert_error(&error, MILD_ERROR_ARGUMENT, "randomize.presets");
    assert_int_equal(task_soils_open(&def, robot, &soils, &error), MILD_OK);
    assert_int_equal(task_def_check_robot(&def, robot, &error), MILD_OK);
    assert_ptr_equal(def.soils, &soils);
    assert_int_equal(soils.count, 3);
    assert_true(soils.soil[0].k_c == 13190 && soils.soil[1].k_c == 4370);
    assert_int_equal(soils.soil[2].model, MILD_MODEL_MILD);
    def = def_of("clay", MILD_MODEL_RIGID);
    assert_int_equal(task_soils_open(&def, robot, &soils, &error), MILD_OK);
    def = def_of("clay", MILD_MODEL_BEKKER);
    task_def_choose_ground(&def); /* an evaluation names its own */
    assert_int_equal(task_def_check_robot(&def, robot, &error), MILD_OK);
    check_bad_soils("clay", MILD_MODEL_MILD, MILD_ERROR_ARGUMENT,
                    "randomize.presets clay randomize.model bekker");
    check_bad_soils("foam45,claj", MILD_MODEL_BEKKER, MILD_ERROR_ARGUMENT,
                    "randomize.presets claj clay");
    check_bad_soils("foam45,,clay", MILD_MODEL_BEKKER, MILD_ERROR_ARGUMENT,
                    "randomize.presets ground");
    check_bad_soils("rigid", MILD_MODEL_MILD, MILD_ERROR_ARGUMENT, "randomize.presets rigid");
    check_bad_soils("/no/such.ini", MILD_MODEL_MILD, MILD_ERROR_IO,
                    "randomize.presets /no/such.ini");
    check_bad_soils(
        "clay,clay,clay,clay,clay,clay,clay,clay,clay,clay,clay,clay,clay,clay,clay,clay,clay",
        MILD_MODEL_BEKKER, MILD_ERROR_RANGE, "randomize.presets 16");
}

/* Draws of a preset and a file of the same model: half each, each number within its jitter. */
TEST(what_is_drawn) {
    MildMaterial soil[2];
    TaskSoils soils;
    MildError error = {0};
    Pool *pool = pool_create(1);
    assert_true(mild_material_preset("clay", &soil[0]) && mild_material_preset("snow", &soil[1]));
    soil[1].shear_length = 0.033;
    write_soil(&soil[1]);
    char names[100];
    snprintf(names, sizeof names, "clay,%s", path);
    TaskDef def = def_of(names, MILD_MODEL_BEKKER);
    assert_int_equal(task_soils_open(&def, robot, &soils, &error), MILD_OK);
    unlink(path); /* read once */
    TaskGrounds *grounds = task_grounds_create(&def, robot, DRAWS, 3, pool, &error);
    assert_non_null(grounds);
    int snow = 0;
    double least[4] = {2, 2, 2, 2}, most[4] = {0}, sum = 0;
    for (int i = 0; i < DRAWS; i++) {
        const MildMaterial *m = &grounds->ground[i].material;
        const int k = m->shear_length == 0.033;
        snow += k;
        assert_true(m->model == MILD_MODEL_BEKKER && m->exponent == soil[k].exponent);
        assert_true(m->shear_length == soil[k].shear_length && m->bed_depth == 1);
        const double factor[4] = {m->k_c / soil[k].k_c, m->k_phi / soil[k].k_phi,
                                  m->mu / soil[k].mu, m->cohesion / soil[k].cohesion};
        for (int n = 0; n < 4; n++) {
            least[n] = fmin(least[n], factor[n]);
            most[n] = fmax(most[n], factor[n]);
        }
        sum += (factor[0] - 1) * (factor[1] - 1);
    }
    assert_true(snow > 0.46 * DRAWS && snow < 0.54 * DRAWS);
    for (int n = 0; n < 4; n++) {
        assert_true(least[n] >= 0.9 - 1e-12 && least[n] < 0.901);
        assert_true(most[n] <= 1.1 + 1e-12 && most[n] > 1.099);
    }
    assert_true(fabs(sum / DRAWS) < 5 * 0.01 / 3 / sqrt(DRAWS)); /* each by itself */
    task_grounds_destroy(grounds);
    pool_destroy(pool);
}

/* k_c below 0 is drawn with the factor of k_phi, so that the modulus under every sole keeps its
 * sign. Ground that does not bear the robot's feet is refused. */
TEST(pressure_that_grows_with_the_sole) {
    MildError error = {0};
    MildMaterial soil;
    TaskSoils soils;
    Pool *pool = pool_create(1);
    const double width = mild_sole_width(robot_rasters(robot)[0]);
    assert_true(mild_material_preset("clay", &soil));
    soil.k_c = -0.98 * width * soil.k_phi;
    write_soil(&soil);
    TaskDef def = def_of(path, MILD_MODEL_BEKKER);
    assert_int_equal(task_soils_open(&def, robot, &soils, &error), MILD_OK);
    TaskGrounds *grounds = task_grounds_create(&def, robot, 200, 3, pool, &error);
    assert_non_null(grounds);
    for (int i = 0; i < 200; i++) {
        const MildMaterial *m = &grounds->ground[i].material;
        assert_true(fabs(m->k_c / m->k_phi / (soil.k_c / soil.k_phi) - 1) < 1e-12);
    }
    soil.k_c = -1.02 * width * soil.k_phi;
    write_soil(&soil);
    check_bad_soils(path, MILD_MODEL_BEKKER, MILD_ERROR_RANGE,
                    "randomize.presets a.ini ground.k_c ground.plate_width");
    task_grounds_destroy(grounds);
    pool_destroy(pool);
}

/* A soil of mild is matched to another model, as a preset is. Granular presets carry the SA01 as
 * deep as the paper's. */
TEST(what_is_matched) {
    static const struct {
        const char *name;
        double k_pen, sigma_cone;
    } paper[] = {{"sand_loose", 380, 0.15e6}, {"sand_dense", 700, 0.24e6}};
    for (int i = 0; i < 2; i++) {
        MildMaterial own, m;
        assert_true(mild_material_preset(paper[i].name, &own));
        assert_int_equal(robot_match_model(robot, MILD_MODEL_MILD, &own, &m, NULL), MILD_OK);
        assert_true(fabs(m.k_pen / paper[i].k_pen - 1) < 2e-6);
        assert_true(fabs(m.sigma_cone / paper[i].sigma_cone - 1) < 2e-6);
        assert_true(m.model == MILD_MODEL_MILD && m.slip_length == 0 && m.grip == 0);
    }
    TaskDef def = def_of("grass", MILD_MODEL_BEKKER);
    TaskSoils soils;
    MildError error = {0};
    MildMaterial grass, wanted;
    Pool *pool = pool_create(1);
    def.randomize.preset_jitter = 0;
    assert_int_equal(task_soils_open(&def, robot, &soils, &error), MILD_OK);
    TaskGrounds *grounds = task_grounds_create(&def, robot, 5, 3, pool, &error);
    assert_true(mild_material_preset("grass", &grass));
    assert_int_equal(robot_match_model(robot, MILD_MODEL_BEKKER, &grass, &wanted, NULL), MILD_OK);
    for (int i = 0; i < 5; i++) {
        assert_true(grounds->ground[i].material.k_phi == wanted.k_phi);
    }
    task_grounds_destroy(grounds);
    pool_destroy(pool);
}

TEST_MAIN(setup, teardown)
