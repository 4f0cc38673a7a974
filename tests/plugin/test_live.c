/* The ground changes while it runs. */
#include <math.h>

#include "plugin/plugin.h"
#include "plugin_kit.h"

#define PLATE                                                                                      \
    "<worldbody><body name='plate' pos='0 0 0.02'><freejoint/><geom type='box' size='.1 .05 .01' " \
    "mass='10' contype='0' conaffinity='0'/></body></worldbody></mujoco>"

static mjModel *plate_on(const char *ground, const char *more) {
    char head[1500], text[3000];
    kit_head(head, sizeof head, 0.002, "Euler", "plate", ground, more);
    snprintf(text, sizeof text, "%s%s", head, PLATE);
    return kit_model(text);
}

/* A plate on foam that is made sand is on sand: from the start with the same bits, and after it has
 * come to rest on the foam it goes on down, to where a plate rests that was put on the sand. */
TEST(changes_as_if_made_so) {
    char text[4000], error[300] = "";
    mjModel *foam = plate_on("foam60", ""), *sand = plate_on("sand_loose", "");
    mjData *d = mj_makeData(foam), *other = mj_makeData(sand);
    const int length = plugin_ground_print(sand, other, NULL, 0, text, sizeof text);
    assert_in_range(length, 200, sizeof text - 1);
    assert_int_equal(plugin_ground_change(foam, d, NULL, 0, text, error, sizeof error), 0);
    kit_run(foam, d, 1);
    kit_run(sand, other, 1);
    assert_memory_equal(d->qpos, other->qpos, (size_t)foam->nq * sizeof(double));
    const double wanted = 0.01 - d->qpos[2];
    mj_deleteData(d);

    d = mj_makeData(foam);
    kit_run(foam, d, 3);
    const double before = 0.01 - d->qpos[2];
    assert_int_equal(plugin_ground_change(foam, d, "soft", 0, text, error, sizeof error), 0);
    kit_run(foam, d, 3);
    const double after = 0.01 - d->qpos[2];
    print_message("foam %.2f mm, then sand %.2f mm, fallen on sand %.2f mm\n", 1e3 * before,
                  1e3 * after, 1e3 * wanted);
    assert_true(fabs(d->qvel[2]) < 1e-4);
    assert_true(after > 1.3 * before && after < wanted && after > 0.7 * wanted);

    char now[4000];
    assert_int_equal(plugin_ground_print(foam, d, "soft", 0, now, sizeof now), length);
    assert_string_equal(now, text);
    mjData *copy = mj_copyData(NULL, foam, d), *fresh = mj_makeData(foam);
    plugin_ground_print(foam, copy, NULL, 0, now, sizeof now);
    assert_string_equal(now, text); /* the change belongs to the data */
    plugin_ground_print(foam, fresh, NULL, 0, now, sizeof now);
    assert_string_not_equal(now, text);
    mj_resetData(foam, d);
    plugin_ground_print(foam, d, NULL, 0, now, sizeof now);
    assert_string_equal(now, text);
    mj_deleteData(copy);
    mj_deleteData(fresh);
    mj_deleteData(d);
    mj_deleteData(other);
    mj_deleteModel(foam);
    mj_deleteModel(sand);
}

/* A preset is matched to the model of the ground, as that of the file was. */
TEST(model_stays) {
    char text[4000], now[4000], error[300] = "";
    const char *bekker = CONFIG("ground.model", "bekker");
    mjModel *m = plate_on("sand_dense", bekker), *made = plate_on("sand_loose", bekker);
    mjModel *mild = plate_on("sand_loose", "");
    mjData *d = mj_makeData(m), *wanted = mj_makeData(made), *plain = mj_makeData(mild);
    plugin_ground_print(mild, plain, NULL, 0, text, sizeof text);
    assert_int_equal(plugin_ground_change(m, d, NULL, 0, text, error, sizeof error), 0);
    plugin_ground_print(m, d, NULL, 0, now, sizeof now);
    plugin_ground_print(made, wanted, NULL, 0, text, sizeof text);
    assert_string_equal(now, text);
    plugin_ground_change(mild, plain, NULL, 0, "mu=0.25", error, sizeof error);
    assert_int_equal(plugin_ground_change(mild, plain, NULL, 0, text, error, sizeof error), -1);
    assert_names(error, "bekker");
    mj_deleteData(d);
    mj_deleteData(wanted);
    mj_deleteData(plain);
    mj_deleteModel(m);
    mj_deleteModel(made);
    mj_deleteModel(mild);
}

/* What is wrong changes nothing. */
TEST(refuses) {
    static const struct {
        const char *name;
        int label;
        const char *text;
    } wrong[] = {{"other", 0, "mu=0.3"},
                 {NULL, 1, "mu=0.3"},
                 {NULL, -1, "mu=0.3"},
                 {NULL, 0, "mu"},
                 {NULL, 0, "my=0.3"},
                 {NULL, 0, "mu=-1"},
                 {NULL, 0, "mu=x"},
                 {NULL, 0, "mu=0.3\nk_pen=nan"},
                 {NULL, 0, "plate_width=1e-9"}};
    char before[4000], now[4000];
    mjModel *m = plate_on("sand_loose", "");
    mjData *d = mj_makeData(m);
    plugin_ground_print(m, d, NULL, 0, before, sizeof before);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        char error[300] = "";
        assert_int_equal(plugin_ground_change(m, d, wrong[i].name, wrong[i].label, wrong[i].text,
                                              error, sizeof error),
                         -1);
        assert_true(error[0]);
        plugin_ground_print(m, d, NULL, 0, now, sizeof now);
        assert_string_equal(now, before);
    }
    assert_int_equal(plugin_ground_print(m, d, NULL, 1, now, sizeof now), -1);
    assert_true(plugin_ground_print(m, d, NULL, 0, now, 10) > 10); /* cut off */
    assert_int_equal(strlen(now), 9);
    mj_deleteData(d);
    mj_deleteModel(m);
}

/* The labels of a pattern change each by itself. */
TEST(labels) {
    char text[4000], error[300] = "";
    mjModel *m = plate_on("foam45 grass", CONFIG("terrain.patches", "stripes"));
    mjData *d = mj_makeData(m);
    assert_int_equal(plugin_ground_change(m, d, NULL, 1, "mu=0.123", error, sizeof error), 0);
    plugin_ground_print(m, d, NULL, 1, text, sizeof text);
    assert_non_null(strstr(text, "\nmu=0.123\n"));
    plugin_ground_print(m, d, NULL, 0, text, sizeof text);
    assert_null(strstr(text, "\nmu=0.123\n"));
    mj_deleteData(d);
    mj_deleteModel(m);
}

TEST_MAIN(kit_setup, NULL)
