/* The engine plugin: soft ground under any MJCF (docs/plugin.md). It acts at two stages, because
 * MuJoCo has a stage of actuation only in models with actuators (soft.h); at a third it says what
 * it did (sensor.h). */
#include <stdatomic.h>
#include <string.h>

#include "plugin/check.h"
#include "plugin/plugin.h"
#include "plugin/sensor.h"
#include "plugin/visual.h"

/* NULL in an mjData whose `init` has failed, which the compiler may go on with. */
static Soft *soft_of(const mjData *d, int instance) {
    return (Soft *)d->plugin_data[instance];
}

static MildGround *ground_of(const mjModel *m, const mjData *d, int instance) {
    return (MildGround *)(void *)(d->plugin_state + m->plugin_stateadr[instance]);
}

/* MuJoCo's warnings are the channel for what is wrong with a plugin's attributes. */
static void say(const mjModel *m, int instance, const char *text) {
    const char *name = mj_id2name(m, mjOBJ_PLUGIN, instance);
    mju_warning(PLUGIN_NAME "%s%s%s: %s", name ? " '" : "", name ? name : "", name ? "'" : "",
                text);
}

static Soft *create(const mjModel *m, int instance, MildError *error) {
    return check_model(m, instance, error) == MILD_OK ? soft_create(m, instance, error) : NULL;
}

/* Bool: the warning about the feet of the model that was compiled last has been given. */
static atomic_int warned;

/* Called first, when the model is compiled; what is wrong is said by `init`. */
static int state_size(const mjModel *m, int instance) {
    atomic_store(&warned, 0);
    return (int)(soft_state_bytes(m, instance) / sizeof(mjtNum));
}

/* Called when a model with a sensor of the instance is compiled. */
static int sensor_size(const mjModel *m, int instance, int sensor) {
    (void)sensor;
    return SENSOR_NUMBERS * soft_feet(m, instance);
}

static int init(const mjModel *m, mjData *d, int instance) {
    MildError error = {0};
    char text[400];
    Soft *soft = create(m, instance, &error);
    d->plugin_data[instance] = (uintptr_t)soft;
    if (!soft) {
        say(m, instance, error.text);
        return -1;
    }
    /* the compiler makes an mjData of its own, for which the model has no signature yet */
    if (m->signature && check_feet(m, soft, text, sizeof text) && !atomic_exchange(&warned, 1)) {
        say(m, instance, text);
    }
    return 0;
}

static void destroy(mjData *d, int instance) {
    soft_destroy(soft_of(d, instance));
    d->plugin_data[instance] = 0;
}

static void copy(mjData *to, const mjModel *m, const mjData *from, int instance) {
    if (soft_of(to, instance) && soft_of(from, instance)) {
        soft_copy(soft_of(to, instance), m, soft_of(from, instance));
    }
}

static void reset(const mjModel *m, mjtNum *state, void *data, int instance) {
    (void)m;
    (void)instance;
    if (data) {
        soft_reset(data, state);
    }
}

static void compute(const mjModel *m, mjData *d, int instance, int capability) {
    Soft *soft = soft_of(d, instance);
    MildGround *ground = ground_of(m, d, instance);
    if (!soft) {
        return;
    }
    if (capability == mjPLUGIN_SENSOR) {
        sensor_write(soft, m, d, instance);
        return;
    }
    if (!soft_owns(soft, ground)) {
        say(m, instance, "its state is not one of this ground; it was reset");
        soft_reset(soft, ground);
    }
    if (capability == mjPLUGIN_PASSIVE) {
        soft_passive(soft, m, d, ground);
    } else {
        soft_actuation(soft, m, d, ground);
    }
}

static void advance(const mjModel *m, mjData *d, int instance) {
    if (soft_of(d, instance)) {
        soft_advance(soft_of(d, instance), m, d, ground_of(m, d, instance));
    }
}

static void visualize(const mjModel *m, mjData *d, const mjvOption *option, mjvScene *scene,
                      int instance) {
    const Soft *soft = soft_of(d, instance);
    const MildGround *ground = ground_of(m, d, instance);
    if (soft && soft_owns(soft, ground)) {
        visual_add(soft, m, d, ground, option, scene);
    }
}

const Soft *plugin_soft(const mjModel *m, const mjData *d) {
    for (int i = 0; i < m->nplugin; i++) {
        const mjpPlugin *plugin = mjp_getPluginAtSlot(m->plugin[i]);
        if (plugin && strcmp(plugin->name, PLUGIN_NAME) == 0) {
            return soft_of(d, i);
        }
    }
    return NULL;
}

void plugin_register(void) {
    mjpPlugin plugin;
    mjp_defaultPlugin(&plugin);
    plugin.name = PLUGIN_NAME;
    plugin.attributes = plugin_attributes(&plugin.nattribute);
    plugin.capabilityflags = mjPLUGIN_ACTUATOR | mjPLUGIN_PASSIVE | mjPLUGIN_SENSOR;
    plugin.needstage = mjSTAGE_ACC;
    plugin.nsensordata = sensor_size;
    plugin.nstate = state_size;
    plugin.init = init;
    plugin.destroy = destroy;
    plugin.copy = copy;
    plugin.reset = reset;
    plugin.compute = compute;
    plugin.advance = advance;
    plugin.visualize = visualize;
    mjp_registerPlugin(&plugin);
}
