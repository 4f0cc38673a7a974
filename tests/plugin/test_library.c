/* The shared library as MuJoCo loads it, with the example: what a user does first. */
#include <mujoco/mujoco.h>

#include "kit.h"
TEST(example_stands) {
    char error[500] = "";
    assert_null(mjp_getPlugin("mild.ground", NULL));
    mj_loadPluginLibrary(PLUGIN_FILE);
    const mjpPlugin *plugin = mjp_getPlugin("mild.ground", NULL);
    assert_non_null(plugin);
    assert_in_range(plugin->nattribute, 30, 95);
    mjModel *m = mj_loadXML(MILD_SOURCE_DIR "/examples/soft_stool.xml", NULL, error, sizeof error);
    if (!m) {
        fail_msg("%s", error);
    }
    mjData *d = mj_makeData(m);
    for (int i = 0; i < 400; i++) {
        mj_step(m, d);
    }
    const int foot = mj_name2id(m, mjOBJ_BODY, "foot1");
    const double sunk = 0.11 - d->xpos[3 * foot + 2];
    print_message("stool: its feet are %.1f mm deep, %.1e m/s\n", 1e3 * sunk, d->qvel[2]);
    assert_true(sunk > 0.002 && sunk < 0.05);
    assert_true(fabs(d->qvel[2]) < 1e-4);
    assert_true(d->xmat[9 * 1 + 8] > 0.999);
    mj_deleteData(d);
    mj_deleteModel(m);
}

TEST_MAIN(NULL, NULL)
