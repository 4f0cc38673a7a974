/* The engine plugin: soft ground under any MJCF (docs/plugin.md). It acts at two stages, because
 * MuJoCo has a stage of actuation only in models with actuators (soft.h); at a third it says what
 * it did (sensor_write). */
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>

#include "plugin/plugin.h"

/* ---- sensors ---- */

static void write_foot(const MildFootResult *foot, mjtNum *data) {
    mju_copy3(data, foot->force);
    mju_copy3(data + 3, foot->torque);
    mju_copy3(data + 6, foot->pressure_center);
    data[9] = foot->area;
    data[10] = foot->depth_max;
    data[11] = foot->depth_mean;
}

void sensor_write(const Soft *soft, const mjModel *m, mjData *d, int instance) {
    for (int s = 0; s < m->nsensor; s++) {
        if (m->sensor_type[s] != mjSENS_PLUGIN || m->sensor_plugin[s] != instance) {
            continue;
        }
        mjtNum *data = d->sensordata + m->sensor_adr[s];
        mju_zero(data, m->sensor_dim[s]);
        for (int f = 0; f < soft->feet && soft->known; f++) {
            write_foot(&soft->contact.foot[f], data + (ptrdiff_t)(SENSOR_NUMBERS * f));
        }
    }
}

/* ---- stages ---- */

/* NULL in an mjData whose `init` has failed, which the compiler may go on with. */
static Soft *soft_of(const mjData *d, int instance) {
    return (Soft *)d->plugin_data[instance];
}

static MildGround *ground_of(const mjModel *m, const mjData *d, int instance) {
    return (MildGround *)(void *)(d->plugin_state + m->plugin_stateadr[instance]);
}

/* A message that names the instance. */
static const char *name_it(const mjModel *m, int instance, const char *text, char *line,
                           size_t size) {
    const char *name = mj_id2name(m, mjOBJ_PLUGIN, instance);
    snprintf(line, size, PLUGIN_NAME "%s%.60s%s: %s", name ? " '" : "", name ? name : "",
             name ? "'" : "", text);
    return line;
}

static void say(const mjModel *m, int instance, const char *text) {
    char line[600];
    mju_warning("%s", name_it(m, instance, text, line, sizeof line));
}

/* Does not return. MuJoCo would free the mjData and end with an error of its own if `init` failed;
 * a warning beside it is said twice since MuJoCo 3.10. */
static void refuse(const mjModel *m, mjData *d, int instance, const char *text) {
    char line[600];
    name_it(m, instance, text, line, sizeof line);
    mju_free(d->buffer);
    mju_free(d->arena);
    mju_free(d);
    mju_error("%s", line);
}

static size_t state_bytes(const mjModel *m, int instance) {
    return (size_t)m->plugin_statenum[instance] * sizeof(mjtNum);
}

static Soft *create(const mjModel *m, int instance, MildError *error) {
    return check_model(m, instance, error) == MILD_OK ? soft_create(m, instance, error) : NULL;
}

/* Bool: the warnings about the model that was compiled last have been given, and the one about a
 * body that a rigid floor carries. */
static atomic_int warned, rested;

/* Called first, when the model is compiled; what is wrong is said by `init`. */
static int state_size(const mjModel *m, int instance) {
    atomic_store(&warned, 0);
    atomic_store(&rested, 0);
    return (int)(soft_room(m, instance) / sizeof(mjtNum));
}

/* Called when a model with a sensor of the instance is compiled. A sensor of no numbers would end
 * the compilation before `init` can say what is wrong. */
static int sensor_size(const mjModel *m, int instance, int sensor) {
    const int feet = soft_feet(m, instance);
    (void)sensor;
    return SENSOR_NUMBERS * (feet > 0 ? feet : 1);
}

static int init(const mjModel *m, mjData *d, int instance) {
    MildError error = {0};
    char text[400];
    Soft *soft = create(m, instance, &error);
    d->plugin_data[instance] = (uintptr_t)soft;
    if (!soft) {
        refuse(m, d, instance, error.text);
    }
    /* the compiler makes an mjData of its own, for which the model has no signature yet */
    if (m->signature && !atomic_exchange(&warned, 1)) {
        if (check_feet(m, soft, text, sizeof text)) {
            say(m, instance, text);
        }
        if (check_sensors(m, soft, text, sizeof text)) {
            say(m, instance, text);
        }
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
    if (data) {
        soft_reset(data, state, state_bytes(m, instance));
    }
}

/* The ground's memory. What is not one of this ground is said and replaced. */
static MildGround *own_state(Soft *soft, const mjModel *m, const mjData *d, int instance) {
    MildGround *ground = ground_of(m, d, instance);
    if (!soft_owns(soft, ground)) {
        say(m, instance, "its state is not one of this ground; it was reset");
        soft_reset(soft, ground, state_bytes(m, instance));
    }
    return ground;
}

static void compute(const mjModel *m, mjData *d, int instance, int capability) {
    Soft *soft = soft_of(d, instance);
    if (!soft) {
        return;
    }
    if (capability == mjPLUGIN_SENSOR) {
        sensor_write(soft, m, d, instance);
        return;
    }
    if (capability == mjPLUGIN_PASSIVE ? soft_passive(soft, m, d) : soft_actuation(soft, m, d)) {
        soft_step(soft, m, d, own_state(soft, m, d, instance));
    }
}

static void advance(const mjModel *m, mjData *d, int instance) {
    Soft *soft = soft_of(d, instance);
    if (soft) {
        char text[400];
        soft_advance(soft, m, d, own_state(soft, m, d, instance));
        if (!atomic_load(&rested) && check_rests(m, d, soft, text, sizeof text) &&
            !atomic_exchange(&rested, 1)) {
            say(m, instance, text);
        }
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

/* The instance of this name, or the only one (NULL); -1 when there is none with a ground. */
static int find_instance(const mjModel *m, const mjData *d, const char *name) {
    for (int i = 0; i < m->nplugin; i++) {
        const mjpPlugin *plugin = mjp_getPluginAtSlot(m->plugin[i]);
        const char *own = mj_id2name(m, mjOBJ_PLUGIN, i);
        if (plugin && strcmp(plugin->name, PLUGIN_NAME) == 0 &&
            (!name || (own && strcmp(own, name) == 0))) {
            return soft_of(d, i) ? i : -1;
        }
    }
    return -1;
}

/* Its ground; NULL when there is none. */
static Soft *find_soft(const mjModel *m, const mjData *d, const char *name) {
    const int instance = find_instance(m, d, name);
    return instance < 0 ? NULL : soft_of(d, instance);
}

const Soft *plugin_soft(const mjModel *m, const mjData *d) {
    return find_soft(m, d, NULL);
}

int plugin_ground_print(const mjModel *m, const mjData *d, const char *name, int label, char *text,
                        int size) {
    const Soft *soft = find_soft(m, d, name);
    return soft ? live_print(soft, label, text, size) : -1;
}

int plugin_ground_change(const mjModel *m, mjData *d, const char *name, int label, const char *text,
                         char *error, int size) {
    MildError said = {0};
    const int instance = find_instance(m, d, name);
    if (instance < 0) {
        snprintf(error, (size_t)size, "the model has no " PLUGIN_NAME " of this name");
        return -1;
    }
    Soft *soft = soft_of(d, instance);
    MildGround *ground = ground_of(m, d, instance);
    ground = soft_owns(soft, ground) ? ground : NULL; /* the next step resets what is none */
    if (live_change(soft, m, ground, label, text, &said) != MILD_OK) {
        snprintf(error, (size_t)size, "%s", said.text);
        return -1;
    }
    return 0;
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
