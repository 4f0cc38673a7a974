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
