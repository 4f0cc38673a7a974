#include "plugin/sensor.h"

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
