#include "view/pressure.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"

#define STANCE_FORCE 20.0 /* [N] normal force above which a foot is in stance */
#define STANCE_MAX 2.0    /* [s] a longer stance is standing still, not a step */
#define STANCE_MIN 0.05   /* [s] a shorter stance is a scuff */
#define STANCE_SAMPLES 4096

/* Sums over the finished stances of one foot on one material. */
typedef struct {
    double *sum, *peak; /* [elements] N */
    long samples;
    double path[PRESSURE_PATH][2];
    int stances;
} Tally;

/* The present stance of a foot. */
typedef struct {
    int material; /* -1: in the air, -2: began on another material */
    int samples;
    double *sum, *peak; /* [elements] */
    double center[STANCE_SAMPLES][2];
} Stance;

struct Pressure {
    const Robot *robot;
    const MildSole *const *soles;
    int materials;
    int min_samples, max_samples;
    Tally tally[MILD_MATERIALS_MAX][ROBOT_FEET_MAX];
    Stance stance[ROBOT_FEET_MAX];
    double *block; /* everything the pointers above point into */
};

Pressure *pressure_create(const Robot *robot, int materials, double dt, MildError *error) {
    if (!(dt > 0) || materials < 1 || materials > MILD_MATERIALS_MAX) {
        mild_fail(error, MILD_ERROR_ARGUMENT, "sole pressure: %d materials at %g s per step",
                  materials, dt);
        return NULL;
    }
    const MildSole *const *soles = robot_soles(robot);
    const int feet = robot_feet(robot);
    size_t elements = 0;
    for (int f = 0; f < feet; f++) {
        elements += (size_t)mild_sole_elements(soles[f]);
    }
    Pressure *pressure = calloc(1, sizeof *pressure);
    double *block = calloc(2 * elements * ((size_t)materials + 1), sizeof *block);
    if (!pressure || !block) {
        free(pressure);
        free(block);
        mild_fail(error, MILD_ERROR_MEMORY, "sole pressure: out of memory");
        return NULL;
    }
    pressure->robot = robot;
    pressure->soles = soles;
    pressure->materials = materials;
    pressure->block = block;
    double most = STANCE_MAX / dt;
    pressure->max_samples = most < STANCE_SAMPLES ? (int)most : STANCE_SAMPLES;
    pressure->min_samples = (int)(STANCE_MIN / dt) + 2;
    for (int f = 0; f < feet; f++) {
        size_t n = (size_t)mild_sole_elements(soles[f]);
        pressure->stance[f].material = -1;
        pressure->stance[f].sum = block, block += n;
        pressure->stance[f].peak = block, block += n;
        for (int m = 0; m < materials; m++) {
            pressure->tally[m][f].sum = block, block += n;
            pressure->tally[m][f].peak = block, block += n;
        }
    }
    return pressure;
}

void pressure_destroy(Pressure *pressure) {
    if (!pressure) {
        return;
    }
    free(pressure->block);
    free(pressure);
}

/* Adds the finished stance to its tally: element sums as they are, the path resampled over 0..100 %
 * of the stance. */
static void finish_stance(Pressure *pressure, int foot) {
    Stance *stance = &pressure->stance[foot];
    int samples = stance->samples;
    if (stance->material >= 0 && samples >= pressure->min_samples &&
        samples < pressure->max_samples) {
        Tally *tally = &pressure->tally[stance->material][foot];
        for (int i = 0; i < mild_sole_elements(pressure->soles[foot]); i++) {
            tally->sum[i] += stance->sum[i];
            if (stance->peak[i] > tally->peak[i]) {
                tally->peak[i] = stance->peak[i];
            }
        }
        tally->samples += samples;
        tally->stances++;
        for (int k = 0; k < PRESSURE_PATH; k++) {
            double at = (double)k * (samples - 1) / (PRESSURE_PATH - 1);
            int low = (int)at < samples - 1 ? (int)at : samples - 2;
            for (int c = 0; c < 2; c++) {
                tally->path[k][c] +=
                    stance->center[low][c] +
                    (at - low) * (stance->center[low + 1][c] - stance->center[low][c]);
            }
        }
    }
    stance->material = -1;
}

static void start_stance(Pressure *pressure, int foot, int material) {
    Stance *stance = &pressure->stance[foot];
    size_t bytes = (size_t)mild_sole_elements(pressure->soles[foot]) * sizeof(double);
    memset(stance->sum, 0, bytes);
    memset(stance->peak, 0, bytes);
    stance->samples = 0;
    stance->material = material;
}

void pressure_observe(Pressure *pressure, const RobotSim *sim, const MildTerrain *terrain) {
    for (int f = 0; f < robot_feet(pressure->robot); f++) {
        const MildSole *sole = pressure->soles[f];
        const double *normal = mild_scratch_elements(robot_sim_scratch(sim), f).normal;
        const double *x = mild_sole_x(sole), *y = mild_sole_y(sole);
        int elements = mild_sole_elements(sole);
        double force = 0, fx = 0, fy = 0;
        for (int i = 0; i < elements; i++) {
            force += normal[i], fx += normal[i] * x[i], fy += normal[i] * y[i];
        }
        Stance *stance = &pressure->stance[f];
        if (force < STANCE_FORCE) {
            if (stance->material != -1) {
                finish_stance(pressure, f);
            }
            continue;
        }
        const double *center = robot_sim_foot(sim, f)->sole_center;
        int material = mild_terrain_material_at(terrain, center[0], center[1]);
        if (stance->material == -1) {
            start_stance(pressure, f, material);
        } else if (stance->material != material) {
            stance->material = -2;
        }
        if (stance->samples >= pressure->max_samples) {
            continue;
        }
        for (int i = 0; i < elements; i++) {
            stance->sum[i] += normal[i];
            stance->peak[i] = normal[i] > stance->peak[i] ? normal[i] : stance->peak[i];
        }
        stance->center[stance->samples][0] = fx / force;
        stance->center[stance->samples][1] = fy / force;
        stance->samples++;
    }
}

int pressure_stances(const Pressure *pressure, int material) {
    int stances = 0;
    for (int f = 0; f < robot_feet(pressure->robot); f++) {
        stances += pressure->tally[material][f].stances;
    }
    return stances;
}

static void write_foot(const Pressure *pressure, int material, int foot, const char *name,
                       FILE *file) {
    const char *foot_name = robot_foot_name(pressure->robot, foot);
    const MildSole *sole = pressure->soles[foot];
    const Tally *tally = &pressure->tally[material][foot];
    double kilopascal = 1e-3 / (mild_sole_pitch(sole) * mild_sole_pitch(sole));
    for (int i = 0; i < mild_sole_elements(sole); i++) {
        fprintf(file, "%s,%s,element,%d,%.5f,%.5f,%.4f,%.4f\n", name, foot_name, i,
                mild_sole_x(sole)[i], mild_sole_y(sole)[i],
                kilopascal * tally->sum[i] / (double)tally->samples, kilopascal * tally->peak[i]);
    }
    for (int k = 0; k < PRESSURE_PATH; k++) {
        fprintf(file, "%s,%s,path,%d,%.5f,%.5f,,\n", name, foot_name, 100 * k / (PRESSURE_PATH - 1),
                tally->path[k][0] / tally->stances, tally->path[k][1] / tally->stances);
    }
}

MildStatus pressure_write(const Pressure *pressure, const char *path, const char *const *names,
                          MildError *error) {
    char *text = NULL;
    size_t size = 0;
    FILE *memory = open_memstream(&text, &size);
    if (!memory) {
        return mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", path);
    }
    fprintf(memory, "ground,foot,what,index,x_m,y_m,mean_kpa,peak_kpa\n");
    for (int m = 0; m < pressure->materials; m++) {
        for (int f = 0; f < robot_feet(pressure->robot); f++) {
            if (pressure->tally[m][f].stances > 0) {
                write_foot(pressure, m, f, names[m], memory);
            }
        }
    }
    MildStatus status = fclose(memory) == 0
                            ? file_write(path, text, size, error)
                            : mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", path);
    free(text);
    return status;
}
