/* The file of an actuator network: the tensors of a PyTorch ModuleList of Sequential(Linear,
 * Softsign, Linear, Softsign, Linear), motors.0.0.weight and so on, with the scales and the kinds
 * of the joints. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/text.h"
#include "env/actuator/private.h"
#include "learn/safetensors.h"

#define FILE_KIND "mild actuator"
#define FILE_VERSION "1"

enum { SCALES = 3, TENSORS_MAX = 2 * MLP_LAYERS_MAX * ROBOT_JOINTS_MAX + 2 };

typedef struct {
    int count;
    Safetensor tensor[TENSORS_MAX];
    char name[TENSORS_MAX][40];
} Tensors;

static void add(Tensors *tensors, SafetensorsType type, const void *data, int rows, int columns) {
    const size_t one = type == SAFETENSORS_F32 ? sizeof(float) : sizeof(double);
    tensors->tensor[tensors->count] =
        (Safetensor){.name = tensors->name[tensors->count],
                     .type = type,
                     .rank = columns > 0 ? 2 : 1,
                     .shape = {rows, columns},
                     .data = data,
                     .bytes = one * (size_t)rows * (size_t)(columns > 0 ? columns : 1)};
    tensors->count++;
}

/* What the file of an actuator holds. `data` points into the actuator, into scale
 * [kinds][SCALES] and into kind [joints]. */
static void list_tensors(const Actuator *actuator, const double *scale, const int64_t *kind,
                         Tensors *tensors) {
    const Mlp mlp = actuator_mlp();
    tensors->count = 0;
    for (int k = 0; k < actuator->kinds; k++) {
        const float *parameters = actuator->net[k].parameters;
        for (int l = 0; l < mlp.layers; l++) {
            const MlpLayer *layer = &mlp.layer[l];
            const int first = tensors->count;
            snprintf(tensors->name[first], sizeof tensors->name[0], "motors.%d.%d.weight", k,
                     2 * l);
            add(tensors, SAFETENSORS_F32, parameters + layer->weight, layer->out, layer->in);
            snprintf(tensors->name[first + 1], sizeof tensors->name[0], "motors.%d.%d.bias", k,
                     2 * l);
            add(tensors, SAFETENSORS_F32, parameters + layer->bias, layer->out, 0);
        }
    }
    strcpy(tensors->name[tensors->count], "scale");
    add(tensors, SAFETENSORS_F64, scale, actuator->kinds, SCALES);
    strcpy(tensors->name[tensors->count], "kind");
    add(tensors, SAFETENSORS_I64, kind, actuator->joint_count, 0);
}

MildStatus actuator_save(const Actuator *actuator, const char *path, const char *note,
                         MildError *error) {
    Tensors tensors;
    double scale[ROBOT_JOINTS_MAX][SCALES];
    int64_t kind[ROBOT_JOINTS_MAX];
    char spacing[32];
    for (int k = 0; k < actuator->kinds; k++) {
        const ActuatorScale *own = &actuator->net[k].scale;
        scale[k][0] = own->error, scale[k][1] = own->speed, scale[k][2] = own->torque;
    }
    for (int i = 0; i < actuator->joint_count; i++) {
        kind[i] = actuator->kind[i];
    }
    list_tensors(actuator, scale[0], kind, &tensors);
    snprintf(spacing, sizeof spacing, "%.17g", actuator->spacing);
    const SafetensorsText texts[] = {{"kind", FILE_KIND},
                                     {"version", FILE_VERSION},
                                     {"note", note ? note : ""},
                                     {"robot", actuator->robot},
                                     {"joints", actuator->joints},
                                     {"spacing", spacing},
                                     {"inputs", "error/scale[0] at t, t - spacing, t - 2 spacing; "
                                                "then speed/scale[1]; output torque/scale[2]"}};
    return safetensors_write(path, tensors.tensor, tensors.count, texts,
                             sizeof texts / sizeof *texts, error);
}

/* ---- reading ---- */

static MildStatus bad_file(const char *path, const char *why, MildError *error) {
    return mild_fail(error, MILD_ERROR_FORMAT,
                     "%.200s: %s; give a file that `mild actuator fit` wrote", path, why);
}

static MildStatus check_texts(const Safetensors *file, const char *path, const Actuator *wanted,
                              double *spacing, MildError *error) {
    const char *kind = safetensors_text(file, "kind"), *version = safetensors_text(file, "version");
    const char *robot = safetensors_text(file, "robot"), *joints = safetensors_text(file, "joints");
    const char *text = safetensors_text(file, "spacing");
    if (!kind || strcmp(kind, FILE_KIND) != 0) {
        return bad_file(path, "holds no actuator network", error);
    }
    if (!version || strcmp(version, FILE_VERSION) != 0) {
        return bad_file(path, "has another version than " FILE_VERSION, error);
    }
    if (!robot || !joints || !text || !text_double(text, spacing) ||
        !(*spacing >= ACTUATOR_SPACING_MIN && *spacing <= ACTUATOR_SPACING_MAX)) {
        return bad_file(path, "its robot, joints or spacing is missing or wrong", error);
    }
    if (strcmp(robot, wanted->robot) != 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%.200s: is an actuator network of robot %.63s, and this is %s", path,
                         robot, wanted->robot);
    }
    return strcmp(joints, wanted->joints) == 0
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_ARGUMENT,
                           "%.200s: is of a robot %s with other joints; fit it again", path,
                           wanted->robot);
}

/* Copies a tensor of the file into `data`. */
static MildStatus take(const Safetensors *file, const char *path, const Safetensor *want,
                       void *data, MildError *error) {
    const Safetensor *have = safetensors_find(file, want->name);
    char why[96];
    if (have && have->type == want->type && have->rank == want->rank &&
        memcmp(have->shape, want->shape, sizeof have->shape) == 0) {
        memcpy(data, have->data, have->bytes);
        return MILD_OK;
    }
    snprintf(why, sizeof why, "tensor %s is missing or has another type or shape", want->name);
    return bad_file(path, why, error);
}

static MildStatus check_numbers(const Actuator *actuator, const char *path, const double *scale,
                                const int64_t *kind, const float *parameters, MildError *error) {
    const int count = actuator_parameters();
    for (int i = 0; i < actuator->joint_count; i++) {
        if (kind[i] != actuator->kind[i]) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "%.200s: its joints share motors in another way than gains, effort "
                             "and speed of robot %s say; fit it again",
                             path, actuator->robot);
        }
    }
    for (int i = 0; i < actuator->kinds * SCALES; i++) {
        if (!(scale[i] > 0 && scale[i] < 1e9)) {
            return bad_file(path, "has a scale that is not positive", error);
        }
    }
    for (int i = 0; i < actuator->kinds * count; i++) {
        if (!isfinite(parameters[i])) {
            return bad_file(path, "holds weights that are not finite", error);
        }
    }
    return MILD_OK;
}

static MildStatus take_networks(const Safetensors *file, const char *path, Actuator *actuator,
                                float *parameters, MildError *error) {
    Tensors tensors;
    double scale[ROBOT_JOINTS_MAX][SCALES] = {{0}};
    int64_t kind[ROBOT_JOINTS_MAX] = {0};
    const int count = actuator_parameters(), per_kind = 2 * actuator_mlp().layers;
    list_tensors(actuator, scale[0], kind, &tensors);
    MildStatus status = safetensors_count(file) == tensors.count
                            ? MILD_OK
                            : bad_file(path, "has another number of tensors", error);
    for (int i = 0; status == MILD_OK && i < tensors.count - 2; i++) {
        const int k = i / per_kind;
        const ptrdiff_t at = (const float *)tensors.tensor[i].data - actuator->net[k].parameters;
        status =
            take(file, path, &tensors.tensor[i], parameters + (ptrdiff_t)k * count + at, error);
    }
    if (status == MILD_OK) {
        status = take(file, path, &tensors.tensor[tensors.count - 2], scale, error);
    }
    if (status == MILD_OK) {
        status = take(file, path, &tensors.tensor[tensors.count - 1], kind, error);
    }
    if (status == MILD_OK) {
        status = check_numbers(actuator, path, scale[0], kind, parameters, error);
    }
    for (int k = 0; status == MILD_OK && k < actuator->kinds; k++) {
        actuator_set(actuator, k, (ActuatorScale){scale[k][0], scale[k][1], scale[k][2]},
                     parameters + (ptrdiff_t)k * count);
    }
    return status;
}

static Actuator *read_file(const Safetensors *file, const char *path, const Robot *robot,
                           MildError *error) {
    Actuator *actuator = actuator_create(robot, 0, error);
    if (!actuator) {
        return NULL;
    }
    const size_t count = (size_t)actuator->kinds * (size_t)actuator_parameters();
    float *parameters = calloc(count, sizeof *parameters);
    if (!parameters) {
        mild_fail(error, MILD_ERROR_MEMORY, "%.200s: out of memory", path);
        actuator_destroy(actuator);
        return NULL;
    }
    MildStatus status = check_texts(file, path, actuator, &actuator->spacing, error);
    if (status == MILD_OK) {
        status = take_networks(file, path, actuator, parameters, error);
    }
    free(parameters);
    if (status != MILD_OK) {
        actuator_destroy(actuator);
        return NULL;
    }
    return actuator;
}

Actuator *actuator_load(const char *path, const Robot *robot, MildError *error) {
    Safetensors *file = safetensors_read(path, error);
    Actuator *actuator = file ? read_file(file, path, robot, error) : NULL;
    safetensors_destroy(file);
    return actuator;
}
