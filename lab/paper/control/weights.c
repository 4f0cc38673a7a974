#include "paper/control/weights.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "learn/product.h"
#include "learn/safetensors.h"

enum { NAME_SIZE = 64 };

struct Weights {
    Safetensors *file;
    char path[256]; /* for messages */
    float *block;   /* copies of the tensors that were taken */
    size_t used;    /* floats */
    size_t size;    /* floats of all tensors */
    MildError error;
};

static void check_texts(Weights *weights, const char *kind, const char *script, const char *robot) {
    const char *found = safetensors_text(weights->file, "kind"),
               *version = safetensors_text(weights->file, "version"),
               *of = safetensors_text(weights->file, "robot");
    if (!found || strcmp(found, kind) != 0) {
        mild_fail(&weights->error, MILD_ERROR_FORMAT,
                  "%s: holds %.40s, not a %s; give --policy a file of %s", weights->path,
                  found ? found : "weights of no kind", kind, script);
    } else if (!version || strcmp(version, "1") != 0) {
        mild_fail(&weights->error, MILD_ERROR_FORMAT,
                  "%s: has file version %.20s, this program reads version 1", weights->path,
                  version ? version : "none");
    } else if (!of || strcmp(of, robot) != 0) {
        mild_fail(&weights->error, MILD_ERROR_FORMAT,
                  "%s: this %s is for robot %.60s, not for %s; give another --policy",
                  weights->path, kind, of ? of : "of no name", robot);
    }
}

Weights *weights_read(const char *path, const char *kind, const char *script, const char *robot,
                      MildError *error) {
    Safetensors *file = safetensors_read(path, error);
    if (!file) {
        return NULL;
    }
    Weights *weights = calloc(1, sizeof *weights);
    for (int i = 0; weights && i < safetensors_count(file); i++) {
        weights->size += safetensors_at(file, i)->bytes / sizeof(float);
    }
    if (weights) {
        weights->block = malloc((weights->size + 1) * sizeof *weights->block);
    }
    if (!weights || !weights->block) {
        safetensors_destroy(file);
        free(weights);
        mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", path);
        return NULL;
    }
    weights->file = file;
    snprintf(weights->path, sizeof weights->path, "%s", path);
    check_texts(weights, kind, script, robot);
    if (weights_status(weights, error) != MILD_OK) {
        weights_destroy(weights);
        return NULL;
    }
    return weights;
}

void weights_destroy(Weights *weights) {
    if (weights) {
        safetensors_destroy(weights->file);
        free(weights->block);
        free(weights);
    }
}

int weights_length(const Weights *weights, const char *name, int dimension) {
    const Safetensor *tensor = safetensors_find(weights->file, name);
    return tensor && dimension < tensor->rank && tensor->shape[dimension] < 65536
               ? (int)tensor->shape[dimension]
               : 0;
}

int weights_number(Weights *weights, const char *key) {
    const char *text = safetensors_text(weights->file, key);
    const long number = text ? strtol(text, NULL, 10) : 0;
    if (number >= 1 && number <= 1000) {
        return (int)number;
    }
    if (weights->error.status == MILD_OK) {
        mild_fail(&weights->error, MILD_ERROR_FORMAT,
                  "%s: its metadata key '%s' is %.20s, not a number from 1 to 1000", weights->path,
                  key, text ? text : "missing");
    }
    return 0;
}

/* What is wrong with a tensor; NULL: nothing. */
static const char *fault(const Safetensor *tensor, int rows, int columns) {
    if (!tensor) {
        return "is missing";
    }
    if (tensor->type != SAFETENSORS_F32 || tensor->rank != (columns > 0 ? 2 : 1) ||
        tensor->shape[0] != rows || (columns > 0 && tensor->shape[1] != columns)) {
        return "has another type or shape than its network and this robot need";
    }
    return NULL;
}

const float *weights_take(Weights *weights, const char *name, int rows, int columns) {
    if (weights->error.status != MILD_OK) {
        return NULL;
    }
    const Safetensor *tensor = safetensors_find(weights->file, name);
    const char *why = fault(tensor, rows, columns);
    const size_t count = why ? 0 : tensor->bytes / sizeof(float);
    float *taken = weights->block + weights->used;
    if (!why && weights->used + count > weights->size) {
        why = "is taken twice";
    }
    if (!why) {
        memcpy(taken, tensor->data, tensor->bytes);
    }
    for (size_t i = 0; !why && i < count; i++) {
        why = isfinite(taken[i]) ? NULL : "holds weights that are not finite";
    }
    if (why) {
        mild_fail(&weights->error, MILD_ERROR_FORMAT, "%s: tensor %s %s", weights->path, name, why);
        return NULL;
    }
    weights->used += count;
    return taken;
}

Linear weights_take_linear(Weights *weights, const char *name, int in, int out) {
    char weight[NAME_SIZE], bias[NAME_SIZE];
    snprintf(weight, sizeof weight, "%s.weight", name);
    snprintf(bias, sizeof bias, "%s.bias", name);
    return (Linear){in, out, weights_take(weights, weight, out, in),
                    weights_take(weights, bias, out, 0)};
}

MildStatus weights_status(const Weights *weights, MildError *error) {
    const MildError *found = &weights->error;
    return found->status == MILD_OK ? MILD_OK : mild_fail(error, found->status, "%s", found->text);
}

void linear_apply(const Linear *linear, int rows, const float *x, float *y) {
    const int in = linear->in, out = linear->out;
    for (int r = 0; r < rows; r++) {
        memcpy(y + (long)r * out, linear->bias, (size_t)out * sizeof *y);
    }
    product('N', 'T', rows, out, in, x, in, linear->weight, in, 1, y, out);
}
