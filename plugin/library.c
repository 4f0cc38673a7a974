/* What happens when mj_loadPluginLibrary loads the shared library. */
#include "plugin/plugin.h"

/* A plugin reads mjModel and mjData, whose layout changes with every version of MuJoCo. Not by
 * mjPLUGIN_LIB_INIT, which takes a name in some versions and none in others. */
__attribute__((constructor)) static void load(void) {
    if (mj_version() != mjVERSION_HEADER) {
        mju_warning(PLUGIN_NAME ": built for MuJoCo %d, loaded into %d; build the plugin against "
                                "the MuJoCo that is in use (docs/plugin.md)",
                    mjVERSION_HEADER, mj_version());
        return;
    }
    plugin_register();
}

/* For mild.ground of the Python package. */
#define SHOWN __attribute__((visibility("default")))

SHOWN int mild_plugin_print(const mjModel *m, const mjData *d, const char *name, int label,
                            char *text, int size);
SHOWN int mild_plugin_change(const mjModel *m, mjData *d, const char *name, int label,
                             const char *text, char *error, int size);

int mild_plugin_print(const mjModel *m, const mjData *d, const char *name, int label, char *text,
                      int size) {
    return plugin_ground_print(m, d, name, label, text, size);
}

int mild_plugin_change(const mjModel *m, mjData *d, const char *name, int label, const char *text,
                       char *error, int size) {
    return plugin_ground_change(m, d, name, label, text, error, size);
}
