/* What the tests of the plugin share: models from text, MuJoCo's messages caught. */
#ifndef PLUGIN_KIT_H
#define PLUGIN_KIT_H

#include "kit.h"
#include "plugin/plugin.h"

static char kit_said[1000]; /* MuJoCo's last warning or error, from compilation or after */
static int kit_messages;
static int kit_tilts; /* warnings of a foot on its side, which are not among them */
static char kit_tilted[200];

static inline void kit_listen(const mjLogMessage *message) {
    if (message->level < mjLOG_WARNING) {
        return;
    }
    if (strstr(message->subject, "sole tilted")) {
        snprintf(kit_tilted, sizeof kit_tilted, "%.190s", message->subject);
        kit_tilts++;
        return;
    }
    snprintf(kit_said, sizeof kit_said, "%.900s", message->subject);
    kit_messages++;
}

static inline int kit_setup(void **state) {
    (void)state;
    plugin_register();
    mju_setLogHandler(kit_listen);
    return 0;
}

/* The model of an MJCF text, or NULL with the reason in kit_said. */
static inline mjModel *kit_compile(const char *text) {
    char error[1000] = "";
    mjVFS vfs;
    mj_defaultVFS(&vfs);
    mj_addBufferVFS(&vfs, "test.xml", text, (int)strlen(text));
    mjModel *model = mj_loadXML("test.xml", &vfs, error, (int)sizeof error);
    mj_deleteVFS(&vfs);
    if (error[0]) { /* the compiler collects what the plugin says */
        snprintf(kit_said, sizeof kit_said, "%s", error);
        kit_messages++;
    }
    return model;
}

static inline mjModel *kit_model(const char *text) {
    kit_messages = 0;
    mjModel *model = kit_compile(text);
    if (!model) {
        fail_msg("%s", kit_said);
    }
    return model;
}

/* The head of an MJCF: step, integrator, and the plugin with its feet, ground and more keys. */
static inline const char *kit_head(char *text, size_t size, double dt, const char *integrator,
                                   const char *feet, const char *ground, const char *more) {
    snprintf(text, size,
             "<mujoco><option timestep='%g' integrator='%s'/><extension><plugin "
             "plugin='mild.ground'><instance name='soft'><config key='feet' value='%s'/><config "
             "key='ground' value='%s'/>%s</instance></plugin></extension>",
             dt, integrator, feet, ground, more);
    return text;
}

#define CONFIG(key, value) "<config key='" key "' value='" value "'/>"

static inline void kit_run(const mjModel *m, mjData *d, double seconds) {
    const int steps = (int)(seconds / m->opt.timestep + 0.5);
    for (int i = 0; i < steps; i++) {
        mj_step(m, d);
    }
}

#endif
